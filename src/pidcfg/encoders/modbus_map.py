"""The Modbus map of a PLC that the user states: its rows, what they stand for, and a map ready to be filled in."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import count
from typing import Any, Literal, NamedTuple, cast

from pidcfg.encoders.codecs import WORD_MAX
from pidcfg.encoders.image import Cell, Image
from pidcfg.encoders.listing import (
    COMMENT_STARTS,
    FIRST_REFERENCE,
    MAX_FIVE_DIGIT_REGISTER,
    FileKind,
    Listing,
    ListingError,
    Place,
    Table,
    find_delimiter,
    reference,
)
from pidcfg.encoders.parameters import Content, Program, raw_of, types_of
from pidcfg.encoders.regmap import BIT, SINGLE, WORD, Kind, Space
from pidcfg.schemas.iec import IecType, Wire
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.text.signs import closest_name

# --- The rows of a Modbus map that the user states: a symbol of the PLC, and where a client finds it ------------------
#
# Rows without a header, or below ``symbol,table,register,type,order,comment`` in any order of the columns::
#
# R100,holding,99,uint16 S100,coil,99,bool M10,holding,40.3,bool DF1,holding,0,float32,high-first
# PRG.TIC_1.Kp,holding,1000,float32 TIC_1.Direct,none
#
# Registers count from 0. What a symbol is, and which types fit it, is looked at further down.

D890 = Decision(
    890,
    "a register of a map counts from 0, and one that looks like a reference is refused",
    "`holding,0` is what references call 40001. In the tables holding, input and discrete a number from 40001, 30001 "
    "or 10001 up to the end of the five-digit references is refused with both readings, and so is one with a leading "
    "zero; `0x9C41` says that the number is meant as it stands.",
    "Panels print references and drivers want numbers: whoever takes one for the other reads a register that is "
    "another one's.",
)
D891 = Decision(
    891,
    "without an order the low word comes first",
    "Of the two registers of a 32-bit value the one with the lower number holds the low word, unless the row says "
    "high-first.",
    "So do a CLICK and the double words of a Delta AS: D500 is the low word, D501 the high one.",
)
HEADER = ("symbol", "table", "register", "type", "order", "comment")
REGISTER_ORDERS = {"low-first": False, "high-first": True}
TYPE_WIDTHS = {"bool": 1, "int16": 1, "uint16": 1, "int32": 2, "uint32": 2, "float32": 2}
"""Registers, or coils, that a value of a type takes."""
MODBUS_TABLES: tuple[Table, ...] = ("coil", "discrete", "holding", "input")
BIT_TABLES = frozenset({"coil", "discrete"})
"""Tables of single bits."""
NO_TABLE: Literal["none"] = "none"
"""In place of a table: no register has it."""
LAST_BIT = 15
REGISTER_PATTERN = re.compile(r"(?P<number>0[xX][0-9A-Fa-f]{1,4}|[0-9]{1,6})(?:\.(?P<bit>[0-9]{1,2}))?")


class MapError(ListingError):
    """A map that cannot be used, with line and column of the fault."""


class UnusableMapError(ValueError):
    """A map that is missing or cannot be used: file, line and column, and what to do."""

    def __init__(self, message: str, name: str = "", line: int = 1, column: int = 1) -> None:
        super().__init__(f"{name}:{line}:{column}: {message}" if name else message)
        self.message = message
        self.name, self.line, self.column = name, line, column


class Row(NamedTuple):
    """A row: where a symbol is, and, of a vendor with banks, those behind it."""

    symbol: str
    table: Table | Literal["none"]
    line: int
    columns: Mapping[str, int]
    """Where its cells begin, counted from 1."""
    register: int = 0
    type: str = ""
    bit: int | None = None
    """Of a switch in a register: the bit, 0 to 15."""
    high_first: bool = False

    @property
    def bit_number(self) -> int:
        """The place of a switch as a number of bits."""
        return self.register * (LAST_BIT + 1) + (self.bit or 0)

    def place(self, steps: int) -> Place:
        """Where the symbol is that is ``steps`` registers, or switches, behind that of the row.

        Raises `LookupError` beyond the last register.
        """
        width = TYPE_WIDTHS[self.type]
        if self.bit is None:
            register, bit = self.register + steps, None
        else:
            register, bit = divmod(self.bit_number + steps, LAST_BIT + 1)
        if register + width - 1 > WORD_MAX:
            raise LookupError(f"{register}, beyond the last register, {WORD_MAX}")
        return Place(cast("Table", self.table), register, width, self.high_first, bit)

    def error_in(self, cell: str, message: str) -> MapError:
        """The error of one of its cells."""
        return MapError(message, self.line, self.columns[cell])


def place_text(place: Place) -> str:
    """A place as messages name it, with the reference that counts from 1: ``holding 99 (40100)``."""
    bit = "" if place.bit is None else f".{place.bit}"
    return f"{place.table} {place.register}{bit} ({reference(place.table, place.register)}{bit})"


def read_map_rows(text: str) -> list[Row]:
    """The rows of a map; raises `MapError`."""
    text = text.removeprefix("\ufeff")
    separator, rows = find_delimiter(text), list[Row]()
    header: tuple[str, ...] = HEADER
    is_first = True
    for line, content in enumerate(text.splitlines(), start=1):
        if not content.strip(f" \t{separator}") or content.lstrip().startswith(COMMENT_STARTS):
            continue
        cells = list(_split_cells(content, separator, line))
        if is_first and _is_header({text.lower() for text, _ in cells}):
            header = _read_header(cells, line)
        else:
            rows.append(_read_row(cells, header, line))
        is_first = False
    if not rows:
        raise MapError("the map has no row; write one like R100,holding,99,uint16")
    return rows


def _is_header(names: set[str]) -> bool:
    """Whether the first line names the columns: the symbol's, or, where that has another name, two of the others."""
    return HEADER[0] in names or len(names & {*HEADER[1:]}) > 1


