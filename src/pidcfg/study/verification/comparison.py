"""Two trials of one stage held against each other, signal by signal, sample by sample."""

from __future__ import annotations

from dataclasses import replace
from itertools import accumulate, groupby, pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.conversion.builder import flatten, rescale_output, round_computed
from pidcfg.conversion.comparison import is_same_value
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from pidcfg.schemas.generic import Loop
    from pidcfg.study.verification.stages import Bench, Stage
    from pidcfg.study.verification.trial import Trial

# --- Fields of neutral loops, and their values on one scale -----------------------------------------------------------

FOLLOWS_PV_FIELD, NO_FOLLOWING = "setpoint.follows_pv", False
"""A PLC that knows nothing of it lets the set point stay."""
LABEL_FIELDS = ("name", "description", "pv.unit", "output.unit")
ACTION = "output_raises_pv"
"""No line excuses another action."""
FIRST_FIELDS = ("sample_time", "tuning.gain")
"""Fields on which the meaning of others depends."""
GAIN, INTEGRAL_TIME, DERIVATIVE_TIME = "tuning.gain", "tuning.integral_time", "tuning.derivative_time"


def neutral_values(loop: Loop, other: Loop) -> tuple[dict[str, Any], dict[str, Any]]:
    """The values of two neutral loops by path, the second on the first one's scale of the output.

    Without a proportional action any gain is as good, as long as its times go with it: the second has the first one's.
    """
    one, two = flatten(loop), flatten(other)
    for values in (one, two):
        values.setdefault(FOLLOWS_PV_FIELD, NO_FOLLOWING)
    two = rescale_output(one, two)
    if loop.tuning.proportional is other.tuning.proportional is False and one[GAIN] and two[GAIN]:
        share = two[GAIN] / one[GAIN]
        times = {INTEGRAL_TIME: two[INTEGRAL_TIME] / share, DERIVATIVE_TIME: two[DERIVATIVE_TIME] * share}
        two |= {GAIN: one[GAIN]} | {path: round_computed(time) for path, time in times.items()}
    return one, two


def differing_fields(one: Mapping[str, Any], two: Mapping[str, Any]) -> list[str]:
    """The neutral fields that differ, those first on which others depend."""
    keys = [key for key in dict.fromkeys((*one, *two)) if not is_same_value(one.get(key), two.get(key))]
    return sorted(keys, key=lambda key: FIRST_FIELDS.index(key) if key in FIRST_FIELDS else len(FIRST_FIELDS))


# ----------------------------------------------------------------------------------------------------------------------
# Signals of two sides, a value a sample: how far they lie apart where either may come earlier, and their means.

MEAN_SAMPLES = 60
"""Samples over which the kicks of a derivative cancel each other."""


def running_means(values: Sequence[float], first: int) -> list[float]:
    """Of the samples before each, as many as there are."""
    sums = [0.0, *accumulate(values)]
    begins = (max(k + 1 - MEAN_SAMPLES, 0) for k in range(first, len(values)))
    return [(sums[k + 1] - sums[begin]) / (k + 1 - begin) for k, begin in enumerate(begins, first)]


def distance_at(a: Sequence[float], b: Sequence[float], k: int, window: int) -> float:
    """How far two signals lie apart at a sample, where each may come ``window`` samples earlier or later."""
    if a[k] == b[k]:
        return 0.0
    return min(_distance_outside(a, k, b[k], window), _distance_outside(b, k, a[k], window))


def _distance_outside(values: Sequence[float], k: int, value: float, window: int) -> float:
    """How far a value is outside of what a signal shows in the samples around."""
    near = values[max(k - window, 0) : k + window + 1]
    return max(value - max(near), min(near) - value, 0.0)


# --- Two trials of one stage held against each other, signal by signal, sample by sample ------------------------------

State = str | bool
"""A mode, or an alarm."""
RESPONSE_TOLERANCE = 0.01
"""Of the response of a stage, by which both sides may differ."""
COUNT_TOLERANCE = 2.0
"""Of the coarser side."""
SAMPLE_TOLERANCE = 2
"""By which modes, alarms and set points may come apart."""
DEADBAND_TOLERANCE = 0.5
"""Of a dead band, by which two PVs may rest apart in it."""
MANUAL_STAGES = ("start", "manual")
"""Stages in which an output in Manual is the one that was given."""
SAMPLE_SHIFTS = (0, -1, 1)
"""By which PV and output may, from one act to the next: it may act with the sample or with the next one."""
REST_SAMPLES = 4
"""Samples without a move after which an output stands still."""
FLIP_SAMPLES, MAX_FLIPS = 2, 4
"""Samples in which a PV that is rounded up on one side and down on the other moves the output, and of how many such
PVs in a stage this may be so."""
LARGE_JUMP = 0.1
"""Of the output's range, by which it jumps at the edge of a dead band, so that a loop may never come to rest."""
LIMIT_DISTANCE = 1e-3
"""How near to its end an output is at it: a share of its range."""


