"""Sample times, and times that are too short or too long beside them."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING

from pidcfg.refs import NEXTOPID, Decision
from pidcfg.schemas.nextopid import LONGEST_SAMPLE, SHORTEST_INTEGRAL
from pidcfg.validate.rule import Finding, Findings, error, info, per_pid, warning
from pidcfg.validate.rules.nextopid.program import TIME_CONSTANTS, BlockView
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.nextopid.context import NextopidContext

ERRORS = NEXTOPID.at("chapter 2: ErrBits, and SampleTime")
INTEGRAL = NEXTOPID.at("chapter 2: Ti_Ki")
FILTER = NEXTOPID.at("chapter 2: Tfd")
VARIATION = NEXTOPID.at("chapter 2: MaxVarMV")

D213 = Decision(
    213,
    "times that are short or long beside the sample time",
    "A task below 1 ms and an integral time below the sample time are warnings, a filter or lag below it an info. "
    "0.1 % of the PV range that moves MV by more than 10 % of its range through an unfiltered derivative is a warning, "
    "and so is a MaxVarMV with which a full stroke takes more than 10 minutes.",
    "Ki Ts / Kp above 1 adds more than the whole error in a cycle; 0.1 % is the noise of a common transmitter; "
    "MaxVarMV counts per cycle, and values meant per second or minute are off by that factor.",
)
SHORTEST_TASK = Decimal("0.001")
NOISE = Decimal("0.001")
"""Of the PV range."""
JOLT = Decimal("0.1")
"""Of the MV range."""
LONG_STROKE = Decimal(600)


@per_pid
@error("NX624", ERRORS, "a sample time of {time} s is above the 60 s that the block allows")
def sample_time_above_60_s(view: BlockView) -> Findings:
    """A PID controller is called less often than once in 60 s.

    Why: the block measures the time between its calls, and stops with an error bit above 60 s.

    Fix: call it more often; a slow process is served by small gains, not by long intervals.
    """
    if view.sample_time > LONGEST_SAMPLE:
        yield view.at("sample_time", "ErrBits.SampleTime", time=number_text(view.sample_time))


@error("NX625", ERRORS, "sample_time is {time} s; it must be above 0")
def sample_time_not_positive(context: NextopidContext) -> Findings:
    """A sample time is 0 or negative.

    Why: no task can be called at such an interval, and the block divides by it.

    Fix: give the interval of the cyclic task.
    """
    places = [("plc", "sample_time")] + [(*v.placed.place, "sample_time") for v in context.controllers]
    times = [context.config.plc.sample_time] + [v.item.sample_time for v in context.controllers]
    for place, time in zip(places, times, strict=True):
        if time is not None and time <= 0:
            yield Finding(place, {"time": number_text(time)})


@error("NX626", ERRORS, "sample_time {time} s is no whole multiple of the task's {task} s")
def sample_time_not_a_multiple(context: NextopidContext) -> Findings:
    """A loop's own sample time does not fit the task that calls it.

    Why: a loop can be called in every n-th cycle of the task and at no other time; its gains would belong to another
    interval.

    Fix: give a whole multiple of `plc.sample_time`.
    """
    task = context.config.plc.sample_time
    for view in context.controllers:
        if task > 0 and view.sample_time > 0 and (Fraction(view.sample_time) / Fraction(task)).denominator > 1:
            yield view.at("sample_time", time=number_text(view.sample_time), task=number_text(task))


@warning("NX627", D213, "a sample time of {time} s is below 1 ms, the resolution of the PLC's clock")
def task_below_1_ms(context: NextopidContext) -> Findings:
    """The task is called more often than the time can be measured.

    Why: the blocks measure the time between two calls. Where the clock counts whole milliseconds they see 0 or 1 ms.
    Often it is a time in seconds that was meant in milliseconds.

    Fix: give the interval in seconds, or with its unit, such as `100 ms`.
    """
    time = context.config.plc.sample_time
    if 0 < time < SHORTEST_TASK:
        yield Finding(("plc", "sample_time"), {"time": number_text(time)})


@per_pid
@info("NX628", FILTER, "Tfd {time} is shorter than the sample time of {sample} s: it filters next to nothing")
def derivative_filter_below_sample_time(view: BlockView) -> Findings:
    """The filter of the derivative is shorter than the time between two calculations.

    Why: within one cycle the filter has followed by 63 % or more; noise passes as if there were none.

    Fix: give several sample times, or 0 for no filter.
    """
    time = view.number_of("Tfd")
    if time is not None and 0 < time < view.sample_time and view.derivative:
        yield view.at("Tfd", time=view.shown("Tfd"), sample=number_text(view.sample_time))


@info("NX629", D213, "{key} {time} is shorter than the sample time of {sample} s: the output follows within a cycle")
def lag_below_sample_time(context: NextopidContext) -> Findings:
    """A filter or lag is shorter than the time between two calculations.

    Why: it follows by 63 % or more within one cycle, and does next to nothing.

    Fix: give several sample times, or leave the block out.
    """
    for view in context.of(*TIME_CONSTANTS):
        key = TIME_CONSTANTS[view.type]
        time = view.number_of(key)
        if time is not None and 0 < time < view.sample_time:
            yield view.at(key, key=key, time=view.shown(key), sample=number_text(view.sample_time))


@per_pid
@warning("NX630", INTEGRAL, "Ti_Ki {time} is below 0.001 s: the block takes it as no integral")
def integral_time_below_1_ms(view: BlockView) -> Findings:
    """An integral time is so short that the block switches the integral off.

    Why: below 0.001 s the dependent form has no integral at all, where the strongest one was written. An error stays.

    Fix: give the integral time in seconds; or 0 where no integral is wanted.
    """
    time = view.number_of("Ti_Ki")
    if view.is_on("Indep") is False and time is not None and 0 < time < SHORTEST_INTEGRAL:
        yield view.at("Ti_Ki", time=view.shown("Ti_Ki"))


@warning(
    "NX631",
    D213,
    "the integral time of {time} s{how} is shorter than the sample time of {sample} s: each cycle adds "
    "{factor} times what the error makes by Kp",
)
def integral_time_below_sample_time(context: NextopidContext) -> Findings:
    """The integral time is shorter than the time between two calculations.

    Why: the integral corrects more than the whole error in each cycle, before its effect can be seen. Such a loop
    swings. In the independent form Kp / Ki is the integral time; a Ti_Ki that was meant as a time makes it short.

    Fix: lengthen the integral time, lower Ki, or shorten the sample time.
    """
    for view in context.pids:
        gain, rate = view.number_of("Kp"), view.integral
        if not gain or not rate or gain <= 0 or rate <= 0 or context.has_time_as_gain(view, "Ti_Ki"):
            continue
        time = gain / rate
        if time < view.sample_time:
            how = " (Kp / Ki)" if view.is_on("Indep") else ""
            yield view.at(
                "Ti_Ki",
                time=f"{float(time):.4g}",
                how=how,
                sample=number_text(view.sample_time),
                factor=f"{float(view.sample_time / time):.3g}",
            )


@warning(
    "NX632",
    D213,
    "without Tfd, noise of 0.1 % of the PV range moves MV by {percent} % of its range through the derivative",
)
def derivative_without_filter(context: NextopidContext) -> Findings:
    """The derivative turns the noise of the PV into jolts of the output.

    Why: the derivative acts on the difference of two samples. With a large derivative gain, a short sample time and no
    filter, what no trend shows throws the valve about.

    Fix: give Tfd, a tenth to a third of the derivative time; or lower the derivative.
    """
    for view in context.pids:
        gain, pv, mv = view.derivative, view.pv_limits, view.mv_limits
        if gain is None or pv is None or mv is None or view.number_of("Tfd") != 0 or view.sample_time <= 0:
            continue
        if context.has_time_as_gain(view, "Td_Kd"):
            continue
        jolt = gain * (pv[1] - pv[0]) * NOISE / view.sample_time / (mv[1] - mv[0])
        if jolt > JOLT:
            yield view.at("Td_Kd", percent=f"{float(jolt) * 100:.3g}")


@per_pid
@warning("NX633", D213, "with MaxVarMV {rate} in a cycle of {sample} s, MV needs {time} s for its whole range")
def slow_mv(view: BlockView) -> Findings:
    """MaxVarMV makes the output very slow.

    Why: it is the largest change in one cycle, not in a second or a minute. A loop whose output cannot follow swings,
    however it is tuned.

    Fix: multiply what the valve may do in a second by the sample time.
    """
    rate, mv = view.number_of("MaxVarMV"), view.mv_limits
    if rate is not None and rate > 0 and mv is not None:
        time = (mv[1] - mv[0]) / rate * view.sample_time
        if time > LONG_STROKE:
            yield view.at(
                "MaxVarMV", rate=view.shown("MaxVarMV"), sample=number_text(view.sample_time), time=f"{float(time):.4g}"
            )


@per_pid
@info("NX634", VARIATION, "MaxVarMV {rate} is the whole range of MV or more: it never limits")
def mv_rate_without_effect(view: BlockView) -> Findings:
    """MaxVarMV is so large that it never acts.

    Why: MV cannot change by more than its range in a cycle. Somebody meant to protect the valve, and it is not.

    Fix: give the change in one cycle, or 0 for no limit.
    """
    rate, mv = view.number_of("MaxVarMV"), view.mv_limits
    if rate is not None and mv is not None and rate >= mv[1] - mv[0]:
        yield view.at("MaxVarMV", rate=view.shown("MaxVarMV"))