def _split_cells(content: str, separator: str, line: int) -> Iterator[tuple[str, int]]:
    """The cells of a line, each with its column."""
    end = re.escape(separator)
    cell = re.compile(rf'[ ]*(?P<text>"(?:[^"]|"")*" *|[^"{end}][^{end}]*|)(?P<end>{end}|$)')
    position = 0
    while (match := cell.match(content, position)) is not None:
        text = match["text"].strip()
        yield text[1:-1].replace('""', '"').strip() if text.startswith('"') else text, match.start("text") + 1
        position = match.end()
        if not match["end"]:
            return
    raise MapError("a cell ends behind a quotation mark: remove the mark", line, position + 1)


def _read_header(cells: list[tuple[str, int]], line: int) -> tuple[str, ...]:
    names = [text.lower() for text, _ in cells]
    while names and not names[-1]:
        names.pop()
    for name, (text, column) in zip(names, cells, strict=False):
        if name not in HEADER:
            raise MapError(f"{text!r} is none of the columns {', '.join(HEADER)}", line, column)
        if names.count(name) > 1:
            raise MapError(f"the column {name} stands here twice", line, column)
    missing = [name for name in HEADER[:4] if name not in names]
    if missing:
        raise MapError(f"the header has no column {missing[0]}", line)
    return tuple(names)


