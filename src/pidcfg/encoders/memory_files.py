"""Memory listings as text, CSV and JSON, and the way back; for every vendor whose memory has addresses.

Readers take nothing on trust: an address twice, content that is no hexadecimal number of the address's size, or
a hexadecimal and a decimal value that differ are refused with their line.
"""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

from pidcfg.display_width import to_left, width_of
from pidcfg.encoders.listing import (
    DECIMAL,
    Listing,
    ListingError,
    comments,
    csv_text,
    decimal_content,
    fill_from_json,
    json_listing,
    settings_line,
)
from pidcfg.encoders.tables import table_rows

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.encoders.image import Cell, Image
    from pidcfg.encoders.spaces import Kind, Space

COLUMNS = ("address", "hex", "value", "loop", "field")
OTHER_NAMES = {"element": "address", "decimal": "value", "dec": "value"}
"""What programming software calls these columns."""
PADDED = re.compile(r"0[0-9]")
"""Digits that nobody writes before a decimal number."""
HEX = re.compile(r"[0-9A-Fa-f]{1,8}")


def write_text(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """One word a line: address, hexadecimal (a BCD word reads as its digits), decimal, loop, register."""
    lines = [f"# {image.vendor} memory listing: address, hex, decimal, loop, register", *comments(image, checklist)]
    wide = max((c.kind.digits for c in image.cells), default=1)
    long = max((5, *(len(c.text) for c in image.cells)))
    width = max((width_of(c.loop or "-") for c in image.cells), default=1)
    lines += [
        f"{c.address:<7} {c.hex:>{wide}}  {c.text:>{long}}  {to_left(_bare(c.loop), width)}  {c.field}"
        for c in image.cells
    ]
    return "\n".join(lines) + "\n"


def _bare(loop: str | None) -> str:
    return "-" if loop is None else loop.replace(" ", "_")


def read_text(text: str, space: Space) -> Listing:
    """The first two columns of each line and the settings comment; anything after them is for people."""
    listing = Listing()
    for number, line in enumerate(text.splitlines(), start=1):
        if settings_line(line, number, listing):
            continue
        parts = line.split()
        if len(parts) == 1:
            raise ListingError(f"the word of {parts[0]} is missing", number, len(line.rstrip()) + 1)
        address = _address(parts[0], space, number, line.index(parts[0]) + 1)
        kind = space.kind(address)
        word = _raw(parts[1], kind, number, line.index(parts[1], len(parts[0])) + 1)
        if len(parts) > 2 and DECIMAL.fullmatch(parts[2]):
            _agree(word, parts[2], kind, parts[0], number)
        listing.add(address, word, parts[0], number)
    return listing


def write_csv(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """Columns address, hex, value, loop, field; names are safe for spreadsheets by the schema's rule for names."""
    rows = ((c.address, c.hex, c.text, c.loop or "", c.field) for c in image.cells)
    return csv_text(COLUMNS, rows, comments(image, checklist))


def read_csv(text: str, space: Space) -> Listing:
    """Rows by their header, so that columns may be reordered, added or (but for address and content) left out."""
    listing = Listing()
    for number, row in table_rows(text, listing, required=("address", "hex|value"), other_names=OTHER_NAMES):
        address = _address(row["address"], space, number, 1)
        listing.add(address, _content(row, space.kind(address), number), row["address"], number)
    return listing


def _content(row: Mapping[str, str], kind: Kind, number: int) -> int:
    """The raw content of a row: its hexadecimal digits, its value, or both where they agree."""
    if row.get("hex"):
        raw = _raw(row["hex"], kind, number, 1)
        _agree(raw, row.get("value"), kind, row["address"], number)
        return raw
    if PADDED.match(row.get("value", "")):
        message = f"{row['address']}: {row['value']} looks hexadecimal and stands in a column of decimal values"
        raise ListingError(f"{message}; call the column Hex, or write it without the zeros before it", number)
    content = decimal_content(row.get("value", ""), kind)
    if content is None:
        raise ListingError(f"{row['address']}: {row.get('value', '')!r} is not {kind.holds}", number)
    return content


def write_json(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """The layout of the public interface, spelled out key by key."""
    return json_listing(image, checklist, [_json_cell(cell) for cell in image.cells])


def _json_cell(cell: Cell) -> dict[str, Any]:
    return {"address": cell.address, "value": cell.value, "hex": cell.hex, "loop": cell.loop, "field": cell.field}


def read_json(text: str, space: Space) -> Listing:
    """``words`` with address and value, and the settings."""

    def word(entry: Mapping[str, Any], place: str) -> tuple[int, int]:
        address = _address(entry["address"], space, 1, 1)
        return address, _json_content(entry, space.kind(address), place)

    return fill_from_json(Listing(), text, word)


def _json_content(entry: Mapping[str, Any], kind: Kind, place: str) -> int:
    """The raw content of an entry; its hexadecimal digits must say the same as its value."""
    value = entry.get("value")
    raw = kind.read(value)
    if raw is None:
        raise ListingError(f"{place}: the value {json.dumps(value)} is not {kind.holds}")
    if "hex" in entry and (not isinstance(entry["hex"], str) or _raw(entry["hex"], kind, 1, 1) != raw):
        raise ListingError(f"{place}: hex {entry['hex']!r} and value {json.dumps(value)} differ")
    return raw


def _address(text: str, space: Space, line: int, column: int) -> int:
    address = space.parse(text.upper())
    if address is None:
        raise ListingError(f"{text!r} is not an address of this vendor", line, column)
    return address


def _raw(text: str, kind: Kind, line: int, column: int) -> int:
    if not HEX.fullmatch(text) or int(text, 16) > kind.highest:
        raise ListingError(
            f"{text!r} is not {kind.name} content of up to {kind.digits} hexadecimal digits", line, column
        )
    return int(text, 16)


def _agree(raw: int, value: str | None, kind: Kind, address: str, line: int) -> None:
    """The two spellings of a content must say the same."""
    if value and value != kind.text(raw) and decimal_content(value, kind) != raw:
        raise ListingError(f"{address}: hex {kind.hex(raw)} is {kind.text(raw)}, but the value says {value}", line)
