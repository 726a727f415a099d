"""The result of a batch as data: shares with their bounds, distributions, what mattered most, and the worst samples."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.certification.bound import lower_bound
from pidcfg.sim.metrics import METRICS
from pidcfg.sim.report import rounded

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.certification.fan import Fan
    from pidcfg.certification.histogram import Distribution
    from pidcfg.certification.sample import Batch
    from pidcfg.certification.tally import Tally, Worst
    from pidcfg.diagnostics import Diagnostic
    from pidcfg.document import Document
    from pidcfg.scenario.axes import Axes

QUANTILES = {"p5": 0.05, "p25": 0.25, "p50": 0.5, "p75": 0.75, "p95": 0.95, "p99": 0.99}
WHOLE = 100.0


@dataclass(frozen=True, slots=True)
class Share:
    """How many samples keep an expectation; shares are in %."""

    text: str
    held: int
    samples: int
    wanted: float | None = None
    """None: no sample may fail."""
    judged: int | None = None
    """Of a standing expectation: the samples in which it was judged."""

    @property
    def share(self) -> float:
        """Of these samples."""
        return rounded(WHOLE * self.held / self.samples)

    @property
    def bound(self) -> float:
        """What the share of all plants is at least, at 95 %."""
        return rounded(WHOLE * lower_bound(self.held, self.samples))

    @property
    def passed(self) -> bool:
        """Whether the bound reaches what is wanted."""
        if self.wanted is None:
            return self.held == self.samples
        return lower_bound(self.held, self.samples) >= self.wanted / WHOLE


@dataclass(frozen=True, slots=True)
class StandingShare(Share):
    """The same of a standing expectation."""

    kind: str = ""
    loop: str = ""


@dataclass(frozen=True, slots=True)
class Effect:
    """What an uncertainty does: the share of samples that pass where it is low, and where it is high; in %."""

    label: str
    text: str
    lowest: float | None
    highest: float | None
    """None: no sample lies there."""

    @property
    def size(self) -> float:
        """How far the two are apart."""
        return 0.0 if self.lowest is None or self.highest is None else abs(self.lowest - self.highest)


@dataclass(frozen=True, slots=True)
class WorstSample:
    """A sample near a limit, or beyond it."""

    sample: int
    margin: float | None
    """None: nothing that has a number holds or fails, or it could not run."""
    failed: bool
    expectation: str
    """Empty: a standing one, or it could not run."""
    numbers: Mapping[str, float]
    text: str
    """Its scenario, for `pidcfg simulate`."""


@dataclass(frozen=True, slots=True)
class Certification:
    """All that a batch of samples says."""

    scenario: str
    samples: int
    seed: int
    expectations: Sequence[Share]
    standing: Sequence[StandingShare]
    metrics: Mapping[str, Mapping[str, Mapping[str, float | int | None]]]
    """By loop and metric: ``count``, ``mean``, ``min``, ``max`` and quantiles."""
    effects: Sequence[Effect]
    worst: Sequence[WorstSample]
    all_passed: int
    """Samples in which everything holds."""
    failed_to_run: int
    reasons: Sequence[str]
    """Why the first of them could not run."""

    @property
    def passed(self) -> bool:
        """Whether every bound reaches what is wanted, and all samples ran."""
        return not self.failed_to_run and all(one.passed for one in (*self.expectations, *self.standing))


@dataclass(frozen=True, slots=True)
class Outcome:
    """One scenario file: its findings, and the certification when it could run."""

    file: str
    config: str = ""
    certification: Certification | None = None
    findings: Sequence[Diagnostic] = ()
    documents: Mapping[str, Document] = field(default_factory=dict)
    fan: Fan | None = None
    """How far signals spread, for a picture, where one is wanted."""
    axes: Mapping[str, Axes] = field(default_factory=dict)
    """Names and units of each loop's signals."""
    duration: float = 0.0
    """Of each run, in s."""
    unjudged: bool = False
    """The configuration has errors, and nothing is expected of the runs."""

    @property
    def passed(self) -> bool:
        """Whether it ran and all is shown that is wanted."""
        return self.certification is not None and self.certification.passed and not self.unjudged


@dataclass(frozen=True, slots=True)
class Names:
    """What the counts of a batch are about."""

    scenario: str
    expectations: Sequence[tuple[str, float | None]]
    """In words, with the share that is wanted in %."""
    standing: Sequence[tuple[str, str]]
    """Kind and loop."""
    loops: Sequence[str]


def certification(names: Names, batch: Batch, tally: Tally, keep: int) -> Certification:
    """What the counts say; ``keep``: how many of the worst samples."""
    lost = tally.failed_to_run
    standing = zip(names.standing, tally.standing_failed, tally.standing_judged, strict=True)
    effects = [
        Effect(what.label, what.text, _passed(low), _passed(high))
        for what, low, high in zip(batch.varies, tally.lowest, tally.highest, strict=True)
    ]
    return Certification(
        scenario=names.scenario,
        samples=tally.samples,
        seed=batch.seed,
        expectations=[
            Share(text, held, tally.samples, wanted)
            for (text, wanted), held in zip(names.expectations, tally.held, strict=True)
        ],
        standing=[
            StandingShare(
                f"{loop} {kind}".strip(), tally.samples - lost - failed, tally.samples, None, judged, kind, loop
            )
            for (kind, loop), failed, judged in standing
        ],
        metrics={
            loop: {name: _summary(one) for name, one in zip(METRICS, row, strict=True)}
            for loop, row in zip(names.loops, tally.metrics, strict=True)
        },
        effects=sorted(effects, key=lambda effect: -effect.size),
        worst=[_worst(one, names, batch) for one in tally.worst[:keep]],
        all_passed=tally.passed,
        failed_to_run=lost,
        reasons=list(tally.reasons),
    )


def _passed(counts: Sequence[int]) -> float | None:
    samples, passed = counts
    return rounded(WHOLE * passed / samples) if samples else None


def _summary(one: Distribution) -> dict[str, float | int | None]:
    if not one.count:
        return {"count": 0, "mean": None, "min": None, **dict.fromkeys(QUANTILES), "max": None}
    ends = {"min": one.low, "max": one.high}
    # An edge of a bin lies beyond all numbers where they end.
    found = {name: rounded(min(max(one.quantile(q), one.low), one.high)) for name, q in QUANTILES.items()}
    return {"count": one.count, "mean": rounded(one.mean), "min": ends["min"], **found, "max": ends["max"]}


def _worst(one: Worst, names: Names, batch: Batch) -> WorstSample:
    numbers = {what.label: rounded(number) for what, number in zip(batch.varies, one.numbers, strict=False)}
    finite = abs(one.margin) < float("inf")
    text = batch.text(one.sample, one.numbers) if len(one.numbers) == len(batch.varies) else ""
    about = names.expectations[one.expectation][0] if one.expectation >= 0 else ""
    return WorstSample(one.sample, rounded(one.margin) if finite else None, one.margin < 0, about, numbers, text)
