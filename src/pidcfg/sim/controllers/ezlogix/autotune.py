"""Autotune of the EZLogix: the open-loop answer to a step of the CV by 10 %, in any mode (D178).

A few samples measure the noise of the PV, then the CV steps up; the gains follow from slope and dead time (Ziegler and
Nichols). What Base+12 and the CV are at the end: D179.
"""

from __future__ import annotations

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
from pidcfg.sim.controllers.ezlogix.equation import HELD, TUNE, TUNE_ERROR, TUNING, Config, State, calculate_gains
from pidcfg.sim.controllers.kernels import add_notice, nearest

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
PLC_STOPPED, RATE_WRITTEN = 9, 10
"""Reasons of notices: a stop of the PLC (D173) or another sample rate (D695) has ended an autotune."""
NEAR = 0.10
"""Share of the PV's span."""


def restore(config: Config, state: State, status: int) -> None:
    """End the autotune with the CV of before; a loop in Auto continues with its integral term of before."""
    if state.pending & HELD:
        state.out = state.tune_out
    state.pending &= ~(TUNE | HELD)
    state.status &= ~TUNING
    state.tune_status = status
    state.tune_last = status
    state.tune_countdown = config.timeout
    if status > CANCELLED:
        state.status |= TUNE_ERROR


def end_tune(config: Config, state: State, status: int) -> None:
    """End the autotune, and tell of one without results."""
    restore(config, state, status)
    if status != DONE:
        state.notice = add_notice(state.notice, 0, REASON + status)


def stop_tune(config: Config, state: State) -> None:
    """The PLC runs again: an autotune that it has stopped does not go on, since samples are missing (D173)."""
    if state.status & TUNING:
        restore(config, state, CANCELLED)
        state.notice = add_notice(state.notice, 0, PLC_STOPPED)


def change_rate(config: Config, state: State) -> None:
    """Another sample rate has been written: samples of two rates make no curve (D695)."""
    if state.status & TUNING:
        restore(config, state, NO_FIT)
        state.notice = add_notice(state.notice, 0, RATE_WRITTEN)


def switch_tune(config: Config, state: State) -> None:
    """Discrete +4: on starts, or ends a finished autotune; off cancels one that runs."""
    command = state.tune_command
    state.tune_command = 0
    if state.status & TUNING:
        if command == OFF:
            end_tune(config, state, CANCELLED)
        return
    state.pending &= ~TUNE
    if command == OFF:
        return
    state.status &= ~TUNE_ERROR
    if state.tune_status != IDLE:
        state.tune_status = IDLE
        return
    if state.out + STEP > config.cv_high_limit:
        end_tune(config, state, NO_STEP)
        return
    state.pending |= TUNE | HELD
    state.tune_out = state.out
    state.status |= TUNING
    state.tune_status = COLLECTING
    state.tune_countdown = config.timeout
    state.tune_phase = OBSERVING
    begin_noise(state)
    if abs(state.error) > NEAR * config.pv_span:
        state.notice = add_notice(state.notice, 0, FAR)


def tell_moving(state: State, slope: float) -> None:
    """Leave a notice when the PV was moving before the step."""
    if was_moving(state, slope, 1.0):
        state.notice = add_notice(state.notice, 0, MOVING)


def fits(gain: float, reset: float, rate: float, only_pi: int) -> bool:
    """Whether results, in last digits of their registers, lie within the manual's ranges and are not 0."""
    if gain < 1.0 or gain > GAIN_MOST or reset < 1.0 or reset > RESET_MOST or rate > RATE_MOST:
        return False
    return only_pi == 1 or rate >= 1.0


def compute(config: Config, state: State, aux: list[float]) -> None:
    """Slope and dead time of the recorded answer, the gains that they give, and their registers."""
    slope, dead = steepest_line(state, config.tune_buffer, aux, state.tune_change)
    tell_moving(state, slope)
    if slope <= 0.0:
        end_tune(config, state, NO_DIVISOR)
        return
    gain, reset, rate, _ = curve_gains(config.tune_pi, STEP / (dead * slope), dead)
    gain = nearest(gain * 100.0)
    reset = nearest(reset * 10.0)
    rate = nearest(rate * 10.0)
    if not fits(gain, reset, rate, config.tune_pi):
        end_tune(config, state, OUT_OF_RANGE)
        return
    state.gain = gain / 100.0
    state.reset = reset / 10.0
    state.rate = rate / 10.0
    state.tune_gain = state.gain
    state.tune_reset = state.reset
    state.tune_rate = state.rate
    calculate_gains(state)
    end_tune(config, state, DONE)


def flattens(state: State, first: int, aux: list[float]) -> bool:
    """Whether the answer rises half as fast as it did, between sixths of it: the steepest slope lies behind."""
    width = state.tune_points // BLOCKS
    at = first + state.tune_points - width
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
    return best > max(CLEAR, 8.0 * state.tune_noise) and recent <= best / 2.0


def judge_answer(config: Config, state: State, aux: list[float]) -> int:
    """Whether the answer is complete: 0 not yet, 1 it is, 2 it goes the wrong way."""
    n = state.tune_points
    few = max(1, n // 12)
    last = config.tune_buffer + n
    state.tune_change = mean(aux, last - few, few)
    change = abs(state.tune_change)
    detectable = max(DETECTABLE, 6.0 * state.tune_noise)
    if change <= detectable:
        return 0
    settled = False
    if n >= SETTLING:
        moved = abs(state.tune_change - mean(aux, last - n // 3, few))
        settled = moved <= max(SMALL * change, state.tune_noise, 1.0)
    if state.tune_change < 0.0:
        return 2 if settled else 0
    if settled or change >= ENOUGH * config.pv_span:
        return 1
    if n >= SETTLING and flattens(state, config.tune_buffer, aux):
        state.tune_change *= REMAINDER
        return 1
    return 0


def respond(config: Config, state: State, aux: list[float], x: float) -> None:
    """One sample of the answer to the step."""
    rise = state.tune_base - x if config.direct else x - state.tune_base
    if not record(state, config.tune_buffer, aux, rise):
        return
    how = judge_answer(config, state, aux)
    if how == 1:
        state.tune_status = CALCULATING
        state.tune_phase = COMPUTE
    elif how == 2:
        tell_moving(state, 0.0)
        end_tune(config, state, NO_FIT)


def tune(config: Config, state: State, aux: list[float], x: float) -> None:
    """One sample of the autotune; ``x`` is the PV, or its root, in counts of the PV."""
    if state.tune_command:
        switch_tune(config, state)
        if state.status & TUNING == 0:
            return
    if state.tune_phase == COMPUTE:
        compute(config, state, aux)
        return
    if state.tune_countdown <= 0:
        detected = state.tune_phase == RESPOND and abs(state.tune_change) > max(DETECTABLE, 6.0 * state.tune_noise)
        if detected:
            tell_moving(state, 0.0)
        end_tune(config, state, NO_FIT if detected else NO_DEAD_TIME)
        return
    state.tune_countdown -= state.period
    if state.tune_phase == RESPOND:
        respond(config, state, aux, x)
    elif measure_noise(state, x):
        state.out = state.tune_out + STEP
        state.tune_change = 0.0
        state.tune_phase = RESPOND
        begin_curve(state)
