"""Two configurations compared by meaning: through the neutral loop, in engineering units, ranked by what can go wrong.

Each side is first taken as its PLC holds it (encoded and decoded), so that a value below the resolution of a register
is no difference. What no neutral field says is compared as the vendor's own words say it, within one vendor.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel

from pidcfg.conversion.ledger import ConvertError
from pidcfg.conversion.pipeline import generic_file
from pidcfg.conversion.values import number_of, shown
from pidcfg.differences.common_scale import normal, on_the_same_scale
from pidcfg.differences.parameters import SIGNALS, is_own, own_of
from pidcfg.differences.vendor_fields import own_risk, unsaid
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.conversion.ledger import NeutralLoop, SourceField
    from pidcfg.differences.parameters import Own
    from pidcfg.schemas.generic import Loop
    from pidcfg.vendors import Vendor

Risk = Literal["critical", "high", "medium", "low", "cosmetic"]
Status = Literal["same", "changed", "added", "removed"]
RISKS: tuple[Risk, ...] = ("critical", "high", "medium", "low", "cosmetic")
MUCH = Decimal(2)
"""A gain that grows or falls by more than this factor is another controller."""
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
    status: Status
    differences: tuple[Difference, ...] = ()


@dataclass(frozen=True, slots=True)
class Side:
    """One configuration: its vendor, its neutral loops, and what they do not say, by loop and field.

    A loop of named parameters may have no neutral form; ``own`` are the parameters of a vendor that names them.
    """

    vendor: Vendor
    names: tuple[str, ...]
    loops: tuple[Loop | None, ...]
    beside: tuple[dict[str, Any], ...]
    own: Own | None = None


def side_of(config: Any, vendor: Vendor) -> Side:
    """A configuration as its PLC holds it; raises `ConvertError` where it does not say what its values mean."""
    image = vendor.encoder(config).image
    held: Any = vendor.model.model_validate(vendor.load("decode")(image.words, image.settings, image.plc).data)
    found: list[NeutralLoop] = vendor.load("to_neutral")(held)
    missing = [entry for loop in found for entry in loop.missing]
    whole = [loop for loop in found if not loop.missing]
    names = tuple(loop.name for loop in held.loops)
    own = own_of(image, names, found)
    if missing and own is None:
        raise ConvertError(missing)
    made = iter(generic_file(held, whole).loops if whole else ())
    loops = tuple(None if loop.missing else next(made) for loop in found)
    beside = tuple({entry.path: entry.value for entry in loop.fields if _is_own(entry)} for loop in found)
    if own is None:
        beside = tuple(fields | unsaid(held, i, found[i]) for i, fields in enumerate(beside))
    return Side(vendor, names, loops, beside, own)


def _is_own(entry: SourceField) -> bool:
    return not entry.to


def compare(before: Side, after: Side) -> list[Compared]:
    """Loop by loop: matched by name, then by their order."""
    pairs = matched(before.names, after.names)
    neutral = {(i, j): _neutral(before, i, after, j) for i, j in pairs if i is not None and j is not None}
    own = _OwnWords(before, after, neutral) if before.own and after.own and before.vendor is after.vendor else None
    found = []
    for i, j in pairs:
        if j is None and i is not None:
            found.append(Compared(before.names[i], "removed"))
        elif i is None and j is not None:
            found.append(Compared(after.names[j], "added"))
        elif i is not None and j is not None:
            more = _beside(before, i, after, j) if own is None else own.of_loop(i, j)
            found.append(_compared(after.names[j], [*neutral[i, j], *more]))
    return found + (own.others() if own else [])


def _compared(name: str, differences: Sequence[Difference]) -> Compared:
    ranked = sorted(differences, key=lambda difference: RISKS.index(difference.risk))
    return Compared(name, "changed" if ranked else "same", tuple(ranked))


class _OwnWords:
    """What the vendor's own words of both sides say beside the ``neutral`` differences of each pair of loops."""

    def __init__(self, before: Side, after: Side, neutral: Mapping[tuple[int, int], list[Difference]]) -> None:
        self.before, self.after = before, after
        fields = {pair: frozenset(d.field for d in differences) for pair, differences in neutral.items()}
        empty: frozenset[str] = frozenset()
        self.told = (
            [next((of for (i, _), of in fields.items() if i == n), empty) for n in range(len(before.names))],
            [next((of for (_, j), of in fields.items() if j == n), empty) for n in range(len(after.names))],
        )

    def of_loop(self, i: int, j: int) -> Iterator[Difference]:
        """Of two loops: their own parameters, and what else no neutral field covers."""
        one, two = self.before.names[i], self.after.names[j]
        yield from self._owned(one, two, lone=(self.before.loops[i] is None) != (self.after.loops[j] is None))
        for d in _beside(self.before, i, self.after, j):
            if not any(
                side.own and is_own(d.field, name, side.own) for side, name in ((self.before, one), (self.after, two))
            ):
                yield d

    def _owned(self, one: str, two: str, *, lone: bool = False) -> Iterator[Difference]:
        """Of two owners; ``lone``: one of two loops has a neutral form, what only the other one lists is no news."""
        mine, theirs = self.before.own, self.after.own
        if mine is None or theirs is None:
            return
        for key, a, b in mine.differs(theirs, one, two):
            told = {mine.became_differently(one, key, self.told[0]), theirs.became_differently(two, key, self.told[1])}
            if lone and (a is None or b is None):
                continue
            wired = isinstance(a, Wire) or isinstance(b, Wire)
            if True in told or (False in told and not wired):
                continue
            yield Difference(key, "medium", _text(a), _text(b))

    def others(self) -> list[Compared]:
        """Blocks and signals that differ, come or go."""
        mine, theirs = (side.own.words if side.own else {} for side in (self.before, self.after))
        found = []
        for name in {**mine, **theirs}:
            if name in self.before.names or name in self.after.names:
                continue
            if name != SIGNALS and (name not in mine or name not in theirs):
                found.append(Compared(name, "added" if name in theirs else "removed"))
            else:
                found.append(_compared(name, list(self._owned(name, name))))
        return [entry for entry in found if entry.status != "same"]


