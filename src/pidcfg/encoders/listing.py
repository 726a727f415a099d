"""Memory listings as text, CSV and JSON, and the way back; for every vendor whose memory is addressed words.

A listing carries what no register holds: in JSON under ``settings`` and ``plc``, in text and CSV as comment lines.
Readers take nothing on trust: an address twice, a word that is not four hexadecimal digits, or a hexadecimal and a
decimal value that differ are refused with their line.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.words import WORD_MAX

if TYPE_CHECKING:
    from pidcfg.encoders.image import Cell, Image

COLUMNS = ("address", "hex", "value", "loop", "field")
PLC, LOOP = "# plc: ", "# loop: "
"""How the comment lines begin that carry what no register holds: one for the file, one a loop."""
HEX = re.compile(r"[0-9A-Fa-f]{1,4}")
DECIMAL = re.compile(r"[0-9]{1,5}")
ParseAddress = Callable[[str], int | None]


class ListingError(ValueError):
    """A listing that cannot be read, with the place of the fault."""

    def __init__(self, message: str, line: int = 1, column: int = 1) -> None:
        super().__init__(message)
        self.line = line
        self.column = column


@dataclass(slots=True)
class Listing:
    """What a memory listing holds: raw words by address, and what was written beside them."""

    words: dict[int, int] = field(default_factory=dict)
    settings: tuple[Mapping[str, Any], ...] = ()
    plc: Mapping[str, Any] = field(default_factory=dict)
    vendor: str | None = None
    lines: dict[int, int] = field(default_factory=dict)
    """Where each word stands, and how its address is written."""
    shown: dict[int, str] = field(default_factory=dict)

    def add(self, address: int, value: int, shown: str, line: int = 1, column: int = 1) -> None:
        """Takes a word; the same address twice is refused."""
        if address in self.words:
            raise ListingError(f"{shown} stands here again", line, column)
        self.words[address] = value
        self.lines[address] = line
        self.shown[address] = shown


def comments(image: Image, checklist: tuple[str, ...]) -> list[str]:
    """The comment lines above the words: the checklist for people, the settings for the way back."""
    lines = [f"# check after the download: {item}" for item in checklist]
    lines.append(PLC + json.dumps(dict(image.plc), ensure_ascii=False))
    return lines + [LOOP + json.dumps(dict(entry), ensure_ascii=False) for entry in image.settings]


def write_text(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """One word a line: address, hexadecimal (a BCD word reads as its digits), decimal, loop, register."""
    lines = [f"# {image.vendor} memory listing: address, hex, decimal, loop, register", *comments(image, checklist)]
    width = max((len(c.loop or "-") for c in image.cells), default=1)
    lines += [f"{c.address:<7} {c.hex}  {c.value:>5}  {_bare(c.loop):<{width}}  {c.field}" for c in image.cells]
    return "\n".join(lines) + "\n"


def _bare(loop: str | None) -> str:
    return "-" if loop is None else loop.replace(" ", "_")


def read_text(text: str, parse: ParseAddress) -> Listing:
    """The first two columns of each line and the settings comment; anything after them is for people."""
    found = Listing()
    for number, line in enumerate(text.splitlines(), start=1):
        if _comment(line, number, found):
            continue
        parts = line.split()
        if len(parts) == 1:
            raise ListingError(f"the word of {parts[0]} is missing", number, len(line.rstrip()) + 1)
        address = _address(parts[0], parse, number, line.index(parts[0]) + 1)
        word = _word(parts[1], number, line.index(parts[1], len(parts[0])) + 1)
        if len(parts) > 2 and DECIMAL.fullmatch(parts[2]):
            _agree(word, parts[2], parts[0], number)
        found.add(address, word, parts[0], number)
    return found


def write_csv(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """Columns address, hex, value, loop, field; names are safe for spreadsheets by the schema's rule for names."""
    out = io.StringIO()
    out.writelines(f"{line}\n" for line in comments(image, checklist))
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows((c.address, c.hex, c.value, c.loop or "", c.field) for c in image.cells)
    return out.getvalue()


def read_csv(text: str, parse: ParseAddress) -> Listing:
    """Rows by their header, so that columns may be reordered, added or (but for address and hex) left out."""
    found = Listing()
    for number, row in csv_rows(text, found, required=("address", "hex")):
        address = _address(row["address"], parse, number, 1)
        word = _word(row["hex"], number, 1)
        _agree(word, row.get("value"), row["address"], number)
        found.add(address, word, row["address"], number)
    return found


