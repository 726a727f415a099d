"""V-memory listings as other programs and people write them: rows of words, tables of values, Modbus registers.

A word is read where its digits have one reading. `V2007 7E08` is hexadecimal as in pidcfg's own listings, and so is
what is marked (`0x0100`, `0100h`, `K0100`). Where digits stand behind another sign, or in a column of values, all of
them together decide, and a note says what was taken (D991).
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from typing import NamedTuple

from pidcfg.encoders.listing import (
    DECIMAL,
    HEADERS,
    OTHER_NAMES,
    Listing,
    ListingError,
    columns,
    decimal_content,
    first_line,
    read_csv,
    reference,
    settings_line,
    table_rows,
)
from pidcfg.encoders.maps.dl06 import SPACE
from pidcfg.encoders.regmap import WORD
from pidcfg.text.references import Decision

D991 = Decision(
    991,
    "digits of a DL06 listing are read where they have one reading",
    "Marked words (0x0100, 0100h, 16#0100, $0100 and the constant K0100) are hexadecimal digits. Without a mark, "
    "behind a comma, semicolon, colon or equals sign or in a column of values, they are hexadecimal where one of them "
    "has a letter and every other one has four digits or a single one; in a column of values without letters, and "
    "without zeros before a digit, they are decimal. A note says which. All else is refused with a cure. Registers of "
    "Modbus count from 0 or from 1 as V7640 finds the loop table; references from 40001.",
    "0100 is 256 or 100: a gain or a limit that is read wrongly is a runaway. A memory dump has four digits a word; "
    "V7640 holds where the table begins, so that only one way to count finds words there.",
)

ROW = re.compile(r'"?(?P<place>[Vv][0-9]\w*|4[0-9]{4,5})"?(?P<sign>[ \t]*[,;:=]|(?=[ \t]|$))(?P<rest>.*)')
"""An address or a Modbus reference, what stands behind it, and its words."""
MARKED = re.compile(r"(?:(?:0[xX]|16#|\$|[kK])([0-9A-Fa-f]{1,4})|([0-9A-Fa-f]{1,5})[hH])")
"""A word whose digits say by themselves that they are hexadecimal."""
FOUR = re.compile(r"[0-9A-Fa-f]{4}")
DIGITS = re.compile(r"[0-9A-Fa-f]{1,5}")
LETTER = re.compile(r"[A-Fa-f]")
FOUR_DIGITS, HEXADECIMAL, DECIMAL_BASE = 4, 16, 10
SEVERAL = 3
"""So many words of four digits in one row, and nothing else, are those of as many addresses."""
FIVE, SIX = (40_001, 49_999), (400_001, 465_536)
"""References of holding registers: the first and the last one, of five digits and of six."""
POINTER, LOOPS = 0o7640, 8
"""V7640 says where the loop table begins; V7641 behind it how many loops there are."""
VALUES = frozenset({"value", "status", "decimal", "dec"})
NAMES = OTHER_NAMES | {"register": "address", "reference": "address", "status": "value"}
"""What programming software and Modbus clients call the columns; that of a Data View is its status."""


class Digits(NamedTuple):
    """A word as it is written: where, whose, and to which base where that is known."""

    line: int
    column: int
    place: str
    text: str
    base: int | None
    sign: str = ""
    """What stands between it and its address; empty in a table."""
    offset: int = 0
    """Which word of its row."""

    @property
    def shown(self) -> str:
        """Its text, short enough for a message."""
        return self.text[:40]

    @property
    def has_length(self) -> bool:
        """Whether its digits are more than one, so that the base matters."""
        return len(self.text) > 1

    def error(self, message: str) -> ListingError:
        """The word's place with a message."""
        return ListingError(message, self.line, self.column)

    def read(self, base: int) -> int:
        """The content; raises `ListingError` for what no word can hold."""
        marked = MARKED.fullmatch(self.text)
        text = self.text if marked is None else marked[1] or marked[2]
        if base == HEXADECIMAL:
            if not DIGITS.fullmatch(text) or int(text, base) > WORD.highest:
                slip = ", where O is a letter" if "O" in text.upper() else ""
                raise self.error(f"{self.shown!r} is not word content of up to 4 hexadecimal digits{slip}")
            return int(text, base)
        if self.has_length and text.startswith("0"):
            raise self.error(_unlikely(self))
        raw = decimal_content(text, WORD)
        if raw is None:
            raise self.error(f"{self.place}: {self.shown!r} is not {WORD.holds}")
        return raw


