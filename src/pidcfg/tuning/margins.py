"""Whether gains are to be trusted: margins of the loop, its answers in time, and the range of the rule."""

from __future__ import annotations

from bisect import bisect_left
from cmath import exp, phase
from dataclasses import replace
from itertools import pairwise
from math import atan, degrees, expm1, inf, isinf, log10, pi, sqrt
from typing import TYPE_CHECKING

from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.tuning.rules import Process
from pidcfg.tuning.transfer import transfer_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.tuning import Form
    from pidcfg.tuning.rules import Cycle, Gains, Method
    from pidcfg.tuning.transfer import Transfer

    OpenLoop = Callable[[float], complex]
    """The open loop by the frequency in rad/s."""

# --- How robust a loop is: maximum sensitivity, gain margin and phase margin of a controller on a process -------------
#
# The loop is L = Kp (1 + 1/(Ti s) + Td s) G(s): the dependent form without a filter, as the rules have it, in
# continuous time; a sample time counts as half of it in dead time.

D708 = Decision(
    708,
    "margins are those of the continuous loop",
    "Ms is the largest 1/|1 + L|, the gain margin the smallest 1/|L| where L crosses the negative real axis inside the "
    "unit circle, the phase margin the smallest distance to -180° where |L| is 1. No derivative filter, half the "
    "sample time as dead time. An unstable loop has none of them.",
    "Åström and Hägglund, Advanced PID Control (2006), 4.6; the registers' rounding and a PLC's filter come later, and "
    "`simulate` has them.",
)

DECADES_BELOW, DECADES_ABOVE, POINTS_PER_DECADE = 5, 3, 120
"""Of the frequencies that are looked at, around the inverse of the slowest and of the fastest time."""
FOLLOWED_RADIANS, POINTS_PER_RADIAN = 60.0, 25
"""Radians of the dead time that are followed one by one; beyond, only |L| counts, as every phase comes by."""
MAX_SURE_TURN = 0.7
"""Radians: a larger turn between two frequencies may be one of the other way round."""
HALVINGS = 40
MAX_SECTIONS = 60
GOLDEN_SECTION = (5**0.5 - 1) / 2


@frozen
class Margins:
    """Maximum sensitivity (at least 1), gain margin (a factor), phase margin in degrees; infinite: no limit."""

    ms: float
    gain_margin: float
    phase_margin: float


@frozen
class Trace:
    """The open loop in the complex plane, from low frequencies to high ones, and where its margins are measured."""

    points: tuple[complex, ...]
    nearest: complex
    """Closest to -1: there the sensitivity is Ms."""
    crossing: complex | None
    """Farthest out on the negative real axis, of what is within the unit circle or not; None: it is not crossed."""
    crossover: complex | None
    """On the unit circle, closest to -1; None: the loop is never as loud."""


