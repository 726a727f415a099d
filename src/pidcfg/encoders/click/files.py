"""The files that a CLICK image is written to and read from: DataView, data dump and the common ones."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from pidcfg.encoders.click.nicknames import (
    HEADER,
    merge_nicknames,
    read_nicknames,
    write_nicknames,
)
from pidcfg.encoders.image import Cell, Image
from pidcfg.encoders.listing import (
    FileKind,
    Listing,
    ListingError,
    Place,
    UnwritableError,
    column_names,
    decimal_content,
    first_line,
    listing_kinds,
)
from pidcfg.encoders.maps.click import ALL_BANKS, SPACE, address_of, modbus_place
from pidcfg.encoders.regmap import BIT, INT16, SINGLE, Bank, Kind, NoRegisterError
from pidcfg.schemas.click import ClickFile
from pidcfg.text.references import Decision

# --- CLICK DataViews (CDV): one a loop, with new values for the settings; UTF-16 and CRLF as CLICK writes them --------

D108 = Decision(
    108,
    "a DataView shows all of a loop and writes its settings",
    "One file a loop in address order: settings with a new value, requests and what the controller writes without, "
    "reserved registers not at all.",
    "A new value is written by one click on all rows: a request among them would start, a status would be overwritten.",
)

DATAVIEW_ROWS = 100
BYTE_ORDER_MARK = "\ufeff"
CDV_HEADER = re.compile(r"(-1|0)(,[0-9]{1,6}){2}")
ROW_PATTERN = re.compile(r"([A-Z]{1,3}[0-9]{1,4}u?),([0-9]{1,4})(?:,([0-9]{1,10})?)?")
EMPTY_ROW = re.compile(r"(,0?,?)?")
BIT_MAX, INT16_MAX, MIN_NEGATIVE = 1, 0x7FFF, 0xFFFF8000
"""Integers are kept as 32 bits with their sign: -1 is 4294967295."""
CODES = {"BIT": 768, "INT": 0, "INT2": 256, "FLOAT": 257, "HEX": 3, "TEXT": 1024}
"""The second cell of a row, by the type of the address."""
UNSAFE_CHARACTER = re.compile(r"[^A-Za-z0-9_-]")


def write_dataviews(image: Image, checklist: tuple[str, ...] = ()) -> Mapping[str, str]:
    """A DataView for each loop, by its name; a single one needs no name."""
    del checklist
    views = [
        (f"{name}-{i}" if i > 1 else name, cells)
        for name in _loop_names(image)
        for i, cells in enumerate(_split_views([c for c in image.cells if c.loop == name]), start=1)
    ]
    texts = [BYTE_ORDER_MARK + _view_text(cells) for _, cells in views]
    if len(texts) == 1:
        return {"": texts[0]}
    safe = [UNSAFE_CHARACTER.sub("_", name) for name, _ in views]
    if len({name.casefold() for name in safe}) < len(safe):
        safe = [f"{i}-{name}" for i, name in enumerate(safe, start=1)]
    return dict(zip(safe, texts, strict=True))


def _loop_names(image: Image) -> list[str]:
    return list(dict.fromkeys(str(entry["loop"]) for entry in image.settings))


def _split_views(cells: list[Cell]) -> list[list[Cell]]:
    """The registers with a meaning, a hundred at a time."""
    visible = [cell for cell in cells if cell.access != "reserved"]
    return [visible[i : i + DATAVIEW_ROWS] for i in range(0, len(visible), DATAVIEW_ROWS)]


def _view_text(cells: list[Cell]) -> str:
    """One DataView: as many rows as the window has, the rest of them empty."""
    head = f"{-any(cell.access == 'setting' for cell in cells)},0,0"
    rows = [*map(_view_row, cells), *[",0"] * (DATAVIEW_ROWS - len(cells))]
    return "".join(f"{row}\r\n" for row in (head, *rows))


def _view_row(cell: Cell) -> str:
    """Address and type of a cell, and its new value if it is a setting."""
    bank, _ = SPACE.bank_and_number(cell.number)
    stored = cell.raw + (MIN_NEGATIVE - 0x8000 if bank.kind is INT16 and cell.raw > INT16_MAX else 0)
    value = f",{stored}" if cell.access == "setting" else ""
    return f"{cell.address},{CODES[ALL_BANKS[bank.prefix][1]]}{value}"


def read_dataview(text: str) -> Listing:
    """The new values of C, DS and DF rows; rows without, and rows of other banks, only have to be right."""
    listing = Listing(is_mixed=True)
    lines = _split_lines(text)
    if not lines or not CDV_HEADER.fullmatch(lines[0]):
        raise ListingError("this is no DataView: the first line is not like -1,0,0")
    rows = list(_view_rows(lines[1:]))
    if lines[0].startswith("0") and any(value for _, _, _, value in rows):
        raise ListingError("the first line says that no row has a new value, but one has (-1 in place of 0)")
    for line, address, code, value in rows:
        _check_type(line, address, code)
        number = SPACE.parse(address)
        if number is not None and value:
            listing.add(number, _stored_content(line, address, SPACE.kind_of(number), int(value)), address, line)
    return listing


def _split_lines(text: str) -> list[str]:
    """Lines by LF or CRLF; nothing else ends one."""
    lines = text.removeprefix(BYTE_ORDER_MARK).replace("\r\n", "\n").split("\n")
    while lines and not lines[-1].strip():
        lines.pop()
    return [line.strip(" ") for line in lines]


def _view_rows(lines: list[str]) -> Iterator[tuple[int, str, str, str]]:
    """Line, address, type code and new value of every row that has an address."""
    for line, text in enumerate(lines, start=2):
        if EMPTY_ROW.fullmatch(text):
            continue
        match = ROW_PATTERN.fullmatch(text)
        if match is None:
            raise ListingError(f"{text[:60]!r} is not a row of a DataView: address,type or address,type,value", line)
        if line > DATAVIEW_ROWS + 1:
            raise ListingError(
                f"a DataView has at most {DATAVIEW_ROWS} rows; the address {match.group(1)} is beyond", line
            )
        yield line, match.group(1), match.group(2), match.group(3) or ""


def _check_type(line: int, address: str, code: str) -> None:
    known = address_of(address)
    if known is None or known.name != address:
        raise ListingError(f"{address} is not an address of CLICK", line)
    if int(code) != CODES[known.type]:
        raise ListingError(f"{address} has the type {CODES[known.type]}, but the row says {code}", line)


def _stored_content(line: int, address: str, kind: Kind, stored: int) -> int:
    """A stored number as raw content: a switch, 16 bits with their sign spread over 32, the bits of a float."""
    is_valid = {
        BIT: stored <= BIT_MAX,
        INT16: stored <= INT16_MAX or MIN_NEGATIVE <= stored <= 0xFFFFFFFF,
        SINGLE: stored <= 0xFFFFFFFF and kind.read(kind.show(min(stored, 0xFFFFFFFF))) == stored,
    }
    if not is_valid[kind]:
        raise ListingError(f"{address}: the new value {stored} is not {kind.holds}", line)
    return stored & kind.highest


# ----------------------------------------------------------------------------------------------------------------------
# CLICK's data dump, which "Write Data into PLC" loads: whole banks, so that ours only go into one of the user's.
# Everything that is not a cell of ours stays byte for byte.

D109 = Decision(
    109,
    "a data dump gets settings, and requests off",
    "Merged into a dump are the settings of each loop, and 0 for its requests; what the controller writes and reserved "
    "registers keep the dump's content.",
    "The dump is what the PLC held when it was read: a request caught in it would start when it is written back.",
)
SECTION_START, SECTION_END = re.compile(r"<([A-Z]{1,3})=START>"), re.compile(r"</([A-Z]{1,3})=END>")
BANKS = {bank.prefix: bank for bank in SPACE.banks}
MAX_COLUMNS = 100


class DumpCell(NamedTuple):
    """One value of a dump: its raw content, its line, and where its text stands."""

    raw: int
    line: int
    start: int
    end: int


@dataclass(slots=True)
class Dump:
    """The C, DS and DF cells of a dump by address."""

    cells: dict[int, DumpCell] = field(default_factory=dict)
    sections: set[str] = field(default_factory=set)


def write_dump(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """A dump of its own would write zeros everywhere else, so there is none."""
    del image, checklist
    raise UnwritableError("a data dump covers whole banks, and is only written into one of yours")


def read_dump(text: str) -> Listing:
    """All C, DS and DF values."""
    listing = Listing(is_mixed=True)
    for number, cell in parse_dump(text).cells.items():
        listing.add(number, cell.raw, SPACE.name(number), cell.line)
    return listing


def parse_dump(text: str) -> Dump:
    """The cells of the three banks, each checked."""
    dump = Dump()
    columns: list[int] = []
    bank, line, position = "", 0, 0
    for line, raw in enumerate(re.split(r"(?<=\n)", text), start=1):
        words, row_start = raw.strip(" \r\n" + BYTE_ORDER_MARK), position
        position += len(raw)
        opened, closed = SECTION_START.fullmatch(words), SECTION_END.fullmatch(words)
        if opened or closed:
            bank = _read_section(dump, bank, opened, closed, line)
            columns = []
        elif words and not bank:
            raise ListingError("this stands in no section of a data dump, which begins like <DS=START>", line)
        elif words and bank in BANKS and words.startswith("Address,"):
            columns = _read_columns(words, line)
        elif words and bank in BANKS:
            _read_row(dump, BANKS[bank], columns, raw, line, row_start)
    if bank:
        raise ListingError(f"the section {bank} does not end: the file is cut off", line)
    if not dump.sections:
        raise ListingError("this is no data dump: it has no section that begins like <DS=START>")
    return dump


def _read_section(dump: Dump, bank: str, begin: re.Match[str] | None, end: re.Match[str] | None, line: int) -> str:
    """The section that is open after this line."""
    if begin is None:
        name = end.group(1) if end else ""
        if name != bank:
            raise ListingError(f"the section {name} ends here, but {bank or 'none'} is open", line)
        return ""
    name = begin.group(1)
    if bank:
        raise ListingError(f"the section {name} begins inside {bank}", line)
    if name in dump.sections:
        raise ListingError(f"the section {name} stands here again", line)
    dump.sections.add(name)
    return name


def _read_columns(words: str, line: int) -> list[int]:
    """The header of a section: numbers from 1 up, which the address of a row is counted from."""
    cells = words.removesuffix(",").split(",")[1:]
    if len(cells) > MAX_COLUMNS or cells != [str(n) for n in range(1, len(cells) + 1)]:
        raise ListingError("the header of a section is Address,1,2,3 and so on", line)
    return list(range(len(cells)))


def _read_row(dump: Dump, bank: Bank, columns: list[int], raw: str, line: int, position: int) -> None:
    """The values of one row."""
    text = raw.rstrip(" \r\n")
    name, *cells = text.removesuffix(",").split(",")
    first = SPACE.parse(name.strip()) if name.isascii() else None
    if first is None or SPACE.bank_and_number(first)[0] != bank:
        raise ListingError(f"{name.strip()[:40]!r} is not an address of {bank.prefix}", line)
    if len(cells) > len(columns):
        raise ListingError(
            f"{len(cells)} value{'s stand' if cells[1:] else ' stands'} under a header of {len(columns)}", line
        )
    start = position + len(name) + 1
    for offset, cell in enumerate(cells):
        number = first + offset
        if SPACE.bank_and_number(number)[1] > bank.last:
            raise ListingError(f"{bank.prefix}{SPACE.bank_and_number(number)[1]} does not exist", line)
        if number in dump.cells:
            raise ListingError(f"{SPACE.name(number)} stands here again", line)
        end = start + len(cell)
        dump.cells[number] = DumpCell(_raw_content(number, cell.strip(" "), line), line, start, end)
        start = end + 1


def _raw_content(number: int, text: str, line: int) -> int:
    kind = SPACE.kind_of(number)
    raw = decimal_content(text, kind)
    if raw is None:
        raise ListingError(f"{SPACE.name(number)}: {text[:40]!r} is not {kind.holds}", line)
    return raw


def merge_dump(image: Image, text: str) -> tuple[str, tuple[str, ...]]:
    """The user's dump with the loops' settings in their places, and all requests off (D109)."""
    dump = parse_dump(text)
    settings = {c.number: c.raw for c in image.cells if c.access in {"setting", "request"}}
    missing = next((number for number in settings if number not in dump.cells), None)
    if missing is not None:
        raise ListingError(f"the dump does not hold {SPACE.name(missing)}; read all data from the PLC, and save that")
    pieces, position, changed = [], 0, 0
    for number in sorted(settings, key=lambda n: dump.cells[n].start):
        cell = dump.cells[number]
        if cell.raw != settings[number]:
            pieces += [text[position : cell.start], _dump_text(number, settings[number])]
            position, changed = cell.end, changed + 1
    merged = "".join([*pieces, text[position:]])
    expected = {number: cell.raw for number, cell in dump.cells.items()} | settings
    if {number: cell.raw for number, cell in parse_dump(merged).cells.items()} != expected:
        raise ListingError("the values could not be put into this dump")
    return merged, (f"{len(settings)} values are in the dump, {changed} of them changed",)


def _dump_text(number: int, raw: int) -> str:
    """A value as CLICK writes it; one that its decimals do not hold is refused."""
    kind = SPACE.kind_of(number)
    text = f"{kind.show(raw):.8f}" if kind is SINGLE else kind.text(raw)
    if decimal_content(text, kind) != raw:
        decimals = " (eight decimals)" if kind is SINGLE else ""
        raise UnwritableError(f"{SPACE.name(number)} = {kind.text(raw)} does not fit into a data dump{decimals}")
    return text


# --- The files that a CLICK image is written to and read from ---------------------------------------------------------


class Numbering:
    """C bits are coils; DS and DF are holding registers, a DF two of them (D1031)."""

    @staticmethod
    def place(number: int) -> Place:
        """Where an address is; raises `NoRegisterError` behind the end of its bank."""
        bank, n = SPACE.bank_and_number(number)
        if not bank.first <= n <= bank.last:
            raise NoRegisterError(f"there is no {bank.address_name(n)}: the last one is {bank.address_name(bank.last)}")
        return Place(*modbus_place(number))

    @staticmethod
    def find(table: str, register: int) -> tuple[int, int] | None:
        """The address of a coil or holding register."""
        for bank in SPACE.banks:
            bank_table, first, width = modbus_place(SPACE.number_of(bank.prefix, bank.first))
            n, part = divmod(register - first, width)
            if bank_table == table and 0 <= n <= bank.last - bank.first:
                return SPACE.number_of(bank.prefix, bank.first + n), part
        return None


NUMBERING = Numbering()
FORMATS = listing_kinds(SPACE, "register listing", NUMBERING) | {
    "nickname-csv": FileKind(
        "nickname-csv",
        "nicknames with initial values (CSV)",
        write_nicknames,
        read_nicknames,
        lambda text: {name.lower() for name in HEADER} <= set(column_names(text)),
        merge=merge_nicknames,
        is_complete=False,
    ),
    "cdv": FileKind(
        "cdv",
        "DataViews with new values",
        write_dataviews,
        read_dataview,
        lambda text: re.fullmatch(r"(-1|0),[0-9]+,[0-9]+", first_line(text)) is not None,
        encoding="utf-16-le",
        may_be_partial=True,
        is_complete=False,
    ),
    "data-dump": FileKind(
        "data-dump",
        "data for Write Data into PLC",
        write_dump,
        read_dump,
        lambda text: re.fullmatch(r"<[A-Z]{1,3}=START>", first_line(text)) is not None,
        merge=merge_dump,
        needs_into=True,
        is_complete=False,
    ),
}


CHECK_WRITES = (
    "write the values into the PLC after the download (Write Data into PLC, or the DataView's new values): registers "
    "that were never written are the first cause of PID errors"
)


CHECK_RETENTIVE = (
    "look at Initial Value and Retentive of the loops' registers in the Address Picker, and at the battery: after a "
    "power cycle a register that is not retained begins with its initial value, and the operator's set point is gone"
)


def checklist(config: ClickFile) -> tuple[str, ...]:
    """What no file can set or prove."""
    items = [CHECK_WRITES]
    open_loops = [f"{loop.name} ({loop.action})" for loop in config.loops if not loop.action_verified]
    if open_loops:
        items.append(
            f"verify Forward/Reverse in the PID window before Auto: {', '.join(open_loops)}; direct is Forward, where "
            "the PV rises with the output; then state `action_verified: true`"
        )
    pulsed = [f"{loop.name} ({loop.output.pwm.bit})" for loop in config.loops if loop.output.pwm is not None]
    if pulsed:
        items.append(f"enable PWM in the PID window, and its bit address: {', '.join(pulsed)}; no register holds them")
    items.append(CHECK_RETENTIVE)
    return tuple(items)
