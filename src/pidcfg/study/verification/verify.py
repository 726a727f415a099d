"""The verdict on two configurations: every loop through all stages, and the differences that nothing explains."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from itertools import chain
from math import expm1
from pathlib import Path
from typing import Any

from pidcfg.conversion import Change, do_overlap
from pidcfg.conversion.builder import flatten, has_alarms
from pidcfg.conversion.comparison import NeutralSide
from pidcfg.conversion.operation import PREFIX, Operation, differing_rules, source_of
from pidcfg.conversion.pipeline import LoopReport
from pidcfg.encoders.contract import encoder_of
from pidcfg.pictures import Chart, Line, Mark, Panel, Role
from pidcfg.schemas.generic import Loop
from pidcfg.sim.engine.run import UnusableError
from pidcfg.study.verification.comparison import (
    ACTION,
    COUNT_TOLERANCE,
    LABEL_FIELDS,
    LIMIT_DISTANCE,
    MEAN_SAMPLES,
    RESPONSE_TOLERANCE,
    SAMPLE_SHIFTS,
    CountSizes,
    SignalDifference,
    Tolerance,
    differing_fields,
    find_differences,
    neutral_values,
    refused_mode,
)
from pidcfg.study.verification.stages import Bench, Stage, bench_of, stages_of
from pidcfg.study.verification.stand_in import Rules, StandIn, make_stand_in
from pidcfg.study.verification.trial import (
    Side,
    Trial,
    analog_counts,
    companion_loops,
    finest_counts,
    loops_of,
    nearest_step,
    new_plc,
    root_step,
    round_setpoints,
    run_stage,
    smaller_moves,
)
from pidcfg.study.verification.twin import (
    ALARMS_PREFIX,
    ReportLine,
    drop_losses,
    explaining_key,
    field_of,
    is_material,
    replace_fields,
    reported_loops,
)
from pidcfg.text.frozen import frozen
from pidcfg.text.processes import WorkerPool
from pidcfg.vendors import Vendor

# --- The battery: source, twin and target of every loop through all stages, and what comes of it ----------------------

STAND_IN_TOLERANCE = 0.003
"""Of the response of a stage, by which a PLC may differ from the loop that stands in for it."""
CLOSED_TOLERANCE = 8.0
"""Counts by which both may be apart where each drives its own PV: one may round up what the other rounds down."""
ROUNDING_SHARE = 2e-5
"""Share of a range that single precision makes of a stage."""
VISIBLE_COUNTS, VISIBLE_SHARE = 3.0, 1e-4
"""Of a PV, in counts and as a share of the largest one: what single precision tells well enough."""
SINGLE_PRECISION_SHARE = 1.2e-7
"""What single precision rounds a PV to, as a share of it."""
CASCADE_STAGES = ("cascade", "manual", "set point limits")
"""What a loop of a cascade goes through besides the stages in which its PV goes its own way: in the others each PLC
lets outer and inner loops act on each other in another way."""
NUMBERS_STAGE = "numbers"
"""The stage of a difference that the files show."""
RUN_SIGNAL = "run"
"""The signal of a difference that is none: one side cannot go through a stage."""


def make_side(vendor: Vendor, config: Any) -> Side:
    """A configuration as it runs."""
    return Side(vendor, config, encoder_of(vendor).encode(config).image, loops_of(config, vendor))


@dataclass(slots=True)
class Reference:
    """One loop of the side that the others are held against, with its bench; trials are kept."""

    side: Side
    i: int
    bench: Bench
    stages: tuple[Stage, ...]
    before_root: bool
    step: float
    """Of its set points, where either side has few of them; 0: all values are as near."""
    trials: dict[tuple[Bench, Stage], Trial] = field(default_factory=dict)

    @property
    def loop(self) -> Loop:
        """The loop in the neutral form."""
        return self.side.loop(self.i)

    @property
    def possible_stages(self) -> Iterator[Stage]:
        """The stages in which the loop goes to every mode that is asked of it, each when it has run."""
        return (stage for stage in self.stages if not self.refused_mode(stage))

    def refused_mode(self, stage: Stage) -> str:
        """The mode that a stage asks for and the loop does not go to; empty: none."""
        return refused_mode(stage, self.run_trial(stage), self.bench.sample)

    def run_trial(self, stage: Stage) -> Trial:
        """The loop through a stage."""
        key = (self.bench, stage)
        if key not in self.trials:
            self.trials[key] = run_stage(self.side, self.i, stage, self.bench, before_root=self.before_root)
        return self.trials[key]


def make_reference(side: Side, i: int, other: Loop, step: float = 0.0, *, in_cascade: bool = False) -> Reference:
    """A loop with its bench and its battery; ``other`` is the same loop on the other side.

    ``step``: what a count of the set point means where either side has few of them; 0: all values are as near.
    ``in_cascade``: others run with it, on this side or on another one.
    """
    loop = side.loop(i)
    cascade = [i, *companion_loops(side.loops, i, with_master=True)]
    bench = bench_of(loop, other, float(max(side.loop(k).sample_time for k in cascade)))
    if step:
        bench = replace(bench, rest_pv=nearest_step(bench.rest_pv, bench.low, step, bench.high))
    count, _ = analog_counts(new_plc(side, (i,)), i)
    fine = side.rules[i].pv_count if isinstance(side, StandIn) else finest_counts(new_plc(side, (i,)), i)[0]
    bench = replace(bench, min_move=max(VISIBLE_COUNTS * fine, VISIBLE_SHARE * max(abs(bench.low), abs(bench.high))))
    stages = tuple(stages_of(bench, loop, other, count, in_cascade=in_cascade or len(cascade) > 1))
    if step:
        stages = tuple(round_setpoints(stage, bench.low, step, bench.high) for stage in stages)
    if isinstance(side, StandIn) and in_cascade:
        stages = tuple(stage for stage in stages if stage.is_swept or stage.name in CASCADE_STAGES)
    return Reference(side, i, bench, stages, loop.pv.square_root, step)


def tolerance_of(first: Side, i: int, second: Side, j: int, bench: Bench) -> Tolerance:
    """How far a stand-in and the side that it stands for may lie apart (D306)."""
    loop = first.loop(i)
    pv, output = _larger_counts(finest_counts(new_plc(side, (k,)), k) for side, k in ((first, i), (second, j)))
    pv, output = max(pv, bench.span * ROUNDING_SHARE), max(output, ROUNDING_SHARE)
    share = abs(float(loop.tuning.gain)) * bench.span / float(loop.output.range[1] - loop.output.range[0])
    kick = float(loop.tuning.derivative_time) / (bench.sample + float(loop.tuning.derivative_filter))
    closed_loop_output = output + pv / bench.span * share * (1 + kick)
    whole = any(getattr(new_plc(side, (k,)).configs[k], "is_integer", 0) for side, k in ((first, i), (second, j)))
    last = 1.0 if whole else SINGLE_PRECISION_SHARE * max(abs(bench.low), abs(bench.high))
    digits = last / bench.span * share * (1 + kick)
    band = float(loop.deadband)
    switching = share * band / bench.span
    return Tolerance(
        STAND_IN_TOLERANCE,
        CountSizes(CLOSED_TOLERANCE * (pv + output * abs(bench.gain)), CLOSED_TOLERANCE * closed_loop_output),
        CountSizes(COUNT_TOLERANCE * pv, COUNT_TOLERANCE * (output + 2 * digits)),
        COUNT_TOLERANCE * pv,
        COUNT_TOLERANCE * output + 2 * LIMIT_DISTANCE,
        band,
        switching,
        switching * float(loop.tuning.derivative_time) / bench.sample,
        manual_output=COUNT_TOLERANCE * output,
    )


def tolerance_between(first: Side, i: int, second: Side, j: int, bench: Bench) -> Tolerance:
    """How far two PLCs of different families may lie apart (D306)."""
    loop, sides = first.loop(i), ((first, i), (second, j))
    pv, output = _larger_counts(analog_counts(new_plc(side, (k,)), k) for side, k in sides)
    fine_pv, fine_output = _larger_counts(finest_counts(new_plc(side, (k,)), k) for side, k in sides)
    setpoint = COUNT_TOLERANCE * pv
    # a filter that is worked out in counts stops where its share of the rest is less than half a count
    passed = -expm1(-bench.sample / float(loop.pv.filter)) if loop.pv.filter else 1.0
    width = float(loop.output.range[1] - loop.output.range[0])
    share = abs(float(loop.tuning.gain)) * bench.span / width
    other = second.loop(j)
    smoothed = float(min(loop.tuning.derivative_filter, other.tuning.derivative_filter))
    kick = float(loop.tuning.derivative_time) / (bench.sample + smoothed)
    open_loop_output = fine_output + fine_pv / bench.span * share * (1 / passed + kick)
    mean = fine_output + fine_pv / bench.span * share * (1 + 1 / passed + kick / MEAN_SAMPLES)
    pv = pv / passed + output * abs(bench.gain)
    band = float(max(loop.deadband, other.deadband))
    switching = share * band / bench.span
    return Tolerance(
        RESPONSE_TOLERANCE,
        CountSizes(COUNT_TOLERANCE * pv, COUNT_TOLERANCE * (output + pv / bench.span * share * (1 + kick))),
        CountSizes(COUNT_TOLERANCE * fine_pv / passed, COUNT_TOLERANCE * open_loop_output),
        setpoint,
        COUNT_TOLERANCE * output + 2 * LIMIT_DISTANCE,
        band,
        switching,
        switching * float(loop.tuning.derivative_time) / bench.sample,
        mean if kick else 0.0,
        SAMPLE_SHIFTS,
    )


def _larger_counts(counts: Iterable[tuple[float, float]]) -> tuple[float, float]:
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
    other_reference: Reference | None = None
    """Where the other side has trials already."""
    trials: dict[Stage, Trial] = field(default_factory=dict)

    def run_trial(self, stage: Stage) -> Trial:
        """The other side through a stage."""
        if self.other_reference is not None:
            return self.other_reference.run_trial(stage)
        if stage not in self.trials:
            rooted = self.reference.before_root
            self.trials[stage] = run_stage(self.side, self.j, stage, self.reference.bench, before_root=rooted)
        return self.trials[stage]

    def as_reference(self) -> Reference:
        """The other side with the trials that it has."""
        trials = {(self.reference.bench, stage): self.run_trial(stage) for stage in self.reference.possible_stages}
        return replace(self.reference, side=self.side, i=self.j, trials=trials)

    def find_differences(self) -> Iterator[SignalDifference]:
        """Where both sides differ, stage by stage: who wants the first one alone waits for no other stage."""
        for stage in self.reference.possible_stages:
            yield from self._lasting_differences(stage)

    def _lasting_differences(self, stage: Stage) -> Iterator[SignalDifference]:
        """The differences of a stage that are there with smaller moves, too: rounding at an edge is not."""
        differences = list(self._stage_differences(stage))
        smaller = smaller_moves(stage, self.reference.bench, self.reference.step)
        if differences and smaller != stage:
            lasting = {difference.signal for difference in self._stage_differences(smaller)}
            differences = [difference for difference in differences if difference.signal in lasting]
        yield from differences

    def _stage_differences(self, stage: Stage) -> Iterator[SignalDifference]:
        try:
            trial = self.run_trial(stage)
        except UnusableError as error:
            yield SignalDifference(stage.name, RUN_SIGNAL, 0.0, "", str(error), ())
            return
        yield from find_differences(stage, self.reference.run_trial(stage), trial, self.reference.bench, self.tolerance)

    def find_key(self, difference: SignalDifference, lines: Sequence[ReportLine] = ()) -> str:
        """The key of the other side that explains what ``lines`` of the report do not; empty where none does."""
        reported = {line.neutral for line in lines} - {"", ACTION}
        return explaining_key(difference, self.reference.loop, self.side, self.j, reported)


# --- What the battery found: of each loop the differences that nothing explains, and those that a line names ----------


@frozen
class NamedDifference:
    """A difference, and the line of the report that says why; None: several do, and none of them alone."""

    difference: SignalDifference
    line: Change | None


@frozen
class Failure:
    """A difference that nothing explains, and the key of the target that does where one is found."""

    difference: SignalDifference
    key: str = ""


@frozen
class UntriedStage:
    """A stage that shows nothing, and the mode that it asks for and the source does not go to."""

    stage: str
    mode: str


@frozen
class VerifiedLoop:
    """One loop's two sides in the battery, and how far they lie apart in its step and its disturbance."""

    loop: str
    pv_percent: float
    """The PVs at most, in % of the range, with the source as it is."""
    output_percent: float
    iae_ratio: float | None
    chart: Chart
    stages: tuple[str, ...] = ()
    """Those that were run."""
    untried: tuple[UntriedStage, ...] = ()
    failures: tuple[Failure, ...] = ()
    named: tuple[NamedDifference, ...] = ()
    switched: tuple[Change, ...] = ()
    """The lines of the report whose rules, and values, the source's numbers were run with."""
    hidden: tuple[str, ...] = ()
    """Neutral fields that no stage shows: another value of them would be called alike."""

    @property
    def passed(self) -> bool:
        """Whether everything that differs is named by a line of the report."""
        return not self.failures


