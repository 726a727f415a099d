"""Autotune of the EZLogix: the open-loop answer to a step of the CV by 10 %, in any mode (D178).

A few samples measure the noise of the PV, then the CV steps up; the gains follow from slope and dead time (Ziegler and
Nichols). What Base+12 and the CV are at the end: D179.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.ezlogix import HUNDREDTHS, TENTHS, highest
from pidcfg.schemas.ezlogix import DERIVATIVE, GAIN, INTEGRAL
from pidcfg.sim.controllers.autotune import (
    begin_curve,
    begin_noise,
    curve_gains,
    mean,
    measure_noise,
    record,
    steepest_line,
    was_moving,
)
from pidcfg.sim.controllers.ezlogix.equation import HELD, TUNE, TUNE_ERROR, TUNING, coefficients
from pidcfg.sim.controllers.kernels import nearest, noticed

if TYPE_CHECKING:
    from pidcfg.sim.controllers.ezlogix.equation import Config, State

# The manual's table of Base+12
IDLE, COLLECTING, CALCULATING, DONE, CANCELLED = 0, 1, 2, 3, 4
NO_STEP, NO_FIT, NO_DIVISOR, NO_DEAD_TIME, OUT_OF_RANGE, NO_MEMORY = 5, 6, 7, 8, 9, 10

OBSERVING, RESPOND, COMPUTE = 1, 2, 3
"""`State.tune_phase`."""
ON, OFF = 1, 2
"""`State.tune_command`."""

STEP = 410.0
"""Counts: 10 % of the CV's range."""
ENOUGH = 0.10
"""An answer of this much of the PV's span is enough to measure its slope."""
SMALL = 0.02
DETECTABLE = 4.0
"""Counts that the PV must move by to count as an answer, or six standard deviations of its noise."""
BLOCKS = 6
CLEAR = 8.0
"""Counts, or eight standard deviations, that make a rise between two of these comparable with others."""
REMAINDER = 1.5
"""What a first-order answer comes to, once it rises half as fast as it did."""
SETTLING = 24
"""Points without which nothing counts as settled."""
GAIN_MOST, RESET_MOST, RATE_MOST = highest(GAIN, HUNDREDTHS), highest(INTEGRAL, TENTHS), highest(DERIVATIVE, TENTHS)
"""What the registers may hold by the manual."""
REASON = 32
"""Base+12 as the reason of a notice: it is added to this."""
FAR, MOVING = 7, 8
"""Reasons of notices: an autotune that begins far from the set point (D622), or on a moving PV (D623)."""
NEAR = 0.10
"""Share of the PV's span."""


def end_tune(c: Config, s: State, status: int) -> None:
    """Restore the CV; a loop in Auto continues with its integral term of before."""
    if s.busy & HELD:
        s.out = s.tune_out
    s.busy &= ~(TUNE | HELD)
    s.status &= ~TUNING
    s.tune_status = status
    s.tune_last = status
    s.tune_left = c.timeout
    if status > CANCELLED:
        s.status |= TUNE_ERROR
    if status != DONE:
        s.notice = noticed(s.notice, 0, REASON + status)


def switch_tune(c: Config, s: State) -> None:
    """Discrete +4: on starts, or ends a finished autotune; off cancels one that runs."""
    command = s.tune_command
    s.tune_command = 0
    if s.status & TUNING:
        if command == OFF:
            end_tune(c, s, CANCELLED)
        return
    s.busy &= ~TUNE
    if command == OFF:
        return
    s.status &= ~TUNE_ERROR
    if s.tune_status != IDLE:
        s.tune_status = IDLE
        return
    if s.out + STEP > c.m_high:
        end_tune(c, s, NO_STEP)
        return
    s.busy |= TUNE | HELD
    s.tune_out = s.out
    s.status |= TUNING
    s.tune_status = COLLECTING
    s.tune_left = c.timeout
    s.tune_phase = OBSERVING
    begin_noise(s)
    if abs(s.error) > NEAR * c.pv_span:
        s.notice = noticed(s.notice, 0, FAR)


def tell_moving(s: State, slope: float) -> None:
    """Leave a notice when the PV was moving before the step."""
    if was_moving(s, slope, 1.0):
        s.notice = noticed(s.notice, 0, MOVING)


