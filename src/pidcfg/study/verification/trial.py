"""One side through one stage: its signals, modes and alarms at every sample."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import sqrt
from typing import TYPE_CHECKING, Any

from pydantic_core import PydanticCustomError

from pidcfg.conversion.operation import source_of
from pidcfg.conversion.pipeline import generic_file
from pidcfg.sim.controllers.kernels import NEVER
from pidcfg.sim.controllers.plc import COUNTS_PER_RANGE, TICKS, CountsPlc
from pidcfg.sim.engine.recording import Recording
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from pidcfg.conversion import NeutralLoop
    from pidcfg.schemas.generic import Loop
    from pidcfg.sim.controllers.plc import Plc
    from pidcfg.sim.judgement.report import LoopReport
    from pidcfg.study.verification.stages import Act, Bench, Stage
    from pidcfg.vendors import Vendor

# --- The loops of a configuration in the neutral form, as far as they have one ----------------------------------------


def neutral_of(config: Any, vendor: Vendor) -> tuple[tuple[Loop | None, ...], list[NeutralLoop]]:
    """The loops of a file, None for one without a neutral form, and what became of their fields."""
    neutral: list[NeutralLoop] = source_of(vendor).to_neutral(config)
    complete = [loop for loop in neutral if not loop.missing]
    models = iter(generic_file(config, complete).loops if complete else ())
    return tuple(None if loop.missing else next(models) for loop in neutral), neutral


def loops_of(config: Any, vendor: Vendor) -> tuple[Loop | None, ...]:
    """The loops of a file, None for one without a neutral form."""
    return neutral_of(config, vendor)[0]


# --- What a loop's signals are called on one side, and the loops of its cascade that run with it ----------------------
#
# Those have no plant: the PV of each is its own set point, so that none holds the others up. Slaves go to Cascade, a
# master stays in Manual.

PERCENT = (0.0, 100.0)


@frozen
class SideNames:
    """What a loop's signals are called on one side."""

    loop: str
    output: str
    pv_inlet: str
    """Where the PV comes in."""
    measured: str
    """What the transmitter shows, as an expression of the plant's value."""
    scale: tuple[float, float]
    """What the output's signal shows at 0 % and 100 %."""
    step: float
    """The base step in s: what happens to the plant begins with a sample and is seen at the next one on every side."""
    takes_integers: tuple[bool, bool]
    """Whether output and set point are set in whole numbers."""
    modes: Collection[str]
    """What can be asked for."""
    connect: Mapping[str, str]
    """What the PVs of other loops are wired to, where some run with it."""
    events: Sequence[Mapping[str, Any]]
    """What happens to those."""
    master: tuple[str, tuple[float, float]] | None = None
    """The loop that gives the set point, and what its output shows at 0 % and 100 %."""

    def output_at(self, share: float) -> float:
        """The value of the output's signal for a share of its range."""
        low, high = self.scale
        value = low + share * (high - low)
        return round(value) if self.takes_integers[0] else value

    def setpoint_at(self, value: float) -> float:
        """A set point as the loop takes it."""
        return round(value) if self.takes_integers[1] else value


def slaves_of(loops: Sequence[Loop | None], i: int) -> tuple[int, ...]:
    """The loops whose set point is the output of one."""
    loop = loops[i]
    name = None if loop is None else loop.name
    return tuple(
        j
        for j, loop_of_side in enumerate(loops)
        if loop_of_side is not None and loop_of_side.setpoint.source == name and j != i
    )


def master_of(loops: Sequence[Loop | None], i: int) -> int | None:
    """The loop whose output is the set point of one."""
    loop = loops[i]
    source = None if loop is None else loop.setpoint.source
    return next(
        (
            j
            for j, loop_of_side in enumerate(loops)
            if loop_of_side is not None and loop_of_side.name == source and j != i
        ),
        None,
    )


def companion_loops(loops: Sequence[Loop | None], i: int, *, with_master: bool) -> tuple[int, ...]:
    """The loops that run with one: its slaves and theirs, the last ones first, behind its master where it is wanted."""
    master = master_of(loops, i)
    others = list(slaves_of(loops, i))
    for j in others:
        others += [k for k in slaves_of(loops, j) if k not in {i, *others}]
    if with_master and master is not None and master not in others:
        others.append(master)
    return tuple(reversed(others))


