"""Autotune of DPIDE, PID_MODE 1: the noise, then a relay around SV (D276), and the operands at its end (D277).

From a cold start the relay begins with heating. It swings between the limits, and where that makes uneven halves of a
cycle evenly around its mean: an oven that heats much faster than it cools would show a far too long period otherwise.
The gain is in units of MV per unit of PV.
"""

from __future__ import annotations

from math import isfinite

from pidcfg.sim.controllers.autotune import (
    CANCELLED,
    DONE,
    FAILED,
    FIRST_TURN,
    LAST_TURN,
    NOTHING,
    begin_cycle,
    begin_noise,
    cycle_length,
    measure_noise,
    relay_switch,
    stalled,
    ultimate_gain,
)
from pidcfg.sim.controllers.dpide.equation import (
    AUTO,
    FRESH,
    MANUAL,
    MODES,
    TUNE_ERROR,
    TUNING,
    Config,
    State,
    calculate_gains,
)
from pidcfg.sim.controllers.kernels import add_notice, clamp, single
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.tuning.tables import TYREUS_LUYBEN

OBSERVING, SWITCHING = 1, 2
"""`State.tune_phase`."""

NO_RANGE, NO_RESPONSE, NO_SWITCH, TOO_FAST, UNEVEN, OUT_OF_RANGE = 16, 17, 18, 19, 20, 21
"""Why there is no result."""
ABANDONED = 22
RATE_WRITTEN = 23
REASONS = {
    NO_RANGE: "autotune stopped: MV_MIN and MV_MAX are the same",
    NO_RESPONSE: "autotune stopped: PV does not answer",
    NO_SWITCH: "autotune stopped: PV does not come to SV",
    TOO_FAST: "autotune stopped: PV swings faster than CYCLE can follow",
    UNEVEN: "autotune stopped: MV does not swing evenly, a limit is too near the MV that holds SV",
    OUT_OF_RANGE: "autotune stopped: a result is no number that its operand can hold",
    RATE_WRITTEN: "autotune stopped: the sampling time was changed (D695)",
    ABANDONED: "autotune ended without results",
}

GAIN, RESET, RATE = TYREUS_LUYBEN["PID"]
"""Of the ultimate gain and its period."""
SMOOTHING = 0.1
"""Tf is this share of the derivative time."""
HYSTERESIS = 4.0
"""The relay's hysteresis in standard deviations of the noise."""
RESPONDS = 6.0
"""A PV that moves by this many standard deviations of its noise answers."""
PATIENCE_SECONDS, PATIENCE_SAMPLES = 600.0, 256
"""Seconds and samples, both, after which a PV that does not move stops the autotune."""
LONGEST, MOST = 14400.0, 1000
"""Seconds and samples, both, after which an error that keeps its sign stops the autotune."""
BALANCE_TURN = 6
"""Switch at which a whole cycle, from `FIRST_TURN` on, tells the mean MV."""
EVEN, TOLERABLE = 0.1, 0.3
"""How far the share of a cycle in which the error is above 0 may be from a half: without another round, and at all."""
ROUNDS = 4
"""Times that the relay is put around its mean at most."""
LEAST_SWING = 0.005
"""Share of the way between the limits that MV moves from its mean at least."""
LEAST_PERIOD = 6.0
"""Samples of a cycle without which it is not measured."""


def start_tune(config: Config, state: State) -> None:
    """MV is held while the noise of PV is measured."""
    state.status &= ~TUNE_ERROR
    state.tune_done = NOTHING
    state.tune_phase = OBSERVING
    state.out = clamp(state.out, config.lowest_mv, config.highest_mv)
    begin_noise(state)


def leave(config: Config, state: State, mode: int) -> None:
    """PID_MODE changes; PID_MAN has an effect again."""
    state.mode = mode
    state.wanted_mode = MANUAL if config.manual else AUTO
    state.status = (state.status & ~MODES) | state.wanted_mode
    state.pending |= FRESH


def fail(config: Config, state: State, reason: int) -> None:
    """The autotune ends without results, and the operands are those of before."""
    state.tune_done = FAILED
    state.tune_reason = reason
    state.status |= TUNE_ERROR
    state.notice = add_notice(state.notice, 0, reason)
    leave(config, state, state.previous_mode)


def change_rate(config: Config, state: State) -> None:
    """Another sampling time has been written: samples of two of them make no cycle (D695)."""
    if state.status & TUNING:
        fail(config, state, RATE_WRITTEN)


def abandon(state: State) -> None:
    """The autotune is ended by the operator or the program."""
    state.tune_done = CANCELLED
    state.notice = add_notice(state.notice, 0, ABANDONED)