def fits(gain: float, reset: float, rate: float, only_pi: int) -> bool:
    """Whether results, in last digits of their registers, lie within the manual's ranges and are not 0."""
    if gain < 1.0 or gain > GAIN_MOST or reset < 1.0 or reset > RESET_MOST or rate > RATE_MOST:
        return False
    return only_pi == 1 or rate >= 1.0


def compute(c: Config, s: State, aux: list[float]) -> None:
    """Slope and dead time of the recorded answer, the gains that they give, and their registers."""
    slope, dead = steepest_line(s, c.tune_buffer, aux, s.tune_change)
    tell_moving(s, slope)
    if slope <= 0.0:
        end_tune(c, s, NO_DIVISOR)
        return
    gain, reset, rate, _ = curve_gains(c.tune_pi, STEP / (dead * slope), dead)
    gain = nearest(gain * 100.0)
    reset = nearest(reset * 10.0)
    rate = nearest(rate * 10.0)
    if not fits(gain, reset, rate, c.tune_pi):
        end_tune(c, s, OUT_OF_RANGE)
        return
    s.gain = gain / 100.0
    s.reset = reset / 10.0
    s.rate = rate / 10.0
    s.tune_gain = s.gain
    s.tune_reset = s.reset
    s.tune_rate = s.rate
    coefficients(s)
    end_tune(c, s, DONE)


def flattens(s: State, first: int, aux: list[float]) -> bool:
    """Whether the answer rises half as fast as it did, between sixths of it: the steepest slope lies behind."""
    width = s.tune_points // BLOCKS
    at = first + s.tune_points - width
    above = mean(aux, at, width)
    recent = 0.0
    best = 0.0
    for j in range(1, BLOCKS):
        below = mean(aux, at - j * width, width)
        rise = above - below
        above = below
        if j == 1:
            recent = rise
        if rise > best:
            best = rise
    return best > max(CLEAR, 8.0 * s.tune_noise) and recent <= best / 2.0


def judge_answer(c: Config, s: State, aux: list[float]) -> int:
    """Whether the answer is complete: 0 not yet, 1 it is, 2 it goes the wrong way."""
    n = s.tune_points
    few = max(1, n // 12)
    last = c.tune_buffer + n
    s.tune_change = mean(aux, last - few, few)
    change = abs(s.tune_change)
    detectable = max(DETECTABLE, 6.0 * s.tune_noise)
    if change <= detectable:
        return 0
    settled = False
    if n >= SETTLING:
        moved = abs(s.tune_change - mean(aux, last - n // 3, few))
        settled = moved <= max(SMALL * change, s.tune_noise, 1.0)
    if s.tune_change < 0.0:
        return 2 if settled else 0
    if settled or change >= ENOUGH * c.pv_span:
        return 1
    if n >= SETTLING and flattens(s, c.tune_buffer, aux):
        s.tune_change *= REMAINDER
        return 1
    return 0


def respond(c: Config, s: State, aux: list[float], x: float) -> None:
    """One sample of the answer to the step."""
    rise = s.tune_base - x if c.direct else x - s.tune_base
    if not record(s, c.tune_buffer, aux, rise):
        return
    how = judge_answer(c, s, aux)
    if how == 1:
        s.tune_status = CALCULATING
        s.tune_phase = COMPUTE
    elif how == 2:
        tell_moving(s, 0.0)
        end_tune(c, s, NO_FIT)


def tune(c: Config, s: State, aux: list[float], x: float) -> None:
    """One sample of the autotune; ``x`` is the PV, or its root, in counts of the PV."""
    if s.tune_command:
        switch_tune(c, s)
        if s.status & TUNING == 0:
            return
    if s.tune_phase == COMPUTE:
        compute(c, s, aux)
        return
    if s.tune_left <= 0:
        detected = s.tune_phase == RESPOND and abs(s.tune_change) > max(DETECTABLE, 6.0 * s.tune_noise)
        if detected:
            tell_moving(s, 0.0)
        end_tune(c, s, NO_FIT if detected else NO_DEAD_TIME)
        return
    s.tune_left -= s.period
    if s.tune_phase == RESPOND:
        respond(c, s, aux, x)
    elif measure_noise(s, x):
        s.out = s.tune_out + STEP
        s.tune_change = 0.0
        s.tune_phase = RESPOND
        begin_curve(s)
