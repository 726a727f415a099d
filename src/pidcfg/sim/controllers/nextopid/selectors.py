"""ControlSelectMax, ControlSelectMin and ControlSplitRange: functions, which keep nothing from call to call.

Of two equal outputs MV2 is selected (D245); a range is split at SPLIT (D246). D numbers: see `block_decisions`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.nextopid.slots import PLACES
from pidcfg.sim.terms import single

if TYPE_CHECKING:
    from collections.abc import MutableSequence

    from pidcfg.sim.controllers.nextopid.state import Config

_SELECT = PLACES["ControlSelectMax"]
"""ControlSelectMin has the same places."""
_MV1, _MV2, _MV = _SELECT["MV1"], _SELECT["MV2"], _SELECT["MV"]
_OVERR1, _OVERR2 = _SELECT["OVERR1"], _SELECT["OVERR2"]
_SPLIT = PLACES["ControlSplitRange"]
_IN, _POINT, _MODE = _SPLIT["MV"], _SPLIT["SPLIT"], _SPLIT["Mode"]
_OUT1, _OUT2, _ERROR = _SPLIT["MV1"], _SPLIT["MV2"], _SPLIT["Error"]
FULL = 100.0


def select(c: Config, first: bool, sig: MutableSequence[float]) -> None:  # noqa: FBT001 - a kernel
    """Takes one of the two and tells the other one that it is overridden (kernel)."""
    b = c.base
    sig[b + _MV] = sig[b + (_MV1 if first else _MV2)]
    sig[b + _OVERR1] = 0.0 if first else 1.0
    sig[b + _OVERR2] = 1.0 if first else 0.0


def select_max(c: Config, sig: MutableSequence[float]) -> None:
    """One call of ControlSelectMax (kernel)."""
    select(c, sig[c.base + _MV1] > sig[c.base + _MV2], sig)


def select_min(c: Config, sig: MutableSequence[float]) -> None:
    """One call of ControlSelectMin (kernel)."""
    select(c, sig[c.base + _MV1] < sig[c.base + _MV2], sig)


def split_range(c: Config, sig: MutableSequence[float]) -> None:
    """One call of ControlSplitRange (kernel)."""
    b = c.base
    mv = sig[b + _IN]
    point = sig[b + _POINT]
    mode = sig[b + _MODE]
    if not (1.0 <= mode <= 4.0 and 0.0 <= mv <= FULL and 0.0 < point < FULL):
        sig[b + _ERROR] = 1.0
        sig[b + _OUT1] = 0.0
        sig[b + _OUT2] = 0.0
        return
    sig[b + _ERROR] = 0.0
    lower = FULL
    upper = 0.0
    if mv < point:
        lower = single(single(mv / point) * FULL)
    else:
        upper = single(single(single(mv - point) / single(FULL - point)) * FULL)
    sig[b + _OUT1] = single(FULL - lower) if mode == 4.0 else lower
    if mode == 1.0:
        sig[b + _OUT2] = single(FULL - lower)
    else:
        sig[b + _OUT2] = single(FULL - upper) if mode == 3.0 else upper
