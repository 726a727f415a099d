"""What a DPIDE instruction knows and calculates: its records, its equation in single precision, and its autotune."""

from __future__ import annotations

from collections.abc import MutableSequence
from dataclasses import dataclass
from math import isfinite, isnan

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
    is_stalled,
    measure_noise,
    relay_switch,
    ultimate_gain,
)
from pidcfg.sim.controllers.kernels import LoopConfig, RelayState, add_notice, clamp, finite_or, register, single
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.tuning import TYREUS_LUYBEN

# ----------------------------------------------------------------------------------------------------------------------
# Records of a DPIDE instruction: `Config` (operands that it reads) and `State` (operands and memory that it writes).
# REAL operands are what single precision holds; the clock is in ticks of a microsecond. Everything is an int or a
# float: the same fields become a NumPy record for numba.

# `State.status`
MANUAL, AUTO, TUNING, OFF = 1, 2, 4, 8
MODES = MANUAL | AUTO | TUNING | OFF
LIMITED = 16
"""What the algorithm, or MOUT, makes of MV is beyond MV_MIN or MV_MAX."""
IN_DEAD_BAND = 32
"""PV has crossed SV inside the dead band: the error counts as 0."""
TUNE_ERROR = 64
"""The last autotune ended without results."""

# What is pending besides the equation (`State.pending`)
NO_PAST = 1
"""The next calculation of the algorithm has no past."""
REQUEST = 2
"""`State.wanted_mode` is another mode."""
HALTING = 4
"""PID_RUN has become FALSE, which acts at once."""
FROM_MANUAL = 8
"""The next calculation of the algorithm is the first one after manual."""
STOPPED = 16
"""The PLC is stopped."""


@dataclass(slots=True)
class Config(LoopConfig):
    """The operands that an instruction only reads."""

    mout_slot: int = 4
    bias_slot: int = 5
    """I_MV."""
    error_slot: int = 6
    manual: int = register("PID_MAN", 0)
    mout_follows: int = register("MOUT_AUTO", 0)
    mout_is_mv: int = 0
    """MOUT stands in the device of this loop's MV: both are one value (D266)."""
    dependent: int = register("PID_EQ", 0)
    derivative_on_pv: int = register("PID_DE", 0)
    """The derivative is that of PV."""
    forward_action: int = register("PID_DIR", 0)
    """E = SV - PV."""
    sv_writer: int = -1
    """The loop whose MV shares the device of SV, so that it writes SV (D266); -1: none; likewise the next two."""
    bias_writer: int = -1
    mout_writer: int = -1
    dead_band: float = 0.0
    """The absolute value of ERR_DBW."""
    lowest_mv: float = 0.0
    """The lower one of MV_MIN and MV_MAX."""
    highest_mv: float = 0.0


@dataclass(slots=True)
class State(RelayState):
    """What an instruction writes."""

    mode: int = register("PID_MODE", 0)
    previous_mode: int = 0
    """PID_MODE before it became 1."""
    wanted_mode: int = AUTO
    """The mode that PID_RUN, PID_MODE and PID_MAN make."""
    sp: float = register("SV", 0.0)
    gain: float = register("Kc_Kp", 1.0)
    reset: float = register("Ti_Ki", 0.0)
    rate: float = register("Td_Kd", 0.0)
    filter_time: float = register("Tf", 0.0)
    mout: float = register("MOUT", 0.0)
    bias: float = register("BIAS", 0.0)
    integral: float = register("I_MV", 0.0)
    out: float = register("MV", 0.0)
    # factors
    sampling_time: float = 1.0
    """Ts in s."""
    filter_share: float = 1.0
    """Of the derivative's smoothing, Ts / (Tf + Ts)."""
    # past
    error: float = 0.0
    """The error as it counts."""
    previous_error: float = 0.0
    """I_MV+1: the error of the calculation before, as it counted."""
    previous_pv: float = 0.0
    """I_MV+6."""
    smoothed_derivative: float = 0.0
    error_sign: float = 0.0
    """Sign of the last error that was not 0; 0: there was none."""
    sv_crossed: int = 0
    """PV has crossed SV since it came into the dead band."""
    # autotune
    tune_reason: int = 0
    """Why it ended without results."""
    tune_band: float = 0.0
    """The relay's hysteresis."""
    tune_mv_low: float = 0.0
    """MV while the error is below 0; the next one while it is above."""
    tune_mv_high: float = 0.0
    tune_rounds: int = 0
    """Times that the halves of the cycle were uneven."""
    tune_pv_change: float = 0.0
    """How far PV has come since the relay switched."""
    tune_gain: float = 0.0
    """Result of the last successful autotune, as in the operand; likewise the next three."""
    tune_reset: float = 0.0
    tune_rate: float = 0.0
    tune_tf: float = 0.0


