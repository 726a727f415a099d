"""The trend of a run for a picture: a bounded number of points a signal, in which no extreme is lost.

The base steps of a run fall into equal groups. Of each group a signal keeps its first, lowest, highest and last value
with their times, so that a line through them covers the same points of a picture as a line through all values.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from math import nan
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.sim.plc import Plc

POINTS = 2_000
"""What a signal keeps at most."""
KEPT = 4
"""Values of a group: first, lowest, highest, last."""
LOW, HIGH = "output low", "output high"
"""What stands for an output's limits among the levels of alarms."""


@dataclass(slots=True)
class Recording:
    """Signals of a run as it goes on; only those that are ``wanted``, or all."""

    wanted: frozenset[str] | None = None
    dt: float = 1.0
    """The base step in s."""
    names: list[str] = field(default_factory=list)
    group: int = 1
    """Base steps in a group."""
    steps: dict[str, array[int]] = field(default_factory=dict)
    """The base steps of the points that are kept, by signal."""
    values: dict[str, array[float]] = field(default_factory=dict)
    levels: dict[tuple[str, str], list[tuple[float, float]]] = field(default_factory=dict)
    """By loop and alarm: where the alarm comes on, from which time in s on; NaN where it is off. The limits of the
    output, as `LOW` and `HIGH`, likewise."""
    _columns: list[tuple[int, str]] = field(default_factory=list)
    _rows: int = 0
    _width: int = 0
    _open: dict[str, list[tuple[int, float]]] = field(default_factory=dict)
    """First, lowest, highest and last value so far of the group that is not complete."""

    def begin(self, names: Sequence[str], steps: int, dt: float) -> None:
        """A run of so many base steps begins; what was recorded before is forgotten."""
        self.dt, self._rows, self._width = dt, 0, len(names)
        self._columns = [(i, name) for i, name in enumerate(names) if self.wanted is None or name in self.wanted]
        self.names = [name for _, name in self._columns]
        self.group = 1 if steps <= POINTS else -(-steps * KEPT // POINTS)
        self.steps = {name: array("q") for name in self.names}
        self.values = {name: array("d") for name in self.names}
        self.levels, self._open = {}, {}

    def look(self, plc: Plc, sig: Sequence[float], time: float) -> None:
        """Notes the levels of all alarms and the limits of all outputs where they have changed."""
        for i, loop in enumerate(plc.loops):
            levels = {alarm: plc.alarm_level(i, alarm) for alarm in plc.alarm_limits}
            low, high = plc.output_limits(i, sig)
            for name, level in {**levels, LOW: low, HIGH: high}.items():
                value = nan if level is None else level
                rows = self.levels.setdefault((loop, name), [])
                if not rows or repr(rows[-1][1]) != repr(value):
                    rows.append((time, value))

    def take(self, rows_of_values: Sequence[float], rows: int) -> None:
        """Rows of values, one a base step, one after the other."""
        done = 0
        while done < rows:
            count = min(rows - done, self.group - (self._rows % self.group))
            for column, name in self._columns:
                part = rows_of_values[done * self._width + column : (done + count) * self._width : self._width]
                self._see(name, part)
            self._rows += count
            done += count
            if self._rows % self.group == 0:
                self._close()

    def _see(self, name: str, part: Sequence[float]) -> None:
        """The next values of a signal, all of one group."""
        low, high = min(part), max(part)
        seen = self._open.get(name)
        first = (self._rows, part[0])
        lowest, highest = (self._rows + part.index(low), low), (self._rows + part.index(high), high)
        last = (self._rows + len(part) - 1, part[-1])
        if seen is not None:
            first = seen[0]
            lowest = seen[1] if seen[1][1] <= low else lowest
            highest = seen[2] if seen[2][1] >= high else highest
        self._open[name] = [first, lowest, highest, last]

    def _close(self) -> None:
        for name, seen in self._open.items():
            for step, value in sorted(set(seen)):
                self.steps[name].append(step)
                self.values[name].append(value)
        self._open = {}

    def end(self) -> None:
        """The run is over."""
        self._close()

    def signal(self, name: str) -> tuple[list[float], list[float]]:
        """Times in s and values of a signal."""
        return [float(f"{step * self.dt:.10g}") for step in self.steps[name]], self.values[name].tolist()