# --- Charts of two runs laid over each other: a configuration and what became of it, on the same plants ---------------


def overlay_chart(  # noqa: PLR0913, PLR0917 - two trends and their times, each in columns
    loop: Loop,
    times: Sequence[float],
    setpoints: Sequence[float],
    pvs: Sequence[Sequence[float]],
    outputs: Sequence[Sequence[float]],
    names: tuple[str, str],
    mark_times: tuple[float, float],
) -> Chart:
    """PV and output of both sides; outputs are in % of their ranges, since these may differ."""
    shares = [[100 * value for value in side] for side in outputs]
    return Chart(
        title=f"{loop.name}: {loop.description}" if loop.description else loop.name,
        loop=loop.name,
        panels=(
            Panel(
                "PV, SP",
                loop.pv.unit or "",
                (Line("SP", "setpoint", times, setpoints), *_before_and_after("PV", "pv", times, pvs)),
            ),
            Panel("OUT", "%", _before_and_after("OUT", "output", times, shares)),
        ),
        marks=(Mark("step of the set point", mark_times[0]), Mark("disturbance", mark_times[1])),
        sides=names,
    )


def _before_and_after(
    name: str, role: Role, times: Sequence[float], both: Sequence[Sequence[float]]
) -> tuple[Line, Line]:
    return Line(name, role, times, both[0], "before"), Line(name, role, times, both[1], "after")


