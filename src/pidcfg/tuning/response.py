"""How a process answers to a recorded output, the parameters that fit best, and what no first-order process does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from math import exp, hypot, inf, sqrt
from operator import mul
from statistics import fmean
from typing import NamedTuple

from pidcfg.text.frozen import frozen

# --- The samples of a test, what a user says of them, and the error for those that tell no process --------------------


class RecordError(ValueError):
    """A record that tells no process: what is wrong, and what to record instead."""

    def __init__(self, message: str, cure: str, row: int | None = None) -> None:
        super().__init__(message)
        self.cure = cure
        self.row = row
        """Index of the sample that shows it."""


@frozen
class Record:
    """Samples of one test: times in s, and what output and PV were."""

    time: Sequence[float]
    output: Sequence[float]
    pv: Sequence[float]
    units: tuple[str, str] = ("", "")
    """Of output and PV, where the headers say them."""


@frozen
class Request:
    """What the user says of a record: its columns, the output before it, and the part that counts."""

    columns: str | None = None
    rest: float | None = None
    start: str | None = None
    """A time of the record: a number with or without unit, or as the record writes it."""
    until: str | None = None


# --- How a process answers to the recorded output, and the parameters of it that fit best -----------------------------
#
# The output is held between its changes, or runs straight along a ramp. A process is a first-order lag or an
# integrator behind a dead time. Gain, rest and drift are linear and follow by least squares; the two times are
# searched.

FINE_POINTS = 800
"""Points that the search looks at; longer records are averaged."""
COARSE_POINTS = 120
"""Points of the first, coarse search."""
SEARCH_ROUNDS = 200
START_CONSTANTS = (0.003, 0.01, 0.03, 0.07, 0.15, 0.3, 0.6, 1.5, 5.0, 20.0)
START_DEAD_TIMES = (0.0, 0.003, 0.01, 0.03, 0.07, 0.15, 0.3, 0.5)
"""Where the search begins, in lengths of the record."""
LONGEST_CONSTANT = 1e3
"""Lengths of the record beyond which a time constant is an integrator."""
NORMAL_95 = 1.96
MIN_LAG_RATIO, MIN_LAG_SPACING = 1e-6, 1e-4
"""Of a second time constant to the first: below there is none, and nearer to 1 both count as so far apart."""
MAX_CORRELATION = 0.98
"""Of the correlation of neighbours: more makes every number unknown."""


class Segment(NamedTuple):
    """The output from a time on: how far from its rest, and how fast it goes on."""

    time: float
    value: float
    slope: float = 0.0


@frozen
class Samples:
    """Times in s and values of the PV."""

    time: Sequence[float]
    value: Sequence[float]

    @cached_property
    def centred_values(self) -> tuple[float, list[float]]:
        """The mean of the values, and what each is beyond it."""
        return centre_values(self.value)

    def average(self, points: int, split_time: float) -> Samples:
        """At most so many points, each the mean of its neighbours, none of both sides of ``split_time``."""
        width = -(-len(self.time) // points)
        if width <= 1:
            return self
        split = sum(t < split_time for t in self.time)
        groups = [*range(0, split, width), *range(split, len(self.time), width), len(self.time)]
        pairs = [(a, min(b, split) if a < split else b) for a, b in pairwise(groups)]
        return Samples([fmean(self.time[a:b]) for a, b in pairs], [fmean(self.value[a:b]) for a, b in pairs])


@frozen
class Fit:
    """The best parameters; ``time_constant`` is infinite for an integrator, whose gain is per s."""

    gain: float
    time_constant: float
    dead_time: float
    base: float
    drift: float
    squares: float
    points: int
    errors: tuple[float, float, float]
    """95 % confidence of gain, time constant and dead time: plus or minus so much."""
    second_time_constant: float = 0.0
    """The second time constant; 0: there is one lag."""
    second_time_constant_error: float = 0.0

    @property
    def residual(self) -> float:
        """Standard deviation of what the fit leaves."""
        return sqrt(self.squares / self.points)

    def widen(self, other: Fit) -> Fit:
        """The same, less sure by what another fit, as possible, makes of it."""
        mine, theirs = (
            (self.gain, self.time_constant, self.dead_time),
            (other.gain, other.time_constant, other.dead_time),
        )
        gain, constant, dead = (hypot(e, a - b) for e, a, b in zip(self.errors, mine, theirs, strict=True))
        return replace(self, errors=(gain, constant, dead))


def first_order_response(
    times: Sequence[float], output: Sequence[Segment], dead_time: float, constant: float
) -> list[float]:
    """The PV, from rest, of a process with gain 1 (an integrator where the time constant is infinite)."""
    pvs: list[float] = []
    state = value = slope = 0.0
    reached, k = min(times[0], output[0].time + dead_time), 0
    changes = [segment.time + dead_time for segment in output]
    for time in times:
        while k < len(changes) and changes[k] <= time:
            state = _advance_lag(state, value, slope, changes[k] - reached, constant)
            reached, value, slope = changes[k], output[k].value, output[k].slope
            k += 1
        elapsed, reached = time - reached, time
        if constant == inf or slope:
            state = _advance_lag(state, value, slope, elapsed, constant)
            value += slope * elapsed
        else:  # the same of a held output, in which a search passes most of its time
            state = value + (state - value) * exp(-elapsed / constant)
        pvs.append(state)
    return pvs


def _advance_lag(state: float, value: float, slope: float, elapsed: float, constant: float) -> float:
    if constant == inf:
        return state + value * elapsed + slope * elapsed * elapsed / 2
    lag = value - slope * constant
    return lag + slope * elapsed + (state - lag) * exp(-elapsed / constant)


def second_order_response(
    times: Sequence[float], output: Sequence[Segment], dead_time: float, constant: float, second: float
) -> list[float]:
    """The PV, from rest, of a process with gain 1 and two lags, the second one not the longer; 0: with one."""
    first_order = first_order_response(times, output, dead_time, constant)
    if second < constant * MIN_LAG_RATIO:
        return first_order
    second = min(second, constant * (1 - MIN_LAG_SPACING))
    two, share = first_order_response(times, output, dead_time, second), constant / (constant - second)
    return [share * a + (1 - share) * b for a, b in zip(first_order, two, strict=True)]


def fit_process(
    samples: Samples,
    output: Sequence[Segment],
    *,
    drift: bool = False,
    integrating: bool = False,
    guess: Fit | None = None,
    with_second_lag: bool = False,
) -> Fit:
    """The process that fits best; with ``drift`` the rest moves evenly; ``guess``: a fit to begin at.

    ``with_second_lag``: with two lags, of which ``guess`` is an estimate with one.
    """
    length = samples.time[-1] - output[0].time
    begin = output[0].time
    coarse, fine = samples.average(COARSE_POINTS, begin), samples.average(FINE_POINTS, begin)

    def cost(points: Samples) -> Callable[[Sequence[float]], float]:
        def squares_left(place: Sequence[float]) -> float:
            constant = inf if integrating else _time_constant(place[1]) * length
            lag = constant * _lag_ratio(place[2]) if with_second_lag else 0.0
            return _fit_linear(points, output, abs(place[0]) * length, (constant, lag), begin, drift=drift)[1]

        return squares_left

    place: tuple[float, ...]
    if guess is not None and with_second_lag:
        constant, delay = guess.time_constant / length, guess.dead_time / length
        begins = [
            (max(delay - constant * q / 2, 0.0), _scale_place(constant / (1 + q / 2)), q) for q in (0.15, 0.4, 0.8)
        ]
        place = min((search_minimum(cost(coarse), begin_place, 0.02) for begin_place in begins), key=cost(coarse))
        place = search_minimum(cost(fine), place, 0.005)
    elif guess is None:
        starts = [
            (delay, _scale_place(share))
            for delay in START_DEAD_TIMES
            for share in ((1.0,) if integrating else START_CONSTANTS)
        ]
        ends = [search_minimum(cost(coarse), start, 0.05) for start in sorted(starts, key=cost(coarse))[:3]]
        place = search_minimum(cost(fine), min(ends, key=cost(coarse)), 0.005)
    else:
        place = search_minimum(cost(fine), (guess.dead_time / length, _scale_place(guess.time_constant / length)), 0.05)
    delay, constant = abs(place[0]) * length, inf if integrating else _time_constant(place[1]) * length
    lag = constant * _lag_ratio(place[2]) if with_second_lag else 0.0
    (base, moves, gain), squares = _fit_linear(fine, output, delay, (constant, lag), begin, drift=drift)
    errors = _confidences(fine, output, (gain, constant, delay, lag), squares, drift=drift)
    return Fit(gain, constant, delay, base, moves, squares, len(fine.time), errors[:3], lag, errors[3])


def _lag_ratio(place: float) -> float:
    """The second time constant over the first from its place on the search's scale, on which 1 is no end."""
    return min(abs(place), 1 / max(abs(place), MIN_LAG_RATIO))


