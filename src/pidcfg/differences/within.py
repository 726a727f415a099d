"""Two sides of one vendor compared key by key: the file's numbers, their units, and the words with their addresses."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

from pidcfg.differences.matching import moved, pairs_of
from pidcfg.differences.result import Compared, Difference, by_risk
from pidcfg.differences.risk import judged_key
from pidcfg.differences.terms import SIGNALS, Item, Owner
from pidcfg.differences.wired import Wired

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.differences.matching import Pair
    from pidcfg.differences.result import Status
    from pidcfg.differences.terms import Terms

Fate = Literal["same", "missing", "live", "operated", "differs"]
"""What becomes of a key: a listing does not hold it, the PLC or the process writes it, the operator does, …"""
SOURCE = "setpoint.source"
ALARMS, OFF = "alarms.", "the alarm is off on both sides"


@dataclass(slots=True)
class _Rows:
    """What was found of a loop."""

    differs: list[Difference] = field(default_factory=list)
    operated: list[Difference] = field(default_factory=list)
    live: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)


class Comparison:
    """How two sides are compared.

    ``fields``: the neutral fields that a key of a loop becomes, by which it is ranked; ``live``: whether words that the
    PLC or the process writes count against a listing.
    """

    def __init__(
        self, before: Terms, after: Terms, fields: Callable[[str, str], Sequence[str]], *, live: bool = False
    ) -> None:
        self.before, self.after, self.fields, self.live = before, after, fields, live
        self.listings = (before.is_listing, after.is_listing)

    def rows(self) -> list[Compared]:
        """Every loop; blocks, and at the end the rest of the file, only where there is something to tell of them."""
        pairs = pairs_of(self.before.owners, self.after.owners)
        places = {id(two): place for two, place in moved(pairs)}
        names = {one.name: two.name for one, two in pairs if one and two and one.name != two.name}
        rows: list[Compared] = []
        rest: list[Compared] = []
        for one, two in pairs:
            row, kinds = self._row((one, two), names, places), {owner.kind for owner in (one, two) if owner}
            if "loop" in kinds or not _is_silent(row):
                (rest if "file" in kinds else rows).append(row)
        return rows + rest

    def _row(self, pair: Pair, names: Mapping[str, str], places: Mapping[int, tuple[str, str]]) -> Compared:
        one, two = pair
        if SIGNALS in {owner.kind for owner in pair if owner}:
            one, two = one or Owner(SIGNALS, SIGNALS), two or Owner(SIGNALS, SIGNALS)
        if one is None:
            return Compared(two.name if two else "", "added")
        if two is None:
            return Compared(one.name, "removed")
        rows = self._compared(one, two, names)
        place, is_renamed = places.get(id(two)), one.name != two.name
        status: Status = "renamed" if is_renamed else "moved" if place else "changed" if rows.differs else "same"
        return Compared(
            two.name,
            status,
            by_risk(_once(rows.differs)),
            one.name if is_renamed else "",
            place,
            by_risk(rows.operated),
            tuple(rows.live),
            tuple(rows.missing),
        )

    def _compared(self, one: Owner, two: Owner, names: Mapping[str, str]) -> _Rows:
        """The keys of a loop."""
        rows = _Rows()
        for key in _keys(one, two):
            a, b = one.items.get(key), two.items.get(key)
            shown = b or a
            fate = self._fate((one, two), renamed(a, names), b)
            if shown is not None and fate == "missing":
                rows.missing.append(shown.key)
            elif shown is not None and fate == "live":
                rows.live.append(shown.key)
            elif fate != "same":
                difference = self._difference(two.name, a or Item(key), b or Item(key))
                if _is_off(key, one) and _is_off(key, two):
                    difference = replace(difference, risk="low", note=OFF)
                (rows.operated if fate == "operated" else rows.differs).append(difference)
        return rows

    def _fate(self, owners: tuple[Owner, Owner], a: Item | None, b: Item | None) -> Fate:
        """What becomes of a key."""
        items = [item for item in (a, b) if item is not None]
        if any(item.fault for item in items):
            is_same = len(items) == len(owners) and items[0].content == items[1].content
            return "same" if is_same else self._allowed(items)
        if not all(item.known for item in items):
            held = any(item.known and item.kind != "live" and item.content for item in items)
            return "missing" if held else "same"
        if len(items) < len(owners):
            side = 0 if a is None else 1
            fate = self._of_one_side(owners[side], side, items[0])
        else:
            fate = "same" if items[0].content == items[1].content else "differs"
        return self._allowed(items) if fate == "differs" else fate

    def _of_one_side(self, owner: Owner, side: int, item: Item) -> Fate:
        """What becomes of a key that ``owner``, the loop of one side, lacks."""
        if item.default or (item.optional and item.value is None):
            return "same"
        if not self.listings[side]:
            return "same" if item.optional and any(self.listings) else "differs"
        if item.file_only or not (item.address or owner.is_described):
            return "same"
        held = (self.before, self.after)[side].holds
        return "missing" if item.optional and not held(item.address) else "differs"

    def _allowed(self, items: Sequence[Item]) -> Fate:
        """What becomes of a key that differs: against a listing much does that nobody has edited."""
        kinds = {item.kind for item in items}
        if "reserved" in kinds:
            return "differs" if all(self.listings) else "same"
        if self.live or not any(self.listings):
            return "differs"
        if "live" in kinds or ("operated" in kinds and len(items) == 1):
            return "live"
        is_value = not any(item.fault for item in items)
        return "operated" if is_value and "operated" in kinds else "differs"

    def _difference(self, loop: str, one: Item, two: Item) -> Difference:
        key = two.key if two.address or not one.address else one.key
        unit, before, after = _in_one_unit(one, two)
        neutral, risk, note = judged_key(key, self.fields(loop, key), before, after)
        by, kinds = one.by or two.by, {one.kind, two.kind}
        if fault := one.fault or two.fault:
            note = f"no value: {fault.rpartition(': ')[2]}"
        elif by and any(self.listings) and (self.live or "operated" not in kinds):
            written = f"written by {by}" if kinds & {"live", "operated"} else f"written by {by}, too"
            note = "; ".join(part for part in (note, written) if part)
        address = two.address or one.address
        return Difference(neutral, risk, before, after, note, key, unit, address, one.word, two.word)


def _keys(one: Owner, two: Owner) -> Iterator[str]:
    yield from two.items
    yield from (key for key in one.items if key not in two.items)


def _is_off(key: str, owner: Owner) -> bool:
    """Whether a key is the limit of an alarm whose enable bit is off."""
    bits = (f"{key}_enabled", f"{key.rpartition('.')[0]}.enabled")
    bit = next((owner.items[name] for name in bits if name in owner.items), None)
    return key.startswith(ALARMS) and key not in bits and bit is not None and bit.known and not bit.content


def _is_silent(row: Compared) -> bool:
    return row.same and not (row.operated or row.left_out or row.missing)


def renamed(item: Item | None, names: Mapping[str, str]) -> Item | None:
    """An item of the first side in which loops have the names of the second."""
    if item is None or not names:
        return item
    if isinstance(item.content, Wired):
        return replace(item, content=item.content.renamed(names))
    return replace(item, content=names.get(item.content, item.content)) if item.key == SOURCE else item


def _in_one_unit(one: Item, two: Item) -> tuple[str, object, object]:
    """The unit of both values, of which one may be a word such as ``off``; where they have two, they carry them."""
    if isinstance(one.content, Wired) or isinstance(two.content, Wired):
        return "", one.value, two.value
    if one.value is None or two.value is None:
        return (two.unit if two.value is not None else one.unit), one.value, two.value
    if one.unit == two.unit or not (one.unit and two.unit):
        return one.unit or two.unit, one.value, two.value
    return "", f"{one.value} {one.unit}".rstrip(), f"{two.value} {two.unit}".rstrip()


def _once(rows: Sequence[Difference]) -> Iterator[Difference]:
    """What a register or a part of it tells is told by no other row: that it is left to the operator, or left alone."""
    words = [row.key for row in rows if row.address]
    yield from (row for row in rows if row.address or not any(f"{word}.".startswith(f"{row.key}.") for word in words))
