"""CLICK's nickname CSV: the names of a loop's registers, written, read back, and added to a list of the user's."""

from __future__ import annotations

import csv
import io
import re
import string
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from pidcfg.encoders.codecs import FLAG, Choice
from pidcfg.encoders.image import Cell, Image
from pidcfg.encoders.listing import (
    CONFLICT,
    Listing,
    ListingError,
    UnwritableError,
    cell_count_text,
    decimal_content,
    shorten_names,
)
from pidcfg.encoders.maps.click import ALL_BANKS, BLOCKS, SPACE, SUFFIXES, address_of, modbus_place
from pidcfg.encoders.regmap import Word
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

# --- The nicknames of a loop's registers: a name each, its initial value, and a comment that says what it is ----------

D104 = Decision(
    104,
    "a nickname that CLICK would refuse is not written",
    "At most 24 characters, which are letters, digits, blanks and _ (ASCII), each nickname once whatever its case. "
    "A loop whose nicknames break this has no nickname CSV, and no shortened names; the message says what fits.",
    "A name cut to size would no longer say which register it is, and no import reports what it leaves out.",
)
D105 = Decision(
    105,
    "initial values go to settings only, and retention stays the bank's own",
    "Switches and registers that a configuration sets have its value as initial value; what the controller writes, "
    "requests and Cn+10 have a nickname and the initial value 0, which is how CLICK writes that there is none. DS and "
    "DF are retentive, C is not.",
    "An initial value in a request would start it, and one in a status would show what never was.",
)

D106 = Decision(
    106,
    "a nickname list of the user's keeps what it says",
    "A row whose address or nickname stands there with another partner is left as it is and reported. Where both agree "
    "the row is the loop's own: its initial value becomes the configuration's, and nothing else of it changes. A row "
    "with neither nickname nor comment nor initial value is nobody's, and becomes the loop's.",
    "A list that kept the old initial values of a loop would be written into the PLC as if they were the new ones. An "
    "export of all addresses has a row of each, used or not.",
)
D107 = Decision(
    107,
    "a loop is found by the nickname of its Cn+09",
    "In a nickname list a name is that of a loop when `<name>_SEL_DirectReverse` is one of its nicknames; the blocks "
    "begin where all its other nicknames say, and where they disagree the list is refused. A name without it, of which "
    "three nicknames or more agree on where a block begins, is told and not read.",
    "Short suffixes (_P, _SP) are common in nicknames that have nothing to do with a loop.",
)

MAX_NICKNAME = 24
MAX_COMMENT = 128
LEGAL_SIGNS = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_ ")
UNITS = {"s": "s", "%": "%"}


class NamedRegister(NamedTuple):
    """A register with a nickname of its own."""

    bank: str
    offset: int
    word: Word
    suffix: str


def _named_registers() -> Iterator[NamedRegister]:
    for bank, table in BLOCKS.values():
        for word in table.words:
            # C alone has a reserved bit with a nickname; the other banks call registers by the same name
            if word.name in SUFFIXES and (word.access != "reserved" or bank == "C"):
                yield NamedRegister(bank, word.offset, word, SUFFIXES[word.name])


NAMED_REGISTERS = tuple(_named_registers())
NICKNAME_ROWS = {(row.bank, row.word.name): row for row in NAMED_REGISTERS}
MAX_LOOP_NAME = MAX_NICKNAME - max(len(row.suffix) for row in NAMED_REGISTERS)
"""Characters of the longest loop name that all nicknames have room for."""
ACTION = NICKNAME_ROWS["C", "action"]


class Nickname(NamedTuple):
    """One row of a nickname list; ``value`` is empty where there is no initial value."""

    address: str
    nickname: str
    value: str
    comment: str


def nicknames(image: Image) -> list[Nickname]:
    """The nicknames of all loops in address order; raises `UnwritableError` for one that CLICK would refuse."""
    units = {entry["loop"]: entry for entry in image.settings}
    rows = []
    for cell in image.cells:
        bank, _ = SPACE.bank_and_number(cell.number)
        register = NICKNAME_ROWS.get((bank.prefix, cell.field))
        if register is not None and cell.loop is not None:
            name = _legal_nickname(cell.loop, cell.loop + register.suffix)
            value = initial_value(cell) if cell.access == "setting" else ""
            rows.append(Nickname(cell.address, name, value, _comment_text(register.word, units.get(cell.loop, {}))))
    _refuse_repeated(rows)
    return rows


