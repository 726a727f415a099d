"""What moves what in a run, and whether a loop's action fits its plant."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.schemas.expressions import CONSTANT, SIGNAL
from pidcfg.sim.engine.expressions import Problem, depends_on, evaluate
from pidcfg.sim.engine.plants import PERCENT, PULSES
from pidcfg.text.paths import dotted_text, leaves

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from pidcfg.schemas.scenario import Event, Scenario
    from pidcfg.sim.controllers.plc import Plc
    from pidcfg.sim.engine.kernel import Channel
    from pidcfg.sim.engine.network import Network
    from pidcfg.sim.engine.plants import Plant

# --- What moves what in a run: signals that follow others through plants, connections and the PLC's program -----------
#
# Design. A graph of signals (their slots), worked out once from the wiring. A plant without gain and without an event
# that gives it one moves nothing, nor does what is multiplied by 0; how far something moves is for the run to tell.
# Every loop's PV moves its output and so does its set point.


MAX_CACHED_EVENTS = 1_000
"""Events of which it is kept what they move."""


@dataclass(slots=True)
class Influence:
    """The graph, and the questions that verdicts ask of it."""

    net: Network
    plc: Plc
    followers: dict[int, set[int]] = field(default_factory=lambda: defaultdict(set))
    is_driven: list[bool] = field(default_factory=list)
    """Whether each loop's output moves its PV, or a signal does that the scenario sets."""
    idle_events: Collection[Event] = ()
    """Events that change nothing."""
    event_signals: set[int] = field(default_factory=set)
    """The signals that the scenario's events set."""
    set_point_sources: list[set[int]] = field(default_factory=list)
    """The signals that each loop's set point in force is made of by the program alone, without another loop."""
    _reached_cache: dict[tuple[frozenset[int], frozenset[int]], frozenset[int]] = field(default_factory=dict)
    """Answers of `reached_signals`: a run asks the same again and again, and the graph stays."""
    _followers_cache: dict[int, tuple[frozenset[int], frozenset[int]]] = field(default_factory=dict)
    _plants: dict[int, Sequence[str]] = field(default_factory=dict)
    _event_cache: dict[int, tuple[Event, frozenset[int]]] = field(default_factory=dict)
    """What events move, by their identity."""

    @classmethod
    def build(cls, scenario: Scenario, net: Network, plc: Plc, idle_events: Collection[Event] = ()) -> Influence:
        """Of a scenario whose network is ready, and of whose events some are ``idle_events``."""
        self = cls(net, plc, idle_events=idle_events)
        revived_plants = {e.plant or e.loop for e in scenario.events if (e.disturb or {}).get("gain")}
        for name, at in net.plant_index.items():
            plant = net.plants[at]
            if plant.gain or name in revived_plants:
                self._add_moves(followed_signals(net, plant), (plant.slot, plant.measured))
            self._add_moves([plant.slot], [plant.measured])
        for channel in net.channels:
            self._add_moves(followed_signals(net, channel), [channel.target])
        for i, config in enumerate(plc.configs[: len(plc.loops)]):
            self._add_moves([config.in_slot], [config.pv_slot])
            self._add_moves([config.pv_slot, config.sp_slot], [config.out_slot])
            self._add_moves([config.out_slot], self.pulse_signals(i))
        for source, target in plc.signal_links:
            self.followers[source].add(target)
        self.event_signals = {slot for event in scenario.events for slot in self.written_signals(event)}
        for i, config in enumerate(plc.configs[: len(plc.loops)]):
            self.is_driven.append(self.can_drive(i) or self.is_moved_by_events(i))
            self.set_point_sources.append(self._outside_sources(config.sp_slot))
        return self

    def can_drive(self, loop: int, excluded: Collection[int] = ()) -> bool:
        """Whether a loop's output moves its PV, not by way of ``excluded``."""
        config = self.plc.configs[loop]
        return config.pv_slot in self.reached_signals([config.out_slot], excluded)

    def is_moved_by_events(self, loop: int, excluded: Collection[int] = ()) -> bool:
        """Whether a signal that the scenario sets moves a loop's PV."""
        return self.plc.configs[loop].pv_slot in self.reached_signals(self.event_signals, excluded)

    def is_cut(self, loop: int) -> bool:
        """Whether plants that have no gain now keep a loop's output and the scenario from moving its PV."""
        dead = {plant.slot for plant in self.net.plants if not plant.gain}
        return not self.can_drive(loop, dead) and not self.is_moved_by_events(loop, dead)

    def _outside_sources(self, slot: int) -> set[int]:
        """Signals from outside that reach a slot otherwise than through a loop."""
        configs = self.plc.configs[: len(self.plc.loops)]
        loops = {place for config in configs for place in (config.pv_slot, config.out_slot)}
        return {
            source
            for source in self.net.outside_signals.values()
            if slot in self.reached_signals([source], excluded=loops)
        }

    def _add_moves(self, sources: Iterable[int], targets: Iterable[int]) -> None:
        for source in sources:
            self.followers[source].update(targets)

    def pulse_signals(self, loop: int) -> list[int]:
        """The signals that follow a loop's output as pulses."""
        names = (f"{self.plc.loops[loop]}.{name}" for name in self.plc.pulses)
        return [self.net.slots[name] for name in names if name in self.net.slots]

    def pulse_cycle(self, loop: int) -> float:
        """The period of the pulses that follow a loop's output, its own or plants', in s; 0: none do."""
        follow = self.moved_by_output(loop)
        periods = (plant.b for plant in self.net.plants if plant.model == PULSES and plant.slot in follow)
        return max(self.plc.pulse_cycle(loop), *periods, 0.0)

    def reached_signals(self, sources: Iterable[int], excluded: Collection[int] = ()) -> frozenset[int]:
        """Everything that follows the ``sources``, themselves included; not by way of ``excluded``."""
        question = frozenset(sources), frozenset(excluded)
        if question not in self._reached_cache:
            self._reached_cache[question] = frozenset(self._find_followers(*question))
        return self._reached_cache[question]

    def _find_followers(self, sources: Iterable[int], excluded: Collection[int]) -> set[int]:
        """The same, worked out."""
        waiting = list(sources)
        reached = set(waiting)
        while waiting:
            for target in self.followers.get(waiting.pop(), ()):
                if target not in reached and target not in excluded:
                    reached.add(target)
                    waiting.append(target)
        return reached

    def moved_by_output(self, loop: int) -> frozenset[int]:
        """Everything that a loop's output moves."""
        return self.reached_signals([self.plc.configs[loop].out_slot])

    def own_and_other_signals(self, loop: int) -> tuple[frozenset[int], frozenset[int]]:
        """What follows a loop's output, and what follows those of the others, neither by way of a PV or the other."""
        configs = self.plc.configs[: len(self.plc.loops)]
        if loop not in self._followers_cache:
            pvs, out = {config.pv_slot for config in configs}, configs[loop].out_slot
            others = {config.out_slot for config in configs} - {out}
            own = self.reached_signals([out], pvs | others)
            self._followers_cache[loop] = (own, self.reached_signals(others, pvs | {out}))
        return self._followers_cache[loop]

    def moved_by_event(self, event: Event) -> frozenset[int]:
        """Everything that an event moves; one of the CPU moves all outputs."""
        configs = self.plc.configs[: len(self.plc.loops)]
        if event.plc is not None:
            return self.reached_signals([config.out_slot for config in configs])
        if event.disturb is not None:
            return self.reached_signals([self.net.plants[self.net.plant_index[event.plant or event.loop or ""]].slot])
        if event.loop is None:
            return self.reached_signals(self.written_signals(event))
        config = configs[self.plc.loops.index(event.loop)]
        return self.reached_signals([config.pv_slot if event.pv is not None else config.sp_slot])

    def written_signals(self, event: Event) -> list[int]:
        """The signals from outside that an event sets."""
        if event.set is None or event.loop is not None:
            return []
        return [self.net.outside_signals[dotted_text(keys)] for keys, _, _ in leaves(event.set)]

    def can_move(self, event: Event, loop: int) -> bool:
        """Whether an event moves a loop's PV or its set point; one that changes nothing moves nothing."""
        if any(event is one for one in self.idle_events):
            return False
        known, moved_signals = self._event_cache.get(id(event), (None, frozenset()))
        if known is not event:
            moved_signals = self.moved_by_event(event)
            if len(self._event_cache) >= MAX_CACHED_EVENTS:  # a batch has new ones in each sample
                self._event_cache.clear()
            self._event_cache[id(event)] = event, moved_signals
        config = self.plc.configs[loop]
        return config.pv_slot in moved_signals or config.sp_slot in moved_signals

    def plants_between(self, loop: int) -> Sequence[str]:
        """The plants by which a loop's output moves its PV."""
        if loop not in self._plants:
            after, pv = self.moved_by_output(loop), self.plc.configs[loop].pv_slot
            slots = ((name, self.net.plants[at].slot) for name, at in self.net.plant_index.items())
            self._plants[loop] = [name for name, slot in slots if slot in after and pv in self.reached_signals([slot])]
        return self._plants[loop]


