"""What is downloaded to a PLC with addresses: words, settings beside them, and one walk of a map both ways."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import field
from decimal import Decimal
from functools import cache, cached_property
from math import isfinite
from types import MappingProxyType, UnionType
from typing import Any, ClassVar, NamedTuple, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from pidcfg.encoders.codecs import DecodeError, Scale
from pidcfg.encoders.regmap import (
    SINGLE,
    WORD,
    Access,
    Encoded,
    Kind,
    Misfit,
    NoRegisterError,
    RegisterMap,
    Rounded,
    Space,
    Word,
    Writer,
)
from pidcfg.schemas.base import Model, Quantity
from pidcfg.schemas.numbers import plain_number
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Data, Path, dotted_text, given_fields, has_key, parse_path, set_value, value_at

# --- What is downloaded to a PLC: its words in address order, and beside them what no register holds ------------------


@frozen
class Cell:
    """One register: its address as the vendor writes it and as a number, its raw content, and what it is."""

    address: str
    number: int
    raw: int
    field: str
    loop: str | None = None
    kind: Kind = WORD
    access: Access = "setting"
    path: Path | None = dataclasses.field(default=None, compare=False)
    """Where its value stands in the configuration; None where it holds several, or none of it."""

    @property
    def hex(self) -> str:
        """The raw content in hexadecimal digits; BCD words read as their decimal digits."""
        return self.kind.hex(self.raw)

    @property
    def value(self) -> bool | int | float:
        """The content as the vendor shows it."""
        return self.kind.show(self.raw)

    @property
    def text(self) -> str:
        """The content as a listing writes it."""
        return self.kind.text(self.raw)

    @property
    def single_value(self) -> float | None:
        """The number, where it is one in single precision."""
        return self.value if self.kind is SINGLE else None

    @property
    def no_number_hex(self) -> str:
        """The hexadecimal digits of an infinity or of what is no number, which JSON has no word for; empty: it has."""
        return "" if isfinite(self.value) else self.hex

    def data(self) -> Data:
        """The register as JSON has it, exactly."""
        return {"address": self.address, "hex": self.hex, "loop": self.loop, "field": self.field}


@frozen
class Image:
    """A vendor's memory, and what no register holds: ``settings`` one mapping a loop, ``plc`` for the whole file."""

    vendor: str
    cells: tuple[Cell, ...]
    settings: tuple[Settings, ...] = ()
    plc: Settings = field(default_factory=dict)

    @property
    def words(self) -> dict[int, int]:
        """Raw values by address."""
        return {cell.number: cell.raw for cell in self.cells}


@frozen
class Block:
    """A register block at its address, and the place in the configuration that it comes from."""

    path: Path
    start: int
    table: RegisterMap
    encoded: Encoded
    loop: str | None = None
    prefix: str = ""
    scales: Mapping[str, Scale] = field(default_factory=dict)
    """What the quantities of the block are on."""

    def make_cells(self, space: Space) -> list[Cell]:
        """The registers of the block; flags that only the CPU writes (they belong to no loop) are left out."""
        rows = [w for w in self.table.words if self.loop is not None or w.access != "status"]
        return [
            Cell(
                space.name(a),
                a,
                self.encoded.words[row.offset],
                self.prefix + row.name,
                self.loop,
                space.kind_of(a),
                row.access,
                None if row.path is None else (*self.path, *parse_path(row.path)),
            )
            for row, a in ((row, self.start + row.offset) for row in rows)
        ]


def bank_end_error(block: Block, space: Space) -> NoRegisterError:
    """The error of a block that goes on behind the last register of its bank."""
    owner = f" of {block.loop}" if block.loop else ""
    return NoRegisterError(f"the block{owner} at {space.name(block.start)} goes on behind the last register")


