"""The loop as a PLC runs it: samples, a held output, the PV's filter, and the vendor's difference equation.

All five families add up the integral with the present error in it and take the difference to the last sample as the
derivative, so that one equation serves them: u(n) = Kp (f(n) + Ts/Ti sum f + Td/Ts (y(n) - y(n-1))), with f the
filtered error and y the derivative's own filter. They differ in the filters, which `Sampling` holds. The process is
exact for an output that is held from sample to sample, with a dead time of any length.
"""

from __future__ import annotations

from cmath import exp as turn
from dataclasses import dataclass
from math import exp, expm1, floor, inf, isclose, log10, pi
from typing import TYPE_CHECKING

from pidcfg.refs import Decision
from pidcfg.tuning.margins import TURNS, Margins, gain_margin, peak, phase_margin

if TYPE_CHECKING:
    from pidcfg.tuning.rules import Gains, Process

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

PER_DEAD_TIME, PER_TIME_CONSTANT, SHORTEST, LONGEST = 10, 100, 0.1, 20.0
ALIKE = 1e-6
"""Two time constants nearer than this are set apart by as much: their modes would cancel."""
LAST_DIGITS = 1e-9
DECADES_BELOW, PER_DECADE, PER_RADIAN = 3, 60, 8
"""Of the frequencies that are looked at: below the slowest time, of each decade, and of each radian of delay."""
Mode = tuple[float, float, float]
"""x(n+1) = a x(n) + b u(n-d) + c u(n-d-1)."""
NO_MODE: Mode = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Sampling:
    """How a loop samples and filters: s, and shares of what is new that a filter takes in each sample."""

    sample_time: float
    pv_share: float = 1.0
    derivative_share: float = 1.0
    derivative_limit: float | None = None
    """The derivative's filter has the derivative time over this, by Ts/(Ts + Td/limit); None: it has not."""

    def lag(self, derivative_time: float) -> float:
        """The share that the derivative's filter takes."""
        if self.derivative_limit is None:
            return self.derivative_share
        return self.sample_time / (self.sample_time + derivative_time / self.derivative_limit)


@dataclass(frozen=True, slots=True)
class Held:
    """A process from sample to sample, as the sum of two first-order modes behind the same delay."""

    modes: tuple[Mode, Mode]
    delay: int
    """Whole samples."""
    sample_time: float
    slowest: float
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


def held(process: Process, sample_time: float) -> Held:
    """A process behind an output that is held; its gain counts without a sign."""
    samples = process.dead_time / sample_time
    delay = floor(samples + LAST_DIGITS)
    late = max(0.0, (samples - delay) * sample_time)
    slowest = process.time_constant + process.second_time_constant + process.dead_time + sample_time
    modes = [_mode(gain, lag, sample_time, late) for gain, lag in _parts(process)]
    first, second, *_ = (*modes, NO_MODE)
    return Held((first, second), delay, sample_time, slowest, process.dead_time)


def _parts(process: Process) -> list[tuple[float, float]]:
    """Gain and time constant of the lags that add up to a process; infinite: an integrator, with its slope."""
    gain, second = abs(process.gain), process.second_time_constant
    if process.integrating:
        slope = abs(process.slope)
        return [(slope, inf), (-slope * second, second)] if second else [(slope, inf)]
    first = process.time_constant
    if not second:
        return [(gain, first)]
    if isclose(first, second, rel_tol=ALIKE):
        second = first * (1 + ALIKE)
    return [(gain * first / (first - second), first), (-gain * second / (first - second), second)]


def _mode(gain: float, lag: float, sample_time: float, late: float) -> Mode:
    """A lag over one sample, in which the output of the sample before still acts for ``late`` s."""
    rest = sample_time - late
    if lag == inf:
        return 1.0, gain * rest, gain * late
    fresh = -expm1(-rest / lag)
    return exp(-sample_time / lag), gain * fresh, gain * exp(-rest / lag) * -expm1(-late / lag)


@dataclass(frozen=True, slots=True)
class SampledLoop:
    """The open loop of a controller on a process, at frequencies in rad/s up to half the sample frequency."""

    gains: Gains
    plant: Held
    sampling: Sampling

    def __call__(self, w: float) -> complex:
        """The open loop at a frequency."""
        z = turn(complex(0, w * self.sampling.sample_time))
        return self.gains.gain * self.controller(z) * filtered(self.plant, self.sampling, z)

    def controller(self, z: complex) -> complex:
        """The controller without its gain and the PV's filter."""
        gains, back = self.gains, 1 / z
        value = 1 + self.sampling.sample_time / gains.integral_time / (1 - back)
        if not gains.derivative_time:
            return value
        return value + gains.derivative_time * difference(back, self.sampling, gains.derivative_time)


def filtered(plant: Held, sampling: Sampling, z: complex) -> complex:
    """The process behind its hold and before the PV's filter."""
    return plant(z) * sampling.pv_share / (1 - (1 - sampling.pv_share) / z)


def difference(back: complex, sampling: Sampling, derivative_time: float) -> complex:
    """The difference to the last sample, per s, behind the derivative's filter; ``back`` is 1/z."""
    lag = sampling.lag(derivative_time)
    return (1 - back) / sampling.sample_time * lag / (1 - (1 - lag) * back)


def frequencies(plant: Held) -> tuple[list[float], list[float]]:
    """From where the loop is an integrator, close enough for every turn of the dead time; and from there to the end.

    In the second list every phase comes by, so that only |L| counts.
    """
    top = pi / plant.sample_time * (1 - LAST_DIGITS)
    ratio = 10 ** (1 / PER_DECADE)
    step = 1 / PER_RADIAN / (plant.dead_time + plant.sample_time)
    followed = min(top, TURNS / plant.dead_time if plant.dead_time else top)
    w = 10**-DECADES_BELOW / plant.slowest
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
    return inf if loudest >= 1 else max(peak(loop, near, [loop(w) for w in near]), 1 / (1 - loudest), 1.0)


def sampled_margins(loop: SampledLoop) -> Margins:
    """How robust a stable loop is."""
    near, beyond = frequencies(loop.plant)
    loudest = max((abs(loop(w)) for w in beyond), default=0.0)
    margin = min(gain_margin(loop, near), 1 / loudest if loudest else inf)
    return Margins(highest_sensitivity(loop), margin, phase_margin(loop, near))


def default_sample_time(process: Process) -> float:
    """A tenth of the dead time, or a hundredth of the time constant, rounded down to 1, 2, 5, 10 and so on."""
    constant = 0.0 if process.integrating else process.time_constant
    wanted = min(max(process.dead_time / PER_DEAD_TIME, constant / PER_TIME_CONSTANT, SHORTEST), LONGEST)
    decade = 10.0 ** floor(log10(wanted) + 1e-9)
    return float(f"{max(n * decade for n in (1, 2, 5) if n * decade <= wanted * (1 + 1e-9)):.3g}")
