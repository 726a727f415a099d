"""Two configurations compared by meaning: through the neutral loop, in engineering units, ranked by what can go wrong.

Each side is first taken as its PLC holds it (encoded and decoded), so that a value below the resolution of a register
is no difference. What no neutral field says is compared as the vendor's own words say it, within one vendor.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel

from pidcfg.convert.pipeline import neutral_loops, number_of, shown

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.convert.ledger import Said
    from pidcfg.schemas.generic import GenericFile, Loop
    from pidcfg.vendors import Vendor

Risk = Literal["critical", "high", "medium", "low", "cosmetic"]
RISKS: tuple[Risk, ...] = ("critical", "high", "medium", "low", "cosmetic")
ROUNDING = Decimal("0.001")
"""Relative differences below this are what two vendors' registers make of one value."""

# fmt: off
LOW_ENDS = ("setpoint.limits.0", "output.limits.0")
HIGH_ENDS = ("setpoint.limits.1", "output.limits.1")
HIGH_ALARMS = ("alarms.pv.high", "alarms.pv.high_high", "alarms.deviation.high", "alarms.deviation.high_high",
               "alarms.rate_of_change")
LOW_ALARMS = ("alarms.pv.low", "alarms.pv.low_low")
GRAVE: dict[str, tuple[Risk, str]] = {
    "output_raises_pv":    ("critical", "the action is reversed: positive feedback on the same plant"),
    "pv.range.0":          ("high", "every quantity on the PV's scale and the gain mean something else"),
    "pv.range.1":          ("high", "every quantity on the PV's scale and the gain mean something else"),
    "pv.square_root":      ("high", "the PV means something else"),
    "output.range.0":      ("high", "the output's scale and the gain mean something else"),
    "output.range.1":      ("high", "the output's scale and the gain mean something else"),
    "anti_windup":         ("high", "the integral behaves otherwise at the limits"),
    "tuning.proportional": ("high", "the proportional action is switched"),
    "setpoint.source":     ("high", "the set point comes from elsewhere"),
    "mode":                ("high", "the loop starts in another mode"),
    "output.max_rate":     ("high", "the output moves at another speed"),
}
COSMETIC = ("name", "description", "pv.unit", "output.unit")
# fmt: on


@dataclass(frozen=True, slots=True)
class Difference:
    """One field that differs; ``note`` says what it means."""

    field: str
    risk: Risk
    before: Any
    after: Any
    note: str = ""


@dataclass(frozen=True, slots=True)
class Compared:
    """A loop on both sides: changed or the same, or on one side only."""

    loop: str
    status: Literal["same", "changed", "added", "removed"]
    differences: tuple[Difference, ...] = ()


@dataclass(frozen=True, slots=True)
class Side:
    """One configuration: its vendor, its neutral loops, and what they do not say, by loop and field."""

    vendor: Vendor
    file: GenericFile
    beside: tuple[dict[str, Any], ...]


def side_of(config: Any, vendor: Vendor) -> Side:
    """A configuration as its PLC holds it; raises `ConvertError` where it does not say what its values mean."""
    image = vendor.encoder(config).image
    held = vendor.model.model_validate(vendor.load("decode")(image.words, image.settings, image.plc).data)
    file, loops = neutral_loops(held, vendor)
    beside = tuple({entry.field: entry.value for entry in loop.said if _is_own(entry)} for loop in loops)
    return Side(vendor, file, beside)


def _is_own(entry: Said) -> bool:
    return not entry.to


def compare(before: Side, after: Side) -> list[Compared]:
    """Loop by loop: matched by name, then by their order."""
    pairs = matched(before.file.loops, after.file.loops)
    found = []
    for i, j in pairs:
        if j is None and i is not None:
            found.append(Compared(before.file.loops[i].name, "removed"))
        elif i is None and j is not None:
            found.append(Compared(after.file.loops[j].name, "added"))
        elif i is not None and j is not None:
            differences = _differences(before, i, after, j)
            found.append(Compared(after.file.loops[j].name, "changed" if differences else "same", tuple(differences)))
    return found


