"""Random numbers by counters: a sample's depend on the seed, its number, and the name of what varies, on nothing else.

SplitMix64 (Steele, Lea and Flood 2014) mixes a counter to 64 bits. Every sample has 64 bits of its own, of which 63 are
the seed of its scenario; every uncertainty has a row of numbers that begins at those bits and its name.
"""

from __future__ import annotations

import hashlib
from functools import cache
from math import inf
from statistics import NormalDist
from typing import TYPE_CHECKING

from pidcfg.refs import Decision

if TYPE_CHECKING:
    from pidcfg.scenario.vary import Ends, Uncertainty

DRAWN = Decision(
    801,
    "how a sample is drawn",
    "The 64 bits of sample i are SplitMix64 at seed + (i + 1)·0x9E3779B97F4A7C15 modulo 2⁶⁴; their upper 63 seed the "
    "noise of its scenario. The row of an uncertainty begins at those bits XOR the first eight bytes of SHA-256 of "
    "`plants.NAME.KEY` or `loops.NAME.KEY`, mixed once; each number is the upper 53 bits of the next one, plus a half, "
    "over 2⁵³. A normal number is the inverse of its distribution there (Wichura's AS 241, as in Python's statistics); "
    "one outside its limits is drawn again from its row, at most 100 times, after which the sample cannot run.",
    "Samples are independent, more of them continue the same row, and another uncertainty in the file does not change "
    "those that were there.",
)
GOLDEN, MASK = 0x9E3779B97F4A7C15, (1 << 64) - 1
MOST_DRAWS = 100
"""Numbers that are drawn for one that has limits."""
STANDARD = NormalDist()


class DrawError(Exception):
    """No number within its limits was drawn."""


def mixed(counter: int) -> int:
    """SplitMix64's output for a counter."""
    z = counter & MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


def bits_of(seed: int, sample: int) -> int:
    """The 64 bits of a sample."""
    return mixed(seed + (sample + 1) * GOLDEN)


def seed_of(seed: int, sample: int) -> int:
    """The seed of a sample's scenario, 63 bits."""
    return bits_of(seed, sample) >> 1


@cache
def _name_bits(row: str) -> int:
    return int.from_bytes(hashlib.sha256(row.encode()).digest()[:8], "big")


def unit(seed: int, sample: int, row: str, draw: int = 0) -> float:
    """A number above 0 and below 1: the one at ``draw`` in a row of a sample."""
    begin = mixed(bits_of(seed, sample) ^ _name_bits(row))
    return ((mixed(begin + (draw + 1) * GOLDEN) >> 11) + 0.5) / (1 << 53)


def drawn(what: Uncertainty, seed: int, sample: int) -> float:
    """The number of a sample; raises `DrawError`."""
    ends = what.ends
    for draw in range(MOST_DRAWS):
        value = quantile(ends, unit(seed, sample, what.row, draw))
        if ends.low <= value <= ends.high:
            return value
    raise DrawError(f"{what.label}: {MOST_DRAWS} numbers, none within {ends.low:g} to {ends.high:g}")


def quantile(ends: Ends, share: float) -> float:
    """Where a spread reaches a share, its limits left aside."""
    if ends.sigma is None:
        return ends.low + (ends.high - ends.low) * share
    return ends.mean + ends.sigma * STANDARD.inv_cdf(share)


def fifths(ends: Ends) -> tuple[float, float]:
    """Below the first lies a fifth of all samples, above the second another one."""
    if ends.sigma is None:
        return quantile(ends, 0.2), quantile(ends, 0.8)
    low = 0.0 if ends.low == -inf else STANDARD.cdf((ends.low - ends.mean) / ends.sigma)
    high = 1.0 if ends.high == inf else STANDARD.cdf((ends.high - ends.mean) / ends.sigma)
    span = high - low
    if not span > 0:  # limits so far out that no number comes there
        return ends.low, ends.high
    return quantile(ends, low + 0.2 * span), quantile(ends, low + 0.8 * span)