def _read_row(cells: list[tuple[str, int]], header: tuple[str, ...], line: int) -> Row:
    while cells and not cells[-1][0]:
        cells.pop()
    if len(cells) > len(header):
        raise MapError(f"{len(cells)} cells; a row has at most {','.join(header)}", line, cells[len(header)][1])
    texts = dict(zip(header, (text for text, _ in cells), strict=False))
    columns = dict(zip(header, (column for _, column in cells), strict=False))
    end = cells[-1][1] + len(cells[-1][0]) + 1
    row = Row(texts.get("symbol", ""), NO_TABLE, line=line, columns={**dict.fromkeys(header, end), **columns})
    if not row.symbol:
        raise row.error_in("symbol", "the row names no symbol")
    table = texts.get("table", "").lower()
    if table == NO_TABLE:
        if any(texts.get(key) for key in ("register", "type", "order")):
            raise row.error_in("table", f"{row.symbol} is in no table, but the row says more")
        return row
    if table not in MODBUS_TABLES:
        advice = f"write {', '.join(MODBUS_TABLES)}, or {NO_TABLE} where no register has {row.symbol}"
        raise row.error_in("table", f"{texts.get('table', '')!r} is no table; {advice}")
    table_name = next(name for name in MODBUS_TABLES if name == table)
    row = row._replace(table=table_name)
    row = row._replace(type=_read_type(row, texts.get("type", "")))
    row = _with_register(row, table_name, texts.get("register", ""))
    return row._replace(high_first=_read_order(row, texts.get("order", "")))


def _read_type(row: Row, text: str) -> str:
    kind = text.lower()
    if kind not in TYPE_WIDTHS:
        near = closest_name(kind, TYPE_WIDTHS)
        cure = f"did you mean {near}?" if near else f"write one of {', '.join(TYPE_WIDTHS)}"
        raise row.error_in("type", f"{text!r} is no type; {cure}" if text else f"the type is missing; {cure}")
    if (kind == "bool") < (row.table in BIT_TABLES):
        raise row.error_in("type", f"a {row.table} holds a bool, not {kind}")
    return kind


def _with_register(row: Row, table: Table, text: str) -> Row:
    if not text:
        first = f"{table} 0 is what references call {reference(table, 0)}"
        raise row.error_in("register", f"the register of {row.symbol} is missing; write its number from 0 on: {first}")
    match = REGISTER_PATTERN.fullmatch(text)
    if match is None:
        raise row.error_in("register", f"{text!r} is no register; write 0 to {WORD_MAX}, of a bit such as 100.3")
    number = int(match["number"], 16 if match["number"][:2].lower() == "0x" else 10)
    _refuse_reference(row, table, match["number"], number)
    if number + TYPE_WIDTHS[row.type] - 1 > WORD_MAX:
        raise row.error_in(
            "register", f"{row.symbol} would end at {number + TYPE_WIDTHS[row.type] - 1}, beyond {WORD_MAX}"
        )
    bit = None if match["bit"] is None else int(match["bit"])
    if (bit is not None) != (row.type == "bool" and row.table not in BIT_TABLES):
        if bit is None:
            cure = f"say its bit, such as {text}.0, or take a coil or discrete"
            raise row.error_in("register", f"a {row.table} register has 16 switches: {cure}")
        raise row.error_in("register", f"{text!r} is a bit, and {row.symbol} a {row.type} of {row.table}")
    if bit is not None and bit > LAST_BIT:
        raise row.error_in("register", f"{text!r}: the bits of a register are 0 to {LAST_BIT}")
    return row._replace(register=number, bit=bit)


def _refuse_reference(row: Row, table: Table, text: str, number: int) -> None:
    """Refuses what two people read differently (D890)."""
    five_digit, six_digit = FIRST_REFERENCE[table]
    if len(text) > 1 and text[0] == "0" and text[1] not in "xX":
        meant = f"{number} or {number - 1}" if number else "0"
        raise row.error_in("register", f"{text} may be a number or a reference; write {meant}")
    first = next((n for n in (five_digit, six_digit) if n > 1 and n <= number < n + MAX_FIVE_DIGIT_REGISTER), None)
    if first is not None and text[1] not in "xX":
        other = f", or 0x{number:X} if {number} itself is meant" if number <= WORD_MAX else ""
        advice = f"{number} is how references call {table} {number - first}; write {number - first}{other}"
        raise row.error_in("register", advice)


