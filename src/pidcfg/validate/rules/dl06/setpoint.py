"""The set point: its limits and what becomes of it, and the deadband of the error."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.words import nearest
from pidcfg.refs import DL06, Decision
from pidcfg.validate.ideas import alarms
from pidcfg.validate.rule import Findings, error, info, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.dl06.context import LoopView

LIMITS = DL06.at("Setpoint (SP) Limits")
BUMPLESS = DL06.at("Bumpless Transfers")
TROUBLE = DL06.at("Troubleshooting Tips")
DEADBAND = DL06.at("Error Term Configuration")

D18 = Decision(
    18,
    "a deadband should end inside the alarms",
    "A deadband as wide as the yellow deviation limit, or from the set point to the high or low alarm, is a warning.",
    "Inside the deadband the error counts as zero: the loop would let the PV drift into an alarm that it could "
    "prevent.",
)


@per_loop
@error("DL228", LIMITS, "the upper set point limit {high} is not above the lower limit {low}")
def setpoint_limits_not_ascending(view: LoopView) -> Findings:
    """The set point limits are on, and the upper one is equal to or below the lower one.

    Why: the calculation applies the limits before each sample; limits that are equal pin the set point, crossed ones
    leave no set point at all.

    Fix: write the lower limit first, and leave at least one count between them.
    """
    limits = view.holds("setpoint_low", "setpoint_high")
    if view.setpoint_limited and limits and limits[0] >= limits[1]:
        yield view.at("setpoint", "limits", 1, high=view.shown("setpoint_high"), low=view.shown("setpoint_low"))


@per_loop
@warning(
    "DL229",
    LIMITS,
    "the set point {value} is outside the limits {low} to {high}: the loop controls to the nearer limit",
)
def setpoint_outside_limits(view: LoopView) -> Findings:
    """The set point lies outside the loop's own set point limits.

    Why: any value may be written to +02, and the word keeps it; the limit is applied inside the calculation only. The
    display then shows a set point that the loop never controls to.

    Fix: correct the set point, or widen the limits.
    """
    words = view.holds("setpoint_low", "setpoint", "setpoint_high")
    if view.loop.setpoint.value is None or not view.setpoint_limited or not words or words[0] >= words[2]:
        return
    if not words[0] <= words[1] <= words[2]:
        yield view.at(
            "setpoint",
            "value",
            value=view.shown("setpoint"),
            low=view.shown("setpoint_low"),
            high=view.shown("setpoint_high"),
        )


@per_loop
@info("DL230", LIMITS, "set point limits {low} and {high} are stored, but bit 3 of {word} is off: they limit nothing")
def setpoint_limits_switched_off(view: LoopView) -> Findings:
    """Set point limits are given, but not enabled.

    Why: the words +26 and +27 hold them, so they show up in every listing; without the enable bit they guard nothing.

    Fix: remove `limits_enabled: false`, or the limits.
    """
    if view.loop.setpoint.limits is not None and not view.setpoint_limited:
        yield view.at(
            "setpoint",
            "limits_enabled",
            word=view.v("mode_setting_2"),
            low=view.shown("setpoint_low"),
            high=view.shown("setpoint_high"),
        )


@per_loop
@info(
    "DL231",
    TROUBLE,
    "the set point {value} is replaced by the PV when the loop goes from Manual to Auto (Bumpless I)",
)
def setpoint_replaced_on_transfer(view: LoopView) -> Findings:
    """The set point of the file does not survive the change to Auto.

    Why: Bumpless Transfer I makes the set point equal to the PV at that moment. "The loop setpoint appears to be
    changing by itself" is a question of the manual's troubleshooting section.

    Fix: let the operator or the ladder program write the set point after the change to Auto, or take Bumpless II.
    """
    if view.loop.mode == "auto" and view.loop.bumpless == "I" and view.loop.setpoint.value is not None:
        yield view.at("setpoint", "value", value=view.shown("setpoint"))


@per_loop
@warning("DL232", BUMPLESS, "no set point is given: with Bumpless II the loop goes to Auto with {word} at {zero}")
def setpoint_left_at_zero(view: LoopView) -> Findings:
    """A loop with Bumpless Transfer II is meant for Auto, and nothing gives its set point.

    Why: the word is downloaded as 0. Type II does not copy the PV to it (type I would), so the loop drives the process
    towards 0 counts unless something writes the set point first.

    Fix: give `setpoint.value`, or take `bumpless: I`.
    """
    loop = view.loop
    if loop.mode == "auto" and loop.bumpless == "II" and loop.setpoint.value is None:
        yield view.at("setpoint", word=view.v("setpoint"), zero=view.eu(0, "sp"))


@per_loop
@warning("DL233", DEADBAND, "the error deadband is on with {value}: it ignores nothing")
def deadband_of_zero(view: LoopView) -> Findings:
    """The error deadband is on, but its word holds 0 counts.

    Why: a deadband narrower than half a count of the data format is stored as 0, and a bit without a value means 0 too.

    Fix: give a deadband of at least one count, or switch it off.
    """
    return alarms.deadband_of_zero(view)


@per_loop
@error(
    "DL504", DEADBAND, "the error deadband is {value}, as wide as the PV's whole range ({span}): no error is outside it"
)
def deadband_covers_the_range(view: LoopView) -> Findings:
    """The error deadband is as wide as the span of the PV, or of its root.

    Why: an error inside the deadband counts as zero, and no error can be larger. In Auto the output stays where it is,
    whatever happens to the PV.

    Fix: make the deadband as wide as the noise of the PV, no more.
    """
    width, scale = view.counts("deadband"), view.scales["sp"]
    if view.deadband_on and width is not None and width >= scale.full:
        span = view.text(scale.span_value(nearest(scale.full)), "sp", nearest(scale.full))
        yield view.at("error", "deadband", value=view.shown("deadband"), span=span)


@per_loop
@warning(
    "DL234",
    D18,
    "the error deadband of {value} is not less than the distance {limit} from the set point to the {alarm} alarm",
)
def deadband_reaches_alarm(view: LoopView) -> Findings:
    """The error deadband is as wide as the distance from the set point to an alarm.

    Why: inside the deadband the error counts as zero and the output stays where it is. The PV may drift into the alarm,
    and the loop does nothing about it.

    Fix: make the deadband narrower than the yellow deviation limit and the distance to the low and high alarms.
    """
    width = view.counts("deadband")
    if view.deadband_on and width and not view.loop.pv.square_root:
        setpoint = None if view.loop.setpoint.value is None else view.counts("setpoint")
        alarm = alarms.alarm_within(view, width, setpoint, ("yellow deviation", "deviation_yellow"))
        if alarm is not None:
            yield view.at(
                "error", "deadband", value=view.shown("deadband"), alarm=alarm[0], limit=view.distance(alarm[1])
            )
