"""The commissioning report: what it says, as data; values as people read them; a run as a sheet of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from math import floor, isfinite, log10
from typing import Literal

from pidcfg.encoders.image import Block, Encoding
from pidcfg.encoders.regmap import Word
from pidcfg.output.explanation.page import is_on_raw_signal, raw_signal_share
from pidcfg.pictures import Chart
from pidcfg.pictures.page import render_figures
from pidcfg.schemas.base import Duration, Quantity
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.numbers import decimal_text
from pidcfg.sim.judgement.expect import UNITS as EXPECTATION_UNITS
from pidcfg.sim.judgement.meters import SWING_METRICS
from pidcfg.sim.judgement.report import VERDICT_WORDS, LoopReport, Report, Tally, Verdict, flag_words
from pidcfg.text.diagnostics import Diagnostic, Severity
from pidcfg.text.frozen import frozen

# --- What a commissioning report says, as data: the page, the CSV files and the workbook read the same ----------------

Value = str | int | float | Decimal | bool | None
"""What a cell holds: numbers stay numbers until they are written."""
Owner = Literal["setting", "request", "status", "reserved"]
"""Who owns a word or bit: the engineer, a momentary request, the controller, nobody."""
COMPARED_OWNERS = {"setting", "request"}
"""Whose contents are those of the configuration as long as nobody changes them."""


@frozen
class Title:
    """The title block; nothing in it comes from the clock or the computer."""

    title: str
    project: str | None = None
    customer: str | None = None
    plant: str | None = None
    document: str | None = None
    revision: str | None = None
    author: str | None = None
    date: str | None = None
    version: str = ""
    """Of pidcfg."""


@frozen
class SourceFile:
    """A file that the report was made from."""

    name: str
    kind: str
    size: int
    """In bytes."""
    sha256: str


@frozen
class Setting:
    """A value of a configuration in engineering units."""

    path: str
    value: Value
    unit: str
    meaning: str
    is_given: bool
    """Whether the file says it; otherwise it is the default."""
    place: str = ""
    """Where the PLC holds it."""


@frozen
class Group:
    """Settings of one section of a configuration."""

    key: str
    title: str
    settings: tuple[Setting, ...]


@frozen
class Bit:
    """One choice inside a bit word."""

    bits: str
    state: str
    value: str
    meaning: str
    owner: Owner


@frozen
class Register:
    """A register with its content; a run of reserved ones stands as one."""

    address: str
    name: str
    hex: str
    decimal: Value
    value: Value
    unit: str
    meaning: str
    owner: Owner
    bits: tuple[Bit, ...] = ()
    writer: str = ""
    """Who writes it, where it is no setting."""
    has_number: bool = True
    """Whether its decimal number says something: not of BCD digits, bits and addresses."""


@frozen
class RegisterBlock:
    """Registers that stand together."""

    title: str
    registers: tuple[Register, ...]


def contents_of(blocks: Sequence[RegisterBlock]) -> dict[str, str]:
    """What an engineer compares with the PLC, by address: four digits where words are BCD, numbers elsewhere."""
    rows = [register for block in blocks for register in block.registers]
    digits = not all(row.has_number for row in rows)
    return {row.address: row.hex if digits else f"{row.decimal:g}" for row in rows if row.owner in COMPARED_OWNERS}


@frozen
class Parameter:
    """A named parameter with its content, or the expression that it is wired to."""

    name: str
    type: str
    content: str
    unit: str
    meaning: str
    device: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """What a loop and a PLC have in common."""

    name: str
    description: str
    anchor: str = ""
    """What links lead to: known once its place in the report is."""
    groups: tuple[Group, ...] = ()
    blocks: tuple[RegisterBlock, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    unstored: tuple[tuple[str, str], ...] = ()
    """What no register holds."""


@frozen
class Fact:
    """Something that a reader looks for first; ``place``: where the PLC holds it, with what stands there."""

    title: str
    text: str
    place: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopSheet(Sheet):
    """Everything about one loop of a configuration."""

    facts: tuple[Fact, ...]
    """Mode, ranges, direction, set point, the three terms, pulses."""
    findings: tuple[Diagnostic, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlcSheet(Sheet):
    """One configuration: what holds for the PLC, and its loops."""

    file: str
    vendor: str
    checklist: tuple[str, ...] = ()
    loops: tuple[LoopSheet, ...] = ()


@frozen
class Content:
    """The whole report."""

    title: Title
    files: tuple[SourceFile, ...]
    plcs: tuple[PlcSheet, ...]
    runs: tuple[RunSheet, ...]
    findings: tuple[Diagnostic, ...]

    @property
    def loops(self) -> tuple[tuple[PlcSheet, LoopSheet], ...]:
        """Every loop with its configuration."""
        return tuple((plc, loop) for plc in self.plcs for loop in plc.loops)

    @property
    def vendors(self) -> tuple[str, ...]:
        """The PLC families."""
        return tuple(dict.fromkeys(plc.vendor for plc in self.plcs))

    @property
    def verdicts(self) -> tuple[int, int]:
        """Expectations that hold, and all."""
        expectations = [expectation for run in self.runs for expectation in run.expectations]
        return sum(expectation.passed for expectation in expectations), len(expectations)

    @property
    def worst_run(self) -> RunSheet | None:
        """The run with the trend to look at first."""
        graded = [(run.worst_trend.urgency, run) for run in self.runs if run.worst_trend is not None]
        return max(graded, key=lambda pair: pair[0])[1] if graded else None

    @property
    def verdict(self) -> tuple[str, str]:
        """``passed``, ``FAILED`` or ``NOT PROVEN`` (empty: nothing ran), and why."""
        errors = sum(d.severity is Severity.ERROR for d in self.findings)
        not_passed, count = sum(not run.passed for run in self.runs), len(self.runs)
        runs_text = f"{not_passed} of {count} run{'' if count == 1 else 's'}"
        if not_passed and not errors and all(run.verdict_word != "FAILED" for run in self.runs):
            return "NOT PROVEN", f"{runs_text} not proven"
        faults = [f"{errors} error{'' if errors == 1 else 's'}"] if errors else []
        faults += [f"{runs_text} not passed"] if not_passed else []
        if faults:
            return "FAILED", ", ".join(faults)
        if not count:
            return "", "No errors; nothing was run."
        return "passed", f"no errors, {'the run' if count == 1 else f'all {count} runs'} passed"

    @property
    def standing(self) -> dict[str, int]:
        """How many standing expectations have which verdict."""
        return {word: sum(run.count(word) for run in self.runs) for word in (*VERDICT_WORDS.values(), "allowed")}


# --- What a commissioning report says about a run, as data ------------------------------------------------------------


@frozen
class RunEvent:
    """Something of a run: an event, an alarm, a mode, a remark."""

    at: float
    loop: str
    kind: str
    text: str
    until: float | None = None
    error: bool = False


@frozen
class OpenAlarm:
    """An alarm that is on at the end of a run."""

    loop: str
    alarm: str
    at: float
    """Since when, in s."""


@frozen
class Units:
    """What the PV and the output of a loop are counted in; empty: nobody says."""

    pv: str = ""
    output: str = ""
    signals: Mapping[str, str] = field(default_factory=dict)
    """Of the loop's signals, by their names."""


