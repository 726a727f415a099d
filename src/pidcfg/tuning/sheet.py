"""A recorded table as loggers save it: separators, decimal commas, times of all countries, and which column is what."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, date, datetime
from itertools import pairwise
from math import isfinite

from pidcfg.encoders.decoding import listing_text
from pidcfg.encoders.listing import ListingError
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import describe_binary
from pidcfg.tuning.rules import TuningError

# ----------------------------------------------------------------------------------------------------------------------
# Times as loggers write them, to seconds: ISO stamps, dates of all countries, clock times, date and time apart.
# The standard library reads ISO; what it does not read is little and closed, so no library is needed for it.

MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
CLOCK_PATTERN = re.compile(r"([0-9]{1,3}):([0-9]{2})(?::([0-9]{2}))?(?:[.,]([0-9]{1,9}))?\s*(?:([AaPp])\.?[Mm]\.?)?")
YEAR_FIRST_PATTERN = re.compile(r"([0-9]{4})([-/.])([0-9]{1,2})\2([0-9]{1,2})")
YEAR_LAST_PATTERN = re.compile(r"([0-9]{1,2})([-/.])([0-9]{1,2})\2([0-9]{4}|[0-9]{2})")
NAMED_MONTH_PATTERN = re.compile(r"([0-9]{1,2})[-/ .]+([A-Za-z]{3})[a-z]*[-/ .,]+([0-9]{4}|[0-9]{2})")
MONTH_FIRST_PATTERN = re.compile(r"([A-Za-z]{3})[a-z]*\.? ([0-9]{1,2}),? ([0-9]{4})")
DAY_SECONDS, HALF_DAY_SECONDS = 86_400.0, 43_200.0
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
    is_short_clock: bool = False
    """The clock has two numbers only, which may be hours and minutes, or minutes and seconds."""
    hours: int = 0
    has_offset: bool = False


def looks_like_stamp(text: str) -> bool:
    """Whether a text is a time or a date."""
    return read_stamp(text) is not None


def read_stamp(text: str) -> Stamp | None:
    """A time, a date, or both; None for anything else."""
    text = text.strip()
    if CLOCK_PATTERN.fullmatch(text):
        return _read_clock(text)
    day, _, rest = _split_stamp(text)
    if not day:
        return _read_iso(text)
    stamp = _read_date(day)
    if stamp is None:
        return None
    if not rest:
        return stamp
    clock = _read_clock(rest)
    if clock is None:
        return _read_iso(text)
    return Stamp(stamp.year, stamp.first, stamp.second, stamp.sign, clock.clock, clock.is_short_clock, clock.hours)


def _split_stamp(text: str) -> tuple[str, str, str]:
    """Date and clock of a text."""
    for pattern in (YEAR_FIRST_PATTERN, YEAR_LAST_PATTERN, NAMED_MONTH_PATTERN, MONTH_FIRST_PATTERN):
        match = pattern.match(text)
        if match:
            rest = text[match.end() :]
            return (match[0], "", rest.lstrip(" T,-_")) if not rest or rest[0] in " T,-_" else ("", "", "")
    return "", "", ""


def _read_date(text: str) -> Stamp | None:
    if match := YEAR_FIRST_PATTERN.fullmatch(text):
        return _stamp_of(int(match[1]), int(match[3]), int(match[4]))
    if match := YEAR_LAST_PATTERN.fullmatch(text):
        return Stamp(_read_year(match[4]), int(match[1]), int(match[3]), "." if match[2] == "." else "/")
    if match := NAMED_MONTH_PATTERN.fullmatch(text):
        month, day, year = match[2], match[1], match[3]
    elif match := MONTH_FIRST_PATTERN.fullmatch(text):
        month, day, year = match[1], match[2], match[3]
    else:
        return None
    name = month.lower()
    return _stamp_of(_read_year(year), MONTHS.index(name) + 1, int(day)) if name in MONTHS else None


def _read_year(text: str) -> int:
    return int(text) + (CENTURY if len(text) == 2 else 0)


def _stamp_of(year: int, month: int, day: int) -> Stamp | None:
    try:
        date(year, month, day)
    except ValueError:
        return None
    return Stamp(year, month, day, "-")


def _read_clock(text: str) -> Stamp | None:
    match = CLOCK_PATTERN.fullmatch(text)
    if match is None:
        return None
    first, second, third, fraction, half = match.groups()
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
    return Stamp(clock=seconds, is_short_clock=third is None and not half, hours=hours)


def _read_iso(text: str) -> Stamp | None:
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
    return Stamp(moment.year, moment.month, moment.day, "-", clock, has_offset=moment.tzinfo is not None)


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
        if stamps and ((stamp.year is None) != (stamps[0].year is None) or stamp.has_offset != stamps[0].has_offset):
            raise StampError(f"{text[:40]!r} is written otherwise than {texts[0][:40]!r}", i)
        stamps.append(stamp)
    clocks = [stamp.clock for stamp in stamps]
    if any(stamp.is_short_clock for stamp in stamps):
        if minutes_first or max(stamp.hours for stamp in stamps) > 24:
            clocks = [c / 60 if s.is_short_clock else c for c, s in zip(clocks, stamps, strict=True)]
            remarks.append("times are read as minutes:seconds")
        else:
            remarks.append("times are read as hours:minutes")
    if stamps[0].year is None:
        return _unwrap_midnight(clocks, remarks), remarks
    days = _count_days(stamps, remarks)
    return [day * DAY_SECONDS + clock for day, clock in zip(days, clocks, strict=True)], remarks


def _unwrap_midnight(clocks: Sequence[float], remarks: list[str]) -> list[float]:
    """Clock times that go on over midnight, forwards or backwards."""
    steps = [b - a for a, b in pairwise(clocks)]
    backwards = sum(d < 0 for d in steps) > sum(d > 0 for d in steps)
    shift, out = 0.0, list(clocks[:1])
    for clock, step in zip(clocks[1:], steps, strict=True):
        if not backwards and step < -HALF_DAY_SECONDS:
            shift += DAY_SECONDS
        elif backwards and step > HALF_DAY_SECONDS:
            shift -= DAY_SECONDS
        out.append(clock + shift)
    if shift:
        remarks.append("the times go on over midnight")
    return out


def _count_days(stamps: Sequence[Stamp], remarks: list[str]) -> list[int]:
    """Dates as numbers of days; which number is the day is told by the signs, by the numbers, or by the shorter way."""
    if len({(s.year, s.first, s.second) for s in stamps}) == 1 and stamps[0].sign == "/":
        return [0] * len(stamps)
    ways = [True, False]
    for i, stamp in enumerate(stamps):
        ways = [day_first for day_first in ways if _is_date(stamp, day_first=day_first)]
        if not ways:
            raise StampError("there is no such date", i)
    readings = {day_first: [_day_number(stamp, day_first=day_first) for stamp in stamps] for day_first in ways}
    spans = {key: max(days) - min(days) for key, days in readings.items()}
    best = min(readings, key=lambda key: spans[key])
    if len(readings) > 1 and spans[True] != spans[False]:
        remarks.append(f"dates are read with the {'day' if best else 'month'} first, by which the record is shorter")
    return readings[best]


def _is_date(stamp: Stamp, *, day_first: bool) -> bool:
    try:
        _day_number(stamp, day_first=day_first)
    except ValueError:
        return False
    return True


def _day_number(stamp: Stamp, *, day_first: bool) -> int:
    month, day = stamp.first, stamp.second
    if stamp.sign == "." or (stamp.sign == "/" and day_first):
        month, day = day, month
    return date(stamp.year or 1, month, day).toordinal()


# --- A recorded table as loggers and spreadsheets save it: separators, decimal commas, header and units are found -----
#
# Nothing is guessed that could be read two ways: such a file is refused with the place and what to do.

NUMBER_PATTERN = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)([eE][+-]?[0-9]{1,3})?")
POINT_PATTERN, COMMA_PATTERN = re.compile(r"[+-]?[0-9]*\.[0-9]*([eE].*)?"), re.compile(r"[+-]?[0-9]*,[0-9]*([eE].*)?")
THOUSANDS_PATTERNS = {
    False: re.compile(r"[+-]?[0-9]{1,3}(,[0-9]{3})+\.[0-9]+"),
    True: re.compile(r"[+-]?[0-9]{1,3}(\.[0-9]{3})+,[0-9]+"),
}
"""Numbers with both signs, by whether the comma is the decimal one."""
NUMBER_AND_UNIT = re.compile(r"([+-]?[0-9.,]+(?:[eE][+-]?[0-9]{1,3})?)\s*(%|°?[A-Za-z][A-Za-z°/²³]{0,7})")
UNIT_IN_NAME_PATTERN = re.compile(r"(.*?)[\s_]*[\[(<]\s*([^\])>]*?)\s*[\])>]\s*")
UNITS = frozenset(
    {"s", "sec", "ms", "min", "h", "%", "°c", "°f", "c", "f", "degc", "degf", "k", "bar", "mbar", "pa", "psi"}
)
MORE_UNITS = frozenset(
    {"kpa", "mpa", "l/min", "l/h", "m3/h", "m³/h", "kg/h", "gpm", "mm", "cm", "m", "v", "ma", "rpm", "hz"}
)
MISSING_WORDS = frozenset(
    {"", "nan", "null", "none", "n/a", "na", "#n/a", "#num!", "#value!", "-", "--", "---", "bad", "no data"}
)
"""What a logger writes where it has no value."""
MIN_COLUMNS = 2


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
        if text.lower() in MISSING_WORDS:
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
    match = NUMBER_AND_UNIT.fullmatch(text)
    bare = match[1] if match else text
    grouped = THOUSANDS_PATTERNS[comma].fullmatch(bare)
    bare = bare.replace("." if comma else ",", "") if grouped else bare
    if not NUMBER_PATTERN.fullmatch(bare) or (not comma and "," in bare) or (comma and "." in bare):
        return None
    value = float(bare.replace(",", "."))
    return value if isfinite(value) else None


def read_sheet(data: bytes, name: str) -> Sheet:
    """The table in a file's bytes; raises `TuningError`."""
    if other := describe_binary(data):
        raise TuningError(f"{name}: {other[0]}, no table of a record; {other[1]}")
    text, remarks = _decode_table(data, name)
    lines = [(n, line) for n, line in enumerate(text.splitlines(), start=1) if line.strip()]
    lines = [(n, line) for n, line in lines if not line.lstrip().startswith(("#", "//"))]
    separator = _find_separator([line for _, line in lines])
    rows = [Row(n, _split_cells(line, separator, f"{name}:{n}")) for n, line in lines]
    first = next((i for i, row in enumerate(rows) if _holds_values(row.cells)), None)
    if first is None:
        raise TuningError(f"{name} holds no samples; a record has a row a sample, with time, output and PV")
    width = _table_width(rows[first:])
    names, units = _read_header(rows[:first], width)
    body = _read_body(rows[first:], width, names, name)
    comma = _decimal_comma(body, name)
    separator_name = {"\t": "tabs", None: "blanks"}.get(separator, f"{separator!r}")
    if comma:
        remarks.append(f"numbers have a decimal comma, cells are separated by {separator_name}")
    return Sheet(name, names, units, body, comma, tuple(remarks))


