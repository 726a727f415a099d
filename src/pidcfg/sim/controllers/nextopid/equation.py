"""One call of PIDA_REAL, PIDA_INT, PIDA_TUNE_REAL or PIDA_TUNE_INT, and its auto-tuning.

In this order: error bits, limits of PV and set point, the three actions, the auto-tuning, then MV by what has priority:
auto-tuning, manual, tracking, override, automatic (D225). The parameters stand among the signals in single precision.
Sections are those of the manual's chapter 2, PIDA_REAL. D numbers: see `nextopid.PID_DECISIONS`.
"""

from __future__ import annotations

from collections.abc import MutableSequence, Sequence
from math import isfinite

from pidcfg.schemas.nextopid import TUNE_LIMITS
from pidcfg.sim.controllers.kernels import finite_or, single
from pidcfg.sim.controllers.nextopid.terms import (
    AUTO_MODE,
    AUTO_TUNE,
    BIAS,
    CASC,
    CASCADE_MODE,
    D_ACTION,
    DEAD_BAND,
    DIRECT,
    DOWNWARD_BITS,
    FLAG_COUNT,
    I_ACTION,
    INDEP,
    MANUAL,
    MANUAL_MODE,
    MANUAL_MV,
    MAX_MV,
    MAX_PV,
    MIN_MV,
    MIN_PV,
    MODES,
    MV,
    OVERR,
    OVERRIDDEN,
    P_ACTION,
    PIDA_TUNE_INT,
    PIDA_TUNE_REAL,
    SAMPLE_TIME,
    TRACKING_MODE,
    TRK_IN,
    TRK_OUT,
    TRK_VAL,
    TUNE_DONE,
    TUNE_ERROR,
    TUNE_FLAGS,
    TUNE_PARAM,
    TUNE_RESULT,
    TUNING_MODE,
    UPWARD_BITS,
    WINDUP_H_OUT,
    WINDUP_L_OUT,
    Config,
    State,
    accepted_increment,
    bad_limits,
    copy_mv,
    derivative_action,
    integral_for_mv,
    integral_gain,
    integral_increment,
    limit_inputs_to_range,
    limit_mv,
    negative_parameters,
    proportional_action,
    round_mv,
    sum_actions,
    write_errors,
    write_warnings,
)
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.tuning import NEXTOPID_P, NEXTOPID_PART, NEXTOPID_TD, NEXTOPID_TI

# --- How an auto-tuning ends: flags, results, and the reset of both. D numbers: see `nextopid.PID_DECISIONS` ----------

IDLE, AVERAGING, RELAY, DONE, FAILED = 0, 1, 2, 3, 4
"""`State.tune_phase`; FAILED is an end with AutoTuneError."""

# Flags of AutoTuneResult, in the order of the table
BAD_AMP, BAD_HYST, BAD_PEAK, BAD_CYCLES, BAD_MODE = 1, 2, 4, 8, 16
MV_TOO_HIGH, MV_TOO_LOW, PV_TOO_HIGH, PV_TOO_LOW = 32, 64, 128, 256
PEAK_TOO_HIGH, PEAK_TOO_LOW, PV_NOT_STEADY, CYCLE_TOO_FAST, HIGH_DEAD_TIME = 512, 1024, 2048, 4096, 8192

P_ONLY, PI_ONLY, FULL_PID = 0, 1, 2
"""AUTOTUNE_MODE."""

PI = single(3.141592653589793)
MIN_CYCLE_SAMPLES = 10
"""Samples that a cycle has at least (D233)."""
MIN_DEAD_TIMES = 1.5
"""Dead times that a half cycle has at least (D233)."""
P_GAIN_FACTOR = single(NEXTOPID_P)
PI_GAIN_DIVISOR, TI_FACTOR, TD_DIVISOR = single(NEXTOPID_PART), single(NEXTOPID_TI), single(NEXTOPID_TD)
"""Kp = Ku / 3.2, Ti = 2.2 Pu, Td = Pu / 6.3 (D234)."""


