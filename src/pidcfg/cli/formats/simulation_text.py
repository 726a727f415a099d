"""A run as text for people and CI logs, and as JSON whose layout is spelled out key by key."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pidcfg.cli.formats.reporters import text as findings_text
from pidcfg.diagnostics import Diagnostic, Severity
from pidcfg.sim.metrics import METRICS
from pidcfg.sim.report import rounded

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.scenario.charts import Axes
    from pidcfg.sim.recording import Recording
    from pidcfg.sim.report import LoopReport, Report
    from pidcfg.source import Document

SHOWN = 60
"""Lines of the list of happenings; JSON has all of them."""
METRIC_UNITS = {"overshoot": " %", "settling_time": " s", "rise_time": " s"}


@dataclass(frozen=True, slots=True)
class Outcome:
    """One scenario file: its findings, and its report when it could run."""

    file: str
    config: str = ""
    report: Report | None = None
    findings: Sequence[Diagnostic] = ()
    documents: Mapping[str, Document] = field(default_factory=dict)
    config_errors: bool = False
    """Whether the configuration has errors; they are among the findings."""
    recording: Recording | None = None
    """The trend for a picture, where one is wanted."""
    axes: Mapping[str, Axes] = field(default_factory=dict)
    """Names and units of each loop's signals."""

    @property
    def unjudged(self) -> bool:
        """Whether a configuration with errors ran and nothing was expected of it."""
        return self.config_errors and self.report is not None and not self.report.expectations

    @property
    def passed(self) -> bool:
        """Whether it ran and everything expected of it holds."""
        return self.report is not None and self.report.passed and not self.unjudged


def text(outcomes: Sequence[Outcome]) -> str:
    """One section a scenario."""
    return "\n".join(_section(outcome) for outcome in outcomes)


def _section(outcome: Outcome) -> str:
    report = outcome.report
    found = findings_text(outcome.findings, outcome.documents).rstrip("\n")
    if report is None:
        return f"{outcome.file}: cannot run\n\n{found}\n"
    parts = [
        _head(outcome, report),
        found and f"{found}\n",
        _happenings(report),
        _tables(report),
        _flags(report),
        _verdicts(outcome, report),
    ]
    return "\n".join(part for part in parts if part)


def _head(outcome: Outcome, report: Report) -> str:
    steady = "" if report.settled is None else f", after {report.settled:g} s to the steady state"
    words = ", ".join(f"{name} = {word}" for name, word in report.plc_flags.items())
    words += "" if report.running else ": the loop task is off, no loop is calculated"
    timing = report.scan_time
    scan = (
        ""
        if timing is None
        else (
            f"  scan time with these loops: {timing.typical * 1e3:.3f} ms "
            f"({timing.minimum * 1e3:.3f} to {timing.maximum * 1e3:.3f} ms)\n"
        )
    )
    return (
        f"{report.scenario}\n"
        f"  {outcome.file} runs {outcome.config}\n"
        f"  {report.duration:g} s in steps of {report.step:g} s{steady}; engine: {report.engine}\n"
        + (f"  {words}\n" if words else "")
        + scan
    )


def _happenings(report: Report) -> str:
    rows = [(event.at, event.loop or "", f"event: {event.text}") for event in report.events]
    for name, loop in report.loops.items():
        for change in loop.modes:
            asked = "" if change.requested in (None, change.mode) else f" (requested {change.requested})"
            reason = f": {change.reason}" if change.reason else ""
            rows.append((change.at, name, f"mode {change.mode}{asked}{reason}"))
        for alarm in loop.alarms:
            until = "on at the end" if alarm.cleared is None else f"until {alarm.cleared:g} s"
            rows.append((alarm.at, name, f"alarm {alarm.alarm}, {until}"))
        if loop.unlisted:
            rows.append((report.duration, name, f"and {loop.unlisted} more changes that are not listed"))
    rows += [(note.at, note.loop or "", ("error: " if note.error else "note: ") + note.text) for note in report.notes]
    rows.sort(key=lambda row: row[0])
    lines = [(f"{at:g} s", name, what) for at, name, what in rows[:SHOWN]]
    more = f"  … and {len(rows) - SHOWN} more; --format json lists all\n" if len(rows) > SHOWN else ""
    return "What happened\n" + _table(lines, right=1) + more if rows else ""


def _tables(report: Report) -> str:
    metrics: list[tuple[str, ...]] = [("", *METRICS)]
    for name, loop in report.loops.items():
        values = [loop.metrics.get(metric) for metric in METRICS]
        units = [METRIC_UNITS.get(metric, "") for metric in METRICS]
        metrics.append((name, *(_number(v, unit) for v, unit in zip(values, units, strict=True))))
    signals = [("", "min", "max", "final")]
    signals += [(name, f"{s.low:g}", f"{s.high:g}", f"{s.final:g}") for name, s in report.signals.items()]
    return "Metrics\n" + _table(metrics, left=1) + "\nSignals\n" + _table(signals, left=1)