def followed_signals(net: Network, reader: Plant | Channel) -> Collection[int]:
    """The signals that a plant or a channel reads and really follows."""
    read, pool = read_signals(net, reader), net.pool
    if reader.source >= 0 or CONSTANT not in pool.code[reader.first : reader.last : 2]:
        return read
    stack = pool.new_stack()

    def value(signals: Sequence[float]) -> float | None:
        result = evaluate(pool.code, pool.constants, reader.first, reader.last, signals, stack)
        return None if stack[0] else result

    return {slot for slot in read if depends_on(value, net.signal_values, read, slot)}


def read_signals(net: Network, reader: Plant | Channel) -> Collection[int]:
    """The signals that a plant or a channel reads."""
    if reader.source >= 0:
        return (reader.source,)
    code = net.pool.code[reader.first : reader.last]
    return {operand for op, operand in zip(code[::2], code[1::2], strict=True) if op == SIGNAL}


# --- Whether a loop's action fits its plant: the way from its output to its PV, looked at before anything runs --------
#
# Design. Every signal that follows the output is raised a little, and the change is carried through the plants in
# their order, by the sign of their gain, and through the expressions as they stand at time 0. A PV that falls where
# the action takes for granted that it rises, or the other way round, is positive feedback: the loop runs away. Ways
# through another loop, and expressions that do not answer at time 0, tell nothing.

