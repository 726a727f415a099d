"""Codecs of 16-bit words: a pair with a stated domain, exact in between.

Outside stands a `Decimal` (or an int where nothing else can be meant), inside an int from 0 to 0xFFFF. Rounding is half
to even on exact decimals. What a word cannot hold raises `EncodeError`, a word that cannot be a value `DecodeError`;
neither ever guesses.
"""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Decimal
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pidcfg.frozen import frozen
from pidcfg.schemas.numbers import EXACT

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

WORD_MAX = 0xFFFF
SIGN = 0x8000
Fault = Literal["range", "off", "form", "wire"]


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
    """A word that is not a value of its format; ``place``: its offset in a block, its address, or its name."""

    def __init__(self, message: str, place: Any = None) -> None:
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


@frozen
class Bcd:
    """Four BCD digits with an implied decimal point. ``off``: digits that switch it off, or do ``special``."""

    rounds: ClassVar[bool] = True
    """Values are rounded to the last digit, which is worth reporting."""
    decimals: int
    off: tuple[int, ...] = ()
    special: str = "off"

    @property
    def notation(self) -> str:
        """How the word is written, for reference pages."""
        off = f", {' and '.join(f'{digits:04d}' for digits in self.off)} {self.special}" if self.off else ""
        return f"BCD, {self.decimals} decimal{'s' * (self.decimals > 1)}{off}" if self.decimals else f"BCD{off}"

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
            raise EncodeError("range", "is outside the word's range", self.low, self.high)
        if digits in self.off and value != digits * self.step:
            effect = "switches it off" if self.special in {"off", "not allowed"} else self.special
            raise EncodeError("off", f"rounds to {digits * self.step}, which {effect}", self.low, self.high)
        return bcd_word(digits)

    def decode(self, word: int) -> Decimal:
        """A word to its value."""
        return bcd_digits(word) * self.step


@frozen
class Binary:
    """An unsigned binary word from 0 to ``high``."""

    high: int = WORD_MAX

    @property
    def room(self) -> int:
        """The largest difference that the word can hold."""
        return self.high

    @property
    def notation(self) -> str:
        """How the word is written, for reference pages."""
        return "binary"

    @property
    def low(self) -> int:
        """Smallest value."""
        return 0

    def encode(self, value: int) -> int:
        """A number to its word."""
        if not 0 <= value <= self.high:
            raise EncodeError("range", "is outside the word's range", Decimal(0), Decimal(self.high))
        return value

    def decode(self, word: int) -> int:
        """A word to its number."""
        if word > self.high:
            raise DecodeError(f"0x{word:04X} is above 0x{self.high:04X}")
        return word


@frozen
class Pointer(Binary):
    """A word that holds the address of another one; 0 points nowhere."""

    @staticmethod
    def spelled(word: int, name: Callable[[int], str]) -> str:
        """The address as the vendor writes it."""
        return name(word) if word else "none"


@frozen
class SignMagnitude:
    """A magnitude up to ``high`` with bit 15 as its sign; −0 and stray bits between are not values."""

    high: int

    @property
    def room(self) -> int:
        """The largest difference that the word can hold."""
        return self.high

    @property
    def low(self) -> int:
        """Smallest value."""
        return -self.high

    def encode(self, value: int) -> int:
        """A number to its word: ``SignMagnitude(4095).encode(-1) == 0x8001``."""
        if abs(value) > self.high:
            raise EncodeError("range", "is outside the word's range", Decimal(-self.high), Decimal(self.high))
        return value if value >= 0 else SIGN | -value

    def decode(self, word: int) -> int:
        """A word to its number."""
        magnitude = word & ~SIGN
        if magnitude > self.high:
            raise DecodeError(f"0x{word:04X} has bits set above 0x{self.high:04X} and the sign")
        if word == SIGN:
            raise DecodeError("0x8000 is minus zero")
        return -magnitude if word & SIGN else magnitude


@frozen
class Implied:
    """A whole number with an implied point, ``least`` (negative: two's complement) to ``most``; `off` as `Bcd`."""

    rounds: ClassVar[bool] = True
    decimals: int = 0
    off: tuple[int, ...] = ()
    least: int = 0
    most: int = WORD_MAX
    special: str = "off"

    @property
    def notation(self) -> str:
        """How the word is written, for reference pages."""
        signed = "signed " if self.least < 0 else ""
        off = f", {' and '.join(map(str, self.off))} {self.special}" if self.off else ""
        return f"{signed}integer of {self.step:f}{off}" if self.decimals else f"{signed}integer{off}"

    @property
    def step(self) -> Decimal:
        """The last digit's worth."""
        return Decimal(1).scaleb(-self.decimals)

    def encode(self, value: Decimal) -> int:
        """A value to its word; one that merely rounds onto an off code is refused."""
        number = nearest(Decimal(value).scaleb(self.decimals, EXACT))
        low, high = self.least * self.step, self.most * self.step
        if not self.least <= number <= self.most or not low <= value <= high:
            raise EncodeError("range", "is outside the word's range", low, high)
        if number in self.off and value != number * self.step:
            raise EncodeError("off", f"rounds to {number * self.step}, which switches it off", low, high)
        return number & WORD_MAX

    def decode(self, word: int) -> Decimal:
        """A word to its value."""
        return (word - 0x10000 if self.least < 0 and word & SIGN else word) * self.step


@frozen
class Choice:
    """A switch: each of its two states by its value in the file."""

    choices: Mapping[int, Any]

    @property
    def notation(self) -> str:
        """How the switch is written, for reference pages."""
        states = (
            (bit, str(value).lower() if isinstance(value, bool) else value) for bit, value in self.choices.items()
        )
        return ", ".join(f"{bit} {value}" for bit, value in states)

    def encode(self, value: Any) -> int:
        """A value to its bit."""
        return next(bit for bit, chosen in self.choices.items() if chosen == value)

    def decode(self, bit: int) -> Any:
        """A bit to its value."""
        if bit not in self.choices:
            raise DecodeError(f"{bit} is not the state of a switch")
        return self.choices[bit]


FLAG = Choice({0: False, 1: True})
