"""CLICK's nickname CSV: written and checked by pyclickplc, and read strictly.

Newer versions of CLICK's software export two more columns, the Modbus address and its function codes, behind the type.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.encoders.click.nicknames import nicknames
from pidcfg.encoders.click.package import read_with, written_by
from pidcfg.encoders.files import UnwritableError
from pidcfg.encoders.listing import ListingError, decimal_content
from pidcfg.encoders.maps.click import SPACE
from pidcfg.encoders.tables import cells_stand

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from pidcfg.encoders.image import Image

HEADER = ("Address", "Data Type", "Nickname", "Initial Value", "Retentive", "Address Comment")
MODBUS, FUNCTION_CODE = "Modbus Address", "Function Code"
HEADERS = (HEADER, (*HEADER[:2], MODBUS, FUNCTION_CODE, *HEADER[2:]))
MARK = "\ufeff"
SYSTEM = frozenset({"SC", "SD"})
"""Banks whose nicknames the PLC's software gives, some of them twice."""


@dataclass(frozen=True, slots=True)
class Row:
    """One address of a nickname CSV: its first line, its text with the line end, its cells without blanks around."""

    line: int
    raw: str
    address: str
    bank: str
    kind: str
    nickname: str
    value: str
    retentive: str
    comment: str
    modbus: str = ""
    """Its Modbus address as the file writes it, where the file has that column."""

    @property
    def is_unused(self) -> bool:
        """Whether the row only says that the address exists: no nickname, no comment, no initial value."""
        return not self.nickname and not self.comment and self.value in {"", "0"}


@dataclass(slots=True)
class Table:
    """A nickname CSV: what stands before the first row, and its rows by address and by nickname in small letters."""

    head: str = ""
    columns: tuple[str, ...] = HEADER
    rows: list[Row] = field(default_factory=list)
    by_address: dict[str, Row] = field(default_factory=dict)
    by_name: dict[str, Row] = field(default_factory=dict)

    def add(self, row: Row) -> None:
        """Takes a row; an address twice is refused, and so is a nickname twice but for the system's own."""
        if row.address in self.by_address:
            first = self.by_address[row.address]
            raise ListingError(f"{row.address} stands here again, after line {first.line}", row.line)
        other = self.by_name.get(row.nickname.casefold()) if row.nickname else None
        if other is not None and row.bank not in SYSTEM:
            raise ListingError(
                f"the nickname {row.nickname!r} of {row.address} is that of {other.address} in line {other.line} too",
                row.line,
            )
        self.rows.append(row)
        self.by_address[row.address] = row
        if row.nickname:
            self.by_name[row.nickname.casefold()] = row

    def column(self, name: str) -> int:
        """Where a column stands, from 0."""
        return self.columns.index(name)

    @property
    def line_end(self) -> str:
        """How the file ends its lines."""
        return "\r\n" if self.head.endswith("\r\n") else "\n"