@frozen
class Expectation:
    """What was expected of a run, and what came."""

    text: str
    passed: bool
    value: str


@frozen
class StandingRow:
    """A standing expectation of a run: what is expected of every loop, whether the scenario says so or not."""

    loop: str
    """Empty: the PLC."""
    kind: str
    verdict: str
    """``passed``, ``FAILED``, ``NOT PROVEN``, ``allowed``, or ``not judged``."""
    at: float | None
    """Since when, in s."""
    text: str


@frozen
class Trend:
    """A picture as a part of a page; ``urgency``: how urgently a reader looks at it."""

    urgency: tuple[int, float]
    picture: str


@frozen
class RunSheet:
    """One scenario's run; without facts it could not run, and the findings say why."""

    file: str
    config: str
    title: str
    has_run: bool
    passed: bool
    verdict: str
    anchor: str = ""
    """What links lead to: known once its place in the report is."""
    facts: tuple[tuple[str, str], ...] = ()
    events: tuple[RunEvent, ...] = ()
    unlisted_changes: int = 0
    """Changes of modes and alarms that the run has counted only."""
    metrics: Mapping[str, Mapping[str, float | None]] = field(default_factory=dict)
    metric_titles: Mapping[str, str] = field(default_factory=dict)
    """The columns of the metrics; those of swings only where a loop swings."""
    units: Mapping[str, Units] = field(default_factory=dict)
    """Of each loop."""
    open_alarms: tuple[OpenAlarm, ...] = ()
    root_loops: tuple[tuple[str, str], ...] = ()
    """Loops that take the root of their PV, and what their signals are."""
    signals: tuple[tuple[str, float, float, float], ...] = ()
    flags: tuple[tuple[str, str], ...] = ()
    """Loops and the flags that were on at any time."""
    autotunes: tuple[tuple[str, str, tuple[tuple[str, float], ...]], ...] = ()
    """Loop, status and the gains found."""
    expectations: tuple[Expectation, ...] = ()
    standing: tuple[StandingRow, ...] = ()
    time_in_control: Mapping[str, float] = field(default_factory=dict)
    """How long each loop was in Auto or Cascade, in s."""
    duration: float = 0.0
    """In s."""
    pictures: str = ""
    """The trends, as a part of a page."""
    worst_trend: Trend | None = None
    """That of the loop to look at first."""

    @property
    def signal_units(self) -> dict[str, str]:
        """The units of the loops' signals, by their names."""
        return {name: unit for units in self.units.values() for name, unit in units.signals.items()}

    @property
    def verdict_word(self) -> str:
        """``passed``, ``FAILED``, or ``NOT PROVEN`` where nothing has failed."""
        if self.passed:
            return "passed"
        failed = self.count("FAILED") or not all(expectation.passed for expectation in self.expectations)
        return "NOT PROVEN" if self.count("NOT PROVEN") and not failed else "FAILED"

    def count(self, verdict: str) -> int:
        """How many standing expectations have this verdict."""
        return sum(row.verdict == verdict for row in self.standing)

    @property
    def judged_count(self) -> int:
        """How many standing expectations are judged."""
        return len(self.standing) - self.count("not judged")

    @property
    def open_rows(self) -> tuple[tuple[str, str, tuple[str, ...], float | None, str], ...]:
        """What does not simply hold: verdict, loop, kinds for the same reason, since when, why."""
        rows: dict[tuple[str, str, float | None, str], list[str]] = {}
        for row in self.standing:
            if row.verdict != "passed":
                rows.setdefault((row.verdict, row.loop, row.at, row.text), []).append(row.kind)
        return tuple(
            (verdict, loop, self._shorten_kinds(kinds), at, why) for (verdict, loop, at, why), kinds in rows.items()
        )

    @property
    def unjudged_rows(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """Loops with standing expectations that are not judged, and which."""
        rows: dict[str, list[str]] = {}
        for row in self.standing:
            if row.verdict == "not judged":
                rows.setdefault(row.loop, []).append(row.kind)
        return tuple((loop, self._shorten_kinds(kinds)) for loop, kinds in rows.items())

    def _shorten_kinds(self, kinds: Sequence[str]) -> tuple[str, ...]:
        """Kinds of a loop; all of them are the loop as a whole."""
        return tuple(kinds) if len(kinds) < len({row.kind for row in self.standing}) else ("as a whole",)


# --- Values as people read them, and units in the words of the loop ---------------------------------------------------

UNITS_OF_SIDES = {"pv": "PV unit", "output": "output unit"}
"""What stands for the unit of a side that has none."""
TINY, THOUSANDTH, THOUSAND, HUNDRED_THOUSAND, MILLION, HUGE = 1e-15, 1e-3, 1e3, 1e5, 1e6, 1e15
SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def cell_value(value: object) -> Value:
    """A value of a model as a cell: numbers, truths and texts stay what they are."""
    if value is None or isinstance(value, bool | int | float | Decimal):
        return value
    if isinstance(value, Quantity | Duration):
        return value.value
    if isinstance(value, Wire):
        return f":= {value.text}"
    if isinstance(value, tuple) and type(value) is tuple:
        is_counts = all(isinstance(part, Quantity) and part.counts for part in value)
        return " to ".join(cell_text(part.value if is_counts else part) for part in value)
    return str(value)


def cell_text(value: object) -> str:
    """A cell, or a value that becomes one, as text."""
    if isinstance(value, Quantity) and value.counts:
        return str(value)
    value = cell_value(value)
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Decimal):
        return decimal_text(value)
    return number_text(value) if isinstance(value, float) else str(value)


