"""The equation of the EZLogix, what its autotune needs, and pulses in place of an analog output."""

from __future__ import annotations

import math
from collections.abc import Iterator
from decimal import Decimal
from typing import NamedTuple

from pidcfg.encoders.maps.ezlogix import DUTY_COUNTS
from pidcfg.schemas.ezlogix import CV_FULL
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.references import EZLOGIX, Decision
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning
from pidcfg.validate.rules.ezlogix.setup import EzlogixContext, LoopView
from pidcfg.validate.rules.ezlogix.signals import looks_like_percent
from pidcfg.validate.shared_checks import number_text

# --- The terms of the equation: which are on, and values that do not do what they look like ---------------------------

VELOCITY = EZLOGIX.cite("Velocity Algorithm")
POSITION = EZLOGIX.cite("Position Algorithm")
GAIN = EZLOGIX.cite("Proportional Gain")
INTEGRAL = EZLOGIX.cite("Integral (Reset) Time")
SAMPLE_RATE = EZLOGIX.cite("Sample Rate")
OFFSET = EZLOGIX.cite("CV Offset")

D184 = Decision(
    184,
    "times shorter than the sample rate",
    "An integral time below the sample rate is a warning, a derivative time below it an info; both at 0.3 s, the "
    "dialog's defaults, are a warning of their own.",
    "Ts/Ti above 1 adds more than the whole error at each calculation, which the manual does not forbid; Td/Ts below 1 "
    "is less than the proportional term. No process wants both times alike.",
)
D185 = Decision(
    185,
    "a derivative that turns one count into 10 % of the CV is a warning",
    "Kp times Td/Ts above 410 counts of the CV for a count of the PV.",
    "The last count of a converter flickers, and there is no filter and no limit of the derivative gain.",
)
DEFAULT_TIME = Decimal("0.3")
"""Integral and derivative time of the dialog, in s."""
TENTH_OF_CV = 410
"""Counts: 10 % of the CV."""


@per_loop
@checklist(
    "EZ421",
    VELOCITY,
    "velocity is the position form with the derivative of the PV, not an incremental form; its sign is printed "
    "for direct action only, and taken as {sign} here",
)
def velocity_is_not_incremental(view: LoopView) -> Findings:
    """The algorithm that the manual calls velocity computes no increments.

    Why: other controllers add increments to the CV in their velocity form, so that it cannot wind up and needs no
    offset. This one has the whole sum like the position form; the derivative looks at the PV, so that a new set point
    gives no kick. As printed it would be positive feedback with reverse action: the printed sign is a misprint, and
    `pidcfg` takes the sign that the error has.

    Fix: try a new loop with derivative in Manual and Auto on a harmless process. While the PV rises fast
    the CV must rise with `action: direct` (cooling), and fall with `action: reverse` (heating).
    """
    if view.loop.algorithm == "velocity" and view.register_value("derivative_time"):
        yield view.report("algorithm", sign="+" if view.loop.action == "direct" else "-")


@per_loop
@info("EZ422", VELOCITY, "velocity without a derivative time is the same as position")
def velocity_without_derivative(view: LoopView) -> Findings:
    """The velocity algorithm is chosen, and there is no derivative.

    Why: the two algorithms differ in the derivative term only. Whoever expects increments, or protection from windup,
    gets neither.

    Fix: write `algorithm: position`, or leave it if the autotune is to set a derivative time.
    """
    if view.loop.algorithm == "velocity" and view.register_value("derivative_time") == 0:
        yield view.report("algorithm")


@per_loop
@warning(
    "EZ423",
    GAIN,
    "gain 0 with {terms}: by the manual's text only the proportional term is off, by its formula all terms are",
)
def gain_zero_with_integral(view: LoopView) -> Findings:
    """The gain is 0 and there is an integral term.

    Why: the text says that 0 removes the proportional term; the printed formula multiplies all three by the gain.
    `pidcfg` follows the text, with Ts/Ti and Td/Ts as they stand. By the other reading the CV never moves.

    Fix: give a small gain and adapt the times; or try on the PLC whether the CV moves.
    """
    terms = view.register_values("proportional_gain", "integral_time", "derivative_time")
    if terms and terms[0] == 0 and terms[1] > 0:
        names = "integral and derivative time" if terms[2] > 0 else "an integral time"
        yield view.report("tuning", "proportional_gain", terms=names)


