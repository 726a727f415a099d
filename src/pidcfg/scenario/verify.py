"""Source and result of a conversion on the same plants: how far their answers lie apart.

Design. Each loop gets a first-order plant with dead time that its own gains fit (D304), scaled in shares of the output,
so that both sides' outputs mean the same. Each side settles in Auto in the middle of its range, gets a step of the set
point and then a disturbance; both trends are compared at the same times.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pidcfg.pictures.chart import Chart
    from pidcfg.schemas.generic import Loop
    from pidcfg.sim.plc import Plc
    from pidcfg.vendors import Vendor

D304 = Decision(
    304,
    "a conversion is verified on the plant that the loop's own gains fit",
    "Time constant Ti (without an integral 50 samples), dead time a tenth of it, and the gain for which lambda tuning "
    "gives the loop's gain; a step of 5 % of the range, or of a fifth of what the output can do, then a load that "
    "moves the PV by as much.",
    "A loop that is tuned at all is stable on it, and it shows gain, times, action and scales of both sides.",
)
LAMBDA = 0.5
DEAD = 0.1
STEP, REACH = 0.05, 0.2
"""Of the range, and of what the output can do: the step is the smaller one."""
SAMPLES_WITHOUT_INTEGRAL = 50
SETTLED, STEP_AT, LOAD_AT, END = 7.5, 8.0, 16.0, 24.0
"""In time constants of the slowest loop: from when on both sides are compared, and what happens."""
Way = Literal["alone", "linked", "ideal"]
"""Every loop by itself; slaves of a cascade linked; linked, and their PVs at their set points."""
POINTS = 2_000
"""Rows of a trend."""


@dataclass(frozen=True, slots=True)
class Tested:
    """One side: its vendor, its image, the loops that are compared, and their places in its PLC."""

    vendor: Vendor
    image: Any
    loops: Sequence[Loop]
    places: Sequence[int]


@dataclass(frozen=True, slots=True)
class Verified:
    """How far one loop's two sides lie apart, in % of the ranges, and how their integrals of the error compare."""

    loop: str
    pv_percent: float
    output_percent: float
    iae_ratio: float | None
    chart: Chart


@dataclass(frozen=True, slots=True)
class Plant:
    """A loop's plant, in PV units per share of the output."""

    gain: float
    time: float
    dead: float
    load: float
    start: float
    step: float


def plant_of(loop: Loop, other: Loop) -> Plant:
    """The plant that the loop's own gains fit; ``other``: the same loop on the other side, which may sample slower."""
    low, high = (float(end) for end in loop.pv.range)
    out_low, out_high = (float(end) for end in loop.output.range)
    sample = float(max(loop.sample_time, other.sample_time))
    time = max(float(loop.tuning.integral_time) or SAMPLES_WITHOUT_INTEGRAL * sample, 10 * sample)
    dead = max(round(DEAD * time / sample), 1) * sample
    gain = abs(float(loop.tuning.gain)) / (out_high - out_low)
    size = time / (gain * (LAMBDA * time + dead)) if gain else high - low
    size = min(size, 5 * (high - low))
    sign = 1.0 if loop.output_raises_pv else -1.0
    limits = loop.output.limits or loop.output.range
    middle = (float(sum(limits)) / 2 - out_low) / (out_high - out_low)
    bounds = loop.setpoint.limits or loop.pv.range
    start = float(sum(bounds)) / 2
    step = min(STEP * (float(bounds[1]) - float(bounds[0])), REACH * size)
    return Plant(sign * size, time, dead, start - sign * size * middle, start, step)


def scenario_of(side: Tested, plants: Sequence[Plant], plc: Plc, way: Way) -> dict[str, Any]:
    """The scenario of one side."""
    longest = max(plant.time for plant in plants)
    data: dict[str, Any] = {"pidcfg": 1, "scenario": "verify", "config": "x.yaml"}
    data["duration"] = round(END * longest, 3)
    data["plants"], data["connect"], data["events"] = [], {}, []
    for i, loop, plant in zip(side.places, side.loops, plants, strict=True):
        name = loop.name
        if loop.mode == "manual" or (loop.mode == "cascade" and way == "alone"):
            data["events"].append({"at": 0, "loop": name, "mode": "auto"})
        low, high = scale_of(plc, i, loop)
        share = f"({name}.{plc.out_name} - ({low!r})) / {high - low!r}"
        data["plants"].append(
            {
                "name": f"Plant{i}",
                "model": "first_order",
                "input": share,
                "gain": plant.gain,
                "time_constant": plant.time,
                "dead_time": plant.dead,
                "load": plant.load,
                "initial": plant.start,
            }
        )
        ideal = way == "ideal" and loop.setpoint.source is not None and f"{name}.SP" in plc.signals
        data["connect"][plc.inlets.get(name, f"{name}.PV")] = f"{name}.SP" if ideal else f"Plant{i}"
        data["events"] += [
            {"at": 0, "loop": name, "set": {"setpoint": plant.start}},
            {"at": round(STEP_AT * longest, 3), "loop": name, "set": {"setpoint": plant.start + plant.step}},
            {"at": round(LOAD_AT * longest, 3), "plant": f"Plant{i}", "disturb": {"load": plant.load - plant.step}},
        ]
    return data


def scale_of(plc: Plc, i: int, loop: Loop) -> tuple[float, float]:
    """What a loop's output signal shows at 0 % and 100 %."""
    low, high = plc.outputs[i] if plc.outputs else loop.output.range
    return float(low), float(high)


