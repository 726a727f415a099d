"""A sheet of loops, CSV or XLSX, to a configuration."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import date, time, timedelta
from importlib.resources import files
from typing import Any

from pidcfg.output.sheets import (
    TEXT_KEYS,
    UnknownColumnError,
    is_column_header,
    key_of,
    key_order,
    switch_keys,
    to_yaml_value,
    unit_of,
)
from pidcfg.schemas.base import scaled_sides
from pidcfg.schemas.terms import PAIR_ENDS
from pidcfg.text.diagnostics import Diagnostic, Severity
from pidcfg.text.document import Plain
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Data, Path, parse_path, set_value, value_at
from pidcfg.text.reader import Limits
from pidcfg.text.signs import FORMULA_STARTS
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import check_document
from pidcfg.validate.shared_checks import action_key, action_word
from pidcfg.vendors import VENDORS, Vendor

# --- A sheet as a table of texts: CSV with any usual separator, or the first sheet of a workbook ----------------------

SEPARATORS = ",;\t"
APOSTROPHE_PATTERN = re.compile(f"^'(?=[{re.escape(''.join(FORMULA_STARTS))}])")
"""What keeps a spreadsheet from calculating a text; written by us, and no part of it."""
COMMA_NUMBER = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
POINT_NUMBER = re.compile(r"[+-]?\d+\.\d+(?:[eE][+-]?\d+)?")
THOUSANDS_NUMBER = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""A decimal comma, or what English writes between thousands."""
GROUPED_NUMBER = re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+(?:,\d+)?")
MAX_UNPACKED = 50
"""Times the limit on the size of a file that a workbook may have without its compression."""
MAX_ELEMENTS = 10
"""Elements of XML that a workbook may have for each cell that is allowed."""
BLOCK_BYTES = 1 << 16
WORKBOOK_SIGN = b"PK\x03\x04"


class SheetError(ValueError):
    """A sheet that cannot be read: what is wrong, and where."""


@frozen
class Cell:
    """A text and its place: line and column of the sheet, both from 1."""

    text: str
    row: int
    column: int
    is_number: bool = False
    """Of a workbook, which leaves no doubt of what it is."""

    @property
    def name(self) -> str:
        """As spreadsheets call it."""
        letters, number = "", self.column
        while number:
            number, rest = divmod(number - 1, 26)
            letters = chr(ord("A") + rest) + letters
        return f"{letters}{self.row}"


@frozen
class Sheet:
    """The rows that hold anything, and whether numbers have a decimal comma, for certain or perhaps."""

    rows: Sequence[Sequence[Cell]]
    has_comma: bool
    is_certain: bool
    other_sheets: tuple[str, ...] = ()
    """Other sheets of a workbook that hold anything."""
    remark: str = ""
    """How the text was read, where that is not certain."""

    def plain_number(self, cell: Cell) -> str:
        """A cell's text with a decimal point; raises `SheetError` for a number of two readings."""
        if not self.has_comma or cell.is_number:
            return cell.text
        if THOUSANDS_NUMBER.fullmatch(cell.text) and not self.is_certain:
            raise SheetError(
                f"{cell.text} can be two numbers, {cell.text.replace(',', '.')} or {cell.text.replace(',', '')}; "
                "write the one that is meant, without the comma"
            )
        if GROUPED_NUMBER.fullmatch(cell.text) and "," not in cell.text:
            raise SheetError(
                f"{cell.text} can be two numbers where others have a decimal comma; write it without the point"
            )
        if GROUPED_NUMBER.fullmatch(cell.text):
            return cell.text.replace(".", "").replace(",", ".")
        return cell.text.replace(",", ".") if COMMA_NUMBER.fullmatch(cell.text) else cell.text


def read_sheet(data: bytes, name: str, limits: Limits) -> Sheet:
    """The table of a file; raises `SheetError`."""
    if len(data) > limits.listing_bytes:
        raise SheetError(f"{name} is larger than {limits.listing_bytes} bytes")
    other_sheets: tuple[str, ...] = ()
    separator = remark = ""
    if data.startswith(WORKBOOK_SIGN):
        rows, other_sheets = _workbook_rows(data, name, limits)
    else:
        text, remark = _text_of(data, name)
        separator = _separator_of(text)
        rows = list(_csv_rows(text, separator, name))
    rows = [row for row in rows if row]
    count = sum(map(len, rows))
    if count > limits.nodes:
        raise SheetError(f"{name} has more than {limits.nodes} cells")
    texts = [cell.text for row in rows for cell in row if not cell.is_number]
    commas = [text for text in texts if COMMA_NUMBER.fullmatch(text)]
    has_points = any(POINT_NUMBER.fullmatch(text) and not GROUPED_NUMBER.fullmatch(text) for text in texts)
    is_certain = not has_points and (separator == ";" or not all(map(THOUSANDS_NUMBER.fullmatch, commas)))
    return Sheet(rows, bool(commas), is_certain, other_sheets, remark)


