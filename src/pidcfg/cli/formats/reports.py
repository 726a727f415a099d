"""Findings, runs and batches in every format: for people, programs, and CI systems."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

from pidcfg import __version__
from pidcfg.cli.formats import Format, Kind, load, render
from pidcfg.cli.formats import findings as reporters
from pidcfg.cli.formats.findings import STDIN, Findings, details, display_name, fingerprints, sentence, summary, uri
from pidcfg.cli.formats.runs import batches_text, figure, value_text
from pidcfg.output.runs import batches_data
from pidcfg.text.diagnostics import START, Diagnostic, Edit, Severity, Span, number_of
from pidcfg.text.signs import CONTROL, one_line, printable
from pidcfg.text.writer import json_text
from pidcfg.validate.catalog import page, rule_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.sim.judgement.report import Standing, Verdict
    from pidcfg.study.certification.certify import BatchOutcome, Certification, Share
    from pidcfg.study.outcome import Outcome
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Path
    from pidcfg.validate.rule import Rule

# --- Format ``text``: a block a finding, with the line and a caret; a section a run -----------------------------------


def findings_text(findings: Findings) -> str:
    """For people in front of a terminal."""
    return reporters.text(findings.reported, findings.documents)


def runs_text(outcomes: Sequence[Outcome], fails: Severity) -> str:
    """What happened, metrics and expectations."""
    from pidcfg.cli.formats.runs import simulations_text

    del fails
    return simulations_text(outcomes)


TEXT = Format("people; the default", "txt", Kind.PLAIN, findings_text, runs_text)

# --- Format ``concise``: one line a finding, as compilers print it and editors jump to it -----------------------------


def findings_concise(findings: Findings) -> str:
    """``file:line:column: severity CODE message [loop]``."""
    rows = (
        f"{d.file}:{d.span.line}:{d.span.column}: {d.severity.label} {d.code} {' '.join(sentence(d).split())}"
        for d in findings.reported
    )
    return "".join(printable(row).replace("\n", " ") + "\n" for row in rows)


CONCISE = Format("people and editors: one line a finding", "concise", Kind.PLAIN, findings_concise)

# --- Format ``json``: the public layout, for programs -----------------------------------------------------------------


def findings_json(findings: Findings) -> str:
    """The layout that `pidcfg schema output-validate` describes."""
    return reporters.json_v1(findings.reported, findings.documents)


def runs_json(outcomes: Sequence[Outcome], fails: Severity) -> str:
    """The layout that `pidcfg schema output-simulate` describes."""
    from pidcfg.cli.formats.runs import json_v1

    del fails
    return json_v1(outcomes)


JSON = Format("programs; the layout is [published](#json) and stays", "json", Kind.JSON, findings_json, runs_json)

# --- Format ``markdown``: tables for comments of pull requests and for the summary of a job ---------------------------

MARKS = re.compile(r"[\\|]|(?<=\])\(")
"""What would end a cell, and the sign that makes a link of a text in brackets."""
MOST = 500
"""Rows of a table: GitHub drops a summary of more than a megabyte."""


def cell(text: str) -> str:
    """Text that stays in its cell of a Markdown table, and is no picture or link there."""
    return MARKS.sub(r"\\\g<0>", one_line(text)).replace("&", "&amp;").replace("<", "&lt;")


def findings_markdown(findings: Findings) -> str:
    """How many findings there are, and a row for each of the first ones."""
    return "".join(f"{line}\n" for line in _markdown_lines(findings))


def _markdown_lines(findings: Findings) -> Iterator[str]:
    yield f"**{summary(findings.reported, len(findings.documents))}**"
    if not findings.reported:
        return
    yield from ("", "| | place | rule | finding |", "|---|---|---|---|")
    yield from map(_table_row, findings.reported[:MOST])
    if len(findings.reported) > MOST:
        yield from ("", f"… and {len(findings.reported) - MOST} more")


def _table_row(d: Diagnostic) -> str:
    """A finding: what it is, and below it in the same cell what the PLC would do and the cure."""
    more = ((d.plc_effect, "PLC"), (d.help, "cure"))
    said = [sentence(d), *(f"{label}: {text}" for text, label in more if text)]
    place = f"{d.file}:{d.span.line}:{d.span.column}"
    cells = (d.severity.label, cell(place), d.code, "<br>".join(map(cell, said)))
    return f"| {' | '.join(cells)} |"


MARKDOWN = Format("comments of pull requests, summaries of jobs", "md", Kind.LINES, findings_markdown)

# --- Format ``github``: workflow commands, which GitHub shows as annotations beside the lines of a pull request -------

COMMANDS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "notice"}
DATA = {"%": "%25", "\r": "%0D", "\n": "%0A"}
PROPERTY = {**DATA, ":": "%3A", ",": "%2C"}


def findings_github(findings: Findings) -> str:
    """One command a finding."""
    return "".join(f"{_command(d)}\n" for d in findings.reported)


def _command(d: Diagnostic) -> str:
    loop = f" [{d.loop}]" if d.loop else ""
    values = {} if d.file == STDIN else _place(d)
    values["title"] = f"pidcfg {d.code}{loop}"
    properties = ",".join(f"{key}={escaped(value, PROPERTY)}" for key, value in values.items())
    place = f"{d.file}:{d.span.line}:{d.span.column}: " if d.file == STDIN else ""
    return f"::{COMMANDS[d.severity]} {properties}::{escaped(place + chr(10).join(details(d)), DATA)}"


def _place(d: Diagnostic) -> dict[str, str]:
    """GitHub takes a column only together with a single line."""
    values = {"file": display_name(d.file), "line": str(d.span.line), "endLine": str(d.span.end_line)}
    return values | ({"col": str(d.span.column)} if d.span.line == d.span.end_line else {})


def escaped(text: str, table: dict[str, str]) -> str:
    """Text whose special characters are written as GitHub's runner reads them back; other control characters go."""
    return printable("".join(table.get(c, c) for c in text))