def trend_of(vendor: Vendor, image: Any, data: dict[str, Any]) -> dict[str, list[float]]:
    """Columns of one side's trend by signal."""
    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.prepare import options
    from pidcfg.sim.run import Settings, simulate

    controller: Any = vendor.module("controller")
    scenario = Scenario.model_validate(data)
    plc = controller.load(image, options(scenario, controller))
    steps = float(data["duration"]) * 1_000_000 / plc.base
    sink = io.StringIO()
    every = max(1, round(steps / POINTS))
    simulate(
        scenario,
        lambda: controller.load(image, options(scenario, controller)),
        controller,
        Settings(trend=sink, every=every),
    )
    rows = list(csv.reader(io.StringIO(sink.getvalue())))
    return {name: [float(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}


def at_times(column: list[float], times: list[float], wanted: list[float]) -> list[float]:
    """The values of a column at other times: each is the last sample up to then."""
    values, i = [], 0
    for time in wanted:
        while i + 1 < len(times) and times[i + 1] <= time + 1e-9:
            i += 1
        values.append(column[i])
    return values


def verify(
    source: tuple[Vendor, Any, Any],
    target: tuple[Vendor, Any, Any],
    names: tuple[str, str] = ("source", "result"),
    pairs: Sequence[tuple[int, int]] | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Verified]:
    """Each side is a vendor, a configuration and its image; ``names``: what charts call them.

    ``pairs``: the places of the loops that are compared, on both sides; not given, all loops, in the same order on
    both. Loops run by themselves. Slaves that are linked on both sides are compared so, since in some PLCs a link
    cannot be cut; masters with slaves that follow at once. ``progress`` is called with the share that is done.
    """
    from pidcfg.conversion.pipeline import neutral_loops
    from pidcfg.scenario.overlays import overlay

    sides = []
    for at, (vendor, config, image) in enumerate((source, target)):
        loops = neutral_loops(config, vendor)[0].loops
        places = range(len(loops)) if pairs is None else [pair[at] for pair in pairs]
        sides.append(Tested(vendor, image, [loops[i] for i in places], places))
    plants = [plant_of(loop, other) for loop, other in zip(sides[0].loops, sides[1].loops, strict=True)]
    longest = max(plant.time for plant in plants)
    masters = {loop.setpoint.source for loop in sides[0].loops} - {None}
    ways: tuple[Way, ...] = ("alone", "linked", "ideal") if masters else ("alone",)
    rounds = [(way, side) for way in ways for side in sides]
    runs: dict[Way, list[list[tuple[list[float], list[float]]]]] = {way: [] for way in ways}
    for done, (way, side) in enumerate(rounds, start=1):
        runs[way].append(_run(side, plants, way))
        if progress is not None:
            progress(done / len(rounds))
    results = []
    for i, (loop, other) in enumerate(zip(*(side.loops for side in sides), strict=True)):
        linked = loop.setpoint.source is not None and other.setpoint.source is not None
        trends = runs["ideal" if loop.name in masters else "linked" if linked else "alone"]
        times, setpoints = times_of(longest), setpoints_of(plants[i], longest)
        pvs, outputs = zip(*(trend[i] for trend in trends), strict=True)
        chart = overlay(loop, times, setpoints, pvs, outputs, names, (STEP_AT * longest, LOAD_AT * longest))
        results.append(_compared(loop, setpoints, pvs, outputs, chart))
    return results


def _run(side: Tested, plants: Sequence[Plant], way: Way) -> list[tuple[list[float], list[float]]]:
    """PV and share of the output of each loop of one side, at the times that are compared.

    A PV is what the loop controls: where the PLC tells the signal before the root, its root.
    """
    from pidcfg.scenario.axes import root_of

    plc: Plc = side.vendor.module("controller").load(side.image)
    trend = trend_of(side.vendor, side.image, scenario_of(side, plants, plc, way))
    times = times_of(max(plant.time for plant in plants))
    trends = []
    for i, loop in zip(side.places, side.loops, strict=True):
        low, high = scale_of(plc, i, loop)
        column = at_times(trend[f"{loop.name}.{plc.out_name}"], trend["time"], times)
        pv = at_times(trend[f"{loop.name}.PV"], trend["time"], times)
        root = root_of(plc, i)
        if root is not None:
            pv = [root.taken(value) for value in pv]
        trends.append((pv, [(value - low) / (high - low) for value in column]))
    return trends


def times_of(longest: float) -> list[float]:
    """When both sides are compared."""
    return [longest * (SETTLED + (END - SETTLED) * i / POINTS) for i in range(POINTS)]


def setpoints_of(plant: Plant, longest: float) -> list[float]:
    """The set point at the times that are compared."""
    return [plant.start + (plant.step if time >= STEP_AT * longest else 0.0) for time in times_of(longest)]


def _compared(
    loop: Loop, setpoints: list[float], pvs: Sequence[list[float]], outputs: Sequence[list[float]], chart: Chart
) -> Verified:
    """One loop's two sides."""
    span = float(loop.pv.range[1] - loop.pv.range[0])
    iae = [sum(abs(sp - pv) for sp, pv in zip(setpoints, side, strict=True)) for side in pvs]
    return Verified(
        loop.name,
        100 * max(abs(a - b) for a, b in zip(*pvs, strict=True)) / span,
        100 * max(abs(a - b) for a, b in zip(*outputs, strict=True)),
        iae[1] / iae[0] if iae[0] else None,
        chart,
    )
