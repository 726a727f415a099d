"""The terms of the equation: which are on, and values that do not do what they look like."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.refs import EZLOGIX, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.ezlogix.context import LoopView

VELOCITY = EZLOGIX.at("Velocity Algorithm")
POSITION = EZLOGIX.at("Position Algorithm")
GAIN = EZLOGIX.at("Proportional Gain")
INTEGRAL = EZLOGIX.at("Integral (Reset) Time")
SAMPLE_RATE = EZLOGIX.at("Sample Rate")
OFFSET = EZLOGIX.at("CV Offset")

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
TENTH = 410
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
    if view.loop.algorithm == "velocity" and view.held("derivative_time"):
        yield view.at("algorithm", sign="+" if view.loop.action == "direct" else "-")


@per_loop
@info("EZ422", VELOCITY, "velocity without a derivative time is the same as position")
def velocity_without_derivative(view: LoopView) -> Findings:
    """The velocity algorithm is chosen, and there is no derivative.

    Why: the two algorithms differ in the derivative term only. Whoever expects increments, or protection from windup,
    gets neither.

    Fix: write `algorithm: position`, or leave it if the autotune is to set a derivative time.
    """
    if view.loop.algorithm == "velocity" and view.held("derivative_time") == 0:
        yield view.at("algorithm")


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
    terms = view.holds("proportional_gain", "integral_time", "derivative_time")
    if terms and terms[0] == 0 and terms[1] > 0:
        names = "integral and derivative time" if terms[2] > 0 else "an integral time"
        yield view.at("tuning", "proportional_gain", terms=names)


@per_loop
@error("EZ424", POSITION, "gain 0 and integral_time off: {left}")
def no_control_term(view: LoopView) -> Findings:
    """Neither a proportional nor an integral term is left.

    Why: the CV stays at its offset whatever the error is; with a derivative time it moves only while the PV does, and
    nothing holds the set point.

    Fix: give `proportional_gain`, or an `integral_time`.
    """
    terms = view.holds("proportional_gain", "integral_time", "derivative_time")
    if terms and terms[0] == 0 and terms[1] == 0:
        left = "the derivative alone holds no set point" if terms[2] > 0 else "no term is left, the CV never moves"
        yield view.at("tuning", "proportional_gain", left=left)


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
    gain, reset, offset = view.held("proportional_gain"), view.held("integral_time"), view.counts("cv_offset")
    if gain and reset == 0 and offset == 0:
        yield view.at_key("tuning")


def at_defaults(view: LoopView) -> bool:
    """Whether integral and derivative time are those of the dialog."""
    return view.holds("integral_time", "derivative_time") == [DEFAULT_TIME, DEFAULT_TIME]


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
    times = view.holds("integral_time", "sample_rate")
    if times and 0 < times[0] < times[1] and not at_defaults(view):
        yield view.at(
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
    times = view.holds("derivative_time", "sample_rate")
    if times and 0 < times[0] < times[1] and not at_defaults(view):
        yield view.at(
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
    if at_defaults(view):
        yield view.at("tuning", "integral_time")


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
    terms = view.holds("proportional_gain", "derivative_time", "sample_rate")
    if not terms or not terms[2]:
        return
    counts = (terms[0] or Decimal(1)) * terms[1] / terms[2]
    if counts > TENTH:
        yield view.at(
            "tuning",
            "derivative_time",
            counts=f"{counts:.0f}",
            gain=decimal_text(terms[0]),
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
        yield view.at("sample_rate")
