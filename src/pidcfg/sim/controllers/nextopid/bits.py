"""ErrBits and WarnBits of the PID blocks: what sets them, and how they are written.

A NaN in a parameter is an error as well: every comparison asks for what is right. D numbers: see `decisions`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.schemas.nextopid import LONGEST_SAMPLE
from pidcfg.sim.controllers.nextopid.slots import (
    CASC,
    DEAD_BAND,
    ERR_BITS,
    INDEP,
    KP,
    MAX_MV,
    MAX_PV,
    MAX_VAR_MV,
    MIN_MV,
    MIN_PV,
    PV,
    SP,
    SP_CASC,
    TD_KD,
    TFD,
    TI_KI,
    WARN_BITS,
)
from pidcfg.sim.controllers.nextopid.state import ERROR_BASE, MODES

if TYPE_CHECKING:
    from collections.abc import MutableSequence, Sequence

    from pidcfg.sim.controllers.nextopid.state import Config, State

# ErrBits, in the order of the table
BAD_MV_LIMITS, BAD_PV_LIMITS, BAD_KP, BAD_TD_KD, BAD_TI_KI = 1, 2, 4, 8, 16
BAD_TFD, BAD_MAX_VAR_MV, BAD_DEAD_BAND, BAD_SAMPLE_TIME = 32, 64, 128, 256
ERRORS = 9

# WarnBits, in the order of the table
PV_HIGH, PV_LOW, SP_HIGH, SP_LOW, SP_CASC_HIGH, SP_CASC_LOW = 1, 2, 4, 8, 16, 32
MV_HIGH, MV_LOW, RISE_LIMITED, FALL_LIMITED = 64, 128, 256, 512
WARNINGS = 10

LONGEST = float(LONGEST_SAMPLE)


def bad_limits(c: Config, sig: Sequence[float]) -> int:
    """Errors of the limits, of the gain's range and of the sample time (kernel)."""
    b = c.base
    errors = 0
    if not sig[b + MAX_MV] > sig[b + MIN_MV]:
        errors |= BAD_MV_LIMITS
    if not sig[b + MAX_PV] > sig[b + MIN_PV]:
        errors |= BAD_PV_LIMITS
    if sig[b + INDEP] != 0.0:
        if not sig[b + KP] >= 0.0:
            errors |= BAD_KP
    elif not sig[b + KP] > 0.0:
        errors |= BAD_KP
    if not c.ts <= LONGEST:
        errors |= BAD_SAMPLE_TIME
    return errors


def negative(c: Config, sig: Sequence[float]) -> int:
    """Errors of the parameters that may not be negative (kernel)."""
    b = c.base
    errors = 0
    if not sig[b + TD_KD] >= 0.0:
        errors |= BAD_TD_KD
    if not sig[b + TI_KI] >= 0.0:
        errors |= BAD_TI_KI
    if not sig[b + TFD] >= 0.0:
        errors |= BAD_TFD
    if not sig[b + MAX_VAR_MV] >= 0.0:
        errors |= BAD_MAX_VAR_MV
    if not sig[b + DEAD_BAND] >= 0.0:
        errors |= BAD_DEAD_BAND
    return errors


def write_errors(c: Config, s: State, sig: MutableSequence[float], errors: int) -> None:
    """The error bits, where they have changed (kernel)."""
    if errors != s.status // ERROR_BASE:
        s.status = (s.status & MODES) | (errors * ERROR_BASE)
        for i in range(ERRORS):
            sig[c.base + ERR_BITS + i] = float((errors >> i) & 1)


def write_warnings(c: Config, s: State, sig: MutableSequence[float], warnings: int) -> None:
    """The warning bits, where they have changed (kernel)."""
    if warnings != s.aux_status:
        s.aux_status = warnings
        for i in range(WARNINGS):
            sig[c.base + WARN_BITS + i] = float((warnings >> i) & 1)


def limited_inputs(c: Config, sig: Sequence[float]) -> tuple[float, float, int]:
    """PV and the set point in force within MinPV and MaxPV, with the bits that tell so (kernel, D224)."""
    b = c.base
    high = sig[b + MAX_PV]
    low = sig[b + MIN_PV]
    pv = sig[b + PV]
    warnings = 0
    if pv > high:
        pv = high
        warnings = PV_HIGH
    elif pv < low:
        pv = low
        warnings = PV_LOW
    cascade = sig[b + CASC] != 0.0
    sp = sig[b + SP_CASC] if cascade else sig[b + SP]
    if sp > high:
        sp = high
        warnings |= SP_CASC_HIGH if cascade else SP_HIGH
    elif sp < low:
        sp = low
        warnings |= SP_CASC_LOW if cascade else SP_LOW
    return pv, sp, warnings