@per_loop
@error("EZ424", POSITION, "gain 0 and integral_time off: {left}")
def no_control_term(view: LoopView) -> Findings:
    """Neither a proportional nor an integral term is left.

    Why: the CV stays at its offset whatever the error is; with a derivative time it moves only while the PV does, and
    nothing holds the set point.

    Fix: give `proportional_gain`, or an `integral_time`.
    """
    terms = view.register_values("proportional_gain", "integral_time", "derivative_time")
    if terms and terms[0] == 0 and terms[1] == 0:
        left = "the derivative alone holds no set point" if terms[2] > 0 else "no term is left, the CV never moves"
        yield view.report("tuning", "proportional_gain", left=left)


@per_loop
@info(
    "EZ425",
    OFFSET,
    "no integral term and CV offset 0: without an error the CV is 0, so an error stays as long as the process "
    "needs any output",
)
def proportional_without_offset(view: LoopView) -> Findings:
    """A loop without integral term has a CV offset of 0.

    Why: the CV is the offset when the error is zero. A heater that has to give 30 % to hold the temperature does so
    only with the error that makes 30 %.

    Fix: give the offset that holds the set point as `output.offset`, or an integral time.
    """
    gain, reset, offset = (
        view.register_value("proportional_gain"),
        view.register_value("integral_time"),
        view.counts("cv_offset"),
    )
    if gain and reset == 0 and offset == 0:
        yield view.report_key("tuning")


def has_dialog_times(view: LoopView) -> bool:
    """Whether integral and derivative time are those of the dialog."""
    return view.register_values("integral_time", "derivative_time") == [DEFAULT_TIME, DEFAULT_TIME]


@per_loop
@warning(
    "EZ426",
    D184,
    "integral_time {integral} s is shorter than the sample rate of {sample} s: each calculation adds {times} "
    "times the error",
)
def integral_time_below_sample_rate(view: LoopView) -> Findings:
    """The integral time is shorter than the time between two calculations.

    Why: Ts/Ti is more than 1, so that the integral corrects more than the whole error at every sample, before its
    effect can be seen. Such a loop swings.

    Fix: lengthen the integral time, or shorten the sample rate to a tenth of it or less.
    """
    times = view.register_values("integral_time", "sample_rate")
    if times and 0 < times[0] < times[1] and not has_dialog_times(view):
        yield view.report(
            "tuning",
            "integral_time",
            integral=decimal_text(times[0]),
            sample=decimal_text(times[1]),
            times=f"{times[1] / times[0]:.3g}",
        )


@per_loop
@info(
    "EZ427",
    D184,
    "derivative_time {derivative} s is shorter than the sample rate of {sample} s: the term is {times} of the "
    "proportional one",
)
def derivative_time_below_sample_rate(view: LoopView) -> Findings:
    """The derivative time is shorter than the time between two calculations.

    Why: Td/Ts is less than 1, so a change within one sample acts less through the derivative than through the
    proportional term; what happens between two samples it does not see.

    Fix: shorten the sample rate, or switch the derivative off.
    """
    times = view.register_values("derivative_time", "sample_rate")
    if times and 0 < times[0] < times[1] and not has_dialog_times(view):
        yield view.report(
            "tuning",
            "derivative_time",
            derivative=decimal_text(times[0]),
            sample=decimal_text(times[1]),
            times=f"{float(times[0] / times[1]):.4g}",
        )


@per_loop
@warning("EZ428", D184, "integral and derivative time are 0.3 s, as the dialog shows them for a new loop")
def dialog_default_times(view: LoopView) -> Findings:
    """Integral and derivative time are the dialog's defaults.

    Why: 0.3 s each fits hardly any process: the integral is far too fast for all but the fastest flows, and a
    derivative as long as the integral makes it swing. They look like values that nobody has chosen.

    Fix: give times that fit the process, or switch the terms off until it is tuned.
    """
    if has_dialog_times(view):
        yield view.report("tuning", "integral_time")


