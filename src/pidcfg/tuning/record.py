"""The record of a step test as people have it: a table with time, output and PV somewhere in its columns."""

from __future__ import annotations

import re
from itertools import groupby, pairwise
from math import isfinite
from statistics import median
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.tuning.columns import find_columns, wanted_columns
from pidcfg.tuning.identify import Identified, identify
from pidcfg.tuning.rules import TuningError
from pidcfg.tuning.samples import Record, RecordError, Request
from pidcfg.tuning.sheet import MISSING, read_sheet
from pidcfg.tuning.stamps import StampError, looks_like_stamp, seconds_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.limits import Limits
    from pidcfg.tuning.columns import Columns
    from pidcfg.tuning.sheet import Row, Sheet

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


class UnreadableRecordError(TuningError):
    """A record that tells no process, with its name and line."""


class Sample(NamedTuple):
    """A row of the record."""

    time: float
    output: float
    pv: float
    line: int


def identified(data: bytes, name: str, limits: Limits, request: Request | None = None) -> tuple[Identified, Record]:
    """The process of a recorded step, and its samples; raises `UnreadableRecordError`."""
    request = request or Request()
    record, lines, said = read_record(data, name, limits, request)
    try:
        found = identify(record, request.rest)
    except RecordError as error:
        where = name if error.row is None else f"{name}:{lines[error.row]}"
        raise UnreadableRecordError(f"{where}: {error}; {error.cure} ({'; '.join(said)})") from None
    return found.with_remarks(said), record


def read_record(
    data: bytes, name: str, limits: Limits, request: Request | None = None
) -> tuple[Record, list[int], tuple[str, ...]]:
    """The samples of a file, the lines that they stand in, and what was read as what."""
    request = request or Request()
    if len(data) > limits.file_bytes:
        raise UnreadableRecordError(
            f"{name} is larger than {limits.file_bytes} bytes; --limit file_bytes=… raises that"
        )
    try:
        given = wanted_columns(request.columns) if request.columns else {}
        sheet = read_sheet(data, name)
        columns = find_columns(sheet, given)
        said = [columns.text(sheet), *sheet.remarks]
        rows = _with_values(sheet, columns, said)
        times, zero = _times(sheet, columns, rows, said)
        samples = [
            Sample(time, *_numbers(sheet, row, columns), row.line) for time, row in zip(times, rows, strict=True)
        ]
        samples = _window(_in_order(samples, name, said), request, zero, said)
    except UnreadableRecordError:
        raise
    except TuningError as error:
        raise UnreadableRecordError(str(error)) from None
    record = Record([s.time for s in samples], [s.output for s in samples], [s.pv for s in samples])
    return record, [s.line for s in samples], tuple(said)


def _numbers(sheet: Sheet, row: Row, columns: Columns) -> tuple[float, float]:
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
