"""Coefficients: terms that are off, and numbers that belong to the other form."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.encoders.maps.dpide import TABLE
from pidcfg.refs import DPIDE
from pidcfg.schemas.iec import Timed
from pidcfg.validate.rule import Findings, checklist, error, per_loop, warning
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.dpide.context import LoopView

FORMULAS = DPIDE.at("The PID algorithm")
DIAGRAM = DPIDE.at("PID Block Diagram")
COEFFICIENTS = ("Kc_Kp", "Ti_Ki", "Td_Kd", "Tf")
EFFECTS = {
    "Kc_Kp": "no proportional term",
    "Ti_Ki": "no integral term",
    "Td_Kd": "no derivative term",
    "Tf": "no smoothing",
}


def is_dead(view: LoopView) -> bool:
    """Whether the dependent form multiplies everything by 0."""
    return view.loop.PID_EQ and bool(view.held("Kc_Kp")) and not view.coefficient("Kc_Kp")


def has_no_term(view: LoopView) -> bool:
    """Whether all gains of the independent form are 0."""
    fits = bool(view.held("Kc_Kp", "Ti_Ki", "Td_Kd"))
    return not view.loop.PID_EQ and fits and not any(view.coefficient(name) for name in COEFFICIENTS[:3])


def tunes_itself(view: LoopView) -> bool:
    """Whether the autotune replaces the coefficients before they are used."""
    return view.loop.PID_MODE == 1


@per_loop
@error("DP711", DIAGRAM, "Kc_Kp is {gain}, which counts as 0 and switches off all three terms of the dependent form")
def dead_controller(view: LoopView) -> Findings:
    """The gain of the dependent form is 0 or below.

    Why: Kc multiplies the integral and the derivative too (PID_EQ TRUE). MV is BIAS and nothing else, whatever the PV
    does.

    Fix: write a gain above 0. For an integral alone take the independent form (PID_EQ FALSE), where the gains are free
    of each other. For cooling write `PID_DIR: false`, not a negative gain.
    """
    if is_dead(view) and not tunes_itself(view):
        yield view.at("Kc_Kp", gain=number_text(view.loop.Kc_Kp))


@per_loop
@error("DP712", DIAGRAM, "Kc_Kp, Ti_Ki and Td_Kd all count as 0: MV is BIAS alone")
def no_term(view: LoopView) -> Findings:
    """All three gains of the independent form are 0 or below.

    Why: there is no control; the PV has no effect on MV.

    Fix: write gains above 0. For cooling write `PID_DIR: false`, not negative gains.
    """
    if has_no_term(view) and not tunes_itself(view):
        yield view.at("Kc_Kp")


@per_loop
@warning("DP713", TABLE, "{operand} is {value}, which counts as 0: {effect}")
def negative_coefficient(view: LoopView) -> Findings:
    """A coefficient is below 0.

    Why: the PLC takes it as 0. It does not turn the direction round.

    Fix: write 0 or a number above it. For cooling write `PID_DIR: false`.
    """
    for name in COEFFICIENTS:
        value = getattr(view.loop, name)
        if value < 0 and not (name == "Kc_Kp" and (is_dead(view) or has_no_term(view))):
            yield view.at(name, operand=name, value=number_text(value), effect=EFFECTS[name])


@per_loop
@checklist("DP714", TABLE, "Ti_Ki is 0: without an integral the PV stays beside SV, unless BIAS is just right")
def no_integral(view: LoopView) -> Findings:
    """There is no integral term.

    Why: MV is BIAS where PV is SV; any other load needs an error that stays.

    Fix: see that a steady error is acceptable. Otherwise write Ti or Ki.
    """
    if view.held("Ti_Ki") == [0] and not (is_dead(view) or has_no_term(view) or tunes_itself(view)):
        yield view.at("Ti_Ki")


@per_loop
@error("DP715", TABLE, "{operand} has a unit of time, but with PID_EQ FALSE it is {gain}")
def time_as_a_gain(view: LoopView) -> Findings:
    """A time stands where the independent form wants a gain.

    Why: an integral time of 180 s would become a gain of 180 per second: the integral runs from one end to the other
    within a cycle. A derivative time of 20 s becomes a gain Kd of 20, whatever Kp is; since the manual gives Td_Kd in s
    for both forms, that is a warning alone.

    Fix: write `PID_EQ: true`, or the gain as a bare number: Ki is Kp divided by the integral time in s, Kd is Kp times
    the derivative time in s.
    """
    if view.loop.PID_EQ:
        return
    if isinstance(view.loop.Ti_Ki, Timed):
        yield view.at("Ti_Ki", operand="Ti_Ki", gain="the gain Ki in 1/s")
    if isinstance(view.loop.Td_Kd, Timed):
        gain = "the gain Kd: Kp times the derivative time in s"
        yield view.at("Td_Kd", severity=Severity.WARNING, operand="Td_Kd", gain=gain)


@per_loop
@warning(
    "DP716", FORMULAS, "the integral time is {time} s, shorter than the sampling time of {cycle} s: was {other} meant?"
)
def integral_faster_than_cycle(view: LoopView) -> Findings:
    """The integral acts faster than the instruction is calculated.

    Why: in each cycle the integral adds more than the whole proportional term, and the loop swings between its limits.
    Mostly Ti and Ki were mixed up: Ti_Ki is a time in s with PID_EQ TRUE, and a gain in 1/s with PID_EQ FALSE, where
    the time is Kp divided by Ki.

    Fix: check PID_EQ, then write Ti or Ki.
    """
    if view.times is None or (isinstance(view.loop.Ti_Ki, Timed) and not view.loop.PID_EQ):
        return
    time = view.times[0]
    if 0 < time < view.cycle:
        other = "a gain Ki (PID_EQ FALSE)" if view.loop.PID_EQ else "a time Ti (PID_EQ TRUE)"
        yield view.at("Ti_Ki", time=number_text(time), cycle=number_text(view.cycle), other=other)


@per_loop
@checklist("DP717", TABLE, "Kc_Kp is {gain}: the independent form works without a proportional term")
def no_proportional(view: LoopView) -> Findings:
    """There is no proportional term, but another one.

    Why: an integral alone is slow, and swings with most processes.

    Fix: see that no proportional term is meant. Otherwise write Kp.
    """
    alone = not view.loop.PID_EQ and view.held("Kc_Kp") == [0] and not has_no_term(view)
    if alone and not tunes_itself(view):
        yield view.at("Kc_Kp", gain=number_text(view.loop.Kc_Kp))