# --- The equation of DPIDE, every result rounded to single precision as it arises (D265) ------------------------------
#
# MV = P + I_MV + D + BIAS. Independent: P = Kp E, I_MV sums Ki E Ts, D = Kd x. Dependent: P = Kc E, I_MV sums Kc/Ti E
# Ts, D = Kc Td x. x, ``slope``, is the derivative of the error, or that of PV with the sign that makes it act like one.
# The manual: The PID algorithm, and PID Block Diagram. D numbers: see `dpide.ENGINE_DECISIONS`.

BUMP_SHARE = 0.01
"""Share of the way between the limits that MV moves by at most without a word when manual ends (D272)."""
MV_JUMPS = 2
"""Notice of `calculate_mv`."""


def calculate_gains(config: Config, state: State) -> None:
    """The factors of the equation; what is below 0 counts as 0."""
    # The PID algorithm: dependent formula Kc, Kc Ts/Ti, Kc Td; independent formula Kp, Ki Ts, Kd
    seconds = single(state.period / TICKS)
    gain = max(0.0, state.gain)
    rate = max(0.0, state.rate)
    state.kp = gain
    state.ki = 0.0
    if config.dependent:
        if state.reset > 0.0:
            state.ki = single(single(gain * seconds) / state.reset)
        state.kd = single(gain * rate)
    else:
        if state.reset > 0.0:
            state.ki = single(state.reset * seconds)
        state.kd = rate
    state.sampling_time = seconds
    state.filter_share = single(seconds / single(state.filter_time + seconds)) if state.filter_time > 0.0 else 1.0


def apply_dead_band(config: Config, state: State, error: float) -> float:
    """The error as it counts: 0 inside the dead band once PV has crossed SV there (D268)."""
    # Additional remarks, 6: the error counts until PV has gone beyond SV inside ERR_DBW
    if -config.dead_band < error < config.dead_band:
        if state.error_sign * error < 0.0:
            state.sv_crossed = 1
    else:
        state.sv_crossed = 0
    if error > 0.0:
        state.error_sign = 1.0
    elif error < 0.0:
        state.error_sign = -1.0
    if state.sv_crossed:
        state.status |= IN_DEAD_BAND
        return 0.0
    state.status &= ~IN_DEAD_BAND
    return error


def calculate_slope(config: Config, state: State, error: float) -> float:
    """What the derivative's gain is multiplied with; the first one is 0 (D267), the gain comes last (D686)."""
    # D267: first derivative is 0
    if state.pending & NO_PAST:
        state.smoothed_derivative = 0.0
        state.previous_error = error
        state.previous_pv = state.pv
    # PID_DE: dE; or dPV, minus with forward action (E = SV - PV), plus with reverse action (E = PV - SV)
    if config.derivative_on_pv == 0:
        change = single(error - state.previous_error)
    elif state.sv_crossed:
        change = 0.0
    elif config.forward_action:
        change = single(state.previous_pv - state.pv)
    else:
        change = single(state.pv - state.previous_pv)
    state.previous_error = error
    state.previous_pv = state.pv
    slope = single(change / state.sampling_time)
    # Tf: derivative smoothing
    if state.filter_share < 1.0:
        slope = single(
            state.smoothed_derivative + single(state.filter_share * single(slope - state.smoothed_derivative))
        )
    state.smoothed_derivative = slope
    return slope


def restore_integral(state: State, output: float, proportional_term: float, derivative_term: float) -> None:
    """I_MV as it is when MV is ``output`` (D270)."""
    integral = single(single(single(output - proportional_term) - derivative_term) - state.bias)
    if isfinite(integral):
        state.integral = integral


