"""Filters, delays and lags of NextoPID, sample times, and loops whose process is part of the file."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

from pidcfg.encoders.maps.nextopid import MAX_DELAY_SAMPLES
from pidcfg.schemas.nextopid import MAX_SAMPLE_TIME, MIN_INTEGRAL_TIME
from pidcfg.text.references import NEXTOPID, Decision
from pidcfg.validate.rule import Finding, Findings, error, info, per_pid, warning
from pidcfg.validate.rules.nextopid.context import TIME_CONSTANTS, BlockView, FeedbackPath, NextopidContext, value_text
from pidcfg.validate.shared_checks import number_text

# --- Filters, delays and lags: times, gains and limits that stop them or pin their output -----------------------------

DELAY = NEXTOPID.cite("chapter 9: DelayTime")
TIME_CONSTANT = NEXTOPID.cite("chapters 8, 10, 11 and 12: Error")
LIMITS = NEXTOPID.cite("chapters 10 and 11: Error")
GAIN = NEXTOPID.cite("chapters 10, 11 and 12: Gs, G")

D214 = Decision(
    214,
    "an output without room is an error",
    "Min_OutVar equal to Max_OutVar, as both are 0 when not given, is an error of lags and lead-lags; Min_OutVar above "
    "Max_OutVar is one of ControlLeadLag too, though its Error is not set then. A delay that is no whole number of "
    "samples is an info.",
    "A constant output is never what a block is for; a lead-lag that is limited twice in the wrong order gives one "
    "limit. Delays count calls.",
)

ROUNDING_TOLERANCE = Decimal("1e-6")
DELAY_BLOCKS = ("ControlDelay", "ControlDelayLag")
LAG_BLOCKS = ("ControlLag", "ControlDelayLag")
LIMITED_BLOCKS = (*LAG_BLOCKS, "ControlLeadLag")


@error("NX642", DELAY, "DelayTime {time} is {count} samples of {sample} s; the block holds 100, that is {most} s")
def delay_too_long(context: NextopidContext) -> Findings:
    """A delay is longer than 100 samples.

    Why: the block has room for 100 samples. With a longer delay it stops with its Error, and its output stands still.

    Fix: lengthen the task's interval, or put several delays behind each other.
    """
    for view in context.blocks_of_type(*DELAY_BLOCKS):
        time, sample = view.number_of("DelayTime"), view.sample_time
        if time is not None and sample > 0 and time > MAX_DELAY_SAMPLES * sample:
            yield view.report(
                "DelayTime",
                "Error",
                time=view.quote("DelayTime"),
                sample=number_text(sample),
                count=f"{float(time / sample):.6g}",
                most=number_text(MAX_DELAY_SAMPLES * sample),
            )


@info("NX643", D214, "DelayTime {time} is {count} samples of {sample} s: it will be {whole} s")
def delay_between_samples(context: NextopidContext) -> Findings:
    """A delay is no whole number of samples.

    Why: the block delays by calls. Between two of them there is nothing; the delay is one of the two next to it.

    Fix: give a whole multiple of the sample time, if the difference matters.
    """
    for view in context.blocks_of_type(*DELAY_BLOCKS):
        time, sample = view.number_of("DelayTime"), view.sample_time
        if time is not None and time > 0 and sample > 0 and _is_between_samples(time / sample):
            yield view.report(
                "DelayTime",
                time=view.quote("DelayTime"),
                sample=number_text(sample),
                whole=number_text(round(time / sample) * sample),
                count=f"{float(time / sample):.6g}",
            )


def _is_between_samples(samples: Decimal) -> bool:
    """Whether a number of samples is not whole, apart from what single precision makes of it."""
    return abs(samples - round(samples)) > samples * ROUNDING_TOLERANCE


@error("NX644", TIME_CONSTANT, "{key} is {time}; it must be above 0")
def time_constant_not_positive(context: NextopidContext) -> Findings:
    """The time constant of a filter or lag is 0 or negative.

    Why: the block stops with its Error, and its output stands still. 0 does not mean "no filter".

    Fix: give a time above 0, or leave the block out.
    """
    for view in context.blocks_of_type(*TIME_CONSTANTS):
        key = TIME_CONSTANTS[view.type]
        time = view.number_of(key)
        if time is not None and time <= 0:
            yield view.report(key, "Error", key=key, time=view.quote(key))


@error("NX645", LIMITS, "Min_OutVar {low} is above Max_OutVar {high}")
def output_limits_crossed(context: NextopidContext) -> Findings:
    """The lower limit of an output is above the upper one.

    Why: a lag stops with its Error; the output of a lead-lag stays at one of the two.

    Fix: exchange them.
    """
    for view in context.blocks_of_type(*LIMITED_BLOCKS):
        low, high = view.number_of("Min_OutVar"), view.number_of("Max_OutVar")
        if low is not None and high is not None and low > high:
            yield view.report(
                "Min_OutVar",
                "Error" if view.type in LAG_BLOCKS else None,
                low=view.quote("Min_OutVar"),
                high=view.quote("Max_OutVar"),
            )


@error("NX646", D214, "Min_OutVar and Max_OutVar are both {value}{how}: OutVar never moves")
def output_pinned(context: NextopidContext) -> Findings:
    """The limits of an output leave it a single value.

    Why: parameters that are not given are 0, and so the output is 0 for ever: a process that does not answer, or a
    feed-forward that does not act.

    Fix: give Min_OutVar and Max_OutVar.
    """
    for view in context.blocks_of_type(*LIMITED_BLOCKS):
        low, high = view.number_of("Min_OutVar"), view.number_of("Max_OutVar")
        if low is not None and low == high:
            how = "" if view.is_given("Min_OutVar") or view.is_given("Max_OutVar") else ", as they are when not given"
            yield view.report("Max_OutVar", value=view.quote("Max_OutVar"), how=how)


@error("NX647", LIMITS, "Init_OutVar {value} is {side} {limit} {end}")
def initial_output_outside_limits(context: NextopidContext) -> Findings:
    """The first output of a lag is outside its limits.

    Why: the block stops with its Error. Init_OutVar is 0 when it is not given, which may lie below Min_OutVar.

    Fix: give an Init_OutVar inside the limits.
    """
    for view in context.blocks_of_type(*LAG_BLOCKS):
        value, low, high = (view.number_of(key) for key in ("Init_OutVar", "Min_OutVar", "Max_OutVar"))
        if value is None or low is None or high is None or low >= high or low <= value <= high:
            continue
        side, limit = ("below", "Min_OutVar") if value < low else ("above", "Max_OutVar")
        yield view.report(
            "Init_OutVar", "Error", value=view.quote("Init_OutVar"), side=side, limit=limit, end=view.quote(limit)
        )


@warning("NX648", GAIN, "{key} is 0{how}: the output does not depend on InVar")
def gain_of_zero(context: NextopidContext) -> Findings:
    """The gain of a lag or lead-lag is 0.

    Why: the block puts out its offset, or 0. A gain that is not given is 0, not 1.

    Fix: give the gain.
    """
    for view in context.blocks_of_type(*LIMITED_BLOCKS):
        key = "Gs" if view.type in LAG_BLOCKS else "G"
        if view.number_of(key) == 0:
            known = view.known_value(key)
            how = ", as it is when not given" if not view.is_given(key) else known.source if known else ""
            yield view.report(key, key=key, how=how)


# --- Sample times, and times that are too short or too long beside them -----------------------------------------------

ERRORS = NEXTOPID.cite("chapter 2: ErrBits, and SampleTime")
INTEGRAL = NEXTOPID.cite("chapter 2: Ti_Ki")
FILTER = NEXTOPID.cite("chapter 2: Tfd")
VARIATION = NEXTOPID.cite("chapter 2: MaxVarMV")

D213 = Decision(
    213,
    "times that are short or long beside the sample time",
    "A task below 1 ms and an integral time below the sample time are warnings, a filter or lag below it an info. "
    "0.1 % of the PV range that moves MV by more than 10 % of its range through an unfiltered derivative is a warning, "
    "and so is a MaxVarMV with which a full stroke takes more than 10 minutes.",
    "Ki Ts / Kp above 1 adds more than the whole error in a cycle; 0.1 % is the noise of a common transmitter; "
    "MaxVarMV counts per cycle, and values meant per second or minute are off by that factor.",
)
MIN_TASK_TIME = Decimal("0.001")
PV_NOISE_SHARE = Decimal("0.001")
"""Of the PV range."""
MAX_NOISE_SHARE = Decimal("0.1")
"""Of the MV range."""
MAX_STROKE_TIME = Decimal(600)


@per_pid
@error("NX624", ERRORS, "sample_time is {time} s, above the 60 s that the block allows")
def sample_time_above_60_s(view: BlockView) -> Findings:
    """A PID controller is called less often than once in 60 s.

    Why: the block measures the time between its calls, and stops with an error bit above 60 s.

    Fix: a bare number is in s: write `200 ms` or 0.2. Else call it more often; a slow process is served by small gains,
    not by long intervals.
    """
    if view.sample_time > MAX_SAMPLE_TIME:
        finding = view.report("sample_time", "ErrBits.SampleTime", time=number_text(view.sample_time))
        yield finding if view.item.sample_time is not None else replace(finding, path=("plc", "sample_time"))


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
            yield view.report("sample_time", time=number_text(view.sample_time), task=number_text(task))


@warning("NX627", D213, "a sample time of {time} s is below 1 ms, the resolution of the PLC's clock")
def task_below_1_ms(context: NextopidContext) -> Findings:
    """The task is called more often than the time can be measured.

    Why: the blocks measure the time between two calls. Where the clock counts whole milliseconds they see 0 or 1 ms.
    Often it is a time in seconds that was meant in milliseconds.

    Fix: give the interval in seconds, or with its unit, such as `100 ms`.
    """
    time = context.config.plc.sample_time
    if 0 < time < MIN_TASK_TIME:
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
        yield view.report("Tfd", time=view.quote("Tfd"), sample=number_text(view.sample_time))


@info("NX629", D213, "{key} {time} is shorter than the sample time of {sample} s: the output follows within a cycle")
def lag_below_sample_time(context: NextopidContext) -> Findings:
    """A filter or lag is shorter than the time between two calculations.

    Why: it follows by 63 % or more within one cycle, and does next to nothing.

    Fix: give several sample times, or leave the block out.
    """
    for view in context.blocks_of_type(*TIME_CONSTANTS):
        key = TIME_CONSTANTS[view.type]
        time = view.number_of(key)
        if time is not None and 0 < time < view.sample_time:
            yield view.report(key, key=key, time=view.quote(key), sample=number_text(view.sample_time))


@per_pid
@warning("NX630", INTEGRAL, "Ti_Ki {time} is below 0.001 s: the block takes it as no integral")
def integral_time_below_1_ms(view: BlockView) -> Findings:
    """An integral time is so short that the block switches the integral off.

    Why: below 0.001 s the dependent form has no integral at all, where the strongest one was written. An error stays.

    Fix: give the integral time in seconds; or 0 where no integral is wanted.
    """
    time = view.number_of("Ti_Ki")
    if view.is_on("Indep") is False and time is not None and 0 < time < MIN_INTEGRAL_TIME:
        yield view.report("Ti_Ki", time=view.quote("Ti_Ki"))


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
        if gain is None or rate is None or gain <= 0 or rate <= 0 or context.has_time_as_gain(view, "Ti_Ki"):
            continue
        time = gain / rate
        if time < view.sample_time:
            description = " (Kp / Ki)" if view.is_on("Indep") else ""
            yield view.report(
                "Ti_Ki",
                time=f"{float(time):.4g}",
                how=description,
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
        noise_share = gain * (pv[1] - pv[0]) * PV_NOISE_SHARE / view.sample_time / (mv[1] - mv[0])
        if noise_share > MAX_NOISE_SHARE:
            yield view.report("Td_Kd", percent=f"{float(noise_share) * 100:.3g}")


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
        if time > MAX_STROKE_TIME:
            yield view.report(
                "MaxVarMV", rate=view.quote("MaxVarMV"), sample=number_text(view.sample_time), time=f"{float(time):.4g}"
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
        yield view.report("MaxVarMV", rate=view.quote("MaxVarMV"))


# --- Loops whose process is part of the file: the direction of control, and the sample time ---------------------------

PROCESS_GAIN = NEXTOPID.cite("chapter 10: Gs, and chapter 2: Direct")
SAMPLE_TIME = NEXTOPID.cite("chapter 17: Maximum Sample Time of Controller")

D212 = Decision(
    212,
    "the direction of control is judged where the process is in the file",
    "A ring from a loop's MV through ControlLag or ControlDelayLag back to its PV has a sign: of all gains, of the "
    "expressions and of split ranges on the way. PV rising with MV needs Direct FALSE, PV falling needs Direct TRUE.",
    "The manual's notes on Gs. Without a process in the file nobody can know.",
)


@error(
    "NX622",
    PROCESS_GAIN,
    "Direct is {direct}, but PV {moves} when MV rises, through {process} with Gs {gain}: it must be {wanted}",
)
def wrong_direction_of_control(context: NextopidContext) -> Findings:
    """The direction of control does not fit the process that is wired to the loop.

    Why: the loop drives its PV away from the set point, and MV to one of its limits: a heater runs to full power and
    stays there. Direct TRUE means that MV rises with PV (cooling), FALSE that it falls when PV rises (heating).

    Fix: change Direct; or correct the sign of Gs, if the process is the one that is written wrong.
    """
    paths = {view.number: FeedbackPath(context, view) for view in context.pids}
    wrong_paths = {number: path for number, path in paths.items() if _drives_pv_away(path)}
    for number, path in wrong_paths.items():
        if any(
            other in wrong_paths and number not in wrong_paths[other].other_controllers
            for other in path.other_controllers
        ):
            continue  # the loop inside is wrong; what that makes of this one is its echo
        view, direct = path.loop, path.loop.is_on("Direct")
        process = next((block for block in path.processes if (block.number_of("Gs") or 0) < 0), path.processes[0])
        yield view.report(
            "Direct",
            direct=view.quote("Direct"),
            moves="falls" if direct is False else "rises",
            process=process.name,
            gain=process.quote("Gs"),
            wanted=value_text(not direct),
        )


def _drives_pv_away(path: FeedbackPath) -> bool:
    """Whether the loop drives its PV away: it falls with MV and Direct is FALSE, or rises and Direct is TRUE."""
    sign, direct = path.sign(), path.loop.is_on("Direct")
    return bool(path.processes) and sign in {1, -1} and direct is not None and direct == (sign == 1)


@warning(
    "NX623",
    SAMPLE_TIME,
    "a sample time of {sample} s is not below a tenth of the time constant {constant} s of {process}",
)
def sample_time_long_for_the_process(context: NextopidContext) -> Findings:
    """The loop is calculated too seldom for the process that is wired to it.

    Why: the manual asks for less than a tenth of the time constant. With a longer sample time the loop sees its own
    effect late, as if the process had more dead time, and swings.

    Fix: shorten `sample_time`.
    """
    for view in context.pids:
        path = FeedbackPath(context, view)
        path.sign()
        slowest_process = max(path.processes, key=lambda block: block.number_of("Tc") or 0, default=None)
        constant = None if slowest_process is None else slowest_process.number_of("Tc")
        if slowest_process is not None and constant is not None and 0 < constant <= 10 * view.sample_time:
            yield view.report(
                "sample_time",
                sample=number_text(view.sample_time),
                constant=number_text(constant),
                process=slowest_process.name,
            )
