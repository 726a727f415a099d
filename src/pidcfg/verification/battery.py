"""The battery: source, twin and target of every loop through all stages, and what comes of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import expm1
from typing import TYPE_CHECKING, Any

from pidcfg.sim.run import UnusableError
from pidcfg.verification.acts import nearest_step, on_grid
from pidcfg.verification.bench import bench_of
from pidcfg.verification.comparison import AT_END, COUNTS, SHARE, Counts, Difference, Tolerance, differences
from pidcfg.verification.keys import key_of
from pidcfg.verification.lines import Scene, reason
from pidcfg.verification.names import companions
from pidcfg.verification.neutral import ACTION, loops_of
from pidcfg.verification.operated import refused
from pidcfg.verification.signals import MEAN
from pidcfg.verification.smoothing import FILTER, SMOOTHING, lets_through_the_same
from pidcfg.verification.stages import stages_of
from pidcfg.verification.trial import Side, finest, new_plc, resolution, run
from pidcfg.verification.validity import true_lines

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from pidcfg.schemas.generic import Loop
    from pidcfg.vendors import Vendor
    from pidcfg.verification.acts import Stage
    from pidcfg.verification.bench import Bench
    from pidcfg.verification.trial import Trial
    from pidcfg.verification.twin import Line

RUN = "run"
"""The signal of a difference that is none: one side cannot go through a stage."""


def side_of(vendor: Vendor, config: Any, like: Sequence[Loop | None] = ()) -> Side:
    """A configuration as it runs; ``like``: loops whose outputs have the scales that are meant.

    A twin without its links no longer says what the output of a master is counted in.
    """
    loops = loops_of(config, vendor)
    if like:
        loops = tuple(_scaled(loop, one) for loop, one in zip(loops, like, strict=True))
    return Side(vendor, config, vendor.encoder(config).image, loops)


def _scaled(loop: Loop | None, like: Loop | None) -> Loop | None:
    if loop is None or like is None:
        return loop
    return loop.model_copy(update={"output": loop.output.model_copy(update={"range": like.output.range})})


@dataclass(slots=True)
class Reference:
    """One loop of the side that the others are held against, with its bench; trials are kept."""

    side: Side
    i: int
    bench: Bench
    stages: tuple[Stage, ...]
    before_root: bool
    trials: dict[tuple[Bench, Stage], Trial] = field(default_factory=dict)

    @property
    def loop(self) -> Loop:
        """The loop in the neutral form."""
        return self.side.loop(self.i)

    @property
    def possible(self) -> tuple[Stage, ...]:
        """The stages in which the loop goes to every mode that is asked of it."""
        return tuple(stage for stage in self.stages if not self.refused(stage))

    def refused(self, stage: Stage) -> str:
        """The mode that a stage asks for and the loop does not go to; empty: none."""
        return refused(stage, self.trial(stage), self.bench.sample)

    def trial(self, stage: Stage) -> Trial:
        """The loop through a stage."""
        key = (self.bench, stage)
        if key not in self.trials:
            self.trials[key] = run(self.side, self.i, stage, self.bench, before_root=self.before_root)
        return self.trials[key]


def reference_of(side: Side, i: int, other: Loop, step: float = 0.0) -> Reference:
    """A loop with its bench and its battery; ``other`` is the same loop on the other side.

    ``step``: what a count of the set point means where either side has few of them; 0: all values are as near.
    """
    loop = side.loop(i)
    cascade = [i, *companions(side.loops, i, with_master=True)]
    bench = bench_of(loop, other, float(max(side.loop(k).sample_time for k in cascade)))
    if step:
        bench = replace(bench, start=nearest_step(bench.start, bench.low, step, bench.high))
    count, _ = resolution(new_plc(side, (i,)), i)
    stages = tuple(stages_of(bench, loop, other, count, in_cascade=len(cascade) > 1))
    if step:
        stages = tuple(
            stage if stage.name.startswith("dead band") else on_grid(stage, bench.low, step, bench.high)
            for stage in stages
        )
    return Reference(side, i, bench, stages, loop.pv.square_root)


def tolerance_of(one: Side, i: int, two: Side, j: int, bench: Bench) -> Tolerance:
    """How far both may lie apart (D306)."""
    loop, sides = one.loop(i), ((one, i), (two, j))
    pv, output = _coarser(resolution(new_plc(side, (k,)), k) for side, k in sides)
    fine_pv, fine_output = _coarser(finest(new_plc(side, (k,)), k) for side, k in sides)
    setpoint = COUNTS * pv
    # a filter that is worked out in counts stops where its share of the rest is less than half a count
    passed = -expm1(-bench.sample / float(loop.pv.filter)) if loop.pv.filter else 1.0
    width = float(loop.output.range[1] - loop.output.range[0])
    share = abs(float(loop.tuning.gain)) * bench.span / width
    other = two.loop(j)
    smoothed = float(min(loop.tuning.derivative_filter, other.tuning.derivative_filter))
    kick = float(loop.tuning.derivative_time) / (bench.sample + smoothed)
    alone = fine_output + fine_pv / bench.span * share * (1 / passed + kick)
    mean = fine_output + fine_pv / bench.span * share * (1 + 1 / passed + kick / MEAN)
    pv = pv / passed + output * abs(bench.gain)
    band = float(max(loop.deadband, other.deadband))
    switching = share * band / bench.span
    return Tolerance(
        SHARE,
        Counts(COUNTS * pv, COUNTS * (output + pv / bench.span * share * (1 + kick))),
        Counts(COUNTS * fine_pv / passed, COUNTS * alone),
        setpoint,
        COUNTS * output + 2 * AT_END,
        band,
        switching,
        switching * float(loop.tuning.derivative_time) / bench.sample,
        mean if kick else 0.0,
    )


def _coarser(counts: Iterable[tuple[float, float]]) -> tuple[float, float]:
    """The larger counts of two sides, of PV and of output."""
    pvs, outputs = zip(*counts, strict=True)
    return max(pvs), max(outputs)


@dataclass(slots=True)
class Battery:
    """The other side of a reference on its way through the stages."""

    reference: Reference
    side: Side
    j: int
    tolerance: Tolerance
    other: Reference | None = None
    """Where the other side has trials already."""
    trials: dict[str, Trial] = field(default_factory=dict)

    def trial(self, stage: Stage) -> Trial:
        """The other side through a stage."""
        if self.other is not None:
            return self.other.trial(stage)
        if stage.name not in self.trials:
            rooted = self.reference.before_root
            self.trials[stage.name] = run(self.side, self.j, stage, self.reference.bench, before_root=rooted)
        return self.trials[stage.name]

    def differences(self) -> Iterator[Difference]:
        """Where both sides differ."""
        for stage in self.reference.possible:
            yield from self._of(stage)

    def _of(self, stage: Stage) -> Iterator[Difference]:
        bench = self.reference.bench
        try:
            trial = self.trial(stage)
        except UnusableError as error:
            yield Difference(stage.name, RUN, 0.0, "", str(error), ())
            return
        yield from differences(stage, self.reference.trial(stage), trial, bench, self.tolerance)

    def judged(self, lines: Sequence[Line]) -> Iterator[tuple[Difference, Line | None]]:
        """Every difference with the line that explains it; else from the first sample on that no line explains."""
        lines = list(true_lines(lines, self.reference.loop, self.side, self.j))
        for stage in self.reference.possible:
            for difference in self._of(stage):
                if difference.signal == RUN:
                    yield difference, None
                    continue
                one, two = self.reference.trial(stage), self.trial(stage)
                scene = Scene(stage, self.reference.bench, self.reference.loop, one, two, self.tolerance.closed.pv)
                line, k = reason(difference, lines, scene)
                yield difference if line else _from(difference, k, scene), line

    def key_of(self, difference: Difference, lines: Sequence[Line]) -> str:
        """The key of the other side that explains what ``lines`` of the report do not; empty where none does."""
        loop, other = self.reference.loop, self.side.loop(self.j)
        told = {line.neutral for line in true_lines(lines, loop, self.side, self.j)} - {"", ACTION}
        if any(line.neutral == SMOOTHING and lets_through_the_same(line.change, loop, other) for line in lines):
            told.add(FILTER)
        return key_of(difference, loop, self.side, self.j, told)


def _from(difference: Difference, k: int, scene: Scene) -> Difference:
    """A difference from a later sample on."""
    one, two = (_value(trial, difference.signal, k) for trial in (scene.one, scene.two))
    at = k * scene.bench.sample - scene.stage.begin
    return replace(difference, at=at, before=one, after=two)


def _value(trial: Trial, signal: str, k: int) -> float | str | bool:
    if signal == "sample time":
        return trial.period
    if signal in trial.alarms:
        return trial.alarms[signal][k]
    column: Sequence[float | str] = trial.modes if signal == "mode" else getattr(trial, signal)
    return column[k]
