"""Two configurations compared: key by key within a vendor, through the neutral loop between two."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any, Literal

from pidcfg.conversion import ConvertError, NeutralLoop, do_overlap, number_of
from pidcfg.conversion.builder import (
    OUTPUT_SCALE_FIELDS,
    PV_SCALE_FIELDS,
    flatten,
    rescale_output,
    without_unused_terms,
)
from pidcfg.conversion.differences import (
    Difference,
    LoopComparison,
    Status,
    judge_difference,
    judge_key,
    rank_by_risk,
    sort_by_risk,
)
from pidcfg.conversion.operation import source_of
from pidcfg.conversion.pipeline import generic_file
from pidcfg.conversion.terms import SIGNALS, Item, Owner, Terms, WireContent
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.contract import encoder_of
from pidcfg.encoders.parameters import AnyEncoding
from pidcfg.schemas.base import ConfigurationFile
from pidcfg.schemas.generic import Loop
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.vendors import Vendor

if TYPE_CHECKING:
    from pydantic import BaseModel

# --- Configurations of two vendors compared by meaning: through the neutral loop, in engineering units ----------------
#
# Each side is first taken as its PLC holds it (encoded and decoded), so that a value below the resolution of a
# register is no difference. Differences are ranked by what can go wrong. Two sides of one vendor are compared in
# their own words (`pidcfg.conversion.comparison`).

EQUAL_TOLERANCE = Decimal("1e-6")
"""Relative difference of numbers that count as equal."""


def compare_loops(before: NeutralSide, after: NeutralSide) -> list[LoopComparison]:
    """Loop by loop: matched by name, then by their order."""
    rows = []
    for i, j in match_loops(before.names, after.names):
        if j is None and i is not None:
            rows.append(LoopComparison(before.names[i], "removed"))
        elif i is None and j is not None:
            rows.append(LoopComparison(after.names[j], "added"))
        elif i is not None and j is not None:
            rows.append(rank_by_risk(after.names[j], _neutral_differences(before, i, after, j)))
    return rows


def match_loops(before: Sequence[str], after: Sequence[str]) -> list[tuple[int | None, int | None]]:
    """Numbers of loops that belong together, by their names."""
    numbers = {_fold_name(name): j for j, name in enumerate(after)}
    partners: dict[int, int] = {}
    for i, name in enumerate(before):
        j = numbers.get(_fold_name(name))
        if j is not None and j not in partners.values():
            partners[i] = j
    unmatched = [j for j in range(len(after)) if j not in partners.values()]
    pairs: list[tuple[int | None, int | None]] = []
    for i in range(len(before)):
        j = partners.get(i)
        if j is None and unmatched and len(before) == len(after):
            j = unmatched.pop(0)
        pairs.append((i, j))
    return pairs + [(None, j) for j in unmatched]


def _fold_name(name: str) -> str:
    """A name as vendors with narrower rules for names would write it."""
    return name.casefold().replace("-", "_")


# --- the neutral form ------------------------------------------------------------------------------------------------


def _neutral_differences(before: NeutralSide, i: int, after: NeutralSide, j: int) -> list[Difference]:
    first, second = before.loops[i], after.loops[j]
    if first is None or second is None:
        if first is second:
            return []
        kinds = ["no PID" if loop is None else "PID" for loop in (first, second)]
        return [Difference("type", "high", kinds[0], kinds[1], "the neutral form does not have both")]
    one = without_unused_terms(flatten(first))
    two = rescale_output(one, without_unused_terms(flatten(second)))
    return [
        judge_difference(key, one.get(key), two.get(key), scale_width(key, one))
        for key in {**one, **two}
        if not is_same_value(one.get(key), two.get(key))
    ]


def scale_width(key: str, loop: Mapping[str, object]) -> Decimal | None:
    """The width of the scale that a neutral field is a point of; None: it is none, or the scale has no range."""
    side = "pv" if key in PV_SCALE_FIELDS else "output" if key in OUTPUT_SCALE_FIELDS else None
    low, high = (number_of(loop.get(f"{side}.range.{end}")) for end in (0, 1))
    return None if low is None or high is None else abs(high - low)


def is_same_value(before: object, after: object) -> bool:
    """Whether two neutral values count as equal."""
    one, two = number_of(before), number_of(after)
    if one is None or two is None:
        return bool(before == after)
    return abs(one - two) <= EQUAL_TOLERANCE * max(abs(one), abs(two))


# --- One side of a comparison in the neutral form: a configuration as its PLC holds it --------------------------------


@frozen
class NeutralSide:
    """One configuration: its vendor and its loops, in their order."""

    vendor: Vendor
    names: tuple[str, ...]
    loops: tuple[Loop | None, ...]
    """In the neutral form; None: it has none."""


def neutral_side(config: ConfigurationFile, vendor: Vendor, *, partial: bool = False) -> NeutralSide:
    """A configuration as its PLC holds it.

    Raises `ConvertError` where it does not say what its values mean, unless it may be ``partial``: loops without a
    neutral form are then none. A vendor that names its parameters may have such loops in any case.
    """
    encoding = encoder_of(vendor).encode(config)
    image = encoding.image
    config_in_plc: Any = vendor.model.model_validate(
        encoder_of(vendor).decode(image.words, image.settings, image.plc).data
    )
    neutral: list[NeutralLoop] = source_of(vendor).to_neutral(config_in_plc)
    missing = [entry for loop in neutral for entry in loop.missing]
    if missing and not partial and encoding.space is not None:
        raise ConvertError(missing)
    complete = [loop for loop in neutral if not loop.missing]
    models = iter(generic_file(config_in_plc, complete).loops if complete else ())
    loops = tuple(None if loop.missing else next(models) for loop in neutral)
    return NeutralSide(vendor, tuple(loop.name for loop in config_in_plc.loops), loops)


# --- The neutral fields that the keys of a vendor's loops become: by them a difference is ranked ----------------------

SCALED_SECTIONS = ("pv", "output")


def fields_of(
    vendor: Vendor, config: ConfigurationFile, encoding: AnyEncoding
) -> dict[str, list[tuple[str, tuple[str, ...]]]]:
    """By loop, each key with the neutral fields that it becomes; a key of a block stands with the block's name."""
    try:
        loops: list[NeutralLoop] = source_of(vendor).to_neutral(with_ranges(config, encoding))
    except (ConvertError, DecodeError, ArithmeticError):
        return {}
    fields: dict[str, list[tuple[str, tuple[str, ...]]]] = {}
    for loop, neutral in zip(config.loops, loops, strict=True):
        for row in neutral.fields:
            _, _, inner = row.path.partition("blocks.")
            block, _, key = inner.partition(".")
            owner, path = (block, key) if row.path.startswith("blocks.") and key else (loop.name, row.path)
            fields.setdefault(owner, []).append((path, row.neutral))
    return fields


