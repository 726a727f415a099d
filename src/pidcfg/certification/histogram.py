"""Quantiles and means of numbers that come one by one, in little memory."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from math import ceil
from typing import Any

from pidcfg.refs import Decision

BINNED = Decision(
    802,
    "quantiles and means of a batch",
    "A number falls into the bin of its sign, its exponent and the first 8 bits of its mantissa (0.4 % wide); a "
    "quantile is the upper edge of the bin in which it lies, or the largest number where that is less; 0 stays 0. "
    "Means are sums over blocks of 1,024 samples by index, the blocks in order. What a sample does not measure is not "
    "counted.",
    "Memory does not grow with the samples, and no sum depends on who calculated which sample.",
)
CUT = 52 - 8
"""Bits of the mantissa that a bin leaves out."""
BLOCK = 1_024
"""Samples of a block."""
SMALLEST = 2.0**-1022
"""Smaller amounts count as 0."""


def bin_of(value: float) -> int:
    """The bin of a number: its highest 20 bits."""
    if abs(value) < SMALLEST:
        return 0
    bits: int = struct.unpack(">Q", struct.pack(">d", value))[0]
    return bits >> CUT


def upper_edge(number: int) -> float:
    """The highest number that a bin stands for."""
    if not number:
        return 0.0
    negative = number >> (63 - CUT)
    edge: float = struct.unpack(">d", struct.pack(">Q", (number if negative else number + 1) << CUT))[0]
    return edge


@dataclass(slots=True)
class Distribution:
    """One metric of one loop over all samples so far."""

    bins: dict[int, int] = field(default_factory=dict)
    count: int = 0
    low: float = 0.0
    high: float = 0.0
    total: float = 0.0
    """Of whole blocks."""
    part: float = 0.0
    """Of the block that is not complete."""

    def add(self, value: float) -> None:
        """The next sample's number."""
        place = bin_of(value)
        self.bins[place] = self.bins.get(place, 0) + 1
        self.low = min(self.low, value) if self.count else value
        self.high = max(self.high, value) if self.count else value
        self.count += 1
        self.part += value

    def end_block(self) -> None:
        """The block is complete."""
        self.total, self.part = self.total + self.part, 0.0

    def append(self, other: Distribution) -> None:
        """The numbers of the next block; this one has whole blocks alone."""
        for place, number in other.bins.items():
            self.bins[place] = self.bins.get(place, 0) + number
        if other.count:
            self.low = min(self.low, other.low) if self.count else other.low
            self.high = max(self.high, other.high) if self.count else other.high
        self.count += other.count
        self.total += other.total
        self.part = other.part

    @property
    def mean(self) -> float:
        """Of what was measured; there must be something."""
        return (self.total + self.part) / self.count

    def quantile(self, share: float) -> float:
        """What so large a share does not exceed, as the upper edge of its bin."""
        wanted, seen = max(1, ceil(share * self.count)), 0
        for edge, number in sorted((upper_edge(place), number) for place, number in self.bins.items()):
            seen += number
            if seen >= wanted:
                return edge
        raise ValueError("nothing was measured")

    def state(self) -> dict[str, Any]:
        """As JSON, from which `of_state` makes the same again."""
        return {
            "bins": {str(place): number for place, number in sorted(self.bins.items())},
            "numbers": [self.count, self.low, self.high, self.total, self.part],
        }

    @classmethod
    def of_state(cls, state: dict[str, Any]) -> Distribution:
        """What `state` has given."""
        return cls({int(place): int(number) for place, number in state["bins"].items()}, *state["numbers"])
