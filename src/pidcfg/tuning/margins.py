"""How robust a loop is: maximum sensitivity, gain margin and phase margin of a controller on a process.

The loop is L = Kp (1 + 1/(Ti s) + Td s) G(s): the dependent form without a filter, as the rules have it, in continuous
time; a sample time counts as half of it in dead time.
"""

from __future__ import annotations

from bisect import bisect_left
from cmath import exp, phase
from dataclasses import dataclass
from itertools import pairwise
from math import degrees, inf, isinf, log10, pi
from typing import TYPE_CHECKING

from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.tuning.rules import Gains
    from pidcfg.tuning.transfer import Transfer

    OpenLoop = Callable[[float], complex]
    """The open loop by the frequency in rad/s."""

D708 = Decision(
    708,
    "margins are those of the continuous loop",
    "Ms is the largest 1/|1 + L|, the gain margin the smallest 1/|L| where L crosses the negative real axis inside the "
    "unit circle, the phase margin the smallest distance to -180° where |L| is 1. No derivative filter, half the "
    "sample time as dead time. An unstable loop has none of them.",
    "Åström and Hägglund, Advanced PID Control (2006), 4.6; the registers' rounding and a PLC's filter come later, and "
    "`simulate` has them.",
)

DECADES_BELOW, DECADES_ABOVE, PER_DECADE = 5, 3, 120
"""Of the frequencies that are looked at, around the inverse of the slowest and of the fastest time."""
TURNS, PER_RADIAN = 60.0, 25
"""Radians of the dead time that are followed one by one; beyond, only |L| counts, as every phase comes by."""
NO_DOUBT = 0.7
"""Radians: a larger turn between two frequencies may be one of the other way round."""
HALVINGS = 40
SECTIONS = 60
GOLDEN = (5**0.5 - 1) / 2


@dataclass(frozen=True, slots=True)
class Margins:
    """Maximum sensitivity (at least 1), gain margin (a factor), phase margin in degrees; infinite: no limit."""

    ms: float
    gain_margin: float
    phase_margin: float


@dataclass(frozen=True, slots=True)
class Trace:
    """The open loop in the complex plane, from low frequencies to high ones, and where its margins are measured."""

    points: tuple[complex, ...]
    nearest: complex
    """Closest to -1: there the sensitivity is Ms."""
    turn: complex | None
    """Farthest out on the negative real axis, of what is within the unit circle or not; None: it is not crossed."""
    crossover: complex | None
    """On the unit circle, closest to -1; None: the loop is never as loud."""


@dataclass(frozen=True, slots=True)
class Loop:
    """A controller on a process."""

    gains: Gains
    transfer: Transfer

    def __call__(self, w: float) -> complex:
        """The open loop at a frequency in rad/s."""
        s, gains, transfer = complex(0, w), self.gains, self.transfer
        integral = 0 if isinf(gains.integral_time) else 1 / (gains.integral_time * s)
        value = gains.gain * (1 + integral + gains.derivative_time * s) * abs(transfer.gain)
        for time in transfer.zeros:
            value *= time * s + 1
        for time in transfer.poles:
            value /= time * s + 1
        return complex(value / s**transfer.integrators * exp(-transfer.dead_time * s))

    @property
    def times(self) -> list[float]:
        """Every time in it."""
        gains, transfer = self.gains, self.transfer
        times = (*map(abs, transfer.zeros), *transfer.poles, transfer.dead_time, gains.derivative_time)
        return [time for time in (*times, gains.integral_time) if time and not isinf(time)]

    @property
    def crossover(self) -> float:
        """The highest frequency, in rad/s, of all that are looked at, at which it is as loud as 1; else the lowest."""
        frequencies = _frequencies(self)
        return next((w for w in reversed(frequencies) if abs(self(w)) >= 1), frequencies[0])

    @property
    def integrators(self) -> int:
        """Of controller and process."""
        return self.transfer.integrators + (not isinf(self.gains.integral_time))


def margins(gains: Gains, transfer: Transfer) -> Margins | None:
    """How robust the loop is; None: it is unstable."""
    loop = Loop(gains, transfer)
    frequencies = _frequencies(loop)
    values = [loop(w) for w in frequencies]
    followed = len(frequencies)
    if transfer.dead_time:
        followed = bisect_left(frequencies, TURNS / transfer.dead_time)
    if not _is_stable(loop, frequencies[:followed], values[:followed], values[followed:]):
        return None
    loudest = max((abs(value) for value in values[followed:]), default=0.0)
    near, values = frequencies[:followed], values[:followed]
    return Margins(
        max(peak(loop, near, values), 1 / (1 - loudest), 1.0),
        min(gain_margin(loop, near), 1 / loudest if loudest else inf),
        phase_margin(loop, near),
    )


