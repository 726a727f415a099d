"""One side through one stage: its signals, modes and alarms at every sample of the slower side."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from functools import cached_property
from math import sqrt
from typing import TYPE_CHECKING, Any

from pidcfg.refs import Decision
from pidcfg.sim.plc import COUNTS, TICKS, CountsPlc
from pidcfg.sim.recording import Recording
from pidcfg.sim.records import NEVER
from pidcfg.verification.names import companions, names_of
from pidcfg.verification.scenarios import scenario_data

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from pidcfg.schemas.generic import Loop
    from pidcfg.sim.plc import Plc
    from pidcfg.sim.report import LoopReport
    from pidcfg.vendors import Vendor
    from pidcfg.verification.acts import Stage
    from pidcfg.verification.bench import Bench

D580 = Decision(
    580,
    "the battery works the operator's inputs, wired or not",
    "In every stage but the start SP, ManualMV, Manual and CASC of a NextoPID loop are free of their wires, each at "
    "the first value of its wire, on both sides. A copy that a line of the report says the target does not have is "
    "never made by the twin.",
    "A wire to one of them is the operator's switch or his panel; with it in force the battery cannot operate the "
    "loop, and a conversion with its action reversed was called alike in the two stages that were left.",
)
TWELVE_BITS = 4095
"""Counts of an analog module where the PLC calculates with finer numbers."""
SAME_ALARM = {"deviation_yellow": "deviation_high", "deviation_red": "deviation_high_high"}
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

    @cached_property
    def operated(self) -> Any:
        """The image with the operator's inputs in his own hand, whatever the program wires to them."""
        return self.vendor.module("controller").load(self.image).operated(self.image)


@dataclass(frozen=True, slots=True)
class Trial:
    """What one side did in a stage, a value a sample."""

    pv: Sequence[float]
    setpoint: Sequence[float]
    output: Sequence[float]
    """Shares of the range."""
    modes: Sequence[str]
    period: float
    """Between two calculations of the loop, in s."""
    cascades: bool
    """Whether the PLC has a mode for cascade; where it has none, a loop that follows another one is in Auto."""
    alarms: Mapping[str, Sequence[bool]]
    """By the name that all sides have for them."""


@dataclass(slots=True)
class EverySample(Recording):
    """A recording that keeps the signals at every base step."""

    columns: dict[str, array[float]] = field(default_factory=dict)

    def begin(self, names: Sequence[str], steps: int, dt: float) -> None:  # noqa: ARG002 - nothing is thinned
        """A run begins; what was recorded before is forgotten."""
        self.dt, self.names = dt, list(names)
        self.columns = {name: array("d") for name in names if self.wanted is None or name in self.wanted}

    def take(self, rows_of_values: Sequence[float], rows: int) -> None:
        """Rows of values, one a base step, one after the other."""
        width = len(self.names)
        for column, name in enumerate(self.names):
            if name in self.columns:
                self.columns[name].extend(rows_of_values[column : rows * width : width])

    def end(self) -> None:
        """The run is over."""


def new_plc(side: Side, active: Collection[int], *, by_hand: bool = False) -> Plc:
    """The PLC of a side in which only some of the loops are calculated; ``by_hand``: with nothing but its operator."""
    plc: Plc = side.vendor.module("controller").load(side.operated if by_hand else side.image)
    for i in range(len(plc.loops)):
        if i not in active:
            plc.cfg[i].halt = 1
            plc.st[i].due = NEVER
    return plc


def finest(plc: Plc, i: int) -> tuple[float, float]:
    """One count of the PV in its unit, and of the output as a share of its range, as the PLC calculates."""
    low, high, counts = plc.scales[i]
    output = getattr(plc.cfg[i], "out_span", TWELVE_BITS) if isinstance(plc, CountsPlc) else COUNTS
    return abs(high - low) / counts, 1 / output


