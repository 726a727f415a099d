"""Both auto-tune procedures of the DL06, as a state machine of one sample.

Open loop (in Manual): the output steps up by 10 % of its span, to 20 % when the PV settles after less than 2 %; the
steepest slope R of the response and its dead time L give the gains by Ziegler and Nichols. The response is kept in
`POINTS` averages whose width doubles when they are full. The slope is that of a regression line over a tenth of the
response, the dead time is where this line leaves the PV before the step.

Closed loop (in Auto): the output switches between its limits whenever the error changes its sign, for three cycles; the
first one is left out. Period T and swing X of the PV give the ultimate gain 4 M / (pi X).

Before either, `OBSERVED` samples tell the noise of the PV: it widens the relay's switching band and the regression.
"""

from __future__ import annotations

from pidcfg.sim.controllers.dl06_equation import coefficients, process
from pidcfg.sim.controllers.dl06_modes import tell
from pidcfg.sim.controllers.dl06_state import (
    AUTO,
    FRESH,
    MANUAL,
    NEAREST,
    RELAY,
    TICKS,
    TUNE,
    TUNE_ERROR,
    TUNING,
    Config,
    State,
)
from pidcfg.sim.terms import clamp, nearest

POINTS = 512
"""Floats of a loop's buffer in `aux`."""
OBSERVED = 16
IDLE, WANTED, OBSERVE, RESPONSE, SWITCHING = 0, 1, 2, 3, 4
"""`State.tune_phase`."""

DISTANCE = 205.0 / 4095.0
"""How far the PV must be away from the set point, on the side that a step of the output moves it away from."""
STEP = 0.10
SMALL = 0.02
ENOUGH = 0.10
"""A response of this much of the span is enough to measure its slope."""
PI = 3.141592653589793
SECOND_DIFFERENCE = 1.9544
"""Mean of |y(n) - 2 y(n-1) + y(n-2)| of white noise in standard deviations: sqrt(6) sqrt(2 / pi)."""
PATIENCE = 600.0
"""Seconds, or `PATIENT` samples if those are longer, until a PV that does not move at all is given up."""
PATIENT = 256
RELAY_PATIENCE = 3600.0
RELAY_PATIENT = 1000

REFUSED_TUNE_MODE = 30
REFUSED_TUNE_DISTANCE = 31
TUNE_FULL_SCALE = 32
TUNE_NO_RESPONSE = 33
TUNE_ABORTED = 34
TUNE_AT_LIMITS = 35
TUNE_NO_SWING = 36

REASONS = {
    REFUSED_TUNE_MODE: "auto-tune refused: open loop needs Manual, closed loop needs Auto",
    REFUSED_TUNE_DISTANCE: "auto-tune refused: the PV is not 205 of 4095 counts below SP (direct) or above (reverse)",
    TUNE_FULL_SCALE: "auto-tune stopped: the output step reaches full scale",
    TUNE_NO_RESPONSE: "auto-tune stopped: the PV does not answer",
    TUNE_ABORTED: "auto-tune stopped: the mode was changed",
    TUNE_AT_LIMITS: "auto-tune: the output goes to the limits of the data range",
    TUNE_NO_SWING: "auto-tune stopped: output limits leave nothing to switch between",
}


def end_tune(s: State, error: int) -> None:
    """Give the output back; ``error`` is a reason, 0 for success."""
    s.status &= ~TUNING
    s.busy &= ~(TUNE | RELAY)
    s.tune_phase = IDLE
    if error:
        s.status |= TUNE_ERROR
        s.requested = 0
        tell(s, error)
    else:
        s.tune_done = 1


def store(c: Config, s: State, gain: float, reset: float, rate: float, seconds: float) -> None:
    """Write the results to their words: rounded to the last digit, within what the words hold."""
    s.gain = clamp(nearest(gain * 100.0), 1.0, 9999.0) / 100.0
    digits = clamp(nearest(reset / (c.reset_unit * c.reset_step)), 1.0, 9998.0)
    s.reset = digits * c.reset_step * c.reset_unit
    s.rate = clamp(nearest(rate * 100.0), 0.0, 9999.0) / 100.0
    s.period = int(clamp(nearest(seconds * 100.0) * 10000.0, c.least_period * 1.0, 99990000.0))
    coefficients(c, s)
    end_tune(s, 0)


def want(c: Config, s: State, p: float, sp: float) -> None:
    """The start bit: check the conditions, then observe."""
    s.status &= ~TUNE_ERROR
    s.tune_done = 0
    below = p - sp if c.reverse else sp - p
    if s.status & (MANUAL if c.tune_open else AUTO) == 0:
        end_tune(s, REFUSED_TUNE_MODE)
    elif c.tune_open and below < DISTANCE * c.span:
        end_tune(s, REFUSED_TUNE_DISTANCE)
    elif c.tune_open == 0 and c.m_high <= c.m_low:
        end_tune(s, TUNE_NO_SWING)
    else:
        s.status |= TUNING
        s.tune_phase = OBSERVE
        s.tune_count = 0
        s.tune_sum = 0.0
        s.tune_base = 0.0