@frozen
class Encoding:
    """The blocks of a configuration in the order they are written; where they overlap, the later wins."""

    vendor: str
    blocks: tuple[Block, ...]
    space: Space
    settings: tuple[Settings, ...] = ()
    plc: Settings = field(default_factory=dict)
    entries: ClassVar[tuple[()]] = ()
    """It has no parameters with names."""

    @cached_property
    def image(self) -> Image:
        """All words in address order; raises `NoRegisterError` where a block leaves its bank, and has no image."""
        if self.blocks_outside:
            raise bank_end_error(self.blocks_outside[0], self.space)
        cells = {cell.number: cell for block in self.blocks for cell in block.make_cells(self.space)}
        return Image(self.vendor, tuple(cells[a] for a in sorted(cells)), self.settings, self.plc)

    @cached_property
    def misfits(self) -> tuple[tuple[Path, Misfit], ...]:
        """Values that their registers cannot hold, each with its place."""
        return tuple(((*b.path, *parse_path(m.path)), m) for b in self.blocks for m in b.encoded.misfits)

    @cached_property
    def blocks_outside(self) -> tuple[Block, ...]:
        """Blocks that go on behind the last register of their bank."""
        return tuple(b for b in self.blocks if not self.space.same_bank(b.start, b.start + b.table.size - 1))

    @property
    def is_complete(self) -> bool:
        """Whether every value has a register that can hold it: no misfit, and no block that leaves its bank."""
        return not self.blocks_outside and not self.misfits

    @cached_property
    def rounded(self) -> tuple[tuple[Path, Rounded], ...]:
        """Values that their registers hold only rounded, each with its place."""
        return tuple(((*b.path, *parse_path(r.path)), r) for b in self.blocks for r in b.encoded.rounded)

    def addresses_under(self, loop: str, key: str, _: Iterable[object]) -> Iterator[int]:
        """The registers that hold a section of a loop."""
        for block in self.blocks:
            if block.loop == loop:
                inner = dotted_text(block.path[2:])
                for point in block.table.points:
                    own = ".".join(part for part in (inner, point.path) if part)
                    if point.path is not None and (own == key or own.startswith(f"{key}.")):
                        yield block.start + point.offset


@frozen
class Decoded:
    """A configuration as plain data in the order of its file, and notes on what it could not carry."""

    data: Data
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    """Those of the notes that name a word that is no value: the data have 0 in its place (D50)."""
    status: tuple[int, ...] = ()
    """Words outside the loops that the PLC writes: a listing may hold them, no configuration does."""
    suggestion: str = ""
    """The listing with words corrected that seem wrong, for a person to compare; empty: none does."""


# --- Blocks of registers that are to be read from a PLC: where each begins, and the table that says what is in it -----


class AreaError(DecodeError):
    """A PLC whose registers do not say where its loops are; the message says which options would."""


class Area(NamedTuple):
    """A block: ``start`` as a plain number of the vendor's space, and the loop that it is of (empty: of none)."""

    start: int
    table: RegisterMap
    loop: str = ""
    prefix: str = ""

    @property
    def numbers(self) -> range:
        """The registers of the block."""
        return range(self.start, self.start + self.table.size)

    def make_cells(self, space: Space, words: Mapping[int, int]) -> list[Cell]:
        """The block with its contents; a register that ``words`` does not hold is left out."""
        return [
            Cell(space.name(n), n, words[n], self.prefix + row.name, self.loop or None, space.kind_of(n), row.access)
            for n, row in zip(self.numbers, self.table.words, strict=True)
            if n in words
        ]

    def kept_masks(self, writers: tuple[Writer, ...]) -> dict[int, int]:
        """The bits of each register that stay as the engineer has set them: what runs, and the operator's, is 0."""
        running = {row.name for row in writers if row.kind != "compared"}
        return {self.start + row.offset: self._kept_mask(row, running) for row in self.table.words}

    def _kept_mask(self, row: Word, running: set[str]) -> int:
        if row.access != "setting" or row.name in running:
            return 0
        return ~sum(bits.mask for bits in self.table.bits if bits.offset == row.offset and bits.access != "setting")


# --- Values as the plain data of a configuration file has them --------------------------------------------------------

Settings = Mapping[str, Any]
"""What stands beside words as plain data: of a loop, of the PLC, or what options of a command say."""


def file_quantity(value: Quantity | Decimal) -> int | float | str:
    """A value as the file writes it."""
    if isinstance(value, Quantity):
        return f"{value.value} counts" if value.counts else plain_number(value.value)
    return plain_number(value)


def file_value(value: object) -> Any:
    """A field's value as the file writes it; a pair is a list."""
    if isinstance(value, Quantity | Decimal):
        return file_quantity(value)
    return [file_value(end) for end in value] if isinstance(value, tuple) else value


def without_none(data: Mapping[str, Any]) -> Data:
    """Without what is not given."""
    return {key: value for key, value in data.items() if value is not None}


