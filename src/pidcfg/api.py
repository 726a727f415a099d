"""The public calls: what the commands do, from Python in one call each.

Every call takes text or files and returns a frozen result with ``findings``, ``ok`` and ``to_json()``. None prints,
exits, handles signals or changes anything outside of its result. What is wrong with a file is in ``findings``; a file
that is not there is an `OSError`, a wrong argument a `ValueError` that names the choices. ``docs/api.md`` has it all.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, get_args

from pidcfg.limits import DEFAULT, Limits
from pidcfg.reader import Files, reader_of, source_data
from pidcfg.results.arguments import ArgumentError, refuse_unknown, vendor_named
from pidcfg.results.exact import exact
from pidcfg.results.models import check_file, check_text, decode_words
from pidcfg.vendors import format_names

__all__ = [
    "check",
    "check_file",
    "check_text",
    "convert",
    "decode",
    "decode_words",
    "diff",
    "encode",
    "explain",
    "load",
    "simulate",
    "tune",
]

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from pidcfg.results.conversion import ConvertResult
    from pidcfg.results.differences import DiffResult
    from pidcfg.results.explanations import ExplainResult
    from pidcfg.results.findings import CheckResult, LoadResult
    from pidcfg.results.gains import TuneResult
    from pidcfg.results.runs import SimulateResult
    from pidcfg.results.sources import Source
    from pidcfg.results.words import DecodeResult, EncodeResult
    from pidcfg.sim.engine import EngineName
    from pidcfg.sim.trace import Sink
    from pidcfg.tuning.rules import Form


@exact
def load(source: Source, *, name: str | None = None, files: Files = None, limits: Limits = DEFAULT) -> LoadResult:
    """A configuration or scenario as data, with what is wrong with its text and its keys; no rule looks at it.

    ``name``: what findings call a text. ``files``: other files by their names, and with them nothing is read from disk;
    a `Path` is then one of these names.
    """
    from pidcfg.results.findings import loaded
    from pidcfg.results.sources import document_of

    return loaded(document_of(source, name, files, limits))


@exact
def check(
    source: Source,
    *,
    name: str | None = None,
    files: Files = None,
    comments: bool = True,
    limits: Limits = DEFAULT,
) -> CheckResult:
    """All findings of a configuration, or of a scenario and how it fits the configuration that it names.

    ``comments``: whether ``# pidcfg: ignore[CODE] reason`` in the file counts. Settings and baselines are the command
    line's.
    """
    from pidcfg.results.findings import checked
    from pidcfg.results.sources import document_of

    return checked(document_of(source, name, files, limits), limits, reader_of(files), comments=comments)


@exact
def encode(
    source: Source,
    format: str = "text",  # noqa: A002 - what the option is called
    *,
    into: Path | str | bytes | None = None,
    into_name: str | None = None,
    allow_errors: bool = False,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> EncodeResult:
    """The PLC's memory for a configuration: every word with its address, and its texts in one of the vendor's formats.

    ``into``: a file that the format adds to, such as a tag list. ``allow_errors``: although rules find errors, as long
    as every value has its word. Raises `pidcfg.encoders.files.UnwritableError` (a `ValueError`) for what the format
    cannot hold, although the PLC can.
    """
    from pidcfg.results.sources import checked_of
    from pidcfg.results.words import encoded

    refuse_unknown("format", format, format_names())
    checked = checked_of(source, name, files, limits)
    added_to = None if into is None else source_data(into, into_name, files, limits.file_bytes + 1)
    return encoded(checked, format, added_to, limits, errors=allow_errors)


@exact
def decode(
    source: Path | str | bytes | Sequence[Path | str | bytes],
    vendor: str,
    *,
    format: str | None = None,  # noqa: A002 - as in `encode`
    annotate: bool = False,
    options: Mapping[str, object] | None = None,
    name: str | Sequence[str] | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> DecodeResult:
    """A memory listing back to a configuration; several files of one image as a list, ``name`` then being one too.

    ``format``: of the listing, where it does not tell by itself. ``annotate``: the listing with a meaning beside every
    word instead. ``options``: what a listing may lack, as the vendor's options of ``pidcfg decode``: ``loop_table``,
    ``number_of_loops`` and so on.
    """
    from pidcfg.results.words import decoded

    family = vendor_named(vendor)
    if format is not None:
        refuse_unknown("format", format, family.load("formats"))
    sources = source if isinstance(source, Sequence) and not isinstance(source, str | bytes) else [source]
    names = [name] * len(sources) if name is None or isinstance(name, str) else list(name)
    if not sources or len(names) != len(sources):
        raise ArgumentError("`source` and `name` are lists of the same length, and not empty", "source", "name")
    most = limits.file_bytes + 1
    entries = [source_data(one, label, files, most) for one, label in zip(sources, names, strict=True)]
    return decoded(entries, family, format, options or {}, limits, annotate=annotate)


@exact
def convert(
    source: Source,
    to: str,
    *,
    verify: bool = False,
    max_loss: str | None = None,
    options: Mapping[str, object] | None = None,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
    progress: Callable[[float], None] | None = None,
) -> ConvertResult:
    """Another vendor's configuration, and what became of every field: exact, rounded, clamped, dropped or assumed.

    ``verify``: run both sides through the same battery on the same plants; ``progress`` is called with the share that
    is done. ``max_loss``: how
    far values may be rounded without being a loss, such as ``gain=2%,time=5%``. ``options``: where things go that the
    source does not say, as the target's options of ``pidcfg convert``, such as ``loop_table``.
    """
    from pidcfg.results.conversion import both_sides, converted, max_loss_of
    from pidcfg.results.sources import checked_of

    target = vendor_named(to, "to")
    checked = checked_of(source, name, files, limits)
    compare = (lambda one, two, report: both_sides(one, two, report, progress)) if verify else None
    return converted(checked, target, options or {}, limits, compare, max_loss_of(max_loss))


@exact
def diff(
    before: Source,
    after: Source,
    *,
    vendor: str | None = None,
    names: tuple[str | None, str | None] = (None, None),
    files: Files = None,
    limits: Limits = DEFAULT,
) -> DiffResult:
    """Two configurations, or a configuration and a memory listing, compared by meaning in engineering units.

    A side whose name ends in .yaml or .yml, or that has no name, is a configuration, another one a listing. ``vendor``:
    the PLC family of a listing, where the other side does not tell.
    """
    from pidcfg.results.differences import compared
    from pidcfg.results.sources import side_of

    family = None if vendor is None else vendor_named(vendor)
    one, two = (side_of(source, label, files, limits) for source, label in zip((before, after), names, strict=True))
    return compared((one[0], two[0]), (one[1], two[1]), family, limits)


@exact
def simulate(
    source: Source,
    *,
    engine: EngineName = "auto",
    every: int = 1,
    trend: Sink | None = None,
    record: bool = False,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
    progress: Callable[[float], None] | None = None,
) -> SimulateResult:
    """Runs a scenario: the encoded configuration that it names against its plants, judged by its expectations.

    ``trend``: an open text stream for the trend as CSV, a row every ``every`` base steps. ``record``: keep the signals
    of the loops for pictures. ``engine``: numba (extra ``fast``) pays for long runs, with the same results.
    ``progress`` is called with the share that is done.
    """
    from pidcfg.results.runs import SimulateResult
    from pidcfg.results.sources import document_of
    from pidcfg.scenario.outcome import simulate_document
    from pidcfg.sim.engine import EngineName
    from pidcfg.sim.run import Settings

    refuse_unknown("engine", engine, get_args(EngineName))
    if every < 1:
        raise ArgumentError(f"`every` is {every}; write a whole number above 0", "every")
    settings = Settings(engine, every, limits.loop_steps, trend, progress=progress)
    doc = document_of(source, name, files, limits)
    return SimulateResult(simulate_document(doc, settings, limits, reader_of(files), record=record))


@exact
def tune(
    method: str,
    form: Form = "PID",
    *,
    gain: float | None = None,
    time_constant: float | None = None,
    dead_time: float | None = None,
    closed_loop: float | None = None,
    sample_time: float | None = None,
    ultimate_gain: float | None = None,
    ultimate_period: float | None = None,
    record: Path | str | bytes | None = None,
    vendor: str | None = None,
    pv_range: tuple[float, float] | None = None,
    output_range: tuple[float, float] = (0, 100),
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> TuneResult:
    """Gains by a rule, in output units per PV unit, times in s.

    ``gain`` is in PV units per unit of the output, negative for cooling; the times are in s. A method needs some of the
    numbers. ``record``: a CSV file of a step test (time, output, PV) in place of the first three. ``vendor``: also as
    this PLC holds them; one whose gain is a share of the span needs ``pv_range``. Raises `ValueError` for a record that
    tells no process, and beyond the range of a rule.
    """
    from pidcfg.results import gains
    from pidcfg.tuning.rules import METHODS, Form

    refuse_unknown("method", method, METHODS)
    refuse_unknown("form", form, get_args(Form))
    target = gains.Target(None if vendor is None else vendor_named(vendor), pv_range, output_range)
    numbers = {
        "gain": gain,
        "time_constant": time_constant,
        "dead_time": dead_time,
        "closed_loop": closed_loop,
        "sample_time": sample_time,
        "ultimate_gain": ultimate_gain,
        "ultimate_period": ultimate_period,
    }
    values = {key: gains.usable(key, value) for key, value in numbers.items() if value is not None}
    step = None if record is None else source_data(record, name, files, limits.file_bytes + 1)
    return gains.tuned(method, form, values, step, target, limits)


@exact
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
    ``config``: a configuration, for the loop and the line that set a register. Raises `ValueError` for what nothing is
    known of.
    """
    from pidcfg.results.explanations import explained
    from pidcfg.results.sources import checked_of

    family = None if vendor is None else vendor_named(vendor).key
    checked = None if config is None else checked_of(config, name, files, limits)
    return explained(things, family, tuple(blocks), checked, loop=loop)
