"""The control output: its limits, and pulses in place of an analog signal."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.encoders.maps.click import OUTPUT_BELOW_ZERO
from pidcfg.refs import CLICK, Decision
from pidcfg.schemas.click import EFFECT, ERRORS
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, error, info, per_loop, warning
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.click.context import LoopView

OUTPUT = CLICK.at("Control Output (DFn+08)")
PWM = CLICK.at("PWM Control")

D140 = Decision(
    140,
    "an output whose upper limit is 1 % or less is a warning",
    "It is taken for a fraction of 1 in place of a percentage, unless the output has a unit of its own.",
    "The range is 0 to 100 % by default; other controllers scale it from 0 to 1.",
)
D141 = Decision(
    141,
    "a pulse period beyond the reset time is a warning",
    "The period of the pulses should not be longer than the reset time; one shorter than the sample rate is an info.",
    "The help gives no relation. Within a period the actuator is fully on and fully off: a process that a loop with "
    "that reset time controls follows both, and swings with the period.",
)
FULL = Decimal(100)


def percent(view: LoopView) -> bool:
    """Whether the output is a percentage."""
    return view.loop.output.unit in {None, "%"}


@per_loop
@error("CK361", OUTPUT, "the upper output limit is {high}: in Auto {register} never gets above zero")
def output_upper_limit_zero(view: LoopView) -> Findings:
    """The upper output limit is 0 or less.

    Why: the output never gets above zero, and the loop does not function. On a new loop this is what a register that
    was never written holds.

    Fix: set the upper limit to the highest output that the process may see; 100 when `limits` is left out.
    """
    high = view.held("output_upper")
    if high is not None and high <= 0:
        yield view.at("output", "limits", 1, high=view.co(high), register=view.register("output"))


@per_loop
@error("CK362", OUTPUT, "the upper output limit {high} is not above the lower limit {low}: the output cannot move")
def output_limits_not_ascending(view: LoopView) -> Findings:
    """The lower output limit is equal to or above the upper one.

    Why: the output stays within its limits in Auto. Equal limits pin it; with crossed ones every output is outside one
    of them, and what the PLC writes is not documented.

    Fix: write the lower limit first. The direction of control is the loop's `action`, not the order of the limits.
    """
    limits = view.holds("output_lower", "output_upper")
    if limits and limits[0] >= limits[1] > 0:
        yield view.at("output", "limits", 1, high=view.co(limits[1]), low=view.co(limits[0]))


@per_loop
@error("CK363", ERRORS, "the lower output limit is {low}; the PLC wants at least 0")
def output_lower_limit_negative(view: LoopView) -> Findings:
    """The lower output limit is below 0.

    Why: the PLC reports error 30 and keeps the loop in Manual. An output that goes both ways, such as heating and
    cooling, has to be split outside the loop.

    Fix: begin the limits at 0 or above.
    """
    low = view.held("output_lower")
    if low is not None and low < 0:
        yield view.at("output", "limits", 0, plc_effect=f"{EFFECT}{OUTPUT_BELOW_ZERO}", low=view.co(low))


@per_loop
@info("CK364", PWM, "the upper output limit is {high}: {effect}")
def output_limit_beyond_full(view: LoopView) -> Findings:
    """The upper output limit is more than 100 %.

    Why: the pulses are on for the whole period from 100 % on, so that a loop whose output goes further saturates where
    nobody sees it, and the anti-windup acts too late (a warning). An analog output has more than 100 only when it is
    scaled in another unit (an info).

    Fix: end the limits at 100, or give the unit in `output.unit`.
    """
    high = view.held("output_upper")
    if high is None or high <= FULL:
        return
    if view.loop.output.pwm is not None:
        effect = "the pulses are on all the time from 100 % on"
        yield view.at("output", "limits", 1, severity=Severity.WARNING, high=view.co(high), effect=effect)
    elif percent(view):
        yield view.at("output", "limits", 1, high=view.co(high), effect="more than 100 % wants a unit of its own")


@per_loop
@warning("CK365", D140, "the upper output limit is {high}: one hundredth of the usual 100 %, or a fraction of 1")
def output_limit_looks_like_fraction(view: LoopView) -> Findings:
    """The output may not exceed 1 %.

    Why: the output is a percentage. Limits of [0, 1] are meant as the full range on other controllers; here the
    actuator hardly opens.

    Fix: write [0, 100], or give the unit in `output.unit` when the output really is scaled from 0 to 1.
    """
    limits = view.holds("output_lower", "output_upper")
    if limits and limits[0] < limits[1] and 0 < limits[1] <= 1 and (percent(view) or view.loop.output.pwm):
        yield view.at("output", "limits", 1, high=view.co(limits[1]))


@per_loop
@warning(
    "CK366",
    D141,
    "the pulses have a period of {period} s, longer than the reset_time of {reset} s: the PV follows single pulses",
)
def pwm_period_beyond_reset(view: LoopView) -> Findings:
    """The pulse period is longer than the reset time.

    Why: within one period the actuator is fully on and fully off. A process that is fast enough for this reset time
    swings with the pulses, and the loop answers the swing.

    Fix: shorten the period to a small part of the reset time. A relay that is to be spared wants a slower loop.
    """
    pwm, reset = view.loop.output.pwm, view.loop.tuning.reset_time
    if pwm is not None and reset < pwm.period and view.sound("reset_time", "pwm_period"):
        yield view.at("output", "pwm", "period", period=decimal_text(pwm.period), reset=decimal_text(reset))


@per_loop
@info(
    "CK367",
    D141,
    "the pulses have a period of {period} s, and the output changes every {sample} s: {times} equal pulses "
    "between two calculations",
)
def pwm_period_below_sample_rate(view: LoopView) -> Findings:
    """The pulse period is shorter than the sample rate.

    Why: the output is the same until the next calculation, so shorter pulses control no better. A relay switches the
    more often for nothing.

    Fix: for a relay make the period at least as long as the sample rate; for a solid-state output it does no harm.
    """
    pwm, sample = view.loop.output.pwm, view.loop.sample_rate
    if pwm is not None and pwm.period < sample and view.sound("sample_rate", "pwm_period"):
        yield view.at(
            "output",
            "pwm",
            "period",
            period=decimal_text(pwm.period),
            sample=decimal_text(sample),
            times=number_text((sample / pwm.period).quantize(Decimal("0.1"))),
        )
