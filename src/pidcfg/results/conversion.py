"""A configuration of another vendor: the result of `pidcfg.convert`, and its JSON."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import TYPE_CHECKING

from pidcfg.conversion.comments import comments, with_comments
from pidcfg.conversion.pipeline import ConvertError, convert
from pidcfg.conversion.values import shown
from pidcfg.diagnostics import Diagnostic, Severity
from pidcfg.results.arguments import vendor_options
from pidcfg.results.findings import Data, errors_in, findings_data
from pidcfg.source import read_document
from pidcfg.validate.engine import Checked, check_document
from pidcfg.writer import yaml_text

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from pidcfg.conversion.ledger import Change
    from pidcfg.document import Document
    from pidcfg.limits import Limits
    from pidcfg.scenario.verify import Verified
    from pidcfg.vendors import Vendor

LoopChanges = tuple[str, tuple["Change", ...]]
"""A loop's name, and what became of each of its fields."""


@dataclass(frozen=True, slots=True)
class ConvertResult:
    """A configuration for another vendor, what became of every field, and how both sides compare."""

    document: Document
    """The source."""
    findings: tuple[Diagnostic, ...]
    """Of the source; PID042: what it has to say before it can be converted."""
    target: str
    source: str | None = None
    """Keys of both vendors."""
    data: Data | None = None
    """The target's configuration as plain data, with the values that its registers hold; None: there is none."""
    text: str = ""
    """The same as YAML, with the comments of the source."""
    loops: tuple[LoopChanges, ...] = ()
    losses: bool = False
    """Whether anything was dropped or clamped."""
    target_document: Document | None = None
    target_findings: tuple[Diagnostic, ...] = ()
    """What the target's own rules say about the result; with an error, its PLC would not take it."""
    verified: tuple[Verified, ...] | None = None
    """Loop by loop, how far both sides lie apart on the same plants; None: that was not asked for, or not possible."""
    unverified: str = ""
    """Why that was not possible."""

    @property
    def ok(self) -> bool:
        """Whether there is a configuration that the target's PLC takes; it may have lost something."""
        return self.data is not None and not errors_in(self.target_findings)

    @property
    def pv_percent(self) -> float:
        """How far a PV lies apart at most, in % of its range."""
        return max((loop.pv_percent for loop in self.verified or ()), default=0.0)

    def to_json(self) -> Data:
        """What ``pidcfg convert --report json`` prints: the changes; where there is no result, the errors."""
        if self.data is None:
            return findings_data(errors_in(self.findings))
        loops = [{"loop": name, "changes": [_change(change) for change in changes]} for name, changes in self.loops]
        document = {"version": 1, "from": self.source, "to": self.target, "loops": loops}
        if self.verified is not None:
            document["verify"] = [_apart(loop) for loop in self.verified]
        return document


def _change(change: Change) -> Data:
    return {
        "field": change.field,
        "kind": change.kind,
        "from": shown(change.source),
        "to": shown(change.target),
        "error_percent": round(change.error_percent, 6),
        "note": change.note,
    }


def _apart(loop: Verified) -> Data:
    return {
        "loop": loop.loop,
        "pv_percent": round(loop.pv_percent, 6),
        "output_percent": round(loop.output_percent, 6),
        "iae_ratio": None if loop.iae_ratio is None else round(loop.iae_ratio, 6),
    }


def converted(
    checked: Checked,
    target: Vendor,
    options: Mapping[str, object],
    limits: Limits,
    verify: Callable[[Checked, Checked], tuple[Verified, ...]] | None,
) -> ConvertResult:
    """The conversion of a checked configuration; ``verify`` compares both sides where the target takes the result.

    ``options`` are the target's own: where things go that the source does not say.
    """
    nothing = ConvertResult(checked.document, checked.findings, target.key)
    if checked.vendor is None or errors_in(checked.findings):
        return nothing
    placements = vendor_options(target, "convert_options", options)
    try:
        outcome = convert(checked.config, checked.vendor, target, placements)
    except ConvertError as error:
        return replace(nothing, findings=(*checked.findings, *missing(error, checked.document)))
    head, loops = comments(checked.document, len(outcome.loops))
    text = with_comments(yaml_text(outcome.data), head, loops)
    result = check_document(read_document(text.encode(), f"<{target.key}>", limits), limits)
    conversion = replace(
        nothing,
        source=checked.vendor.key,
        data=outcome.data,
        text=text,
        loops=outcome.loops,
        losses=outcome.losses,
        target_document=result.document,
        target_findings=result.findings,
    )
    if verify is None or not conversion.ok:
        return conversion
    return _compared(conversion, checked, result, verify)


def _compared(
    conversion: ConvertResult,
    source: Checked,
    result: Checked,
    verify: Callable[[Checked, Checked], tuple[Verified, ...]],
) -> ConvertResult:
    """The conversion with both sides on the same plants, or with the reason why that cannot be."""
    from pidcfg.sim.run import UnusableError

    try:
        return replace(conversion, verified=verify(source, result))
    except UnusableError as error:
        return replace(conversion, unverified=str(error))


def missing(error: ConvertError, doc: Document) -> list[Diagnostic]:
    """What a source has to say before it can be converted, at the keys where it should."""
    return [
        Diagnostic("PID042", Severity.ERROR, entry.message, doc.file, doc.locate(entry.path, key=True), entry.path)
        for entry in error.missing
    ]


def both_sides(
    source: Checked, result: Checked, progress: Callable[[float], None] | None = None
) -> tuple[Verified, ...]:
    """Source and result on the same plants; charts call them by their files' names and vendors."""
    from pidcfg.scenario.verify import verify

    sides = [
        (side.vendor, side.config, side.encoding.image)
        for side in (source, result)
        if side.vendor is not None and side.encoding is not None
    ]
    before, after = (
        f"{name} ({vendor.key})"
        for name, (vendor, _, _) in zip((PurePath(source.document.file).name, "result"), sides, strict=True)
    )
    return tuple(verify(sides[0], sides[1], (before, after), progress=progress))
