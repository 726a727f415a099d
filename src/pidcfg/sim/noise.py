"""Noise of transmitters: standard normal numbers, drawn by `random.gauss` or by kernels that give the same bits.

`normals` is Python's own generator, the Mersenne Twister with Box and Muller's transformation, on its own state, as a
kernel: compiled, it draws a number in a tenth of the time. The last bits of a logarithm or a sine depend on the
mathematical library; where compiled code is not linked to Python's, `agrees` tells, and Python draws.
"""

from __future__ import annotations

import math
import random
from array import array
from collections.abc import Callable, MutableSequence  # of the annotations that `on_lists` reads
from dataclasses import dataclass, field

Normals = Callable[[int, int, int, MutableSequence[int], MutableSequence[float], MutableSequence[float]], int]
"""The type of `normals`."""

WORDS, MIDDLE = 624, 397
"""Words of the generator's state, and how far apart those are that are mixed."""
UPPER, LOWER, MATRIX = 0x80000000, 0x7FFFFFFF, 0x9908B0DF
TURN = 2.0 * math.pi
TRIED = 4096
"""Numbers by which compiled code is held to Python's."""


def renew(state: MutableSequence[int]) -> None:
    """The next 624 words of the Mersenne Twister (kernel)."""
    for i in range(WORDS):
        following = i + 1 if i + 1 < WORDS else 0
        mixed = i + MIDDLE if i + MIDDLE < WORDS else i + MIDDLE - WORDS
        y = (state[i] & UPPER) | (state[following] & LOWER)
        state[i] = state[mixed] ^ (y >> 1) ^ (MATRIX * (y & 1))
    state[WORDS] = 0


def word(state: MutableSequence[int]) -> int:
    """32 random bits; the last number of the state counts the words that are used up (kernel)."""
    if state[WORDS] >= WORDS:
        renew(state)
    y = state[state[WORDS]]
    state[WORDS] += 1
    y ^= y >> 11
    y ^= (y << 7) & 0x9D2C5680
    y ^= (y << 15) & 0xEFC60000
    return y ^ (y >> 18)


def uniform(state: MutableSequence[int]) -> float:
    """`random.random`: 53 random bits as a number from 0 up to 1 (kernel)."""
    high = word(state) >> 5
    low = word(state) >> 6
    return (high * 67108864.0 + low) * (1.0 / 9007199254740992.0)


def normals(
    rows: int,
    column: int,
    columns: int,
    state: MutableSequence[int],
    spare: MutableSequence[float],
    noise: MutableSequence[float],
) -> int:
    """Fills a column of ``rows`` with what ``random.gauss(0.0, 1.0)`` draws (kernel).

    Numbers come in pairs; ``spare`` holds the second one, and whether there is one.
    """
    for row in range(rows):
        if spare[1] != 0.0:
            z = spare[0]
            spare[1] = 0.0
        else:
            angle = uniform(state) * TURN
            radius = math.sqrt(-2.0 * math.log(1.0 - uniform(state)))
            z = math.cos(angle) * radius
            spare[0] = math.sin(angle) * radius
            spare[1] = 1.0
        noise[row * columns + column] = 0.0 + z
    return rows


@dataclass(slots=True)
class Noise:
    """Noise by rows, of each row a number from each of the sources: what one draws depends on none of the others."""

    seeds: list[str]
    fast: Normals | None = None
    """`normals`, compiled; without it Python draws."""
    sources: list[random.Random] = field(init=False)
    states: list[tuple[array[int], array[float]]] = field(init=False)

    def __post_init__(self) -> None:
        self.sources = [random.Random(seed) for seed in self.seeds]
        self.states = [state_of(source) for source in self.sources] if self.fast is not None else []

    def rows(self, count: int) -> array[float]:
        """The next rows, one after the other."""
        columns = len(self.seeds)
        noise = array("d", bytes(8 * count * columns))
        for column, source in enumerate(self.sources):
            if self.fast is not None:
                self.fast(count, column, columns, *self.states[column], noise)
            else:
                noise[column::columns] = array("d", [source.gauss(0.0, 1.0) for _ in range(count)])
        return noise


def state_of(source: random.Random) -> tuple[array[int], array[float]]:
    """A source's state as `normals` takes it."""
    _, words, spare = source.getstate()
    return array("q", words), array("d", [0.0, 0.0] if spare is None else [spare, 1.0])


def agrees(fast: Normals, tried: int = TRIED) -> bool:
    """Whether compiled code draws what Python does."""
    return Noise(["noise"], fast).rows(tried).tobytes() == Noise(["noise"]).rows(tried).tobytes()
