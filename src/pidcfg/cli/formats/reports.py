"""Findings, runs and batches in every format: for people, programs, and CI systems."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pidcfg.about import VERSION
from pidcfg.cli.formats import Format, Kind
from pidcfg.cli.formats import findings as findings_format
from pidcfg.cli.formats.findings import (
    STDIN,
    Findings,
    display_name,
    file_uri,
    finding_lines,
    finding_sentence,
    fingerprints,
    markdown_cell,
    summary_line,
)
from pidcfg.text.diagnostics import START, Diagnostic, Edit, Severity, Span, number_of
from pidcfg.text.signs import to_printable
from pidcfg.text.writer import json_text
from pidcfg.validate import rule_page
from pidcfg.validate.catalog import rule_of, text_of, url_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.study.outcome import Outcome
    from pidcfg.text.paths import Data
    from pidcfg.validate.rule import Rule

# --- Format ``text``: a block a finding, with the line and a caret; a section a run -----------------------------------


def findings_text(findings: Findings) -> str:
    """For people in front of a terminal."""
    return findings_format.findings_text(findings.reported, findings.documents, brief=findings.brief)


def runs_text(outcomes: Sequence[Outcome], failing_severity: Severity) -> str:
    """A line a loop, what failed, and the verdict of each run."""
    from pidcfg.cli.formats.runs import simulations_text

    del failing_severity
    return simulations_text(outcomes)


TEXT = Format("people; the default", "txt", Kind.PLAIN, findings_text, runs_text)

# --- Format ``concise``: one line a finding, as compilers print it and editors jump to it -----------------------------


def findings_concise(findings: Findings) -> str:
    """``file:line:column: severity CODE message [loop]``."""
    rows = (
        f"{d.file}:{d.span.line}:{d.span.column}: {d.severity.label} {d.code} {' '.join(finding_sentence(d).split())}"
        for d in findings.reported
    )
    return "".join(to_printable(row).replace("\n", " ") + "\n" for row in rows)


CONCISE = Format("people and editors: one line a finding", "txt", Kind.PLAIN, findings_concise)

# --- Format ``json``: the public layout, for programs -----------------------------------------------------------------


def findings_json(findings: Findings) -> str:
    """The layout that `pidcfg schema output-validate` describes."""
    return findings_format.json_v1(findings.reported, findings.documents)


def runs_json(outcomes: Sequence[Outcome], failing_severity: Severity) -> str:
    """The layout that `pidcfg schema output-simulate` describes."""
    from pidcfg.cli.formats.runs import json_v1

    del failing_severity
    return json_v1(outcomes)


JSON = Format("programs; the layout is [published](#json) and stays", "json", Kind.JSON, findings_json, runs_json)

# --- Format ``markdown``: tables for comments of pull requests and for the summary of a job ---------------------------

MAX_FINDINGS = 500
"""Rows of a table: GitHub drops a summary of more than a megabyte."""


def findings_markdown(findings: Findings) -> str:
    """How many findings there are, and a row for each of the first ones."""
    return "".join(f"{line}\n" for line in _markdown_lines(findings))


def _markdown_lines(findings: Findings) -> Iterator[str]:
    yield f"**{summary_line(findings.reported, len(findings.documents))}**"
    if not findings.reported:
        return
    yield from ("", "| | place | rule | finding |", "|---|---|---|---|")
    yield from map(_table_row, findings.reported[:MAX_FINDINGS])
    if len(findings.reported) > MAX_FINDINGS:
        yield from ("", f"… and {len(findings.reported) - MAX_FINDINGS} more")


def _table_row(d: Diagnostic) -> str:
    """A finding: what it is, and below it in the same cell what the PLC would do and the cure."""
    more = ((d.plc_effect, "PLC"), (d.help, "cure"))
    lines = [finding_sentence(d), *(f"{label}: {text}" for text, label in more if text)]
    place = f"{d.file}:{d.span.line}:{d.span.column}"
    cells = (d.severity.label, markdown_cell(place), d.code, "<br>".join(map(markdown_cell, lines)))
    return f"| {' | '.join(cells)} |"


MARKDOWN = Format("comments of pull requests, summaries of jobs", "md", Kind.LINES, findings_markdown)

# --- Format ``github``: workflow commands, which GitHub shows as annotations beside the lines of a pull request -------

GITHUB_COMMANDS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "notice"}
DATA_ESCAPES = {"%": "%25", "\r": "%0D", "\n": "%0A"}
PROPERTY_ESCAPES = {**DATA_ESCAPES, ":": "%3A", ",": "%2C"}


def findings_github(findings: Findings) -> str:
    """One command a finding."""
    return "".join(f"{_workflow_command(d)}\n" for d in findings.reported)


def _workflow_command(d: Diagnostic) -> str:
    loop = f" [{d.loop}]" if d.loop else ""
    values = {} if d.file == STDIN else _github_place(d)
    values["title"] = f"pidcfg {d.code}{loop}"
    properties = ",".join(f"{key}={escape_data(value, PROPERTY_ESCAPES)}" for key, value in values.items())
    place = f"{d.file}:{d.span.line}:{d.span.column}: " if d.file == STDIN else ""
    text = escape_data(place + "\n".join(finding_lines(d)), DATA_ESCAPES)
    return f"::{GITHUB_COMMANDS[d.severity]} {properties}::{text}"


def _github_place(d: Diagnostic) -> dict[str, str]:
    """GitHub takes a column only together with a single line."""
    values = {"file": display_name(d.file), "line": str(d.span.line), "endLine": str(d.span.end_line)}
    return values | ({"col": str(d.span.column)} if d.span.line == d.span.end_line else {})


def escape_data(text: str, table: dict[str, str]) -> str:
    """Text whose special characters are written as GitHub's runner reads them back; other control characters go."""
    return to_printable("".join(table.get(c, c) for c in text))