def output_scale(plc: Plc, i: int, loop: Loop | None) -> tuple[float, float]:
    """What a loop's output signal shows at 0 % and 100 %."""
    if plc.out_ranges:
        low, high = plc.out_ranges[i]
    elif loop is not None:
        low, high = (float(end) for end in loop.output.range)
    else:
        low, high = PERCENT
    return float(low), float(high)


def names_of(
    plc: Plc, loops: Sequence[Loop | None], i: int, measured: str, others: Sequence[int], *, as_configured: bool
) -> SideNames:
    """The names of a loop's signals; ``others`` of its cascade run with it, in their own modes or not."""
    name, c = plc.loops[i], plc.configs[i]
    scale = output_scale(plc, i, loops[i])
    master = master_of(loops, i)
    master_scale = None if master is None else (plc.loops[master], output_scale(plc, master, loops[master]))
    return SideNames(
        name,
        plc.signals[c.out_slot],
        _pv_inlet(plc, i),
        measured,
        scale,
        plc.base_ticks / TICKS,
        (is_whole(plc, i, "output", scale[0]), is_whole(plc, i, "setpoint", plc.scales[i][0])),
        plc.modes,
        {_pv_inlet(plc, j): plc.signals[plc.configs[j].sp_slot] for j in others},
        []
        if as_configured
        else [
            event
            for turn, j in enumerate(others)
            for event in _companion_events(plc, j, turn, output_scale(plc, j, loops[j]), is_master=j == master)
        ],
        master_scale,
    )


def _pv_inlet(plc: Plc, i: int) -> str:
    name = plc.loops[i]
    return plc.pv_inputs.get(name, f"{name}.PV")


def _companion_events(
    plc: Plc, j: int, turn: int, scale: tuple[float, float], *, is_master: bool
) -> list[dict[str, Any]]:
    """A master goes to Manual, a slave by way of Auto to Cascade, where it has that mode, its output in the middle."""
    if is_master:
        return [{"at": 0, "loop": plc.loops[j], "mode": "manual"}]
    name, period = plc.loops[j], plc.configs[j].period / TICKS
    low, high, _ = plc.scales[j]
    begin = 3 * turn * period
    bottom, top = scale
    middle, centre = (bottom + top) / 2, (low + high) / 2
    events: list[dict[str, Any]] = [
        {"at": begin, "loop": name, "mode": "manual"},
        {
            "at": begin,
            "loop": name,
            "set": {"output": round(middle) if is_whole(plc, j, "output", bottom) else middle},
        },
        {"at": begin + period, "loop": name, "mode": "auto"},
        {
            "at": begin + period,
            "loop": name,
            "set": {"setpoint": round(centre) if is_whole(plc, j, "setpoint", low) else centre},
        },
    ]
    if "cascade" in plc.modes:
        events.append({"at": begin + 2 * period, "loop": name, "mode": "cascade"})
    return events


def is_whole(plc: Plc, i: int, key: str, low: float) -> bool:
    """Whether a value is set in whole numbers only: counts, where there is no range, and the inputs of INT blocks."""
    try:
        plc.check_set(i, (key,), low + 0.5)
    except PydanticCustomError:
        return True
    return False


# --- A stage as the scenario of one side: its plant, what is wired to what, and its events ----------------------------

PLANT_NAME, LOST_SIGNAL, OFFSET_SIGNAL = "Plant", "lost", "moved"


