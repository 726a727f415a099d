"""Runs as text and JSON, and all that JUnit tells."""

from __future__ import annotations

import re
from collections import Counter
from decimal import Decimal
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from pidcfg.cli.formats import Format, Kind, load_format, render_findings
from pidcfg.cli.formats.findings import Findings, display_name, finding_lines, findings_text
from pidcfg.output.runs import runs_data, signal_rows
from pidcfg.sim.judgement.meters import METRICS, SWING_METRICS
from pidcfg.sim.judgement.report import ACCEPTED_KIND, ASSUMED_KIND, SIGN_TEXT, Tally, summarise_verdicts
from pidcfg.text.diagnostics import START, Diagnostic, Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import CONTROL_SIGNS, pad_left, pad_right, to_one_line, width_of
from pidcfg.text.writer import json_text
from pidcfg.validate.catalog import rule_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from pidcfg.sim.judgement.report import LoopReport, Report, Standing, TuneReport, Verdict
    from pidcfg.study.outcome import Outcome
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Path

# --- A run as text for people and CI logs, and as JSON whose layout is spelled out key by key -------------------------

MAX_EVENTS = 60
"""Lines of the list of happenings; JSON has all of them."""
MAX_NOTES = 5
"""Of them in the short form."""
FAILED, NOT_PROVEN, ERROR = "FAILED", "NOT PROVEN", "ERROR"
FIXED_POINT_RANGE = (1e-9, 1e15)
"""Sizes of numbers that are written without an exponent."""
VERDICT_WORDS = {"proven": "proven", "failed": FAILED, "not-proven": NOT_PROVEN, "not-judged": "not judged"}
"""How a loop's verdict is written."""
METRIC_UNITS = {"overshoot": " %", "settling_time": " s", "rise_time": " s", "oscillation_period": " s"}


def simulations_text(outcomes: Sequence[Outcome], *, tables: bool = False) -> str:
    """One section a scenario: a line a loop, what failed and the verdict; with ``tables`` all that happened, too."""
    return "\n".join(_run_section(outcome, tables=tables) for outcome in outcomes)


def _run_section(outcome: Outcome, *, tables: bool) -> str:
    report = outcome.report
    findings = findings_text(outcome.findings, outcome.documents, brief=not tables).rstrip("\n")
    if report is None:
        return f"{to_one_line(outcome.file)}: cannot run\n\n{findings}\n"
    parts = [_run_head(outcome, report, tables=tables), findings and f"{findings}\n", _verdicts_text(outcome, report)]
    if tables:
        parts += [_expectations_text(report), _events_text(report), _tables_text(report, outcome), _flags_text(report)]
    return "\n".join(part for part in parts if part)


def _run_head(outcome: Outcome, report: Report, *, tables: bool) -> str:
    steady = "" if report.settled is None else f", after {report.settled:g} s to the steady state"
    engine = f"; engine: {report.engine}" if tables else ""
    words = [f"{name} = {word}" for name, word in report.plc_flags.items() if tables or int(word, 0)]
    if not report.running:
        words.append("the loop task is off, no loop is calculated")
    lines = [
        to_one_line(report.scenario),
        f"  {to_one_line(f'{outcome.file} runs {outcome.config}')}",
        f"  {report.duration:g} s in steps of {report.step:g} s{steady}{engine}",
        *([f"  {', '.join(words)}"] if words else []),
    ]
    if report.scan_time is not None and tables:
        typical, shortest, longest = (
            f"{time * 1e3:.3f}"
            for time in (report.scan_time.typical, report.scan_time.minimum, report.scan_time.maximum)
        )
        lines.append(f"  scan time with these loops: {typical} ms ({shortest} to {longest} ms)")
    return "\n".join(lines) + "\n"


def number_text(value: float, digits: int = 6) -> str:
    """A number, without an exponent where people write none."""
    text = f"{value:.{digits}g}"
    return f"{Decimal(text):f}" if FIXED_POINT_RANGE[0] <= abs(value) < FIXED_POINT_RANGE[1] else text


def four_digits(value: float | None) -> str:
    """A number in four digits."""
    return number_text(value or 0.0, 4)