def neutral_fields(fields: Mapping[str, list[tuple[str, tuple[str, ...]]]], owner: str, key: str) -> Iterator[str]:
    """The neutral fields of a key."""
    for path, names in fields.get(owner, ()):
        if do_overlap(path, key):
            yield from names


def with_ranges(config: ConfigurationFile, encoding: AnyEncoding) -> Any:
    """A configuration in which a scale without a range counts from end to end, so that it has a neutral form."""
    scales = {block.path[1]: block.scales for block in encoding.blocks if block.path[:1] == ("loops",)}
    loops = []
    for i, loop in enumerate(config.loops):
        ranged_sections: dict[str, BaseModel] = {}
        for part, scale in ((part, scales.get(i, {}).get(part)) for part in SCALED_SECTIONS):
            if scale is not None and scale.range is None:
                ends = {"range": (scale.format.minimum, scale.format.maximum)}
                ranged_sections[part] = getattr(loop, part).model_copy(update=ends)
        loops.append(loop.model_copy(update=ranged_sections) if ranged_sections else loop)
    return config.model_copy(update={"loops": tuple(loops)})


# --- Which loops of two sides belong together: by name, then as renamed ones; and which of them moved -----------------

D346 = Decision(
    346,
    "a loop with another name at the same place is the same loop",
    "A loop is renamed when its registers begin where they did (in a vendor without addresses: when it has the same "
    "position) and at least half of what it has set is the same, or when all of it is the same elsewhere. Otherwise "
    "one loop was removed and another one added.",
    "A name is changed in an afternoon, and the gains with it; a loop of which most differs is another loop.",
)

MIN_LIKENESS = 0.5
"""The share of what is set that must be the same for a loop at the same place to be the same one."""

Pair = tuple["Owner | None", "Owner | None"]


