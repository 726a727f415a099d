"""A vendor's registers as a table, the address space they lie in, who else writes them, and where its gains stand."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from decimal import Decimal
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, Protocol, cast, get_args

from pidcfg.encoders.codecs import (
    WORD_MAX,
    Binary,
    DecodeError,
    Distance,
    EncodeError,
    Position,
    Scale,
    single_bits,
    single_value,
)
from pidcfg.schemas.base import Limits, limits_at
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Basis, Decision

if TYPE_CHECKING:
    from pydantic import BaseModel

# --- A vendor's registers as a table, and everything that follows from the table --------------------------------------
#
# A `RegisterMap` is rows only: a `Word` per register and a `Bits` row per choice inside a bit word. Encoding,
# decoding, the register documentation and the word tests all walk the same rows; nothing else knows an offset.

NO_SCALES: Mapping[str, Scale] = MappingProxyType({})
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
    read_when: str
    basis: Basis
    access: Access = "setting"
    other_key: str | None = None
    """Another key of the file that says the same in other words."""
    suffix: str = ""
    """How its nickname ends, behind the loop's name, where the PLC's software has nicknames."""
    bits: ClassVar[tuple[int, ...]] = ()
    """It has no bits of its own in another word."""
    mask: ClassVar[int] = ~0
    """It owns every bit of its register."""

    @property
    def choices(self) -> Mapping[int, object] | None:
        """The value of each raw content; None: the register holds a number."""
        return getattr(self.codec, "choices", None)

    @property
    def scale(self) -> str | None:
        """The scale that its values are on; None: it needs none."""
        return getattr(self.codec, "scale", None)

    def encode(self, value: object, scales: Mapping[str, Scale] = NO_SCALES) -> int:
        """A value to raw content; raises `EncodeError`."""
        if self.scale is None:
            return cast("Codec", self.codec).encode(value)
        return cast("ScaledCodec", self.codec).encode(value, scales[self.scale])

    def decode(self, raw: int, scales: Mapping[str, Scale] = NO_SCALES) -> Any:
        """Raw content to a value; raises `DecodeError`."""
        if self.scale is None:
            return cast("Codec", self.codec).decode(raw)
        return cast("ScaledCodec", self.codec).decode(raw, scales[self.scale])


@frozen
class Bits:
    """One choice inside a bit word: the bits from least to most significant, and the value of each code."""

    offset: int
    bits: tuple[int, ...]
    path: str | None
    choices: Mapping[int, object]
    title: str
    access: Access = "setting"
    unit: ClassVar[str] = ""
    """A choice has none."""
    read_when: ClassVar[str] = ""
    """When the controller reads it: with the register that it is a part of."""
    other_key: ClassVar[str | None] = None
    """No other key says the same."""
    bits_by_value: dict[object, int] = field(init=False, default_factory=dict)
    """Each value's bits where they stand in the word; of several codes of one value the first."""

    def __post_init__(self) -> None:
        for code, value in self.choices.items():
            self.bits_by_value.setdefault(value, sum((code >> i & 1) << b for i, b in enumerate(self.bits)))

    @property
    def mask(self) -> int:
        """The bits this row owns."""
        return sum(1 << b for b in self.bits)

    def encode(self, value: object, _: Mapping[str, Scale] = NO_SCALES) -> int:
        """The bits of a value, in place."""
        return self.bits_by_value[value]

    def decode(self, raw: int, _: Mapping[str, Scale] = NO_SCALES) -> Any:
        """The value that a word's bits choose; raises `DecodeError`."""
        code = sum((raw >> b & 1) << i for i, b in enumerate(self.bits))
        if code not in self.choices:
            raise DecodeError(f"0x{raw:04X} has a combination of bits {self.bits} that means nothing")
        return self.choices[code]


Point = Word | Bits
"""What holds one value of a file: a register, or some bits of one."""


class NamedValue(Protocol):
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
    word: NamedValue
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
    values: Mapping[str, Any]
    """What was to go in, by path."""


