"""The loop as a PLC runs it: samples and a held output, its answer to a load, and the gains that keep its margins."""

from __future__ import annotations

from cmath import exp as turn
from collections.abc import Iterator, Sequence
from math import ceil, exp, expm1, floor, inf, isclose, log10, pi, sqrt

from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.tuning.margins import FOLLOWED_RADIANS, Margins, gain_margin, peak_sensitivity, phase_margin
from pidcfg.tuning.rules import Gains, Process

# --- The loop as a PLC runs it: samples, a held output, the PV's filter, and the vendor's difference equation ---------
#
# All five families add up the integral with the present error in it and take the difference to the last sample as the
# derivative, so that one equation serves them: u(n) = Kp (f(n) + Ts/Ti sum f + Td/Ts (y(n) - y(n-1))), with f the
# filtered error and y the derivative's own filter. They differ in the filters, which `Sampling` holds. The process is
# exact for an output that is held from sample to sample, with a dead time of any length.

D850 = Decision(
    850,
    "the loop that robust gains are for",
    "The loop samples, its output is held, and its equation is the vendor's: the integral with the present error, the "
    "derivative as a difference, filters of PV and derivative per sample. A new output acts at once. Ms, the margins "
    "and the IAE are those of this loop, without limits, dead bands and the rounding of PV and output words; the "
    "integral of |error| is added up at the samples. Ms and margins look up to half the sample frequency.",
    "The equations are those of the virtual PLCs (`pidcfg explain` names the manuals' places); between its samples the "
    "loop sees nothing.",
)
D854 = Decision(
    854,
    "what robust gains assume where nothing is said",
    "The sample time is the largest of 1, 2, 5, 10 … that is at most a tenth of the dead time, or a hundredth of the "
    "time constant if that is longer, from 0.1 s to 20 s; there is no filter. Where the gain is a share of the span "
    "and no range of the PV is given, the process's gain is in % of the PV's span per % of the output. Both are told. "
    "The form is PI; the limit of Ms is 1.6.",
    "All five PLCs hold 0.1 s to 20 s. A derivative amplifies noise, of which the process's numbers say nothing.",
)

D937 = Decision(
    937,
    "the forecast for a loop of a file is a run of its words",
    "`tune --write` takes the loop's sample time as --sample-time and its PV filter as one more lag, by the half rule. "
    "The words that are written then run on the virtual PLC against the process, from rest with the output in the "
    "middle of its limits: a step of the set point by a tenth of the PV's range, or less where the output would meet "
    "its limits, and afterwards one at the output. Overshoot and IAE are those that `simulate` measures, the IAE per "
    "unit of the step. Up to which step the output stays within its limits is told. Margins are those of the "
    "continuous loop with half the sample time as dead time and the filter as a lag.",
    "A continuous loop overshoots by 2 % where the words of a loop of 5 s overshoot by 25 to 48 %.",
)

SAMPLES_PER_DEAD_TIME, SAMPLES_PER_TIME_CONSTANT, SHORTEST_SAMPLE_TIME, LONGEST_SAMPLE_TIME = 10, 100, 0.1, 20.0
MIN_LAG_SPACING = 1e-6
"""Two time constants nearer than this are set apart by as much: their modes would cancel."""
ROUNDING_TOLERANCE = 1e-9
DECADES_BELOW, POINTS_PER_DECADE, POINTS_PER_RADIAN = 3, 60, 8
"""Of the frequencies that are looked at: below the slowest time, of each decade, and of each radian of delay."""
Mode = tuple[float, float, float]
"""x(n+1) = a x(n) + b u(n-d) + c u(n-d-1)."""
NO_MODE: Mode = (0.0, 0.0, 0.0)


@frozen
class Sampling:
    """How a loop samples and filters: s, and shares of what is new that a filter takes in each sample."""

    sample_time: float
    pv_share: float = 1.0
    derivative_share: float = 1.0
    derivative_limit: float | None = None
    """The derivative's filter has the derivative time over this, by Ts/(Ts + Td/limit); None: it has not."""

    def filter_share(self, derivative_time: float) -> float:
        """The share that the derivative's filter takes."""
        if self.derivative_limit is None:
            return self.derivative_share
        return self.sample_time / (self.sample_time + derivative_time / self.derivative_limit)


