"""A Modbus map that the user states, for a PLC whose manual prints none, or that stands behind a gateway.

Rows without a header, or below ``symbol,table,register,type,order``::

    R100,holding,99,uint16
    S100,coil,99,bool
    DF1,holding,0,float32,high-first

A row is for its register and those that follow it in the bank, up to the next row.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, get_args

from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.modbus import Place, Table
from pidcfg.encoders.spaces import BIT, SINGLE
from pidcfg.encoders.words import WORD_MAX
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.encoders.spaces import Kind, Space

D875 = Decision(
    875,
    "a Modbus map is the user's where the manual has none",
    "The manuals of EZLogix, DPIDE and NextoPID print no Modbus numbers, and none is made up: `--map FILE` says them, "
    "row by row. A row counts for its register and those behind it in the bank, up to the next row; a map may also be "
    "stated for a PLC that has one of its own, such as one behind a gateway.",
    "A register that is guessed is somebody else's number.",
)
HEADER = ["symbol", "table", "register", "type", "order"]
ORDERS = {"low-first": False, "high-first": True}
BITS = ("coil", "discrete")
LEAST, MOST = 3, 5
"""Cells of a row."""


class Row(NamedTuple):
    """Where a register of the vendor is, and those behind it."""

    start: int
    table: Table
    register: int
    width: int
    high_first: bool


@dataclass(frozen=True, slots=True)
class StatedNumbering:
    """The rows of a map in the order of their registers; a `pidcfg.encoders.modbus.Numbering`."""

    space: Space
    rows: tuple[Row, ...]

    def place(self, number: int) -> Place:
        """Where an address is; raises `LookupError` where no row says it."""
        row = next((row for row in reversed(self.rows) if row.start <= number), None)
        if row is None or not self.space.same_bank(row.start, number):
            raise LookupError(f"the map does not say where {self.space.name(number)} is")
        register = row.register + (number - row.start) * row.width
        if register + row.width - 1 > WORD_MAX:
            raise LookupError(f"by the map {self.space.name(number)} is at {register}, beyond the last register")
        return Place(row.table, register, row.width, row.high_first)

    def find(self, table: str, register: int) -> tuple[int, int] | None:
        """The address that a register belongs to, and which of its registers it is."""
        for row in reversed(self.rows):
            n, part = divmod(register - row.register, row.width)
            number = row.start + n
            is_behind = row.table == table and n >= 0 and self.space.same_bank(row.start, number)
            if is_behind and self.place(number)[:2] == (table, register - part):
                return number, row.width - 1 - part if row.high_first else part
        return None


def read_map(text: str, space: Space) -> StatedNumbering:
    """A map as text; raises `ListingError` with the line of what cannot be read."""
    rows = {}
    for line, cells in _lines(text):
        row = _row(cells, space, line)
        if row.start in rows:
            raise ListingError(f"{cells[0]} stands here again", line)
        rows[row.start] = row
    if not rows:
        raise ListingError(f"the map has no row; write one like {example(space)[0]}")
    return StatedNumbering(space, tuple(rows[start] for start in sorted(rows)))


def example(space: Space) -> list[str]:
    """A map as it may look for a vendor, a row a bank."""
    rows = []
    for bank in space.banks:
        table = "coil" if bank.kind is BIT else "holding"
        rows.append(f"{bank.name(bank.first)},{table},0,{_types(bank.kind)[0]}")
    return rows


def _lines(text: str) -> Iterator[tuple[int, list[str]]]:
    for number, line in enumerate(text.splitlines(), start=1):
        cells = [cell.strip() for cell in next(csv.reader([line]), [])]
        if (
            any(cells)
            and not line.lstrip().startswith("#")
            and [cell.lower() for cell in cells] != HEADER[: len(cells)]
        ):
            yield number, cells


def _row(cells: Sequence[str], space: Space, line: int) -> Row:
    if not LEAST <= len(cells) <= MOST:
        raise ListingError(f"{len(cells)} cells; write {','.join(HEADER)}, such as {example(space)[0]}", line)
    symbol, table, register, *more = cells
    start = space.parse(symbol.upper())
    if start is None:
        raise ListingError(f"{symbol!r} is not an address of this vendor", line)
    if table not in get_args(Table):
        raise ListingError(f"{table!r} is none of {', '.join(get_args(Table))}", line)
    if not (register.isascii() and register.isdecimal() and len(register) <= 5 and int(register) <= WORD_MAX):
        raise ListingError(f"{register!r} is no register of 0 to {WORD_MAX}, counted from 0", line)
    kind, (form, order) = space.kind(start), (*more, "", "")[:2]
    known = _types(kind)
    if form and form not in known:
        raise ListingError(f"{symbol} is {' or '.join(known)}, not {form!r}", line)
    if (table in BITS) != (kind is BIT):
        raise ListingError(f"{symbol} holds {kind.holds}, which {table} registers do not", line)
    if order and order not in ORDERS:
        raise ListingError(f"{order!r} is none of {', '.join(ORDERS)}", line)
    stated: Table = next(name for name in get_args(Table) if name == table)
    return Row(start, stated, int(register), 2 if kind is SINGLE else 1, ORDERS.get(order, False))


def _types(kind: Kind) -> tuple[str, ...]:
    if kind is BIT:
        return ("bool",)
    return ("float32",) if kind is SINGLE else ("uint16", "int16")
