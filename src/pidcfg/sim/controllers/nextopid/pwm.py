"""ControlPWM: the share of a period's cycles in which the output is on.

The on-cycles come first in a period, as many as MV is where the period begins, rounded (D241, D242). D numbers: see
`block_decisions`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.nextopid.slots import PLACES
from pidcfg.sim.terms import clamp, nearest, single

if TYPE_CHECKING:
    from collections.abc import MutableSequence

    from pidcfg.sim.controllers.nextopid.state import Config, State

_PWM = PLACES["ControlPWM"]
_MV, _HIGH, _LOW, _PERIOD = _PWM["MV"], _PWM["MaxMV"], _PWM["MinMV"], _PWM["Period"]
_OUT, _ERROR, _WARNING = _PWM["PWM"], _PWM["Error"], _PWM["Warning"]


def pwm(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """One call of ControlPWM (kernel)."""
    b = c.base
    low = sig[b + _LOW]
    high = sig[b + _HIGH]
    period = sig[b + _PERIOD]
    if not (high > low and period >= 1.0):
        sig[b + _ERROR] = 1.0
        return
    sig[b + _ERROR] = 0.0
    mv = sig[b + _MV]
    limited = clamp(mv, low, high)
    sig[b + _WARNING] = 1.0 if limited != mv else 0.0
    if s.head == 0:
        on = nearest(single(single(single(limited - low) / single(high - low)) * period))
        s.samples = int(period)
        s.held = int(on) if on > 0.0 else 0
    sig[b + _OUT] = 1.0 if s.head < s.held else 0.0
    s.head += 1
    if s.head >= s.samples:
        s.head = 0
