"""ControlDelay and ControlDelayLag: the input of so many samples ago.

The line lies in the shared vector from ``c.buffer`` on and is as long as the delay; the oldest value is at ``s.head``.
It starts full of InitDelayedVar, and a delay of another length starts full of what the last one gave, so that the
output stands for the new delay (D240). A delay is rounded to samples (D239). D numbers: see `block_decisions`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.nextopid import MOST_SAMPLES
from pidcfg.sim.controllers.nextopid.filters import lag_fault, step_lag
from pidcfg.sim.controllers.nextopid.slots import PLACES
from pidcfg.sim.terms import nearest, single

if TYPE_CHECKING:
    from collections.abc import MutableSequence

    from pidcfg.sim.controllers.nextopid.state import Config, State

_DELAY = PLACES["ControlDelay"]
_DELAY_LAG = PLACES["ControlDelayLag"]
_IN, _TIME, _INIT = _DELAY["InVar"], _DELAY["DelayTime"], _DELAY["InitDelayedVar"]
"""ControlDelayLag has them at the same places."""
_OUT, _ERROR, _TS = _DELAY["OutVar"], _DELAY["Error"], _DELAY["SampleTime"]
_LAG_ERROR, _LAG_TS = _DELAY_LAG["Error"], _DELAY_LAG["SampleTime"]
LAG_AT = _DELAY_LAG["Gs"] - PLACES["ControlLag"]["Gs"]
"""How far the rest of ControlDelayLag's parameters is behind ControlLag's."""

ALMOST = 1.0 - 2.0**-22
"""A delay that exceeds the longest one by less than single precision can tell does not exceed it."""


def delay_fault(c: Config, time: float) -> bool:
    """Whether a delay is negative or longer than the line (kernel, D239)."""
    return not (time >= 0.0 and time * ALMOST <= MOST_SAMPLES * c.ts)


def begin_line(c: Config, s: State, aux: MutableSequence[float], samples: int, value: float) -> None:
    """A line of this length, full of one value (kernel)."""
    s.samples = samples
    s.head = 0
    s.delayed = value
    for i in range(samples):
        aux[c.buffer + i] = value


def delayed(c: Config, s: State, aux: MutableSequence[float], sig: MutableSequence[float]) -> float:
    """What InVar was a DelayTime ago (kernel)."""
    b = c.base
    x = sig[b + _IN]
    samples = int(nearest(single(sig[b + _TIME] / c.ts)))
    if s.started == 0:
        begin_line(c, s, aux, samples, sig[b + _INIT])
    elif samples != s.samples:
        begin_line(c, s, aux, samples, s.delayed)
    if samples == 0:
        s.delayed = x
        return x
    at = c.buffer + s.head
    s.delayed = aux[at]
    aux[at] = x
    s.head += 1
    if s.head == samples:
        s.head = 0
    return s.delayed


def delay(c: Config, s: State, aux: MutableSequence[float], sig: MutableSequence[float]) -> None:
    """One call of ControlDelay (kernel)."""
    b = c.base
    sig[b + _TS] = c.ts
    if delay_fault(c, sig[b + _TIME]):
        sig[b + _ERROR] = 1.0
        return
    sig[b + _ERROR] = 0.0
    sig[b + _OUT] = delayed(c, s, aux, sig)
    s.started = 1


def delay_lag(c: Config, s: State, aux: MutableSequence[float], sig: MutableSequence[float]) -> None:
    """One call of ControlDelayLag: the delay first, then the lag (kernel)."""
    b = c.base
    sig[b + _LAG_TS] = c.ts
    if delay_fault(c, sig[b + _TIME]) or lag_fault(b + LAG_AT, sig):
        sig[b + _LAG_ERROR] = 1.0
        return
    sig[b + _LAG_ERROR] = 0.0
    step_lag(c, s, delayed(c, s, aux, sig), b + LAG_AT, sig)