def calculate_mv(config: Config, state: State, error: float) -> None:
    """MV of the algorithm, and I_MV with its anti-windup; what is no number is not written (D265, D689)."""
    # PID Block Diagram: PID-P, PID-D, PID-I
    previous_output = state.out
    slope = calculate_slope(config, state, error)
    proportional_term = single(state.kp * error)
    derivative_term = single(state.kd * slope) if state.kd > 0.0 else 0.0
    integral = 0.0
    if state.ki > 0.0:
        if state.pending & FROM_MANUAL:
            restore_integral(state, previous_output, proportional_term, derivative_term)
        integral = single(state.integral + single(state.ki * error))
    else:
        # D271: without Ti_Ki I_MV is 0
        state.integral = 0.0
    # The sum: MV = P + I_MV + D + BIAS
    output = single(single(single(proportional_term + integral) + derivative_term) + state.bias)
    if isnan(output):
        state.out = clamp(previous_output, config.lowest_mv, config.highest_mv)
        state.pending |= NO_PAST
        return
    # MV_LIMIT: MV_MAX, MV_MIN
    if config.lowest_mv <= output <= config.highest_mv:
        state.status &= ~LIMITED
        state.out = output
        state.integral = integral
    else:
        state.status |= LIMITED
        state.out = config.highest_mv if output > config.highest_mv else config.lowest_mv
        # beyond them D269: PID_MODE 0 holds I_MV; D270: PID_MODE 2 works it out of MV
        if state.ki > 0.0 and state.mode == 2:
            restore_integral(state, state.out, proportional_term, derivative_term)
    if (
        state.pending & FROM_MANUAL
        and state.ki <= 0.0
        and abs(state.out - previous_output) > BUMP_SHARE * (config.highest_mv - config.lowest_mv)
    ):
        state.notice = add_notice(state.notice, 0, MV_JUMPS)
    state.pending &= ~(NO_PAST | FROM_MANUAL)


# --- The signals of a DPIDE instruction: what its operands hold -------------------------------------------------------


