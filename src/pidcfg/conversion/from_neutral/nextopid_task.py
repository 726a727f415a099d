"""The cyclic task of a NextoPID program: the longest interval of which all loops take every n-th cycle."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from math import gcd
from typing import TYPE_CHECKING

from pidcfg.conversion.arithmetic import quotient
from pidcfg.encoders.words import nearest
from pidcfg.refs import Decision
from pidcfg.schemas.nextopid import LONGEST_SAMPLE

if TYPE_CHECKING:
    from collections.abc import Sequence

D295 = Decision(
    295,
    "the task's interval is the greatest common step of the loops' sample times, of at least 1 ms",
    "Sample times are rounded to whole milliseconds for it where they are none, and limited to 60 s; a loop runs in "
    "every n-th cycle. An interval that an option gives is taken, and sample times are rounded to its multiples. "
    "Filters and pulses run in every cycle of the task.",
    "A loop's sample time must be a multiple of the task's. 60 s is the longest that the blocks allow.",
)
SHORTEST, LONGEST = Decimal("0.001"), LONGEST_SAMPLE
"""Sample times in s."""


@dataclass(frozen=True, slots=True)
class Task:
    """The interval in s."""

    interval: Decimal

    def cycles(self, time: Decimal) -> int:
        """How many cycles are nearest to a sample time."""
        most = int(LONGEST / self.interval)
        return max(1, min(nearest(quotient(time, self.interval)), most))

    @staticmethod
    def holds(time: Decimal) -> bool:
        """Whether a sample time is one that the blocks allow."""
        return SHORTEST <= time <= LONGEST


def task_of(times: Sequence[Decimal], interval: Decimal | None) -> Task:
    """The task for these sample times; ``interval``: it is decided."""
    if interval is not None:
        return Task(interval)
    steps = [min(max(time, SHORTEST), LONGEST) for time in times]
    common = common_step(steps)
    if common < SHORTEST:
        common = common_step([max(Decimal(nearest(step / SHORTEST)), Decimal(1)) * SHORTEST for step in steps])
    return Task(common)


def common_step(times: Sequence[Decimal]) -> Decimal:
    """The greatest interval of which all times are multiples; 0.1 s without any."""
    fractions = [Fraction(time) for time in times] or [Fraction(1, 10)]
    step = fractions[0]
    for other in fractions[1:]:
        common = step.denominator * other.denominator
        step = Fraction(gcd(step.numerator * other.denominator, other.numerator * step.denominator), common)
    return Decimal(step.numerator) / Decimal(step.denominator)
