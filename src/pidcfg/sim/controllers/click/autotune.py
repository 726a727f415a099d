"""Autotune of the CLICK, sample by sample, and how it begins and ends."""

from __future__ import annotations

from pidcfg.schemas.expressions import LARGEST_VALUE
from pidcfg.sim.controllers.autotune import (
    ANSWERED,
    CANCELLED,
    DONE,
    FAILED,
    LAST_TURN,
    NO_ANSWER,
    NOTHING,
    RELAY_PATIENCE_SAMPLES,
    RELAY_PATIENCE_SECONDS,
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
    ultimate_gain,
    was_moving,
)
from pidcfg.sim.controllers.click.equation import (
    AUTO,
    FRESH,
    MODES,
    RANGES,
    TUNE_ERROR,
    TUNING,
    Config,
    State,
    calculate_gains,
)
from pidcfg.sim.controllers.kernels import add_notice, clamp, nearest, single
from pidcfg.sim.controllers.plc import TICKS

# --- How an autotune of the CLICK begins and ends: the output is restored, results go to their registers (D125) -------

IDLE, OBSERVING, RESPONSE, SWITCHING = 0, 1, 2, 3
"""`State.tune_phase`."""

REFUSED_TUNE_MODE = 30
REFUSED_TUNE_RANGE = 31
TUNE_NO_RANGE = 32
TUNE_NO_RESPONSE = 33
TUNE_ABORTED = 34
TUNE_CANCELLED = 35
TUNE_IDLE = 36
TUNE_MOVING = 37
TUNE_RATE = 38

ASCENDING = "the PV limits (DFn+22, DFn+23) and the output limits (DFn+09, DFn+10) must ascend"
REASONS = {
    REFUSED_TUNE_MODE: "autotune refused: it starts in Auto only",
    REFUSED_TUNE_RANGE: f"autotune refused: {ASCENDING}",
    TUNE_NO_RANGE: f"autotune stopped: {ASCENDING}",
    TUNE_NO_RESPONSE: "autotune stopped: the PV does not answer",
    TUNE_ABORTED: "autotune stopped: the loop went to Manual",
    TUNE_CANCELLED: "autotune cancelled: its request was cleared",
    TUNE_IDLE: "no autotune to be cancelled",
    TUNE_RATE: "autotune stopped: the sample rate was changed (D695)",
    TUNE_MOVING: "the PV was moving when the autotune began: do not trust its gains (D623)",
}

LEAST_GAIN, MOST_GAIN = RANGES["proportional_gain"]
LEAST_RESET, MOST_RESET = RANGES["reset_time"]
LEAST_RATE, MOST_RATE = RANGES["derivative_gain"]
LEAST_MS, MOST_MS = RANGES["sample_rate"]
"""What registers without a PID error hold."""


def tunable(config: Config) -> bool:
    """Whether the limits of PV and output are ranges."""
    return (
        0.0 < config.pv_high - config.pv_low <= LARGEST_VALUE
        and 0.0 < config.out_high - config.out_low <= LARGEST_VALUE
    )


def start_tune(state: State) -> None:
    """The loop goes to Autotune; its output is held while the noise of the PV is measured (D123)."""
    state.status = (state.status & ~(MODES | TUNE_ERROR)) | TUNING
    state.tune_phase = OBSERVING
    state.tune_done = NOTHING
    state.tune_out = state.out
    state.tune_step = 0.0
    begin_noise(state)


def restore_output(state: State) -> None:
    """The controller continues from the output before the autotune; its bias is unchanged."""
    state.out = state.tune_out
    state.pending |= FRESH
    state.tune_phase = IDLE


def abandon(state: State) -> None:
    """The autotune ends without results."""
    restore_output(state)
    state.tune_done = CANCELLED


def fail(state: State, reason: int) -> None:
    """Back to Auto with the gains of before."""
    restore_output(state)
    state.tune_done = FAILED
    state.status = (state.status & ~MODES) | AUTO | TUNE_ERROR
    state.requested = 0
    state.notice = add_notice(state.notice, 0, reason)


def change_rate(state: State) -> None:
    """Another sample rate has been written: samples of two rates make no curve and no cycle (D695)."""
    if state.status & TUNING:
        fail(state, TUNE_RATE)


