"""The P, I and D terms of the CLICK, the derivative's gain limit, and the error term's square and deadband."""

from __future__ import annotations

from decimal import Decimal

from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.references import CLICK, Decision
from pidcfg.validate import shared_checks
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning
from pidcfg.validate.rules.click.setup import NO_INTEGRAL, NO_LIMIT, LoopView
from pidcfg.validate.rules.click.signals import limited_setpoint, setpoint_in_file
from pidcfg.validate.shared_checks import number_text, value_or_switch_key

# --- The P, I and D terms: which are on, and values that do not do what they look like --------------------------------

RESET = CLICK.cite("Integral or Reset Time (DFn+06)")
FREEZE = CLICK.cite("Freeze Bias (Anti-Windup) (Cn+05)")

D134 = Decision(
    134,
    "a proportional band below 1 % of the range is a warning",
    "When an error of less than a hundredth of the PV's range drives the output through all of its limits, the gain is "
    "a warning; when an error of the whole range moves it by less than 1 %, an info.",
    "The gain is in % of output per unit of the PV, which is easily taken for % per %. Below 1 % a loop acts like a "
    "switch, and sensors and converters are hardly better than that.",
)
SWITCH_SPAN_RATIO = Decimal(100)


def output_travel(view: LoopView) -> Decimal | None:
    """How far the output may move, in %; None when its limits leave nothing."""
    low, high = view.loop.output.limits
    return high - low if high > low else None


