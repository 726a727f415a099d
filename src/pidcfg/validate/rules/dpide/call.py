"""What stands around the instruction in the program: pulses, timers, and the bits that they need."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

from pidcfg.refs import DPIDE
from pidcfg.schemas.dpide_call import D600
from pidcfg.schemas.dpide_devices import place_of
from pidcfg.validate.ideas.duplicates import at_both
from pidcfg.validate.rule import Findings, error, per_loop, warning
from pidcfg.validate.views import with_unit

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.validate.rules.dpide.context import DpideContext, LoopView

PULSES = DPIDE.at("Example 3")
TIMER = DPIDE.at("Example 4")


@per_loop
@warning("DP791", PULSES, "MV goes from {low} to {high}, and GPWM's cycle is {cycle} ms: {effect}")
def pulses_beyond_cycle(view: LoopView) -> Findings:
    """The limits of MV are not those of the pulses.

    Why: behind GPWM MV is the time on in each cycle. A cycle that is shorter than MV_MAX has the output on for good
    long before MV is at its limit, and a longer one never has it on for good; below 0 there is no pulse.

    Fix: MV_MIN 0, MV_MAX and the cycle the same.
    """
    gpwm, limits = view.loop.call.GPWM, view.limits
    if gpwm is None or limits is None or (limits[0] >= 0 and limits[1] == gpwm.cycle):
        return
    low, high, effect = with_unit(limits[0], None), view.mv(limits[1]), _effect(limits, gpwm.cycle)
    yield view.at("call", "GPWM", "cycle", low=low, high=high, cycle=gpwm.cycle, effect=effect)


def _effect(limits: tuple[Decimal, Decimal], cycle: int) -> str:
    """What the output does."""
    if limits[1] > cycle:
        return f"from {cycle} on the output is never off"
    return "the output is never on for good" if limits[1] < cycle else "below 0 it makes no pulse"


@error("DP792", D600, "GPWM writes its pulses to {bit}, the place of {other}")
def pulses_collide(context: DpideContext) -> Findings:
    """The bit of the pulses is that of an operand, of EN, or of another loop's pulses.

    Why: the bit goes on and off in every cycle, and with it the loop that it starts or enables; two GPWM in one bit
    leave the one that is executed last.

    Fix: give the pulses a bit of their own.
    """
    for view in context.loops:
        gpwm = view.loop.call.GPWM
        if gpwm is None:
            continue
        bit = place_of("GPWM", gpwm.output)
        for other in context.loops:
            others = {} if other is view or other.loop.call.GPWM is None else {"GPWM": other.loop.call.GPWM.output}
            enable = {} if other.loop.call.EN is None else {"EN": other.loop.call.EN}
            given = {"I_MV": other.loop.device, **other.loop.devices.given(), **enable, **others}
            for name in [name for name, device in given.items() if place_of(name, device).overlaps(bit)]:
                finding = view.at("call", "GPWM", "output", bit=bit, other=f"{other.name}.{name}")
                if other is view:
                    yield finding
                elif name == "GPWM":  # the other loop says the same of this one
                    yield finding.shared_with(other.name)
                else:
                    yield from at_both(view, finding, other, other.at("name", bit=bit, other=f"{other.name}.{name}"))


@error("DP793", TIMER, "{timer} also calls {other} every {other_cycle} ms, and CYCLE is {cycle} ms here")
def timer_with_two_times(context: DpideContext) -> Findings:
    """One timer calls loops with different CYCLE.

    Why: a timer runs for one time. Two TMRH with one timer disturb each other, and neither loop is called when it
    should be; `pidcfg encode --format st` refuses the file.

    Fix: give each CYCLE a timer of its own.
    """
    timed = [view for view in context.loops if view.loop.call.timer is not None]
    for first, second in combinations(timed, 2):
        one, two = first.loop, second.loop
        if one.call.timer == two.call.timer and one.CYCLE != two.CYCLE:
            for view, other in ((first, second), (second, first)):
                yield view.at(
                    "call",
                    "timer",
                    timer=view.loop.call.timer,
                    other=other.name,
                    other_cycle=other.loop.CYCLE,
                    cycle=view.loop.CYCLE,
                ).shared_with(other.name)
