"""Auto-tune of the DL06, sample by sample: the reaction curve, the relay, and how it ends."""

from __future__ import annotations

from pidcfg.sim.controllers.autotune import (
    ANSWERED,
    LAST_TURN,
    NO_ANSWER,
    PI,
    RELAY_PATIENCE_SAMPLES,
    RELAY_PATIENCE_SECONDS,
    STEP_SHARE,
    TOO_SMALL,
    begin_curve,
    begin_cycle,
    begin_noise,
    curve_gains,
    cycle_gains,
    cycle_length,
    is_stalled,
    judge_response,
    measure_noise,
    record_point,
    relay_switch,
    steepest_line,
    was_moving,
)
from pidcfg.sim.controllers.autotune import POINTS as CURVE
from pidcfg.sim.controllers.dl06.equation import (
    AUTO,
    MANUAL,
    NO_PAST,
    RELAY,
    TUNE,
    TUNE_ERROR,
    TUNING,
    Config,
    State,
    calculate_gains,
    pv_on_sp_scale,
)
from pidcfg.sim.controllers.kernels import ROUNDING_MAGIC, add_notice, clamp, round_half_even, tell_request
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
TUNE_RATE = 40

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
    TUNE_RATE: "auto-tune stopped: the sample rate was changed (D695)",
    TUNE_MOVING: "the PV was moving when the auto-tune began: do not trust its gains (D623)",
}


def restore_output(state: State) -> None:
    """The output of before the auto-tune; after a relay the controller goes on from its old bias (D60).

    The velocity form goes on from that output. Until the noise is known, the output has not been moved.
    """
    if state.tune_phase < RESPONSE:
        return
    state.out = state.tune_out
    if state.pending & RELAY:
        state.unrounded_output = state.tune_out
        state.pending |= NO_PAST


def end_tune(state: State, error: int) -> None:
    """The auto-tune releases the loop; ``error`` is a reason, 0 for success."""
    restore_output(state)
    state.status &= ~TUNING
    state.pending &= ~(TUNE | RELAY)
    state.tune_phase = IDLE
    if error:
        state.status |= TUNE_ERROR
        state.requested_mode = 0
        tell_request(state, error)
    else:
        state.tune_done = 1


def stop_tune(state: State) -> None:
    """Another mode ends an auto-tune before its transfer, which begins from the output of before (D64)."""
    if state.status & TUNING:
        end_tune(state, TUNE_ABORTED)


def change_rate(state: State) -> None:
    """Another sample rate has been written: samples of two rates make no curve and no cycle (D695)."""
    if state.status & TUNING:
        end_tune(state, TUNE_RATE)


def nearest_digit(x: float) -> float:
    """The nearest whole number, half to even; what only a rounding error keeps from a half is one."""
    return round_half_even(round_half_even(x * 1e6) / 1e6)


def write_results(config: Config, state: State, gain: float, reset: float, rate: float, seconds: float) -> None:
    """Write the results to their words: rounded to the last digit, within what the words hold (D65)."""
    state.gain = clamp(nearest_digit(gain * 100.0), 1.0, 9999.0) / 100.0
    steps = clamp(nearest_digit(reset / (config.reset_unit * config.reset_step)), 1.0, 9998.0)
    state.reset = steps * config.reset_step * config.reset_unit
    state.rate = clamp(nearest_digit(rate * 100.0), 0.0, 9999.0) / 100.0
    state.period = int(clamp(nearest_digit(seconds * 100.0) * 10000.0, config.min_period * 1.0, 99990000.0))
    calculate_gains(config, state)
    end_tune(state, 0)


# --- Open-loop auto-tune of the DL06: the reaction curve of a step of the output --------------------------------------
#
# The output steps up by 10 % of its span, to 20 % when the PV settles after less than 2 %. The gains follow from the
# steepest slope R and the dead time L of the response (Ziegler and Nichols).

POINTS = CURVE
"""Floats of a loop's buffer in `aux`."""


def step_output(config: Config, state: State) -> None:
    """Step the output up by another 10 % of its span and start recording."""
    state.tune_step += STEP_SHARE
    wanted = state.tune_out + state.tune_step * config.out_span
    if wanted >= config.out_max:
        end_tune(state, TUNE_FULL_SCALE)
        return
    state.out = wanted + ROUNDING_MAGIC - ROUNDING_MAGIC
    state.tune_phase = RESPONSE
    begin_curve(state)


def measure_response(config: Config, state: State, aux: list[float], change: float) -> None:
    """Slope and dead time of the recorded response, and the gains they give."""
    slope, dead = steepest_line(state, config.tune_buffer, aux, change)
    if slope <= 0.0:
        end_tune(state, TUNE_NO_RESPONSE)
        return
    if was_moving(state, slope, config.span / config.pv_span):
        state.notice = add_notice(state.notice, 0, TUNE_MOVING)
    gain, reset, derivative, sample = curve_gains(config.tune_pi, STEP_SHARE / (dead * (slope / config.span)), dead)
    write_results(config, state, gain, reset, derivative, sample)


