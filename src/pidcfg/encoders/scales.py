"""Engineering units to counts and back, exactly.

A `Scale` is a data format (which counts exist) and a range (what they mean). Positions lie on the scale, spans are
distances along it. On a square-root scale full scale is the root of the span: the set point of a loop that extracts the
root of its PV is compared with that root.
"""

from __future__ import annotations

from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Protocol

from pidcfg.encoders.words import Binary, EncodeError, nearest
from pidcfg.frozen import frozen
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.numbers import EXACT

if TYPE_CHECKING:
    from collections.abc import Callable

MOST_DECIMALS = 12
COARSE, SHARE = Decimal("0.01"), Decimal("0.0005")
"""Of a band's value, and of the span for a position: what is further off is not the same number."""
SHOWN = Decimal("0.0001")
"""Of a value: how close the number is that says what a word means."""


class CountsCodec(Protocol):
    """Whole counts in a word, from 0 % to 100 %."""

    @property
    def low(self) -> int:
        """Counts at 0 %."""

    @property
    def high(self) -> int:
        """Counts at 100 %."""

    @property
    def room(self) -> int:
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
    root: bool = False

    @cached_property
    def full(self) -> Decimal:
        """Counts from 0 % to 100 % on this scale."""
        span = Decimal(self.format.span)
        return EXACT.sqrt(span) if self.root else span

    @cached_property
    def width(self) -> Decimal:
        """Engineering units from 0 % to 100 %; 1 on a raw scale."""
        return EXACT.subtract(self.range[1], self.range[0]) if self.range else Decimal(1)

    @property
    def zero(self) -> int:
        """Counts at 0 %."""
        return 0 if self.root else self.format.minimum

    @property
    def top(self) -> int:
        """Counts at 100 %."""
        return self.zero + nearest(self.full)

    @property
    def ends(self) -> tuple[Quantity, Quantity]:
        """The counts at both ends."""
        return Quantity(Decimal(self.zero), counts=True), Quantity(Decimal(self.top), counts=True)

    def position(self, quantity: Quantity) -> Decimal:
        """Counts of a value on the scale, not yet rounded."""
        if quantity.counts or self.range is None:
            return quantity.value
        return EXACT.add(self._scaled(EXACT.subtract(quantity.value, self.range[0])), Decimal(self.zero))

    def distance(self, quantity: Quantity) -> Decimal:
        """Counts of a difference of two values, not yet rounded."""
        return quantity.value if quantity.counts or self.range is None else self._scaled(quantity.value)

    def _scaled(self, value: Decimal) -> Decimal:
        """Multiplied before it is divided, so that a tie comes out as one: a quotient ending in .5 is exact."""
        return EXACT.divide(EXACT.multiply(value, self.full), self.width)

    def value(self, counts: int) -> Quantity:
        """The shortest engineering value that encodes to these counts."""
        if self.range is None:
            return Quantity(Decimal(counts))
        if counts > self.top:  # a word of a square-root loop may hold more than full scale
            return Quantity(Decimal(counts), counts=True)
        exact = EXACT.add(self.range[0], self._units(Decimal(counts - self.zero)))
        return shortest(exact, lambda q: nearest(self.position(q)) == counts, counts)

    def span_value(self, counts: int | Decimal) -> Quantity:
        """The shortest engineering difference that encodes to these counts."""
        return self.span_value_by(counts, lambda q: nearest(self.distance(q)) == counts)

    def span_value_by(self, counts: int | Decimal, same: Callable[[Quantity], bool]) -> Quantity:
        """As `span_value`, with the test of equality that fits the word."""
        if self.range is None:
            return Quantity(Decimal(counts))
        if counts > (self.top if self.root else self.format.maximum):
            return Quantity(Decimal(counts), counts=True)
        return shortest(self._units(Decimal(counts)), same, counts)

    def meaning(self, counts: int, *, distance: bool = False) -> Decimal:
        """What counts stand for, in few digits; of a scale with a range."""
        exact = self._units(Decimal(counts if distance else counts - self.zero))
        if not distance and self.range is not None:
            exact = EXACT.add(self.range[0], exact)
        return shortest(exact, lambda q: abs(q.value - exact) <= SHOWN * abs(exact), 0).value

    def _units(self, counts: Decimal) -> Decimal:
        return EXACT.divide(EXACT.multiply(counts, self.width), self.full)


