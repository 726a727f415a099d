"""Memory listings: what they hold, text, CSV, JSON and Modbus, and the file kinds of an image."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from math import isinf
from sys import float_info
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

from pidcfg.encoders.codecs import WORD_MAX
from pidcfg.encoders.image import Cell, Image
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import pad_right, width_of
from pidcfg.text.writer import json_line, json_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.encoders.image import Settings
    from pidcfg.encoders.parameters import AnyImage, Program
    from pidcfg.encoders.regmap import Kind, Space

# ----------------------------------------------------------------------------------------------------------------------
# What a listing holds, and what its files have in common: comment lines with settings, CSV rows, JSON documents.
# A listing carries what no register or parameter holds: in JSON under ``settings`` and ``plc``, in text and CSV as
# comment lines. Listings of memory are in `pidcfg.encoders.listing`, those of named parameters in
# `pidcfg.encoders.parameter_files`.

PLC_PREFIX, LOOP_PREFIX = "# plc: ", "# loop: "
"""How the comment lines begin that carry what no register holds: one for the file, one a loop."""
DECIMAL_PATTERN = re.compile(r"-?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?")
WHOLE_PATTERN = re.compile(r"-?[0-9]{1,10}")
JSON_VERSION = 1
"""Of JSON listings."""
MAX_NAMES = 12
"""Names that a note lists before it only counts."""


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
    settings: tuple[Settings, ...] = ()
    plc: Settings = field(default_factory=dict)
    vendor: str | None = None
    is_mixed: bool = False
    """The file is about more than loops, so that words outside them are nothing to tell."""
    lines: dict[int | str, int] = field(default_factory=dict)
    """Where each word stands, and how its address is written."""
    shown_addresses: dict[object, str] = field(default_factory=dict)
    has_settings: bool = False
    """Whether it says what no register holds as pidcfg writes it, so that what it does not say is not there."""
    notes: tuple[str, ...] = ()
    """What the reader passed over or takes otherwise than it is written."""
    is_leading: bool = False
    """Whether it says what the words of other files of the same image are for."""

    def make_image(self, vendor: str) -> Any:
        """The memory that the listing is of."""
        cells = tuple(Cell("", number, raw, "") for number, raw in sorted(self.words.items()))
        return Image(vendor, cells, self.settings, self.plc)

    def add(self, address: int | str, value: Any, shown: str, line: int = 1, column: int = 1) -> None:
        """Takes a word; the same address twice is refused."""
        if address in self.words:
            first = f"; first in line {self.lines[address]}" if address in self.lines else ""
            raise ListingError(f"{shown} stands here again{first}", line, column)
        self.words[address] = value
        self.lines[address] = line
        self.shown_addresses[address] = shown

    def join(self, other: Listing) -> None:
        """Takes another file of the same image; an address in both is refused."""
        for address, raw in other.words.items():
            self.add(address, raw, other.shown_addresses[address], other.lines[address])
        self.is_mixed |= other.is_mixed
        self.notes = (*self.notes, *other.notes)
        self.settings, self.plc = (*self.settings, *other.settings), {**self.plc, **other.plc}


def settings_comments(image: AnyImage) -> list[str]:
    """The comment lines above the words: the settings for the way back."""
    return [
        PLC_PREFIX + json_line(dict(image.plc)),
        *(LOOP_PREFIX + json_line(dict(entry)) for entry in image.settings),
    ]


def csv_text(header: Iterable[str], rows: Iterable[Iterable[object]], comments: Iterable[str]) -> str:
    """A CSV file: the comment lines above, the header and the rows."""
    return "".join(f"{line}\n" for line in comments) + csv_lines([header, *rows])


def csv_lines(rows: Iterable[Iterable[object]], end: str = "\n", delimiter: str = ",") -> str:
    """Rows as CSV, each with this line end."""
    out = io.StringIO()
    csv.writer(out, delimiter=delimiter, lineterminator=end).writerows(rows)
    return out.getvalue()


def json_listing(image: AnyImage, checklist: tuple[str, ...], words: Sequence[Mapping[str, object]]) -> str:
    """A JSON listing of words that are ready to be written."""
    document = {
        "version": JSON_VERSION,
        "vendor": image.vendor,
        "words": words,
        "settings": [dict(s) for s in image.settings],
        "plc": dict(image.plc),
        "checklist": list(checklist),
    }
    return json_text(document)


def fill_from_json(listing: Listing, text: str, read: Callable[[Mapping[str, Any], str], tuple[Any, Any]]) -> Listing:
    """Puts a JSON document into a listing; ``read`` makes key and content of an entry and its place for messages."""
    document = load_json(text)
    version = document.get("version", JSON_VERSION) if isinstance(document, dict) else JSON_VERSION
    if version != JSON_VERSION or not isinstance(version, int) or isinstance(version, bool):
        raise ListingError(f"the JSON document has version {version}; this pidcfg reads version {JSON_VERSION}")
    words = document.get("words") if isinstance(document, dict) else None
    if not isinstance(words, list):
        raise ListingError("the JSON document has no list 'words'")
    for i, entry in enumerate(words):
        if not isinstance(entry, dict) or not isinstance(entry.get("address"), str):
            raise ListingError(f"words[{i}] has no text 'address'")
        listing.add(*read(entry, f"words[{i}] ({entry['address']})"), entry["address"])
    take_settings(document, listing)
    listing.vendor = document.get("vendor")
    return listing


def load_json(text: str) -> Any:
    """A JSON document without NaN and infinities, also such as only a computer makes of a number."""
    try:
        return json.loads(text, parse_constant=_refuse_constant, parse_float=_finite_number)
    except json.JSONDecodeError as error:
        raise ListingError(f"not JSON: {error.msg}", error.lineno, error.colno) from None
    except ListingError:
        raise
    except ValueError:
        raise ListingError("a number of the JSON document has too many digits") from None
    except RecursionError:
        raise ListingError("the JSON document is nested too deeply") from None


def _refuse_constant(name: str) -> None:
    raise ListingError(f"{name} is not a number of JSON")


def _finite_number(text: str) -> float:
    value = float(text)
    if isinf(value):
        raise ListingError(f"{text} is too large for a number; the limit is {float_info.max:.1e}")
    return value


def read_settings_line(line: str, number: int, listing: Listing) -> bool:
    """Whether a line is blank or a comment; the settings are taken from theirs."""
    for start in (PLC_PREFIX, LOOP_PREFIX):
        if line.startswith(start):
            try:
                entry = load_json(line.removeprefix(start))
            except ListingError as error:
                raise ListingError(str(error), number, len(start) + error.column) from None
            if not isinstance(entry, dict):
                raise ListingError("the settings are not a mapping", number, len(start) + 1)
            if start == PLC_PREFIX:
                listing.plc, listing.has_settings = entry, True
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
    listing.has_settings = {"settings", "plc"} <= document.keys()


def shorten_names(names: list[str]) -> str:
    """Names for a note; of many the first, and how many more there are."""
    return ", ".join(names[:MAX_NAMES]) + (f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else "")


def decimal_content(text: str, kind: Kind) -> int | None:
    """The raw content of a value as a listing writes it; None when the address cannot hold it."""
    if not DECIMAL_PATTERN.fullmatch(text):
        return None
    return kind.read(int(text) if WHOLE_PATTERN.fullmatch(text) else float(text))


# --- Tables with a header, as programs write them and spreadsheets save them again ------------------------------------
#
# A header counts whatever its letters; commas, semicolons or tabs may stand between cells; columns may be in any
# order, with empty ones behind them. Comment lines that a spreadsheet took for cells are put together again.

DELIMITERS = (",", ";", "\t")
COMMENT_STARTS = ("#", '"#')
"""How a comment line begins; in quotes where a spreadsheet saved it."""


def first_line(text: str) -> str:
    """The first line that is neither blank nor a comment."""
    return next((s for line in text.splitlines() if (s := line.strip()) and not s.startswith(COMMENT_STARTS)), "")


def find_delimiter(text: str) -> str:
    """What stands between the cells of a table, by its first line."""
    head = first_line(text)
    return max(DELIMITERS, key=head.count)


def column_names(text: str) -> list[str]:
    """The cells of the first line that is not a comment, in small letters."""
    try:
        return [
            cell.strip().lower() for cell in next(csv.reader([first_line(text)], delimiter=find_delimiter(text)), [])
        ]
    except csv.Error:
        return []


def table_rows(
    text: str, listing: Listing, required: tuple[str, ...], aliases: Mapping[str, str] | None = None
) -> Iterator[tuple[int, dict[str, str]]]:
    """The rows of a table with their line numbers; comment lines are read into ``listing``.

    ``required``: the columns that must be there, ``hex|value`` for one of two. ``aliases``: columns by names that
    count as well. Raises `ListingError`.
    """
    separator = find_delimiter(text)
    header: list[str] | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        if read_settings_line(_restore_comment(line, separator), number, listing):
            continue
        try:
            cells = [cell.strip() for cell in next(csv.reader([line], delimiter=separator, strict=True))]
        except csv.Error as error:
            raise ListingError(f"not CSV: {error}", number) from None
        if header is None:
            known_names = aliases or {}
            header = _read_header([known_names.get(cell.lower(), cell) for cell in cells], required, number)
        elif any(cells):
            if len(cells) < len(header) or any(cells[len(header) :]):
                raise ListingError(f"{cell_count_text(cells)} under a header of {len(header)} columns", number)
            yield number, dict(zip(header, cells, strict=False))


def cell_count_text(cells: Sequence[str]) -> str:
    """How many cells stand somewhere, as a sentence begins."""
    return "1 cell stands" if len(cells) == 1 else f"{len(cells)} cells stand"


def _read_header(cells: list[str], required: tuple[str, ...], line: int) -> list[str]:
    """The names of the columns; nothing may stand twice, and the empty ones behind them do not count."""
    names = [cell.lower() for cell in cells]
    while names and not names[-1]:
        names.pop()
    missing = [name for name in required if not set(name.split("|")) & set(names)]
    if missing:
        raise ListingError(f"the header has no column {missing[0].replace('|', ' or ')}", line)
    repeated = next((name for i, name in enumerate(names) if name and name in names[:i]), None)
    if repeated is not None:
        raise ListingError(f"the header has the column {repeated[:40]} twice", line)
    return names


def _restore_comment(line: str, separator: str) -> str:
    """A comment line as it was before a spreadsheet took it for cells; any other line as it is."""
    if not line.startswith(COMMENT_STARTS):
        return line
    try:
        cells = next(csv.reader([line], delimiter=separator)) if line.startswith('"') else [line]
    except csv.Error:
        return line
    return ",".join(cells).rstrip(separator + ",")


# --- Memory listings as text, CSV and JSON, and the way back; for every vendor whose memory has addresses -------------
#
# Readers take nothing on trust: an address twice, content that is no hexadecimal number of the address's size, or a
# hexadecimal and a decimal value that differ are refused with their line.

COLUMNS = ("address", "hex", "value", "loop", "field")
COLUMN_ALIASES = {"element": "address", "decimal": "value", "dec": "value"}
"""What programming software calls these columns."""
LEADING_ZERO_PATTERN = re.compile(r"0[0-9]")
"""Digits that nobody writes before a decimal number."""
HEX_PATTERN = re.compile(r"(0[xX])?[0-9A-Fa-f]{1,8}")
HEADERS_ADVICE = "the header 'address,hex', or 'address,value' where the numbers are decimal"


def write_text(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """One word a line: address, hexadecimal (a BCD word reads as its digits), decimal, loop, register."""
    del checklist
    lines = [f"# {image.vendor} memory listing: address, hex, decimal, loop, register", *settings_comments(image)]
    hex_size = max((c.kind.digits for c in image.cells), default=1)
    text_size = max((5, *(len(c.text) for c in image.cells)))
    width = max((width_of(c.loop or "-") for c in image.cells), default=1)
    lines += [
        f"{c.address:<7} {c.hex:>{hex_size}}  {c.text:>{text_size}}  {pad_right(_loop_text(c.loop), width)}  {c.field}"
        for c in image.cells
    ]
    return "\n".join(lines) + "\n"


def _loop_text(loop: str | None) -> str:
    return "-" if loop is None else loop.replace(" ", "_")


def read_text(text: str, space: Space) -> Listing:
    """The first two columns of each line and the settings comment; anything after them is for people."""
    listing = Listing()
    for number, line in enumerate(text.splitlines(), start=1):
        if read_settings_line(line, number, listing):
            continue
        parts = line.split()
        if len(parts) == 1:
            raise ListingError(f"the word of {parts[0]} is missing", number, len(line.rstrip()) + 1)
        address = _parse_address(parts[0], space, number, line.index(parts[0]) + 1)
        kind = space.kind_of(address)
        word = _parse_raw(parts[1], kind, number, line.index(parts[1], len(parts[0])) + 1)
        if len(parts) > 2 and DECIMAL_PATTERN.fullmatch(parts[2]):
            _check_agreement(word, parts[2], kind, parts[0], number)
        listing.add(address, word, parts[0], number)
    return listing


def write_csv(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """Columns address, hex, value, loop, field; names are safe for spreadsheets by the schema's rule for names."""
    del checklist
    rows = ((c.address, c.hex, c.text, c.loop or "", c.field) for c in image.cells)
    return csv_text(COLUMNS, rows, settings_comments(image))


