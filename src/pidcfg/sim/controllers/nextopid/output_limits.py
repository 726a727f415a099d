"""MV within its limits, and the integral action that goes with it. D numbers: see `decisions`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.nextopid.bits import FALL_LIMITED, MV_HIGH, MV_LOW, RISE_LIMITED
from pidcfg.sim.controllers.nextopid.slots import MAX_MV, MAX_VAR_MV, MIN_MV
from pidcfg.sim.terms import clamp, nearest, single

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.sim.controllers.nextopid.state import Config, State

UPWARD = MV_HIGH | RISE_LIMITED
DOWNWARD = MV_LOW | FALL_LIMITED


def total(p: float, i: float, d: float, bias: float) -> float:
    """P + I + D + BIAS (kernel)."""
    return single(single(single(p + i) + d) + bias)


def remainder(x: float, p: float, d: float, bias: float) -> float:
    """The integral action with which P + I + D + BIAS is ``x`` (kernel)."""
    return single(single(single(x - p) - d) - bias)


def whole(c: Config, mv: float) -> float:
    """MV rounded where the block is an INT one (kernel, D228)."""
    return nearest(mv) if c.whole else mv


def copy_mv(c: Config, s: State, sig: Sequence[float], mv: float) -> int:
    """MV from elsewhere, within MinMV and MaxMV (kernel): the bits that tell whether they limit it."""
    b = c.base
    s.out = whole(c, clamp(mv, sig[b + MIN_MV], sig[b + MAX_MV]))
    if mv > sig[b + MAX_MV]:
        return MV_HIGH
    return MV_LOW if mv < sig[b + MIN_MV] else 0


def limited(c: Config, s: State, sig: Sequence[float], x: float) -> int:
    """MV as calculated, its variation limited first, then MV itself (kernel, D223, D691): the bits."""
    b = c.base
    variation = sig[b + MAX_VAR_MV]
    bits = 0
    if variation > 0.0:
        highest = single(s.out + variation)
        lowest = single(s.out - variation)
        if x > highest:
            x = highest
            bits = RISE_LIMITED
        elif x < lowest:
            x = lowest
            bits = FALL_LIMITED
    if x > sig[b + MAX_MV]:
        x = sig[b + MAX_MV]
        bits |= MV_HIGH
    elif x < sig[b + MIN_MV]:
        x = sig[b + MIN_MV]
        bits |= MV_LOW
    s.out = whole(c, x)
    return bits


def accepted_change(s: State, bits: int, without: float, change: float) -> float:
    """How much of an increment of the integral action does not push MV past the limit that it is at (kernel, D222).

    ``without`` is P + I + D + BIAS before the increment.
    """
    if change > 0.0 and bits & UPWARD:
        return clamp(single(s.out - without), 0.0, change)
    if change < 0.0 and bits & DOWNWARD:
        return clamp(single(s.out - without), change, 0.0)
    return change
