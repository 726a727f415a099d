"""Auto-tune of the DL06, sample by sample: the reaction curve, the relay, and how it ends."""

from __future__ import annotations

from pidcfg.sim.controllers.autotune import (
    ANSWERED,
    LAST_TURN,
    NO_ANSWER,
    PI,
    RELAY_PATIENCE,
    RELAY_PATIENT,
    STEP,
    TOO_SMALL,
    begin_curve,
    begin_cycle,
    begin_noise,
    curve_gains,
    cycle_gains,
    cycle_length,
    judge_response,
    measure_noise,
    record,
    relay_switch,
    stalled,
    steepest_line,
    was_moving,
)
from pidcfg.sim.controllers.autotune import POINTS as CURVE
from pidcfg.sim.controllers.dl06.equation import (
    AUTO,
    FRESH,
    MANUAL,
    RELAY,
    TUNE,
    TUNE_ERROR,
    TUNING,
    Config,
    State,
    coefficients,
    process,
)
from pidcfg.sim.controllers.kernels import NEAREST, clamp, nearest, noticed, tell_request
from pidcfg.sim.controllers.plc import TICKS

# --- How an auto-tune of the DL06 ends: the output is restored, results go to their words, or a reason is logged ------

IDLE, REQUESTED, OBSERVE, RESPONSE, SWITCHING = 0, 1, 2, 3, 4
"""`State.tune_phase`."""

REFUSED_TUNE_MODE = 30
REFUSED_TUNE_DISTANCE = 31
TUNE_FULL_SCALE = 32
TUNE_NO_RESPONSE = 33
TUNE_ABORTED = 34
TUNE_AT_LIMITS = 35
TUNE_NO_SWING = 36
REFUSED_TUNE_APART = 37
TUNE_MOVING = 38
TUNE_RUNS = 39

REASONS = {
    REFUSED_TUNE_MODE: "auto-tune refused: open loop needs Manual, closed loop needs Auto",
    REFUSED_TUNE_DISTANCE: "auto-tune refused: the PV is not 205 of 4095 counts below SP (direct) or above (reverse)",
    TUNE_FULL_SCALE: "auto-tune stopped: the output step reaches full scale",
    TUNE_NO_RESPONSE: "auto-tune stopped: the PV does not answer",
    TUNE_ABORTED: "auto-tune stopped: the mode was changed",
    TUNE_AT_LIMITS: "auto-tune: the output goes to the ends of its range, which the manual calls an error (+06 bit 13);"
    " the gains are written all the same, output limits inside the range avoid it",
    TUNE_NO_SWING: "auto-tune stopped: output limits leave nothing to switch between",
    REFUSED_TUNE_APART: "auto-tune refused: PV and SP are more than 5 % of full scale (205 of 4095 counts) apart",
    TUNE_RUNS: "auto-tune is running already (D683)",
    TUNE_MOVING: "the PV was moving when the auto-tune began: do not trust its gains (D623)",
}


def end_tune(s: State, error: int) -> None:
    """The auto-tune releases the loop; ``error`` is a reason, 0 for success."""
    s.status &= ~TUNING
    s.busy &= ~(TUNE | RELAY)
    s.tune_phase = IDLE
    if error:
        s.status |= TUNE_ERROR
        s.requested = 0
        tell_request(s, error)
    else:
        s.tune_done = 1


def digits(x: float) -> float:
    """The nearest whole number, half to even; what only a rounding error keeps from a half is one."""
    return nearest(nearest(x * 1e6) / 1e6)


def store(c: Config, s: State, gain: float, reset: float, rate: float, seconds: float) -> None:
    """Write the results to their words: rounded to the last digit, within what the words hold (D65)."""
    s.gain = clamp(digits(gain * 100.0), 1.0, 9999.0) / 100.0
    steps = clamp(digits(reset / (c.reset_unit * c.reset_step)), 1.0, 9998.0)
    s.reset = steps * c.reset_step * c.reset_unit
    s.rate = clamp(digits(rate * 100.0), 0.0, 9999.0) / 100.0
    s.period = int(clamp(digits(seconds * 100.0) * 10000.0, c.least_period * 1.0, 99990000.0))
    coefficients(c, s)
    end_tune(s, 0)


# --- Open-loop auto-tune of the DL06: the reaction curve of a step of the output --------------------------------------
#
# The output steps up by 10 % of its span, to 20 % when the PV settles after less than 2 %. The gains follow from the
# steepest slope R and the dead time L of the response (Ziegler and Nichols).

POINTS = CURVE
"""Floats of a loop's buffer in `aux`."""


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
    begin_curve(s)


def measure(c: Config, s: State, aux: list[float], change: float) -> None:
    """Slope and dead time of the recorded response, and the gains they give."""
    slope, dead = steepest_line(s, c.tune_buffer, aux, change)
    s.out = s.tune_out
    if slope <= 0.0:
        end_tune(s, TUNE_NO_RESPONSE)
        return
    if was_moving(s, slope, c.span / c.pv_span):
        s.notice = noticed(s.notice, 0, TUNE_MOVING)
    gain, reset, derivative, sample = curve_gains(c.tune_pi, STEP / (dead * (slope / c.span)), dead)
    store(c, s, gain, reset, derivative, sample)