def _legal_nickname(loop: str, nickname: str) -> str:
    illegal = sorted(set(nickname) - LEGAL_SIGNS)
    if illegal:
        raise UnwritableError(
            f"loop {loop}: CLICK allows no {' '.join(map(repr, illegal))} in the nickname {nickname!r}; rename the "
            "loop with letters, digits, blanks and _"
        )
    if nickname.startswith("_"):
        raise UnwritableError(f"loop {loop}: the nickname {nickname!r} begins with _, which CLICK keeps for its own")
    if len(nickname) > MAX_NICKNAME:
        raise UnwritableError(
            f"loop {loop}: the nickname {nickname!r} has {len(nickname)} characters, CLICK allows {MAX_NICKNAME}; "
            f"the longest loop name that fits has {MAX_LOOP_NAME}"
        )
    return nickname


def _refuse_repeated(rows: Sequence[Nickname]) -> None:
    rows_by_name: dict[str, Nickname] = {}
    for row in rows:
        other = rows_by_name.setdefault(row.nickname.casefold(), row)
        if other is not row:
            raise UnwritableError(
                f"{other.address} and {row.address} would both be called {row.nickname!r}, whose case CLICK ignores; "
                "rename one of the loops"
            )


def initial_value(cell: Cell) -> str:
    """The content as CLICK writes an initial value: shortest decimals, ``1E-05`` with a large E."""
    text = cell.text.upper()
    return text.removesuffix(".0")


def _comment_text(word: Word, entry: Mapping[str, object]) -> str:
    """What the register is; a switch begins with what 0 means (D100)."""
    if isinstance(word.codec, Choice):
        text = word.title if word is ACTION.word else f"{_state_text(word.codec)}: {word.title}"
    else:
        unit = "" if " in " in word.title else _unit_text(word.unit, entry)
        text = f"{word.title}, {unit}" if unit else word.title
    return text if len(text) <= MAX_COMMENT else word.title


def _state_text(codec: Choice) -> str:
    """Both states of a switch, that of 0 first."""
    if codec == FLAG:
        return "Off or on"
    first, second = (str(codec.decode(bit)) for bit in (0, 1))
    return f"{first[0].upper()}{first[1:]} or {second}"


def _unit_text(unit: str, entry: Mapping[str, object]) -> str:
    pv = entry.get("pv")
    text = pv.get("unit") if isinstance(pv, dict) else None
    shown = " ".join(str(text).split()) if text else ""
    if unit == "pv":
        return shown
    if unit == "pv/sample":
        return f"{shown} per sample".strip()
    return UNITS.get(unit, "")


# --- CLICK's nickname CSV, read strictly (D1031) ----------------------------------------------------------------------
#
# Newer versions of CLICK's software export two more columns, the Modbus address and its function codes, behind the
# type.

HEADER = ("Address", "Data Type", "Nickname", "Initial Value", "Retentive", "Address Comment")
MODBUS, FUNCTION_CODE = "Modbus Address", "Function Code"
HEADERS = (HEADER, (*HEADER[:2], MODBUS, FUNCTION_CODE, *HEADER[2:]))
TYPE_ALIASES = {"TXT": "TEXT"}
"""Types by other names."""
RETENTIVE_BANKS = frozenset({"DS", "DF"})
"""Banks of a loop that keep their content while the PLC is off."""
BYTE_ORDER_MARK = "\ufeff"
LOOP_BANKS = frozenset(prefix for prefix, _ in BLOCKS.values())
SYSTEM_BANKS = frozenset({"SC", "SD"})
"""Banks whose nicknames the PLC's software gives, some of them twice."""

