"""What happens during a run, in order: events of the scenario, the end of a sensor's fault, looks at a mode."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from pidcfg.paths import dotted, leaves
from pidcfg.schemas.numbers import parse_number
from pidcfg.sim.loop_facts import IN_CONTROL
from pidcfg.sim.meters import break_sensor, cut_off, repair_sensor, want
from pidcfg.sim.metrics import begin_step
from pidcfg.sim.parameters import numbers_of, set_parameters
from pidcfg.sim.plc import TICKS, Plc, steps_until
from pidcfg.sim.report import Note, rounded

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.schemas.base import Quantity
    from pidcfg.schemas.scenario import Event, Scenario
    from pidcfg.sim.engine import Machine
    from pidcfg.sim.influence import Influence
    from pidcfg.sim.journal import Journal
    from pidcfg.sim.network import Network

SETPOINT = ("setpoint", "setpoint.value")
"""The keys of a loop's set point with every vendor; the vendor's own is the third."""

GRACE = 10
"""Samples that a loop has to come into its mode."""

Action = Callable[[int], "Note | None"]
"""What is done at a base step (counted from time 0), and what the report shall say about it."""


@dataclass(slots=True)
class Agenda:
    """The stops of a run and what is done at each."""

    scenario: Scenario
    plc: Plc
    net: Network
    machine: Machine
    journal: Journal
    influence: Influence
    step: int
    modes: dict[int, str] = field(default_factory=dict)
    """Modes at the times that expectations look at them, by number of the expectation."""
    done: list[Note] = field(default_factory=list)
    """The events that have happened, in words."""
    numbers: dict[str, dict[str, float]] = field(default_factory=dict)
    """The present numbers of disturbed plants."""
    zero: int = 0
    """The base step at which time starts."""
    broken: dict[str, int] = field(default_factory=dict)
    """The event that broke a loop's sensor last."""

    def __post_init__(self) -> None:
        self.look_at_gains(0)

    def stops(self, last: int, looks: Iterable[tuple[int, Action]] = ()) -> Iterator[tuple[int, Action]]:
        """Base steps before which something is done, in order; events that come later than ``last`` are left out.

        ``looks`` come before whatever happens at the same base step.
        """
        actions: list[tuple[int, int, Action]] = [(k, -2, action) for k, action in looks]
        for i, event in enumerate(self.scenario.events):
            actions.append((self.at_or_after(event.at), 1, partial(self.happen, event, i)))
            if event.duration is not None:
                end = self.at_or_after(event.at + event.duration)
                actions.append((end, 0, partial(self.repair, event, i)))
        for i, wanted in enumerate(self.scenario.expect):
            if wanted.mode is not None and wanted.at is not None:
                look = int(wanted.at * TICKS) // self.step + 1
                actions.append((look, -1, partial(self.look, wanted.loop or "", i)))
        for k, _, action in sorted(actions, key=lambda stop: stop[:2]):
            if k <= last:
                yield k, action

    def at_or_after(self, time: Decimal) -> int:
        """The first base step that is not before a time."""
        return steps_until(time, self.step)

    def look(self, loop: str, expectation: int, _k: int) -> None:
        """Notes the mode for an expectation."""
        i = self.plc.loops.index(loop)
        self.modes[expectation] = self.plc.mode(self.plc.st[i].status)

    def happen(self, event: Event, number: int, k: int) -> Note | None:
        """Carries out an event."""
        before = list(self.net.sig)
        note = self.act(event, number, k)
        self.machine.hold(before)
        return note

    def act(self, event: Event, number: int, k: int) -> Note | None:
        """Lets an event act on PLC, plants or signals."""
        time = rounded(k * self.step / TICKS)
        self.done.append(Note(time, event.loop or event.plant, in_words(event)))
        if event.plc is not None:
            self.switch(k, event.plc)
        elif event.disturb is not None:
            self.disturb(k, event)
        elif event.loop is None:
            self.set_signals(k, event)
        elif event.set is not None:
            late = self.write(k, self.plc.loops.index(event.loop), event)
            return Note(time, event.loop, late) if late else None
        else:
            self.operate(k, self.plc.loops.index(event.loop), event, number)
        return None

    def set_signals(self, k: int, event: Event) -> None:
        """Values from outside; they may be a loop's set point, or what chooses its mode."""
        before = list(self.net.sig)
        for keys, value, _ in leaves(event.set):
            name = dotted(keys)
            self.net.sig[self.net.outside[name]] = (
                self.plc.check_input(name, value) if name in self.plc.inputs else float(parse_number(value))
            )
        slots = {slot for slot in self.influence.signals_set(event) if self.net.sig[slot] != before[slot]}
        for i in range(len(self.plc.loops)):
            if slots & set(self.plc.mode_inputs(i)):
                self.renew_intent(k, i)
            if slots & self.influence.set_points[i]:
                self.begin_step(k, i, before[self.plc.cfg[i].sig_sp])

    def renew_intent(self, k: int, loop: int) -> None:
        """What chooses a loop's mode says something else now."""
        mode = self.plc.intended_mode(loop, self.net.sig)
        bits = self.plc.modes.get(mode, 0)
        if bits & self.plc.control_bits != self.machine.meters[loop].wanted:
            self.want(k, loop, bits)

    def want(self, k: int, loop: int, bits: int) -> None:
        """A loop is meant for another mode; it has some samples to come into it."""
        want(self.machine.meters[loop], k, bits, GRACE * self.plc.cfg[loop].period // self.step)

    def begin_step(self, k: int, loop: int, before: float) -> None:
        """Measures from here on how a loop follows its set point, if it controls anything."""
        if self.plc.mode(self.plc.st[loop].status) in IN_CONTROL and self.influence.driven[loop]:
            self.machine.counts[2] += 1
            period = -(-self.plc.cfg[loop].period // self.step)
            begin_step(self.machine.meters[loop], k, before, period, self.net.sig)

    def operate(self, k: int, loop: int, event: Event, number: int) -> None:
        """What an operator does to a loop, or a sensor by itself."""
        if event.pv is not None and event.loop is not None:
            self.break_sensor(event.loop, loop, event.pv, number)
            end = None if event.duration is None else event.at + event.duration
            for_good = end is None or end >= self.scenario.duration
            break_sensor(self.machine.meters[loop], k, for_good=for_good)
        elif event.mode is not None:
            self.journal.requested[loop] = event.mode
            self.plc.request(loop, event.mode)
            self.want(k, loop, self.plc.modes[event.mode])
        elif event.ramp_soak is not None:
            self.plc.ramp_soak(loop, event.ramp_soak)
        elif event.autotune is not None:
            self.plc.autotune(loop, event.autotune)

    def write(self, k: int, loop: int, event: Event) -> str | None:
        """Writes parameters; an event that changes the set point in force starts what is measured from it."""
        sig, config = self.net.sig, self.plc.cfg[loop]
        before, changed, of_mode = sig[config.sig_sp], False, False
        late = []
        for keys, value, _ in leaves(event.set):
            present = sig[config.sig_sp]
            effect = self.plc.set(loop, keys, self.plc.check_set(loop, keys, value), sig)
            if effect:
                late.append(f"{dotted(keys)}: {effect}")
            changed |= dotted(keys) in {*SETPOINT, self.plc.setpoint} and sig[config.sig_sp] != present
            of_mode |= dotted(keys) in self.plc.mode_keys
        if of_mode:
            self.renew_intent(k, loop)
        if changed:
            self.begin_step(k, loop, before)
        return "; ".join(late) or None

    def disturb(self, k: int, event: Event) -> None:
        """Replaces numbers of a plant."""
        name = event.plant or event.loop or ""
        _, text = self.net.texts[name]
        numbers = self.numbers.setdefault(name, numbers_of(text))
        numbers |= {key: float(value) for key, value in (event.disturb or {}).items()}
        set_parameters(self.net.plants[self.net.plant_of[name]], numbers, self.step / TICKS)
        for key in event.disturb or {}:
            if f"{name}.{key}" in self.net.parameters:
                self.net.sig[self.net.parameters[f"{name}.{key}"]] = numbers[key]
        self.look_at_gains(k)

    def look_at_gains(self, k: int) -> None:
        """Notes which loops cannot move their PV from here on, since a plant has no gain."""
        for i, meter in enumerate(self.machine.meters):
            cut_off(meter, k, cut=self.influence.driven[i] and self.influence.is_cut(i))

    def break_sensor(self, name: str, loop: int, shown: Quantity, number: int) -> None:
        """The loop's analog input shows one value from now on."""
        low, high, counts = self.plc.scales[loop]
        value = float(shown.value)
        channel = self.net.channels[self.net.faults[name]]
        channel.value = low + value * (high - low) / counts if shown.counts else value
        channel.broken = 1
        self.broken[name] = number

    def repair(self, event: Event, number: int, k: int) -> None:
        """The end of a fault, unless a later one has taken its place."""
        if event.loop is not None and self.broken.get(event.loop) == number:
            self.net.channels[self.net.faults[event.loop]].broken = 0
            repair_sensor(self.machine.meters[self.plc.loops.index(event.loop)], k)

    def switch(self, k: int, mode: str) -> None:
        """The CPU's mode switch."""
        if mode == "run":
            self.plc.run((self.zero + k) * self.step)
        else:  # program or stop
            self.plc.program(self.net.sig)


def in_words(event: Event) -> str:
    """What an event does, for the report."""
    if event.set is not None:
        return ", ".join(f"set {dotted(keys)} to {as_written(value)}" for keys, value, _ in leaves(event.set))
    if event.disturb is not None:
        return ", ".join(f"disturb {key} to {value:f}" for key, value in event.disturb.items())
    if event.pv is not None:
        end = "" if event.duration is None else f" for {event.duration:f} s"
        return f"broken sensor shows {event.pv}{end}"
    if event.mode is not None:
        return f"request mode {event.mode}"
    if event.plc is not None:
        return f"PLC to {event.plc} mode"
    return f"ramp/soak {event.ramp_soak}" if event.ramp_soak else f"auto-tune {event.autotune}"


def as_written(value: object) -> str:
    """A value as the file has it."""
    return f"[{', '.join(map(str, value))}]" if isinstance(value, list | tuple) else str(value)
