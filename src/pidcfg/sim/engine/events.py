"""What happens during a run, in order, and the alarms and modes that the kernel logs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, fields
from functools import partial, reduce
from operator import or_
from typing import TYPE_CHECKING, Any, TypeVar

from pidcfg.schemas.numbers import parse_number
from pidcfg.sim.controllers.plc import CONTROL_MODES, SETPOINT, TICKS, Plc, steps_until
from pidcfg.sim.engine.kernel import LOG_COLUMNS
from pidcfg.sim.engine.plants import numbers_of, set_parameters
from pidcfg.sim.judgement.meters import begin_step, break_sensor, cut_off, end_step, repair_sensor, want_mode
from pidcfg.sim.judgement.report import Alarm, LoopReport, ModeChange, Note, Period, ten_digits
from pidcfg.text.paths import dotted_text, leaves

if TYPE_CHECKING:
    from array import array
    from collections.abc import Mapping
    from decimal import Decimal

    from pidcfg.schemas.base import Quantity
    from pidcfg.schemas.scenario import Event, Scenario
    from pidcfg.sim.engine.choice import Machine
    from pidcfg.sim.engine.influence import Influence
    from pidcfg.sim.engine.network import Network

# --- Events that write what is already there: nothing happens, so that they explain nothing of what a run shows -------
#
# Design. What an event writes is tried beforehand, in the order of the events, on a PLC that does not run. What the
# PLC itself writes while it runs (an output, a set point that follows the PV in Manual, gains after an auto-tune) is
# never taken for idle.

LIVE_KEYS = ("output", "bias", "MV", "MOUT", "I_MV", "ManualMV")
"""Keys of a loop that the PLC overwrites while it controls."""


def idle_events(
    scenario: Scenario, new_plc: Callable[[], Plc], net: Network, events: Iterable[Event] | None = None
) -> list[Event]:
    """The events of a scenario that has no errors which change nothing; of some ``events`` of one kind, where given."""
    trial, candidates = _EventTrial(new_plc, net, scenario), scenario.events if events is None else events
    return [event for event in sorted(candidates, key=lambda event: event.at) if not trial.has_effect(event)]


class _EventTrial:
    """What stands where, as far as events have written it."""

    def __init__(self, new_plc: Callable[[], Plc], net: Network, scenario: Scenario) -> None:
        self.new_plc, self.net = new_plc, net
        self.plc: Plc | None = None
        self.signal_values: list[float] = []
        self.numbers = {name: numbers_of(text) for name, (_, text) in net.texts.items()}
        self.signals: dict[str, float] = {name: net.signal_values[slot] for name, slot in net.outside_signals.items()}
        self.signals |= {name: float(value) for name, value in scenario.signals.items()}
        self.plc_written: set[str | None] = set()
        """Loops whose parameters the PLC may have written itself; None: all."""
        self.running = True

    def has_effect(self, event: Event) -> bool:
        """Whether anything is otherwise after an event."""
        if event.disturb is not None:
            return _update_numbers(self.numbers[event.plant or event.loop or ""], event.disturb)
        if event.set is None:
            return self._may_switch(event)
        if event.loop is not None:
            return self._write_parameters(event.loop, event.set)
        return _update_numbers(
            self.signals, {dotted_text(keys): self._input_value(keys, value) for keys, value, _ in leaves(event.set)}
        )

    def _may_switch(self, event: Event) -> bool:
        """Whether an event may change a mode: the CPU's, or that of a loop, which only the run can tell."""
        was = self.running
        if event.plc is not None:
            self.running = event.plc == "run"
            if self.running == was:
                return False
        self.plc_written.add(event.loop)
        return True

    def _input_value(self, keys: tuple[str, ...], value: object) -> float:
        """The value of a signal as an event gives it."""
        self.plc = self.plc or self.new_plc()
        name = dotted_text(keys)
        return self.plc.check_input(name, value) if name in self.plc.inputs else float(parse_number(value))

    def _write_parameters(self, loop: str, values: dict[str, Any]) -> bool:
        """Whether parameters of a loop become others."""
        if self.plc is None or not self.signal_values:
            self.plc = self.plc or self.new_plc()
            self.signal_values = list(self.plc.signal_values)
        plc, i, changed = self.plc, self.plc.loops.index(loop), bool(self.plc_written & {loop, None})
        for keys, value, _ in leaves(values):
            before = self._loop_contents(i)
            plc.set(i, keys, plc.check_set(i, keys, value), self.signal_values)
            changed |= dotted_text(keys) in LIVE_KEYS or before != self._loop_contents(i)
        return changed

    def _loop_contents(self, loop: int) -> list[object]:
        """What the PLC has of a loop."""
        plc = self.plc or self.new_plc()
        records = [getattr(record, f.name) for record in (plc.configs[loop], plc.states[loop]) for f in fields(record)]
        return [*records, *plc.aux, *self.signal_values]