def read_csv(text: str, space: Space) -> Listing:
    """Rows by their header, so that columns may be reordered, added or (but for address and content) left out."""
    listing = Listing()
    for number, row in table_rows(text, listing, required=("address", "hex|value"), aliases=COLUMN_ALIASES):
        address = _parse_address(row["address"], space, number, 1)
        listing.add(address, _row_content(row, space.kind_of(address), number), row["address"], number)
    return listing


def _row_content(row: Mapping[str, str], kind: Kind, number: int) -> int:
    """The raw content of a row: its hexadecimal digits, its value, or both where they agree."""
    if row.get("hex"):
        raw = _parse_raw(row["hex"], kind, number, 1)
        _check_agreement(raw, row.get("value"), kind, row["address"], number)
        return raw
    if LEADING_ZERO_PATTERN.match(row.get("value", "")):
        message = f"{row['address']}: {row['value']} looks hexadecimal and stands in a column of decimal values"
        raise ListingError(f"{message}; call the column Hex, or write it without the zeros before it", number)
    content = decimal_content(row.get("value", ""), kind)
    if content is None:
        raise ListingError(f"{row['address']}: {row.get('value', '')!r} is not {kind.holds}", number)
    return content


def write_json(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """The layout of the public interface, spelled out key by key."""
    return json_listing(
        image, checklist, [{"address": cell.address, "value": cell.value} | cell.data() for cell in image.cells]
    )


def read_json(text: str, space: Space) -> Listing:
    """``words`` with address and value, and the settings."""

    def read_word(entry: Settings, place: str) -> tuple[int, int]:
        address = _parse_address(entry["address"], space, 1, 1)
        return address, _json_content(entry, space.kind_of(address), place)

    return fill_from_json(Listing(), text, read_word)


def _json_content(entry: Mapping[str, object], kind: Kind, place: str) -> int:
    """The raw content of an entry; its hexadecimal digits must say the same as its value."""
    value = entry.get("value")
    raw = kind.read(value)
    if raw is None:
        raise ListingError(f"{place}: the value {json.dumps(value)} is not {kind.holds}")
    if "hex" in entry and (not isinstance(entry["hex"], str) or _parse_raw(entry["hex"], kind, 1, 1) != raw):
        raise ListingError(f"{place}: hex {entry['hex']!r} and value {json.dumps(value)} differ")
    return raw


def _parse_address(text: str, space: Space, line: int, column: int) -> int:
    address = space.parse(text.upper())
    if address is None:
        raise ListingError(f"{text!r} is not an address of this vendor", line, column)
    return address


def _parse_raw(text: str, kind: Kind, line: int, column: int) -> int:
    if not HEX_PATTERN.fullmatch(text) or int(text, 16) > kind.highest:
        raise ListingError(
            f"{text!r} is not {kind.name} content of up to {kind.digits} hexadecimal digits", line, column
        )
    return int(text, 16)


def _check_agreement(raw: int, value: str | None, kind: Kind, address: str, line: int) -> None:
    """The two spellings of a content must say the same."""
    if value and value != kind.text(raw) and decimal_content(value, kind) != raw:
        raise ListingError(f"{address}: hex {kind.hex(raw)} is {kind.text(raw)}, but the value says {value}", line)


# --- A Modbus map of an image: which coil or holding register a client reads or writes, with the value to write -------
#
# A value of two registers takes two rows, the low word first.

Table = Literal["coil", "discrete", "holding", "input"]
MODBUS_COLUMNS = ("table", "register", "reference", "address", "value", "hex", "access", "loop", "field")
MAX_FIVE_DIGIT_REGISTER = 9_999
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
    return str((short if register < MAX_FIVE_DIGIT_REGISTER else long) + register).zfill(5)


def register_rows(cell: Cell, place: Place) -> Iterator[tuple[int, int, str]]:
    """Each register of a cell: its number, its content, and what is added to the field's name."""
    for part in range(place.width):
        shift = place.shift(part)
        name = "" if place.width == 1 else (", high word" if shift else ", low word")
        yield place.register + part, cell.raw >> shift & WORD_MAX, name


def write_modbus(image: Image, checklist: tuple[str, ...], numbering: Numbering) -> str:
    """Coils and registers in the order of the image."""
    del checklist
    return modbus_csv(image, ((cell, numbering.place(cell.number)) for cell in image.cells))


def modbus_csv(image: AnyImage, cells: Iterable[tuple[Cell, Place]]) -> str:
    """Coils and registers, each with its value; of a switch in a register the bit stands behind a point."""
    table: list[tuple[object, ...]] = []
    for c, place in cells:
        digits = min(c.kind.digits, 4)
        bit = "" if place.bit is None else f".{place.bit}"
        for register, content, part in register_rows(c, place):
            where = (place.table, f"{register}{bit}", f"{reference(place.table, register)}{bit}", c.address)
            table.append((*where, content, f"{content:0{digits}X}", c.access, c.loop or "", c.field + part))
    return csv_text(MODBUS_COLUMNS, table, settings_comments(image))


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
        contents = parts.setdefault(address, {})
        if part in contents:
            raise ListingError(f"{shown} stands here again", number)
        contents[part] = int(row["value"])
        listing.lines[address] = number
    for address, contents in parts.items():
        _join_registers(listing, space, numbering, address, contents)
    return listing


def _join_registers(
    listing: Listing, space: Space, numbering: Numbering, address: int, contents: dict[int, int]
) -> None:
    """The registers of one address put together; half a value is refused."""
    line, name = listing.lines[address], space.name(address)
    if len(contents) < numbering.place(address).width:
        raise ListingError(f"{name}: one of its two registers is missing", line)
    raw = sum(content << 16 * part for part, content in contents.items())
    if raw > space.kind_of(address).highest:
        raise ListingError(f"{name}: {raw} is not the state of a switch", line)
    listing.add(address, raw, name, line)


# --- The file kinds of an image: how each is written, and how it is read back -----------------------------------------

CONFLICT = "conflict"
"""How a line of a merge's report begins that says what was left out because something else stands in its place."""
Write = Callable[[Any, tuple[str, ...]], str | Mapping[str, str]]
"""Image (or `Program`) and checklist to a text, or to several, each by what is added to the file's name."""
Read = Callable[[str], Listing]
Merge = Callable[[Any, str], tuple[str, tuple[str, ...]]]
"""Image and the text of a file that is the user's to the text of the file with both, and a report of what was done."""


class UnwritableError(ValueError):
    """What a format cannot hold, although the PLC can: named with its loop or address."""


@frozen
class FileKind:
    """One output format: its name, what it is for, writer, reader, and how a file of it begins."""

    name: str
    title: str
    write: Write
    read: Read
    looks_like: Callable[[str], bool]
    encoding: str = "utf-8"
    merge: Merge | None = None
    """How the image goes into a file that is the user's (``--into``)."""
    needs_into: bool = False
    """The format makes no sense but inside a file that is the user's."""
    carries_checklist: bool = False
    """Whether the checklist stands in the file itself."""
    is_complete: bool = True
    """Whether every register has its value in it."""
    may_be_partial: bool = False
    """Whether it may hold some registers only, to be written over what the PLC has."""
    read_program: Callable[[str, str], Listing] | None = None
    """Reads the program of that name, where a file may hold several."""


LISTING_HEADERS = ({"address"}, {"element"})
"""Columns of which the table of a memory listing has one and no other."""


def detect_kind(text: str, kinds: Mapping[str, FileKind]) -> FileKind | None:
    """The format that a text is in, by its first characters; None when it looks like none."""
    return next((kind for kind in kinds.values() if kind.looks_like(text)), None)


def listing_kinds(space: Space, title: str, numbering: Numbering | None = None) -> dict[str, FileKind]:
    """The formats that every vendor with addresses has: text, csv, json, and modbus where its numbering is known."""
    address_line = re.compile(rf"({'|'.join(bank.prefix for bank in space.banks)})[0-9]\w*(\s|$)", re.IGNORECASE)
    kinds = [
        FileKind(
            "text",
            title,
            write_text,
            partial(read_text, space=space),
            lambda text: address_line.match(first_line(text)) is not None,
            may_be_partial=True,
        ),
        FileKind(
            "csv",
            f"{title} for spreadsheets",
            write_csv,
            partial(read_csv, space=space),
            lambda text: (
                {"address", "element", "table", "tag", "nickname"} & set(column_names(text)) in LISTING_HEADERS
            ),
            may_be_partial=True,
        ),
        FileKind(
            "json",
            f"{title} for programs",
            write_json,
            partial(read_json, space=space),
            lambda text: text.lstrip().startswith("{"),
            carries_checklist=True,
            may_be_partial=True,
        ),
    ]
    if numbering is not None:
        kinds.append(modbus_kind(space, numbering))
    return {kind.name: kind for kind in kinds}


def modbus_kind(space: Space, numbering: Numbering) -> FileKind:
    """The format ``modbus`` by a vendor's numbering, or one that is stated."""
    return FileKind(
        "modbus",
        "Modbus map (CSV)",
        partial(write_modbus, numbering=numbering),
        partial(read_modbus, space=space, numbering=numbering),
        lambda text: "table" in column_names(text),
        may_be_partial=True,
    )


def named_modbus_kind(cells: Callable[[Program], Iterable[tuple[Cell, Place]]]) -> FileKind:
    """The same of named parameters; ``cells``: those that have registers, with their places."""

    def read(_text: str) -> Listing:
        raise ListingError("registers of named parameters do not say what they are of: read them from the PLC (pull)")

    return FileKind(
        "modbus",
        "Modbus map (CSV)",
        lambda image, _checklist: modbus_csv(image, cells(image)),
        read,
        lambda _text: False,
        may_be_partial=True,
    )