# --- The verdict on two configurations: a source and what it was converted to, or any two files -----------------------
#
# A conversion is held against the twin of its source. Two files without a report are held against each other: of one
# vendor they run the same algorithm on the same numbers, so that nothing but a count of rounding is excused.

VendorConfig = tuple["Vendor", Any]
"""A vendor and a configuration of it."""
SHOWN_STAGES = ("step 5 %", "disturbance")
"""The stages that pictures and figures are of."""
MIN_PARALLEL_LOOPS = 3
"""Loops that several processes judge sooner than one: each takes about as long as a process takes to start."""


@frozen
class Sides:
    """What is compared, and what of it a report says."""

    source: Side
    target: Side
    names: tuple[str, str]
    reduced_source: Side | None = None
    """Of a conversion: the source without what the report says is lost, and no neutral loop has."""
    source_model: Side | None = None
    """Of a conversion: the source's numbers under the source's rules, which must do what ``reduced_source`` does."""
    target_model: Side | None = None
    """Of a conversion: what the report makes of these numbers under the target's rules, which the target must do."""
    lines: Mapping[int, Sequence[ReportLine]] = field(default_factory=dict)
    """By place in the source."""


def verify(  # noqa: PLR0913
    source: VendorConfig,
    target: VendorConfig,
    pairs: Sequence[tuple[int, int]],
    report: Sequence[LoopReport] = (),
    names: tuple[str, str] = ("source", "result"),
    progress: Callable[[float], None] | None = None,
    *,
    jobs: int = 1,
) -> list[VerifiedLoop]:
    """The loops of both sides in the battery, pair by pair of their places; one without a neutral form is left out.

    ``report``: of the conversion, by the places of the source; without one both files are held against each other.
    ``names``: what charts call the sides. ``progress`` is called with the share that is done. ``jobs``: processes,
    which are started for `MIN_PARALLEL_LOOPS` loops.
    """
    inputs = (source, target, pairs, report, names)
    sides = _make_sides(*inputs)
    common = [(i, j) for i, j in pairs if sides.source.loops[i] is not None and sides.target.loops[j] is not None]
    several = jobs > 1 and len(common) >= MIN_PARALLEL_LOOPS
    loops = WorkerPool(jobs, _make_judge, inputs).results(common) if several else map(_make_judge(*inputs), common)
    results = []
    for done, verified in enumerate(loops, start=1):
        results.append(verified)
        if progress is not None:
            progress(done / len(common))
    return results


