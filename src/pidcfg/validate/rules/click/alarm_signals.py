"""The hysteresis of alarms, the rate-of-change alarm, and alarms that are switched off."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.refs import CLICK, Decision
from pidcfg.validate.ideas import alarms
from pidcfg.validate.rule import Findings, error, info, per_loop, warning
from pidcfg.validate.views import number_text, value_or_switch

if TYPE_CHECKING:
    from pidcfg.validate.rules.click.context import ClickContext, LoopView

HYSTERESIS = CLICK.at("PV Alarm Hysteresis (DFn+20)")
RATE = CLICK.at("Use PV Rate of Change (Cn+14)")

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
DIGITS = 24


def resolution(view: LoopView) -> Decimal:
    """The distance between two single-precision numbers at the larger end of the range."""
    largest = float(max(abs(end) for end in view.loop.pv.range))
    exponent = Decimal(largest.hex().partition("p")[2]) if largest else Decimal(0)
    return Decimal(2) ** (exponent + 1 - DIGITS)


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
    if (view.pv_alarms or view.deviation_alarms) and view.held("hysteresis") == 0:
        yield view.at("alarms", "hysteresis", value=view.shown("hysteresis"))


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
        hysteresis = view.held("hysteresis")
        if not view.deviation_alarms or not hysteresis:
            continue
        for key in ("high", "high_high"):
            limit = view.held(f"deviation_{key}")
            if limit is not None and 0 < limit <= hysteresis:
                yield view.at("alarms", "hysteresis", value=view.eu(hysteresis), point=key, limit=view.eu(limit))
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
    return alarms.hysteresis_spans_normal_zone(view)


@per_loop
@info(
    "CK381",
    RATE,
    "hysteresis is {value}, but neither PV nor deviation alarms are on, and the rate-of-change alarm has none",
)
def hysteresis_without_effect(view: LoopView) -> Findings:
    """A hysteresis is given for a loop whose only alarm, if any, is the rate of change.

    Why: the hysteresis works with the PV alarms and the deviation alarms only.

    Fix: remove it, or switch on the alarms it was meant for.
    """
    if view.loop.alarms.hysteresis and not view.pv_alarms and not view.deviation_alarms:
        yield view.at("alarms", "hysteresis", value=view.shown("hysteresis"))


def rate_text(view: LoopView) -> str:
    """The limit as it is written."""
    rate = view.loop.alarms.rate_of_change
    return "no value" if rate is None else str(rate)


@per_loop
@warning("CK382", RATE, "the rate-of-change alarm is on with {value}: every change of the PV is an alarm")
def rate_of_change_alarm_always_on(view: LoopView) -> Findings:
    """The rate-of-change alarm is on with 0 or a negative value, or without one.

    Why: the alarm comes when the PV changes faster than the limit. With 0 that is every sample in which it moves.

    Fix: give a limit per sample, or a rate such as `15 /min`.
    """
    limit = view.held("rate_of_change")
    if view.rate_alarm and limit is not None and limit <= 0:
        key = value_or_switch(view.loop.alarms, "rate_of_change")
        yield view.at("alarms", key, value=rate_text(view))


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
    limit, step = view.held("rate_of_change"), resolution(view)
    if view.rate_alarm and limit is not None and 0 < limit < step:
        yield view.at(
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
    limit = view.held("rate_of_change")
    span = view.span
    if view.rate_alarm and limit is not None and span is not None and limit > span:
        yield view.at("alarms", "rate_of_change", value=rate_text(view), stored=view.eu(limit), span=view.eu(span))


@per_loop
@info("CK385", CLICK.at("Use PV Alarm (Cn+12)"), "{alarms} are stored, but {register} is off: they never trip")
def alarms_switched_off(view: LoopView) -> Findings:
    """Alarm limits are given, but not enabled.

    Why: their registers show up in every listing; without the enable bit no alarm comes.

    Fix: remove `enabled: false` (or `rate_of_change_enabled: false`), or the limits.
    """
    alarms = view.loop.alarms
    groups = (
        ("pv", "PV alarms", "pv_alarm_enable", view.pv_alarms),
        ("deviation", "deviation alarms", "deviation_alarm_enable", view.deviation_alarms),
    )
    for key, title, register, on in groups:
        group = getattr(alarms, key)
        if not on and group is not None and any(v is not None for k, v in group if k != "enabled"):
            yield view.at("alarms", key, "enabled", alarms=title, register=view.register(register))
    if alarms.rate_of_change is not None and not view.rate_alarm:
        yield view.at(
            "alarms",
            "rate_of_change_enabled",
            alarms="rate-of-change limits",
            register=view.register("rate_alarm_enable"),
        )
