"""A recorded table as loggers and spreadsheets save it: separators, decimal commas, and times of all countries."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from datetime import UTC, date, datetime
from itertools import pairwise
from math import isfinite

from pidcfg.encoders.decoding import listing_text
from pidcfg.encoders.listing import ListingError
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import binary_file
from pidcfg.tuning.rules import TuningError

# ----------------------------------------------------------------------------------------------------------------------
# Times as loggers write them, to seconds: ISO stamps, dates of all countries, clock times, date and time apart.
# The standard library reads ISO; what it does not read is little and closed, so no library is needed for it.

MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
CLOCK = re.compile(r"([0-9]{1,3}):([0-9]{2})(?::([0-9]{2}))?(?:[.,]([0-9]{1,9}))?\s*(?:([AaPp])\.?[Mm]\.?)?")
YEAR_FIRST = re.compile(r"([0-9]{4})([-/.])([0-9]{1,2})\2([0-9]{1,2})")
YEAR_LAST = re.compile(r"([0-9]{1,2})([-/.])([0-9]{1,2})\2([0-9]{4}|[0-9]{2})")
NAMED_MONTH = re.compile(r"([0-9]{1,2})[-/ .]+([A-Za-z]{3})[a-z]*[-/ .,]+([0-9]{4}|[0-9]{2})")
MONTH_FIRST = re.compile(r"([A-Za-z]{3})[a-z]*\.? ([0-9]{1,2}),? ([0-9]{4})")
DAY, HALF_DAY = 86_400.0, 43_200.0
CENTURY = 2000
"""What a year of two digits counts from."""


class StampError(ValueError):
    """A time that cannot be read: why, and the index of its cell."""

    def __init__(self, message: str, row: int) -> None:
        super().__init__(message)
        self.row = row


@frozen
class Stamp:
    """A time as written: three numbers of a date (day and month not yet told apart), and seconds of the day."""

    year: int | None = None
    first: int = 0
    second: int = 0
    sign: str = ""
    """What stands between the numbers of the date; ``-`` also where the order is known: month, day."""
    clock: float = 0.0
    minutes: bool = False
    """The clock has two numbers only, which may be hours and minutes, or minutes and seconds."""
    hours: int = 0
    aware: bool = False


def looks_like_stamp(text: str) -> bool:
    """Whether a text is a time or a date."""
    return read_stamp(text) is not None


def read_stamp(text: str) -> Stamp | None:
    """A time, a date, or both; None for anything else."""
    text = text.strip()
    if CLOCK.fullmatch(text):
        return _clock(text)
    day, _, rest = _split(text)
    if not day:
        return _iso(text)
    found = _date(day)
    if found is None:
        return None
    if not rest:
        return found
    clock = _clock(rest)
    if clock is None:
        return _iso(text)
    return Stamp(found.year, found.first, found.second, found.sign, clock.clock, clock.minutes, clock.hours)


def _split(text: str) -> tuple[str, str, str]:
    """Date and clock of a text."""
    for pattern in (YEAR_FIRST, YEAR_LAST, NAMED_MONTH, MONTH_FIRST):
        found = pattern.match(text)
        if found:
            rest = text[found.end() :]
            return (found[0], "", rest.lstrip(" T,-_")) if not rest or rest[0] in " T,-_" else ("", "", "")
    return "", "", ""


def _date(text: str) -> Stamp | None:
    if found := YEAR_FIRST.fullmatch(text):
        return _stamp_of(int(found[1]), int(found[3]), int(found[4]))
    if found := YEAR_LAST.fullmatch(text):
        return Stamp(_year(found[4]), int(found[1]), int(found[3]), "." if found[2] == "." else "/")
    if found := NAMED_MONTH.fullmatch(text):
        month, day, year = found[2], found[1], found[3]
    elif found := MONTH_FIRST.fullmatch(text):
        month, day, year = found[1], found[2], found[3]
    else:
        return None
    name = month.lower()
    return _stamp_of(_year(year), MONTHS.index(name) + 1, int(day)) if name in MONTHS else None


def _year(text: str) -> int:
    return int(text) + (CENTURY if len(text) == 2 else 0)


def _stamp_of(year: int, month: int, day: int) -> Stamp | None:
    try:
        date(year, month, day)
    except ValueError:
        return None
    return Stamp(year, month, day, "-")


def _clock(text: str) -> Stamp | None:
    found = CLOCK.fullmatch(text)
    if found is None:
        return None
    first, second, third, fraction, half = found.groups()
    part = float(f"0.{fraction}") if fraction else 0.0
    if third is None and fraction:
        return Stamp(clock=int(first) * 60 + int(second) + part) if int(second) < 60 else None
    hours = int(first)
    if half:
        if not 1 <= hours <= 12:
            return None
        hours = hours % 12 + (12 if half in "Pp" else 0)
    if int(second) > 59 or int(third or 0) > 60:
        return None
    seconds = hours * 3600 + int(second) * 60 + int(third or 0) + part
    return Stamp(clock=seconds, minutes=third is None and not half, hours=hours)


def _iso(text: str) -> Stamp | None:
    """What the standard library reads, with its offset from UTC."""
    if not text[:4].isdigit() or len(text) < len("2026-01-01T00"):
        return None
    try:
        moment = datetime.fromisoformat(text.replace(",", "."))
    except ValueError:
        return None
    if moment.tzinfo is not None:
        moment = moment.astimezone(UTC)
    clock = moment.hour * 3600 + moment.minute * 60 + moment.second + moment.microsecond / 1e6
    return Stamp(moment.year, moment.month, moment.day, "-", clock, aware=moment.tzinfo is not None)


def seconds_of(texts: Sequence[str], *, minutes_first: bool = False) -> tuple[list[float], list[str]]:
    """Times of a column in seconds from some origin, and remarks; raises `StampError`.

    ``minutes_first``: two numbers are minutes and seconds.
    """
    stamps: list[Stamp] = []
    remarks: list[str] = []
    for i, text in enumerate(texts):
        stamp = read_stamp(text)
        if stamp is None:
            raise StampError(f"{text[:40]!r} is not a time", i)
        if stamps and ((stamp.year is None) != (stamps[0].year is None) or stamp.aware != stamps[0].aware):
            raise StampError(f"{text[:40]!r} is written otherwise than {texts[0][:40]!r}", i)
        stamps.append(stamp)
    clocks = [stamp.clock for stamp in stamps]
    if any(stamp.minutes for stamp in stamps):
        if minutes_first or max(stamp.hours for stamp in stamps) > 24:
            clocks = [c / 60 if s.minutes else c for c, s in zip(clocks, stamps, strict=True)]
            remarks.append("times are read as minutes:seconds")
        else:
            remarks.append("times are read as hours:minutes")
    if stamps[0].year is None:
        return _over_midnight(clocks, remarks), remarks
    days = _days(stamps, remarks)
    return [day * DAY + clock for day, clock in zip(days, clocks, strict=True)], remarks


def _over_midnight(clocks: Sequence[float], remarks: list[str]) -> list[float]:
    """Clock times that go on over midnight, forwards or backwards."""
    steps = [b - a for a, b in pairwise(clocks)]
    backwards = sum(d < 0 for d in steps) > sum(d > 0 for d in steps)
    shift, out = 0.0, list(clocks[:1])
    for clock, step in zip(clocks[1:], steps, strict=True):
        if not backwards and step < -HALF_DAY:
            shift += DAY
        elif backwards and step > HALF_DAY:
            shift -= DAY
        out.append(clock + shift)
    if shift:
        remarks.append("the times go on over midnight")
    return out


def _days(stamps: Sequence[Stamp], remarks: list[str]) -> list[int]:
    """Dates as numbers of days; which number is the day is told by the signs, by the numbers, or by the shorter way."""
    if len({(s.year, s.first, s.second) for s in stamps}) == 1 and stamps[0].sign == "/":
        return [0] * len(stamps)
    readings = {}
    for day_first in (True, False):
        try:
            readings[day_first] = [_day(stamp, day_first=day_first) for stamp in stamps]
        except ValueError:
            continue
    if not readings:
        bad = next(i for i, s in enumerate(stamps) if not _possible(s))
        raise StampError("there is no such date", bad)
    spans = {key: max(days) - min(days) for key, days in readings.items()}
    best = min(readings, key=lambda key: spans[key])
    if len(readings) > 1 and spans[True] != spans[False]:
        remarks.append(f"dates are read with the {'day' if best else 'month'} first, by which the record is shorter")
    return readings[best]


def _possible(stamp: Stamp) -> bool:
    for day_first in (True, False):
        try:
            _day(stamp, day_first=day_first)
        except ValueError:
            continue
        return True
    return False


def _day(stamp: Stamp, *, day_first: bool) -> int:
    month, day = stamp.first, stamp.second
    if stamp.sign == "." or (stamp.sign == "/" and day_first):
        month, day = day, month
    return date(stamp.year or 1, month, day).toordinal()


# --- A recorded table as loggers and spreadsheets save it: separators, decimal commas, header and units are found -----
#
# Nothing is guessed that could be read two ways: such a file is refused with the place and what to do.

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


@frozen
class Row:
    """A row of values: its line, from 1, and its cells without blanks around."""

    line: int
    cells: tuple[str, ...]


@frozen
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
    return tuple(_clean_cell(cell) for cell in cells)


def _clean_cell(cell: str) -> str:
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
        units = [cell.strip("[]()") for cell in _fill_cells(rows.pop(), width)]
    names = _fill_cells(rows[-1], width) if rows else [""] * width
    for i, name in enumerate(names):
        found = UNIT_IN_NAME.fullmatch(name)
        if found:
            names[i], units[i] = found[1] or name, units[i] or found[2]
    return tuple(names), tuple(units)


def _is_unit(cell: str) -> bool:
    return not cell or cell.lower().strip("[]()") in UNITS | MORE_UNITS or cell.startswith(("[", "("))


def _fill_cells(cells: Sequence[str], width: int) -> list[str]:
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
