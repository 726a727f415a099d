"""One call of PIDA_REAL, PIDA_INT, PIDA_TUNE_REAL or PIDA_TUNE_INT.

In this order: error bits, limits of PV and set point, the three actions, the auto-tuning, then MV by what has priority:
auto-tuning, manual, tracking, override, automatic (D225). The parameters stand among the signals in single precision.
D numbers: see `decisions`.
"""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

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
    accepted_change,
    bad_limits,
    copy_mv,
    derivative,
    increment,
    integral_gain,
    limited,
    limited_inputs,
    negative,
    proportional,
    remainder,
    total,
    write_errors,
    write_warnings,
)

if TYPE_CHECKING:
    from collections.abc import MutableSequence, Sequence

    from pidcfg.sim.controllers.nextopid.terms import Config, State

CONTROLLING = AUTO_MODE | CASCADE_MODE


def mode_in_force(c: Config, sig: Sequence[float], tuning: int) -> int:
    """The mode of this call, with `OVERRIDDEN` in addition to automatic and cascade (kernel, D225)."""
    b = c.base
    if tuning == HOLDS:
        return TUNING_MODE
    if sig[b + MANUAL] != 0.0:
        return MANUAL_MODE
    if sig[b + TRK_IN] != 0.0:
        return TRACKING_MODE
    mode = CASCADE_MODE if sig[b + CASC] != 0.0 else AUTO_MODE
    if sig[b + OVERR] != 0.0:
        mode |= OVERRIDDEN
    return mode


def restores_mv(mode: int, tuning: int) -> bool:
    """Whether MV is RefMV once more: after an abort, and where control begins without a bump (kernel, D231)."""
    return tuning == ABORTED or (tuning == ENDED and mode & ~CONTROLLING == 0)


def calculate_automatic(
    c: Config, s: State, sig: Sequence[float], ki: float, p: float, d: float, change: float
) -> tuple[float, int]:
    """MV in automatic: the integral action that goes with it, and the bits of the limits (kernel)."""
    bias = sig[c.base + BIAS]
    i = single(s.integral + change) if ki != 0.0 else 0.0
    bits = limited(c, s, sig, total(p, i, d, bias))
    if bits and change != 0.0:
        i = single(s.integral + accepted_change(s, bits, total(p, s.integral, d, bias), change))
    return i, bits


def calculate_override(c: Config, s: State, sig: Sequence[float], ki: float, p: float, d: float) -> tuple[float, int]:
    """MV while another controller has the valve: its MV takes the place of P in the integral (kernel, D227)."""
    b = c.base
    i = 0.0
    if ki != 0.0:
        i = finite(remainder(sig[b + TRK_VAL], 0.0, d, sig[b + BIAS]), s.integral)
    return i, limited(c, s, sig, total(p, i, d, sig[b + BIAS]))


def manipulate(
    c: Config, s: State, sig: Sequence[float], mode: int, tuning: int, e: float, d: float
) -> tuple[float, int]:
    """MV and the integral action by the mode: the proportional action and the bits of the limits (kernel, D229)."""
    b = c.base
    p = proportional(c, sig, e)
    ki = integral_gain(c, sig)
    if tuning == HOLDS or restores_mv(mode, tuning):
        bits = copy_mv(c, s, sig, single(s.tune_out + s.tune_side * s.tune_step))
    elif mode == MANUAL_MODE:
        bits = copy_mv(c, s, sig, sig[b + MANUAL_MV])
    elif mode == TRACKING_MODE:
        bits = copy_mv(c, s, sig, sig[b + TRK_VAL])
    elif mode & OVERRIDDEN:
        s.integral, bits = calculate_override(c, s, sig, ki, p, d)
        return p, bits
    elif abs(e) < sig[b + DEAD_BAND]:
        bits = copy_mv(c, s, sig, s.out)
    else:
        i, bits = calculate_automatic(c, s, sig, ki, p, d, increment(c, sig, ki, e))
        s.integral = finite(i, s.integral)
        return p, bits
    s.integral = finite(remainder(s.out, p, d, sig[b + BIAS]), s.integral) if ki != 0.0 else 0.0
    return p, bits


def write_outputs(c: Config, s: State, sig: MutableSequence[float], mode: int, bits: int) -> None:
    """MV, and the tracking and windup outputs for a cascade master (kernel, D226)."""
    b = c.base
    up = 1.0 if bits & UPWARD else 0.0
    down = 1.0 if bits & DOWNWARD else 0.0
    direct = sig[b + DIRECT] != 0.0
    sig[b + MV] = s.out
    sig[b + TRK_OUT] = 0.0 if mode & CASCADE_MODE else 1.0
    sig[b + WINDUP_H_OUT] = down if direct else up
    sig[b + WINDUP_L_OUT] = up if direct else down


def pid(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """One call of the block; with an error bit it is not executed, and its outputs stay (kernel, D224)."""
    b = c.base
    sig[b + SAMPLE_TIME] = c.ts
    errors = bad_limits(c, sig) | negative(c, sig)
    write_errors(c, s, sig, errors)
    if errors:
        return
    pv, sp, warnings = limited_inputs(c, sig)
    e = single(sp - pv)
    if not isfinite(e):
        return
    if s.started == 0:
        s.started = 1
        s.pv = pv
        s.error = e
    d = derivative(c, s, sig, pv, e)
    s.pv = pv
    s.sp = sp
    s.error = e
    s.derivative = d
    tuning = 0
    if PIDA_TUNE_REAL <= c.kind <= PIDA_TUNE_INT:
        tuning = tune(c, s, sig)
    mode = mode_in_force(c, sig, tuning)
    p, bits = manipulate(c, s, sig, mode, tuning, e, d)
    s.status = (s.status & ~MODES) | mode
    write_warnings(c, s, sig, warnings | bits)
    sig[b + P_ACTION] = p
    sig[b + D_ACTION] = d
    sig[b + I_ACTION] = s.integral
    write_outputs(c, s, sig, mode, bits)
