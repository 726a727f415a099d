"""The P, I and D terms of the DL06, the form of the equation, and auto-tuning."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal

from pidcfg.encoders.codecs import EncodeError, bcd_digits, round_to_integer
from pidcfg.encoders.dl06.image import reset_value
from pidcfg.encoders.maps.dl06 import D01, RESET
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.references import DL06, Decision
from pidcfg.validate.rule import Finding, Findings, checklist, error, info, make_finding, per_loop, warning
from pidcfg.validate.rules.dl06.alarms import MAX_BCD, Dl06Context, LoopView, counts_text
from pidcfg.validate.shared_checks import number_text, value_or_switch_key

# --- The P, I and D terms: which are on, and values that do not do what they look like --------------------------------

TERMS = DL06.cite("P-I-D Loop Terms")
TERM_SUBSETS = DL06.cite("Using a Subset of PID Control")
DERIVATIVE_LIMIT = DL06.cite("Derivative Gain Limiting")
BIAS = DL06.cite("Bias Term")

D12 = Decision(
    12,
    "gain 0 leaves the integral at gain 1",
    "With gain 0 the coefficients are Ki = Ts/Ti and Kr = Td/Ts.",
    "The manual says that gain 0 removes the proportional term for integral-only loops, yet prints Ki = Kc·Ts/Ti, "
    "which would be 0; the DL405 manual of the same family gives these coefficients.",
)
D13 = Decision(
    13,
    "a derivative beyond 20 times the gain wants a limit",
    "A rate time of more than 20 samples with neither derivative gain limit nor PV filter is a warning.",
    "Td/Ts is the gain of the derivative term over the proportional one for a change within one sample; 20 is the "
    "largest limit that the CPU offers.",
)
MAX_DERIVATIVE_LIMIT = 20


@warning(
    "DL211",
    D01,
    "reset {value} {unit} is stored as {digits}: {one} {unit} by the manual's feature table (xxx.x), "
    "{two} {unit} by its text (xx.xx)",
)
def reset_has_two_readings(context: Dl06Context) -> Findings:
    """The manual contradicts itself about the decimals of the reset word, and the file takes no side.

    Why: the feature table says 0.1 to 999.8, the text says that all three gains are xx.xx. The wrong reading makes the
    integral ten times too strong or too weak, in every loop of the file.

    Fix: download, compare one reset value with the PID setup dialog, then write `reset_decimals: 1` (or 2) under `plc`;
    the warning goes away with it.
    """
    if "reset_decimals" not in context.config.plc.model_fields_set:
        yield from (_readings_finding(view) for view in context.loops if reset_digits(view) is not None)


def _readings_finding(view: LoopView) -> Finding:
    """The two times that the reset word of a loop may mean."""
    digits = reset_digits(view) or 0
    return view.report(
        "tuning",
        "reset",
        value=decimal_text(reset_value(view.loop)),
        unit=reset_unit(view),
        digits=f"{digits:04}",
        one=digits * RESET[1].step,
        two=digits * RESET[2].step,
    )


def reset_digits(view: LoopView) -> int | None:
    """The digits of the reset word; None where it has none."""
    try:
        return None if view.reset is None else bcd_digits(RESET[1].encode(reset_value(view.loop)))
    except EncodeError:
        return None


def reset_unit(view: LoopView) -> str:
    """The unit of the reset word, short."""
    return "min" if view.loop.tuning.reset_unit == "minutes" else "s"


@error(
    "DL212",
    TERMS,
    "reset {value} {unit} is stored as 9999, which switches the integral term off; the largest reset is {limit} {unit}",
)
def reset_is_the_off_code(context: Dl06Context) -> Findings:
    """A reset time is written as a number that the PLC takes for "no integral": 999.9, or 9999 as in the manual's text.

    Why: the word 9999 removes the integrator. As a number it looks like a very slow integral, and the loop keeps an
    offset that nobody can explain.

    Fix: write `reset: off` (0000) or `reset: off 9999` to switch the integral off, or a time below the code.
    """
    for view in context.loops:
        value = reset_value(view.loop)
        if value in view.off_resets:
            step = RESET[context.config.plc.reset_decimals].step
            yield view.report("tuning", "reset", value=decimal_text(value), unit=reset_unit(view), limit=9998 * step)


@error("DL502", TERMS, "reset is {value}; its word holds {least} to {most}{cure}")
def reset_beyond_its_word(context: Dl06Context) -> Findings:
    """A reset time has no place in its word: too long, too short, or negative.

    Why: the word has four digits of seconds or of minutes, and its ends 0000 and 9999 switch the integral off.

    Fix: write a time that the word holds; one that is too long in seconds gets its unit, and `reset_unit: minutes`. A
    time is never negative, the direction of control is `action`.
    """
    step = RESET[context.config.plc.reset_decimals].step
    for view in context.loops:
        value = reset_value(view.loop)
        if "reset" in view.misfits and value not in view.off_resets:
            unit = reset_unit(view)
            yield view.report(
                "tuning",
                "reset",
                value=f"{number_text(value)} {unit}",
                least=f"{decimal_text(step)} {unit}",
                most=f"{decimal_text(9998 * step)} {unit}",
                cure=_other_unit_cure(view, value, step),
            )


def _other_unit_cure(view: LoopView, value: Decimal, step: Decimal) -> str:
    """The same time in the other unit, where that has room for it."""
    if value <= 0:
        return "; a time is not negative, the direction of control is `action`"
    in_minutes = view.loop.tuning.reset_unit == "minutes"
    other = value * 60 if in_minutes else value / 60
    digits = round_to_integer(other / step)
    if not 0 < digits < MAX_BCD:
        return ""
    unit, key = ("s", "seconds") if in_minutes else ("min", "minutes")
    return f"; write `reset: {decimal_text(digits * step)} {unit}` and `reset_unit: {key}`"


@per_loop
@warning("DL503", TERMS, "reset is {value}, the code 0000: it switches the integral term off")
def reset_of_zero(view: LoopView) -> Findings:
    """A reset time of 0 is written, which is no time but a code.

    Why: the shorter the reset time, the stronger the integral, but 0 takes it out: the loop keeps an offset.

    Fix: write `reset: off` if that is meant, else a time.
    """
    if view.loop.tuning.reset.duration is not None and reset_value(view.loop) == 0:
        yield view.report("tuning", "reset", value=f"0 {reset_unit(view)}")


@per_loop
@info("DL213", D12, "gain is 0: no proportional term; {terms} as if the gain were 1")
def gain_of_zero(view: LoopView) -> Findings:
    """The gain is 0: the other terms act as if it were 1.

    Why: by the printed formula Ki = Kc·Ts/Ti a gain of 0 would switch everything off, yet the manual offers it for
    integral-only loops. The integral then moves the output by its full range each reset time at full error.

    Fix: check that the reset time was chosen for Ki = Ts/Ti; otherwise give a gain.
    """
    tuning = view.loop.tuning
    if tuning.gain == 0 and view.reset is not None and not tuning.rate:
        yield view.report("tuning", "gain", terms="the integral acts")


@per_loop
@error("DL214", TERM_SUBSETS, "gain 0, reset off and rate 0 s: no term is left, and the output never moves")
def no_control_term(view: LoopView) -> Findings:
    """Proportional, integral and derivative terms are all switched off.

    Why: in Auto the output stays where Manual left it, whatever the error is; the loop looks alive and controls
    nothing.

    Fix: give a gain (P, PI, PD or PID), or a reset time (I alone).
    """
    tuning = view.loop.tuning
    if tuning.gain == 0 and view.reset is None and tuning.rate == 0:
        yield view.report("tuning", "gain")


@per_loop
@info(
    "DL523",
    TERM_SUBSETS,
    "no integral: an error stays as long as the process needs another output than at the change to Auto",
)
def proportional_alone(view: LoopView) -> Findings:
    """A loop has a gain and no integral.

    Why: without an error the output is the bias (+04), which a change to Auto leaves where the output was. A heater
    that needs more later gives it only with the error that makes it. Where errors may be large that is what is wanted.

    Fix: give a reset time, or let the ladder program write the output that holds the set point to +04.
    """
    tuning = view.loop.tuning
    if view.reset is None and tuning.gain > 0 and "reset" not in view.misfits and view.loop.algorithm == "position":
        yield view.report("tuning", "reset")


@per_loop
@warning("DL215", TERM_SUBSETS, "rate is {rate} s with gain 0: {terms} alone is not among P, PI, PD, PID and I")
def derivative_without_proportional(view: LoopView) -> Findings:
    """Derivative alone, or integral and derivative without proportional.

    Why: the manual recommends none but P, PI, PD, PID and I, because most other combinations are inherently unstable: a
    derivative alone does not even know where the set point is.

    Fix: give a gain, or set the rate to 0.
    """
    tuning = view.loop.tuning
    if tuning.gain == 0 and tuning.rate > 0:
        terms = "D" if view.reset is None else "ID"
        yield view.report("tuning", "rate", rate=decimal_text(tuning.rate), terms=terms)


@per_loop
@warning(
    "DL216",
    BIAS,
    "reset is {reset} s, shorter than the sample_rate of {sample} s: each sample integrates {times} times the "
    "proportional action",
)
def integral_faster_than_proportional(view: LoopView) -> Findings:
    """The reset time is shorter than the time between two samples.

    Why: Ki = Kc·Ts/Ti then exceeds Kc: the integral answers an error more strongly than the proportional term within
    one sample, while the manual wants it to respond more slowly than the other two. Such a loop oscillates.

    Fix: lengthen the reset time, or sample at least ten times in a reset time.
    """
    reset, sample = view.reset, view.loop.sample_rate
    if reset is not None and 0 < reset < sample and "reset" not in view.misfits:
        yield view.report(
            "tuning", "reset", reset=decimal_text(reset), sample=decimal_text(sample), times=f"{sample / reset:.1f}"
        )


@per_loop
@warning(
    "DL217",
    DERIVATIVE_LIMIT,
    "the derivative gain limit is on with {limit}, so rate {rate} s has no effect; the limit's range is 1 to 20",
)
def derivative_limited_to_nothing(view: LoopView) -> Findings:
    """The derivative gain limit is on, but its word holds 0.

    Why: the manual accepts 0 to 20 in one place and says 1 to 20 in another. A limit of 0 leaves no derivative, which
    is the cause that the troubleshooting section names first when the rate seems to do nothing.

    Fix: give `derivative_gain_limit` a value from 1 to 20 (8 to 10 is usual), or switch the limit off.
    """
    loop, limit = view.loop, view.loop.derivative_gain_limit
    if view.derivative_limit_on and not limit and loop.tuning.rate > 0:
        key = value_or_switch_key(loop, "derivative_gain_limit")
        yield view.report(key, limit="no value" if limit is None else 0, rate=decimal_text(loop.tuning.rate))


@per_loop
@info("DL218", DERIVATIVE_LIMIT, "derivative_gain_limit is {limit}, but rate is 0 s: there is no derivative to limit")
def derivative_limit_without_rate(view: LoopView) -> Findings:
    """A derivative gain limit is set for a loop without a derivative term.

    Why: it does nothing; usually the rate was meant to be set, or was taken out during tuning.

    Fix: set the rate, or remove the limit.
    """
    loop, limit = view.loop, view.loop.derivative_gain_limit
    if limit and loop.tuning.rate == 0 and view.derivative_limit_on:
        yield view.report("derivative_gain_limit", limit=decimal_text(limit))


@per_loop
@warning(
    "DL219",
    D13,
    "rate {rate} s is {times} samples of {sample} s: one count of noise moves the output by {counts} counts "
    "for a sample, and neither derivative_gain_limit nor pv.filter is on",
)
def derivative_without_limit_or_filter(view: LoopView) -> Findings:
    """A strong derivative acts on an unfiltered PV without a gain limit.

    Why: a change of the PV within one sample is multiplied by Kr = Kc·Td/Ts. The derivative reacts badly to noise, and
    most loops tolerate only a little of it without going into wild oscillations.

    Fix: set `derivative_gain_limit` (1 to 20), filter the PV, or sample more slowly.
    """
    loop, sample = view.loop, view.loop.sample_rate
    strong = sample > 0 and loop.tuning.rate > MAX_DERIVATIVE_LIMIT * sample
    if strong and not view.derivative_limit_on and not view.pv_filter_on:
        times = loop.tuning.rate / sample
        spans = Decimal(view.scales["output"].format.span) / view.scales["pv"].format.span
        counts = times * (loop.tuning.gain or 1) * spans
        yield view.report(
            "tuning",
            "rate",
            rate=decimal_text(loop.tuning.rate),
            times=f"{times:.4g}",
            sample=decimal_text(sample),
            counts=f"{counts:.0f}",
        )


# ----------------------------------------------------------------------------------------------------------------------
# The form of the equation and what depends on it: bumpless transfer, bias freeze, and what the derivative acts on.

FEATURES = DL06.cite("PID Loop Feature Specifications")
FREEZE = DL06.cite("Bias Freeze")
BUMPLESS = DL06.cite("Bumpless Transfers")

D14 = Decision(
    14,
    "the DL06's derivative acts on the error",
    "`derivative: pv` is accepted for other CPUs of the family, with an info.",
    "The DL06 manual prints Kr·(e(n) − e(n−1)), the DL405 manual a derivative of the PV.",
)


@info("DL220", D14, "derivative is pv, but the DL06's manual prints a derivative of the error")
def derivative_of_another_cpu(context: Dl06Context) -> Findings:
    """The file says that the derivative acts on the PV, as on other CPUs of the family.

    Why: no word of the DL06 selects it; the choice only changes the simulation. With the derivative of the error, a
    step of the set point kicks the output, and a simulation with `pv` would hide that.

    Fix: remove `derivative: pv` unless the file is for another CPU of the family.
    """
    if context.config.plc.derivative == "pv":
        yield make_finding("plc", "derivative")


@per_loop
@error("DL221", BUMPLESS, "bumpless is II, but the velocity form needs Bumpless Transfer I")
def velocity_form_with_bumpless_two(view: LoopView) -> Findings:
    """The velocity form of the equation is combined with Bumpless Transfer II.

    Why: type II sets the bias, and the velocity form has no bias: the change to Auto would not be bumpless at all. The
    manual demands type I.

    Fix: write `bumpless: I`, or take the position form.
    """
    if view.loop.algorithm == "velocity" and view.loop.bumpless == "II":
        yield view.report("bumpless")


@per_loop
@warning(
    "DL222",
    FREEZE,
    "bias_freeze is on, but the output stays between {low} and {high}: it never reaches {ends} counts, where "
    "the bias would freeze",
)
def freeze_never_reached(view: LoopView) -> Findings:
    """Bias freeze is on while the output limits are narrower than the data range.

    Why: the freeze works only when the output reaches an end of the data range (0 and 4095 counts for 12-bit unipolar).
    Behind narrower limits the bias keeps integrating: the loop winds up and overshoots when it comes back, which the
    freeze was meant to prevent.

    Fix: set the output limits to the ends of the data range and limit the actuator elsewhere, or expect windup and
    remove `bias_freeze`.
    """
    if (
        view.loop.bias_freeze
        and view.loop.algorithm == "position"
        and (limits := view.register_values("output_low", "output_high"))
    ):
        data_format = view.scales["output"].format
        if limits[0] < limits[1] and (limits[0] > data_format.minimum or limits[1] < data_format.maximum):
            yield view.report(
                "bias_freeze",
                low=view.quote("output_low"),
                high=view.quote("output_high"),
                ends=f"{data_format.minimum} or {data_format.maximum}",
            )


@per_loop
@warning("DL223", FEATURES, "bias_freeze is on, but the velocity form has no bias to freeze")
def freeze_in_velocity_form(view: LoopView) -> Findings:
    """Bias freeze is on in a loop of the velocity form.

    Why: anti-windup is a feature of the position form. The velocity form keeps no integral sum, so the bit does
    nothing.

    Fix: remove `bias_freeze`, or take the position form.
    """
    if view.loop.bias_freeze and view.loop.algorithm == "velocity":
        yield view.report("bias_freeze")


@per_loop
@checklist(
    "DL521",
    FREEZE,
    "with the reset of {reset} s and without bias_freeze the bias goes on to the end of its range while the output "
    "stands at {low} or {high} counts",
)
def windup_not_prevented(view: LoopView) -> Findings:
    """A loop integrates while its output is at an end of the data range.

    Why: as long as there is an error the bias goes on to its own limit, although the output cannot follow. After a
    start-up or a lost signal it takes a long time to come back, and the PV overshoots meanwhile; the manual calls it
    reset windup. Loops whose output limits are narrower than the data range are not reported: there the freeze does
    not work.

    Fix: write `bias_freeze: true`, or see that the overshoot after a start-up does no harm.
    """
    loop, reset, limits = view.loop, view.reset, view.register_values("output_low", "output_high")
    if loop.bias_freeze or loop.algorithm != "position" or not limits or reset is None or "reset" in view.misfits:
        return
    data_format = view.scales["output"].format
    if reset > 0 and (limits[0], limits[1]) == (data_format.minimum, data_format.maximum):
        yield view.report("bias_freeze", low=limits[0], high=limits[1], reset=decimal_text(reset))


# ----------------------------------------------------------------------------------------------------------------------
# Auto-tuning: a start that nobody asked for, modes and limits that stop it, and the manual's two contradictions.

AUTOTUNE_STEPS = DL06.cite("Auto Tuning Procedure")
FILTER = DL06.cite("The DL06 Built-in Analog Filter")

D28 = Decision(
    28,
    "auto-tune starts with the PV 205 counts from the set point",
    "The PV must be at least 205 of 4095 counts below the set point for direct action, above it for reverse action.",
    "A note of the procedure says so; the paragraph on the error bit demands PV and SP within 5 % of full scale, "
    "which is the opposite. The procedure is followed.",
)
D29 = Decision(
    29,
    "a closed-loop auto-tune switches between the output limits",
    "Output limits at the ends of the data range set the error bit, and the gains are written all the same; narrower "
    "limits make the relay smaller and set no bit.",
    "The timing diagram switches between the upper and lower limit settings, while the error bit is said to come on "
    "when the output goes to the limits of the range.",
)
D1085 = Decision(
    1085,
    "the output limits do not hold an open-loop auto-tune",
    "Its step goes past +31, up to the end of the data range, where it ends with bit 13; a line of the checklist says "
    "so.",
    "The loop is in Manual, where the limits do not hold (D645). The figure of the open loop stops at the full scale "
    "positive limit; only that of the closed loop names the limit settings.",
)
START_DISTANCE, FULL_SCALE = 205, 4095
"""Counts of 12 bit; of another format that share of the span (D57)."""


@per_loop
@warning("DL296", AUTOTUNE_STEPS, "autotune.start is true: bit 7 of {word} is already 1 when the program is downloaded")
def autotune_start_preset(view: LoopView) -> Findings:
    """The start bit of auto-tuning is set in the download.

    Why: auto-tuning induces large changes of the output, and the manual warns of injury and damage. With the bit in the
    image it begins as soon as the PLC runs, with nobody watching, and overwrites gain, reset, rate and sample rate.

    Fix: remove `start`; start auto-tuning from the programming software or the ladder program.
    """
    if view.loop.autotune.start:
        yield view.report("autotune", "start", word=view.address_of("mode_setting_2"))


@per_loop
@warning("DL297", AUTOTUNE_STEPS, "{method}-loop auto-tuning is to start in mode {mode}; it needs the loop in {wanted}")
def autotune_in_wrong_mode(view: LoopView) -> Findings:
    """Auto-tuning is to start in a mode that its method does not work in.

    Why: the open-loop method steps the output and wants the loop in Manual; the closed-loop method is for a loop that
    is in Auto and cannot be shut down.

    Fix: choose the method that fits the mode.
    """
    tune, mode = view.loop.autotune, view.loop.mode
    wanted = "manual" if tune.method == "open" else "auto"
    if tune.start and mode != wanted:
        yield view.report("autotune", "method", method=tune.method, mode=mode, wanted=wanted)


@per_loop
@checklist("DL298", D29, "a closed-loop auto-tune switches the output between {low} and {high} only")
def autotune_between_narrow_limits(view: LoopView) -> Findings:
    """A closed-loop auto-tune is planned for a loop with narrowed output limits.

    Why: the relay switches between the output limits. Narrow ones make the PV's swing smaller, so that noise counts for
    more; the full range, on the other hand, is what the manual calls an error (DL501).

    Fix: see that the PV moves clearly; otherwise widen the limits while tuning, or use the open-loop method.
    """
    if (
        has_closed_loop_autotune(view)
        and view.register_values("output_low", "output_high")
        and not output_limit_at_an_end(view)
    ):
        yield view.report_key("autotune", low=view.quote("output_low"), high=view.quote("output_high"))


@per_loop
@checklist(
    "DL524",
    D1085,
    "an open-loop auto-tune steps the output up by 10 %, or 20 %, of its range, past the upper limit {high} too",
)
def autotune_steps_past_the_limit(view: LoopView) -> Findings:
    """An open-loop auto-tune is planned for a loop whose upper output limit is below the end of the data range.

    Why: the loop is in Manual meanwhile, where the output limits do not hold, and the manual stops the step at full
    scale only. A limit that protects the plant protects it after the auto-tune.

    Fix: start from an output that lies 20 % of the range below the limit.
    """
    high, tune = view.counts("output_high"), view.loop.autotune
    planned = "autotune" in view.loop.model_fields_set and tune.method == "open"
    if planned and high is not None and high < view.scales["output"].format.maximum:
        yield view.report_key("autotune", high=view.quote("output_high"))


@per_loop
@warning(
    "DL501",
    D29,
    "a closed-loop auto-tune switches the output between {low} and {high}, and an end of the range is an error by the "
    "manual: bit 13 of {word} comes on",
)
def autotune_relay_at_the_end_of_the_range(view: LoopView) -> Findings:
    """A closed-loop auto-tune is planned for a loop whose output limits reach an end of the data range.

    Why: "the bit will also turn on if the closed-loop method is in use, and the output goes to the limits of the
    range", yet the output limits are what the relay switches between. The simulated PLC sets the bit and writes the
    gains all the same; whether a real one does is open, so that gains with bit 13 on are not to be trusted.

    Fix: narrow `output.limits` at both ends while tuning, and read bit 13 of +06 before the gains are used.
    """
    if has_closed_loop_autotune(view) and output_limit_at_an_end(view):
        low, high = view.quote("output_low"), view.quote("output_high")
        yield view.report_key("autotune", low=low, high=high, word=view.address_of("mode_and_alarm_status"))


@per_loop
@info("DL508", FILTER, "a closed-loop auto-tune is planned without a PV filter, which the manual strongly recommends")
def autotune_without_filter(view: LoopView) -> Findings:
    """A closed-loop auto-tune is planned, and the PV filter is off.

    Why: the relay switches at each crossing of PV and set point; noise switches it too early. "We strongly recommend
    the use of a filter during auto tuning. You may disable the filter after auto tuning is complete."

    Fix: give `pv.filter` while tuning, or filter in the ladder program.
    """
    if has_closed_loop_autotune(view) and not view.pv_filter_on:
        yield view.report_key("autotune")


@per_loop
@checklist("DL509", AUTOTUNE_STEPS, "an auto-tune of type PI writes 0 to {word}: the rate of {rate} s is lost")
def autotune_of_pi_clears_the_rate(view: LoopView) -> Findings:
    """An auto-tune of type PI is planned for a loop with a rate time.

    Why: "if you select PI tuning, the auto tune procedure leaves the derivative gain at 0".

    Fix: tune with `type: PID`, or write the rate again afterwards.
    """
    tune, rate = view.loop.autotune, view.loop.tuning.rate
    if "autotune" in view.loop.model_fields_set and tune.type == "PI" and rate:
        yield view.report_key("autotune", word=view.address_of("rate"), rate=decimal_text(rate))


def has_closed_loop_autotune(view: LoopView) -> bool:
    """Whether the file speaks of a closed-loop auto-tune."""
    return "autotune" in view.loop.model_fields_set and view.loop.autotune.method == "closed"


def output_limit_at_an_end(view: LoopView) -> bool:
    """Whether an output limit is an end of the data range."""
    limits, data_format = view.register_values("output_low", "output_high"), view.scales["output"].format
    return bool(limits) and (limits[0] <= data_format.minimum or limits[1] >= data_format.maximum)


@per_loop
@info("DL299", D28, "{condition}")
def autotune_start_condition(view: LoopView) -> Findings:
    """Auto-tuning is planned, and the manual contradicts itself about when it starts.

    Why: the open-loop procedure wants the PV more than 205 counts from the set point, below it for direct and above it
    for reverse action; the text on the error bit wants both within 5 % of full scale, nearly the same number the other
    way round, and that is all it says about the closed loop.

    Fix: for the open loop move the set point that far from the PV before the start, for the closed loop leave it near;
    if bit 13 of +06 comes on, try the other reading.
    """
    if "autotune" in view.loop.model_fields_set:
        limit = start_distance(view)
        side = "below" if view.loop.action == "direct" else "above"
        condition = f"open-loop auto-tuning starts only with the PV at least {limit} {side} the set point"
        if view.loop.autotune.method == "closed":
            condition = f"closed-loop auto-tuning starts only with PV and set point within 5 % of full scale ({limit})"
        yield view.report_key("autotune", condition=condition)


def start_distance(view: LoopView) -> str:
    """The least distance of PV and set point for the open loop, the greatest one for the closed loop.

    Whole counts that pass; of a square-root loop hundredths, since the root of a PV is no whole number.
    """
    rounding = ROUND_CEILING if view.loop.autotune.method == "open" else ROUND_FLOOR
    root = view.loop.pv.square_root
    exact = START_DISTANCE * view.scales["sp"].full_counts / FULL_SCALE
    counts = exact.quantize(Decimal("0.01") if root else Decimal(1), rounding)
    return f"{counts_text(counts)} of the set point's scale" if root else view.distance(int(counts))