@frozen
class HeldProcess:
    """A process from sample to sample, as the sum of two first-order modes behind the same delay."""

    modes: tuple[Mode, Mode]
    delay: int
    """Whole samples."""
    sample_time: float
    total_time: float
    """Sum of the process's times, in s."""
    dead_time: float

    def __call__(self, z: complex) -> complex:
        """The transfer function."""
        back = 1 / z
        (a, b, c), (a2, b2, c2) = self.modes
        value = (b + c * back) / (z - a)
        if b2:
            value += (b2 + c2 * back) / (z - a2)
        return value * back**self.delay


def hold_process(process: Process, sample_time: float) -> HeldProcess:
    """A process behind an output that is held; its gain counts without a sign."""
    samples = process.dead_time / sample_time
    delay = floor(samples + ROUNDING_TOLERANCE)
    late = max(0.0, (samples - delay) * sample_time)
    slowest = process.time_constant + process.second_time_constant + process.dead_time + sample_time
    modes = [_mode_of_lag(gain, lag, sample_time, late) for gain, lag in _lags_of(process)]
    first, second, *_ = (*modes, NO_MODE)
    return HeldProcess((first, second), delay, sample_time, slowest, process.dead_time)


def _lags_of(process: Process) -> list[tuple[float, float]]:
    """Gain and time constant of the lags that add up to a process; infinite: an integrator, with its slope."""
    gain, second = abs(process.gain), process.second_time_constant
    if process.integrating:
        slope = abs(process.slope)
        return [(slope, inf), (-slope * second, second)] if second else [(slope, inf)]
    first = process.time_constant
    if not second:
        return [(gain, first)]
    if isclose(first, second, rel_tol=MIN_LAG_SPACING):
        second = first * (1 + MIN_LAG_SPACING)
    return [(gain * first / (first - second), first), (-gain * second / (first - second), second)]


def _mode_of_lag(gain: float, lag: float, sample_time: float, late_time: float) -> Mode:
    """A lag over one sample, in which the output of the sample before still acts for ``late_time`` s."""
    rest = sample_time - late_time
    if lag == inf:
        return 1.0, gain * rest, gain * late_time
    fresh = -expm1(-rest / lag)
    return exp(-sample_time / lag), gain * fresh, gain * exp(-rest / lag) * -expm1(-late_time / lag)


@frozen
class SampledLoop:
    """The open loop of a controller on a process, at frequencies in rad/s up to half the sample frequency."""

    gains: Gains
    plant: HeldProcess
    sampling: Sampling

    def __call__(self, w: float) -> complex:
        """The open loop at a frequency."""
        z = turn(complex(0, w * self.sampling.sample_time))
        return self.gains.gain * self.controller(z) * filtered_process(self.plant, self.sampling, z)

    def controller(self, z: complex) -> complex:
        """The controller without its gain and the PV's filter."""
        gains, back = self.gains, 1 / z
        value = 1 + self.sampling.sample_time / gains.integral_time / (1 - back)
        if not gains.derivative_time:
            return value
        return value + gains.derivative_time * filtered_difference(back, self.sampling, gains.derivative_time)


def filtered_process(plant: HeldProcess, sampling: Sampling, z: complex) -> complex:
    """The process behind its hold and before the PV's filter."""
    return plant(z) * sampling.pv_share / (1 - (1 - sampling.pv_share) / z)


def filtered_difference(back: complex, sampling: Sampling, derivative_time: float) -> complex:
    """The difference to the last sample, per s, behind the derivative's filter; ``back`` is 1/z."""
    lag = sampling.filter_share(derivative_time)
    return (1 - back) / sampling.sample_time * lag / (1 - (1 - lag) * back)


def frequencies(plant: HeldProcess) -> tuple[list[float], list[float]]:
    """From where the loop is an integrator, close enough for every turn of the dead time; and from there to the end.

    In the second list every phase comes by, so that only |L| counts.
    """
    top = pi / plant.sample_time * (1 - ROUNDING_TOLERANCE)
    ratio = 10 ** (1 / POINTS_PER_DECADE)
    step = 1 / POINTS_PER_RADIAN / (plant.dead_time + plant.sample_time)
    followed = min(top, FOLLOWED_RADIANS / plant.dead_time if plant.dead_time else top)
    w = 10**-DECADES_BELOW / plant.total_time
    near, beyond = [], []
    while w < followed:
        near.append(w)
        w = min(w * ratio, w + step)
    near.append(followed)
    while (w := w * ratio) < top:
        beyond.append(w)
    return near, [*beyond, top] if followed < top else []


