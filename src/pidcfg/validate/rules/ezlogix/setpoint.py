"""The set point, its limits and the deadband."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.refs import EZLOGIX, Decision
from pidcfg.validate.rule import Findings, error, info, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.ezlogix.context import EzlogixContext, LoopView

LOW = EZLOGIX.at("Setpoint Low Limit")
LIMITS = EZLOGIX.at("PID Limits")
SETPOINT = EZLOGIX.at("Setpoint")

D186 = Decision(
    186,
    "a deadband of more than a tenth of the PV's span is a warning",
    "It is an error when no PV is that far from the set point. A deadband of one count or less of an integer error is "
    "an info: it changes nothing.",
    "The manual gives no bounds. An error below the deadband counts as zero, and errors are whole counts; those of a "
    "square-root loop are not.",
)
WIDE = 10
"""Parts of the span that a deadband may be one of."""


def pinned(view: LoopView) -> bool:
    """Whether both limits are the dialog's 0, and make any other set point 0."""
    zero = view.loop.setpoint.value is not None and view.counts("setpoint") == 0
    return view.setpoint_limits == (0, 0) and not zero


@per_loop
@error("EZ435", LIMITS, "the low set point limit {low} is above the high limit {high}")
def set_point_limits_crossed(view: LoopView) -> Findings:
    """The low set point limit is above the high one.

    Why: every set point is outside one of them, and is replaced by a limit; by which one, the manual does not say.

    Fix: write the low limit first.
    """
    limits = view.all_counts("setpoint_low", "setpoint_high")
    if limits and limits[0] > limits[1]:
        yield view.at("setpoint", "limits", low=view.pv(limits[0]), high=view.pv(limits[1]))


@per_loop
@error(
    "EZ436",
    LIMITS,
    "both set point limits are 0 counts, as in the dialog of a new loop: {register} becomes 0 whatever is "
    "written to it",
)
def set_point_limits_zero(view: LoopView) -> Findings:
    """Both set point limits are left at 0.

    Why: they do not mean "no limits". A set point above the high limit is set to it, so every set point becomes 0: a
    heating loop stays off, and a cooling one runs at full output.

    Fix: give the limits of the process, or leave `setpoint.limits` out, which stores the ends of the PV's counts.
    """
    if pinned(view):
        yield view.at("setpoint", "limits", register=view.register("setpoint"))


@per_loop
@warning("EZ437", LIMITS, "both set point limits are {value}: there is no other set point")
def set_point_limits_equal(view: LoopView) -> Findings:
    """Both set point limits are equal.

    Why: every entry of an operator jumps back to this one value, as if the display were broken.

    Fix: set the limits apart.
    """
    limits = view.setpoint_limits
    if limits is not None and limits[0] == limits[1] and not pinned(view):
        yield view.at("setpoint", "limits", value=view.pv(limits[0]))


@per_loop
@error("EZ438", LOW, "the set point {value} is {side} its {end} limit: {register} becomes {limit}")
def set_point_outside_limits(view: LoopView) -> Findings:
    """The set point lies outside its own limits.

    Why: the PLC sets it to the limit, and the loop controls to another set point than the file says.

    Fix: correct the set point, or widen the limits.
    """
    value, kept = view.counts("setpoint"), view.setpoint
    if view.loop.setpoint.value is None or value is None or kept in {None, value} or pinned(view):
        return
    side, end = ("below", "low") if value < (kept or 0) else ("above", "high")
    yield view.at(
        "setpoint",
        "value",
        value=view.pv(value),
        side=side,
        end=end,
        limit=view.pv(kept or 0),
        register=view.register("setpoint"),
    )


@warning(
    "EZ439",
    SETPOINT,
    "the loop starts in Auto without a set point: {register} is downloaded as 0 counts, and the loop controls "
    "to {value}",
)
def set_point_left_at_zero(context: EzlogixContext) -> Findings:
    """A loop starts in Auto, and nothing gives its set point.

    Why: the register holds 0, or the low limit that replaces it, until an operator or the ladder program writes it.
    A cooling loop runs at full output until then.

    Fix: give `setpoint.value`, or start the loop with `mode: manual`.
    """
    for view in context.loops:
        if view.loop.mode != "auto" or view.loop.setpoint.value is not None or view.index in context.driven:
            continue
        if view.setpoint is not None and not pinned(view):
            yield view.at("mode", register=view.register("setpoint"), value=view.pv(view.setpoint))


@per_loop
@warning("EZ440", D186, "the deadband is {deadband}: {consequence}")
def deadband_wide(view: LoopView) -> Findings:
    """The deadband is a large part of the PV's span.

    Why: an error below it counts as zero, so the PV may wander that far to both sides of the set point. A deadband that
    no error can reach (an error) leaves the output standing for good.

    Fix: make it as wide as the noise of the measurement, no more. It is a difference, in the PV's unit.
    """
    deadband, limits = view.counts("deadband"), view.setpoint_limits
    if not deadband or limits is None:
        return
    scale = view.scales["sp"]
    furthest = max(limits[1] - scale.zero, scale.top - limits[0])
    if deadband > furthest:
        consequence = "no error is that large, the loop rests"
        yield view.at("deadband", severity=Severity.ERROR, deadband=view.pv_distance(deadband), consequence=consequence)
    elif deadband * WIDE > scale.top - scale.zero:
        share = f"{100 * deadband / (scale.top - scale.zero):.0f}"
        yield view.at(
            "deadband",
            deadband=view.pv_distance(deadband),
            consequence=f"errors of up to {share} % of the PV's span are not corrected",
        )


@per_loop
@info("EZ441", D186, "a deadband stored as {counts} has no effect: errors are whole counts")
def deadband_without_effect(view: LoopView) -> Findings:
    """A deadband is so small that it does nothing.

    Why: errors below the deadband count as zero. Below one count there is only the error 0, so a deadband of 1 is the
    same as none.

    Fix: write a deadband of two counts or more, or leave it out.
    """
    counts = view.counts("deadband")
    has_deadband = view.loop.deadband.value > 0 and not view.loop.pv.square_root
    if has_deadband and counts is not None and counts <= 1:
        yield view.at("deadband", counts="1 count" if counts else "0 counts")