def respond(c: Config, s: State, aux: list[float], p: float) -> None:
    """One sample of the step response, until it is large enough or settled (D59), or fails to come (D63)."""
    rise = s.tune_base - p if c.reverse else p - s.tune_base
    if not record(s, c.tune_buffer, aux, rise):
        return
    second = int(s.tune_step > STEP)
    verdict, change = judge_response(s, c.tune_buffer, aux, c.span, c.span / c.pv_span, 1.0, second)
    if verdict == ANSWERED:
        measure(c, s, aux, change)
    elif verdict == TOO_SMALL:
        s.tune_base += -change if c.reverse else change
        step_output(c, s)
    elif verdict == NO_ANSWER and second:
        s.out = s.tune_out
        end_tune(s, TUNE_NO_RESPONSE)
    elif verdict == NO_ANSWER:
        step_output(c, s)


# --- Closed-loop auto-tune of the DL06: a relay in place of the controller --------------------------------------------
#
# The output switches between its limits whenever the error changes its sign, for three cycles of which the first is
# left out. Period T and swing X of the PV (both peak to peak, as the output's M) give the ultimate gain 4 M / (pi X).


def begin_relay(c: Config, s: State) -> None:
    """Take the output over; the first switch follows at once. Limits at the ends of the range are reported (D62)."""
    s.tune_phase = SWITCHING
    s.busy |= RELAY
    begin_cycle(s)
    if c.velocity == 0:
        s.tune_out = s.bias
    if c.m_high >= c.out_max or c.m_low <= c.out_min:
        s.status |= TUNE_ERROR
        s.requested = 0
        tell_request(s, TUNE_AT_LIMITS)


def restore_bias(c: Config, s: State) -> None:
    """The controller continues from the bias before the auto-tune, the velocity form from the output (D60)."""
    if c.velocity == 0:
        s.bias = s.tune_out
    s.m = s.tune_out
    s.busy |= FRESH


def switching(c: Config, s: State, p: float, sp: float) -> None:
    """One sample of the relay of three cycles (D60), and their gains (D61); noise widens the hysteresis."""
    band = 3.0 * s.tune_noise if s.tune_noise > 1.0 else 0.0
    side = relay_switch(s, p, sp - p, band)
    if side != 0:
        up = side > 0 if c.reverse == 0 else side < 0
        s.out = c.m_high if up else c.m_low
    if s.tune_turns == LAST_TURN:
        restore_bias(c, s)
        swing = s.tune_swing / 2.0 - band
        ultimate = 4.0 * (c.m_high - c.m_low) / c.out_span / (PI * max(swing, 1.0) / c.span)
        gain, reset, derivative, sample = cycle_gains(c.tune_pi, ultimate, cycle_length(s) * s.period / TICKS)
        store(c, s, gain, reset, derivative, sample)
    elif stalled(s, RELAY_PATIENT, RELAY_PATIENCE):
        restore_bias(c, s)
        end_tune(s, TUNE_NO_RESPONSE)


# --- Auto-tune of the DL06, sample by sample: start conditions, a look at the noise, then open or closed loop ---------
#
# A few samples measure the noise of the PV before the output is changed: it widens the relay's band and the
# regression of the step response.

DISTANCE = 205.0 / 4095.0
"""For the open loop the least distance of the PV below the set point (reverse action: above), for the closed loop the
greatest one on either side, as a share of the span."""


def check_start(c: Config, s: State, p: float, sp: float) -> None:
    """The start bit: check mode and distance from the set point (D57), then measure the noise."""
    s.status &= ~TUNE_ERROR
    s.tune_done = 0
    below = p - sp if c.reverse else sp - p
    if s.status & (MANUAL if c.tune_open else AUTO) == 0:
        end_tune(s, REFUSED_TUNE_MODE)
    elif c.tune_open and below < DISTANCE * c.span:
        end_tune(s, REFUSED_TUNE_DISTANCE)
    elif c.tune_open == 0 and abs(below) > DISTANCE * c.span:
        end_tune(s, REFUSED_TUNE_APART)
    elif c.tune_open == 0 and c.m_high <= c.m_low:
        end_tune(s, TUNE_NO_SWING)
    else:
        s.status |= TUNING
        s.tune_phase = OBSERVE
        begin_noise(s)


def observe(c: Config, s: State, p: float) -> None:
    """Estimate the noise from second differences, and the PV at rest from the mean (D58)."""
    if not measure_noise(s, p):
        return
    s.tune_out = s.out
    s.tune_step = 0.0
    if c.tune_open:
        step_output(c, s)
    else:
        begin_relay(c, s)


def tune(c: Config, s: State, aux: list[float], sp: float) -> None:
    """One sample of the auto-tune; a change of mode stops it (D64)."""
    p = process(c, s.pv)
    if s.tune_phase == REQUESTED:
        check_start(c, s, p, sp)
    elif s.status & (MANUAL if c.tune_open else AUTO) == 0:
        end_tune(s, TUNE_ABORTED)
    elif s.tune_phase == OBSERVE:
        observe(c, s, p)
    elif s.tune_phase == RESPONSE:
        respond(c, s, aux, p)
    else:
        switching(c, s, p, sp)