def scenario_data(stage: Stage, bench: Bench, names: SideNames) -> dict[str, Any]:
    """The stage as a scenario of one side.

    The plant reads the output in its own units: ``zero`` is what its 0 % adds.
    """
    low, high = names.scale
    width, zero = high - low, bench.gain * low / (high - low)
    plant: dict[str, Any] = {"name": PLANT_NAME, "model": "first_order", "input": names.output, "initial": stage.pv}
    plant |= {"gain": bench.gain / width, "time_constant": bench.time_constant, "dead_time": bench.dead_time}
    plant["load"] = stage.load - zero
    if stage.is_swept:
        plant = {"name": PLANT_NAME, "model": "integrator", "input": "0", "gain": 1, "load": 0, "initial": stage.pv}
    offset = 0.0 if stage.is_swept else zero
    plant["limits"] = [bench.low, bench.high]
    return {
        "pidcfg": 1,
        "scenario": stage.name,
        "config": "configuration.yaml",
        "duration": round(stage.end, 6),
        "plants": [plant],
        "signals": {LOST_SIGNAL: 0, OFFSET_SIGNAL: 0},
        "connect": {names.pv_inlet: names.measured, **names.connect},
        "events": [
            *names.events,
            *(event for act in stage.acts for event in _act_events(act, names, offset)),
        ],
    }


def _act_events(act: Act, names: SideNames, zero: float) -> Iterator[dict[str, Any]]:
    event: dict[str, Any] = {"at": round(act.at, 6)}
    if act.mode is not None and act.mode in names.modes:
        yield event | {"loop": names.loop, "mode": act.mode}
    if act.setpoint is not None:
        yield event | {"loop": names.loop, "set": {"setpoint": names.setpoint_at(act.setpoint)}}
    if act.output is not None:
        yield event | {"loop": names.loop, "set": {"output": names.output_at(act.output)}}
    if act.master_output is not None and names.master is not None:
        name, (low, high) = names.master
        yield event | {"loop": name, "set": {"output": low + act.master_output * (high - low)}}
    after = {"at": round(act.at + names.step, 6)}
    if act.load is not None:
        yield after | {"plant": PLANT_NAME, "disturb": {"load": act.load - zero}}
    if act.pv_offset is not None:
        yield after | {"set": {OFFSET_SIGNAL: act.pv_offset}}
    if act.sensor_lost is not None:
        yield after | {"set": {LOST_SIGNAL: int(act.sensor_lost)}}


# --- One side through one stage: its signals, modes and alarms at every sample of the slower side ---------------------

D580 = Decision(
    580,
    "the battery works the operator's inputs, wired or not",
    "In every stage but the start SP, ManualMV, Manual and CASC of a NextoPID loop are free of their wires, each at "
    "the first value of its wire, on both sides. A copy that a line of the report says the target does not have is "
    "never made: the source runs without it.",
    "A wire to one of them is the operator's switch or his panel; with it in force the battery cannot operate the "
    "loop, and a conversion with its action reversed was called alike in the two stages that were left.",
)
TWELVE_BIT_COUNTS = 4095
"""Counts of an analog module where the PLC calculates with finer numbers."""
ALARM_NAMES = {"deviation_yellow": "deviation_high", "deviation_red": "deviation_high_high"}
"""Alarms that go by another name."""


@dataclass(frozen=True)
class Side:
    """A configuration that runs: its vendor, its image, and its loops in the neutral form."""

    vendor: Vendor
    config: Any
    image: Any
    loops: Sequence[Loop | None]

    def loop(self, i: int) -> Loop:
        """One that has a neutral form."""
        loop = self.loops[i]
        if loop is None:
            raise ValueError(f"loop {i} has no neutral form")
        return loop

    @property
    def controller(self) -> Any:
        """What the runner calls."""
        return self.vendor.module("controller")

    def load(self, *, operator_only: bool) -> Plc:
        """The PLC; ``operator_only``: with nothing but its operator."""
        plc: Plc = self.controller.load(self._operated_image if operator_only else self.image)
        return plc

    @cached_property
    def _operated_image(self) -> Any:
        """The image with the operator's inputs in his own hand, whatever the program wires to them."""
        return self.controller.load(self.image).unwire_operator_inputs(self.image)


@frozen
class Trial:
    """What one side did in a stage, a value a sample."""

    pv: Sequence[float]
    setpoint: Sequence[float]
    output: Sequence[float]
    """Shares of the range."""
    modes: Sequence[str]
    period: float
    """Between two calculations of the loop, in s."""
    has_cascade: bool
    """Whether the loop has a master and the PLC a mode for cascade; else Cascade is Auto with another set point."""
    alarms: Mapping[str, Sequence[bool]]
    """By the name that all sides have for them."""