def _make_judge(
    source: VendorConfig,
    target: VendorConfig,
    pairs: Sequence[tuple[int, int]],
    report: Sequence[LoopReport],
    names: tuple[str, str],
) -> Callable[[tuple[int, int]], VerifiedLoop]:
    """What judges one pair of loops after the other."""
    sides = _make_sides(source, target, pairs, report, names)
    is_exact = not report and source[0] == target[0]
    return lambda pair: _judge_loop(sides, *pair, is_exact=is_exact)


def _make_sides(
    source: VendorConfig,
    target: VendorConfig,
    pairs: Sequence[tuple[int, int]],
    report: Sequence[LoopReport],
    names: tuple[str, str],
) -> Sides:
    (source_vendor, before), (target_vendor, after) = source, target
    second = make_side(target_vendor, after)
    if not report:
        return Sides(make_side(source_vendor, before), second, names)
    reported = reported_loops(before, source_vendor, after, target_vendor, pairs, report)
    first = make_side(source_vendor, before)
    reduced_config = drop_losses(before, source_vendor, report)
    reduced = first if reduced_config is before else make_side(source_vendor, reduced_config)
    source_rules, places = source_of(source_vendor).operations(reduced.config), dict(pairs)
    rules = [None if loop is None else Rules.make(reduced, i, source_rules[i]) for i, loop in enumerate(reduced.loops)]
    target_rules = [
        None if loop is None else Rules.make(*((second, places[i]) if i in places else (first, i)), reported.rules[i])
        for i, loop in enumerate(reported.loops)
    ]
    stand_ins = make_stand_in(reduced.loops, rules), make_stand_in(reported.loops, target_rules)
    return Sides(first, second, names, reduced, *stand_ins, reported.lines)


