"""CLICK DataViews (CDV): one a loop, with new values for the settings; UTF-16 and CRLF as CLICK writes them.

pyclickplc writes and reads them; it ends lines with LF, cuts at 100 rows and wraps numbers, so everything is checked.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from pidcfg.encoders.click.package import read_with, written_by
from pidcfg.encoders.files import UnwritableError
from pidcfg.encoders.listing import Listing, ListingError
from pidcfg.encoders.maps.click import SPACE
from pidcfg.encoders.spaces import BIT, INT16, SINGLE
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.image import Cell, Image
    from pidcfg.encoders.spaces import Kind

D108 = Decision(
    108,
    "a DataView shows all of a loop and writes its settings",
    "One file a loop in address order: settings with a new value, requests and what the controller writes without, "
    "reserved registers not at all.",
    "A new value is written by one click on all rows: a request among them would start, a status would be overwritten.",
)

ROWS = 100
MARK = "\ufeff"
HEADER = re.compile(r"(-1|0)(,[0-9]{1,6}){2}")
ROW = re.compile(r"([A-Z]{1,3}[0-9]{1,4}u?),([0-9]{1,4})(?:,([0-9]{1,10})?)?")
EMPTY = re.compile(r"(,0?,?)?")
BIT_MAX, SIGNED = 1, 0xFFFF8000
"""Integers are kept as 32 bits with their sign: -1 is 4294967295."""
CODES = {"BIT": 768, "INT": 0, "INT2": 256, "FLOAT": 257, "HEX": 3, "TXT": 1024}
"""The second cell of a row; pyclickplc takes the address's own type for a code that it does not know."""
PLAIN = re.compile(r"[^A-Za-z0-9_-]")


def write_dataviews(image: Image, checklist: tuple[str, ...] = ()) -> Mapping[str, str]:
    """A DataView for each loop, by its name; a single one needs no name."""
    del checklist
    views = [
        (f"{name}-{i}" if i > 1 else name, cells)
        for name in _loops(image)
        for i, cells in enumerate(_views([c for c in image.cells if c.loop == name]), start=1)
    ]
    texts = [MARK + _text(cells) for _, cells in views]
    if len(texts) == 1:
        return {"": texts[0]}
    safe = [PLAIN.sub("_", name) for name, _ in views]
    if len({name.casefold() for name in safe}) < len(safe):
        safe = [f"{i}-{name}" for i, name in enumerate(safe, start=1)]
    return dict(zip(safe, texts, strict=True))


def _loops(image: Image) -> list[str]:
    return list(dict.fromkeys(str(entry["loop"]) for entry in image.settings))


def _views(cells: list[Cell]) -> list[list[Cell]]:
    """The registers with a meaning, a hundred at a time."""
    shown = [cell for cell in cells if cell.access != "reserved"]
    return [shown[i : i + ROWS] for i in range(0, len(shown), ROWS)]


def _text(cells: list[Cell]) -> str:
    """One DataView, written by pyclickplc and read again."""
    from pyclickplc.dataview import DataViewFile, make_dataview_record

    rows = [make_dataview_record(c.address, new_value=c.value if c.access == "setting" else None) for c in cells]
    content = written_by(DataViewFile(rows=rows).save)
    text = content.decode("utf-16").replace("\r\n", "\n").replace("\n", "\r\n")
    if read_dataview(text).words != {c.number: c.raw for c in cells if c.access == "setting"}:
        raise UnwritableError(f"a DataView of {cells[0].loop} does not hold what it was given")
    return text


def read_dataview(text: str) -> Listing:
    """The new values of C, DS and DF rows; rows without, and rows of other banks, only have to be right."""
    listing = Listing(mixed=True)
    lines = _lines(text)
    if not lines or not HEADER.fullmatch(lines[0]):
        raise ListingError("this is no DataView: the first line is not like -1,0,0")
    rows = list(_rows(lines[1:]))
    if lines[0].startswith("0") and any(value for _, _, _, value in rows):
        raise ListingError("the first line says that no row has a new value, but one has (-1 in place of 0)")
    for line, address, code, value in rows:
        _typed(line, address, code)
        number = SPACE.parse(address)
        if number is not None and value:
            listing.add(number, _content(line, address, SPACE.kind(number), int(value)), address, line)
    _compare(listing, rows, lines)
    return listing


def _lines(text: str) -> list[str]:
    """Lines by LF or CRLF; nothing else ends one."""
    lines = text.removeprefix(MARK).replace("\r\n", "\n").split("\n")
    while lines and not lines[-1].strip():
        lines.pop()
    return [line.strip(" ") for line in lines]


def _rows(lines: list[str]) -> Iterator[tuple[int, str, str, str]]:
    """Line, address, type code and new value of every row that has an address."""
    for line, text in enumerate(lines, start=2):
        if EMPTY.fullmatch(text):
            continue
        match = ROW.fullmatch(text)
        if match is None:
            raise ListingError(f"{text[:60]!r} is not a row of a DataView: address,type or address,type,value", line)
        if line > ROWS + 1:
            raise ListingError(f"a DataView has at most {ROWS} rows; the address {match.group(1)} is beyond", line)
        yield line, match.group(1), match.group(2), match.group(3) or ""


def _typed(line: int, address: str, code: str) -> None:
    from pyclickplc.addresses import normalize_address
    from pyclickplc.dataview import get_data_type_for_address

    kind = get_data_type_for_address(address)
    if kind is None or normalize_address(address) != address:
        raise ListingError(f"{address} is not an address of CLICK", line)
    if int(code) != CODES[kind.name]:
        raise ListingError(f"{address} has the type {CODES[kind.name]}, but the row says {code}", line)


def _content(line: int, address: str, kind: Kind, stored: int) -> int:
    """A stored number as raw content: a switch, 16 bits with their sign spread over 32, the bits of a float."""
    fits = {
        BIT: stored <= BIT_MAX,
        INT16: stored <= 0x7FFF or SIGNED <= stored <= 0xFFFFFFFF,
        SINGLE: stored <= 0xFFFFFFFF and kind.read(kind.show(min(stored, 0xFFFFFFFF))) == stored,
    }
    if not fits[kind]:
        raise ListingError(f"{address}: the new value {stored} is not {kind.holds}", line)
    return stored & kind.highest


def _compare(listing: Listing, rows: list[tuple[int, str, str, str]], lines: list[str]) -> None:
    """What pyclickplc reads must be the same."""
    from pyclickplc.dataview import DataViewFile

    try:
        content = (MARK + "\r\n".join(lines) + "\r\n").encode("utf-16-le")
    except UnicodeEncodeError:
        raise ListingError("a character that is not Unicode") from None
    view = read_with(DataViewFile.load, content)
    read = {line: row for line, row in enumerate(view.rows, start=2) if row.address}
    for line, address, _, value in rows:
        row = read.pop(line, None)
        if row is None or row.address != address or (row.new_value is None) != (not value):
            raise ListingError(f"pyclickplc does not read the row of {address} as it is written", line)
        number = SPACE.parse(address)
        if (
            number is not None
            and number in listing.words
            and SPACE.kind(number).read(row.new_value) != listing.words[number]
        ):
            raise ListingError(f"{address}: pyclickplc reads {row.new_value} from {value}", line)
    if read:
        raise ListingError(f"pyclickplc reads a row that is not there: {next(iter(read.values())).address}")
