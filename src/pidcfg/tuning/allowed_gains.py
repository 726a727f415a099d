"""Which gains keep a sampled loop out of the circle of a maximum sensitivity, for given integral and derivative times.

At each frequency the open loop is a gain k times a number g. k g lies within the circle of radius 1/Ms around -1 for
the k between two roots of |g|² k² + 2 Re(g) k + 1 - 1/Ms² = 0. Where g has a phase of -180° or beyond, larger ones are
out too: they would go round -1. What is left at the frequencies of a list may be too much, never too little.
"""

from __future__ import annotations

from cmath import exp as turn
from math import inf, sqrt
from typing import TYPE_CHECKING

from pidcfg.tuning.margins import peak
from pidcfg.tuning.sampled import SampledLoop, difference, filtered, frequencies

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.tuning.rules import Gains
    from pidcfg.tuning.sampled import Held, Sampling

Interval = tuple[float, float]


class Curve:
    """The part of the open loop that no gain changes, at a list of frequencies, and where it last was in the way."""

    def __init__(self, plant: Held, sampling: Sampling, ms: float, *, derivative: bool = True) -> None:
        self.plant, self.sampling, self.ms = plant, sampling, ms
        self.upper_at: int | None = None
        """Index of the frequency that allows the least gain, of the times before."""
        self.inner_at: int | None = None
        """The same of those in front of -180°."""
        near, beyond = frequencies(plant)
        self.end = None if beyond else len(near) - 1
        """Index of half the sample frequency: there the loop is a real number, and below 0 it has turned."""
        rows = [self._row(w) for w in near]
        if not derivative:
            kept = self._heard([row[0] for row in rows])
            near, rows, beyond = near[:kept], rows[:kept], beyond if kept == len(rows) else []
        self.near = near
        self.plant_at, self.integral_at, self.back_at = (list(column) for column in zip(*rows, strict=True))
        self.beyond = [self._row(w) for w in beyond]

    def _heard(self, plant_at: Sequence[complex]) -> int:
        """How many frequencies matter without a derivative.

        PI turns the loop back, and the less it amplifies the higher the frequency. So a stable loop is below 1 where
        the process alone has -180°, and from where the process is quieter by 1 - 1/Ms on it is out of the circle.
        """
        turned = next((abs(h) for i, h in enumerate(plant_at) if self._is_turned(i, h)), inf)
        loud = [i for i, h in enumerate(plant_at) if abs(h) >= (1 - 1 / self.ms) * turned]
        return len(plant_at) if turned == inf else min(len(plant_at), max(loud) + 2)

    def _is_turned(self, i: int, g: complex) -> bool:
        """Whether -180° is reached, with less than another half turn: a larger gain goes round -1."""
        return g.real < 0 and (g.imag >= 0 or i == self.end)

    def _row(self, w: float) -> tuple[complex, complex, complex]:
        """Process, integral over 1/Ti, and 1/z at a frequency."""
        time = self.sampling.sample_time
        z = turn(complex(0, w * time))
        return filtered(self.plant, self.sampling, z), time / (1 - 1 / z), 1 / z

    def sensitivity(self, gains: Gains, *, least: float = 0.0) -> float:
        """Ms; only as close as the frequencies are where it is below ``least``."""
        gain, derivative = gains.gain, gains.derivative_time
        distances = [abs(1 + gain * g) for g in self._all(gains.integral_time, derivative)]
        highest = 1 / min(distances)
        if highest >= least:
            loop = SampledLoop(gains, self.plant, self.sampling)
            nearest = distances.index(min(distances))
            around = self.near[max(0, nearest - 1) : nearest + 2]
            highest = max(highest, peak(loop, around, [loop(w) for w in around]))
        loudest = max((gain * abs(self._times(row, gains.integral_time, derivative)) for row in self.beyond), default=0)
        return inf if loudest >= 1 else max(highest, 1 / (1 - loudest), 1.0)

    def _times(self, row: tuple[complex, complex, complex], integral_time: float, derivative_time: float) -> complex:
        """The open loop of a gain of 1 at a frequency."""
        h, integral, back = row
        value = 1 + integral / integral_time
        if derivative_time:
            value += derivative_time * difference(back, self.sampling, derivative_time)
        return h * value

    def at(self, i: int, integral_time: float, derivative_time: float) -> complex:
        """The open loop of a gain of 1 at a frequency of the list."""
        return self._times((self.plant_at[i], self.integral_at[i], self.back_at[i]), integral_time, derivative_time)

    def _all(self, integral_time: float, derivative_time: float) -> list[complex]:
        """The open loop of a gain of 1 at all frequencies of the list."""
        if derivative_time:
            return [self.at(i, integral_time, derivative_time) for i in range(len(self.near))]
        share = 1 / integral_time
        return [h * (1 + i * share) for h, i in zip(self.plant_at, self.integral_at, strict=True)]

    def at_most(self, integral_time: float, derivative_time: float) -> float:
        """A bound of the gain from the frequencies that were in the way before; infinite: nothing is known."""
        most = self._still_turned(integral_time, derivative_time)
        if self.inner_at is not None and most < inf:
            g = self.at(self.inner_at, integral_time, derivative_time)
            low, high = roots(g, self.ms)
            if low < most <= high or g.imag >= 0:
                most = min(low, most)
        return most

    def _still_turned(self, integral_time: float, derivative_time: float) -> float:
        """The gain that the first frequency with -180° or beyond allows, from the one that was in the way before.

        With other times that one may be in front of -180°, where gains beyond the circle are allowed again.
        """
        for i in range(len(self.near) if self.upper_at is None else self.upper_at, len(self.near)):
            g = self.at(i, integral_time, derivative_time)
            if self._is_turned(i, g):
                self.upper_at = i
                return roots(g, self.ms)[0]
        return inf

    def most_from(self, error: float) -> float:
        """A bound M of the gain with every integral time above M times an error, without a derivative.

        At a frequency g goes straight to the process's own h as the time grows, and the g that allow no more than some
        gain are a convex set: no g between allows more than both ends do.
        """
        i = next((i for i, h in enumerate(self.plant_at) if self._is_turned(i, h)), None)
        if i is None:
            return inf
        last = roots(self.plant_at[i], self.ms)[0]
        return inf if last == inf else max(last, roots(self.at(i, last * error, 0.0), self.ms)[0])

    def forbidden(self, integral_time: float, derivative_time: float) -> tuple[float, list[Interval]]:
        """The gain from which on none is allowed, and the intervals below it that are not."""
        most, inner = inf, list[tuple[float, float, int]]()
        self.upper_at = None
        for i, g in enumerate(self._all(integral_time, derivative_time)):
            if g.real >= 0:
                continue
            low, high = roots(g, self.ms)
            if low == inf:
                continue
            if not self._is_turned(i, g):
                inner.append((low, high, i))
            elif low < most:
                most, self.upper_at = low, i
        for row in self.beyond:
            most = min(most, (1 - 1 / self.ms) / abs(self._times(row, integral_time, derivative_time)))
        last = min((row for row in inner if row[1] >= most), default=None)
        self.inner_at = None if last is None else last[2]
        return most, [(low, high) for low, high, _ in inner if low < most]


def roots(g: complex, ms: float) -> Interval:
    """The gains between which k g lies in the circle; infinite: it never does."""
    square, along = g.real * g.real + g.imag * g.imag, g.real
    inner = along * along - square * (1 - 1 / ms**2)
    if along >= 0 or inner <= 0:
        return inf, inf
    root = sqrt(inner)
    return (-along - root) / square, (root - along) / square


def allowed(curves: Sequence[Curve], integral_time: float, derivative_time: float) -> list[Interval]:
    """The intervals of gains that no curve forbids at its frequencies, the highest first."""
    most, inner = inf, list[Interval]()
    for curve in curves:
        bound, intervals = curve.forbidden(integral_time, derivative_time)
        most = min(most, bound)
        inner += intervals
    left, low = [], 0.0
    for begin, end in sorted(inner):
        if begin >= most:
            break
        if begin > low:
            left.append((low, begin))
        low = max(low, end)
    if low < most:
        left.append((low, most))
    return left[::-1]
