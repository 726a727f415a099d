"""Codecs of registers: 16-bit words, single-precision numbers, and engineering units to counts, exact both ways."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from decimal import ROUND_HALF_EVEN, Decimal
from functools import cached_property
from math import inf, isfinite, nextafter
from typing import Any, ClassVar, Literal, Protocol

from pidcfg.schemas.base import Quantity
from pidcfg.schemas.numbers import EXACT_CONTEXT
from pidcfg.text.frozen import frozen

# --- Codecs of 16-bit words: a pair with a stated domain, exact in between --------------------------------------------
#
# Outside stands a `Decimal` (or an int where nothing else can be meant), inside an int from 0 to 0xFFFF. Rounding is
# half to even on exact decimals. What a word cannot hold raises `EncodeError`, a word that cannot be a value
# `DecodeError`; neither ever guesses.

WORD_MAX = 0xFFFF
MAX_BCD = 9999
SIGN_BIT = 0x8000
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
    """A word that is not a value of its format; ``address``: its offset in a block, its address, or its name."""

    def __init__(self, message: str, address: Any = None) -> None:
        super().__init__(message)
        self.address = address


def round_to_integer(value: Decimal) -> int:
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


def typed_digits(word: int) -> int | None:
    """The BCD word of the number that a word is in decimal: 00FA is 250, hence 0250; None: it has five digits."""
    return bcd_word(word) if word <= MAX_BCD else None


@frozen
class Bcd:
    """Four BCD digits with an implied decimal point. ``off``: digits that switch it off, or do ``off_effect``."""

    reports_rounding: ClassVar[bool] = True
    """Values are rounded to the last digit, which is worth reporting."""
    decimals: int
    off: tuple[int, ...] = ()
    off_effect: str = "off"

    @property
    def notation(self) -> str:
        """How the word is written, for reference pages."""
        off = f", {' and '.join(f'{digits:04d}' for digits in self.off)} {self.off_effect}" if self.off else ""
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
        return MAX_BCD * self.step

    def encode(self, value: Decimal) -> int:
        """A value to its word; one that merely rounds onto an off code is refused."""
        digits = round_to_integer(value.scaleb(self.decimals, EXACT_CONTEXT))
        if value < 0 or digits > MAX_BCD:
            raise EncodeError("range", "is outside the word's range", self.low, self.high)
        if digits in self.off and value != digits * self.step:
            effect = "switches it off" if self.off_effect in {"off", "not allowed"} else self.off_effect
            raise EncodeError("off", f"rounds to {digits * self.step}, which {effect}", self.low, self.high)
        return bcd_word(digits)

    def decode(self, word: int) -> Decimal:
        """A word to its value; one that is no BCD is refused with the digits that would mean what it is in decimal."""
        try:
            return bcd_digits(word) * self.step
        except DecodeError as error:
            typed_word = typed_digits(word)
            if typed_word is None:
                raise
            raise DecodeError(
                f"{error}; it is {word} (typed in decimal? {self.show(typed_word)} would be {typed_word:04X})"
            ) from None

    def show(self, word: int) -> str:
        """The value of four BCD digits with all its decimals; that of an off code with what it does."""
        digits = bcd_digits(word)
        return f"{digits * self.step:f}{f' ({self.off_effect})' if digits in self.off else ''}"


@frozen
class Binary:
    """An unsigned binary word from 0 to ``high``."""

    high: int = WORD_MAX

    @property
    def max_difference(self) -> int:
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
    def spell(word: int, name: Callable[[int], str]) -> str:
        """The address as the vendor writes it."""
        return name(word) if word else "none"


@frozen
class SignMagnitude:
    """A magnitude up to ``high`` with bit 15 as its sign; −0 and stray bits between are not values."""

    high: int

    @property
    def max_difference(self) -> int:
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
        return value if value >= 0 else SIGN_BIT | -value

    def decode(self, word: int) -> int:
        """A word to its number."""
        magnitude = word & ~SIGN_BIT
        if magnitude > self.high:
            raise DecodeError(f"0x{word:04X} has bits set above 0x{self.high:04X} and the sign")
        if word == SIGN_BIT:
            raise DecodeError("0x8000 is minus zero")
        return -magnitude if word & SIGN_BIT else magnitude


@frozen
class Implied:
    """A whole number with an implied point, ``low_count`` (< 0: two's complement) to ``high_count``; `off` as `Bcd`."""

    reports_rounding: ClassVar[bool] = True
    decimals: int = 0
    off: tuple[int, ...] = ()
    low_count: int = 0
    high_count: int = WORD_MAX
    off_effect: str = "off"

    @property
    def notation(self) -> str:
        """How the word is written, for reference pages."""
        signed = "signed " if self.low_count < 0 else ""
        off = f", {' and '.join(map(str, self.off))} {self.off_effect}" if self.off else ""
        return f"{signed}integer of {self.step:f}{off}" if self.decimals else f"{signed}integer{off}"

    @property
    def step(self) -> Decimal:
        """The last digit's worth."""
        return Decimal(1).scaleb(-self.decimals)

    def encode(self, value: Decimal) -> int:
        """A value to its word; one that merely rounds onto an off code is refused."""
        number = round_to_integer(Decimal(value).scaleb(self.decimals, EXACT_CONTEXT))
        low, high = self.low_count * self.step, self.high_count * self.step
        if not self.low_count <= number <= self.high_count or not low <= value <= high:
            raise EncodeError("range", "is outside the word's range", low, high)
        if number in self.off and value != number * self.step:
            raise EncodeError("off", f"rounds to {number * self.step}, which switches it off", low, high)
        return number & WORD_MAX

    def decode(self, word: int) -> Decimal:
        """A word to its value."""
        return (word - 0x10000 if self.low_count < 0 and word & SIGN_BIT else word) * self.step


@frozen
class Choice:
    """A switch: each of its two states by its value in the file."""

    choices: Mapping[int, object]

    @property
    def notation(self) -> str:
        """How the switch is written, for reference pages."""
        states = (
            (bit, str(value).lower() if isinstance(value, bool) else value) for bit, value in self.choices.items()
        )
        return ", ".join(f"{bit} {value}" for bit, value in states)

    def encode(self, value: object) -> int:
        """A value to its bit."""
        return next(bit for bit, chosen in self.choices.items() if chosen == value)

    def decode(self, bit: int) -> Any:
        """A bit to its value."""
        if bit not in self.choices:
            raise DecodeError(f"{bit} is not the state of a switch")
        return self.choices[bit]


FLAG = Choice({0: False, 1: True})

# --- Single-precision numbers (IEEE 754) in registers of 32 bits ------------------------------------------------------

SINGLE_MINUS_ZERO = 0x80000000
LARGEST_SINGLE = Decimal("3.4028234663852886E+38")


def single_bits(value: float) -> int | None:
    """The bits of the nearest single-precision number; None when there is no finite one."""
    try:
        return int.from_bytes(struct.pack(">f", value), "big") if isfinite(value) else None
    except OverflowError:
        return None


def single_value(raw: int) -> float:
    """The shortest decimal that means these single-precision bits, as a float: ``2.4``, not ``2.4000000953674316``."""
    exact: float = struct.unpack(">f", raw.to_bytes(4, "big"))[0]
    if not isfinite(exact):
        return exact
    return next(v for v in (float(f"{exact:.{digits}g}") for digits in range(1, 10)) if single_bits(v) == raw)


def _round_to_odd(value: Decimal) -> float:
    """One of the two doubles around a number, that with the odd last bit: rounded again it is as if rounded once."""
    double = float(value)
    exact = Decimal(double)
    if exact == value or not isfinite(double) or struct.pack(">d", double)[-1] & 1:
        return double
    return nextafter(double, inf if value > exact else -inf)


@frozen
class Single:
    """A single-precision number (IEEE 754), rounded to the nearest, ties to even."""

    reports_rounding: ClassVar[bool] = False

    @property
    def notation(self) -> str:
        """How the register is written, for reference pages."""
        return "float"

    def encode(self, value: Decimal) -> int:
        """A value to its bits; what is too large, or so small that it would become 0, is refused."""
        bits = single_bits(_round_to_odd(value))
        if bits is None:
            raise EncodeError("range", "is outside the range of single precision", -LARGEST_SINGLE, LARGEST_SINGLE)
        if value and not bits & 0x7FFFFFFF:
            raise EncodeError("off", "rounds to 0 in single precision")
        return 0 if bits == SINGLE_MINUS_ZERO else bits

    def decode(self, raw: int) -> Decimal:
        """Bits to the shortest decimal that means them."""
        value = single_value(raw)
        if not isfinite(value):
            raise DecodeError(f"0x{raw:08X} is not a finite number")
        return Decimal(repr(value))


# --- Engineering units to counts and back, exactly --------------------------------------------------------------------
#
# A `Scale` is a data format (which counts exist) and a range (what they mean). Positions lie on the scale, spans are
# distances along it. On a square-root scale full scale is the root of the span: the set point of a loop that extracts
# the root of its PV is compared with that root.

MAX_DECIMALS = 12
BAND_TOLERANCE, POSITION_TOLERANCE = Decimal("0.01"), Decimal("0.0005")
"""Of a band's value, and of the span for a position: what is further off is not the same number."""
EXAMPLE_TOLERANCE = Decimal("0.0001")
"""Of a value, and of the span for a position: how close the number is that says what a word means."""


class CountsCodec(Protocol):
    """Whole counts in a word, from 0 % to 100 %."""

    @property
    def low(self) -> int:
        """Counts at 0 %."""

    @property
    def high(self) -> int:
        """Counts at 100 %."""

    @property
    def max_difference(self) -> int:
        """The largest difference that a word can hold, whether it means anything or not."""

    def encode(self, value: int, /) -> int:
        """Counts to the word."""

    def decode(self, word: int, /) -> int:
        """The word to counts."""


@frozen
class Format:
    """A data format of PV, set point and output."""

    name: str
    codec: CountsCodec

    @property
    def minimum(self) -> int:
        """Counts at 0 %."""
        return self.codec.low

    @property
    def maximum(self) -> int:
        """Counts at 100 %."""
        return self.codec.high

    @property
    def span(self) -> int:
        """Counts from 0 % to 100 %."""
        return self.codec.high - self.codec.low


@frozen
class Scale:
    """A data format with engineering values at its ends (None: raw counts)."""

    format: Format
    range: tuple[Decimal, Decimal] | None = None
    has_root: bool = False

    @cached_property
    def full_counts(self) -> Decimal:
        """Counts from 0 % to 100 % on this scale."""
        span = Decimal(self.format.span)
        return EXACT_CONTEXT.sqrt(span) if self.has_root else span

    @cached_property
    def width(self) -> Decimal:
        """Engineering units from 0 % to 100 %; 1 on a raw scale."""
        return EXACT_CONTEXT.subtract(self.range[1], self.range[0]) if self.range else Decimal(1)

    @property
    def zero_counts(self) -> int:
        """Counts at 0 %."""
        return 0 if self.has_root else self.format.minimum

    @property
    def top_counts(self) -> int:
        """Counts at 100 %."""
        return self.zero_counts + round_to_integer(self.full_counts)

    @property
    def ends(self) -> tuple[Quantity, Quantity]:
        """The counts at both ends."""
        return Quantity(Decimal(self.zero_counts), counts=True), Quantity(Decimal(self.top_counts), counts=True)

    def position(self, quantity: Quantity) -> Decimal:
        """Counts of a value on the scale, not yet rounded."""
        if quantity.counts or self.range is None:
            return quantity.value
        return EXACT_CONTEXT.add(
            self._units_to_counts(EXACT_CONTEXT.subtract(quantity.value, self.range[0])), Decimal(self.zero_counts)
        )

    def distance(self, quantity: Quantity) -> Decimal:
        """Counts of a difference of two values, not yet rounded."""
        return quantity.value if quantity.counts or self.range is None else self._units_to_counts(quantity.value)

    def _units_to_counts(self, value: Decimal) -> Decimal:
        """Multiplied before it is divided, so that a tie comes out as one: a quotient ending in .5 is exact."""
        return EXACT_CONTEXT.divide(EXACT_CONTEXT.multiply(value, self.full_counts), self.width)

    def value(self, counts: int) -> Quantity:
        """The shortest engineering value that encodes to these counts."""
        if self.range is None:
            return Quantity(Decimal(counts))
        if counts > self.top_counts:  # a word of a square-root loop may hold more than full scale
            return Quantity(Decimal(counts), counts=True)
        exact = EXACT_CONTEXT.add(self.range[0], self._counts_to_units(Decimal(counts - self.zero_counts)))
        return shortest_quantity(exact, lambda q: round_to_integer(self.position(q)) == counts, counts)

    def span_value(self, counts: int | Decimal) -> Quantity:
        """The shortest engineering difference that encodes to these counts."""
        return self.matching_span(counts, lambda q: round_to_integer(self.distance(q)) == counts)

    def matching_span(self, counts: int | Decimal, is_same: Callable[[Quantity], bool]) -> Quantity:
        """As `span_value`, with the test of equality that fits the word."""
        if self.range is None:
            return Quantity(Decimal(counts))
        if counts > (self.top_counts if self.has_root else self.format.maximum):
            return Quantity(Decimal(counts), counts=True)
        return shortest_quantity(self._counts_to_units(Decimal(counts)), is_same, counts)

    def meaning(self, counts: int, *, distance: bool = False) -> Decimal:
        """What counts stand for, in few digits; of a scale with a range."""
        exact = self._counts_to_units(Decimal(counts if distance else counts - self.zero_counts))
        if not distance and self.range is not None:
            exact = EXACT_CONTEXT.add(self.range[0], exact)
        near = EXAMPLE_TOLERANCE * min(abs(exact), abs(self.width))
        return shortest_quantity(exact, lambda q: abs(q.value - exact) <= near, 0).value

    def _counts_to_units(self, counts: Decimal) -> Decimal:
        return EXACT_CONTEXT.divide(EXACT_CONTEXT.multiply(counts, self.width), self.full_counts)


def pv_before_root(pv: Scale, root: Scale, counts: int) -> tuple[Decimal, Decimal | None]:
    """What counts of a PV are before its root is taken: percent of the signal, and the value that they stand for.

    ``pv`` is the scale of the signal, ``root`` that of the set point; there is no value without a range.
    """
    percent = EXACT_CONTEXT.divide(Decimal(100 * (counts - pv.format.minimum)), Decimal(pv.format.span))
    if root.range is None:
        return percent, None
    taken = EXACT_CONTEXT.divide(EXACT_CONTEXT.sqrt(Decimal(max(counts, 0))), root.full_counts)
    return percent, EXACT_CONTEXT.add(root.range[0], EXACT_CONTEXT.multiply(taken, root.width))


def shortest_quantity(exact: Decimal, is_same: Callable[[Quantity], bool], counts: int | Decimal) -> Quantity:
    """The decimal with fewest places that means the same; raw counts where no short one does."""
    if (
        exact.adjusted() >= EXACT_CONTEXT.prec - MAX_DECIMALS
    ):  # a range like [0, 1e300]: more digits than can be counted in
        return Quantity(Decimal(counts), counts=True)
    for places in range(MAX_DECIMALS + 1):
        candidate = Quantity(EXACT_CONTEXT.quantize(exact, Decimal(1).scaleb(-places)) + 0)
        if is_same(candidate):
            return candidate
    return Quantity(Decimal(counts), counts=True)


@frozen
class Position:
    """A word that holds a value on a named scale (``pv``, ``sp`` or ``output``)."""

    scale: str
    tolerance: ClassVar[Decimal] = Decimal("0.1")
    """Of a value: what is rounded further needs a warning; a root has few counts anyway (D340)."""

    @property
    def notation(self) -> str:
        """How the word is written, for reference pages."""
        return "counts"

    def coarse_value(self, value: Quantity, word: int, scale: Scale) -> Decimal | None:
        """What a word means that is far from its value, as one of a root's few counts is; None: it is the value."""
        if is_raw(value, scale) or value.derived:
            return None
        meaning = scale.meaning(scale.format.codec.decode(word))
        return meaning if abs(meaning - value.value) > POSITION_TOLERANCE * scale.width else None

    def rounding_excess(self, value: Quantity, word: int, scale: Scale) -> Decimal:
        """Counts by which a word is beyond its value."""
        return EXACT_CONTEXT.subtract(Decimal(scale.format.codec.decode(word)), scale.position(value))

    def encode(self, value: Quantity, scale: Scale) -> int:
        """A quantity to the word of its format."""
        counts = whole_counts(scale.position(value), raw=is_raw(value, scale))
        try:
            word = scale.format.codec.encode(counts)
        except EncodeError as error:
            range_error = _range_error(scale, value, scale.value)
            range_error.stored = error.stored
            raise range_error from None
        return check_root(word, counts, scale, value)

    def decode(self, word: int, scale: Scale) -> Quantity:
        """The word to a quantity."""
        return scale.value(scale.format.codec.decode(word))


@frozen
class Distance:
    """A word that holds a difference on a named scale: never negative, up to the format's maximum."""

    scale: str
    tolerance: ClassVar[Decimal] = Decimal("Infinity")
    """Of a value: what is rounded further needs a warning; rules of their own look at bands that are too small."""

    @property
    def notation(self) -> str:
        """How the word is written, for reference pages."""
        return "counts, a difference"

    def coarse_value(self, value: Quantity, word: int, scale: Scale) -> Decimal | None:
        """What a word means that is far from its value, as a band of few counts is; None: it is the value."""
        if is_raw(value, scale) or value.derived:
            return None
        meaning = scale.meaning(word, distance=True)
        return meaning if abs(meaning - value.value) > BAND_TOLERANCE * abs(value.value) else None

    def rounding_excess(self, value: Quantity, word: int, scale: Scale) -> Decimal:
        """Counts by which a word is beyond its value."""
        return EXACT_CONTEXT.subtract(Decimal(word), scale.distance(value))

    def encode(self, value: Quantity, scale: Scale) -> int:
        """A quantity to an unsigned word."""
        counts = whole_counts(scale.distance(value), raw=is_raw(value, scale) and not value.derived)
        if not 0 <= counts <= scale.format.maximum:
            error = _range_error(scale, value, scale.span_value, low=0)
            error.stored = counts if 0 <= counts <= scale.format.codec.max_difference else None
            raise error
        return check_root(counts, counts, scale, value)

    def decode(self, word: int, scale: Scale) -> Quantity:
        """The word to a quantity."""
        return scale.span_value(Binary(scale.format.codec.max_difference).decode(word))


def check_root(word: int, counts: int, scale: Scale, value: Quantity) -> int:
    """The word, unless it is beyond full scale of a square-root loop: no PV has such a root."""
    if scale.has_root and counts > scale.top_counts:
        error = _range_error(scale, value, scale.value, low=0)
        error.stored = word
        raise error
    return word


def is_raw(value: Quantity, scale: Scale) -> bool:
    """Whether a value is meant as counts."""
    return value.counts or scale.range is None


def whole_counts(counts: Decimal, *, raw: bool) -> int:
    """Rounded counts; raw ones must be whole already."""
    if raw and counts != counts.to_integral_value():
        raise EncodeError("form", "is not a whole number of counts")
    return round_to_integer(counts)


def _range_error(
    scale: Scale, value: Quantity, value_of: Callable[[int], Quantity], low: int | None = None
) -> EncodeError:
    """The error with the limits in the user's own unit."""
    low_count, high_count = (
        scale.format.minimum if low is None else low,
        scale.top_counts if scale.has_root else scale.format.maximum,
    )
    if is_raw(value, scale):
        return EncodeError("range", "is outside the word's range", Decimal(low_count), Decimal(high_count))
    return EncodeError("range", "is outside the word's range", value_of(low_count).value, value_of(high_count).value)