def matched(before: Sequence[Loop], after: Sequence[Loop]) -> list[tuple[int | None, int | None]]:
    """Numbers of loops that belong together."""
    names = {loop.name.casefold().replace("-", "_"): j for j, loop in enumerate(after)}
    taken: dict[int, int] = {}
    for i, loop in enumerate(before):
        j = names.get(loop.name.casefold().replace("-", "_"))
        if j is not None and j not in taken.values():
            taken[i] = j
    left = [j for j in range(len(after)) if j not in taken.values()]
    pairs: list[tuple[int | None, int | None]] = []
    for i in range(len(before)):
        j = taken.get(i)
        if j is None and left and len(before) == len(after):
            j = left.pop(0)
        pairs.append((i, j))
    return pairs + [(None, j) for j in left]


def _differences(before: Side, i: int, after: Side, j: int) -> list[Difference]:
    one, two = flat(before.file.loops[i]), flat(after.file.loops[j])
    found = [
        _judged(key, one.get(key), two.get(key)) for key in {**one, **two} if not _equal(one.get(key), two.get(key))
    ]
    if before.vendor is after.vendor:
        mine, theirs = before.beside[i], after.beside[j]
        found += [Difference(key, "medium", shown(mine.get(key)), shown(theirs.get(key)))
                  for key in {**mine, **theirs} if mine.get(key) != theirs.get(key)]  # fmt: skip
    return sorted(found, key=lambda difference: RISKS.index(difference.risk))


def flat(model: Any, prefix: str = "") -> dict[str, Any]:
    """Every value of a neutral loop by its path; limits that are not given are the ends of their range."""
    found: dict[str, Any] = {}
    for name in type(model).model_fields:
        value, path = getattr(model, name), f"{prefix}{name}"
        if isinstance(value, BaseModel):
            found |= flat(value, f"{path}.")
        elif isinstance(value, tuple):
            found |= {f"{path}.{k}": end for k, end in enumerate(value)}
        elif value is not None:
            found[path] = value
    if not prefix:
        for section in ("setpoint", "output"):
            whole = "pv" if section == "setpoint" else "output"
            for end in ("0", "1"):
                found.setdefault(f"{section}.limits.{end}", found[f"{whole}.range.{end}"])
    return found


def _equal(before: Any, after: Any) -> bool:
    one, two = number_of(before), number_of(after)
    if one is None or two is None:
        return bool(before == after)
    return abs(one - two) <= Decimal("1e-6") * max(abs(one), abs(two))


def _judged(field: str, before: Any, after: Any) -> Difference:
    one, two = number_of(before), number_of(after)
    risk, note = _meaning(field, before, after, one, two)
    if one is not None and two is not None and one and abs(two / one - 1) <= ROUNDING:
        risk, note = "cosmetic", "the registers' rounding"
    elif one and two is not None and not note:
        note = f"{(two / one - 1) * 100:+.3g} %"
    return Difference(field, risk, shown(before), shown(after), note)


def _meaning(field: str, before: Any, after: Any, one: Decimal | None, two: Decimal | None) -> tuple[Risk, str]:
    """How grave a difference is, and what it means."""
    if field in COSMETIC:
        return "cosmetic", ""
    if field in GRAVE:
        return GRAVE[field]
    if field in {*LOW_ALARMS, *HIGH_ALARMS}:
        return _alarm(field, before, after, one, two)
    if field in {*LOW_ENDS, *HIGH_ENDS} and one is not None and two is not None:
        wider = two > one if field in HIGH_ENDS else two < one
        return ("high", "the limit is wider") if wider else ("medium", "the limit is narrower")
    return "medium", ""


def _alarm(field: str, before: Any, after: Any, one: Decimal | None, two: Decimal | None) -> tuple[Risk, str]:
    if after is None:
        return "high", "the alarm is gone"
    if before is None:
        return "low", "a new alarm"
    outward = one is not None and two is not None and (two > one if field in HIGH_ALARMS else two < one)
    return ("high", "the alarm comes later") if outward else ("low", "the alarm comes earlier")


def worst(found: Sequence[Compared]) -> Iterator[Risk]:
    """The risks of all differences."""
    for entry in found:
        yield from (difference.risk for difference in entry.differences)
        if entry.status in {"added", "removed"}:
            yield "high"
