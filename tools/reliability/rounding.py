"""Which word is the nearest to a number, computed with fractions and none of the product's arithmetic."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from math import isqrt
from typing import TYPE_CHECKING, Any, Protocol

from pidcfg.encoders.codecs import Bcd, Implied, Position, Single
from pidcfg.schemas.base import Quantity

if TYPE_CHECKING:
    import random

    from pidcfg.encoders.codecs import Scale

DRAWN = 1_000
"""Numbers that are encoded of a field, each time."""
HALF = Fraction(1, 2)
FINE = 10**12
"""Parts of a count that the root of a span is worked out to."""
SINGLE_FINITE = 0x7F7FFFFF


class Rounding(Protocol):
    """What is known of the numbers of a field without its codec."""

    def drawn(self, rng: random.Random) -> Any:
        """A number, in the range or a little outside."""

    def is_nearest(self, value: Any, word: int) -> bool:
        """Whether no other word is nearer."""

    def refuses(self, value: Any, fault: str) -> bool:
        """Whether a number may be refused."""


def of(codec: object, scale: Scale | None) -> Rounding | None:
    """The rounding of a codec; None where its values are no numbers, or are counts."""
    if isinstance(codec, Bcd | Implied):
        return Digits(codec)
    if isinstance(codec, Position) and scale is not None and scale.range is not None:
        return Counts(scale, scale.range)
    return Singles() if isinstance(codec, Single) else None


@dataclass(frozen=True)
class Digits:
    """Whole digits with an implied point."""

    codec: Bcd | Implied

    @property
    def ends(self) -> tuple[int, int]:
        """The least and the largest digits."""
        return (0, 9999) if isinstance(self.codec, Bcd) else (self.codec.low_count, self.codec.high_count)

    def drawn(self, rng: random.Random) -> Decimal:
        low, high = self.ends
        digits = Decimal(rng.randint(low - 3, high + 3)) + rng.choice(
            (Decimal(0), Decimal("0.5"), Decimal(rng.random()))
        )
        return digits.scaleb(-self.codec.decimals)

    def _exact(self, value: Decimal) -> Fraction:
        return Fraction(value) * 10**self.codec.decimals

    def is_nearest(self, value: Decimal, word: int) -> bool:
        digits = (
            int(f"{word:x}") if isinstance(self.codec, Bcd) else word - (1 << 16) * (self.ends[0] < 0 and word >> 15)
        )
        return _even(digits, self._exact(value))

    def refuses(self, value: Decimal, fault: str) -> bool:
        exact = self._exact(value)
        off = any(abs(exact - digits) <= HALF and exact != digits for digits in self.codec.off)
        return off if fault == "off" else not self.ends[0] <= exact <= self.ends[1]


def _even(digits: int, exact: Fraction) -> bool:
    """Whether these are the nearest whole digits, the even ones of two."""
    return abs(digits - exact) < HALF or (abs(digits - exact) == HALF and digits % 2 == 0)


@dataclass(frozen=True)
class Counts:
    """Counts of a value on a scale with a range."""

    scale: Scale
    range: tuple[Decimal, Decimal]

    def drawn(self, rng: random.Random) -> Quantity:
        low, high = self.range
        return Quantity(low + (high - low) * Decimal(rng.choice((0, 0.5, 1, rng.random(), rng.uniform(-0.1, 1.1)))))

    def _exact(self, value: Quantity) -> Fraction:
        low, high = map(Fraction, self.range)
        span, zero = self.scale.format.span, self.scale.format.minimum
        if self.scale.has_root:
            full, zero = Fraction(isqrt(span * FINE**2), FINE), 0
        else:
            full = Fraction(span)
        return (Fraction(value.value) - low) * full / (high - low) + zero

    def is_nearest(self, value: Quantity, word: int) -> bool:
        form = self.scale.format
        counts = -(word & 0x7FFF) if form.minimum < 0 and word >> 15 else word
        near = abs(counts - self._exact(value)) <= HALF + Fraction(1, FINE // 10**6)
        return near if self.scale.has_root else _even(counts, self._exact(value))

    def refuses(self, value: Quantity, fault: str) -> bool:
        form = self.scale.format
        top = isqrt(form.span) if self.scale.has_root else form.maximum
        low = 0 if self.scale.has_root else form.minimum
        return fault == "range" and not low - HALF <= self._exact(value) <= top + HALF - self.scale.has_root * HALF


class Singles:
    """Single precision."""

    @staticmethod
    def drawn(rng: random.Random) -> Decimal:
        if rng.randrange(4) == 0:  # half way between two of them, as near as a `Decimal` comes
            bits = rng.randrange(1, SINGLE_FINITE)
            half = (_exact(bits) + _exact(bits + 1)) / 2
            return Decimal(half.numerator) / Decimal(half.denominator) * rng.choice((1, -1))
        if rng.randrange(2):
            return Decimal(f"{rng.uniform(-1e4, 1e4):.{rng.randrange(12)}f}")
        return Decimal(f"{rng.random():.17f}E{rng.randint(-46, 39)}")

    @staticmethod
    def is_nearest(value: Decimal, word: int) -> bool:
        bits, exact = word & 0x7FFFFFFF, Fraction(abs(value))
        if bool(word >> 31) != (value < 0):
            return False
        off = abs(_exact(bits) - exact)
        below = abs(_exact(bits - 1) - exact) if bits else off
        above = abs(_exact(bits + 1) - exact)
        return off <= min(below, above) and (bits % 2 == 0 or off < min(below, above))

    @staticmethod
    def refuses(value: Decimal, fault: str) -> bool:
        exact = Fraction(abs(value))
        if fault == "off":
            return 0 < exact <= _exact(1) / 2
        return exact >= _exact(SINGLE_FINITE) + (_exact(SINGLE_FINITE) - _exact(SINGLE_FINITE - 1)) / 2


def _exact(bits: int) -> Fraction:
    """The number of a pattern without sign; one beyond the largest as if there were no end."""
    power, part = bits >> 23, bits & 0x7FFFFF
    whole, power = (part, 1) if power == 0 else (part | 0x800000, power)
    return Fraction(whole) * Fraction(2) ** (power - 150)
