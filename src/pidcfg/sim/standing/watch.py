"""What the meters of a run have to know beforehand: masks, the mode that is wanted, and where the end begins."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING

from pidcfg.sim.expressions import evaluate
from pidcfg.sim.meters import Meter
from pidcfg.sim.standing.looks import PATIENCE, Look

if TYPE_CHECKING:
    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.network import Network
    from pidcfg.sim.plc import Plc

THIRD = 3
SWING_COUNTS, SWING_SHARE, SWING_NOISE = 4, 0.01, 10
"""Counts, share of the span, and standard deviations of the noise that a swing must pass, peak to peak."""


def meters_of(scenario: Scenario, plc: Plc, net: Network, last: int) -> list[Meter]:
    """A meter a loop, for a run of ``last`` base steps."""
    return [_meter(scenario, plc, net, i, last) for i in range(len(plc.loops))]


def aim(m: Meter, look: Look, pace: float) -> None:
    """Sets a meter to the next look at its loop, whose plant time is ``pace`` base steps."""
    m.window, m.middle = look.start, look.middle
    m.early_error = m.final_error = m.early_sp = m.final_sp = 0.0
    m.side = 0
    m.watched = min(m.late, max(look.stage, look.start - round(PATIENCE * pace)))


def _meter(scenario: Scenario, plc: Plc, net: Network, i: int, last: int) -> Meter:
    c = plc.cfg[i]
    m = Meter(c.sig_pv, c.sig_sp, c.sig_out)
    m.control_bits = plc.control_bits
    m.wanted = plc.modes.get(plc.goals[i], 0) & m.control_bits
    named = {e.alarm for e in scenario.expect if e.loop == plc.loops[i] and e.alarm and not e.never}
    m.outer_bits = sum(plc.alarm_bits[name] for name in plc.outer_alarms if name not in named)
    m.late = last - last // THIRD
    low, high, counts = plc.scales[i]
    span = abs(high - low)
    m.least = max(SWING_COUNTS * span / counts, SWING_SHARE * span, SWING_NOISE * noise_of(scenario, plc, net, i))
    return m


def noise_of(scenario: Scenario, plc: Plc, net: Network, loop: int) -> float:
    """The standard deviation of the noise of a loop's PV, at rest."""
    total = 0.0
    for name in net.noisy:
        plant = net.plants[net.plant_of[name]]
        later = [(e.disturb or {}).get("noise", 0) for e in scenario.events if (e.plant or e.loop) == name]
        sigma = max([plant.sigma, *map(float, later)])
        total = hypot(total, _passed_on(net, plc, loop, plant.measured, sigma))
    return total


def _passed_on(net: Network, plc: Plc, loop: int, measured: int, sigma: float) -> float:
    """What a change of a measurement by ``sigma`` makes of a loop's PV, by way of connections alone."""
    raised = list(net.sig)
    raised[measured] += sigma
    stack = net.pool.stack()
    for channel in net.channels:
        if channel.source >= 0:
            raised[channel.target] += raised[channel.source] - net.sig[channel.source]
        else:
            ends = [
                evaluate(net.pool.code, net.pool.constants, channel.first, channel.last, sig, stack)
                for sig in (net.sig, raised)
            ]
            raised[channel.target] += ends[1] - ends[0]
    inlet = plc.inlets.get(plc.loops[loop])
    target = plc.cfg[loop].sig_in if inlet is None else plc.inputs[inlet]
    return abs(raised[target] - net.sig[target])