@per_loop
@warning(
    "EZ429",
    D185,
    "one count of the PV moves the CV by {counts} counts through the derivative: gain {gain} times "
    "{derivative} s / {sample} s",
)
def derivative_amplifies_counts(view: LoopView) -> Findings:
    """The derivative turns the last count of the PV into a jolt of the output.

    Why: the derivative acts on the difference of two samples. With a long derivative time and a short sample rate the
    flicker of the converter's last count throws the CV by more than 10 %.

    Fix: lengthen the sample rate, or shorten the derivative time.
    """
    terms = view.register_values("proportional_gain", "derivative_time", "sample_rate")
    if not terms or not terms[2]:
        return
    gain = terms[0] or Decimal(1)  # D160
    counts = gain * terms[1] / terms[2]
    if counts > TENTH_OF_CV:
        yield view.report(
            "tuning",
            "derivative_time",
            counts=f"{counts:.0f}",
            gain=decimal_text(gain),
            derivative=decimal_text(terms[1]),
            sample=decimal_text(terms[2]),
        )


@per_loop
@error("EZ430", SAMPLE_RATE, "sample_rate is 0, as the dialog shows it for a new loop; it must be 0.05 to 99.99 s")
def sample_rate_of_zero(view: LoopView) -> Findings:
    """The sample rate is 0, the dialog's default.

    Why: the equation divides by it, and the manual's range begins at 0.05 s. A loop whose sample rate was never entered
    is not calculated, or not as anyone has written down.

    Fix: give a tenth of the process's time constant or less; 1 s for temperatures, 0.1 to 0.5 s for flows.
    """
    if view.loop.sample_rate == 0:
        yield view.report("sample_rate")


# --- What the autotune would need -------------------------------------------------------------------------------------

TIMEOUT = EZLOGIX.cite("Timeout Time (in sec)")
TYPE = EZLOGIX.cite("Tuning Type")
TUNE_SETUP = EZLOGIX.cite("Autotune Setup")

D190 = Decision(
    190,
    "an autotune needs 40 samples and the integral time",
    "A timeout below 40 sample rates is a warning, one below the integral time an info.",
    "The manual wants it chosen by the dynamics of the process. The noise, the dead time and the slope of the answer "
    "are read from samples; by the rules of Ziegler and Nichols the integral time is two to three dead times, and the "
    "answer to a step lasts longer than that.",
)
MIN_AUTOTUNE_SAMPLES = 40
D622 = Decision(
    622,
    "within 10 % of the operating set point is a tenth of the PV's span",
    "An autotune that begins further from the set point starts all the same and leaves a note in a run; where a file "
    "speaks of an autotune, the checklist asks for it.",
    "The manual wants it for best results, and refuses nothing. A tenth of the set point's own value would be another "
    "distance with every zero of the scale.",
)


def has_autotune(view: LoopView) -> bool:
    """Whether the file speaks of an autotune."""
    return "autotune" in view.loop.model_fields_set


@per_loop
@checklist(
    "EZ485",
    D622,
    "before the autotune bring the process to rest within 10 % of the PV's span of the set point",
)
def autotune_start_condition(view: LoopView) -> Findings:
    """An autotune is planned, and it wants a process at rest near its working point.

    Why: the gains come from one answer to a step of the CV. A PV that was moving already adds its own slope to that
    answer, and far from the set point many processes answer differently. The PLC starts the autotune all the same.

    Fix: in Manual, set the CV that holds the PV near the set point, wait until the PV stands still, then start.
    """
    if has_autotune(view):
        yield view.report_key("autotune")


@per_loop
@warning("EZ480", TIMEOUT, "the autotune's timeout is 0 s: it is aborted as soon as it starts")
def autotune_timeout_zero(view: LoopView) -> Findings:
    """The timeout of the autotune is 0.

    Why: an autotune that has not finished within its timeout is aborted. 0 does not mean "without limit".

    Fix: give several times the time that the process needs to answer a step; the dialog's own value is 600 s.
    """
    if has_autotune(view) and view.loop.autotune.timeout == 0:
        yield view.report("autotune", "timeout")


@per_loop
@info(
    "EZ481",
    D190,
    "the autotune's timeout of {timeout} s is shorter than the integral_time of {integral} s: a process that "
    "needs it has not answered by then",
)
def autotune_timeout_below_integral_time(view: LoopView) -> Findings:
    """The autotune is aborted sooner than the process can answer.

    Why: the integral time is about as long as the process takes to answer a step. A shorter timeout ends the autotune
    before its slope is known. The dialog's 600 s are too short for a slow process.

    Fix: make `autotune.timeout` several integral times long.
    """
    timeout, times = view.loop.autotune.timeout, view.register_values("integral_time", "sample_rate")
    if has_autotune(view) and times and MIN_AUTOTUNE_SAMPLES * times[1] <= timeout < times[0]:
        yield view.report_key("tuning", timeout=timeout, integral=decimal_text(times[0]))