def highest_sensitivity(loop: SampledLoop) -> float:
    """Ms of a stable loop: the largest 1/|1 + L|."""
    near, beyond = frequencies(loop.plant)
    loudest = max((abs(loop(w)) for w in beyond), default=0.0)
    return inf if loudest >= 1 else max(peak_sensitivity(loop, near, [loop(w) for w in near]), 1 / (1 - loudest), 1.0)


def sampled_margins(loop: SampledLoop) -> Margins:
    """How robust a stable loop is."""
    near, beyond = frequencies(loop.plant)
    loudest = max((abs(loop(w)) for w in beyond), default=0.0)
    margin = min(gain_margin(loop, near), 1 / loudest if loudest else inf)
    return Margins(highest_sensitivity(loop), margin, phase_margin(loop, near))


def default_sample_time(process: Process) -> float:
    """A tenth of the dead time, or a hundredth of the time constant, rounded down to 1, 2, 5, 10 and so on."""
    constant = 0.0 if process.integrating else process.time_constant
    longest = min(
        max(process.dead_time / SAMPLES_PER_DEAD_TIME, constant / SAMPLES_PER_TIME_CONSTANT, SHORTEST_SAMPLE_TIME),
        LONGEST_SAMPLE_TIME,
    )
    decade = 10.0 ** floor(log10(longest) + 1e-9)
    return float(f"{max(n * decade for n in (1, 2, 5) if n * decade <= longest * (1 + 1e-9)):.3g}")


# --- What a sampled loop does after a step of 1 that is added to its output: the integral of the absolute error -------

MAX_SAMPLES = 200_000
"""A loop that is not at rest by then counts as unstable."""
REST_SHARE = 1e-6
"""Of the highest error: what is left of it when the rest of the integral is known."""
DIVERGENCE_FACTOR = 1e3
"""Times the highest error of the beginning: the loop is unstable."""
BLOCK_SAMPLES = 32
"""Samples between two looks at what the integral will be at least."""


def absolute_error(gains: Gains, plant: HeldProcess, sampling: Sampling, max_error: float = inf) -> float:
    """The integral in PV units and s, infinite for an unstable loop, and where it is at least ``max_error``.

    The integral of the error itself is Ti/Kp whatever the process is, for the integral term ends at -1. So what is
    still to come is known but for its changes of sign, and Ti/Kp is a lower bound from the start.
    """
    final_sum, limit = gains.integral_time / (gains.gain * sampling.sample_time), max_error / sampling.sample_time
    block = end = BLOCK_SAMPLES * ceil(max(BLOCK_SAMPLES, 2 * (plant.delay + 1)) / BLOCK_SAMPLES)
    total = signed = peak = first_peak = block_peak = 0.0
    for n, errors in enumerate(_sampled_errors(gains, plant, sampling), 1):
        low, high, part = min(errors), max(errors), sum(errors)
        signed += part
        total += part if low >= 0 else -part if high <= 0 else sum(map(abs, errors))
        lower_bound = total + abs(final_sum - signed)
        if not lower_bound < limit:
            return inf
        block_peak = max(block_peak, high, -low)
        if n * BLOCK_SAMPLES < end:
            continue
        if block_peak > peak:
            peak, first_peak = block_peak, first_peak or block_peak
            if peak > DIVERGENCE_FACTOR * first_peak:
                return inf
        elif block_peak <= REST_SHARE * peak:
            return lower_bound * sampling.sample_time
        block_peak, end = 0.0, end + block
    return inf


def _sampled_errors(gains: Gains, plant: HeldProcess, sampling: Sampling) -> Iterator[list[float]]:
    """The PV at the samples after the step, `BLOCK_SAMPLES` of them at a time."""
    has_one_part = plant.modes[1] == NO_MODE and sampling.pv_share == 1 and not gains.derivative_time
    return _errors_of_one_lag(gains, plant, sampling) if has_one_part else _errors_of_all_parts(gains, plant, sampling)


def _errors_of_one_lag(gains: Gains, plant: HeldProcess, sampling: Sampling) -> Iterator[list[float]]:
    """The same as `_errors_of_all_parts` with nothing of what is 0, in a third of the time."""
    a, b, c = plant.modes[0]
    kp, ki = gains.gain, gains.gain * sampling.sample_time / gains.integral_time
    outputs = [0.0] * (plant.delay + 1)
    pv = signed = old = 0.0
    for begin in range(1, MAX_SAMPLES + 1, BLOCK_SAMPLES):
        errors = []
        for n in range(begin, begin + BLOCK_SAMPLES):
            errors.append(pv)
            signed += pv
            outputs.append(1.0 - kp * pv - ki * signed)
            fresh = outputs[n]
            pv = a * pv + b * fresh + c * old
            old = fresh
        yield errors