# ----------------------------------------------------------------------------------------------------------------------
# One walk of a register map, both ways: a loop to the values of its registers, and those to the plain data of a file.
# A register's path names its field in the schema: ``pv.filter`` is that field, ``pv.range.0`` the lower end of a
# pair. An enable bit follows from its value where the file does not give it: ``pv.filter_enabled`` is on when
# ``pv.filter`` is given, ``alarms.pv.enabled`` when anything of ``alarms.pv`` is. A value that is not given leaves
# its register at the schema's default, else at what the vendor's map says (``unset``), else at 0.
#
# On the way back a field is left out where its register holds just that, and its enable bit, if it has one, is off;
# the others stand in the order of the schema, which is that of a hand-written file. What a map cannot say (a pointer
# that is a loop's name, a time that is ``off``) is code of the vendor, which changes values on their way.

NO_VALUES: Mapping[str, Any] = MappingProxyType({})
ENABLE_KEY = "enabled"
"""How the key of an enable bit ends."""


class Field(NamedTuple):
    """A field of a model, and the section that it opens, if it does."""

    key: str
    section: type[Model] | None
    required: bool
    default: object


@cache
def model_fields(model: type[Model]) -> tuple[Field, ...]:
    """The fields of a model in their order."""
    return tuple(
        Field(
            key, _section_model(field.annotation), field.is_required(), None if field.is_required() else field.default
        )
        for key, field in model.model_fields.items()
    )


def _section_model(annotation: object) -> type[Model] | None:
    kinds = get_args(annotation) if get_origin(annotation) in {Union, UnionType} else (annotation,)
    return next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Model)), None)


@cache
def default_of(model: type[Model], path: str) -> Any:
    """What the schema takes for a field that is not given; None where it has no default."""
    section: type[Model] | None = model
    value: Any = None
    for step in parse_path(path):
        if section is None:
            return None if value is None else value[step]
        field = next(field for field in model_fields(section) if field.key == step)
        section, value = field.section, field.default
    return value


def values_of(loop: Model, tables: Iterable[RegisterMap], unset: Mapping[str, object] = NO_VALUES) -> Data:
    """The value of every register of a loop, by path; None where there is none."""
    return {path: _value_of_path(loop, path, unset) for table in tables for path in table.paths()}


def _value_of_path(loop: Model, path: str, unset: Mapping[str, object]) -> Any:
    if path.endswith(ENABLE_KEY):
        return is_enabled(loop, path)
    value = value_at(loop, parse_path(path))
    return _default_value(type(loop), path, unset) if value is None else value


def _default_value(model: type[Model], path: str, unset: Mapping[str, object]) -> Any:
    value = default_of(model, path)
    return unset.get(path) if value is None else value


def is_switched_on(bit: bool | None, *values: object) -> bool:  # noqa: FBT001 - a bit is what it is about
    """The state of an enable bit: as written, else on when any of its values is given."""
    return any(v is not None for v in values) if bit is None else bit


def is_enabled(loop: object, path: str) -> bool:
    """The state of an enable bit: as written, else on when its value, or anything of its section, is given."""
    *section_path, key = parse_path(path)
    bit = value_at(loop, (*section_path, key))
    if bit is not None:
        return bool(bit)
    if key != ENABLE_KEY:
        return value_at(loop, (*section_path, str(key).removesuffix(f"_{ENABLE_KEY}"))) is not None
    section = value_at(loop, section_path)
    return section is not None and any(value is not None for value in dict(section).values())


def defaults_of(model: type[Model], tables: Iterable[RegisterMap], unset: Mapping[str, object] = NO_VALUES) -> Data:
    """The value of every register by path for a loop whose file gives none."""
    return {path: _default_value(model, path, unset) for table in tables for path in table.paths()}


