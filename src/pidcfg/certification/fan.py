"""How far signals spread over time: samples 0 to 499, thinned to 400 times, and of these the quantiles at each."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from math import ceil
from typing import TYPE_CHECKING

from pidcfg.sim.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

SAMPLES, TIMES = 500, 400
LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles that are drawn."""


@dataclass(slots=True)
class Thinned(Recording):
    """Signals of one run at equal distances: at most `TIMES` values of each, the first and the last among them."""

    wanted_steps: list[int] = field(default_factory=list)
    taken: dict[str, array[float]] = field(default_factory=dict)
    _next: int = 0

    def begin(self, names: Sequence[str], steps: int, dt: float) -> None:
        """A run of so many base steps begins."""
        self.dt, self._rows, self._width, self._next = dt, 0, len(names), 0
        self._columns = [(i, name) for i, name in enumerate(names) if self.wanted is None or name in self.wanted]
        self.names = [name for _, name in self._columns]
        count = min(steps, TIMES)
        self.wanted_steps = [round(i * (steps - 1) / max(count - 1, 1)) for i in range(count)]
        self.taken = {name: array("d") for name in self.names}

    def take(self, rows_of_values: Sequence[float], rows: int) -> None:
        """Rows of values, one a base step."""
        while self._next < len(self.wanted_steps) and self.wanted_steps[self._next] < self._rows + rows:
            row = (self.wanted_steps[self._next] - self._rows) * self._width
            for column, name in self._columns:
                self.taken[name].append(rows_of_values[row + column])
            self._next += 1
        self._rows += rows

    def end(self) -> None:
        """The run is over."""


@dataclass(frozen=True, slots=True)
class Fan:
    """The spread of each signal."""

    samples: int
    times: Sequence[float]
    """In s."""
    quantiles: Mapping[str, Sequence[Sequence[float]]]
    """By signal, of each of `LEVELS` a value a time."""


def fan_of(times: Sequence[float], runs: Sequence[Mapping[str, Sequence[float]]]) -> Fan:
    """The quantiles of some runs, each by its signals; a quantile is the value of the nearest rank."""
    ranks = [max(1, ceil(level * len(runs))) - 1 for level in LEVELS]
    found: dict[str, list[list[float]]] = {}
    for name in runs[0] if runs else ():
        columns = [sorted(values) for values in zip(*(run[name] for run in runs), strict=True)]
        found[name] = [[column[rank] for column in columns] for rank in ranks]
    return Fan(len(runs), list(times), found)
