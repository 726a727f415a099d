"""Vendors whose parameters have names and types: their tables, their image, and one walk of it both ways."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

from pidcfg.encoders.codecs import WORD_MAX, DecodeError, EncodeError, Single, single_bits, single_value
from pidcfg.encoders.image import (
    NO_VALUES,
    Decoded,
    Encoding,
    Image,
    LoopOption,
    Settings,
    file_data,
    file_value,
    read_settings,
    settings_of,
    settings_values,
    with_options,
    without_none,
)
from pidcfg.encoders.regmap import GainUnit, Misfit, Rounded
from pidcfg.schemas.base import Limits, Model, SectionSettings, limits_at
from pidcfg.schemas.document import models_of
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
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Data, Path, outer_keys, parse_path, set_value, value_at
from pidcfg.text.references import Basis, Decision
from pidcfg.text.signs import closest_name

if TYPE_CHECKING:
    from pydantic import BaseModel

# ----------------------------------------------------------------------------------------------------------------------
# The image of a vendor whose parameters have names and types, as variables of a program have, and no addresses.
# `Program` is to such a vendor what `pidcfg.encoders.image.Image` is to one with registers. Its content is what the
# PLC holds: a REAL is the shortest decimal that means its single-precision number, an LREAL that of a double-
# precision one.

MAX_QUOTED_CHARACTERS = 60
"""Characters of a strange name that a message quotes."""
Content = bool | int | float | str
SINGLE = Single()
LARGEST_DOUBLE = Decimal(repr(sys.float_info.max))
"""Of an LREAL."""


class UnknownContent(Wire):
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

    def find_parameter(self, name: str) -> Parameter:
        """A parameter by its name."""
        return next(row for row in self.rows if row.name == name)

    def units(self) -> Iterator[tuple[str, str]]:
        """Where each value stands in a configuration, and its unit."""
        return ((row.name, row.unit) for row in self.rows)


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

    @property
    def content(self) -> Content:
        """What it holds; the text of what it is wired to."""
        return self.raw.text if isinstance(self.raw, Wire) else self.raw

    @property
    def single_value(self) -> float | None:
        """The number, where it is one in single precision."""
        return self.raw if isinstance(self.raw, float) and not self.type.double else None

    @property
    def no_number_hex(self) -> str:
        """Empty: JSON has a word for every content."""
        return ""

    def data(self) -> Data:
        """The parameter as JSON has it; a wired one has its expression in place of a value."""
        content = {"expression": self.raw.text} if isinstance(self.raw, Wire) else {"value": self.raw}
        device = {} if self.device is None else {"device": self.device}
        name = {"address": self.address, "type": self.type.name}
        return {**name, **content, **device, "loop": self.loop, "field": self.field}


@frozen
class Program:
    """A vendor's named parameters in the order of the configuration, and what no parameter holds."""

    vendor: str
    cells: tuple[Entry, ...]
    settings: tuple[Settings, ...] = ()
    plc: Settings = field(default_factory=dict)

    @property
    def words(self) -> dict[str, Content | Wire]:
        """Content by name."""
        return {cell.address: cell.raw for cell in self.cells}


class NamedEncoding:
    """What every encoding of named parameters has: entries in place of blocks, and no addresses."""

    __slots__ = ()
    image: Program
    misfits: tuple[tuple[Path, Misfit], ...]
    rounded: tuple[tuple[Path, Rounded], ...]
    blocks: ClassVar[tuple[()]] = ()
    space: ClassVar[None] = None

    @property
    def entries(self) -> tuple[Entry, ...]:
        """The parameters."""
        return self.image.cells

    @property
    def is_complete(self) -> bool:
        """Whether every value has a parameter that can hold it."""
        return not self.misfits

    def addresses_under(self, loop: str, key: str, words: Iterable[str]) -> Iterator[str]:
        """The names of ``words`` that hold a section of a loop."""
        section = f"{loop}.{key}" if loop else key
        return (word for word in words if word == section or word.startswith(f"{section}."))