D1081 = Decision(
    1081,
    "units that our comments name are read back",
    "A nickname list and a symbol table hold no units. Where the comments of all registers on the scale of the PV, or "
    "of the output, are those that `encode` writes, and end with one unit, it is the loop's.",
    "The list then says after `decode` and `encode` what it said before. A comment that somebody has changed is "
    "nobody's unit, and one row alone proves nothing.",
)
D990 = Decision(
    990,
    "rows of a nickname list that no loop can touch are kept and not judged",
    "Of a row that is not of C, DS or DF only the number of its cells counts. Where it has neither address nor "
    "nickname, another type than its bank, or an address or nickname that another such row has, one note says so; the "
    "row itself stays in its place, byte for byte.",
    "CLICK's own export of all addresses has 16 rows without an address (the upper halves of XD1 to XD8 and YD1 to "
    "YD8), and lists that work in the field have types that CLICK does not give. Nothing of a loop depends on them.",
)


@frozen
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
    def is_foreign(self) -> bool:
        """Whether it is of no bank that a loop has registers in."""
        return self.bank not in LOOP_BANKS

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
    oddities: list[str] = field(default_factory=list)
    """What is wrong with rows that no loop can touch (D990)."""
    nameless_lines: list[int] = field(default_factory=list)
    """Lines of such rows without an address."""

    def add(self, row: Row) -> None:
        """Takes a row; an address or a nickname twice is refused where a row of a loop's bank has it."""
        first = self.by_address.get(row.address)
        if first is not None and not row.is_foreign:
            raise ListingError(f"{row.address} stands here again, after line {first.line}", row.line)
        other = self.by_name.get(row.nickname.casefold()) if row.nickname else None
        if other is not None and not {row.bank, other.bank} & SYSTEM_BANKS:
            if not (row.is_foreign and other.is_foreign):
                raise ListingError(
                    f"the nickname {row.nickname!r} of {row.address} is that of {other.address} in line {other.line} "
                    "too",
                    row.line,
                )
            self.oddities.append(f"{row.address} has the nickname of {other.address}")
        if not row.address:
            self.nameless_lines.append(row.line)
        elif row.is_foreign and (oddity := "stands here again" if first else _type_oddity(row)):
            self.oddities.append(f"{row.address} {oddity}")
        self.rows.append(row)
        if row.address:
            self.by_address.setdefault(row.address, row)
        if row.nickname and (other is None or other.is_foreign):
            self.by_name[row.nickname.casefold()] = row

    @property
    def notes(self) -> tuple[str, ...]:
        """One note on the rows that no loop can touch and that are not as CLICK makes them (D990)."""
        lines, oddities = self.nameless_lines, list(self.oddities)
        if lines:
            span = f"lines {lines[0]} to {lines[-1]}" if lines[1:] else f"line {lines[0]}"
            oddities.insert(0, f"{len(lines)} without an address ({span})")
        return (f"rows that no loop uses are left as they are: {shorten_names(oddities)} (D990)",) if oddities else ()

    def column_index(self, name: str) -> int:
        """Where a column stands, from 0."""
        return self.columns.index(name)

    @property
    def line_end(self) -> str:
        """How the file ends its lines."""
        return "\r\n" if self.head.endswith("\r\n") else "\n"


