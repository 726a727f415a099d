"""Charts of two runs of the same loops laid over each other: as it was, and as it is now."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from pidcfg.pictures.chart import Chart, Line, Strip
from pidcfg.sim.judgement.control import NO_REFERENCE
from pidcfg.study.outcome import Outcome, charts_of


def overlaid(before: Outcome, after: Outcome, names: tuple[str, str], loops: Collection[str] = ()) -> list[Chart]:
    """The charts of a run, with the lines of another one of the same loops behind them, and what lasted otherwise."""
    old = {chart.loop: chart for chart in charts_of(before)}
    return [_over(old[chart.loop], chart, names) if chart.loop in old else chart for chart in charts_of(after, loops)]


def _over(before: Chart, after: Chart, names: tuple[str, str]) -> Chart:
    """One chart of two runs; levels and marks are those of the second. Nobody expects a reference of it."""
    panels = []
    for i, panel in enumerate(after.panels):
        now = [replace(line, side=None if line.role == "level" else "after") for line in panel.lines]
        held = {line.name: line for line in now if line.role != "level"}
        was = before.panels[i].lines if i < len(before.panels) else ()
        lines = [replace(line, side="before") for line in was if _differs(line, held.get(line.name))]
        panels.append(replace(panel, lines=(*lines, *now)))
    rows = {(strip.kind, strip.title): strip for strip in after.strips}
    others = [
        replace(strip, title=f"{strip.title}, {names[0]}")
        for strip in before.strips
        if not _alike(strip, rows.get((strip.kind, strip.title)))
    ]
    notes = tuple(note for note in after.notes if NO_REFERENCE not in note)
    return replace(after, panels=tuple(panels), strips=(*after.strips, *others), notes=notes, sides=names)


def _alike(strip: Strip, other: Strip | None) -> bool:
    """Whether a row would show the same again; modes are the same in the same order."""
    if strip.kind == "mode" and other is not None:
        return [bar.label for bar in strip.bars] == [bar.label for bar in other.bars]
    return strip == other


def _differs(line: Line, other: Line | None) -> bool:
    """Whether a signal is worth a second line: PV and output are, a set point that went another way."""
    if line.role == "level" or other is None:
        return False
    return line.role != "setpoint" or [*line.values] != [*other.values]
