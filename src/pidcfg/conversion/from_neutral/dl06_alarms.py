"""The alarms of a neutral loop as those of a DL06, which enables them by groups and wants them in order."""

from __future__ import annotations

from decimal import Decimal
from itertools import pairwise
from typing import TYPE_CHECKING

from pidcfg.conversion.arithmetic import product
from pidcfg.conversion.to_neutral.dl06_scales import distance, short, squared
from pidcfg.encoders.values import quantity
from pidcfg.encoders.words import nearest
from pidcfg.refs import Decision
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.numbers import decimal_text

if TYPE_CHECKING:
    from pidcfg.conversion.builder import TargetBuilder
    from pidcfg.conversion.from_neutral.dl06_target import Dl06Target

D282 = Decision(
    282,
    "alarms that a group needs besides those that are wanted",
    "One bit enables all four PV alarms, another both deviation alarms. A point that is not wanted stands at the end "
    "of the scale, or one count beside its neighbour; a point at the very end of the scale, which no PV passes, makes "
    "room for it. A hysteresis of less than one count becomes one.",
    "The PLC wants low_low < low < high < high_high and yellow < red in counts, and compares with words of 0 too.",
)
POINTS = ("low_low", "low", "high", "high_high")
WIDEST = Decimal(0x200) / 4095
FILLED = "one bit enables the whole group: this point is not wanted and stands where it does least"
INNER = f"{FILLED}: on only with the PV at the end of the scale, which also refuses Auto"
END = "at the end of the scale: no PV passes it"
ROOT = "a DL06 compares the differential pressure with it, not the root"


def alarms(b: TargetBuilder, t: Dl06Target) -> None:
    """All alarms of a loop."""
    on = _pv_points(b, t)
    yellow = _deviations(b, t)
    _rate_of_change(b, t)
    _hysteresis(b, t, yellow, on=on or yellow is not None)


def _pv_points(b: TargetBuilder, t: Dl06Target) -> bool:
    """The four points of the PV; returns whether they are on."""
    points, scale = t.neutral.alarms.pv, t.scales["pv"]
    wanted = {key: value for key in POINTS if (value := getattr(points, key)) is not None}
    if not wanted:
        return False
    values = {key: squared(scale, v) if t.neutral.pv.square_root else v for key, v in wanted.items()}
    bottom, top = scale.format.minimum, scale.format.maximum
    counts = {key: min(max(nearest(scale.position(Quantity(v))), bottom), top) for key, v in values.items()}
    for key, end in (("low", bottom), ("high", top)):
        if counts.get(key) == end:
            b.drop(f"alarms.pv.{key}", END)
            del counts[key], values[key]
    if not counts:
        return False
    places = _filled(counts, bottom, top)
    for low, high in pairwise(POINTS):
        if places[low] >= places[high]:
            text = " and ".join(f"{key} {decimal_text(wanted[key])}" for key in (low, high) if key in wanted)
            b.refuse(f"alarms.pv.{high}", f"{t.neutral.name}: {text}: {low} must be at least one count below {high}")
    for key in POINTS:
        if key in values:
            b.put(f"alarms.pv.{key}", values[key], f"alarms.pv.{key}")
        else:
            note = INNER if places[key] in {bottom + 1, top - 1} else FILLED
            b.put(f"alarms.pv.{key}", f"{places[key]} counts", None, note)
    return True


def _filled(counts: dict[str, int], bottom: int, top: int) -> dict[str, int]:
    """All four points: those that are given, and the others out of the way (D282)."""
    places = dict(counts)
    places.setdefault("low_low", bottom)
    places.setdefault("low", places["low_low"] + 1)
    places.setdefault("high_high", top)
    places.setdefault("high", places["high_high"] - 1)
    return places


def _deviations(b: TargetBuilder, t: Dl06Target) -> int | None:
    """Yellow and red deviation; returns the counts of yellow when they are on."""
    deviation, scale = t.neutral.alarms.deviation, t.scales["pv"]
    wanted = {"yellow": deviation.high, "red": deviation.high_high}
    neutral = {"yellow": "alarms.deviation.high", "red": "alarms.deviation.high_high"}
    values = {key: value for key, value in wanted.items() if value is not None}
    top = scale.format.maximum
    counts = {key: min(nearest(scale.distance(Quantity(v))), top) for key, v in values.items()}
    if t.neutral.pv.square_root or ("red" not in counts and counts.get("yellow") == top):
        for key in values:
            b.drop(neutral[key], ROOT if t.neutral.pv.square_root else END)
        return None
    if not counts:
        return None
    counts.setdefault("red", top)
    counts.setdefault("yellow", counts["red"] - 1)
    if not 0 <= counts["yellow"] < counts["red"]:
        text = " and ".join(f"{key} {decimal_text(value)}" for key, value in values.items())
        b.refuse("alarms.deviation.red", f"{t.neutral.name}: {text}: yellow must be at least one count below red")
    for key in ("yellow", "red"):
        if key in values:
            b.put(f"alarms.deviation.{key}", values[key], neutral[key])
        else:
            b.put(f"alarms.deviation.{key}", f"{counts[key]} counts", None, FILLED)
    return counts["yellow"]


def _rate_of_change(b: TargetBuilder, t: Dl06Target) -> None:
    rate, of = t.neutral.alarms.rate_of_change, "alarms.rate_of_change"
    if rate is None:
        return
    change = product(rate, t.sample)
    if t.neutral.pv.square_root:
        b.drop(of, ROOT)
    elif (counts := nearest(t.scales["pv"].distance(Quantity(change)))) == 0:
        b.drop(of, "less than half a count a sample: sample more slowly, or compare over more samples in the program")
    else:
        held = distance(t.scales["pv"], Quantity(Decimal(counts), counts=True))
        b.put(of, short(change), of, "per sample", exact=change, held=held)


def _hysteresis(b: TargetBuilder, t: Dl06Target, yellow: int | None, *, on: bool) -> None:
    """At least one count, at most 12.5 % of the span, and less than the yellow deviation."""
    wanted, scale, field = t.neutral.alarms.hysteresis, t.scales["pv"], "alarms.hysteresis"
    if t.neutral.pv.square_root:
        if wanted:
            b.drop(field, ROOT)
        return
    if not on:
        if wanted:
            b.put(field, wanted, field)
        return
    most = nearest(WIDEST * scale.format.span)
    most = most if yellow is None else max(min(most, yellow - 1), 1)
    counts = nearest(scale.distance(Quantity(wanted)))
    if counts < 1:
        b.put(field, "1 counts", field, "a DL06 wants at least one count", assumed=True)
    elif counts > most:
        held = quantity(scale.span_value(most))
        b.put(field, held, field, "at most 12.5 % of the span and less than the yellow deviation", clamped=True)
    else:
        b.put(field, wanted, field)
