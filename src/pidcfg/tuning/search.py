"""The gains with the least error after a load, of those that stay below a maximum sensitivity on every plant.

Design. The answer is exact for a grid of gains and times, and fast for three reasons:

1. Ti/Kp, the integral of the error itself, is a lower bound of the integral of |error| on every plant. With the best
   gains so far, a pair with a larger bound is not looked at, and a run in time ends as soon as its bound passes them.
2. For each pair of times the gains that Ms allows are intervals, from roots at a list of frequencies (`allowed_gains`);
   a finer Ms is only worked out for gains that would be the best.
3. A few plants decide. The search runs on these; what it finds is tried on all, and the plant that it fails on most is
   added, until it fails on none. Fewer plants only allow more, so that what holds on all is the best of all.

Real numbers are grids that become finer around the best of the coarser one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, floor, inf
from typing import TYPE_CHECKING, Protocol

from pidcfg.tuning.allowed_gains import Curve, allowed
from pidcfg.tuning.load_response import absolute_error
from pidcfg.tuning.rules import Gains
from pidcfg.tuning.sampled import SampledLoop, held, sampled_margins

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.tuning.margins import Margins
    from pidcfg.tuning.rules import Process
    from pidcfg.tuning.sampled import Sampling

SPREAD, FEW = 16, 64
"""Every so many rows are searched first, where there are not few, for a good bound and the plants that decide."""
LOW = 0.5
"""Of the highest gain that two times allow: where Ms is too large from there up, the frequencies were too few."""
NEARLY = 0.98
"""Of an Ms at the frequencies of a list: it may still be the largest between them."""
EQUAL = 1e-9
"""Relative difference of numbers that count as equal."""


class Axis(Protocol):
    """Numbers that a gain or a time may have."""

    def between(self, low: float, high: float) -> Iterator[float]:
        """Those above ``low`` and up to ``high``, the largest first."""


@dataclass(frozen=True, slots=True)
class Words:
    """Multiples of a step."""

    step: float
    first: int
    last: int

    def between(self, low: float, high: float) -> Iterator[float]:
        """Those above ``low`` and up to ``high``, the largest first."""
        top = self.last if high == inf else min(self.last, floor(high / self.step * (1 + EQUAL)))
        for word in range(top, self.first - 1, -1):
            value = word * self.step
            if value <= low:
                return
            yield value

    def around(self, value: float, reach: float) -> Words:
        """Those within a ratio of a number."""
        first, last = floor(value / reach / self.step), ceil(value * reach / self.step)
        return Words(self.step, max(self.first, first), min(self.last, last))


@dataclass(frozen=True, slots=True)
class Ratios:
    """Numbers that grow by a ratio, from ``low`` to ``high``; the end of an interval is one of them."""

    ratio: float
    low: float
    high: float

    def between(self, low: float, high: float) -> Iterator[float]:
        """From ``high`` down, above ``low``."""
        value = min(high, self.high)
        while value > low and value >= self.low:
            yield value
            value /= self.ratio


@dataclass(frozen=True, slots=True)
class Result:
    """Gains, the largest error over all plants, and the largest Ms."""

    gains: Gains
    error: float
    ms: float
    worst_error: int
    """Index of the plant."""
    worst_ms: int


@dataclass(frozen=True, slots=True)
class Candidate:
    """Gains, and their largest error over the plants that decide."""

    gains: Gains
    error: float


class Search:
    """Plants, the loop around them, and the limit of Ms."""

    def __init__(self, plants: Sequence[Process], sampling: Sampling, ms: float, *, derivative: bool = False) -> None:
        self.plants, self.sampling, self.ms = plants, sampling, ms
        self.derivative = derivative
        self.curves = [
            Curve(held(plant, sampling.sample_time), sampling, ms, derivative=derivative) for plant in plants
        ]
        self.deciding = self.curves[:1]
        """Of the plants that have decided so far."""
        self.tried = 0
        """Gains whose run in time was looked at."""

    def begin(self, gains: Gains) -> None:
        """Finds the plants that decide for some gains, which are a first guess."""
        result = self.judged(gains)
        if result.error == inf:
            result = self.judged(replace(gains, gain=gains.gain / 2, integral_time=gains.integral_time * 2))
        self.deciding = [self.curves[i] for i in dict.fromkeys((0, result.worst_ms, result.worst_error))]

    def best(self, search: Callable[[], Candidate | None]) -> Result | None:
        """What a search among the plants that decide finds, when it holds on all; None: Ms allows nothing."""
        while True:
            found = search()
            if found is None:
                return None
            result = self.judged(found.gains)
            if not self._add_deciding(result, found):
                return result

    def among(
        self, gains: Axis, rows: Sequence[tuple[float, float]], known: Candidate | None = None
    ) -> Candidate | None:
        """The best for the plants that decide: a gain with one of the pairs of times, or what is known."""
        if len(rows) > FEW:
            known = self.among(gains, rows[::SPREAD], known)
            rows = self._not_too_long(rows, known)
        best, least = known, inf if known is None else known.error
        for integral, derivative in rows:
            if self._at_least(integral, derivative) >= least:
                continue
            for low, high in allowed(self.deciding, integral, derivative):
                for gain in gains.between(low, high):
                    if integral / gain >= least or (best is None and gain < LOW * high):
                        break
                    one = Gains(gain, integral, derivative)
                    if best is None and not self._is_robust(one):
                        continue
                    error = self._error(one, least)
                    if error < least and self._is_robust(one):
                        best, least = Candidate(one, error), error
        return best

    def judged(self, gains: Gains) -> Result:
        """Gains on all plants."""
        errors = [absolute_error(gains, curve.plant, self.sampling) for curve in self.curves]
        ms = [inf if error == inf else curve.sensitivity(gains, least=inf) for curve, error in self._with(errors)]
        near = max(ms) * NEARLY
        ms = [
            one if one < near or one == inf else curve.sensitivity(gains)
            for curve, one in zip(self.curves, ms, strict=True)
        ]
        error, highest = max(errors), max(ms)
        return Result(gains, error, highest, errors.index(error), ms.index(highest))

    def _with(self, errors: Sequence[float]) -> Iterator[tuple[Curve, float]]:
        return zip(self.curves, errors, strict=True)

    def margins(self, gains: Gains, plant: int) -> Margins:
        """Of the sampled loop on one plant."""
        return sampled_margins(SampledLoop(gains, self.curves[plant].plant, self.sampling))

    def _add_deciding(self, result: Result, found: Candidate) -> bool:
        """Adds the plants that show that gains are not good enough; whether there are any."""
        failing = []
        if result.ms > self.ms:
            failing.append(self.curves[result.worst_ms])
        if result.error > found.error * (1 + EQUAL):
            failing.append(self.curves[result.worst_error])
        added = [curve for curve in dict.fromkeys(failing) if curve not in self.deciding]
        self.deciding = [*self.deciding, *added]
        return bool(added)

    def _not_too_long(
        self, rows: Sequence[tuple[float, float]], known: Candidate | None
    ) -> Sequence[tuple[float, float]]:
        """Without the integral times that are too long whatever the gain is: Ti/Kp is then larger than the error."""
        if known is None or self.derivative:
            return rows
        most = min(curve.most_from(known.error) for curve in self.deciding)
        return [row for row in rows if row[0] < most * known.error]

    def _at_least(self, integral: float, derivative: float) -> float:
        """A lower bound of the error with these times."""
        most = min(curve.at_most(integral, derivative) for curve in self.deciding)
        return 0.0 if most == inf else integral / most

    def _error(self, gains: Gains, least: float) -> float:
        """The largest of the plants that decide; infinite: not below ``least``."""
        self.tried += 1
        largest = 0.0
        for curve in reversed(self.deciding):
            largest = max(largest, absolute_error(gains, curve.plant, self.sampling, least))
            if largest >= least:
                self.deciding.remove(curve)
                self.deciding.append(curve)
                return inf
        return largest

    def _is_robust(self, gains: Gains) -> bool:
        """Whether Ms holds on the plants that decide."""
        return all(curve.sensitivity(gains, least=NEARLY * self.ms) <= self.ms for curve in self.deciding)
