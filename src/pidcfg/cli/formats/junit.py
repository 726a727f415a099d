"""Format ``junit``: test cases in JUnit's XML, which nearly every CI system shows."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from pidcfg.cli.formats.findings import details, display_name
from pidcfg.cli.formats.format import Format, Kind
from pidcfg.control_characters import CONTROL
from pidcfg.diagnostics import Severity
from pidcfg.validate.catalog import rule_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.cli.formats.findings import Findings
    from pidcfg.diagnostics import Diagnostic
    from pidcfg.scenario.outcome import Outcome

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
    from pidcfg.cli.formats.simulation import run_errors

    def fails_run(d: Diagnostic) -> bool:
        judged = d.file == outcome.file or outcome.unjudged or fails < Severity.ERROR
        return judged and d.severity >= fails

    diagnostics = [*outcome.findings, *run_errors(outcome)]
    return _case(RUN, diagnostics, fails_run, unusable=outcome.report is None)


def _expectations(outcome: Outcome) -> Iterator[Case]:
    """A case an expectation; the same one twice is numbered."""
    from pidcfg.cli.formats.simulation import failed_expectation
    from pidcfg.cli.formats.simulation_text import value_text

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
    from pidcfg.cli.formats.simulation import failed_standing

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
    first, *rest = map(_row, details(d))
    place = f"{_row(display_name(d.file))}:{d.span.line}:{d.span.column}"
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
            ET.SubElement(node, tag, {"message": _legal(message), "type": kind}).text = _lines(text)
    if case.skipped:
        ET.SubElement(node, "skipped", {"message": _legal(case.skipped)})
    if case.output:
        ET.SubElement(node, "system-out").text = _lines(case.output)


def _totals(cases: Sequence[Case]) -> dict[str, str]:
    failed = sum(bool(case.failures) and not case.errors for case in cases)
    totals = {"tests": len(cases), "failures": failed, "errors": sum(bool(case.errors) for case in cases)}
    if skipped := sum(bool(case.skipped) for case in cases):
        totals["skipped"] = skipped
    return {name: str(total) for name, total in totals.items()}


def _legal(text: str) -> str:
    return NO_XML.sub("", text)


def _row(text: str) -> str:
    """Text that has a line to itself."""
    return " ".join(_legal(text).splitlines())


def _lines(text: str) -> str:
    """The text of an element, whose carriage returns nothing would escape."""
    return _legal(text).replace("\r", "")


FORMAT = Format("test reports of nearly every CI system", "xml", Kind.XML, findings_junit, runs_junit)