def _scale_place(share: float) -> float:
    """Where a time constant, in lengths of the record, lies on the search's scale."""
    return float(share ** (1 / 3))


def _time_constant(place: float) -> float:
    """A time constant, in lengths of the record, from its place on the search's scale."""
    return min(max(abs(place) ** 3, 1e-6), LONGEST_CONSTANT)


def _fit_linear(
    samples: Samples,
    output: Sequence[Segment],
    dead_time: float,
    constants: tuple[float, float],
    begin: float,
    *,
    drift: bool,
) -> tuple[tuple[float, float, float], float]:
    """Rest, drift and gain by least squares, and the sum of squares that they leave."""
    columns = [[1.0] * len(samples.time), second_order_response(samples.time, output, dead_time, *constants)]
    if drift:
        columns.insert(1, [t - begin for t in samples.time])
    weights_found = least_squares(columns, samples.value, samples.centred_values)
    if weights_found is None:
        return (fmean(samples.value), 0.0, 0.0), inf
    base, *weights = weights_found
    rest = [y - base for y in samples.value]
    for weight, column in zip(weights, columns[1:], strict=True):
        rest = [y - weight * x for y, x in zip(rest, column, strict=True)]
    return (weights_found[0], weights_found[1] if drift else 0.0, weights_found[-1]), _dot_product(rest, rest)