def _text(content: Any) -> Any:
    return content.text if isinstance(content, Wire) else shown(content)


def matched(before: Sequence[str], after: Sequence[str]) -> list[tuple[int | None, int | None]]:
    """Numbers of loops that belong together, by their names."""
    names = {name.casefold().replace("-", "_"): j for j, name in enumerate(after)}
    taken: dict[int, int] = {}
    for i, name in enumerate(before):
        j = names.get(name.casefold().replace("-", "_"))
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


def _neutral(before: Side, i: int, after: Side, j: int) -> list[Difference]:
    first, second = before.loops[i], after.loops[j]
    if first is None or second is None:
        if before.vendor is after.vendor and first is second:
            return []
        kinds = ["no PID" if loop is None else "PID" for loop in (first, second)]
        return [Difference("type", "high", kinds[0], kinds[1], "the neutral form does not have both")]
    one, two = normal(flat(first)), normal(flat(second))
    if before.vendor is not after.vendor:
        two = on_the_same_scale(one, two)
    return [
        _judged(key, one.get(key), two.get(key)) for key in {**one, **two} if not _equal(one.get(key), two.get(key))
    ]


def _beside(before: Side, i: int, after: Side, j: int) -> list[Difference]:
    """What no neutral field says, within one vendor."""
    if before.vendor is not after.vendor:
        return []
    mine, theirs = before.beside[i], after.beside[j]
    return [
        Difference(key, own_risk(key), shown(mine.get(key)), shown(theirs.get(key)))
        for key in {**mine, **theirs}
        if mine.get(key) != theirs.get(key)
    ]


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
    if field == "tuning.gain" and one and two is not None and not MUCH >= two / one >= 1 / MUCH:
        return "high", ""
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
