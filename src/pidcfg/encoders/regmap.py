"""A vendor's registers as a table, and everything that follows from the table.

A `RegisterMap` is rows only: a `Word` per register and a `Bits` row per choice inside a bit word. Encoding, decoding,
the register documentation and the word tests all walk the same rows; nothing else knows an offset.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from pidcfg.encoders.scales import Distance, Position, Scale
from pidcfg.encoders.words import Bcd, Binary, DecodeError, EncodeError, Source

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from decimal import Decimal

    from pidcfg.refs import Basis

Access = Literal["setting", "request", "status", "reserved"]
"""Who owns a word or bit: the engineer, a momentary request, the controller, nobody."""


@dataclass(frozen=True, slots=True)
class SpanBcd:
    """A BCD word that holds a difference on a named scale per second."""

    scale: str
    bcd: Bcd

    def encode(self, value: Any, scale: Scale) -> int:
        """A quantity to counts in BCD."""
        return self.bcd.encode(scale.distance(value))

    def decode(self, word: int, scale: Scale) -> Any:
        """The word to a quantity."""
        counts = self.bcd.decode(word)
        return scale.span_value_by(counts, lambda q: self._same(q, scale, word))

    def _same(self, value: Any, scale: Scale, word: int) -> bool:
        try:
            return self.encode(value, scale) == word
        except EncodeError:
            return False


ScaledCodec = Position | Distance | SpanBcd
Codec = Bcd | Binary | Source | ScaledCodec


@dataclass(frozen=True, slots=True)
class Word:
    """One register: its offset from the block's start, its name, where its value stands in the file, and its codec."""

    offset: int
    name: str
    path: str | None
    codec: Codec
    unit: str
    title: str
    read: str
    basis: Basis
    access: Access = "setting"


@dataclass(frozen=True, slots=True)
class Bits:
    """One choice inside a bit word: the bits from least to most significant, and the value of each code."""

    offset: int
    bits: tuple[int, ...]
    path: str | None
    choices: Mapping[int, Any]
    title: str
    access: Access = "setting"
    in_place: dict[Any, int] = field(init=False, compare=False, default_factory=dict)
    """Each value's bits where they stand in the word; of several codes of one value the first."""

    def __post_init__(self) -> None:
        for code, value in self.choices.items():
            self.in_place.setdefault(value, sum((code >> i & 1) << b for i, b in enumerate(self.bits)))

    @property
    def mask(self) -> int:
        """The bits this row owns."""
        return sum(1 << b for b in self.bits)

    def encode(self, value: Any) -> int:
        """The bits of a value, in place."""
        return self.in_place[value]

    def decode(self, word: int) -> Any:
        """The value that a word's bits choose."""
        code = sum((word >> b & 1) << i for i, b in enumerate(self.bits))
        if code not in self.choices:
            raise DecodeError(f"0x{word:04X} has a combination of bits {self.bits} that means nothing")
        return self.choices[code]


@dataclass(frozen=True, slots=True)
class Misfit:
    """A value that its register cannot hold."""

    path: str
    word: Word
    value: Any
    error: EncodeError


@dataclass(frozen=True, slots=True)
class Rounded:
    """A value that its register holds only rounded."""

    path: str
    word: Word
    value: Decimal
    stored: Decimal


@dataclass(frozen=True, slots=True)
class Encoded:
    """The words of one block, and what did not go in as written."""

    words: list[int]
    misfits: list[Misfit]
    rounded: list[Rounded]


@dataclass(frozen=True, slots=True)
class RegisterMap:
    """A block of registers of fixed size."""

    title: str
    size: int
    words: tuple[Word, ...]
    bits: tuple[Bits, ...] = ()

    def offset(self, name: str) -> int:
        """Where a register stands in the block."""
        return next(w.offset for w in self.words if w.name == name)

    def word(self, name: str) -> Word:
        """The row of a register."""
        return next(w for w in self.words if w.name == name)

    def bit(self, path: str) -> Bits:
        """The row of a choice."""
        return next(b for b in self.bits if b.path == path)

    def paths(self) -> list[str]:
        """Where each setting of the block stands in a configuration."""
        rows: Iterable[Word | Bits] = (*self.words, *self.bits)
        return [r.path for r in rows if r.path is not None]

    def encode(self, values: Mapping[str, Any], scales: Mapping[str, Scale]) -> Encoded:
        """Values by path to the words of the block. A path that is missing, or None, leaves its word 0."""
        image = Encoded([0] * self.size, [], [])
        for word in self.words:
            if word.path is not None and values.get(word.path) is not None:
                self._encode_word(word, values[word.path], scales, image)
        for row in self.bits:
            if row.path is not None and row.path in values:
                image.words[row.offset] |= row.encode(values[row.path])
        return image

    @staticmethod
    def _encode_word(word: Word, value: Any, scales: Mapping[str, Scale], image: Encoded) -> None:
        path = str(word.path)
        try:
            image.words[word.offset] = encode_one(word.codec, value, scales)
        except EncodeError as error:
            image.misfits.append(Misfit(path, word, value, error))
            image.words[word.offset] = error.stored or 0
            return
        if isinstance(word.codec, Bcd):
            stored = word.codec.decode(image.words[word.offset])
            if stored != value:
                image.rounded.append(Rounded(path, word, value, stored))

    def decode(self, words: Sequence[int], scales: Mapping[str, Scale]) -> dict[str, Any]:
        """The words of the block to values by path; `DecodeError` names the register of a word that is no value."""
        values: dict[str, Any] = self.decode_bits(words)
        for word in self.words:
            if word.path is not None:
                values[word.path] = self.decode_word(word, words[word.offset], scales)
        return values

    def decode_bits(self, words: Sequence[int]) -> dict[str, Any]:
        """The choices alone; they decide the scales of the words."""
        return {row.path: self._decode_bits(row, words) for row in self.bits if row.path is not None}

    def _decode_bits(self, row: Bits, words: Sequence[int]) -> Any:
        try:
            return row.decode(words[row.offset])
        except DecodeError as error:
            name = next(w.name for w in self.words if w.offset == row.offset)
            raise DecodeError(f"{name} (+{row.offset:02o}): {error}", row.offset) from None

    @staticmethod
    def decode_word(word: Word, raw: int, scales: Mapping[str, Scale]) -> Any:
        """One register's value."""
        try:
            if isinstance(word.codec, ScaledCodec):
                return word.codec.decode(raw, scales[word.codec.scale])
            return word.codec.decode(raw)
        except DecodeError as error:
            raise DecodeError(f"{word.name} (+{word.offset:02o}): {error}", word.offset) from None


def encode_one(codec: Codec, value: Any, scales: Mapping[str, Scale]) -> int:
    """A value to its word by whatever codec the row has."""
    if isinstance(codec, ScaledCodec):
        return codec.encode(value, scales[codec.scale])
    return codec.encode(value)