def loops_text(report: Report) -> str:
    """A line a loop: its verdict, how it answered, and what alarms are on at the end."""
    reasons: dict[str, dict[str, None]] = {}
    for v in report.standing:
        if v.allowed is not None:
            reasons.setdefault(v.loop, {})[f"allowed: {v.allowed}"] = None
    rows = [
        (
            name,
            VERDICT_WORDS[loop.verdict],
            "; ".join(_loop_answers(loop, "; ".join(reasons.get(name, ())) or loop.missing)),
        )
        for name, loop in report.loops.items()
        if report.standing
    ]
    return align_columns(rows) if rows else ""


def _loop_answers(loop: LoopReport, reason: str) -> Iterator[str]:
    """What a loop did, as far as it was measured; ``reason``: why it is not judged."""
    if loop.verdict == "not-judged":
        yield reason
    metrics, unit = loop.metrics, f" {loop.unit}" if loop.unit else ""
    if metrics.get("overshoot") is not None:
        yield f"overshoot {four_digits(metrics['overshoot'])} %"
    if metrics.get("settling_time") is not None:
        yield f"settles in {four_digits(metrics['settling_time'])} s"
    elif loop.until is not None:
        yield f"has not settled at {four_digits(loop.until)} s, when an event moves it"
    if metrics.get("oscillation_amplitude") is not None:
        yield f"swings by {four_digits(metrics['oscillation_amplitude'])}{unit}"
    if metrics.get("final_error") is not None:
        distance = abs(metrics["final_error"] or 0)
        yield f"ends {four_digits(distance)}{unit} from its set point" if distance else "ends at its set point"
    elif loop.verdict != "not-judged":
        yield f"ends in {loop.modes[-1].mode if loop.modes else loop.first_mode}"
    alarms_on = [alarm.alarm for alarm in loop.alarms if alarm.cleared is None]
    if alarms_on:
        yield f"{' and '.join(dict.fromkeys(alarms_on))} on at the end"
    if loop.autotune is not None:
        yield autotune_text(loop.autotune)


def autotune_text(autotune: TuneReport) -> str:
    """How an auto-tune ended, and with what."""
    results = ", ".join(f"{key} {number_text(value)}" for key, value in autotune["results"].items())
    rule = f"; {autotune['rule']}" if "rule" in autotune else ""
    return f"autotune {autotune['status']}{': ' if results else ''}{results}{rule}"


def _events_text(report: Report) -> str:
    rows = [(event.at, event.loop or "", f"event: {event.text}") for event in report.events]
    for name, loop in report.loops.items():
        for change in loop.modes:
            requested = "" if change.requested in (None, change.mode) else f" (requested {change.requested})"
            reason = f": {change.reason}" if change.reason else ""
            rows.append((change.at, name, f"mode {change.mode}{requested}{reason}"))
        for alarm in loop.alarms:
            until = "on at the end" if alarm.cleared is None else f"until {alarm.cleared:g} s"
            rows.append((alarm.at, name, f"alarm {alarm.alarm}, {until}"))
        if loop.unlisted:
            rows.append((report.duration, name, f"and {loop.unlisted} more changes that are not listed"))
    rows += [(note.at, note.loop or "", ("error: " if note.error else "note: ") + note.text) for note in report.notes]
    rows.sort(key=lambda row: row[0])
    lines = [(f"{seconds:g} s", name, event_text) for seconds, name, event_text in rows[:MAX_EVENTS]]
    more = f"  … and {len(rows) - MAX_EVENTS} more; --format json lists all\n" if len(rows) > MAX_EVENTS else ""
    return "What happened\n" + align_columns(lines, right=1) + more if rows else ""


def _tables_text(report: Report, outcome: Outcome) -> str:
    metrics: list[tuple[str, ...]] = [("", *METRICS)]
    for name, loop in report.loops.items():
        values = [loop.metrics.get(metric) for metric in METRICS]
        units = [METRIC_UNITS.get(metric, "") for metric in METRICS]
        metrics.append((name, *(_metric_text(v, unit) for v, unit in zip(values, units, strict=True))))
    metrics = [tuple(row) for row in zip(*_drop_empty_swings(zip(*metrics, strict=True)), strict=True)]
    parts = [
        f"  {name}: integrals and errors over the {loop.time_in_control:g} s in Auto or Cascade\n"
        for name, loop in report.loops.items()
        if 0 < loop.time_in_control < report.duration
    ]
    signals = [("", "min", "max", "final"), *signal_rows(outcome, number_text)]
    return (
        "Metrics\n" + align_columns(metrics, left=1) + "".join(parts) + "\nSignals\n" + align_columns(signals, left=1)
    )


