"""The public calls: what the commands do, from Python in one call each."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from pidcfg.output.arguments import ArgumentError, check_arguments, check_minimum, refuse_unknown, vendor_named
from pidcfg.text.reader import DEFAULT, Files, Limits, data_of, read_file, reader_of, source_data
from pidcfg.vendors import VENDORS, format_names

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from pidcfg.encoders.image import Decoded
    from pidcfg.output.conversion import ConvertResult
    from pidcfg.output.differences import DiffResult
    from pidcfg.output.drawing import PictureFormat, PlotResult, Result
    from pidcfg.output.explanation import ExplainResult
    from pidcfg.output.findings import CheckResult, FixResult, LoadResult
    from pidcfg.output.gains import TuneResult
    from pidcfg.output.handles import ChangeResult, GainsResult
    from pidcfg.output.process import GainsFile
    from pidcfg.output.reporting import ReportResult
    from pidcfg.output.runs import CertifyResult, SimulateResult
    from pidcfg.output.words import DecodeResult, EncodeResult
    from pidcfg.sim.engine.choice import EngineName
    from pidcfg.sim.engine.run import Sink
    from pidcfg.tuning import Form
    from pidcfg.tuning.rules import Model
    from pidcfg.validate.engine import Checked, Source

# --- The public calls that return models and images themselves, for programs that work with them ----------------------


def check_text(text: str | bytes, file: str = "<text>") -> Checked:
    """A configuration as text: its findings, and when it is sound its model and its ``encoding.image``.

    Nothing is raised for what is wrong with the text; it is in ``findings``.
    """
    from pidcfg.validate.engine import check_source

    return check_source(data_of(text), file, None, DEFAULT)


def check_file(path: str | Path) -> Checked:
    """A configuration file. Raises `OSError` when it cannot be read."""
    return check_text(read_file(path), Path(path).as_posix())


def decode_words(vendor: str, words: Mapping[int, int], **options: object) -> Decoded:
    """Words by address back to a configuration as plain data; options as in ``pidcfg decode``.

    Raises `KeyError` for a vendor that is not known and `DecodeError` for words that are missing or impossible.
    """
    from pidcfg.encoders.contract import encoder_of

    decoded: Decoded = encoder_of(VENDORS[vendor]).decode(words, options=options)
    return decoded


# --- The public calls that need no configuration: what a rule gives, and what a word means ----------------------------


@check_arguments
def tune(
    method: str,
    form: Form | None = None,
    *,
    gain: float | None = None,
    time_constant: float | None = None,
    second_time_constant: float | None = None,
    dead_time: float | None = None,
    model: Model | None = None,
    transfer: str | None = None,
    closed_loop: float | None = None,
    sample_time: float | None = None,
    ultimate_gain: float | None = None,
    ultimate_period: float | None = None,
    vary: str | None = None,
    ms: float | None = None,
    samples: int = 0,
    record: Path | str | bytes | None = None,
    columns: str | None = None,
    rest: float | None = None,
    start: str | None = None,
    until: str | None = None,
    vendor: str | None = None,
    pv_range: tuple[float, float] | None = None,
    output_range: tuple[float, float] | None = None,
    into: Path | str | bytes | None = None,
    into_name: str | None = None,
    loop: str | None = None,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> TuneResult:
    """Gains by a rule, in output units per PV unit, times in s.

    ``form``: P, PI or PID; without it the most that the rule has. ``gain`` is in PV units per unit of the output,
    negative for cooling; the times are in s. A method needs some of the numbers. ``model``: first-order, second-order
    (with ``second_time_constant``) or integrating (``gain`` is the slope, per s). ``transfer``: a transfer function as
    text in place of these numbers, reduced by the half rule. ``record``: a CSV file of a step test in place of them;
    ``columns`` says where it has which (``time=…,output=…,pv=…``), ``rest`` is the output before it, ``start`` and
    ``until`` take a part of it. ``vendor``: also as this PLC holds them; one whose gain is a share of the span needs
    ``pv_range``; ``output_range`` is 0 to 100 when not given. ``into``: a configuration whose ``loop`` is to have the
    gains (the only one when not given); ``written`` of the result is the file with them, in the loop's own units, form
    and ranges; nothing is saved. ``vary`` and ``ms`` are for robust: what is uncertain (such as
    ``gain=±30%,dead-time=80%..130%``) and the limit of the maximum sensitivity (1.6 when not given), and so many
    ``samples`` of `certify` confirm the gains on the virtual PLC. Raises
    `TuningError`, a `ValueError`, for a record that no process fits, and beyond the range of a rule.
    """
    from pidcfg.output import gains
    from pidcfg.output import process as processes
    from pidcfg.output import process as targets
    from pidcfg.tuning import Form
    from pidcfg.tuning.rules import METHODS, Model

    refuse_unknown("method", method, METHODS)
    if form is not None:
        refuse_unknown("form", form, get_args(Form))
    if model is not None:
        refuse_unknown("model", model, get_args(Model))
    family = None if vendor is None else vendor_named(vendor)
    target = targets.Target(family, pv_range, output_range, _gains_file(into, into_name, loop, files, limits))
    numbers = {
        "gain": gain,
        "time_constant": time_constant,
        "dead_time": dead_time,
        "second_time_constant": second_time_constant,
        "closed_loop": closed_loop,
        "sample_time": sample_time,
        "ultimate_gain": ultimate_gain,
        "ultimate_period": ultimate_period,
    }
    robustness = processes.robustness_of(vary, ms, samples, is_robust=METHODS[method].searches)
    values = {key: processes.check_number(key, value) for key, value in numbers.items() if value is not None}
    request = processes.record_request(columns, rest, start, until, has_record=record is not None)
    step = None if record is None else (*source_data(record, name, files, limits.listing_bytes + 1), request)
    process = processes.check_process(values, model, transfer, has_record=record is not None)
    return gains.tune_gains(method, form, replace(process, robustness=robustness), step, target, limits)


def _gains_file(
    source: Path | str | bytes | None, name: str | None, loop: str | None, files: Files, limits: Limits
) -> GainsFile | None:
    """The configuration that gains are put into; raises `ArgumentError` for a loop without one."""
    if source is None:
        for argument, value in (("into_name", name), ("loop", loop)):
            if value is not None:
                raise ArgumentError(f"`{argument}` is for `into`", argument, "into")
        return None
    from pidcfg.output.process import GainsFile

    return GainsFile(*source_data(source, name, files, limits.listing_bytes + 1), loop, reader_of(files))


@check_arguments
def explain(
    *things: str,
    vendor: str | None = None,
    loop: bool = False,
    blocks: Sequence[str] = (),
    config: Source | None = None,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> ExplainResult:
    """What words, contents, bits, error numbers, registers, rules and decisions mean; without one, what can be asked.

    ``loop``: addresses are of loops that begin where the manual's example does; ``blocks``: where loop registers begin.
    ``config``: a configuration, for the loop and the line that set a register. Raises `QuestionError`, a `ValueError`,
    for an unknown thing.
    """
    from pidcfg.output.explanation import ExplainResult, rule_pages

    family = None if vendor is None else vendor_named(vendor).key
    if config is None and not blocks and (pages := rule_pages(things)):
        return ExplainResult(pages)

    from pidcfg.output.explanation.lookup import explain_things
    from pidcfg.validate.engine import check_source

    checked = None if config is None else check_source(config, name, files, limits)
    return explain_things(things, family, tuple(blocks), checked, loop=loop)


# --- The public calls: what the commands do, from Python in one call each ---------------------------------------------
#
# Every call takes text or files and returns a frozen result with ``findings``, ``ok`` and ``to_json()``. None prints,
# exits, handles signals or changes anything outside of its result. What is wrong with a file is in ``findings``; a
# file that is not there is an `OSError`, a wrong argument a `ValueError` that names it and says what is wanted. All
# of it stands in ``docs/api.md``.

__all__ = [
    "certify",
    "change",
    "check",
    "check_file",
    "check_text",
    "convert",
    "decode",
    "decode_words",
    "diff",
    "encode",
    "explain",
    "fix",
    "gains",
    "load",
    "plot",
    "report",
    "simulate",
    "tune",
]


@check_arguments
def load(source: Source, *, name: str | None = None, files: Files = None, limits: Limits = DEFAULT) -> LoadResult:
    """A configuration or scenario as data, with what is wrong with its text and its keys; no rule looks at it.

    ``name``: what findings call a text. ``files``: other files by their names, and with them nothing is read from disk;
    a `Path` is then one of these names.
    """
    from pidcfg.output.findings import load_document
    from pidcfg.validate.engine import document_of

    return load_document(document_of(source, name, files, limits))


@check_arguments
def check(
    source: Source,
    *,
    name: str | None = None,
    files: Files = None,
    comments: bool = True,
    select: Sequence[str] = (),
    ignore: Sequence[str] = (),
    baseline: Path | str | bytes | None = None,
    limits: Limits = DEFAULT,
) -> CheckResult:
    """All findings of a configuration, or of a scenario and how it fits the configuration that it names.

    ``comments``: whether ``# pidcfg: ignore[CODE] reason`` in the file counts. ``select`` and ``ignore``: beginnings of
    codes, as settings have them. ``baseline``: a file of known findings, whose names begin at its folder, or its text,
    whose names are those of the findings; what it knows stands in ``known``. Raises `ArgumentError` for one that cannot
    be read. Files of settings are the command line's.
    """
    from pidcfg.output.findings import CheckSettings, check_loaded
    from pidcfg.validate.engine import document_of

    doc = document_of(source, name, files, limits)
    settings = CheckSettings(comments, [code.upper() for code in select], [code.upper() for code in ignore])
    if baseline is None:
        return check_loaded(doc, reader_of(files), settings)
    from pidcfg.validate.baseline import BaselineError

    text = source_data(baseline, None, files, limits.listing_bytes + 1)[0].decode("utf-8-sig", "replace")
    folder = baseline.parent.as_posix() if isinstance(baseline, Path) else None
    try:
        return check_loaded(doc, reader_of(files), replace(settings, baseline=text, folder=folder))
    except BaselineError as error:
        raise ArgumentError(f"`baseline`: {error}", "baseline") from None


@check_arguments
def fix(
    source: Source,
    *,
    codes: Sequence[str] = (),
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> FixResult:
    """A file with everything corrected that can be read in one way only, as ``pidcfg validate --fix`` does it.

    Every correction is proven: the new text can be read, differs in the corrected places alone, its finding has gone
    and none has come. ``codes``: only findings of these rules. Nothing is saved.
    """
    from pidcfg.output.findings import FixResult, correct_file
    from pidcfg.validate.engine import document_of

    doc = document_of(source, name, files, limits)
    limit = limits.listing_bytes + 1
    data = source_data(source, name, files, limit)[0] if isinstance(source, Path | str | bytes) else data_of(doc.text)
    fixed = correct_file(data, doc, reader_of(files), lambda d: not codes or d.code in codes)
    return FixResult(doc, fixed.data, fixed.fixed, fixed.remaining)


@check_arguments
def gains(source: Source, *, name: str | None = None, files: Files = None, limits: Limits = DEFAULT) -> GainsResult:
    """Gain, integral and derivative number of each loop as its registers hold them, with what they can hold.

    Of a scenario: those of the configuration that it names, and how robust each loop is with its plant (Ms, gain margin
    and phase margin; times in s).
    """
    from pidcfg.output.handles import gains_of
    from pidcfg.validate.engine import document_of

    return gains_of(document_of(source, name, files, limits), reader_of(files))


@check_arguments
def change(
    source: Source,
    values: Mapping[str, object],
    *,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> ChangeResult:
    """A configuration or scenario with other values; every other byte of it stays. Nothing is saved.

    ``values``: texts or numbers by their dotted paths, ``{"loops.1.tuning.gain": 3.1}``; a key that is not there goes
    behind the last one beside it. A place that the file shares with others, by a template or an anchor, is an
    `ArgumentError`.
    """
    from pidcfg.output.handles import change_document
    from pidcfg.validate.engine import document_of

    return change_document(document_of(source, name, files, limits), values)


@check_arguments
def encode(
    source: Source,
    format: str = "text",
    *,
    into: Path | str | bytes | None = None,
    into_name: str | None = None,
    changed_from: Path | str | bytes | None = None,
    changed_from_name: str | None = None,
    live: bool = False,
    allow_errors: bool = False,
    map: Path | str | bytes | None = None,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> EncodeResult:
    """The PLC's memory for a configuration: every word with its address, and its texts in one of the vendor's formats.

    ``into``: a file that the format adds to. ``changed_from``: a listing, or a configuration by its ending ``.yaml``;
    only words that differ from it are written, ``live``: also those that run. ``allow_errors``: although rules find
    errors, as long as every value has its word. ``map``: a Modbus map, not that of ``plc.map``. Raises
    `UnwritableError` and `UnusableMapError`, both `ValueError`.
    """
    from pidcfg.output.words import MODBUS, EncodeOptions, encode_checked
    from pidcfg.validate.engine import check_source

    refuse_unknown("format", format, format_names())
    checked, max_bytes = check_source(source, name, files, limits), limits.listing_bytes + 1
    added_to = None if into is None else source_data(into, into_name, files, max_bytes)
    baseline = None if changed_from is None else source_data(changed_from, changed_from_name, files, max_bytes)
    plc_map = None
    if map is not None or format == MODBUS:
        from pidcfg.validate.map_files import map_of_source

        plc_map = map_of_source(map, checked.document, files, limits)
    return encode_checked(checked, format, EncodeOptions(added_to, baseline, live, allow_errors, plc_map))


@check_arguments
def decode(
    source: Path | str | bytes | Sequence[Path | str | bytes],
    vendor: str,
    *,
    format: str | None = None,
    like: Source | None = None,
    annotate: bool = False,
    pou: str | None = None,
    options: Mapping[str, object] | None = None,
    name: str | Sequence[str] | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> DecodeResult:
    """A memory listing back to a configuration; several files of one image as a list, ``name`` then being one too.

    ``format``: where the listing does not tell. ``like``: a configuration that gives names, ranges and units.
    ``annotate``: the listing with a meaning beside every word instead. ``pou``: the program of a project with several.
    ``options``: the vendor's of ``pidcfg decode``.
    """
    from pidcfg.encoders.contract import formats_of
    from pidcfg.output.arguments import files_of
    from pidcfg.output.words import DecodeOptions, decode_files
    from pidcfg.validate.engine import check_source

    family = vendor_named(vendor)
    if format is not None:
        refuse_unknown("format", format, formats_of(family).FORMATS)
    entries = files_of(source, name, files, limits)
    like_config = None if like is None else check_source(like, None, files, limits)
    return decode_files(entries, family, DecodeOptions(format, like_config, annotate, pou=pou), options or {}, limits)


@check_arguments
def convert(
    source: Source,
    to: str,
    *,
    verify: bool = False,
    jobs: int = 1,
    max_loss: str | None = None,
    options: Mapping[str, object] | None = None,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
    progress: Callable[[float], None] | None = None,
) -> ConvertResult:
    """Another vendor's configuration, and what became of every field: exact, rounded, clamped, dropped or assumed.

    ``verify``: run both sides through the same battery on the same plants, in up to ``jobs`` processes; ``progress`` is
    called with the share that is done. ``max_loss``: how far values may be rounded without being a loss, such as
    ``gain=2%,time=5%``. ``options``: where things go that the source does not say, as the target's options of
    ``pidcfg convert``, such as ``loop_table``.
    """
    from pidcfg.output.conversion import convert_checked, max_loss_of, verify_sides
    from pidcfg.validate.engine import check_source

    target = vendor_named(to, "to")
    check_minimum(1, jobs=jobs)
    checked = check_source(source, name, files, limits)
    compare = (lambda one, two, report: verify_sides(one, two, report, progress, jobs)) if verify else None
    return convert_checked(checked, target, options or {}, compare, max_loss_of(max_loss))


@check_arguments
def diff(
    before: Source,
    after: Source,
    *,
    vendor: str | None = None,
    like: Source | None = None,
    live: bool = False,
    verify: bool = False,
    jobs: int = 1,
    names: tuple[str | None, str | None] = (None, None),
    files: Files = None,
    limits: Limits = DEFAULT,
    progress: Callable[[float], None] | None = None,
) -> DiffResult:
    """Two configurations or memory listings: key by key within one vendor, by meaning between two.

    A side whose name ends in .yaml or .yml, or that has no name, is a configuration, another one a listing. ``vendor``:
    the PLC family of a listing, where the other side does not tell. ``like``: a configuration that gives listings their
    names, ranges and units; else it is the other side. ``live``: also words that the PLC or the process writes.
    ``verify``: run both sides through the same battery, in up to ``jobs`` processes; ``progress`` is told the share.
    """
    from pidcfg.output.differences import DiffOptions, compare_sides, side_of, with_verdict
    from pidcfg.validate.engine import check_source

    check_minimum(1, jobs=jobs)
    family = None if vendor is None else vendor_named(vendor)
    like_config = None if like is None else check_source(like, None, files, limits)
    before_side, after_side = (
        side_of(source, label, files, limits) for source, label in zip((before, after), names, strict=True)
    )
    result = compare_sides(
        (before_side[0], after_side[0]), (before_side[1], after_side[1]), DiffOptions(family, like_config, live), limits
    )
    return with_verdict(result, progress, jobs) if verify and result.ok else result


@check_arguments
def simulate(
    source: Source,
    *,
    engine: EngineName = "auto",
    runs: int | None = None,
    every: int = 1,
    trend: Sink | bool | None = None,
    record: bool = False,
    reference: bool = True,
    against: Path | str | bytes | None = None,
    against_name: str | None = None,
    accept: str | None = None,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
    progress: Callable[[float], None] | None = None,
) -> SimulateResult:
    """Runs a scenario: the encoded configuration that it names against its plants, judged by its expectations.

    A configuration in its place runs with the scenario that `pidcfg init --scenario` writes for it.

    ``trend``: an open text stream for the trend as CSV, a row every ``every`` base steps; True keeps it for
    ``to_frame()`` of the result. ``record``: keep the signals
    of the loops for pictures. ``reference``: run the same plants beside it without control, without which no loop is
    proven to do better than nothing. ``engine``: numba (extra ``fast``) pays for long runs, with the same results;
    ``runs``: how many runs like this one the caller makes in all, where that alone is to choose it, and not what ran
    before. ``progress`` is called with the share that is done. ``against``: an accepted run, in the place of the one
    that the scenario's ``reference`` names; what differs from it fails. ``accept``: what the file will be called that
    this run is accepted as; ``accepted`` of the result is its text, unless the run has failed. Nothing is saved.
    """
    from pidcfg.output.runs import Columns, SimulateResult
    from pidcfg.sim.engine.choice import EngineName
    from pidcfg.sim.engine.run import Settings
    from pidcfg.study.outcome import simulate_document
    from pidcfg.validate.engine import document_of, is_configuration

    refuse_unknown("engine", engine, get_args(EngineName))
    check_minimum(1, every=every, runs=runs)
    if against is not None and accept is not None:
        raise ArgumentError("`against` and `accept` exclude each other", "against", "accept")
    if against is None and against_name is not None:
        raise ArgumentError("`against_name` is for `against`", "against_name", "against")
    accepted_run = None if against is None else source_data(against, against_name, files, limits.listing_bytes + 1)
    columns = Columns() if trend is True else None
    sink = columns if isinstance(trend, bool) else trend
    settings = Settings(engine, every, limits.loop_steps, sink, progress=progress, runs=runs, with_reference=reference)
    doc = document_of(source, name, files, limits)
    if is_configuration(doc):
        from pidcfg.study.draft import simulate_draft

        outcome = simulate_draft(doc, settings, record=record, reference_file=accepted_run, accept_as=accept)
    else:
        outcome = simulate_document(
            doc, settings, reader_of(files), record=record, reference_file=accepted_run, accept_as=accept
        )
    return SimulateResult(outcome, columns)


@check_arguments
def certify(
    source: Source,
    *,
    samples: int = 2000,
    seed: int | None = None,
    jobs: int = 1,
    cluster: str | None = None,
    keep_worst: int = 3,
    record: bool = False,
    state: bytes | None = None,
    keep: Callable[[bytes], None] | None = None,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
    progress: Callable[[float], None] | None = None,
    remark: Callable[[str], None] | None = None,
) -> CertifyResult:
    """Runs samples of a scenario, in which what its ``vary`` names is drawn anew, and bounds how often it passes.

    ``seed``: of the row of samples; not given: the scenario's. ``jobs``: processes, with the same results however many
    (a script that starts some needs ``if __name__ == "__main__"``). ``cluster``: the address of a Dask scheduler, as in
    ``tcp://127.0.0.1:8786``, or ``local:2``; its workers take the place of the processes, and ``remark`` is called with
    why one of them is left out; where nobody is left, a `WorkersError` says why. ``keep_worst``: how many samples the
    result has as scenarios. ``record``: how the signals spread, for a picture. ``keep`` is called with a state now and
    then, and ``state`` continues there; one of another batch is an `ArgumentError`. ``progress``: the share done.
    """
    from pidcfg.output.runs import CertifyResult
    from pidcfg.study.certification.certify import CertifyOptions, certify_document
    from pidcfg.study.certification.cluster import is_address
    from pidcfg.study.certification.tally import MAX_WORST_SAMPLES, StateError
    from pidcfg.validate.engine import document_of

    check_minimum(1, samples=samples, jobs=jobs)
    check_minimum(0, keep_worst=keep_worst)
    if keep_worst > MAX_WORST_SAMPLES:
        raise ArgumentError(f"`keep_worst` is {keep_worst}; at most {MAX_WORST_SAMPLES} are kept", "keep_worst")
    doc = document_of(source, name, files, limits)
    if cluster is not None and not is_address(cluster):
        advice = "write the address of a scheduler, as in tcp://127.0.0.1:8786, or local:2 for two workers here"
        raise ArgumentError(f"`cluster` is {cluster!r}; {advice}", "cluster")
    plan = CertifyOptions(samples, seed, jobs, cluster, keep_worst, record, state, keep, progress, remark)
    try:
        return CertifyResult(certify_document(doc, plan, reader_of(files)))
    except StateError as error:
        raise ArgumentError(f"`state` cannot be continued: {error}; begin anew without it", "state") from None


@check_arguments
def plot(
    result: Result,
    format: PictureFormat = "svg",
    *,
    loops: Sequence[str] = (),
    title: str | None = None,
) -> PlotResult:
    """The picture of a result: ``data`` of what it returns is what a file of it holds. Nothing is saved.

    ``result``: of `simulate` or `certify` with ``record=True``, of `diff` or `convert` with ``verify=True``.
    ``format``: png needs the extra ``png``, svg and html need nothing, and html can be zoomed. ``loops``: only these.
    """
    from pidcfg.output.drawing import PictureFormat, draw_result

    refuse_unknown("format", format, get_args(PictureFormat))
    return draw_result(result, format, loops, title)


@check_arguments
def report(
    *sources: Source,
    title: str = "Commissioning report",
    project: str | None = None,
    customer: str | None = None,
    plant: str | None = None,
    document: str | None = None,
    revision: str | None = None,
    author: str | None = None,
    date: str | None = None,
    pictures: bool = True,
    files: Files = None,
    limits: Limits = DEFAULT,
    progress: Callable[[float], None] | None = None,
) -> ReportResult:
    """The commissioning report on scenarios, which are run, and configurations.

    A scenario brings its configuration along. ``page()`` of the result is the HTML page, ``sheet()`` the page for the
    cabinet's door (both need the extra ``report``), ``tables`` the tables as CSV. ``pictures``: with trends. The other
    texts are those of the title block. Nothing is saved.
    """
    from pidcfg.about import VERSION
    from pidcfg.output.report import Title
    from pidcfg.output.reporting import report_sources
    from pidcfg.validate.engine import document_of

    title_block = Title(title, project, customer, plant, document, revision, author, date, VERSION)
    documents = [document_of(source, None, files, limits) for source in sources]
    if not documents:
        raise ArgumentError("`sources` is empty; give a scenario or a configuration", "sources")
    return report_sources(documents, reader_of(files), title_block, progress, pictures=pictures, on_disk=files is None)
