"""One scenario run: what was read, what became of it, and the charts of what was recorded, also of two runs."""

from __future__ import annotations

from dataclasses import field, replace
from math import isfinite, nan
from typing import TYPE_CHECKING, Any

from pidcfg.pictures import Bar, Chart, Line, Mark, Panel, Strip
from pidcfg.sim.controllers.plc import axes_of, signals_of
from pidcfg.sim.engine.recording import OUTPUT_HIGH, OUTPUT_LOW
from pidcfg.sim.judgement.report import LOWER_FLAGS, UPPER_FLAGS, Alarm, flag_words
from pidcfg.text.diagnostics import Diagnostic, Severity, sort_findings
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import DISK, Reader

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from pidcfg.pictures import Role, Side
    from pidcfg.sim.controllers.plc import Axes
    from pidcfg.sim.engine.recording import Recording
    from pidcfg.sim.engine.run import Settings
    from pidcfg.sim.judgement.report import LoopReport, Period, Report, Verdict
    from pidcfg.study.scenario import LoadedScenario
    from pidcfg.text.document import Document

    Steps = Sequence[tuple[float, float]]
    """Times in s, each with the value from then on."""

# --- Lines in a trend at which its alarms come on and its output ends -------------------------------------------------

DEVIATION_PREFIX = "deviation"
"""Alarms with this beginning are distances from the set point."""
RATE_ALARM = "rate_of_change"
"""An alarm that has no place beside a PV."""


def alarm_lines(recording: Recording, loop: str, alarms: Sequence[str], setpoint: str, end: float) -> Iterator[Line]:
    """The level of each alarm until the end (s): one for a PV, two around the set point (a signal) for a distance."""
    for alarm in alarms:
        level = recording.levels.get((loop, alarm), ())
        if alarm.startswith(DEVIATION_PREFIX) and setpoint:
            centre = list(zip(*recording.signal(setpoint), strict=True))
            for side in (1.0, -1.0):
                yield from level_lines(flag_words(alarm), levels_around(centre, level, side), end)
        elif alarm != RATE_ALARM:
            yield from level_lines(flag_words(alarm), level, end)


def limit_lines(recording: Recording, loop: str, flags: Sequence[str], end: float) -> Iterator[Line]:
    """The limits of the output, where a flag says that it was at one."""
    for name, title, reasons in ((OUTPUT_HIGH, "upper limit", UPPER_FLAGS), (OUTPUT_LOW, "lower limit", LOWER_FLAGS)):
        if reasons & {*flags}:
            yield from level_lines(title, recording.levels.get((loop, name), ()), end)


def level_lines(title: str, steps: Steps, end: float) -> Iterator[Line]:
    """A level that holds its last value to the end; a line for each time without a gap."""
    times: list[float] = []
    values: list[float] = []
    for time, value in (*steps, (end, nan)):
        if values:
            times.append(time)
            values.append(value if isfinite(value) else values[-1])
        elif isfinite(value):
            times, values = [time], [value]
        if values and not isfinite(value):
            yield Line(title, "level", times, values)
            times, values = [], []


def levels_around(centre: Steps, distance: Steps, side: float) -> list[tuple[float, float]]:
    """What is a distance away from a centre, whenever either changes."""
    rows: list[tuple[float, float]] = []
    centre_now = distance_now = nan
    for time, kind, value in sorted([(t, 0, v) for t, v in centre] + [(t, 1, v) for t, v in distance]):
        centre_now, distance_now = (value, distance_now) if kind == 0 else (centre_now, value)
        row = centre_now + side * distance_now
        if rows and rows[-1][0] == time:
            rows[-1] = (time, row)
        elif not rows or repr(rows[-1][1]) != repr(row):
            rows.append((time, row))
    return rows


# --- Charts of a run: what was recorded of it, and what its report says happened --------------------------------------

MAX_STATE_ROWS = 8
"""Alarms and flags of a loop that get a row each."""


def charts_of(outcome: Outcome, loops: Collection[str] = ()) -> list[Chart]:
    """One chart a loop, in the order of the PLC; ``loops``: only these.

    Nothing for a scenario that could not run or was not recorded.
    """
    report, recording = outcome.report, outcome.recording
    if report is None or recording is None:
        return []
    return [
        _loop_chart(loop, loop_report, outcome.axes[loop], report, recording)
        for loop, loop_report in report.loops.items()
        if not loops or loop in loops
    ]


