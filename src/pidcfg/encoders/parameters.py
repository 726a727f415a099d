"""The image of a vendor whose parameters have names and types, as variables of a program have, and no addresses.

`Program` is to such a vendor what `pidcfg.encoders.image.Image` is to one with registers. Its content is what the PLC
holds: a REAL is the shortest decimal that means its single-precision number, an LREAL that of a double-precision one.
"""

from __future__ import annotations

import sys
from dataclasses import field
from decimal import Decimal
from math import isfinite
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pidcfg.encoders.regmap import Misfit
from pidcfg.encoders.singles import Single, single_value
from pidcfg.encoders.words import DecodeError, EncodeError
from pidcfg.frozen import frozen
from pidcfg.schemas.iec import (
    AUTOTUNE_MODE,
    BOOL,
    DERIVATIVE_OF,
    DINT,
    INT,
    LOOP_MODE,
    LREAL,
    REAL,
    TIME,
    UINT,
    USINT,
    IecType,
    Wire,
    time_seconds,
    time_text,
)
from pidcfg.schemas.names import nearest

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from pidcfg.encoders.regmap import Rounded
    from pidcfg.paths import Path
    from pidcfg.refs import Basis

SHOWN = 60
"""Characters of a strange name that a message quotes."""
Content = bool | int | float | str
SINGLE = Single()
LARGEST = Decimal(repr(sys.float_info.max))
"""Of an LREAL."""


class Elsewhere(Wire):
    """The symbol or device that a parameter stands in, where a listing does not say what it holds."""

    __slots__ = ()


TYPES = {
    kind.name: kind
    for kind in (BOOL, REAL, LREAL, INT, UINT, USINT, DINT, TIME, AUTOTUNE_MODE, LOOP_MODE, DERIVATIVE_OF)
}


class Parameter(NamedTuple):
    """A row of a function block's or an instruction's table; ``name`` is the manual's, and its path in the file."""

    name: str
    type: IecType
    unit: str = ""
    title: str = ""
    basis: Basis | None = None
    access: Literal["input", "output"] = "input"


class ParameterTable(NamedTuple):
    """All parameters of a function block, a function or an instruction, in the manual's order."""

    title: str
    rows: tuple[Parameter, ...]

    def row(self, name: str) -> Parameter:
        """A parameter by its name."""
        return next(row for row in self.rows if row.name == name)


class Entry(NamedTuple):
    """One parameter: its full name, its type, and its content, or the expression that it is wired to."""

    address: str
    type: IecType
    raw: Content | Wire
    field: str
    loop: str | None = None
    device: str | None = None
    """Where it stands in the PLC's memory, for vendors that place parameters there."""

    @property
    def number(self) -> str:
        """What tells it from the other entries of an image: its name."""
        return self.address


@frozen
class Program:
    """A vendor's named parameters in the order of the configuration, and what no parameter holds."""

    vendor: str
    cells: tuple[Entry, ...]
    settings: tuple[Mapping[str, Any], ...] = ()
    plc: Mapping[str, Any] = field(default_factory=dict)

    @property
    def words(self) -> dict[str, Content | Wire]:
        """Content by name."""
        return {cell.address: cell.raw for cell in self.cells}


@frozen
class ProgramEncoding:
    """A configuration's program, and the values that did not go in as written, each with its place."""

    image: Program
    misfits: tuple[tuple[Path, Misfit], ...] = ()
    rounded: tuple[tuple[Path, Rounded], ...] = ()

    @property
    def whole(self) -> bool:
        """Whether every value has a parameter that can hold it."""
        return not self.misfits


def store(kind: IecType, value: Decimal | Content) -> Content:
    """What a variable of this type holds of a value; raises `EncodeError` for one that it cannot hold."""
    if kind.kind == "bool":
        return bool(value)
    if kind.kind == "word":
        return str(value)
    if kind.kind == "time":
        return time_text(_milliseconds(kind, Decimal(value)))
    number = Decimal(value)
    if kind.kind == "real":
        return _double(kind, number) if kind.double else single_value(SINGLE.encode(number))
    if number != number.to_integral_value():
        raise EncodeError("form", f"{kind.name} holds whole numbers")
    if not kind.low <= number <= kind.high:
        raise EncodeError("range", f"is outside the range of {kind.name}", Decimal(kind.low), Decimal(kind.high))
    return int(number)


def _double(kind: IecType, number: Decimal) -> float:
    value = float(number)
    if not isfinite(value):
        raise EncodeError("range", f"is outside the range of {kind.name}", -LARGEST, LARGEST)
    return value


def _milliseconds(kind: IecType, seconds: Decimal) -> int:
    number = seconds * 1000
    if number != number.to_integral_value():
        raise EncodeError("form", f"{kind.name} holds whole milliseconds")
    if not kind.low <= number <= kind.high:
        raise EncodeError("range", f"is outside the range of {kind.name}", Decimal(0), Decimal(kind.high) / 1000)
    return int(number)


def read(kind: IecType, value: object) -> Content | None:
    """A content as JSON has it, if it is one of this type; None: it is not."""
    if kind.kind == "bool":
        return value if isinstance(value, bool) else None
    if kind.kind == "word":
        return value if isinstance(value, str) and value in kind.words else None
    if kind.kind == "time":
        value = time_seconds(value) if isinstance(value, str) and value.upper().startswith(("T#", "TIME#")) else None
    elif isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        if isinstance(value, Decimal):
            return store(kind, value)
        return None if value is None else store(kind, Decimal(repr(value)))
    except (EncodeError, ArithmeticError):
        return None


def stored(row: Parameter, value: Any) -> tuple[Content, Misfit | None]:
    """What a parameter holds of a value; for one that it cannot hold its default, and what is wrong."""
    try:
        return store(row.type, value), None
    except EncodeError as error:
        return row.type.default, Misfit(row.name, row, value, error)


def content_of(name: str, row: Parameter, raw: Content | Wire, kind: str) -> Content:
    """The content of a parameter in a listing; raises `DecodeError` where it is wired, or no value of its type."""
    if isinstance(raw, Wire):
        raise DecodeError(f"{name} is an expression; {kind} is a value", name)
    content = read(row.type, raw)
    if content is None:
        raise DecodeError(f"{name}: {repr(raw)[:SHOWN]} is not a value of {row.type.name}", name)
    return content


def type_of_content(content: Content) -> IecType:
    """The type of a variable that begins with a content: each has a form of its own."""
    if isinstance(content, bool):
        return BOOL
    return TIME if isinstance(content, str) else INT if isinstance(content, int) else REAL


def value_of(content: Content) -> Decimal | bool | str:
    """A content as the value of a field."""
    return content if isinstance(content, bool | str) else Decimal(repr(content))


def unknown_name(name: str, key: str, keys: Iterable[str], kind: str) -> DecodeError:
    """The error of a name with a key that there is none of: it would leave a default in place."""
    near = nearest(key, keys)
    cure = f"; did you mean {near}?" if near else ""
    return DecodeError(f"{name[:SHOWN]}: {key[:SHOWN]!r} is not {kind}{cure}", name)


def shortest(value: float) -> float:
    """The shortest decimal that means this single-precision number."""
    return single_value(SINGLE.encode(Decimal(value)))


def shown(kind: IecType, content: Content) -> str:
    """A content as the programming language writes it: TRUE, 5, 2.0, 1.0E-6."""
    if kind.kind == "bool":
        return "TRUE" if content else "FALSE"
    if kind.kind in {"word", "time"}:
        return str(content)
    return repr(content).upper() if kind.kind == "real" else str(int(content))
