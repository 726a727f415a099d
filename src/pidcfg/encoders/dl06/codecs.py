"""Codecs of words that only the DL06 has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.scales import is_raw
from pidcfg.encoders.words import SIGN, Bcd, EncodeError
from pidcfg.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.encoders.scales import Scale


@frozen
class SpanBcd:
    """A BCD word that holds a difference on a named scale per second."""

    scale: str
    bcd: Bcd

    @property
    def notation(self) -> str:
        """How the word is written, for reference pages."""
        return "BCD counts a second"

    def encode(self, value: Any, scale: Scale) -> int:
        """A quantity to counts in BCD; the limits of an error are in the quantity's own unit."""
        try:
            return self._word(value, scale)
        except EncodeError as error:
            if error.fault != "range" or is_raw(value, scale):
                raise
            most = self.decode(self.bcd.encode(self.bcd.high), scale).value
            raise EncodeError(error.fault, str(error), error.low, most) from None

    def _word(self, value: Any, scale: Scale) -> int:
        return self.bcd.encode(scale.distance(value))

    def decode(self, word: int, scale: Scale) -> Any:
        """The word to a quantity."""
        counts = self.bcd.decode(word)
        return scale.span_value_by(counts, lambda q: self._same(q, scale, word))

    def _same(self, value: Any, scale: Scale, word: int) -> bool:
        try:
            return self._word(value, scale) == word
        except EncodeError:
            return False


@frozen
class Source:
    """Where an auto transfer goes: base, slot and channel, or with bit 15 a V-memory address."""

    @property
    def notation(self) -> str:
        """How the word is written, for reference pages."""
        return "slot and channel, or address"

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

    def spelled(self, word: int, name: Callable[[int], str]) -> str:
        """The place in words."""
        source = self.decode(word)
        if isinstance(source, int):
            return name(source)
        return "none" if source is None else "base {}, slot {}, channel {}".format(*source)

    def decode(self, word: int) -> tuple[int, int, int] | int | None:
        """A word to ``(base, slot, channel)``, an address, or None for no transfer."""
        if word & SIGN:
            return word & ~SIGN
        return (word >> 12, word >> 8 & 0xF, word & 0xFF) if word else None
