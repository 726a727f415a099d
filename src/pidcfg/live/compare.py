"""A configuration against the PLC that it is for: the result of `pidcfg.compare`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.values import text_of
from pidcfg.diagnostics import Diagnostic, Severity, ordered
from pidcfg.differences.terms import CONFIGURATION
from pidcfg.live.doubts import doubts
from pidcfg.live.pull import listing, read
from pidcfg.paths import steps
from pidcfg.results.differences import DiffResult, compared
from pidcfg.results.findings import errors_in, findings_data
from pidcfg.results.sides import DiffOptions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from pidcfg.differences.result import Compared, Difference
    from pidcfg.document import Document
    from pidcfg.encoders.image import Image
    from pidcfg.encoders.parameters import Program
    from pidcfg.limits import Limits
    from pidcfg.live.link import Patience
    from pidcfg.live.pull import Source
    from pidcfg.results.findings import Data
    from pidcfg.validate.engine import Checked

CODE = "PID065"
"""A setting in which the PLC differs from its file."""
UNREACHED = "PID066"
"""A PLC that is not reached, or does not give what is asked for."""
CURE = "look who changed it: correct the file, or write its value into the PLC"


@dataclass(frozen=True, slots=True)
class CompareResult:
    """What differs between a configuration and the PLC."""

    plc: str
    """The PLC, as ``10.0.0.5:502``."""
    document: Document
    findings: tuple[Diagnostic, ...]
    """A finding for each setting that differs; of a file that cannot be compared, what is wrong with it."""
    diff: DiffResult | None = None
    """The comparison loop by loop, file first; None: the file cannot be compared."""
    notes: tuple[str, ...] = ()
    """What is told and is no difference: set points that the operator has changed, words that are no values."""
    unread: tuple[str, ...] = ()
    """Settings that were not compared, since no register has them, by name."""

    @property
    def ok(self) -> bool:
        """Whether the file could be compared; the PLC may differ from it."""
        return self.diff is not None and self.diff.ok

    @property
    def same(self) -> bool:
        """Whether no setting differs of those that were read."""
        return self.ok and not self.findings

    def to_json(self) -> Data:
        """What ``pidcfg compare --format json`` prints."""
        return findings_data(self.findings if self.ok else errors_in(self.findings))


def compared_with(checked: Checked, source: Source, image: Image | Program, limits: Limits) -> CompareResult:
    """The comparison of a checked configuration with what was read of the PLC."""
    plc, document = str(source.address), checked.document
    diff = compared((checked, (listing(image), plc)), (document.file, plc), DiffOptions(source.vendor), limits)
    if not diff.ok:
        return CompareResult(plc, document, diff.findings, diff)
    findings = [finding for loop in diff.loops for finding in _findings(loop, document, source.register)]
    notes = (*source.left_out, *doubts(image), *_notes(diff))
    return CompareResult(plc, document, tuple(ordered(findings)), diff, notes, source.unread)


def _findings(loop: Compared, document: Document, register: Callable[[str], str]) -> Iterator[Diagnostic]:
    index = next((i for i, name in enumerate(_names(document)) if name in {loop.loop, loop.was}), None)
    if loop.status in {"added", "removed"}:
        said = (
            "the PLC does not have this loop" if loop.status == "removed" else f"the PLC has one more loop, {loop.loop}"
        )
        yield _finding(document, ("loops",) if index is None else ("loops", index), said, loop.loop)
    elif loop.moved is not None:
        said = f"the PLC has the loop at {loop.moved[1]}, the file at {loop.moved[0]}"
        yield _finding(document, ("loops", index) if index is not None else ("loops",), said, loop.loop)
    for d in loop.differences:
        if d.key == CONFIGURATION:
            yield _finding(document, (), f"the PLC's words make no configuration{_why(d)}", "")
            continue
        key = tuple(steps(d.key or d.field))
        path = key if index is None else ("loops", index, *key)
        yield _finding(
            document, path, _message(d, register(d.address or "")), loop.loop if index is not None else "", d.key
        )


def _why(d: Difference) -> str:
    return f": {d.note.removeprefix('no value: ')}" if d.note else ""


def _names(document: Document) -> list[str]:
    loops = (document.data or {}).get("loops") or []
    return [str(loop.get("name")) for loop in loops if isinstance(loop, dict)]


def _finding(document: Document, path: Any, message: str, loop: str, key: str = "") -> Diagnostic:
    span = document.locate(path)
    return Diagnostic(CODE, Severity.ERROR, message, document.file, span, path, loop, help=CURE, key=key)


def _message(d: Difference, register: str) -> str:
    """Both values with their unit, and the register with both contents; by a stated map with its number."""
    unit = f" {d.unit}" if d.unit else ""
    held = f" ({d.address} {d.word_after or '-'}{register and f' at {register}'})" if d.address else ""
    said = f" ({d.word_before})" if d.address and d.word_before else ""
    note = f"; {d.note}" if d.note else ""
    values = f"the PLC holds {_value(d.after, unit)}{held}, the file says {_value(d.before, unit)}{said}"
    return f"{d.key or d.field}: {values}{note}"


def _value(value: Any, unit: str) -> str:
    """A value with its unit; none where the content says that there is none, or is no value, as the note says then."""
    if value is None:
        return "none"
    return f"[{', '.join(map(text_of, value))}]{unit}" if isinstance(value, list) else f"{text_of(value)}{unit}"


def _notes(diff: DiffResult) -> Iterator[str]:
    yield from diff.notes
    for loop in diff.loops:
        for d in loop.operated:
            unit = f" {d.unit}" if d.unit else ""
            held = f" ({d.address} {d.word_after})" if d.address else ""
            values = f"{d.key} is {text_of(d.after)}{unit}{held}, in the file {text_of(d.before)}"
            yield f"{loop.loop}: operated, and no difference: {values}"


def read_and_compared(checked: Checked, source: Source, patience: Patience, limits: Limits) -> CompareResult:
    """Reads the PLC and compares; a file that has no memory is not compared, and nothing is read."""
    if source.image is None:
        return CompareResult(str(source.address), checked.document, tuple(errors_in(checked.findings)))
    return compared_with(checked, source, read(source, patience), limits)


def not_reached(file: str, message: str) -> Diagnostic:
    """A file that could not be compared, as reports have it."""
    return Diagnostic(UNREACHED, Severity.ERROR, message, file)