def file_data(
    model: type[Model],
    values: Mapping[str, object],
    unset: Mapping[str, Any] = NO_VALUES,
    always_written: frozenset[str] = frozenset(),
    prefix: str = "",
) -> Data:
    """The section of a file that gives these values, in the order of its schema.

    ``values`` are by path, of registers and of what no register holds. Required fields are always given, and those
    named in ``always_written``; others if they differ from ``unset``, or from the schema's default where that says
    nothing. A section that has a value of its own is not walked; where that is None it is left out.
    """
    data: Data = {}
    for part in model_fields(model):
        path = prefix + part.key
        if part.section is not None and path not in values:
            section = file_data(part.section, values, unset, always_written, f"{path}.")
            data |= {part.key: section} if section else {}
        elif part.key.endswith(ENABLE_KEY):
            has_value = data if part.key == ENABLE_KEY else part.key.removesuffix(f"_{ENABLE_KEY}") in data
            if has_value and not values[path]:
                data[part.key] = False
        elif (
            part.required
            or path in always_written
            or _is_switched_on(values, path, prefix)
            or _is_different(part, path, values, unset)
        ):
            data |= without_none({part.key: file_value(_value_or_pair(values, path))})
    return data


def _is_switched_on(values: Mapping[str, object], path: str, prefix: str) -> bool:
    """Whether the enable bit of a field, or of all of its section, is on."""
    return bool(values.get(f"{path}_{ENABLE_KEY}") or values.get(prefix + ENABLE_KEY))


def _is_different(field: Field, path: str, values: Mapping[str, object], unset: Mapping[str, object]) -> bool:
    absent = _value_or_pair(unset, path)
    return bool(_value_or_pair(values, path) != (field.default if absent is None else absent))


def _value_or_pair(values: Mapping[str, object], path: str) -> Any:
    """A value, or both ends of a pair."""
    low, high = f"{path}.0", f"{path}.1"
    return (values[low], values[high]) if low in values else values.get(path)


# --- What no register holds of a loop and stands beside the registers in a listing, or is said by options -------------

S = TypeVar("S", bound=BaseModel)


class RefusedError(DecodeError):
    """Settings that a schema refuses: ``where`` they stand, and the ``path`` in them of what is wrong."""

    def __init__(self, message: str, where: str, path: Sequence[str | int]) -> None:
        super().__init__(message)
        self.where = where
        self.path = tuple(path)


def default_name(index: int) -> str:
    """What a loop is called whose listing does not say its name, counted from 0."""
    return f"LOOP-{index + 1}"


def read_settings(model: type[S], entry: Mapping[str, object], place: str) -> S:
    """Settings from beside the words, as strictly as from a file; raises `RefusedError`."""
    try:
        return model.model_validate(entry)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise RefusedError(f"{place}: {dotted_text(first['loc'])}: {first['msg']}", place, first["loc"]) from None


class LoopOption(NamedTuple):
    """An option for what a listing may lack, one text a loop: the key in the settings, the option, what it says."""

    path: tuple[str, ...]
    option: str
    title: str
    needed: bool = True


def with_options(
    settings: Sequence[Mapping[str, object]],
    options: Settings,
    rows: Sequence[LoopOption],
    name: Callable[[int], str] = default_name,
) -> list[Data]:
    """The settings of each loop with what options say; what neither says and is needed is asked for.

    The number of loops is that of the settings, or of the longest option; an option that is shorter than that speaks
    of no loop in particular, and is refused unless it says one thing for all.
    """
    count = len(settings) or max((len(options.get(row.option) or ()) for row in rows), default=0)
    loops = [deepcopy(dict(settings[i])) if settings else {"loop": name(i)} for i in range(count)]
    for row in rows:
        texts = options.get(row.option)
        if texts is not None and len(texts) not in {1, count}:
            flag = row.option.replace("_", "-")
            raise DecodeError(f"--{flag} names {len(texts)} for {count} loops; give one for each, with commas between")
        for i, loop in enumerate(loops):
            if texts is not None:
                set_value(loop, row.path, texts[0] if len(texts) == 1 else texts[i])
    if not loops:
        raise _missing_error(rows[0], "")
    for loop in loops:
        for row in rows:
            if row.needed and not has_key(loop, row.path):
                raise _missing_error(row, f" of {loop.get('loop', 'a loop')}")
    return loops


def _missing_error(row: LoopOption, owner: str) -> DecodeError:
    subject, comma, reason = row.title.partition(", ")
    return DecodeError(
        f"the listing does not say {subject}{owner}{comma}{reason}; give --{row.option.replace('_', '-')}"
    )


def settings_of(
    model: type[Model], loop: Any, banks: Mapping[str, str] = NO_VALUES, explicit: frozenset[str] = frozenset()
) -> Data:
    """What no register of a loop holds: the fields that ``model`` has of it, as far as they are given.

    ``banks``: prefixes of the addresses at which its blocks begin; ``explicit``: fields whose absence says something.
    """
    entry = {"loop": loop.name, **_section_settings(model, loop, explicit, "")}
    return entry | {key: f"{prefix}{entry[key]}" for key, prefix in banks.items()}


