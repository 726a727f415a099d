"""ControlON_OFF: the output switches where the error leaves the dead band (D244).

With an error bit the block is not executed, and its other outputs stay (D235). `State.status` has its two error bits
where it has those of the PID blocks, so that each is reported under its own name. D numbers: see `block_decisions`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.nextopid.bits import BAD_DEAD_BAND, BAD_PV_LIMITS
from pidcfg.sim.controllers.nextopid.slots import PLACES
from pidcfg.sim.controllers.nextopid.state import AUTO_MODE, ERROR_BASE, MANUAL_MODE, MODES
from pidcfg.sim.terms import single

if TYPE_CHECKING:
    from collections.abc import MutableSequence

    from pidcfg.sim.controllers.nextopid.state import Config, State

_ON_OFF = PLACES["ControlON_OFF"]
_SP, _PV, _BAND, _HIGH, _LOW = (_ON_OFF[name] for name in ("SP", "PV", "DeadBand", "MaxPV", "MinPV"))
_DIRECT, _MANUAL, _MANUAL_MV, _MV = (_ON_OFF[name] for name in ("Direct", "Manual", "ManualMV", "MV"))
_ERR_PV_LIMITS, _ERR_DEAD_BAND = _ON_OFF["ErrBits.MaxMinPV"], _ON_OFF["ErrBits.DeadBand"]
_WARN_BITS = _ON_OFF["WarnBits.PV_MaxPV"]
"""The first of four, in the order of the table, which is that of the PID blocks."""
WARNINGS = 4
PV_HIGH, PV_LOW, SP_HIGH, SP_LOW = 1, 2, 4, 8


def write_bits(at: int, count: int, bits: int, sig: MutableSequence[float]) -> None:
    """A set of bits as BOOLs, one after the other (kernel)."""
    for i in range(count):
        sig[at + i] = float((bits >> i) & 1)


def limit_inputs(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """PV and SP within MinPV and MaxPV, and the warnings that tell so (kernel)."""
    b = c.base
    high = sig[b + _HIGH]
    low = sig[b + _LOW]
    s.pv = sig[b + _PV]
    s.sp = sig[b + _SP]
    warnings = 0
    if s.pv > high:
        s.pv = high
        warnings = PV_HIGH
    elif s.pv < low:
        s.pv = low
        warnings = PV_LOW
    if s.sp > high:
        s.sp = high
        warnings |= SP_HIGH
    elif s.sp < low:
        s.sp = low
        warnings |= SP_LOW
    if warnings != s.aux_status:
        s.aux_status = warnings
        write_bits(b + _WARN_BITS, WARNINGS, warnings, sig)


def on_off(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """One call of ControlON_OFF (kernel)."""
    b = c.base
    band = sig[b + _BAND]
    errors = 0
    if not sig[b + _HIGH] > sig[b + _LOW]:
        errors |= BAD_PV_LIMITS
    if not band >= 0.0:
        errors |= BAD_DEAD_BAND
    if errors != s.status // ERROR_BASE:
        s.status = (s.status & MODES) | errors * ERROR_BASE
        sig[b + _ERR_PV_LIMITS] = 1.0 if errors & BAD_PV_LIMITS else 0.0
        sig[b + _ERR_DEAD_BAND] = 1.0 if errors & BAD_DEAD_BAND else 0.0
    if errors != 0:
        return
    limit_inputs(c, s, sig)
    s.status = MANUAL_MODE if sig[b + _MANUAL] != 0.0 else AUTO_MODE
    s.error = single(s.sp - s.pv)
    if s.status == MANUAL_MODE:
        sig[b + _MV] = 1.0 if sig[b + _MANUAL_MV] != 0.0 else 0.0
    elif s.error > band or s.error < -band:
        above = s.error > 0.0
        sig[b + _MV] = 1.0 if above == (sig[b + _DIRECT] == 0.0) else 0.0
    s.out = sig[b + _MV]