def _number(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:g}{unit}"


def _flags(report: Report) -> str:
    rows = []
    for name, loop in report.loops.items():
        on = [flag for flag, seen in loop.flags.items() if seen]
        if on:
            rows.append((name, ", ".join(on)))
        if loop.autotune is not None:
            results = ", ".join(f"{key} {value:g}" for key, value in loop.autotune["results"].items())
            rows.append((name, f"autotune {loop.autotune['status']}{': ' if results else ''}{results}"))
    return "Flags\n" + _table(rows) if rows else ""


def _verdicts(outcome: Outcome, report: Report) -> str:
    rows = [("passed" if v.passed else "FAILED", f"{v.text}: {value_text(v.value)}") for v in report.expectations]
    return ("Expectations\n" + _table(rows) if rows else "") + verdict_line(outcome, report) + "\n"


def verdict_line(outcome: Outcome, report: Report) -> str:
    """How a run went, in one line."""
    failed = sum(not verdict.passed for verdict in report.expectations)
    total = len(report.expectations)
    errors = any(note.error for note in report.notes) or any(p.severity == "error" for p in report.problems)
    line = f"FAILED: {failed} of {total} expectations" if failed else f"passed: {total} of {total} expectations"
    if errors and not failed:
        line = f"FAILED: an error in the run ({total} of {total} expectations passed)"
    if outcome.unjudged:
        line = "FAILED: the configuration has errors, and nothing is expected of the run"
    return line


def value_text(value: Any) -> str:
    """What was measured, for people."""
    if isinstance(value, list):
        return " to ".join(value_text(v) for v in value)
    if isinstance(value, float):
        return f"{value:g}"
    return "none" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _table(rows: Sequence[Sequence[str]], left: int = 9, right: int = 0) -> str:
    """Aligned columns; the first ``right`` ones and all after ``left`` to the right."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = [
            cell.rjust(width) if i < right or i >= left else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  " + "  ".join(cells).rstrip())
    return "\n".join(lines) + "\n"


def json_v1(outcomes: Sequence[Outcome]) -> str:
    """The public layout, version 1: one object for one scenario, for several a list of them under ``runs``."""
    data: dict[str, Any]
    if len(outcomes) == 1:
        data = {"version": 1, **_run(outcomes[0])}
    else:
        runs = [_run(outcome) for outcome in outcomes]
        data = {"version": 1, "runs": runs, "passed": all(outcome.passed for outcome in outcomes)}
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _run(outcome: Outcome) -> dict[str, Any]:
    report = outcome.report
    timing = report.scan_time if report else None
    scan = {} if timing is None else {"scan_time": dict(zip(timing._fields, map(rounded, timing), strict=True))}
    return {
        "scenario": report.scenario if report else None,
        "file": outcome.file,
        "engine": report.engine if report else None,
        "plc_flags": dict(report.plc_flags) if report else {},
        "loops": {name: _loop(loop) for name, loop in report.loops.items()} if report else {},
        "signals": {
            name: {"min": seen.low, "max": seen.high, "final": seen.final} for name, seen in report.signals.items()
        }
        if report
        else {},
        "expectations": [{"text": v.text, "passed": v.passed, "value": v.value} for v in report.expectations]
        if report
        else [],
        "notes": [{"at": n.at, "loop": n.loop, "text": n.text, "error": n.error} for n in report.notes]
        if report
        else [],
        "findings": [_finding(d) for d in outcome.findings],
        "passed": outcome.passed,
        **scan,
    }


def _loop(loop: LoopReport) -> dict[str, Any]:
    data: dict[str, Any] = {
        "metrics": {name: loop.metrics.get(name) for name in METRICS},
        "alarms": [{"alarm": a.alarm, "at": a.at, "cleared": a.cleared} for a in loop.alarms],
        "modes": [{"at": m.at, "requested": m.requested, "mode": m.mode, "reason": m.reason} for m in loop.modes],
        "flags": dict(loop.flags),
        "unlisted": loop.unlisted,
    }
    if loop.autotune is not None:
        tuned = loop.autotune
        data["autotune"] = {
            "done": tuned["done"],
            "error": tuned["error"],
            "status": tuned["status"],
            "results": dict(tuned["results"]),
        }
    return data


def _finding(d: Diagnostic) -> dict[str, Any]:
    return {
        "code": d.code,
        "severity": d.severity.label,
        "message": d.message,
        "file": d.file,
        "line": d.span.line,
        "column": d.span.column,
        "path": d.where,
        "loop": d.loop,
        "plc_effect": d.plc_effect,
        "reference": d.reference,
        "help": d.help,
    }


def worst(outcomes: Sequence[Outcome]) -> Severity:
    """The most severe finding of all scenarios."""
    return max((d.severity for outcome in outcomes for d in outcome.findings), default=Severity.INFO)
