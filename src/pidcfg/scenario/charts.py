"""Charts of a run: what was recorded of it, and what its report says happened."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.pictures.chart import Bar, Chart, Line, Mark, Panel, Strip
from pidcfg.scenario.levels import alarm_lines, limit_lines
from pidcfg.sim.names import in_words
from pidcfg.sim.report import Alarm

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from pidcfg.pictures.chart import Role, Side
    from pidcfg.scenario.axes import Axes
    from pidcfg.scenario.outcome import Outcome
    from pidcfg.sim.recording import Recording
    from pidcfg.sim.report import LoopReport, Period, Report, Verdict

ROWS = 8
"""Alarms and flags of a loop that get a row each."""


def charts_of(outcome: Outcome, loops: Collection[str] = ()) -> list[Chart]:
    """One chart a loop, in the order of the PLC; ``loops``: only these.

    Nothing for a scenario that could not run or was not recorded.
    """
    report, recording = outcome.report, outcome.recording
    if report is None or recording is None:
        return []
    return [
        _chart(loop, loop_report, outcome.axes[loop], report, recording)
        for loop, loop_report in report.loops.items()
        if not loops or loop in loops
    ]


def signals_before_root(outcome: Outcome) -> dict[str, str]:
    """What PV and set point are of each loop that takes the root of its PV."""
    found = {}
    for loop, axes in outcome.axes.items():
        seen = outcome.report.signals.get(axes.setpoint) if outcome.report is not None else None
        if axes.root is not None and seen is not None:
            found[loop] = axes.root.remark(axes.setpoint.rpartition(".")[2], seen.final, axes.pv_unit)
    return found


def _chart(loop: str, loop_report: LoopReport, axes: Axes, report: Report, recording: Recording) -> Chart:
    marks, notes = failures(loop, report)
    events = [
        Mark(event.text if event.loop in {loop, None} else f"{event.loop}: {event.text}", event.at)
        for event in report.events
        if event.loop in {loop, None} or event.loop not in report.loops
    ]
    return Chart(
        title=f"{loop}: {axes.description}" if axes.description else loop,
        loop=loop,
        panels=panels(axes, recording, loop, loop_report, report.duration),
        strips=strips(loop_report, report.duration),
        marks=(*events, *marks),
        begin=0.0,
        end=report.duration,
        notes=(*before_root(axes, recording), *notes),
    )


def before_root(axes: Axes, recording: Recording) -> tuple[str, ...]:
    """What the signals of a loop that takes the root of its PV are; nothing for another loop."""
    if axes.root is None or not axes.setpoint:
        return ()
    _, values = recording.signal(axes.setpoint)
    if not values:
        return ()
    return (axes.root.remark(axes.setpoint.rpartition(".")[2], float(values[-1]), axes.pv_unit),)


def panels(axes: Axes, recording: Recording, loop: str, report: LoopReport, end: float) -> tuple[Panel, ...]:
    """PV and set point on one axis, the output on its own, each with the levels that bars below refer to."""
    wanted: tuple[tuple[str, Role], ...] = ((axes.setpoint, "setpoint"), (axes.pv, "pv"))
    lines = [line(recording, name, role) for name, role in wanted if name]
    title = ", ".join(reversed([one.name for one in lines]))
    lines += alarm_lines(recording, loop, names_of(report.alarms), axes.setpoint, end)
    rows = [Panel(title, axes.pv_unit, tuple(lines))]
    if axes.root is not None:
        rows = [Panel(f"{title} before the root", "", tuple(lines))]
    if axes.output:
        output = line(recording, axes.output, "output")
        limits = limit_lines(recording, loop, names_of(report.conditions), end)
        rows.append(Panel(output.name, axes.output_unit, (output, *limits), axes.output_range))
    return tuple(rows)


def line(recording: Recording, signal: str, role: Role, side: Side | None = None) -> Line:
    """One signal, called as the vendor does: TIC-101.PV is PV."""
    times, values = recording.signal(signal)
    return Line(signal.rpartition(".")[2], role, times, values, side)


def strips(report: LoopReport, end: float) -> tuple[Strip, ...]:
    """Modes, then each alarm and flag that was on, then the steps of a profile."""
    spans = [(in_words(one.alarm), one.at, one.cleared) for one in report.alarms]
    rows = [Strip("mode", modes(report, end), "mode"), *_rows(spans, end, "alarm")]
    if report.steps:
        rows.append(Strip("ramp/soak", tuple(_bar(step, end) for step in report.steps), "step"))
    rows += _rows([(in_words(one.name), one.at, one.until) for one in report.conditions], end, "condition")
    return tuple(rows)


def names_of(spans: Sequence[Alarm] | Sequence[Period]) -> list[str]:
    """The alarms or flags that have a row."""
    return list(dict.fromkeys(one.alarm if isinstance(one, Alarm) else one.name for one in spans))[:ROWS]


def modes(report: LoopReport, end: float) -> tuple[Bar, ...]:
    """One bar for each time in a mode; a refusal changes none."""
    bars, mode, since = [], report.first_mode, 0.0
    for change in report.modes:
        if change.mode != mode:
            bars.append(Bar(mode, since, change.at))
            mode, since = change.mode, change.at
    bars.append(Bar(mode, since, end))
    return tuple(bar for bar in bars if bar.end > bar.begin)


def _bar(step: Period, end: float) -> Bar:
    return Bar(step.name, step.at, end if step.until is None else step.until)


def _rows(spans: Sequence[tuple[str, float, float | None]], end: float, kind: Any) -> list[Strip]:
    """A row for each name, in the order in which they first came on."""
    names = list(dict.fromkeys(name for name, _, _ in spans))
    return [
        Strip(name, tuple(Bar(name, at, end if off is None else off) for row, at, off in spans if row == name), kind)
        for name in names[:ROWS]
    ]


def failures(loop: str, report: Report) -> tuple[list[Mark], tuple[str, ...]]:
    """Failed expectations of a loop, written and standing: marks where they are about a time, else lines of text."""
    failed = [(_with_value(one), one.at) for one in report.expectations if one.loop == loop and not one.passed]
    failed += [(f"{one.kind}: {one.text}", one.at) for one in report.standing if one.loop == loop and one.fails]
    marks = [Mark(text, at, "failure") for text, at in failed if at is not None]
    return marks, tuple(f"failed: {text}" for text, at in failed if at is None)


def _with_value(one: Verdict) -> str:
    value = "" if one.value is None else f" ({one.value:g})" if isinstance(one.value, float) else f" ({one.value})"
    return f"{one.text}{value}"