def pairs_of(before: Sequence[Owner], after: Sequence[Owner]) -> list[Pair]:
    """Owners that belong together, in the order of the second side, what was removed behind the one it followed."""
    by_key = dict(zip(_owner_keys(before), before, strict=True))
    partners = {id(second): by_key[key] for key, second in zip(_owner_keys(after), after, strict=True) if key in by_key}
    for is_same in (_has_same_place, _has_same_content):
        _match_renamed(before, after, partners, is_same)
    pairs: list[Pair] = [(partners.get(id(second)), second) for second in after]
    matched = {id(first) for first in partners.values()}
    for i, first in enumerate(before):
        if id(first) not in matched:
            index = next((k for k, pair in enumerate(pairs) if i and pair[0] is before[i - 1]), -1)
            pairs.insert(index + 1, (first, None))
    return pairs


def _match_renamed(
    before: Sequence[Owner],
    after: Sequence[Owner],
    partners: dict[int, Owner],
    is_same: Callable[[Owner, Owner, int, int], bool],
) -> None:
    """Adds pairs of loops that have no partner yet."""
    matched = {id(first) for first in partners.values()}
    for j, second in enumerate(after):
        candidates = (
            (i, first) for i, first in enumerate(before) if id(first) not in matched and first.kind == second.kind
        )
        if id(second) not in partners:
            first = next((first for i, first in candidates if is_same(first, second, i, j)), None)
            if first is not None:
                partners[id(second)] = first
                matched.add(id(first))


def _owner_keys(owners: Sequence[Owner]) -> list[tuple[str, str, int]]:
    """What owners are called; of several with one name the first belongs to the first of the other side, and so on."""
    counts: Counter[tuple[str, str]] = Counter()
    keys: list[tuple[str, str, int]] = []
    for owner in owners:
        counts[owner.kind, owner.name] += 1
        keys.append((owner.kind, owner.name, counts[owner.kind, owner.name]))
    return keys


def _has_same_place(one: Owner, two: Owner, i: int, j: int) -> bool:
    """At the same address, or position, and much alike."""
    at_place = one.addresses == two.addresses if one.addresses or two.addresses else i == j
    return at_place and likeness(one, two) >= MIN_LIKENESS


def _has_same_content(one: Owner, two: Owner, i: int, j: int) -> bool:
    del i, j
    return likeness(one, two) == 1


def likeness(one: Owner, two: Owner) -> float:
    """The share of settings that are the same, of those that one of two loops has set."""
    keys = [key for key in {**one.items, **two.items} if _is_set(one, key) or _is_set(two, key)]
    same = sum(1 for key in keys if _item_content(one, key) == _item_content(two, key))
    return same / len(keys) if keys else 1.0


def _item_content(owner: Owner, key: str) -> object:
    item = owner.items.get(key)
    return None if item is None else item.content


def _is_set(owner: Owner, key: str) -> bool:
    """Whether a setting that is not about the place is something other than nothing."""
    item = owner.items.get(key)
    return item is not None and item.kind == "setting" and bool(item.content) and not is_address(item.value, owner)


def is_address(value: object, owner: Owner) -> bool:
    """Whether a value is where the registers of a loop begin."""
    return isinstance(value, str) and value in owner.addresses.split()


def moved_loops(pairs: Sequence[Pair]) -> Iterator[tuple[Owner, tuple[str, str]]]:
    """Loops of the second side that have another place than on the first, with both places.

    That is where its registers begin; where a vendor gives loops no addresses, its number, if its order has changed.
    """
    loop_pairs = [(one, two) for one, two in pairs if one is not None and two is not None and two.kind == "loop"]
    for one, two in loop_pairs:
        if one.addresses != two.addresses:
            yield two, (one.addresses, two.addresses)
    unplaced = [(one, two) for one, two in loop_pairs if not (one.addresses or two.addresses)]
    numbers = [one.number for one, _ in unplaced]
    ordered = _longest_increasing(numbers)
    for i, (one, two) in enumerate(unplaced):
        if i not in ordered:
            yield two, (f"loop {one.number}", f"loop {two.number}")


def _longest_increasing(numbers: Sequence[int]) -> frozenset[int]:
    """The places of as many numbers as possible of which each is larger than the one before."""
    runs: list[tuple[int, ...]] = [()]
    for i, number in enumerate(numbers):
        candidates = [run for run in runs if not run or numbers[run[-1]] < number]
        runs.append((*max(candidates, key=len), i))
    longest = max(runs, key=len)
    return frozenset(longest)