def before_root(pv: Scale, root: Scale, counts: int) -> tuple[Decimal, Decimal | None]:
    """What counts of a PV are before its root is taken: percent of the signal, and the value that they stand for.

    ``pv`` is the scale of the signal, ``root`` that of the set point; there is no value without a range.
    """
    share = EXACT.divide(Decimal(100 * (counts - pv.format.minimum)), Decimal(pv.format.span))
    if root.range is None:
        return share, None
    taken = EXACT.divide(EXACT.sqrt(Decimal(max(counts, 0))), root.full)
    return share, EXACT.add(root.range[0], EXACT.multiply(taken, root.width))


def shortest(exact: Decimal, same: Callable[[Quantity], bool], counts: int | Decimal) -> Quantity:
    """The decimal with fewest places that means the same; raw counts where no short one does."""
    if exact.adjusted() >= EXACT.prec - MOST_DECIMALS:  # a range like [0, 1e300]: more digits than can be counted in
        return Quantity(Decimal(counts), counts=True)
    for places in range(MOST_DECIMALS + 1):
        candidate = Quantity(EXACT.quantize(exact, Decimal(1).scaleb(-places)) + 0)
        if same(candidate):
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

    def coarse(self, value: Quantity, word: int, scale: Scale) -> Decimal | None:
        """What a word means that is far from its value, as one of a root's few counts is; None: it is the value."""
        if is_raw(value, scale) or value.derived:
            return None
        meant = scale.meaning(scale.format.codec.decode(word))
        return meant if abs(meant - value.value) > SHARE * scale.width else None

    def encode(self, value: Quantity, scale: Scale) -> int:
        """A quantity to the word of its format."""
        counts = whole(scale.position(value), raw=is_raw(value, scale))
        try:
            word = scale.format.codec.encode(counts)
        except EncodeError as error:
            outside = _outside(scale, value, scale.value)
            outside.stored = error.stored
            raise outside from None
        return within_root(word, counts, scale, value)

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

    def coarse(self, value: Quantity, word: int, scale: Scale) -> Decimal | None:
        """What a word means that is far from its value, as a band of few counts is; None: it is the value."""
        if is_raw(value, scale) or value.derived:
            return None
        meant = scale.meaning(word, distance=True)
        return meant if abs(meant - value.value) > COARSE * abs(value.value) else None

    def encode(self, value: Quantity, scale: Scale) -> int:
        """A quantity to an unsigned word."""
        counts = whole(scale.distance(value), raw=is_raw(value, scale) and not value.derived)
        if not 0 <= counts <= scale.format.maximum:
            error = _outside(scale, value, scale.span_value, low=0)
            error.stored = counts if 0 <= counts <= scale.format.codec.room else None
            raise error
        return within_root(counts, counts, scale, value)

    def decode(self, word: int, scale: Scale) -> Quantity:
        """The word to a quantity."""
        return scale.span_value(Binary(scale.format.codec.room).decode(word))


def within_root(word: int, counts: int, scale: Scale, value: Quantity) -> int:
    """The word, unless it is beyond full scale of a square-root loop: no PV has such a root."""
    if scale.root and counts > scale.top:
        error = _outside(scale, value, scale.value, low=0)
        error.stored = word
        raise error
    return word


def is_raw(value: Quantity, scale: Scale) -> bool:
    """Whether a value is meant as counts."""
    return value.counts or scale.range is None


def whole(counts: Decimal, *, raw: bool) -> int:
    """Rounded counts; raw ones must be whole already."""
    if raw and counts != counts.to_integral_value():
        raise EncodeError("form", "is not a whole number of counts")
    return nearest(counts)


def _outside(scale: Scale, value: Quantity, back: Callable[[int], Quantity], low: int | None = None) -> EncodeError:
    """The error with the limits in the user's own unit."""
    least, most = scale.format.minimum if low is None else low, scale.top if scale.root else scale.format.maximum
    if is_raw(value, scale):
        return EncodeError("range", "is outside the word's range", Decimal(least), Decimal(most))
    return EncodeError("range", "is outside the word's range", back(least).value, back(most).value)
