"""A symbol table of the user's: read as ISPSoft exports it, and the symbols of all loops added to it (D358).

ISPSoft quotes nothing: a comment is the rest of its line, commas and all, and a row may end before it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.encoders.dpide.symbols import COLUMNS, Symbol, symbol_line, symbols
from pidcfg.encoders.files import CONFLICT
from pidcfg.encoders.listing import ListingError
from pidcfg.refs import Decision
from pidcfg.schemas.numbers import NUMBER

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.parameters import Program

D358 = Decision(
    358,
    "a symbol table of the user's keeps what it says",
    "A symbol whose name and device both stand there is the loop's own: its initial value becomes the configuration's, "
    "and nothing else of the row changes. One whose name stands there with another device, or whose device another "
    "symbol has, or shares a register with, is left out and reported; everything else is added at the end.",
    "As with nicknames (D106); a register of I_MV that something else writes would move the output.",
)

IDENTIFIER, ADDRESS, TYPE, VALUE = (COLUMNS.index(name) for name in ("Identifiers", "Address", "Type", "Initial Value"))
LEAST_CELLS = 4
"""Class, identifier, address and type; the initial value and the comment may be missing."""
WORDS = {
    "BOOL": 0,
    "WORD": 1,
    "INT": 1,
    "UINT": 1,
    "DWORD": 2,
    "DINT": 2,
    "UDINT": 2,
    "REAL": 2,
    "LWORD": 4,
    "LREAL": 4,
}
"""Registers that a value of a type takes; a bit none but its own."""
ARRAY = re.compile(r"ARRAY\s*\[\s*(\d{1,6})\s*\.\.\s*(\d{1,6})\s*\]\s*OF\s+(\w+)", re.IGNORECASE)
REGISTER = re.compile(r"D(\d{1,6})")


@dataclass(frozen=True, slots=True)
class Row:
    """A row of the table: its line, its text with the line end, and its cells."""

    line: int
    raw: str
    cells: tuple[str, ...]

    @property
    def name(self) -> str:
        """The symbol."""
        return self.cells[IDENTIFIER]

    @property
    def address(self) -> str:
        """Its device; empty where ISPSoft places it."""
        return self.cells[ADDRESS].upper()

    @property
    def value(self) -> str:
        """Its initial value; empty where it has none."""
        return self.cells[VALUE] if len(self.cells) > VALUE else ""


@dataclass(slots=True)
class Table:
    """The rows of a table by their symbols in small letters, and what stands before them."""

    head: str = ""
    rows: list[Row] = field(default_factory=list)
    by_name: dict[str, Row] = field(default_factory=dict)


def parse(text: str) -> Table:
    """The rows of a symbol table; raises `ListingError` with the line of what is none."""
    table = Table()
    for line, raw in enumerate(text.splitlines(keepends=True), start=1):
        cells = tuple(raw[a:b].strip() for a, b in _spans(raw.rstrip("\r\n")))
        if not table.head:
            if [cell.casefold() for cell in cells] != [name.casefold() for name in COLUMNS]:
                raise ListingError(f"the header of a symbol table is {','.join(COLUMNS)}; export it again", line)
            table.head = raw
            continue
        row = Row(line, raw, cells)
        if any(cells):
            _check(row, table)
            table.by_name[row.name.casefold()] = row
        table.rows.append(row)
    if not table.head:
        raise ListingError("the file is empty")
    return table


def _check(row: Row, table: Table) -> None:
    if len(row.cells) < LEAST_CELLS:
        raise ListingError(
            f"{len(row.cells)} cells; a row has {', '.join(COLUMNS[:LEAST_CELLS])}, and may have a value and a comment",
            row.line,
        )
    if not row.name:
        raise ListingError("the row has no symbol in its second cell", row.line)
    other = table.by_name.get(row.name.casefold())
    if other is not None:
        raise ListingError(f"the symbol {row.name[:60]} stands here again, after line {other.line}", row.line)


def _spans(line: str) -> Iterator[tuple[int, int]]:
    """Where the cells of a line stand; commas in brackets (arrays) and in the comment separate nothing."""
    start = depth = count = 0
    for i, sign in enumerate(line):
        depth += (sign in "[(") - (sign in "])" and depth > 0)
        if sign == "," and not depth and count < len(COLUMNS) - 1:
            yield start, i
            start, count = i + 1, count + 1
    yield start, len(line)


def registers_of(kind: str, address: str) -> range:
    """The D registers of a symbol: none on other devices, and one where the type's length is not known."""
    found = REGISTER.fullmatch(address.split(".", maxsplit=1)[0])
    if found is None:
        return range(0)
    first, array = int(found[1]), ARRAY.fullmatch(kind)
    words = WORDS.get((array[3] if array else kind).upper(), 1)
    if array:
        words *= int(array[2]) - int(array[1]) + 1
    return range(first, first + (1 if "." in address else max(words, 1)))