# ----------------------------------------------------------------------------------------------------------------------
# Two sides of one vendor compared key by key: the file's numbers, their units, and the words with their addresses.

Verdict = Literal["same", "missing", "live", "operated", "differs"]
"""What becomes of a key: a listing does not hold it, the PLC or the process writes it, the operator does, …"""
SOURCE_KEY = "setpoint.source"
ALARM_PREFIX, ALARM_OFF_NOTE = "alarms.", "the alarm is off on both sides"


@dataclass(slots=True)
class _LoopDifferences:
    """What was found of a loop."""

    differences: list[Difference] = field(default_factory=list)
    operator_differences: list[Difference] = field(default_factory=list)
    live_keys: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)


class Comparison:
    """How two sides are compared.

    ``find_fields``: the neutral fields that a key becomes, by which it is ranked; ``with_live``: whether words that
    the PLC or the process writes count against a listing.
    """

    def __init__(
        self, before: Terms, after: Terms, find_fields: Callable[[str, str], Sequence[str]], *, with_live: bool = False
    ) -> None:
        self.before, self.after, self.find_fields, self.with_live = before, after, find_fields, with_live
        self.are_listings = (before.is_listing, after.is_listing)

    def rows(self) -> list[LoopComparison]:
        """Every loop; blocks, and at the end the rest of the file, only where there is something to tell of them."""
        pairs = pairs_of(self.before.owners, self.after.owners)
        moves = {id(two): place for two, place in moved_loops(pairs)}
        names = {one.name: two.name for one, two in pairs if one and two and one.name != two.name}
        rows: list[LoopComparison] = []
        file_rows: list[LoopComparison] = []
        for one, two in pairs:
            row, kinds = self._compare_owners((one, two), names, moves), {owner.kind for owner in (one, two) if owner}
            if "loop" in kinds or not _is_silent(row):
                (file_rows if "file" in kinds else rows).append(row)
        return rows + file_rows

    def _compare_owners(
        self, pair: Pair, names: Mapping[str, str], places: Mapping[int, tuple[str, str]]
    ) -> LoopComparison:
        one, two = pair
        if SIGNALS in {owner.kind for owner in pair if owner}:
            one, two = one or Owner(SIGNALS, SIGNALS), two or Owner(SIGNALS, SIGNALS)
        if one is None:
            return LoopComparison(two.name if two else "", "added")
        if two is None:
            return LoopComparison(one.name, "removed")
        rows = self._compare_keys(one, two, names)
        place, is_renamed = places.get(id(two)), one.name != two.name
        status: Status = "renamed" if is_renamed else "moved" if place else "changed" if rows.differences else "same"
        return LoopComparison(
            two.name,
            status,
            sort_by_risk(_without_repeats(rows.differences)),
            one.name if is_renamed else "",
            place,
            sort_by_risk(rows.operator_differences),
            tuple(rows.live_keys),
            tuple(rows.missing),
        )

    def _compare_keys(self, one: Owner, two: Owner, names: Mapping[str, str]) -> _LoopDifferences:
        """The keys of a loop."""
        rows = _LoopDifferences()
        for key in _keys_of_both(one, two):
            a, b = one.items.get(key), two.items.get(key)
            item = b or a or Item(key)
            verdict = self._judge_key((one, two), rename_loops(a, names), b)
            if verdict == "missing":
                rows.missing.append(item.key)
            elif verdict == "live":
                rows.live_keys.append(item.key)
            elif verdict != "same":
                difference = self._make_difference(two.name, a or Item(item.key), b or Item(item.key))
                if _is_off(key, one) and _is_off(key, two):
                    difference = replace(difference, risk="low", note=ALARM_OFF_NOTE)
                (rows.operator_differences if verdict == "operated" else rows.differences).append(difference)
        return rows

    def _judge_key(self, owners: tuple[Owner, Owner], a: Item | None, b: Item | None) -> Verdict:
        """What becomes of a key."""
        items = [item for item in (a, b) if item is not None]
        if any(item.fault for item in items):
            is_same = len(items) == len(owners) and items[0].content == items[1].content
            return "same" if is_same else self._judge_listing_difference(items)
        if not all(item.is_known for item in items):
            is_held = any(item.is_known and item.kind != "live" and item.content for item in items)
            return "missing" if is_held else "same"
        if len(items) < len(owners):
            side = 0 if a is None else 1
            verdict = self._judge_one_sided(owners[side], side, items[0])
        else:
            verdict = "same" if items[0].content == items[1].content else "differs"
        return self._judge_listing_difference(items) if verdict == "differs" else verdict

    def _judge_one_sided(self, owner: Owner, side: int, item: Item) -> Verdict:
        """What becomes of a key that ``owner``, the loop of one side, lacks."""
        if item.is_default or (item.is_optional and item.value is None):
            return "same"
        if not self.are_listings[side]:
            return "same" if item.is_optional and any(self.are_listings) else "differs"
        if item.file_only or not (item.address or owner.is_described):
            return "same"
        has_address = (self.before, self.after)[side].has_address
        return "missing" if item.is_optional and not has_address(item.address) else "differs"

    def _judge_listing_difference(self, items: Sequence[Item]) -> Verdict:
        """What becomes of a key that differs: against a listing much does that nobody has edited."""
        kinds = {item.kind for item in items}
        if "reserved" in kinds:
            return "differs" if all(self.are_listings) else "same"
        if self.with_live or not any(self.are_listings):
            return "differs"
        if "live" in kinds or ("operated" in kinds and len(items) == 1):
            return "live"
        is_value = not any(item.fault for item in items)
        return "operated" if is_value and "operated" in kinds else "differs"

    def _make_difference(self, loop: str, one: Item, two: Item) -> Difference:
        key = two.key
        unit, before, after = _in_one_unit(one, two)
        is_scaled = {type(before), type(after)} == {str} != {type(one.value), type(two.value)}
        neutral, risk, note = judge_key(key, self.find_fields(loop, key), before, after, is_scaled=is_scaled)
        writer, kinds = one.writer or two.writer, {one.kind, two.kind}
        if fault := one.fault or two.fault:
            note = f"no value: {fault.rpartition(': ')[2]}"
        elif writer and any(self.are_listings) and (self.with_live or "operated" not in kinds):
            writer_note = f"written by {writer}" if kinds & {"live", "operated"} else f"written by {writer}, too"
            note = "; ".join(part for part in (note, writer_note) if part)
        address = two.address or one.address
        return Difference(neutral, risk, before, after, note, key, unit, address, one.word, two.word)