def clear_results(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """AutoTuneDone, AutoTuneError and AutoTuneResult as they are without auto-tuning (kernel)."""
    base = config.base
    state.tune_phase = IDLE
    state.tune_relay_sign = 0
    signals[base + TUNE_DONE] = 0.0
    signals[base + TUNE_ERROR] = 0.0
    for i in range(3):
        signals[base + TUNE_RESULT + i] = 0.0
    for i in range(FLAG_COUNT):
        signals[base + TUNE_FLAGS + i] = 0.0


def end_tune(config: Config, state: State, signals: MutableSequence[float], flags: int) -> None:
    """The auto-tuning has ended, with an error if there are flags; MV is what it was (kernel)."""
    base = config.base
    state.tune_relay_sign = 0
    state.tune_phase = FAILED if flags else DONE
    signals[base + TUNE_DONE] = 1.0
    signals[base + TUNE_ERROR] = 1.0 if flags else 0.0
    for i in range(FLAG_COUNT):
        signals[base + TUNE_FLAGS + i] = float((flags >> i) & 1)


def quality_flags(state: State, samples: int, amplitude: float) -> int:
    """Flags of a measurement whose results cannot be trusted (kernel, D233)."""
    flags = 0
    if amplitude < single(2.0 * state.tune_band):
        flags |= PEAK_TOO_LOW
    if samples < MIN_CYCLE_SAMPLES * state.tune_cycles:
        flags |= CYCLE_TOO_FAST
    if samples < MIN_DEAD_TIMES * state.tune_dead_samples:
        flags |= HIGH_DEAD_TIME
    return flags


def calculate_results(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """Gain and times from amplitude and period of the measured cycles (kernel, D234)."""
    base = config.base
    samples = state.tune_count - state.tune_start
    amplitude = single(state.tune_swing / (2 * state.tune_cycles))
    period = single(single(samples * config.sample_time) / state.tune_cycles)
    if amplitude <= 0.0:
        end_tune(config, state, signals, PEAK_TOO_LOW)
        return
    ultimate = single(single(4.0 * abs(state.tune_step)) / single(PI * amplitude))
    kp = single(P_GAIN_FACTOR * ultimate) if state.tune_mode == P_ONLY else single(ultimate / PI_GAIN_DIVISOR)
    ti = 0.0
    td = 0.0
    if state.tune_mode != P_ONLY:
        ti = single(TI_FACTOR * period)
    if state.tune_mode == FULL_PID:
        td = single(period / TD_DIVISOR)
    if signals[base + INDEP] != 0.0:
        ti = single(kp / ti) if ti > 0.0 else 0.0
        td = single(kp * td)
    signals[base + TUNE_RESULT] = kp
    signals[base + TUNE_RESULT + 1] = ti
    signals[base + TUNE_RESULT + 2] = td
    end_tune(config, state, signals, quality_flags(state, samples, amplitude))


# ----------------------------------------------------------------------------------------------------------------------
# Auto-tuning of PIDA_TUNE_REAL and PIDA_TUNE_INT, call by call: three seconds at rest, then a relay (D230 to D234).
# Everything of the PV is counted from its rest, RefPV. `State.tune_relay_sign` is 1 while the relay drives the PV up,
# -1 while it drives it down, else 0; `State.tune_step` is M, negative for direct control. D numbers: see
# `nextopid.PID_DECISIONS`.

FREE, HOLDS, ABORTED, ENDED = 0, 1, 2, 3
"""What the auto-tuning is to MV: nothing, it holds it, or AutoTune has just been reset before or after the end."""

AMP, HYST, PEAK, CYCLES, MODE = 0, 1, 2, 3, 4
"""Members of AutoTuneParam."""
(MIN_AMP, MAX_AMP), (MIN_HYST, MAX_HYST), (MIN_PEAK, MAX_PEAK), (MIN_CYCLES, MAX_CYCLES) = (
    (single(float(low)), single(float(high))) for low, high in TUNE_LIMITS.values()
)
"""The manual's ranges, in the order of the members."""
REST_TICKS = 3 * TICKS
"""How long RefPV is averaged."""
FIRST_RETURN = 2
"""The switch with which the first measured cycle begins."""


def bad_parameters(signals: Sequence[float], first: int) -> int:
    """Flags of parameters that are out of range (kernel)."""
    flags = 0
    if not MIN_AMP <= signals[first + AMP] <= MAX_AMP:
        flags |= BAD_AMP
    if not MIN_HYST <= signals[first + HYST] <= MAX_HYST:
        flags |= BAD_HYST
    if not MIN_PEAK <= signals[first + PEAK] <= MAX_PEAK:
        flags |= BAD_PEAK
    if not MIN_CYCLES <= signals[first + CYCLES] <= MAX_CYCLES:
        flags |= BAD_CYCLES
    if not P_ONLY <= signals[first + MODE] <= FULL_PID:
        flags |= BAD_MODE
    return flags


def percent_of_range(percentage: float, low: float, high: float) -> float:
    """So many percent of a range (kernel)."""
    return single(single(percentage * single(high - low)) / 100.0)


def begin_autotune(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """The rising edge: RefMV is the present MV, and the parameters are taken as they are (kernel, D230)."""
    base = config.base
    first = base + TUNE_PARAM
    flags = bad_parameters(signals, first)
    step = round_mv(config, percent_of_range(signals[first + AMP], signals[base + MIN_MV], signals[base + MAX_MV]))
    if config.is_integer and step == 0.0:
        flags |= BAD_AMP
    state.tune_out = state.out
    state.tune_step = -step if signals[base + DIRECT] != 0.0 else step
    if flags & BAD_AMP == 0:
        if single(state.out + step) > signals[base + MAX_MV]:
            flags |= MV_TOO_HIGH
        if single(state.out - step) < signals[base + MIN_MV]:
            flags |= MV_TOO_LOW
    if flags:
        end_tune(config, state, signals, flags)
        return
    state.tune_phase = AVERAGING
    state.tune_band = percent_of_range(signals[first + HYST], signals[base + MIN_PV], signals[base + MAX_PV])
    state.tune_max_deviation = percent_of_range(signals[first + PEAK], signals[base + MIN_PV], signals[base + MAX_PV])
    state.tune_cycles = int(signals[first + CYCLES])
    state.tune_mode = int(signals[first + MODE])
    state.tune_count = 0
    state.tune_sum = 0.0
    state.tune_base = state.pv
    state.tune_low = 0.0
    state.tune_high = 0.0


def average_pv(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """One sample at rest; after three seconds the relay takes its first step (kernel, D230, D692)."""
    state.tune_count += 1
    deviation = single(state.pv - state.tune_base)
    if state.tune_count * config.period < REST_TICKS:
        state.tune_sum = single(state.tune_sum + deviation)
        state.tune_low = min(state.tune_low, deviation)
        state.tune_high = max(state.tune_high, deviation)
        return
    mean = single(state.tune_sum / state.tune_count)
    flags = 0
    if single(state.tune_high - mean) > state.tune_band or single(mean - state.tune_low) > state.tune_band:
        flags |= PV_NOT_STEADY
    state.tune_base = single(state.tune_base + mean)
    if single(state.tune_base + state.tune_band) > signals[config.base + MAX_PV]:
        flags |= PV_TOO_HIGH
    if single(state.tune_base - state.tune_band) < signals[config.base + MIN_PV]:
        flags |= PV_TOO_LOW
    if abs(single(state.pv - state.tune_base)) > state.tune_max_deviation:
        flags |= PEAK_TOO_HIGH
    if flags:
        end_tune(config, state, signals, flags)
        return
    state.tune_phase = RELAY
    state.tune_relay_sign = 1
    state.tune_count = 0
    state.tune_turns = 0
    state.tune_dead_samples = 0
    state.tune_swing = 0.0


def switch_relay(config: Config, state: State, signals: MutableSequence[float], deviation: float) -> None:
    """The relay switches: a half cycle ends, and another one begins (kernel, D232)."""
    if state.tune_turns >= FIRST_RETURN:
        state.tune_swing = single(state.tune_swing + abs(state.tune_extreme))
        state.tune_dead_samples += state.tune_peak - state.tune_points
    state.tune_turns += 1
    state.tune_relay_sign = -state.tune_relay_sign
    state.tune_points = state.tune_count
    state.tune_peak = state.tune_count
    state.tune_extreme = deviation
    if state.tune_turns == FIRST_RETURN:
        state.tune_start = state.tune_count
    elif state.tune_turns == FIRST_RETURN + 2 * state.tune_cycles:
        calculate_results(config, state, signals)


def run_relay(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """One sample under the relay (kernel, D232)."""
    state.tune_count += 1
    deviation = single(state.pv - state.tune_base)
    if abs(deviation) > state.tune_max_deviation:
        end_tune(config, state, signals, PEAK_TOO_HIGH)
    elif state.tune_relay_sign * deviation >= state.tune_band:
        switch_relay(config, state, signals, deviation)
    elif state.tune_relay_sign * deviation <= state.tune_relay_sign * state.tune_extreme:
        state.tune_extreme = deviation
        state.tune_peak = state.tune_count


def run_autotune(config: Config, state: State, signals: MutableSequence[float]) -> int:
    """One call of the auto-tuning: what it is to MV (kernel)."""
    phase = state.tune_phase
    if signals[config.base + AUTO_TUNE] == 0.0:
        if phase == IDLE:
            return FREE
        clear_results(config, state, signals)
        return ABORTED if AVERAGING <= phase <= RELAY else ENDED
    if phase == IDLE:
        begin_autotune(config, state, signals)
    elif phase == AVERAGING:
        average_pv(config, state, signals)
    elif phase == RELAY:
        run_relay(config, state, signals)
    return HOLDS


# --- A call: the mode, MV and the outputs -----------------------------------------------------------------------------

CONTROLLING = AUTO_MODE | CASCADE_MODE


def mode_in_force(config: Config, signals: Sequence[float], tuning: int) -> int:
    """The mode of this call, with `OVERRIDDEN` in addition to automatic and cascade (kernel, D225)."""
    base = config.base
    if tuning == HOLDS:
        return TUNING_MODE
    if signals[base + MANUAL] != 0.0:
        return MANUAL_MODE
    if signals[base + TRK_IN] != 0.0:
        return TRACKING_MODE
    mode = CASCADE_MODE if signals[base + CASC] != 0.0 else AUTO_MODE
    if signals[base + OVERR] != 0.0:
        mode |= OVERRIDDEN
    return mode


def restores_mv(mode: int, tuning: int) -> bool:
    """Whether MV is RefMV once more: after an abort, and where control begins without a bump (kernel, D231)."""
    return tuning == ABORTED or (tuning == ENDED and mode & ~CONTROLLING == 0)


def calculate_automatic(
    config: Config,
    state: State,
    signals: Sequence[float],
    ki: float,
    proportional_term: float,
    derivative_term: float,
    change: float,
) -> tuple[float, int]:
    """MV in automatic: the integral action that goes with it, and the bits of the limits (kernel)."""
    bias = signals[config.base + BIAS]
    integral_term = single(state.integral + change) if ki != 0.0 else 0.0
    bits = limit_mv(config, state, signals, sum_actions(proportional_term, integral_term, derivative_term, bias))
    if bits and change != 0.0:
        integral_term = single(
            state.integral
            + accepted_increment(
                state, bits, sum_actions(proportional_term, state.integral, derivative_term, bias), change
            )
        )
    return integral_term, bits


def calculate_override(
    config: Config, state: State, signals: Sequence[float], ki: float, proportional_term: float, derivative_term: float
) -> tuple[float, int]:
    """MV while another controller has the valve: its MV takes the place of P in the integral (kernel, D227)."""
    base = config.base
    integral_term = 0.0
    if ki != 0.0:
        integral_term = finite_or(
            integral_for_mv(signals[base + TRK_VAL], 0.0, derivative_term, signals[base + BIAS]), state.integral
        )
    return integral_term, limit_mv(
        config, state, signals, sum_actions(proportional_term, integral_term, derivative_term, signals[base + BIAS])
    )


def calculate_mv(
    config: Config, state: State, signals: Sequence[float], mode: int, tuning: int, error: float, derivative_term: float
) -> tuple[float, int]:
    """MV and the integral action by the mode: the proportional action and the bits of the limits (kernel, D229)."""
    base = config.base
    proportional_term = proportional_action(config, signals, error)
    ki = integral_gain(config, signals)
    # AutoTune: RefMV, RefMV + M or RefMV - M (Figure 4-2); ManualMV; TRK_VAL
    if tuning == HOLDS or restores_mv(mode, tuning):
        bits = copy_mv(config, state, signals, single(state.tune_out + state.tune_relay_sign * state.tune_step))
    elif mode == MANUAL_MODE:
        bits = copy_mv(config, state, signals, signals[base + MANUAL_MV])
    elif mode == TRACKING_MODE:
        bits = copy_mv(config, state, signals, signals[base + TRK_VAL])
    # OVERR - Override Mode
    elif mode & OVERRIDDEN:
        state.integral, bits = calculate_override(config, state, signals, ki, proportional_term, derivative_term)
        return proportional_term, bits
    # DeadBand - Error Deadband: MV does not change
    elif abs(error) < signals[base + DEAD_BAND]:
        bits = copy_mv(config, state, signals, state.out)
    else:
        change = integral_increment(config, signals, ki, error)
        integral_term, bits = calculate_automatic(
            config, state, signals, ki, proportional_term, derivative_term, change
        )
        state.integral = finite_or(integral_term, state.integral)
        return proportional_term, bits
    # D229: I follows MV
    state.integral = (
        finite_or(integral_for_mv(state.out, proportional_term, derivative_term, signals[base + BIAS]), state.integral)
        if ki != 0.0
        else 0.0
    )
    return proportional_term, bits


def write_outputs(config: Config, state: State, signals: MutableSequence[float], mode: int, bits: int) -> None:
    """MV, and the tracking and windup outputs for a cascade master (kernel, D226)."""
    base = config.base
    # MV; TRK_OUT, Windup_H_OUT and Windup_L_OUT of a cascade slave
    up = 1.0 if bits & UPWARD_BITS else 0.0
    down = 1.0 if bits & DOWNWARD_BITS else 0.0
    direct = signals[base + DIRECT] != 0.0
    signals[base + MV] = state.out
    signals[base + TRK_OUT] = 0.0 if mode & CASCADE_MODE else 1.0
    signals[base + WINDUP_H_OUT] = down if direct else up
    signals[base + WINDUP_L_OUT] = up if direct else down


def call_pid(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """One call of the block; with an error bit it is not executed, and its outputs stay (kernel, D224)."""
    base = config.base
    # ErrBits - Error Bits: one of them prevents the execution
    signals[base + SAMPLE_TIME] = config.sample_time
    errors = bad_limits(config, signals) | negative_parameters(config, signals)
    write_errors(config, state, signals, errors)
    if errors:
        return
    # SP - Setpoint: Error = SP - PV, both within MinPV and MaxPV
    pv, sp, warnings = limit_inputs_to_range(config, signals)
    error = single(sp - pv)
    if not isfinite(error):
        return
    # D221: first call changes nothing
    if state.started == 0:
        state.started = 1
        state.pv = pv
        state.previous_error = error
    derivative_term = derivative_action(config, state, signals, pv, error)
    state.pv = pv
    state.sp = sp
    state.previous_error = error
    state.previous_derivative = derivative_term
    # Chapter 4, PIDA_TUNE_REAL: the auto-tuning, then MV by the mode
    tuning = 0
    if PIDA_TUNE_REAL <= config.kind <= PIDA_TUNE_INT:
        tuning = run_autotune(config, state, signals)
    mode = mode_in_force(config, signals, tuning)
    proportional_term, bits = calculate_mv(config, state, signals, mode, tuning, error, derivative_term)
    state.status = (state.status & ~MODES) | mode
    write_warnings(config, state, signals, warnings | bits)
    signals[base + P_ACTION] = proportional_term
    signals[base + D_ACTION] = derivative_term
    signals[base + I_ACTION] = state.integral
    write_outputs(config, state, signals, mode, bits)
