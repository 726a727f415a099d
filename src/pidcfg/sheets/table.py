"""A sheet as a table of texts: CSV with any usual separator, or the first sheet of a workbook."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.limits import Limits

SEPARATORS = ",;\t"
APOSTROPHE = re.compile(r"'(?=[=+\-@\t\r'])")
"""What keeps a spreadsheet from calculating a text; written by us, and no part of it."""
COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
GROUPED = re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+(?:,\d+)?")
MOST_UNPACKED = 50
"""Times the limit on the size of a file that a workbook may have without its compression."""
WORKBOOK = b"PK\x03\x04"


class SheetError(ValueError):
    """A sheet that cannot be read: what is wrong, and where."""


@dataclass(frozen=True, slots=True)
class Cell:
    """A text and its place: line and column of the sheet, both from 1."""

    text: str
    row: int
    column: int

    @property
    def place(self) -> str:
        """As spreadsheets call it."""
        letters, number = "", self.column
        while number:
            number, rest = divmod(number - 1, 26)
            letters = chr(ord("A") + rest) + letters
        return f"{letters}{self.row}"


@dataclass(frozen=True, slots=True)
class Sheet:
    """The rows that hold anything, and whether numbers have a decimal comma."""

    rows: Sequence[Sequence[Cell]]
    comma: bool

    def plain(self, cell: Cell) -> str:
        """A cell's text with a decimal point; raises `SheetError` for a number of two readings."""
        if not self.comma:
            return cell.text
        if GROUPED.fullmatch(cell.text) and "," not in cell.text:
            raise SheetError(
                f"{cell.text} can be two numbers where others have a decimal comma; write it without the point"
            )
        if GROUPED.fullmatch(cell.text):
            return cell.text.replace(".", "").replace(",", ".")
        return cell.text.replace(",", ".") if COMMA.fullmatch(cell.text) else cell.text


def read_sheet(data: bytes, name: str, limits: Limits) -> Sheet:
    """The table of a file; raises `SheetError`."""
    if len(data) > limits.file_bytes:
        raise SheetError(f"{name} is larger than {limits.file_bytes} bytes")
    rows = list(_workbook(data, name, limits) if data.startswith(WORKBOOK) else _csv(data, name))
    rows = [row for row in rows if row]
    count = sum(map(len, rows))
    if count > limits.nodes:
        raise SheetError(f"{name} has more than {limits.nodes} cells")
    return Sheet(rows, any(COMMA.fullmatch(cell.text) for row in rows for cell in row))


def _csv(data: bytes, name: str) -> Iterator[list[Cell]]:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise SheetError(f"{name} is not UTF-8; save it as 'CSV UTF-8'") from None
    if "\0" in text:
        raise SheetError(f"{name} is no text; save it as CSV or XLSX")
    lines = text.splitlines()
    separator = max(SEPARATORS, key=lambda sign: (sum(sign in line for line in lines), sign != ","))
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    try:
        before = 0
        for row in reader:
            yield _cells(row, before + 1)
            before = reader.line_num
    except csv.Error as error:
        raise SheetError(f"{name}, line {reader.line_num}: {error}") from None


def _cells(row: Sequence[Any], number: int) -> list[Cell]:
    texts = [(APOSTROPHE.sub("", str(text).strip(), count=1), i) for i, text in enumerate(row, start=1)]
    return [Cell(text, number, i) for text, i in texts if text]


def _workbook(data: bytes, name: str, limits: Limits) -> Iterator[list[Cell]]:
    """The first sheet; what its formulas gave when it was saved."""
    from openpyxl import load_workbook

    try:
        with zipfile.ZipFile(io.BytesIO(data)) as package:
            if sum(entry.file_size for entry in package.infolist()) > MOST_UNPACKED * limits.file_bytes:
                raise SheetError(f"{name} is larger than {MOST_UNPACKED * limits.file_bytes} bytes when it is unpacked")
        book = load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        for number, row in enumerate(book.worksheets[0].iter_rows(values_only=True), start=1):
            yield _cells(["" if value is None else _text(value) for value in row], number)
    except (zipfile.BadZipFile, KeyError, ValueError, IndexError) as error:
        if isinstance(error, SheetError):
            raise
        raise SheetError(f"{name} is no workbook that can be read; save it as XLSX or CSV") from None


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)
    return str(value)