@frozen
class RegisterMap:
    """A block of registers of fixed size."""

    title: str
    size: int
    words: tuple[Word, ...]
    bits: tuple[Bits, ...] = ()
    label: str = "+{:02d}"
    """How the manual writes an offset."""

    @property
    def points(self) -> tuple[Point, ...]:
        """Every register, then every choice."""
        return (*self.words, *self.bits)

    def offset_text(self, offset: int) -> str:
        """An offset as the manual writes it."""
        return self.label.format(offset)

    def fill_reserved(self, basis: Basis) -> RegisterMap:
        """The map with a reserved row for every register that has none; ``basis`` says so.

        Raises `ValueError` for an offset that stands twice or lies outside the block.
        """
        by_offset: dict[int, Word] = {}
        for word in self.words:
            if word.offset in by_offset or not 0 <= word.offset < self.size:
                place = f"{self.title}: {word.name} at {self.offset_text(word.offset)}"
                raise ValueError(f"{place} is taken, or outside the {self.size} registers")
            by_offset[word.offset] = word
        rows = (
            by_offset.get(n) or Word(n, f"reserved_{n:02d}", None, RESERVED, "", "Reserved", "-", basis, "reserved")
            for n in range(self.size)
        )
        return replace(self, words=tuple(rows))

    def offset_of(self, name: str) -> int:
        """Where a register stands in the block."""
        return next(w.offset for w in self.words if w.name == name)

    def find_word(self, name: str) -> Word:
        """The row of a register."""
        return next(w for w in self.words if w.name == name)

    def find_bits(self, path: str) -> Bits:
        """The row of a choice."""
        return next(b for b in self.bits if b.path == path)

    def paths(self) -> list[str]:
        """Where each setting of the block stands in a configuration."""
        return [point.path for point in self.points if point.path is not None]

    def units(self) -> Iterator[tuple[str, str]]:
        """Where each value stands in a configuration, and its unit."""
        return ((word.path, word.unit) for word in self.words if word.path is not None)

    def encode(self, values: Mapping[str, object], scales: Mapping[str, Scale]) -> Encoded:
        """Values by path to the words of the block. A path that is missing, or None, leaves its word 0."""
        image = Encoded([0] * self.size, [], [], values)
        for word in self.words:
            if word.path is not None and values.get(word.path) is not None:
                self._encode_word(word, values[word.path], scales, image)
        for row in self.bits:
            if row.path is not None and values.get(row.path) is not None:
                image.words[row.offset] |= row.encode(values[row.path])
        return image

    def read_back(self, values: Mapping[str, object], scales: Mapping[str, Scale]) -> dict[str, object]:
        """What the words of the block hold of values by path."""
        return self.decode(self.encode(values, scales).words, scales)

    @staticmethod
    def _encode_word(word: Word, value: Any, scales: Mapping[str, Scale], image: Encoded) -> None:
        path = str(word.path)
        try:
            image.words[word.offset] = word.encode(value, scales)
        except EncodeError as error:
            image.misfits.append(Misfit(path, word, value, error))
            image.words[word.offset] = error.stored or 0
            return
        if getattr(word.codec, "reports_rounding", False):
            stored = word.decode(image.words[word.offset], scales)
            if stored != value:
                image.rounded.append(Rounded(path, word, value, stored))
        elif isinstance(word.codec, Position | Distance):
            meaning = word.codec.coarse_value(value, image.words[word.offset], scales[word.codec.scale])
            if meaning is not None:
                image.rounded.append(Rounded(path, word, value.value, meaning))

    def decode(self, words: Sequence[int], scales: Mapping[str, Scale]) -> dict[str, object]:
        """The words of the block to values by path; `DecodeError` names the register of a word that is no value."""
        values: dict[str, Any] = self.decode_bits(words)
        for word in self.words:
            if word.path is not None:
                values[word.path] = self.decode_word(word, words[word.offset], scales)
        return values

    def decode_bits(self, words: Sequence[int]) -> dict[str, object]:
        """The choices alone; they decide the scales of the words."""
        return {row.path: self._decode_bits(row, words) for row in self.bits if row.path is not None}

    def _decode_bits(self, row: Bits, words: Sequence[int]) -> Any:
        try:
            return row.decode(words[row.offset])
        except DecodeError as error:
            name = next(w.name for w in self.words if w.offset == row.offset)
            raise DecodeError(f"{name} ({self.offset_text(row.offset)}): {error}", row.offset) from None

    def decode_word(self, word: Word, raw: int, scales: Mapping[str, Scale]) -> Any:
        """One register's value."""
        try:
            return word.decode(raw, scales)
        except DecodeError as error:
            raise DecodeError(f"{word.name} ({self.offset_text(word.offset)}): {error}", word.offset) from None


