"""Alarms of a neutral loop as CLICK ones, which one bit enables for a whole group."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.arithmetic import ZERO, width
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Mapping
    from decimal import Decimal

    from pidcfg.conversion.builder import TargetBuilder
    from pidcfg.schemas.generic import Deviation, Loop, Points

D287 = Decision(
    287,
    "an alarm that is not wanted goes where the PV cannot get",
    "Of the PV's alarms the outer points go a range's width outside the range, of the deviation's the outer one to the "
    "width of the range; an inner point that is not wanted goes to the outer one.",
    "One bit enables all alarms of a group, and a register that is not given is compared like any other.",
)


def pv_alarms(b: TargetBuilder, loop: Loop) -> None:
    """The four points of the PV."""
    _group(b, "alarms.pv", dict(loop.alarms.pv), _pv_points(loop.alarms.pv, loop.pv.range))


def deviation_alarms(b: TargetBuilder, loop: Loop) -> None:
    """The two points of the deviation."""
    deviation = loop.alarms.deviation
    _group(b, "alarms.deviation", dict(deviation), _deviation_points(deviation, loop.pv.range))


def _group(b: TargetBuilder, path: str, wanted: Mapping[str, Decimal | None], points: Mapping[str, Decimal]) -> None:
    """All points of a group, when one of them is wanted."""
    if all(value is None for value in wanted.values()):
        return
    for key, value in points.items():
        if wanted[key] is None:
            b.put(f"{path}.{key}", value, None, "not wanted: one bit enables all of them")
        else:
            b.put(f"{path}.{key}", value, f"{path}.{key}")


def _pv_points(points: Points, span: tuple[Decimal, Decimal]) -> dict[str, Decimal]:
    """The four points with those that are not wanted out of reach (D287)."""
    reach = width(span)
    low, high = _inner(points.low, points.low_low), _inner(points.high, points.high_high)
    lowest = span[0] - reach if low is None else min(span[0] - reach, low)
    highest = span[1] + reach if high is None else max(span[1] + reach, high)
    return {
        "low_low": lowest if points.low_low is None else points.low_low,
        "low": lowest if low is None else low,
        "high": highest if high is None else high,
        "high_high": highest if points.high_high is None else points.high_high,
    }


def _deviation_points(points: Deviation, span: tuple[Decimal, Decimal]) -> dict[str, Decimal]:
    """Both points, the one that is not wanted out of reach or at the other (D287)."""
    high = _inner(points.high, points.high_high) or ZERO
    return {"high": high, "high_high": max(width(span), high) if points.high_high is None else points.high_high}


def _inner(point: Decimal | None, outer: Decimal | None) -> Decimal | None:
    return outer if point is None else point