@per_loop
@warning("EZ482", D190, "the autotune's timeout of {timeout} s leaves it fewer than 40 samples of {sample} s")
def autotune_timeout_few_samples(view: LoopView) -> Findings:
    """The autotune would end after a handful of samples.

    Why: dead time and slope are read from the samples of the answer. Of fewer than 40, some of which must come before
    the step, no line can be drawn.

    Fix: lengthen `autotune.timeout`, or shorten the sample rate.
    """
    timeout, sample = view.loop.autotune.timeout, view.register_value("sample_rate")
    if has_autotune(view) and sample is not None and 0 < timeout < MIN_AUTOTUNE_SAMPLES * sample:
        yield view.report("sample_rate", timeout=timeout, sample=decimal_text(sample))


@per_loop
@info("EZ483", TYPE, "the autotune computes PI gains: the derivative_time of {derivative} s would not fit the new gain")
def autotune_pi_drops_derivative(view: LoopView) -> Findings:
    """The autotune's type is PI, and the loop has a derivative time.

    Why: the gains of a PI loop are computed for a loop without derivative. The derivative time of the file is switched
    off by the autotune, or stays beside a gain that was not made for it.

    Fix: `type: PID`, or switch the derivative off.
    """
    derivative = view.register_value("derivative_time")
    if has_autotune(view) and view.loop.autotune.type == "PI" and derivative:
        yield view.report("autotune", "type", derivative=decimal_text(derivative))


@per_loop
@warning(
    "EZ484", TUNE_SETUP, "the CV limits {low} and {high} leave no room for the autotune's step of 10 %, {step} counts"
)
def autotune_step_impossible(view: LoopView) -> Findings:
    """The CV limits are closer together than the step of the autotune.

    Why: the autotune steps the CV up by 10 %. With limits that are closer together it cannot, from any output: it ends
    with status 5.

    Fix: tune by hand; widen the limits for the autotune only if the plant bears it, since they may protect it, and put
    them back afterwards.
    """
    limits = view.cv_limits
    if has_autotune(view) and limits and limits[0] + TENTH_OF_CV > limits[1] and not looks_like_percent(view):
        yield view.report(
            "output",
            "limits",
            plc_effect="autotune status 5",
            low=view.cv_text(limits[0]),
            high=view.cv_text(limits[1]),
            step=TENTH_OF_CV,
        )


# --- The control output: pulses, and which of them are left out -------------------------------------------------------

CYCLE = EZLOGIX.cite("Cycle Time")
MIN_DUTY = EZLOGIX.cite("Min Duty Cycle")
MAX_DUTY = EZLOGIX.cite("Max Duty Cycle")

D191 = Decision(
    191,
    "pulses below the minimum on time and gaps below the minimum off time are left out",
    "On-time is CV / 4096 of the cycle. Minimum times that leave no pulse, no gap, or neither in between are errors; "
    "those that undo a CV limit are warnings.",
    "The manual names the two times and does not explain them; the dialog's duty cycles divide by 4096.",
)
D192 = Decision(
    192,
    "how long a cycle should be",
    "A cycle longer than the integral time is a warning; one shorter than the sample rate, or than 10 s, is an info.",
    "Within a cycle the actuator is fully on and fully off, and the process of such a loop follows both. The manual "
    "wants cycles of electromechanical relays as long as possible and gives no figure: at 10 s one switches three "
    "million times a year.",
)
SHORT_RELAY_CYCLE = 10
SECONDS_PER_YEAR = 365 * 86400
"""Seconds."""
MILLION = 1_000_000