def _read_order(row: Row, text: str) -> bool:
    if text and TYPE_WIDTHS[row.type] == 1:
        raise row.error_in("order", f"{row.symbol} is in one place and has no order; leave {text!r} out")
    if text and text.lower() not in REGISTER_ORDERS:
        raise row.error_in("order", f"{text!r} is no order; write {' or '.join(REGISTER_ORDERS)}")
    return REGISTER_ORDERS.get(text.lower(), False)


# --- A stated Modbus map of a vendor with banks of registers (`pidcfg.encoders.modbus_map` reads its rows) ------------
#
# A row is for its register and those that follow it in the bank, up to the next row.

D875 = Decision(
    875,
    "a Modbus map is the user's where the manual has none",
    "The manuals of EZLogix, DPIDE and NextoPID print no Modbus numbers, and none is made up: `--map FILE`, or `plc: "
    "{map: FILE}` in the configuration, says them row by row. A row of a bank counts for its register and those behind "
    "it, up to the next row; a map may also be stated for a PLC that has one of its own, such as one behind a gateway.",
    "A register that is guessed is somebody else's number.",
)
D894 = Decision(
    894,
    "no map comes ready-made",
    "There is none for EZLogix, DPIDE or NextoPID: `encode --format modbus-map` writes one without registers, and the "
    "user fills them in from the project of the PLC.",
    "For an EZLogix no public table of Modbus numbers was found. Of a Delta AS the appendix with functions and counts "
    "was (D895), its table of addresses was not; that of the older DVP is another. On a Nexto the project chooses "
    "them: its user manual (Modbus mappings) has a start address for each variable, counted from 1.",
)


@frozen
class StatedNumbering:
    """The rows of a map by the plain numbers at which they begin; a `pidcfg.encoders.listing.Numbering`."""

    space: Space
    rows: tuple[tuple[int, Row], ...]
    """In the order of the numbers."""

    def covering_row(self, number: int) -> tuple[int, Row] | None:
        """The row that an address is covered by, and where that begins."""
        found = next((entry for entry in reversed(self.rows) if entry[0] <= number), None)
        return found if found is not None and self.space.same_bank(found[0], number) else None

    def place(self, number: int) -> Place:
        """Where an address is; raises `LookupError` where no row says it."""
        entry = self.covering_row(number)
        if entry is None:
            bank, _ = self.space.bank_and_number(number)
            line = example_row(bank.address_name(bank.first), bank.kind)
            raise LookupError(f"no row of the map says where {self.space.name(number)} is; add one like {line}")
        start, row = entry
        try:
            return row.place((number - start) * TYPE_WIDTHS[row.type])
        except LookupError as error:
            raise LookupError(f"by line {row.line} of the map {self.space.name(number)} is at {error}") from None

    def find(self, table: str, register: int) -> tuple[int, int] | None:
        """The address that a register belongs to, and which of its registers it is."""
        for start, row in sorted(self.rows, key=lambda entry: entry[1].register, reverse=True):
            n, part = divmod(register - row.register, TYPE_WIDTHS[row.type])
            number = start + n
            if row.table == table and row.bit is None and self.covering_row(number) == (start, row):
                width = TYPE_WIDTHS[row.type]
                return number, width - 1 - part if row.high_first else part
        return None

    def check_places(self, image: Image) -> None:
        """Raises `MapError` where a register of the loops has no place, or the place of another one."""
        numbers_by_bit: dict[tuple[str, int, int], int] = {}
        for cell in image.cells:
            try:
                place = self.place(cell.number)
            except LookupError as error:
                entry = self.covering_row(cell.number)
                line = max(row.line for _, row in self.rows) if entry is None else entry[1].line
                owner = f" ({cell.field} of {cell.loop})" if cell.loop else ""
                raise MapError(f"{cell.address}{owner}: {error}", line) from None
            for bit in bits_of_place(place):
                other = numbers_by_bit.setdefault(bit, cell.number)
                if other != cell.number:
                    raise self._overlap_error(other, cell.number, place)

    def _overlap_error(self, first: int, second: int, place: Place) -> MapError:
        rows = [row for entry in map(self.covering_row, (first, second)) if entry is not None for row in (entry[1],)]
        last = max(rows, key=lambda row: row.line)
        lines = " and ".join(str(row.line) for row in sorted(rows, key=lambda row: row.line))
        problem = (
            f"{self.space.name(first)} and {self.space.name(second)} are both at {place_text(place)} by lines {lines}"
        )
        return last.error_in("register", f"{problem}; each needs a place of its own")


