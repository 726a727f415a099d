"""Proportional, integral and derivative action of the PID blocks, every result in single precision (D220).

Direct control negates all three, and not BIAS. D numbers: see `decisions`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.schemas.nextopid import SHORTEST_INTEGRAL
from pidcfg.sim.controllers.nextopid.decay import share
from pidcfg.sim.controllers.nextopid.slots import (
    DERIV_ER,
    DIRECT,
    DISABLE_P,
    INDEP,
    KP,
    TD_KD,
    TFD,
    TI_KI,
    WINDUP_H_IN,
    WINDUP_L_IN,
)
from pidcfg.sim.terms import finite, single

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.sim.controllers.nextopid.state import Config, State

LEAST_TI = single(float(SHORTEST_INTEGRAL))
"""An integral time below this switches the integral action off."""


def integral_gain(c: Config, sig: Sequence[float]) -> float:
    """Ki; 0 without integral action (kernel)."""
    ti_ki = sig[c.base + TI_KI]
    if sig[c.base + INDEP] != 0.0:
        return ti_ki
    if ti_ki < LEAST_TI:
        return 0.0
    return single(sig[c.base + KP] / ti_ki)


def proportional(c: Config, sig: Sequence[float], e: float) -> float:
    """The proportional action; DisableP is of effect in the dependent form only (kernel)."""
    b = c.base
    if sig[b + DISABLE_P] != 0.0 and sig[b + INDEP] == 0.0:
        return 0.0
    p = single(sig[b + KP] * e)
    return -p if sig[b + DIRECT] != 0.0 else p


def increment(c: Config, sig: Sequence[float], ki: float, e: float) -> float:
    """What this call adds to the integral action, unless a cascade slave cannot follow that way (kernel)."""
    b = c.base
    if ki == 0.0:
        return 0.0
    change = single(single(ki * e) * c.ts)
    if sig[b + DIRECT] != 0.0:
        change = -change
    if change > 0.0 and sig[b + WINDUP_H_IN] != 0.0:
        return 0.0
    if change < 0.0 and sig[b + WINDUP_L_IN] != 0.0:
        return 0.0
    return change


def derivative(c: Config, s: State, sig: Sequence[float], pv: float, e: float) -> float:
    """The derivative action after its filter, from what PV and error were in the last call (kernel, D221)."""
    b = c.base
    kd = sig[b + TD_KD]
    if sig[b + INDEP] == 0.0:
        kd = single(sig[b + KP] * kd)
    change = single(e - s.error) if sig[b + DERIV_ER] != 0.0 else single(s.pv - pv)
    if sig[b + DIRECT] != 0.0:
        change = -change
    d = single(single(kd * change) / c.ts)
    tfd = sig[b + TFD]
    if tfd > 0.0:
        quotient = single(c.ts / tfd)
        if quotient != s.share_of:
            s.share_of = quotient
            s.share = single(share(quotient))
        d = single(s.derivative + single(single(d - s.derivative) * s.share))
    return finite(d, s.derivative)