def saturating_error(view: LoopView) -> Decimal | None:
    """The error that drives the output through its limits by the proportional term alone, in the PV's unit."""
    travel, gain = output_travel(view), view.loop.tuning.proportional_gain
    if travel is None or gain <= 0:
        return None
    linear = travel / gain
    return linear.sqrt() if view.error_squared_on else linear


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
    if reset < sample and view.has_no_error_at("reset_time", "sample_rate"):
        yield view.report(
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
    if view.loop.tuning.reset_time >= NO_INTEGRAL and view.has_no_error_at("reset_time"):
        yield view.report("tuning", "reset_time", reset=decimal_text(view.loop.tuning.reset_time))


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
    if (
        error is not None
        and view.span is not None
        and error * SWITCH_SPAN_RATIO < view.span
        and view.has_no_error_at("proportional_gain")
    ):
        yield view.report(
            "tuning",
            "proportional_gain",
            gain=number_text(view.loop.tuning.proportional_gain),
            error=four_digits_text(view, error),
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
    moves = gain * (width * width if view.error_squared_on else width)
    if moves < 1 and view.has_no_error_at("proportional_gain"):
        yield view.report(
            "tuning", "proportional_gain", gain=number_text(gain), span=view.eu(width), moves=f"{float(moves):.2g} %"
        )


def four_digits_text(view: LoopView, value: Decimal) -> str:
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
    if (
        view.integrates
        and view.has_no_error_at("reset_time")
        and not view.loop.freeze_bias
        and output_travel(view) is not None
    ):
        low, high = view.loop.output.limits
        yield view.report(
            "freeze_bias",
            low=view.co_text(low),
            high=view.co_text(high),
            reset=decimal_text(view.loop.tuning.reset_time),
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
        yield view.report("freeze_bias", reset=decimal_text(view.loop.tuning.reset_time))


# --- The derivative term and its gain limit ---------------------------------------------------------------------------

LIMIT = CLICK.cite("Derivative Gain Limit")

D135 = Decision(
    135,
    "a derivative beyond 20 samples wants a limit",
    "A derivative gain of more than 20 sample rates with neither derivative gain limit nor PV filter is a warning.",
    "Td/Ts is the gain of the derivative over the proportional term for a change within one sample; 20 is the upper "
    "end of the limits that the help calls typical.",
)
D136 = Decision(
    136,
    "a derivative gain beyond half the reset time is a warning",
    "Td above Ti/2 is reported for loops that integrate.",
    "Tuning rules for this form of the algorithm give Ti/8 to Ti/4; beyond that the two terms work against each other.",
)
D137 = Decision(
    137,
    "a kick that fills the output is an info",
    "It is reported when a step of the set point by a tenth of the PV's range moves the output by 100 % or more "
    "through the derivative alone, and the derivative has no gain limit.",
    "The topic prints a derivative of the error, so that steps of the set point count as well; it gives no number.",
)
TYPICAL_LIMITS = (8, 20)
TIME_REGISTERS = ("reset_time", "derivative_gain")
GAIN_REGISTERS = ("proportional_gain", "derivative_gain")
SETPOINT_STEP_SHARE = Decimal("0.1")
FULL_OUTPUT = Decimal(100)


def derivative_limit_in_use(view: LoopView) -> Decimal | None:
    """The limit's factor; None when it is off or filters nothing."""
    limit = view.register_value("derivative_gain_limit") if view.derivative_limit_on else None
    return None if limit is None or limit >= NO_LIMIT else limit


def has_pv_filter(view: LoopView) -> bool:
    """Whether the PV is filtered by something less than 100 %."""
    constant = view.register_value("filter")
    return view.pv_filter_on and constant is not None and constant < NO_LIMIT


@per_loop
@warning(
    "CK341",
    LIMIT,
    "the derivative gain limit is on with {limit}, which is no derivative: derivative_gain {gain} s has no effect",
)
def derivative_limited_to_nothing(view: LoopView) -> Findings:
    """The derivative gain limit is on, but its register holds 0.

    Why: a factor of 0 is the same as a derivative gain of 0. A limit that is enabled without a value holds 0.

    Fix: give `derivative_gain_limit` a value from 8 to 20, or switch the limit off.
    """
    loop, limit = view.loop, view.loop.derivative_gain_limit
    if view.derivative_limit_on and not limit and loop.tuning.derivative_gain > 0:
        key = value_or_switch_key(loop, "derivative_gain_limit")
        yield view.report(key, limit="no value" if limit is None else 0, gain=decimal_text(loop.tuning.derivative_gain))


@per_loop
@info("CK342", LIMIT, "derivative_gain_limit is {limit}, but derivative_gain is 0 s: there is no derivative to limit")
def derivative_limit_without_derivative(view: LoopView) -> Findings:
    """A derivative gain limit is set for a loop without a derivative.

    Why: it does nothing; usually the derivative gain was meant to be set, or was taken out during tuning.

    Fix: set `derivative_gain`, or remove the limit.
    """
    limit = derivative_limit_in_use(view)
    if limit and view.loop.tuning.derivative_gain == 0:
        yield view.report("derivative_gain_limit", limit=decimal_text(limit))


@per_loop
@warning(
    "CK343",
    D135,
    "derivative_gain {gain} s is {times} samples of {sample} s: noise of one unit moves the output by {moves} "
    "for a sample, and neither derivative_gain_limit nor pv.filter is on",
)
def derivative_without_limit_or_filter(view: LoopView) -> Findings:
    """A strong derivative acts on an unfiltered PV without a gain limit.

    Why: a change within one sample is multiplied by Kp·Td/Ts, so noise is amplified significantly and the output
    becomes erratic. A limit of 100 filters nothing.

    Fix: set `derivative_gain_limit` (8 to 20), filter the PV, or sample more slowly.
    """
    tuning, sample = view.loop.tuning, view.loop.sample_rate
    if (
        not has_pv_filter(view)
        and derivative_limit_in_use(view) is None
        and view.has_no_error_at("sample_rate", "derivative_gain")
    ):
        times = tuning.derivative_gain / sample
        if times > TYPICAL_LIMITS[1]:
            move_text = f"{float(times * tuning.proportional_gain):.3g} {view.loop.output.unit or '%'}"
            yield view.report(
                "tuning",
                "derivative_gain",
                gain=decimal_text(tuning.derivative_gain),
                times=f"{float(times):.4g}",
                sample=decimal_text(sample),
                moves=move_text,
            )


@per_loop
@info("CK344", LIMIT, "derivative_gain_limit is {limit}; 8 to 20 is typical: {effect}")
def derivative_limit_untypical(view: LoopView) -> Findings:
    """The derivative gain limit is outside the range that the help calls typical.

    Why: below 8 so little of the derivative is left that it can be left out; far above 20 noise passes as if there were
    no limit, and 100 is none at all.

    Fix: choose 8 to 20.
    """
    limit = view.register_value("derivative_gain_limit")
    if not view.derivative_limit_on or not limit or view.loop.tuning.derivative_gain <= 0:
        return
    if not TYPICAL_LIMITS[0] <= limit <= TYPICAL_LIMITS[1]:
        effect = "little of the derivative is left" if limit < TYPICAL_LIMITS[0] else "much of the noise passes"
        if limit >= NO_LIMIT:
            effect = "100 filters nothing"
        yield view.report("derivative_gain_limit", limit=decimal_text(limit), effect=effect)


@per_loop
@warning("CK345", D136, "derivative_gain {gain} s is more than half the reset_time of {reset} s")
def derivative_exceeds_reset(view: LoopView) -> Findings:
    """The derivative time is long compared with the reset time.

    Why: the derivative then works against the integral instead of leading it, and the loop swings. Usually minutes and
    seconds were mixed up, or the two values exchanged.

    Fix: a quarter of the reset time is the most that tuning rules give.
    """
    tuning = view.loop.tuning
    if view.integrates and tuning.reset_time < 2 * tuning.derivative_gain and view.has_no_error_at(*TIME_REGISTERS):
        yield view.report(
            "tuning",
            "derivative_gain",
            gain=decimal_text(tuning.derivative_gain),
            reset=decimal_text(tuning.reset_time),
        )


@per_loop
@info(
    "CK346",
    D137,
    "the derivative is of the error: a set point step of {step} (10 % of the range) moves the output by {kick} "
    "% for a sample",
)
def setpoint_step_kicks_output(view: LoopView) -> Findings:
    """A step of the set point kicks the output through the derivative.

    Why: the algorithm differentiates the error, not the PV, so that a change of the set point counts as an infinitely
    fast change of the process. The output jumps to a limit for a sample and back.

    Fix: change the set point in small steps, set `derivative_gain_limit`, or do without the derivative.
    """
    tuning, sample = view.loop.tuning, view.loop.sample_rate
    if (
        derivative_limit_in_use(view) is not None
        or view.error_squared_on
        or not view.has_no_error_at("sample_rate", *GAIN_REGISTERS)
        or view.span is None
    ):
        return
    step = SETPOINT_STEP_SHARE * view.span
    kick = tuning.proportional_gain * tuning.derivative_gain / sample * step
    if kick >= FULL_OUTPUT:
        yield view.report("tuning", "derivative_gain", step=view.eu(step), kick=f"{float(kick):.4g}")


# --- The error term: its square and its deadband ----------------------------------------------------------------------

SQUARED = CLICK.cite("Error Squared Option")
DEADBAND = CLICK.cite("Error Deadband Option")

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


def deadband_half_width(view: LoopView) -> Decimal | None:
    """How far the PV may be from the set point without control action; None when the deadband does nothing."""
    value = view.register_value("deadband")
    if not view.deadband_on or value is None or value <= 0:
        return None
    return value.sqrt() if view.error_squared_on else value


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
    full_error = saturating_error(view)
    if view.error_squared_on and full_error is not None:
        yield view.report(
            "error",
            "curve",
            gain=view.loop.tuning.proportional_gain,
            one=view.eu(Decimal(1)),
            full=f"one of {four_digits_text(view, full_error)}",
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
    width, value = deadband_half_width(view), view.register_value("deadband")
    if view.error_squared_on and width is not None and value is not None and width != value:
        yield view.report(
            "error",
            "deadband",
            value=view.loop.error.deadband,
            width=four_digits_text(view, width),
            linear=view.eu(value),
        )


@per_loop
@warning("CK353", DEADBAND, "the error deadband is on with {value}: it ignores nothing")
def deadband_of_zero(view: LoopView) -> Findings:
    """The error deadband is on, but its register holds 0.

    Why: a deadband that is enabled without a value is 0, and the output follows every noise of the PV.

    Fix: give a deadband, or switch it off.
    """
    return shared_checks.zero_deadband_findings(view)


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
    width = deadband_half_width(view)
    if width is not None and view.span is not None and width >= view.span:
        yield view.report("error", "deadband", width=four_digits_text(view, width), span=view.eu(view.span))


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
    width, setpoint = deadband_half_width(view), setpoint_in_file(view)
    if width is not None and (view.span is None or width < view.span):
        setpoint = None if setpoint is None else limited_setpoint(view, setpoint)
        alarm = shared_checks.nearby_alarm(view, width, setpoint, ("deviation", "deviation_high"))
        if alarm is not None:
            yield view.report(
                "error", "deadband", width=four_digits_text(view, width), alarm=alarm[0], limit=view.distance(alarm[1])
            )


@per_loop
@info("CK356", DEADBAND, "a deadband of {value} is stored, but {register} is off: every error is acted on")
def deadband_switched_off(view: LoopView) -> Findings:
    """A deadband is given, but not enabled.

    Why: its register shows up in every listing; without the enable bit it ignores nothing.

    Fix: remove `deadband_enabled: false`, or the deadband.
    """
    if view.loop.error.deadband and not view.deadband_on:
        yield view.report(
            "error", "deadband_enabled", value=view.quote("deadband"), register=view.register("deadband_enable")
        )