GITHUB = Format("annotations in GitHub Actions; the default there", "github", Kind.ORDERS, findings_github)

# --- Format ``gitlab``: the Code Quality report that GitLab shows in merge requests -----------------------------------

SEVERITIES = {Severity.ERROR: "major", Severity.WARNING: "minor", Severity.INFO: "info"}


def findings_gitlab(findings: Findings) -> str:
    """A list of issues."""
    rows = [
        {
            "description": sentence(d),
            "check_name": d.code,
            "fingerprint": fingerprint,
            "severity": SEVERITIES[d.severity],
            "location": {
                "path": "stdin" if d.file == STDIN else display_name(d.file),
                "lines": {"begin": d.span.line, "end": d.span.end_line},
            },
        }
        for d, fingerprint in zip(findings.reported, fingerprints(findings), strict=True)
    ]
    return json_text(rows)


GITLAB = Format("GitLab's Code Quality report", "gitlab.json", Kind.JSON, findings_gitlab)

# --- Runs as findings, for formats of CI systems: every expectation that failed is a finding at its line --------------


def render_runs(name: str, outcomes: Sequence[Outcome], fails: Severity = Severity.ERROR) -> str:
    """The runs in one of the formats; findings from ``fails`` on fail a run."""
    write = load(name).runs
    if write is not None:
        return write(outcomes, fails)
    reported = [d for outcome in outcomes for d in (*outcome.findings, *_failures(outcome))]
    documents = {file: doc for outcome in outcomes for file, doc in outcome.documents.items()}
    return render(name, Findings(list(dict.fromkeys(reported)), documents, fails))


def _failures(outcome: Outcome) -> Iterator[Diagnostic]:
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
    stated = doc.data["expect"][i] if doc.data else {}
    names = (stated.get("loop"), str(stated.get("signal", "")).rpartition(".")[0])
    loops = () if outcome.report is None else outcome.report.loops
    loop = next((str(name) for name in names if name in loops), "")
    message = f"expected: {verdict.text}; measured: {value_text(verdict.value)}"
    return Diagnostic("PID061", Severity.ERROR, message, outcome.file, doc.locate(path), path, loop)


def failed_standing(outcome: Outcome, verdict: Standing) -> Diagnostic:
    """A failed standing expectation at the loop in the configuration; of the PLC, where the scenario names it."""
    file, path = outcome.config, loop_path(outcome.documents.get(outcome.config), verdict.loop)
    if path is None:
        file, path = outcome.file, ("config",)
    subject = f"{verdict.loop}: " if verdict.loop else ""
    message = f"{verdict.kind}: {subject}{verdict.text}"
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