def _update_numbers(present: dict[str, float], new: Any) -> bool:
    """Writes numbers into those that are there; whether one of them is another now."""
    changed = any(present.get(key) != float(value) for key, value in new.items())
    present |= {key: float(value) for key, value in new.items()}
    return changed


# --- Alarms and modes with their times, from the rows that the kernel logs --------------------------------------------

Entry = TypeVar("Entry", Alarm, ModeChange, Note)

MAX_LISTED = 1_000
"""Alarms, mode changes and notes that are listed for a loop; so that a chattering alarm does not fill the memory."""


@dataclass(slots=True)
class Journal:
    """What happened to each loop so far."""

    plc: Plc
    dt: float
    requested_modes: list[str] = field(default_factory=list)
    """The mode that was requested last, by loop."""
    loops: list[LoopReport] = field(default_factory=list)
    modes: list[str] = field(default_factory=list)
    active_alarms: list[dict[str, float]] = field(default_factory=list)
    flags_since: list[dict[str, float]] = field(default_factory=list)
    """When each flag that is on came on, by loop."""
    profile_steps: list[tuple[str, float]] = field(default_factory=list)
    """The step of a set-point profile and its beginning, by loop."""
    seen_status: list[int] = field(default_factory=list)
    """Every status bit that was on at any time, by loop; likewise ``seen_aux``."""
    seen_aux: list[int] = field(default_factory=list)

    last_status: list[tuple[int, int] | None] = field(default_factory=list)
    """The status words of the last row, by loop."""
    mode_bits: int = 0
    """The bits of a status that tell the mode; likewise alarms and flags."""
    alarm_bits: int = 0
    flag_bits: int = 0

    def __post_init__(self) -> None:
        plc = self.plc
        groups = (plc.modes, plc.alarm_bits, plc.flag_bits)
        self.mode_bits, self.alarm_bits, self.flag_bits = (reduce(or_, group.values(), 0) for group in groups)
        for goal in self.plc.initial_modes:
            self.requested_modes.append(goal)
            self.modes.append("manual" if "manual" in self.plc.modes else goal)
            self.loops.append(LoopReport(first_mode=self.modes[-1]))
            self.flags_since.append({})
            self.profile_steps.append(("", 0.0))
            self.active_alarms.append({})
            self.seen_status.append(0)
            self.seen_aux.append(0)
            self.last_status.append(None)

    def read_log(self, log: array[int], rows: int) -> None:
        """The rows of the log, each a base step, a loop, its status words and a notice.

        There may be many of them, so only what has changed is looked at.
        """
        numbers = iter(log[: rows * LOG_COLUMNS].tolist())
        for k, loop, status, aux, notice in zip(*[numbers] * LOG_COLUMNS, strict=True):
            time = ten_digits(k * self.dt)
            status_before, aux_before = self.last_status[loop] or (~status, ~aux)
            self.last_status[loop] = status, aux
            self.seen_status[loop] |= status
            self.seen_aux[loop] |= aux
            changed = status ^ status_before
            if notice or changed & self.mode_bits:
                self._note_mode(time, loop, status, notice)
            if changed & self.alarm_bits:
                self._note_alarms(time, loop, status, changed)
            if changed & self.flag_bits:
                self._note_flags(time, loop, self.plc.flag_bits, status)
            if aux != aux_before:
                self._note_flags(time, loop, self.plc.aux_bits, aux)
                self._note_stage(time, loop, self.plc.profile_step(aux))

    def _note_mode(self, time: float, loop: int, status: int, notice: int) -> None:
        """The mode after a base step, with what led to it (D640); what does not concern it is a note."""
        mode = self.plc.mode(status)
        reason, apart = self.plc.describe(notice)
        if apart:
            self._list_entry(loop, self.loops[loop].notes, Note(time, self.plc.loops[loop], apart))
        if mode == self.modes[loop] and not reason:
            return
        requested = self.plc.requested_mode(notice) if reason else self.requested_modes[loop]
        self.modes[loop] = mode
        self._list_entry(loop, self.loops[loop].modes, ModeChange(time, requested, mode, reason or None))

    def _note_alarms(self, time: float, loop: int, status: int, changed: int) -> None:
        active = self.active_alarms[loop]
        for name, mask in self.plc.alarm_bits.items():
            if not changed & mask:
                continue
            if not status & mask and name in active:
                self._list_entry(loop, self.loops[loop].alarms, Alarm(name, active.pop(name), time))
            elif status & mask and name not in active:
                active[name] = time

    def _note_flags(self, time: float, loop: int, names: Mapping[str, int], bits: int) -> None:
        """Flags of one status word, by name and mask."""
        since = self.flags_since[loop]
        for name, mask in names.items():
            if bits & mask:
                since.setdefault(name, time)
            elif name in since:
                _list_period(self.loops[loop].conditions, Period(name, since.pop(name), time))

    def _note_stage(self, time: float, loop: int, stage: str) -> None:
        old, begun = self.profile_steps[loop]
        if stage != old:
            if old:
                _list_period(self.loops[loop].steps, Period(old, begun, time))
            self.profile_steps[loop] = (stage, time)

    def _list_entry(self, loop: int, entries: list[Entry], entry: Entry) -> None:
        if len(entries) < MAX_LISTED:
            entries.append(entry)
        else:
            self.loops[loop].unlisted += 1

    def notes(self) -> list[Note]:
        """Notes of the loops that do not concern their modes."""
        return [note for loop in self.loops for note in loop.notes]

    def close(self) -> None:
        """Alarms that are still on, and flags."""
        for loop, report in enumerate(self.loops):
            report.alarms += [Alarm(name, at) for name, at in self.active_alarms[loop].items()]
            report.conditions += [Period(name, at) for name, at in self.flags_since[loop].items()]
            report.conditions.sort(key=lambda period: period.at)
            stage, begun = self.profile_steps[loop]
            report.steps += [Period(stage, begun)] if stage else []
            report.alarms.sort(key=lambda alarm: (alarm.at, list(self.plc.alarm_bits).index(alarm.alarm)))
            report.flags = {name: bool(self.seen_status[loop] & mask) for name, mask in self.plc.flag_bits.items()}
            report.flags |= {name: bool(self.seen_aux[loop] & mask) for name, mask in self.plc.aux_bits.items()}
            report.autotune = self.plc.tuning_result(loop)


