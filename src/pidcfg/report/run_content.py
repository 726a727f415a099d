"""What a commissioning report says about a run, as data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


@dataclass(frozen=True, slots=True)
class Happening:
    """Something of a run: an event, an alarm, a mode, a remark."""

    at: float
    loop: str
    kind: str
    text: str
    until: float | None = None
    error: bool = False


@dataclass(frozen=True, slots=True)
class OpenAlarm:
    """An alarm that is on at the end of a run."""

    loop: str
    alarm: str
    at: float
    """Since when, in s."""


@dataclass(frozen=True, slots=True)
class Units:
    """What the PV and the output of a loop are counted in; empty: nobody says."""

    pv: str = ""
    output: str = ""
    signals: Mapping[str, str] = field(default_factory=dict)
    """Of the loop's signals, by their names."""


@dataclass(frozen=True, slots=True)
class Expectation:
    """What was expected of a run, and what came."""

    text: str
    passed: bool
    value: str


@dataclass(frozen=True, slots=True)
class StandingRow:
    """A standing expectation of a run: what is expected of every loop, whether the scenario says so or not."""

    loop: str
    """Empty: the PLC."""
    kind: str
    verdict: str
    """``passed``, ``FAILED``, ``allowed``, or ``not judged``."""
    at: float | None
    """Since when, in s."""
    text: str


@dataclass(frozen=True, slots=True)
class RunSheet:
    """One scenario's run; without facts it could not run, and the findings say why."""

    file: str
    config: str
    title: str
    ran: bool
    passed: bool
    verdict: str
    anchor: str = ""
    """What links lead to: known once its place in the report is."""
    facts: tuple[tuple[str, str], ...] = ()
    happenings: tuple[Happening, ...] = ()
    unlisted: int = 0
    """Changes of modes and alarms that the run has counted only."""
    metrics: Mapping[str, Mapping[str, float | None]] = field(default_factory=dict)
    metric_titles: Mapping[str, str] = field(default_factory=dict)
    """The columns of the metrics; those of swings only where a loop swings."""
    units: Mapping[str, Units] = field(default_factory=dict)
    """Of each loop."""
    open_alarms: tuple[OpenAlarm, ...] = ()
    before_root: tuple[tuple[str, str], ...] = ()
    """Loops that take the root of their PV, and what their signals are."""
    signals: tuple[tuple[str, float, float, float], ...] = ()
    flags: tuple[tuple[str, str], ...] = ()
    """Loops and the flags that were on at any time."""
    autotunes: tuple[tuple[str, str, tuple[tuple[str, float], ...]], ...] = ()
    """Loop, status and the gains found."""
    expectations: tuple[Expectation, ...] = ()
    standing: tuple[StandingRow, ...] = ()
    in_control: Mapping[str, float] = field(default_factory=dict)
    """How long each loop was in Auto or Cascade, in s."""
    duration: float = 0.0
    """In s."""
    pictures: str = ""
    """The trends, as a part of a page."""

    @property
    def signal_units(self) -> dict[str, str]:
        """The units of the loops' signals, by their names."""
        return {name: unit for units in self.units.values() for name, unit in units.signals.items()}

    def count(self, verdict: str) -> int:
        """How many standing expectations have this verdict."""
        return sum(row.verdict == verdict for row in self.standing)

    @property
    def judged(self) -> int:
        """How many standing expectations are judged."""
        return len(self.standing) - self.count("not judged")

    @property
    def remarkable(self) -> tuple[tuple[str, str, tuple[str, ...], float | None, str], ...]:
        """What does not simply hold: verdict, loop, kinds for the same reason, since when, why."""
        rows: dict[tuple[str, str, float | None, str], list[str]] = {}
        for row in self.standing:
            if row.verdict != "passed":
                rows.setdefault((row.verdict, row.loop, row.at, row.text), []).append(row.kind)
        return tuple(
            (verdict, loop, self._in_short(kinds), at, why) for (verdict, loop, at, why), kinds in rows.items()
        )

    @property
    def left_out(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """Loops with standing expectations that are not judged, and which."""
        rows: dict[str, list[str]] = {}
        for row in self.standing:
            if row.verdict == "not judged":
                rows.setdefault(row.loop, []).append(row.kind)
        return tuple((loop, self._in_short(kinds)) for loop, kinds in rows.items())

    def _in_short(self, kinds: Sequence[str]) -> tuple[str, ...]:
        """Kinds of a loop; all of them are the loop as a whole."""
        return tuple(kinds) if len(kinds) < len({row.kind for row in self.standing}) else ("as a whole",)
