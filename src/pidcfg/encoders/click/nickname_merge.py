"""A nickname list of the user's with the nicknames of all loops added, in the columns that it has (D106)."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from pidcfg.encoders.click.nickname_csv import MARK, MODBUS, initial, parse, write_nicknames
from pidcfg.encoders.click.nicknames import nicknames
from pidcfg.encoders.files import CONFLICT
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.maps.click import SPACE

if TYPE_CHECKING:
    from pidcfg.encoders.click.nickname_csv import Row, Table
    from pidcfg.encoders.image import Image

CELL = re.compile(r'"(?:[^"]|"")*"|[^",\r\n][^,\r\n]*|')
"""A cell as it is written, with its quotes."""
FIRST_HOLDING = 400_001
"""Reference of the first holding register; coils count from 1."""
FUNCTION_CODES = {"coil": "FC=01,05,15", "holding": "FC=03,06,16"}
"""How CLICK's own exports name the Modbus functions of C bits, and of DS and DF registers."""


def merge_nicknames(image: Image, text: str) -> tuple[str, tuple[str, ...]]:
    """The text of the user's file with all rows, and what was done; only an initial value of theirs is renewed."""
    mark = MARK if text.startswith(MARK) else ""
    theirs, wanted = parse(text), parse(write_nicknames(image))
    hexadecimal = _modbus_style(theirs)
    set_here = {row.address for row in nicknames(image) if row.value}
    changed: dict[str, str] = {}
    created, named, same, notes = [], 0, [], []
    for row in wanted.rows:
        at, called = theirs.by_address.get(row.address), theirs.by_name.get(row.nickname.casefold())
        if called is None and (at is None or at.is_unused):
            line = _in_columns(row, theirs, hexadecimal=hexadecimal)
            if at is None:
                created.append(line)
            else:
                changed[row.address], named = line + _line_end(at.raw), named + 1
        elif at is not None and at is called:
            same.append(row.address)
            if row.address in set_here and (initial(at) or 0) != initial(row):
                changed[row.address] = _with_cell(at.raw, theirs.column("Initial Value"), row.value)
                notes.append(f"initial value renewed: {row.nickname} ({row.address}), {at.value or 0} to {row.value}")
        else:
            notes.append(_conflict(row, at, called))
    body = "".join(changed.get(row.address, row.raw) for row in theirs.rows)
    if created and not (theirs.head + body).endswith(("\n", "\r")):
        body += theirs.line_end
    body += "".join(line + theirs.line_end for line in created)
    merged = theirs.head + body
    if len(parse(merged).rows) != len(theirs.rows) + len(created):
        raise ListingError("the rows could not be added to this file")
    return mark + merged, (f"created {len(created) + named}, already there: {len(same)}", *notes)


def _modbus_style(table: Table) -> bool:
    """Whether the file writes Modbus addresses in hexadecimal; what it says of a C, DS or DF row must be so."""
    if MODBUS not in table.columns:
        return False
    hexadecimal = any(row.modbus.endswith(("h", "H")) for row in table.rows)
    for row in table.rows:
        number = SPACE.parse(row.address)
        if number is None or not row.modbus:
            continue
        wanted = _modbus(row.address, hexadecimal=hexadecimal)[0]
        if row.modbus.lstrip("0").casefold() != wanted.lstrip("0").casefold():
            raise ListingError(
                f"{row.address} has the {MODBUS} {wanted}, but the file says {row.modbus[:40]!r}; export it again, or "
                "correct the cell",
                row.line,
            )
    return hexadecimal


def _modbus(address: str, *, hexadecimal: bool) -> tuple[str, str]:
    """The Modbus address of a C, DS or DF register as CLICK's exports write it, and its function codes."""
    from pyclickplc import plc_to_modbus
    from pyclickplc.addresses import parse_address

    bank, n = parse_address(address)
    register, _ = plc_to_modbus(bank, n)
    table = "coil" if bank == "C" else "holding"
    first = 1 if table == "coil" else FIRST_HOLDING
    return f"{register:04X}h" if hexadecimal else str(first + register), FUNCTION_CODES[table]


def _in_columns(row: Row, table: Table, *, hexadecimal: bool) -> str:
    """A row of ours in the columns of the user's file, without its line end."""
    line = row.raw.removesuffix("\n")
    if MODBUS not in table.columns:
        return line
    address, kind, rest = line.split(",", 2)
    register, codes = _modbus(row.address, hexadecimal=hexadecimal)
    return f'{address},{kind},{register},"{codes}",{rest}'


def _with_cell(raw: str, column: int, value: str) -> str:
    """A row's text with another value in one column, and every other character as it was."""
    at = 0
    for _ in range(column):
        cell = CELL.match(raw, at)
        at = (at if cell is None else cell.end()) + 1
    cell = CELL.match(raw, at)
    return raw[:at] + value + raw[at if cell is None else cell.end() :]


def _line_end(raw: str) -> str:
    return raw[len(raw.rstrip("\r\n")) :]


def _conflict(row: Row, at: Row | None, called: Row | None) -> str:
    """Why a row was not added."""
    reasons = []
    if at is not None:
        reasons.append(f"{at.address} is {at.nickname!r}" if at.nickname else f"{at.address} has no nickname there")
    if called is not None:
        reasons.append(f"the nickname is that of {called.address}")
    return f"{CONFLICT}, left as it is: {row.nickname} ({row.address}) was not created, since {' and '.join(reasons)}"
