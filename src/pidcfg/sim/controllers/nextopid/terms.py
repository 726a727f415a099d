"""What the PID blocks are made of: places of parameters, records, the three actions, limits, ErrBits and WarnBits."""

from __future__ import annotations

from collections.abc import MutableSequence, Sequence
from dataclasses import dataclass

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.schemas.nextopid import MAX_SAMPLE_TIME, MIN_INTEGRAL_TIME
from pidcfg.sim.controllers.kernels import LoopConfig, RelayState, clamp, finite_or, round_half_even, single

# --- Where a block's parameters stand among the signals, counted from the block's first: the order of its table -------
#
# Kernels read and write ``signals[config.base + SP]``; a BOOL is 0 or 1 there, AUTOTUNE_MODE the number of its word.

OFFSETS = {name: {row.name: i for i, row in enumerate(kind.table.rows)} for name, kind in BLOCK_TYPES.items()}
"""Offsets by block type and parameter."""

KINDS = {name: i for i, name in enumerate(BLOCK_TYPES)}
"""Number of each block type: `Config.kind`."""
(
    PIDA_REAL,
    PIDA_INT,
    PIDA_TUNE_REAL,
    PIDA_TUNE_INT,
    ON_OFF,
    PWM,
    LOW_FILTER,
    DELAY,
    LAG,
    DELAY_LAG,
    LEAD_LAG,
    SELECT_MAX,
    SELECT_MIN,
    SPLIT_RANGE,
) = range(len(KINDS))

_PIDA = OFFSETS["PIDA_TUNE_REAL"]
"""The other PIDA blocks have the same places, as far as they go."""
SP, SP_CASC, PV = _PIDA["SP"], _PIDA["SP_CASC"], _PIDA["PV"]
KP, TD_KD, TI_KI, TFD = _PIDA["Kp"], _PIDA["Td_Kd"], _PIDA["Ti_Ki"], _PIDA["Tfd"]
BIAS, MANUAL_MV, TRK_VAL = _PIDA["BIAS"], _PIDA["ManualMV"], _PIDA["TRK_VAL"]
MAX_VAR_MV, MAX_MV, MIN_MV = _PIDA["MaxVarMV"], _PIDA["MaxMV"], _PIDA["MinMV"]
DEAD_BAND, MAX_PV, MIN_PV = _PIDA["DeadBand"], _PIDA["MaxPV"], _PIDA["MinPV"]
INDEP, DISABLE_P, DERIV_ER, CASC = _PIDA["Indep"], _PIDA["DisableP"], _PIDA["DerivEr"], _PIDA["CASC"]
TRK_IN, WINDUP_H_IN, WINDUP_L_IN = _PIDA["TRK_IN"], _PIDA["Windup_H_IN"], _PIDA["Windup_L_IN"]
OVERR, MANUAL, DIRECT = _PIDA["OVERR"], _PIDA["Manual"], _PIDA["Direct"]
MV, TRK_OUT = _PIDA["MV"], _PIDA["TRK_OUT"]
WINDUP_H_OUT, WINDUP_L_OUT = _PIDA["Windup_H_OUT"], _PIDA["Windup_L_OUT"]
P_ACTION, D_ACTION, I_ACTION = _PIDA["ProportionalAction"], _PIDA["DerivativeAction"], _PIDA["IntegralAction"]
SAMPLE_TIME = _PIDA["SampleTime"]
ERR_BITS, WARN_BITS = _PIDA["ErrBits.MaxMinMV"], _PIDA["WarnBits.PV_MaxPV"]
"""The first of nine, and of ten, in the order of the table."""
AUTO_TUNE, TUNE_PARAM = _PIDA["AutoTune"], _PIDA["AutoTuneParam.PercAmpMV"]
"""The second one is the first of five."""
TUNE_DONE, TUNE_ERROR = _PIDA["AutoTuneDone"], _PIDA["AutoTuneError"]
TUNE_RESULT, TUNE_FLAGS = _PIDA["AutoTuneResult.Kp"], _PIDA["AutoTuneResult.Bad_PercAmpMV"]
FLAG_COUNT = len(_PIDA) - TUNE_FLAGS
"""Three numbers, and so many flags, which are the last."""

