"""The operand table and ISPSoft's symbol table: written, read, and added to a table of the user's."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from pidcfg.encoders.dpide.image import symbol_name, unusable_reason
from pidcfg.encoders.image import Settings
from pidcfg.encoders.listing import (
    CONFLICT,
    Listing,
    ListingError,
    UnwritableError,
    csv_text,
    load_json,
    settings_comments,
    table_rows,
)
from pidcfg.encoders.maps.dpide import DPIDE_TABLE, LOOPS, PROCESS_OPERANDS, ROWS
from pidcfg.encoders.parameter_files import content_of, read_csv, read_json, safe_cell
from pidcfg.encoders.parameters import Entry, Parameter, Program, content_text
from pidcfg.schemas.base import parse_name
from pidcfg.schemas.dpide import device_range, parse_flag_device, parse_register
from pidcfg.schemas.iec import BOOL
from pidcfg.schemas.numbers import NUMBER
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Data
from pidcfg.text.references import Decision
from pidcfg.text.signs import to_printable

# --- The operand table: a row an operand with device, value and unit, for people who enter a DPIDE instruction --------
#
# It is read back, also when a person wrote it: a row's value may be empty, the loop may stand in a column of its own,
# and devices are taken from their column.

OPERAND_COLUMNS = ("operand", "type", "device", "value", "unit", "description", "loop")
OTHER_TYPES = {"DINT": "DWORD"}
"""Types that the manual names as well."""


def write_operands(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """All operands of every loop, also those without a value."""
    del checklist
    rows: list[tuple[str, ...]] = []
    for settings in image.settings:
        entries = {cell.field: cell for cell in image.cells if cell.loop == settings["loop"]}
        rows += (_operand_row(row, entries, settings) for row in DPIDE_TABLE.rows)
    return csv_text(OPERAND_COLUMNS, rows, settings_comments(image))


def _operand_row(row: Parameter, entries: Mapping[str, Entry], settings: Settings) -> tuple[str, ...]:
    entry = entries.get(row.name)
    value = "" if entry is None or row.name == "I_MV" else content_text(row.type, entry.content)
    device = device_of(settings, row.name) or ""
    unit = unit_of(row, settings, dependent=bool(entries["PID_EQ"].raw))
    return row.name, row.type.name, device, value, unit, row.title, settings["loop"]


def device_of(settings: Settings, operand: str) -> str | None:
    """The device of an operand, as the settings have it."""
    device = settings.get("device") if operand == "I_MV" else (settings.get("devices") or {}).get(operand)
    return None if device is None else str(device)


def unit_of(row: Parameter, settings: Settings, *, dependent: bool) -> str:
    """The unit of an operand: the PV's, the output's, or that of a time or an integral gain."""
    if row.name == "Ti_Ki":
        return "s" if dependent else "1/s"
    unit = settings.get(row.unit, {}).get("unit") or "" if row.unit in {"pv", "output"} else row.unit
    return safe_cell(to_printable(" ".join(str(unit).split())))


def read_operands(text: str) -> Listing:
    """Rows by their header; the loop may be missing where the operand's name has it (``OVEN.SV``)."""
    listing = Listing()
    devices: dict[str, dict[str, str]] = {}
    for number, row in table_rows(text, listing, required=("operand", "value")):
        loop, operand = _loop_and_operand(row)
        kind = ROWS.get(operand)
        if kind is None or not _is_name(loop):
            raise ListingError(
                f"{row['operand'][:60]!r} is not an operand of a loop; the table has columns operand and loop", number
            )
        if row.get("type") and row["type"] not in {kind.type.name, OTHER_TYPES.get(kind.type.name)}:
            raise ListingError(f"{loop}.{operand} is {kind.type.name}, not {row['type'][:20]!r}", number)
        if row["value"]:
            name = f"{loop}.{operand}"
            listing.add(name, content_of(row["value"], kind.type, name, number), name, number)
        elif operand not in PROCESS_OPERANDS:
            raise ListingError(f"{loop}.{operand} has no value", number)
        _take_device(devices.setdefault(loop, {}), operand, row.get("device", ""), number)
    _take_devices(listing, devices)
    return listing


def _loop_and_operand(row: Mapping[str, str]) -> tuple[str, str]:
    """Loop and operand; a loop in its own column may stand before the operand as well."""
    loop = row.get("loop", "")
    return (loop, row["operand"].removeprefix(f"{loop}.")) if loop else LOOPS.split_name(row["operand"])


def _is_name(loop: str) -> bool:
    try:
        return parse_name(loop) == loop
    except ValueError:
        return False


def _take_device(devices: dict[str, str], operand: str, device: str, line: int) -> None:
    if not device:
        return
    try:
        (parse_flag_device if ROWS[operand].type is BOOL else parse_register)(device)
    except ValueError as error:
        raise ListingError(f"{operand}: {error}", line) from None
    devices[operand] = device