def store(config: Config, state: State, gain: float, reset: float, rate: float, seconds: float) -> None:
    """Write the results, within what the registers hold, and return to Auto."""
    state.gain = single(clamp(gain, LEAST_GAIN, MOST_GAIN))
    state.reset = single(clamp(reset, LEAST_RESET, MOST_RESET))
    state.rate = single(clamp(rate, LEAST_RATE, MOST_RATE))
    state.sample_ms = int(clamp(nearest(seconds * 1000.0), LEAST_MS, MOST_MS))
    state.period = state.sample_ms * 1000
    calculate_gains(config, state)
    restore_output(state)
    state.tune_done = DONE
    state.status = (state.status & ~MODES) | AUTO


# --- Autotune of the CLICK, sample by sample: the noise, then the step response (D123) or the relay (D124) ------------
#
# The output is in %, the PV in its units, so the gain is % per unit; responses count as shares of the PV limits.

RESOLUTION = 1.0 / 4000.0
"""Resolution of the PV, as a share of its range."""
LEAST_SWING = 1e-6
"""Least amplitude of a cycle, as a share of the PV's range."""


def step_output(config: Config, state: State) -> None:
    """Step the output by another 10 % of its range: up, or down where the way up is too short."""
    span = config.out_high - config.out_low
    if state.tune_step == 0.0:
        state.tune_step = STEP if state.tune_out + 2.0 * STEP * span <= config.out_high else -STEP
    else:
        state.tune_step += state.tune_step
    state.out = single(state.tune_out + state.tune_step * span)
    state.tune_phase = RESPONSE
    begin_curve(state)


def begin_relay(state: State) -> None:
    """The first switch follows at the next sample."""
    state.tune_phase = SWITCHING
    begin_cycle(state)


def sign(config: Config, state: State) -> float:
    """1 when the step moves the PV up, else -1."""
    return 1.0 if (state.tune_step > 0.0) == (config.reverse == 0) else -1.0


def measure(config: Config, state: State, aux: list[float], change: float) -> None:
    """Slope and dead time of the recorded response, and the gains they give."""
    slope, dead = steepest_line(state, config.tune_buffer, aux, change)
    if slope <= 0.0:
        fail(state, TUNE_NO_RESPONSE)
        return
    if was_moving(state, slope, 0.0):
        state.notice = add_notice(state.notice, 0, TUNE_MOVING)
    gain, reset, rate, sample = curve_gains(
        config.tune_pi, STEP * (config.out_high - config.out_low) / (dead * slope), dead
    )
    store(config, state, gain, reset, rate, sample)


def respond(config: Config, state: State, aux: list[float]) -> None:
    """One sample of the step response, until there is enough of it or it has settled."""
    if not record(state, config.tune_buffer, aux, sign(config, state) * (state.pv - state.tune_base)):
        return
    span = config.pv_high - config.pv_low
    second = int(abs(state.tune_step) > STEP)
    count = span * RESOLUTION
    verdict, change = judge_response(state, config.tune_buffer, aux, span, count, count, second)
    if verdict == ANSWERED:
        measure(config, state, aux, change)
    elif verdict == TOO_SMALL:
        state.tune_base += sign(config, state) * change
        step_output(config, state)
    elif verdict == NO_ANSWER and second:
        fail(state, TUNE_NO_RESPONSE)
    elif verdict == NO_ANSWER:
        step_output(config, state)


def relay(config: Config, state: State) -> None:
    """One sample of the relay, whose hysteresis is that of DFn+21 in % of the PV limits."""
    span = config.pv_high - config.pv_low
    band = config.tune_hysteresis * span / 100.0
    side = relay_switch(state, state.pv, state.sp - state.pv, band)
    if side:
        state.out = config.out_high if (side > 0) == (config.reverse == 0) else config.out_low
    if state.tune_turns == LAST_TURN:
        ultimate = ultimate_gain(
            state, config.out_high - config.out_low, band, LEAST_SWING * span * (LEAST_SWING * span)
        )
        gain, reset, rate, sample = cycle_gains(config.tune_pi, ultimate, cycle_length(state) * state.period / TICKS)
        store(config, state, gain, reset, rate, sample)
    elif stalled(state, RELAY_PATIENCE_SAMPLES, RELAY_PATIENCE_SECONDS):
        fail(state, TUNE_NO_RESPONSE)


def tune(config: Config, state: State, aux: list[float]) -> None:
    """One sample of the autotune; its limits may be written meanwhile."""
    if not tunable(config):
        fail(state, TUNE_NO_RANGE)
    elif state.tune_phase == OBSERVING:
        if measure_noise(state, state.pv):
            if config.tune_closed:
                begin_relay(state)
            else:
                step_output(config, state)
    elif state.tune_phase == RESPONSE:
        respond(config, state, aux)
    else:
        relay(config, state)