def least_squares(
    columns: Sequence[Sequence[float]], values: Sequence[float], centred: tuple[float, list[float]] | None = None
) -> list[float] | None:
    """The weights of columns that come closest to values; None where columns are not independent.

    ``centred``: the mean of the values and what they are beyond it, where that is known.
    """
    inverse = _invert_matrix(_normal_matrix(columns))
    if inverse is None:
        return None
    middle, around = centred or centre_values(values)
    right = [_dot_product(column, around) for column in columns]
    weights = [_dot_product(row, right) for row in inverse]
    weights[0] += middle / columns[0][0]
    return weights


def centre_values(values: Sequence[float]) -> tuple[float, list[float]]:
    """The mean of values, and what each is beyond it."""
    middle = fmean(values)
    return middle, [y - middle for y in values]


def _normal_matrix(columns: Sequence[Sequence[float]]) -> list[list[float]]:
    half = [[_dot_product(x, y) for y in columns[: i + 1]] for i, x in enumerate(columns)]
    return [[half[max(i, j)][min(i, j)] for j in range(len(columns))] for i in range(len(columns))]


def _dot_product(x: Sequence[float], y: Sequence[float]) -> float:
    return float(sum(map(mul, x, y)))


def _invert_matrix(matrix: Sequence[Sequence[float]]) -> list[list[float]] | None:
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