def write_nicknames(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """The nicknames of all loops; raises `UnwritableError` for one that CLICK would refuse."""
    del checklist
    return "".join((",".join(HEADER), "\n", *map(_csv_row, nicknames(image))))


def _csv_row(row: Nickname) -> str:
    bank = row.address.rstrip(string.digits)
    comment = row.comment.replace('"', '""')
    cells = (f'"{row.nickname}"', row.value or "0", "Yes" if bank in RETENTIVE_BANKS else "No", f'"{comment}"')
    return ",".join((row.address, ALL_BANKS[bank][1], *cells)) + "\n"


def parse_nicknames(text: str) -> Table:
    """The rows of a nickname CSV, each checked."""
    table = Table()
    for line, raw, cells in _csv_records(text.removeprefix(BYTE_ORDER_MARK)):
        stripped = [cell.strip() for cell in cells]
        if not table.head:
            table.head, table.columns = raw, _read_header(stripped, line)
        elif any(stripped):
            table.add(_read_row(line, raw, stripped, table.columns))
        else:
            table.rows.append(Row(line, raw, "", "", "", "", "", "", ""))
    if not table.head:
        raise ListingError("the file is empty")
    return table


def _csv_records(text: str) -> Iterator[tuple[int, str, list[str]]]:
    """Each record with its first line and its raw text; a quoted comment may run over several lines."""
    if "\0" in text:
        raise ListingError("a NUL character", text[: text.index("\0")].count("\n") + 1)
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ListingError("a character that is not Unicode", text[: error.start].count("\n") + 1) from None
    lines = io.StringIO(text, newline="").readlines()
    reader = csv.reader(iter(lines), strict=True)
    lines_read = 0
    while True:
        try:
            cells = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            raise ListingError(f"not CSV: {error}", lines_read + 1) from None
        yield lines_read + 1, "".join(lines[lines_read : reader.line_num]), cells
        lines_read = reader.line_num


def _read_header(cells: list[str], line: int) -> tuple[str, ...]:
    """The columns of a file, whatever the letters of its header."""
    for header in HEADERS:
        if [cell.casefold() for cell in cells] == [name.casefold() for name in header]:
            return header
    raise ListingError(
        f"the header of a nickname CSV is {','.join(HEADER)}, with {MODBUS} and {FUNCTION_CODE} behind Data Type or "
        "without; export it again",
        line,
    )


def _read_row(line: int, raw: str, cells: list[str], columns: tuple[str, ...]) -> Row:
    if len(cells) != len(columns):
        raise ListingError(f"{cell_count_text(cells)} under a header of {len(columns)} columns", line)
    by_column = dict(zip(columns, cells, strict=True))
    address_text, kind, nickname, value, retentive, comment = (by_column[name] for name in HEADER)
    if not address_text and not nickname:
        return Row(line, raw, "", "", kind, nickname, value, retentive, comment, by_column.get(MODBUS, ""))
    address = address_of(address_text)
    if address is None:
        raise ListingError(f"{address_text[:40]!r} is not an address of CLICK", line)
    row = Row(
        line, raw, address.name, address.bank, kind, nickname, value, retentive, comment, by_column.get(MODBUS, "")
    )
    if not row.is_foreign:
        if retentive.lower() not in {"yes", "no", ""}:
            raise ListingError(f"{row.address}: {retentive[:40]!r} stands where Yes or No is wanted", line)
        if oddity := _type_oddity(row):
            raise ListingError(f"{row.address} {oddity}", line)
        initial_content(row)
    return row


def _type_oddity(row: Row) -> str:
    """What CLICK would not write of a row: another data type than that of the bank."""
    kind = ALL_BANKS[row.bank][1]
    if not row.kind or TYPE_ALIASES.get(row.kind.upper(), row.kind.upper()) == kind:
        return ""
    return f"is of type {kind}, but the file says {row.kind[:40]!r}"


def initial_content(row: Row) -> int | None:
    """The raw content of a C, DS or DF row; None where it has no initial value, and for other banks."""
    number = SPACE.parse(row.address)
    if number is None or not row.value:
        return None
    kind = SPACE.kind_of(number)
    raw = decimal_content(row.value, kind)
    if raw is None:
        raise ListingError(f"{row.address}: the initial value {row.value[:40]!r} is not {kind.holds}", row.line)
    return raw


# --- A nickname CSV read back: its initial values, and the loops and blocks that the nicknames tell -------------------

BLOCK_KEYS = {prefix: key for key, (prefix, _) in BLOCKS.items()}

NO_LOOP_NOTE = f"no nickname of the list is <loop>{ACTION.suffix}, so none of its rows is known to be a loop's (D107)"
MIN_AGREEING = 3
"""So many nicknames that agree on where a block begins are no chance."""


class Claim(NamedTuple):
    """What one nickname says: where a block of a loop begins."""

    loop: str
    bank: str
    start: int
    row: Row
    word: Word


def read_nicknames(text: str) -> Listing:
    """The initial values of all C, DS and DF rows, and beside them the loops with their blocks (D107)."""
    listing = Listing(is_mixed=True)
    table = parse_nicknames(text)
    rows = table.rows
    for row in rows:
        number, raw = SPACE.parse(row.address), initial_content(row)
        if number is not None and raw is not None:
            listing.add(number, raw, row.address, row.line)
    claims = list(_find_claims(rows))
    listing.settings = tuple(_loop_settings(claims))
    almost = tuple(_near_loop_names(claims))
    listing.notes = (*table.notes, *(almost if almost or listing.settings else (NO_LOOP_NOTE,)))
    return listing


def _find_claims(rows: Iterable[Row]) -> Iterator[Claim]:
    """Nicknames with a known suffix; none of a bank's suffixes is the end of another."""
    for row in rows:
        number = SPACE.parse(row.address)
        if number is None:
            continue
        bank, n = SPACE.bank_and_number(number)
        for register in NAMED_REGISTERS:
            name = row.nickname.removesuffix(register.suffix)
            if register.bank == bank.prefix and name and name != row.nickname:
                yield Claim(name, register.bank, n - register.offset, row, register.word)


def _near_loop_names(claims: list[Claim]) -> Iterator[str]:
    """Names that look like loops and are none, as the nickname of the action's bit is missing (D107)."""
    names = {claim.loop for claim in claims if claim.row.nickname == claim.loop + ACTION.suffix}
    for name in dict.fromkeys(claim.loop for claim in claims if claim.loop not in names):
        agreeing = Counter((claim.bank, claim.start) for claim in claims if claim.loop == name)
        count = sum(number for number in agreeing.values() if number >= MIN_AGREEING)
        if not count:
            continue
        place = next((f" at C{start + ACTION.offset}" for bank, start in agreeing if bank == ACTION.bank), "")
        yield (
            f"{name}: {count} nicknames are those of a loop, but {name}{ACTION.suffix} is missing{place}, so it is not "
            "read as one (D107)"
        )


def _loop_settings(claims: list[Claim]) -> Iterator[Mapping[str, Any]]:
    names = [claim.loop for claim in claims if claim.row.nickname == claim.loop + ACTION.suffix]
    for name in dict.fromkeys(names):
        entry: dict[str, object] = {"loop": name}
        for bank, key in BLOCK_KEYS.items():
            block_claims = [claim for claim in claims if claim.loop == name and claim.bank == bank]
            if block_claims:
                entry[key] = _block_start(block_claims)
        unit = _unit_in_comments(claim for claim in claims if claim.loop == name)
        yield entry | ({"pv": {"unit": unit}} if unit else {})


def _unit_in_comments(claims: Iterable[Claim]) -> str:
    """The unit of the PV, where the comments of all its registers are ours and end with the same one (D1081)."""
    words = [(f"{claim.word.title}, ", claim.row.comment) for claim in claims if claim.word.unit == "pv"]
    units = {text.removeprefix(title) for title, text in words if text.startswith(title)}
    is_told = len(units) == 1 and all(text.startswith(title) for title, text in words)
    return units.pop() if is_told else ""


def _block_start(claims: list[Claim]) -> str:
    """Where a block begins when all nicknames agree."""
    first = claims[0]
    other = next((claim for claim in claims if claim.start != first.start), None)
    if other is not None:
        raise ListingError(
            f"the nicknames of {first.loop} do not agree: {first.row.nickname} at {first.row.address} belongs to a "
            f"block from {first.bank}{first.start}, {other.row.nickname} at {other.row.address} to one from "
            f"{other.bank}{other.start}",
            other.row.line,
        )
    if SPACE.parse(f"{first.bank}{first.start}") is None:
        raise ListingError(f"{first.row.nickname} at {first.row.address} leaves no room for its block", first.row.line)
    return f"{first.bank}{first.start}"


# --- A nickname list of the user's with the nicknames of all loops added, in the columns that it has (D106) -----------

CELL_PATTERN = re.compile(r'"(?:[^"]|"")*"|[^",\r\n][^,\r\n]*|')
"""A cell as it is written, with its quotes."""
FIRST_HOLDING = 400_001
"""Reference of the first holding register; coils count from 1."""
FUNCTION_CODES = {"coil": "FC=01,05,15", "holding": "FC=03,06,16"}
"""How CLICK's own exports name the Modbus functions of C bits, and of DS and DF registers."""


def merge_nicknames(image: Image, text: str) -> tuple[str, tuple[str, ...]]:
    """The text of the user's file with all rows, and what was done; only an initial value of theirs is renewed."""
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    table, own_table = parse_nicknames(text), parse_nicknames(write_nicknames(image))
    hexadecimal = _modbus_style(table)
    set_addresses = {row.address for row in nicknames(image) if row.value}
    changed: dict[str, str] = {}
    created, filled, unchanged, notes = [], 0, [], []
    for row in own_table.rows:
        same_address, same_name = table.by_address.get(row.address), table.by_name.get(row.nickname.casefold())
        if same_name is None and (same_address is None or same_address.is_unused):
            line = _arrange_cells(row, table, hexadecimal=hexadecimal)
            if same_address is None:
                created.append(line)
            else:
                changed[row.address], filled = line + _line_end(same_address.raw), filled + 1
        elif same_address is not None and same_address is same_name:
            unchanged.append(row.address)
            if row.address in set_addresses and (initial_content(same_address) or 0) != initial_content(row):
                changed[row.address] = _replace_cell(same_address.raw, table.column_index("Initial Value"), row.value)
                notes.append(
                    f"initial value renewed: {row.nickname} ({row.address}), {same_address.value or 0} to {row.value}"
                )
        else:
            notes.append(_conflict_note(row, same_address, same_name))
    body = "".join(changed.get(row.address, row.raw) for row in table.rows)
    if created and not (table.head + body).endswith(("\n", "\r")):
        body += table.line_end
    body += "".join(line + table.line_end for line in created)
    merged = table.head + body
    if len(parse_nicknames(merged).rows) != len(table.rows) + len(created):
        raise ListingError("the rows could not be added to this file")
    return mark + merged, (f"created {len(created) + filled}, already there: {len(unchanged)}", *notes, *table.notes)


def _modbus_style(table: Table) -> bool:
    """Whether the file writes Modbus addresses in hexadecimal; what it says of a C, DS or DF row must be so."""
    if MODBUS not in table.columns:
        return False
    stated = [row for row in table.rows if row.modbus]
    own = [row for row in stated if not row.is_foreign]
    hexadecimal = any(row.modbus.endswith(("h", "H")) for row in own or stated)
    for row in own:
        expected = _modbus_address(row.address, hexadecimal=hexadecimal)[0]
        if row.modbus.lstrip("0").casefold() != expected.lstrip("0").casefold():
            raise ListingError(
                f"{row.address} has the {MODBUS} {expected}, but the file says {row.modbus[:40]!r}; export it again, "
                "or correct the cell",
                row.line,
            )
    return hexadecimal


def _modbus_address(address: str, *, hexadecimal: bool) -> tuple[str, str]:
    """The Modbus address of a C, DS or DF register as CLICK's exports write it, and its function codes."""
    table, register, _ = modbus_place(SPACE.parse(address) or 0)
    first = 1 if table == "coil" else FIRST_HOLDING
    return f"{register:04X}h" if hexadecimal else str(first + register), FUNCTION_CODES[table]


def _arrange_cells(row: Row, table: Table, *, hexadecimal: bool) -> str:
    """A row of ours in the columns of the user's file, without its line end."""
    line = row.raw.removesuffix("\n")
    if MODBUS not in table.columns:
        return line
    address, kind, behind = line.split(",", 2)
    register, codes = _modbus_address(row.address, hexadecimal=hexadecimal)
    return f'{address},{kind},{register},"{codes}",{behind}'


def _replace_cell(raw: str, column: int, value: str) -> str:
    """A row's text with another value in one column, and every other character as it was."""
    position = 0
    for _ in range(column):
        cell = CELL_PATTERN.match(raw, position)
        position = (position if cell is None else cell.end()) + 1
    cell = CELL_PATTERN.match(raw, position)
    return raw[:position] + value + raw[position if cell is None else cell.end() :]


def _line_end(raw: str) -> str:
    return raw[len(raw.rstrip("\r\n")) :]


def _conflict_note(row: Row, same_address: Row | None, same_name: Row | None) -> str:
    """Why a row was not added."""
    reasons = []
    if same_address is not None:
        reasons.append(
            f"{same_address.address} is {same_address.nickname!r}"
            if same_address.nickname
            else f"{same_address.address} has no nickname there"
        )
    if same_name is not None:
        reasons.append(f"the nickname is that of {same_name.address}")
    return f"{CONFLICT}, left as it is: {row.nickname} ({row.address}) was not created, since {' and '.join(reasons)}"