def _listing(listing: Listing, words: list[Digits]) -> Listing:
    """The words in the listing, when it is known how the doubtful ones and the registers are meant."""
    words = [word._replace(base=HEXADECIMAL) if MARKED.fullmatch(word.text) else word for word in words]
    base = _base([word for word in words if word.base is None], listing)
    read = [(word, word.read(word.base or base)) for word in words]
    if any(word.text[0] in "kK" for word in words):
        _note(listing, "K before digits is the constant of a ladder program: K0100 is the word 0100")
    first = _first(read, listing)
    for word, raw in read:
        place = (int(word.place) - first if word.place.isdigit() else _address(word)) + word.offset
        if not 0 <= place <= SPACE.banks[0].last:
            raise word.error(f"there is no word {word.offset} behind {word.place}")
        listing.add(
            place, raw, SPACE.name(place) if word.offset else word.place, word.line, word.column if word.offset else 1
        )
    return listing


def _note(listing: Listing, text: str) -> None:
    listing.notes = (*listing.notes, f"{text} (D991)")


def _no_address(text: str) -> str:
    octal = "; its digits are octal, 0 to 7" if re.fullmatch(r"[Vv][0-9]+", text) else ""
    return f"{text[:40]!r} is not an address of this vendor{octal}"


def _address(word: Digits) -> int:
    number = SPACE.parse(word.place.upper())
    if number is None:
        raise ListingError(_no_address(word.place), word.line, 1)
    return number


def _first(read: list[tuple[Digits, int]], listing: Listing) -> int:
    """What number the register of V0 has in this file."""
    have = {int(word.place): raw for word, raw in read if word.place.isdigit()}
    if not have:
        return 0
    one = next(word for word, _ in read if word.place.isdigit())
    for low, high in (FIVE, SIX):
        if all(low <= number <= high for number in have):
            _note(listing, f"{one.place} is read as the reference of {SPACE.name(int(one.place) - low)}")
            return low
    firsts = [first for first in (0, 1) if _has_table(have, first)]
    if len(firsts) != 1:
        raise one.error(
            f"register {one.place} may count from 0 or from 1, and no V7640 in the file tells which by the loop table "
            f"that it points to; write references, {reference('holding', 0o2000)} for V2000, or addresses"
        )
    _note(listing, f"registers count from {firsts[0]}: so V7640 finds the loop table")
    return firsts[0]


def _has_table(have: dict[int, int], first: int) -> bool:
    """Whether V7640 and V7641 are there, and a loop table where they say, when V0 has the number ``first``."""
    start, loops = have.get(POINTER + first), have.get(POINTER + 1 + first)
    return start is not None and loops in range(1, LOOPS + 1) and start + first in have


def _base(doubtful: list[Digits], listing: Listing) -> int:
    """How digits without a mark are meant, by all of them together; refused where that is open."""
    wrong = next((word for word in doubtful if not DIGITS.fullmatch(word.text)), None)
    if wrong is not None:
        raise wrong.error(f"{wrong.place}: {wrong.shown!r} is not {WORD.holds}")
    letter = next((word for word in doubtful if LETTER.search(word.text)), None)
    others = [word for word in doubtful if word.has_length and not LETTER.search(word.text)]
    if letter is not None:
        short = next((word for word in others if len(word.text) != FOUR_DIGITS), None)
        if short is not None:
            beside = f"may be hexadecimal or decimal, and {letter.text} in line {letter.line} is hexadecimal"
            raise short.error(f"{short.place}: {short.text} {beside}; {_cure(short)}")
        _note(listing, f"words are read as hexadecimal, as {letter.text} of {letter.place} must be")
        return HEXADECIMAL
    padded = next((word for word in others if word.sign or word.text.startswith("0")), None)
    if padded is not None:
        raise padded.error(_unlikely(padded))
    if others:
        long = next((word for word in others if len(word.text) > FOUR_DIGITS), None)
        sure = f"as {long.text} of {long.place} must be" if long else "call their column Hex if they are not"
        _note(listing, f"values are read as decimal{', ' if long else '; '}{sure}")
    return DECIMAL_BASE


