"""Alarm points: their order, what is missing, and points that trip always or never."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.refs import CLICK, Decision
from pidcfg.validate.ideas.alarms import PV_POINTS, alarm_beyond, neighbours_out_of_order
from pidcfg.validate.rule import Finding, Findings, per_loop, warning
from pidcfg.validate.rules.click.setpoint import effective, written

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.validate.rules.click.context import LoopView

ABSOLUTE = CLICK.at("Use PV Alarm (Cn+12)")
DEVIATION = CLICK.at("Use PV Deviation Alarm (Cn+13)")

D142 = Decision(
    142,
    "an alarm point that is not given is 0",
    "One bit enables all four PV alarms, another both deviation alarms; the register of a point that is not given "
    "holds 0 and is compared like any other.",
    "The block has no bit for a single alarm, and no value that means none.",
)
D143 = Decision(
    143,
    "an alarm point more than a range away is a warning",
    "A PV alarm that lies further outside the PV's range than the range is wide is taken for a mistaken unit.",
    "The range is that of the process, not of the sensor: alarms for a failed sensor stand outside it on purpose.",
)
DEVIATIONS = ("high", "high_high")
EVERYWHERE = (Decimal("-Infinity"), Decimal("Infinity"))
"""What a PV may be whose range is not known."""


def has_pv_point(view: LoopView, point: str) -> bool:
    """Whether the file gives a limit for a PV alarm."""
    return view.value(f"pv_{point}") is not None


def wrong_pairs(view: LoopView) -> Iterator[tuple[str, str]]:
    """Neighbours of the PV alarms in the wrong order; low and high may not even be equal."""
    for below, above, equal in neighbours_out_of_order(view, "pv"):
        if always(below) or not equal:
            yield below, above


def always(below: str) -> bool:
    """Whether a wrong pair leaves no PV without an alarm."""
    return below == "low"


@per_loop
@warning("CK371", ABSOLUTE, "{above} is {high}, not above {below}, {low}: {effect}")
def pv_alarms_out_of_order(view: LoopView) -> Findings:
    """The PV alarm points are not in the order low_low, low, high, high_high.

    Why: a low alarm that is not below the high one leaves no PV without an alarm (an error). With an inner point beyond
    its outer one the warning comes after the emergency. The PLC accepts both.

    Fix: put the points in order.
    """
    if not view.pv_alarms:
        return
    for below, above in wrong_pairs(view):
        if has_pv_point(view, below) and has_pv_point(view, above):
            effect = "every PV is in alarm" if always(below) else f"{_inner(below, above)} comes last"
            yield view.at(
                "alarms",
                "pv",
                above,
                severity=Severity.ERROR if always(below) else None,
                above=above,
                below=below,
                high=view.shown(f"pv_{above}"),
                low=view.shown(f"pv_{below}"),
                effect=effect,
            )


def _inner(below: str, above: str) -> str:
    """The alarm of a pair that should announce the other."""
    return above if above == "low" else below


@per_loop
@warning("CK372", D142, "{missing} not given: {registers} {holds} 0, and one bit enables all four PV alarms: {effect}")
def pv_alarms_incomplete(view: LoopView) -> Findings:
    """Some of the four PV alarms are given, and the others are 0.

    Why: Cn+12 enables low_low, low, high and high_high together. A point that is left out is 0: a high alarm at 0 is on
    all the time (an error), a low alarm at 0 inside the range trips there (a warning); outside the range a point does
    no harm (an info).

    Fix: give all four. An alarm that is not wanted goes where the PV cannot get.
    """
    missing = [point for point in PV_POINTS if not has_pv_point(view, point)] if view.pv_alarms else []
    if missing:
        yield _incomplete(view, missing)


def _incomplete(view: LoopView, missing: list[str]) -> Finding:
    severity, effect = _consequence(view, missing)
    one = len(missing) == 1
    registers = " and ".join(view.register(f"pv_{point}") for point in missing)
    return view.at(
        "alarms",
        "pv",
        missing[0],
        severity=severity,
        missing=f"{' and '.join(missing)} {'is' if one else 'are'}",
        registers=registers,
        holds="holds" if one else "hold",
        effect=effect,
    )


def _consequence(view: LoopView, missing: list[str]) -> tuple[Severity, str]:
    """How bad it is that these points are 0, and why."""
    low, high = view.process_range or EVERYWHERE
    if any(always(below) and {below, above} & set(missing) for below, above in wrong_pairs(view)):
        return Severity.ERROR, "every PV is in alarm"
    if high > 0 and any(point.startswith("high") for point in missing):
        return Severity.ERROR, "every PV above 0 is in alarm"
    if low < 0 and any(point.startswith("low") for point in missing):
        return Severity.WARNING, "every PV below 0 is in alarm"
    return Severity.INFO, "no PV of the process range is in alarm"


@per_loop
@warning(
    "CK373",
    D143,
    "{point} is {value}, further outside the PV's range {low} to {high} than the range is wide: it never trips",
)
def pv_alarm_far_outside_range(view: LoopView) -> Findings:
    """A PV alarm lies far outside the range of the process.

    Why: it watches nothing. Alarms just outside the range catch a failed sensor; one this far away usually has another
    unit, or a digit too many.

    Fix: correct the alarm, or `pv.range`.
    """
    if view.process_range is None or view.span is None:
        return
    low, high = view.process_range
    for point in PV_POINTS if view.pv_alarms else ():
        value = view.held(f"pv_{point}")
        if value is not None and has_pv_point(view, point) and not low - view.span <= value <= high + view.span:
            yield view.at(
                "alarms", "pv", point, point=point, value=view.eu(value), low=view.eu(low), high=view.eu(high)
            )


@per_loop
@warning(
    "CK374",
    ABSOLUTE,
    "the set point {value} is beyond the {alarm} alarm at {limit}: on its set point the loop is in alarm",
)
def setpoint_in_alarm(view: LoopView) -> Findings:
    """The set point lies beyond a PV alarm point.

    Why: a loop that controls well then stands in alarm, and operators learn to ignore it.

    Fix: move the set point or the alarm.
    """
    setpoint = written(view)
    if setpoint is None:
        return
    setpoint = effective(view, setpoint)
    alarm = alarm_beyond(view, setpoint)
    if alarm is not None:
        yield view.at("setpoint", "value", value=view.eu(setpoint), alarm=alarm, limit=view.shown(f"pv_{alarm}"))


def deviation_points(view: LoopView) -> dict[str, Decimal]:
    """The deviation alarms by their keys, as far as they are on and fit their registers."""
    points = {key: view.held(f"deviation_{key}") for key in DEVIATIONS} if view.deviation_alarms else {}
    return {key: value for key, value in points.items() if value is not None}


@per_loop
@warning(
    "CK375", D142, "the {point} deviation alarm is {value}: it is on whenever the PV is not exactly on the set point"
)
def deviation_alarm_of_zero(view: LoopView) -> Findings:
    """A deviation alarm is 0 or negative, given so or left out.

    Why: one bit enables both deviation alarms. With 0 the alarm is on nearly all the time, and operators learn to
    ignore it.

    Fix: give both limits, as distances from the set point that the loop normally keeps. One that is not wanted goes to
    the width of the range.
    """
    for key, value in deviation_points(view).items():
        if value <= 0:
            yield view.at("alarms", "deviation", key, point=key, value=view.shown(f"deviation_{key}"))


@per_loop
@warning(
    "CK376",
    DEVIATION,
    "the high deviation alarm {high} is above the high_high one, {high_high}: high_high comes first",
)
def deviation_alarms_out_of_order(view: LoopView) -> Findings:
    """The high deviation alarm is further from the set point than the high-high one.

    Why: the emergency then comes before the warning that should announce it.

    Fix: make `high_high` the larger one.
    """
    points = deviation_points(view)
    if len(points) == len(DEVIATIONS) and points["high"] > points["high_high"] > 0:
        yield view.at(
            "alarms",
            "deviation",
            "high_high",
            high=view.shown("deviation_high"),
            high_high=view.shown("deviation_high_high"),
        )


@per_loop
@warning(
    "CK377",
    DEVIATION,
    "the {point} deviation alarm {value} is more than the PV's whole range of {span}: it never trips",
)
def deviation_alarm_beyond_range(view: LoopView) -> Findings:
    """A deviation alarm is wider than the PV's range.

    Why: with a set point in the range the PV cannot be that far away. The alarm watches nothing; often an absolute
    value was written for a distance.

    Fix: write the distance from the set point.
    """
    for key, value in deviation_points(view).items():
        if view.span is not None and value > view.span:
            yield view.at("alarms", "deviation", key, point=key, value=view.eu(value), span=view.eu(view.span))