class Pulses(NamedTuple):
    """The pulses of a loop at its CV limits, in s."""

    cycle: Decimal
    min_on: Decimal
    min_off: Decimal
    low: int
    high: int

    def on_time(self, cv: int) -> Decimal:
        """The on-time for a CV, as it is before short pulses and gaps are left out; exact: 4096 is a power of two."""
        return self.cycle * cv / DUTY_COUNTS

    def has_pulse(self, cv: int) -> bool:
        """Whether there is a pulse at all."""
        return cv > 0 and self.on_time(cv) >= self.min_on

    def has_no_gap(self, cv: int) -> bool:
        """Whether the gap is left out."""
        return self.has_pulse(cv) and self.cycle - self.on_time(cv) < self.min_off

    @property
    def never_on(self) -> bool:
        """Whether no CV makes a pulse."""
        return not self.has_pulse(self.high)

    @property
    def never_off(self) -> bool:
        """Whether no CV makes a gap."""
        return self.has_no_gap(self.low)

    @property
    def is_on_or_off_only(self) -> bool:
        """Whether there is nothing between off and on: the shortest pulse has no gap behind it."""
        shortest = max(self.low, 1, math.ceil(self.min_on * DUTY_COUNTS / self.cycle))
        return self.never_on or self.never_off or self.has_no_gap(shortest)


def loops_with_pulses(context: EzlogixContext) -> Iterator[tuple[LoopView, Pulses]]:
    """The loops with a control output whose times and limits make sense one by one."""
    for view in context.loops:
        if view.pulses is not None and view.cv_limits is not None:
            yield view, Pulses(*view.pulses, *view.cv_limits)


@per_loop
@error("EZ465", CYCLE, "cycle_time is 0: {tag} gives no pulses")
def cycle_time_of_zero(view: LoopView) -> Findings:
    """The control output is enabled with a cycle time of 0.

    Why: pulses are a part of the cycle, so there are none, or what there is is documented nowhere.

    Fix: give the cycle time, 10 s or more for relays, or leave `pulse` out.
    """
    pulse = view.loop.output.pulse
    if pulse is not None and pulse.cycle_time == 0:
        yield view.report("output", "pulse", "cycle_time", tag=pulse.tag)


@error(
    "EZ466",
    D191,
    "a cycle of {cycle} s has no room for a pulse of min_on {min_on} s and a gap of min_off {min_off} s: the "
    "output is either off or on",
)
def minimum_times_exceed_cycle(context: EzlogixContext) -> Findings:
    """Minimum on time and minimum off time do not fit into the cycle together.

    Why: whenever the pulse is long enough, the gap is too short. The output switches between off and on for whole
    cycles, and the loop swings. Where both just fit, there has to be a CV that makes exactly this pulse.

    Fix: lengthen `cycle_time` to several times their sum, or shorten the minimum times.
    """
    for view, p in loops_with_pulses(context):
        if p.is_on_or_off_only and not p.never_on and not p.never_off:
            yield view.report(
                "output",
                "pulse",
                "cycle_time",
                min_on=decimal_text(p.min_on),
                min_off=decimal_text(p.min_off),
                cycle=decimal_text(p.cycle),
            )


@error("EZ467", D191, "the longest pulse is {longest} s, shorter than min_on {min_on} s: {tag} never switches on")
def output_never_on(context: EzlogixContext) -> Findings:
    """No pulse reaches the minimum on time.

    Why: pulses that are shorter are left out. Even at the CV high limit there is none, so the output stays off.

    Fix: shorten `min_on`, lengthen `cycle_time`, or raise the CV high limit.
    """
    for view, p in loops_with_pulses(context):
        if p.never_on and view.loop.output.pulse is not None:
            yield view.report(
                "output",
                "pulse",
                "min_on",
                longest=seconds_text(p.on_time(p.high)),
                min_on=decimal_text(p.min_on),
                tag=view.loop.output.pulse.tag,
            )


@error("EZ468", D191, "the longest gap is {longest} s, shorter than min_off {min_off} s: {tag} never switches off")
def output_always_on(context: EzlogixContext) -> Findings:
    """No gap reaches the minimum off time.

    Why: gaps that are shorter are left out. Even at the CV low limit there is none, so the output stays on whatever the
    PV is.

    Fix: shorten `min_off`, lengthen `cycle_time`, or lower the CV low limit.
    """
    for view, p in loops_with_pulses(context):
        if p.never_off and view.loop.output.pulse is not None:
            yield view.report(
                "output",
                "pulse",
                "min_off",
                longest=seconds_text(p.cycle - p.on_time(p.low)),
                min_off=decimal_text(p.min_off),
                tag=view.loop.output.pulse.tag,
            )


