"""What a scenario's ``set`` may write in a controller whose parameters have names and types: a name to its content.

Keys are the parameters' names, upper and lower case exact, and a vendor's short forms. A vendor makes `NamedKeys`
of its table of parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, cast

from pidcfg.encoders.parameters import Content, Parameter, ParameterTable, store
from pidcfg.encoders.words import EncodeError
from pidcfg.paths import dotted
from pidcfg.schemas.base import Quantity, parse_flag, parse_seconds
from pidcfg.schemas.names import nearest, spoken
from pidcfg.schemas.numbers import parse_integer, parse_number, refuse
from pidcfg.sim.settings import FITS

if TYPE_CHECKING:
    from decimal import Decimal

Parser = Callable[[object], object]


def parameters_of(tables: Iterable[ParameterTable], left_out: Iterable[str] = ()) -> dict[str, Parameter]:
    """Every parameter that is not ``left_out``, by its name."""
    return {row.name: row for table in tables for row in table.rows if row.name not in set(left_out)}


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


BY_KIND: Mapping[str, Parser] = {
    "bool": parse_switch,
    "whole": parse_whole,
    "real": parse_plain,
    "time": parse_seconds,
    "word": str,
}
"""How a value of each kind of type is written."""


@dataclass(frozen=True, slots=True)
class NamedKeys:
    """The parameters that can be set in a running loop."""

    rows: Mapping[str, Parameter]
    """By name."""
    short: Mapping[str, str]
    """Short forms by key, with the names that they stand for; every vendor has ``setpoint`` and ``output``."""
    events: Mapping[str, str] = field(default_factory=dict)
    """Keys that have an event instead, and the key of that event."""
    fixed: Mapping[str, str] = field(default_factory=dict)
    """Names that cannot be set from outside, and what writes them."""
    parsers: Mapping[str, Parser] = field(default_factory=dict)
    """How a parameter's value is written, by name, where its type does not tell."""

    def find(self, path: tuple[str, ...]) -> Parameter:
        """The parameter behind a key; refuses what cannot be set."""
        key = self.short.get(dotted(path), dotted(path))
        if key in self.events:
            refuse("set_key", f"{key} is an event of its own", help=f"write {self.events[key]}: in place of set:")
        if key in self.fixed:
            refuse("set_key", f"{key} cannot be set: {self.fixed[key]}")
        if key in self.rows:
            return self.rows[key]
        return refuse("set_key", f"{key!r} is nothing that can be set in a running loop", help=self._cure(key))

    def parse(self, row: Parameter, value: object) -> Content:
        """A value as its parameter holds it, read as strictly as in the configuration file."""
        parsed = (self.parsers.get(row.name) or BY_KIND[row.type.kind])(value)
        if row.type.kind == "word" and parsed not in row.type.words:
            refuse("choice", f"{value!r} is none of {', '.join(row.type.words)}")
        try:
            return store(row.type, cast("Decimal | Content", parsed))
        except EncodeError as error:
            between = "" if error.low is None else f": {error.low} to {error.high}"
            return refuse("set_value", f"{value} does not fit a {row.type.name}: it {error}{between}", help=FITS)

    def check(self, path: tuple[str, ...], value: object) -> Content:
        """The content that a value makes of a key's parameter; a ``PydanticCustomError`` says what is wrong."""
        return self.parse(self.find(path), value)

    def _cure(self, key: str) -> str:
        known = [*self.short, *self.rows]
        alike = {name.lower(): name for name in known}
        if key.lower() in alike:
            return f"write {alike[key.lower()]}: upper and lower case count"
        near = spoken(key, known) or nearest(key, known) or alike.get(nearest(key.lower(), alike) or "")
        return f"did you mean {near}?" if near else "write the name of a parameter"