def _section_settings(model: type[Model], section: object, explicit: frozenset[str], prefix: str) -> Data:
    data: Data = {}
    for part in model_fields(model):
        path, value = prefix + part.key, getattr(section, part.key, None)
        if part.section is not None and value is not None:
            value = _section_settings(part.section, value, explicit, f"{path}.") or None
        elif isinstance(value, Model):  # a switch for a section: false where the file leaves its value to the operator
            value = False if value_at(value, ("value",)) is None else None
        is_default = value is None or (isinstance(value, bool) and value == part.default)
        if path in explicit or not is_default:
            data[part.key] = file_value(value)
    return data


def settings_values(settings: Any, banks: Mapping[str, str] = NO_VALUES) -> Data:
    """What stands beside the registers of a loop as values of its fields, by path."""
    values = {dotted_text(path): value for path, value in given_fields(settings)}
    del values["loop"]
    values.pop("setpoint", None)
    return {"name": settings.loop, **values, **{key: f"{prefix}{values[key]}" for key, prefix in banks.items()}}


# --- The blocks of registers of a loop in a listing, on their way back to a configuration -----------------------------


class NoValueError(DecodeError):
    """A register of a listing whose content is no value of its format; ``place`` is its address."""


@frozen
class LoopBlock:
    """One block of a loop in a listing: its raw registers by name, and the values of its settings by path."""

    loop: str
    space: Space
    start: int
    table: RegisterMap
    raw: tuple[int, ...]

    def raw_word(self, name: str) -> int:
        """A register as it is."""
        return self.raw[self.table.offset_of(name)]

    def address(self, name: str) -> str:
        """Where a register is."""
        return self.space.name(self.start + self.table.offset_of(name))

    def read_values(self, scales: Mapping[str, Scale]) -> Data:
        """Values by path; a register that is no value is named with its address."""
        try:
            return self.table.decode(self.raw, scales)
        except DecodeError as error:
            raise self._at_address(error) from None

    def read_choices(self) -> Data:
        """The choices inside bit words alone, by path; they decide the scales of the words."""
        try:
            return self.table.decode_bits(self.raw)
        except DecodeError as error:
            raise self._at_address(error) from None

    def _at_address(self, error: DecodeError) -> NoValueError:
        address = self.start + (error.address or 0)
        return NoValueError(f"{self.loop}, {self.space.name(address)}: {error}", address)

    def note_omitted(self, noted_names: Collection[str] = ()) -> Iterator[str]:
        """Says what is not carried over: momentary requests, what the controller writes, reserved registers.

        ``noted_names``: registers of which another note speaks.
        """
        for row in self.table.words:
            if row.path is None and self.raw[row.offset] and row.name not in noted_names:
                address = self.start + row.offset
                value = self.space.kind_of(address).text(self.raw[row.offset])
                yield f"{self.loop}: {self.space.name(address)} = {value} ({row.title}) is not carried over"


def read_loops(
    model: type[S],
    settings: Sequence[Mapping[str, object]],
    words: Mapping[int, int],
    space: Space,
    blocks: Mapping[str, tuple[str, RegisterMap]],
) -> Iterator[tuple[Any, list[LoopBlock]]]:
    """The settings of each loop as ``model`` says, and its blocks, whose addresses stand among them."""
    for i, entry in enumerate(settings):
        loop: Any = read_settings(model, entry, f"settings[{i}]")
        yield (
            loop,
            [
                loop_block(words, space, space.number_of(prefix, getattr(loop, key)), table, loop.loop)
                for key, (prefix, table) in blocks.items()
            ],
        )


def loop_block(words: Mapping[int, int], space: Space, start: int, table: RegisterMap, loop: str) -> LoopBlock:
    """A loop's block at ``start``; settings must be there, what the controller writes may be missing."""
    missing = next((w for w in table.words if w.access == "setting" and start + w.offset not in words), None)
    if missing is not None:
        name = space.name(start + missing.offset)
        raise DecodeError(f"the listing does not hold {name} ({missing.title}) of {loop}")
    return LoopBlock(loop, space, start, table, tuple(words.get(start + n, 0) for n in range(table.size)))