# --- What a block knows: `Config` (fixed during a run) and `State` (what it keeps from one call to the next) ----------
#
# Loops come first, in the order of the file, then the other blocks; all have the same record. Parameters are not
# here: they stand among the signals, from ``base`` on, where wires, events and other blocks find them.
# Everything is an int or a float: the same fields become a NumPy record for numba.

# `State.status`: the mode reached
MANUAL_MODE, AUTO_MODE, CASCADE_MODE, TRACKING_MODE, TUNING_MODE, OVERRIDDEN = 1, 2, 4, 8, 16, 32
MODES = 63
ERROR_BASE = 64
"""`State.status`: from this bit on the nine ErrBits in the order of the table; `State.aux_status` has the WarnBits."""


@dataclass(slots=True)
class Config(LoopConfig):
    """One block of the program."""

    kind: int = 0
    """Number of its type: `KINDS`."""
    base: int = 0
    """Slot of its first parameter."""
    error_slot: int = -1
    """Slot of its output Error; −1: it has none."""
    call_order: int = 0
    """Of the record at this place of the list: which block is called at this place of a cycle."""
    sample_time: float = 0.1
    """The period in s, single precision: what the block measures as SampleTime."""
    is_integer: int = 0
    """Parameters are INT: MV is rounded."""
    wires_begin: int = 0
    """First of its wires in the wire table, and one behind the last."""
    wires_end: int = 0
    early_wires: int = 0
    """How many of its wires, the first ones, are renewed before the first block of a cycle is called."""
    moves_begin: int = 0
    """Of the first record: the first row of the program's moves in the wire table, two rows a move."""
    early_moves_end: int = 0
    """One behind those that are executed before the first call of a cycle, and one behind all."""
    moves_end: int = 0
    buffer: int = 0
    """Where its delay line begins in the shared vector."""


@dataclass(slots=True)
class State(RelayState):
    """What a block keeps. `LoopState`: ``pv`` and ``out`` are PV and MV of the last call, whose error and D follow."""

    command: int = 0
    """Commands of the operator, as bits, for the next call (`write_commands`)."""
    tune_outcome: int = 0
    """State of the last auto-tuning, and its results (`keep_results`)."""
    result_kp: float = 0.0
    result_ti: float = 0.0
    result_td: float = 0.0
    result_flags: int = 0
    fault: int = 0
    """Why a wire had no value, the first time (`pidcfg.sim.engine.expressions.FAULTS`), for which slot, and when in
    ticks."""
    fault_target: int = 0
    fault_at: int = -1
    has_erred: int = 0
    """Whether its output Error was on at some time."""
    started: int = 0
    """Whether it has been called."""
    integral: float = 0.0
    previous_error: float = 0.0
    previous_derivative: float = 0.0
    """The derivative action of the last call, filtered."""
    lag_quotient: float = -1.0
    """The quotient Ts/T that ``lag_share`` was worked out for."""
    lag_share: float = 1.0
    """How far a lag or filter goes in one sample."""
    lag_output: float = 0.0
    """Output of a lag or filter before its limits."""
    samples: int = 0
    """Length of a delay line, or of a period of pulses."""
    position: int = 0
    """Next place of a delay line, or cycle of a period of pulses."""
    delayed_value: float = 0.0
    """Last output of a delay line."""
    on_cycles: int = 0
    """Cycles for which pulses are on."""
    tune_band: float = 0.0
    """Hysteresis of the auto-tuning's relay in PV units."""
    tune_max_deviation: float = 0.0
    """How far the PV may go from its rest before the auto-tuning is aborted."""
    tune_cycles: int = 0
    """Cycles to be measured."""
    tune_mode: int = 0
    """Controller to be tuned: AUTOTUNE_MODE."""
    tune_extreme: float = 0.0
    """The PV's extreme since the last switch, counted from RefPV."""
    tune_peak: int = 0
    """Sample of the PV's extreme since the last switch."""
    tune_dead_samples: int = 0
    """Sum of the samples from the switches to the extremes."""