def _text_of(data: bytes, name: str) -> tuple[str, str]:
    """The text, and what is assumed of it: Excel writes CSV in Windows-1252 unless it is told otherwise."""
    remark = ""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        try:
            text, remark = data.decode("cp1252"), "it is no UTF-8, so it is read as Windows-1252, as Excel writes CSV"
        except UnicodeDecodeError:
            raise SheetError(f"{name} is neither UTF-8 nor Windows-1252; save it as 'CSV UTF-8'") from None
    if "\0" in text:
        raise SheetError(f"{name} is no text; save it as CSV or XLSX")
    return text, remark


def _separator_of(text: str) -> str:
    lines = text.splitlines()
    return max(SEPARATORS, key=lambda sign: (sum(sign in line for line in lines), sign != ","))


def _csv_rows(text: str, separator: str, name: str) -> Iterator[list[Cell]]:
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    try:
        last_line = 0
        for row in reader:
            yield _row_cells(row, last_line + 1)
            last_line = reader.line_num
    except csv.Error as error:
        raise SheetError(f"{name}, line {reader.line_num}: {error}") from None


def _row_cells(row: Sequence[object], number: int) -> list[Cell]:
    texts = [(APOSTROPHE_PATTERN.sub("", str(text).strip(), count=1), i) for i, text in enumerate(row, start=1)]
    return [Cell(text, number, i) for text, i in texts if text]


def _workbook_rows(data: bytes, name: str, limits: Limits) -> tuple[list[list[Cell]], tuple[str, ...]]:
    """The first sheet with what its formulas gave when it was saved, and the names of others that hold anything."""
    book, formula_book = _load_workbooks(data, name, limits)
    sheet = book.worksheets[0]
    if sheet.merged_cells.ranges:
        raise SheetError(
            f"{name}: the cells {min(map(str, sheet.merged_cells.ranges))} are merged, and only the first of "
            "them has a value; unmerge them, and write the value into each row that has it"
        )
    if _cell_count(sheet) > limits.nodes:
        last = Cell("", sheet.max_row, sheet.max_column)
        raise SheetError(
            f"{name}: its cells reach to {last.name}, and it may have {limits.nodes}; delete the rows and columns "
            "behind the loops"
        )
    rows = []
    for row, formula_row in zip(sheet.iter_rows(), formula_book.worksheets[0].iter_rows(), strict=True):
        cells = [_workbook_cell(*pair, name) for pair in zip(row, formula_row, strict=True)]
        rows.append([cell for cell in cells if cell is not None])
    other_sheets = book.worksheets[1:]
    return rows, tuple(
        o.title for o in other_sheets if _cell_count(o) > limits.nodes or any(any(row) for row in o.values)
    )


def _load_workbooks(data: bytes, name: str, limits: Limits) -> tuple[Any, Any]:
    """A workbook with the results of its formulas, and as it is written."""
    from openpyxl import load_workbook

    try:
        _refuse_bombs(data, name, limits)
        book, formula_book = load_workbook(io.BytesIO(data), data_only=True), load_workbook(io.BytesIO(data))
    except SheetError:
        raise
    except Exception:  # noqa: BLE001 - openpyxl lets through whatever its parsers raise
        raise SheetError(f"{name} is no workbook that can be read; save it as XLSX or CSV") from None
    if not book.worksheets:
        raise SheetError(f"{name} has no sheet with cells")
    return book, formula_book


