"""Every field that holds a word: rows of the vendors' tables, choices in bit words, registers in listings, addresses of
registers, and literals of Structured Text, each with the product's own decode and encode.
"""

from __future__ import annotations

import struct
from decimal import Decimal
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders import parameters
from pidcfg.encoders import parameters as iec_registers
from pidcfg.encoders.codecs import SINGLE_MINUS_ZERO, WORD_MAX, DecodeError, EncodeError, Scale, Single
from pidcfg.encoders.dl06.image import make_scales as dl06_scales
from pidcfg.encoders.maps import click, dl06, dpide, ezlogix, generic, nextopid
from pidcfg.encoders.regmap import BANK_NUMBERS, Bits, RegisterMap, Word
from pidcfg.encoders.structured_text import content_of, literal_text, tokens_of
from reliability import rounding

if TYPE_CHECKING:
    import random
    from collections.abc import Callable, Iterator

    from pidcfg.encoders.regmap import Kind, Space
    from pidcfg.schemas.iec import IecType

REGISTERS: dict[str, tuple[RegisterMap, ...]] = {
    "dl06": (*dl06.LOOP_TABLES.values(), dl06.RAMP_SOAK_PAIR, dl06.SETUP_WORDS),
    "click": click.TABLES,
    "ezlogix": ezlogix.TABLES,
}
NAMED = {"nextopid": nextopid.TABLES, "dpide": dpide.TABLES, "generic": generic.TABLES}
SPACES = {"dl06": dl06.SPACE, "click": click.SPACE, "ezlogix": ezlogix.MAP_SPACE}
RANGES = ("0", "1", "100", "-50", "0.5", "-0.25", "1e-6", "1e9", "273.15", "4095", "65535", "12345.678", "-1e6", "1e30")
WINDOWS = ((0, 4095), (0, 65535), (4000, 20000), (6554, 32767), (1, 2))


class Pair(NamedTuple):
    """Decode and encode of a field, the word that must come back, and what is known of its numbers."""

    decode: Callable[[int], Any]
    encode: Callable[[Any], int]
    same: Callable[[int], int] = lambda word: word
    known: rounding.Rounding | None = None


class Field(NamedTuple):
    """A field: its name, its bits, and its codec; ``drawn``: it is another one each time."""

    name: str
    bits: int
    pair: Callable[[random.Random], Pair]
    drawn: bool = False


def fields() -> list[Field]:
    """Every field that there is."""
    return [*_registers(), *_parameters(), *_listings(), *_literals()]


def _registers() -> Iterator[Field]:
    for vendor, tables in REGISTERS.items():
        for table in tables:
            for row in table.words:
                bits = {"C": 1, "S": 1}.get(_bank(vendor, table), 32 if isinstance(row.codec, Single) else 16)
                name = f"{vendor} {table.title} {row.name}"
                yield Field(name, bits, partial(_row, vendor, row), drawn=bits > 16 or row.scale is not None)
            for row in table.bits:
                yield Field(f"{vendor} {table.title} {row.title}", 16, partial(_bits, row))


def _bank(vendor: str, table: RegisterMap) -> str:
    blocks = {"click": click.BLOCKS, "ezlogix": ezlogix.BLOCKS}.get(vendor, {})
    return next((prefix for prefix, block in blocks.values() if block is table), "")


def _row(vendor: str, row: Word, rng: random.Random) -> Pair:
    scales = _scales(vendor, rng)
    same = _same_single if isinstance(row.codec, Single) else _same

    def encode(value: Any) -> int:
        return 0 if value is None else row.encode(value, scales)

    scale = scales.get(row.scale or "")
    return Pair(lambda word: row.decode(word, scales), encode, same, rounding.of(row.codec, scale))


def _same(word: int) -> int:
    return word


def _same_single(word: int) -> int:
    """The number −0 is 0."""
    return 0 if word == SINGLE_MINUS_ZERO else word


def _scales(vendor: str, rng: random.Random) -> dict[str, Scale]:
    ranges = [_range(rng), _range(rng)]
    if vendor == "dl06":
        formats = list(dl06.FORMATS)
        return dl06_scales(rng.choice(formats), rng.choice([None, *formats]), (ranges[0], ranges[1]),
                           root=rng.random() < 0.3)  # fmt: skip
    window = ezlogix.counts_format(*rng.choice(WINDOWS))
    root = window.minimum == 0 and rng.random() < 0.3
    return {"pv": Scale(window, ranges[0]), "sp": Scale(window, ranges[0], has_root=root),
            "output": Scale(ezlogix.CV, ranges[1])}  # fmt: skip