def bits_of_place(place: Place) -> Iterable[tuple[str, int, int]]:
    """Every single bit that a place takes: table, register, bit."""
    bits = range(LAST_BIT + 1) if place.bit is None else (place.bit,)
    return [(place.table, place.register + part, bit) for part in range(place.width) for bit in bits]


def read_map(text: str, space: Space) -> StatedNumbering:
    """A map as text; raises `MapError` with the place of what cannot be read."""
    rows: dict[int, Row] = {}
    for row in read_map_rows(text):
        start = _start_number(row, space)
        if start in rows:
            raise row.error_in("symbol", f"{row.symbol} stands here again; first in line {rows[start].line}")
        rows[start] = row
    return StatedNumbering(space, tuple(sorted(rows.items())))


def _start_number(row: Row, space: Space) -> int:
    start = space.parse(row.symbol.upper())
    if start is None:
        banks = ", ".join(f"{bank.address_name(bank.first)} to {bank.address_name(bank.last)}" for bank in space.banks)
        raise row.error_in("symbol", f"{row.symbol!r} is no register of this vendor, which has {banks}")
    if row.table == NO_TABLE:
        raise row.error_in(
            "table", f"the registers of a block follow each other: {row.symbol} cannot be without a table"
        )
    types = map_types_of(space.kind_of(start))
    if row.type not in types:
        raise row.error_in(
            "type", f"{row.symbol} holds {space.kind_of(start).holds}: {' or '.join(types)}, not {row.type}"
        )
    return start


def example_row(symbol: str, kind: Kind) -> str:
    """A row for a register."""
    return f"{symbol},{'coil' if kind is BIT else 'holding'},0,{map_types_of(kind)[0]}"


def map_types_of(kind: Kind) -> Sequence[str]:
    """The types that a register may have in a map, the usual one first."""
    if kind is BIT:
        return ("bool",)
    return ("float32",) if kind is SINGLE else ("uint16", "int16")


# --- A stated Modbus map of a vendor whose parameters have names (`pidcfg.encoders.modbus_map` reads its rows) --------
#
# A row is for one parameter by its name, with whatever stands before it in the program (``PRG.TIC_1.Kp``), or, where
# the vendor has devices, for a device and those of its type behind it (``D0``, ``M0``).

D893 = Decision(
    893,
    "a map covers every setting of its loops, or says that no register has it",
    "A parameter with a value in the file that stands in the PLC's memory needs a row; `NAME,none` says that no "
    "register has it, and a note repeats that it was not compared. What is wired, a literal of the program without a "
    "device, an input of a function, and what runs need none.",
    "A comparison that leaves out a setting in silence calls two different PLCs alike.",
)
MAX_NAMES_SHOWN = 5


class Point(NamedTuple):
    """A parameter that the memory of a PLC may hold."""

    name: str
    type: IecType
    loop: str | None = None
    needed: bool = False
    """A map must say where it is, or that it is nowhere."""
    literal: bool = False
    """A setting that stands in the program, unless a row says where else."""
    device: str = ""
    """Where it stands in the PLC, for vendors with devices."""


Device = tuple[str, int]
"""A bank, and the number in it."""


