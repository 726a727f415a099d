"""How grave a difference of the neutral loops is: what can go wrong with the plant."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.values import number_of, shown
from pidcfg.differences.result import Difference

if TYPE_CHECKING:
    from pidcfg.differences.result import Risk

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


def judged(field: str, before: Any, after: Any) -> Difference:
    """The difference of a field, with its risk and what it means."""
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