# --- How far a first-order lag goes in one sample, 1 - e^(-Ts/T), with nothing but the four operations ----------------
#
# Time constants may be wired, so that this is worked out inside a run; the library functions of two engines need not
# agree in the last bit, these operations do.

LARGEST_RATIO = 50.0
"""From so many time constants on nothing is left."""
SERIES_TERMS = 18


def lag_share(ratio: float) -> float:
    """1 - e^(-ratio) for a ratio Ts/T >= 0 (kernel)."""
    if ratio >= LARGEST_RATIO:
        return 1.0
    halvings = 0
    while ratio > 0.5:
        ratio *= 0.5
        halvings += 1
    term = ratio
    total = ratio
    for n in range(2, SERIES_TERMS):
        term *= -ratio / n
        total += term
    for _ in range(halvings):
        total *= 2.0 - total
    return total


# --- ErrBits and WarnBits of the PID blocks: what sets them, and how they are written ---------------------------------
#
# A NaN in a parameter is an error as well: every comparison asks for what is right. D: see `nextopid.PID_DECISIONS`.

# ErrBits, in the order of the table
BAD_MV_LIMITS, BAD_PV_LIMITS, BAD_KP, BAD_TD_KD, BAD_TI_KI = 1, 2, 4, 8, 16
BAD_TFD, BAD_MAX_VAR_MV, BAD_DEAD_BAND, BAD_SAMPLE_TIME = 32, 64, 128, 256
ERROR_COUNT = 9

# WarnBits, in the order of the table
PV_HIGH, PV_LOW, SP_HIGH, SP_LOW, SP_CASC_HIGH, SP_CASC_LOW = 1, 2, 4, 8, 16, 32
MV_HIGH, MV_LOW, RISE_LIMITED, FALL_LIMITED = 64, 128, 256, 512
WARNING_COUNT = 10

MAX_SAMPLE_SECONDS = float(MAX_SAMPLE_TIME)


def bad_limits(config: Config, signals: Sequence[float]) -> int:
    """Errors of the limits, of the gain's range and of the sample time (kernel)."""
    base = config.base
    errors = 0
    if not signals[base + MAX_MV] > signals[base + MIN_MV]:
        errors |= BAD_MV_LIMITS
    if not signals[base + MAX_PV] > signals[base + MIN_PV]:
        errors |= BAD_PV_LIMITS
    if signals[base + INDEP] != 0.0:
        if not signals[base + KP] >= 0.0:
            errors |= BAD_KP
    elif not signals[base + KP] > 0.0:
        errors |= BAD_KP
    if not config.sample_time <= MAX_SAMPLE_SECONDS:
        errors |= BAD_SAMPLE_TIME
    return errors


def negative_parameters(config: Config, signals: Sequence[float]) -> int:
    """Errors of the parameters that may not be negative (kernel)."""
    base = config.base
    errors = 0
    if not signals[base + TD_KD] >= 0.0:
        errors |= BAD_TD_KD
    if not signals[base + TI_KI] >= 0.0:
        errors |= BAD_TI_KI
    if not signals[base + TFD] >= 0.0:
        errors |= BAD_TFD
    if not signals[base + MAX_VAR_MV] >= 0.0:
        errors |= BAD_MAX_VAR_MV
    if not signals[base + DEAD_BAND] >= 0.0:
        errors |= BAD_DEAD_BAND
    return errors


def write_errors(config: Config, state: State, signals: MutableSequence[float], errors: int) -> None:
    """The error bits, where they have changed (kernel)."""
    if errors != state.status // ERROR_BASE:
        state.status = (state.status & MODES) | (errors * ERROR_BASE)
        for i in range(ERROR_COUNT):
            signals[config.base + ERR_BITS + i] = float((errors >> i) & 1)