def gain_margin(loop: OpenLoop, frequencies: Sequence[float]) -> float:
    """The factor by which the gain may grow."""
    turns = crossings(loop, frequencies, lambda v: v.imag)
    return min((1 / abs(loop(w)) for w in turns if loop(w).real < 0), default=inf)


def phase_margin(loop: OpenLoop, frequencies: Sequence[float]) -> float:
    """The smallest angle to -180 degrees where the loop is as loud as 1."""
    phases = (pi + phase(loop(w)) for w in crossings(loop, frequencies, lambda v: abs(v) - 1))
    return min((degrees(min(angle, 2 * pi - angle)) for angle in phases), default=inf)


def traced(gains: Gains, transfer: Transfer) -> Trace:
    """The curve of a stable loop."""
    loop = Loop(gains, transfer)
    frequencies = _frequencies(loop)
    if transfer.dead_time:
        frequencies = frequencies[: bisect_left(frequencies, TURNS / transfer.dead_time)]
    points = tuple(loop(w) for w in frequencies)
    turns = [loop(w) for w in crossings(loop, frequencies, lambda v: v.imag) if loop(w).real < 0]
    circle = [loop(w) for w in crossings(loop, frequencies, lambda v: abs(v) - 1)]
    near = min(points, key=lambda v: abs(1 + v))
    return Trace(
        points, near, min(turns, key=lambda v: v.real, default=None), min(circle, key=lambda v: v.real, default=None)
    )


def _frequencies(loop: Loop) -> list[float]:
    """From where the loop is an integrator to where it is silent, close enough for every turn of the dead time."""
    low = log10(1 / sum(loop.times)) - DECADES_BELOW
    high = log10(1 / min(loop.times)) + DECADES_ABOVE
    count = int((high - low) * PER_DECADE) + 1
    points = {10 ** (low + (high - low) * i / count) for i in range(count + 1)}
    if dead := loop.transfer.dead_time:
        points |= {i / (PER_RADIAN * dead) for i in range(1, int(TURNS * PER_RADIAN) + 1)}
    return sorted(points)


def _is_stable(loop: Loop, frequencies: Sequence[float], values: Sequence[complex], beyond: Sequence[complex]) -> bool:
    """Nyquist: 1 + L turns by a quarter for each integrator, and no more, on the way to where L is silent."""
    if any(abs(value) >= 1 for value in (*beyond, values[-1])):
        return False
    turned = sum(
        _turned(loop, *pair) for pair in pairwise((w, phase(1 + v)) for w, v in zip(frequencies, values, strict=True))
    )
    # from -90 degrees for each integrator to the principal value at the end, without a turn more
    expected = phase(1 + values[-1]) + loop.integrators * pi / 2
    return abs(turned - expected) < pi / 2


def _turned(loop: Loop, low: tuple[float, float], high: tuple[float, float], most: int = HALVINGS) -> float:
    """By how much 1 + L turns between two frequencies with its phases there; close to 0 it turns fast."""
    turned = (high[1] - low[1] + pi) % (2 * pi) - pi
    if abs(turned) < NO_DOUBT or not most:
        return turned
    w = (low[0] + high[0]) / 2
    middle = (w, phase(1 + loop(w)))
    return _turned(loop, low, middle, most - 1) + _turned(loop, middle, high, most - 1)


def peak(loop: OpenLoop, frequencies: Sequence[float], values: Sequence[complex]) -> float:
    """The largest sensitivity, found between its neighbours on the grid."""
    sensitivities = [1 / abs(1 + value) for value in values]
    best = max(range(len(values)), key=sensitivities.__getitem__)
    low, high = frequencies[max(best - 1, 0)], frequencies[min(best + 1, len(values) - 1)]
    for _ in range(SECTIONS):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        if abs(1 + loop(left)) < abs(1 + loop(right)):
            high = right
        else:
            low = left
    return max(sensitivities[best], 1 / abs(1 + loop((low + high) / 2)))


def crossings(loop: OpenLoop, frequencies: Sequence[float], of: Callable[[complex], float]) -> Iterator[float]:
    """Where a number of the loop changes its sign."""
    before = of(loop(frequencies[0]))
    for low, high in pairwise(frequencies):
        after = of(loop(high))
        if (before < 0) != (after < 0):
            left, right, rising = low, high, after >= 0
            for _ in range(HALVINGS):
                middle = (left + right) / 2
                if (of(loop(middle)) >= 0) == rising:
                    right = middle
                else:
                    left = middle
            yield (left + right) / 2
        before = after