GITHUB = Format("annotations in GitHub Actions; the default there", "github", Kind.CI_COMMANDS, findings_github)

# --- Format ``gitlab``: the Code Quality report that GitLab shows in merge requests -----------------------------------

GITLAB_SEVERITIES = {Severity.ERROR: "major", Severity.WARNING: "minor", Severity.INFO: "info"}


def findings_gitlab(findings: Findings) -> str:
    """A list of issues."""
    rows = [
        {
            "description": finding_sentence(d),
            "check_name": d.code,
            "fingerprint": fingerprint,
            "severity": GITLAB_SEVERITIES[d.severity],
            "location": {
                "path": "stdin" if d.file == STDIN else display_name(d.file),
                "lines": {"begin": d.span.line, "end": d.span.end_line},
            },
        }
        for d, fingerprint in zip(findings.reported, fingerprints(findings), strict=True)
    ]
    return json_text(rows)


GITLAB = Format("GitLab's Code Quality report", "json", Kind.JSON, findings_gitlab)

# --- Format ``rdjson``: the Reviewdog Diagnostic Format, of which reviewdog makes comments on any code-hosting site ---


def findings_rdjson(findings: Findings) -> str:
    """One result with a diagnostic a finding; columns count the bytes of UTF-8, as the format wants it."""
    rows = {file: doc.lines for file, doc in findings.documents.items()}
    diagnostics = [_rdjson_diagnostic(d, rows.get(d.file, [])) for d in findings.reported]
    return json_text({"source": {"name": "pidcfg"}, "diagnostics": diagnostics})


def _rdjson_diagnostic(d: Diagnostic, rows: Sequence[str]) -> Data:
    """A finding; a correction of several places is left out, since each suggestion is applied by itself."""
    path = "stdin" if d.file == STDIN else display_name(d.file)
    page_of_rule = url_of(d.code, absolute=True)
    suggestions = [{"range": _byte_range(edit.span, rows), "text": edit.text} for edit in d.edits if len(d.edits) == 1]
    place = {"start": {"line": 1}} if d.span == START else _byte_range(d.span, rows)
    return {
        "message": "\n".join(finding_lines(d)),
        "location": {"path": path, "range": place},
        "severity": d.severity.name,
        "code": {"value": d.code} | ({"url": page_of_rule} if page_of_rule else {}),
        **({"suggestions": suggestions} if suggestions else {}),
    }


def _byte_range(span: Span, rows: Sequence[str]) -> dict[str, dict[str, int]]:
    """A place with its columns in bytes; the end exclusive."""

    def position(line: int, column: int) -> dict[str, int]:
        text_before = rows[line - 1][: column - 1] if 0 < line <= len(rows) else ""
        return {"line": line, "column": column + len(text_before.encode("utf-8", "replace")) - len(text_before)}

    return {"start": position(span.line, span.column), "end": position(span.end_line, span.end_column)}


RDJSON = Format(
    "[reviewdog](https://github.com/reviewdog/reviewdog): comments on a pull request of any site",
    "rdjson",
    Kind.JSON,
    findings_rdjson,
)

# --- Format ``sarif``: SARIF 2.1.0, which GitHub code scanning, Azure DevOps and editors read -------------------------

