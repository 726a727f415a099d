"""The derivative: what it makes of noise and of a new set point."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dpide import TABLE
from pidcfg.refs import Decision
from pidcfg.validate.rule import Findings, info, per_loop, warning
from pidcfg.validate.rules.dpide.tuning import FORMULAS, is_dead, tunes_itself
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.dpide.context import LoopView

D260 = Decision(
    260,
    "a derivative of more than 20 cycles needs smoothing",
    "Without Tf, a derivative time of more than 20 sampling times is a warning.",
    "A step of the PV of one unit is then a step of the output of more than 20 times the proportional gain for one "
    "cycle; controllers that limit the derivative limit it to 8 to 20 times.",
)
MOST = Decimal(20)


def derivative_of(view: LoopView) -> Decimal:
    """The coefficient of the derivative as it acts: 0 also where the whole controller is dead."""
    return Decimal(0) if is_dead(view) or tunes_itself(view) else view.coefficient("Td_Kd")


@per_loop
@warning(
    "DP721",
    D260,
    "the derivative time of {time} s is {ratio} sampling times of {cycle} s and Tf is 0: noise of the PV is "
    "multiplied by that",
)
def derivative_unsmoothed(view: LoopView) -> Findings:
    """A large derivative without smoothing at a short cycle.

    Why: the derivative divides the change from cycle to cycle by the sampling time. One digit of noise becomes a large
    pulse of MV.

    Fix: write Tf, a tenth to a fifth of the derivative time; or lengthen CYCLE.
    """
    if view.times is None or tunes_itself(view) or view.coefficient("Tf"):
        return
    ratio = view.times[1] / view.cycle
    if ratio > MOST:
        yield view.at("Td_Kd", time=number_text(view.times[1]), ratio=number_text(ratio), cycle=number_text(view.cycle))


@per_loop
@warning("DP722", FORMULAS, "the derivative time of {derivative} s is longer than the integral time of {integral} s")
def derivative_above_integral(view: LoopView) -> Findings:
    """The derivative time is longer than the integral time.

    Why: such a loop swings; by the usual rules the derivative time is a quarter of the integral time. Mostly the two
    were exchanged, or a gain was written where a time is wanted. In the independent form the times are Kp/Ki and Kd/Kp.

    Fix: exchange them, or check PID_EQ.
    """
    integral, derivative = view.times or (Decimal(0), Decimal(0))
    if 0 < integral < derivative and not tunes_itself(view):
        yield view.at("Td_Kd", derivative=number_text(derivative), integral=number_text(integral))


@per_loop
@warning(
    "DP723", TABLE, "Tf of {tf} s is longer than the derivative time of {time} s: little of the derivative is left"
)
def derivative_smoothed_away(view: LoopView) -> Findings:
    """The smoothing is slower than the derivative.

    Why: the derivative comes so late that it damps nothing; the loop behaves as without it.

    Fix: write Tf as a tenth to a fifth of the derivative time.
    """
    time, smoothing = (view.times or (Decimal(0), Decimal(0)))[1], view.coefficient("Tf")
    if 0 < time < smoothing and not tunes_itself(view):
        yield view.at("Tf", tf=number_text(smoothing), time=number_text(time))


@per_loop
@info("DP724", TABLE, "Tf has no effect: there is no derivative to smooth")
def smoothing_without_derivative(view: LoopView) -> Findings:
    """Tf is given without a derivative.

    Why: it smooths the derivative only, not the PV.

    Fix: leave it out; filter the PV in the program if it is noisy.
    """
    if view.coefficient("Tf") and view.held("Td_Kd") and not view.coefficient("Td_Kd") and not tunes_itself(view):
        yield view.at("Tf")


@per_loop
@info("DP725", FORMULAS, "PID_DE FALSE: the derivative is of the error, so a new SV kicks MV")
def set_point_kick(view: LoopView) -> Findings:
    """The derivative follows the set point.

    Why: with PID_DE FALSE a step of SV is a step of the error; its derivative is a pulse of MV of the gain times the
    derivative time divided by the sampling time.

    Fix: write `PID_DE: true`, unless SV only ever moves slowly.
    """
    if not view.loop.PID_DE and derivative_of(view):
        yield view.at("PID_DE") if view.gives("PID_DE") else view.at("Td_Kd")
