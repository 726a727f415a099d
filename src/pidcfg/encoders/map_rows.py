"""The rows of a Modbus map that the user states: a symbol of the PLC, and where a client finds it.

Rows without a header, or below ``symbol,table,register,type,order,comment`` in any order of the columns::

    R100,holding,99,uint16
    S100,coil,99,bool
    M10,holding,40.3,bool
    DF1,holding,0,float32,high-first
    PRG.TIC_1.Kp,holding,1000,float32
    TIC_1.Direct,none

Registers count from 0. Nothing here knows a vendor: what a symbol is, and which types fit it, is looked at by
`pidcfg.encoders.modbus_map` and `pidcfg.encoders.symbol_map`.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Literal, NamedTuple, cast

from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.modbus import FIRST_REFERENCE, FIVE_DIGITS, Place, Table, reference
from pidcfg.encoders.tables import COMMENT, delimiter
from pidcfg.encoders.words import WORD_MAX
from pidcfg.refs import Decision
from pidcfg.schemas.names import nearest

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

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
ORDERS = {"low-first": False, "high-first": True}
WIDTHS = {"bool": 1, "int16": 1, "uint16": 1, "int32": 2, "uint32": 2, "float32": 2}
"""Registers, or coils, that a value of a type takes."""
TABLES: tuple[Table, ...] = ("coil", "discrete", "holding", "input")
BITS = frozenset({"coil", "discrete"})
"""Tables of single bits."""
NONE: Literal["none"] = "none"
"""In place of a table: no register has it."""
LAST_BIT = 15
REGISTER = re.compile(r"(?P<number>0[xX][0-9A-Fa-f]{1,4}|[0-9]{1,6})(?:\.(?P<bit>[0-9]{1,2}))?")


class MapError(ListingError):
    """A map that cannot be used, with line and column of the fault."""


class UnusableMapError(ValueError):
    """A map that is missing or cannot be used: file, line and column, and what to do."""

    def __init__(self, message: str, name: str = "", line: int = 1, column: int = 1) -> None:
        super().__init__(f"{name}:{line}:{column}: {message}" if name else message)
        self.said = message
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
    def bits(self) -> int:
        """The place of a switch as a number of bits."""
        return self.register * (LAST_BIT + 1) + (self.bit or 0)

    def place(self, steps: int) -> Place:
        """Where the symbol is that is ``steps`` registers, or switches, behind that of the row.

        Raises `LookupError` beyond the last register.
        """
        width = WIDTHS[self.type]
        if self.bit is None:
            register, bit = self.register + steps, None
        else:
            register, bit = divmod(self.bits + steps, LAST_BIT + 1)
        if register + width - 1 > WORD_MAX:
            raise LookupError(f"{register}, beyond the last register, {WORD_MAX}")
        return Place(cast("Table", self.table), register, width, self.high_first, bit)

    def wrong(self, cell: str, message: str) -> MapError:
        """The error of one of its cells."""
        return MapError(message, self.line, self.columns.get(cell, 1))


def shown(place: Place) -> str:
    """A place as messages name it, with the reference that counts from 1: ``holding 99 (40100)``."""
    bit = "" if place.bit is None else f".{place.bit}"
    return f"{place.table} {place.register}{bit} ({reference(place.table, place.register)}{bit})"


def read_rows(text: str) -> list[Row]:
    """The rows of a map; raises `MapError`."""
    text = text.removeprefix("\ufeff")
    between, rows = delimiter(text), list[Row]()
    header: tuple[str, ...] = HEADER
    is_first = True
    for line, content in enumerate(text.splitlines(), start=1):
        if not content.strip(f" \t{between}") or content.lstrip().startswith(COMMENT):
            continue
        cells = list(_cells(content, between, line))
        if is_first and _is_header({text.lower() for text, _ in cells}):
            header = _header(cells, line)
        else:
            rows.append(_row(cells, header, line))
        is_first = False
    if not rows:
        raise MapError("the map has no row; write one like R100,holding,99,uint16")
    return rows


def _is_header(cells: set[str]) -> bool:
    """Whether the first line names the columns: the symbol's, or, where that has another name, two of the others."""
    return HEADER[0] in cells or len(cells & {*HEADER[1:]}) > 1


def _cells(content: str, between: str, line: int) -> Iterator[tuple[str, int]]:
    """The cells of a line, each with its column."""
    end = re.escape(between)
    cell = re.compile(rf'[ ]*(?P<text>"(?:[^"]|"")*" *|[^"{end}][^{end}]*|)(?P<end>{end}|$)')
    at = 0
    while (match := cell.match(content, at)) is not None:
        text = match["text"].strip()
        quoted = len(text) > 1 and text[0] == text[-1] == '"'
        yield text[1:-1].replace('""', '"').strip() if quoted else text, match.start("text") + 1
        at = match.end()
        if not match["end"]:
            return
    raise MapError("a cell ends behind a quotation mark: remove the mark", line, at + 1)