def _list_period(entries: list[Period], entry: Period) -> None:
    if len(entries) < MAX_LISTED:
        entries.append(entry)


# --- What happens during a run, in order: events of the scenario, the end of a sensor's fault, looks at a mode --------

GRACE_SAMPLES = 10
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
    past_events: list[Note] = field(default_factory=list)
    """The events that have happened, in words."""
    plant_numbers: dict[str, dict[str, float]] = field(default_factory=dict)
    """The present numbers of disturbed plants."""
    start_step: int = 0
    """The base step at which time starts."""
    broken_sensors: dict[str, int] = field(default_factory=dict)
    """The event that broke a loop's sensor last."""

    def __post_init__(self) -> None:
        self.look_at_gains(0)

    def stops(self, last: int, looks: Iterable[tuple[int, Action]] = ()) -> Iterator[tuple[int, Action]]:
        """Base steps before which something is done, in order; events that come later than ``last`` are left out.

        ``looks`` come before whatever happens at the same base step.
        """
        actions: list[tuple[int, int, Action]] = [(k, -2, action) for k, action in looks]
        for i, event in enumerate(self.scenario.events):
            begin = self.first_step(event.at)
            actions.append((begin, 1, partial(self.carry_out, event, i)))
            if event.duration is not None:  # a fault is seen once, however short it is
                end = max(begin + 1, self.first_step(event.at + event.duration))
                actions.append((end, 0, partial(self.repair_sensor, event, i)))
        for i, expectation in enumerate(self.scenario.expect):
            if expectation.mode is not None and expectation.at is not None:
                look = int(expectation.at * TICKS) // self.step + 1
                actions.append((look, -1, partial(self.note_mode, expectation.loop or "", i)))
        for k, _, action in sorted(actions, key=lambda stop: stop[:2]):
            if k <= last:
                yield k, action

    def first_step(self, time: Decimal) -> int:
        """The first base step that is not before a time."""
        return steps_until(time, self.step)

    def note_mode(self, loop: str, expectation: int, _k: int) -> None:
        """Notes the mode for an expectation."""
        i = self.plc.loops.index(loop)
        self.modes[expectation] = self.plc.mode(self.plc.states[i].status)

    def carry_out(self, event: Event, number: int, k: int) -> Note | None:
        """Carries out an event."""
        before = list(self.net.signal_values)
        self.end_steps(k, event)
        note = self.apply_event(event, number, k)
        self.machine.hold_signals(before)
        return note

    def apply_event(self, event: Event, number: int, k: int) -> Note | None:
        """Lets an event act on PLC, plants or signals."""
        time = ten_digits(k * self.step / TICKS)
        self.past_events.append(Note(time, event.loop or event.plant, describe_event(event)))
        if event.plc is not None:
            self.switch_cpu(k, event.plc)
        elif event.disturb is not None:
            self.disturb_plant(k, event)
        elif event.loop is None:
            self.set_signals(k, event)
        elif event.set is not None:
            late = self.write_parameters(k, self.plc.loops.index(event.loop), event)
            return Note(time, event.loop, late) if late else None
        else:
            self.operate_loop(k, self.plc.loops.index(event.loop), event, number)
        return None

    def end_steps(self, k: int, event: Event) -> None:
        """No answer to an earlier step is measured any longer where an event moves a loop."""
        for i, meter in enumerate(self.machine.meters):
            if self.influence.can_move(event, i):
                end_step(meter, k)

    def set_signals(self, k: int, event: Event) -> None:
        """Values from outside; they may be a loop's set point, or what chooses its mode."""
        before = list(self.net.signal_values)
        for keys, value, _ in leaves(event.set):
            name = dotted_text(keys)
            self.net.signal_values[self.net.outside_signals[name]] = (
                self.plc.check_input(name, value) if name in self.plc.inputs else float(parse_number(value))
            )
        slots = {slot for slot in self.influence.written_signals(event) if self.net.signal_values[slot] != before[slot]}
        for i in range(len(self.plc.loops)):
            if slots & set(self.plc.mode_inputs(i)):
                self.renew_intent(k, i)
            if slots & self.influence.set_point_sources[i]:
                self.begin_step(k, i, before[self.plc.configs[i].sp_slot])

    def renew_intent(self, k: int, loop: int) -> None:
        """What chooses a loop's mode says something else now."""
        mode = self.plc.intended_mode(loop, self.net.signal_values)
        bits = self.plc.modes.get(mode, 0)
        if bits & self.plc.control_bits != self.machine.meters[loop].wanted_bits:
            self.want_mode(k, loop, bits)

    def want_mode(self, k: int, loop: int, bits: int) -> None:
        """A loop is meant for another mode; it has some samples to come into it."""
        want_mode(self.machine.meters[loop], k, bits, GRACE_SAMPLES * self.plc.configs[loop].period // self.step)

    def begin_step(self, k: int, loop: int, before: float) -> None:
        """Measures from here on how a loop follows its set point, if it controls anything."""
        if self.plc.mode(self.plc.states[loop].status) in CONTROL_MODES and self.influence.is_driven[loop]:
            self.machine.counts[2] += 1
            period = -(-self.plc.configs[loop].period // self.step)
            begin_step(self.machine.meters[loop], k, before, period, self.net.signal_values)

    def operate_loop(self, k: int, loop: int, event: Event, number: int) -> None:
        """What an operator does to a loop, or a sensor by itself."""
        if event.pv is not None and event.loop is not None:
            self.break_sensor(event.loop, loop, event.pv, number)
            end = None if event.duration is None else event.at + event.duration
            for_good = end is None or end >= self.scenario.duration
            break_sensor(self.machine.meters[loop], k, for_good=for_good)
        elif event.mode is not None:
            self.journal.requested_modes[loop] = event.mode
            self.plc.request(loop, event.mode)
            self.want_mode(k, loop, self.plc.modes[event.mode])
        elif event.ramp_soak is not None:
            self.plc.ramp_soak(loop, event.ramp_soak)
        elif event.autotune is not None:
            self.plc.autotune(loop, event.autotune)

    def write_parameters(self, k: int, loop: int, event: Event) -> str | None:
        """Writes parameters; an event that changes the set point in force starts what is measured from it."""
        signals, config = self.net.signal_values, self.plc.configs[loop]
        sp_before, sp_changed, sets_mode = signals[config.sp_slot], False, False
        missing_effects = []
        for keys, value, _ in sorted(leaves(event.set), key=lambda leaf: dotted_text(leaf[0]) != self.plc.form_key):
            present = signals[config.sp_slot]
            effect = self.plc.set(loop, keys, self.plc.check_set(loop, keys, value), signals)
            if effect:
                missing_effects.append(f"{dotted_text(keys)}: {effect}")
            sp_changed |= dotted_text(keys) in {*SETPOINT, self.plc.setpoint} and signals[config.sp_slot] != present
            sets_mode |= dotted_text(keys) in self.plc.mode_keys
        if sets_mode:
            self.renew_intent(k, loop)
        if sp_changed:
            self.begin_step(k, loop, sp_before)
        return "; ".join(missing_effects) or None

    def disturb_plant(self, k: int, event: Event) -> None:
        """Replaces numbers of a plant."""
        name = event.plant or event.loop or ""
        _, text = self.net.texts[name]
        numbers = self.plant_numbers.setdefault(name, numbers_of(text))
        numbers |= {key: float(value) for key, value in (event.disturb or {}).items()}
        set_parameters(self.net.plants[self.net.plant_index[name]], numbers, self.step / TICKS / self.net.parts)
        for key in event.disturb or {}:
            if f"{name}.{key}" in self.net.parameters:
                self.net.signal_values[self.net.parameters[f"{name}.{key}"]] = numbers[key]
        self.look_at_gains(k)

    def look_at_gains(self, k: int) -> None:
        """Notes which loops cannot move their PV from here on, since a plant has no gain."""
        for i, meter in enumerate(self.machine.meters):
            cut_off(meter, k, is_cut=self.influence.is_driven[i] and self.influence.is_cut(i))

    def break_sensor(self, name: str, loop: int, reading: Quantity, number: int) -> None:
        """The loop's analog input shows one value from now on."""
        low, high, counts = self.plc.scales[loop]
        value = float(reading.value)
        channel = self.net.channels[self.net.sensor_channels[name]]
        channel.value = low + value * (high - low) / counts if reading.counts else value
        channel.broken = 1
        self.broken_sensors[name] = number

    def repair_sensor(self, event: Event, number: int, k: int) -> None:
        """The end of a fault, unless a later one has taken its place."""
        if event.loop is not None and self.broken_sensors.get(event.loop) == number:
            self.end_steps(k, event)
            self.net.channels[self.net.sensor_channels[event.loop]].broken = 0
            repair_sensor(self.machine.meters[self.plc.loops.index(event.loop)], k)

    def switch_cpu(self, k: int, mode: str) -> None:
        """The CPU's mode switch."""
        if mode == "run":
            self.plc.run((self.start_step + k) * self.step)
        else:  # program or stop
            self.plc.program(self.net.signal_values)


def describe_event(event: Event) -> str:
    """What an event does, for the report."""
    if event.set is not None:
        return ", ".join(f"set {dotted_text(keys)} to {value_text(value)}" for keys, value, _ in leaves(event.set))
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


def value_text(value: object) -> str:
    """A value as the file has it."""
    return f"[{', '.join(map(str, value))}]" if isinstance(value, list | tuple) else str(value)
