"""One call of PIDA_REAL, PIDA_INT, PIDA_TUNE_REAL or PIDA_TUNE_INT.

In this order: error bits, limits of PV and set point, the three actions, the auto-tuning, then MV by what has priority:
auto-tuning, manual, tracking, override, automatic (D225). The parameters stand among the signals in single precision.
Sections are those of the manual's chapter 2, PIDA_REAL. D numbers: see `nextopid.PID`.
"""

from __future__ import annotations

from collections.abc import MutableSequence, Sequence
from math import isfinite

from pidcfg.sim.controllers.kernels import finite, single
from pidcfg.sim.controllers.nextopid.autotune import ABORTED, ENDED, HOLDS, tune
from pidcfg.sim.controllers.nextopid.terms import (
    AUTO_MODE,
    BIAS,
    CASC,
    CASCADE_MODE,
    D_ACTION,
    DEAD_BAND,
    DIRECT,
    DOWNWARD,
    I_ACTION,
    MANUAL,
    MANUAL_MODE,
    MANUAL_MV,
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
    TUNING_MODE,
    UPWARD,
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
    sum_actions,
    write_errors,
    write_warnings,
)

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
        integral_term = finite(
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
        state.integral = finite(integral_term, state.integral)
        return proportional_term, bits
    # D229: I follows MV
    state.integral = (
        finite(integral_for_mv(state.out, proportional_term, derivative_term, signals[base + BIAS]), state.integral)
        if ki != 0.0
        else 0.0
    )
    return proportional_term, bits


def write_outputs(config: Config, state: State, signals: MutableSequence[float], mode: int, bits: int) -> None:
    """MV, and the tracking and windup outputs for a cascade master (kernel, D226)."""
    base = config.base
    # MV; TRK_OUT, Windup_H_OUT and Windup_L_OUT of a cascade slave
    up = 1.0 if bits & UPWARD else 0.0
    down = 1.0 if bits & DOWNWARD else 0.0
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
        tuning = tune(config, state, signals)
    mode = mode_in_force(config, signals, tuning)
    proportional_term, bits = calculate_mv(config, state, signals, mode, tuning, error, derivative_term)
    state.status = (state.status & ~MODES) | mode
    write_warnings(config, state, signals, warnings | bits)
    signals[base + P_ACTION] = proportional_term
    signals[base + D_ACTION] = derivative_term
    signals[base + I_ACTION] = state.integral
    write_outputs(config, state, signals, mode, bits)