@frozen
class Symbols:
    """What the rows of a vendor's map may name."""

    title: str
    """A parameter, ``an operand of DPIDE``."""
    points: Mapping[str, Point]
    """The parameters of a program, by name."""
    parameters: frozenset[str]
    """The names of all parameters that the vendor has: those of loops in other files are passed over."""
    device: Callable[[str], Device | None] = lambda _text: None
    """A device's bank, and its number there; None: it is none."""

    def find_point(self, symbol: str) -> Point | None:
        """The parameter that a symbol ends with."""
        parts = symbol.split(".")
        ends = (".".join(parts[i:]) for i in range(len(parts)))
        return next((self.points[end] for end in ends if end in self.points), None)

    def is_foreign(self, symbol: str) -> bool:
        """Whether a symbol is a parameter of another loop."""
        parts = symbol.split(".")
        return any(".".join(parts[i:]) in self.parameters for i in range(1, len(parts)))


@frozen
class NamedNumbering:
    """Where a client finds the parameters of one program, by their names."""

    points: Mapping[str, Point]
    places: Mapping[str, Place]
    unmapped: tuple[str, ...] = ()
    """Parameters that no register has, by the map."""
    literals: tuple[str, ...] = ()
    """Settings that stand in the program, and in no register."""

    def place(self, name: str) -> Place:
        """Where a parameter is; raises `LookupError` where no row says it."""
        if name not in self.places:
            raise LookupError(f"no row of the map says where {name} is")
        return self.places[name]

    def cells(self, program: Program) -> Iterator[tuple[Cell, Place]]:
        """The contents of a program as registers hold them."""
        for number, entry in enumerate(program.cells):
            place = self.places.get(entry.address)
            if place is None or isinstance(entry.raw, Wire):
                continue
            kind = BIT if entry.type.kind == "bool" else WORD if place.width == 1 else SINGLE
            yield Cell(entry.address, number, raw_of(entry.type, entry.raw), entry.field, entry.loop, kind), place


def read_symbol_map(text: str, symbols: Symbols) -> NamedNumbering:
    """A map as text for one program; raises `MapError` with the place of what cannot be read, or is missing."""
    rows = read_map_rows(text)
    point_rows: dict[str, Row] = {}
    device_rows: list[tuple[Device, Row]] = []
    for row in rows:
        device = symbols.device(row.symbol)
        point = symbols.find_point(row.symbol)
        if device is not None and point is None:
            same = [other for start, other in device_rows if start == device]
            _refuse_repeated(row, [other for other in same if other.type == row.type])
            _refuse_second_place(row, same)
            device_rows.append((device, _check_device_row(row, symbols)))
        elif point is not None:
            _refuse_repeated(row, [point_rows[point.name]] if point.name in point_rows else [])
            point_rows[point.name] = _check_point_row(row, point)
        elif not symbols.is_foreign(row.symbol):
            near = closest_name(row.symbol, symbols.points)
            cure = f"did you mean {near}?" if near else "write the name of a parameter"
            raise row.error_in("symbol", f"{row.symbol!r} is not {symbols.title}; {cure}")
    return _make_numbering(symbols, point_rows, device_rows, rows[-1].line)


def _refuse_repeated(row: Row, others: list[Row]) -> None:
    if others:
        raise row.error_in("symbol", f"{row.symbol} stands here again; first in line {others[0].line}")


def _refuse_second_place(row: Row, others: list[Row]) -> None:
    """A device is in one place, whatever the type of what stands there."""
    place_of_row = (row.table, row.register, row.bit)
    for other in others:
        if (other.table, other.register, other.bit) != place_of_row:
            place = f"{other.table} {other.register}"
            raise row.error_in("register", f"{row.symbol} is at {place} by line {other.line}, and cannot be elsewhere")


def _check_point_row(row: Row, point: Point) -> Row:
    types = types_of(point.type)
    if row.table != NO_TABLE and row.type not in types:
        expected = f"{' or '.join(types)}, not {row.type}" if types else "no type of a map fits it"
        raise row.error_in("type", f"{point.name} is {point.type.name}: {expected}")
    return row


def _check_device_row(row: Row, symbols: Symbols) -> Row:
    points = [point for point in symbols.points.values() if point.device == row.symbol]
    if row.table == NO_TABLE:
        cure = f"; write {points[0].name},{NO_TABLE}" if points else ""
        raise row.error_in("table", f"{row.symbol} begins a bank{cure}")
    for point in points:
        if row.type not in types_of(point.type):
            expected = " or ".join(types_of(point.type))
            message = f"{row.symbol} is {point.name} of type {point.type.name}: {expected}, not {row.type}"
            raise row.error_in("type", message)
    return row