RESERVED = Binary()


# --- A vendor's address space: its banks of registers, how an address is written, and what one cell holds -------------
#
# Addresses are plain numbers in the order in which a listing shows them; vendors with several banks have them one
# after the other, `BANK_NUMBERS` numbers apart. Raw contents are whole numbers too: the bits of a word, a switch or a
# single-precision number.

BANK_NUMBERS = 1 << 16
"""Numbers that each bank has to itself."""
Value = bool | int | float


@frozen
class Kind:
    """What one address holds: how its raw bits are shown, and read again (None: it cannot hold that value)."""

    name: str
    digits: int
    show: Callable[[int], Value]
    read: Callable[[object], int | None]
    holds: str

    def hex(self, raw: int) -> str:
        """The raw content in hexadecimal."""
        return f"{raw:0{self.digits}X}"

    def text(self, raw: int) -> str:
        """The value as a listing writes it: a switch as 0 or 1."""
        value = self.show(raw)
        return str(int(value)) if isinstance(value, bool) else str(value)

    @property
    def highest(self) -> int:
        """The largest raw content."""
        return 1 if self is BIT else (1 << 4 * self.digits) - 1

    def __reduce__(self) -> tuple[Callable[[str], Kind], tuple[str]]:
        """A copy, be it in another process, is the kind itself."""
        return find_kind, (self.name,)


def _whole_number(value: object, low: int, high: int) -> int | None:
    return value if isinstance(value, int) and not isinstance(value, bool) and low <= value <= high else None


def _int16_bits(value: object) -> int | None:
    number = _whole_number(value, -0x8000, 0x7FFF)
    return None if number is None else number & WORD_MAX


def _bit_value(value: object) -> int | None:
    return int(value) if isinstance(value, bool) else _whole_number(value, 0, 1)


