"""Alarms and modes with their times, from the rows that the kernel logs."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, TypeVar

from pidcfg.sim.kernel import LOG_COLUMNS
from pidcfg.sim.report import Alarm, LoopReport, ModeChange, Note, Period, rounded

if TYPE_CHECKING:
    from array import array
    from collections.abc import Mapping

    from pidcfg.sim.plc import Plc

Entry = TypeVar("Entry", Alarm, ModeChange, Note)

LISTED = 1_000
"""Alarms, mode changes and notes that are listed for a loop; so that a chattering alarm does not fill the memory."""


@dataclass(slots=True)
class Journal:
    """What happened to each loop so far."""

    plc: Plc
    dt: float
    requested: list[str] = field(default_factory=list)
    """The mode that was requested last, by loop."""
    loops: list[LoopReport] = field(default_factory=list)
    mode: list[str] = field(default_factory=list)
    active: list[dict[str, float]] = field(default_factory=list)
    since: list[dict[str, float]] = field(default_factory=list)
    """When each flag that is on came on, by loop."""
    stage: list[tuple[str, float]] = field(default_factory=list)
    """The step of a set-point profile and its beginning, by loop."""
    status: list[int] = field(default_factory=list)
    """Every status bit that was on at any time, by loop; likewise ``aux``."""
    aux: list[int] = field(default_factory=list)

    before: list[tuple[int, int] | None] = field(default_factory=list)
    """The status words of the last row, by loop."""
    mode_bits: int = 0
    """The bits of a status that tell the mode; likewise alarms and flags."""
    alarm_bits: int = 0
    flag_bits: int = 0

    def __post_init__(self) -> None:
        plc = self.plc
        groups = (plc.modes, plc.alarm_bits, plc.flag_bits)
        self.mode_bits, self.alarm_bits, self.flag_bits = (reduce(or_, group.values(), 0) for group in groups)
        for goal in self.plc.goals:
            self.requested.append(goal)
            self.mode.append("manual" if "manual" in self.plc.modes else goal)
            self.loops.append(LoopReport(first_mode=self.mode[-1]))
            self.since.append({})
            self.stage.append(("", 0.0))
            self.active.append({})
            self.status.append(0)
            self.aux.append(0)
            self.before.append(None)

    def take(self, log: array[int], rows: int) -> None:
        """The rows of the log, each a base step, a loop, its status words and a notice.

        There may be many of them, so only what has changed is looked at.
        """
        numbers = iter(log[: rows * LOG_COLUMNS].tolist())
        for k, loop, status, aux, notice in zip(*[numbers] * LOG_COLUMNS, strict=True):
            time = rounded(k * self.dt)
            status_before, aux_before = self.before[loop] or (~status, ~aux)
            self.before[loop] = status, aux
            self.status[loop] |= status
            self.aux[loop] |= aux
            changed = status ^ status_before
            if notice or changed & self.mode_bits:
                self._modes(time, loop, status, notice)
            if changed & self.alarm_bits:
                self._alarms(time, loop, status, changed)
            if changed & self.flag_bits:
                self._flags(time, loop, self.plc.flag_bits, status)
            if aux != aux_before:
                self._flags(time, loop, self.plc.aux_bits, aux)
                self._stages(time, loop, self.plc.profile_step(aux))

    def _modes(self, time: float, loop: int, status: int, notice: int) -> None:
        """The mode after a base step, with what led to it (D640); what does not concern it is a note."""
        mode = self.plc.mode(status)
        reason, apart = self.plc.describe(notice)
        if apart:
            self._list(loop, self.loops[loop].notes, Note(time, self.plc.loops[loop], apart))
        if mode == self.mode[loop] and not reason:
            return
        requested = self.plc.requested(notice) if reason else self.requested[loop]
        self.mode[loop] = mode
        self._list(loop, self.loops[loop].modes, ModeChange(time, requested, mode, reason or None))

    def _alarms(self, time: float, loop: int, status: int, changed: int) -> None:
        active = self.active[loop]
        for name, mask in self.plc.alarm_bits.items():
            if not changed & mask:
                continue
            if not status & mask and name in active:
                self._list(loop, self.loops[loop].alarms, Alarm(name, active.pop(name), time))
            elif status & mask and name not in active:
                active[name] = time

    def _flags(self, time: float, loop: int, names: Mapping[str, int], bits: int) -> None:
        """Flags of one status word, by name and mask."""
        since = self.since[loop]
        for name, mask in names.items():
            if bits & mask:
                since.setdefault(name, time)
            elif name in since:
                _keep(self.loops[loop].conditions, Period(name, since.pop(name), time))

    def _stages(self, time: float, loop: int, stage: str) -> None:
        old, begun = self.stage[loop]
        if stage != old:
            if old:
                _keep(self.loops[loop].steps, Period(old, begun, time))
            self.stage[loop] = (stage, time)

    def _list(self, loop: int, entries: list[Entry], entry: Entry) -> None:
        if len(entries) < LISTED:
            entries.append(entry)
        else:
            self.loops[loop].unlisted += 1

    def notes(self) -> list[Note]:
        """Notes of the loops that do not concern their modes."""
        return [note for loop in self.loops for note in loop.notes]

    def close(self) -> None:
        """Alarms that are still on, and flags."""
        for loop, report in enumerate(self.loops):
            report.alarms += [Alarm(name, at) for name, at in self.active[loop].items()]
            report.conditions += [Period(name, at) for name, at in self.since[loop].items()]
            report.conditions.sort(key=lambda one: one.at)
            stage, begun = self.stage[loop]
            report.steps += [Period(stage, begun)] if stage else []
            report.alarms.sort(key=lambda alarm: (alarm.at, list(self.plc.alarm_bits).index(alarm.alarm)))
            report.flags = {name: bool(self.status[loop] & mask) for name, mask in self.plc.flag_bits.items()}
            report.flags |= {name: bool(self.aux[loop] & mask) for name, mask in self.plc.aux_bits.items()}
            report.autotune = self.plc.tuned(loop)


def _keep(entries: list[Period], entry: Period) -> None:
    if len(entries) < LISTED:
        entries.append(entry)