def _take_devices(listing: Listing, devices: Mapping[str, Mapping[str, str]]) -> None:
    """Devices of the rows into the settings; where both say one, they must agree."""
    settings: list[Data] = [dict(entry) for entry in listing.settings or ({"loop": loop} for loop in devices)]
    for entry in settings:
        if not isinstance(entry.get("devices", {}), dict):
            continue
        for operand, device in devices.get(str(entry.get("loop")), {}).items():
            setting = device_of(entry, operand)
            if setting not in {None, device}:
                raise ListingError(f"{entry['loop']}.{operand} stands at {device}, but the settings say {setting}")
            if operand == "I_MV":
                entry["device"] = device
            else:
                entry["devices"] = {**entry.get("devices", {}), operand: device}
    listing.settings = tuple(settings)


def read_csv_devices(text: str) -> Listing:
    """The plain CSV listing, with the devices of its column."""
    listing = read_csv(text)
    _take_column(
        listing, ((row["name"], row.get("device", ""), n) for n, row in table_rows(text, Listing(), ("name",)))
    )
    return listing


def read_json_devices(text: str) -> Listing:
    """The JSON listing, with the devices of its entries."""
    listing = read_json(text)
    entries = load_json(text)["words"]
    _take_column(listing, ((entry["address"], entry.get("device") or "", 1) for entry in entries))
    return listing


def _take_column(listing: Listing, rows: Iterator[tuple[str, object, int]]) -> None:
    devices: dict[str, dict[str, str]] = {}
    for name, device, line in rows:
        loop, operand = LOOPS.split_name(name)
        if loop:
            if not isinstance(device, str):
                raise ListingError(f"{name}: the device is not a text", line)
            _take_device(devices.setdefault(loop, {}), operand, device, line)
    _take_devices(listing, devices)


# --- The symbol table of ISPSoft: a CSV file in GBK with a symbol for each operand ------------------------------------

D257 = Decision(
    257,
    "initial values other than 0 of rows of REAL are not confirmed",
    "The symbol table has class VAR, GBK without a mark, CRLF, and the types BOOL, DINT and REAL; the checklist says "
    "that the values of REAL rows must be compared after the import.",
    "An export of ISPSoft has rows of REAL with an initial value, all of them 0, so how it writes others is not known.",
)

COLUMNS = ("Class", "Identifiers", "Address", "Type", "Initial Value", "Comment")
ENCODING = "gbk"
ZERO_TEXT = "0"
"""How exports of ISPSoft write the initial value of a REAL that is 0 (D257)."""


class Symbol(NamedTuple):
    """A row of the table; device and initial value are empty where there is none."""

    name: str
    address: str
    type: str
    value: str
    comment: str
    registers: range
    """The D registers that it takes."""


