"""What a batch has found so far: counts, distributions and the worst samples, added up in the order of the samples."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

from pidcfg.certification.draw import fifths
from pidcfg.certification.histogram import BLOCK, Distribution
from pidcfg.sim.metrics import METRICS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.certification.run import Seen
    from pidcfg.scenario.vary import Uncertainty

Sizes = tuple[int, int, int, int]
"""How many expectations, standing ones, loops and uncertainties are counted."""
MOST_WORST = 100
"""Worst samples that are kept."""
MOST_REASONS = 5
"""Samples that could not run whose reasons are told."""


@dataclass(slots=True)
class Worst:
    """A sample that came near a limit, or beyond it."""

    sample: int
    margin: float
    """(limit − value) / |limit|, the smallest of all expectations; infinite where nothing has a number."""
    expectation: int
    """Which of them; −1: a standing one, or the sample could not run."""
    numbers: list[float]


@dataclass(slots=True)
class Tally:
    """Everything that is known after so many samples; its state is what `--resume` keeps."""

    first: int = 0
    """The number of its first sample: 0, or that of a block which another one counts."""
    samples: int = 0
    passed: int = 0
    """Samples in which everything holds."""
    failed_to_run: int = 0
    held: list[int] = field(default_factory=list)
    """Of each expectation, in how many samples."""
    standing_failed: list[int] = field(default_factory=list)
    standing_judged: list[int] = field(default_factory=list)
    metrics: list[list[Distribution]] = field(default_factory=list)
    """Of each loop each metric."""
    lowest: list[list[int]] = field(default_factory=list)
    """Of each uncertainty: samples in its lowest fifth, and how many of these passed; likewise ``highest``."""
    highest: list[list[int]] = field(default_factory=list)
    worst: list[Worst] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)

    @classmethod
    def empty(cls, sizes: Sizes, first: int = 0) -> Tally:
        """Before the first sample."""
        expectations, standing, loops, varies = sizes
        return cls(
            first,
            held=[0] * expectations,
            standing_failed=[0] * standing,
            standing_judged=[0] * standing,
            metrics=[[Distribution() for _ in METRICS] for _ in range(loops)],
            lowest=[[0, 0] for _ in range(varies)],
            highest=[[0, 0] for _ in range(varies)],
        )

    def add(self, seen: Seen, varies: Sequence[Uncertainty]) -> None:
        """The next sample."""
        if seen.sample != self.end:
            raise ValueError(f"sample {seen.sample} comes after {self.end} samples")
        self.samples += 1
        self.passed += seen.passed
        if seen.reason:
            self.failed_to_run += 1
            if len(self.reasons) < MOST_REASONS:
                self.reasons.append(f"sample {seen.sample}: {seen.reason}")
        else:
            self._count(seen)
        self._compare(seen, varies)
        self._keep(seen)
        if self.end % BLOCK == 0:
            for distributions in self.metrics:
                for distribution in distributions:
                    distribution.end_block()

    @property
    def end(self) -> int:
        """The number of the next sample."""
        return self.first + self.samples

    def append(self, block: Tally) -> None:
        """The next samples as others have counted them, from the beginning of a block to its end at most."""
        if block.first != self.end or block.first % BLOCK or block.samples > BLOCK:
            raise ValueError(f"{block.samples} samples from {block.first} come after {self.end} samples")
        self.samples += block.samples
        self.passed += block.passed
        self.failed_to_run += block.failed_to_run
        self.held = _sums(self.held, block.held)
        self.standing_failed = _sums(self.standing_failed, block.standing_failed)
        self.standing_judged = _sums(self.standing_judged, block.standing_judged)
        self.lowest = [_sums(*pair) for pair in zip(self.lowest, block.lowest, strict=True)]
        self.highest = [_sums(*pair) for pair in zip(self.highest, block.highest, strict=True)]
        for row, of_block in zip(self.metrics, block.metrics, strict=True):
            for distribution, other in zip(row, of_block, strict=True):
                distribution.append(other)
        self.reasons = [*self.reasons, *block.reasons][:MOST_REASONS]
        self.worst = sorted([*self.worst, *block.worst], key=_badness)[:MOST_WORST]

    def _count(self, seen: Seen) -> None:
        """Verdicts and metrics of a sample that ran."""
        for i, held in enumerate(seen.held):
            self.held[i] += held
        for i, sign in enumerate(seen.standing):
            self.standing_failed[i] += sign == "-"
            self.standing_judged[i] += sign != "?"
        for loop, values in zip(self.metrics, seen.metrics, strict=True):
            for distribution, value in zip(loop, values, strict=True):
                if value is not None and isfinite(value):
                    distribution.add(value)

    def _compare(self, seen: Seen, varies: Sequence[Uncertainty]) -> None:
        """In which fifth each number lies, and whether the sample passed."""
        for i, (what, number) in enumerate(zip(varies, seen.numbers, strict=False)):
            low, high = fifths(what.ends)
            for counts in [self.lowest[i]] * (number < low) + [self.highest[i]] * (number >= high):
                counts[0] += 1
                counts[1] += seen.passed

    def _keep(self, seen: Seen) -> None:
        """The worst so far; of two alike the earlier one is worse."""
        self.worst.append(Worst(seen.sample, seen.margin, seen.tightest, list(seen.numbers)))
        self.worst.sort(key=_badness)
        del self.worst[MOST_WORST:]

    def state(self) -> dict[str, Any]:
        """As JSON, from which `of_state` makes the same again."""
        state = asdict(self)
        state["metrics"] = [[d.state() for d in loop] for loop in self.metrics]
        state["worst"] = [[w.sample, _text(w.margin), w.expectation, w.numbers] for w in self.worst]
        return state

    @classmethod
    def of_state(cls, state: dict[str, Any]) -> Tally:
        """What `state` has given."""
        tally = cls(**state)
        tally.metrics = [[Distribution.of_state(d) for d in loop] for loop in state["metrics"]]
        tally.worst = [Worst(sample, float(margin), i, numbers) for sample, margin, i, numbers in state["worst"]]
        return tally


def _badness(one: Worst) -> tuple[float, int]:
    """The least is the worst."""
    return one.margin, one.sample


def _sums(ours: Sequence[int], others: Sequence[int]) -> list[int]:
    return [a + b for a, b in zip(ours, others, strict=True)]


def _text(margin: float) -> str:
    """A margin as JSON can hold it."""
    return repr(margin) if isfinite(margin) else "inf" if margin == inf else "-inf"


def json_of(state: dict[str, Any]) -> str:
    """A state as text: the same state, the same text."""
    return json.dumps(state, sort_keys=True, separators=(",", ":"), allow_nan=False)
