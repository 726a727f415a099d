"""Kernels that the vendors' algorithms share: plain functions of numbers, compiled by numba as they are."""

from __future__ import annotations

from array import array
from math import isfinite

NEAREST = 6755399441055744.0
"""1.5 * 2**52: adding and subtracting it rounds to a whole number, half to even, without a call."""

SINGLE = array("f", [0.0])
"""A number that is stored here is rounded to single precision."""


def clamp(x: float, low: float, high: float) -> float:
    """The value within its limits; where they contradict each other, the low limit wins."""
    if x > high:
        x = high
    if x < low:
        x = low
    return x


def nearest(x: float) -> float:
    """The nearest whole number, half to even; exact below 2**51."""
    return x + NEAREST - NEAREST


def finite(x: float, otherwise: float) -> float:
    """The number itself if it is finite, else ``otherwise``."""
    return x if isfinite(x) else otherwise


def step_to(x: float, target: float, step: float) -> float:
    """From ``x`` towards ``target`` by at most ``step``."""
    if x < target:
        return target if target - x <= step else x + step
    return target if x - target <= step else x - step


def single(x: float) -> float:
    """The nearest single-precision number, half to even; infinite beyond them.

    Compiled code has `pidcfg.sim.compile.native_single` in its place.
    """
    SINGLE[0] = x
    return SINGLE[0]


def latched(status: int, bit: int, excess: float, hysteresis: float) -> int:
    """The status with one alarm bit renewed; ``excess`` is how far the PV is beyond the limit.

    Hysteresis acts on the way back (D46, D122).
    """
    if excess > 0.0:
        return status | bit
    if excess <= -hysteresis:
        return status & ~bit
    return status