def _header(cells: list[tuple[str, int]], line: int) -> tuple[str, ...]:
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


def _row(cells: list[tuple[str, int]], header: tuple[str, ...], line: int) -> Row:
    while cells and not cells[-1][0]:
        cells.pop()
    if len(cells) > len(header):
        raise MapError(f"{len(cells)} cells; a row has at most {','.join(header)}", line, cells[len(header)][1])
    texts = dict(zip(header, (text for text, _ in cells), strict=False))
    columns = dict(zip(header, (column for _, column in cells), strict=False))
    end = cells[-1][1] + len(cells[-1][0]) + 1
    row = Row(texts.get("symbol", ""), NONE, line=line, columns={**dict.fromkeys(header, end), **columns})
    if not row.symbol:
        raise row.wrong("symbol", "the row names no symbol")
    table = texts.get("table", "").lower()
    if table == NONE:
        if any(texts.get(key) for key in ("register", "type", "order")):
            raise row.wrong("table", f"{row.symbol} is in no table, but the row says more")
        return row
    if table not in TABLES:
        wanted = f"write {', '.join(TABLES)}, or {NONE} where no register has {row.symbol}"
        raise row.wrong("table", f"{texts.get('table', '')!r} is no table; {wanted}")
    row = row._replace(table=next(name for name in TABLES if name == table))
    row = row._replace(type=_type(row, texts.get("type", "")))
    row = _with_register(row, texts.get("register", ""))
    return row._replace(high_first=_order(row, texts.get("order", "")))


def _type(row: Row, text: str) -> str:
    kind = text.lower()
    if kind not in WIDTHS:
        near = nearest(kind, WIDTHS)
        cure = f"did you mean {near}?" if near else f"write one of {', '.join(WIDTHS)}"
        raise row.wrong("type", f"{text!r} is no type; {cure}" if text else f"the type is missing; {cure}")
    if (kind == "bool") < (row.table in BITS):
        raise row.wrong("type", f"a {row.table} holds a bool, not {kind}")
    return kind


def _with_register(row: Row, text: str) -> Row:
    if not text:
        first = f"{row.table} 0 is what references call {reference(cast('Table', row.table), 0)}"
        raise row.wrong("register", f"the register of {row.symbol} is missing; write its number from 0 on: {first}")
    match = REGISTER.fullmatch(text)
    if match is None:
        raise row.wrong("register", f"{text!r} is no register; write 0 to {WORD_MAX}, of a bit such as 100.3")
    number = int(match["number"], 16 if match["number"][:2].lower() == "0x" else 10)
    _refuse_reference(row, match["number"], number)
    if number + WIDTHS[row.type] - 1 > WORD_MAX:
        raise row.wrong("register", f"{row.symbol} would end at {number + WIDTHS[row.type] - 1}, beyond {WORD_MAX}")
    bit = None if match["bit"] is None else int(match["bit"])
    if (bit is not None) != (row.type == "bool" and row.table not in BITS):
        if bit is None:
            cure = f"say its bit, such as {text}.0, or take a coil or discrete"
            raise row.wrong("register", f"a {row.table} register has 16 switches: {cure}")
        raise row.wrong("register", f"{text!r} is a bit, and {row.symbol} a {row.type} of {row.table}")
    if bit is not None and bit > LAST_BIT:
        raise row.wrong("register", f"{text!r}: the bits of a register are 0 to {LAST_BIT}")
    return row._replace(register=number, bit=bit)


def _refuse_reference(row: Row, text: str, number: int) -> None:
    """Refuses what two people read differently (D890)."""
    table = cast("Table", row.table)
    short, long = FIRST_REFERENCE[table]
    if len(text) > 1 and text[0] == "0" and text[1] not in "xX":
        raise row.wrong("register", f"{text} may be a number or a reference; write {number} or {max(number - 1, 0)}")
    first = next((n for n in (short, long) if n > 1 and n <= number < n + FIVE_DIGITS), None)
    if first is not None and text[1] not in "xX":
        other = f", or 0x{number:X} if {number} itself is meant" if number <= WORD_MAX else ""
        said = f"{number} is how references call {table} {number - first}; write {number - first}{other}"
        raise row.wrong("register", said)


def _order(row: Row, text: str) -> bool:
    if text and WIDTHS[row.type] == 1:
        raise row.wrong("order", f"{row.symbol} is in one place and has no order; leave {text!r} out")
    if text and text.lower() not in ORDERS:
        raise row.wrong("order", f"{text!r} is no order; write {' or '.join(ORDERS)}")
    return ORDERS.get(text.lower(), False)
