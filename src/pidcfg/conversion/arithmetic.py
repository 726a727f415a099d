"""What adapters calculate with: exact decimals between the terms of vendors."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.schemas.numbers import EXACT, plain_number

if TYPE_CHECKING:
    from collections.abc import Sequence

ZERO, ONE, HUNDRED = Decimal(0), Decimal(1), Decimal(100)
DIGITS = 12
"""Significant digits of what a quotient or a logarithm gives."""
Span = tuple[Decimal, Decimal]


def rounded(value: Decimal) -> Decimal:
    """A computed number without the noise of its last digits."""
    return Decimal(f"{value:.{DIGITS}g}") if value else ZERO


def number(value: Decimal) -> int | float:
    """A number as a file has it, its computed digits rounded."""
    return plain_number(rounded(value))


def width(span: Sequence[Decimal]) -> Decimal:
    """From 0 % to 100 %."""
    return span[1] - span[0]


def quotient(a: Decimal, b: Decimal) -> Decimal:
    """A / b."""
    return EXACT.divide(a, b)


def product(*factors: Decimal) -> Decimal:
    """All factors multiplied."""
    result = ONE
    for factor in factors:
        result = EXACT.multiply(result, factor)
    return result


def rescaled(value: Decimal, source: Sequence[Decimal], target: Sequence[Decimal]) -> Decimal:
    """A value of one scale at the same place of another."""
    return target[0] + quotient(product(value - source[0], width(target)), width(source))


def filter_time(share: Decimal, sample_time: Decimal) -> Decimal:
    """The time constant of a filter that takes this share of a difference in each sample; 1: no filter."""
    if share >= ONE:
        return ZERO
    return rounded(-quotient(sample_time, EXACT.ln(ONE - share)))


def filter_share(time: Decimal, sample_time: Decimal) -> Decimal:
    """The share of a difference that a filter with this time constant takes in each sample."""
    if time <= ZERO:
        return ONE
    return rounded(ONE - EXACT.exp(-quotient(sample_time, time)))


def decayed(sample_time: Decimal, time: Decimal) -> Decimal:
    """The share of a difference that a backward step of a filter with this time constant takes in each sample."""
    return rounded(quotient(sample_time, sample_time + time))


def gain_limit(derivative: Decimal, constant: Decimal, highest: int) -> int:
    """The whole N from 1 on with which derivative / N is nearest to the wanted time constant of its filter."""
    below = min(max(int(quotient(derivative, constant)), 1), highest)
    above = min(below + 1, highest)
    return min((below, above), key=lambda n: abs(quotient(derivative, Decimal(n)) - constant))


def dependent(kp: Decimal, ki: Decimal, kd: Decimal) -> tuple[Decimal, Decimal, Decimal, bool]:
    """Independent gains as gain, integral and derivative time, and whether there is a proportional action.

    Without one the gain is 1: the times then are 1/Ki and Kd. Without any of the three it is 0.
    """
    gain = kp or (ONE if ki or kd else ZERO)
    integral = rounded(quotient(gain, ki)) if ki else ZERO
    return gain, integral, rounded(quotient(kd, gain)) if kd else ZERO, bool(kp) or not (ki or kd)


def independent(gain: Decimal, integral: Decimal, derivative: Decimal) -> tuple[Decimal, Decimal]:
    """Ki and Kd of gain, integral time (0: none) and derivative time."""
    return rounded(quotient(gain, integral)) if integral else ZERO, rounded(product(gain, derivative))