def _range(rng: random.Random) -> tuple[Decimal, Decimal] | None:
    low, high = sorted(Decimal(text) for text in rng.sample(RANGES, 2))
    return rng.choice((None, (low, high), (low, high), (low, low + abs(high) + 1)))


def _bits(row: Bits, _: random.Random) -> Pair:
    first: dict[Any, int] = {}
    for code in range(1 << len(row.bits)):
        if code in row.choices:
            first.setdefault(row.choices[code], code)

    def same(word: int) -> int:
        code = first[row.choices[sum((word >> bit & 1) << i for i, bit in enumerate(row.bits))]]
        return sum((code >> i & 1) << bit for i, bit in enumerate(row.bits))

    return Pair(row.decode, row.encode, same)


def _parameters() -> Iterator[Field]:
    bits = {"bool": 1, "word": 16, "real": 32, "time": 32}
    for vendor, tables in NAMED.items():
        for table in tables:
            for row in table.rows:
                wide = 64 if row.type.double else bits.get(row.type.kind, 16 if row.type.high <= WORD_MAX else 32)
                yield Field(f"{vendor} {table.title} {row.name}", wide, partial(_parameter, row.type), drawn=wide > 16)


def _parameter(kind: IecType, _: random.Random) -> Pair:
    """A parameter in registers, and its content as a listing and the file have it."""

    def decode(raw: int) -> Any:
        return parameters.value_of(_double(raw) if kind.double else iec_registers.register_content(kind, raw))

    def encode(value: Any) -> int:
        content = parameters.read_content(kind, value) if kind.kind == "time" else parameters.store_content(kind, value)
        assert content is not None
        return int.from_bytes(struct.pack(">d", content)) if kind.double else iec_registers.raw_of(kind, content)

    codec = Single() if kind.kind == "real" and not kind.double else None
    return Pair(decode, encode, _same_single if codec else _same, rounding.of(codec, None))


def _double(raw: int) -> float:
    value: float = struct.unpack(">d", raw.to_bytes(8))[0]
    if value - value:
        raise DecodeError("is not a finite number")
    return value


def _listings() -> Iterator[Field]:
    for vendor, space in SPACES.items():
        for at, bank in enumerate(space.banks):
            bits = 4 * bank.kind.digits if bank.kind.digits > 1 else 1
            yield Field(f"{vendor} {bank.prefix} in a listing", bits, partial(_shown, bank.kind), drawn=bits > 16)
            yield Field(f"{vendor} {bank.prefix} address", 16, partial(_address, space, at))


def _shown(kind: Kind, _: random.Random) -> Pair:
    def encode(value: Any) -> int:
        raw = kind.read(value)
        if raw is None:
            raise EncodeError("form", kind.holds)
        return raw

    def decode(raw: int) -> Any:
        value = kind.show(raw)
        if isinstance(value, float) and value - value:
            raise DecodeError("is not a finite number")
        return value

    return Pair(decode, encode)


def _address(space: Space, at: int, _: random.Random) -> Pair:
    bank = space.banks[at]

    def encode(text: str) -> int:
        number = space.parse(text)
        assert number is not None
        return number % BANK_NUMBERS

    def decode(word: int) -> str:
        if not bank.first <= word <= bank.last:
            assert space.parse(bank.address_name(word)) is None, "an address that there is not is read"
            raise DecodeError("does not exist")
        return space.name(at * BANK_NUMBERS + word)

    return Pair(decode, encode)


def _literals() -> Iterator[Field]:
    kinds = {row.type for tables in (nextopid.TABLES, dpide.TABLES) for table in tables for row in table.rows}
    for kind in sorted({*kinds, parameters.TIME}, key=lambda kind: kind.name):
        wide = 32 if kind.kind in {"real", "time"} or kind.high > WORD_MAX else 16
        yield Field(f"literal of {kind.name}", 1 if kind.kind == "bool" else wide, partial(_literal, kind), wide > 16)


def _literal(kind: IecType, _: random.Random) -> Pair:
    def encode(text: str) -> int:
        content = content_of(tokens_of(text)[0][:-1], kind, "X")
        assert content is not None
        return iec_registers.raw_of(kind, content)

    def decode(raw: int) -> str:
        return literal_text(kind, iec_registers.register_content(kind, raw))

    return Pair(decode, encode, _same_single if kind.kind == "real" else _same)
