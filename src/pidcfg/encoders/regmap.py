"""A vendor's registers as a table, and everything that follows from the table.

A `RegisterMap` is rows only: a `Word` per register and a `Bits` row per choice inside a bit word. Encoding, decoding,
the register documentation and the word tests all walk the same rows; nothing else knows an offset.
"""

from __future__ import annotations

from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, Literal, Protocol, cast

from pidcfg.encoders.scales import Distance, Position
from pidcfg.encoders.words import Binary, DecodeError, EncodeError
from pidcfg.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from decimal import Decimal

    from pidcfg.encoders.scales import Scale
    from pidcfg.refs import Basis

Access = Literal["setting", "request", "status", "reserved"]
"""Who owns a word or bit: the engineer, a momentary request, the controller, nobody."""


class Codec(Protocol):
    """A pair between a value and the raw content of a register."""

    @property
    def notation(self) -> str:
        """How the register is written, for reference pages."""

    def encode(self, value: Any, /) -> int:
        """A value to raw content; raises `EncodeError`."""

    def decode(self, raw: int, /) -> Any:
        """Raw content to a value; raises `DecodeError`."""


class ScaledCodec(Protocol):
    """A pair that needs the scale that it names."""

    @property
    def notation(self) -> str:
        """How the register is written, for reference pages."""

    @property
    def scale(self) -> str:
        """The scale's name: ``pv``, ``sp``, ``output``."""

    def encode(self, value: Any, scale: Scale, /) -> int:
        """A quantity to raw content; raises `EncodeError`."""

    def decode(self, raw: int, scale: Scale, /) -> Any:
        """Raw content to a quantity; raises `DecodeError`."""


@frozen
class Word:
    """One register: its offset from the block's start, its name, where its value stands in the file, and its codec."""

    offset: int
    name: str
    path: str | None
    codec: Codec | ScaledCodec
    unit: str
    title: str
    read: str
    basis: Basis
    access: Access = "setting"
    instead: str | None = None
    """Another key of the file that says the same in other words."""


@frozen
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


class Named(Protocol):
    """What a message says of a register or parameter."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def unit(self) -> str:
        """The unit of its value."""


@frozen
class Misfit:
    """A value that its register or parameter cannot hold."""

    path: str
    word: Named
    value: Any
    error: EncodeError


@frozen
class Rounded:
    """A value that its register holds only rounded."""

    path: str
    word: Word
    value: Decimal
    stored: Decimal


@frozen
class Encoded:
    """The words of one block, and what did not go in as written."""

    words: list[int]
    misfits: list[Misfit]
    rounded: list[Rounded]


@frozen
class RegisterMap:
    """A block of registers of fixed size."""

    title: str
    size: int
    words: tuple[Word, ...]
    bits: tuple[Bits, ...] = ()
    label: str = "+{:02d}"
    """How the manual writes an offset."""

    def at(self, offset: int) -> str:
        """An offset as the manual writes it."""
        return self.label.format(offset)

    def filled(self, basis: Basis) -> RegisterMap:
        """The map with a reserved row for every register that has none; ``basis`` says so.

        Raises `ValueError` for an offset that stands twice or lies outside the block.
        """
        have: dict[int, Word] = {}
        for word in self.words:
            if word.offset in have or not 0 <= word.offset < self.size:
                where = f"{self.title}: {word.name} at {self.at(word.offset)}"
                raise ValueError(f"{where} is taken, or outside the {self.size} registers")
            have[word.offset] = word
        rows = (
            have.get(n) or Word(n, f"reserved_{n:02d}", None, RESERVED, "", "Reserved", "-", basis, "reserved")
            for n in range(self.size)
        )
        return replace(self, words=tuple(rows))

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
            if row.path is not None and values.get(row.path) is not None:
                image.words[row.offset] |= row.encode(values[row.path])
        return image

    def held(self, values: Mapping[str, Any], scales: Mapping[str, Scale]) -> dict[str, Any]:
        """What the words of the block hold of values by path."""
        return self.decode(self.encode(values, scales).words, scales)

    @staticmethod
    def _encode_word(word: Word, value: Any, scales: Mapping[str, Scale], image: Encoded) -> None:
        path = str(word.path)
        try:
            image.words[word.offset] = encode_one(word.codec, value, scales)
        except EncodeError as error:
            image.misfits.append(Misfit(path, word, value, error))
            image.words[word.offset] = error.stored or 0
            return
        if getattr(word.codec, "rounds", False):
            stored = cast("Codec", word.codec).decode(image.words[word.offset])
            if stored != value:
                image.rounded.append(Rounded(path, word, value, stored))
        elif isinstance(word.codec, Position | Distance):
            meant = word.codec.coarse(value, image.words[word.offset], scales[word.codec.scale])
            if meant is not None:
                image.rounded.append(Rounded(path, word, value.value, meant))

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
            raise DecodeError(f"{name} ({self.at(row.offset)}): {error}", row.offset) from None

    def decode_word(self, word: Word, raw: int, scales: Mapping[str, Scale]) -> Any:
        """One register's value."""
        try:
            return decode_one(word.codec, raw, scales)
        except DecodeError as error:
            raise DecodeError(f"{word.name} ({self.at(word.offset)}): {error}", word.offset) from None


RESERVED = Binary()


def scale_of(codec: Codec | ScaledCodec) -> str | None:
    """The scale that a codec's values are on; None: it needs none."""
    return getattr(codec, "scale", None)


def encode_one(codec: Codec | ScaledCodec, value: Any, scales: Mapping[str, Scale]) -> int:
    """A value to its register by whatever codec the row has."""
    scale = scale_of(codec)
    return (
        cast("Codec", codec).encode(value) if scale is None else cast("ScaledCodec", codec).encode(value, scales[scale])
    )


def decode_one(codec: Codec | ScaledCodec, raw: int, scales: Mapping[str, Scale]) -> Any:
    """A register to its value by whatever codec the row has."""
    scale = scale_of(codec)
    if scale is None:
        return cast("Codec", codec).decode(raw)
    return cast("ScaledCodec", codec).decode(raw, scales[scale])