def _errors_of_all_parts(gains: Gains, plant: HeldProcess, sampling: Sampling) -> Iterator[list[float]]:
    """Two modes, filters of PV and derivative."""
    (a1, b1, c1), (a2, b2, c2) = plant.modes
    share, lag = sampling.pv_share, sampling.filter_share(gains.derivative_time)
    kp, ki = gains.gain, gains.gain * sampling.sample_time / gains.integral_time
    kd = gains.gain * gains.derivative_time / sampling.sample_time
    outputs = [0.0] * (plant.delay + 1)
    first = second = pv = slow = integral = old = 0.0
    for begin in range(1, MAX_SAMPLES + 1, BLOCK_SAMPLES):
        errors = []
        for n in range(begin, begin + BLOCK_SAMPLES):
            y = first + second
            errors.append(y)
            pv += (y - pv) * share
            integral += ki * pv
            new = slow + lag * (pv - slow)
            outputs.append(1.0 - kp * pv - integral - kd * (new - slow))
            slow = new
            fresh = outputs[n]
            first = a1 * first + b1 * fresh + c1 * old
            second = a2 * second + b2 * fresh + c2 * old
            old = fresh
        yield errors


# ----------------------------------------------------------------------------------------------------------------------
# Which gains keep a sampled loop out of the circle of a maximum sensitivity, for given integral and derivative times.
# At each frequency the open loop is a gain k times a number g. k g lies within the circle of radius 1/Ms around -1
# for the k between two roots of |g|² k² + 2 Re(g) k + 1 - 1/Ms² = 0. Where g has a phase of -180° or beyond, larger
# ones are out too: they would go round -1. What is left at the frequencies of a list may be too much, never too
# little.

Interval = tuple[float, float]