def _judge_loop(sides: Sides, i: int, j: int, *, is_exact: bool) -> VerifiedLoop:
    """One loop's verdict."""
    other = sides.target.loop(j)
    tested_side = sides.target_model or sides.source
    step = max(root_step(sides.source, i), root_step(sides.target, j))
    cascades = ((sides.source, i), (sides.target, j))
    in_cascade = any(companion_loops(side.loops, k, with_master=True) for side, k in cascades)
    reference = make_reference(tested_side, i, other, step, in_cascade=in_cascade)
    tolerance_for = tolerance_between if sides.target_model is None else tolerance_of
    tolerance = tolerance_for(tested_side, i, sides.target, j, reference.bench)
    if is_exact:
        pv, output = finest_counts(new_plc(sides.source, (i,)), i)
        tolerance = Tolerance(0.0, CountSizes(pv, output), CountSizes(pv, output), pv, output)
    battery, lines = Battery(reference, sides.target, j, tolerance), sides.lines.get(i, ())
    failures = [Failure(difference, battery.find_key(difference, lines)) for difference in battery.find_differences()]
    original, named_differences = reference, list[NamedDifference]()
    if sides.source_model is not None and sides.reduced_source is not None:
        original = replace(reference, side=sides.source, trials={})
        named_differences = list(_name_differences(original, battery, lines))
        model_reference = replace(reference, side=sides.source_model, trials={})
        tolerance = tolerance_of(sides.source_model, i, sides.reduced_source, i, reference.bench)
        trials = original if sides.reduced_source is sides.source else None
        first = Battery(model_reference, sides.reduced_source, i, tolerance, trials)
        failures += [Failure(difference, first.find_key(difference)) for difference in first.find_differences()]
    result = _make_result(sides, i, reference, original, battery, failures, named_differences)
    if not isinstance(tested_side, StandIn):
        return result
    switched = tuple(line.change for line in lines)
    unsaid_failures = map(Failure, chain(unreported_numbers(tested_side.loop(i), other), unreported_rules(sides, i, j)))
    result = replace(result, failures=(*result.failures, *unsaid_failures))
    return replace(result, switched=switched, hidden=tuple(hidden_fields(reference, tested_side, i)))


