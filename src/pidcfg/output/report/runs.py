"""A scenario's run as a sheet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field

from pidcfg.output.report.content import (
    Expectation,
    Happening,
    OpenAlarm,
    RunSheet,
    StandingRow,
    Trend,
    Units,
    measurement_text,
    number,
    text,
)
from pidcfg.pictures import Chart
from pidcfg.pictures.page import figures
from pidcfg.sim.judgement.expect import UNITS as EXPECTATION_UNITS
from pidcfg.sim.judgement.meters import SWING_METRICS
from pidcfg.sim.judgement.report import LoopReport, Report, Tally, Verdict, flag_words
from pidcfg.text.frozen import frozen

METRIC_TITLES = {
    "overshoot": "Overshoot, %",
    "settling_time": "Settling time, s",
    "rise_time": "Rise time, s",
    "iae": "IAE",
    "ise": "ISE",
    "itae": "ITAE",
    "total_variation": "Total variation",
    "final_error": "Final error",
    "oscillation_period": "Oscillation period, s",
    "oscillation_amplitude": "Oscillation amplitude",
}
"""Integrals and errors are in the PV's unit, the total variation in the output's."""

METRIC_UNITS = {
    "iae": "{pv}·s",
    "ise": "{pv}²·s",
    "itae": "{pv}·s²",
    "final_error": "{pv}",
    "oscillation_amplitude": "{pv}",
    "total_variation": "{output}",
}
"""Units of metrics whose title has none, by those of the loop."""


GRAVE = ("not-judged", "proven", "not-proven", "failed")
"""Verdicts of a loop, the gravest last."""


@frozen
class Run:
    """What the command knows of one scenario; ``report`` None: it could not run."""

    file: str
    config: str
    report: Report | None = None
    passed: bool = False
    unjudged: bool = False
    """Whether a configuration with errors ran and nothing was expected of it."""
    title: str = ""
    charts: Sequence[Chart] = ()
    units: Mapping[str, Units] = field(default_factory=dict)
    before_root: Mapping[str, str] = field(default_factory=dict)
    """What the signals are of each loop that takes the root of its PV."""


def run_sheet(run: Run) -> RunSheet:
    """The sheet of one run, without its anchor."""
    report = run.report
    if report is None:
        verdict = "The scenario could not run; the findings say why."
        return RunSheet(run.file, run.config, run.title or run.file, ran=False, passed=False, verdict=verdict)
    return RunSheet(
        file=run.file,
        config=run.config,
        title=report.scenario,
        ran=True,
        passed=run.passed,
        verdict=verdict_of(run, report),
        facts=tuple(facts(report)),
        happenings=tuple(happenings(report)),
        units=run.units,
        open_alarms=tuple(open_alarms(report)),
        unlisted=sum(loop.unlisted for loop in report.loops.values()),
        metrics={name: loop.metrics for name, loop in report.loops.items()},
        metric_titles=titles(report),
        signals=tuple((name, seen.low, seen.high, seen.final) for name, seen in report.signals.items()),
        flags=tuple((name, on) for name, loop in report.loops.items() if (on := flags_on(loop))),
        autotunes=tuple(autotunes(report)),
        expectations=tuple(Expectation(v.text, v.passed, found_text(v, run.units)) for v in report.expectations),
        standing=tuple(StandingRow(v.loop, v.kind, v.word, v.at, v.why) for v in report.standing),
        in_control={name: loop.time_in_control for name, loop in report.loops.items()},
        duration=report.duration,
        pictures=figures(run.charts),
        worst=worst_trend(run, report),
        before_root=tuple(run.before_root.items()),
    )


def worst_trend(run: Run, report: Report) -> Trend | None:
    """The picture of the loop to look at first: the gravest verdict, then the largest overshoot."""

    def grade(chart: Chart) -> tuple[int, float]:
        loop = report.loops.get(chart.loop)
        return (0, 0.0) if loop is None else (GRAVE.index(loop.verdict), loop.metrics.get("overshoot") or 0.0)

    worst = max(run.charts, key=grade, default=None)
    return None if worst is None else Trend(grade(worst), figures([worst]))


def verdict_of(run: Run, report: Report) -> str:
    """One sentence on how it went."""
    total = len(report.expectations)
    failed = sum(not verdict.passed for verdict in report.expectations)
    tally = Tally.of(report.standing)
    if failed or tally.failed:
        written = f"{failed} of {total} expectations" if failed else ""
        standing = f"{tally.failed} of {tally.judged} always checked" if tally.failed else ""
        unproven = f"; {tally.unproven} not proven" if tally.unproven else ""
        return f"{', '.join(part for part in (written, standing) if part)} failed{unproven}."
    if run.unjudged:
        return "The configuration has errors, and nothing is expected of the run."
    if tally.unproven:
        return f"{tally.unproven} of {tally.judged} always checked not proven."
    if not run.passed:
        return f"There was an error in the run; {total} of {total} expectations passed."
    return f"{total} of {total} expectations, {tally.in_words()}."


def titles(report: Report) -> dict[str, str]:
    """The metrics that are worth a column."""
    swings = any(loop.metrics.get(key) is not None for loop in report.loops.values() for key in SWING_METRICS)
    return {key: title for key, title in METRIC_TITLES.items() if swings or key not in SWING_METRICS}


def facts(report: Report) -> Iterator[tuple[str, str]]:
    """How the run was made."""
    yield "Duration", f"{number(report.duration)} s"
    yield "Step", f"{number(report.step)} s"
    if report.settled is not None:
        yield "Before it", f"{number(report.settled)} s to the steady state"
    yield from report.plc_flags.items()
    if not report.running:
        yield "Loop task", "off: no loop is calculated"
    if report.scan_time is not None:
        low, typical, high = (f"{value * 1e3:.3f}" for value in report.scan_time)
        yield "Scan time", f"{typical} ms ({low} to {high} ms)"


def happenings(report: Report) -> list[Happening]:
    """Events, alarms, modes and remarks in the order of time."""
    rows = [Happening(event.at, event.loop or "", "event", event.text) for event in report.events]
    for name, loop in report.loops.items():
        for change in loop.modes:
            asked = "" if change.requested in {None, change.mode} else f" (requested {change.requested})"
            reason = f": {change.reason}" if change.reason else ""
            rows.append(Happening(change.at, name, "mode", f"{change.mode}{asked}{reason}"))
        rows += [Happening(alarm.at, name, "alarm", flag_words(alarm.alarm), alarm.cleared) for alarm in loop.alarms]
    rows += [
        Happening(note.at, note.loop or "", "error" if note.error else "note", note.text, error=note.error)
        for note in report.notes
    ]
    return sorted(rows, key=lambda row: row.at)


def open_alarms(report: Report) -> Iterator[OpenAlarm]:
    """The alarms that are on at the end."""
    for name, loop in report.loops.items():
        yield from (OpenAlarm(name, flag_words(one.alarm), one.at) for one in loop.alarms if one.cleared is None)


def flags_on(loop: LoopReport) -> str:
    """The flags that were on at any time."""
    return ", ".join(flag_words(flag) for flag, seen in loop.flags.items() if seen)


def autotunes(report: Report) -> Iterator[tuple[str, str, tuple[tuple[str, float], ...]]]:
    """What the auto-tunes found."""
    for name, loop in report.loops.items():
        if loop.autotune is not None:
            rule = f" ({loop.autotune['rule']})" if "rule" in loop.autotune else ""
            yield name, f"{loop.autotune['status']}{rule}", tuple(loop.autotune["results"].items())


def found_text(verdict: Verdict, units: Mapping[str, Units]) -> str:
    """What was measured for an expectation, with the unit of the metric or of the signal that it is about."""
    of_loop = units.get(verdict.loop or "")
    about = verdict.text.removeprefix(f"{verdict.loop} ").partition(" ")[0]
    unit = EXPECTATION_UNITS.get(about, "").strip() or metric_unit(about, of_loop)
    if of_loop is not None and not unit:
        unit = next((unit for name, unit in of_loop.signals.items() if verdict.text.startswith(f"{name} ")), "")
    number = isinstance(verdict.value, int | float | list | tuple) and not isinstance(verdict.value, bool)
    return f"{measured_text(verdict.value)} {unit if number else ''}".rstrip()


def metric_unit(metric: str, units: Units | None) -> str:
    """The unit of a metric that its title does not say; empty where the loop has none."""
    pattern = METRIC_UNITS.get(metric, "")
    side = "" if units is None else units.output if "{output}" in pattern else units.pv
    return pattern.format(pv=side, output=side) if side else ""


def measured_text(value: object) -> str:
    """What was measured, as text."""
    if isinstance(value, list | tuple):
        return " to ".join(measured_text(part) for part in value)
    if isinstance(value, float):
        return measurement_text(value)
    return "none" if value is None else text(value)
