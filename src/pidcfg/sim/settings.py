"""What a scenario's ``set`` may write: a key of the configuration to its register, by the register map's own codecs.

Keys are those of a loop in the configuration file (``tuning.gain``, ``alarms.pv.high``), a vendor's short forms, and
the last part of a key where only one register has it (``gain``). A vendor makes a `Keys` of its register map.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.regmap import Bits, RegisterMap, Word, encode_one
from pidcfg.encoders.words import EncodeError
from pidcfg.paths import dotted
from pidcfg.schemas.base import parse_flag
from pidcfg.schemas.names import spoken
from pidcfg.schemas.numbers import parse_number, refuse
from pidcfg.schemas.units import SIDES

if TYPE_CHECKING:
    from pidcfg.encoders.scales import Scale

FITS = "write a value inside the limits"
Row = Word | Bits
Parser = Callable[[object], object]


def rows_of(tables: Iterable[RegisterMap], left_out: Iterable[str] = ()) -> dict[str, Row]:
    """Every register and choice with a path that is not ``left_out``, by its path."""
    rows: list[Row] = []
    for table in tables:
        rows += [*table.words, *table.bits]
    return {row.path: row for row in rows if row.path is not None and row.path not in set(left_out)}


@dataclass(frozen=True, slots=True)
class Keys:
    """The keys that can be set in a running loop."""

    rows: Mapping[str, Row]
    """The registers and choices behind them, by path; the two ends of a pair end in ``.0`` and ``.1``."""
    short: Mapping[str, str]
    """Short forms; every vendor has ``setpoint`` and ``output``."""
    events: Mapping[str, str] = field(default_factory=dict)
    """Keys that have an event instead, and the key of that event."""
    parsers: Mapping[str, Parser] = field(default_factory=dict)
    """How a register's value is written, by path."""
    parser: Callable[[Word], Parser] = lambda _word: parse_number
    """How the value of any other register is written."""

    def find(self, path: tuple[str, ...]) -> list[Row]:
        """The registers behind a key: one, or both ends of a pair of limits; refuses what cannot be set."""
        key = self.short.get(dotted(path), dotted(path))
        if key in self.events:
            refuse("set_key", f"{key} is an event of its own", help=f"write {self.events[key]}: in place of set:")
        if key in self.rows:
            return [self.rows[key]]
        if f"{key}.0" in self.rows:
            return [self.rows[f"{key}.0"], self.rows[f"{key}.1"]]
        setpoint = self.short["setpoint"]
        same = [row for name, row in self.rows.items() if name.rpartition(".")[2] == key and name != setpoint]
        if len(same) == 1:
            return same
        known = [*self.short, *self.rows]
        near = spoken(key, known) or next(iter(difflib.get_close_matches(key, known, 1, 0.5)), None)
        cure = f"did you mean {near}?" if near else "write a key of the loop's configuration"
        return refuse("set_key", f"{key!r} is nothing that can be set in a running loop", help=cure)

    def check(self, path: tuple[str, ...], value: object, encode: Callable[[Row, Any], int]) -> object:
        """The parsed value of a key; a ``PydanticCustomError`` says why its registers cannot hold it."""
        rows = self.find(path)
        parsed = self.parse(rows, value)
        check_fit(rows, parsed, encode)
        return parsed

    def parse(self, rows: list[Row], value: object) -> object:
        """The value of a key as its registers take it; of a pair both."""
        if len(rows) == 1:
            return self.parse_row(rows[0], value)
        if not isinstance(value, list | tuple) or len(value) != len(rows):
            refuse("pair_type", "both limits are wanted", help="write [low, high]")
        return tuple(self.parse_row(row, item) for row, item in zip(rows, value, strict=True))

    def parse_row(self, row: Row, value: object) -> object:
        """One register's value, as strictly as in the configuration file."""
        choices = choices_of(row)
        if choices is None:
            word: Any = row
            parser = self.parsers.get(str(row.path)) or self.parser(word)
            return parser(value)
        if set(choices) == {False, True}:
            return parse_flag(value)
        known = {str(choice): choice for choice in choices if choice is not None}
        if str(value) not in known:
            refuse("choice", f"{value!r} is none of {', '.join(known)}")
        return known[str(value)]


def choices_of(row: Row) -> list[Any] | None:
    """What a switch can be; None for a register that holds a number."""
    choices = row.choices if isinstance(row, Bits) else getattr(row.codec, "choices", None)
    return None if choices is None else list(choices.values())


def encode_row(row: Row, value: Any, scales: Mapping[str, Scale] = MappingProxyType({})) -> int:
    """A parsed value to its word, or to its bits in place; `EncodeError` when the register cannot hold it."""
    return row.encode(value) if isinstance(row, Bits) else encode_one(row.codec, value, scales)


def items_of(rows: list[Row], value: Any) -> Iterator[tuple[Row, Any]]:
    """Each register behind a key with its part of the value: a pair of limits has two."""
    return zip(rows, value if len(rows) > 1 else [value], strict=True)


def check_fit(rows: list[Row], value: Any, encode: Callable[[Row, Any], int]) -> None:
    """Refuses a parsed value that its registers cannot hold."""
    for row, item in items_of(rows, value):
        try:
            encode(row, item)
        except EncodeError as error:
            unit = _unit(row, item)
            between = "" if error.low is None else f": {error.low} to {error.high}{unit}"
            message = f"{item}{unit} does not fit its word: it {error}{between}"
            refuse("set_value", message, help=FITS)


def _unit(row: Row, item: object) -> str:
    """The unit of a register with a blank before it; empty where it is the loop's own, or the value says it."""
    unit = row.unit if isinstance(row, Word) else ""
    return f" {unit}" if unit and "counts" not in str(item) and not any(side in unit for side in SIDES) else ""