CASCADE_SUBSTITUTES = {"cascade": "auto"}
"""What a loop's mode is in a PLC that has no mode for cascade."""


class CountSizes(NamedTuple):
    """What rounding may make of a PV, in its units, and of an output, a share of its range."""

    pv: float
    output: float


@frozen
class Tolerance:
    """How far both sides of a loop may lie apart."""

    response_share: float
    """Of the response."""
    closed_loop: CountSizes
    """In the closed loop, where each is carried to the other."""
    open_loop: CountSizes
    """Where the PV goes its own way."""
    setpoint: float
    """PV units."""
    limit: float
    """Of an output that is held by its limit: a share of its range."""
    band: float = 0.0
    """The dead band, in PV units."""
    switching: float = 0.0
    """What a dead band switches the output by, when an error is just inside on one side and just outside on the other:
    a share of the range."""
    kick: float = 0.0
    """The same of the derivative."""
    mean: float = 0.0
    """Of the mean of an output where the PV goes its own way: a share of the range; 0: means are not compared."""
    shifts: tuple[int, ...] = (0,)
    """Samples by which PV and output may come apart from one act to the next."""
    manual_output: float | None = None
    """Of an output in Manual, as a share of its range; None: as in Auto."""


@frozen
class SignalDifference:
    """A signal that differs in a stage."""

    stage: str
    signal: str
    """``pv``, ``output``, ``setpoint``, ``mode``, or the name of an alarm."""
    at: float
    """The first time, in s from the beginning of the stage."""
    before: float | str | bool
    after: float | str | bool
    """What both sides show then."""
    samples: tuple[int, ...]
    """Where it differs."""
    worst: float | None = None
    """How far a number lies apart at most, as a share of its range."""
    allowed: float = 0.0
    """How far it may, in the signal's unit."""
    at_limits: frozenset[int] = frozenset()
    """Samples at which both sides are held by their limits, each by another one: no rule of a PLC explains that."""


def find_differences(
    stage: Stage, one: Trial, two: Trial, bench: Bench, tolerance: Tolerance
) -> Iterator[SignalDifference]:
    """Where two trials of a stage differ by more than they may, each signal once."""
    comparison = _Comparison(stage, one, two, bench, tolerance)
    if stage.output is None and abs(one.period - two.period) > RESPONSE_TOLERANCE * one.period:
        yield SignalDifference(stage.name, "sample time", 0.0, one.period, two.period, (0,))
    if "pv" in stage.signals:
        yield from comparison.compare_pv()
    if "output" in stage.signals:
        yield from comparison.compare_output()
    if "setpoint" in stage.signals and not _begins_in_manual(stage, one, two):
        yield from comparison.compare_setpoint()
    if "mode" in stage.signals:
        modes = [side.modes for side in (one, two)]
        if not (one.has_cascade and two.has_cascade):
            modes = [[CASCADE_SUBSTITUTES.get(mode, mode) for mode in side] for side in modes]
        yield from comparison.compare_states("mode", *modes)
    if "alarms" in stage.signals:
        for name in sorted(one.alarms.keys() & two.alarms.keys()):
            yield from comparison.compare_states(name, one.alarms[name], two.alarms[name])


def _begins_in_manual(stage: Stage, one: Trial, two: Trial) -> bool:
    """Whether a loop begins in Manual, where some PLCs get their set point with the change to Auto only."""
    return stage.output is None and "manual" in {one.modes[-1], two.modes[-1]}


