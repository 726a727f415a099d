"""Lines in a trend at which its alarms come on and its output ends."""

from __future__ import annotations

from math import isfinite, nan
from typing import TYPE_CHECKING

from pidcfg.pictures.chart import Line
from pidcfg.sim.names import LIMITED_ABOVE, LIMITED_BELOW, in_words
from pidcfg.sim.recording import HIGH, LOW

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.sim.recording import Recording

    Steps = Sequence[tuple[float, float]]
    """Times in s, each with the value from then on."""

DEVIATION = "deviation"
"""Alarms with this beginning are distances from the set point."""
RATE = "rate_of_change"
"""An alarm that has no place beside a PV."""


def alarm_lines(recording: Recording, loop: str, alarms: Sequence[str], setpoint: str, end: float) -> Iterator[Line]:
    """The level of each alarm until the end (s): one for a PV, two around the set point (a signal) for a distance."""
    for alarm in alarms:
        level = recording.levels.get((loop, alarm), ())
        if alarm.startswith(DEVIATION) and setpoint:
            centre = list(zip(*recording.signal(setpoint), strict=True))
            for side in (1.0, -1.0):
                yield from level_lines(in_words(alarm), around(centre, level, side), end)
        elif alarm != RATE:
            yield from level_lines(in_words(alarm), level, end)


def limit_lines(recording: Recording, loop: str, flags: Sequence[str], end: float) -> Iterator[Line]:
    """The limits of the output, where a flag says that it was at one."""
    for name, title, reasons in ((HIGH, "upper limit", LIMITED_ABOVE), (LOW, "lower limit", LIMITED_BELOW)):
        if reasons & {*flags}:
            yield from level_lines(title, recording.levels.get((loop, name), ()), end)


def level_lines(title: str, steps: Steps, end: float) -> Iterator[Line]:
    """A level that holds its last value to the end; a line for each time without a gap."""
    times: list[float] = []
    values: list[float] = []
    for time, value in (*steps, (end, nan)):
        if values:
            times.append(time)
            values.append(value if isfinite(value) else values[-1])
        elif isfinite(value):
            times, values = [time], [value]
        if values and not isfinite(value):
            yield Line(title, "level", times, values)
            times, values = [], []


def around(centre: Steps, distance: Steps, side: float) -> list[tuple[float, float]]:
    """What is a distance away from a centre, whenever either changes."""
    rows: list[tuple[float, float]] = []
    at = away = nan
    for time, which, value in sorted([(t, 0, v) for t, v in centre] + [(t, 1, v) for t, v in distance]):
        at, away = (value, away) if which == 0 else (at, value)
        row = at + side * away
        if rows and rows[-1][0] == time:
            rows[-1] = (time, row)
        elif not rows or repr(rows[-1][1]) != repr(row):
            rows.append((time, row))
    return rows