def signals_before_root(outcome: Outcome) -> dict[str, str]:
    """What PV and set point are of each loop that takes the root of its PV."""
    remarks = {}
    for loop, axes in outcome.axes.items():
        setpoint = outcome.report.signals.get(axes.setpoint) if outcome.report is not None else None
        if axes.root is not None and setpoint is not None:
            remarks[loop] = axes.root.remark(axes.setpoint.rpartition(".")[2], setpoint.final, axes.pv_unit)
    return remarks


def _loop_chart(loop: str, loop_report: LoopReport, axes: Axes, report: Report, recording: Recording) -> Chart:
    marks, notes = find_failures(loop, report)
    events = [
        Mark(event.text if event.loop in {loop, None} else f"{event.loop}: {event.text}", event.at)
        for event in report.events
        if event.loop in {loop, None} or event.loop not in report.loops
    ]
    return Chart(
        title=f"{loop}: {axes.description}" if axes.description else loop,
        loop=loop,
        panels=loop_panels(axes, recording, loop, loop_report, report.duration),
        strips=state_strips(loop_report, report.duration),
        marks=(*events, *marks),
        begin=0.0,
        end=report.duration,
        notes=(*root_notes(axes, recording), *notes),
    )


def root_notes(axes: Axes, recording: Recording) -> tuple[str, ...]:
    """What the signals of a loop that takes the root of its PV are; nothing for another loop."""
    if axes.root is None or not axes.setpoint:
        return ()
    _, values = recording.signal(axes.setpoint)
    if not values:
        return ()
    return (axes.root.remark(axes.setpoint.rpartition(".")[2], float(values[-1]), axes.pv_unit),)


def loop_panels(axes: Axes, recording: Recording, loop: str, report: LoopReport, end: float) -> tuple[Panel, ...]:
    """PV and set point on one axis, the output on its own, each with the levels that bars below refer to."""
    signals: tuple[tuple[str, Role], ...] = ((axes.setpoint, "setpoint"), (axes.pv, "pv"))
    lines = [signal_line(recording, name, role) for name, role in signals if name]
    title = ", ".join(reversed([line.name for line in lines]))
    lines += alarm_lines(recording, loop, names_of(report.alarms), axes.setpoint, end)
    rows = [Panel(title, axes.pv_unit, tuple(lines))]
    if axes.root is not None:
        rows = [Panel(f"{title} before the root", "", tuple(lines))]
    if axes.output:
        output = signal_line(recording, axes.output, "output")
        limits = limit_lines(recording, loop, names_of(report.conditions), end)
        rows.append(Panel(output.name, axes.output_unit, (output, *limits), axes.output_range))
    return tuple(rows)


def signal_line(recording: Recording, signal: str, role: Role, side: Side | None = None) -> Line:
    """One signal, called as the vendor does: TIC-101.PV is PV."""
    times, values = recording.signal(signal)
    return Line(signal.rpartition(".")[2], role, times, values, side)


def state_strips(report: LoopReport, end: float) -> tuple[Strip, ...]:
    """Modes, then each alarm and flag that was on, then the steps of a profile."""
    spans = [(flag_words(period.alarm), period.at, period.cleared) for period in report.alarms]
    rows = [Strip("mode", mode_strip(report, end), "mode"), *_state_strips(spans, end, "alarm")]
    if report.steps:
        rows.append(Strip("ramp/soak", tuple(_step_bar(step, end) for step in report.steps), "step"))
    rows += _state_strips(
        [(flag_words(period.name), period.at, period.until) for period in report.conditions], end, "condition"
    )
    return tuple(rows)


def names_of(spans: Sequence[Alarm] | Sequence[Period]) -> list[str]:
    """The alarms or flags that have a row."""
    return list(dict.fromkeys(span.alarm if isinstance(span, Alarm) else span.name for span in spans))[:MAX_STATE_ROWS]


