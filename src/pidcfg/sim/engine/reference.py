"""The same plants beside a run with the outputs of its loops held: what they would have done without control."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from pidcfg.sim.engine.influence import read_signals
from pidcfg.sim.engine.kernel import HeldSignal, Reference
from pidcfg.sim.judgement.evidence import NOISE_MARGIN, noise_of
from pidcfg.sim.judgement.meters import Benefit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, MutableSequence, Sequence
    from typing import Any

    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.controllers.plc import Plc
    from pidcfg.sim.engine.influence import Influence
    from pidcfg.sim.engine.kernel import Channel, Storage
    from pidcfg.sim.engine.network import Network
    from pidcfg.sim.engine.plants import Plant

# Design. The second network has plants, delay lines, sound channels and signals of its own, as the run's stand when
# time begins. It sees the run's outputs until a loop first comes into Auto or Cascade, and from then on what stood
# there; outputs of loops that nobody judges, and signals from outside, it sees all the time. Disturbances reach both.


@dataclass
class HeldNetwork:
    """The second network of a run, and what is measured of each loop that has a PV from outside the program."""

    net: Network
    plants: MutableSequence[Plant] = field(default_factory=list)
    channels: MutableSequence[Channel] = field(default_factory=list)
    delay: MutableSequence[float] = field(default_factory=list)
    signal_values: MutableSequence[float] = field(default_factory=list)
    outputs: Sequence[HeldSignal] = ()
    benefits: MutableSequence[Benefit] = field(default_factory=list)
    shared_slots: list[int] = field(default_factory=list)
    """The signals that are those of the run whenever an event may have changed them."""

    @classmethod
    def begin(cls, scenario: Scenario, net: Network, plc: Plc, influence: Influence, storage: Storage) -> HeldNetwork:
        """Of a run at time 0."""
        judged_loops = [i for i, name in enumerate(plc.loops) if scenario.loops is None or name in scenario.loops]
        benefits = [
            Benefit(i, sensor_slot(plc, i), NOISE_MARGIN * noise_of(scenario, plc, net, i))
            for i in judged_loops
            if plc.loops[i] not in plc.wired_loops or plc.loops[i] in plc.pv_inputs
        ]
        network = cls(net, storage.rows(net.plants), storage.rows(net.channels), array("d", net.delay))
        network.signal_values, network.benefits = storage.numbers("d", net.signal_values), storage.rows(benefits)
        network.outputs = storage.rows(list(_held_outputs(net, plc, influence, judged_loops)))
        own = {slot for plant in net.plants for slot in (plant.slot, plant.measured)}
        own |= {channel.target for channel in net.channels} | {one.slot for one in network.outputs}
        network.shared_slots = [slot for slot in range(len(net.signal_values)) if slot not in own]
        return network

    def renew(self, scenario: Scenario, plc: Plc, restore: Callable[[Any, Any], None]) -> None:
        """At time 0 of another run of the same network, with other numbers, whose loops make no pulses."""
        for own, present in ((self.plants, self.net.plants), (self.channels, self.net.channels)):
            restore(own, present)
        restore(self.signal_values, self.net.signal_values)
        if len(self.delay) != len(self.net.delay):
            self.delay = array("d", self.net.delay)
            self.kernel_arguments = self.kernel_arguments._replace(delay=self.delay)
        restore(self.delay, self.net.delay)
        for benefit in self.benefits:
            benefit.margin = NOISE_MARGIN * noise_of(scenario, plc, self.net, benefit.loop)
            benefit.error = benefit.held_error = benefit.widest_error = 0.0

    def follow_events(self) -> None:
        """Takes over what events have changed: numbers of plants, and signals from outside."""
        for own, plant in zip(self.plants, self.net.plants, strict=True):
            own.gain, own.load, own.low, own.high = plant.gain, plant.load, plant.low, plant.high
            own.a, own.b, own.c, own.d = plant.a, plant.b, plant.c, plant.d
            own.late_a, own.late_b, own.late_c, own.late_d = plant.late_a, plant.late_b, plant.late_c, plant.late_d
        for slot in self.shared_slots:
            self.signal_values[slot] = self.net.signal_values[slot]

    @cached_property
    def kernel_arguments(self) -> Reference:
        """For the kernels."""
        return Reference(self.plants, self.channels, self.delay, self.signal_values, self.outputs, self.benefits)


def sensor_slot(plc: Plc, loop: int) -> int:
    """The signal that a loop's sensor shows, before the PLC filters it."""
    inlet = plc.pv_inputs.get(plc.loops[loop])
    return plc.configs[loop].in_slot if inlet is None else plc.inputs[inlet]


def _held_outputs(net: Network, plc: Plc, influence: Influence, judged_loops: Sequence[int]) -> Iterator[HeldSignal]:
    """What the plants and channels read of the PLC, and which loop holds it."""
    readers: list[Plant | Channel] = [*net.plants, *net.channels]
    read_slots = {slot for reader in readers for slot in read_signals(net, reader)}
    owners = {slot: i for i in judged_loops for slot in _program_followers(plc, plc.configs[i].out_slot)}
    owners |= {plc.configs[i].out_slot: i for i in judged_loops}
    pulses = {slot: i for i in judged_loops for slot in influence.pulse_signals(i)}
    sensors = {
        plc.configs[i].pv_slot: i for i in range(len(plc.loops)) if plc.configs[i].pv_slot != plc.configs[i].in_slot
    }
    outside = set(net.outside_signals.values())
    yield from (HeldSignal(i, plc.configs[i].out_slot) for i in judged_loops)
    for slot in sorted(read_slots - outside - {plc.configs[i].out_slot for i in judged_loops}):
        if slot in pulses:
            low, high = plc.output_limits(pulses[slot], net.signal_values)
            yield HeldSignal(pulses[slot], slot, plc.configs[pulses[slot]].out_slot, low, (high - low) or 1.0)
        elif slot in sensors:
            yield HeldSignal(-1, slot, sensor_slot(plc, sensors[slot]))
        elif slot < len(plc.signals) and plc.signals[slot]:
            yield HeldSignal(owners.get(slot, -1), slot)


def _program_followers(plc: Plc, slot: int) -> set[int]:
    """The signals that the PLC's program makes of one."""
    followers, waiting = set[int](), [slot]
    while waiting:
        at = waiting.pop()
        new = {target for source, target in plc.signal_links if source == at} - followers
        followers |= new
        waiting += new
    return followers
