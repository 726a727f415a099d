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
    COLUMN_ALIASES,
    DECIMAL_PATTERN,
    HEADERS_ADVICE,
    Listing,
    ListingError,
    column_names,
    decimal_content,
    first_line,
    read_csv,
    read_settings_line,
    reference,
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

ROW_PATTERN = re.compile(r'"?(?P<place>[Vv][0-9]\w*|4[0-9]{4,5})"?(?P<sign>[ \t]*[,;:=]|(?=[ \t]|$))(?P<rest>.*)')
"""An address or a Modbus reference, what stands behind it, and its words."""
MARKED_WORD = re.compile(r"(?:(?:0[xX]|16#|\$|[kK])([0-9A-Fa-f]{1,4})|([0-9A-Fa-f]{1,5})[hH])")
"""A word whose digits say by themselves that they are hexadecimal."""
FOUR_HEX_DIGITS = re.compile(r"[0-9A-Fa-f]{4}")
DIGITS_PATTERN = re.compile(r"[0-9A-Fa-f]{1,5}")
LETTER_PATTERN = re.compile(r"[A-Fa-f]")
WORD_DIGITS, HEXADECIMAL, DECIMAL_BASE = 4, 16, 10
MIN_ROW_WORDS = 3
"""So many words of four digits in one row, and nothing else, are those of as many addresses."""
FIVE_DIGIT_REFERENCES, SIX_DIGIT_REFERENCES = (40_001, 49_999), (400_001, 465_536)
"""References of holding registers: the first and the last one, of five digits and of six."""
TABLE_POINTER, MAX_LOOPS = 0o7640, 8
"""V7640 says where the loop table begins; V7641 behind it how many loops there are."""
VALUE_COLUMNS = frozenset({"value", "status", "decimal", "dec"})
COLUMN_NAMES = COLUMN_ALIASES | {"register": "address", "reference": "address", "status": "value"}
"""What programming software and Modbus clients call the columns; that of a Data View is its status."""


class Digits(NamedTuple):
    """A word as it is written: where, whose, and to which base where that is known."""

    line: int
    column: int
    address: str
    text: str
    base: int | None
    sign: str = ""
    """What stands between it and its address; empty in a table."""
    offset: int = 0
    """Which word of its row."""

    @property
    def short_text(self) -> str:
        """Its text, short enough for a message."""
        return self.text[:40]

    @property
    def has_length(self) -> bool:
        """Whether its digits are more than one, so that the base matters."""
        return len(self.text) > 1

    def error(self, message: str) -> ListingError:
        """The word's place with a message."""
        return ListingError(message, self.line, self.column)

    def read_content(self, base: int) -> int:
        """The content; raises `ListingError` for what no word can hold."""
        match = MARKED_WORD.fullmatch(self.text)
        text = self.text if match is None else match[1] or match[2]
        if base == HEXADECIMAL:
            if not DIGITS_PATTERN.fullmatch(text) or int(text, base) > WORD.highest:
                hint = ", where O is a letter" if "O" in text.upper() else ""
                raise self.error(f"{self.short_text!r} is not word content of up to 4 hexadecimal digits{hint}")
            return int(text, base)
        if self.has_length and text.startswith("0"):
            raise self.error(_unlikely_problem(self))
        raw = decimal_content(text, WORD)
        if raw is None:
            raise self.error(f"{self.address}: {self.short_text!r} is not {WORD.holds}")
        return raw


def _fill_listing(listing: Listing, words: list[Digits]) -> Listing:
    """The words in the listing, when it is known how the doubtful ones and the registers are meant."""
    words = [word._replace(base=HEXADECIMAL) if MARKED_WORD.fullmatch(word.text) else word for word in words]
    base = _find_base([word for word in words if word.base is None], listing)
    read = [(word, word.read_content(word.base or base)) for word in words]
    if any(word.text[0] in "kK" for word in words):
        _add_note(listing, "K before digits is the constant of a ladder program: K0100 is the word 0100")
    first = _first_register(read, listing)
    for word, raw in read:
        place = (int(word.address) - first if word.address.isdigit() else _word_address(word)) + word.offset
        if not 0 <= place <= SPACE.banks[0].last:
            raise word.error(f"there is no word {word.offset} behind {word.address}")
        listing.add(
            place, raw, SPACE.name(place) if word.offset else word.address, word.line, word.column if word.offset else 1
        )
    return listing