def _decode_table(data: bytes, name: str) -> tuple[str, list[str]]:
    try:
        return listing_text(data), []
    except ListingError as error:
        if b"\0" in data:
            raise TuningError(f"{name}: {error}") from None
        return data.decode("cp1252", "replace"), ["the file is not UTF-8; it was read as Windows-1252"]


def _find_separator(lines: Sequence[str]) -> str | None:
    """What stands between cells; None: blanks."""
    for sign in (";", "\t", "|"):
        if sum(sign in line for line in lines) * 2 > len(lines):
            return sign
    blanks = [line.split() for line in lines]
    if sum(len(cells) > MIN_COLUMNS and all(map(NUMBER_PATTERN.fullmatch, cells)) for cells in blanks) * 2 > len(lines):
        return None
    return "," if sum("," in line for line in lines) * 2 > len(lines) else None


def _split_cells(line: str, separator: str | None, place: str) -> tuple[str, ...]:
    if separator is None:
        return tuple(line.split())
    try:
        cells = next(csv.reader([line], delimiter=separator, strict=True))
    except csv.Error as error:
        raise TuningError(f"{place}: not CSV: {error}") from None
    # without blanks of any width around a cell, and with the minus of the keyboard
    return tuple(cell.replace("\N{NO-BREAK SPACE}", " ").replace("\N{MINUS SIGN}", "-").strip() for cell in cells)


