"""Format ``junit``: test cases in JUnit's XML, which nearly every CI system shows."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from pidcfg.cli.formats.findings import shown, told
from pidcfg.validate.catalog import rule_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from pidcfg.cli.formats.findings import Findings
    from pidcfg.diagnostics import Diagnostic

NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 cannot hold, not even escaped."""


@dataclass(frozen=True, slots=True)
class Case:
    """One test case: what failed it, what kept it from being judged, and what else there is to say."""

    name: str
    failures: tuple[tuple[str, str, str], ...] = ()
    """Kind, message and text of each."""
    errors: tuple[tuple[str, str, str], ...] = ()
    output: str = ""


def junit(findings: Findings) -> str:
    """A suite a file and a case a rule that found something in it; a file without findings has one case that passes."""
    suites = {}
    for file in findings.files:
        own = [d for d in findings.found if d.file == file]
        suites[shown(file)] = list(_cases(own, findings)) or [Case("no findings")]
    return document("pidcfg validate", suites)


def _cases(found: Sequence[Diagnostic], findings: Findings) -> Iterable[Case]:
    """A finding fails its case if it fails the run; one that does not is told in the case's output."""
    for code in dict.fromkeys(d.code for d in found):
        own = [d for d in found if d.code == code]
        failed = [d for d in own if d.severity >= findings.fails]
        entries = tuple(entry(d) for d in failed)
        output = "\n\n".join(block(d) for d in own if d not in failed)
        rule = rule_of(code)
        name = f"{code} {rule.name}"
        yield Case(name, errors=entries, output=output) if rule.unusable else Case(name, entries, output=output)


def entry(d: Diagnostic) -> tuple[str, str, str]:
    """A finding as kind, message and text of a failure."""
    return (f"{d.severity.label} {d.code}", f"{d.span.line}:{d.span.column}: {d.message}", block(d))


def block(d: Diagnostic) -> str:
    """A finding with its place, in lines."""
    first, *rest = told(d)
    place = f"{shown(d.file)}:{d.span.line}:{d.span.column}"
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
            found = ET.SubElement(node, tag, {"message": _legal(message), "type": kind})
            found.text = _legal(text)
    if case.output:
        ET.SubElement(node, "system-out").text = _legal(case.output)


def _totals(cases: Sequence[Case]) -> dict[str, str]:
    failed = sum(bool(case.failures) and not case.errors for case in cases)
    return {"tests": str(len(cases)), "failures": str(failed), "errors": str(sum(bool(c.errors) for c in cases))}


def _legal(text: str) -> str:
    return NO_XML.sub("", text)