OUTPUT_STEP = 1.0
"""By how much an output is raised, in its unit."""


def wrong_actions(net: Network, plc: Plc) -> Iterator[Problem]:
    """A problem for each loop whose action does not fit its plant; the network is at rest at its initial values."""
    for i, loop in enumerate(plc.loops):
        change = pv_change(net, plc, i)
        if change and (change > 0) != plc.output_raises_pv[i]:
            is_so, should = ("rises", "fall") if change > 0 else ("falls", "rise")
            message = (
                f"the PV of {loop} {is_so} with its output, but its action expects it to {should}: positive feedback, "
                "the loop runs away"
            )
            cure = "turn the action of the loop round, or the sign of the plant's gain"
            inlet = plc.pv_inputs.get(loop, f"{loop}.PV")
            path = net.texts[loop][0] if loop in net.texts else ("connect", inlet)
            yield Problem(path, message, "wrong_action", help=cure, key=True, loop=loop)


def output_effect(net: Network, plc: Plc, loop: int) -> float:
    """How far a loop's output moves its PV on its way to a limit (an integrator: in 1 s); 0: not, or not known."""
    out = net.signal_values[plc.configs[loop].out_slot]
    return max(abs(pv_change(net, plc, loop, step=limit - out)) for limit in plc.output_limits(loop, net.signal_values))


def pv_change(net: Network, plc: Plc, loop: int, other_loop: int | None = None, step: float = OUTPUT_STEP) -> float:
    """The change of a loop's PV after its output is raised by ``step``, and its pulses come; 0: none, or not known.

    With ``other_loop``, the change of that loop's PV.
    """
    watched_loop = loop if other_loop is None else other_loop
    path = signal_path(net, plc, loop)
    inlet = plc.pv_inputs.get(plc.loops[watched_loop])
    target = plc.configs[watched_loop].in_slot if inlet is None else plc.inputs[inlet]
    if target not in path.slots:
        return 0.0
    raised_signals = list(net.signal_values)
    for slot in path.outputs:
        raised_signals[slot] += step if slot == plc.configs[loop].out_slot else OUTPUT_STEP
    for at in path.plants:
        plant = net.plants[at]
        moved = plant.gain * _input_change(net, plant, raised_signals) / (PERCENT if plant.model == PULSES else 1.0)
        raised_signals[plant.slot] += moved
        if plant.measured != plant.slot:
            raised_signals[plant.measured] += moved
    change: float = raised_signals[target] - net.signal_values[target]
    for channel in net.channels:
        if channel.target == target:
            change = _input_change(net, channel, raised_signals)
    return change


class SignalPath(NamedTuple):
    """What can move with a loop's output, by what reads what alone; all else stands still, whatever its numbers."""

    outputs: Collection[int]
    """The output, and its pulses."""
    plants: Sequence[int]
    slots: Collection[int]
    """The signals."""


def signal_path(net: Network, plc: Plc, loop: int) -> SignalPath:
    """The way of a loop's output; the wiring of a network stays, so it is looked for once."""
    path: SignalPath | None = net.signal_paths.get(loop)
    if path is None:
        pulses = {net.slots.get(f"{plc.loops[loop]}.{name}", -1) for name in plc.pulses} - {-1}
        outputs = {plc.configs[loop].out_slot, *pulses}
        slots, plants = set(outputs), []
        for at, plant in enumerate(net.plants):
            if not slots.isdisjoint(read_signals(net, plant)):
                plants.append(at)
                slots |= {plant.slot, plant.measured}
        wired = [channel for channel in net.channels if not slots.isdisjoint(read_signals(net, channel))]
        path = net.signal_paths[loop] = SignalPath(outputs, plants, slots | {channel.target for channel in wired})
    return path


def _input_change(net: Network, reader: Plant | Channel, raised_signals: Sequence[float]) -> float:
    """How much what a plant or a channel reads has changed; 0 where its expression has no value."""
    if reader.source >= 0:
        return raised_signals[reader.source] - net.signal_values[reader.source]
    stack, values = net.pool.new_stack(), []
    for signals in (net.signal_values, raised_signals):
        values.append(evaluate(net.pool.code, net.pool.constants, reader.first, reader.last, signals, stack))
        if stack[0]:
            return 0.0
    return values[1] - values[0]
