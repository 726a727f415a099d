"""The checks that the DL06 itself makes of its set-up words and pointers, as pure functions of 16-bit words.

The controller reports them as bits (V7642, +35, bit 10 of +06); the validator shows the same bits before the download.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dl06 import CPU, LOOP_TABLE, RAMP_SOAK_SIZE, Cpu
from pidcfg.encoders.words import DecodeError, bcd_digits
from pidcfg.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Sequence

OUTSIDE_LOWER, OUTSIDE_UPPER, TOO_MANY, STRADDLES = 1, 2, 4, 8
"""Bits of V7642."""
TABLE_OUTSIDE_LOWER, TABLE_OUTSIDE_UPPER, TABLE_IN_SYSTEM = 1, 2, 16
"""Bits of +35."""


@frozen
class Setup:
    """What the CPU makes of V7640 and V7641 when it goes from Program to Run."""

    start: int
    count: int
    """Number of loops; 0 when the word is no BCD number."""
    flags: int
    """V7642."""

    @property
    def running(self) -> bool:
        """Whether the loop task runs at all."""
        return self.flags == 0 and self.count > 0


def check_setup(pointer: int, count_word: int, cpu: Cpu = CPU) -> Setup:
    """Bits 0 to 3 of V7642. A count that is no BCD number is reported as too many loops (D53)."""
    try:
        count = bcd_digits(count_word)
    except DecodeError:
        return Setup(pointer, 0, _start_flags(pointer, cpu) | TOO_MANY)
    flags = _start_flags(pointer, cpu)
    if count > cpu.loops:
        flags |= TOO_MANY
    last = pointer + count * LOOP_TABLE.size - 1
    if cpu.lower[0] <= pointer <= cpu.lower[1] and last > cpu.lower_end:
        flags |= STRADDLES
    return Setup(pointer, count, flags)


def _start_flags(pointer: int, cpu: Cpu) -> int:
    if pointer < cpu.upper[0]:
        return 0 if cpu.lower[0] <= pointer <= cpu.lower[1] else OUTSIDE_LOWER
    return 0 if pointer <= cpu.upper[1] else OUTSIDE_UPPER


def check_ramp_soak(pointer: int, cpu: Cpu = CPU) -> int:
    """Bits 0, 1 and 4 of +35 for a table at ``pointer``: one of them, unless it lies in user memory (D54)."""
    if cpu.system[0] <= pointer <= cpu.system[1]:
        return TABLE_IN_SYSTEM
    last = pointer + RAMP_SOAK_SIZE - 1
    if any(first <= pointer and last <= end for first, end in cpu.user):
        return 0
    return TABLE_OUTSIDE_LOWER if pointer < cpu.upper[0] else TABLE_OUTSIDE_UPPER


def alarm_order_broken(pv: Sequence[int] | None, deviation: Sequence[int] | None) -> bool:
    """Bit 10 of +06: low-low < low < high < high-high and yellow < red, for the groups that are on (None: off)."""
    return any(low >= high for group in (pv, deviation) if group is not None for low, high in pairwise(group))