@dataclass(slots=True)
class SampleRecording(Recording):
    """A recording that keeps the signals at every base step."""

    columns: dict[str, array[float]] = field(default_factory=dict)

    def begin(self, names: Sequence[str], steps: int, dt: float) -> None:  # noqa: ARG002 - nothing is thinned
        """A run begins; what was recorded before is forgotten."""
        self.dt, self.names = dt, list(names)
        self.columns = {name: array("d") for name in names if self.chosen is None or name in self.chosen}

    def add_rows(self, rows_of_values: Sequence[float], rows: int) -> None:
        """Rows of values, one a base step, one after the other."""
        width = len(self.names)
        for column, name in enumerate(self.names):
            if name in self.columns:
                self.columns[name].extend(rows_of_values[column : rows * width : width])

    def note_levels(self, plc: Plc, signals: Sequence[float], time: float) -> None:
        """Nobody draws the levels of alarms."""

    def end(self) -> None:
        """The run is over."""


def new_plc(side: Side, active_loops: Collection[int], *, operator_only: bool = False) -> Plc:
    """The PLC of a side in which only some loops are calculated; ``operator_only``: with nothing but its operator."""
    plc = side.load(operator_only=operator_only)
    for i in range(len(plc.loops)):
        if i not in active_loops:
            plc.configs[i].halt = 1
            plc.states[i].due = NEVER
    return plc


def finest_counts(plc: Plc, i: int) -> tuple[float, float]:
    """One count of the PV in its unit, and of the output as a share of its range, as the PLC calculates."""
    low, high, counts = plc.scales[i]
    if getattr(plc.configs[i], "is_integer", 0):
        least, most = plc.output_limits(i, plc.signal_values)
        return 1.0, 1 / (most - least) if most > least else 1 / COUNTS_PER_RANGE
    output = getattr(plc.configs[i], "out_span", TWELVE_BIT_COUNTS) if isinstance(plc, CountsPlc) else COUNTS_PER_RANGE
    return abs(high - low) / counts, 1 / output


def root_step(side: Side, i: int) -> float:
    """What one count of a set point on a root means, in the PV's unit; 0: the set point is no count of a root."""
    plc = new_plc(side, (i,))
    low, high, counts = plc.scales[i]
    return abs(high - low) / sqrt(counts) if isinstance(plc, CountsPlc) and side.loop(i).pv.square_root else 0.0


def analog_counts(plc: Plc, i: int) -> tuple[float, float]:
    """The same, of an analog module of 12 bits at least."""
    low, high, _ = plc.scales[i]
    pv, output = finest_counts(plc, i)
    return max(pv, abs(high - low) / TWELVE_BIT_COUNTS), max(output, 1 / TWELVE_BIT_COUNTS)


