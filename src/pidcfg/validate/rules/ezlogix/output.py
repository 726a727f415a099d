"""The control value: its limits, its offset, and windup."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.maps.ezlogix import DUTY_FULL
from pidcfg.refs import EZLOGIX, Decision
from pidcfg.schemas.ezlogix import CV_FULL
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.ideas.limits import NUMBERS, outside_limits
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.ezlogix.context import LoopView

LOW = EZLOGIX.at("Control Value (CV) Low Limit")
HIGH = EZLOGIX.at("Control Value (CV) High Limit")
ANTI_WINDUP = EZLOGIX.at("Anti-Windup")
OFFSET = EZLOGIX.at("CV Offset")

D188 = Decision(
    188,
    "anti-windup acts at 0 and 4095, not at the CV limits",
    "Limits narrower than these are a warning where there is an integral term and anti-windup is on: the integral goes "
    "on until the CV before its limits is 0 or 4095, and the saturation bit does not come on meanwhile.",
    "The manual calls the CV saturated at 0 and at 4095. A CV that is held at a limit in between is neither, and what "
    "anti-windup looks at is the CV before that (D167).",
)
D189 = Decision(
    189,
    "an upper CV limit of 100 counts or less is a warning",
    "It is taken for a percentage, unless the output has a range or the limit is written with the word counts.",
    "100 of 4095 counts are 2.4 %; other controllers limit their outputs in %.",
)
PERCENT = 100


def looks_like_percent(view: LoopView) -> bool:
    """Whether the CV limits look like percentages."""
    limits, output = view.cv_limits, view.loop.output
    return limits is not None and limits[1] <= PERCENT and output.range is None and not output.limits[1].counts


def left_out(view: LoopView, cv: int) -> bool:
    """Whether the pulse for a CV is shorter than the minimum on time, and there is none."""
    return view.pulses is not None and view.pulses[0] * cv < view.pulses[1] * DUTY_FULL


@per_loop
@error("EZ455", HIGH, "the CV high limit {high} is not above the low limit {low}: the output cannot move")
def cv_limits_not_ascending(view: LoopView) -> Findings:
    """The CV low limit is equal to or above the high one.

    Why: equal limits pin the output. With crossed ones every CV is outside one of them, and which one wins is not
    documented; limits of 0 and 0 keep it off.

    Fix: write the low limit first; 0 and 4095 counts when `limits` is left out. The direction of control is the loop's
    `action`, not the order of the limits.
    """
    limits = view.all_counts("cv_low", "cv_high")
    if limits and limits[0] >= limits[1]:
        yield view.at("output", "limits", low=view.cv(limits[0]), high=view.cv(limits[1]))


@per_loop
@warning(
    "EZ456",
    D188,
    "anti-windup acts at 0 and 4095 counts only: while the CV is held at {limits}, the integral goes on until "
    "the calculated CV is there",
)
def anti_windup_blind_to_limits(view: LoopView) -> Findings:
    """The CV limits are narrower than 0 to 4095, and anti-windup is to protect the integral.

    Why: anti-windup looks at the CV before its limits. While the CV is held at a limit in between, the integral goes on
    until the unlimited value is 0 or 4095, and has to come back from there before the output moves. The saturation bit
    tells nothing of it: it looks at the CV itself.

    Fix: leave the limits at 0 and 4095 where they are not needed; otherwise expect the overshoot, or make the integral
    time longer.
    """
    limits = view.cv_limits
    if limits is None or limits == (0, CV_FULL) or looks_like_percent(view):
        return
    if view.loop.anti_windup and view.integrates:
        held = [view.cv(limit) for limit, end in zip(limits, (0, CV_FULL), strict=True) if limit != end]
        yield view.at("output", "limits", limits=" or ".join(held))


@per_loop
@checklist("EZ457", LOW, "the CV low limit is {low}: in Auto the output never goes below {percent} %")
def output_never_off(view: LoopView) -> Findings:
    """The CV low limit is above 0.

    Why: the loop cannot switch its output off, whatever the PV is; pulses keep the minimum duty cycle that the dialog
    shows. With a heater that is more than the losses at the set point, the temperature goes on rising.

    Fix: see that the process needs this minimum; otherwise write a low limit of 0.
    """
    low = view.cv_limits[0] if view.cv_limits is not None else 0
    if low and not left_out(view, low):
        yield view.at("output", "limits", low=view.cv(low), percent=f"{100 * low / DUTY_FULL:.3g}")


@per_loop
@warning("EZ458", OFFSET, "the CV offset {offset} is outside the CV limits {low} and {high}")
def offset_outside_limits(view: LoopView) -> Findings:
    """The CV offset lies outside the CV limits.

    Why: the offset is the CV when the error is zero. The limit cuts it off, so the loop answers only from a certain
    error on.

    Fix: bring the offset inside the limits.
    """
    offset, limits = view.counts("cv_offset"), view.cv_limits
    default = "offset" not in view.loop.output.model_fields_set
    if default or (offset == 0 and view.integrates):
        return
    yield from outside_limits(
        view, "output", "offset", value=offset, limits=limits, shown=view.cv, units=NUMBERS, field="offset"
    )


@per_loop
@info("EZ459", OFFSET, "the CV offset {offset} is added to an integral term, which cancels it")
def offset_beside_integral(view: LoopView) -> Findings:
    """A CV offset is given for a loop with an integral term.

    Why: the integral takes up whatever the process needs, so a constant beside it has no lasting effect; when the loop
    goes to Auto the integral term begins at the CV without the offset.

    Fix: leave the offset out, or take it as the place where the CV begins after an integral time is set to 0.
    """
    offset, limits = view.counts("cv_offset"), view.cv_limits
    if offset and view.integrates and limits is not None and limits[0] <= offset <= limits[1]:
        yield view.at("output", "offset", offset=view.cv(offset))


@per_loop
@warning(
    "EZ460",
    ANTI_WINDUP,
    "anti_windup is off with an integral_time of {integral} s: the integral goes on while the CV is saturated",
)
def integral_without_anti_windup(view: LoopView) -> Findings:
    """A loop with integral term has no anti-windup.

    Why: while the CV is at 0 or 4095 the sum goes on growing, and the PV has to stay on the other side of the set point
    for as long until it has shrunk again. Heating up from cold ends in a long overshoot.

    Fix: `anti_windup: true`, the dialog's own choice.
    """
    if not view.loop.anti_windup and view.integrates:
        yield view.at("anti_windup", integral=decimal_text(view.held("integral_time") or Decimal(0)))


@per_loop
@warning("EZ461", D189, "the CV high limit is {high} counts of 4095: {percent} %, if it is not meant as {high} %")
def cv_limit_looks_like_percent(view: LoopView) -> Findings:
    """The CV may not exceed 100 counts.

    Why: without a range the limits are counts, 4095 at full output. Limits of [0, 100] are meant as percentages; here
    the actuator hardly opens.

    Fix: give the output the range [0, 100], or write `"100 counts"` if that little is meant.
    """
    if looks_like_percent(view) and view.cv_limits is not None:
        high = view.cv_limits[1]
        yield view.at("output", "limits", high=high, percent=f"{100 * high / CV_FULL:.2g}")