def write_warnings(config: Config, state: State, signals: MutableSequence[float], warnings: int) -> None:
    """The warning bits, where they have changed (kernel)."""
    if warnings != state.aux_status:
        state.aux_status = warnings
        for i in range(WARNING_COUNT):
            signals[config.base + WARN_BITS + i] = float((warnings >> i) & 1)


def limit_inputs_to_range(config: Config, signals: Sequence[float]) -> tuple[float, float, int]:
    """PV and the set point in force within MinPV and MaxPV, with the bits that tell so (kernel, D224)."""
    base = config.base
    high = signals[base + MAX_PV]
    low = signals[base + MIN_PV]
    pv = signals[base + PV]
    warnings = 0
    # MaxPV and MinPV - Maximum and Minimum Value of PV, which limit SP and SP_CASC too
    if pv > high:
        pv = high
        warnings = PV_HIGH
    elif pv < low:
        pv = low
        warnings = PV_LOW
    # CASC - Cascade Mode: SP_CASC is the set point instead of SP
    cascade = signals[base + CASC] != 0.0
    sp = signals[base + SP_CASC] if cascade else signals[base + SP]
    if sp > high:
        sp = high
        warnings |= SP_CASC_HIGH if cascade else SP_HIGH
    elif sp < low:
        sp = low
        warnings |= SP_CASC_LOW if cascade else SP_LOW
    return pv, sp, warnings


# --- Proportional, integral and derivative action of the PID blocks, every result in single precision (D220) ----------
#
# The manual (chapter 2, PIDA_REAL, a section a parameter) prints no equation (D220: MV = P + I + D + BIAS). Direct
# control negates P, I and D, and not BIAS (section Direct). D numbers: see `nextopid.PID_DECISIONS`.

MIN_TI = single(float(MIN_INTEGRAL_TIME))
"""An integral time below this switches the integral action off."""


def integral_gain(config: Config, signals: Sequence[float]) -> float:
    """Ki; 0 without integral action (kernel)."""
    # Ti_Ki - Integral Time or Integral Gain: Kp / Ti in the dependent form, Ki itself in the independent one
    ti_ki = signals[config.base + TI_KI]
    if signals[config.base + INDEP] != 0.0:
        return ti_ki
    if ti_ki < MIN_TI:
        return 0.0
    return single(signals[config.base + KP] / ti_ki)


def proportional_action(config: Config, signals: Sequence[float], error: float) -> float:
    """The proportional action; DisableP is of effect in the dependent form only (kernel)."""
    base = config.base
    # DisableP - Disable Proportional Action; Kp - Proportional Gain: P = Kp e
    if signals[base + DISABLE_P] != 0.0 and signals[base + INDEP] == 0.0:
        return 0.0
    proportional_term = single(signals[base + KP] * error)
    return -proportional_term if signals[base + DIRECT] != 0.0 else proportional_term


def integral_increment(config: Config, signals: Sequence[float], ki: float, error: float) -> float:
    """What this call adds to the integral action, unless a cascade slave cannot follow that way (kernel)."""
    base = config.base
    if ki == 0.0:
        return 0.0
    # I += Ki e Ts
    change = single(single(ki * error) * config.sample_time)
    if signals[base + DIRECT] != 0.0:
        change = -change
    # Windup_H_IN and Windup_L_IN - Integral High and Low Windup Indication from a Cascade Slave
    if change > 0.0 and signals[base + WINDUP_H_IN] != 0.0:
        return 0.0
    if change < 0.0 and signals[base + WINDUP_L_IN] != 0.0:
        return 0.0
    return change