def _unlikely(word: Digits) -> str:
    """Why digits are not taken for a decimal number, and the cure."""
    if word.sign:
        return f"{word.place}: {word.text} may be hexadecimal or decimal; {_cure(word)}"
    return f"{word.place}: {word.text} looks hexadecimal and stands in a column of decimal values; {_cure(word)}"


def _cure(word: Digits) -> str:
    if word.sign:
        return f"write blanks in place of {word.sign!r} behind {word.place}, or begin a table with {HEADERS}"
    return "call the column Hex, or write it without the zeros before it"


# --- Shapes: rows without a header, and tables ------------------------------------------------------------------------


def looks_like_rows(text: str) -> bool:
    """Whether the first line is an address with words behind it."""
    return ROW.fullmatch(first_line(text)) is not None


def looks_like_table(text: str) -> bool:
    """Whether the first line is a header of addresses or registers, and no Modbus map."""
    names = {NAMES.get(name, name) for name in columns(text)}
    return "address" in names and not {"table", "tag", "nickname"} & names


def read_rows(text: str) -> Listing:
    """Rows of an address and its word, or the words from there on; what stands behind one word is for people."""
    listing, words = Listing(), list[Digits]()
    for number, line in enumerate(text.splitlines(), start=1):
        if settings_line(line, number, listing):
            continue
        start = len(line) - len(line.lstrip()) + 1
        row = ROW.fullmatch(line.strip())
        if row is None:
            raise ListingError(_no_address(line.split()[0]), number, start)
        words += _row(row, number, start)
    return _listing(listing, words)


def _row(row: re.Match[str], line: int, start: int) -> list[Digits]:
    place, sign = row["place"], row["sign"].strip()
    cells = [(cell, start + row.start("rest") + at) for cell, at in _cells(row["rest"], sign, line)]
    if not cells:
        raise ListingError(f"the word of {place} is missing", line, start + len(row[0].rstrip()))
    base = None if sign else HEXADECIMAL
    if sign in {":", "="} or (len(cells) >= SEVERAL and all(FOUR.fullmatch(cell) for cell, _ in cells)):
        return [Digits(line, column, place, cell, base, sign, i) for i, (cell, column) in enumerate(cells)]
    word = Digits(line, cells[0][1], place, cells[0][0], base, sign)
    if len(cells) > 1 and DECIMAL.fullmatch(cells[1][0]):
        raw = word.read(HEXADECIMAL)
        if decimal_content(cells[1][0], WORD) != raw:
            told = f"hex {WORD.hex(raw)} is {raw}, but the value says {cells[1][0][:40]}"
            raise ListingError(f"{place}: {told}", line)
        word = word._replace(base=HEXADECIMAL)
    return [word]


def _cells(rest: str, sign: str, line: int) -> Iterator[tuple[str, int]]:
    """The cells behind an address, each with where it begins."""
    if sign in {",", ";"} and '"' in rest:
        try:
            found = next(csv.reader([rest], delimiter=sign, strict=True, skipinitialspace=True), [])
        except csv.Error as error:
            raise ListingError(f"not CSV: {error}", line) from None
        yield from ((text, 0) for cell in found if (text := cell.strip()))
        return
    for cell in re.finditer(r"[^,;]+" if sign in {",", ";"} else r"[^ \t,;]+", rest):
        if text := cell[0].strip():
            yield text, cell.start() + cell[0].index(text)


def read_table(text: str) -> Listing:
    """A table by its header: as every vendor's where the digits have a column, else by what its values are."""
    names = set(columns(text))
    if "hex" in names and names & VALUES:
        return read_csv(text, SPACE)
    listing, words = Listing(), list[Digits]()
    decimal = DECIMAL_BASE if names & {"decimal", "dec"} else None
    for number, row in table_rows(text, listing, required=("address", "hex|value"), other_names=NAMES):
        place, column = row["address"], "hex" if "hex" in row else "value"
        base = HEXADECIMAL if column == "hex" else decimal
        words.append(Digits(number, 1, place, row[column] or " ", base))
        if not re.fullmatch(r"[0-9]{1,6}", place):
            _address(words[-1])
    return _listing(listing, words)
