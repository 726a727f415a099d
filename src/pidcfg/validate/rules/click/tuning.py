"""The P, I and D terms: which are on, and values that do not do what they look like."""

from __future__ import annotations

from decimal import Decimal

from pidcfg.refs import CLICK, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, checklist, info, per_loop, warning
from pidcfg.validate.rules.click.context import NO_INTEGRAL, LoopView
from pidcfg.validate.views import number_text

RESET = CLICK.at("Integral or Reset Time (DFn+06)")
FREEZE = CLICK.at("Freeze Bias (Anti-Windup) (Cn+05)")

D134 = Decision(
    134,
    "a proportional band below 1 % of the range is a warning",
    "When an error of less than a hundredth of the PV's range drives the output through all of its limits, the gain is "
    "a warning; when an error of the whole range moves it by less than 1 %, an info.",
    "The gain is in % of output per unit of the PV, which is easily taken for % per %. Below 1 % a loop acts like a "
    "switch, and sensors and converters are hardly better than that.",
)
BAND = Decimal(100)


def travel(view: LoopView) -> Decimal | None:
    """How far the output may move, in %; None when its limits leave nothing."""
    low, high = view.loop.output.limits
    return high - low if high > low else None


def saturating_error(view: LoopView) -> Decimal | None:
    """The error that drives the output through its limits by the proportional term alone, in the PV's unit."""
    way, gain = travel(view), view.loop.tuning.proportional_gain
    if way is None or gain <= 0:
        return None
    linear = way / gain
    return linear.sqrt() if view.squared else linear


@per_loop
@warning(
    "CK331",
    RESET,
    "reset_time is {reset} s, shorter than the sample_rate of {sample} s: each sample integrates {times} times "
    "the proportional action",
)
def integral_faster_than_proportional(view: LoopView) -> Findings:
    """The reset time is shorter than the time between two samples.

    Why: the error is multiplied by Kp·Ts/Ti each sample. With Ti below Ts the integral answers an error more strongly
    than the proportional term within one sample, and the loop oscillates.

    Fix: lengthen the reset time, or sample at least ten times in a reset time.
    """
    reset, sample = view.loop.tuning.reset_time, view.loop.sample_rate
    if reset < sample and view.sound("reset_time", "sample_rate"):
        yield view.at(
            "tuning",
            "reset_time",
            reset=decimal_text(reset),
            sample=decimal_text(sample),
            times=f"{sample / reset:.1f}",
        )


@per_loop
@checklist(
    "CK332",
    RESET,
    "reset_time is {reset} s: from about 1000 s on there is as good as no integral, and an error may stay",
)
def integral_as_good_as_off(view: LoopView) -> Findings:
    """The reset time is 1000 s or more.

    Why: the integral cannot be switched off; a very long reset time is how the help removes its effect. The output then
    stays around what Manual left, and a loop that was meant to have a slow integral keeps an offset for hours.

    Fix: see that a loop without an integral (or a very slow process) is meant; otherwise shorten the reset time.
    """
    if view.loop.tuning.reset_time >= NO_INTEGRAL and view.sound("reset_time"):
        yield view.at("tuning", "reset_time", reset=decimal_text(view.loop.tuning.reset_time))


@per_loop
@warning(
    "CK333",
    D134,
    "proportional_gain {gain} drives the output through its limits at an error of {error}, less than 1 % of "
    "the PV's range",
)
def gain_acts_like_a_switch(view: LoopView) -> Findings:
    """The proportional gain is so high that the smallest error saturates the output.

    Why: the gain is in % of output per unit of the PV (with `squared`, per unit squared): it depends on the unit, and
    one that was carried over from a controller with % per % can be a hundred times too high.

    Fix: divide a gain in % per % by the hundredth part of the range, or check the unit of the range.
    """
    error = saturating_error(view)
    if error is not None and view.span is not None and error * BAND < view.span and view.sound("proportional_gain"):
        yield view.at(
            "tuning",
            "proportional_gain",
            gain=number_text(view.loop.tuning.proportional_gain),
            error=approximate(view, error),
        )


@per_loop
@info("CK334", D134, "proportional_gain {gain}: an error of the whole range ({span}) moves the output by {moves} only")
def gain_moves_nothing(view: LoopView) -> Findings:
    """The proportional gain is so low that no error moves the output by 1 %.

    Why: the gain multiplies all three terms, so integral and derivative are as weak. The gain is in % of output per
    unit of the PV: a range of small numbers, such as 0 to 1 bar, needs a large gain.

    Fix: raise the gain, or check the unit of the range.
    """
    gain, width = view.loop.tuning.proportional_gain, view.span
    if width is None:
        return
    moves = gain * (width * width if view.squared else width)
    if moves < 1 and view.sound("proportional_gain"):
        yield view.at(
            "tuning", "proportional_gain", gain=number_text(gain), span=view.eu(width), moves=f"{float(moves):.2g} %"
        )


def approximate(view: LoopView, value: Decimal) -> str:
    """A derived number in the PV's unit, with four digits."""
    unit = f" {view.loop.pv.unit}" if view.loop.pv.unit else ""
    return f"{float(value):.4g}{unit}"


@per_loop
@warning(
    "CK335",
    FREEZE,
    "freeze_bias is off: while the output stands at {low} or {high}, the integral with reset_time {reset} s goes on",
)
def windup_not_prevented(view: LoopView) -> Findings:
    """A loop integrates while its output is at a limit.

    Why: as long as there is an error the bias keeps growing, although the output cannot follow. After a start-up or a
    lost signal it takes a long time to come back, and the PV overshoots meanwhile.

    Fix: write `freeze_bias: true`.
    """
    if view.integrates and view.sound("reset_time") and not view.loop.freeze_bias and travel(view) is not None:
        low, high = view.loop.output.limits
        yield view.at(
            "freeze_bias", low=view.co(low), high=view.co(high), reset=decimal_text(view.loop.tuning.reset_time)
        )


@per_loop
@info("CK336", FREEZE, "freeze_bias is on, but reset_time {reset} s leaves as good as no integral to stop")
def freeze_without_integral(view: LoopView) -> Findings:
    """The anti-windup is on for a loop without an integral.

    Why: it stops the integral at the limits of the output; with a reset time of 1000 s and more there is none to speak
    of.

    Fix: leave `freeze_bias` out, or shorten the reset time if an integral is meant.
    """
    if view.loop.freeze_bias and view.loop.tuning.reset_time >= NO_INTEGRAL:
        yield view.at("freeze_bias", reset=decimal_text(view.loop.tuning.reset_time))
