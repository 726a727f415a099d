"""A sheet as a table of texts: CSV with any usual separator, or the first sheet of a workbook."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from dataclasses import dataclass
from datetime import date, time, timedelta
from typing import TYPE_CHECKING, Any

from pidcfg.control_characters import FORMULA

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.limits import Limits

SEPARATORS = ",;\t"
APOSTROPHE = re.compile(f"^'(?=[{re.escape(''.join(FORMULA))}])")
"""What keeps a spreadsheet from calculating a text; written by us, and no part of it."""
COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
POINT = re.compile(r"[+-]?\d+\.\d+(?:[eE][+-]?\d+)?")
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""A decimal comma, or what English writes between thousands."""
GROUPED = re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+(?:,\d+)?")
MOST_UNPACKED = 50
"""Times the limit on the size of a file that a workbook may have without its compression."""
MOST_ELEMENTS = 10
"""Elements of XML that a workbook may have for each cell that is allowed."""
BLOCK = 1 << 16
WORKBOOK = b"PK\x03\x04"


class SheetError(ValueError):
    """A sheet that cannot be read: what is wrong, and where."""


@dataclass(frozen=True, slots=True)
class Cell:
    """A text and its place: line and column of the sheet, both from 1."""

    text: str
    row: int
    column: int
    number: bool = False
    """Of a workbook, which leaves no doubt of what it is."""

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
    """The rows that hold anything, and whether numbers have a decimal comma, for certain or perhaps."""

    rows: Sequence[Sequence[Cell]]
    comma: bool
    certain: bool
    left_out: tuple[str, ...] = ()
    """Other sheets of a workbook that hold anything."""

    def plain(self, cell: Cell) -> str:
        """A cell's text with a decimal point; raises `SheetError` for a number of two readings."""
        if not self.comma or cell.number:
            return cell.text
        if THOUSANDS.fullmatch(cell.text) and not self.certain:
            raise SheetError(
                f"{cell.text} can be two numbers, {cell.text.replace(',', '.')} or {cell.text.replace(',', '')}; "
                "write the one that is meant, without the comma"
            )
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
    left_out: tuple[str, ...] = ()
    separator = ""
    if data.startswith(WORKBOOK):
        rows, left_out = _workbook(data, name, limits)
    else:
        text = _text_of(data, name)
        separator = _separator(text)
        rows = list(_csv(text, separator, name))
    rows = [row for row in rows if row]
    count = sum(map(len, rows))
    if count > limits.nodes:
        raise SheetError(f"{name} has more than {limits.nodes} cells")
    texts = [cell.text for row in rows for cell in row if not cell.number]
    commas = [text for text in texts if COMMA.fullmatch(text)]
    points = any(POINT.fullmatch(text) and not GROUPED.fullmatch(text) for text in texts)
    certain = not points and (separator == ";" or not all(map(THOUSANDS.fullmatch, commas)))
    return Sheet(rows, bool(commas), certain, left_out)


def _text_of(data: bytes, name: str) -> str:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise SheetError(f"{name} is not UTF-8; save it as 'CSV UTF-8'") from None
    if "\0" in text:
        raise SheetError(f"{name} is no text; save it as CSV or XLSX")
    return text


def _separator(text: str) -> str:
    lines = text.splitlines()
    return max(SEPARATORS, key=lambda sign: (sum(sign in line for line in lines), sign != ","))


def _csv(text: str, separator: str, name: str) -> Iterator[list[Cell]]:
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


def _workbook(data: bytes, name: str, limits: Limits) -> tuple[list[list[Cell]], tuple[str, ...]]:
    """The first sheet with what its formulas gave when it was saved, and the names of others that hold anything."""
    book, written = _books(data, name, limits)
    sheet = book.worksheets[0]
    if sheet.merged_cells.ranges:
        raise SheetError(
            f"{name}: the cells {min(map(str, sheet.merged_cells.ranges))} are merged, and only the first of "
            "them has a value; unmerge them, and write the value into each row that has it"
        )
    if _area(sheet) > limits.nodes:
        last = Cell("", sheet.max_row, sheet.max_column)
        raise SheetError(
            f"{name}: its cells reach to {last.place}, and it may have {limits.nodes}; delete the rows and columns "
            "behind the loops"
        )
    rows = []
    for row, as_written in zip(sheet.iter_rows(), written.worksheets[0].iter_rows(), strict=True):
        cells = [_cell(*pair, name) for pair in zip(row, as_written, strict=True)]
        rows.append([cell for cell in cells if cell is not None])
    others = book.worksheets[1:]
    return rows, tuple(o.title for o in others if _area(o) > limits.nodes or any(any(row) for row in o.values))


def _books(data: bytes, name: str, limits: Limits) -> tuple[Any, Any]:
    """A workbook with the results of its formulas, and as it is written."""
    from openpyxl import load_workbook

    try:
        _refuse_bombs(data, name, limits)
        book, written = load_workbook(io.BytesIO(data), data_only=True), load_workbook(io.BytesIO(data))
    except SheetError:
        raise
    except Exception:  # noqa: BLE001 - openpyxl lets through whatever its parsers raise
        raise SheetError(f"{name} is no workbook that can be read; save it as XLSX or CSV") from None
    if not book.worksheets:
        raise SheetError(f"{name} has no sheet with cells")
    return book, written


def _refuse_bombs(data: bytes, name: str, limits: Limits) -> None:
    """Raises `SheetError` for a workbook that is small and makes much of it; its parts are read, and not kept."""
    elements = 0
    with zipfile.ZipFile(io.BytesIO(data)) as package:
        if sum(entry.file_size for entry in package.infolist()) > MOST_UNPACKED * limits.file_bytes:
            raise SheetError(f"{name} is larger than {MOST_UNPACKED * limits.file_bytes} bytes when it is unpacked")
        for entry in package.infolist():
            with package.open(entry) as part:
                while block := part.read(BLOCK):
                    elements += block.count(b"<")
                    if elements > MOST_ELEMENTS * limits.nodes:
                        raise SheetError(f"{name} has more than {MOST_ELEMENTS * limits.nodes} elements")


def _area(sheet: Any) -> int:
    """Cells from the first to the last one of a sheet, as many as openpyxl would make."""
    return int(sheet.max_row * sheet.max_column)


def _cell(cell: Any, written: Any, name: str) -> Cell | None:
    """A cell of a workbook, None for an empty one; raises `SheetError` for one that shows something else."""
    value = cell.value
    place = f"{name}, row {cell.row}, cell {cell.coordinate}"
    if value is None:
        if written.value is not None:
            raise SheetError(
                f"{place}: the formula has no result in the file; open it in a spreadsheet and save it, "
                "or write the number"
            )
        return None
    if cell.data_type == "e":
        raise SheetError(f"{place}: the formula gives {value}; mend it, or write the number")
    if isinstance(value, date | time | timedelta):
        raise SheetError(f"{place}: the cell holds a date or a time of day, {value}; write a number or a text")
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if number and "%" in cell.number_format:
        raise SheetError(
            f"{place}: the cell shows percent and holds {value}; give it the format of a number, and write the one "
            "that is meant"
        )
    text = APOSTROPHE.sub("", _text(value).strip(), count=1)
    return Cell(text, cell.row, cell.column, number) if text else None


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)
    return str(value)
