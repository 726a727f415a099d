"""Filters, delays and lags: times, gains and limits that stop them or pin their output."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.maps.nextopid import MOST_SAMPLES
from pidcfg.refs import NEXTOPID, Decision
from pidcfg.validate.rule import Findings, error, info, warning
from pidcfg.validate.rules.nextopid.program import TIME_CONSTANTS
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.nextopid.context import NextopidContext

DELAY = NEXTOPID.at("chapter 9: DelayTime")
TIME_CONSTANT = NEXTOPID.at("chapters 8, 10, 11 and 12: Error")
LIMITS = NEXTOPID.at("chapters 10 and 11: Error")
GAIN = NEXTOPID.at("chapters 10, 11 and 12: Gs, G")

D214 = Decision(
    214,
    "an output without room is an error",
    "Min_OutVar equal to Max_OutVar, as both are 0 when not given, is an error of lags and lead-lags; Min_OutVar above "
    "Max_OutVar is one of ControlLeadLag too, though its Error is not set then. A delay that is no whole number of "
    "samples is an info.",
    "A constant output is never what a block is for; a lead-lag that is limited twice in the wrong order gives one "
    "limit. Delays count calls.",
)

ROUNDING = Decimal("1e-6")
DELAYS = ("ControlDelay", "ControlDelayLag")
LAGS = ("ControlLag", "ControlDelayLag")
LIMITED = (*LAGS, "ControlLeadLag")


@error("NX642", DELAY, "DelayTime {time} is {count} samples of {sample} s; the block holds 100, that is {most} s")
def delay_too_long(context: NextopidContext) -> Findings:
    """A delay is longer than 100 samples.

    Why: the block has room for 100 samples. With a longer delay it stops with its Error, and its output stands still.

    Fix: lengthen the task's interval, or put several delays behind each other.
    """
    for view in context.of(*DELAYS):
        time, sample = view.number_of("DelayTime"), view.sample_time
        if time is not None and sample > 0 and time > MOST_SAMPLES * sample:
            yield view.at(
                "DelayTime",
                "Error",
                time=view.shown("DelayTime"),
                sample=number_text(sample),
                count=f"{float(time / sample):.6g}",
                most=number_text(MOST_SAMPLES * sample),
            )


@info("NX643", D214, "DelayTime {time} is {count} samples of {sample} s: it will be {whole} s")
def delay_between_samples(context: NextopidContext) -> Findings:
    """A delay is no whole number of samples.

    Why: the block delays by calls. Between two of them there is nothing; the delay is one of the two next to it.

    Fix: give a whole multiple of the sample time, if the difference matters.
    """
    for view in context.of(*DELAYS):
        time, sample = view.number_of("DelayTime"), view.sample_time
        if time is not None and time > 0 and sample > 0 and _is_between(time / sample):
            yield view.at(
                "DelayTime",
                time=view.shown("DelayTime"),
                sample=number_text(sample),
                whole=number_text(round(time / sample) * sample),
                count=f"{float(time / sample):.6g}",
            )


def _is_between(samples: Decimal) -> bool:
    """Whether a number of samples is not whole, apart from what single precision makes of it."""
    return abs(samples - round(samples)) > samples * ROUNDING


@error("NX644", TIME_CONSTANT, "{key} is {time}; it must be above 0")
def time_constant_not_positive(context: NextopidContext) -> Findings:
    """The time constant of a filter or lag is 0 or negative.

    Why: the block stops with its Error, and its output stands still. 0 does not mean "no filter".

    Fix: give a time above 0, or leave the block out.
    """
    for view in context.of(*TIME_CONSTANTS):
        key = TIME_CONSTANTS[view.type]
        time = view.number_of(key)
        if time is not None and time <= 0:
            yield view.at(key, "Error", key=key, time=view.shown(key))


@error("NX645", LIMITS, "Min_OutVar {low} is above Max_OutVar {high}")
def output_limits_crossed(context: NextopidContext) -> Findings:
    """The lower limit of an output is above the upper one.

    Why: a lag stops with its Error; the output of a lead-lag stays at one of the two.

    Fix: exchange them.
    """
    for view in context.of(*LIMITED):
        low, high = view.number_of("Min_OutVar"), view.number_of("Max_OutVar")
        if low is not None and high is not None and low > high:
            yield view.at(
                "Min_OutVar",
                "Error" if view.type in LAGS else None,
                low=view.shown("Min_OutVar"),
                high=view.shown("Max_OutVar"),
            )


@error("NX646", D214, "Min_OutVar and Max_OutVar are both {value}{how}: OutVar never moves")
def output_pinned(context: NextopidContext) -> Findings:
    """The limits of an output leave it a single value.

    Why: parameters that are not given are 0, and so the output is 0 for ever: a process that does not answer, or a
    feed-forward that does not act.

    Fix: give Min_OutVar and Max_OutVar.
    """
    for view in context.of(*LIMITED):
        low, high = view.number_of("Min_OutVar"), view.number_of("Max_OutVar")
        if low is not None and low == high:
            how = "" if view.is_given("Min_OutVar") or view.is_given("Max_OutVar") else ", as they are when not given"
            yield view.at("Max_OutVar", value=view.shown("Max_OutVar"), how=how)


@error("NX647", LIMITS, "Init_OutVar {value} is {side} {limit} {end}")
def initial_output_outside_limits(context: NextopidContext) -> Findings:
    """The first output of a lag is outside its limits.

    Why: the block stops with its Error. Init_OutVar is 0 when it is not given, which may lie below Min_OutVar.

    Fix: give an Init_OutVar inside the limits.
    """
    for view in context.of(*LAGS):
        value, low, high = (view.number_of(key) for key in ("Init_OutVar", "Min_OutVar", "Max_OutVar"))
        if value is None or low is None or high is None or low >= high or low <= value <= high:
            continue
        side, limit = ("below", "Min_OutVar") if value < low else ("above", "Max_OutVar")
        yield view.at(
            "Init_OutVar", "Error", value=view.shown("Init_OutVar"), side=side, limit=limit, end=view.shown(limit)
        )


@warning("NX648", GAIN, "{key} is 0{how}: the output does not depend on InVar")
def gain_of_zero(context: NextopidContext) -> Findings:
    """The gain of a lag or lead-lag is 0.

    Why: the block puts out its offset, or 0. A gain that is not given is 0, not 1.

    Fix: give the gain.
    """
    for view in context.of(*LIMITED):
        key = "Gs" if view.type in LAGS else "G"
        if view.number_of(key) == 0:
            known = view.known(key)
            how = ", as it is when not given" if not view.is_given(key) else known.source if known else ""
            yield view.at(key, key=key, how=how)