RUN = "the run is sound"
"""The test case of what is no expectation: findings, and errors on the way."""
NO_XML = re.compile(f"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]|[{CONTROL}]")
"""Characters that XML 1.0 cannot hold, not even escaped, and those that it should not."""


@dataclass(frozen=True, slots=True)
class Case:
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
        suites[display_name(file)] = list(_rule_cases(reported, findings.fails)) or [Case("no findings")]
    return document(f"pidcfg {findings.command}", suites)


def _rule_cases(reported: Sequence[Diagnostic], fails: Severity) -> Iterator[Case]:
    """A case a rule: findings that fail the run fail it, the others stand in its output."""
    for code in dict.fromkeys(d.code for d in reported):
        of_rule = [d for d in reported if d.code == code]
        rule = rule_of(code)
        yield _case(f"{code} {rule.name}", of_rule, lambda d: d.severity >= fails, unusable=rule.unusable)


def runs_junit(outcomes: Sequence[Outcome], fails: Severity) -> str:
    """A suite a scenario: whether the run is sound, then each expectation, the standing ones last."""
    suites = {display_name(o.file): [_soundness(o, fails), *_expectations(o), *_standing(o)] for o in outcomes}
    return document("pidcfg simulate", suites)


def _soundness(outcome: Outcome, fails: Severity) -> Case:
    """Fails as the run does: on errors of the scenario, and on those of its configuration when nothing is expected."""

    def fails_run(d: Diagnostic) -> bool:
        judged = d.file == outcome.file or outcome.unjudged or fails < Severity.ERROR
        return judged and d.severity >= fails

    diagnostics = [*outcome.findings, *run_errors(outcome)]
    return _case(RUN, diagnostics, fails_run, unusable=outcome.report is None)


def _expectations(outcome: Outcome) -> Iterator[Case]:
    """A case an expectation; the same one twice is numbered."""
    from pidcfg.cli.formats.runs import value_text

    seen: Counter[str] = Counter()
    for i, verdict in enumerate(() if outcome.report is None else outcome.report.expectations):
        seen[verdict.text] += 1
        name = verdict.text if seen[verdict.text] == 1 else f"{verdict.text} ({seen[verdict.text]})"
        if verdict.passed:
            yield Case(name, output=f"measured: {value_text(verdict.value)}")
        else:
            yield Case(name, (entry(failed_expectation(outcome, i, verdict)),))


def _standing(outcome: Outcome) -> Iterator[Case]:
    """A case a standing expectation; one that is allowed to fail, or not judged, is skipped."""
    for v in () if outcome.report is None else outcome.report.standing:
        name = f"{v.loop} {v.kind}".strip()
        if v.fails:
            yield Case(name, (entry(failed_standing(outcome, v)),))
        elif v.allowed is not None:
            yield Case(name, skipped=f"failed, and allowed: {v.allowed}", output=v.text)
        elif not v.judged:
            yield Case(name, skipped=f"not judged: {v.text}")
        else:
            yield Case(name, output=v.text)


def _case(name: str, diagnostics: Sequence[Diagnostic], fails: Callable[[Diagnostic], bool], *, unusable: bool) -> Case:
    """What fails a case is its failure, or its error where nothing could be judged; the rest is its output."""
    entries = tuple(entry(d) for d in diagnostics if fails(d))
    output = "\n\n".join(_block(d) for d in diagnostics if not fails(d))
    return Case(name, errors=entries, output=output) if unusable else Case(name, entries, output=output)


def entry(d: Diagnostic) -> tuple[str, str, str]:
    """A finding as kind, message and text of a failure."""
    return (f"{d.severity.label} {d.code}", f"{d.span.line}:{d.span.column}: {d.message}", _block(d))


def _block(d: Diagnostic) -> str:
    """A finding with its place, in lines."""
    first, *rest = map(_one_line, details(d))
    place = f"{_one_line(display_name(d.file))}:{d.span.line}:{d.span.column}"
    return "\n".join([f"{place}: {d.severity.label} {d.code}: {first}", *(f"  {line}" for line in rest)])


