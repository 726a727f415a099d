"""What a picture of a loop shows, as data: every way of drawing it reads the same chart.

A chart has panels above each other on one time axis (PV and set point on one, the output on its own), and below them
strips: one row each for modes, alarms and ramp/soak steps, in which something lasts from one time to another.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Sequence

Role = Literal["setpoint", "pv", "output", "other"]
Side = Literal["before", "after"]


@dataclass(frozen=True, slots=True)
class Line:
    """One signal; ``side``: which of two runs it belongs to where a chart lays one over the other."""

    name: str
    role: Role
    times: Sequence[float]
    """In s."""
    values: Sequence[float]
    side: Side | None = None


@dataclass(frozen=True, slots=True)
class Panel:
    """Lines on one axis, whose title and unit label it."""

    title: str
    unit: str
    lines: tuple[Line, ...]


@dataclass(frozen=True, slots=True)
class Bar:
    """Something that lasted, in s: a mode, an alarm, a step."""

    label: str
    begin: float
    end: float


@dataclass(frozen=True, slots=True)
class Strip:
    """A row of bars below the panels."""

    title: str
    bars: tuple[Bar, ...]


@dataclass(frozen=True, slots=True)
class Mark:
    """Something that happened at one time: an event of the scenario."""

    label: str
    at: float


@dataclass(frozen=True, slots=True)
class Chart:
    """One loop's picture."""

    title: str
    loop: str
    panels: tuple[Panel, ...]
    strips: tuple[Strip, ...] = ()
    marks: tuple[Mark, ...] = ()
