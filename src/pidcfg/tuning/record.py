"""The record of a step test as people have it: which column is time, output and PV, and the samples that count."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise
from math import isfinite
from statistics import median
from typing import NamedTuple

from pidcfg.text.frozen import frozen
from pidcfg.text.reader import Limits
from pidcfg.text.references import Decision
from pidcfg.tuning.identify import Identified, identify
from pidcfg.tuning.response import Record, RecordError, Request
from pidcfg.tuning.rules import TuningError
from pidcfg.tuning.sheet import (
    CLOCK,
    MISSING,
    UNIT_IN_NAME,
    Row,
    Sheet,
    StampError,
    looks_like_stamp,
    number_of,
    read_sheet,
    read_stamp,
    seconds_of,
)

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
TOKEN = re.compile(r"[a-zäöüßéè]+|[A-ZÄÖÜ]+(?![a-zäöüß])|[A-ZÄÖÜ][a-zäöüßéè]+")
STATED_COLUMNS = re.compile(r"(?:^|,)\s*(time|output|pv)\s*=", re.IGNORECASE)
JUDGED_ROWS = 2000
"""Rows by which a column is judged."""
MOST_OTHERS = 9
"""How many numbers a column must have for each cell that is none; that cell is refused with its place."""
HELD_SHARE = 0.5
"""Share of samples at which an output does not change."""
MOST_MOVES, BEGINS_SHARE = 20, 0.5
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
    by: str
    """How they were found."""

    def text(self, sheet: Sheet) -> str:
        """The columns for people."""
        time = " and ".join(sheet.title(column) for column in self.time)
        return f"columns ({self.by}): time {time}, output {sheet.title(self.output)}, PV {sheet.title(self.pv)}"


def wanted_columns(text: str) -> dict[str, str]:
    """What ``time=…,output=…,pv=…`` says; raises `TuningError`."""
    marks = list(STATED_COLUMNS.finditer(text))
    if not marks or text[: marks[0].start()].strip():
        raise TuningError(f"columns {text[:60]!r}; write time=…,output=…,pv=… with names or numbers, time=1+2 for two")
    found = {}
    for mark, after in zip(marks, [*(m.start() for m in marks[1:]), len(text)], strict=True):
        key, value = mark[1].lower(), text[mark.end() : after].strip()
        if key in found or not value:
            raise TuningError(f"columns {text[:60]!r}: {key} is given {'twice' if key in found else 'no column'}")
        found[key] = value
    return found


def find_columns(sheet: Sheet, given: Mapping[str, str]) -> Columns:
    """The three columns; raises `TuningError` with the columns that there are where one cannot be told."""
    named = {role: _given(sheet, role, given[role]) for role in ROLES if role in given}
    taken = {column for columns in named.values() for column in columns}
    ways = ["as given"] if named else []
    by_name = {role: _by_name(sheet, role, taken) for role in ROLES if role not in named}
    for role, columns in by_name.items():
        if columns and (role == "time" or len(columns) == 1):
            named[role] = columns if role != "time" else _time(sheet, columns)
            taken.update(named[role])
    if any(role in by_name for role in named):
        ways.append("by their names")
    missing = [role for role in ROLES if role not in named]
    if missing:
        ambiguous = next((role for role in missing if len(by_name[role]) > 1), None)
        if ambiguous:
            raise _untold(sheet, ambiguous, f"{len(by_name[ambiguous])} columns are named so")
        ways.append(_by_content(sheet, named, missing, taken))
    return Columns(named["time"], named["output"][0], named["pv"][0], " and ".join(ways))


def _given(sheet: Sheet, role: str, text: str) -> tuple[int, ...]:
    """Columns by number or name."""
    column = _one(sheet, text)
    if column is not None:
        return (column,)
    parts = text.split("+")
    if role == "time" and len(parts) == 2:
        both = [_one(sheet, part.strip()) for part in parts]
        if None not in both:
            return tuple(column for column in both if column is not None)
    raise TuningError(f"{sheet.name}: there is no column {text[:40]!r} for {role}; there are {_all(sheet)}")


def _one(sheet: Sheet, text: str) -> int | None:
    if text.isascii() and text.isdecimal() and text not in sheet.names:
        return int(text) - 1 if 1 <= int(text) <= sheet.width else None
    for same in (str, str.casefold):
        found = [i for i, name in enumerate(sheet.names) if same(name) == same(text)]
        if len(found) == 1:
            return found[0]
    whole = UNIT_IN_NAME.fullmatch(text)
    if whole is None:
        return None
    wanted = whole[1].casefold(), whole[2].casefold()
    pairs = zip(sheet.names, sheet.units, strict=True)
    found = [i for i, (name, unit) in enumerate(pairs) if (name.casefold(), unit.casefold()) == wanted]
    return found[0] if len(found) == 1 else None


def _by_name(sheet: Sheet, role: str, taken: set[int]) -> tuple[int, ...]:
    found = []
    for column, name in enumerate(sheet.names):
        words = {word.lower() for word in TOKEN.findall(name)}
        roles = [r for r in ROLES if words & COLUMN_WORDS[r]]
        if "pv" in words:
            roles = ["pv"]
        if column not in taken and roles == [role] and not words & OTHER_WORDS:
            found.append(column)
    if role != "time":
        found = [column for column in found if _numbers(sheet, column) is not None]
        exact = [column for column in found if sheet.names[column].casefold() in COLUMN_WORDS[role]]
        found = exact if len(exact) == 1 else found
    return tuple(found)


def _time(sheet: Sheet, columns: Sequence[int]) -> tuple[int, ...]:
    """Of several columns with a name of time: a date with its clock, else the first."""
    texts = {column: sheet.rows[0].cells[column] for column in columns}
    dates = [c for c, t in texts.items() if (s := read_stamp(t)) and s.year is not None and ":" not in t]
    clocks = [c for c, t in texts.items() if CLOCK.fullmatch(t)]
    if dates and clocks:
        return dates[0], clocks[0]
    return (columns[0],)


def _numbers(sheet: Sheet, column: int) -> list[float] | None:
    """The numbers of a column; None where mostly something else stands there."""
    out, others = [], 0
    for row in sheet.rows[:JUDGED_ROWS]:
        text = row.cells[column]
        if text.lower() in MISSING:
            continue
        value = number_of(text, comma=sheet.comma)
        if value is None:
            others += 1
        else:
            out.append(value)
    return out if len(out) > MOST_OTHERS * others else None


def _by_content(sheet: Sheet, named: dict[str, tuple[int, ...]], missing: list[str], taken: set[int]) -> str:
    """Finds what names did not tell; what is told stands in ``named``. The way, for people."""
    stamps = [c for c in range(sheet.width) if c not in taken and read_stamp(sheet.rows[0].cells[c])]
    if "time" in missing and stamps:
        named["time"] = _time(sheet, stamps)
        missing.remove("time")
    others = {c: n for c in range(sheet.width) if c not in taken and c not in stamps and (n := _numbers(sheet, c))}
    others = {c: n for c, n in others.items() if not {w.lower() for w in TOKEN.findall(sheet.names[c])} & OTHER_WORDS}
    if "time" in missing:
        rising = [c for c, numbers in others.items() if _goes_one_way(numbers)]
        if not rising:
            raise _untold(sheet, "time", "no column goes one way")
        named["time"] = (rising[0],)
        others.pop(rising[0])
        missing.remove("time")
    if len(others) > len(missing):
        others = {c: n for c, n in others.items() if min(n) != max(n)} or others
    if len(others) != len(missing):
        raise _untold(sheet, missing[0], f"{len(others)} columns could be it")
    if len(missing) == 1:
        named[missing[0]] = tuple(others)
    elif missing:
        _output_and_pv(sheet, others, named)
    return "by their content"


def _output_and_pv(sheet: Sheet, others: Mapping[int, Sequence[float]], named: dict[str, tuple[int, ...]]) -> None:
    """Of two columns, the output is the one that is held, changes a few times, and before the other moves.

    Raises `ColumnsError` where neither is, or both are.
    """
    pairs = [(a, b) for a, b in (tuple(others), tuple(others)[::-1]) if _leads(others[a], others[b])]
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


def _leads(output: Sequence[float], pv: Sequence[float]) -> bool:
    """Whether a column is one of an output that is held, and the other one moves more often and later."""
    moves = _moves(output)
    if _held(output) < HELD_SHARE or not 0 < moves <= MOST_MOVES or _moves(pv) <= moves:
        return False
    begin, reach = _first_move(output, 0.0), max(pv) - min(pv)
    return begin <= _first_move(pv, BEGINS_SHARE * reach)


def _first_move(numbers: Sequence[float], least: float) -> int:
    """The first sample that is farther than this from the first one."""
    return next((i for i, value in enumerate(numbers) if abs(value - numbers[0]) > least), len(numbers))


def _held(numbers: Sequence[float]) -> float:
    return sum(a == b for a, b in pairwise(numbers)) / max(1, len(numbers) - 1)


def _moves(numbers: Sequence[float]) -> int:
    return sum(a != b for a, b in pairwise(numbers))


def _goes_one_way(numbers: Sequence[float]) -> bool:
    """Whether a column never turns round and mostly moves."""
    steps = [b - a for a, b in pairwise(numbers)]
    one_way = all(s >= 0 for s in steps) or all(s <= 0 for s in steps)
    return one_way and len(set(numbers)) * 4 > len(numbers) and len(steps) > 0


def _untold(sheet: Sheet, role: str, why: str) -> TuningError:
    return ColumnsError(
        f"{sheet.name}: which column is the {role} cannot be told ({why}); there are {_all(sheet)}; say which with "
        "--columns time=…,output=…,pv=…"
    )


def _all(sheet: Sheet) -> str:
    return ", ".join(sheet.title(column) for column in range(sheet.width))


# --- The record of a step test as people have it: a table with time, output and PV somewhere in its columns -----------

SECONDS = {"ms": 0.001, "s": 1.0, "sec": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
"""Units of time that a header may name, in s."""
UNIT_WORDS = {"msec": "ms", "millis": "ms", "milliseconds": "ms", "seconds": "s", "secs": "s", "minutes": "min"}
UNIT_WORDS |= {"minute": "min", "hours": "h", "hour": "h", "hr": "h", "days": "d", "std": "h", "sek": "s"}
EXCEL_DAYS = (20_000.0, 80_000.0)
"""Dates of spreadsheets as numbers of days: 1954 to 2119."""
MILLISECONDS_SINCE_1970 = 1e11
EPOCH = 1e8
"""Numbers of seconds from here on count from 1970, so the first sample becomes 0."""
MOST_MISSING = 0.2
"""Share of rows that may lack a value."""
GAP = 10.0
"""How many sample times a gap lasts that is told."""
NUMBER_AND_UNIT = re.compile(r"\s*([+-]?[0-9]+(?:\.[0-9]+)?)\s*([a-z]*)\s*")


class Sample(NamedTuple):
    """A row of the record."""

    time: float
    output: float
    pv: float
    line: int


def identify_record(
    data: bytes, name: str, limits: Limits, request: Request | None = None
) -> tuple[Identified, Record]:
    """The process of a recorded step, and its samples; raises `UnreadableRecordError`."""
    request = request or Request()
    record, lines, said = read_record(data, name, limits, request)
    try:
        found = identify(record, request.rest)
    except RecordError as error:
        where = name if error.row is None else f"{name}:{lines[error.row]}"
        raise UnreadableRecordError(f"{where}: {error}; {error.cure} ({'; '.join(said)})") from None
    return found.with_remarks(said), record


D1080 = Decision(
    1080,
    "what a program has written may be three times as large as a configuration",
    "A configuration or scenario has at most 1 MiB, a memory listing, an export, a project, a sheet or a recording 3 "
    "MiB; `--limit file_bytes` raises both.",
    "Nobody writes a megabyte of loops by hand; a CODESYS project with all its programs has 1.1 MB.",
)


def read_record(
    data: bytes, name: str, limits: Limits, request: Request | None = None
) -> tuple[Record, list[int], tuple[str, ...]]:
    """The samples of a file, the lines that they stand in, and what was read as what."""
    request = request or Request()
    if len(data) > limits.listing_bytes:
        raise UnreadableRecordError(
            f"{name} is larger than {limits.listing_bytes} bytes; --limit file_bytes=… raises that"
        )
    try:
        given = wanted_columns(request.columns) if request.columns else {}
        sheet = read_sheet(data, name)
        columns = find_columns(sheet, given)
        said = [columns.text(sheet), *sheet.remarks]
        rows = _with_values(sheet, columns, said)
        times, zero = _times(sheet, columns, rows, said)
        samples = [
            Sample(time, *_numbers_of_row(sheet, row, columns), row.line) for time, row in zip(times, rows, strict=True)
        ]
        samples = _window(_in_order(samples, name, said), request, zero, said)
    except UnreadableRecordError:
        raise
    except TuningError as error:
        raise UnreadableRecordError(str(error)) from None
    units = sheet.units[columns.output], sheet.units[columns.pv]
    record = Record([s.time for s in samples], [s.output for s in samples], [s.pv for s in samples], units)
    return record, [s.line for s in samples], tuple(said)


def _numbers_of_row(sheet: Sheet, row: Row, columns: Columns) -> tuple[float, float]:
    output, pv = sheet.number(row, columns.output), sheet.number(row, columns.pv)
    if output is None or pv is None:
        raise TuningError(f"{sheet.name}:{row.line}: a value is missing")
    return output, pv


def _with_values(sheet: Sheet, columns: Columns, said: list[str]) -> list[Row]:
    """The rows that have all values; a few may lack one, which is told."""
    needed = (*columns.time, columns.output, columns.pv)
    rows = [row for row in sheet.rows if not any(row.cells[c].lower() in MISSING for c in needed)]
    if len(rows) < len(sheet.rows):
        first = next(row.line for row in sheet.rows if row not in rows)
        lost = len(sheet.rows) - len(rows)
        if lost > MOST_MISSING * len(sheet.rows):
            raise TuningError(
                f"{sheet.name}:{first}: {lost} of {len(sheet.rows)} rows lack a value ({columns.text(sheet)}); choose "
                "other columns, or a part of the record with --from and --until"
            )
        said.append(f"{lost} rows without a value were left out, the first in line {first}")
    return rows


def _times(sheet: Sheet, columns: Columns, rows: Sequence[Row], said: list[str]) -> tuple[list[float], Zero]:
    """Times in s, and what they are counted from."""
    texts = [" ".join(row.cells[c] for c in columns.time) for row in rows]
    if looks_like_stamp(texts[0]):
        first = sheet.units[columns.time[0]].lower()
        try:
            times, remarks = seconds_of(texts, minutes_first=first in {"mm:ss", "min:s", "m:s"})
        except StampError as error:
            place = f"{sheet.name}:{rows[error.row].line}:{columns.time[0] + 1}"
            raise TuningError(f"{place}: {error}; correct the row, or give the column of the time") from None
        start = min(times)
        said += [*remarks, f"the time counts from {texts[times.index(start)]}"]
        return [time - start for time in times], Zero(texts[0], times[0] - start)
    if len(columns.time) > 1:
        raise TuningError(f"{sheet.name}:{rows[0].line}: {texts[0][:40]!r} is no date and time")
    column = columns.time[0]
    numbers = [sheet.number(row, column) or 0.0 for row in rows]
    unit = _unit(sheet, column, numbers)
    if unit is None:
        said.append("the time has no unit and is taken for s")
    factor = SECONDS[unit or "s"]
    times = [number * factor for number in numbers]
    if min(times) >= EPOCH or unit == "d":
        start = min(times)
        said.append(f"the time counts from the first sample, {min(numbers):.10g}{'' if unit is None else ' ' + unit}")
        return [time - start for time in times], Zero("", start)
    if unit not in {None, "s"}:
        said.append(f"times in {unit} are shown in s")
    return times, Zero("", 0.0)


class Zero(NamedTuple):
    """Where the times of a record begin: its first stamp and the time of it, or (no stamp) what numbers count from."""

    stamp: str
    seconds: float


def _unit(sheet: Sheet, column: int, numbers: Sequence[float]) -> str | None:
    """The unit of a column of times, by its header; days and ms by their size."""
    words = [sheet.units[column].lower(), *re.split(r"[^a-z]+", sheet.names[column].lower())[::-1]]
    found = next((UNIT_WORDS.get(word, word) for word in words if UNIT_WORDS.get(word, word) in SECONDS), None)
    if found is None and min(numbers) >= MILLISECONDS_SINCE_1970:
        return "ms"
    dated = {"date", "datetime", "timestamp", "datum", "zeitstempel"} & set(words)
    if found is None and dated and EXCEL_DAYS[0] < min(numbers) and max(numbers) < EXCEL_DAYS[1]:
        return "d"
    return found


def _in_order(samples: list[Sample], name: str, said: list[str]) -> list[Sample]:
    """Oldest first; equal rows once, equal stamps of a coarse clock apart."""
    steps = [b.time - a.time for a, b in pairwise(samples)]
    if sum(s < 0 for s in steps) > sum(s > 0 for s in steps):
        samples.reverse()
        said.append("the record has its newest sample first and was turned round")
    for earlier, later in pairwise(samples):
        if later.time < earlier.time:
            raise TuningError(
                f"{name}:{later.line}: the time does not go on ({later.time:g} after {earlier.time:g} s); correct the "
                "row, or take a part of the record with --from and --until"
            )
    kept = [s for i, s in enumerate(samples) if not i or s[:3] != samples[i - 1][:3]]
    groups = [list(group) for _, group in groupby(kept, key=lambda s: s.time)]
    if len(groups) < 2:
        raise TuningError(f"{name}:{samples[0].line}: all samples have the same time")
    if len(samples) > len(kept) and len(kept) <= len(groups) * 1.1:
        said.append(f"{len(samples) - len(kept)} rows that stand twice count once")
    else:
        groups = [list(group) for _, group in groupby(samples, key=lambda s: s.time)]
        kept = samples
    if len(kept) > len(groups) * 1.1:
        said.append("several samples have the same time; they are put evenly between the times")
        kept = _spread(groups)
    _tell_gaps(kept, said)
    return kept


def _spread(groups: Sequence[Sequence[Sample]]) -> list[Sample]:
    """Samples of a coarse clock, evenly from its tick to the next one; the first tick is seen from its end."""
    out = []
    typical = median(b[0].time - a[0].time for a, b in pairwise(groups)) / median(len(g) for g in groups[1:])
    for i, group in enumerate(groups):
        start = group[0].time
        if i == 0:
            step, start = typical, groups[1][0].time - len(group) * typical
        elif i + 1 < len(groups):
            step = (groups[i + 1][0].time - start) / len(group)
        else:
            step = typical
        out += [s._replace(time=start + j * step) for j, s in enumerate(group)]
    return out


def _tell_gaps(samples: Sequence[Sample], said: list[str]) -> None:
    steps = [b.time - a.time for a, b in pairwise(samples)]
    usual = median(steps)
    if usual > 0 and max(steps) > GAP * usual:
        i = steps.index(max(steps))
        said.append(f"a gap of {steps[i]:.4g} s ends in line {samples[i + 1].line}")


def _window(samples: list[Sample], request: Request, zero: Zero, said: list[str]) -> list[Sample]:
    """The part of the record that counts."""
    start = _moment(request.start, "from", zero)
    until = _moment(request.until, "until", zero)
    part = [s for s in samples if (start is None or s.time >= start) and (until is None or s.time <= until)]
    if start is None and until is None:
        return samples
    if start is not None and until is not None and start >= until:
        raise TuningError(f"--from {start:g} s is not before --until {until:g} s; exchange them")
    if not part:
        raise TuningError(
            f"no sample lies between --from and --until; the record goes from {samples[0].time:g} to "
            f"{samples[-1].time:g} s"
        )
    said.append(f"{len(part)} of {len(samples)} samples count, {part[0].time:g} to {part[-1].time:g} s")
    return part


def _moment(text: str | None, option: str, zero: Zero) -> float | None:
    """A time that the user gives: seconds of the record, a duration, or a stamp as the record has them."""
    if text is None:
        return None
    found = NUMBER_AND_UNIT.fullmatch(text.lower())
    if found and (found[2] or "s") in SECONDS:
        value = float(found[1]) * SECONDS[found[2] or "s"]
        if isfinite(value):
            return value - (zero.seconds if not zero.stamp and value >= EPOCH else 0.0)
    if zero.stamp and looks_like_stamp(text):
        try:
            (there, here), _ = seconds_of([zero.stamp, text])
        except StampError:
            pass  # a stamp of another kind than the record's
        else:
            return zero.seconds + here - there
    raise TuningError(
        f"--{option} {text[:40]!r} is no time of the record; write seconds, a time with its unit as 2 min, or a stamp "
        "as the record writes it"
    )