@frozen
class ProgramEncoding(NamedEncoding):
    """A configuration's program, and the values that did not go in as written, each with its place."""

    image: Program
    misfits: tuple[tuple[Path, Misfit], ...] = ()
    rounded: tuple[tuple[Path, Rounded], ...] = ()


AnyEncoding = Encoding | NamedEncoding
AnyImage = Image | Program
"""Of a vendor with registers, or with named parameters: both say the same of their words."""


def store_content(kind: IecType, value: Decimal | Content) -> Content:
    """What a variable of this type holds of a value; raises `EncodeError` for one that it cannot hold."""
    if kind.kind == "bool":
        return bool(value)
    if kind.kind == "word":
        return str(value)
    if kind.kind == "time":
        return time_text(_store_milliseconds(kind, Decimal(value)))
    number = Decimal(value)
    if kind.kind == "real":
        return _store_double(kind, number) if kind.double else single_value(SINGLE.encode(number))
    if number != number.to_integral_value():
        raise EncodeError("form", f"{kind.name} holds whole numbers")
    if not kind.low <= number <= kind.high:
        raise EncodeError("range", f"is outside the range of {kind.name}", Decimal(kind.low), Decimal(kind.high))
    return int(number)


def _store_double(kind: IecType, number: Decimal) -> float:
    value = float(number)
    if not isfinite(value):
        raise EncodeError("range", f"is outside the range of {kind.name}", -LARGEST_DOUBLE, LARGEST_DOUBLE)
    return value


def _store_milliseconds(kind: IecType, seconds: Decimal) -> int:
    number = seconds * 1000
    if number != number.to_integral_value():
        raise EncodeError("form", f"{kind.name} holds whole milliseconds")
    if not kind.low <= number <= kind.high:
        raise EncodeError("range", f"is outside the range of {kind.name}", Decimal(0), Decimal(kind.high) / 1000)
    return int(number)


def read_content(kind: IecType, value: object) -> Content | None:
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
            return store_content(kind, value)
        return None if value is None else store_content(kind, Decimal(repr(value)))
    except (EncodeError, ArithmeticError):
        return None


def store_value(row: Parameter, value: Any) -> tuple[Content, Misfit | None]:
    """What a parameter holds of a value; for one that it cannot hold its default, and what is wrong."""
    try:
        return store_content(row.type, value), None
    except EncodeError as error:
        return row.type.default, Misfit(row.name, row, value, error)


def content_of(name: str, row: Parameter, raw: Content | Wire, kind: str) -> Content:
    """The content of a parameter in a listing; raises `DecodeError` where it is wired, or no value of its type."""
    if isinstance(raw, Wire):
        raise DecodeError(f"{name} is an expression; {kind} is a value", name)
    content = read_content(row.type, raw)
    if content is None:
        raise DecodeError(f"{name}: {repr(raw)[:MAX_QUOTED_CHARACTERS]} is not a value of {row.type.name}", name)
    return content


def type_of_content(content: Content) -> IecType:
    """The type of a variable that begins with a content: each has a form of its own."""
    if isinstance(content, bool):
        return BOOL
    return TIME if isinstance(content, str) else INT if isinstance(content, int) else REAL


def value_of(content: Content) -> Decimal | bool | str:
    """A content as the value of a field."""
    return content if isinstance(content, bool | str) else Decimal(repr(content))


def unknown_name_error(name: str, key: str, keys: Iterable[str], kind: str) -> DecodeError:
    """The error of a name with a key that there is none of: it would leave a default in place."""
    near = closest_name(key, keys)
    cure = f"; did you mean {near}?" if near else ""
    return DecodeError(f"{name[:MAX_QUOTED_CHARACTERS]}: {key[:MAX_QUOTED_CHARACTERS]!r} is not {kind}{cure}", name)


def shortest_single(value: float) -> float:
    """The shortest decimal that means this single-precision number."""
    return single_value(SINGLE.encode(Decimal(value)))