@frozen
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
        followed = bisect_left(frequencies, FOLLOWED_RADIANS / transfer.dead_time)
    if not _is_stable(loop, frequencies[:followed], values[:followed], values[followed:]):
        return None
    loudest = max((abs(value) for value in values[followed:]), default=0.0)
    near, values = frequencies[:followed], values[:followed]
    return Margins(
        max(peak_sensitivity(loop, near, values), 1 / (1 - loudest), 1.0),
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


def trace_curve(gains: Gains, transfer: Transfer) -> Trace:
    """The curve of a stable loop."""
    loop = Loop(gains, transfer)
    frequencies = _frequencies(loop)
    if transfer.dead_time:
        frequencies = frequencies[: bisect_left(frequencies, FOLLOWED_RADIANS / transfer.dead_time)]
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
    count = int((high - low) * POINTS_PER_DECADE) + 1
    points = {10 ** (low + (high - low) * i / count) for i in range(count + 1)}
    if dead := loop.transfer.dead_time:
        points |= {i / (POINTS_PER_RADIAN * dead) for i in range(1, int(FOLLOWED_RADIANS * POINTS_PER_RADIAN) + 1)}
    return sorted(points)


def _is_stable(loop: Loop, frequencies: Sequence[float], values: Sequence[complex], tail: Sequence[complex]) -> bool:
    """Nyquist: 1 + L turns by a quarter for each integrator, and no more, on the way to where L is silent."""
    if any(abs(value) >= 1 for value in (*tail, values[-1])):
        return False
    turned = sum(
        _turn_between(loop, *pair)
        for pair in pairwise((w, phase(1 + v)) for w, v in zip(frequencies, values, strict=True))
    )
    # from -90 degrees for each integrator to the principal value at the end, without a turn more
    expected = phase(1 + values[-1]) + loop.integrators * pi / 2
    return abs(turned - expected) < pi / 2


def _turn_between(loop: Loop, low: tuple[float, float], high: tuple[float, float], halvings: int = HALVINGS) -> float:
    """By how much 1 + L turns between two frequencies with its phases there; close to 0 it turns fast."""
    turned = (high[1] - low[1] + pi) % (2 * pi) - pi
    if abs(turned) < MAX_SURE_TURN or not halvings:
        return turned
    w = (low[0] + high[0]) / 2
    middle = (w, phase(1 + loop(w)))
    return _turn_between(loop, low, middle, halvings - 1) + _turn_between(loop, middle, high, halvings - 1)


def peak_sensitivity(loop: OpenLoop, frequencies: Sequence[float], values: Sequence[complex]) -> float:
    """The largest sensitivity, found between its neighbours on the grid."""
    sensitivities = [1 / abs(1 + value) for value in values]
    best = max(range(len(values)), key=sensitivities.__getitem__)
    low, high = frequencies[max(best - 1, 0)], frequencies[min(best + 1, len(values) - 1)]
    for _ in range(MAX_SECTIONS):
        left, right = high - GOLDEN_SECTION * (high - low), low + GOLDEN_SECTION * (high - low)
        if abs(1 + loop(left)) < abs(1 + loop(right)):
            high = right
        else:
            low = left
    return max(sensitivities[best], 1 / abs(1 + loop((low + high) / 2)))


def crossings(loop: OpenLoop, frequencies: Sequence[float], quantity: Callable[[complex], float]) -> Iterator[float]:
    """Where a number of the loop changes its sign."""
    before = quantity(loop(frequencies[0]))
    for low, high in pairwise(frequencies):
        after = quantity(loop(high))
        if (before < 0) != (after < 0):
            left, right, rising = low, high, after >= 0
            for _ in range(HALVINGS):
                middle = (left + right) / 2
                if (quantity(loop(middle)) >= 0) == rising:
                    right = middle
                else:
                    left = middle
            yield (left + right) / 2
        before = after


# --- What the loop does in time: overshoot and absolute error after a step of the set point, and of the output --------
#
# The controller has the derivative on the PV, so that a step of the set point makes no spike; process and dead time
# are exact for an output that is held over a step of the calculation, which is a small part of the fastest time.

FINE_STEPS, MAX_STEPS = 100, 60_000
"""Steps of the calculation in the fastest time, and in all."""
COARSE_STEPS = 5
"""Times that step where the fastest time is not the loop's."""
REST_SHARE, SHOWN_DURATIONS, MAX_SHOWN_POINTS = 0.01, 1.15, 1500
"""Part of the way within which a PV is at rest; how long, in times until then, and in points, is shown."""
MAX_DURATION = 12
"""Times the slowest of integral time, lags and dead time: how long is looked at."""


@frozen
class Answer:
    """Overshoot in % of a step of the set point, and integrals of |error| in units and s.

    The integrals are of a unit step of the set point, and of one that is added to the output; None: without an integral
    term the error stays.
    """

    overshoot: float
    iae_setpoint: float | None
    iae_disturbance: float | None


class _Plant:
    """A transfer function in steps of time; as many leads as lags at most."""

    def __init__(self, transfer: Transfer, dt: float) -> None:
        self.dt, self.gain = dt, abs(transfer.gain)
        leads = [*transfer.zeros, *[0.0] * len(transfer.poles)]
        self.lags = [(-expm1(-dt / lag), lead / lag) for lag, lead in zip(transfer.poles, leads, strict=False)]
        self.leads = transfer.zeros[len(transfer.poles) :]
        self.states = [0.0] * len(self.lags)
        self.integral, self.integrates = 0.0, bool(transfer.integrators)
        self.delay = [0.0] * round(transfer.dead_time / dt)
        self.index = 0

    def step(self, output: float) -> float:
        """The PV after one step with this output."""
        if self.delay:
            self.delay[self.index], output = output, self.delay[self.index]
            self.index = (self.index + 1) % len(self.delay)
        value = output * self.gain
        if self.integrates:
            slope = value
            self.integral += value * self.dt
            value = self.integral + sum(self.leads) * slope
        for i, (share, lead) in enumerate(self.lags):
            self.states[i] += (value - self.states[i]) * share
            value = self.states[i] + lead * (value - self.states[i])
        return value


@frozen
class Curves:
    """The PV after a unit step of the set point, and after one that is added to the output; times in s."""

    times: tuple[float, ...]
    setpoint: tuple[float, ...]
    disturbance: tuple[float, ...]


def step_curves(gains: Gains, transfer: Transfer) -> Curves:
    """How a stable loop answers, until it is at rest; nothing where its times are too far apart."""
    grid = _time_grid(gains, transfer)
    if grid is None:
        return Curves((0.0,), (0.0,), (0.0,))
    dt, duration = grid
    after_setpoint, _ = _run_loop(gains, transfer, dt, duration, setpoint=1.0, load=0.0)
    after_load, _ = _run_loop(gains, transfer, dt, duration, setpoint=0.0, load=1.0)
    steps = max(_steps_to_rest(after_setpoint), _steps_to_rest(after_load))
    end = min(len(after_setpoint), round(SHOWN_DURATIONS * steps) + 2)
    every = max(1, end // MAX_SHOWN_POINTS)
    times = (0.0, *((i + 1) * dt for i in range(0, end, every)))
    return Curves(times, (0.0, *after_setpoint[:end:every]), (0.0, *after_load[:end:every]))


def _steps_to_rest(pvs: list[float]) -> int:
    """Steps until the PV stays within a small part of its way."""
    band = REST_SHARE * (max(pvs) - min(pvs))
    return next((i for i in range(len(pvs) - 1, -1, -1) if abs(pvs[i] - pvs[-1]) > band), 0)


def _time_grid(gains: Gains, transfer: Transfer) -> tuple[float, float] | None:
    """The step of the calculation and how long it goes on, in s; None: more steps than can be made."""
    loop = Loop(gains, transfer)
    fine, duration = min(loop.times) / FINE_STEPS, MAX_DURATION * max(loop.times)
    if duration / fine <= MAX_STEPS:
        return fine, duration
    # A lag that is much slower than the loop ends with it; a time that is much faster makes no difference.
    fastest = 1 / loop.crossover
    slowest = max(time for time in (fastest, transfer.dead_time, gains.integral_time) if not isinf(time))
    duration = min(duration, MAX_DURATION * slowest)
    step = max(fine, duration / MAX_STEPS)
    return (step, duration) if step <= fastest / FINE_STEPS * COARSE_STEPS else None


def step_answer(gains: Gains, transfer: Transfer) -> Answer | None:
    """The figures of a stable loop; None where its times are too far apart."""
    if (grid := _time_grid(gains, transfer)) is None:
        return None
    pvs, setpoint_error = _run_loop(gains, transfer, *grid, setpoint=1.0, load=0.0)
    _, load_error = _run_loop(gains, transfer, *grid, setpoint=0.0, load=1.0)
    has_offset = isinf(gains.integral_time)
    final = pvs[-1] if has_offset else 1.0
    overshoot = 100 * max(0.0, max(pvs) / final - 1) if final else 0.0
    return Answer(overshoot, None if has_offset else setpoint_error, None if has_offset else load_error)


def _run_loop(
    gains: Gains, transfer: Transfer, dt: float, duration: float, *, setpoint: float, load: float
) -> tuple[list[float], float]:
    """The PV, and the integral of the absolute error."""
    plant, integral, pv, before, total = _Plant(transfer, dt), 0.0, 0.0, 0.0, 0.0
    rate = gains.derivative_time / dt
    share = 0.0 if isinf(gains.integral_time) else dt / gains.integral_time
    pvs = []
    for _ in range(round(duration / dt)):
        error = setpoint - pv
        integral += error * share
        output = gains.gain * (error + integral - rate * (pv - before))
        before, pv = pv, plant.step(output + load)
        pvs.append(pv)
        total += abs(error) * dt
    return pvs, total


# --- Whether gains are to be trusted: the range of the rule, the margins of the loop, and what it does in time --------

WARNING_MS = 2.5
"""Of Ms: above it small errors of the process make the loop swing (D706)."""
MIN_LAG_SAMPLES = 10
"""A sample time should be below this part of the time constant."""


@frozen
class Judgement:
    """Whether the rule was made for the process, with its range in words, and how the loop behaves."""

    valid: bool
    reason: str
    margins: Margins | None = None
    """None: the loop is unstable, or the process is not known."""
    answer: Answer | None = None
    plant: Transfer | None = None
    """What the margins are those of; None: the process is not known."""
    known: bool = True
    """Whether there was a process to judge the gains by."""

    def warnings(self) -> Iterator[str]:
        """What an engineer has to know before the gains are used."""
        if not self.valid:
            yield f"outside the rule's range, which is {self.reason}"
        if self.margins is not None:
            yield from warnings_of_sensitivity(self.margins.ms)
        elif self.known:
            yield "with these gains the loop is unstable"


def judge_gains(
    method: Method, form: Form, gains: Gains, process: Process | None, transfer: Transfer | None = None
) -> Judgement:
    """The judgement of gains on a process, or on the transfer function that it was reduced from."""
    if process is None:
        return Judgement(valid=True, reason="it has no limits; margins need the process's gain", known=False)
    valid, reason = method.range_of_validity(form, process)
    plant = transfer_of(process)
    if transfer is not None:
        plant = replace(transfer, dead_time=transfer.dead_time + process.sample_time / 2)
    loop_margins = margins(gains, plant)
    return Judgement(valid, reason, loop_margins, None if loop_margins is None else step_answer(gains, plant), plant)


def process_of_cycle(gain: float, cycle: Cycle) -> Process | None:
    """The lag with dead time that has this gain and ultimate cycle; None: no such process."""
    loud = gain * cycle.gain
    if loud <= 1:
        return None
    turned, w = sqrt(loud * loud - 1), 2 * pi / cycle.period
    return Process(gain, turned / w, (pi - atan(turned)) / w)


def warnings_of_authors(process: Process) -> Iterator[str]:
    """What the rules' authors warn of."""
    if process.integrating:
        return
    if process.dead_time and process.time_constant / process.dead_time < 1:
        yield "the dead time is longer than the time constant: hard to control, whatever the gains"
    if process.sample_time and process.sample_time * MIN_LAG_SAMPLES >= process.time_constant:
        yield "the sample time is not below a tenth of the time constant"


def warnings_of_sensitivity(ms: float) -> Iterator[str]:
    """What an Ms that is too large means."""
    if ms > WARNING_MS:
        yield f"Ms is {ms:.3g}: up to 2 is robust, this loop swings when the process changes a little"


def finite_or_none(value: float) -> float | None:
    """A number for JSON; None where there is no limit."""
    return None if isinf(value) else value