def record_response(config: Config, state: State, aux: list[float], pv: float) -> None:
    """One sample of the step response, until it is large enough or settled (D59), or fails to come (D63)."""
    rise = state.tune_base - pv if config.reverse else pv - state.tune_base
    if not record_point(state, config.tune_buffer, aux, rise):
        return
    is_second_step = int(state.tune_step > STEP_SHARE)
    verdict, change = judge_response(
        state, config.tune_buffer, aux, config.span, config.span / config.pv_span, 1.0, is_second_step
    )
    if verdict == ANSWERED:
        measure_response(config, state, aux, change)
    elif verdict == TOO_SMALL:
        state.tune_base += -change if config.reverse else change
        step_output(config, state)
    elif verdict == NO_ANSWER and is_second_step:
        end_tune(state, TUNE_NO_RESPONSE)
    elif verdict == NO_ANSWER:
        step_output(config, state)


# --- Closed-loop auto-tune of the DL06: a relay in place of the controller --------------------------------------------
#
# The output switches between its limits whenever the error changes its sign, for three cycles of which the first is
# left out. Period T and swing X of the PV (both peak to peak, as the output's M) give the ultimate gain 4 M / (pi X).


def begin_relay(config: Config, state: State) -> None:
    """Take the output over; the first switch follows at once. Limits at the ends of the range are reported (D62)."""
    state.tune_phase = SWITCHING
    state.pending |= RELAY
    begin_cycle(state)
    if config.output_high_limit >= config.out_max or config.output_low_limit <= config.out_min:
        state.status |= TUNE_ERROR
        state.requested_mode = 0
        tell_request(state, TUNE_AT_LIMITS)


def run_relay(config: Config, state: State, pv: float, sp: float) -> None:
    """One sample of the relay of three cycles (D60), and their gains (D61); noise widens the hysteresis."""
    band = 3.0 * state.tune_noise if state.tune_noise > 1.0 else 0.0
    side = relay_switch(state, pv, sp - pv, band)
    if side != 0:
        up = side > 0 if config.reverse == 0 else side < 0
        state.out = config.output_high_limit if up else config.output_low_limit
    if state.tune_turns == LAST_TURN:
        swing = state.tune_swing / 2.0
        ultimate = (
            4.0
            * (config.output_high_limit - config.output_low_limit)
            / config.out_span
            / (PI * max(swing, 1.0) / config.span)
        )
        gain, reset, derivative, sample = cycle_gains(
            config.tune_pi, ultimate, cycle_length(state) * state.period / TICKS
        )
        write_results(config, state, gain, reset, derivative, sample)
    elif is_stalled(state, RELAY_PATIENCE_SAMPLES, RELAY_PATIENCE_SECONDS):
        end_tune(state, TUNE_NO_RESPONSE)


# --- Auto-tune of the DL06, sample by sample: start conditions, a look at the noise, then open or closed loop ---------
#
# A few samples measure the noise of the PV before the output is changed: it widens the relay's band and the
# regression of the step response.

START_DISTANCE = 205.0 / 4095.0
"""For the open loop the least distance of the PV below the set point (reverse action: above), for the closed loop the
greatest one on either side, as a share of the span."""


def check_start(config: Config, state: State, pv: float, sp: float) -> None:
    """The start bit: check mode and distance from the set point (D57), then measure the noise."""
    state.status &= ~TUNE_ERROR
    state.tune_done = 0
    deviation = pv - sp if config.reverse else sp - pv
    if state.status & (MANUAL if config.tune_open else AUTO) == 0:
        end_tune(state, REFUSED_TUNE_MODE)
    elif config.tune_open and deviation < START_DISTANCE * config.span:
        end_tune(state, REFUSED_TUNE_DISTANCE)
    elif config.tune_open == 0 and abs(deviation) > START_DISTANCE * config.span:
        end_tune(state, REFUSED_TUNE_APART)
    elif config.tune_open == 0 and config.output_high_limit <= config.output_low_limit:
        end_tune(state, TUNE_NO_SWING)
    else:
        state.status |= TUNING
        state.tune_phase = OBSERVE
        begin_noise(state)


def observe_rest(config: Config, state: State, pv: float) -> None:
    """Estimate the noise from second differences, and the PV at rest from the mean (D58)."""
    if not measure_noise(state, pv):
        return
    state.tune_out = state.out
    state.tune_step = 0.0
    if config.tune_open:
        step_output(config, state)
    else:
        begin_relay(config, state)


def run_autotune(config: Config, state: State, aux: list[float], sp: float) -> None:
    """One sample of the auto-tune; one for the other mode stops it, too (D64)."""
    pv = pv_on_sp_scale(config, state.pv)
    if state.tune_phase == REQUESTED:
        check_start(config, state, pv, sp)
    elif state.status & (MANUAL if config.tune_open else AUTO) == 0:
        end_tune(state, TUNE_ABORTED)
    elif state.tune_phase == OBSERVE:
        observe_rest(config, state, pv)
    elif state.tune_phase == RESPONSE:
        record_response(config, state, aux, pv)
    else:
        run_relay(config, state, pv, sp)
