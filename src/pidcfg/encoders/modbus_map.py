"""A stated Modbus map of a vendor with banks of registers (`pidcfg.encoders.map_rows` reads its rows).

A row is for its register and those that follow it in the bank, up to the next row.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.encoders.map_rows import LAST_BIT, NONE, WIDTHS, MapError, read_rows, shown
from pidcfg.encoders.spaces import BIT, SINGLE
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from pidcfg.encoders.image import Image
    from pidcfg.encoders.map_rows import Row
    from pidcfg.encoders.modbus import Place
    from pidcfg.encoders.spaces import Kind, Space

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


@dataclass(frozen=True, slots=True)
class StatedNumbering:
    """The rows of a map by the plain numbers at which they begin; a `pidcfg.encoders.modbus.Numbering`."""

    space: Space
    rows: tuple[tuple[int, Row], ...]
    """In the order of the numbers."""

    def row(self, number: int) -> tuple[int, Row] | None:
        """The row that an address is covered by, and where that begins."""
        found = next((entry for entry in reversed(self.rows) if entry[0] <= number), None)
        return found if found is not None and self.space.same_bank(found[0], number) else None

    def place(self, number: int) -> Place:
        """Where an address is; raises `LookupError` where no row says it."""
        found = self.row(number)
        if found is None:
            bank, _ = self.space.place(number)
            line = example_row(bank.name(bank.first), bank.kind)
            raise LookupError(f"no row of the map says where {self.space.name(number)} is; add one like {line}")
        start, row = found
        try:
            return row.place((number - start) * WIDTHS[row.type])
        except LookupError as error:
            raise LookupError(f"by line {row.line} of the map {self.space.name(number)} is at {error}") from None

    def find(self, table: str, register: int) -> tuple[int, int] | None:
        """The address that a register belongs to, and which of its registers it is."""
        for start, row in sorted(self.rows, key=lambda entry: entry[1].register, reverse=True):
            n, part = divmod(register - row.register, WIDTHS[row.type])
            number = start + n
            if row.table == table and row.bit is None and n >= 0 and self.row(number) == (start, row):
                width = WIDTHS[row.type]
                return number, width - 1 - part if row.high_first else part
        return None

    def check(self, image: Image) -> None:
        """Raises `MapError` where a register of the loops has no place, or the place of another one."""
        seen: dict[tuple[str, int, int], int] = {}
        for cell in image.cells:
            try:
                place = self.place(cell.number)
            except LookupError as error:
                found = self.row(cell.number)
                line = max(row.line for _, row in self.rows) if found is None else found[1].line
                whose = f" ({cell.field} of {cell.loop})" if cell.loop else ""
                raise MapError(f"{cell.address}{whose}: {error}", line) from None
            for taken in places_of(place):
                other = seen.setdefault(taken, cell.number)
                if other != cell.number:
                    raise self._overlap(other, cell.number, place)

    def _overlap(self, one: int, two: int, place: Place) -> MapError:
        rows = [row for found in map(self.row, (one, two)) if found is not None for row in (found[1],)]
        last = max(rows, key=lambda row: row.line)
        names = f"{self.space.name(one)} and {self.space.name(two)}"
        lines = f"lines {' and '.join(str(row.line) for row in sorted(rows, key=lambda row: row.line))}"
        return last.wrong("register", f"{names} are both at {shown(place)} by {lines}; each needs a place of its own")


def places_of(place: Place) -> Iterable[tuple[str, int, int]]:
    """Every single bit that a place takes: table, register, bit."""
    bits = range(LAST_BIT + 1) if place.bit is None else (place.bit,)
    return [(place.table, place.register + part, bit) for part in range(place.width) for bit in bits]


def read_map(text: str, space: Space) -> StatedNumbering:
    """A map as text; raises `MapError` with the place of what cannot be read."""
    rows: dict[int, Row] = {}
    for row in read_rows(text):
        start = _start(row, space)
        if start in rows:
            raise row.wrong("symbol", f"{row.symbol} stands here again; first in line {rows[start].line}")
        rows[start] = row
    return StatedNumbering(space, tuple(sorted(rows.items())))


def _start(row: Row, space: Space) -> int:
    start = space.parse(row.symbol.upper())
    if start is None:
        banks = ", ".join(f"{bank.name(bank.first)} to {bank.name(bank.last)}" for bank in space.banks)
        raise row.wrong("symbol", f"{row.symbol!r} is no register of this vendor, which has {banks}")
    if row.table == NONE:
        raise row.wrong("table", f"the registers of a block follow each other: {row.symbol} cannot be without a table")
    known = types_of(space.kind(start))
    if row.type not in known:
        raise row.wrong("type", f"{row.symbol} holds {space.kind(start).holds}: {' or '.join(known)}, not {row.type}")
    return start


def example_row(symbol: str, kind: Kind) -> str:
    """A row for a register."""
    return f"{symbol},{'coil' if kind is BIT else 'holding'},0,{types_of(kind)[0]}"


def types_of(kind: Kind) -> Sequence[str]:
    """The types that a register may have in a map, the usual one first."""
    if kind is BIT:
        return ("bool",)
    return ("float32",) if kind is SINGLE else ("uint16", "int16")