def hidden_fields(reference: Reference, side: StandIn, i: int) -> Iterator[str]:
    """The numbers of a loop of which a small change goes unseen in every stage."""
    swept_first = replace(reference, stages=tuple(sorted(reference.stages, key=lambda stage: not stage.is_swept)))
    for path, value in spoiled_fields(side.loop(i)):
        loop = replace_fields(side.loop(i), {path: value})
        other = make_stand_in([loop if k == i else other_loop for k, other_loop in enumerate(side.loops)], side.rules)
        tolerance = tolerance_of(side, i, other, i, reference.bench)
        if next(Battery(swept_first, other, i, tolerance).find_differences(), None) is None:
            yield path


SPOILED_SHARE, SPOILED_POSITION = Decimal("1.1"), Decimal("0.02")
"""What a number is multiplied by, and the share of its range that a position is moved by."""
SPOILED_NUMBERS = (
    "tuning.gain",
    "tuning.integral_time",
    "tuning.derivative_time",
    "tuning.derivative_filter",
    "pv.filter",
    "deadband",
)


def spoiled_fields(loop: Loop) -> Iterator[tuple[str, Decimal]]:
    """The numbers that a loop controls with, each with another value."""
    values = flatten(loop)
    for path in SPOILED_NUMBERS:
        if values.get(path) and not (path == "tuning.derivative_filter" and not values["tuning.derivative_time"]):
            yield path, values[path] * SPOILED_SHARE
    ranges = {"output.limits": loop.output.range, "setpoint.limits": loop.pv.range}
    for section, (low, high) in ranges.items():
        for end, sign in (("0", 1), ("1", -1)):
            yield f"{section}.{end}", values[f"{section}.{end}"] + sign * SPOILED_POSITION * (high - low)
    if not loop.tuning.integral_time:
        low, high = loop.output.range
        yield "output.bias", loop.output.bias + SPOILED_POSITION * (high - low)


RULE_FIELDS = ("anti_windup", "mode", "setpoint.source", "output.manual", "output.bias")
"""Neutral fields that another PLC has in another form: rules, links and what a loop begins with, which stages show."""