def usable(value: float) -> bool:
    """Whether a result is a number above 0."""
    return value > 0.0 and isfinite(value)


def store(config: Config, state: State, ultimate: float, period: float, mean: float) -> None:
    """Results to their operands, and I_MV such that the algorithm goes on around the mean MV."""
    gain = single(GAIN * ultimate)
    reset = single(RESET * period)
    rate = single(RATE * period)
    tf = single(SMOOTHING * rate)
    if config.dependent == 0:
        reset = single(gain / reset)
        rate = single(gain * rate)
    if not (usable(gain) and usable(reset) and usable(rate) and usable(tf)):
        fail(config, state, OUT_OF_RANGE)
        return
    state.gain = gain
    state.reset = reset
    state.rate = rate
    state.filter_time = tf
    state.tune_gain = gain
    state.tune_reset = reset
    state.tune_rate = rate
    state.tune_tf = tf
    calculate_gains(config, state)
    state.integral = single(single(mean) - state.bias)
    state.tune_done = DONE
    leave(config, state, 0)


def mean(state: State) -> float:
    """MV over the cycles that count so far."""
    return state.tune_sum / (state.tune_count - state.tune_start)


def uneven(state: State) -> float:
    """How far the share of MV's higher value is from a half of the cycle."""
    return abs((mean(state) - state.tune_mv_low) / (state.tune_mv_high - state.tune_mv_low) - 0.5)


def measure(config: Config, state: State) -> None:
    """The ultimate cycle from the relay's, which has come to its end."""
    samples = cycle_length(state)
    amplitude = state.tune_swing / 4.0
    if amplitude <= 0.0:
        fail(config, state, NO_RESPONSE)
    elif samples < LEAST_PERIOD:
        fail(config, state, TOO_FAST)
    elif uneven(state) > TOLERABLE:
        fail(config, state, UNEVEN)
    else:
        ultimate = ultimate_gain(
            state, state.tune_mv_high - state.tune_mv_low, state.tune_band, amplitude * amplitude / 4.0
        )
        store(config, state, ultimate, samples * (state.period / TICKS), mean(state))


def begin_relay(state: State, low: float, high: float) -> None:
    """It switches between these from the next sample on."""
    state.tune_mv_low = single(low)
    state.tune_mv_high = single(high)
    begin_cycle(state)


def balance(config: Config, state: State, middle: float) -> None:
    """From now on MV swings as far up from its mean as down: both halves of the cycle then last equally long."""
    way = max(
        min(middle - config.lowest_mv, config.highest_mv - middle), LEAST_SWING * (config.highest_mv - config.lowest_mv)
    )
    state.tune_rounds += 1
    begin_relay(state, max(config.lowest_mv, middle - way), min(config.highest_mv, middle + way))


def relay(config: Config, state: State, error: float) -> None:
    """One sample of the relay: the higher MV while the error is above 0, else the lower one."""
    side = relay_switch(state, state.pv, error, state.tune_band)
    if side:
        if state.tune_turns == BALANCE_TURN and state.tune_rounds < ROUNDS and uneven(state) > EVEN:
            balance(config, state, mean(state))
        state.out = clamp(state.tune_mv_high if side > 0 else state.tune_mv_low, config.lowest_mv, config.highest_mv)
        state.tune_base = state.pv
        state.tune_pv_change = 0.0
    if state.tune_turns >= LAST_TURN:
        measure(config, state)
        return
    if state.tune_turns == FIRST_TURN and side:
        state.tune_sum = 0.0
    state.tune_sum += state.out
    state.tune_pv_change = max(state.tune_pv_change, abs(state.pv - state.tune_base))
    if state.tune_pv_change <= RESPONDS * state.tune_noise and stalled(state, PATIENCE_SAMPLES, PATIENCE_SECONDS):
        fail(config, state, NO_RESPONSE)
    elif stalled(state, MOST, LONGEST):
        fail(config, state, NO_SWITCH)


def tune(config: Config, state: State, error: float) -> None:
    """One sample of the autotune; ``error`` is the error without the dead band."""
    if config.lowest_mv >= config.highest_mv:
        fail(config, state, NO_RANGE)
    elif state.tune_phase == OBSERVING:
        if measure_noise(state, state.pv):
            state.tune_band = HYSTERESIS * state.tune_noise
            state.tune_phase = SWITCHING
            state.tune_rounds = 0
            begin_relay(state, config.lowest_mv, config.highest_mv)
    else:
        relay(config, state, error)
