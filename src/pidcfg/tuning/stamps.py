"""Times as loggers write them, to seconds: ISO stamps, dates of all countries, clock times, date and time apart.

The standard library reads ISO; what it does not read is little and closed, so no library is needed for it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, date, datetime
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

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


@dataclass(frozen=True, slots=True)
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
        return _known(int(found[1]), int(found[3]), int(found[4]))
    if found := YEAR_LAST.fullmatch(text):
        return Stamp(_year(found[4]), int(found[1]), int(found[3]), "." if found[2] == "." else "/")
    if found := NAMED_MONTH.fullmatch(text):
        month, day, year = found[2], found[1], found[3]
    elif found := MONTH_FIRST.fullmatch(text):
        month, day, year = found[1], found[2], found[3]
    else:
        return None
    name = month.lower()
    return _known(_year(year), MONTHS.index(name) + 1, int(day)) if name in MONTHS else None


def _year(text: str) -> int:
    return int(text) + (CENTURY if len(text) == 2 else 0)


def _known(year: int, month: int, day: int) -> Stamp | None:
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
