"""The trend of a run: one row a base step (or every n-th), written as it comes."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from pidcfg.sim.plc import TICKS

if TYPE_CHECKING:
    from collections.abc import Sequence


class Sink(Protocol):
    """Where text goes: an open file."""

    def write(self, text: str, /) -> object:
        """Takes a piece of text."""


def clock(ticks: int) -> str:
    """A time in s, exactly: ``0.2``, ``15``."""
    whole, part = divmod(ticks, TICKS)
    return f"{whole}.{part:06d}".rstrip("0") if part else str(whole)


@dataclass(slots=True)
class Trend:
    """CSV of signals; numbers have ten significant digits, lines end in LF on every system."""

    sink: Sink
    names: Sequence[str]
    step: int
    every: int = 1
    at: int = field(default=0, init=False)
    """The base step of the next values."""

    def __post_init__(self) -> None:
        csv.writer(self.sink, lineterminator="\n").writerow(["time", *self.names])

    def take(self, values: Sequence[float], rows: int, apart: int) -> None:
        """Rows of values, one after the other, ``apart`` base steps from each other; one every n-th is written."""
        width = len(self.names)
        lines = []
        for row in range(rows):
            at = self.at + row * apart
            if at % self.every == 0:
                shown = (f"{value:.10g}" for value in values[row * width : (row + 1) * width])
                lines.append(",".join([clock(at * self.step), *shown]))
        self.at += rows * apart
        if lines:
            self.sink.write("\n".join(lines) + "\n")