def _refuse_bombs(data: bytes, name: str, limits: Limits) -> None:
    """Raises `SheetError` for a workbook that is small and makes much of it; its parts are read, and not kept."""
    elements = 0
    with zipfile.ZipFile(io.BytesIO(data)) as package:
        if sum(entry.file_size for entry in package.infolist()) > MAX_UNPACKED * limits.listing_bytes:
            raise SheetError(f"{name} is larger than {MAX_UNPACKED * limits.listing_bytes} bytes when it is unpacked")
        for entry in package.infolist():
            with package.open(entry) as part:
                while block := part.read(BLOCK_BYTES):
                    elements += block.count(b"<")
                    if elements > MAX_ELEMENTS * limits.nodes:
                        raise SheetError(f"{name} has more than {MAX_ELEMENTS * limits.nodes} elements")


def _cell_count(sheet: Any) -> int:
    """Cells from the first to the last one of a sheet, as many as openpyxl would make."""
    return int(sheet.max_row * sheet.max_column)


def _workbook_cell(cell: Any, formula_cell: Any, name: str) -> Cell | None:
    """A cell of a workbook, None for an empty one; raises `SheetError` for one that shows something else."""
    value = cell.value
    location = f"{name}, row {cell.row}, cell {cell.coordinate}"
    if value is None:
        if formula_cell.value is not None:
            raise SheetError(
                f"{location}: the formula has no result in the file; open it in a spreadsheet and save it, "
                "or write the number"
            )
        return None
    if cell.data_type == "e":
        raise SheetError(f"{location}: the formula gives {value}; mend it, or write the number")
    if isinstance(value, date | time | timedelta):
        raise SheetError(f"{location}: the cell holds a date or a time of day, {value}; write a number or a text")
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if is_number and "%" in cell.number_format:
        raise SheetError(
            f"{location}: the cell shows percent and holds {value}; give it the format of a number, and write the one "
            "that is meant"
        )
    text = APOSTROPHE_PATTERN.sub("", _value_text(value).strip(), count=1)
    return Cell(text, cell.row, cell.column, is_number) if text else None


def _value_text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)
    return str(value)


# --- A sheet of loops to a configuration: one loop a row, and above the header what concerns the whole file -----------

MISSING_KEY_CODE, EQUAL_NAMES_CODE = "PID021", "PID106"
"""The codes of a key that is not there, and of a name that two loops have, which the sheet's reader tells itself."""
HEAD_KEYS = ("vendor", "name", "description", "plc", "signals", "blocks", "moves", "templates")
"""Keys of the whole file, each with its value in the cell behind it, above the header."""
NUMBER = re.compile(r"[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?")
MAX_LISTED = 10
"""Rows, or loops, that are listed of those of which the same is told."""
FAMILY_HEADERS = {"vendor", "plc family", "hersteller"}
"""Headers of a column that says the vendor: the same in every row."""
COMMENT_COLUMN_SIGN = "#"
"""Begins the header of a column that is for people alone."""
MIN_KNOWN_COLUMNS = 2
"""Known columns by which a row is the header."""
SIDE_HEADERS = {"pv": "range low and range high", "output": "output.range low and output.range high"}
"""The sides of a loop, and the headers of their ranges."""
OUTPUT_NUMBERS = ("limits", "offset")
"""Numbers of an output, which without a range are counts."""
PERCENT_OUTPUT = {"range": [0, 100], "unit": "%"}
"""An output of which nothing is said."""


# --- What people write in cells, in English and German, as the vendor's own words ------------------------------------

MODE_SPELLINGS = {
    "auto": "automatik automatisch automatic",
    "manual": "hand handbetrieb manuell",
    "cascade": "kaskade",
}
"""What people write in a cell in the place of a mode."""
DIRECTION_SPELLINGS = {"direct": "direkt", "reverse": "umgekehrt invers revers", "forward": "vorwärts"}
"""The same of a direction, by the word of the vendor for its own action."""
ACTION_WORDS = {
    "action": {"direct": "direct", "reverse": "reverse"},
    "Direct": {"direct": "true", "reverse": "false"},
    "PID_DIR": {"forward": "true", "reverse": "false"},
}
"""By the key of the action, what the manual's words for it are written as."""
PURPOSE_SPELLINGS = {
    True: "heizen heizend heizung heat heating",
    False: "kühlen kühlend kühlung kuehlen cool cooling",
}
"""The same of a direction, by whether the PV rises with the output: that means one thing with every vendor."""
SWITCH_SPELLINGS = {"true": "ja wahr yes", "false": "nein falsch no"}
"""The same of a switch."""


