"""The error term: its square and its deadband."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.refs import CLICK, Decision
from pidcfg.validate.ideas import alarms
from pidcfg.validate.rule import Findings, error, info, per_loop, warning
from pidcfg.validate.rules.click.setpoint import effective, written
from pidcfg.validate.rules.click.tuning import approximate, saturating_error

if TYPE_CHECKING:
    from pidcfg.validate.rules.click.context import LoopView

SQUARED = CLICK.at("Error Squared Option")
DEADBAND = CLICK.at("Error Deadband Option")

D138 = Decision(
    138,
    "the squared error is in squared units of the PV",
    "The error is squared as it is, without dividing by the range, and the square is compared with the deadband.",
    "The help prints no scaling, and says that the error is squared before the deadband; that the deadband is in the "
    "units of the PV holds for the linear error only.",
)
D139 = Decision(
    139,
    "a deadband should end inside the alarms",
    "A deadband as wide as a deviation alarm, or as the distance from the set point to the low or high alarm, is a "
    "warning.",
    "Inside the deadband no control action is taken: the loop would let the PV drift into an alarm that it could "
    "prevent.",
)


def half_width(view: LoopView) -> Decimal | None:
    """How far the PV may be from the set point without control action; None when the deadband does nothing."""
    value = view.held("deadband")
    if not view.deadband_on or value is None or value <= 0:
        return None
    return value.sqrt() if view.squared else value


@per_loop
@info(
    "CK351",
    D138,
    "the gain of {gain} is % per squared unit: as strong as linear at an error of {one}, weaker below; {full} "
    "drives the output through its limits",
)
def squared_error_in_squared_units(view: LoopView) -> Findings:
    """The error is squared, so the gain is in % per squared unit of the PV.

    Why: the square is not divided by the range. The effective gain is Kp·|e|: it depends on the unit of the PV even
    more than a linear one, and a gain that was tuned for a linear error does not fit.

    Fix: check the gain at the error at which the loop should react fully; divide a linear gain by that error.
    """
    full = saturating_error(view)
    if view.squared and full is not None:
        yield view.at(
            "error",
            "curve",
            gain=view.loop.tuning.proportional_gain,
            one=view.eu(Decimal(1)),
            full=f"one of {approximate(view, full)}",
        )


@per_loop
@warning(
    "CK352",
    D138,
    "the deadband {value} is compared with the squared error: no control action up to {width} around the set "
    "point, not {linear}",
)
def deadband_of_squared_error(view: LoopView) -> Findings:
    """A deadband is used together with the squared error.

    Why: the error is squared first, so the deadband counts in squared units. 4 means 2 units around the set point, and
    0.25 means 0.5: what is written is not what is seen.

    Fix: write the square of the width that is wanted, and compare it with the message; or use one of the two options.
    """
    width, value = half_width(view), view.held("deadband")
    if view.squared and width is not None and value is not None and width != value:
        yield view.at(
            "error", "deadband", value=view.loop.error.deadband, width=approximate(view, width), linear=view.eu(value)
        )


@per_loop
@warning("CK353", DEADBAND, "the error deadband is on with {value}: it ignores nothing")
def deadband_of_zero(view: LoopView) -> Findings:
    """The error deadband is on, but its register holds 0.

    Why: a deadband that is enabled without a value is 0, and the output follows every noise of the PV.

    Fix: give a deadband, or switch it off.
    """
    return alarms.deadband_of_zero(view)


@per_loop
@error(
    "CK354",
    DEADBAND,
    "the error deadband reaches {width} to either side, as far as the PV's whole range of {span}: no error is "
    "ever acted on",
)
def deadband_spans_range(view: LoopView) -> Findings:
    """The error deadband is as wide as the PV's range.

    Why: with a set point in the range no PV of the range leaves the deadband. The loop takes no control action at all,
    however far the process runs away.

    Fix: write the deadband in units of the PV, to one side of the set point.
    """
    width = half_width(view)
    if width is not None and view.span is not None and width >= view.span:
        yield view.at("error", "deadband", width=approximate(view, width), span=view.eu(view.span))


@per_loop
@warning(
    "CK355",
    D139,
    "the error deadband reaches {width} to either side, not less than the {limit} from the set point to the "
    "{alarm} alarm",
)
def deadband_reaches_alarm(view: LoopView) -> Findings:
    """The error deadband reaches as far as an alarm.

    Why: inside the deadband no control action is taken. The PV may drift into the alarm, and the loop does nothing
    about it.

    Fix: make the deadband narrower than the deviation alarms and the distance to the low and high alarms.
    """
    width, setpoint = half_width(view), written(view)
    if width is not None and (view.span is None or width < view.span):
        setpoint = None if setpoint is None else effective(view, setpoint)
        alarm = alarms.alarm_within(view, width, setpoint, ("deviation", "deviation_high"))
        if alarm is not None:
            yield view.at(
                "error", "deadband", width=approximate(view, width), alarm=alarm[0], limit=view.distance(alarm[1])
            )


@per_loop
@info("CK356", DEADBAND, "a deadband of {value} is stored, but {register} is off: every error is acted on")
def deadband_switched_off(view: LoopView) -> Findings:
    """A deadband is given, but not enabled.

    Why: its register shows up in every listing; without the enable bit it ignores nothing.

    Fix: remove `deadband_enabled: false`, or the deadband.
    """
    if view.loop.error.deadband and not view.deadband_on:
        yield view.at(
            "error", "deadband_enabled", value=view.shown("deadband"), register=view.register("deadband_enable")
        )