def _make_numbering(
    symbols: Symbols, point_rows: Mapping[str, Row], device_rows: list[tuple[Device, Row]], last_line: int
) -> NamedNumbering:
    """The places of all parameters that rows cover; what is missing, or stands twice, is refused."""
    places: dict[str, Place] = {}
    lines: dict[str, Row] = {}
    for point in symbols.points.values():
        row, steps = point_rows.get(point.name), 0
        device = symbols.device(point.device)
        if row is None and device is not None:
            start, row = _bank_row(point, device, device_rows)
            steps = device[1] - start
        if row is None or row.table == NO_TABLE:
            continue
        try:
            places[point.name] = row.place(steps)
        except LookupError as error:
            raise row.error_in("register", f"{_point_name(point)} would be at {error}") from None
        lines[point.name] = row
    unmapped = tuple(name for name, row in point_rows.items() if row.table == NO_TABLE)
    missing = [p for p in symbols.points.values() if p.needed and p.name not in places and p.name not in unmapped]
    if missing:
        raise MapError(_missing_rows_text(missing), last_line)
    _refuse_overlaps(symbols, places, lines)
    literals = (point.name for point in symbols.points.values() if point.literal and point.name not in places)
    return NamedNumbering(symbols.points, places, unmapped, tuple(name for name in literals if name not in unmapped))


def _bank_row(point: Point, device: Device, device_rows: list[tuple[Device, Row]]) -> tuple[int, Row | None]:
    """The row that a device is behind, of its bank and its type: the nearest one."""
    bank, number = device
    candidates = [
        (start, row)
        for (bank_name, start), row in device_rows
        if bank_name == bank and start <= number and row.type in types_of(point.type)
    ]
    return max(candidates, key=lambda entry: entry[0], default=(0, None))


def _point_name(point: Point) -> str:
    return f"{point.device} ({point.name})" if point.device else point.name


def _missing_rows_text(missing: list[Point]) -> str:
    names = ", ".join(_point_name(point) for point in missing[:MAX_NAMES_SHOWN])
    rest_text = f" and {len(missing) - MAX_NAMES_SHOWN} more" if len(missing) > MAX_NAMES_SHOWN else ""
    line = row_text(missing[0], register="REGISTER")
    return (
        f"no row says where {names}{rest_text} is; add {line}, or {missing[0].name},{NO_TABLE} where no register has it"
    )


def _refuse_overlaps(symbols: Symbols, places: Mapping[str, Place], lines: Mapping[str, Row]) -> None:
    names_by_bit: dict[tuple[str, int, int], str] = {}
    for name, place in places.items():
        for bit in bits_of_place(place):
            other = names_by_bit.setdefault(bit, name)
            first, second = symbols.points[other], symbols.points[name]
            if other != name and not (first.device and first.device == second.device):
                rows = sorted((lines[other], lines[name]), key=lambda row: row.line)
                message = f"{_point_name(first)} and {_point_name(second)} are both at {place_text(place)}"
                by = f"by lines {rows[0].line} and {rows[1].line}"
                raise rows[1].error_in("register", f"{message} {by}; each needs a place of its own")


def row_text(point: Point, register: str = "", symbol: str = "") -> str:
    """A row of a map for a parameter; without ``register`` it is left to the user."""
    kind = types_of(point.type)[0]
    table = "coil" if kind == "bool" else "holding"
    order = ",low-first" if kind in {"float32", "int32", "uint32"} else ""
    return f"{symbol or point.device or point.name},{table},{register},{kind}{order}"


def with_contents(program: Program, contents: Mapping[str, Content]) -> Program:
    """A program with other contents of some of its parameters."""
    cells = (cell._replace(raw=contents.get(cell.address, cell.raw)) for cell in program.cells)
    return replace(program, cells=tuple(cells))