def cell_word(text: str, key: str, vendor: Vendor) -> str:
    """What a cell of a column means in the vendor's own words; a text that no list has stays as it is."""
    spelling = text.strip().casefold()
    if key == "mode":
        return _word_of_spelling(MODE_SPELLINGS, spelling) or (spelling if spelling in MODE_SPELLINGS else text)
    if key == action_key(vendor):
        purpose = next((heats for heats, words in PURPOSE_SPELLINGS.items() if spelling in words.split()), None)
        vendor_word = action_word(vendor, raises_pv=purpose) if purpose is not None else None
        vendor_word = vendor_word or ACTION_WORDS.get(key, {}).get(
            _word_of_spelling(DIRECTION_SPELLINGS, spelling) or spelling
        )
        if vendor_word:
            return vendor_word
    return _word_of_spelling(SWITCH_SPELLINGS, spelling) or text if key in switch_keys(vendor) else text


def _word_of_spelling(table: Mapping[str, str], spelling: str) -> str | None:
    """The word under which a table has a spelling."""
    return next((word for word, spellings in table.items() if spelling in spellings.split()), None)


# --- The configuration of a sheet -------------------------------------------------------------------------------------


@frozen
class SheetConfiguration:
    """A configuration's text, and what there is to say about it."""

    text: str
    vendor: Vendor
    loops: int
    findings: tuple[Diagnostic, ...]
    remarks: tuple[str, ...]


class SheetFaultsError(ValueError):
    """Everything that is wrong with a sheet, each with its place."""

    def __init__(self, faults: Sequence[str]) -> None:
        super().__init__(faults[0])
        self.faults = tuple(faults)


def read_configuration(data: bytes, name: str, vendor_key: str | None, limits: Limits) -> SheetConfiguration:
    """The configuration of a sheet; raises `SheetFaultsError`."""
    try:
        sheet = read_sheet(data, name, limits)
        head, header, rows = _split_rows(sheet, name)
        vendor = _vendor_of(_find_vendor(head, header, rows, name), vendor_key, name)
    except SheetError as error:
        raise SheetFaultsError([str(error)]) from None
    reader = _Reader(sheet, name, vendor, limits)
    columns = reader.read_columns(header)
    loops = [reader.read_loop(row, columns, i) for i, row in enumerate(rows)]
    reader.refuse_equal_names(loops)
    scale_remarks = reader.check_scales(loops, columns)
    content = reader.read_head(head)
    remarks = [sheet.remark] * bool(sheet.remark)
    remarks += (
        [f"only the first sheet is read; also there: {', '.join(sheet.other_sheets)}"] if sheet.other_sheets else []
    )
    remarks += scale_remarks
    if "plc" not in content and _needs_plc(vendor):
        content["plc"] = _starter_plc(vendor)
        remarks.append(f"plc is as in the starter file of {vendor.key}; look at it")
    file_data = {"pidcfg": 1, "vendor": vendor.key, **content, "loops": loops}
    text = yaml_text(to_yaml_value(file_data))
    checked = check_document(read_document(text.encode(), name, limits))
    errors = [d for d in checked.findings if d.severity is Severity.ERROR]
    if reader.faults or checked.config is None:
        raise SheetFaultsError(reader.all_faults(errors))
    findings = tuple(replace(d, message=message) for d, message in reader.merge_findings(errors))
    return SheetConfiguration(text, vendor, len(loops), findings, tuple(remarks))


def _split_rows(sheet: Sheet, name: str) -> tuple[list[Sequence[Cell]], Sequence[Cell], list[Sequence[Cell]]]:
    """What stands above the header, the header, and the rows of loops."""
    headers = [number for number, row in enumerate(sheet.rows) if _is_header(row)]
    if not headers:
        raise SheetError(
            f"{name} has no header; one row names the columns, such as name, gain, reset, range low, range high"
        )
    body_start = next((number for number, row in enumerate(sheet.rows) if not _is_head(row)), headers[0])
    number = body_start if body_start in headers else headers[0]
    rows = list(sheet.rows[number + 1 :])
    if not rows:
        raise SheetError(f"{name} has a header and no loops below it")
    return list(sheet.rows[:number]), sheet.rows[number], rows


def _is_header(row: Sequence[Cell]) -> bool:
    known_cells = [cell for cell in row if any(is_column_header(cell.text, vendor) for vendor in VENDORS.values())]
    return len(known_cells) >= MIN_KNOWN_COLUMNS and not (_is_head(row) and row[0].text != "name")