@frozen
class _Comparison:
    """Two trials of one stage."""

    stage: Stage
    one: Trial
    two: Trial
    bench: Bench
    tolerance: Tolerance

    @property
    def first_sample(self) -> int:
        """The sample from which on they are compared."""
        return round(self.stage.begin / self.bench.sample)

    def compare_pv(self) -> Iterator[SignalDifference]:
        """The PVs, which may rest anywhere in a dead band."""
        tolerance = self.tolerance
        counts = (
            tolerance.open_loop.pv
            if self.stage.is_swept
            else tolerance.closed_loop.pv + DEADBAND_TOLERANCE * tolerance.band
        )
        yield from self._compare_values("pv", self.one.pv, self.two.pv, counts, self.bench.span)

    def compare_output(self) -> Iterator[SignalDifference]:
        """The outputs, which a dead band switches."""
        tolerance = self.tolerance
        counts = tolerance.open_loop.output if self.stage.is_swept else tolerance.closed_loop.output
        if not (self.stage.is_swept or self.stage.name.startswith("dead band")):
            counts += tolerance.switching
        output_differences = list(self._compare_values("output", self.one.output, self.two.output, counts, 1.0))
        if not output_differences and self.stage.is_swept and tolerance.mean and not tolerance.band:
            output_differences = list(self._compare_means())
        yield from output_differences

    def _compare_means(self) -> Iterator[SignalDifference]:
        """Outputs whose means differ, although a count of the PV moves each of them by more for a sample."""
        a, b = (running_means(side.output, self.first_sample) for side in (self.one, self.two))
        allowed = self.tolerance.response_share * (max(a) - min(a)) + self.tolerance.mean
        samples = tuple(self.first_sample + k for k in range(len(a)) if not distance_at(a, b, k, 1) <= allowed)
        if samples:
            worst = max(abs(a[k - self.first_sample] - b[k - self.first_sample]) for k in samples)
            difference = self._make_difference("output", self.one.output, self.two.output, samples)
            yield replace(difference, worst=worst, allowed=allowed)

    def _compare_values(
        self, signal: str, a: Sequence[float], b: Sequence[float], counts: float, span: float
    ) -> Iterator[SignalDifference]:
        """A signal of which one side may come a sample later, where that fits better."""
        first = self.first_sample
        allowed = self.tolerance.response_share * (max(a[first:]) - min(a[first:])) + counts
        if self._is_operated:
            window = (len(self.tolerance.shifts) > 1) + self.stage.slack
            samples = [k for k in range(first, len(a)) if not distance_at(a, b, k, window) <= allowed]
        else:
            samples = [
                k
                for part in self._stage_parts(len(a))
                for k in _distant_samples(a, b, part, allowed, self.tolerance.shifts)
            ]
        if not self.stage.is_swept and self.tolerance.response_share:
            known = set(samples)
            samples = [k for k in samples if not _is_single_sample(k, known, abs(a[k] - b[k]) - allowed, allowed)]
        if signal == "output":
            flips = self._flipped_samples()
            kick = self.tolerance.kick
            samples = [
                k for k in samples if k not in flips and not self._is_at_edge(k, abs(a[k] - b[k]) - allowed, kick)
            ]
        if samples:
            jump = self._jump_of_one_side()
            samples = [k for k in samples if k < jump]
        if signal == "output":
            samples += self._manual_samples(samples)
        limit_samples = self._samples_at_limits() if signal == "output" else frozenset()
        if samples or limit_samples:
            all_samples = tuple(sorted({*samples, *limit_samples}))
            worst = max(abs(a[k] - b[k]) for k in all_samples) / span
            difference = self._make_difference(signal, a, b, all_samples)
            yield replace(difference, worst=worst, allowed=allowed, at_limits=limit_samples)

    def _manual_samples(self, samples: Sequence[int]) -> list[int]:
        """Where both are in Manual, and their outputs are apart by more than counts."""
        one, two, max_distance = self.one, self.two, self.tolerance.manual_output
        if max_distance is None or self.stage.name not in MANUAL_STAGES:
            return []
        known = set(samples)
        return [
            k
            for k in range(self.first_sample, len(one.output))
            if k not in known
            and one.modes[k] == two.modes[k] == "manual"
            and abs(one.output[k] - two.output[k]) > max_distance
        ]

    @property
    def _is_operated(self) -> bool:
        """Whether an operator or another loop acts meanwhile: each PLC takes that over at a sample of its own."""
        begin, acts = self.stage.begin, self.stage.acts
        by_hand = any(act.mode is not None or act.output is not None for act in acts if act.at >= begin)
        return by_hand or self.stage.slack > 0 or self.stage.output is None

    def _stage_parts(self, count: int) -> Iterator[range]:
        """From one act to the next."""
        begins = {round(act.at / self.bench.sample) for act in self.stage.acts}
        ends = [self.first_sample, *sorted(k for k in begins if self.first_sample < k < count), count]
        return (range(one, two) for one, two in pairwise(ends))

    def _flipped_samples(self) -> frozenset[int]:
        """Where a PV that lies between two counts is rounded up on one side alone: a derivative makes much of that."""
        if not self.stage.is_swept:
            return frozenset()
        half = self.tolerance.open_loop.pv / COUNT_TOLERANCE / 2
        flips = [k for k in range(self.first_sample, len(self.one.pv)) if abs(self.one.pv[k] - self.two.pv[k]) > half]
        return frozenset(k + n for k in flips for n in range(FLIP_SAMPLES)) if len(flips) <= MAX_FLIPS else frozenset()

    def _is_at_edge(self, k: int, excess: float, jump: float) -> bool:
        """Whether an output may jump, an error being at the edge of the dead band and inside on one side only."""
        band, near = self.tolerance.band, self.tolerance.closed_loop.pv
        if not band or self.stage.is_swept or excess > 2 * jump:
            return False
        return any(
            abs(abs(side.setpoint[n] - side.pv[n]) - band) <= near
            for side in (self.one, self.two)
            for n in range(max(k - 1, 0), min(k + 2, len(side.pv)))
        )

    def _jump_of_one_side(self) -> int:
        """The sample after which each side goes its own way, the edge of the dead band having moved one of them alone.

        Where that is far, PV and output swing on by jumps whose times rounding decides.
        """
        one, two, count = self.one, self.two, len(self.one.output)
        jump = self.tolerance.switching + self.tolerance.kick
        if self.stage.is_swept or jump < LARGE_JUMP:
            return count
        apart = ((k, abs(one.output[k] - two.output[k]) - LARGE_JUMP) for k in range(self.first_sample, count))
        return next((k for k, further in apart if further > 0.0 and self._is_at_edge(k, further, jump)), count)

    def compare_setpoint(self) -> Iterator[SignalDifference]:
        """The set points, but for one that follows its PV in Manual: some PLCs take it over with the change to Auto."""
        a, b, allowed = self.one.setpoint, self.two.setpoint, self.tolerance.setpoint
        window = SAMPLE_TOLERANCE + self.stage.slack
        samples = tuple(
            k
            for k in range(self.first_sample, len(a))
            if not distance_at(a, b, k, window) <= allowed
            and not (self.one.modes[k] == self.two.modes[k] == "manual" and self._is_following(k, window, allowed))
        )
        if samples:
            worst = max(abs(a[k] - b[k]) for k in samples) / self.bench.span
            yield replace(self._make_difference("setpoint", a, b, samples), worst=worst, allowed=allowed)

    def _is_following(self, k: int, window: int, allowed: float) -> bool:
        """Whether the set point of a side is its PV."""
        return any(distance_at(side.setpoint, side.pv, k, window) <= allowed for side in (self.one, self.two))

    def compare_states(self, signal: str, a: Sequence[State], b: Sequence[State]) -> Iterator[SignalDifference]:
        """A signal that is a mode or an alarm."""
        window = SAMPLE_TOLERANCE + self.stage.slack
        runs = [
            list(run) for differs, run in groupby(range(self.first_sample, len(a)), lambda k: a[k] != b[k]) if differs
        ]
        samples = tuple(k for run in runs if len(run) > window for k in run)
        if samples:
            yield self._make_difference(signal, a, b, samples)

    def _samples_at_limits(self) -> frozenset[int]:
        """Where the first output stands still at a limit, and the second one at an end of its way, but elsewhere."""
        if self.stage.output is None:
            return frozenset()
        a, b = self.one.output, self.two.output
        low, high = self.bench.limits
        bottom, top = min(b[self.first_sample :]), max(b[self.first_sample :])
        return frozenset(
            k
            for k in range(self.first_sample + REST_SAMPLES, len(a))
            if abs(a[k] - b[k]) > self.tolerance.limit
            and (
                (a[k] >= high - LIMIT_DISTANCE and b[k] >= top - LIMIT_DISTANCE)
                or (a[k] <= low + LIMIT_DISTANCE and b[k] <= bottom + LIMIT_DISTANCE)
            )
            and _is_at_rest(a, k)
            and _is_at_rest(b, k)
        )

    def _make_difference(
        self, signal: str, a: Sequence[float | State], b: Sequence[float | State], samples: tuple[int, ...]
    ) -> SignalDifference:
        k = samples[0]
        at = k * self.bench.sample - self.stage.begin
        return SignalDifference(self.stage.name, signal, at, a[k], b[k], samples)


