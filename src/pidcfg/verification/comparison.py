"""Two trials of one stage held against each other, signal by signal, sample by sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.verification.bench import Bench
    from pidcfg.verification.stages import Stage
    from pidcfg.verification.trial import Trial

State = str | bool
"""A mode, or an alarm."""
SHARE = 0.01
"""Of the response of a stage, by which both sides may differ."""
COUNTS = 2.0
"""Of the coarser side."""
SAMPLES = 2
"""By which modes, alarms and set points may come apart."""
SHIFT = 1
"""By which PV and output may: a PLC may let a change act with the sample or with the next one."""


IN_AUTO = {"cascade": "auto"}
"""What a loop's mode is in a PLC that has no mode for cascade."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far both sides of a loop may lie apart."""

    share: float
    pv: float
    """PV units, as the next one."""
    setpoint: float
    output: float
    """A share of the range."""
    switching: float = 0.0
    """What a dead band switches the output by, when an error is just inside on one side and just outside on the other:
    a share of the range."""


@dataclass(frozen=True, slots=True)
class Difference:
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


def differences(stage: Stage, one: Trial, two: Trial, bench: Bench, tolerance: Tolerance) -> Iterator[Difference]:
    """Where two trials of a stage differ by more than they may, each signal once."""
    compare = _Comparison(stage, bench)
    if stage.output is None and abs(one.period - two.period) > SHARE * one.period:
        yield Difference(stage.name, "sample time", 0.0, one.period, two.period, (0,))
    switching = 0.0 if stage.name.startswith("dead band") else tolerance.switching
    if "pv" in stage.signals:
        yield from compare.numbers("pv", one.pv, two.pv, tolerance.share, tolerance.pv)
    if "output" in stage.signals:
        yield from compare.numbers("output", one.output, two.output, tolerance.share, tolerance.output + switching)
    if "setpoint" in stage.signals and not _by_hand(stage, one, two):
        yield from compare.numbers("setpoint", one.setpoint, two.setpoint, 0.0, tolerance.setpoint)
    if "mode" in stage.signals:
        modes = [side.modes for side in (one, two)]
        if not (one.cascades and two.cascades):
            modes = [[IN_AUTO.get(mode, mode) for mode in side] for side in modes]
        yield from compare.states("mode", *modes)
    if "alarms" in stage.signals:
        for name in sorted(one.alarms.keys() & two.alarms.keys()):
            yield from compare.states(name, one.alarms[name], two.alarms[name])


def _by_hand(stage: Stage, one: Trial, two: Trial) -> bool:
    """Whether a loop begins in Manual, where some PLCs get their set point with the change to Auto only."""
    return stage.output is None and "manual" in {one.modes[-1], two.modes[-1]}


@dataclass(frozen=True, slots=True)
class _Comparison:
    stage: Stage
    bench: Bench

    def numbers(
        self, signal: str, a: Sequence[float], b: Sequence[float], share: float, counts: float
    ) -> Iterator[Difference]:
        """A signal that is a number."""
        first = round(self.stage.begin / self.bench.sample)
        allowed = share * (max(a[first:]) - min(a[first:])) + counts
        window = (SHIFT if share else SAMPLES) + self.stage.slack
        samples = tuple(k for k in range(first, len(a)) if not apart(a, b, k, window) <= allowed)
        if samples:
            span = 1.0 if signal == "output" else self.bench.span
            worst = max(abs(a[k] - b[k]) for k in samples) / span
            yield self._difference(signal, a, b, samples, worst, allowed)

    def states(self, signal: str, a: Sequence[str | bool], b: Sequence[str | bool]) -> Iterator[Difference]:
        """A signal that is a mode or an alarm."""
        first, window = round(self.stage.begin / self.bench.sample), SAMPLES + self.stage.slack
        samples = tuple(
            k
            for k in range(first, len(a))
            if a[k] != b[k] and not (_near(a, k, b[k], window) or _near(b, k, a[k], window))
        )
        if samples:
            yield self._difference(signal, a, b, samples)

    def _difference(
        self,
        signal: str,
        a: Sequence[float | str | bool],
        b: Sequence[float | str | bool],
        samples: tuple[int, ...],
        worst: float | None = None,
        allowed: float = 0.0,
    ) -> Difference:
        k = samples[0]
        at = k * self.bench.sample - self.stage.begin
        return Difference(self.stage.name, signal, at, a[k], b[k], samples, worst, allowed)


def apart(a: Sequence[float], b: Sequence[float], k: int, window: int) -> float:
    """How far two signals lie apart at a sample, where each may come ``window`` samples earlier or later."""
    if a[k] == b[k]:
        return 0.0
    return min(_outside(a, k, b[k], window), _outside(b, k, a[k], window))


def _outside(values: Sequence[float], k: int, value: float, window: int) -> float:
    """How far a value is outside of what a signal shows in the samples around."""
    near = values[max(k - window, 0) : k + window + 1]
    return max(value - max(near), min(near) - value, 0.0)


def _near(states: Sequence[State], k: int, state: State, window: int) -> bool:
    return state in states[max(k - window, 0) : k + window + 1]


D306 = Decision(
    306,
    "two sides are alike when they agree within the response and the counts of the coarser one",
    "PV and output agree within 1 % of what the stage moves them by and two counts of the coarser side, at least of 12 "
    "bits, each also as the loop and the plant carry it to the other, a sample earlier or later; set points within two "
    "counts; modes and alarms within 2 samples.",
    "A count of a PV moves the output by the gain, and a count of the output moves the PV by the plant's gain.",
)