def unreported_numbers(loop: Loop, other: Loop) -> Iterator[SignalDifference]:
    """The numbers and choices of a result that no line makes other ones; ``loop``: the source as the report has it.

    They are told whatever the stages show: a gain that drives the output from limit to limit hides in all of them, and
    a range that is not the transmitter's acts on the plant alone.
    """
    one, two = neutral_values(loop, other)
    idle_fields = {*LABEL_FIELDS, *RULE_FIELDS, *_without_effect(loop, other)}
    for path in differing_fields(one, two):
        before, after = one.get(path), two.get(path)
        is_lost = after is None and path.startswith(ALARMS_PREFIX)
        if before is None or path in idle_fields or (after is None and not is_lost):
            continue
        if is_lost or is_material(path, one, two):
            yield SignalDifference(NUMBERS_STAGE, path, 0.0, _plain_value(before), _plain_value(after), ())


def unreported_rules(sides: Sides, i: int, j: int) -> Iterator[SignalDifference]:
    """The rules of a result that no line names; the integral that a report has as lost has none of its own."""
    if not isinstance(sides.target_model, StandIn):
        return
    target, target_model = sides.target, sides.target_model
    other: Operation = source_of(target.vendor).operations(target.config)[j]
    lost = bool(sides.source.loop(i).tuning.integral_time) and not target_model.loop(i).tuning.integral_time
    for row in differing_rules(target_model.rules[i].operation, other, target_model.loop(i), is_master=False):
        if lost and row.field == f"{PREFIX}transfer":
            continue
        yield SignalDifference(NUMBERS_STAGE, row.field, 0.0, str(row.source), str(row.target), ())


def _plain_value(value: Any) -> float | str | bool:
    if isinstance(value, Decimal):
        return float(value)
    return value if isinstance(value, bool) else "nothing" if value is None else str(value)


def _without_effect(loop: Loop, other: Loop) -> Iterator[str]:
    """Fields that do nothing on a loop."""
    if not (loop.tuning.derivative_time and other.tuning.derivative_time):
        yield "tuning.derivative_on"
    if not has_alarms(loop):
        yield "alarms.hysteresis"


RULE_STAGES: Mapping[str, Sequence[str]] = {
    "start": ("start",),
    "hand": ("start",),
    "interlock": ("start",),
    "master": ("start", "cascade"),
    "transfer": ("auto", "transfers", "start"),
    "manual": ("transfers",),
    "rate": ("auto", "transfers"),
    "windup": ("high limit", "low limit", "step 50 %", "disturbance", "start", "sensor"),
    "deadband": ("dead band", "dead band 2"),
    "smoothing": ("answer", "slow answer", "set point"),
    "filter": ("answer", "slow answer"),
}
"""The stages in which a rule shows itself first."""


def _name_differences(original: Reference, battery: Battery, lines: Sequence[ReportLine]) -> Iterator[NamedDifference]:
    """Where the source as it is and the target differ, each with the line that it is likeliest of."""
    shown = Battery(original, battery.side, battery.j, battery.tolerance, battery.as_reference())
    for difference in shown.find_differences():
        line = next((line for line in lines if difference.stage in _stages_of_rule(line)), None)
        field = field_of(difference, original.loop, battery.side.loop(battery.j))
        line = line or next((line for line in lines if field and do_overlap(field, line.neutral)), None)
        if line is None and len(lines) == 1:
            (line,) = lines
        if lines:
            yield NamedDifference(difference, None if line is None else line.change)


def _stages_of_rule(line: ReportLine) -> Sequence[str]:
    return RULE_STAGES.get(line.neutral.removeprefix(PREFIX), ())