def _distant_samples(
    a: Sequence[float], b: Sequence[float], part: range, allowed: float, shifts: Sequence[int]
) -> list[int]:
    """Where two signals lie apart in a part, the second one a sample earlier or later where that fits better."""

    def apart_by(shift: int) -> list[int]:
        return [
            k
            for k in part
            if not (abs(a[k] - b[k + shift]) if k + shift in part else distance_at(a, b, k, abs(shift))) <= allowed
        ]

    return max(map(apart_by, shifts), key=lambda ks: (ks[0] if ks else len(a), -len(ks)))


def _is_single_sample(k: int, samples: Collection[int], excess: float, allowed: float) -> bool:
    """Whether a difference of less than twice what is allowed lasts for one sample: a count at the edge of a limit."""
    return excess <= allowed and k - 1 not in samples and k + 1 not in samples


def _is_at_rest(output: Sequence[float], k: int) -> bool:
    """Whether an output has not moved for some samples."""
    near = output[k - REST_SAMPLES : k + 1]
    return max(near) - min(near) <= LIMIT_DISTANCE


D582 = Decision(
    582,
    "where a derivative makes much of a count, the means of the outputs are compared, too",
    "Between vendors without a report: where the PV goes its own way, the means of both outputs over 60 samples "
    "agree within 1 % of what the mean moves by and one count of the PV, as gain and filter carry it to the output "
    "and the derivative's share of it to the mean. Loops with a derivative also answer a change of the PV that takes "
    "4 derivative times.",
    "A count of the PV that comes a sample later kicks the output by gain x Td/Ts: a bound that allows for this let a "
    "Ti 20 % too long and a PV range 5 % too wide pass. A kick and the one back cancel each other in the mean.",
)
D306 = Decision(
    306,
    "two sides are alike when they agree within the response and the counts of the coarser one",
    "A PLC and its stand-in (D927) agree within 0.3 % of what a stage moves them by and two counts, where the PV "
    "follows the output within eight, and what these make of each other; a sample is a sample. Where a PV that goes "
    "its own way lies between two counts and is rounded up on one side alone, up to four times in a stage, the output "
    "of that sample and of the next is left out; where the PV follows the output, so is a single sample that is less "
    "than twice as far apart. A stage that differs is gone through "
    "once more with moves that are 1.3 % smaller: what is alike then was rounding at a limit or an edge, which the "
    "first moves met by chance. Where the edge of a dead band makes gain and derivative move the output by a tenth of "
    "its range and more, closed loops are compared up to the first such jump of one side alone. Two files of "
    "different vendors, of which no report says what differs, agree within 1 % and two counts of the coarser "
    "side, at least of 12 bits, and one side may be a sample late from one act to the next. Outputs that are held by "
    "their limits agree within two counts, set points within two counts, modes and alarms within 2 "
    "samples; alarms are compared where the PV goes its own way.",
    "A stand-in rounds where its PLC rounds: over 300 wild loops of five vendors what was left between both was "
    "single precision, and a count that one rounds up and the other down. Between PLCs a count of a PV moves the "
    "output by the gain, and a count of the output moves the PV by the plant's gain.",
)

# ----------------------------------------------------------------------------------------------------------------------
# Whether a loop does what its operator asks: one whose mode the program gives it shows nothing of the other modes.


def refused_mode(stage: Stage, trial: Trial, sample: float) -> str:
    """The first mode that a stage asks for and the loop does not go to before the next is asked; empty: none."""
    for mode, first, last in _wanted_modes(stage, sample):
        mode_here = mode if trial.has_cascade else CASCADE_SUBSTITUTES.get(mode, mode)
        if mode_here not in trial.modes[first:last]:
            return mode
    return ""


def _wanted_modes(stage: Stage, sample: float) -> Iterator[tuple[str, int, int]]:
    """The modes of a stage, each with the samples in which it is the one that is wanted."""
    acts = [(act.mode, round(act.at / sample)) for act in stage.acts if act.mode is not None]
    for (mode, first), (_, last) in pairwise([*acts, ("", round(stage.end / sample) + 1)]):
        if last > first:
            yield mode, first, last