def _is_head(row: Sequence[Cell]) -> bool:
    """Whether a row may concern the whole file: a key of the file and its value."""
    return row[0].text.partition(".")[0] in HEAD_KEYS and len(row) <= MIN_KNOWN_COLUMNS


def _find_vendor(
    head: Sequence[Sequence[Cell]], header: Sequence[Cell], rows: Sequence[Sequence[Cell]], name: str
) -> str | None:
    """The vendor that the sheet names, above the header or in a column of its own."""
    column = next((cell.column for cell in header if _is_family(cell)), None)
    cells = [cell for row in rows for cell in row if cell.column == column]
    cells += [row[1] for row in head if row[0].text == "vendor" and len(row) > 1]
    contradiction = next((cell for cell in cells if cell.text.lower() != cells[0].text.lower()), None)
    if contradiction is not None:
        one, two = (f"cell {cell.name} says {cell.text}" for cell in (cells[0], contradiction))
        raise SheetError(f"{name}: {one} and {two}; a file has one vendor, so write a sheet for each")
    return cells[0].text.lower() if cells else None


def _is_family(cell: Cell) -> bool:
    return cell.text.strip().lower() in FAMILY_HEADERS


def _vendor_of(sheet_key: str | None, option_key: str | None, name: str) -> Vendor:
    if sheet_key is not None and option_key is not None and sheet_key != option_key:
        raise SheetError(f"{name} is for {sheet_key}, and --vendor says {option_key}")
    key = option_key or sheet_key
    if key is None:
        raise SheetError(f"{name} does not say for which vendor it is; add --vendor, one of {', '.join(VENDORS)}")
    if key not in VENDORS:
        raise SheetError(f"there is no vendor {key}; there are {', '.join(VENDORS)}")
    return VENDORS[key]