def _is_value(cell: str) -> bool:
    return bool(NUMBER_PATTERN.fullmatch(cell) or NUMBER_AND_UNIT.fullmatch(cell) or looks_like_stamp(cell))


def _holds_values(cells: Iterable[str]) -> bool:
    return sum(map(_is_value, cells)) >= MIN_COLUMNS


def _table_width(rows: Sequence[Row]) -> int:
    """The number of columns that most rows have, without empty ones at the end."""
    counts = Counter(len(row.cells) for row in rows)
    width = max(counts, key=lambda n: (counts[n], n))
    whole = [row for row in rows if len(row.cells) == width]
    while width and not any(row.cells[width - 1] for row in whole):
        width -= 1
    return width


def _read_header(head_rows: Sequence[Row], width: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of the columns, from the last row above the values, and a row of units below it."""
    rows = [row.cells for row in head_rows if len(row.cells) >= width or sum(map(bool, row.cells)) >= MIN_COLUMNS]
    units = [""] * width
    if len(rows) > 1 and all(_is_unit(cell) for cell in rows[-1]):
        units = [cell.strip("[]()") for cell in _fill_cells(rows.pop(), width)]
    names = _fill_cells(rows[-1], width) if rows else [""] * width
    for i, name in enumerate(names):
        match = UNIT_IN_NAME_PATTERN.fullmatch(name)
        if match:
            names[i], units[i] = match[1] or name, units[i] or match[2]
    return tuple(names), tuple(units)


def _is_unit(cell: str) -> bool:
    return not cell or cell.lower().strip("[]()") in UNITS | MORE_UNITS or cell.startswith(("[", "("))


def _fill_cells(cells: Sequence[str], width: int) -> list[str]:
    return [*cells, *[""] * width][:width]


def _read_body(rows: Sequence[Row], width: int, names: Sequence[str], name: str) -> list[Row]:
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
    places: dict[bool, tuple[int, int, str]] = {}
    for row in rows:
        for column, cell in enumerate(row.cells):
            match = NUMBER_AND_UNIT.fullmatch(cell)
            bare = match[1] if match else cell
            for comma in (False, True):
                plain = (COMMA_PATTERN if comma else POINT_PATTERN).fullmatch(bare) and NUMBER_PATTERN.fullmatch(bare)
                if plain or THOUSANDS_PATTERNS[comma].fullmatch(bare):
                    places.setdefault(comma, (row.line, column + 1, cell))
    if len(places) > 1:
        (line, column, cell), (_, _, other) = places[True], places[False]
        raise TuningError(
            f"{name}:{line}:{column}: {cell!r} has a decimal comma, and {other!r} a decimal point; write all alike"
        )
    return True in places


# --- Which column of a record is time, output and PV: as the user says, by their names, or by what they hold ----------
#
# What cannot be told is refused with the columns that there are, never guessed.

ROLES = ("time", "output", "pv")


def words_of(text: str) -> frozenset[str]:
    """The words of a text."""
    return frozenset(text.split())


COLUMN_WORDS = {
    "time": words_of(
        "time timestamp date datetime datum zeit uhrzeit zeitstempel t elapsed seconds secs clock temps heure fecha "
        "hora tijd"
    ),
    "output": words_of(
        "output out op co cv mv mout u cout valve ventil stellgröße stellgrösse stellwert ausgang sortie salida uscita "
        "heater actuator manipulated stellgrad"
    ),
    "pv": words_of(
        "pv process istwert measured measurement actual temp temperature temperatur level pressure flow druck "
        "durchfluss füllstand mesure mesuré medida ist sensor"
    ),
}
"""Words that name a column, in small letters."""
OTHER_WORDS = words_of("sp sv setpoint sollwert soll w target set consigne mode status quality qualität error err dev")
"""Words of columns that are none of the three."""
WORD = re.compile(r"[a-zäöüßéè]+|[A-ZÄÖÜ]+(?![a-zäöüß])|[A-ZÄÖÜ][a-zäöüßéè]+")
COLUMN_OPTION_PATTERN = re.compile(r"(?:^|,)\s*(time|output|pv)\s*=", re.IGNORECASE)
MAX_JUDGED_ROWS = 2000
"""Rows by which a column is judged."""
MIN_NUMBER_RATIO = 9
"""How many numbers a column must have for each cell that is none; that cell is refused with its place."""
MIN_HELD_SHARE = 0.5
"""Share of samples at which an output does not change."""
MAX_MOVES, MOVE_SHARE = 20, 0.5
"""How often an output of a test changes at most, and the part of its range by which a PV has surely moved."""


class UnreadableRecordError(TuningError):
    """A record that tells no process, with its name and line."""


class ColumnsError(UnreadableRecordError):
    """Several columns could be the same: a question to who knows them."""

    is_question = True


@frozen
class Columns:
    """Where the three stand, from 0; the time may stand in two columns, date and clock."""

    time: tuple[int, ...]
    output: int
    pv: int
    basis: str
    """How they were found."""

    def text(self, sheet: Sheet) -> str:
        """The columns for people."""
        time = " and ".join(sheet.title(column) for column in self.time)
        return f"columns ({self.basis}): time {time}, output {sheet.title(self.output)}, PV {sheet.title(self.pv)}"


def read_column_options(text: str) -> dict[str, str]:
    """What ``time=…,output=…,pv=…`` says; raises `TuningError`."""
    marks = list(COLUMN_OPTION_PATTERN.finditer(text))
    if not marks or text[: marks[0].start()].strip():
        raise TuningError(f"columns {text[:60]!r}; write time=…,output=…,pv=… with names or numbers, time=1+2 for two")
    options = {}
    for mark, after in zip(marks, [*(m.start() for m in marks[1:]), len(text)], strict=True):
        key, value = mark[1].lower(), text[mark.end() : after].strip()
        if key in options or not value:
            raise TuningError(f"columns {text[:60]!r}: {key} is given {'twice' if key in options else 'no column'}")
        options[key] = value
    return options


def find_columns(sheet: Sheet, options: Mapping[str, str]) -> Columns:
    """The three columns; raises `TuningError` with the columns that there are where one cannot be told."""
    named = {role: _column_option(sheet, role, options[role]) for role in ROLES if role in options}
    used_columns = {column for columns in named.values() for column in columns}
    ways = ["as given"] if named else []
    by_name = {role: _columns_by_name(sheet, role, used_columns) for role in ROLES if role not in named}
    for role, columns in by_name.items():
        if columns and (role == "time" or len(columns) == 1):
            named[role] = columns if role != "time" else _time_columns(sheet, columns)
            used_columns.update(named[role])
    if any(role in by_name for role in named):
        ways.append("by their names")
    missing = [role for role in ROLES if role not in named]
    if missing:
        ambiguous = next((role for role in missing if len(by_name[role]) > 1), None)
        if ambiguous:
            raise _ambiguity_error(sheet, ambiguous, f"{len(by_name[ambiguous])} columns are named so")
        ways.append(_tell_by_content(sheet, named, missing, used_columns))
    return Columns(named["time"], named["output"][0], named["pv"][0], " and ".join(ways))


def _column_option(sheet: Sheet, role: str, text: str) -> tuple[int, ...]:
    """Columns by number or name."""
    column = _find_column(sheet, text)
    if column is not None:
        return (column,)
    parts = text.split("+")
    if role == "time" and len(parts) == 2:
        both = [_find_column(sheet, part.strip()) for part in parts]
        if None not in both:
            return tuple(column for column in both if column is not None)
    raise TuningError(f"{sheet.name}: there is no column {text[:40]!r} for {role}; there are {_list_columns(sheet)}")


def _find_column(sheet: Sheet, text: str) -> int | None:
    if text.isascii() and text.isdecimal() and text not in sheet.names:
        return int(text) - 1 if 1 <= int(text) <= sheet.width else None
    for fold in (str, str.casefold):
        matches = [i for i, name in enumerate(sheet.names) if fold(name) == fold(text)]
        if len(matches) == 1:
            return matches[0]
    whole = UNIT_IN_NAME_PATTERN.fullmatch(text)
    if whole is None:
        return None
    name_and_unit = whole[1].casefold(), whole[2].casefold()
    pairs = zip(sheet.names, sheet.units, strict=True)
    matches = [i for i, (name, unit) in enumerate(pairs) if (name.casefold(), unit.casefold()) == name_and_unit]
    return matches[0] if len(matches) == 1 else None


def _columns_by_name(sheet: Sheet, role: str, used: set[int]) -> tuple[int, ...]:
    columns = []
    for column, name in enumerate(sheet.names):
        words = {word.lower() for word in WORD.findall(name)}
        roles = [r for r in ROLES if words & COLUMN_WORDS[r]]
        if "pv" in words:
            roles = ["pv"]
        if column not in used and roles == [role] and not words & OTHER_WORDS:
            columns.append(column)
    if role != "time":
        columns = [column for column in columns if _column_numbers(sheet, column) is not None]
        exact = [column for column in columns if sheet.names[column].casefold() in COLUMN_WORDS[role]]
        columns = exact if len(exact) == 1 else columns
    return tuple(columns)


def _time_columns(sheet: Sheet, columns: Sequence[int]) -> tuple[int, ...]:
    """Of several columns with a name of time: a date with its clock, else the first."""
    texts = {column: sheet.rows[0].cells[column] for column in columns}
    dates = [c for c, t in texts.items() if (s := read_stamp(t)) and s.year is not None and ":" not in t]
    clocks = [c for c, t in texts.items() if CLOCK_PATTERN.fullmatch(t)]
    if dates and clocks:
        return dates[0], clocks[0]
    return (columns[0],)


def _column_numbers(sheet: Sheet, column: int) -> list[float] | None:
    """The numbers of a column; None where mostly something else stands there."""
    numbers, others = [], 0
    for row in sheet.rows[:MAX_JUDGED_ROWS]:
        text = row.cells[column]
        if text.lower() in MISSING_WORDS:
            continue
        value = number_of(text, comma=sheet.comma)
        if value is None:
            others += 1
        else:
            numbers.append(value)
    return numbers if len(numbers) > MIN_NUMBER_RATIO * others else None


def _tell_by_content(sheet: Sheet, named: dict[str, tuple[int, ...]], missing: list[str], used: set[int]) -> str:
    """Finds what names did not tell; what is told stands in ``named``. The way, for people."""
    stamps = [c for c in range(sheet.width) if c not in used and read_stamp(sheet.rows[0].cells[c])]
    if "time" in missing and stamps:
        named["time"] = _time_columns(sheet, stamps)
        missing.remove("time")
    others = {
        c: n for c in range(sheet.width) if c not in used and c not in stamps and (n := _column_numbers(sheet, c))
    }
    others = {c: n for c, n in others.items() if not {w.lower() for w in WORD.findall(sheet.names[c])} & OTHER_WORDS}
    if "time" in missing:
        rising = [c for c, numbers in others.items() if _goes_one_way(numbers)]
        if not rising:
            raise _ambiguity_error(sheet, "time", "no column goes one way")
        named["time"] = (rising[0],)
        others.pop(rising[0])
        missing.remove("time")
    if len(others) > len(missing):
        others = {c: n for c, n in others.items() if min(n) != max(n)} or others
    if len(others) != len(missing):
        raise _ambiguity_error(sheet, missing[0], f"{len(others)} columns could be it")
    if len(missing) == 1:
        named[missing[0]] = tuple(others)
    elif missing:
        _tell_output_and_pv(sheet, others, named)
    return "by their content"


def _tell_output_and_pv(sheet: Sheet, others: Mapping[int, Sequence[float]], named: dict[str, tuple[int, ...]]) -> None:
    """Of two columns, the output is the one that is held, changes a few times, and before the other moves.

    Raises `ColumnsError` where neither is, or both are.
    """
    pairs = [(a, b) for a, b in (tuple(others), tuple(others)[::-1]) if _leads_pv(others[a], others[b])]
    if len(pairs) != 1:
        time = "+".join(str(column + 1) for column in named["time"])
        first, second = others
        ways = " or ".join(
            f"--columns time={time},output={a + 1},pv={b + 1}" for a, b in ((first, second), (second, first))
        )
        raise ColumnsError(
            f"{sheet.name}: columns {sheet.title(first)} and {sheet.title(second)} could both be the output: "
            f"{'neither' if not pairs else 'each'} is held and changes before the other moves; say {ways}"
        )
    named["output"], named["pv"] = ((column,) for column in pairs[0])


def _leads_pv(output: Sequence[float], pv: Sequence[float]) -> bool:
    """Whether a column is one of an output that is held, and the other one moves more often and later."""
    moves = _count_moves(output)
    if _held_share(output) < MIN_HELD_SHARE or not 0 < moves <= MAX_MOVES or _count_moves(pv) <= moves:
        return False
    begin, reach = _first_move(output, 0.0), max(pv) - min(pv)
    return begin <= _first_move(pv, MOVE_SHARE * reach)


def _first_move(numbers: Sequence[float], distance: float) -> int:
    """The first sample that is farther than this from the first one."""
    return next((i for i, value in enumerate(numbers) if abs(value - numbers[0]) > distance), len(numbers))


def _held_share(numbers: Sequence[float]) -> float:
    return sum(a == b for a, b in pairwise(numbers)) / max(1, len(numbers) - 1)


def _count_moves(numbers: Sequence[float]) -> int:
    return sum(a != b for a, b in pairwise(numbers))


def _goes_one_way(numbers: Sequence[float]) -> bool:
    """Whether a column never turns round and mostly moves."""
    steps = [b - a for a, b in pairwise(numbers)]
    one_way = all(s >= 0 for s in steps) or all(s <= 0 for s in steps)
    return one_way and len(set(numbers)) * 4 > len(numbers) and len(steps) > 0


def _ambiguity_error(sheet: Sheet, role: str, why: str) -> TuningError:
    return ColumnsError(
        f"{sheet.name}: which column is the {role} cannot be told ({why}); there are {_list_columns(sheet)}; say "
        "which with --columns time=…,output=…,pv=…"
    )


def _list_columns(sheet: Sheet) -> str:
    return ", ".join(sheet.title(column) for column in range(sheet.width))