def write_symbols(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """A symbol for each operand; raises `UnwritableError` for a loop whose name gives none."""
    del checklist
    lines = [",".join(COLUMNS), *(symbol_line(symbol) for symbol in make_symbols(image))]
    return "".join(f"{line}\r\n" for line in lines)


def symbol_line(symbol: Symbol) -> str:
    """A symbol as a row, without a line end."""
    return f"VAR,{symbol.name},{symbol.address},{symbol.type},{symbol.value},{symbol.comment}"


def make_symbols(image: Program) -> Iterator[Symbol]:
    """The symbols of all operands; raises `UnwritableError` for a loop whose name gives none."""
    loops_by_name: dict[str, str] = {}
    for settings in image.settings:
        contents = {cell.field: cell for cell in image.cells if cell.loop == settings["loop"]}
        dependent = bool(contents["PID_EQ"].raw)
        for row in DPIDE_TABLE.rows:
            name = identifier(str(settings["loop"]), row.name)
            other = loops_by_name.setdefault(name.casefold(), str(settings["loop"]))
            if other != settings["loop"]:
                raise UnwritableError(f"loops {other} and {settings['loop']} would share the symbol {name}")
            content = "" if row.name in PROCESS_OPERANDS else content_text(row.type, contents[row.name].content)
            content = ZERO_TEXT if content == "0.0" else content
            comment = _plain_comment(", ".join(_comment_parts(row, settings, dependent=dependent)))
            device = device_of(settings, row.name) or ""
            yield Symbol(name, device, row.type.name, content, comment, _device_registers(row.name, device))


def _device_registers(operand: str, device: str) -> range:
    place = device_range(operand, device) if device else None
    return range(place.first, place.last + 1) if place is not None and place.bank == "D" else range(0)


def identifier(loop: str, operand: str) -> str:
    """The symbol of an operand; raises `UnwritableError` for a name that gives none."""
    reason = unusable_reason(loop)
    if reason is not None:
        raise UnwritableError(f"loop {loop}: no symbols can be made of the name: {reason}")
    return symbol_name(loop, operand)


def _comment_parts(row: Parameter, settings: Settings, *, dependent: bool) -> Iterator[str]:
    yield f"{row.name}: {row.title}"
    if row.name == "I_MV":
        yield f"30 registers {device_range(row.name, settings['device'])}"
    if unit := unit_of(row, settings, dependent=dependent):
        yield unit


def units_in_comments(comments: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """The units of PV and output, where the comments of all their operands are ours and end with the same (D1081).

    ``comments``: of a loop's symbols, by operand.
    """
    units_by_scale: dict[str, dict[str, str]] = {}
    for scale in ("pv", "output"):
        rows = [row for row in DPIDE_TABLE.rows if row.unit == scale and row.name != "I_MV"]
        starts = [(_plain_comment(f"{row.name}: {row.title}, "), comments.get(row.name, "")) for row in rows]
        units = {text.removeprefix(start) for start, text in starts if text.startswith(start)}
        if len(units) == 1 and all(text.startswith(start) for start, text in starts):
            units_by_scale[scale] = {"unit": units.pop()}
    return units_by_scale


def _plain_comment(text: str) -> str:
    """A comment without commas and quotes, of characters that GBK has."""
    plain = text.replace(",", ";").replace('"', "'")
    return plain.encode(ENCODING, "replace").decode(ENCODING)


# --- A symbol table of the user's: read as ISPSoft exports it, and the symbols of all loops added to it (D358) --------
#
# ISPSoft quotes nothing: a comment is the rest of its line, commas and all, and a row may end before it.

D358 = Decision(
    358,
    "a symbol table of the user's keeps what it says",
    "A symbol whose name and device both stand there is the loop's own: its initial value becomes the configuration's, "
    "and nothing else of the row changes. One whose name stands there with another device, or whose device another "
    "symbol has, or shares a register with, is left out and reported; everything else is added at the end.",
    "As with nicknames (D106); a register of I_MV that something else writes would move the output.",
)

IDENTIFIER_COLUMN, ADDRESS_COLUMN, TYPE_COLUMN, VALUE_COLUMN = (
    COLUMNS.index(name) for name in ("Identifiers", "Address", "Type", "Initial Value")
)
MIN_CELLS = 4
"""Class, identifier, address and type; the initial value and the comment may be missing."""
TYPE_REGISTERS = {
    "BOOL": 0,
    "WORD": 1,
    "INT": 1,
    "UINT": 1,
    "DWORD": 2,
    "DINT": 2,
    "UDINT": 2,
    "REAL": 2,
    "LWORD": 4,
    "LREAL": 4,
}
"""Registers that a value of a type takes; a bit none but its own."""
ARRAY_PATTERN = re.compile(r"ARRAY\s*\[\s*(\d{1,6})\s*\.\.\s*(\d{1,6})\s*\]\s*OF\s+(\w+)", re.IGNORECASE)
REGISTER_PATTERN = re.compile(r"D(\d{1,6})")


@frozen
class Row:
    """A row of the table: its line, its text with the line end, and its cells."""

    line: int
    raw: str
    cells: tuple[str, ...]

    @property
    def name(self) -> str:
        """The symbol."""
        return self.cells[IDENTIFIER_COLUMN]

    @property
    def address(self) -> str:
        """Its device; empty where ISPSoft places it."""
        return self.cells[ADDRESS_COLUMN].upper()

    @property
    def value(self) -> str:
        """Its initial value; empty where it has none."""
        return self.cells[VALUE_COLUMN] if len(self.cells) > VALUE_COLUMN else ""

    @property
    def comment(self) -> str:
        """Its comment; empty where it has none."""
        return self.cells[-1] if len(self.cells) == len(COLUMNS) else ""


@dataclass(slots=True)
class Table:
    """The rows of a table by their symbols in small letters, and what stands before them."""

    head: str = ""
    rows: list[Row] = field(default_factory=list)
    by_name: dict[str, Row] = field(default_factory=dict)


def parse_symbols(text: str) -> Table:
    """The rows of a symbol table; raises `ListingError` with the line of what is none."""
    table = Table()
    for line, raw in enumerate(text.splitlines(keepends=True), start=1):
        cells = tuple(raw[a:b].strip() for a, b in _cell_spans(raw.rstrip("\r\n")))
        if not table.head:
            if [cell.casefold() for cell in cells] != [name.casefold() for name in COLUMNS]:
                raise ListingError(f"the header of a symbol table is {','.join(COLUMNS)}; export it again", line)
            table.head = raw
            continue
        row = Row(line, raw, cells)
        if any(cells):
            _check_row(row, table)
            table.by_name[row.name.casefold()] = row
        table.rows.append(row)
    if not table.head:
        raise ListingError("the file is empty")
    return table


def _check_row(row: Row, table: Table) -> None:
    if len(row.cells) < MIN_CELLS:
        raise ListingError(
            f"{len(row.cells)} cells; a row has {', '.join(COLUMNS[:MIN_CELLS])}, and may have a value and a comment",
            row.line,
        )
    if not row.name:
        raise ListingError("the row has no symbol in its second cell", row.line)
    other = table.by_name.get(row.name.casefold())
    if other is not None:
        raise ListingError(f"the symbol {row.name[:60]} stands here again, after line {other.line}", row.line)


def _cell_spans(line: str) -> Iterator[tuple[int, int]]:
    """Where the cells of a line stand; commas in brackets (arrays) and in the comment separate nothing."""
    start = depth = count = 0
    for i, sign in enumerate(line):
        depth += (sign in "[(") - (sign in "])" and depth > 0)
        if sign == "," and not depth and count < len(COLUMNS) - 1:
            yield start, i
            start, count = i + 1, count + 1
    yield start, len(line)


def registers_of(kind: str, address: str) -> range:
    """The D registers of a symbol: none on other devices, and one where the type's length is not known."""
    match = REGISTER_PATTERN.fullmatch(address.split(".", maxsplit=1)[0])
    if match is None:
        return range(0)
    first, array = int(match[1]), ARRAY_PATTERN.fullmatch(kind)
    words = TYPE_REGISTERS.get((array[3] if array else kind).upper(), 1)
    if array:
        words *= int(array[2]) - int(array[1]) + 1
    return range(first, first + (1 if "." in address else max(words, 1)))


def merge_symbols(image: Program, text: str) -> tuple[str, tuple[str, ...]]:
    """The text of the user's table with the symbols of all loops, and what was done."""
    table = parse_symbols(text)
    placed_rows = [
        (row, registers_of(row.cells[TYPE_COLUMN], row.address)) for row in table.rows if len(row.cells) > TYPE_COLUMN
    ]
    renewed_rows: dict[int, str] = {}
    created: list[str] = []
    unchanged: list[str] = []
    notes: list[str] = []
    for symbol in make_symbols(image):
        same_name = table.by_name.get(symbol.name.casefold())
        if same_name is not None and same_name.address == symbol.address.upper():
            unchanged.append(symbol.name)
            if symbol.value and not _has_same_value(same_name.value, symbol.value):
                renewed_rows[same_name.line] = _with_value(same_name, symbol.value)
                before = same_name.value or "none"
                notes.append(f"initial value renewed: {symbol.name} ({symbol.address}), {before} to {symbol.value}")
            continue
        reasons = list(_conflict_reasons(symbol, same_name, placed_rows))
        if reasons:
            device = symbol.address or "no device"
            reason_text = " and ".join(reasons)
            notes.append(f"{CONFLICT}, left as it is: {symbol.name} ({device}) was not created, since {reason_text}")
        else:
            created.append(symbol_line(symbol))
    end = "\n" if "\r\n" not in table.head and table.head.endswith("\n") else "\r\n"
    body = table.head + "".join(renewed_rows.get(row.line, row.raw) for row in table.rows)
    if created and not body.endswith(("\n", "\r")):
        body += end
    merged = body + "".join(line + end for line in created)
    if len(parse_symbols(merged).by_name) != len(table.by_name) + len(created):
        raise ListingError("the symbols could not be added to this file")
    return merged, (f"created {len(created)}, already there: {len(unchanged)}", *notes)


def _conflict_reasons(symbol: Symbol, same_name: Row | None, placed_rows: list[tuple[Row, range]]) -> Iterator[str]:
    """Why a symbol is not added."""
    if same_name is not None:
        yield f"the symbol is that of {same_name.address or 'a variable without a device'} in line {same_name.line}"
    for row, registers in placed_rows:
        if row is same_name or not symbol.address or not row.address:
            continue
        shared = range(max(registers.start, symbol.registers.start), min(registers.stop, symbol.registers.stop))
        bits = "." in row.address and "." in symbol.address
        if row.address == symbol.address.upper() or (shared and not bits):
            yield f"{row.address} is {row.name!r} in line {row.line}"
            return


def _has_same_value(value: str, other: str) -> bool:
    """Whether two initial values are the same, however they are written."""
    if value.upper() == other.upper() or {"0": "FALSE", "1": "TRUE"}.get(value) == other:
        return True
    return all(map(NUMBER.fullmatch, (value, other))) and float(value) == float(other)


def _with_value(row: Row, value: str) -> str:
    """A row's text with another initial value; every other character as it was."""
    line = row.raw.rstrip("\r\n")
    spans = [*_cell_spans(line)]
    if len(spans) <= VALUE_COLUMN:
        return f"{line},{value}{row.raw[len(line) :]}"
    start, stop = spans[VALUE_COLUMN]
    return line[:start] + value + row.raw[stop:]