def _list_first(names: Sequence[str]) -> str:
    """The first of some names, and how many more there are."""
    return ", ".join(names[:MAX_LISTED]) + (f" and {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else "")


def _needs_plc(vendor: Vendor) -> bool:
    field = vendor.model.model_fields.get("plc")
    return field is not None and field.is_required()


def _starter_plc(vendor: Vendor) -> object:
    text = files("pidcfg").joinpath(vendor.starter).read_bytes()
    return (read_document(text, vendor.starter).data or {})["plc"]


class _Reader:
    """Cells to values, with what is wrong with them."""

    def __init__(self, sheet: Sheet, name: str, vendor: Vendor, limits: Limits) -> None:
        self.sheet, self.name, self.vendor, self.limits = sheet, name, vendor, limits
        self.faults: list[tuple[Cell, str]] = []
        self.cells_by_path: dict[Path, tuple[Cell, str]] = {}
        """The cell of each value, and the header of its column."""
        self.rows: list[Cell] = []
        self.unknown_columns: set[int] = set()
        """Columns whose header is no key of a loop."""
        self.half_pairs: set[Path] = set()
        """Pairs of which one end is missing."""
        self.value_count = 0
        """In cells that hold more than one, counted with what their aliases stand for."""

    def add_fault(self, cell: Cell, message: str) -> None:
        """Something wrong with a cell."""
        self.faults.append((cell, f"{self.name}, row {cell.row}, cell {cell.name}: {message}"))

    def all_faults(self, errors: Sequence[Diagnostic]) -> list[str]:
        """What is wrong with the cells, and with the file that they make, in the order of the sheet.

        What follows from a fault of a cell is none of its own: it has no value, or its column no key.
        """
        faulty = {(cell.row, cell.column) for cell, _ in self.faults}
        rows = {cell.row for cell, _ in self.faults}
        row_messages = [(cell.row, cell.column, message) for cell, message in self.faults]
        own_findings = [
            d for d in errors if not (d.code == MISSING_KEY_CODE and (self.unknown_columns or self._row_of(d) in rows))
        ]
        own_findings = [
            d for d in own_findings if d.code != EQUAL_NAMES_CODE and not {d.path, d.path[:-1]} & self.half_pairs
        ]
        own_findings = [
            d
            for d in own_findings
            if (source := self._cell_of(d)) is None or (source[0].row, source[0].column) not in faulty
        ]
        for d, message in self.merge_findings(own_findings):
            source = self._cell_of(d)
            row_messages.append((self._row_of(d), source[0].column if source else 0, message))
        return [message for *_, message in sorted(row_messages)]

    def _cell_of(self, d: Diagnostic) -> tuple[Cell, str] | None:
        """The cell that a finding is about, and the header of its column."""
        path: Path = d.path
        while path and path not in self.cells_by_path:
            path = path[:-1]
        return self.cells_by_path[path] if path else None

    def _row_of(self, d: Diagnostic) -> int:
        """The row that a finding is about; 0: none."""
        source = self._cell_of(d)
        if source is None and len(d.path) > 1 and d.path[0] == "loops":
            return self.rows[int(d.path[1])].row
        return 0 if source is None else source[0].row

    def read_columns(self, header: Sequence[Cell]) -> dict[int, tuple[str, str]]:
        """Key and header by the number of a column."""
        columns: dict[int, tuple[str, str]] = {}
        headers: dict[str, str] = {}
        for cell in header:
            if _is_family(cell) or cell.text.startswith(COMMENT_COLUMN_SIGN):
                self.unknown_columns.add(cell.column)
                continue
            try:
                key = key_of(cell.text, self.vendor)
            except UnknownColumnError as error:
                self.add_fault(cell, str(error))
                self.unknown_columns.add(cell.column)
                continue
            if key in headers:
                self.add_fault(cell, f"{cell.text} and {headers[key]} are both {key}; keep one of the two")
            pair = key.removesuffix(PAIR_ENDS[0]).removesuffix(PAIR_ENDS[1])
            for other in (pair,) if pair != key else (key + PAIR_ENDS[0], key + PAIR_ENDS[1]):
                if other in headers:
                    self.add_fault(cell, f"{cell.text} and {headers[other]} are both {pair}; keep the pair or its ends")
            headers[key] = cell.text
            columns[cell.column] = (key, cell.text)
        return columns

    def read_loop(self, row: Sequence[Cell], columns: dict[int, tuple[str, str]], number: int) -> Data:
        """The loop of a row."""
        loop: Data = {}
        self.rows.append(row[0])
        for cell in row:
            if cell.column in self.unknown_columns:
                continue
            if cell.column not in columns:
                self.add_fault(cell, f"{cell.text!r} has no header above it")
                continue
            key, header = columns[cell.column]
            end = next((i for i, word in enumerate(PAIR_ENDS) if key.endswith(word)), None)
            path = parse_path(key if end is None else key.removesuffix(PAIR_ENDS[end]))
            if end is not None:
                pair = value_at(loop, path)
                if pair is None:
                    set_value(loop, path, pair := [None, None])
                pair[end] = self.read_value(cell, key, header)
                path = (*path, end)
            else:
                set_value(loop, path, self.read_value(cell, key, header))
            self.cells_by_path["loops", number, *path] = (cell, header)
        self._check_pairs(loop, row[0], (), number)
        return self._sort_sections(loop)

    def refuse_equal_names(self, loops: Sequence[Data]) -> None:
        """Each loop has a name of its own."""
        cells: dict[str, Cell] = {}
        for i, loop in enumerate(loops):
            cell = self.cells_by_path.get(("loops", i, "name"), (self.rows[i], ""))[0]
            name = str(loop.get("name", ""))
            if name and name in cells:
                self.add_fault(cell, f"{name} is the name of the loop in row {cells[name].row}, too; give each its own")
            cells.setdefault(name, cell)

    def check_scales(self, loops: list[Data], columns: dict[int, tuple[str, str]]) -> list[str]:
        """Asks for the range of a side that has a unit; an output of which no more is said is 0 to 100 %."""
        names: list[str] = []
        sections = {key.partition(" ")[0] for key, _ in columns.values()}
        masters = {str(loop.get("cascade_from")) for loop in loops}
        for i, loop in enumerate(loops):
            for side, headers in SIDE_HEADERS.items():
                scale, unit = loop.get(side, {}), value_at(loop, (side, "unit"))
                if side not in scaled_sides(self.vendor.model) or "use" in loop or "range" in scale:
                    continue
                name = str(loop.get("name", i + 1))
                lacks_range = not {"output.range", *(f"output.{key}" for key in OUTPUT_NUMBERS)} & sections
                if side == "output" and lacks_range and unit in {None, "%"} and name not in masters:
                    loops[i] = self._sort_sections({**loop, side: {**PERCENT_OUTPUT, **scale}})
                    names.append(name)
                elif unit is not None:
                    cell = self.cells_by_path["loops", i, side, "unit"][0]
                    self.add_fault(
                        cell,
                        f"{side}.unit is {unit}, and there is no {side}.range: add the columns {headers}, "
                        "what 0 % and 100 % of the signal stand for",
                    )
        return [f"output.range is [0, 100] % in {_list_first(names)}, since the sheet says none"] if names else []

    def _sort_sections(self, loop: Data) -> Data:
        """A loop with its sections as the schema has them, whatever the order of the columns."""
        section_order: dict[str, int] = {}
        for key, index in key_order(self.vendor).items():
            section_order.setdefault(key.partition(".")[0].partition(" ")[0], index)
        return dict(sorted(loop.items(), key=lambda item: section_order.get(item[0], len(section_order))))

    def _check_pairs(self, data: Data, row: Cell, parent_keys: tuple[str, ...], number: int) -> None:
        for key, value in data.items():
            if isinstance(value, dict):
                self._check_pairs(value, row, (*parent_keys, key), number)
            elif isinstance(value, list) and None in value:
                self.half_pairs.add(("loops", number, *parent_keys, key))
                self.add_fault(row, f"{'.'.join((*parent_keys, key))} has one end only; give low and high")

    def read_head(self, rows: Sequence[Sequence[Cell]]) -> Data:
        """What concerns the whole file."""
        content: Data = {}
        for row in rows:
            key = row[0].text
            if key.partition(".")[0] not in HEAD_KEYS:
                self.add_fault(
                    row[0], f"{key!r} stands above the header and is no key of a file; there are {', '.join(HEAD_KEYS)}"
                )
            elif len(row) != MIN_KNOWN_COLUMNS:
                self.add_fault(row[0], f"{key} wants one value, in the cell behind it")
            elif key != "vendor":
                set_value(content, parse_path(key), self.read_value(row[1], key))
                self.cells_by_path[parse_path(key)] = (row[1], key)
        return content

    def read_value(self, cell: Cell, key: str, header: str = "") -> object:
        """A cell as the file format would read it: plain text, or YAML in brackets or quotes."""
        if cell.text[0] in '[{"':
            doc = read_document(f"value: {cell.text}".encode(), self.name, self.limits)
            self.value_count += doc.root.size - 1  # without the mapping that is put around it
            if self.value_count > self.limits.nodes:
                raise SheetFaultsError([f"{self.name}: more than {self.limits.nodes} values up to cell {cell.name}"])
            if doc.data is not None:
                return doc.data["value"]
            self.add_fault(cell, doc.problems[0].message)
            return None
        if key.rpartition(".")[2] in TEXT_KEYS:
            return Plain(cell.text)
        try:
            text = self.sheet.plain_number(cell)
            unit = unit_of(header)
            return Plain(f"{text} {unit}" if unit and NUMBER.fullmatch(text) else cell_word(text, key, self.vendor))
        except SheetError as error:
            self.add_fault(cell, str(error))
            return None

    def merge_findings(self, errors: Sequence[Diagnostic]) -> list[tuple[Diagnostic, str]]:
        """The findings as they are told: what says the same of several rows once, with the further rows."""
        groups: dict[tuple[str, Path, str], list[Diagnostic]] = {}
        for d in errors:
            key = (*d.path[:1], *d.path[2:]) if d.path[:1] == ("loops",) and len(d.path) > 1 else d.path
            groups.setdefault((d.code, key, d.message), []).append(d)
        return [(group[0], self.row_text(group[0]) + self._other_rows(group[1:])) for group in groups.values()]

    def _other_rows(self, findings: Sequence[Diagnostic]) -> str:
        rows = [str(self.rows[int(d.path[1])].row) for d in findings]
        return f"; so it is in row{'s' if rows[1:] else ''} {_list_first(rows)}" if rows else ""

    def row_text(self, d: Diagnostic) -> str:
        """A finding with the row and the cell that it is about."""
        text = d.message + (f"; {d.help}" if d.help else "")
        source, row = self._cell_of(d), self._row_of(d)
        if source is not None:
            cell, header = source
            return f"{self.name}, row {cell.row}, cell {cell.name} ({header}): {text}"
        return f"{self.name}{f', row {row}' if row else ''}: {text}"