def csv_rows(text: str, found: Listing, required: tuple[str, ...]) -> Iterator[tuple[int, dict[str, str]]]:
    """The rows of a CSV file with their line numbers; comment lines are read into ``found``."""
    header: list[str] | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        if _comment(line, number, found):
            continue
        try:
            cells = next(csv.reader([line], strict=True))
        except csv.Error as error:
            raise ListingError(f"not CSV: {error}", number) from None
        if header is None:
            header = [cell.strip() for cell in cells]
            missing = [name for name in required if name not in header]
            if missing:
                raise ListingError(f"the header has no column {missing[0]!r}", number)
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
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def _json_cell(cell: Cell) -> dict[str, Any]:
    return {"address": cell.address, "value": cell.value, "hex": cell.hex, "loop": cell.loop, "field": cell.field}


def read_json(text: str, parse: ParseAddress) -> Listing:
    """``words`` with address and value, and what stands beside them."""
    document = _load_json(text)
    words = document.get("words") if isinstance(document, dict) else None
    if not isinstance(words, list):
        raise ListingError("the JSON document has no list 'words'")
    found = Listing()
    for i, entry in enumerate(words):
        if not isinstance(entry, dict) or not isinstance(entry.get("address"), str):
            raise ListingError(f"words[{i}] has no text 'address'")
        address = _address(entry["address"], parse, 1, 1)
        value = entry.get("value")
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= WORD_MAX:
            raise ListingError(
                f"words[{i}] ({entry['address']}): the value {json.dumps(value)} is not a word of 0 to {WORD_MAX}"
            )
        if "hex" in entry and (not isinstance(entry["hex"], str) or _word(entry["hex"], 1, 1) != value):
            raise ListingError(f"words[{i}] ({entry['address']}): hex {entry['hex']!r} and value {value} differ")
        found.add(address, value, entry["address"])
    _take_settings(document, found)
    found.vendor = document.get("vendor")
    return found


def _load_json(text: str) -> Any:
    try:
        return json.loads(text, parse_constant=_no_constant)
    except json.JSONDecodeError as error:
        raise ListingError(f"not JSON: {error.msg}", error.lineno, error.colno) from None
    except RecursionError:
        raise ListingError("the JSON document is nested too deeply") from None


def _no_constant(name: str) -> None:
    raise ListingError(f"{name} is not a number of JSON")


def _comment(line: str, number: int, found: Listing) -> bool:
    """Whether a line is blank or a comment; the settings are taken from theirs."""
    for start in (PLC, LOOP):
        if line.startswith(start):
            try:
                entry = _load_json(line.removeprefix(start))
            except ListingError as error:
                raise ListingError(str(error), number, len(start) + error.column) from None
            if not isinstance(entry, dict):
                raise ListingError("the settings are not a mapping", number, len(start) + 1)
            if start == PLC:
                found.plc = entry
            else:
                found.settings = (*found.settings, entry)
            return True
    return not line.strip() or line.lstrip().startswith("#")


def _take_settings(document: Any, found: Listing) -> None:
    """Settings by loop; what is not of their shape is refused rather than dropped."""
    settings, plc = document.get("settings", []), document.get("plc", {})
    if not isinstance(settings, list) or not all(isinstance(s, dict) for s in settings) or not isinstance(plc, dict):
        raise ListingError("the settings are not a list of mappings, one a loop")
    found.settings, found.plc = tuple(settings), plc


def _address(text: str, parse: ParseAddress, line: int, column: int) -> int:
    address = parse(text)
    if address is None:
        raise ListingError(f"{text!r} is not an address of this vendor", line, column)
    return address


def _word(text: str, line: int, column: int) -> int:
    if not HEX.fullmatch(text):
        raise ListingError(f"{text!r} is not a word of up to four hexadecimal digits", line, column)
    return int(text, 16)


def _agree(word: int, decimal: str | None, address: str, line: int) -> None:
    """The two spellings of a word must say the same."""
    if decimal and (not DECIMAL.fullmatch(decimal) or int(decimal) != word):
        raise ListingError(f"{address}: hex {word:04X} is {word}, but the value says {decimal}", line)
