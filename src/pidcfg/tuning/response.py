"""How a process answers to the recorded output, and the parameters of it that fit best.

The output is held between its changes, or runs straight along a ramp. A process is a first-order lag or an integrator
behind a dead time. Gain, rest and drift are linear and follow by least squares; the two times are searched.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from math import exp, hypot, inf, sqrt
from operator import mul
from statistics import fmean
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

POINTS = 800
"""Points that the search looks at; longer records are averaged."""
COARSE = 120
"""Points of the first, coarse search."""
ROUNDS = 200
CONSTANTS = (0.003, 0.01, 0.03, 0.07, 0.15, 0.3, 0.6, 1.5, 5.0, 20.0)
DEAD_TIMES = (0.0, 0.003, 0.01, 0.03, 0.07, 0.15, 0.3, 0.5)
"""Where the search begins, in lengths of the record."""
LONGEST_CONSTANT = 1e3
"""Lengths of the record beyond which a time constant is an integrator."""
NORMAL_95 = 1.96


class Segment(NamedTuple):
    """The output from a time on: how far from its rest, and how fast it goes on."""

    time: float
    value: float
    slope: float = 0.0


@dataclass(frozen=True, slots=True)
class Samples:
    """Times in s and values of the PV."""

    time: Sequence[float]
    value: Sequence[float]

    def averaged(self, points: int, apart: float) -> Samples:
        """At most so many points, each the mean of its neighbours, none of both sides of ``apart``."""
        width = -(-len(self.time) // points)
        if width <= 1:
            return self
        split = sum(t < apart for t in self.time)
        groups = [*range(0, split, width), *range(split, len(self.time), width), len(self.time)]
        pairs = [(a, min(b, split) if a < split else b) for a, b in pairwise(groups)]
        return Samples([fmean(self.time[a:b]) for a, b in pairs], [fmean(self.value[a:b]) for a, b in pairs])


@dataclass(frozen=True, slots=True)
class Fit:
    """The best parameters; ``constant`` is infinite for an integrator, whose gain is per s."""

    gain: float
    constant: float
    dead: float
    base: float
    drift: float
    squares: float
    points: int
    errors: tuple[float, float, float]
    """95 % confidence of gain, time constant and dead time: plus or minus so much."""

    @property
    def left(self) -> float:
        """Standard deviation of what the fit leaves."""
        return sqrt(self.squares / self.points)

    def widened(self, other: Fit) -> Fit:
        """The same, less sure by what another fit, as possible, makes of it."""
        mine, theirs = (self.gain, self.constant, self.dead), (other.gain, other.constant, other.dead)
        gain, constant, dead = (hypot(e, a - b) for e, a, b in zip(self.errors, mine, theirs, strict=True))
        return replace(self, errors=(gain, constant, dead))


def response(times: Sequence[float], output: Sequence[Segment], dead: float, constant: float) -> list[float]:
    """The PV, from rest, of a process with gain 1 (an integrator where the time constant is infinite)."""
    out: list[float] = []
    state = value = slope = 0.0
    at, k = min(times[0], output[0].time + dead), 0
    changes = [segment.time + dead for segment in output]
    for time in times:
        while k < len(changes) and changes[k] <= time:
            state = _step(state, value, slope, changes[k] - at, constant)
            at, value, slope = changes[k], output[k].value, output[k].slope
            k += 1
        state = _step(state, value, slope, time - at, constant)
        value, at = value + slope * (time - at), time
        out.append(state)
    return out


def _step(state: float, value: float, slope: float, past: float, constant: float) -> float:
    if constant == inf:
        return state + value * past + slope * past * past / 2
    lag = value - slope * constant
    return lag + slope * past + (state - lag) * exp(-past / constant)


def fit(
    samples: Samples,
    output: Sequence[Segment],
    *,
    drift: bool = False,
    integrating: bool = False,
    near: Fit | None = None,
) -> Fit:
    """The process that fits best; with ``drift`` the rest moves evenly; ``near``: a fit to begin at."""
    length = samples.time[-1] - output[0].time
    begin = output[0].time
    coarse, fine = samples.averaged(COARSE, begin), samples.averaged(POINTS, begin)

    def cost(points: Samples) -> Callable[[Sequence[float]], float]:
        def left(place: Sequence[float]) -> float:
            constant = inf if integrating else _constant(place[1]) * length
            return _linear(points, output, abs(place[0]) * length, constant, begin, drift=drift)[1]

        return left

    if near is None:
        starts = [(dead, _place(share)) for dead in DEAD_TIMES for share in ((1.0,) if integrating else CONSTANTS)]
        ends = [_simplex(cost(coarse), start, 0.05) for start in sorted(starts, key=cost(coarse))[:3]]
        place = _simplex(cost(fine), min(ends, key=cost(coarse)), 0.005)
    else:
        place = _simplex(cost(fine), (near.dead / length, _place(near.constant / length)), 0.05)
    dead, constant = abs(place[0]) * length, inf if integrating else _constant(place[1]) * length
    (base, moves, gain), squares = _linear(fine, output, dead, constant, begin, drift=drift)
    errors = _errors(fine, output, (gain, constant, dead), squares, drift=drift)
    return Fit(gain, constant, dead, base, moves, squares, len(fine.time), errors)


def _place(share: float) -> float:
    """Where a time constant, in lengths of the record, lies on the search's scale."""
    return float(share ** (1 / 3))


