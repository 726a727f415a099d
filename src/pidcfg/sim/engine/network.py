"""A scenario's plants and connections as the kernels see them, and plants at rest before time begins."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from math import ceil
from typing import TYPE_CHECKING, Any

from pidcfg.schemas.expressions import Expression, ExpressionError, parse
from pidcfg.sim.controllers.plc import TICKS, Plc
from pidcfg.sim.engine.expressions import Pool, Problem, evaluate, unknown_name
from pidcfg.sim.engine.kernel import Channel
from pidcfg.sim.engine.plants import MODELS, Plant, numbers_of, set_parameters, settle_at
from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

    from pidcfg.schemas.scenario import Plant as PlantText
    from pidcfg.schemas.scenario import Scenario
    from pidcfg.text.paths import Path

# --- A scenario's plants and connections as the kernels see them: signals get numbers, expressions become code --------
#
# A plant's signal as the input of another plant is free of noise; a connection to a loop's PV sees what the
# transmitters show. Plants are ordered so that each comes after those it reads; where they form a ring, the one that
# is written first reads the value of the step before. A step is exact for an input that is held. What a plant reads of
# plants is not, nor is a limit in a swing: all plants then take short parts of a base step as their steps (D916).

MAX_DELAY = 1_000_000
"""Steps of dead time in one scenario: what a buffer may take."""
MAX_PARTS = 100
STEPS_PER_LAG = 10
"""Steps that the shortest lag takes of a plant whose input is not held."""
MIN_PULSE_STEPS = 2
"""Base steps that the period of pulses has at least."""
READABLE_PARAMETERS = ("gain", "load")
"""Parameters of a plant that expressions can read: ``FIC-102.gain``."""


@dataclass(slots=True)
class Network:
    """Everything between the outputs and the PVs of the loops, and the signals of a run."""

    signal_values: list[float]
    slots: dict[str, int]
    """Signals of the report and the trend, in the order of their columns."""
    plants: list[Plant] = field(default_factory=list)
    channels: list[Channel] = field(default_factory=list)
    parts: int = 1
    """Equal parts of a base step, each of which is a step of the plants."""
    delay: MutableSequence[float] = field(default_factory=list)
    pool: Pool = field(default_factory=Pool)
    plant_index: dict[str, int] = field(default_factory=dict)
    """Index into ``plants`` by the name of the loop or the plant."""
    texts: dict[str, tuple[Path, PlantText]] = field(default_factory=dict)
    moving_plants: list[str] = field(default_factory=list)
    """Plants that read others or themselves: their inputs move within a step."""
    parameters: dict[str, int] = field(default_factory=dict)
    noisy_plants: list[str] = field(default_factory=list)
    """Names of the plants with noise, in the order of their columns."""
    outside_signals: dict[str, int] = field(default_factory=dict)
    """Signals that events may set."""
    sensor_channels: dict[str, int] = field(default_factory=dict)
    """Index into ``channels`` of a loop whose sensor can break."""
    channel_paths: dict[int, Path] = field(default_factory=dict)
    """Where the expression of a channel (its index) is written."""
    problems: list[Problem] = field(default_factory=list)
    signal_paths: dict[int, Any] = field(default_factory=dict)
    """By loop what its output can move (`pidcfg.sim.engine.influence.SignalPath`)."""
    noise_sources: dict[int, list[str]] = field(default_factory=dict)
    """By loop the noisy plants whose noise reaches its PV."""

    def add_signal(self, value: float = 0.0) -> int:
        """A new signal."""
        self.signal_values.append(value)
        return len(self.signal_values) - 1

    def longest_time(self) -> float:
        """The longest time constant or dead time in s; an integrator counts as 1/gain."""
        return float(max((t for _, text in self.texts.values() for t in (*lag_times(text), text.dead_time)), default=0))


def lag_times(text: PlantText) -> list[Decimal]:
    """The time constants of a plant in s; an integrator counts as 1/gain."""
    if text.model == "integrator":
        return [1 / abs(text.gain)] if text.gain else []
    return [t for t in (text.time_constant, text.lag, *(text.time_constants or ())) if t is not None]


def build_network(scenario: Scenario, plc: Plc, step: int, problems: Sequence[Problem] = ()) -> Network:
    """The network of a scenario whose base step is ``step`` ticks; ``problems`` are those of earlier checks.

    It is ready to run only when none of them is an error.
    """
    net = Network(
        list(plc.signal_values), {name: slot for slot, name in enumerate(plc.signals) if name}, problems=list(problems)
    )
    net.outside_signals |= plc.inputs
    for name, value in scenario.signals.items():
        if name in net.slots:
            net.problems.append(Problem(("signals", name), f"{name} is a signal of the PLC", "value", key=True))
        else:
            net.slots[name] = net.outside_signals[name] = net.add_signal(float(value))
    needs = _EventNeeds.from_scenario(scenario)
    for key, text in scenario.plants.items():
        _add_plant(net, plc, key, text, needs)
    inputs = _read_inputs(net, plc)
    _connect_pvs(net, plc, scenario.connect, needs)
    if not any(problem.severity == "error" for problem in net.problems):
        _sort_plants(net, inputs)
        slots = {plant.slot for plant in net.plants}
        net.moving_plants = [name for name in net.texts if not slots.isdisjoint(inputs[name].signals)]
        set_numbers(net, scenario, step)
    return net


def set_numbers(net: Network, scenario: Scenario, step: int) -> None:
    """Works out parts, coefficients and delay lines of the numbers that the plants have in ``net.texts``."""
    for name, (_, text) in net.texts.items():
        for parameter in READABLE_PARAMETERS:
            net.signal_values[net.parameters[f"{name}.{parameter}"]] = float(getattr(text, parameter))
    _divide_step(net, scenario, step)
    _prepare_plants(net, step)


@frozen
class _EventNeeds:
    """What events will need: loops whose sensor breaks, plants that become noisy."""

    broken_loops: frozenset[str | None]
    noisy_plants: frozenset[str | None]

    @classmethod
    def from_scenario(cls, scenario: Scenario) -> _EventNeeds:
        """Of all events."""
        broken = frozenset(event.loop for event in scenario.events if event.pv is not None)
        noisy = frozenset(e.plant or e.loop for e in scenario.events if "noise" in (e.disturb or {}))
        return cls(broken, noisy)


def _add_plant(net: Network, plc: Plc, key: str | int, text: PlantText, needs: _EventNeeds) -> None:
    """A plant with its signals; one that is named after a loop feeds the loop's PV."""
    path: Path = ("plants", key)
    name = str(key) if isinstance(key, str) else text.name
    if name is None:
        net.problems.append(
            Problem(path, "a plant in a list needs a name", help="add 'name: …', or key it by its loop")
        )
        return
    if isinstance(key, str) and text.name is not None:
        net.problems.append(Problem((*path, "name"), "a plant that is keyed by its loop has no other name", key=True))
    if isinstance(key, str) and name not in plc.loops:
        net.problems.append(unknown_name(path, "loop", name, plc.loops, key=True))
        return
    if name in net.texts or (isinstance(key, int) and name in net.slots):
        net.problems.append(Problem(path, f"{name} is taken", "value", help="give the plant another name"))
        return
    noisy = text.noise > 0 or name in needs.noisy_plants
    if name in plc.wired_loops:
        net.problems.append(_wired_pv_problem(path, name))
        return
    measured = _measured_slot(net, plc, name, needs) if name in plc.loops else net.add_signal()
    plant = Plant(MODELS[text.model], net.add_signal() if noisy else measured, measured)
    if name not in plc.loops:
        net.slots[name] = measured
    if noisy:
        plant.column = len(net.noisy_plants)
        net.noisy_plants.append(name)
    net.texts[name] = (path, text)
    net.plant_index[name] = len(net.plants)
    net.plants.append(plant)
    for parameter in READABLE_PARAMETERS:
        net.parameters[f"{name}.{parameter}"] = net.add_signal()


