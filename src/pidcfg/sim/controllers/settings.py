"""What a scenario's ``set`` may write, and the registers of a virtual PLC as somebody outside sees them."""

from __future__ import annotations

import difflib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, MutableSequence, Sequence
from dataclasses import field
from decimal import Decimal
from typing import Any, NamedTuple, TypeVar

from pydantic_core import PydanticCustomError

from pidcfg.encoders.codecs import DecodeError, EncodeError
from pidcfg.encoders.parameters import Content, Parameter, ParameterTable, store_content
from pidcfg.encoders.regmap import Point, RegisterMap, Word
from pidcfg.schemas.base import SIDES, Quantity, parse_flag, parse_seconds
from pidcfg.schemas.numbers import parse_integer, parse_number, refuse
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import dotted_text
from pidcfg.text.references import Decision
from pidcfg.text.signs import closest_name, key_of_term

# ----------------------------------------------------------------------------------------------------------------------
# What a scenario's ``set`` may write: a key of the configuration to its register, by the register map's own codecs.
# Keys are those of a loop in the configuration file (``tuning.gain``, ``alarms.pv.high``), a vendor's short forms,
# and the last part of a key where only one register has it (``gain``). A vendor makes a `Keys` of its register map.

FITS_HELP = "write a value inside the limits"
Parser = Callable[[object], object]
ContentParser = Callable[[object], Decimal | Content]
Value = TypeVar("Value")


def rows_of(tables: Iterable[RegisterMap], excluded: Iterable[str] = ()) -> dict[str, Point]:
    """Every register and choice with a path that is not ``excluded``, by its path."""
    points = (point for table in tables for point in table.points)
    return {point.path: point for point in points if point.path is not None and point.path not in set(excluded)}


@frozen
class Keys:
    """The keys that can be set in a running loop."""

    rows: Mapping[str, Point]
    """The registers and choices behind them, by path; the two ends of a pair end in ``.0`` and ``.1``."""
    short_forms: Mapping[str, str]
    """Short forms; every vendor has ``setpoint`` and ``output``."""
    events: Mapping[str, str] = field(default_factory=dict)
    """Keys that have an event instead, and the key of that event."""
    parsers: Mapping[str, Parser] = field(default_factory=dict)
    """How a register's value is written, by path."""
    default_parser: Callable[[Word], Parser] = lambda _word: parse_number
    """How the value of any other register is written."""

    def find(self, path: tuple[str, ...]) -> list[Point]:
        """The registers behind a key: one, or both ends of a pair of limits; refuses what cannot be set."""
        key = self.short_forms.get(dotted_text(path), dotted_text(path))
        if key in self.events:
            refuse("set_key", f"{key} is an event of its own", help=f"write {self.events[key]}: in place of set:")
        if key in self.rows:
            return [self.rows[key]]
        if f"{key}.0" in self.rows:
            return [self.rows[f"{key}.0"], self.rows[f"{key}.1"]]
        setpoint = self.short_forms["setpoint"]
        same = [row for name, row in self.rows.items() if name.rpartition(".")[2] == key and name != setpoint]
        if len(same) == 1:
            return same
        known = [*self.short_forms, *self.rows]
        near = key_of_term(key, known) or next(iter(difflib.get_close_matches(key, known, 1, 0.5)), None)
        cure = f"did you mean {near}?" if near else "write a key of the loop's configuration"
        return refuse("set_key", f"{key!r} is nothing that can be set in a running loop", help=cure)

    def check(self, path: tuple[str, ...], value: object, encode: Callable[[Point, Any], int]) -> object:
        """The parsed value of a key; a ``PydanticCustomError`` says why its registers cannot hold it."""
        rows = self.find(path)
        parsed = self.parse(rows, value)
        check_fit(rows, parsed, encode)
        return parsed

    def parse(self, rows: list[Point], value: object) -> object:
        """The value of a key as its registers take it; of a pair both."""
        if len(rows) == 1:
            return self.parse_row(rows[0], value)
        if not isinstance(value, list | tuple) or len(value) != len(rows):
            refuse("pair_type", "both limits are wanted", help="write [low, high]")
        return tuple(self.parse_row(row, item) for row, item in zip(rows, value, strict=True))

    def parse_row(self, row: Point, value: object) -> object:
        """One register's value, as strictly as in the configuration file."""
        choices = choices_of(row)
        if choices is None:
            word: Any = row
            parser = self.parsers.get(str(row.path)) or self.default_parser(word)
            return parser(value)
        if set(choices) == {False, True}:
            return parse_flag(value)
        known = {str(choice): choice for choice in choices if choice is not None}
        if str(value) not in known:
            refuse("choice", f"{value!r} is none of {', '.join(known)}")
        return known[str(value)]


