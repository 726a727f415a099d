"""Memory listings as text, CSV and JSON, and the way back; for every vendor whose memory has addresses.

A listing carries what no register holds: in JSON under ``settings`` and ``plc``, in text and CSV as comment lines.
Readers take nothing on trust: an address twice, content that is no hexadecimal number of the address's size, or
a hexadecimal and a decimal value that differ are refused with their line.
"""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Cell, Image
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.parameters import Program
    from pidcfg.encoders.spaces import Kind, Space

COLUMNS = ("address", "hex", "value", "loop", "field")
PLC, LOOP = "# plc: ", "# loop: "
"""How the comment lines begin that carry what no register holds: one for the file, one a loop."""
HEX = re.compile(r"[0-9A-Fa-f]{1,8}")
DECIMAL = re.compile(r"-?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?")
WHOLE = re.compile(r"-?[0-9]{1,10}")


class ListingError(ValueError):
    """A listing that cannot be read, with the place of the fault."""

    def __init__(self, message: str, line: int = 1, column: int = 1) -> None:
        super().__init__(message)
        self.line = line
        self.column = column


@dataclass(slots=True)
class Listing:
    """What a memory listing holds: raw content by address, or by name where a vendor's parameters have names."""

    words: dict[Any, Any] = field(default_factory=dict)
    settings: tuple[Mapping[str, Any], ...] = ()
    plc: Mapping[str, Any] = field(default_factory=dict)
    vendor: str | None = None
    mixed: bool = False
    """The file is about more than loops, so that words outside them are nothing to tell."""
    lines: dict[Any, int] = field(default_factory=dict)
    """Where each word stands, and how its address is written."""
    shown: dict[Any, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    """What the reader passed over or takes otherwise than it is written."""

    def image(self, vendor: str) -> Any:
        """The memory that the listing is of."""
        cells = tuple(Cell("", number, raw, "") for number, raw in sorted(self.words.items()))
        return Image(vendor, cells, self.settings, self.plc)

    def add(self, address: int | str, value: Any, shown: str, line: int = 1, column: int = 1) -> None:
        """Takes a word; the same address twice is refused."""
        if address in self.words:
            raise ListingError(f"{shown} stands here again", line, column)
        self.words[address] = value
        self.lines[address] = line
        self.shown[address] = shown


def comments(image: Image | Program, checklist: tuple[str, ...]) -> list[str]:
    """The comment lines above the words: the checklist for people, the settings for the way back."""
    lines = [f"# check after the download: {item}" for item in checklist]
    lines.append(PLC + json.dumps(dict(image.plc), ensure_ascii=False))
    return lines + [LOOP + json.dumps(dict(entry), ensure_ascii=False) for entry in image.settings]


def write_text(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """One word a line: address, hexadecimal (a BCD word reads as its digits), decimal, loop, register."""
    lines = [f"# {image.vendor} memory listing: address, hex, decimal, loop, register", *comments(image, checklist)]
    wide = max((c.kind.digits for c in image.cells), default=1)
    long = max((5, *(len(c.text) for c in image.cells)))
    width = max((len(c.loop or "-") for c in image.cells), default=1)
    lines += [
        f"{c.address:<7} {c.hex:>{wide}}  {c.text:>{long}}  {_bare(c.loop):<{width}}  {c.field}" for c in image.cells
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
    out = io.StringIO()
    out.writelines(f"{line}\n" for line in comments(image, checklist))
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows((c.address, c.hex, c.text, c.loop or "", c.field) for c in image.cells)
    return out.getvalue()


def read_csv(text: str, space: Space) -> Listing:
    """Rows by their header, so that columns may be reordered, added or (but for address and content) left out."""
    listing = Listing()
    for number, row in csv_rows(text, listing, required=("address", "hex|value")):
        address = _address(row["address"], space, number, 1)
        listing.add(address, _content(row, space.kind(address), number), row["address"], number)
    return listing


def _content(row: Mapping[str, str], kind: Kind, number: int) -> int:
    """The raw content of a row: its hexadecimal digits, its value, or both where they agree."""
    if row.get("hex"):
        raw = _raw(row["hex"], kind, number, 1)
        _agree(raw, row.get("value"), kind, row["address"], number)
        return raw
    read = _decimal(row.get("value", ""), kind)
    if read is None:
        raise ListingError(f"{row['address']}: {row.get('value', '')!r} is not {kind.holds}", number)
    return read


def csv_rows(text: str, listing: Listing, required: tuple[str, ...]) -> Iterator[tuple[int, dict[str, str]]]:
    """The rows of a CSV file with their line numbers; comment lines are read into ``listing``.

    ``required``: the columns that must be there, ``hex|value`` for one of two.
    """
    header: list[str] | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        if settings_line(line, number, listing):
            continue
        try:
            cells = next(csv.reader([line], strict=True))
        except csv.Error as error:
            raise ListingError(f"not CSV: {error}", number) from None
        if header is None:
            header = [cell.strip() for cell in cells]
            missing = [name for name in required if not set(name.split("|")) & set(header)]
            if missing:
                raise ListingError(f"the header has no column {missing[0].replace('|', ' or ')}", number)
            continue
        if len(cells) != len(header):
            raise ListingError(f"{len(cells)} cells stand under a header of {len(header)} columns", number)
        yield number, {key: cell.strip() for key, cell in zip(header, cells, strict=True)}


def write_json(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """The layout of the public interface, spelled out key by key."""
    document = {
        "version": 1,
        "vendor": image.vendor,
        "words": [_json_cell(cell) for cell in image.cells],
        "settings": [dict(s) for s in image.settings],
        "plc": dict(image.plc),
        "checklist": list(checklist),
    }
    return json_text(document)


def _json_cell(cell: Cell) -> dict[str, Any]:
    return {"address": cell.address, "value": cell.value, "hex": cell.hex, "loop": cell.loop, "field": cell.field}


def read_json(text: str, space: Space) -> Listing:
    """``words`` with address and value, and what stands beside them."""
    document = load_json(text)
    words = document.get("words") if isinstance(document, dict) else None
    if not isinstance(words, list):
        raise ListingError("the JSON document has no list 'words'")
    listing = Listing()
    for i, entry in enumerate(words):
        if not isinstance(entry, dict) or not isinstance(entry.get("address"), str):
            raise ListingError(f"words[{i}] has no text 'address'")
        address = _address(entry["address"], space, 1, 1)
        listing.add(
            address, _json_content(entry, space.kind(address), f"words[{i}] ({entry['address']})"), entry["address"]
        )
    take_settings(document, listing)
    listing.vendor = document.get("vendor")
    return listing


def _json_content(entry: Mapping[str, Any], kind: Kind, place: str) -> int:
    """The raw content of an entry; its hexadecimal digits must say the same as its value."""
    value = entry.get("value")
    raw = kind.read(value)
    if raw is None:
        raise ListingError(f"{place}: the value {json.dumps(value)} is not {kind.holds}")
    if "hex" in entry and (not isinstance(entry["hex"], str) or _raw(entry["hex"], kind, 1, 1) != raw):
        raise ListingError(f"{place}: hex {entry['hex']!r} and value {json.dumps(value)} differ")
    return raw


def load_json(text: str) -> Any:
    """A JSON document without NaN and infinities."""
    try:
        return json.loads(text, parse_constant=_no_constant)
    except json.JSONDecodeError as error:
        raise ListingError(f"not JSON: {error.msg}", error.lineno, error.colno) from None
    except ValueError:
        raise ListingError("a number of the JSON document has too many digits") from None
    except RecursionError:
        raise ListingError("the JSON document is nested too deeply") from None


def _no_constant(name: str) -> None:
    raise ListingError(f"{name} is not a number of JSON")


def settings_line(line: str, number: int, listing: Listing) -> bool:
    """Whether a line is blank or a comment; the settings are taken from theirs."""
    for start in (PLC, LOOP):
        if line.startswith(start):
            try:
                entry = load_json(line.removeprefix(start))
            except ListingError as error:
                raise ListingError(str(error), number, len(start) + error.column) from None
            if not isinstance(entry, dict):
                raise ListingError("the settings are not a mapping", number, len(start) + 1)
            if start == PLC:
                listing.plc = entry
            else:
                listing.settings = (*listing.settings, entry)
            return True
    return not line.strip() or line.lstrip().startswith("#")


def take_settings(document: Any, listing: Listing) -> None:
    """Settings by loop; what is not of their shape is refused rather than dropped."""
    settings, plc = document.get("settings", []), document.get("plc", {})
    if not isinstance(settings, list) or not all(isinstance(s, dict) for s in settings) or not isinstance(plc, dict):
        raise ListingError("the settings are not a list of mappings, one a loop")
    listing.settings, listing.plc = tuple(settings), plc


def _address(text: str, space: Space, line: int, column: int) -> int:
    address = space.parse(text)
    if address is None:
        raise ListingError(f"{text!r} is not an address of this vendor", line, column)
    return address


def _raw(text: str, kind: Kind, line: int, column: int) -> int:
    if not HEX.fullmatch(text) or int(text, 16) > kind.highest:
        raise ListingError(
            f"{text!r} is not {kind.name} content of up to {kind.digits} hexadecimal digits", line, column
        )
    return int(text, 16)


def _decimal(text: str, kind: Kind) -> int | None:
    """The raw content of a value as a listing writes it; None when the address cannot hold it."""
    if not DECIMAL.fullmatch(text):
        return None
    return kind.read(int(text) if WHOLE.fullmatch(text) else float(text))


def _agree(raw: int, value: str | None, kind: Kind, address: str, line: int) -> None:
    """The two spellings of a content must say the same."""
    if value and _decimal(value, kind) != raw:
        raise ListingError(f"{address}: hex {kind.hex(raw)} is {kind.text(raw)}, but the value says {value}", line)