def document(name: str, suites: Mapping[str, Sequence[Case]]) -> str:
    """The whole file; suites by name, whose name is also the class of their cases."""
    root = ET.Element("testsuites", {"name": name, **_totals([case for cases in suites.values() for case in cases])})
    for title, cases in suites.items():
        suite = ET.SubElement(root, "testsuite", {"name": _legal(title), **_totals(cases)})
        for case in cases:
            _add(suite, title, case)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _add(suite: ET.Element, title: str, case: Case) -> None:
    node = ET.SubElement(suite, "testcase", {"classname": _legal(title), "name": _legal(case.name)})
    for tag, entries in (("error", case.errors), ("failure", case.failures)):
        for kind, message, text in entries:
            ET.SubElement(node, tag, {"message": _legal(message), "type": kind}).text = _element_text(text)
    if case.skipped:
        ET.SubElement(node, "skipped", {"message": _legal(case.skipped)})
    if case.output:
        ET.SubElement(node, "system-out").text = _element_text(case.output)


def _totals(cases: Sequence[Case]) -> dict[str, str]:
    failed = sum(bool(case.failures) and not case.errors for case in cases)
    totals = {"tests": len(cases), "failures": failed, "errors": sum(bool(case.errors) for case in cases)}
    if skipped := sum(bool(case.skipped) for case in cases):
        totals["skipped"] = skipped
    return {name: str(total) for name, total in totals.items()}


def _legal(text: str) -> str:
    return NO_XML.sub("", text)


def _one_line(text: str) -> str:
    """Text that has a line to itself."""
    return " ".join(_legal(text).splitlines())


def _element_text(text: str) -> str:
    """The text of an element, whose carriage returns nothing would escape."""
    return _legal(text).replace("\r", "")


JUNIT = Format("test reports of nearly every CI system", "xml", Kind.XML, findings_junit, runs_junit)

# --- Format ``sarif``: SARIF 2.1.0, which GitHub code scanning, Azure DevOps and editors read -------------------------

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}
BASE = "%SRCROOT%"
FINGERPRINT = "pidcfgFinding/v1"


def findings_sarif(findings: Findings) -> str:
    """One run, with the rules that are broken."""
    hidden = [d for d, _ in findings.suppressed]
    every = replace(findings, reported=[*findings.reported, *hidden])
    used = sorted({d.code for d in every.reported}, key=number_of)
    numbers = {code: i for i, code in enumerate(used)}
    prints = fingerprints(every)
    why = [None] * len(findings.reported) + [_suppression(reason) for _, reason in findings.suppressed]
    run = {
        "tool": {
            "driver": {"name": "pidcfg", "version": __version__, "rules": [_rule(rule_of(code)) for code in used]}
        },
        "originalUriBaseIds": {BASE: {"description": {"text": "The checkout, or the folder that pidcfg ran in."}}},
        "columnKind": "unicodeCodePoints",
        "results": [
            _result(d, numbers[d.code], key) | ({"suppressions": [reason]} if reason else {})
            for d, key, reason in zip(every.reported, prints, why, strict=True)
        ],
    }
    document = {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}
    return json_text(document)


def _rule(rule: Rule) -> dict[str, Any]:
    why, fix = (part[:1].upper() + part[1:] for part in (rule.part("Why"), rule.part("Fix")))
    return {
        "id": rule.code,
        "name": rule.name,
        "shortDescription": {"text": rule.title},
        "fullDescription": {"text": f"{rule.title} {why}"},
        "help": {"text": f"Why: {why}\n\nCure: {fix}\n\nBasis: {rule.basis}.", "markdown": page(rule)},
        "defaultConfiguration": {"level": LEVELS[rule.severity]},
    }


def _result(d: Diagnostic, number: int, fingerprint: str) -> dict[str, Any]:
    location: dict[str, Any] = {"physicalLocation": {"artifactLocation": _artifact(d.file), "region": _region(d.span)}}
    if d.path:
        location["logicalLocations"] = _logical(d)
    return {
        "ruleId": d.code,
        "ruleIndex": number,
        "level": LEVELS[d.severity],
        "message": {"text": "\n".join(details(d))},
        "locations": [location],
        "partialFingerprints": {FINGERPRINT: fingerprint},
        **({"fixes": [_fix(d, d.edits)]} if d.edits else {}),
    }