def merge_symbols(image: Program, text: str) -> tuple[str, tuple[str, ...]]:
    """The text of the user's table with the symbols of all loops, and what was done."""
    table = parse(text)
    taken = [(row, registers_of(row.cells[TYPE], row.address)) for row in table.rows if len(row.cells) > TYPE]
    renewed: dict[int, str] = {}
    created: list[str] = []
    same: list[str] = []
    notes: list[str] = []
    for symbol in symbols(image):
        called = table.by_name.get(symbol.name.casefold())
        if called is not None and called.address == symbol.address.upper():
            same.append(symbol.name)
            if symbol.value and not _equal(called.value, symbol.value):
                renewed[called.line] = _with_value(called, symbol.value)
                before = called.value or "none"
                notes.append(f"initial value renewed: {symbol.name} ({symbol.address}), {before} to {symbol.value}")
            continue
        reasons = list(_reasons(symbol, called, taken))
        if reasons:
            where = symbol.address or "no device"
            why = " and ".join(reasons)
            notes.append(f"{CONFLICT}, left as it is: {symbol.name} ({where}) was not created, since {why}")
        else:
            created.append(symbol_line(symbol))
    end = "\n" if "\r\n" not in table.head and table.head.endswith("\n") else "\r\n"
    body = table.head + "".join(renewed.get(row.line, row.raw) for row in table.rows)
    if created and not body.endswith(("\n", "\r")):
        body += end
    merged = body + "".join(line + end for line in created)
    if len(parse(merged).by_name) != len(table.by_name) + len(created):
        raise ListingError("the symbols could not be added to this file")
    return merged, (f"created {len(created)}, already there: {len(same)}", *notes)


def _reasons(symbol: Symbol, called: Row | None, taken: list[tuple[Row, range]]) -> Iterator[str]:
    """Why a symbol is not added."""
    if called is not None:
        yield f"the symbol is that of {called.address or 'a variable without a device'} in line {called.line}"
    for row, registers in taken:
        if row is called or not symbol.address or not row.address:
            continue
        shared = range(max(registers.start, symbol.registers.start), min(registers.stop, symbol.registers.stop))
        bits = "." in row.address and "." in symbol.address
        if row.address == symbol.address.upper() or (shared and not bits):
            yield f"{row.address} is {row.name!r} in line {row.line}"
            return


def _equal(value: str, other: str) -> bool:
    """Whether two initial values are the same, however they are written."""
    if value.upper() == other.upper() or {"0": "FALSE", "1": "TRUE"}.get(value) == other:
        return True
    return all(map(NUMBER.fullmatch, (value, other))) and float(value) == float(other)


def _with_value(row: Row, value: str) -> str:
    """A row's text with another initial value; every other character as it was."""
    bare = row.raw.rstrip("\r\n")
    spans = [*_spans(bare)]
    if len(spans) <= VALUE:
        return f"{bare},{value}{row.raw[len(bare) :]}"
    start, stop = spans[VALUE]
    return bare[:start] + value + row.raw[stop:]
