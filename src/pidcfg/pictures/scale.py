"""Ends and ticks of an axis, and numbers as people write them beside it."""

from __future__ import annotations

from math import ceil, floor, log10
from typing import TYPE_CHECKING

from pidcfg.pictures.style import drawable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.pictures.chart import Line, Panel

ROOM = 0.06
"""What is left free above and below the lines, as a share of what they cover."""
NEAR = 0.25
"""How far beyond the signals an axis reaches to show a level, as a share of what they cover."""
FLAT = 1e-9
"""Values that differ by less than this share of their size are one value."""
STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
"""Distances of ticks, times a power of ten."""
SLACK = 1e-9
"""What rounding may add to the ends of an axis, as a share of a step."""


def limits(panel: Panel) -> tuple[float, float]:
    """The ends of a value axis: all signals with some room, and around a flat line something to see it in.

    A level widens it only where it is near: an alarm that is far away would make a line of the signal.
    """
    values = [v for line in panel.lines if line.role != "level" for v in drawable(line)[1]] + list(panel.least or ())
    values += [v for band in panel.bands for side in (band.low, band.high) for v in side]
    low, high = min(values, default=0.0), max(values, default=1.0)
    if high - low <= FLAT * max(abs(low), abs(high)):
        low, high = low - 0.05 * (abs(low) or 10.0), high + 0.05 * (abs(high) or 10.0)
    near = NEAR * (high - low)
    levels = [v for line in panel.lines if line.role == "level" for v in drawable(line)[1]]
    close = [v for v in levels if low - near <= v <= high + near]
    low, high = min([low, *close]), max([high, *close])
    room = ROOM * (high - low)
    return low - room, high + room


def layer_of(line: Line) -> tuple[bool, bool, bool]:
    """Levels lie below all, thin lines on thick ones."""
    return line.role != "level", line.role == "setpoint", line.side == "before"


def level_names(panel: Panel) -> list[tuple[float, str]]:
    """Where the name of each level stands, the lowest first: once, at the highest end that is seen."""
    low, high = limits(panel)
    ends: dict[str, float] = {}
    for line in panel.lines:
        if line.role == "level" and line.values and low <= line.values[-1] <= high:
            ends[line.name] = max(line.values[-1], ends.get(line.name, low))
    return sorted((value, name) for name, value in ends.items())


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers between the ends of an axis, at most so many."""
    rough = (high - low) / most
    power = 10.0 ** floor(log10(rough))
    step = next(size * power for size in STEPS if size * power >= rough * (1 - SLACK))
    first, last = ceil(low / step - SLACK), floor(high / step + SLACK)
    return [i * step for i in range(first, last + 1)]


def tick_text(value: float) -> str:
    """A tick's number."""
    return f"{value:.10g}"


def spread(places: Sequence[float], room: float, apart: float) -> list[float]:
    """Ascending places, moved as little as needed to be apart, and within the room as far as it allows."""
    moved: list[float] = []
    for place in places:
        moved.append(max(place, moved[-1] + apart if moved else place))
    for i in range(len(moved) - 1, -1, -1):
        ceiling = room if i == len(moved) - 1 else moved[i + 1] - apart
        moved[i] = min(moved[i], ceiling)
    return moved
