"""A first-order process with dead time from a recorded step: time, output and PV.

Design. The step is the largest change of the output, which must be constant on both sides of it. The PV must be at rest
before it and settled at the end, and its answer must stand out of its noise. Then gain, time constant and dead time are
those of the least squares: the gain is linear and follows from the other two, which a simplex search finds.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import exp, sqrt
from statistics import fmean
from typing import TYPE_CHECKING

from pidcfg.tuning.rules import Process

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

LEAST_BEFORE, LEAST_AFTER = 3, 12
"""Samples before and after the step that are needed at least."""
CONSTANT = 0.05
"""How far the output may stray from its two levels, in steps."""
SETTLED = 0.03
"""How far the last two tenths of the answer may differ, in answers."""
ABOVE_NOISE = 5.0
"""How many standard deviations of noise an answer must have."""
POINTS = 400
"""Points that the search looks at; longer records are averaged."""
ROUNDS = 200
SECOND_DIFFERENCE = 6.0
"""Variance of y(n) - 2 y(n-1) + y(n-2) of white noise, in variances of the noise."""


class RecordError(ValueError):
    """A record that tells no process: what is wrong, and what to record instead."""

    def __init__(self, message: str, cure: str, row: int | None = None) -> None:
        super().__init__(message)
        self.cure = cure
        self.row = row
        """Index of the sample that shows it."""


@dataclass(frozen=True, slots=True)
class Record:
    """Samples of one test."""

    time: Sequence[float]
    output: Sequence[float]
    pv: Sequence[float]


@dataclass(frozen=True, slots=True)
class Identified:
    """What was identified: the process, when the step came, the PV before it, and how well it fits."""

    process: Process
    at: float
    base: float
    step: float
    noise: float
    misfit: float
    """Standard deviation of what is left, in answers."""

    def value(self, time: float) -> float:
        """The PV of the identified process."""
        past = time - self.at - self.process.dead_time
        if past <= 0:
            return self.base
        return self.base + self.process.gain * self.step * (1 - exp(-past / self.process.time_constant))


def identify(record: Record) -> Identified:
    """The process of a record; raises `RecordError`."""
    k = _step_at(record.output)
    low, high = fmean(record.output[:k]), fmean(record.output[k:])
    step = high - low
    stray = max((abs(u - (low if i < k else high)), i) for i, u in enumerate(record.output))
    if stray[0] > CONSTANT * abs(step):
        raise RecordError("the output is no single step", "hold it constant before and after one step", stray[1])
    if k < LEAST_BEFORE or len(record.output) - k < LEAST_AFTER:
        raise RecordError(
            f"the step has {k} samples before and {len(record.output) - k} after it",
            f"record at least {LEAST_BEFORE} before and {LEAST_AFTER} after",
        )
    noise, base = _noise(record.pv), fmean(record.pv[:k])
    _check_answer(record.pv, k, base, noise)
    at = record.time[k]
    times, values = _averaged([t - at for t in record.time[k:]], [y - base for y in record.pv[k:]])
    dead, constant, rise, left = _search(times, values)
    return Identified(Process(rise / step, constant, dead), at, base, step, noise, left / abs(rise))


def _step_at(output: Sequence[float]) -> int:
    """The first sample with the new output."""
    changes = [abs(b - a) for a, b in pairwise(output)]
    if not changes or max(changes) == 0:
        raise RecordError("the output never changes", "record a step of the output in manual mode")
    return changes.index(max(changes)) + 1


def _noise(pv: Sequence[float]) -> float:
    """The standard deviation of the noise, from second differences, which a slow answer hardly has."""
    seconds = [c - 2 * b + a for a, b, c in zip(pv, pv[1:], pv[2:], strict=False)]
    middle = sorted(abs(d) for d in seconds)[len(seconds) // 2] / 0.6745
    return middle / sqrt(SECOND_DIFFERENCE)


def _check_answer(pv: Sequence[float], k: int, base: float, noise: float) -> None:
    """At rest before the step, settled at the end, and more than noise."""
    tenth = max(2, (len(pv) - k) // 10)
    last, earlier = fmean(pv[-tenth:]), fmean(pv[-2 * tenth : -tenth])
    answer = last - base
    if abs(answer) <= ABOVE_NOISE * noise or answer == 0:
        raise RecordError(
            f"the PV answers by {abs(answer):.4g}, with noise of {noise:.4g}", "take a larger step, or filter the PV"
        )
    margin = 2 * noise / sqrt(tenth)
    if abs(last - earlier) > SETTLED * abs(answer) + margin:
        raise RecordError(
            f"the PV has not settled: of {abs(answer):.4g}, {abs(last - earlier):.4g} came in the last tenth",
            "record until it is at rest; a process that never comes to rest is an integrator",
            len(pv) - 1,
        )
    half = max(1, k // 2)
    drift = abs(fmean(pv[k - half : k]) - fmean(pv[:half]))
    if drift > SETTLED * abs(answer) + 2 * noise / sqrt(half):
        raise RecordError(
            f"the PV was not at rest before the step: it moved by {drift:.4g}", "wait until it is at rest, then step", 0
        )


def _averaged(times: Sequence[float], values: Sequence[float]) -> tuple[list[float], list[float]]:
    """At most `POINTS` points, each the mean of its neighbours."""
    width = -(-len(times) // POINTS)
    groups = range(0, len(times), width)
    return [fmean(times[i : i + width]) for i in groups], [fmean(values[i : i + width]) for i in groups]


def _search(times: Sequence[float], values: Sequence[float]) -> tuple[float, float, float, float]:
    """Dead time, time constant, final rise, and the standard deviation of what is left."""
    final = fmean(values[-max(1, len(values) // 10) :])
    first = next((t for t, y in zip(times, values, strict=True) if y / final >= 0.28), times[-1])
    second = next((t for t, y in zip(times, values, strict=True) if y / final >= 0.63), times[-1])
    constant = max(1.5 * (second - first), times[-1] / len(times) / 10, 1e-9)

    def left(point: Sequence[float]) -> float:
        return _least_squares(times, values, abs(point[0]), abs(point[1]))[1]

    dead, constant = (abs(x) for x in _simplex(left, (max(second - constant, 0.0), constant)))
    rise, squares = _least_squares(times, values, dead, constant)
    return dead, constant, rise, sqrt(squares / len(times))


def _least_squares(
    times: Sequence[float], values: Sequence[float], dead: float, constant: float
) -> tuple[float, float]:
    """The best final rise for a dead time and time constant, and the sum of squares that it leaves."""
    if constant <= 0:
        return 0.0, sum(y * y for y in values)
    shape = [1 - exp(-(t - dead) / constant) if t > dead else 0.0 for t in times]
    norm = sum(s * s for s in shape)
    rise = sum(s * y for s, y in zip(shape, values, strict=True)) / norm if norm else 0.0
    return rise, sum((y - rise * s) ** 2 for s, y in zip(shape, values, strict=True))


def _simplex(cost: Callable[[Sequence[float]], float], start: tuple[float, float]) -> tuple[float, float]:
    """Nelder and Mead's search in two dimensions."""
    scale = max(abs(start[1]), 1e-6)
    corners = [start, (start[0] + 0.3 * scale, start[1]), (start[0], 1.3 * start[1] + 1e-9)]
    ranked = sorted((cost(c), c) for c in corners)
    for _ in range(ROUNDS):
        (best, a), (middle, b), (worst, c) = ranked
        centre = (a[0] + b[0]) / 2, (a[1] + b[1]) / 2
        at = [(centre[0] + f * (c[0] - centre[0]), centre[1] + f * (c[1] - centre[1])) for f in (-1.0, -2.0, 0.5)]
        tried = (cost(at[0]), at[0])
        if tried[0] < best:
            tried = min(tried, (cost(at[1]), at[1]))
        elif tried[0] >= middle:
            tried = min(tried, (cost(at[2]), at[2]))
        if tried[0] < worst:
            ranked = sorted([(best, a), (middle, b), tried])
        else:
            shrunk = [((p[0] + a[0]) / 2, (p[1] + a[1]) / 2) for p in (b, c)]
            ranked = sorted([(best, a), *((cost(p), p) for p in shrunk)])
    return ranked[0][1]
