"""A run that is made once and begun again and again, for scenarios that differ in nothing but numbers."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from pydantic_core import PydanticCustomError, ValidationError

from pidcfg.schemas.scenario import Event, Plant, Scenario
from pidcfg.sim.controllers.plc import Controller, Plc
from pidcfg.sim.engine.checks import check_plant
from pidcfg.sim.engine.events import Agenda, idle_events
from pidcfg.sim.engine.influence import Influence, wrong_actions
from pidcfg.sim.engine.network import initial_values, set_numbers, settle_plants
from pidcfg.sim.engine.run import Run, Settings, settle_run
from pidcfg.sim.judgement.evidence import min_swing
from pidcfg.text.paths import leaves

# Design. What a scenario says in names (loops, wiring, events, expectations) is read, checked and wired once. Another
# one may have other numbers in its plants, another seed, and other values of the parameters that its events set; all
# records then go back to what they held before the plants came to rest, and the rest is that of any run. What would
# change more than numbers, or is wrong, is refused: such a scenario runs by itself, which also says what is wrong.

ARRAY_FIELDS = ("configs", "states", "aux")
"""Of a PLC, what lies where the kernels work on it; all else is Python's."""


class IrregularError(Exception):
    """A scenario that differs in more than numbers from the one that the run was made of."""


def replace_numbers(base: Scenario, seed: int, plants: Mapping[Any, Any], events: Sequence[Any]) -> Scenario:
    """A scenario with other plants, by key, and other events at its beginning, as data; raises `IrregularError`."""
    try:
        new = {key: Plant.model_validate(plant) for key, plant in plants.items()}
        first = [Event.model_validate(event) for event in events]
    except ValidationError as error:
        raise IrregularError(str(error)) from None
    changed = {"seed": seed, "plants": base.plants | new, "events": (*first, *base.events[len(first) :])}
    return base.model_copy(update=changed)


class RepeatedRun:
    """A run of one scenario, to be begun again for others like it; raises `UnusableError` as `simulate` does."""

    def __init__(
        self, scenario: Scenario, new_plc: Callable[[], Plc], controller: Controller, settings: Settings
    ) -> None:
        self.run = run = Run.prepare(scenario, new_plc, controller, settings)
        self.plc = plc = run.plc
        machine, net, storage = run.machine, run.net, run.machine.kernels.storage
        rows: tuple[Any, ...] = (
            plc.configs,
            plc.states,
            net.plants,
            net.channels,
            machine.meters,
            machine.bands,
            machine.gauges,
        )
        self.restore = storage.copy_into
        self.plc_data = [
            (plc.aux, storage.numbers("d", plc.aux)),
            *((objects, storage.rows(objects)) for objects in rows[:2]),
        ]
        self.other_data: list[tuple[Any, Any]] = [(net.signal_values, storage.numbers("d", run.initial_signals))]
        self.other_data += [(objects, storage.rows(objects)) for objects in (*rows[2:], machine.onsets)]
        fixed = {name: value for name, value in vars(plc).items() if name not in ARRAY_FIELDS}
        operated = any(event.loop is not None or event.plc is not None for event in scenario.events)
        self.plc_pickle = pickle.dumps(fixed, pickle.HIGHEST_PROTOCOL) if operated else b""
        self.is_fresh = False
        """Nothing has happened to the PLC yet."""
        self.trial = new_plc if isinstance(scenario.initial, dict) else self._operated_plc
        self.has_new_parameters = False
        """Events write other parameters of loops than those of the first scenario."""
        self.idle_events = [event for event in run.agenda.influence.idle_events if event.disturb is None]
        self.gains = [bool(plant.gain) for plant in net.plants]
        self.has_pulses = any(run.agenda.influence.pulse_signals(i) for i in range(len(plc.loops)))

    def begin(self, scenario: Scenario) -> Run:
        """A run of another scenario at time 0; raises `IrregularError`."""
        self.has_new_parameters = self._take_over(scenario)
        return settle_run(lambda: self._renew_run(scenario))

    def _take_over(self, scenario: Scenario) -> bool:
        """Holds a scenario against the first one, and takes over what is new; whether it writes other parameters."""
        first, net = self.run.scenario, self.run.net
        has_other_parameters = False
        if len(scenario.events) != len(first.events):
            raise IrregularError("events")
        for event, known in zip(scenario.events, first.events, strict=True):
            if event is not known:
                self._renew_plc()
                self._check_event(event)
                has_other_parameters = True
        for name, (path, known_plant) in net.texts.items():
            plant = scenario.plants[path[-1]]
            if plant is known_plant:
                continue
            if any(check_plant(path, plant)) or (plant.noise > 0) is not (known_plant.noise > 0):
                raise IrregularError(name)
            net.texts[name] = path, plant
        return has_other_parameters

    def _check_event(self, event: Event) -> None:
        """Another value of a parameter: the PLC takes it, and it is no sample rate."""
        if event.loop is None or event.set is None:
            raise IrregularError("an event")
        loop = self.plc.loops.index(event.loop)
        for keys, value, _ in leaves(event.set):
            content = None
            with suppress(PydanticCustomError):
                content = self.plc.check_set(loop, keys, value)
            if content is None or self.plc.new_period(loop, keys, content):
                raise IrregularError(event.loop)

    def _renew_run(self, scenario: Scenario) -> Run:
        """Everything in place for another scenario, nothing run yet."""
        first_run = self.run
        net, machine, plc = first_run.net, first_run.machine, self.plc
        self._renew_plc()
        for target, kept in self.other_data:
            self.restore(target, kept)
        net.problems.clear()
        set_numbers(net, scenario, first_run.step)
        if any(problem.severity == "error" for problem in net.problems):
            raise IrregularError("its plants")
        settle_plants(net, initial_values(net))
        problems = list(wrong_actions(net, plc))
        influence = self._renew_influence(scenario)
        if net.noisy_plants:
            for i, meter in enumerate(machine.meters):
                meter.min_swing = min_swing(scenario, plc, net, i)
        machine.restart()
        journal = first_run.journal
        agenda = Agenda(scenario, plc, net, machine, journal, influence, first_run.step)
        run = Run(
            scenario,
            first_run.settings,
            plc,
            net,
            first_run.step,
            first_run.last,
            first_run.engine,
            machine,
            journal,
            agenda,
            first_run.watches,
            problems,
        )
        run.old_reference, machine.reference = (None if self.has_pulses else machine.reference), None
        self.is_fresh = False
        return run

    def _renew_influence(self, scenario: Scenario) -> Influence:
        """What moves what: the same as long as the same plants have a gain."""
        net, plc = self.run.net, self.plc
        disturbances = [event for event in scenario.events if event.disturb is not None]
        if self.has_new_parameters:
            idle = idle_events(scenario, self.trial, net)
            self._renew_plc()
        else:
            idle = [*self.idle_events, *idle_events(scenario, self.trial, net, disturbances)]
        influence = self.run.agenda.influence
        if self.gains != [bool(plant.gain) for plant in net.plants]:
            return Influence.build(scenario, net, plc, idle)
        influence.idle_events = idle
        return influence

    def _operated_plc(self) -> Plc:
        """The PLC at its program-to-run transition, for somebody who will change it."""
        self.is_fresh = False
        return self.plc

    def _renew_plc(self) -> None:
        """The PLC at its program-to-run transition."""
        if self.is_fresh:
            return
        self.is_fresh = True
        for target, kept in self.plc_data:
            self.restore(target, kept)
        if self.plc_pickle:
            vars(self.plc).update(pickle.loads(self.plc_pickle))  # noqa: S301 - our own bytes
