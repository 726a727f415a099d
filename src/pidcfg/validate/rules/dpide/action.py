"""Direction and form: choices that decide everything, and that nothing else tells."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dpide import D255
from pidcfg.refs import Decision
from pidcfg.validate.ideas.purpose import spoken_of
from pidcfg.validate.rule import Findings, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.dpide.context import LoopView

D261 = Decision(
    261,
    "words of heating and cooling tell the direction that is meant",
    "PID_DIR FALSE in a loop whose name or description speaks of heating, and TRUE in one that speaks of cooling, are "
    "a warning. Words of both kinds, of an exhaust, or of an actuator that works the other way round are none, nor is "
    "a PV whose unit is not one of temperature.",
    "The manual's forward is heating; other manuals call forward what cools. Swapping it is the likeliest mistake, and "
    "a heater that runs away its result.",
)
CHOICES = {
    "PID_DIR": ("FALSE: E = PV - SV, MV rises while PV is above SV, as for cooling", "heating needs TRUE"),
    "PID_EQ": ("FALSE: Ti_Ki is a gain in 1/s", "an integral time needs TRUE"),
}


@per_loop
@warning("DP781", D255, "{operand} is not given, so it is {meaning}; {other}")
def choice_not_given(view: LoopView) -> Findings:
    """The direction, or the form of the equation, is left to its default.

    Why: the wrong direction is a heater that runs away; with the wrong form an integral time counts as a gain. Neither
    can be seen in any other operand.

    Fix: write PID_DIR and PID_EQ, also where they are false.
    """
    for operand, (meaning, other) in CHOICES.items():
        if not view.gives(operand):
            yield view.at(operand, operand=operand, meaning=meaning, other=other)


@per_loop
@warning(
    "DP782",
    D261,
    "PID_DIR is {direction}, but the loop's name or description speaks of {purpose}, which needs {other}",
)
def direction_against_description(view: LoopView) -> Findings:
    """The direction is the other one than the loop's name or description suggests.

    Why: TRUE (forward) is E = SV - PV: MV rises while the PV is below SV, as for heating. Other manuals call this
    reverse. With the wrong one the heater is switched on the further, the hotter it gets.

    Fix: change PID_DIR. If it is right because the actuator works the other way round, say so in the description:
    "air to close", "normally open", "fail open", "inverted".
    """
    forward = view.loop.PID_DIR
    purpose = "cooling" if forward else "heating"
    if view.gives("PID_DIR") and spoken_of(view.loop) == {purpose}:
        direction, other = ("TRUE (forward)", "FALSE") if forward else ("FALSE (reverse)", "TRUE")
        yield view.at("PID_DIR", direction=direction, purpose=purpose, other=other)
