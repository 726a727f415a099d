"""Signals of two sides, a value a sample: how far they lie apart where either may come earlier, and their means."""

from __future__ import annotations

from itertools import accumulate
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

MEAN = 60
"""Samples over which the kicks of a derivative cancel each other."""


def running_means(values: Sequence[float], first: int) -> list[float]:
    """Of the samples before each, as many as there are."""
    sums = [0.0, *accumulate(values)]
    begins = (max(k + 1 - MEAN, 0) for k in range(first, len(values)))
    return [(sums[k + 1] - sums[begin]) / (k + 1 - begin) for k, begin in enumerate(begins, first)]


def apart(a: Sequence[float], b: Sequence[float], k: int, window: int) -> float:
    """How far two signals lie apart at a sample, where each may come ``window`` samples earlier or later."""
    if a[k] == b[k]:
        return 0.0
    return min(_outside(a, k, b[k], window), _outside(b, k, a[k], window))


def _outside(values: Sequence[float], k: int, value: float, window: int) -> float:
    """How far a value is outside of what a signal shows in the samples around."""
    near = values[max(k - window, 0) : k + window + 1]
    return max(value - max(near), min(near) - value, 0.0)