def _add_note(listing: Listing, text: str) -> None:
    listing.notes = (*listing.notes, f"{text} (D991)")


def _no_address_text(text: str) -> str:
    octal = "; its digits are octal, 0 to 7" if re.fullmatch(r"[Vv][0-9]+", text) else ""
    return f"{text[:40]!r} is not an address of this vendor{octal}"


def _word_address(word: Digits) -> int:
    number = SPACE.parse(word.address.upper())
    if number is None:
        raise ListingError(_no_address_text(word.address), word.line, 1)
    return number


def _first_register(register_words: list[tuple[Digits, int]], listing: Listing) -> int:
    """What number the register of V0 has in this file."""
    contents = {int(word.address): raw for word, raw in register_words if word.address.isdigit()}
    if not contents:
        return 0
    register = next(word for word, _ in register_words if word.address.isdigit())
    for low, high in (FIVE_DIGIT_REFERENCES, SIX_DIGIT_REFERENCES):
        if all(low <= number <= high for number in contents):
            _add_note(
                listing, f"{register.address} is read as the reference of {SPACE.name(int(register.address) - low)}"
            )
            return low
    firsts = [first for first in (0, 1) if _has_table(contents, first)]
    if len(firsts) != 1:
        raise register.error(
            f"register {register.address} may count from 0 or from 1, and no V7640 in the file tells which by the loop "
            f"table that it points to; write references, {reference('holding', 0o2000)} for V2000, or addresses"
        )
    _add_note(listing, f"registers count from {firsts[0]}: so V7640 finds the loop table")
    return firsts[0]


def _has_table(contents: dict[int, int], first: int) -> bool:
    """Whether V7640 and V7641 are there, and a loop table where they say, when V0 has the number ``first``."""
    start, loops = contents.get(TABLE_POINTER + first), contents.get(TABLE_POINTER + 1 + first)
    return start is not None and loops in range(1, MAX_LOOPS + 1) and start + first in contents


def _find_base(unmarked: list[Digits], listing: Listing) -> int:
    """How digits without a mark are meant, by all of them together; refused where that is open."""
    invalid = next((word for word in unmarked if not DIGITS_PATTERN.fullmatch(word.text)), None)
    if invalid is not None:
        raise invalid.error(f"{invalid.address}: {invalid.short_text!r} is not {WORD.holds}")
    letter = next((word for word in unmarked if LETTER_PATTERN.search(word.text)), None)
    others = [word for word in unmarked if word.has_length and not LETTER_PATTERN.search(word.text)]
    if letter is not None:
        short = next((word for word in others if len(word.text) != WORD_DIGITS), None)
        if short is not None:
            explanation = f"may be hexadecimal or decimal, and {letter.text} in line {letter.line} is hexadecimal"
            raise short.error(f"{short.address}: {short.text} {explanation}; {_base_cure(short)}")
        _add_note(listing, f"words are read as hexadecimal, as {letter.text} of {letter.address} must be")
        return HEXADECIMAL
    padded = next((word for word in others if word.sign or word.text.startswith("0")), None)
    if padded is not None:
        raise padded.error(_unlikely_problem(padded))
    if others:
        five_digits = next((word for word in others if len(word.text) > WORD_DIGITS), None)
        evidence = (
            f"as {five_digits.text} of {five_digits.address} must be"
            if five_digits
            else "call their column Hex if they are not"
        )
        _add_note(listing, f"values are read as decimal{', ' if five_digits else '; '}{evidence}")
    return DECIMAL_BASE


def _unlikely_problem(word: Digits) -> str:
    """Why digits are not taken for a decimal number, and the cure."""
    if word.sign:
        return f"{word.address}: {word.text} may be hexadecimal or decimal; {_base_cure(word)}"
    return f"{word.address}: {word.text} looks hexadecimal and stands in a column of decimal values; {_base_cure(word)}"