def choices_of(row: Point) -> list[Any] | None:
    """What a switch can be; None for a register that holds a number."""
    return None if row.choices is None else list(row.choices.values())


def items_of(rows: list[Point], value: Any) -> Iterator[tuple[Point, Any]]:
    """Each register behind a key with its part of the value: a pair of limits has two."""
    return zip(rows, value if len(rows) > 1 else [value], strict=True)


def check_fit(rows: list[Point], value: Any, encode: Callable[[Point, Any], int]) -> None:
    """Refuses a parsed value that its registers cannot hold."""
    for row, item in items_of(rows, value):
        try:
            encode(row, item)
        except EncodeError as error:
            unit = _unit(row, item)
            between = "" if error.low is None else f": {error.low} to {error.high}{unit}"
            message = f"{item}{unit} does not fit its word: it {error}{between}"
            refuse("set_value", message, help=FITS_HELP)


def _unit(row: Point, item: object) -> str:
    """The unit of a register with a blank before it; empty where it is the loop's own, or the value says it."""
    is_own = any(side in row.unit for side in SIDES)
    return "" if not row.unit or is_own or "counts" in str(item) else f" {row.unit}"


# ----------------------------------------------------------------------------------------------------------------------
# What a scenario's ``set`` may write in a controller whose parameters have names and types: a name to its content.
# Keys are the parameters' names, upper and lower case exact, and a vendor's short forms. A vendor makes `NamedKeys`
# of its table of parameters.


def parameters_of(tables: Iterable[ParameterTable], excluded: Iterable[str] = ()) -> dict[str, Parameter]:
    """Every parameter that is not ``excluded``, by its name."""
    return {row.name: row for table in tables for row in table.rows if row.name not in set(excluded)}


def parse_plain(value: object) -> Decimal:
    """A number in the unit of its parameter; a parameter has no counts."""
    if not isinstance(value, Quantity):
        return parse_number(value)
    if value.counts:
        refuse("number_form", f"{value} is in counts, but the parameter holds a number in its own unit")
    return value.value


def parse_whole(value: object) -> int:
    """A whole number; `initial` gives it as a quantity."""
    return parse_integer(parse_plain(value) if isinstance(value, Quantity) else value)


def parse_switch(value: object) -> bool:
    """On or off; `initial`, which gives numbers, has 1 and 0 for it."""
    if not isinstance(value, Quantity):
        return parse_flag(value)
    if value.counts or value.value not in {0, 1}:
        refuse("set_value", f"{value} is neither on nor off", help="write 1 or 0")
    return bool(value.value)


class Seconds(float):
    """A time that was written with a unit, where the other form of the equation wants a gain."""


PARSERS_BY_KIND: Mapping[str, ContentParser] = {
    "bool": parse_switch,
    "whole": parse_whole,
    "real": parse_plain,
    "time": parse_seconds,
    "word": str,
}
"""How a value of each kind of type is written."""


@frozen
class NamedKeys:
    """The parameters that can be set in a running loop."""

    rows: Mapping[str, Parameter]
    """By name."""
    short_forms: Mapping[str, str]
    """Short forms by key, with the names that they stand for; every vendor has ``setpoint`` and ``output``."""
    events: Mapping[str, str] = field(default_factory=dict)
    """Keys that have an event instead, and the key of that event."""
    unsettable: Mapping[str, str] = field(default_factory=dict)
    """Names that cannot be set from outside, and what writes them."""
    parsers: Mapping[str, ContentParser] = field(default_factory=dict)
    """How a parameter's value is written, by name, where its type does not tell."""

    def find(self, path: tuple[str, ...]) -> Parameter:
        """The parameter behind a key; refuses what cannot be set."""
        key = self.short_forms.get(dotted_text(path), dotted_text(path))
        if key in self.events:
            refuse("set_key", f"{key} is an event of its own", help=f"write {self.events[key]}: in place of set:")
        if key in self.unsettable:
            refuse("set_key", f"{key} cannot be set: {self.unsettable[key]}")
        if key in self.rows:
            return self.rows[key]
        return refuse("set_key", f"{key!r} is nothing that can be set in a running loop", help=self._cure(key))

    def parse(self, row: Parameter, value: object) -> Content:
        """A value as its parameter holds it, read as strictly as in the configuration file."""
        parsed = (self.parsers.get(row.name) or PARSERS_BY_KIND[row.type.kind])(value)
        if row.type.kind == "word" and parsed not in row.type.words:
            refuse("choice", f"{value!r} is none of {', '.join(row.type.words)}")
        try:
            return store_content(row.type, parsed)
        except EncodeError as error:
            between = "" if error.low is None else f": {error.low} to {error.high}"
            return refuse("set_value", f"{value} does not fit a {row.type.name}: it {error}{between}", help=FITS_HELP)

    def check(self, path: tuple[str, ...], value: object) -> Content:
        """The content that a value makes of a key's parameter; a ``PydanticCustomError`` says what is wrong."""
        return self.parse(self.find(path), value)

    def _cure(self, key: str) -> str:
        known = [*self.short_forms, *self.rows]
        alike = {name.lower(): name for name in known}
        if key.lower() in alike:
            return f"write {alike[key.lower()]}: upper and lower case count"
        near = key_of_term(key, known) or closest_name(key, known) or alike.get(closest_name(key.lower(), alike) or "")
        return f"did you mean {near}?" if near else "write the name of a parameter"