def number_text(value: float) -> str:
    """The shortest decimal that means this number, all digits in sight unless there would be more than fifteen."""
    if value and not TINY <= abs(value) < HUGE:
        return repr(value)
    return decimal_text(Decimal(repr(value)))


def measurement_text(value: float) -> str:
    """A number that was measured, in engineering digits: five of them, or all before the point up to a million.

    Beyond, and below a thousandth, with a power of ten whose exponent is a multiple of three: 4.1471×10⁹.
    """
    if value and isfinite(value) and not THOUSANDTH <= abs(value) < MILLION:
        exponent = 3 * (floor(log10(abs(value))) // 3)
        mantissa = float(f"{Decimal(value).scaleb(-exponent):.5g}")
        if abs(mantissa) >= THOUSAND:
            exponent, mantissa = exponent + 3, mantissa / THOUSAND
        return f"{mantissa:g}×10{str(exponent).translate(SUPERSCRIPTS)}"
    return number_text(float(f"{value:.5g}" if abs(value) < HUNDRED_THOUSAND else f"{value:.0f}"))


# --- Words about a PV of which the loop takes the root: they are compared with the signal before it -------------------

SIGNAL_SHARE_UNIT = "% of the signal before the root"


@frozen
class SignalShare:
    """What a word means there: a share of the signal, and the PV at which the signal has it (None: a difference)."""

    percent: Decimal
    value: Decimal | None
    time_unit: str = ""
    """What a change is counted in: ``sample``."""

    @property
    def unit(self) -> str:
        """The unit of the share."""
        return f"{SIGNAL_SHARE_UNIT} per {self.time_unit}" if self.time_unit else SIGNAL_SHARE_UNIT

    def pv_clause(self, unit: str) -> str:
        """Where the PV is then, as a clause; empty for a difference."""
        return "" if self.value is None else f"reached at {self.value:.4g} {unit}".rstrip()


def signal_share_of(word: Word, block: Block, raw: int) -> SignalShare | None:
    """A content before the root; None where the word is about something else."""
    if not is_on_raw_signal(word, block.scales):
        return None
    percent, value = raw_signal_share(word, raw, block.scales)
    return SignalShare(round(percent, 2), value, word.unit.partition("/")[2])


def loop_words(encoding: Encoding, loop: int) -> Iterator[tuple[Block, Word, int]]:
    """The registers of a loop's own blocks, by its number, with their contents."""
    memory = encoding.image.words
    for block in encoding.blocks:
        if block.path == ("loops", loop):
            yield from ((block, word, memory.get(block.start + word.offset, 0)) for word in block.table.words)


def signal_shares(encoding: Encoding, loop: int) -> dict[str, SignalShare]:
    """The settings of a loop, by its number, that are compared with the signal before the root."""
    by_path = ((word.path, signal_share_of(word, block, raw)) for block, word, raw in loop_words(encoding, loop))
    return {path: share for path, share in by_path if path is not None and share is not None}


def add_shares(groups: tuple[Group, ...], shares: Mapping[str, SignalShare], unit: str) -> tuple[Group, ...]:
    """The settings with what they mean before the root; ``unit``: that of the PV."""
    return tuple(
        replace(group, settings=tuple(_with_share(s, shares.get(s.path), unit) for s in group.settings))
        for group in groups
    )


def _with_share(setting: Setting, share: SignalShare | None, unit: str) -> Setting:
    if share is None:
        return setting
    pv_text = share.pv_clause(unit)
    unit_text = f"{setting.unit} of a linear PV" if setting.unit == unit else setting.unit
    per_text = f" per {share.time_unit}" if share.time_unit else ""
    meaning = f"{setting.meaning} LoopComparison with the signal before the root: {share.percent} % of it{per_text}"
    return replace(setting, unit=unit_text, meaning=f"{meaning}{f', {pv_text}' if pv_text else ''}.")


# --- A scenario's run as a sheet --------------------------------------------------------------------------------------

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
GRAVITY_ORDER = ("not-judged", "proven", "not-proven", "failed")
"""Verdicts of a loop, the gravest last."""


@frozen
class Run:
    """What the command knows of one scenario; ``report`` None: it could not run."""

    file: str
    config: str
    report: Report | None = None
    passed: bool = False
    lacks_expectations: bool = False
    """Whether a configuration with errors ran and nothing was expected of it."""
    title: str = ""
    charts: Sequence[Chart] = ()
    units: Mapping[str, Units] = field(default_factory=dict)
    root_signals: Mapping[str, str] = field(default_factory=dict)
    """What the signals are of each loop that takes the root of its PV."""


def run_sheet(run: Run) -> RunSheet:
    """The sheet of one run, without its anchor."""
    report = run.report
    if report is None:
        verdict = "The scenario could not run; the findings say why."
        return RunSheet(run.file, run.config, run.title or run.file, has_run=False, passed=False, verdict=verdict)
    return RunSheet(
        file=run.file,
        config=run.config,
        title=report.scenario,
        has_run=True,
        passed=run.passed,
        verdict=verdict_of(run, report),
        facts=tuple(run_facts(report)),
        events=tuple(run_events(report)),
        units=run.units,
        open_alarms=tuple(open_alarms(report)),
        unlisted_changes=sum(loop.unlisted for loop in report.loops.values()),
        metrics={name: loop.metrics for name, loop in report.loops.items()},
        metric_titles=metric_titles(report),
        signals=tuple((name, seen.low, seen.high, seen.final) for name, seen in report.signals.items()),
        flags=tuple((name, on) for name, loop in report.loops.items() if (on := flags_on(loop))),
        autotunes=tuple(autotune_rows(report)),
        expectations=tuple(Expectation(v.text, v.passed, measured_quantity(v, run.units)) for v in report.expectations),
        standing=tuple(StandingRow(v.loop, v.kind, v.word, v.at, v.why) for v in report.standing),
        time_in_control={name: loop.time_in_control for name, loop in report.loops.items()},
        duration=report.duration,
        pictures=render_figures(run.charts),
        worst_trend=worst_trend(run, report),
        root_loops=tuple(run.root_signals.items()),
    )


def worst_trend(run: Run, report: Report) -> Trend | None:
    """The picture of the loop to look at first: the gravest verdict, then the largest overshoot."""

    def grade(chart: Chart) -> tuple[int, float]:
        loop = report.loops.get(chart.loop)
        return (0, 0.0) if loop is None else (GRAVITY_ORDER.index(loop.verdict), loop.metrics.get("overshoot") or 0.0)

    worst = max(run.charts, key=grade, default=None)
    return None if worst is None else Trend(grade(worst), render_figures([worst]))


def verdict_of(run: Run, report: Report) -> str:
    """One sentence on how it went."""
    total = len(report.expectations)
    failed = sum(not verdict.passed for verdict in report.expectations)
    tally = Tally.count(report.standing)
    if failed or tally.failed:
        expected_text = f"{failed} of {total} expectations" if failed else ""
        standing_text = f"{tally.failed} of {tally.judged_count} always checked" if tally.failed else ""
        unproven_text = f"; {tally.unproven} not proven" if tally.unproven else ""
        return f"{', '.join(part for part in (expected_text, standing_text) if part)} failed{unproven_text}."
    if run.lacks_expectations:
        return "The configuration has errors, and nothing is expected of the run."
    if tally.unproven:
        return f"{tally.unproven} of {tally.judged_count} always checked not proven."
    if not run.passed:
        return f"There was an error in the run; {total} of {total} expectations passed."
    return f"{total} of {total} expectations, {tally.summary_text()}."


def metric_titles(report: Report) -> dict[str, str]:
    """The metrics that are worth a column."""
    has_swings = any(loop.metrics.get(key) is not None for loop in report.loops.values() for key in SWING_METRICS)
    return {key: title for key, title in METRIC_TITLES.items() if has_swings or key not in SWING_METRICS}


def run_facts(report: Report) -> Iterator[tuple[str, str]]:
    """How the run was made."""
    yield "Duration", f"{number_text(report.duration)} s"
    yield "Step", f"{number_text(report.step)} s"
    if report.settled is not None:
        yield "Before it", f"{number_text(report.settled)} s to the steady state"
    yield from report.plc_flags.items()
    if not report.running:
        yield "Loop task", "off: no loop is calculated"
    if report.scan_time is not None:
        low, typical, high = (f"{value * 1e3:.3f}" for value in report.scan_time)
        yield "Scan time", f"{typical} ms ({low} to {high} ms)"


def run_events(report: Report) -> list[RunEvent]:
    """Events, alarms, modes and remarks in the order of time."""
    rows = [RunEvent(event.at, event.loop or "", "event", event.text) for event in report.events]
    for name, loop in report.loops.items():
        for change in loop.modes:
            requested = "" if change.requested in {None, change.mode} else f" (requested {change.requested})"
            reason = f": {change.reason}" if change.reason else ""
            rows.append(RunEvent(change.at, name, "mode", f"{change.mode}{requested}{reason}"))
        rows += [RunEvent(alarm.at, name, "alarm", flag_words(alarm.alarm), alarm.cleared) for alarm in loop.alarms]
    rows += [
        RunEvent(note.at, note.loop or "", "error" if note.error else "note", note.text, error=note.error)
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


def autotune_rows(report: Report) -> Iterator[tuple[str, str, tuple[tuple[str, float], ...]]]:
    """What the auto-tunes found."""
    for name, loop in report.loops.items():
        if loop.autotune is not None:
            rule = f" ({loop.autotune['rule']})" if "rule" in loop.autotune else ""
            yield name, f"{loop.autotune['status']}{rule}", tuple(loop.autotune["results"].items())


def measured_quantity(verdict: Verdict, units: Mapping[str, Units]) -> str:
    """What was measured for an expectation, with the unit of the metric or of the signal that it is about."""
    loop_units = units.get(verdict.loop or "")
    metric = verdict.text.removeprefix(f"{verdict.loop} ").partition(" ")[0]
    unit = EXPECTATION_UNITS.get(metric, "").strip() or metric_unit(metric, loop_units)
    if loop_units is not None and not unit:
        unit = next((unit for name, unit in loop_units.signals.items() if verdict.text.startswith(f"{name} ")), "")
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
    return "none" if value is None else cell_text(value)
