"""Alarm points of the CLICK: their order, hysteresis, rate of change, and alarms that trip always or never."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal

from pidcfg.text.diagnostics import Severity
from pidcfg.text.references import CLICK, Decision
from pidcfg.validate import shared_checks
from pidcfg.validate.rule import Finding, Findings, error, info, per_loop, warning
from pidcfg.validate.rules.click.setup import ClickContext, LoopView
from pidcfg.validate.rules.click.signals import limited_setpoint, setpoint_in_file
from pidcfg.validate.shared_checks import (
    PV_POINTS,
    exceeded_alarm,
    list_names,
    neighbours_out_of_order,
    number_text,
    value_or_switch_key,
)

# --- Alarm points: their order, what is missing, and points that trip always or never ---------------------------------

PV_ALARM = CLICK.cite("Use PV Alarm (Cn+12)")
DEVIATION = CLICK.cite("Use PV Deviation Alarm (Cn+13)")

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
ANY_VALUE = (Decimal("-Infinity"), Decimal("Infinity"))
"""What a PV may be whose range is not known."""


def has_pv_point(view: LoopView, point: str) -> bool:
    """Whether the file gives a limit for a PV alarm."""
    return view.value(f"pv_{point}") is not None


def misordered_pairs(view: LoopView) -> Iterator[tuple[str, str]]:
    """Neighbours of the PV alarms in the wrong order; low and high may not even be equal."""
    for low, high, equal in neighbours_out_of_order(view, "pv"):
        if leaves_no_normal_zone(low) or not equal:
            yield low, high


def leaves_no_normal_zone(low: str) -> bool:
    """Whether a wrong pair leaves no PV without an alarm."""
    return low == "low"


@per_loop
@warning("CK371", PV_ALARM, "{above} is {high}, not above {below}, {low}: {effect}")
def pv_alarms_out_of_order(view: LoopView) -> Findings:
    """The PV alarm points are not in the order low_low, low, high, high_high.

    Why: a low alarm that is not below the high one leaves no PV without an alarm (an error). With an inner point beyond
    its outer one the warning comes after the emergency. The PLC accepts both.

    Fix: put the points in order.
    """
    if not view.pv_alarms_on:
        return
    for low, high in misordered_pairs(view):
        if has_pv_point(view, low) and has_pv_point(view, high):
            effect = "every PV is in alarm" if leaves_no_normal_zone(low) else f"{_inner_alarm(low, high)} comes last"
            yield view.report(
                "alarms",
                "pv",
                high,
                severity=Severity.ERROR if leaves_no_normal_zone(low) else None,
                above=high,
                below=low,
                high=view.quote(f"pv_{high}"),
                low=view.quote(f"pv_{low}"),
                effect=effect,
            )


def _inner_alarm(low: str, high: str) -> str:
    """The alarm of a pair that should announce the other."""
    return high if high == "low" else low


@per_loop
@warning("CK372", D142, "{missing} not given: {registers} {holds} 0, and one bit enables all four PV alarms: {effect}")
def pv_alarms_incomplete(view: LoopView) -> Findings:
    """Some of the four PV alarms are given, and the others are 0.

    Why: Cn+12 enables low_low, low, high and high_high together. A point that is left out is 0: a high alarm at 0 is on
    all the time (an error), a low alarm at 0 inside the range trips there (a warning); outside the range a point does
    no harm (an info).

    Fix: give all four. An alarm that is not wanted goes where the PV cannot get.
    """
    missing = [point for point in PV_POINTS if not has_pv_point(view, point)] if view.pv_alarms_on else []
    if missing:
        yield _missing_points_finding(view, missing)


def _missing_points_finding(view: LoopView, missing: list[str]) -> Finding:
    severity, effect = _effect_of_missing(view, missing)
    is_single = len(missing) == 1
    registers = list_names([view.register(f"pv_{point}") for point in missing])
    return view.report(
        "alarms",
        "pv",
        missing[0],
        severity=severity,
        missing=f"{list_names(missing)} {'is' if is_single else 'are'}",
        registers=registers,
        holds="holds" if is_single else "hold",
        effect=effect,
    )


def _effect_of_missing(view: LoopView, missing: list[str]) -> tuple[Severity, str]:
    """How bad it is that these points are 0, and why."""
    low, high = view.process_range or ANY_VALUE
    if any(leaves_no_normal_zone(below) and {below, above} & set(missing) for below, above in misordered_pairs(view)):
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
    for point in PV_POINTS if view.pv_alarms_on else ():
        value = view.register_value(f"pv_{point}")
        if value is not None and has_pv_point(view, point) and not low - view.span <= value <= high + view.span:
            yield view.report(
                "alarms", "pv", point, point=point, value=view.eu(value), low=view.eu(low), high=view.eu(high)
            )


@per_loop
@warning(
    "CK374",
    PV_ALARM,
    "the set point {value} is beyond the {alarm} alarm at {limit}: on its set point the loop is in alarm",
)
def setpoint_in_alarm(view: LoopView) -> Findings:
    """The set point lies beyond a PV alarm point.

    Why: a loop that controls well then stands in alarm, and operators learn to ignore it.

    Fix: move the set point or the alarm.
    """
    setpoint = setpoint_in_file(view)
    if setpoint is None:
        return
    setpoint = limited_setpoint(view, setpoint)
    alarm = exceeded_alarm(view, setpoint)
    if alarm is not None:
        yield view.report("setpoint", "value", value=view.eu(setpoint), alarm=alarm, limit=view.quote(f"pv_{alarm}"))


def deviation_points(view: LoopView) -> dict[str, Decimal]:
    """The deviation alarms by their keys, as far as they are on and fit their registers."""
    points = {key: view.register_value(f"deviation_{key}") for key in DEVIATIONS} if view.deviation_alarms_on else {}
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
            yield view.report("alarms", "deviation", key, point=key, value=view.quote(f"deviation_{key}"))


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
        yield view.report(
            "alarms",
            "deviation",
            "high_high",
            high=view.quote("deviation_high"),
            high_high=view.quote("deviation_high_high"),
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
            yield view.report("alarms", "deviation", key, point=key, value=view.eu(value), span=view.eu(view.span))


# --- The hysteresis of alarms, the rate-of-change alarm, and alarms that are switched off -----------------------------

HYSTERESIS = CLICK.cite("PV Alarm Hysteresis (DFn+20)")
RATE = CLICK.cite("Use PV Rate of Change (Cn+14)")

D144 = Decision(
    144,
    "the hysteresis must leave a zone without alarm",
    "A hysteresis as wide as the zone between low and high alarm is a warning, one as wide as the high deviation alarm "
    "an error.",
    "The alarm goes off when the PV is back by the hysteresis: there the opposite alarm is on, or no PV is far enough "
    "back.",
)
D145 = Decision(
    145,
    "a rate-of-change limit finer than the PV's float is a warning",
    "It is compared with the distance between two single-precision numbers at the larger end of the PV's range.",
    "A float has 24 binary digits: the PV cannot change by less than that distance without standing still.",
)
MANTISSA_BITS = 24


def resolution(view: LoopView) -> Decimal:
    """The distance between two single-precision numbers at the larger end of the range."""
    largest = float(max(abs(end) for end in view.loop.pv.range))
    exponent = Decimal(largest.hex().partition("p")[2]) if largest else Decimal(0)
    return Decimal(2) ** (exponent + 1 - MANTISSA_BITS)


@per_loop
@warning(
    "CK378", HYSTERESIS, "alarms are on with a hysteresis of {value}: a PV at a limit switches its alarm on and off"
)
def alarms_without_hysteresis(view: LoopView) -> Findings:
    """PV or deviation alarms are on, and the hysteresis is 0.

    Why: a real PV fluctuates. As it crosses an alarm point, the alarm comes and goes with each sample and is triggered
    again and again.

    Fix: give `alarms.hysteresis`, a little more than the PV's noise.
    """
    if (view.pv_alarms_on or view.deviation_alarms_on) and view.register_value("hysteresis") == 0:
        yield view.report("alarms", "hysteresis", value=view.quote("hysteresis"))


@error(
    "CK379",
    D144,
    "hysteresis is {value}, not less than the {point} deviation alarm {limit}: once on, the alarm stays on",
)
def hysteresis_swallows_deviation_alarm(context: ClickContext) -> Findings:
    """The hysteresis is not less than a deviation alarm.

    Why: the alarm goes off when the deviation has fallen below the limit by the hysteresis. If that is as much as the
    limit, no deviation is small enough: the alarm, once on, stays on.

    Fix: make the hysteresis much smaller than the deviation alarms.
    """
    for view in context.loops:
        hysteresis = view.register_value("hysteresis")
        if not view.deviation_alarms_on or not hysteresis:
            continue
        for key in ("high", "high_high"):
            limit = view.register_value(f"deviation_{key}")
            if limit is not None and 0 < limit <= hysteresis:
                yield view.report("alarms", "hysteresis", value=view.eu(hysteresis), point=key, limit=view.eu(limit))
                break


@per_loop
@warning(
    "CK380",
    D144,
    "hysteresis is {value}, but low and high alarm are only {zone} apart: neither goes off before the other comes",
)
def hysteresis_spans_normal_zone(view: LoopView) -> Findings:
    """The hysteresis is as wide as the zone between the low and the high alarm.

    Why: after a high alarm the PV must fall by the hysteresis to clear it, and by then it is at the low alarm. There is
    no PV without an alarm left.

    Fix: make the hysteresis much smaller than the distance from low to high.
    """
    return shared_checks.hysteresis_spans_normal_zone(view)


@per_loop
@info(
    "CK381",
    HYSTERESIS,
    "hysteresis is {value}, but neither PV nor deviation alarms are on, and the rate-of-change alarm has none",
)
def hysteresis_without_effect(view: LoopView) -> Findings:
    """A hysteresis is given for a loop whose only alarm, if any, is the rate of change.

    Why: the hysteresis works with the PV alarms and the deviation alarms only.

    Fix: remove it, or switch on the alarms it was meant for.
    """
    if view.loop.alarms.hysteresis and not view.pv_alarms_on and not view.deviation_alarms_on:
        yield view.report("alarms", "hysteresis", value=view.quote("hysteresis"))


def rate_text(view: LoopView) -> str:
    """The limit as it is written."""
    rate = view.loop.alarms.rate_of_change
    return "no value" if rate is None else f"{number_text(rate.value)} /{rate.per}"


@per_loop
@warning("CK382", RATE, "the rate-of-change alarm is on with {value}: every change of the PV is an alarm")
def rate_of_change_alarm_always_on(view: LoopView) -> Findings:
    """The rate-of-change alarm is on with 0 or a negative value, or without one.

    Why: the alarm comes when the PV changes faster than the limit. With 0 that is every sample in which it moves.

    Fix: give a limit per sample, or a rate such as `15 /min`.
    """
    limit = view.register_value("rate_of_change")
    if view.rate_alarm_on and limit is not None and limit <= 0:
        key = value_or_switch_key(view.loop.alarms, "rate_of_change")
        yield view.report("alarms", key, value=rate_text(view))


@per_loop
@warning(
    "CK383",
    D145,
    "the rate-of-change limit {value} is {stored} a sample, less than the {step} by which the PV's float can "
    "change: every change is an alarm",
)
def rate_of_change_finer_than_pv(view: LoopView) -> Findings:
    """The rate-of-change limit is smaller than the smallest change of the PV.

    Why: the limit is per sample. A slow rate and a fast sample rate give so little that single precision, of about 7
    digits, cannot tell it from no change: the alarm comes with every movement.

    Fix: sample more slowly, raise the limit, or use a unit in which the PV has fewer digits before the point.
    """
    limit, step = view.register_value("rate_of_change"), resolution(view)
    if view.rate_alarm_on and limit is not None and 0 < limit < step:
        yield view.report(
            "alarms", "rate_of_change", value=rate_text(view), stored=number_text(limit), step=f"{float(step):.3g}"
        )


@per_loop
@warning(
    "CK384",
    RATE,
    "the rate-of-change limit {value} is {stored} a sample, more than the PV's whole range of {span}: it never trips",
)
def rate_of_change_never_reached(view: LoopView) -> Findings:
    """The rate-of-change limit is more than the PV's range in a single sample.

    Why: the PV does not leave its range within a sample, so the alarm watches nothing. Often a rate per minute was
    written as a number, which is per sample.

    Fix: write the unit of time: `15 /min` or `0.25 /s`.
    """
    limit = view.register_value("rate_of_change")
    span = view.span
    if view.rate_alarm_on and limit is not None and span is not None and limit > span:
        yield view.report("alarms", "rate_of_change", value=rate_text(view), stored=view.eu(limit), span=view.eu(span))


@per_loop
@info("CK385", CLICK.cite("Use PV Alarm (Cn+12)"), "{alarms} are stored, but {register} is off: they never trip")
def alarms_switched_off(view: LoopView) -> Findings:
    """Alarm limits are given, but not enabled.

    Why: their registers show up in every listing; without the enable bit no alarm comes.

    Fix: remove `enabled: false` (or `rate_of_change_enabled: false`), or the limits.
    """
    alarms = view.loop.alarms
    groups = (
        ("pv", "PV alarms", "pv_alarm_enable", view.pv_alarms_on),
        ("deviation", "deviation alarms", "deviation_alarm_enable", view.deviation_alarms_on),
    )
    for key, title, register, on in groups:
        group = getattr(alarms, key)
        if not on and group is not None and any(v is not None for k, v in group if k != "enabled"):
            yield view.report("alarms", key, "enabled", alarms=title, register=view.register(register))
    if alarms.rate_of_change is not None and not view.rate_alarm_on:
        yield view.report(
            "alarms",
            "rate_of_change_enabled",
            alarms="rate-of-change limits",
            register=view.register("rate_alarm_enable"),
        )