def observe(c: Config, s: State, p: float) -> None:
    """Estimate the noise from second differences, and the PV at rest from the mean."""
    if s.tune_count >= 2:
        s.tune_sum += abs(p - 2.0 * s.tune_a + s.tune_b)
    s.tune_b = s.tune_a
    s.tune_a = p
    s.tune_base += p
    s.tune_count += 1
    if s.tune_count < OBSERVED:
        return
    s.tune_noise = s.tune_sum / (OBSERVED - 2.0) / SECOND_DIFFERENCE
    s.tune_base /= OBSERVED
    s.tune_out = s.out
    s.tune_step = 0.0
    if c.tune_open:
        step_output(c, s)
    else:
        begin_relay(c, s)


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


def respond(c: Config, s: State, aux: list[float], p: float) -> None:
    """One sample of the step response, until there is enough of it or it has settled."""
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


def crossing(c: Config, s: State, aux: list[float], level: float) -> int:
    """The first point at or above a level."""
    for j in range(s.tune_points):
        if aux[c.tune_buffer + j] >= level:
            return j
    return s.tune_points - 1


def measure(c: Config, s: State, aux: list[float], change: float) -> None:
    """Slope and dead time of the recorded response, and the gains they give."""
    need = max(0.1 * change, 6.0 * s.tune_noise)
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


def begin_relay(c: Config, s: State) -> None:
    """Take the output over; the first switch follows at once."""
    s.tune_phase = SWITCHING
    s.busy |= RELAY
    s.tune_count = 0
    s.tune_turns = 0
    s.tune_side = 0
    s.tune_points = 0
    s.tune_swing = 0.0
    if c.velocity == 0:
        s.tune_out = s.bias
    if c.m_high >= c.out_max or c.m_low <= c.out_min:
        s.status |= TUNE_ERROR
        s.requested = 0
        tell(s, TUNE_AT_LIMITS)


def turn(c: Config, s: State, side: int) -> None:
    """The error changed its sign: switch the output, and close a half cycle."""
    s.tune_side = side
    up = side > 0 if c.reverse == 0 else side < 0
    s.out = c.m_high if up else c.m_low
    s.tune_turns += 1
    s.tune_points = s.tune_count
    if s.tune_turns == 4:
        s.tune_start = s.tune_count
    elif s.tune_turns in (6, 8):
        s.tune_swing += s.tune_high - s.tune_low
    if s.tune_turns % 2 == 0:
        s.tune_high = -1e18
        s.tune_low = 1e18


def switching(c: Config, s: State, p: float, sp: float) -> None:
    """One sample of the relay."""
    seconds = s.period / TICKS
    s.tune_count += 1
    e = sp - p
    band = 3.0 * s.tune_noise if s.tune_noise > 1.0 else 0.0
    if s.tune_turns:
        s.tune_high = max(s.tune_high, p)
        s.tune_low = min(s.tune_low, p)
    if s.tune_side == 0:
        turn(c, s, -1 if e < 0.0 else 1)
    elif s.tune_side > 0 and e < -band:
        turn(c, s, -1)
    elif s.tune_side < 0 and e > band:
        turn(c, s, 1)
    quiet = s.tune_count - s.tune_points
    if s.tune_turns == 8:
        s.bias = s.tune_out
        s.m = s.tune_out
        s.busy |= FRESH
        swing = s.tune_swing / 2.0 - (3.0 * s.tune_noise if s.tune_noise > 1.0 else 0.0)
        period = (s.tune_count - s.tune_start) / 2.0 * seconds
        gain = 4.0 * (c.m_high - c.m_low) / c.out_span / (PI * max(swing, 1.0) / c.span)
        if c.tune_pi:
            store(c, s, 0.30 * gain, 1.00 * period, 0.0, 0.03 * period)
        else:
            store(c, s, 0.45 * gain, 0.60 * period, 0.10 * period, 0.014 * period)
    elif quiet > RELAY_PATIENT and quiet * seconds > RELAY_PATIENCE:
        s.bias = s.tune_out
        s.m = s.tune_out
        s.busy |= FRESH
        end_tune(s, TUNE_NO_RESPONSE)


def tune(c: Config, s: State, aux: list[float], sp: float) -> None:
    """One sample of the auto-tune."""
    p = process(c, s.pv)
    if s.tune_phase == WANTED:
        want(c, s, p, sp)
    elif s.status & (MANUAL if c.tune_open else AUTO) == 0:
        end_tune(s, TUNE_ABORTED)
    elif s.tune_phase == OBSERVE:
        observe(c, s, p)
    elif s.tune_phase == RESPONSE:
        respond(c, s, aux, p)
    else:
        switching(c, s, p, sp)
