"""The two sides of a comparison: configurations, and listings that are read when it is known what they are like."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.differences.reading import reading_of
from pidcfg.differences.terms import Subject
from pidcfg.document import Document, Node
from pidcfg.encoders.listing import ListingError
from pidcfg.listings import read_listing
from pidcfg.results.arguments import ArgumentError
from pidcfg.results.words import unreadable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.limits import Limits
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor

Entry = tuple[bytes, str]
"""The bytes of a memory listing, and its name."""


OPTION = "--"
"""What stands in the message of a listing that an option of `decode` would complete."""
LIKE = "name a configuration to read it like (--like FILE)"


@dataclass(frozen=True, slots=True)
class DiffOptions:
    """How two sides are compared: the family of listings, what they are read like, whether live words count."""

    vendor: Vendor | None = None
    like: Checked | None = None
    live: bool = False


class SideError(Exception):
    """A side that cannot be compared."""

    def __init__(self, name: str, findings: Sequence[Diagnostic], document: Document | None = None) -> None:
        super().__init__(name)
        self.name, self.findings = name, tuple(findings)
        self.document = document or Document(name, "", None, Node(None))


def subjects_of(
    sides: tuple[Checked | Entry, Checked | Entry], names: tuple[str, str], options: DiffOptions, limits: Limits
) -> tuple[Subject, Subject]:
    """Both sides; listings are read when it is known what they are like."""
    known: list[Subject | None] = [
        None if isinstance(side, tuple) else _configuration(side, name) for side, name in zip(sides, names, strict=True)
    ]
    like = None if options.like is None else _configuration(options.like, options.like.document.file)
    like = like or next((subject for subject in known if subject is not None), None)
    vendor = options.vendor or (None if like is None else like.vendor)
    if options.like is not None and like is not None and like.vendor is not vendor:
        raise ArgumentError(f"`like` is a file of {like.vendor.title}, not of `vendor`", "like", "vendor")
    for i in _order(sides, vendor, like, limits):
        side = sides[i]
        if isinstance(side, tuple):
            known[i] = _listing(side, vendor, like, limits)
            like = like or known[i]
    one, two = known
    if one is None or two is None:
        raise AssertionError("both sides are read")
    return one, two


def _order(
    sides: tuple[Checked | Entry, Checked | Entry], vendor: Vendor | None, like: Subject | None, limits: Limits
) -> list[int]:
    """Which side is read first: of two listings the one that says names, and gives a configuration by itself."""
    order = sorted((0, 1), key=lambda i: _says_names(sides[i], vendor, limits), reverse=True)
    first = sides[order[0]]
    if like is None and isinstance(first, tuple):
        try:
            _listing(first, vendor, None, limits)
        except SideError:
            order.reverse()
    return order


def _says_names(side: Checked | Entry, vendor: Vendor | None, limits: Limits) -> bool:
    """Whether a listing says names of loops, so that it is read before one that does not."""
    try:
        return isinstance(side, tuple) and vendor is not None and bool(read_listing(side[0], vendor, limits).settings)
    except ListingError:
        return False


def _configuration(checked: Checked, name: str) -> Subject:
    """A configuration whose values all have their words."""
    if checked.vendor is None or checked.encoding is None or not checked.encoding.whole:
        raise SideError(name, checked.findings, checked.document)
    return Subject(checked.vendor, checked.config, checked.encoding)


def _listing(entry: Entry, vendor: Vendor | None, like: Subject | None, limits: Limits) -> Subject:
    """A listing as far as it can be read."""
    if vendor is None:
        raise ArgumentError("neither file says the PLC family; name it with `vendor`", "vendor")
    data, name = entry
    other = (like.config, like.encoding) if like is not None and like.vendor is vendor else None
    cure = None
    try:
        listing = read_listing(data, vendor, limits)
        cure = f"{LIKE}, or decode it with what it lacks: pidcfg decode {name} --vendor {vendor.key} --help"
        reading = reading_of(listing, vendor, other)
    except ListingError as error:
        raise SideError(name, [unreadable(error, name, cure if OPTION in str(error) else cure and LIKE)]) from None
    return Subject(vendor, reading.config, reading.encoding, reading)