class Curve:
    """The part of the open loop that no gain changes, at a list of frequencies, and where it last was in the way."""

    def __init__(self, plant: HeldProcess, sampling: Sampling, ms: float, *, derivative: bool = True) -> None:
        self.plant, self.sampling, self.ms = plant, sampling, ms
        self.upper_at: int | None = None
        """Index of the frequency that allows the least gain, of the times before."""
        self.inner_at: int | None = None
        """The same of those in front of -180°."""
        near, beyond = frequencies(plant)
        self.end = None if beyond else len(near) - 1
        """Index of half the sample frequency: there the loop is a real number, and below 0 it has turned."""
        rows = [self._frequency_row(w) for w in near]
        if not derivative:
            count = self._count_deciding([row[0] for row in rows])
            near, rows, beyond = near[:count], rows[:count], beyond if count == len(rows) else []
        self.near = near
        self.plant_at, self.integral_at, self.back_at = (list(column) for column in zip(*rows, strict=True))
        self.beyond = [self._frequency_row(w) for w in beyond]

    def _count_deciding(self, plant_at: Sequence[complex]) -> int:
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

    def _frequency_row(self, w: float) -> tuple[complex, complex, complex]:
        """Process, integral over 1/Ti, and 1/z at a frequency."""
        time = self.sampling.sample_time
        z = turn(complex(0, w * time))
        return filtered_process(self.plant, self.sampling, z), time / (1 - 1 / z), 1 / z

    def sensitivity(self, gains: Gains, *, least: float = 0.0) -> float:
        """Ms; only as close as the frequencies are where it is below ``least``."""
        gain, derivative = gains.gain, gains.derivative_time
        distances = [abs(1 + gain * g) for g in self._unit_loops(gains.integral_time, derivative)]
        highest = 1 / min(distances)
        if highest >= least:
            loop = SampledLoop(gains, self.plant, self.sampling)
            nearest = distances.index(min(distances))
            around = self.near[max(0, nearest - 1) : nearest + 2]
            highest = max(highest, peak_sensitivity(loop, around, [loop(w) for w in around]))
        loudest = max(
            (gain * abs(self._unit_loop(row, gains.integral_time, derivative)) for row in self.beyond), default=0
        )
        return inf if loudest >= 1 else max(highest, 1 / (1 - loudest), 1.0)

    def _unit_loop(
        self, row: tuple[complex, complex, complex], integral_time: float, derivative_time: float
    ) -> complex:
        """The open loop of a gain of 1 at a frequency."""
        h, integral, back = row
        value = 1 + integral / integral_time
        if derivative_time:
            value += derivative_time * filtered_difference(back, self.sampling, derivative_time)
        return h * value

    def unit_loop_at(self, i: int, integral_time: float, derivative_time: float) -> complex:
        """The open loop of a gain of 1 at a frequency of the list."""
        return self._unit_loop((self.plant_at[i], self.integral_at[i], self.back_at[i]), integral_time, derivative_time)

    def _unit_loops(self, integral_time: float, derivative_time: float) -> list[complex]:
        """The open loop of a gain of 1 at all frequencies of the list."""
        if derivative_time:
            return [self.unit_loop_at(i, integral_time, derivative_time) for i in range(len(self.near))]
        share = 1 / integral_time
        return [h * (1 + i * share) for h, i in zip(self.plant_at, self.integral_at, strict=True)]

    def bound_at_known(self, integral_time: float, derivative_time: float) -> float:
        """A bound of the gain from the frequencies that were in the way before; infinite: nothing is known."""
        most = self._bound_of_turned(integral_time, derivative_time)
        if self.inner_at is not None and most < inf:
            g = self.unit_loop_at(self.inner_at, integral_time, derivative_time)
            low, high = circle_gains(g, self.ms)
            if low < most <= high or g.imag >= 0:
                most = min(low, most)
        return most

    def _bound_of_turned(self, integral_time: float, derivative_time: float) -> float:
        """The gain that the first frequency with -180° or beyond allows, from the one that was in the way before.

        With other times that one may be in front of -180°, where gains beyond the circle are allowed again.
        """
        for i in range(len(self.near) if self.upper_at is None else self.upper_at, len(self.near)):
            g = self.unit_loop_at(i, integral_time, derivative_time)
            if self._is_turned(i, g):
                self.upper_at = i
                return circle_gains(g, self.ms)[0]
        return inf

    def bound_by_error(self, error: float) -> float:
        """A bound M of the gain with every integral time above M times an error, without a derivative.

        At a frequency g goes straight to the process's own h as the time grows, and the g that allow no more than some
        gain are a convex set: no g between allows more than both ends do.
        """
        i = next((i for i, h in enumerate(self.plant_at) if self._is_turned(i, h)), None)
        if i is None:
            return inf
        last = circle_gains(self.plant_at[i], self.ms)[0]
        return inf if last == inf else max(last, circle_gains(self.unit_loop_at(i, last * error, 0.0), self.ms)[0])

    def forbidden_gains(self, integral_time: float, derivative_time: float) -> tuple[float, list[Interval]]:
        """The gain from which on none is allowed, and the intervals below it that are not."""
        most, inner = inf, list[tuple[float, float, int]]()
        self.upper_at = None
        for i, g in enumerate(self._unit_loops(integral_time, derivative_time)):
            if g.real >= 0:
                continue
            low, high = circle_gains(g, self.ms)
            if low == inf:
                continue
            if not self._is_turned(i, g):
                inner.append((low, high, i))
            elif low < most:
                most, self.upper_at = low, i
        for row in self.beyond:
            most = min(most, (1 - 1 / self.ms) / abs(self._unit_loop(row, integral_time, derivative_time)))
        last = min((row for row in inner if row[1] >= most), default=None)
        self.inner_at = None if last is None else last[2]
        return most, [(low, high) for low, high, _ in inner if low < most]


def circle_gains(g: complex, ms: float) -> Interval:
    """The gains between which k g lies in the circle; infinite: it never does."""
    square, along = g.real * g.real + g.imag * g.imag, g.real
    inner = along * along - square * (1 - 1 / ms**2)
    if along >= 0 or inner <= 0:
        return inf, inf
    root = sqrt(inner)
    return (-along - root) / square, (root - along) / square


def allowed_gains(curves: Sequence[Curve], integral_time: float, derivative_time: float) -> list[Interval]:
    """The intervals of gains that no curve forbids at its frequencies, the highest first."""
    most, inner = inf, list[Interval]()
    for curve in curves:
        bound, intervals = curve.forbidden_gains(integral_time, derivative_time)
        most = min(most, bound)
        inner += intervals
    allowed, low = [], 0.0
    for begin, end in sorted(inner):
        if begin >= most:
            break
        if begin > low:
            allowed.append((low, begin))
        low = max(low, end)
    if low < most:
        allowed.append((low, most))
    return allowed[::-1]