SARIF_SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
SARIF_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}
URI_BASE = "%SRCROOT%"
FINGERPRINT_NAME = "pidcfgFinding/v1"


def findings_sarif(findings: Findings) -> str:
    """One run, with the rules that are broken."""
    suppressed = [d for d, _ in findings.suppressed]
    all_findings = replace(findings, reported=[*findings.reported, *suppressed])
    codes = sorted({d.code for d in all_findings.reported}, key=number_of)
    numbers = {code: i for i, code in enumerate(codes)}
    keys = fingerprints(all_findings)
    reasons = [None] * len(findings.reported) + [_sarif_suppression(reason) for _, reason in findings.suppressed]
    run = {
        "tool": {
            "driver": {"name": "pidcfg", "version": VERSION, "rules": [_sarif_rule(rule_of(code)) for code in codes]}
        },
        "originalUriBaseIds": {URI_BASE: {"description": {"text": "The checkout, or the folder that pidcfg ran in."}}},
        "columnKind": "unicodeCodePoints",
        "results": [
            _sarif_result(d, numbers[d.code], key) | ({"suppressions": [reason]} if reason else {})
            for d, key, reason in zip(all_findings.reported, keys, reasons, strict=True)
        ],
    }
    document = {"$schema": SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}
    return json_text(document)


def _sarif_rule(rule: Rule) -> Data:
    why, fix = (part[:1].upper() + part[1:] for part in (rule.doc_part("Why"), rule.doc_part("Fix")))
    return {
        "id": rule.code,
        "name": rule.name,
        "shortDescription": {"text": rule.title},
        "fullDescription": {"text": f"{rule.title} {why}"},
        "help": {"text": f"Why: {why}\n\nCure: {fix}\n\nBasis: {rule.basis}.", "markdown": rule_page(text_of(rule))},
        "defaultConfiguration": {"level": SARIF_LEVELS[rule.severity]},
    }


def _sarif_result(d: Diagnostic, number: int, fingerprint: str) -> Data:
    location: Data = {
        "physicalLocation": {"artifactLocation": _sarif_artifact(d.file), "region": _sarif_region(d.span)}
    }
    if d.path:
        location["logicalLocations"] = _logical_locations(d)
    return {
        "ruleId": d.code,
        "ruleIndex": number,
        "level": SARIF_LEVELS[d.severity],
        "message": {"text": "\n".join(finding_lines(d))},
        "locations": [location],
        "partialFingerprints": {FINGERPRINT_NAME: fingerprint},
        **({"fixes": [_sarif_fix(d, d.edits)]} if d.edits else {}),
    }


def _sarif_suppression(reason: str | None) -> dict[str, str]:
    """Why a result is not reported: a comment, or a baseline."""
    if reason is None:
        return {"kind": "external"}
    return {"kind": "inSource", **({"justification": reason} if reason else {})}


def _sarif_artifact(file: str) -> Data:
    reference, relative = file_uri(file)
    if file == STDIN:
        return {"uri": reference, "description": {"text": "standard input"}}
    return {"uri": reference, "uriBaseId": URI_BASE} if relative else {"uri": reference}


def _sarif_region(span: Span) -> dict[str, int]:
    """The place in a file; what concerns all of a file is shown at its first line."""
    if span == START:
        return {"startLine": 1}
    return {
        "startLine": span.line,
        "startColumn": span.column,
        "endLine": span.end_line,
        "endColumn": span.end_column,
    }


def _logical_locations(d: Diagnostic) -> list[dict[str, str]]:
    """The key of a finding, and the loop that it belongs to."""
    last = next((step for step in reversed(d.path) if isinstance(step, str)), "")
    key = {"name": last, "fullyQualifiedName": d.where, "kind": "property"}
    return [key, {"name": d.loop, "kind": "object"}] if d.loop else [key]


def _sarif_fix(d: Diagnostic, edits: Sequence[Edit]) -> Data:
    replacements = [{"deletedRegion": _edit_region(e.span), "insertedContent": {"text": e.text}} for e in edits]
    change = {"artifactLocation": _sarif_artifact(d.file), "replacements": replacements}
    return {"description": {"text": d.help or d.message}, "artifactChanges": [change]}


def _edit_region(span: Span) -> dict[str, int]:
    """An edit's place, which may be the very beginning of a file."""
    place = (span.line, span.column, span.end_line, span.end_column)
    return dict(zip(("startLine", "startColumn", "endLine", "endColumn"), place, strict=True))


SARIF = Format("GitHub code scanning, Azure DevOps, editors: SARIF 2.1.0", "sarif", Kind.JSON, findings_sarif)