def _drop_empty_swings(columns: Iterable[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """The columns of metrics, without those of swings where no loop swings."""
    return [column for column in columns if column[0] not in SWING_METRICS or set(column[1:]) != {"-"}]


def _metric_text(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{number_text(value)}{unit}"


def _flags_text(report: Report) -> str:
    rows = []
    for name, loop in report.loops.items():
        flags_on = [flag for flag, was_set in loop.flags.items() if was_set]
        if flags_on:
            rows.append((name, ", ".join(flags_on)))
        if loop.autotune is not None:
            rows.append((name, autotune_text(loop.autotune)))
    return "Flags\n" + align_columns(rows) if rows else ""


def failures_text(report: Report) -> str:
    """The expectations that failed, as the text of a run has them; nothing where all hold."""
    rows = [row for row in _expectation_rows(report) if row[0] == FAILED]
    standing = [row for row in summarise_verdicts(report.standing) if row[0] in {FAILED, NOT_PROVEN}]
    return (align_columns(rows) if rows else "") + (align_columns(standing) if standing else "")


def _expectation_rows(report: Report) -> list[tuple[str, str]]:
    """What was written to be expected: how it was judged, and what was measured."""
    return [("passed" if v.passed else FAILED, f"{v.text}: {value_text(v.value)}") for v in report.expectations]


def _verdicts_text(outcome: Outcome, report: Report) -> str:
    """A line a loop, what needs saying, what failed, and the verdict of the run."""
    parts = loops_text(report), _assumed_line(report), _notes_text(report), failures_text(report)
    return f"{''.join(parts)}{run_verdict_line(outcome, report)}\n"


def _assumed_line(report: Report) -> str:
    """The loops whose action is not judged, in one line."""
    names = ", ".join(v.loop for v in report.standing if v.kind == ASSUMED_KIND)
    return align_columns([(names, "not judged", f"whether the action is right: {SIGN_TEXT}")]) if names else ""


def _notes_text(report: Report) -> str:
    """What happened and needs saying, errors first, as far as a screen has room for it."""
    notes = sorted(report.notes, key=lambda note: not note.error)
    rows = [
        (ERROR if note.error else "note", f"{note.loop or 'PLC'} at {note.at:g} s", note.text)
        for note in notes[:MAX_NOTES]
    ]
    more = f"  … and {len(notes) - MAX_NOTES} more; -v lists them\n" if len(notes) > MAX_NOTES else ""
    return align_columns(rows) + more if rows else ""


def _expectations_text(report: Report) -> str:
    """Every expectation, and the standing ones that are not simply met."""
    rows, standing = _expectation_rows(report), summarise_verdicts(report.standing)
    return ("Expectations\n" + align_columns(rows) if rows else "") + (
        "Always checked\n" + align_columns(standing) if standing else ""
    )


def run_remarks(outcomes: Sequence[Outcome], fmt: str, trend: str | None) -> Iterator[str]:
    """What people are told beside the results: what a trend's signals are, and in a job of GitHub how each run went."""
    from pidcfg.study.outcome import signals_before_root

    if trend is not None:
        yield from (f"{trend}: {loop}: {text}" for loop, text in signals_before_root(outcomes[0]).items())
    if fmt == "github":
        yield from map(outcome_line, outcomes)


def outcome_line(outcome: Outcome) -> str:
    """A scenario's file, and how its run went."""
    line = "cannot run" if outcome.report is None else run_verdict_line(outcome, outcome.report)
    return f"{to_one_line(outcome.file)}: {line}"


def run_verdict_line(outcome: Outcome, report: Report) -> str:
    """How a run went, in one line."""
    failed = sum(not verdict.passed for verdict in report.expectations)
    total, tally = len(report.expectations), Tally.count(report.standing)
    errors = any(note.error for note in report.notes) or any(p.severity == "error" for p in report.problems)
    line = f"passed: {total} of {total} expectations, {tally.summary_text()}"
    if not report.expectations and not report.standing:
        line = "nothing was expected of this run"
    if not any(loop.time_in_control for loop in report.loops.values()):
        line += "; no loop was in Auto or Cascade, so nothing was controlled"
    elif not report.running:
        line += "; the PLC ends stopped"
    if failed or tally.failed:
        parts = [f"{failed} of {total} expectations"] * (failed > 0)
        parts += [f"{tally.failed} of {tally.judged_count} always checked"] * (tally.failed > 0)
        parts += [f"{tally.unproven} not proven"] * (tally.unproven > 0)
        line = f"{FAILED}: {', '.join(parts)}"
    elif tally.unproven and not errors:
        line = f"{NOT_PROVEN}: {tally.unproven} of {tally.judged_count} always checked"
        line += f" ({total} of {total} expectations passed)" if total else ""
    elif errors:
        line = f"FAILED: an error in the run ({total} of {total} expectations passed)"
    if outcome.lacks_expectations:
        line = "FAILED: the configuration has errors, and nothing is expected of the run"
    return line


def value_text(value: object) -> str:
    """What was measured, for people."""
    if isinstance(value, list):
        return " to ".join(value_text(v) for v in value)
    if isinstance(value, float):
        return number_text(value)
    return "none" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def align_columns(rows: Sequence[Sequence[str]], left: int = 9, right: int = 0) -> str:
    """Aligned columns; the first ``right`` ones and all after ``left`` to the right."""
    rows = [[to_one_line(cell) for cell in row] for row in rows]
    widths = [max(map(width_of, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = [
            (pad_left if i < right or i >= left else pad_right)(cell, width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  " + "  ".join(cells).rstrip())
    return "\n".join(lines) + "\n"


def json_v1(outcomes: Sequence[Outcome]) -> str:
    """The public layout, version 1."""
    return json_text(runs_data(outcomes), allow_nan=False)


def worst_severity(outcomes: Sequence[Outcome]) -> Severity:
    """The most severe finding of all scenarios."""
    return max((d.severity for outcome in outcomes for d in outcome.findings), default=Severity.INFO)


# --- Runs as findings, for formats of CI systems: every expectation that failed is a finding at its line --------------


def render_runs(
    name: str, outcomes: Sequence[Outcome], failing_severity: Severity = Severity.ERROR, *, tables: bool = False
) -> str:
    """The runs in one of the formats; from ``failing_severity`` on a finding fails. ``tables``: all that happened."""
    if tables and name == "text":
        return simulations_text(outcomes, tables=True)
    write = load_format(name).runs
    if write is not None:
        return write(outcomes, failing_severity)
    reported = [d for outcome in outcomes for d in (*outcome.findings, *_failure_findings(outcome))]
    documents = {file: doc for outcome in outcomes for file, doc in outcome.documents.items()}
    return render_findings(name, Findings(list(dict.fromkeys(reported)), documents, failing_severity))


def _failure_findings(outcome: Outcome) -> Iterator[Diagnostic]:
    """Expectations that do not hold, and errors of the run."""
    for i, verdict in enumerate(() if outcome.report is None else outcome.report.expectations):
        if not verdict.passed:
            yield failed_expectation(outcome, i, verdict)
    for standing in () if outcome.report is None else outcome.report.standing:
        if standing.fails:
            yield failed_standing(outcome, standing)
    yield from run_errors(outcome)


def failed_expectation(outcome: Outcome, i: int, verdict: Verdict) -> Diagnostic:
    """A failed expectation where the scenario states it; verdicts stand in the order of the scenario."""
    doc, path = outcome.documents[outcome.file], ("expect", i)
    expectation = doc.data["expect"][i] if doc.data else {}
    names = (expectation.get("loop"), str(expectation.get("signal", "")).rpartition(".")[0])
    loops = () if outcome.report is None else outcome.report.loops
    loop = next((str(name) for name in names if name in loops), "")
    message = f"expected: {verdict.text}; measured: {value_text(verdict.value)}"
    return Diagnostic("PID061", Severity.ERROR, message, outcome.file, doc.locate(path), path, loop)


def failed_standing(outcome: Outcome, verdict: Standing) -> Diagnostic:
    """A failed standing expectation at the loop in the configuration; of the PLC, where the scenario names it."""
    file, path = outcome.config, loop_path(outcome.documents.get(outcome.config), verdict.loop)
    if verdict.kind == ACCEPTED_KIND and "reference" in (outcome.documents[outcome.file].data or {}):
        file, path = outcome.file, ("reference",)
    if path is None:
        file, path = outcome.file, ("config",)
    subject = f"{verdict.loop}: " if verdict.loop else ""
    message = f"{verdict.kind}: {subject}{verdict.text}"
    if verdict.verdict == "not-proven":
        message = f"not proven, {message}"
    span = outcome.documents[file].locate(path)
    return Diagnostic("PID063", Severity.ERROR, message, file, span, path, verdict.loop or "")


def loop_path(doc: Document | None, loop: str) -> Path | None:
    """Where a configuration names a loop; None: nowhere, as in a listing."""
    entries = doc.data.get("loops") if doc is not None and doc.data else None
    for i, entry in enumerate(entries if isinstance(entries, list) else ()):
        if isinstance(entry, dict) and str(entry.get("name")) == loop:
            return ("loops", i, "name")
    return None


def run_errors(outcome: Outcome) -> Iterator[Diagnostic]:
    """Errors that a run met on its way; they have a time, but no place in the file."""
    for note in () if outcome.report is None else outcome.report.notes:
        if note.error:
            text = f"at {note.at:g} s: {note.text}"
            yield Diagnostic("PID062", Severity.ERROR, text, outcome.file, START, (), note.loop or "")


# --- Format ``junit``: test cases in JUnit's XML, which nearly every CI system shows ----------------------------------

RUN_CASE = "the run is sound"
"""The test case of what is no expectation: findings, and errors on the way."""
NO_XML_CHARACTERS = re.compile(f"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]|[{CONTROL_SIGNS}]")
"""Characters that XML 1.0 cannot hold, not even escaped, and those that it should not."""


@frozen
class TestCase:
    """One test case: what failed it, what kept it from being judged, and what else there is to say."""

    name: str
    failures: tuple[tuple[str, str, str], ...] = ()
    """Kind, message and text of each."""
    errors: tuple[tuple[str, str, str], ...] = ()
    output: str = ""
    skipped: str = ""
    """Why it was not judged, or need not pass."""


def findings_junit(findings: Findings) -> str:
    """A suite a file and a case a rule that it breaks; a file without findings has one case that passes."""
    suites = {}
    for file in findings.files:
        reported = [d for d in findings.reported if d.file == file]
        suites[display_name(file)] = list(_rule_cases(reported, findings.failing_severity)) or [TestCase("no findings")]
    return junit_document(f"pidcfg {findings.command}", suites)


def _rule_cases(reported: Sequence[Diagnostic], failing_severity: Severity) -> Iterator[TestCase]:
    """A case a rule: findings that fail the run fail it, the others stand in its output."""
    for code in dict.fromkeys(d.code for d in reported):
        rule_findings = [d for d in reported if d.code == code]
        rule = rule_of(code)
        yield _findings_case(
            f"{code} {rule.name}", rule_findings, lambda d: d.severity >= failing_severity, unusable=rule.is_unusable
        )


def runs_junit(outcomes: Sequence[Outcome], failing_severity: Severity) -> str:
    """A suite a scenario: whether the run is sound, then each expectation, the standing ones last."""
    suites = {
        display_name(o.file): [_soundness_case(o, failing_severity), *_expectation_cases(o), *_standing_cases(o)]
        for o in outcomes
    }
    return junit_document("pidcfg simulate", suites)


def _soundness_case(outcome: Outcome, failing_severity: Severity) -> TestCase:
    """Fails as the run does: on errors of the scenario, and on those of its configuration when nothing is expected."""

    def fails_run(d: Diagnostic) -> bool:
        judged = d.file == outcome.file or outcome.lacks_expectations or failing_severity < Severity.ERROR
        return judged and d.severity >= failing_severity

    diagnostics = [*outcome.findings, *run_errors(outcome)]
    return _findings_case(RUN_CASE, diagnostics, fails_run, unusable=outcome.report is None)


def _expectation_cases(outcome: Outcome) -> Iterator[TestCase]:
    """A case an expectation; the same one twice is numbered."""
    counts: Counter[str] = Counter()
    for i, verdict in enumerate(() if outcome.report is None else outcome.report.expectations):
        counts[verdict.text] += 1
        name = verdict.text if counts[verdict.text] == 1 else f"{verdict.text} ({counts[verdict.text]})"
        if verdict.passed:
            yield TestCase(name, output=f"measured: {value_text(verdict.value)}")
        else:
            yield TestCase(name, (failure_entry(failed_expectation(outcome, i, verdict)),))


def _standing_cases(outcome: Outcome) -> Iterator[TestCase]:
    """A case a standing expectation; one that is allowed to fail, or not judged, is skipped."""
    for v in () if outcome.report is None else outcome.report.standing:
        name = f"{v.loop} {v.kind}".strip()
        if v.fails:
            _, message, text = failure_entry(failed_standing(outcome, v))
            yield TestCase(name, ((v.verdict, message, text),))
        elif v.allowed is not None:
            yield TestCase(name, skipped=f"{v.verdict.replace('-', ' ')}, and allowed: {v.allowed}", output=v.text)
        elif not v.is_judged:
            yield TestCase(name, skipped=f"not judged: {v.text}")
        else:
            yield TestCase(name, output=v.text)


def _findings_case(
    name: str, diagnostics: Sequence[Diagnostic], is_failure: Callable[[Diagnostic], bool], *, unusable: bool
) -> TestCase:
    """What fails a case is its failure, or its error where nothing could be judged; the rest is its output."""
    entries = tuple(failure_entry(d) for d in diagnostics if is_failure(d))
    output = "\n\n".join(_finding_block(d) for d in diagnostics if not is_failure(d))
    return TestCase(name, errors=entries, output=output) if unusable else TestCase(name, entries, output=output)


def failure_entry(d: Diagnostic) -> tuple[str, str, str]:
    """A finding as kind, message and text of a failure."""
    return (f"{d.severity.label} {d.code}", f"{d.span.line}:{d.span.column}: {d.message}", _finding_block(d))


def _finding_block(d: Diagnostic) -> str:
    """A finding with its place, in lines."""
    first, *rest = map(_one_line, finding_lines(d))
    place = f"{_one_line(display_name(d.file))}:{d.span.line}:{d.span.column}"
    return "\n".join([f"{place}: {d.severity.label} {d.code}: {first}", *(f"  {line}" for line in rest)])


def junit_document(name: str, suites: Mapping[str, Sequence[TestCase]]) -> str:
    """The whole file; suites by name, whose name is also the class of their cases."""
    root = ET.Element(
        "testsuites", {"name": name, **_case_counts([case for cases in suites.values() for case in cases])}
    )
    for title, cases in suites.items():
        suite = ET.SubElement(root, "testsuite", {"name": title, **_case_counts(cases)})
        for case in cases:
            _add_case(suite, title, case)
    return xml_text(root)


def xml_text(root: ET.Element) -> str:
    """A document of XML, without the characters of users' texts that XML cannot hold or should not."""
    for node in root.iter():
        for name, value in node.items():
            node.set(name, _legal_xml(value))
        if node.text:
            node.text = _legal_xml(node.text).replace("\r", "")  # nothing would escape one here, as in a value
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _add_case(suite: ET.Element, title: str, case: TestCase) -> None:
    node = ET.SubElement(suite, "testcase", {"classname": title, "name": case.name})
    for tag, entries in (("error", case.errors), ("failure", case.failures)):
        for kind, message, text in entries:
            ET.SubElement(node, tag, {"message": message, "type": kind}).text = text
    if case.skipped:
        ET.SubElement(node, "skipped", {"message": case.skipped})
    if case.output:
        ET.SubElement(node, "system-out").text = case.output


def _case_counts(cases: Sequence[TestCase]) -> dict[str, str]:
    failed = sum(bool(case.failures) and not case.errors for case in cases)
    totals = {"tests": len(cases), "failures": failed, "errors": sum(bool(case.errors) for case in cases)}
    if skipped := sum(bool(case.skipped) for case in cases):
        totals["skipped"] = skipped
    return {name: str(total) for name, total in totals.items()}


def _legal_xml(text: str) -> str:
    return NO_XML_CHARACTERS.sub("", text)


def _one_line(text: str) -> str:
    """Text that has a line to itself."""
    return " ".join(_legal_xml(text).splitlines())


JUNIT = Format("test reports of nearly every CI system", "xml", Kind.XML, findings_junit, runs_junit)