def _wired_pv_problem(path: Path, loop: str) -> Problem:
    """A plant for a loop that has its PV from the program."""
    message = f"the PV of {loop} comes from the PLC's program, no plant reaches it"
    cure = "wire the plant to the signal that the program makes the PV of"
    return Problem(path, message, help=cure, key=True, loop=loop)


def _measured_slot(net: Network, plc: Plc, name: str, needs: _EventNeeds) -> int:
    """The signal by which a plant reaches the analog input of its loop: the input, unless the sensor can break."""
    target: int = plc.configs[plc.loops.index(name)].in_slot
    if name not in needs.broken_loops:
        return target
    measured = net.add_signal()
    net.sensor_channels[name] = len(net.channels)
    net.channels.append(Channel(target, measured))
    return measured


def _read_inputs(net: Network, plc: Plc) -> dict[str, Expression]:
    """What each plant reads."""
    names = {**net.slots, **net.parameters}
    for i, loop in enumerate(plc.loops):
        at = net.plant_index.get(loop)
        names[f"{loop}.PV"] = plc.configs[i].in_slot if at is None else net.plants[at].slot
    names |= {name: net.plants[at].slot for name, at in net.plant_index.items() if name not in plc.loops}
    inputs = {}
    for name, (path, text) in net.texts.items():
        input_text = text.input
        if input_text is None and name in plc.loops:
            input_text = f"{name}.{plc.out_name}"
        if input_text is None:
            net.problems.append(Problem(path, f"the plant {name} has no input", help="add 'input: …'", key=True))
            continue
        expression = _read_expression(net, (*path, "input"), input_text, names)
        if expression is not None:
            inputs[name] = expression
    return inputs