def derivative_action(config: Config, state: State, signals: Sequence[float], pv: float, error: float) -> float:
    """The derivative action after its filter, from what PV and error were in the last call (kernel, D221)."""
    base = config.base
    # Td_Kd - Derivative Time or Derivative Gain: Kp Td in the dependent form, Kd itself in the independent one
    kd = signals[base + TD_KD]
    if signals[base + INDEP] == 0.0:
        kd = single(signals[base + KP] * kd)
    # DerivEr - Derivative Action Calculated on Error: D = Kd (e(n) - e(n-1)) / Ts; else Kd (PV(n-1) - PV(n)) / Ts
    change = single(error - state.previous_error) if signals[base + DERIV_ER] != 0.0 else single(state.pv - pv)
    if signals[base + DIRECT] != 0.0:
        change = -change
    derivative_term = single(single(kd * change) / config.sample_time)
    # Tfd - Filter Time for Derivative Action. D221: exact first-order lag
    tfd = signals[base + TFD]
    if tfd > 0.0:
        quotient = single(config.sample_time / tfd)
        if quotient != state.lag_quotient:
            state.lag_quotient = quotient
            state.lag_share = single(lag_share(quotient))
        derivative_term = single(
            state.previous_derivative + single(single(derivative_term - state.previous_derivative) * state.lag_share)
        )
    return finite_or(derivative_term, state.previous_derivative)


# --- MV within its limits, and the integral action that goes with it. D numbers: see `nextopid.PID_DECISIONS` ---------

UPWARD_BITS = MV_HIGH | RISE_LIMITED
DOWNWARD_BITS = MV_LOW | FALL_LIMITED


def sum_actions(proportional_term: float, integral_term: float, derivative_term: float, bias: float) -> float:
    """P + I + D + BIAS (kernel)."""
    return single(single(single(proportional_term + integral_term) + derivative_term) + bias)


def integral_for_mv(output: float, proportional_term: float, derivative_term: float, bias: float) -> float:
    """The integral action with which P + I + D + BIAS is ``output`` (kernel)."""
    return single(single(single(output - proportional_term) - derivative_term) - bias)


def round_mv(config: Config, mv: float) -> float:
    """MV rounded where the block is an INT one (kernel, D228)."""
    return round_half_even(mv) if config.is_integer else mv


def copy_mv(config: Config, state: State, signals: Sequence[float], mv: float) -> int:
    """MV from elsewhere, within MinMV and MaxMV (kernel): the bits that tell whether they limit it."""
    base = config.base
    state.out = round_mv(config, clamp(mv, signals[base + MIN_MV], signals[base + MAX_MV]))
    if mv > signals[base + MAX_MV]:
        return MV_HIGH
    return MV_LOW if mv < signals[base + MIN_MV] else 0


def limit_mv(config: Config, state: State, signals: Sequence[float], mv: float) -> int:
    """MV as calculated, its variation limited first, then MV itself (kernel, D223, D691): the bits."""
    base = config.base
    # MaxVarMV - Maximum Variation of MV per Cycle. D223: variation before limits
    variation = signals[base + MAX_VAR_MV]
    bits = 0
    if variation > 0.0:
        highest = single(state.out + variation)
        lowest = single(state.out - variation)
        if mv > highest:
            mv = highest
            bits = RISE_LIMITED
        elif mv < lowest:
            mv = lowest
            bits = FALL_LIMITED
    # MaxMV and MinMV - Maximum and Minimum Value of MV
    if mv > signals[base + MAX_MV]:
        mv = signals[base + MAX_MV]
        bits |= MV_HIGH
    elif mv < signals[base + MIN_MV]:
        mv = signals[base + MIN_MV]
        bits |= MV_LOW
    state.out = round_mv(config, mv)
    return bits


def accepted_increment(state: State, bits: int, mv_before: float, change: float) -> float:
    """How much of an increment of the integral action does not push MV past the limit that it is at (kernel, D222).

    ``mv_before`` is P + I + D + BIAS before the increment.
    """
    if change > 0.0 and bits & UPWARD_BITS:
        return clamp(single(state.out - mv_before), 0.0, change)
    if change < 0.0 and bits & DOWNWARD_BITS:
        return clamp(single(state.out - mv_before), change, 0.0)
    return change