def root_step(side: Side, i: int) -> float:
    """What one count of a set point on a root means, in the PV's unit; 0: the set point is no count of a root."""
    plc = new_plc(side, (i,))
    low, high, counts = plc.scales[i]
    return abs(high - low) / sqrt(counts) if isinstance(plc, CountsPlc) and side.loop(i).pv.square_root else 0.0


def resolution(plc: Plc, i: int) -> tuple[float, float]:
    """The same, of an analog module of 12 bits at least."""
    low, high, _ = plc.scales[i]
    pv, output = finest(plc, i)
    return max(pv, abs(high - low) / TWELVE_BITS), max(output, 1 / TWELVE_BITS)


def run(side: Side, i: int, stage: Stage, bench: Bench, *, before_root: bool, limit: int | None = None) -> Trial:
    """One side through one stage; ``before_root``: the transmitter shows what the PV is the root of."""
    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.run import Settings, simulate

    others = companions(side.loops, i, with_master=stage.with_master)
    by_hand = stage.output is not None
    plc = new_plc(side, (i, *others), by_hand=by_hand)
    name, c = plc.loops[i], plc.cfg[i]
    low, width = bench.low, bench.span
    shown = f"(Plant * (1 - lost) + ({low!r}) * lost)" if stage.loses_sensor else "Plant"
    shown = "(Plant + moved)" if stage.swept else shown
    measured = f"({low!r}) + ({shown} - ({low!r})) * ({shown} - ({low!r})) / {width!r}" if before_root else shown
    names = names_of(plc, side.loops, i, measured, others, as_configured=not by_hand)
    scenario = Scenario.model_validate(scenario_data(stage, bench, names))
    signals = [plc.signals[slot] for slot in (c.sig_pv, c.sig_sp, c.sig_out)]
    recording = EverySample(frozenset(signals))
    settings = Settings("python", recording=recording, max_loop_steps=limit, judged=False)
    unused = [plc]
    fresh: Callable[[], Plc] = lambda: unused.pop() if unused else new_plc(side, (i, *others), by_hand=by_hand)  # noqa: E731
    report = simulate(scenario, fresh, side.vendor.module("controller"), settings)
    count = int(stage.end / bench.sample + 1e-9) + 1
    rows = [min(round(k * bench.sample / recording.dt), len(recording.columns[signals[0]]) - 1) for k in range(count)]
    pv, setpoint, output = ([recording.columns[signal][row] for row in rows] for signal in signals)
    if plc.roots and plc.roots[i] is not None:
        pv, setpoint = (
            [_root(value, low, width, plc.roots[i] or 0.0) for value in column] for column in (pv, setpoint)
        )
    bottom, top = names.scale
    return Trial(
        pv,
        setpoint,
        [(value - bottom) / (top - bottom) for value in output],
        _modes(report.loops[name], count, bench.sample),
        plc.cfg[i].period / TICKS,
        "cascade" in plc.modes,
        {
            SAME_ALARM.get(alarm.removeprefix("pv_"), alarm.removeprefix("pv_")): _alarm(
                report.loops[name], alarm, count, bench.sample
            )
            for alarm in plc.alarm_bits
        },
    )


def _root(value: float, low: float, width: float, zero: float) -> float:
    return low + width * sqrt(max((value - low) / width + zero, 0.0))


def _at(time: float, sample: float) -> int:
    """The sample at which something that happened at a time is first seen."""
    return -int(-(time / sample - 1e-6) // 1)


def _modes(report: LoopReport, count: int, sample: float) -> list[str]:
    modes = [report.first_mode] * count
    for change in report.modes:
        first = _at(change.at, sample)
        modes[first:] = [change.mode] * max(count - first, 0)
    return modes


def _alarm(report: LoopReport, name: str, count: int, sample: float) -> list[bool]:
    states = [False] * count
    for alarm in report.alarms:
        if alarm.alarm == name:
            first = _at(alarm.at, sample)
            last = count if alarm.cleared is None else min(max(_at(alarm.cleared, sample), first + 1), count)
            states[first:last] = [True] * max(last - first, 0)
    return states
