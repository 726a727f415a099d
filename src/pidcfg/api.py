"""The public calls: what the commands do, from Python in one call each.

Every call takes text or files and returns a frozen result with ``findings``, ``ok`` and ``to_json()``. None prints,
exits, handles signals or changes anything outside of its result. What is wrong with a file is in ``findings``; a file
that is not there is an `OSError`, a wrong argument a `ValueError` that names it and says what is wanted. All of it
stands in ``docs/api.md``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, get_args

from pidcfg.limits import DEFAULT, Limits
from pidcfg.reader import Files, reader_of, source_data
from pidcfg.results.arguments import ArgumentError, refuse_below, refuse_unknown, vendor_named
from pidcfg.results.exact import exact
from pidcfg.results.models import check_file, check_text, decode_words
from pidcfg.results.reference import explain, tune
from pidcfg.vendors import format_names

__all__ = [
    "certify",
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
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from pidcfg.results.certification import CertifyResult
    from pidcfg.results.conversion import ConvertResult
    from pidcfg.results.differences import DiffResult
    from pidcfg.results.findings import CheckResult, LoadResult
    from pidcfg.results.runs import SimulateResult
    from pidcfg.results.sources import Source
    from pidcfg.results.words import DecodeResult, EncodeResult
    from pidcfg.sim.engine import EngineName
    from pidcfg.sim.trace import Sink


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
    changed_from: Path | str | bytes | None = None,
    changed_from_name: str | None = None,
    live: bool = False,
    allow_errors: bool = False,
    map: Path | str | bytes | None = None,  # noqa: A002 - what the option is called
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> EncodeResult:
    """The PLC's memory for a configuration: every word with its address, and its texts in one of the vendor's formats.

    ``into``: a file that the format adds to. ``changed_from``: a listing; only words that differ from it are written,
    ``live``: also those that run. ``allow_errors``: although rules find errors, as long as every value has its word.
    ``map``: a Modbus map, not that of ``plc.map``. Raises `UnwritableError` and `UnusableMapError`, both `ValueError`.
    """
    from pidcfg.results.sources import checked_of, stated_map
    from pidcfg.results.words import MODBUS, EncodeOptions, encoded

    refuse_unknown("format", format, format_names())
    checked, most = checked_of(source, name, files, limits), limits.file_bytes + 1
    added_to = None if into is None else source_data(into, into_name, files, most)
    old = None if changed_from is None else source_data(changed_from, changed_from_name, files, most)
    plc_map = stated_map(map, checked.document, files, limits) if map is not None or format == MODBUS else None
    return encoded(checked, format, EncodeOptions(added_to, old, live, allow_errors, plc_map), limits)


@exact
def decode(
    source: Path | str | bytes | Sequence[Path | str | bytes],
    vendor: str,
    *,
    format: str | None = None,  # noqa: A002 - as in `encode`
    like: Source | None = None,
    annotate: bool = False,
    options: Mapping[str, object] | None = None,
    name: str | Sequence[str] | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> DecodeResult:
    """A memory listing back to a configuration; several files of one image as a list, ``name`` then being one too.

    ``format``: where the listing does not tell. ``like``: a configuration that gives names, ranges and units.
    ``annotate``: the listing with a meaning beside every word instead. ``options``: the vendor's of ``pidcfg decode``.
    """
    from pidcfg.results.sources import checked_of, files_of
    from pidcfg.results.words import DecodeOptions, decoded

    family = vendor_named(vendor)
    if format is not None:
        refuse_unknown("format", format, family.load("formats"))
    entries = files_of(source, name, files, limits)
    other = None if like is None else checked_of(like, None, files, limits)
    return decoded(entries, family, DecodeOptions(format, other, annotate), options or {}, limits)


@exact
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
    from pidcfg.results.conversion import both_sides, converted, max_loss_of
    from pidcfg.results.sources import checked_of

    target = vendor_named(to, "to")
    refuse_below(1, jobs=jobs)
    checked = checked_of(source, name, files, limits)
    compare = (lambda one, two, report: both_sides(one, two, report, progress, jobs)) if verify else None
    return converted(checked, target, options or {}, limits, compare, max_loss_of(max_loss))


@exact
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
    from pidcfg.results.battery import with_verdict
    from pidcfg.results.differences import compared
    from pidcfg.results.sides import DiffOptions
    from pidcfg.results.sources import checked_of, side_of

    refuse_below(1, jobs=jobs)
    family = None if vendor is None else vendor_named(vendor)
    other = None if like is None else checked_of(like, None, files, limits)
    one, two = (side_of(source, label, files, limits) for source, label in zip((before, after), names, strict=True))
    result = compared((one[0], two[0]), (one[1], two[1]), DiffOptions(family, other, live), limits)
    return with_verdict(result, progress, jobs) if verify and result.ok else result


@exact
def simulate(
    source: Source,
    *,
    engine: EngineName = "auto",
    runs: int | None = None,
    every: int = 1,
    trend: Sink | None = None,
    record: bool = False,
    name: str | None = None,
    files: Files = None,
    limits: Limits = DEFAULT,
    progress: Callable[[float], None] | None = None,
) -> SimulateResult:
    """Runs a scenario: the encoded configuration that it names against its plants, judged by its expectations.

    A configuration in its place runs with the scenario that `pidcfg init --scenario` writes for it.

    ``trend``: an open text stream for the trend as CSV, a row every ``every`` base steps. ``record``: keep the signals
    of the loops for pictures. ``engine``: numba (extra ``fast``) pays for long runs, with the same results;
    ``runs``: how many runs like this one the caller makes in all, where that alone is to choose it, and not what ran
    before. ``progress`` is called with the share that is done.
    """
    from pidcfg.results.runs import SimulateResult
    from pidcfg.results.sources import document_of
    from pidcfg.scenario.outcome import simulate_document
    from pidcfg.sim.engine import EngineName
    from pidcfg.sim.run import Settings
    from pidcfg.validate.engine import is_configuration

    refuse_unknown("engine", engine, get_args(EngineName))
    refuse_below(1, every=every, runs=runs)
    settings = Settings(engine, every, limits.loop_steps, trend, progress=progress, runs=runs)
    doc = document_of(source, name, files, limits)
    if is_configuration(doc):
        from pidcfg.draft.write import simulate_draft

        return SimulateResult(simulate_draft(doc, settings, limits, record=record))
    return SimulateResult(simulate_document(doc, settings, limits, reader_of(files), record=record))


@exact
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
    why one of them is left out; where nobody is left, a `RuntimeError` says why. ``keep_worst``: how many samples the
    result has as scenarios. ``record``: how the signals spread, for a picture. ``keep`` is called with a state now and
    then, and ``state`` continues there; one of another batch is an `ArgumentError`. ``progress``: the share done.
    """
    from pidcfg.certification.certify import Plan, certify_document
    from pidcfg.certification.cluster import is_address
    from pidcfg.certification.state import StateError
    from pidcfg.certification.tally import MOST_WORST
    from pidcfg.results.certification import CertifyResult
    from pidcfg.results.sources import document_of

    refuse_below(1, samples=samples, jobs=jobs)
    refuse_below(0, keep_worst=keep_worst)
    if keep_worst > MOST_WORST:
        raise ArgumentError(f"`keep_worst` is {keep_worst}; at most {MOST_WORST} are kept", "keep_worst")
    doc = document_of(source, name, files, limits)
    if cluster is not None and not is_address(cluster):
        wanted = "write the address of a scheduler, as in tcp://127.0.0.1:8786, or local:2 for two workers here"
        raise ArgumentError(f"`cluster` is {cluster!r}; {wanted}", "cluster")
    plan = Plan(samples, seed, jobs, cluster, keep_worst, record, state, keep, progress, remark)
    try:
        return CertifyResult(certify_document(doc, plan, limits, reader_of(files)))
    except StateError as error:
        raise ArgumentError(f"`state` cannot be continued: {error}; begin anew without it", "state") from None