def _base_cure(word: Digits) -> str:
    if word.sign:
        return f"write blanks in place of {word.sign!r} behind {word.address}, or begin a table with {HEADERS_ADVICE}"
    return "call the column Hex, or write it without the zeros before it"


# --- Shapes: rows without a header, and tables ------------------------------------------------------------------------


def looks_like_rows(text: str) -> bool:
    """Whether the first line is an address with words behind it."""
    return ROW_PATTERN.fullmatch(first_line(text)) is not None


def looks_like_table(text: str) -> bool:
    """Whether the first line is a header of addresses or registers, and no Modbus map."""
    names = {COLUMN_NAMES.get(name, name) for name in column_names(text)}
    return "address" in names and not {"table", "tag", "nickname"} & names


def read_rows(text: str) -> Listing:
    """Rows of an address and its word, or the words from there on; what stands behind one word is for people."""
    listing, words = Listing(), list[Digits]()
    for number, line in enumerate(text.splitlines(), start=1):
        if read_settings_line(line, number, listing):
            continue
        start = len(line) - len(line.lstrip()) + 1
        row = ROW_PATTERN.fullmatch(line.strip())
        if row is None:
            raise ListingError(_no_address_text(line.split()[0]), number, start)
        words += _read_row(row, number, start)
    return _fill_listing(listing, words)


def _read_row(row: re.Match[str], line: int, start: int) -> list[Digits]:
    address, sign = row["place"], row["sign"].strip()
    cells = [(cell, start + row.start("rest") + at) for cell, at in _split_cells(row["rest"], sign, line)]
    if not cells:
        raise ListingError(f"the word of {address} is missing", line, start + len(row[0].rstrip()))
    base = None if sign else HEXADECIMAL
    if sign in {":", "="} or (
        len(cells) >= MIN_ROW_WORDS and all(FOUR_HEX_DIGITS.fullmatch(cell) for cell, _ in cells)
    ):
        return [Digits(line, column, address, cell, base, sign, i) for i, (cell, column) in enumerate(cells)]
    word = Digits(line, cells[0][1], address, cells[0][0], base, sign)
    if len(cells) > 1 and DECIMAL_PATTERN.fullmatch(cells[1][0]):
        raw = word.read_content(HEXADECIMAL)
        if decimal_content(cells[1][0], WORD) != raw:
            problem = f"hex {WORD.hex(raw)} is {raw}, but the value says {cells[1][0][:40]}"
            raise ListingError(f"{address}: {problem}", line)
        word = word._replace(base=HEXADECIMAL)
    return [word]


def _split_cells(rest: str, sign: str, line: int) -> Iterator[tuple[str, int]]:
    """The cells behind an address, each with where it begins."""
    if sign in {",", ";"} and '"' in rest:
        try:
            cells = next(csv.reader([rest], delimiter=sign, strict=True, skipinitialspace=True), [])
        except csv.Error as error:
            raise ListingError(f"not CSV: {error}", line) from None
        yield from ((text, 0) for cell in cells if (text := cell.strip()))
        return
    for cell in re.finditer(r"[^,;]+" if sign in {",", ";"} else r"[^ \t,;]+", rest):
        if text := cell[0].strip():
            yield text, cell.start() + cell[0].index(text)


def read_table(text: str) -> Listing:
    """A table by its header: as every vendor's where the digits have a column, else by what its values are."""
    names = set(column_names(text))
    if "hex" in names and names & VALUE_COLUMNS:
        return read_csv(text, SPACE)
    listing, words = Listing(), list[Digits]()
    decimal = DECIMAL_BASE if names & {"decimal", "dec"} else None
    for number, row in table_rows(text, listing, required=("address", "hex|value"), aliases=COLUMN_NAMES):
        place, column = row["address"], "hex" if "hex" in row else "value"
        base = HEXADECIMAL if column == "hex" else decimal
        words.append(Digits(number, 1, place, row[column] or " ", base))
        if not re.fullmatch(r"[0-9]{1,6}", place):
            _word_address(words[-1])
    return _fill_listing(listing, words)
