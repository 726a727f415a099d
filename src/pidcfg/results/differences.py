"""Two configurations compared by meaning: the result of `pidcfg.diff`, and its JSON."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.pipeline import ConvertError
from pidcfg.diagnostics import Diagnostic, Severity
from pidcfg.differences.meaning import compare
from pidcfg.differences.result import RISKS, Compared
from pidcfg.differences.side import Side, side_of
from pidcfg.document import Document, Node
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.words import DecodeError
from pidcfg.listings import decode_listing, read_listing
from pidcfg.reader import SUFFIXES
from pidcfg.results.arguments import ArgumentError
from pidcfg.results.findings import Data, errors_in, findings_data
from pidcfg.results.verification import verified_data
from pidcfg.results.words import unreadable

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.limits import Limits
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor
    from pidcfg.verification.verdict import Verified

Configuration = tuple[Any, "Vendor"]
"""A typed configuration and its vendor."""
Entry = tuple[bytes, str]
"""The bytes of a memory listing, and its name."""


@dataclass(frozen=True, slots=True)
class DiffResult:
    """What differs between two configurations, loop by loop, ranked by what can go wrong."""

    before: str
    after: str
    """Names of both sides."""
    findings: tuple[Diagnostic, ...] = ()
    """What keeps a side from being compared; empty: both were."""
    document: Document | None = None
    refused: str = ""
    """The side that the findings are of, and its name."""
    loops: tuple[Compared, ...] = ()
    sides: tuple[Side, Side] | None = None
    sources: tuple[Configuration, Configuration] | None = None
    """Configuration and vendor of both sides."""
    verified: tuple[Verified, ...] | None = None
    """Loop by loop the verdict of the battery on both sides; None: that was not asked for."""

    @property
    def ok(self) -> bool:
        """Whether both sides could be compared; they may differ."""
        return self.sides is not None

    @property
    def same(self) -> bool:
        """Whether nothing differs."""
        return self.ok and all(loop.status == "same" for loop in self.loops)

    @property
    def alike(self) -> bool:
        """Whether all loops are on both sides and behave alike there, as far as the battery was asked."""
        loops = self.verified
        return loops is None or (len(loops) == len(self.loops) > 0 and all(loop.passed for loop in loops))

    @property
    def summary(self) -> dict[str, int]:
        """How many differences there are of each risk, and loops of each status."""
        count = Counter(difference.risk for loop in self.loops for difference in loop.differences)
        statuses = Counter(loop.status for loop in self.loops)
        return {risk: count[risk] for risk in RISKS} | {s: statuses[s] for s in ("same", "changed", "added", "removed")}

    def to_json(self) -> Data:
        """What ``pidcfg diff --format json`` prints: the differences, or the errors of the side that is in the way."""
        if not self.ok:
            return findings_data(errors_in(self.findings))
        loops = [
            {
                "loop": loop.loop,
                "status": loop.status,
                "differences": [
                    {"field": d.field, "risk": d.risk, "from": d.before, "to": d.after, "note": d.note}
                    for d in loop.differences
                ],
            }
            for loop in self.loops
        ]
        document = {"version": 1, "from": self.before, "to": self.after, "loops": loops, "summary": self.summary}
        if self.verified is not None:
            document["verify"] = [verified_data(loop) for loop in self.verified]
        return document


class _SideError(Exception):
    """A side that cannot be compared."""

    def __init__(self, name: str, findings: Sequence[Diagnostic], document: Document | None = None) -> None:
        super().__init__(name)
        self.name, self.findings = name, tuple(findings)
        self.document = document or Document(name, "", None, Node(None))


def is_listing(name: str) -> bool:
    """Whether a text of this name is a memory listing; a text without a file's name is a configuration."""
    return not name.startswith("<") and PurePath(name).suffix.lower() not in SUFFIXES


def compared(
    sides: tuple[Checked | Entry, Checked | Entry], names: tuple[str, str], vendor: Vendor | None, limits: Limits
) -> DiffResult:
    """The comparison of two checked configurations or listings.

    A listing is of the vendor that is named, or of the other side's; names and ranges that it does not carry are those
    of the other side.
    """
    try:
        configurations = [
            None if isinstance(side, tuple) else _configuration(side, name)
            for side, name in zip(sides, names, strict=True)
        ]
        other, family = next((source for source in configurations if source is not None), (None, None))
        first, second = (
            _listing(side, vendor or family, other, limits) if isinstance(side, tuple) else _configuration(side, name)
            for side, name in zip(sides, names, strict=True)
        )
        one, two = (_side(name, *source) for name, source in zip(names, (first, second), strict=True))
    except _SideError as error:
        return DiffResult(*names, error.findings, error.document, error.name)
    return DiffResult(*names, loops=tuple(compare(one, two)), sides=(one, two), sources=(first, second))


def _configuration(checked: Checked, name: str) -> Configuration:
    """A configuration whose values all have their words."""
    if checked.vendor is None or checked.encoding is None or not checked.encoding.whole:
        raise _SideError(name, checked.findings, checked.document)
    return checked.config, checked.vendor


def _listing(entry: Entry, vendor: Vendor | None, other: Any, limits: Limits) -> Configuration:
    """A listing's configuration."""
    if vendor is None:
        raise ArgumentError("neither file says the PLC family; name it with `vendor`", "vendor")
    data, name = entry
    try:
        listing = read_listing(data, vendor, limits)
        if other is not None:
            image = vendor.encoder(other).image
            listing.settings, listing.plc = _completed(listing.settings, image.settings), {**image.plc, **listing.plc}
        decoded = decode_listing(listing, vendor, {})
    except ListingError as error:
        cure = f"decode it first: pidcfg decode {name} --vendor {vendor.key}"
        raise _SideError(name, [unreadable(error, name, cure)]) from None
    return vendor.model.model_validate(decoded.data), vendor


def _completed(settings: Sequence[Mapping[str, Any]], other: Sequence[Mapping[str, Any]]) -> Any:
    """Settings of a listing with what only the other side says of the loop with the same name."""
    if not settings:
        return other
    by_name = {entry.get("loop"): entry for entry in other}
    return tuple(_merged(by_name.get(entry.get("loop"), {}), entry) for entry in settings)


def _merged(under: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    merged = {**under, **over}
    for key in under.keys() & over.keys():
        if isinstance(under[key], dict) and isinstance(over[key], dict):
            merged[key] = _merged(under[key], over[key])
    return merged


def _side(name: str, config: Any, vendor: Vendor) -> Side:
    try:
        return side_of(config, vendor)
    except DecodeError as error:
        cure = "correct what `pidcfg validate` says of it"
        message = f"its words cannot be read back: {error}"
        raise _SideError(name, [Diagnostic("PID041", Severity.ERROR, message, name, help=cure)]) from None
    except ConvertError as error:
        rows = [Diagnostic("PID042", Severity.ERROR, row.message, name, path=row.path) for row in error.missing]
        raise _SideError(name, rows) from None
