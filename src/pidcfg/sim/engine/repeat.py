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
from pidcfg.sim.engine.network import initial_values, rest, set_numbers
from pidcfg.sim.engine.run import Run, Settings, settled
from pidcfg.sim.judgement.evidence import least_swing
from pidcfg.text.paths import leaves

# Design. What a scenario says in names (loops, wiring, events, expectations) is read, checked and wired once. Another
# one may have other numbers in its plants, another seed, and other values of the parameters that its events set; all
# records then go back to what they held before the plants came to rest, and the rest is that of any run. What would
# change more than numbers, or is wrong, is refused: such a scenario runs by itself, which also says what is wrong.

IN_ARRAYS = ("configs", "states", "aux")
"""Of a PLC, what lies where the kernels work on it; all else is Python's."""


class IrregularError(Exception):
    """A scenario that differs in more than numbers from the one that the run was made of."""


def with_numbers(known: Scenario, seed: int, plants: Mapping[Any, Any], events: Sequence[Any]) -> Scenario:
    """A scenario with other plants, by key, and other events at its beginning, as data; raises `IrregularError`."""
    try:
        new = {key: Plant.model_validate(plant) for key, plant in plants.items()}
        first = [Event.model_validate(event) for event in events]
    except ValidationError as error:
        raise IrregularError(str(error)) from None
    changed = {"seed": seed, "plants": known.plants | new, "events": (*first, *known.events[len(first) :])}
    return known.model_copy(update=changed)


class Repeated:
    """A run of one scenario, to be begun again for others like it; raises `UnusableError` as `simulate` does."""

    def __init__(
        self, scenario: Scenario, new_plc: Callable[[], Plc], controller: Controller, settings: Settings
    ) -> None:
        self.run = run = Run.of(scenario, new_plc, controller, settings)
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
        self.put = storage.put
        self.of_plc = [(plc.aux, storage.numbers("d", plc.aux)), *((one, storage.rows(one)) for one in rows[:2])]
        self.others: list[tuple[Any, Any]] = [(net.signal_values, storage.numbers("d", run.given))]
        self.others += [(one, storage.rows(one)) for one in (*rows[2:], machine.onsets)]
        fixed = {name: value for name, value in vars(plc).items() if name not in IN_ARRAYS}
        operated = any(event.loop is not None or event.plc is not None for event in scenario.events)
        self.python = pickle.dumps(fixed, pickle.HIGHEST_PROTOCOL) if operated else b""
        self.clean = False
        """Nothing has happened to the PLC yet."""
        self.trial = new_plc if isinstance(scenario.initial, dict) else self._operated_plc
        self.written = False
        """Events write other parameters of loops than those of the first scenario."""
        self.idle = [event for event in run.agenda.influence.idle if event.disturb is None]
        self.gains = [bool(plant.gain) for plant in net.plants]
        self.pulsed = any(run.agenda.influence.pulses(i) for i in range(len(plc.loops)))

    def begin(self, scenario: Scenario) -> Run:
        """A run of another scenario at time 0; raises `IrregularError`."""
        self.written = self._take(scenario)
        return settled(lambda: self._again(scenario))

    def _take(self, scenario: Scenario) -> bool:
        """Holds a scenario against the first one, and takes over what is new; whether it writes other parameters."""
        first, net = self.run.scenario, self.run.net
        written = False
        if len(scenario.events) != len(first.events):
            raise IrregularError("events")
        for event, known in zip(scenario.events, first.events, strict=True):
            if event is not known:
                self._renew_plc()
                self._check_event(event)
                written = True
        for name, (path, known_plant) in net.texts.items():
            plant = scenario.plants[path[-1]]
            if plant is known_plant:
                continue
            if any(check_plant(path, plant)) or (plant.noise > 0) is not (known_plant.noise > 0):
                raise IrregularError(name)
            net.texts[name] = path, plant
        return written

    def _check_event(self, event: Event) -> None:
        """Another value of a parameter: the PLC takes it, and it is no sample rate."""
        if event.loop is None or event.set is None:
            raise IrregularError("an event")
        loop = self.plc.loops.index(event.loop)
        for keys, value, _ in leaves(event.set):
            content = None
            with suppress(PydanticCustomError):
                content = self.plc.check_set(loop, keys, value)
            if content is None or self.plc.period_set(loop, keys, content):
                raise IrregularError(event.loop)

    def _again(self, scenario: Scenario) -> Run:
        """Everything in place for another scenario, nothing run yet."""
        made = self.run
        net, machine, plc = made.net, made.machine, self.plc
        self._renew_plc()
        for target, kept in self.others:
            self.put(target, kept)
        net.problems.clear()
        set_numbers(net, scenario, made.step)
        if any(problem.severity == "error" for problem in net.problems):
            raise IrregularError("its plants")
        rest(net, initial_values(net))
        problems = list(wrong_actions(net, plc))
        influence = self._influence(scenario)
        if net.noisy:
            for i, meter in enumerate(machine.meters):
                meter.least = least_swing(scenario, plc, net, i)
        machine.renew()
        journal = made.journal
        agenda = Agenda(scenario, plc, net, machine, journal, influence, made.step)
        run = Run(
            scenario,
            made.settings,
            plc,
            net,
            made.step,
            made.last,
            made.engine,
            machine,
            journal,
            agenda,
            made.watches,
            problems,
        )
        run.beside, machine.reference = (None if self.pulsed else machine.reference), None
        self.clean = False
        return run

    def _influence(self, scenario: Scenario) -> Influence:
        """What moves what: the same as long as the same plants have a gain."""
        net, plc = self.run.net, self.plc
        disturbances = [event for event in scenario.events if event.disturb is not None]
        if self.written:
            idle = idle_events(scenario, self.trial, net)
            self._renew_plc()
        else:
            idle = [*self.idle, *idle_events(scenario, self.trial, net, disturbances)]
        found = self.run.agenda.influence
        if self.gains != [bool(plant.gain) for plant in net.plants]:
            return Influence.of(scenario, net, plc, idle)
        found.idle = idle
        return found

    def _operated_plc(self) -> Plc:
        """The PLC at its program-to-run transition, for somebody who will change it."""
        self.clean = False
        return self.plc

    def _renew_plc(self) -> None:
        """The PLC at its program-to-run transition."""
        if self.clean:
            return
        self.clean = True
        for target, kept in self.of_plc:
            self.put(target, kept)
        if self.python:
            vars(self.plc).update(pickle.loads(self.python))  # noqa: S301 - our own bytes
