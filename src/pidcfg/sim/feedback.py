"""Whether a loop's action fits its plant: the way from its output to its PV, looked at before anything runs.

Design. Every signal that follows the output is raised a little, and the change is carried through the plants in their
order, by the sign of their gain, and through the expressions as they stand at time 0. A PV that falls where the action
takes for granted that it rises, or the other way round, is positive feedback: the loop runs away. Ways through another
loop, and expressions that do not answer at time 0, tell nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.expressions import evaluate
from pidcfg.sim.problems import Problem

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.sim.kernel import Channel
    from pidcfg.sim.network import Network
    from pidcfg.sim.plants import Plant
    from pidcfg.sim.plc import Plc

RAISED = 1.0
"""By how much an output is raised, in its unit."""


def wrong_actions(net: Network, plc: Plc) -> Iterator[Problem]:
    """A problem for each loop whose action does not fit its plant; the network is at rest at its initial values."""
    for i, loop in enumerate(plc.loops):
        change = answer(net, plc, i)
        if change and (change > 0) != plc.rises[i]:
            is_so, should = ("rises", "fall") if change > 0 else ("falls", "rise")
            message = (
                f"the PV of {loop} {is_so} with its output, but its action expects it to {should}: positive feedback, "
                "the loop runs away"
            )
            cure = "turn the action of the loop round, or the sign of the plant's gain"
            inlet = plc.inlets.get(loop, f"{loop}.PV")
            place = net.texts[loop][0] if loop in net.texts else ("connect", inlet)
            yield Problem(place, message, "wrong_action", help=cure, key=True, loop=loop)


def effect(net: Network, plc: Plc, loop: int) -> float:
    """How far a loop's output moves its PV on its way to a limit (an integrator: in 1 s); 0: not, or not known."""
    out = net.sig[plc.cfg[loop].sig_out]
    return max(abs(answer(net, plc, loop, by=limit - out)) for limit in plc.output_limits(loop, net.sig))


def answer(net: Network, plc: Plc, loop: int, other: int | None = None, by: float = RAISED) -> float:
    """The change of a loop's PV after its output is raised ``by`` so much, and its pulses come; 0: none, or not known.

    With ``other``, the change of that loop's PV.
    """
    watched = loop if other is None else other
    raised = list(net.sig)
    outputs = {plc.cfg[loop].sig_out, *(net.names.get(f"{plc.loops[loop]}.{name}", -1) for name in plc.pulses)} - {-1}
    for slot in outputs:
        raised[slot] += by if slot == plc.cfg[loop].sig_out else RAISED
    for plant in net.plants:
        moved = plant.gain * _moved(net, plant, raised)
        raised[plant.slot] += moved
        if plant.measured != plant.slot:
            raised[plant.measured] += moved
    inlet = plc.inlets.get(plc.loops[watched])
    target = plc.cfg[watched].sig_in if inlet is None else plc.inputs[inlet]
    change: float = raised[target] - net.sig[target]
    for channel in net.channels:
        if channel.target == target:
            change = _moved(net, channel, raised)
    return change


def _moved(net: Network, reader: Plant | Channel, raised: Sequence[float]) -> float:
    """How much what a plant or a channel reads has changed; 0 where its expression has no value."""
    if reader.source >= 0:
        return raised[reader.source] - net.sig[reader.source]
    stack, values = net.pool.stack(), []
    for sig in (net.sig, raised):
        values.append(evaluate(net.pool.code, net.pool.constants, reader.first, reader.last, sig, stack))
        if stack[0]:
            return 0.0
    return values[1] - values[0]
