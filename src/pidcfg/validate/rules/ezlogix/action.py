"""The controller's action against what the file says of the loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import EZLOGIX, Decision
from pidcfg.validate.ideas.purpose import spoken_of
from pidcfg.validate.rule import Findings, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.ezlogix.context import LoopView

ACTION = EZLOGIX.at("Controller Action")

D183 = Decision(
    183,
    "words of heating and cooling tell the action that is meant",
    "A direct-acting loop whose name or description speaks of heating, and a reverse-acting one that speaks of "
    "cooling, are a warning. Words of both kinds, of an exhaust, or of an actuator that works the other way round are "
    "none, nor is a PV whose unit is not one of temperature.",
    "The action stands in no register, and the word is the opposite of the process's action, by which other "
    "controllers name it: swapping it is the likeliest mistake, and a heater that runs away its result.",
)
MEANING = {
    "direct": ("heating", "CV rises as PV rises", "reverse"),
    "reverse": ("cooling", "CV falls as PV rises", "direct"),
}


@per_loop
@warning(
    "EZ415",
    D183,
    "action {action} ({meaning}), but the loop's name or description speaks of {purpose}, which needs {other}",
)
def action_against_description(view: LoopView) -> Findings:
    """The action is the other one than the loop's name or description suggests.

    Why: here `action` is the controller's: a heater needs `reverse`, a cooler `direct`. DL06 and CLICK name the
    process's action, which is the opposite word. With the wrong one the heater is switched on the further, the hotter
    it gets.

    Fix: change the action. If it is right because the actuator works the other way round, say so in the description:
    "air to close", "normally open", "fail open", "inverted".
    """
    purpose, meaning, other = MEANING[view.loop.action]
    if spoken_of(view.loop) == {purpose}:
        yield view.at("action", action=view.loop.action, meaning=meaning, purpose=purpose, other=other)
