"""The trend of a run for a picture: a bounded number of points a signal, in which no extreme is lost."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from math import nan
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.sim.controllers.plc import Plc

# The base steps of a run fall into equal groups. Of each group a signal keeps its first, lowest, highest and last
# value with their times, so that a line through them covers the same points of a picture as a line through all
# values.

MAX_POINTS = 2_000
"""What a signal keeps at most."""
GROUP_VALUES = 4
"""Values of a group: first, lowest, highest, last."""
OUTPUT_LOW, OUTPUT_HIGH = "output low", "output high"
"""What stands for an output's limits among the levels of alarms."""


@dataclass(slots=True)
class Recording:
    """Signals of a run as it goes on; only those that are ``wanted``, or all."""

    chosen: frozenset[str] | None = None
    dt: float = 1.0
    """The base step in s."""
    names: list[str] = field(default_factory=list)
    group_size: int = 1
    """Base steps in a group."""
    steps: dict[str, array[int]] = field(default_factory=dict)
    """The base steps of the points that are kept, by signal."""
    values: dict[str, array[float]] = field(default_factory=dict)
    levels: dict[tuple[str, str], list[tuple[float, float]]] = field(default_factory=dict)
    """By loop and alarm: where the alarm comes on, from which time in s on; NaN where it is off. The limits of the
    output, as `OUTPUT_LOW` and `OUTPUT_HIGH`, likewise."""
    _columns: list[tuple[int, str]] = field(default_factory=list)
    _rows: int = 0
    _width: int = 0
    _open_values: dict[str, list[float]] = field(default_factory=dict)
    """The values so far of the group that is not complete."""
    _times: dict[int, float] = field(default_factory=dict)
    """The times in s of base steps that were asked for."""

    def begin(self, names: Sequence[str], steps: int, dt: float) -> None:
        """A run of so many base steps begins; what was recorded before is forgotten."""
        self.dt, self._rows, self._width = dt, 0, len(names)
        self._columns = [(i, name) for i, name in enumerate(names) if self.chosen is None or name in self.chosen]
        self.names = [name for _, name in self._columns]
        self.group_size = 1 if steps <= MAX_POINTS else -(-steps * GROUP_VALUES // MAX_POINTS)
        self.steps = {name: array("q") for name in self.names}
        self.values = {name: array("d") for name in self.names}
        self.levels, self._open_values, self._times = {}, {}, {}

    def note_levels(self, plc: Plc, signals: Sequence[float], time: float) -> None:
        """Notes the levels of all alarms and the limits of all outputs where they have changed."""
        for i, loop in enumerate(plc.loops):
            levels = {alarm: plc.alarm_level(i, alarm) for alarm in plc.alarm_limits}
            low, high = plc.output_limits(i, signals)
            for name, level in {**levels, OUTPUT_LOW: low, OUTPUT_HIGH: high}.items():
                value = nan if level is None else level
                rows = self.levels.setdefault((loop, name), [])
                if not rows or repr(rows[-1][1]) != repr(value):
                    rows.append((time, value))

    def add_rows(self, values: Sequence[float], rows: int) -> None:
        """Rows of values, one a base step, one after the other."""
        for column, name in self._columns:
            self._add_values(name, values[column : rows * self._width : self._width])
        self._rows += rows

    def _add_values(self, name: str, values: Sequence[float]) -> None:
        """The next values of a signal, which belong to as many groups as they reach into."""
        held = self._open_values.get(name, [])
        values = [*held, *values]
        complete = len(values) - len(values) % self.group_size
        indices = kept_indices(values, complete, self.group_size)
        self._keep_points(name, self._rows - len(held), indices, values)
        self._open_values[name] = values[complete:]

    def _keep_points(self, name: str, zero: int, indices: Sequence[int], values: Sequence[float]) -> None:
        """Keeps a signal's values at these places; the first of all values belongs to base step ``zero``."""
        self.steps[name].extend([zero + place for place in indices])
        self.values[name].extend(map(values.__getitem__, indices))

    def end(self) -> None:
        """The run is over; what is left of a group is one."""
        for name, values in self._open_values.items():
            self._keep_points(
                name, self._rows - len(values), kept_indices(values, len(values), len(values) or 1), values
            )
        self._open_values = {}

    def signal(self, name: str) -> tuple[list[float], list[float]]:
        """Times in s and values of a signal."""
        times = self._times
        for step in self.steps[name]:
            if step not in times:
                times[step] = float(f"{step * self.dt:.10g}")
        return [times[step] for step in self.steps[name]], self.values[name].tolist()


def kept_indices(values: Sequence[float], end: int, size: int) -> Sequence[int]:
    """Where first, lowest, highest and last value of each group of this size stand, in the order of time."""
    if size == 1:
        return range(end)
    indices, last = list[int](), size - 1
    for first in range(0, end, size):
        group = values[first : first + size]
        low, high = min(group), max(group)
        if low == high:
            indices += first, first + last
            continue
        first_extreme, second_extreme = group.index(low), group.index(high)
        if first_extreme > second_extreme:
            first_extreme, second_extreme = second_extreme, first_extreme
        indices.append(first)
        if first_extreme:
            indices.append(first + first_extreme)
        if second_extreme < last:
            indices.append(first + second_extreme)
        indices.append(first + last)
    return indices
