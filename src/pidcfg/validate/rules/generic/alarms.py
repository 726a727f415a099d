"""Alarm points: their order, and whether they can come."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.schemas.generic import D280
from pidcfg.validate.ideas.alarms import PV_POINTS
from pidcfg.validate.ideas.limits import outside_limits
from pidcfg.validate.rule import Findings, error, per_loop, warning

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.schemas.base import Model
    from pidcfg.validate.rules.generic.context import LoopView

DEVIATIONS = ("high", "high_high")


def existing(points: Model, names: tuple[str, ...]) -> list[tuple[str, Decimal]]:
    """The alarm points that the file gives, in order."""
    return [(name, getattr(points, name)) for name in names if getattr(points, name) is not None]


def severity_of(lower: Decimal, upper: Decimal) -> Severity:
    """Equal points are one alarm twice; crossed ones make no sense."""
    return Severity.WARNING if lower == upper else Severity.ERROR


@per_loop
@error("GN811", D280, "{upper} {above} is not above {lower} {below}")
def alarm_points_out_of_order(view: LoopView) -> Findings:
    """The alarm points of the PV do not ascend from low_low to high_high.

    Why: crossed points are on where nothing is wrong, or the severe alarm comes before the mild one. Equal points make
    two alarms of one.

    Fix: write low_low < low < high < high_high; leave out what is not wanted.
    """
    for (lower, below), (upper, above) in pairwise(existing(view.loop.alarms.pv, PV_POINTS)):
        if above <= below:
            yield view.at(
                "alarms",
                "pv",
                upper,
                severity=severity_of(above, below),
                upper=upper,
                above=view.pv(above),
                lower=lower,
                below=view.pv(below),
            )


@per_loop
@error("GN812", D280, "high_high {above} is not above high {below}")
def deviation_points_out_of_order(view: LoopView) -> Findings:
    """The second alarm point of the deviation is not above the first one.

    Why: the severe alarm comes before the mild one, or together with it.

    Fix: write high < high_high, or leave one out.
    """
    for (_, below), (_, above) in pairwise(existing(view.loop.alarms.deviation, DEVIATIONS)):
        if above <= below:
            severity = severity_of(above, below)
            yield view.at(
                "alarms", "deviation", "high_high", severity=severity, above=view.pv(above), below=view.pv(below)
            )


@per_loop
@warning("GN813", D280, "the alarm point {name} {value} is outside the PV's range, {low} to {high}")
def alarm_point_outside_range(view: LoopView) -> Findings:
    """An alarm point of the PV lies outside the PV's range.

    Why: the PV is not measured there: the alarm never comes, or is always on.

    Fix: write a point inside `pv.range`, or leave it out.
    """
    for name, value in existing(view.loop.alarms.pv, PV_POINTS):
        place = ("alarms", "pv", name)
        yield from outside_limits(view, *place, value=value, limits=view.loop.pv.range, shown=view.pv, name=name)