def mode_strip(report: LoopReport, end: float) -> tuple[Bar, ...]:
    """One bar for each time in a mode; a refusal changes none."""
    bars, mode, since = [], report.first_mode, 0.0
    for change in report.modes:
        if change.mode != mode:
            bars.append(Bar(mode, since, change.at))
            mode, since = change.mode, change.at
    bars.append(Bar(mode, since, end))
    return tuple(bar for bar in bars if bar.end > bar.begin)


def _step_bar(step: Period, end: float) -> Bar:
    return Bar(step.name, step.at, end if step.until is None else step.until)


def _state_strips(spans: Sequence[tuple[str, float, float | None]], end: float, kind: Any) -> list[Strip]:
    """A row for each name, in the order in which they first came on."""
    names = list(dict.fromkeys(name for name, _, _ in spans))
    return [
        Strip(name, tuple(Bar(name, at, end if off is None else off) for row, at, off in spans if row == name), kind)
        for name in names[:MAX_STATE_ROWS]
    ]


def find_failures(loop: str, report: Report) -> tuple[list[Mark], tuple[str, ...]]:
    """Failed expectations of a loop, written and standing: marks where they are about a time, else lines of text."""
    failed = [
        (_verdict_text(verdict), verdict.at)
        for verdict in report.expectations
        if verdict.loop == loop and not verdict.passed
    ]
    failed += [
        (f"{verdict.kind}: {verdict.text}", verdict.at)
        for verdict in report.standing
        if verdict.loop == loop and verdict.fails
    ]
    marks = [Mark(text, at, "failure") for text, at in failed if at is not None]
    return marks, tuple(f"failed: {text}" for text, at in failed if at is None)


def _verdict_text(verdict: Verdict) -> str:
    value = (
        ""
        if verdict.value is None
        else f" ({verdict.value:g})"
        if isinstance(verdict.value, float)
        else f" ({verdict.value})"
    )
    return f"{verdict.text}{value}"


# --- One scenario run: what was read, what became of it, and whether that is what was expected ------------------------

LOOP_COST = 10.0
"""About what a loop-step takes in CPython with everything around it, in µs."""


@frozen
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
    reference: str = ""
    """The file of the accepted run that it was held against."""
    accepted_text: str | None = None
    """The text of the file that it was to be accepted as; None: it was not, or has failed."""

    @property
    def lacks_expectations(self) -> bool:
        """Whether a configuration with errors ran and nothing was expected of it."""
        return self.config_errors and self.report is not None and not self.report.expectations

    @property
    def estimated_cost(self) -> float:
        """What the run has taken, in µs by a count of its loop-steps; compiled ones are next to nothing."""
        report = self.report
        return 0.0 if report is None or report.engine != "python" else report.steps * len(report.loops) * LOOP_COST

    @property
    def passed(self) -> bool:
        """Whether it ran and everything expected of it holds."""
        return self.report is not None and self.report.passed and not self.lacks_expectations


def simulate_document(
    doc: Document,
    settings: Settings,
    reader: Reader = DISK,
    *,
    record: bool = False,
    reference_file: tuple[bytes, str] | None = None,
    accept_as: str | None = None,
) -> Outcome:
    """Runs one scenario file; ``record``: with the trend of its loops, for `pidcfg.study.outcome.charts_of`.

    ``reference_file``: an accepted run, its content and name, in the place of the scenario's ``reference``.
    ``accept_as``: the name of the file that this run is to be accepted as, which takes the place of either.
    """
    from pidcfg.study.scenario import load_scenario
    from pidcfg.validate.engine import is_scenario

    if doc.data is not None and not is_scenario(doc):
        cure = "a scenario begins with 'scenario: …' and names its configuration"
        finding = Diagnostic("PID032", Severity.ERROR, "the file is no scenario", doc.file, help=cure)
        return Outcome(doc.file, findings=[finding], documents={doc.file: doc})
    return simulate_loaded(
        load_scenario(doc, reader), settings, record=record, reference_file=reference_file, accept_as=accept_as
    )


