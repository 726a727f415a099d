"""The P, I and D terms: which are on, and values that do not do what they look like."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.dl06.encode import reset_value
from pidcfg.encoders.maps.dl06 import D01, RESET
from pidcfg.encoders.words import EncodeError, bcd_digits, nearest
from pidcfg.refs import DL06, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Finding, Findings, error, info, per_loop, warning
from pidcfg.validate.rules.dl06.context import NINES
from pidcfg.validate.views import value_or_switch

if TYPE_CHECKING:
    from pidcfg.validate.rules.dl06.context import Dl06Context, LoopView

TERMS = DL06.at("P-I-D Loop Terms")
SUBSET = DL06.at("Using a Subset of PID Control")
DERIVATIVE_LIMIT = DL06.at("Derivative Gain Limiting")
BIAS = DL06.at("Bias Term")

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
LARGEST_LIMIT = 20


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
        yield from (_two_readings(view) for view in context.loops if reset_digits(view) is not None)


def _two_readings(view: LoopView) -> Finding:
    """The two times that the reset word of a loop may mean."""
    digits = reset_digits(view) or 0
    return view.at(
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
            yield view.at("tuning", "reset", value=decimal_text(value), unit=reset_unit(view), limit=9998 * step)


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
            yield view.at(
                "tuning",
                "reset",
                value=f"{decimal_text(value)} {unit}",
                least=f"{decimal_text(step)} {unit}",
                most=f"{decimal_text(9998 * step)} {unit}",
                cure=_cure(view, value, step),
            )


def _cure(view: LoopView, value: Decimal, step: Decimal) -> str:
    """The same time in the other unit, where that has room for it."""
    if value <= 0:
        return "; a time is not negative, the direction of control is `action`"
    minutes = view.loop.tuning.reset_unit == "minutes"
    other = value * 60 if minutes else value / 60
    digits = nearest(other / step)
    if not 0 < digits < NINES:
        return ""
    unit, key = ("s", "seconds") if minutes else ("min", "minutes")
    return f"; write `reset: {decimal_text(digits * step)} {unit}` and `reset_unit: {key}`"


@per_loop
@warning("DL503", TERMS, "reset is {value}, the code 0000: it switches the integral term off")
def reset_of_zero(view: LoopView) -> Findings:
    """A reset time of 0 is written, which is no time but a code.

    Why: the shorter the reset time, the stronger the integral, but 0 takes it out: the loop keeps an offset.

    Fix: write `reset: off` if that is meant, else a time.
    """
    if view.loop.tuning.reset.duration is not None and reset_value(view.loop) == 0:
        yield view.at("tuning", "reset", value=f"0 {reset_unit(view)}")


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
        yield view.at("tuning", "gain", terms="the integral acts")


@per_loop
@error("DL214", SUBSET, "gain 0, reset off and rate 0 s: no term is left, and the output never moves")
def no_control_term(view: LoopView) -> Findings:
    """Proportional, integral and derivative terms are all switched off.

    Why: in Auto the output stays where Manual left it, whatever the error is; the loop looks alive and controls
    nothing.

    Fix: give a gain (P, PI, PD or PID), or a reset time (I alone).
    """
    tuning = view.loop.tuning
    if tuning.gain == 0 and view.reset is None and tuning.rate == 0:
        yield view.at("tuning", "gain")


@per_loop
@warning("DL215", SUBSET, "rate is {rate} s with gain 0: {terms} alone is not among P, PI, PD, PID and I")
def derivative_without_proportional(view: LoopView) -> Findings:
    """Derivative alone, or integral and derivative without proportional.

    Why: the manual recommends none but P, PI, PD, PID and I, because most other combinations are inherently unstable: a
    derivative alone does not even know where the set point is.

    Fix: give a gain, or set the rate to 0.
    """
    tuning = view.loop.tuning
    if tuning.gain == 0 and tuning.rate > 0:
        terms = "D" if view.reset is None else "ID"
        yield view.at("tuning", "rate", rate=decimal_text(tuning.rate), terms=terms)


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
        yield view.at(
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
    if view.derivative_limited and not limit and loop.tuning.rate > 0:
        key = value_or_switch(loop, "derivative_gain_limit")
        yield view.at(key, limit="no value" if limit is None else 0, rate=decimal_text(loop.tuning.rate))


@per_loop
@info("DL218", DERIVATIVE_LIMIT, "derivative_gain_limit is {limit}, but rate is 0 s: there is no derivative to limit")
def derivative_limit_without_rate(view: LoopView) -> Findings:
    """A derivative gain limit is set for a loop without a derivative term.

    Why: it does nothing; usually the rate was meant to be set, or was taken out during tuning.

    Fix: set the rate, or remove the limit.
    """
    loop, limit = view.loop, view.loop.derivative_gain_limit
    if limit and loop.tuning.rate == 0 and view.derivative_limited:
        yield view.at("derivative_gain_limit", limit=decimal_text(limit))


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
    strong = sample > 0 and loop.tuning.rate > LARGEST_LIMIT * sample
    if strong and not view.derivative_limited and not view.filtered:
        times = loop.tuning.rate / sample
        spans = Decimal(view.scales["output"].format.span) / view.scales["pv"].format.span
        counts = times * (loop.tuning.gain or 1) * spans
        yield view.at(
            "tuning",
            "rate",
            rate=decimal_text(loop.tuning.rate),
            times=f"{times:.4g}",
            sample=decimal_text(sample),
            counts=f"{counts:.0f}",
        )