def _single_value(value: object) -> int | None:
    return single_bits(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


WORD = Kind("word", 4, int, lambda v: _whole_number(v, 0, WORD_MAX), "a word of 0 to 65535")
INT16 = Kind(
    "integer", 4, lambda raw: raw - 0x10000 if raw > 0x7FFF else raw, _int16_bits, "an integer of -32768 to 32767"
)
BIT = Kind("bit", 1, bool, _bit_value, "true or false")
SINGLE = Kind("float", 8, single_value, _single_value, "a finite single-precision number")


def find_kind(name: str) -> Kind:
    """One of the kinds that there are."""
    return next(kind for kind in (WORD, INT16, BIT, SINGLE) if kind.name == name)


class NoRegisterError(LookupError):
    """A register that does not exist: it lies behind the last one of its bank."""


@frozen
class Bank:
    """Registers with one prefix, from ``first`` to ``last``."""

    prefix: str
    first: int
    last: int
    kind: Kind
    octal: bool = False

    def address_name(self, n: int) -> str:
        """An address as the vendor writes it: ``DF106``."""
        return f"{self.prefix}{n:{'o' if self.octal else 'd'}}"


@frozen
class Space:
    """All banks of a vendor."""

    banks: Sequence[Bank]

    @cached_property
    def _bank_indices(self) -> dict[str, int]:
        return {bank.prefix: i for i, bank in enumerate(self.banks)}

    def number_of(self, prefix: str, n: int) -> int:
        """An address as a plain number."""
        return self._bank_indices[prefix] * BANK_NUMBERS + n

    def bank_and_number(self, number: int) -> tuple[Bank, int]:
        """A plain number's bank, and its number there; raises `NoRegisterError` behind the last bank."""
        if not self.has_bank(number):
            raise NoRegisterError(f"no register lies behind {self.banks[-1].address_name(self.banks[-1].last)}")
        return self.banks[number // BANK_NUMBERS], number % BANK_NUMBERS

    def has_bank(self, number: int) -> bool:
        """Whether a plain number belongs to a bank that there is."""
        return number // BANK_NUMBERS < len(self.banks)

    def same_bank(self, first: int, last: int) -> bool:
        """Whether two plain numbers belong to one bank that there is."""
        return first // BANK_NUMBERS == last // BANK_NUMBERS < len(self.banks)

    def name(self, number: int) -> str:
        """An address as the vendor writes it: ``DF106``."""
        bank, n = self.bank_and_number(number)
        return bank.address_name(n)

    def kind_of(self, number: int) -> Kind:
        """What an address holds."""
        return self.bank_and_number(number)[0].kind

    def content_text(self, number: int, raw: int) -> str:
        """A content as the vendor's tools show it: hexadecimal where addresses are octal, so that BCD is its digits."""
        bank, _ = self.bank_and_number(number)
        return bank.kind.hex(raw) if bank.octal else bank.kind.text(raw)

    def parse(self, text: str) -> int | None:
        """A written address as a plain number; None for anything else."""
        match = re.fullmatch(r"([A-Z]+)([0-9]{1,6})", text)
        bank_index = self._bank_indices.get(match.group(1)) if match else None
        if match is None or bank_index is None:
            return None
        bank, digits = self.banks[bank_index], match.group(2)
        if bank.octal and not set(digits) <= set("01234567"):
            return None
        n = int(digits, 8 if bank.octal else 10)
        return bank_index * BANK_NUMBERS + n if bank.first <= n <= bank.last else None


# ----------------------------------------------------------------------------------------------------------------------
# Who writes which register or parameter while a PLC runs: what a file and a listing may differ in without an edit.
# Each vendor's map has a table of rows (``WRITTEN``) with the manual's place. What no row names is the engineer's
# where it is a setting, and the PLC's where it is a status or a request. A comparison with a listing leaves out what
# is ``live``, shows what is ``operated`` apart, and compares what is ``compared``, such as the gains of an auto-tune.

D345 = Decision(
    345,
    "a comparison with a listing leaves out what runs",
    "Measurement, output, status, requests, mode, the bias of a loop with an integral, and a set point of a profile "
    "or another loop are left out; another set point is told apart and is no difference; gains and sample time, "
    "which an auto-tune writes, and the bias without an integral are compared.",
    "The first differ in every PLC that runs. The operator has the set point. The last stay what somebody made them.",
)

WriterKind = Literal["live", "operated", "compared"]
"""The PLC or the process, all the time; the operator or the program; now and then, and it then stays."""


def always_applies(values: Mapping[str, object]) -> bool:
    """Whatever the loop's other values are."""
    del values
    return True


class Writer(NamedTuple):
    """Who else writes a register or parameter, and when, by the loop's values (by the paths of their rows)."""

    name: str
    kind: WriterKind
    writer: str
    basis: Basis
    applies: Callable[[Mapping[str, Any]], bool] = always_applies


def writer_of(writers: Iterable[Writer], name: str, values: Mapping[str, object]) -> Writer | None:
    """The first row of a register or parameter that holds for a loop; None: it is the engineer's alone."""
    return next((row for row in writers if row.name == name and row.applies(values)), None)


# ----------------------------------------------------------------------------------------------------------------------
# What a bit, a number or a state means for the plant, and what to do about it: rows beside the register tables.


class Meaning(NamedTuple):
    """What happens while a bit is on or a number is shown, what to do, and which rules find it before the download."""

    effect: str
    cure: str = ""
    rules: tuple[str, ...] = ()
    basis: Basis | None = None


class Code(NamedTuple):
    """A number that a PLC shows: the register that shows it, what it stands for, and what that means."""

    register: str
    number: int
    title: str
    meaning: Meaning


# --- Where a vendor keeps the three numbers of a PID controller, and in which terms -----------------------------------

GainUnit = Literal["span", "percent", "engineering"]
"""``span``: share of the output's span per share of the PV's span; ``percent``: % of the output per PV unit;
``engineering``: output units per PV unit."""
FULL_OUTPUT = Decimal(100)
"""The output's span where nothing is said: 0 to 100 %."""


class TuningNumbers(Protocol):
    """The three numbers of a vendor by name (times in s), and its words for the action."""

    @property
    def names(self) -> tuple[str, str, str]:
        """Gain, integral and derivative time."""

    @property
    def gain_unit(self) -> GainUnit:
        """What the gain is counted in."""

    @property
    def no_integral(self) -> Decimal:
        """What the integral time is written as where there is no integral term."""

    @property
    def heating(self) -> str:
        """The action of a loop whose PV rises with its output."""

    @property
    def cooling(self) -> str:
        """The action of the others."""

    def key(self, name: str) -> str:
        """Where a number stands in the configuration."""

    def unit(self, name: str) -> str:
        """The unit of a number."""

    def stored_value(self, name: str, value: Decimal) -> Decimal:
        """What the vendor holds of a number; raises `EncodeError`."""

    def limits(self, model: type[BaseModel], name: str) -> Limits | None:
        """What the manual allows."""

    def step(self, name: str) -> Decimal | None:
        """What two neighbours differ by; None: a number in floating point."""


@frozen
class TuningWords:
    """Registers of gain, integral and derivative time."""

    table: RegisterMap
    gain: str
    integral: str
    derivative: str
    gain_unit: GainUnit
    no_integral: Decimal
    heating: str
    cooling: str

    @property
    def names(self) -> tuple[str, str, str]:
        """The registers."""
        return self.gain, self.integral, self.derivative

    def key(self, name: str) -> str:
        """Where a register's value stands in the configuration."""
        return str(self.table.find_word(name).path)

    def unit(self, name: str) -> str:
        """The unit of a register."""
        return self.table.find_word(name).unit

    def stored_value(self, name: str, value: Decimal) -> Decimal:
        """What the register holds; raises `EncodeError`."""
        word = self.table.find_word(name)
        value_held: Decimal = word.decode(word.encode(value))
        return value_held

    def limits(self, model: type[BaseModel], name: str) -> Limits | None:
        """What the manual allows for a register."""
        return limits_at(get_args(model.model_fields["loops"].annotation)[0], self.key(name))

    def step(self, name: str) -> Decimal | None:
        """What two neighbours differ by; None: a register in floating point."""
        return getattr(self.table.find_word(name).codec, "step", None)


@frozen
class LoopTuning:
    """How one loop of a file holds the three numbers, and what of it the gains of a rule depend on."""

    words: TuningNumbers
    raises_pv: bool | None = None
    """Whether the loop acts for a PV that rises with the output; None: a program decides."""
    pv_span: Decimal | None = None
    """PV units that the gain is a share of, where it is one; None: the file does not say."""
    output_span: Decimal | None = None
    """Output units from 0 to 100 %; None: the file does not say, so they are 0 to 100."""
    independent: bool = False
    """Integral and derivative gains (Ki in 1/s, Kd in s) stand in the place of the times."""
    minutes: bool = False
    """The integral time is held in minutes."""
    current_values: tuple[Decimal | None, Decimal | None, Decimal | None] = (None, None, None)
    """What the loop holds at present, each in the unit of its word; None: an expression."""
    obstacle: str = ""
    """Why the gains of a rule would not act as they should."""
    no_derivative: str = ""
    """Why a derivative time would have no effect."""
    off_texts: tuple[str, str] = ("0", "0")
    """How the file says that there is no integral term, and no derivative."""
    sample_time: float | None = None
    """Time between two calculations, in s; None: no file says it."""
    pv_share: float = 1.0
    """What the filter of the PV takes of a difference in each sample."""
    derivative_share: float = 1.0
    """What the filter of the derivative takes."""
    derivative_limit: float | None = None
    """The derivative time over the time constant of its filter; None: ``derivative_share`` says it."""

    def units(self) -> tuple[str, str, str]:
        """Of the gain, the integral and the derivative number."""
        gain, _, derivative = (self.words.unit(name) for name in self.words.names)
        return gain, "1/s" if self.independent else "min" if self.minutes else "s", derivative