def write_nicknames(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """The nicknames of all loops; raises `UnwritableError` for one that CLICK would refuse."""
    from pyclickplc.addresses import make_address_record
    from pyclickplc.nicknames import write_csv

    del checklist
    rows = nicknames(image)
    records = [
        make_address_record(row.address, nickname=row.nickname, initial_value=row.value, comment=row.comment)
        for row in rows
    ]
    text = written_by(lambda path: write_csv(path, records)).decode().replace("\r\n", "\n")
    back = [(row.address, row.nickname, row.value, row.comment) for row in parse(text).rows]
    if back != [(row.address, row.nickname, row.value or "0", row.comment) for row in rows]:
        raise UnwritableError("pyclickplc did not write what it was given")
    return text


def parse(text: str) -> Table:
    """The rows of a nickname CSV, each checked; what pyclickplc would read from it must be the same."""
    table = Table()
    for line, raw, cells in _records(text.removeprefix(MARK)):
        stripped = [cell.strip() for cell in cells]
        if not table.head:
            table.head, table.columns = raw, _header(stripped, line)
        elif any(stripped):
            table.add(_row(line, raw, stripped, table.columns))
        else:
            table.rows.append(Row(line, raw, "", "", "", "", "", "", ""))
    if not table.head:
        raise ListingError("the file is empty")
    _compare(table, ",".join(table.columns) + "\n" + text.removeprefix(MARK).removeprefix(table.head))
    return table


def _records(text: str) -> Iterator[tuple[int, str, list[str]]]:
    """Each record with its first line and its raw text; a quoted comment may run over several lines."""
    if "\0" in text:
        raise ListingError("a NUL character", text[: text.index("\0")].count("\n") + 1)
    lines = io.StringIO(text, newline="").readlines()
    reader = csv.reader(iter(lines), strict=True)
    done = 0
    while True:
        try:
            cells = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            raise ListingError(f"not CSV: {error}", done + 1) from None
        yield done + 1, "".join(lines[done : reader.line_num]), cells
        done = reader.line_num


def _header(cells: list[str], line: int) -> tuple[str, ...]:
    """The columns of a file, whatever the letters of its header."""
    for header in HEADERS:
        if [cell.casefold() for cell in cells] == [name.casefold() for name in header]:
            return header
    raise ListingError(
        f"the header of a nickname CSV is {','.join(HEADER)}, with {MODBUS} and {FUNCTION_CODE} behind Data Type or "
        "without; export it again",
        line,
    )


def _row(line: int, raw: str, cells: list[str], columns: tuple[str, ...]) -> Row:
    from pyclickplc.addresses import normalize_address, parse_address

    if len(cells) != len(columns):
        raise ListingError(f"{cells_stand(cells)} under a header of {len(columns)} columns", line)
    named = dict(zip(columns, cells, strict=True))
    written, kind, nickname, value, retentive, comment = (named[name] for name in HEADER)
    address = normalize_address(written) if written.isascii() and len(written) < len("CTD1000000") else None
    if address is None:
        raise ListingError(f"{written[:40]!r} is not an address of CLICK", line)
    bank, _ = parse_address(address)
    if retentive.lower() not in {"yes", "no", ""}:
        raise ListingError(f"{address}: {retentive[:40]!r} stands where Yes or No is wanted", line)
    row = Row(line, raw, address, bank, kind, nickname, value, retentive, comment, named.get(MODBUS, ""))
    _typed(row)
    initial(row)
    return row


def _typed(row: Row) -> None:
    """The data type must be that of the bank."""
    from pyclickplc.banks import MEMORY_TYPE_TO_DATA_TYPE
    from pyclickplc.nicknames import DATA_TYPE_CODE_TO_STR, DATA_TYPE_STR_TO_CODE

    code = MEMORY_TYPE_TO_DATA_TYPE[row.bank]
    if row.kind and DATA_TYPE_STR_TO_CODE.get(row.kind.upper()) != code:
        raise ListingError(
            f"{row.address} is of type {DATA_TYPE_CODE_TO_STR[code]}, but the file says {row.kind[:40]!r}", row.line
        )


def initial(row: Row) -> int | None:
    """The raw content of a C, DS or DF row; None where it has no initial value, and for other banks."""
    number = SPACE.parse(row.address)
    if number is None or not row.value:
        return None
    kind = SPACE.kind(number)
    raw = decimal_content(row.value, kind)
    if raw is None:
        raise ListingError(f"{row.address}: the initial value {row.value[:40]!r} is not {kind.holds}", row.line)
    return raw


def _compare(table: Table, text: str) -> None:
    """What pyclickplc reads must be what stands there: it drops what it does not understand."""
    from pyclickplc.nicknames import read_csv

    def read(path: Path) -> dict[str, tuple[str, str, str]]:
        return {r.display_address: (r.nickname, r.initial_value, r.comment) for r in read_csv(path).values()}

    try:
        content = text.encode()
    except UnicodeEncodeError as error:
        raise ListingError("a character that is not Unicode", text[: error.start].count("\n") + 1) from None
    rows = read_with(read, content)
    for row in table.rows:
        if row.address and rows.pop(row.address, None) != (row.nickname, row.value, row.comment):
            raise ListingError(f"pyclickplc does not read the row of {row.address} as it is written", row.line)
    if rows:
        raise ListingError(f"pyclickplc reads {', '.join(sorted(rows)[:3])}, which no row has")
