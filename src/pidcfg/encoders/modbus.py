"""A Modbus map of an image: which coil or holding register a client reads or writes, with the value to write.

A value of two registers takes two rows, the low word first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

from pidcfg.encoders.listing import Listing, ListingError, comments, csv_text
from pidcfg.encoders.tables import table_rows
from pidcfg.encoders.words import WORD_MAX

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from pidcfg.encoders.image import Cell, Image
    from pidcfg.encoders.parameters import Program
    from pidcfg.encoders.spaces import Space

Table = Literal["coil", "discrete", "holding", "input"]
COLUMNS = ("table", "register", "reference", "address", "value", "hex", "access", "loop", "field")
FIVE_DIGITS = 9_999
"""Registers up to here have a five-digit reference, the others a six-digit one."""
FIRST_REFERENCE = {
    "coil": (1, 1),
    "discrete": (10_001, 100_001),
    "input": (30_001, 300_001),
    "holding": (40_001, 400_001),
}


class Place(NamedTuple):
    """Where a client finds an address: 0-based, ``width`` registers of 16 bits."""

    table: Table
    register: int
    width: int = 1
    high_first: bool = False
    """Of two registers the high word comes first."""
    bit: int | None = None
    """Of a switch in a holding or input register: its bit, 0 to 15."""

    def shift(self, part: int) -> int:
        """By how many bits the content of one of its registers is shifted in the value."""
        return 16 * (self.width - 1 - part if self.high_first else part)


class Places(Protocol):
    """Where a client finds addresses, or parameters by their names."""

    def place(self, number: Any) -> Place:
        """Where an address is; raises `LookupError` where no client finds it."""


class Numbering(Places, Protocol):
    """How a vendor numbers its addresses for Modbus."""

    def find(self, table: str, register: int) -> tuple[int, int] | None:
        """The address that a register belongs to, and which of its registers it is."""


def reference(table: Table, register: int) -> str:
    """The conventional number of a 0-based coil or holding register: holding register 1024 is 41025."""
    short, long = FIRST_REFERENCE[table]
    return str((short if register < FIVE_DIGITS else long) + register).zfill(5)


def rows(cell: Cell, place: Place) -> Iterator[tuple[int, int, str]]:
    """Each register of a cell: its number, its content, and what is added to the field's name."""
    for part in range(place.width):
        shift = place.shift(part)
        name = "" if place.width == 1 else (", high word" if shift else ", low word")
        yield place.register + part, cell.raw >> shift & WORD_MAX, name


def write_modbus(image: Image, checklist: tuple[str, ...], numbering: Numbering) -> str:
    """Coils and registers in the order of the image."""
    return modbus_csv(image, checklist, ((cell, numbering.place(cell.number)) for cell in image.cells))


def modbus_csv(image: Image | Program, checklist: tuple[str, ...], cells: Iterable[tuple[Cell, Place]]) -> str:
    """Coils and registers, each with its value; of a switch in a register the bit stands behind a point."""
    table: list[tuple[object, ...]] = []
    for c, place in cells:
        digits = min(c.kind.digits, 4)
        bit = "" if place.bit is None else f".{place.bit}"
        for register, content, part in rows(c, place):
            where = (place.table, f"{register}{bit}", f"{reference(place.table, register)}{bit}", c.address)
            table.append((*where, content, f"{content:0{digits}X}", c.access, c.loop or "", c.field + part))
    return csv_text(COLUMNS, table, comments(image, checklist))


def read_modbus(text: str, space: Space, numbering: Numbering) -> Listing:
    """Registers and values; the other columns are for people."""
    listing = Listing()
    parts: dict[int, dict[int, int]] = {}
    for number, row in table_rows(text, listing, required=("table", "register", "value")):
        for key in ("register", "value"):
            if not row[key].isascii() or not row[key].isdecimal() or int(row[key][:6]) > WORD_MAX:
                raise ListingError(f"{key} {row[key]!r} is not a number of 0 to {WORD_MAX}", number)
        position = numbering.find(row["table"], int(row["register"]))
        shown = f"{row['table']} {row['register']}"
        if position is None:
            raise ListingError(f"{shown} is no register of this vendor", number)
        address, part = position
        have = parts.setdefault(address, {})
        if part in have:
            raise ListingError(f"{shown} stands here again", number)
        have[part] = int(row["value"])
        listing.lines[address] = number
    for address, have in parts.items():
        _join(listing, space, numbering, address, have)
    return listing


def _join(listing: Listing, space: Space, numbering: Numbering, address: int, have: dict[int, int]) -> None:
    """The registers of one address put together; half a value is refused."""
    line, name = listing.lines[address], space.name(address)
    if len(have) < numbering.place(address).width:
        raise ListingError(f"{name}: one of its two registers is missing", line)
    raw = sum(content << 16 * part for part, content in have.items())
    if raw > space.kind(address).highest:
        raise ListingError(f"{name}: {raw} is not the state of a switch", line)
    listing.add(address, raw, name, line)
