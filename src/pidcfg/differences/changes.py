"""The part of an image that differs from a listing: what is to be written into a PLC that holds the listing's words."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.differences.parameter_terms import owner_of
from pidcfg.differences.reading import Reading
from pidcfg.differences.terms import Subject
from pidcfg.differences.terms_of import terms_of
from pidcfg.differences.wired import content_of
from pidcfg.encoders.listing import few
from pidcfg.encoders.parameters import Program
from pidcfg.paths import is_given, steps
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.differences.terms import Item
    from pidcfg.encoders.listing import Listing

D347 = Decision(
    347,
    "what is written in part leaves alone what runs",
    "`encode --changed-from` writes the words that differ. Those that the PLC or the process writes (D345) and of "
    "which the file says nothing are left out, but for `--live`; a set point that differs is written, and named.",
    "A listing of a running PLC differs in its bias and output; writing 0 there is a bump of the valve.",
)


class Changes(NamedTuple):
    """An image of the words that differ, and what is to be told of them."""

    image: Any
    notes: tuple[str, ...]


def changes_from(subject: Subject, listing: Listing, *, live: bool) -> Changes:
    """What a PLC lacks that holds the words of a listing; ``live``: also words that the PLC or the process writes."""
    image = subject.encoding.image
    written, left, operated = set[Any](), list[str](), list[str]()
    given = {item.name: item for item in (*getattr(subject.config, "blocks", ()), *subject.config.loops)}
    for owner, item, number in _differing(subject, listing):
        told = [f"{owner} {item.key}".lstrip()] if number in listing.words else []
        is_said = owner in given and is_given(given[owner], steps(item.key))
        if item.kind in {"live", "reserved"} and not (live or is_said):
            left += told
        else:
            written.add(number)
            operated += told if item.kind in {"live", "operated"} else []
    cells = tuple(cell for cell in image.cells if cell.number in written)
    notes = [f"written, although it may be set while the PLC runs: {few(operated)}"] if operated else []
    notes += [f"left out, since the PLC or the process writes it: {few(left)} (--live)"] if left else []
    held = {cell.number for cell in image.cells}
    rest = [listing.shown[number] for number in listing.words if number not in held]
    notes += [f"stays as it is, since no loop has it any more: {few(rest)}"] if rest and not listing.mixed else []
    return Changes(replace(image, cells=cells), tuple(notes))


def _differing(subject: Subject, listing: Listing) -> Iterator[tuple[str, Item, Any]]:
    """Every register or parameter whose content differs: its owner, what it is, and its number."""
    owners = terms_of(subject).owners
    if isinstance(subject.encoding.image, Program):
        items = {owner.name: owner.items for owner in owners}
        for cell in subject.encoding.image.cells:
            if cell.address not in listing.words or content_of(listing.words[cell.address]) != content_of(cell.raw):
                owner = owner_of(cell.address, items)
                yield owner, items[owner][cell.field], cell.number
        return
    held = Subject(*subject[:3], Reading(listing, subject.config, subject.encoding, {}))
    for new, old in zip(owners, terms_of(held).owners, strict=True):
        for key, item in new.items.items():
            other = old.items.get(key)
            if item.address and (other is None or not other.known or other.content != item.content):
                yield new.name, item, subject.encoding.space.parse(item.address.partition(".")[0])