def simulate_loaded(
    loaded: LoadedScenario,
    settings: Settings,
    *,
    record: bool = False,
    reference_file: tuple[bytes, str] | None = None,
    accept_as: str | None = None,
) -> Outcome:
    """Runs a scenario with everything that it needs, as far as that could be loaded; see `simulate_document`."""
    from pidcfg.sim.engine.recording import Recording
    from pidcfg.sim.engine.run import UnusableError, simulate

    outcome = Outcome(loaded.document.file, loaded.config, documents=loaded.documents)
    if loaded.scenario is None or loaded.image is None:
        return replace(outcome, findings=loaded.findings)
    plc = loaded.new_plc()
    _, problems = loaded.uncertainties(plc)
    loaded.add_problems(problems)
    scenario, reference = loaded.scenario, None
    if accept_as is None and (reference_file is not None or scenario.reference is not None):
        from pidcfg.study.accepted import reference_of

        reference = reference_of(loaded.document, scenario, plc.loops, loaded.reader, reference_file)
        outcome = replace(outcome, reference=reference.name)
        if reference.run is None:
            return replace(outcome, findings=sort_findings([*loaded.findings, *reference.findings]))
    if any(problem.severity == "error" for problem in problems):
        return replace(outcome, findings=loaded.findings)
    axes = axes_of(plc, loaded.image.settings)
    recording = Recording(signals_of(axes)) if record else None
    try:
        report = simulate(scenario, loaded.new_plc, loaded.controller, replace(settings, recording=recording))
    except UnusableError as error:
        loaded.add_problems(error.problems)
        return replace(outcome, findings=loaded.findings)
    loaded.add_problems(report.problems)
    outcome = replace(
        outcome,
        report=report,
        findings=[*loaded.findings, *loaded.config_errors],
        config_errors=bool(loaded.config_errors),
        recording=recording,
        axes=axes,
    )
    if reference is None and accept_as is None:
        return outcome
    from pidcfg.study.accepted import accepted_text, compare_with_accepted, run_of_report

    run = run_of_report(report, axes, scenario)
    old_run = run if reference is None or reference.run is None else reference.run
    compare_with_accepted(report, old_run, run, outcome.reference or str(accept_as))
    return replace(outcome, accepted_text=accepted_text(run)) if accept_as is not None and outcome.passed else outcome


# --- Charts of two runs of the same loops laid over each other: as it was, and as it is now ---------------------------


def overlay_charts(before: Outcome, after: Outcome, names: tuple[str, str], loops: Collection[str] = ()) -> list[Chart]:
    """The charts of a run, with the lines of another one of the same loops behind them, and what lasted otherwise."""
    old = {chart.loop: chart for chart in charts_of(before)}
    return [
        _overlay_chart(old[chart.loop], chart, names) if chart.loop in old else chart
        for chart in charts_of(after, loops)
    ]


def _overlay_chart(before: Chart, after: Chart, names: tuple[str, str]) -> Chart:
    """One chart of two runs; levels and marks are those of the second. Nobody expects a reference of it."""
    from pidcfg.sim.judgement.control import NO_REFERENCE_TEXT

    panels = []
    for i, panel in enumerate(after.panels):
        lines_after = [replace(line, side=None if line.role == "level" else "after") for line in panel.lines]
        lines_by_name = {line.name: line for line in lines_after if line.role != "level"}
        lines_before = before.panels[i].lines if i < len(before.panels) else ()
        lines = [
            replace(line, side="before")
            for line in lines_before
            if _needs_second_line(line, lines_by_name.get(line.name))
        ]
        panels.append(replace(panel, lines=(*lines, *lines_after)))
    rows = {(strip.kind, strip.title): strip for strip in after.strips}
    others = [
        replace(strip, title=f"{strip.title}, {names[0]}")
        for strip in before.strips
        if not _is_same_strip(strip, rows.get((strip.kind, strip.title)))
    ]
    notes = tuple(note for note in after.notes if NO_REFERENCE_TEXT not in note)
    return replace(after, panels=tuple(panels), strips=(*after.strips, *others), notes=notes, sides=names)


def _is_same_strip(strip: Strip, other: Strip | None) -> bool:
    """Whether a row would show the same again; modes are the same in the same order."""
    if strip.kind == "mode" and other is not None:
        return [bar.label for bar in strip.bars] == [bar.label for bar in other.bars]
    return strip == other


def _needs_second_line(line: Line, other: Line | None) -> bool:
    """Whether a signal is worth a second line: PV and output are, a set point that went another way."""
    if line.role == "level" or other is None:
        return False
    return line.role != "setpoint" or [*line.values] != [*other.values]