def content_text(kind: IecType, content: Content) -> str:
    """A content as the programming language writes it: TRUE, 5, 2.0, 1.0E-6."""
    if kind.kind == "bool":
        return "TRUE" if content else "FALSE"
    if kind.kind in {"word", "time"}:
        return str(content)
    return repr(content).upper() if kind.kind == "real" else str(int(content))


# ----------------------------------------------------------------------------------------------------------------------
# The three numbers of a PID controller where they are parameters with names, as `pidcfg.encoders.regmap` has them.


@frozen
class TuningParameters:
    """Parameters of gain, integral and derivative time, in the dependent form and in engineering units."""

    table: ParameterTable
    names: tuple[str, str, str]
    heating: str
    cooling: str
    gain_unit: GainUnit = "engineering"
    no_integral: Decimal = Decimal(0)
    dependent: tuple[str, bool] | None = None
    """The parameter that makes the other two times rather than gains, and its state then; None: they always are."""

    def key(self, name: str) -> str:
        """Where a parameter stands in the configuration: under its own name."""
        return self.table.find_parameter(name).name

    def unit(self, name: str) -> str:
        """The unit of a parameter; the gain's is that of the plant."""
        return "" if name == self.names[0] else "s"

    def stored_value(self, name: str, value: Decimal) -> Decimal:
        """What the parameter holds; raises `EncodeError`."""
        return Decimal(repr(store_content(self.table.find_parameter(name).type, value)))

    def limits(self, model: type[BaseModel], name: str) -> Limits | None:
        """What the manual allows for a parameter; raises `KeyError` for a name that no part of the model has."""
        key = name.partition(".")[0]
        part = next((part for part in models_of(model) if key in part.model_fields), None)
        if part is None:
            raise KeyError(name)
        return limits_at(part, name)

    def step(self, _: str) -> None:
        """Parameters are numbers in floating point."""
        return


# ----------------------------------------------------------------------------------------------------------------------
# Elementary types of IEC 61131-3 in registers of 16 bits: how many, by which type of a map, and with which content.

D892 = Decision(
    892,
    "an elementary type has the registers of its size",
    "REAL is float32, DINT int32, TIME uint32 in ms, INT int16, UINT and USINT uint16, BOOL one bit; an enumeration is "
    "its number from 0 in an int16 or uint16. LREAL and every other type have none.",
    "IEC 61131-3 gives the sizes, TIME and enumerations as the runtime systems of NextoPID and ISPSoft keep them. What "
    "a client sees of a scaled copy of a value is another value.",
)
DOUBLE_WORD_MAX = 0xFFFFFFFF


def types_of(kind: IecType) -> tuple[str, ...]:
    """The types that a parameter may have in a map, the usual one first; empty: none fits it."""
    if kind.kind == "bool":
        return ("bool",)
    if kind.kind == "real":
        return () if kind.double else ("float32",)
    if kind.kind == "time":
        return ("uint32",)
    if kind.kind == "word" or kind.high <= WORD_MAX:
        return ("int16", "uint16") if kind.low < 0 or kind.kind == "word" else ("uint16", "int16")
    return ("int32",)


def raw_of(kind: IecType, content: Content) -> int:
    """A content as its registers hold it."""
    if kind.kind == "bool":
        return int(bool(content))
    if kind.kind == "real":
        return single_bits(float(content)) or 0
    if kind.kind == "time":
        return int((time_seconds(str(content)) or 0) * 1000)
    if kind.kind == "word":
        return kind.words.index(str(content))
    return int(content) & (WORD_MAX if kind.high <= WORD_MAX else DOUBLE_WORD_MAX)


def register_content(kind: IecType, raw: int) -> Content:
    """The content that registers hold; raises `DecodeError` where that is no value of the type."""
    if kind.kind == "bool":
        return bool(raw)
    if kind.kind == "real":
        return float(SINGLE.decode(raw))
    if kind.kind == "time":
        return time_text(raw)
    size = WORD_MAX if kind.kind == "word" or kind.high <= WORD_MAX else DOUBLE_WORD_MAX
    if kind.kind == "word":
        if raw >= len(kind.words):
            raise DecodeError(f"{raw} is none of the {len(kind.words)} of {kind.name}")
        return kind.words[raw]
    number = raw - size - 1 if kind.low < 0 and raw > size // 2 else raw
    if not kind.low <= number <= kind.high:
        raise DecodeError(f"{number} is outside the range of {kind.name}")
    return number