def _keys_of_both(one: Owner, two: Owner) -> Iterator[str]:
    yield from two.items
    yield from (key for key in one.items if key not in two.items)


def _is_off(key: str, owner: Owner) -> bool:
    """Whether a key is the limit of an alarm whose enable bit is off."""
    bits = (f"{key}_enabled", f"{key.rpartition('.')[0]}.enabled")
    bit = next((owner.items[name] for name in bits if name in owner.items), None)
    return key.startswith(ALARM_PREFIX) and key not in bits and bit is not None and bit.is_known and not bit.content


def _is_silent(row: LoopComparison) -> bool:
    return row.same and not (row.operated or row.left_out or row.missing)


def rename_loops(item: Item | None, names: Mapping[str, str]) -> Item | None:
    """An item of the first side in which loops have the names of the second."""
    if item is None or not names:
        return item
    if isinstance(item.content, WireContent):
        return replace(item, content=item.content.rename_blocks(names))
    return replace(item, content=names.get(item.content, item.content)) if item.key == SOURCE_KEY else item


def _in_one_unit(one: Item, two: Item) -> tuple[str, object, object]:
    """The unit of both values, of which one may be a word such as ``off``; where they have two, they carry them."""
    if isinstance(one.content, WireContent) or isinstance(two.content, WireContent):
        return "", one.value, two.value
    before, after = (item.unit if isinstance(item.unit, str) else item.unit() for item in (one, two))
    if one.value is None or two.value is None:
        return (after if two.value is not None else before), one.value, two.value
    if before == after or not (before and after):
        return before or after, one.value, two.value
    return "", f"{one.value} {before}".rstrip(), f"{two.value} {after}".rstrip()


def _without_repeats(rows: Sequence[Difference]) -> Iterator[Difference]:
    """What a register or a part of it tells is told by no other row: that it is left to the operator, or left alone."""
    words = [row.key for row in rows if row.address]
    yield from (row for row in rows if row.address or not any(f"{word}.".startswith(f"{row.key}.") for word in words))