@warning(
    "EZ469",
    MIN_DUTY,
    "the CV low limit {low} makes pulses of {on} s, shorter than min_on {min_on} s: they are left out",
)
def low_limit_pulse_left_out(context: EzlogixContext) -> Findings:
    """The minimum duty cycle is shorter than the minimum on time.

    Why: the low limit is to keep the output on for a part of each cycle, as the dialog shows. A pulse that is shorter
    than the minimum on time is left out, and the output is off.

    Fix: raise the low limit, shorten `min_on`, or set the low limit to 0 if the output may be off.
    """
    for view, p in loops_with_pulses(context):
        if p.low > 0 and not p.is_on_or_off_only and not p.has_pulse(p.low):
            yield view.report(
                "output",
                "pulse",
                "min_on",
                low=view.cv_text(p.low),
                on=seconds_text(p.on_time(p.low)),
                min_on=decimal_text(p.min_on),
            )


@warning(
    "EZ470",
    MAX_DUTY,
    "the CV high limit {high} makes gaps of {off} s, shorter than min_off {min_off} s: the output stays on",
)
def high_limit_gap_left_out(context: EzlogixContext) -> Findings:
    """The gap of the maximum duty cycle is shorter than the minimum off time.

    Why: the high limit is to keep the output off for a part of each cycle, as the dialog shows. A gap that is shorter
    than the minimum off time is left out, and the output is on all the time: more than the limit allows.

    Fix: lower the high limit, or shorten `min_off`.
    """
    for view, p in loops_with_pulses(context):
        if p.high < CV_FULL and not p.is_on_or_off_only and p.has_no_gap(p.high):
            yield view.report(
                "output",
                "pulse",
                "min_off",
                high=view.cv_text(p.high),
                off=seconds_text(p.cycle - p.on_time(p.high)),
                min_off=decimal_text(p.min_off),
            )


@info("EZ471", D192, "the cycle is {cycle} s, and the CV changes every {sample} s: equal pulses in between")
def cycle_below_sample_rate(context: EzlogixContext) -> Findings:
    """The cycle time is shorter than the sample rate.

    Why: the CV is the same until the next calculation, so shorter cycles control no better. A relay switches the more
    often for nothing.

    Fix: make the cycle at least as long as the sample rate.
    """
    for view, p in loops_with_pulses(context):
        sample = view.register_value("sample_rate")
        if sample is not None and p.cycle < sample:
            yield view.report("output", "pulse", "cycle_time", cycle=decimal_text(p.cycle), sample=decimal_text(sample))


@warning(
    "EZ472",
    D192,
    "the cycle of {cycle} s is longer than the integral_time of {integral} s: the PV follows single pulses",
)
def cycle_beyond_integral_time(context: EzlogixContext) -> Findings:
    """The cycle time is longer than the integral time.

    Why: within one cycle the actuator is fully on and fully off. A process that is fast enough for this integral time
    swings with the pulses, and the loop answers the swing.

    Fix: shorten the cycle to a small part of the integral time. A relay that is to be spared wants a slower loop.
    """
    for view, p in loops_with_pulses(context):
        integral, sample = view.register_value("integral_time"), view.register_value("sample_rate")
        slow = integral and sample is not None and sample <= integral and not has_dialog_times(view)
        if slow and integral and p.cycle > integral:
            yield view.report(
                "output", "pulse", "cycle_time", cycle=decimal_text(p.cycle), integral=decimal_text(integral)
            )


@checklist("EZ473", D192, "a cycle of {cycle} s is up to {times} million pulses a year: for solid-state outputs only")
def cycle_wears_relays(context: EzlogixContext) -> Findings:
    """The cycle time is short for an electromechanical relay or contactor.

    Why: each cycle switches once on and once off. The manual suggests cycles as long as possible to extend the life of
    relays; a contactor is worn after some million operations.

    Fix: see that the output is solid-state, or the valve made for it; otherwise write 10 s or more.
    """
    for view, p in loops_with_pulses(context):
        if p.cycle < SHORT_RELAY_CYCLE:
            times = SECONDS_PER_YEAR / p.cycle / MILLION
            yield view.report("output", "pulse", "cycle_time", cycle=decimal_text(p.cycle), times=f"{float(times):.3g}")


def seconds_text(value: Decimal) -> str:
    """A time as people write it: three digits after the point are enough."""
    return number_text(value.quantize(Decimal("0.001")).normalize())
