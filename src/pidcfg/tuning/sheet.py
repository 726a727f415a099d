"""A recorded table as loggers and spreadsheets save it: separators, decimal commas, header and units are found.

Nothing is guessed that could be read two ways: such a file is refused with the place and what to do.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

from pidcfg.encoders.listing import ListingError
from pidcfg.listings import listing_text
from pidcfg.tuning.rules import TuningError
from pidcfg.tuning.stamps import looks_like_stamp
from pidcfg.unreadable import binary_file

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)([eE][+-]?[0-9]{1,3})?")
POINT, COMMA = re.compile(r"[+-]?[0-9]*\.[0-9]*([eE].*)?"), re.compile(r"[+-]?[0-9]*,[0-9]*([eE].*)?")
THOUSANDS = {
    False: re.compile(r"[+-]?[0-9]{1,3}(,[0-9]{3})+\.[0-9]+"),
    True: re.compile(r"[+-]?[0-9]{1,3}(\.[0-9]{3})+,[0-9]+"),
}
"""Numbers with both signs, by whether the comma is the decimal one."""
WITH_UNIT = re.compile(r"([+-]?[0-9.,]+(?:[eE][+-]?[0-9]{1,3})?)\s*(%|°?[A-Za-z][A-Za-z°/²³]{0,7})")
UNIT_IN_NAME = re.compile(r"(.*?)[\s_]*[\[(<]\s*([^\])>]*?)\s*[\])>]\s*")
UNITS = frozenset(
    {"s", "sec", "ms", "min", "h", "%", "°c", "°f", "c", "f", "degc", "degf", "k", "bar", "mbar", "pa", "psi"}
)
MORE_UNITS = frozenset(
    {"kpa", "mpa", "l/min", "l/h", "m3/h", "m³/h", "kg/h", "gpm", "mm", "cm", "m", "v", "ma", "rpm", "hz"}
)
MISSING = frozenset(
    {"", "nan", "null", "none", "n/a", "na", "#n/a", "#num!", "#value!", "-", "--", "---", "bad", "no data"}
)
"""What a logger writes where it has no value."""
LEAST_COLUMNS = 2


@dataclass(frozen=True, slots=True)
class Row:
    """A row of values: its line, from 1, and its cells without blanks around."""

    line: int
    cells: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Sheet:
    """The table of a file: names and units of its columns (empty where there are none), and its rows."""

    name: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: Sequence[Row]
    comma: bool
    """Whether numbers have a decimal comma."""
    remarks: tuple[str, ...] = ()
    """What was found that a reader should know."""

    @property
    def width(self) -> int:
        """How many columns there are."""
        return len(self.names)

    def title(self, column: int) -> str:
        """A column for people: its number, and its name where it has one."""
        return f"{column + 1}" + (f" {self.names[column]!r}" if self.names[column] else "")

    def number(self, row: Row, column: int) -> float | None:
        """A cell as a number, None where the logger had none; raises `TuningError` with its place."""
        text = row.cells[column]
        if text.lower() in MISSING:
            return None
        value = number_of(text, comma=self.comma)
        if value is None:
            raise TuningError(
                f"{self.name}:{row.line}:{column + 1}: {text[:40]!r} in column {self.title(column)} is not a number; "
                "correct or remove the row, or choose other columns with --columns"
            )
        return value


def number_of(text: str, *, comma: bool) -> float | None:
    """A finite number with its decimal sign; a unit may stand behind it."""
    found = WITH_UNIT.fullmatch(text)
    bare = found[1] if found else text
    grouped = THOUSANDS[comma].fullmatch(bare)
    bare = bare.replace("." if comma else ",", "") if grouped else bare
    if not NUMBER.fullmatch(bare) or (not comma and "," in bare) or (comma and "." in bare):
        return None
    value = float(bare.replace(",", "."))
    return value if isfinite(value) else None


def read_sheet(data: bytes, name: str) -> Sheet:
    """The table in a file's bytes; raises `TuningError`."""
    if other := binary_file(data):
        raise TuningError(f"{name}: {other[0]}, no table of a record; {other[1]}")
    text, remarks = _text(data, name)
    lines = [(n, line) for n, line in enumerate(text.splitlines(), start=1) if line.strip()]
    lines = [(n, line) for n, line in lines if not line.lstrip().startswith(("#", "//"))]
    between = _delimiter([line for _, line in lines])
    rows = [Row(n, _cells(line, between, f"{name}:{n}")) for n, line in lines]
    first = next((i for i, row in enumerate(rows) if _holds_values(row.cells)), None)
    if first is None:
        raise TuningError(f"{name} holds no samples; a record has a row a sample, with time, output and PV")
    width = _width(rows[first:])
    names, units = _header(rows[:first], width)
    body = _body(rows[first:], width, names, name)
    comma = _decimal_comma(body, name)
    shown = {"\t": "tabs", None: "blanks"}.get(between, f"{between!r}")
    if comma:
        remarks.append(f"numbers have a decimal comma, cells are separated by {shown}")
    return Sheet(name, names, units, body, comma, tuple(remarks))