# --- The registers of a virtual PLC as somebody outside sees them: what they hold now, and what may be written --------

D873 = Decision(
    873,
    "what a client may write to the virtual PLC",
    "Settings and requests, and an output where the PLC takes one. A register that only the controller writes, or that "
    "is reserved, is exception 2; a content that is no value of its register is exception 3; a value that the PLC does "
    "not take at this moment is exception 4. What the PLC takes and overwrites with its next calculation is written.",
    "The manuals speak of no Modbus exceptions; the three say where, what and when.",
)


class RegisterError(ValueError):
    """A write that the PLC refuses; ``code`` is the Modbus exception."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


NO_REGISTER, NO_VALUE, NOT_NOW = 2, 3, 4
"""Exceptions of D873."""


class WriteResult(NamedTuple):
    """What a write has done, in words, and the mode that it requested, if it did."""

    text: str
    mode: str | None = None

    @classmethod
    def setting(cls, key: object, value: object, no_effect: str | None, mode: str | None = None) -> WriteResult:
        """A value that has been set; ``no_effect`` says why it has no effect yet."""
        return cls(f"set {key} to {value}" + (f"; {no_effect}" if no_effect else ""), mode)


NO_LOOP = -1


class Registers(ABC):
    """The registers of a virtual PLC by plain number; loops are counted from 0, and `NO_LOOP` is what has none."""

    _rows: Mapping[Any, tuple[int, Any]]
    """The registers of loops, each with its loop and its row of the map."""

    def loops_by_register(self) -> dict[Any, int]:
        """Every register that there is, with its loop."""
        return {number: loop for number, (loop, _) in self._rows.items()}

    @abstractmethod
    def contents(self, loop: int, signals: Sequence[float]) -> Mapping[Any, int]:
        """What the registers of a loop hold now, raw; ``signals``: those of the run."""

    def contents_by_number(self, loop: int, contents: Mapping[str, int]) -> dict[Any, int]:
        """What a loop's registers hold, from what they hold by the name of their row."""
        return {number: contents[row.name] for number, (i, row) in self._rows.items() if i == loop}

    @abstractmethod
    def write(self, number: Any, raw: int, signals: MutableSequence[float]) -> WriteResult:
        """Writes a register as an operator's panel does. Raises `RegisterError`."""

    @staticmethod
    def read_only_error(name: str, row: Word) -> RegisterError:
        """The refusal of a write to a register that only the controller writes."""
        return RegisterError(NO_REGISTER, f"{name} ({row.title}) is written by the PLC alone")

    @staticmethod
    def decode(name: str, decode: Callable[..., Value], *raw: object) -> Value:
        """What ``decode`` makes of the raw content of a register; raises `RegisterError` for what is none."""
        try:
            return decode(*raw)
        except DecodeError as error:
            raise RegisterError(NO_VALUE, f"{name}: {error}") from None

    @staticmethod
    def find_parameter(keys: NamedKeys, name: str, row: str) -> Parameter:
        """A parameter that can be written; raises `RegisterError` where the PLC, or its program, writes it."""
        try:
            return keys.find((row,))
        except PydanticCustomError as error:
            raise RegisterError(NO_REGISTER, f"{name}: {error.message()}") from None
