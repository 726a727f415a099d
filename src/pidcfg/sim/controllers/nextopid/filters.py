"""ControlLowFilter, ControlLag and ControlLeadLag: exact first-order steps, every result in single precision.

A first call has no time before it: it shows where the block starts (D237). At a limit a
lag goes on from it (D238); a result that is no number is not written (D247). D numbers: see `block_decisions`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.nextopid.decay import share
from pidcfg.sim.controllers.nextopid.slots import PLACES
from pidcfg.sim.terms import clamp, finite, single

if TYPE_CHECKING:
    from collections.abc import MutableSequence, Sequence

    from pidcfg.sim.controllers.nextopid.state import Config, State

_FILTER = PLACES["ControlLowFilter"]
_LAG = PLACES["ControlLag"]
_LEAD_LAG = PLACES["ControlLeadLag"]

_F_IN, _F_TC = _FILTER["InVar"], _FILTER["Tc"]
_F_OUT, _F_ERROR, _F_TS = _FILTER["OutVar"], _FILTER["Error"], _FILTER["SampleTime"]

_IN, _GS, _OFFSET, _TC = _LAG["InVar"], _LAG["Gs"], _LAG["Offset"], _LAG["Tc"]
_INIT, _LOW, _HIGH = _LAG["Init_OutVar"], _LAG["Min_OutVar"], _LAG["Max_OutVar"]
_OUT, _ERROR, _TS = _LAG["OutVar"], _LAG["Error"], _LAG["SampleTime"]

_LL_IN, _LL_G, _LL_LEAD, _LL_LAG = _LEAD_LAG["InVar"], _LEAD_LAG["G"], _LEAD_LAG["Tlead"], _LEAD_LAG["Tlag"]
_LL_LOW, _LL_HIGH, _LL_DISABLE = _LEAD_LAG["Min_OutVar"], _LEAD_LAG["Max_OutVar"], _LEAD_LAG["Disable"]
_LL_OUT, _LL_ERROR, _LL_TS = _LEAD_LAG["OutVar"], _LEAD_LAG["Error"], _LEAD_LAG["SampleTime"]


def portion(c: Config, s: State, time_constant: float) -> float:
    """The share of the way of one sample, worked out again when the time constant has changed (kernel, D236)."""
    quotient = single(c.ts / time_constant)
    if quotient != s.share_of:
        s.share_of = quotient
        s.share = single(share(quotient))
    return s.share


def toward(y: float, x: float, part: float) -> float:
    """From ``y`` a part of the way to ``x`` (kernel)."""
    return single(y + single(single(x - y) * part))


def low_filter(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """One call of ControlLowFilter (kernel)."""
    b = c.base
    tc = sig[b + _F_TC]
    sig[b + _F_TS] = c.ts
    if not tc > 0.0:
        sig[b + _F_ERROR] = 1.0
        return
    sig[b + _F_ERROR] = 0.0
    x = sig[b + _F_IN]
    if s.started == 0:
        s.started = 1
        s.y = x
    s.y = finite(toward(s.y, x, portion(c, s, tc)), s.y)
    sig[b + _F_OUT] = s.y


def lag_fault(at: int, sig: Sequence[float]) -> bool:
    """Whether a lag's parameters stop it, crossed limits among them (kernel).

    ``at``: where ControlLag's parameters would begin.
    """
    return not (sig[at + _TC] > 0.0 and sig[at + _LOW] <= sig[at + _INIT] <= sig[at + _HIGH])


def step_lag(c: Config, s: State, x: float, at: int, sig: MutableSequence[float]) -> None:
    """The output of a lag with the input ``x`` (kernel)."""
    if s.started == 0:
        s.started = 1
        s.y = sig[at + _INIT]
    else:
        target = single(single(sig[at + _GS] * x) + sig[at + _OFFSET])
        y = toward(s.y, target, portion(c, s, sig[at + _TC]))
        s.y = finite(clamp(y, sig[at + _LOW], sig[at + _HIGH]), s.y)
    sig[at + _OUT] = s.y


def lag(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """One call of ControlLag (kernel)."""
    b = c.base
    sig[b + _TS] = c.ts
    if lag_fault(b, sig):
        sig[b + _ERROR] = 1.0
        return
    sig[b + _ERROR] = 0.0
    step_lag(c, s, sig[b + _IN], b, sig)


def lead_lag(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """One call of ControlLeadLag: the output comes from the lagged input as it was before this call (kernel, D243)."""
    b = c.base
    lead = sig[b + _LL_LEAD]
    lag_time = sig[b + _LL_LAG]
    sig[b + _LL_TS] = c.ts
    if not (lead >= 0.0 and lag_time > 0.0):
        sig[b + _LL_ERROR] = 1.0
        return
    sig[b + _LL_ERROR] = 0.0
    x = sig[b + _LL_IN]
    if s.started == 0:
        s.started = 1
        s.y = x
    if sig[b + _LL_DISABLE] != 0.0:
        sig[b + _LL_OUT] = 0.0
    else:
        led = single(s.y + single(single(lead / lag_time) * single(x - s.y)))
        out = clamp(single(sig[b + _LL_G] * led), sig[b + _LL_LOW], sig[b + _LL_HIGH])
        sig[b + _LL_OUT] = finite(out, sig[b + _LL_OUT])
    s.y = finite(toward(s.y, x, portion(c, s, lag_time)), s.y)