def _confidences(
    samples: Samples,
    output: Sequence[Segment],
    numbers: tuple[float, float, float, float],
    squares: float,
    *,
    drift: bool,
) -> tuple[float, float, float, float]:
    """95 % confidence of gain, time constant, dead time and second time constant, by how the answer changes with each.

    What is left is often not white, which makes them wider.
    """
    gain, constant, dead, second = numbers
    unit = second_order_response(samples.time, output, dead, constant, second)
    length = samples.time[-1] - output[0].time
    columns = [[1.0] * len(unit), unit]
    if drift:
        columns.append([t - output[0].time for t in samples.time])
    small = 1e-3 * (length if constant == inf else constant)
    columns.append(
        _slope_column(unit, second_order_response(samples.time, output, dead + small, constant, second), gain / small)
    )
    if constant != inf:
        longer = second_order_response(samples.time, output, dead, constant * 1.001, second)
        columns.append(_slope_column(unit, longer, gain / constant * 1e3))
    if second:
        shorter = second_order_response(samples.time, output, dead, constant, second * 0.999)
        columns.append(_slope_column(unit, shorter, -gain / second * 1e3))
    inverse = _invert_matrix(_normal_matrix(columns))
    if inverse is None:
        return (inf, inf, inf, inf)
    variance = (
        squares / max(1, len(unit) - len(columns)) * _variance_growth(samples.value, columns[: 3 if drift else 2])
    )
    wide = [NORMAL_95 * sqrt(max(0.0, variance * inverse[i][i])) for i in range(len(columns))]
    at = 3 if drift else 2
    return wide[1], wide[at + 1] if constant != inf else 0.0, wide[at], wide[at + 2] if second else 0.0


def _variance_growth(values: Sequence[float], columns: Sequence[Sequence[float]]) -> float:
    """By how much the variance of an estimate grows where neighbours of what is left resemble each other."""
    weights = least_squares(columns, values)
    if weights is None:
        return 1.0
    residuals = values
    for weight, column in zip(weights, columns, strict=True):
        residuals = [y - weight * x for y, x in zip(residuals, column, strict=True)]
    whole = _dot_product(residuals, residuals)
    correlation = min(max(_dot_product(residuals[1:], residuals[:-1]) / whole, 0.0), MAX_CORRELATION) if whole else 0.0
    return (1 + correlation) / (1 - correlation)


def _slope_column(before: Sequence[float], after: Sequence[float], factor: float) -> list[float]:
    return [(b - a) * factor for a, b in zip(before, after, strict=True)]


def search_minimum(
    cost: Callable[[Sequence[float]], float], start: tuple[float, ...], width: float, rounds: int = SEARCH_ROUNDS
) -> tuple[float, ...]:
    """Nelder and Mead's search, from a simplex of this width."""
    wide = [width if i == 0 else 2 * width for i in range(len(start))]
    corners = [start, *((*start[:i], start[i] + wide[i], *start[i + 1 :]) for i in range(len(start)))]
    ranked = sorted((cost(c), c) for c in corners)
    for _ in range(rounds):
        best, a = ranked[0]
        worst, c = ranked[-1]
        if sum(abs(x - y) for _, b in ranked[1:] for x, y in zip(a, b, strict=True)) < 1e-8:
            break
        centre = [fmean(corner[i] for _, corner in ranked[:-1]) for i in range(len(start))]
        trials = [tuple(m + f * (x - m) for m, x in zip(centre, c, strict=True)) for f in (-1.0, -2.0, 0.5)]
        trial = (cost(trials[0]), trials[0])
        if trial[0] < best:
            trial = min(trial, (cost(trials[1]), trials[1]))
        elif trial[0] >= ranked[-2][0]:
            trial = min(trial, (cost(trials[2]), trials[2]))
        if trial[0] < worst:
            ranked = sorted([*ranked[:-1], trial])
        else:
            shrunk = [tuple((x + y) / 2 for x, y in zip(p, a, strict=True)) for _, p in ranked[1:]]
            ranked = sorted([(best, a), *((cost(p), p) for p in shrunk)])
    return ranked[0][1]


# --- What the output of a record does: levels that are held, or a ramp, from its first change on ----------------------

MAX_STRAY = 0.05
"""How far a held output may stray, in its range."""
MAX_TURNS = 8
"""How often the output of a test turns round at most."""


@frozen
class Path:
    """The output from its first change on."""

    segments: Sequence[Segment]
    first_sample: int
    """The first sample that is not at rest."""
    span: float
    """The largest change from rest."""


