"""Which column of a record is time, output and PV: as the user says, by their names, or by what they hold.

What cannot be told is refused with the columns that there are, never guessed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from pidcfg.tuning.rules import TuningError
from pidcfg.tuning.sheet import MISSING, number_of
from pidcfg.tuning.stamps import CLOCK, read_stamp

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.tuning.sheet import Sheet

ROLES = ("time", "output", "pv")


def words(text: str) -> frozenset[str]:
    """The words of a text."""
    return frozenset(text.split())


WORDS = {
    "time": words(
        "time timestamp date datetime datum zeit uhrzeit zeitstempel t elapsed seconds secs clock temps heure fecha "
        "hora tijd"
    ),
    "output": words(
        "output out op co cv mv mout u cout valve ventil stellgröße stellgrösse stellwert ausgang sortie salida uscita "
        "heater actuator manipulated stellgrad"
    ),
    "pv": words(
        "pv process istwert measured measurement actual temp temperature temperatur level pressure flow druck "
        "durchfluss füllstand mesure mesuré medida ist sensor"
    ),
}
"""Words that name a column, in small letters."""
NEITHER = words("sp sv setpoint sollwert soll w target set consigne mode status quality qualität error err dev")
"""Words of columns that are none of the three."""
TOKEN = re.compile(r"[a-zäöüßéè]+|[A-ZÄÖÜ]+(?![a-zäöüß])|[A-ZÄÖÜ][a-zäöüßéè]+")
GIVEN = re.compile(r"(?:^|,)\s*(time|output|pv)\s*=", re.IGNORECASE)
LOOKED_AT = 2000
"""Rows by which a column is judged."""
MOST_OTHERS = 9
"""How many numbers a column must have for each cell that is none; that cell is refused with its place."""
HELD = 0.5
"""Share of samples at which an output does not change."""


@dataclass(frozen=True, slots=True)
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
    marks = list(GIVEN.finditer(text))
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
    return None


def _by_name(sheet: Sheet, role: str, taken: set[int]) -> tuple[int, ...]:
    found = []
    for column, name in enumerate(sheet.names):
        words = {word.lower() for word in TOKEN.findall(name)}
        roles = [r for r in ROLES if words & WORDS[r]]
        if "pv" in words:
            roles = ["pv"]
        if column not in taken and roles == [role] and not words & NEITHER:
            found.append(column)
    if role != "time":
        found = [column for column in found if _numbers(sheet, column) is not None]
        exact = [column for column in found if sheet.names[column].casefold() in WORDS[role]]
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
    for row in sheet.rows[:LOOKED_AT]:
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
    others = {c: n for c, n in others.items() if not {w.lower() for w in TOKEN.findall(sheet.names[c])} & NEITHER}
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
        return _output_and_pv(others, named)
    return "by their content"


def _output_and_pv(others: Mapping[int, Sequence[float]], named: dict[str, tuple[int, ...]]) -> str:
    """Of two columns, the output is the one that is held; where both are or neither is, it stands first."""
    (first, a), (second, b) = others.items()
    held = [_held(a), _held(b)]
    swapped = held[1] >= HELD > held[0] or (min(held) >= HELD and _moves(b) < _moves(a) and _moves(b) > 0)
    named["output"], named["pv"] = ((second,), (first,)) if swapped else ((first,), (second,))
    return "by their content" if max(held) >= HELD > min(held) or swapped else "by their order"


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
    return TuningError(
        f"{sheet.name}: which column is the {role} cannot be told ({why}); there are {_all(sheet)}; say which with "
        "--columns time=…,output=…,pv=…"
    )


def _all(sheet: Sheet) -> str:
    return ", ".join(sheet.title(column) for column in range(sheet.width))
