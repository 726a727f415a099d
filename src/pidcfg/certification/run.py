"""One sample through the ordinary simulation, and what a batch keeps of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any

from pidcfg.certification.sample import Batch, UnusableSampleError
from pidcfg.sim.metrics import METRICS
from pidcfg.sim.run import UnusableError, simulate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.scenario.load import Loaded
    from pidcfg.schemas.scenario import Expectation
    from pidcfg.schemas.scenario_fields import Bound
    from pidcfg.sim.report import Report, Verdict
    from pidcfg.sim.run import Settings


@dataclass(frozen=True, slots=True)
class Seen:
    """What a batch keeps of a sample; it travels between processes."""

    sample: int
    numbers: tuple[float, ...] = ()
    """As drawn, in the order of the uncertainties."""
    passed: bool = False
    held: tuple[bool, ...] = ()
    """Of each expectation."""
    margin: float = inf
    """The smallest (limit − value) / |limit| of all expectations."""
    tightest: int = -1
    """The expectation that has it."""
    standing: str = ""
    """Of each standing expectation: ``+`` holds, ``-`` fails, ``a`` is allowed to, ``?`` is not judged."""
    metrics: tuple[tuple[float | None, ...], ...] = ()
    """Of each loop, in the order of `METRICS`."""
    reason: str = ""
    """Why it could not run, or had an error on its way."""


def run_sample(loaded: Loaded, batch: Batch, sample: int, settings: Settings) -> tuple[Seen, Report | None]:
    """Runs a sample exactly as `pidcfg simulate` runs its written-out scenario."""
    numbers: Sequence[float] = ()
    try:
        numbers = batch.numbers(sample)
        scenario = batch.scenario(sample, numbers)
        report = simulate(scenario, partial(batch.new_plc, loaded), loaded.controller, settings)
    except (UnusableSampleError, UnusableError) as error:
        return Seen(sample, tuple(numbers), margin=-inf, reason=str(error)), None
    errors = [note.text for note in report.notes if note.error]
    errors += [problem.message for problem in report.problems if problem.severity == "error"]
    margins = [margin(wanted, v) for wanted, v in zip(scenario.expect, report.expectations, strict=True)]
    if errors or any(v.fails for v in report.standing):
        margins.append(-inf)
    least = min(margins, default=inf)
    tightest = margins.index(least) if margins else -1
    return (
        Seen(
            sample,
            tuple(numbers),
            passed=report.passed,
            held=tuple(v.passed for v in report.expectations),
            margin=least,
            tightest=tightest if tightest < len(scenario.expect) else -1,
            standing="".join(_sign(v) for v in report.standing),
            metrics=tuple(tuple(loop.metrics.get(name) for name in METRICS) for loop in report.loops.values()),
            reason="; ".join(errors),
        ),
        report,
    )


def _sign(verdict: Any) -> str:
    return {"passed": "+", "FAILED": "-", "allowed": "a", "not judged": "?"}[verdict.word]


def margin(wanted: Expectation, verdict: Verdict) -> float:
    """How far a value lies within its limits, as a share of the limit; of 0 in its unit.

    What has no number is at an end: infinite where it holds.
    """
    value, bounds = verdict.value, (wanted.min, wanted.max)
    if wanted.alarm is not None or wanted.flag is not None or wanted.mode is not None or value is None:
        return inf if verdict.passed else -inf
    values = value if isinstance(value, list) else [value, value]
    if not all(type(one) in {int, float} for one in values):
        return inf if verdict.passed else -inf
    if wanted.final is not None and wanted.tolerance is not None and bounds == (None, None):
        return _share(wanted.tolerance, abs(float(values[0]) - float(wanted.final)), 1)
    if wanted.final is not None and not verdict.passed:
        return -inf
    shares = [_share(bound, one, sign) for bound, one, sign in zip(bounds, values, (-1, 1), strict=True) if bound]
    return min(shares, default=inf if verdict.passed else -inf)


def _share(bound: Bound, value: float, sign: int) -> float:
    """How far a value lies below (``sign`` −1: above) a bound, as a share of it."""
    limit = float(bound.value)
    return sign * (limit - value) / (abs(limit) or 1.0)