def output_path(record: Record, rest: float | None) -> Path:
    """How the output goes from rest; ``rest`` is its value before the record, where it changed at the first sample.

    Raises `RecordError`.
    """
    output = record.output
    levels = [*output, *([] if rest is None else [rest])]
    reach = max(levels) - min(levels)
    if reach == 0:
        cure = "record a step of the output in manual mode"
        if rest is None:
            cure += "; where it stepped at the first sample, give the output before it with --rest"
        raise RecordError(f"the output never changes, it is {output[0]:g}", cure)
    turns = _count_turns(output, MAX_STRAY * reach)
    if turns > MAX_TURNS:
        raise RecordError(
            f"the output turns round {turns} times, as in a closed loop",
            "put the loop into Manual, step the output once, and record until the PV is at rest",
        )
    levels_held = _held_levels(output, MAX_STRAY * reach)
    path = output if levels_held is None else levels_held
    before = path[0] if rest is None else rest
    first = next((i for i, u in enumerate(path) if abs(u - before) > MAX_STRAY * reach / 10), len(path) - 1)
    start = first if levels_held is not None else max(first - 1, 0)
    segments = _make_segments(record.time, [u - before for u in path], start, ramps=levels_held is None)
    return Path(segments, first, max((u - before for u in path), key=abs))


def _held_levels(output: Sequence[float], stray: float) -> list[float] | None:
    """The output without its jitter, each level its mean; None where it does not stay on levels, as in a ramp."""
    levels: list[list[float]] = [[output[0]]]
    for a, b in pairwise(output):
        if abs(b - a) > stray:
            levels.append([])
        levels[-1].append(b)
    means = [fmean(level) for level in levels]
    if any(abs(u - mean) > stray for level, mean in zip(levels, means, strict=True) for u in level):
        return None
    if len(levels) > 3 and sum(len(level) == 1 for level in levels) * 2 > len(levels):
        return None
    return [mean for level, mean in zip(levels, means, strict=True) for _ in level]


def _make_segments(times: Sequence[float], path: Sequence[float], start: int, *, ramps: bool) -> list[Segment]:
    """The output as levels that are held, or as straight lines between its samples."""
    segments: list[Segment] = []
    for i in range(start, len(path)):
        ahead = times[i + 1] - times[i] if i + 1 < len(path) else 0.0
        slope = (path[i + 1] - path[i]) / ahead if ramps and ahead > 0 else 0.0
        last = segments[-1] if segments else None
        if last is None or path[i] != last.value + last.slope * (times[i] - last.time) or slope != last.slope:
            segments.append(Segment(times[i], path[i], slope))
    return segments


def _count_turns(path: Sequence[float], stray: float) -> int:
    """How often a path turns round by more than its stray."""
    turns, direction, end = 0, 0, path[0]
    for u in path:
        if abs(u - end) > stray:
            now = 1 if u > end else -1
            turns += direction not in {0, now}
            direction, end = now, u
        elif direction and (u - end) * direction > 0:
            end = u
    return turns


# ----------------------------------------------------------------------------------------------------------------------
# What no first-order process does (the wrong way first, overshoot, swings), and what none does (spikes, a stop).

SHAPE_MEANS = 60
"""Means that the answer is looked at by, so that noise makes no shape."""
WRONG_WAY_SHARE, OVERSHOOT_SHARE = 0.04, 0.06
"""Parts of the answer from which on they are told."""
MIN_NOISE_RATIO = 5.0
"""How many standard deviations of a mean a shape must have."""
OVERSHOOT_RETURN = 0.3
"""Part of the overshoot by which the PV must come back."""

SPIKE_NOISE_RATIO = 12.0
"""How many standard deviations of noise a sample must lie beyond both of its neighbours."""
SPIKE_SHARE = 0.05
"""The same as a part of the PV's range."""
STANDSTILL_SAMPLES, STOP_SPEED_SHARE = 10, 0.08
"""Samples for which a PV at its end must stand still; how fast it came there, in the fastest way it went."""
SPEED_WINDOWS = 40
"""The part of the answer over which its speed is measured."""


