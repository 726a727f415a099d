"""Pictures of runs: a chart as data, which is drawn as SVG, PNG, a page or characters.

A chart has panels above each other on one time axis (PV and set point on one, the output on its own), and below them
strips: one row each for modes, alarms and ramp/soak steps, in which something lasts from one time to another.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from pidcfg.text.frozen import frozen

Role = Literal["setpoint", "pv", "output", "level", "other"]
"""Set point, output and level (of an alarm, of a limit) hold their value until the next one; a PV moves between its
values. A level has no value (NaN) where its alarm is off."""
Side = Literal["before", "after"]
StripKind = Literal["mode", "alarm", "step", "condition"]
MarkKind = Literal["event", "failure"]


@frozen
class Line:
    """One signal; ``side``: which of two runs it belongs to where a chart lays one over the other."""

    name: str
    """Short, as it stands beside the line: PV, SP, OUT."""
    role: Role
    times: Sequence[float]
    """In s."""
    values: Sequence[float]
    side: Side | None = None


@frozen
class Band:
    """A surface between two values at each time: how far a signal spreads."""

    role: Role
    times: Sequence[float]
    """In s."""
    low: Sequence[float]
    high: Sequence[float]


@frozen
class Panel:
    """Lines on one axis, whose title and unit label it."""

    title: str
    unit: str
    lines: tuple[Line, ...]
    shown_range: tuple[float, float] | None = None
    """What the axis shows at least: an output's range."""
    bands: tuple[Band, ...] = ()
    """Behind the lines."""


@frozen
class Bar:
    """Something that lasted, in s: a mode, an alarm, a step."""

    label: str
    begin: float
    end: float


@frozen
class Strip:
    """A row of bars below the panels; bars of one row do not overlap."""

    title: str
    bars: tuple[Bar, ...]
    kind: StripKind = "condition"


@frozen
class Mark:
    """Something that happened at one time: an event of the scenario, or an expectation that fails there."""

    label: str
    time: float
    kind: MarkKind = "event"


@frozen
class Locus:
    """The open loop as a curve in the complex plane (Nyquist), and the points at which its margins are measured."""

    points: Sequence[complex]
    """From low frequencies to high ones."""
    ms: float
    """The curve stays outside of a circle around -1 with the radius 1/ms."""
    nearest: complex
    """Where it comes closest to -1."""
    gain_margin: float
    phase_crossover: complex | None
    """Where it crosses the negative real axis, the farthest out; None: it does not."""
    phase_margin: float
    """In degrees."""
    gain_crossover: complex | None
    """Where it comes into the unit circle, the closest to -1; None: it does not."""

    @property
    def text(self) -> str:
        """The margins in words."""
        words = [f"Ms {self.ms:.3g}"]
        words += [] if self.phase_crossover is None else [f"gain margin {self.gain_margin:.3g}"]
        words += [] if self.gain_crossover is None else [f"phase margin {self.phase_margin:.3g}°"]
        return ", ".join(words)


@frozen
class Chart:
    """One loop's picture."""

    title: str
    loop: str
    panels: tuple[Panel, ...]
    strips: tuple[Strip, ...] = ()
    marks: tuple[Mark, ...] = ()
    begin: float | None = None
    """The ends of the time axis, in s; None: those of the lines."""
    end: float | None = None
    sides: tuple[str, str] | None = None
    """What ``before`` and ``after`` are called, where a chart shows two runs."""
    locus: Locus | None = None
    """Above the panels: the loop's margins."""
    notes: tuple[str, ...] = ()
    """Lines of text below the picture: failed expectations that have no time, what is left out."""

    @property
    def time_span(self) -> tuple[float, float]:
        """Where the time axis begins and ends, in s."""
        if self.begin is not None and self.end is not None:
            return self.begin, self.end
        times = [t for panel in self.panels for line in panel.lines for t in (line.times[:1], line.times[-1:]) if t]
        ends = [float(t[0]) for t in times] + [t for s in self.strips for b in s.bars for t in (b.begin, b.end)]
        begin = min(ends, default=0.0) if self.begin is None else self.begin
        end = max(ends, default=begin) if self.end is None else self.end
        return begin, end