def show_signals(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """Renew them; what is no number is shown as 0 (kernel)."""
    signals[config.pv_slot] = finite_or(state.pv, 0.0)
    signals[config.sp_slot] = state.sp
    signals[config.out_slot] = state.out
    signals[config.mout_slot] = state.mout
    signals[config.bias_slot] = state.integral
    signals[config.error_slot] = finite_or(state.error, 0.0)


# --- Autotune of DPIDE, PID_MODE 1: the noise, then a relay around SV (D276), and the operands at its end (D277) ------
#
# From a cold start the relay begins with heating. It swings between the limits, and where that makes uneven halves of a
# cycle evenly around its mean: an oven that heats much faster than it cools would show a far too long period otherwise.
# The gain is in units of MV per unit of PV.

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

GAIN_FACTOR, RESET_FACTOR, RATE_FACTOR = TYREUS_LUYBEN["PID"]
"""Of the ultimate gain and its period."""
SMOOTHING_SHARE = 0.1
"""Tf is this share of the derivative time."""
HYSTERESIS_SIGMAS = 4.0
"""The relay's hysteresis in standard deviations of the noise."""
RESPONSE_SIGMAS = 6.0
"""A PV that moves by this many standard deviations of its noise answers."""
PATIENCE_SECONDS, PATIENCE_SAMPLES = 600.0, 256
"""Seconds and samples, both, after which a PV that does not move stops the autotune."""
SIGN_SECONDS, SIGN_SAMPLES = 14400.0, 1000
"""Seconds and samples, both, after which an error that keeps its sign stops the autotune."""
BALANCE_TURN = 6
"""Switch at which a whole cycle, from `FIRST_TURN` on, tells the mean MV."""
REBALANCE_LIMIT, MAX_IMBALANCE = 0.1, 0.3
"""How far the share of a cycle in which the error is above 0 may be from a half: without another round, and at all."""
MAX_ROUNDS = 4
"""Times that the relay is put around its mean at most."""
MIN_SWING = 0.005
"""Share of the way between the limits that MV moves from its mean at least."""
MIN_PERIOD = 6.0
"""Samples of a cycle without which it is not measured."""


def start_tune(config: Config, state: State) -> None:
    """MV is held while the noise of PV is measured."""
    state.status &= ~TUNE_ERROR
    state.tune_done = NOTHING
    state.tune_phase = OBSERVING
    state.out = clamp(state.out, config.lowest_mv, config.highest_mv)
    begin_noise(state)


def leave_tuning(config: Config, state: State, mode: int) -> None:
    """PID_MODE changes; PID_MAN has an effect again."""
    state.mode = mode
    state.wanted_mode = MANUAL if config.manual else AUTO
    state.status = (state.status & ~MODES) | state.wanted_mode
    state.pending |= NO_PAST


def fail_autotune(config: Config, state: State, reason: int) -> None:
    """The autotune ends without results, and the operands are those of before."""
    state.tune_done = FAILED
    state.tune_reason = reason
    state.status |= TUNE_ERROR
    state.notice = add_notice(state.notice, 0, reason)
    leave_tuning(config, state, state.previous_mode)


def change_rate(config: Config, state: State) -> None:
    """Another sampling time has been written: samples of two of them make no cycle (D695)."""
    if state.status & TUNING:
        fail_autotune(config, state, RATE_WRITTEN)


def abandon_autotune(state: State) -> None:
    """The autotune is ended by the operator or the program."""
    state.tune_done = CANCELLED
    state.notice = add_notice(state.notice, 0, ABANDONED)


def is_usable(value: float) -> bool:
    """Whether a result is a number above 0."""
    return value > 0.0 and isfinite(value)


def write_results(config: Config, state: State, ultimate: float, period: float, mean: float) -> None:
    """Results to their operands, and I_MV such that the algorithm goes on around the mean MV."""
    gain = single(GAIN_FACTOR * ultimate)
    reset = single(RESET_FACTOR * period)
    rate = single(RATE_FACTOR * period)
    tf = single(SMOOTHING_SHARE * rate)
    if config.dependent == 0:
        reset = single(gain / reset)
        rate = single(gain * rate)
    if not (is_usable(gain) and is_usable(reset) and is_usable(rate) and is_usable(tf)):
        fail_autotune(config, state, OUT_OF_RANGE)
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
    leave_tuning(config, state, 0)


def mean_mv(state: State) -> float:
    """MV over the cycles that count so far."""
    return state.tune_sum / (state.tune_count - state.tune_start)


def imbalance(state: State) -> float:
    """How far the share of MV's higher value is from a half of the cycle."""
    return abs((mean_mv(state) - state.tune_mv_low) / (state.tune_mv_high - state.tune_mv_low) - 0.5)


def measure_cycle(config: Config, state: State) -> None:
    """The ultimate cycle from the relay's, which has come to its end."""
    samples = cycle_length(state)
    amplitude = state.tune_swing / 4.0
    if amplitude <= 0.0:
        fail_autotune(config, state, NO_RESPONSE)
    elif samples < MIN_PERIOD:
        fail_autotune(config, state, TOO_FAST)
    elif imbalance(state) > MAX_IMBALANCE:
        fail_autotune(config, state, UNEVEN)
    else:
        ultimate = ultimate_gain(
            state, state.tune_mv_high - state.tune_mv_low, state.tune_band, amplitude * amplitude / 4.0
        )
        write_results(config, state, ultimate, samples * (state.period / TICKS), mean_mv(state))


def begin_relay(state: State, low: float, high: float) -> None:
    """It switches between these from the next sample on."""
    state.tune_mv_low = single(low)
    state.tune_mv_high = single(high)
    begin_cycle(state)


def balance_relay(config: Config, state: State, middle: float) -> None:
    """From now on MV swings as far up from its mean as down: both halves of the cycle then last equally long."""
    way = max(
        min(middle - config.lowest_mv, config.highest_mv - middle), MIN_SWING * (config.highest_mv - config.lowest_mv)
    )
    state.tune_rounds += 1
    begin_relay(state, max(config.lowest_mv, middle - way), min(config.highest_mv, middle + way))


def run_relay(config: Config, state: State, error: float) -> None:
    """One sample of the relay: the higher MV while the error is above 0, else the lower one."""
    side = relay_switch(state, state.pv, error, state.tune_band)
    if side:
        if state.tune_turns == BALANCE_TURN and state.tune_rounds < MAX_ROUNDS and imbalance(state) > REBALANCE_LIMIT:
            balance_relay(config, state, mean_mv(state))
        state.out = clamp(state.tune_mv_high if side > 0 else state.tune_mv_low, config.lowest_mv, config.highest_mv)
        state.tune_base = state.pv
        state.tune_pv_change = 0.0
    if state.tune_turns >= LAST_TURN:
        measure_cycle(config, state)
        return
    if state.tune_turns == FIRST_TURN and side:
        state.tune_sum = 0.0
    state.tune_sum += state.out
    state.tune_pv_change = max(state.tune_pv_change, abs(state.pv - state.tune_base))
    if state.tune_pv_change <= RESPONSE_SIGMAS * state.tune_noise and is_stalled(
        state, PATIENCE_SAMPLES, PATIENCE_SECONDS
    ):
        fail_autotune(config, state, NO_RESPONSE)
    elif is_stalled(state, SIGN_SAMPLES, SIGN_SECONDS):
        fail_autotune(config, state, NO_SWITCH)


def run_autotune(config: Config, state: State, error: float) -> None:
    """One sample of the autotune; ``error`` is the error without the dead band."""
    if config.lowest_mv >= config.highest_mv:
        fail_autotune(config, state, NO_RANGE)
    elif state.tune_phase == OBSERVING:
        if measure_noise(state, state.pv):
            state.tune_band = HYSTERESIS_SIGMAS * state.tune_noise
            state.tune_phase = SWITCHING
            state.tune_rounds = 0
            begin_relay(state, config.lowest_mv, config.highest_mv)
    else:
        run_relay(config, state, error)
