"""CLICK's data dump, which "Write Data into PLC" loads: whole banks, so that ours only go into one of the user's.

Everything that is not a cell of ours stays byte for byte. pyclickplc writes our cells and reads the result; what it
would skip, round or take for a number is refused before.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.click.package import read_with, written_by
from pidcfg.encoders.files import UnwritableError
from pidcfg.encoders.listing import Listing, ListingError, decimal_content
from pidcfg.encoders.maps.click import SPACE
from pidcfg.encoders.spaces import SINGLE
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.encoders.image import Image
    from pidcfg.encoders.spaces import Bank

D109 = Decision(
    109,
    "a data dump gets settings, and requests off",
    "Merged into a dump are the settings of each loop, and 0 for its requests; what the controller writes and reserved "
    "registers keep the dump's content.",
    "The dump is what the PLC held when it was read: a request caught in it would start when it is written back.",
)

MARK = "\ufeff"
START, END = re.compile(r"<([A-Z]{1,3})=START>"), re.compile(r"</([A-Z]{1,3})=END>")
BANKS = {bank.prefix: bank for bank in SPACE.banks}
MOST_COLUMNS = 100


class Cell(NamedTuple):
    """One value of a dump: its raw content, its line, and where its text stands."""

    raw: int
    line: int
    start: int
    end: int


@dataclass(slots=True)
class Dump:
    """The C, DS and DF cells of a dump by address, and the lines of those three sections."""

    cells: dict[int, Cell] = field(default_factory=dict)
    sections: set[str] = field(default_factory=set)
    lines: list[str] = field(default_factory=list)


def write_dump(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """A dump of its own would write zeros everywhere else, so there is none."""
    del image, checklist
    raise UnwritableError("a data dump covers whole banks, and is only written into one of yours")


def read_dump(text: str) -> Listing:
    """All C, DS and DF values."""
    listing = Listing(mixed=True)
    for number, cell in parse(text).cells.items():
        listing.add(number, cell.raw, SPACE.name(number), cell.line)
    return listing


def parse(text: str) -> Dump:
    """The cells of the three banks, each checked; what pyclickplc would read must be the same."""
    dump = Dump()
    columns: list[int] = []
    bank, line, position = "", 0, 0
    for line, raw in enumerate(re.split(r"(?<=\n)", text), start=1):
        words, at = raw.strip(" \r\n" + MARK), position
        position += len(raw)
        opened, closed = START.fullmatch(words), END.fullmatch(words)
        if opened or closed:
            bank = _section(dump, bank, opened, closed, line)
            columns = []
        elif words and not bank:
            raise ListingError("this stands in no section of a data dump, which begins like <DS=START>", line)
        elif words and bank in BANKS and words.startswith("Address,"):
            columns = _columns(words, line)
        elif words and bank in BANKS:
            _row(dump, BANKS[bank], columns, raw, line, at)
        if bank in BANKS or closed:
            dump.lines.append(words)
    if bank:
        raise ListingError(f"the section {bank} does not end: the file is cut off", line)
    if not dump.sections:
        raise ListingError("this is no data dump: it has no section that begins like <DS=START>")
    _compare(dump)
    return dump


def _section(dump: Dump, bank: str, opened: re.Match[str] | None, closed: re.Match[str] | None, line: int) -> str:
    """The section that is open after this line."""
    if opened is None:
        name = closed.group(1) if closed else ""
        if name != bank:
            raise ListingError(f"the section {name} ends here, but {bank or 'none'} is open", line)
        return ""
    name = opened.group(1)
    if bank:
        raise ListingError(f"the section {name} begins inside {bank}", line)
    if name in dump.sections:
        raise ListingError(f"the section {name} stands here again", line)
    dump.sections.add(name)
    return name


def _columns(words: str, line: int) -> list[int]:
    """The header of a section: numbers from 1 up, which the address of a row is counted from."""
    cells = words.removesuffix(",").split(",")[1:]
    if len(cells) > MOST_COLUMNS or cells != [str(n) for n in range(1, len(cells) + 1)]:
        raise ListingError("the header of a section is Address,1,2,3 and so on", line)
    return list(range(len(cells)))


def _row(dump: Dump, bank: Bank, columns: list[int], raw: str, line: int, position: int) -> None:
    """The values of one row."""
    text = raw.rstrip(" \r\n")
    name, *cells = text.removesuffix(",").split(",")
    first = SPACE.parse(name.strip())
    if first is None or SPACE.place(first)[0] != bank:
        raise ListingError(f"{name.strip()[:40]!r} is not an address of {bank.prefix}", line)
    if len(cells) > len(columns):
        raise ListingError(
            f"{len(cells)} value{'s stand' if cells[1:] else ' stands'} under a header of {len(columns)}", line
        )
    start = position + len(name) + 1
    for offset, cell in enumerate(cells):
        number = first + offset
        if SPACE.place(number)[1] > bank.last:
            raise ListingError(f"{bank.prefix}{SPACE.place(number)[1]} does not exist", line)
        if number in dump.cells:
            raise ListingError(f"{SPACE.name(number)} stands here again", line)
        end = start + len(cell)
        dump.cells[number] = Cell(_raw(number, cell.strip(" "), line), line, start, end)
        start = end + 1


def _raw(number: int, text: str, line: int) -> int:
    kind = SPACE.kind(number)
    raw = decimal_content(text, kind)
    if raw is None:
        raise ListingError(f"{SPACE.name(number)}: {text[:40]!r} is not {kind.holds}", line)
    return raw


def _compare(dump: Dump) -> None:
    """What pyclickplc reads from the three sections must be the same."""
    from pyclickplc.plcdata import read_plc_data

    values = read_with(read_plc_data, "\n".join(dump.lines).encode("ascii", "replace"))
    for number, cell in dump.cells.items():
        name = SPACE.name(number)
        if name not in values or SPACE.kind(number).read(values.pop(name)) != cell.raw:
            raise ListingError(f"pyclickplc does not read {name} as it is written", cell.line)
    if values:
        raise ListingError(f"pyclickplc reads {next(iter(values))}, which no row has")


def merge_dump(image: Image, text: str) -> tuple[str, tuple[str, ...]]:
    """The user's dump with the loops' settings in their places, and all requests off (D109)."""
    dump = parse(text)
    settings = {c.number: c.raw for c in image.cells if c.access in {"setting", "request"}}
    missing = next((number for number in settings if number not in dump.cells), None)
    if missing is not None:
        raise ListingError(f"the dump does not hold {SPACE.name(missing)}; read all data from the PLC, and save that")
    written = _formatted(settings)
    pieces, position, changed = [], 0, 0
    for number in sorted(settings, key=lambda n: dump.cells[n].start):
        cell = dump.cells[number]
        if cell.raw != settings[number]:
            pieces += [text[position : cell.start], written[number]]
            position, changed = cell.end, changed + 1
    merged = "".join([*pieces, text[position:]])
    expected = {number: cell.raw for number, cell in dump.cells.items()} | settings
    if {number: cell.raw for number, cell in parse(merged).cells.items()} != expected:
        raise ListingError("the values could not be put into this dump")
    return merged, (f"{len(settings)} values are in the dump, {changed} of them changed",)


def _formatted(values: Mapping[int, int]) -> dict[int, str]:
    """Each value as pyclickplc writes it; one that its decimals do not hold is refused."""
    from pyclickplc.plcdata import write_plc_data

    data = {SPACE.name(number): SPACE.kind(number).show(raw) for number, raw in values.items()}
    text = written_by(lambda path: write_plc_data(path, data, banks=list(BANKS))).decode("ascii")
    text = text.replace("\r\n", "\n")
    cells = parse(text).cells
    for number, raw in values.items():
        if cells[number].raw != raw:
            decimals = " (eight decimals)" if SPACE.kind(number) is SINGLE else ""
            value = SPACE.kind(number).text(raw)
            raise UnwritableError(f"{SPACE.name(number)} = {value} does not fit into a data dump{decimals}")
    return {number: text[cells[number].start : cells[number].end] for number in values}