# --- A Modbus map that is ready to be filled in: a row for everything that it must cover, without the registers -------

FORMAT_NAME = "modbus-map"
COLUMNS = ",".join(HEADER[:5])
Rows = list[str]
"""Rows of a map; those that begin with ``#`` are offered and not needed."""
EXAMPLE_ROWS = 3
"""Rows of an example in a message."""


def map_kind(rows: Callable[[Any], Rows]) -> FileKind:
    """The format ``modbus-map`` of a vendor."""
    title = "Modbus map to be filled in (CSV)"
    return FileKind(
        FORMAT_NAME, title, lambda image, _: _map_text(rows(image)), _refuse_reading, lambda _: False, is_complete=False
    )


def _refuse_reading(_text: str) -> Listing:
    raise ListingError("a map says where registers are, not what they hold; name it with --map")


def _map_text(rows: Iterable[str]) -> str:
    firsts = ", ".join(f"{table} 0 is {reference(table, 0)}" for table in reversed(MODBUS_TABLES))
    lines = [
        "# Write the register of each row behind its table, counted from 0:",
        f"# {firsts}. A switch in a register has its bit behind a point: holding,40.3.",
        COLUMNS,
        *rows,
    ]
    return "".join(f"{line}\n" for line in lines)


def bank_template_rows(space: Space, offered_space: Space) -> Rows:
    """A row a bank, which counts for all registers behind its own; ``offered_space``: with tags that a trend wants."""
    rows = [
        f"{bank.address_name(bank.first)},{'coil' if bank.kind is BIT else 'holding'},,{map_types_of(bank.kind)[0]}"
        for bank in offered_space.banks
    ]
    needed_count = len(space.banks)
    return [*rows[:needed_count], *(f"# {row}" for row in rows[needed_count:])]


def symbol_template_rows(symbols: Symbols, offered_names: Iterable[str] = (), prefix: str = "") -> Rows:
    """A row a parameter, of devices one a bank and type.

    ``offered_names``: names of parameters that no map has to cover, but that a trend or an operator wants.
    """
    rows: dict[str, None] = {}
    points = symbols.points.values()
    for point in points:
        if point.needed:
            rows[_template_row(symbols, point, prefix)] = None
    wanted = set(offered_names)
    offered_points = (p for p in points if not p.needed and p.name.removeprefix(f"{p.loop}.") in wanted and p.loop)
    others = dict.fromkeys(_template_row(symbols, point, prefix) for point in offered_points)
    return [*rows, *(f"# {row}" for row in others if row not in rows)]


def _template_row(symbols: Symbols, point: Point, prefix: str) -> str:
    device = symbols.device(point.device)
    if device is None:
        return row_text(point, symbol=f"{prefix}{point.name}")
    bank, _ = device
    return row_text(point, symbol=f"{bank}0" if not bank.endswith(".") else f"{bank[:-1]}0.0")


def fill_rows(rows: Iterable[str]) -> Iterator[str]:
    """Rows as an example, with registers one after the other; a device is in one place by all its rows."""
    numbers: Mapping[str, Iterator[int]] = {table: count(0, 2 if table == "holding" else 1) for table in MODBUS_TABLES}
    places: dict[tuple[str, str], int] = {}
    for row in rows:
        if not row.startswith("#"):
            symbol, table, _, *rest = row.split(",")
            if (symbol, table) not in places:
                places[symbol, table] = next(numbers[table])
            yield ",".join((symbol, table, str(places[symbol, table]), *rest))


def example_text(rows: Rows) -> str:
    """What a message shows of a map: some rows, and how many more there are."""
    lines = list(fill_rows(rows))
    more = f" and {len(lines) - EXAMPLE_ROWS} more" if len(lines) > EXAMPLE_ROWS else ""
    return " ".join(f"'{line}'" for line in lines[:EXAMPLE_ROWS]) + more