def refuse_spikes(record: Record, noise: float) -> None:
    """Refuses single samples that stand alone, far from both neighbours, which agree: no process is that fast."""
    pv = record.pv
    min_height = max(SPIKE_NOISE_RATIO * noise, SPIKE_SHARE * (max(pv) - min(pv)))
    spikes = [
        i
        for i in range(1, len(pv) - 1)
        if min(abs(pv[i] - pv[i - 1]), abs(pv[i] - pv[i + 1])) > min_height
        and abs(pv[i + 1] - pv[i - 1]) < min_height / 2
        and (pv[i] - pv[i - 1]) * (pv[i] - pv[i + 1]) > 0
    ]
    if spikes:
        first, more = spikes[0], f", and {len(spikes) - 1} more" if len(spikes) > 1 else ""
        raise RecordError(
            f"the PV jumps to {pv[first]:.4g} for one sample at {record.time[first]:g} s and back (spike{more})",
            "remove the row" + ("s" if more else ""),
            first,
        )


def refuse_stop(record: Record, k: int, quantum: float) -> None:
    """Refuses an answer that stops at once and stands still: the end of a sensor's range."""
    pv = record.pv[k:]
    stop = next((i for i in range(len(pv) - 1, -1, -1) if pv[i] != pv[-1]), -1) + 1
    width = max(2, len(pv) // SPEED_WINDOWS)
    if len(pv) - stop < STANDSTILL_SAMPLES or stop <= width:
        return
    ways = [abs(b - a) for a, b in zip(pv[: stop + 1], pv[width : stop + 1], strict=False)]
    if ways[-1] > max(STOP_SPEED_SHARE * max(ways), 4 * quantum):
        raise RecordError(
            f"the PV stops at once at {pv[-1]:.6g} and stands still, as at the end of a sensor's range",
            "take a smaller step, or widen the range of the measurement",
            k + stop,
        )


def refuse_shape(record: Record, k: int, drift: float, noise: float) -> None:
    """Refuses the answer to one step, from sample ``k`` on, that no first-order process gives."""
    base = fmean(record.pv[:k]) if k else record.pv[0]
    begin = fmean(record.time[:k]) if k else record.time[0]
    moved = [y - base - drift * (t - begin) for t, y in zip(record.time[k:], record.pv[k:], strict=True)]
    width = max(1, len(moved) // SHAPE_MEANS)
    means = [fmean(moved[i : i + width]) for i in range(0, len(moved) - width + 1, width)]
    times = [record.time[k + i] for i in range(0, len(moved) - width + 1, width)]
    tail = max(1, len(means) // 5)
    answer = fmean(means[-tail:])
    doubt = MIN_NOISE_RATIO * noise / sqrt(width)
    sign = 1 if answer > 0 else -1
    means = [sign * y for y in means]
    _refuse_wrong_way(means, times, abs(answer), doubt, record.time[k])
    _refuse_overshoot(means, times, abs(answer), doubt)


def _refuse_wrong_way(
    means: Sequence[float], times: Sequence[float], answer: float, noise: float, start: float
) -> None:
    lowest = min(means)
    if lowest < -max(WRONG_WAY_SHARE * answer, noise):
        raise RecordError(
            f"the PV first goes the wrong way, by {-lowest:.4g} of {answer:.4g}, until "
            f"{times[means.index(lowest)] - start:.4g} s after the step (inverse response)",
            "no first-order process does that; give --gain, --time-constant and --dead-time, with the time of the "
            "wrong way as dead time",
        )


def _refuse_overshoot(means: Sequence[float], times: Sequence[float], answer: float, noise: float) -> None:
    highest = max(means)
    top = means.index(highest)
    later = means[top:]
    overshoot = highest - answer
    if overshoot <= max(OVERSHOOT_SHARE * answer, noise) or highest - min(later) < OVERSHOOT_RETURN * overshoot:
        return
    crossings = [t for t, (a, b) in zip(times, pairwise(y - answer for y in means), strict=False) if a * b < 0]
    if len(crossings) > 2:
        period = 2 * (crossings[-1] - crossings[0]) / (len(crossings) - 1)
        raise RecordError(
            f"the PV swings about its end with a period of about {period:.3g} s, by {overshoot:.4g} of {answer:.4g} "
            "(oscillation)",
            "put the loop into Manual, so that no controller answers; a process that swings by itself has no "
            "first-order model",
        )
    raise RecordError(
        f"the PV goes beyond its end by {overshoot:.4g} of {answer:.4g} and comes back (overshoot)",
        "put the loop into Manual, keep disturbances away, record longer before the step if the PV drifts, and until "
        "it is at rest",
    )
