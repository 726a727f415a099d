"""Codecs of 16-bit words: a pair with a stated domain, exact in between.

Outside stands a `Decimal` (or an int where nothing else can be meant), inside an int from 0 to 0xFFFF. Rounding is half
to even on exact decimals. What a word cannot hold raises `EncodeError`, a word that cannot be a value `DecodeError`;
neither ever guesses.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal
from typing import Literal

from pidcfg.schemas.base import EXACT

WORD_MAX = 0xFFFF
SIGN = 0x8000
Fault = Literal["range", "off", "form"]


class EncodeError(ValueError):
    """A value that its word cannot hold: outside ``low``..``high``, rounded onto an off code, or of the wrong form.

    ``stored`` is what the word would hold all the same, where it has room for a value that means nothing.
    """

    stored: int | None = None

    def __init__(self, fault: Fault, message: str, low: Decimal | None = None, high: Decimal | None = None) -> None:
        super().__init__(message)
        self.fault = fault
        self.low = low
        self.high = high


class DecodeError(ValueError):
    """A word that is not a value of its format; ``place``: its offset in a block, or its address, where known."""

    def __init__(self, message: str, place: int | None = None) -> None:
        super().__init__(message)
        self.place = place


def nearest(value: Decimal) -> int:
    """The nearest integer, ties to even, exactly."""
    return int(value.to_integral_value(ROUND_HALF_EVEN))


def bcd_word(digits: int) -> int:
    """0..9999 as four BCD digits: ``bcd_word(20) == 0x0020``."""
    return int(str(digits), 16)


def bcd_digits(word: int) -> int:
    """Four BCD digits as a number; a digit above 9 is refused."""
    text = f"{word:04X}"
    if not text.isdecimal():
        raise DecodeError(f"0x{text} has a digit above 9")
    return int(text)


@dataclass(frozen=True, slots=True)
class Bcd:
    """Four BCD digits with an implied decimal point. ``off``: digits that switch the function off."""

    decimals: int
    off: tuple[int, ...] = ()

    @property
    def step(self) -> Decimal:
        """The last digit's worth."""
        return Decimal(1).scaleb(-self.decimals)

    @property
    def low(self) -> Decimal:
        """Smallest value."""
        return Decimal(0)

    @property
    def high(self) -> Decimal:
        """Largest value."""
        return 9999 * self.step

    def encode(self, value: Decimal) -> int:
        """A value to its word; one that merely rounds onto an off code is refused."""
        digits = nearest(value.scaleb(self.decimals, EXACT))
        if not 0 <= digits <= 9999 or value < 0:
            raise EncodeError("range", "outside the word's range", self.low, self.high)
        if digits in self.off and value != digits * self.step:
            raise EncodeError("off", f"rounds to {digits * self.step}, which switches it off", self.low, self.high)
        return bcd_word(digits)

    def decode(self, word: int) -> Decimal:
        """A word to its value."""
        return bcd_digits(word) * self.step


@dataclass(frozen=True, slots=True)
class Binary:
    """An unsigned binary word from 0 to ``high``."""

    high: int = WORD_MAX

    @property
    def low(self) -> int:
        """Smallest value."""
        return 0

    def encode(self, value: int) -> int:
        """A number to its word."""
        if not 0 <= value <= self.high:
            raise EncodeError("range", "outside the word's range", Decimal(0), Decimal(self.high))
        return value

    def decode(self, word: int) -> int:
        """A word to its number."""
        if word > self.high:
            raise DecodeError(f"0x{word:04X} is above 0x{self.high:04X}")
        return word


@dataclass(frozen=True, slots=True)
class SignMagnitude:
    """A magnitude up to ``high`` with bit 15 as its sign; −0 and stray bits between are not values."""

    high: int

    @property
    def low(self) -> int:
        """Smallest value."""
        return -self.high

    def encode(self, value: int) -> int:
        """A number to its word: ``SignMagnitude(4095).encode(-1) == 0x8001``."""
        if abs(value) > self.high:
            raise EncodeError("range", "outside the word's range", Decimal(-self.high), Decimal(self.high))
        return value if value >= 0 else SIGN | -value

    def decode(self, word: int) -> int:
        """A word to its number."""
        magnitude = word & ~SIGN
        if magnitude > self.high:
            raise DecodeError(f"0x{word:04X} has bits set above 0x{self.high:04X} and the sign")
        if word == SIGN:
            raise DecodeError("0x8000 is minus zero")
        return -magnitude if word & SIGN else magnitude


@dataclass(frozen=True, slots=True)
class Source:
    """Where an auto transfer goes: base, slot and channel, or with bit 15 a V-memory address."""

    def encode(self, value: tuple[int, int, int] | int) -> int:
        """``(base, slot, channel)`` or an address to its word: slot 1, channel 2 is 0102."""
        if isinstance(value, int):
            if not 0 <= value < SIGN:
                raise EncodeError("range", "an address beyond V77777 does not fit the lower 15 bits")
            return SIGN | value
        base, slot, channel = value
        if not (0 <= base <= 7 and 0 <= slot <= 15 and 0 <= channel <= 255):
            raise EncodeError("range", "base, slot or channel does not fit its digits")
        return base << 12 | slot << 8 | channel

    def decode(self, word: int) -> tuple[int, int, int] | int | None:
        """A word to ``(base, slot, channel)``, an address, or None for no transfer."""
        if word & SIGN:
            return word & ~SIGN
        return (word >> 12, word >> 8 & 0xF, word & 0xFF) if word else None