def _make_result(  # noqa: PLR0913, PLR0917
    sides: Sides,
    i: int,
    reference: Reference,
    original: Reference,
    battery: Battery,
    failures: Sequence[Failure],
    named_differences: Sequence[NamedDifference],
) -> VerifiedLoop:
    """The verdict with its figures, and the picture of the step and the disturbance."""
    loop = sides.source.loop(i)
    shown = [stage for stage in reference.stages if stage.name in SHOWN_STAGES and stage in reference.possible_stages]
    shown = shown or [reference.stages[0]]
    sample = reference.bench.sample
    parts = [(stage, original.run_trial(stage), battery.run_trial(stage)) for stage in shown]
    runs = [(round(stage.begin / sample), one, two) for stage, one, two in parts]
    pvs, outputs, setpoints = (
        [list(chain.from_iterable(getattr(side(one, two), key)[first:] for first, one, two in runs)) for side in SIDES]
        for key in ("pv", "output", "setpoint")
    )
    count = len(pvs[0])
    times = [k * sample for k in range(count)]
    ends = [len(one.pv) - first for first, one, _ in runs]
    iae = [sum(abs(sp - pv) for sp, pv in zip(setpoints[0], side, strict=True)) for side in pvs]
    return VerifiedLoop(
        loop.name,
        100 * max(abs(a - b) for a, b in zip(*pvs, strict=True)) / reference.bench.span,
        100 * max(abs(a - b) for a, b in zip(*outputs, strict=True)),
        iae[1] / iae[0] if iae[0] else None,
        overlay_chart(
            loop, times, setpoints[0], pvs, outputs, sides.names, (0.0, ends[0] * sample if len(runs) > 1 else 0.0)
        ),
        tuple(stage.name for stage in reference.possible_stages),
        tuple(UntriedStage(stage.name, mode) for stage in reference.stages if (mode := reference.refused_mode(stage))),
        tuple(failures),
        tuple(named_differences),
    )


def _first_trial(one: Trial, _: Trial) -> Trial:
    return one


def _second_trial(_: Trial, two: Trial) -> Trial:
    return two


SIDES = (_first_trial, _second_trial)

# --- Both sides of a ``diff`` in the battery: their verdicts and charts, loop over loop -------------------------------


def verify_sides(
    sides: tuple[NeutralSide, NeutralSide],
    sources: Sequence[tuple[Any, Vendor]],
    names: tuple[str, str],
    note: Callable[[str], None],
    progress: Callable[[float], None] | None = None,
    jobs: int = 1,
) -> list[VerifiedLoop]:
    """A verdict for each loop that both sides have and that can be run; ``note`` is told what cannot, and why."""
    from pidcfg.sim.engine.run import UnusableError

    pairs = list(_comparable_pairs(*sides, note))
    if not pairs:
        note("not compared: no loop of both sides can be run on the same plant")
        return []
    (one, first), (two, second) = sources
    before, after = (f"{Path(name).name} ({vendor.key})" for name, (_, vendor) in zip(names, sources, strict=True))
    try:
        return verify((first, one), (second, two), pairs, names=(before, after), progress=progress, jobs=jobs)
    except UnusableError as error:
        note(f"not compared: {error}")
    return []


def _comparable_pairs(
    before: NeutralSide, after: NeutralSide, note: Callable[[str], None]
) -> Iterator[tuple[int, int]]:
    """The places of loops with a neutral form on both sides, whose PVs have the same unit."""
    from pidcfg.conversion.comparison import match_loops

    for i, j in match_loops(before.names, after.names):
        if i is None or j is None:
            name = before.names[i] if i is not None else after.names[j] if j is not None else ""
            note(f"not compared: {name} is on one side only")
            continue
        name, one, two = after.names[j], before.loops[i], after.loops[j]
        if one is None or two is None:
            note(f"not compared: {name} has no ranges in engineering units")
        elif one.pv.unit != two.pv.unit:
            note(f"not compared: the PV of {name} is in {one.pv.unit or 'no unit'} and in {two.pv.unit or 'no unit'}")
        else:
            yield i, j
