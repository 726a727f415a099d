"""Open-loop auto-tune of the DL06: the reaction curve of a step of the output.

The output steps up by 10 % of its span, to 20 % when the PV settles after less than 2 %. The response is kept in
`POINTS` averages whose width doubles when they are full. Its steepest slope R is that of a regression line over about a
tenth of the response, its dead time L ends where this line leaves the PV before the step. Ziegler and Nichols make the
gains of both.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.dl06.tune_results import (
    RESPONSE,
    TUNE_FULL_SCALE,
    TUNE_NO_RESPONSE,
    end_tune,
    store,
)
from pidcfg.sim.plc import TICKS
from pidcfg.sim.terms import NEAREST

if TYPE_CHECKING:
    from pidcfg.sim.controllers.dl06.state import Config, State

POINTS = 512
"""Floats of a loop's buffer in `aux`."""
STEP = 0.10
SMALL = 0.02
ENOUGH = 0.10
"""A response of this much of the span is enough to measure its slope."""
PATIENCE = 600.0
"""Seconds, or `PATIENT` samples if those are longer, until a PV that does not move at all is given up (D63)."""
PATIENT = 256


def step_output(c: Config, s: State) -> None:
    """Step the output up by another 10 % of its span and start recording."""
    s.tune_step += STEP
    wanted = s.tune_out + s.tune_step * c.out_span
    if wanted >= c.out_max:
        s.out = s.tune_out
        end_tune(s, TUNE_FULL_SCALE)
        return
    s.out = wanted + NEAREST - NEAREST
    s.tune_phase = RESPONSE
    s.tune_count = 0
    s.tune_points = 0
    s.tune_stride = 1
    s.tune_sum = 0.0


def record(c: Config, s: State, aux: list[float], rise: float) -> bool:
    """Keep one more sample of the response; True when it completes a point."""
    s.tune_count += 1
    s.tune_sum += rise
    if s.tune_count % s.tune_stride:
        return False
    first = c.tune_buffer
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
    """The mean of some points."""
    total = 0.0
    for j in range(first, first + count):
        total += aux[j]
    return total / count


def crossing(c: Config, s: State, aux: list[float], level: float) -> int:
    """The first point at or above a level."""
    for j in range(s.tune_points):
        if aux[c.tune_buffer + j] >= level:
            return j
    return s.tune_points - 1


def measure(c: Config, s: State, aux: list[float], change: float) -> None:
    """Slope and dead time of the recorded response, and the gains they give."""
    need = max(0.1 * change, min(12.0 * s.tune_noise, 0.2 * change))
    width = crossing(c, s, aux, 2.0 * need) - crossing(c, s, aux, need)
    width = min(max(width, 1), s.tune_points - 1)
    spread = width * (width + 1.0) * (width + 2.0) / 12.0
    steepest = 0.0
    at = 0
    for j in range(s.tune_points - width):
        slope = 0.0
        for k in range(width + 1):
            slope += (k - width / 2.0) * aux[c.tune_buffer + j + k]
        if slope > steepest:
            steepest = slope
            at = j
    s.out = s.tune_out
    if steepest <= 0.0:
        end_tune(s, TUNE_NO_RESPONSE)
        return
    seconds = s.period / TICKS
    steepest /= spread
    middle = (at + width / 2.0) * s.tune_stride + (s.tune_stride + 1) / 2.0
    dead = middle - mean(aux, c.tune_buffer + at, width + 1) / steepest * s.tune_stride
    dead = max(dead, 1.0) * seconds
    rate = steepest / (s.tune_stride * seconds) / c.span
    gain = STEP / (dead * rate)
    if c.tune_pi:
        store(c, s, 0.9 * gain, 3.33 * dead, 0.0, 0.12 * dead)
    else:
        store(c, s, 1.2 * gain, 2.0 * dead, 0.5 * dead, 0.056 * dead)


def respond(c: Config, s: State, aux: list[float], p: float) -> None:
    """One sample of the step response, until there is enough of it or it has settled (D59)."""
    rise = s.tune_base - p if c.reverse else p - s.tune_base
    if not record(c, s, aux, rise):
        return
    n = s.tune_points
    few = max(1, n // 12)
    last = c.tune_buffer + n
    change = mean(aux, last - few, few)
    audible = max(4.0 * c.span / c.pv_span, 6.0 * s.tune_noise)
    if change >= ENOUGH * c.span and change >= audible:
        measure(c, s, aux, change)
    elif change > audible and n >= 24:
        moved = change - mean(aux, last - n // 3, few)
        if moved <= max(SMALL * change, s.tune_noise, 1.0):
            if change >= SMALL * c.span or s.tune_step > STEP:
                measure(c, s, aux, change)
            else:
                s.tune_base += -change if c.reverse else change
                step_output(c, s)
    elif s.tune_count > PATIENT and s.tune_count * (s.period / TICKS) > PATIENCE:
        if s.tune_step > STEP:
            s.out = s.tune_out
            end_tune(s, TUNE_NO_RESPONSE)
        else:
            step_output(c, s)