def _text(data: bytes, name: str) -> tuple[str, list[str]]:
    try:
        return listing_text(data), []
    except ListingError as error:
        if b"\0" in data:
            raise TuningError(f"{name}: {error}") from None
        return data.decode("cp1252", "replace"), ["the file is not UTF-8; it was read as Windows-1252"]


def _delimiter(lines: Sequence[str]) -> str | None:
    """What stands between cells; None: blanks."""
    for sign in (";", "\t", "|"):
        if sum(sign in line for line in lines) * 2 > len(lines):
            return sign
    blanks = [line.split() for line in lines]
    if sum(len(cells) > LEAST_COLUMNS and all(map(NUMBER.fullmatch, cells)) for cells in blanks) * 2 > len(lines):
        return None
    return "," if sum("," in line for line in lines) * 2 > len(lines) else None


def _cells(line: str, between: str | None, place: str) -> tuple[str, ...]:
    if between is None:
        return tuple(line.split())
    try:
        cells = next(csv.reader([line], delimiter=between, strict=True))
    except csv.Error as error:
        raise TuningError(f"{place}: not CSV: {error}") from None
    return tuple(_plain(cell) for cell in cells)


def _plain(cell: str) -> str:
    """A cell without blanks of any width around it, and with the minus of the keyboard."""
    return cell.replace("\N{NO-BREAK SPACE}", " ").replace("\N{MINUS SIGN}", "-").strip()


def _is_value(cell: str) -> bool:
    return bool(NUMBER.fullmatch(cell) or WITH_UNIT.fullmatch(cell) or looks_like_stamp(cell))


def _holds_values(cells: Iterable[str]) -> bool:
    return sum(map(_is_value, cells)) >= LEAST_COLUMNS


def _width(rows: Sequence[Row]) -> int:
    """The number of columns that most rows have, without empty ones at the end."""
    counts = Counter(len(row.cells) for row in rows)
    width = max(counts, key=lambda n: (counts[n], n))
    whole = [row for row in rows if len(row.cells) == width]
    while width and not any(row.cells[width - 1] for row in whole):
        width -= 1
    return width


def _header(above: Sequence[Row], width: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of the columns, from the last row above the values, and a row of units below it."""
    rows = [row.cells for row in above if len(row.cells) >= width or sum(map(bool, row.cells)) >= LEAST_COLUMNS]
    units = [""] * width
    if len(rows) > 1 and all(_is_unit(cell) for cell in rows[-1]):
        units = [cell.strip("[]()") for cell in _filled(rows.pop(), width)]
    names = _filled(rows[-1], width) if rows else [""] * width
    for i, name in enumerate(names):
        found = UNIT_IN_NAME.fullmatch(name)
        if found:
            names[i], units[i] = found[1] or name, units[i] or found[2]
    return tuple(names), tuple(units)


def _is_unit(cell: str) -> bool:
    return not cell or cell.lower().strip("[]()") in UNITS | MORE_UNITS or cell.startswith(("[", "("))


def _filled(cells: Sequence[str], width: int) -> list[str]:
    return [*cells, *[""] * width][:width]


def _body(rows: Sequence[Row], width: int, names: Sequence[str], name: str) -> list[Row]:
    """The rows of values, each with as many cells as there are columns."""
    body = []
    for row in rows:
        cells = row.cells
        if len(cells) == 2 * sum(map(bool, names)):
            raise TuningError(
                f"{name}:{row.line}: {len(cells)} cells stand under {sum(map(bool, names))} names: commas between "
                "cells and within numbers cannot be told apart; save the file with semicolons between cells"
            )
        if len(cells) < width or any(cells[width:]):
            if not any(cells):
                continue
            comma = "; where a comma is the decimal sign, separate cells by semicolons" * (len(cells) > width)
            message = f"{len(cells)} cells where the others have {width}; correct the row{comma}"
            raise TuningError(f"{name}:{row.line}: {message}")
        body.append(Row(row.line, cells[:width]))
    return body


def _decimal_comma(rows: Sequence[Row], name: str) -> bool:
    """Whether numbers have a decimal comma; a file with both signs is refused."""
    seen: dict[bool, tuple[int, int, str]] = {}
    for row in rows:
        for column, cell in enumerate(row.cells):
            found = WITH_UNIT.fullmatch(cell)
            bare = found[1] if found else cell
            for comma in (False, True):
                one = (COMMA if comma else POINT).fullmatch(bare) and NUMBER.fullmatch(bare)
                if one or THOUSANDS[comma].fullmatch(bare):
                    seen.setdefault(comma, (row.line, column + 1, cell))
    if len(seen) > 1:
        (line, column, cell), (_, _, other) = seen[True], seen[False]
        raise TuningError(
            f"{name}:{line}:{column}: {cell!r} has a decimal comma, and {other!r} a decimal point; write all alike"
        )
    return True in seen