def _read_expression(net: Network, path: Path, text: str, names: Mapping[str, int]) -> Expression | None:
    """An expression, or a problem at its character."""
    try:
        return parse(text, names)
    except ExpressionError as error:
        problem = Problem(path, f"expression: {error.message}", "expression", help=error.cure, offset=error.offset)
        net.problems.append(problem)
        return None


def _connect_pvs(net: Network, plc: Plc, connect: Mapping[str, str], needs: _EventNeeds) -> None:
    """Expressions wired to the PVs of loops, and loops that nothing is wired to."""
    names = {**net.slots, **net.parameters}
    for name, at in net.plant_index.items():
        names[f"{name}.PV" if name in plc.loops else name] = net.plants[at].measured
    targets = {f"{loop}.PV": loop for loop in plc.loops}
    for target, text in connect.items():
        path = ("connect", target)
        loop = targets.get(target)
        if loop is None and target in plc.inputs:
            expression = _read_expression(net, path, text, names)
            if expression is not None:
                _add_channel(net, plc.inputs[target], expression)
                net.channel_paths[len(net.channels) - 1] = path
        elif loop is None:
            net.problems.append(unknown_name(path, "loop's PV", target, [*targets, *plc.inputs], key=True))
        elif loop in plc.wired_loops:
            net.problems.append(_wired_pv_problem(path, loop))
        elif loop in net.plant_index:
            message = f"{loop} has a plant of its own, which is wired to its PV"
            net.problems.append(Problem(path, message, help=f"name the plant differently, or drop {target}", key=True))
        else:
            expression = _read_expression(net, path, text, names)
            if expression is not None:
                _add_channel(net, plc.configs[plc.loops.index(loop)].in_slot, expression)
                net.sensor_channels[loop] = len(net.channels) - 1
                net.channel_paths[len(net.channels) - 1] = path
    for i, loop in enumerate(plc.loops):
        if loop not in net.plant_index and f"{loop}.PV" not in connect and loop not in plc.wired_loops:
            low = plc.scales[i][0]
            net.signal_values[plc.configs[i].in_slot] = low
            if loop in needs.broken_loops:
                net.sensor_channels[loop] = len(net.channels)
                net.channels.append(Channel(plc.configs[i].in_slot, net.add_signal(low)))
            else:
                message = f"nothing is wired to the PV of {loop}; it stays at {low:g}"
                cure = f"add {loop} to plants, or {loop}.PV to connect"
                net.problems.append(
                    Problem(("plants",), message, "missing_plant", "warning", cure, key=True, loop=loop)
                )


def _add_channel(net: Network, target: int, expression: Expression) -> None:
    channel = Channel(target)
    if expression.signal is None:
        channel.first, channel.last = net.pool.add(expression)
    else:
        channel.source = expression.signal
    net.channels.append(channel)