def _suppression(reason: str | None) -> dict[str, str]:
    """Why a result is not reported: a comment, or a baseline."""
    if reason is None:
        return {"kind": "external"}
    return {"kind": "inSource", **({"justification": reason} if reason else {})}


def _artifact(file: str) -> dict[str, Any]:
    reference, relative = uri(file)
    if file == STDIN:
        return {"uri": reference, "description": {"text": "standard input"}}
    return {"uri": reference, "uriBaseId": BASE} if relative else {"uri": reference}


def _region(span: Span) -> dict[str, int]:
    """The place in a file; what concerns all of a file is shown at its first line."""
    if span == START:
        return {"startLine": 1}
    return {
        "startLine": span.line,
        "startColumn": span.column,
        "endLine": span.end_line,
        "endColumn": span.end_column,
    }


def _logical(d: Diagnostic) -> list[dict[str, str]]:
    """The key of a finding, and the loop that it belongs to."""
    last = next((step for step in reversed(d.path) if isinstance(step, str)), "")
    key = {"name": last, "fullyQualifiedName": d.where, "kind": "property"}
    return [key, {"name": d.loop, "kind": "object"}] if d.loop else [key]


def _fix(d: Diagnostic, edits: Sequence[Edit]) -> dict[str, Any]:
    replacements = [{"deletedRegion": _replaced(e.span), "insertedContent": {"text": e.text}} for e in edits]
    change = {"artifactLocation": _artifact(d.file), "replacements": replacements}
    return {"description": {"text": d.help or d.message}, "artifactChanges": [change]}


def _replaced(span: Span) -> dict[str, int]:
    """An edit's place, which may be the very beginning of a file."""
    place = (span.line, span.column, span.end_line, span.end_column)
    return dict(zip(("startLine", "startColumn", "endLine", "endColumn"), place, strict=True))


SARIF = Format("GitHub code scanning, Azure DevOps, editors: SARIF 2.1.0", "sarif", Kind.JSON, findings_sarif)

# --- Batches of samples in the formats of `pidcfg certify`: text for people, JSON, and JUnit's XML --------------------

Written = dict[tuple[str, int], str]
"""Files of samples, by scenario file and number."""


def render_batches(name: str, outcomes: Sequence[BatchOutcome], written: Mapping[tuple[str, int], str]) -> str:
    """The batches in one of the formats."""
    if name == "json":
        return json_text(batches_data(outcomes, written), allow_nan=False)
    return junit(outcomes) if name == "junit" else batches_text(outcomes, written)


def junit(outcomes: Sequence[BatchOutcome]) -> str:
    """A suite a scenario: whether all samples ran, then each expectation, the standing ones last."""
    from pidcfg.cli.formats.findings import display_name

    return document("pidcfg certify", {display_name(one.file): list(_cases(one)) for one in outcomes})


def _cases(outcome: BatchOutcome) -> Iterator[Case]:
    found = outcome.certification
    errors = [d for d in outcome.findings if d.severity is Severity.ERROR]
    if found is None:
        yield Case("the samples run", errors=tuple(entry(d) for d in errors))
        return
    failures = tuple(entry(d) for d in errors) if outcome.unjudged else ()
    if found.failed_to_run:
        message = f"{found.failed_to_run:,} of {found.samples:,} samples cannot run"
        failures += (("error PID062", message, "\n".join(found.reasons)),)
    yield Case("the samples run", failures)
    for one in (*found.expectations, *found.standing):
        yield _batch_case(one, found)


def _batch_case(one: Share, found: Certification) -> Case:
    said = f"{one.held:,} of {one.samples:,} samples, so at least {figure(one.bound)} %"
    if one.judged == 0 and not found.failed_to_run:
        return Case(one.text, skipped="not judged in any sample")
    if one.passed:
        return Case(one.text, output=said)
    wanted = "all samples are wanted" if one.wanted is None else f"{one.wanted:g} % are wanted"
    return Case(one.text, (("error PID061", f"{said}; {wanted}", said),))