def _constant(place: float) -> float:
    """A time constant, in lengths of the record, from its place on the search's scale."""
    return min(max(abs(place) ** 3, 1e-6), LONGEST_CONSTANT)


def _linear(
    samples: Samples, output: Sequence[Segment], dead: float, constant: float, begin: float, *, drift: bool
) -> tuple[tuple[float, float, float], float]:
    """Rest, drift and gain by least squares, and the sum of squares that they leave."""
    columns = [[1.0] * len(samples.time), response(samples.time, output, dead, constant)]
    if drift:
        columns.insert(1, [t - begin for t in samples.time])
    solved = least_squares(columns, samples.value)
    if solved is None:
        return (fmean(samples.value), 0.0, 0.0), inf
    rest = samples.value
    for weight, column in zip(solved, columns, strict=True):
        rest = [y - weight * x for y, x in zip(rest, column, strict=True)]
    return (solved[0], solved[1] if drift else 0.0, solved[-1]), _dot(rest, rest)


def least_squares(columns: Sequence[Sequence[float]], values: Sequence[float]) -> list[float] | None:
    """The weights of columns that come closest to values; None where columns are not independent."""
    inverse = _inverse(_normal(columns))
    if inverse is None:
        return None
    middle = fmean(values)
    around = [y - middle for y in values]
    right = [_dot(column, around) for column in columns]
    weights = [_dot(row, right) for row in inverse]
    weights[0] += middle / columns[0][0]
    return weights


def _normal(columns: Sequence[Sequence[float]]) -> list[list[float]]:
    half = [[_dot(x, y) for y in columns[: i + 1]] for i, x in enumerate(columns)]
    return [[half[max(i, j)][min(i, j)] for j in range(len(columns))] for i in range(len(columns))]


def _dot(x: Sequence[float], y: Sequence[float]) -> float:
    return float(sum(map(mul, x, y)))


def _inverse(matrix: Sequence[Sequence[float]]) -> list[list[float]] | None:
    """The inverse of a small symmetric matrix, scaled by its diagonal; None where it has none."""
    size = len(matrix)
    scale = [sqrt(matrix[i][i]) for i in range(size)]
    if not all(scale):
        return None
    rows = [
        [matrix[i][j] / scale[i] / scale[j] for j in range(size)] + [float(i == j) for j in range(size)]
        for i in range(size)
    ]
    for i in range(size):
        pivot = max(range(i, size), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        if abs(rows[i][i]) < 1e-13:
            return None
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for k in range(size):
            if k != i:
                factor = rows[k][i]
                rows[k] = [x - factor * y for x, y in zip(rows[k], rows[i], strict=True)]
    return [[rows[i][size + j] / scale[i] / scale[j] for j in range(size)] for i in range(size)]


def _errors(
    samples: Samples, output: Sequence[Segment], found: tuple[float, float, float], squares: float, *, drift: bool
) -> tuple[float, float, float]:
    """95 % confidence of gain, time constant and dead time, from how the answer changes with each."""
    gain, constant, dead = found
    unit = response(samples.time, output, dead, constant)
    length = samples.time[-1] - output[0].time
    columns = [[1.0] * len(unit), unit]
    if drift:
        columns.append([t - output[0].time for t in samples.time])
    small = 1e-3 * (length if constant == inf else constant)
    columns.append(_change(unit, response(samples.time, output, dead + small, constant), gain / small))
    if constant != inf:
        columns.append(_change(unit, response(samples.time, output, dead, constant * 1.001), gain / constant * 1e3))
    inverse = _inverse(_normal(columns))
    if inverse is None:
        return (inf, inf, inf)
    variance = squares / max(1, len(unit) - len(columns))
    wide = [NORMAL_95 * sqrt(max(0.0, variance * inverse[i][i])) for i in range(len(columns))]
    at = 3 if drift else 2
    return wide[1], wide[at + 1] if constant != inf else 0.0, wide[at]


def _change(before: Sequence[float], after: Sequence[float], factor: float) -> list[float]:
    return [(b - a) * factor for a, b in zip(before, after, strict=True)]


def _simplex(cost: Callable[[Sequence[float]], float], start: tuple[float, float], width: float) -> tuple[float, float]:
    """Nelder and Mead's search in two dimensions, from a triangle of this width."""
    corners = [start, (start[0] + width, start[1]), (start[0], start[1] + 2 * width)]
    ranked = sorted((cost(c), c) for c in corners)
    for _ in range(ROUNDS):
        (best, a), (middle, b), (worst, c) = ranked
        if abs(a[0] - c[0]) + abs(a[1] - c[1]) + abs(a[0] - b[0]) + abs(a[1] - b[1]) < 1e-8:
            break
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