# --- Configurations whose loops are rows of one table of named parameters: to their contents and back -----------------
#
# A parameter is called ``LOOP.NAME``, where the name is its path in a loop of the file (``OVEN.SV``,
# ``TIC-101.tuning.gain``). A vendor makes one `NamedLoops`, which says what its table cannot: what stands beside the
# parameters, which of them have no default, and what messages call them. Defaults are left out on the way back, so
# that encoding the result again gives the same contents.


@dataclass(frozen=True, kw_only=True)
class NamedLoops:
    """What a vendor's loops are made of, and what messages call it."""

    vendor: str
    table: ParameterTable
    loop: type[Model]
    """The schema of a loop."""
    settings: type[Model]
    """What no parameter of a loop holds; its ``loop`` is the name."""
    file: type[SectionSettings]
    """What no parameter of the file holds."""
    title: str
    """A parameter, ``an operand of DPIDE``."""
    kind: str
    """The same, of a name that is none."""
    entry: str
    """An entry of a listing, for the message that there is none."""
    needed_names: Sequence[str] = ()
    """Parameters without a default."""
    always_given: frozenset[str] = frozenset()
    """Choices that are written even where they are defaults, and remarked on where a listing lacks them."""
    first_values: Mapping[str, int] = field(default_factory=dict)
    """Parameters that the file never gives, and what they hold at the start."""
    options: Sequence[LoopOption] = ()
    """What options say where no settings stand beside the parameters."""
    last_settings: Sequence[str] = ()
    """Settings that a file has behind the parameters of their section."""
    devices: Callable[[Any], Mapping[str, str]] = lambda _loop: NO_VALUES
    """Where parameters of a loop stand in the PLC's memory."""

    @cached_property
    def rows_by_name(self) -> dict[str, Parameter]:
        """The parameters by name."""
        return {row.name: row for row in self.table.rows}

    @cached_property
    def rows_with_paths(self) -> list[tuple[Parameter, Path | None]]:
        """The parameters in their order, each with its place in a loop; None for one that the file never gives."""
        return [(row, None if row.name in self.first_values else parse_path(row.name)) for row in self.table.rows]

    def split_name(self, name: str) -> tuple[str, str]:
        """The loop and the parameter of a full name; two empty texts for another name.

        No name of a parameter is the end of another one, so that a loop may have dots in its name.
        """
        parts = name.split(".")
        ends = (".".join(parts[i:]) for i in range(1, len(parts)))
        end = next((end for end in ends if end in self.rows_by_name), "")
        return (name[: -len(end) - 1], end) if end else ("", "")

    def loop_names(self, words: Iterable[str]) -> list[str]:
        """The loops of names with a known parameter, in their order."""
        return list(dict.fromkeys(loop for loop, _ in map(self.split_name, words) if loop))

    def values_of(self, loop: object) -> Iterator[tuple[Parameter, Any]]:
        """Parameters with their values; what is not given and has no default is left out."""
        for row, path in self.rows_with_paths:
            value = self.first_values[row.name] if path is None else value_at(loop, path)
            if value is not None:
                yield row, value

    def encode(self, config: Any) -> ProgramEncoding:
        """All parameters of every loop that have a value; what none holds stands beside them."""
        entries, misfits = [], []
        for i, loop in enumerate(config.loops):
            devices = self.devices(loop)
            for row, value in self.values_of(loop):
                content, misfit = store_value(row, value)
                device = devices.get(row.name)
                entries.append(Entry(f"{loop.name}.{row.name}", row.type, content, row.name, loop.name, device))
                if misfit is not None:
                    misfits.append((("loops", i, *parse_path(row.name)), misfit))
        settings = tuple(settings_of(self.settings, loop) for loop in config.loops)
        values = {**dict(config), **dict(getattr(config, "plc", {}))}
        file_settings = without_none({key: file_value(values.get(key)) for key in self.file.model_fields})
        return ProgramEncoding(Program(self.vendor, tuple(entries), settings, file_settings), tuple(misfits))

    def decode(
        self,
        words: Mapping[str, Content | Wire],
        settings: Sequence[Mapping[str, object]] = (),
        plc: Settings | None = None,
        options: Mapping[str, object] | None = None,
    ) -> Decoded:
        """The configuration that these parameters hold; raises `DecodeError` for what is missing or is no value.

        ``words`` are contents by full name; ``settings`` and ``plc`` are what an encoder put beside them; ``options``
        one list for each of the vendor's, of one entry a loop.
        """
        file = read_settings(self.file, plc or {}, "plc")
        entries: Sequence[Mapping[str, Any]] = list(settings) or [{"loop": name} for name in self.loop_names(words)]
        if not entries:
            raise DecodeError(f"the listing holds no {self.entry}")
        if self.options:
            entries = with_options(entries, options or {}, self.options)
        loops: list[Any] = [read_settings(self.settings, entry, f"settings[{i}]") for i, entry in enumerate(entries)]
        names = {loop.loop for loop in loops}
        self._check_names(words, names)
        other_names = [name for name in self.loop_names(words) if name not in names]
        notes = [f"{name} is not carried over: the settings do not name it" for name in other_names]
        data: Data = {"pidcfg": 1, "vendor": self.vendor}
        data |= without_none({key: getattr(file, key) for key in SectionSettings.model_fields})
        plc_data = without_none(
            {key: value for key, value in dict(file).items() if key not in SectionSettings.model_fields}
        )
        data |= {"plc": plc_data} if plc_data else {}
        return Decoded({**data, "loops": [self._loop_data(loop, words, notes) for loop in loops]}, tuple(notes))

    def _check_names(self, words: Iterable[str], loops: set[str]) -> None:
        """An unknown name would leave its default in place, which may be the other direction."""
        nested = any("." in name for name in self.rows_by_name)
        for name in words:
            loop = next((loop for loop in outer_keys(name) if loop in loops), None)
            key = name.removeprefix(f"{loop}.")
            if loop is not None and not self.split_name(name)[0] and (nested or "." not in key):
                raise unknown_name_error(name, key, self.rows_by_name, self.kind)

    def _loop_data(self, settings: Any, words: Mapping[str, Content | Wire], notes: list[str]) -> Data:
        values = settings_values(settings)
        last_values = {path: values.pop(path) for path in self.last_settings if path in values}
        for row in self.table.rows:
            name = f"{settings.loop}.{row.name}"
            if name not in words:
                if row.name in self.needed_names:
                    raise DecodeError(f"the listing does not hold {name} ({row.title})")
                continue
            content = content_of(name, row, words[name], self.title)
            if row.access == "input" and row.name not in self.first_values:
                values[row.name] = value_of(content)
            elif content:
                notes.append(f"{name} = {content_text(row.type, content)} ({row.title}) is not carried over")
        self._check_pairs(settings.loop, values)
        for key in sorted(self.always_given - values.keys()):
            default = content_text(self.rows_by_name[key].type, self.rows_by_name[key].type.default)
            notes.append(f"{settings.loop}: the listing does not hold {key}, which then is {default}")
        data = file_data(self.loop, values, always_written=self.always_given)
        for path, value in last_values.items():
            set_value(data, parse_path(path), value)
        return data

    def _check_pairs(self, loop: str, values: Mapping[str, object]) -> None:
        """Refuses one end of a pair alone."""
        for low in (name for name in self.rows_by_name if name.endswith(".0")):
            ends = (low, f"{low.removesuffix('0')}1")
            missing = [end for end in ends if end not in values]
            if len(missing) == 1:
                raise DecodeError(
                    f"the listing does not hold {loop}.{missing[0]} ({self.rows_by_name[missing[0]].title})"
                )