def _sort_plants(net: Network, inputs: Mapping[str, Expression]) -> None:
    """Sorts the plants: each after those it reads, otherwise as written."""
    owner = {net.plants[at].slot: name for name, at in net.plant_index.items()}
    sources = {name: {owner[s] for s in inputs[name].signals if s in owner} - {name} for name in net.texts}
    sorted_names: list[str] = []
    remaining = list(net.texts)
    while remaining:
        ready = next((name for name in remaining if sources[name] <= set(sorted_names)), remaining[0])
        sorted_names.append(ready)
        remaining.remove(ready)
    plants = [net.plants[net.plant_index[name]] for name in sorted_names]
    net.plants, net.plant_index = plants, {name: i for i, name in enumerate(sorted_names)}
    for name, plant in zip(sorted_names, plants, strict=True):
        expression = inputs[name]
        if expression.signal is None:
            plant.first, plant.last = net.pool.add(expression)
        else:
            plant.source = expression.signal


def _divide_step(net: Network, scenario: Scenario, step: int) -> None:
    """The parts of a base step, by the shortest lag of a plant whose input is not held; events may shorten it."""
    net.parts = 1
    for name, (path, text) in net.texts.items():
        if name not in net.moving_plants and not (text.model == "second_order" and text.limits):
            continue
        changes = [e.disturb for e in scenario.events if e.disturb and (e.plant or e.loop) == name]
        times = [lag for change in ({}, *changes) for lag in lag_times(text.model_copy(update=change))]
        times += [text.dead_time] if not times and text.dead_time * TICKS % step else []
        parts = ceil(STEPS_PER_LAG * Decimal(step) / TICKS / min(times)) if times else 1
        net.parts = max(net.parts, min(parts, MAX_PARTS))
        if parts > MAX_PARTS:
            message = (
                f"the shortest lag of {name} is {float(min(times)):g} s, the base step {step / TICKS:g} s: "
                f"the plants go through it in {MAX_PARTS} parts, and {parts} are wanted"
            )
            cure = "give a shorter 'step' if what the plant does within a base step matters"
            net.problems.append(Problem(path, message, "rounded", "info", cure, key=True))


def _prepare_plants(net: Network, step: int) -> None:
    """Coefficients and delay lines."""
    length = 0
    for name, i in net.plant_index.items():
        path, text = net.texts[name]
        plant = net.plants[i]
        exact = text.dead_time * TICKS * net.parts / step
        plant.delay, plant.length = length, ceil(exact)
        if plant.delay + plant.length > MAX_DELAY:
            message = f"dead times of more than {MAX_DELAY} steps"
            net.problems.append(Problem((*path, "dead_time"), message, "value", help="use a longer step"))
            return
        plant.late_share = float(exact % 1)
        if text.period is not None and text.period * TICKS < MIN_PULSE_STEPS * step:
            message = (
                f"the period of {name}, {text.period:f} s, is not {MIN_PULSE_STEPS} base steps of {step / TICKS:g} s"
            )
            net.problems.append(Problem((*path, "period"), message, "value", help="give a shorter 'step'"))
            return
        length += plant.length
        set_parameters(plant, numbers_of(text), step / TICKS / net.parts)
    if length > len(net.delay):
        net.delay = [0.0] * length


# --- Plants at rest before time begins --------------------------------------------------------------------------------


def settle_plants(net: Network, initial: Sequence[float | None]) -> None:
    """Every plant at rest at its initial value (by plant; None: where its input holds it), in order of dependence."""
    stack = net.pool.new_stack()
    for plant, value in zip(net.plants, initial, strict=True):
        if plant.source >= 0:
            u = net.signal_values[plant.source]
        else:
            u = evaluate(net.pool.code, net.pool.constants, plant.first, plant.last, net.signal_values, stack)
        settle_at(plant, value, u, net.delay)
        net.signal_values[plant.slot] = net.signal_values[plant.measured] = plant.y


def initial_values(net: Network) -> list[float | None]:
    """The initial values as the scenario gives them, in the order of the plants."""
    values = [net.texts[name][1].initial for name in net.plant_index]
    return [None if value is None else float(value) for value in values]