def run_stage(side: Side, i: int, stage: Stage, bench: Bench, *, before_root: bool, limit: int | None = None) -> Trial:
    """One side through one stage; ``before_root``: the transmitter shows what the PV is the root of."""
    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.engine.run import Settings, simulate

    others = companion_loops(side.loops, i, with_master=stage.with_master)
    operator_only = stage.output is not None
    plc = new_plc(side, (i, *others), operator_only=operator_only)
    name, c = plc.loops[i], plc.configs[i]
    low, width = bench.low, bench.span
    pv_text = f"(Plant * (1 - lost) + ({low!r}) * lost)" if stage.loses_sensor else "Plant"
    pv_text = "(Plant + moved)" if stage.is_swept else pv_text
    measured = f"({low!r}) + ({pv_text} - ({low!r})) * ({pv_text} - ({low!r})) / {width!r}" if before_root else pv_text
    names = names_of(plc, side.loops, i, measured, others, as_configured=not operator_only)
    scenario = Scenario.model_validate(scenario_data(stage, bench, names))
    signals = [plc.signals[slot] for slot in (c.pv_slot, c.sp_slot, c.out_slot)]
    recording = SampleRecording(frozenset(signals))
    settings = Settings("python", recording=recording, max_loop_steps=limit, with_verdicts=False)
    unused = [plc]

    def next_plc() -> Plc:
        return unused.pop() if unused else new_plc(side, (i, *others), operator_only=operator_only)

    report = simulate(scenario, next_plc, side.controller, settings)
    count = int(stage.end / bench.sample + 1e-9) + 1
    columns, dt = [recording.columns[signal] for signal in signals], recording.dt
    last = len(columns[0]) - 1
    rows = [min(round(k * bench.sample / dt), last) for k in range(count)]
    pv, setpoint, output = ([column[row] for row in rows] for column in columns)
    if plc.root_zeros and plc.root_zeros[i] is not None:
        pv, setpoint = (
            [_square_root(value, low, width, plc.root_zeros[i] or 0.0) for value in column] for column in (pv, setpoint)
        )
    bottom, top = names.scale
    return Trial(
        pv,
        setpoint,
        [(value - bottom) / (top - bottom) for value in output],
        _modes_by_sample(report.loops[name], count, bench.sample),
        plc.configs[i].period / TICKS,
        "cascade" in plc.modes and names.master is not None,
        {
            ALARM_NAMES.get(alarm.removeprefix("pv_"), alarm.removeprefix("pv_")): _alarm_by_sample(
                report.loops[name], alarm, count, bench.sample
            )
            for alarm in plc.alarm_bits
        },
    )


def _square_root(value: float, low: float, width: float, zero: float) -> float:
    return low + width * sqrt(max((value - low) / width + zero, 0.0))


def _sample_at(time: float, sample: float) -> int:
    """The sample at which something that happened at a time is first seen."""
    return -int(-(time / sample - 1e-6) // 1)


def _modes_by_sample(report: LoopReport, count: int, sample: float) -> list[str]:
    modes = [report.first_mode] * count
    for change in report.modes:
        first = _sample_at(change.at, sample)
        modes[first:] = [change.mode] * max(count - first, 0)
    return modes


def _alarm_by_sample(report: LoopReport, name: str, count: int, sample: float) -> list[bool]:
    states = [False] * count
    for alarm in report.alarms:
        if alarm.alarm == name:
            first = _sample_at(alarm.at, sample)
            last = count if alarm.cleared is None else min(max(_sample_at(alarm.cleared, sample), first + 1), count)
            states[first:last] = [True] * max(last - first, 0)
    return states


# --- The moves of a stage: smaller ones, and set points that both sides can hold ------------------------------------

SMALLER_MOVES_SHARE = 0.987
"""Of a stage's moves, with which it is gone through again."""


def smaller_moves(stage: Stage, b: Bench, step: float) -> Stage:
    """The stage with everything moved by less from where it rests; ``step``: of its set points, 0: any."""

    def shrink(value: float | None, rest: float) -> float | None:
        return None if value is None else rest + SMALLER_MOVES_SHARE * (value - rest)

    acts = tuple(
        replace(
            act,
            setpoint=shrink(act.setpoint, b.rest_pv),
            output=shrink(act.output, b.rest_out),
            load=shrink(act.load, stage.load),
            pv_offset=shrink(act.pv_offset, 0.0),
        )
        if act.at >= stage.begin
        else act
        for act in stage.acts
    )
    smaller = replace(stage, acts=acts)
    return round_setpoints(smaller, b.low, step, b.high) if step else smaller


def round_setpoints(stage: Stage, low: float, step: float, high: float) -> Stage:
    """The stage with its set points at whole steps from ``low`` on, so that the coarser register holds them."""
    acts = tuple(
        act if act.setpoint is None else replace(act, setpoint=nearest_step(act.setpoint, low, step, high))
        for act in stage.acts
    )
    return replace(stage, acts=acts)


def nearest_step(value: float, low: float, step: float, high: float) -> float:
    """The nearest of the values that lie whole steps from ``low`` on, up to ``high``; the value itself at an end."""
    near = low + round((value - low) / step) * step
    return near if low < value < high and near <= high else value
