"""What a DPIDE instruction knows and calculates: its records and its equation, in single precision."""

from __future__ import annotations

from collections.abc import MutableSequence
from dataclasses import dataclass
from math import isfinite, isnan

from pidcfg.sim.controllers.kernels import LoopConfig, RelayState, add_notice, clamp, finite, register, single
from pidcfg.sim.controllers.plc import TICKS

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
FRESH = 1
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
    sv_from: int = -1
    """The loop whose MV shares the device of SV, so that it writes SV (D266); -1: none; likewise the next two."""
    bias_from: int = -1
    mout_from: int = -1
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
# The manual: The PID algorithm, and PID Block Diagram. D numbers: see `dpide.ENGINE`.

NOTABLE = 0.01
"""Share of the way between the limits that MV moves by at most without a word when manual ends (D272)."""
JUMPS_WITHOUT = 2
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
    if state.pending & FRESH:
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
        state.pending |= FRESH
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
        and abs(state.out - previous_output) > NOTABLE * (config.highest_mv - config.lowest_mv)
    ):
        state.notice = add_notice(state.notice, 0, JUMPS_WITHOUT)
    state.pending &= ~(FRESH | FROM_MANUAL)


# --- The signals of a DPIDE instruction: what its operands hold -------------------------------------------------------


def show_signals(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """Renew them; what is no number is shown as 0 (kernel)."""
    signals[config.pv_slot] = finite(state.pv, 0.0)
    signals[config.sp_slot] = state.sp
    signals[config.out_slot] = state.out
    signals[config.mout_slot] = state.mout
    signals[config.bias_slot] = state.integral
    signals[config.error_slot] = finite(state.error, 0.0)
