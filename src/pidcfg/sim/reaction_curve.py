"""The answer of a process to a step of its input, recorded in little memory: steepest slope and dead time.

The response is kept in `POINTS` averages whose width doubles when they are full. Its steepest slope is that of a
regression line over about a tenth of the response; its dead time ends where this line leaves the PV before the step.
Kernels; ``first`` is the place of the points in ``aux``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.plc import TICKS

if TYPE_CHECKING:
    from pidcfg.sim.records import CurveState

POINTS = 512
"""Floats of a curve in `aux`."""
STEP = 0.10
"""Share of the output's span that it steps by; twice that when the answer is too small."""
SMALL = 0.02
"""An answer that settles below this share of the span is too small."""
ENOUGH = 0.10
"""A response of this much of the span is enough to measure its slope."""
PATIENCE = 600.0
"""Seconds, or `PATIENT` samples if those are longer, after which a PV that does not move stops the auto-tune."""
PATIENT = 256
MOVING = 0.10
"""Share of the answer's slope by which the PV may move before the step."""
SURE = 4.0 / 340.0**0.5
"""Four standard deviations of the slope a sample, of 16 samples with a noise of 1."""
ROUNDING = 0.3
"""Standard deviation of what rounding to whole counts adds."""
GOES_ON, ANSWERED, TOO_SMALL, NO_ANSWER = 0, 1, 2, 3
"""Results of `judge_response`."""


def begin_curve(s: CurveState) -> None:
    """Before the first sample after the step (kernel)."""
    s.tune_count = 0
    s.tune_points = 0
    s.tune_stride = 1
    s.tune_sum = 0.0


def record(s: CurveState, first: int, aux: list[float], rise: float) -> bool:
    """Keep one more sample of the response; True when it completes a point (kernel)."""
    s.tune_count += 1
    s.tune_sum += rise
    if s.tune_count % s.tune_stride:
        return False
    if s.tune_points == POINTS:
        for j in range(POINTS // 2):
            aux[first + j] = (aux[first + 2 * j] + aux[first + 2 * j + 1]) / 2.0
        s.tune_points = POINTS // 2
        s.tune_stride *= 2
        if s.tune_count % s.tune_stride:
            return False
    aux[first + s.tune_points] = s.tune_sum / s.tune_stride
    s.tune_points += 1
    s.tune_sum = 0.0
    return True


def mean(aux: list[float], first: int, count: int) -> float:
    """The mean of some points (kernel)."""
    total = 0.0
    for j in range(first, first + count):
        total += aux[j]
    return total / count


def crossing(s: CurveState, first: int, aux: list[float], level: float) -> int:
    """The first point at or above a level (kernel)."""
    for j in range(s.tune_points):
        if aux[first + j] >= level:
            return j
    return s.tune_points - 1


def steepest_line(s: CurveState, first: int, aux: list[float], change: float) -> tuple[float, float]:
    """Slope a second of the steepest line, 0 when there is none, and the dead time in s, at least a sample (kernel)."""
    need = max(0.1 * change, min(12.0 * s.tune_noise, 0.2 * change))
    width = crossing(s, first, aux, 2.0 * need) - crossing(s, first, aux, need)
    width = min(max(width, 1), s.tune_points - 1)
    spread = width * (width + 1.0) * (width + 2.0) / 12.0
    steepest = 0.0
    at = 0
    for j in range(s.tune_points - width):
        slope = 0.0
        for k in range(width + 1):
            slope += (k - width / 2.0) * aux[first + j + k]
        if slope > steepest:
            steepest = slope
            at = j
    if steepest <= 0.0:
        return 0.0, 0.0
    steepest /= spread
    seconds = s.period / TICKS
    middle = (at + width / 2.0) * s.tune_stride + (s.tune_stride + 1) / 2.0
    dead = middle - mean(aux, first + at, width + 1) / steepest * s.tune_stride
    return steepest / (s.tune_stride * seconds), max(dead, 1.0) * seconds


def was_moving(s: CurveState, slope: float, count: float) -> bool:
    """Whether the PV moved before the step by a tenth of the ``slope`` a second, and surely (kernel).

    Surely: by four standard deviations of the slope of 16 samples; ``count`` is the resolution of the PV.
    """
    drift = abs(s.tune_drift)
    return drift > MOVING * slope * (s.period / TICKS) and drift > SURE * max(s.tune_noise, ROUNDING * count)


def judge_response(
    s: CurveState, first: int, aux: list[float], span: float, count: float, rest: float, last_step: int
) -> tuple[int, float]:
    """The judgement of a response at one of its points, and its change so far (kernel).

    ``count`` is the resolution of the PV and ``rest`` what a PV at rest may still move; after the ``last_step`` every
    answer above the noise counts.
    """
    n = s.tune_points
    few = max(1, n // 12)
    last = first + n
    change = mean(aux, last - few, few)
    detectable = max(4.0 * count, 6.0 * s.tune_noise)
    if change >= ENOUGH * span and change >= detectable:
        return ANSWERED, change
    if change > detectable and n >= 24:
        moved = change - mean(aux, last - n // 3, few)
        if moved <= max(SMALL * change, s.tune_noise, rest):
            if last_step or change >= SMALL * span:
                return ANSWERED, change
            return TOO_SMALL, change
    elif s.tune_count > PATIENT and s.tune_count * (s.period / TICKS) > PATIENCE:
        return NO_ANSWER, change
    return GOES_ON, change
