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
    cell,
    details,
    display_name,
    fingerprints,
    sentence,
    summary,
    uri,
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
    return findings_format.text(findings.reported, findings.documents, brief=findings.brief)


def runs_text(outcomes: Sequence[Outcome], fails: Severity) -> str:
    """A line a loop, what failed, and the verdict of each run."""
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
    return "".join(to_printable(row).replace("\n", " ") + "\n" for row in rows)


CONCISE = Format("people and editors: one line a finding", "txt", Kind.PLAIN, findings_concise)

# --- Format ``json``: the public layout, for programs -----------------------------------------------------------------


def findings_json(findings: Findings) -> str:
    """The layout that `pidcfg schema output-validate` describes."""
    return findings_format.json_v1(findings.reported, findings.documents)


def runs_json(outcomes: Sequence[Outcome], fails: Severity) -> str:
    """The layout that `pidcfg schema output-simulate` describes."""
    from pidcfg.cli.formats.runs import json_v1

    del fails
    return json_v1(outcomes)


JSON = Format("programs; the layout is [published](#json) and stays", "json", Kind.JSON, findings_json, runs_json)

# --- Format ``markdown``: tables for comments of pull requests and for the summary of a job ---------------------------

MAX_FINDINGS = 500
"""Rows of a table: GitHub drops a summary of more than a megabyte."""


def findings_markdown(findings: Findings) -> str:
    """How many findings there are, and a row for each of the first ones."""
    return "".join(f"{line}\n" for line in _markdown_lines(findings))


def _markdown_lines(findings: Findings) -> Iterator[str]:
    yield f"**{summary(findings.reported, len(findings.documents))}**"
    if not findings.reported:
        return
    yield from ("", "| | place | rule | finding |", "|---|---|---|---|")
    yield from map(_table_row, findings.reported[:MAX_FINDINGS])
    if len(findings.reported) > MAX_FINDINGS:
        yield from ("", f"… and {len(findings.reported) - MAX_FINDINGS} more")


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
    properties = ",".join(f"{key}={escape_data(value, PROPERTY)}" for key, value in values.items())
    place = f"{d.file}:{d.span.line}:{d.span.column}: " if d.file == STDIN else ""
    return f"::{COMMANDS[d.severity]} {properties}::{escape_data(place + chr(10).join(details(d)), DATA)}"


def _place(d: Diagnostic) -> dict[str, str]:
    """GitHub takes a column only together with a single line."""
    values = {"file": display_name(d.file), "line": str(d.span.line), "endLine": str(d.span.end_line)}
    return values | ({"col": str(d.span.column)} if d.span.line == d.span.end_line else {})


def escape_data(text: str, table: dict[str, str]) -> str:
    """Text whose special characters are written as GitHub's runner reads them back; other control characters go."""
    return to_printable("".join(table.get(c, c) for c in text))


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


GITLAB = Format("GitLab's Code Quality report", "json", Kind.JSON, findings_gitlab)

# --- Format ``rdjson``: the Reviewdog Diagnostic Format, of which reviewdog makes comments on any code-hosting site ---


def findings_rdjson(findings: Findings) -> str:
    """One result with a diagnostic a finding; columns count the bytes of UTF-8, as the format wants it."""
    rows = {file: doc.lines for file, doc in findings.documents.items()}
    listed = [_diagnostic(d, rows.get(d.file, [])) for d in findings.reported]
    return json_text({"source": {"name": "pidcfg"}, "diagnostics": listed})


def _diagnostic(d: Diagnostic, rows: Sequence[str]) -> Data:
    """A finding; a correction of several places is left out, since each suggestion is applied by itself."""
    path = "stdin" if d.file == STDIN else display_name(d.file)
    page_of_rule = url_of(d.code, absolute=True)
    suggestions = [{"range": _bytes(edit.span, rows), "text": edit.text} for edit in d.edits if len(d.edits) == 1]
    place = {"start": {"line": 1}} if d.span == START else _bytes(d.span, rows)
    return {
        "message": "\n".join(details(d)),
        "location": {"path": path, "range": place},
        "severity": d.severity.name,
        "code": {"value": d.code} | ({"url": page_of_rule} if page_of_rule else {}),
        **({"suggestions": suggestions} if suggestions else {}),
    }


def _bytes(span: Span, rows: Sequence[str]) -> dict[str, dict[str, int]]:
    """A place with its columns in bytes; the end exclusive."""

    def position(line: int, column: int) -> dict[str, int]:
        before = rows[line - 1][: column - 1] if 0 < line <= len(rows) else ""
        return {"line": line, "column": column + len(before.encode("utf-8", "replace")) - len(before)}

    return {"start": position(span.line, span.column), "end": position(span.end_line, span.end_column)}


RDJSON = Format(
    "[reviewdog](https://github.com/reviewdog/reviewdog): comments on a pull request of any site",
    "rdjson",
    Kind.JSON,
    findings_rdjson,
)

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
        "tool": {"driver": {"name": "pidcfg", "version": VERSION, "rules": [_rule(rule_of(code)) for code in used]}},
        "originalUriBaseIds": {BASE: {"description": {"text": "The checkout, or the folder that pidcfg ran in."}}},
        "columnKind": "unicodeCodePoints",
        "results": [
            _result(d, numbers[d.code], key) | ({"suppressions": [reason]} if reason else {})
            for d, key, reason in zip(every.reported, prints, why, strict=True)
        ],
    }
    document = {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}
    return json_text(document)


def _rule(rule: Rule) -> Data:
    why, fix = (part[:1].upper() + part[1:] for part in (rule.doc_part("Why"), rule.doc_part("Fix")))
    return {
        "id": rule.code,
        "name": rule.name,
        "shortDescription": {"text": rule.title},
        "fullDescription": {"text": f"{rule.title} {why}"},
        "help": {"text": f"Why: {why}\n\nCure: {fix}\n\nBasis: {rule.basis}.", "markdown": rule_page(text_of(rule))},
        "defaultConfiguration": {"level": LEVELS[rule.severity]},
    }


def _result(d: Diagnostic, number: int, fingerprint: str) -> Data:
    location: Data = {"physicalLocation": {"artifactLocation": _artifact(d.file), "region": _region(d.span)}}
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


def _artifact(file: str) -> Data:
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


def _fix(d: Diagnostic, edits: Sequence[Edit]) -> Data:
    replacements = [{"deletedRegion": _replaced(e.span), "insertedContent": {"text": e.text}} for e in edits]
    change = {"artifactLocation": _artifact(d.file), "replacements": replacements}
    return {"description": {"text": d.help or d.message}, "artifactChanges": [change]}


def _replaced(span: Span) -> dict[str, int]:
    """An edit's place, which may be the very beginning of a file."""
    place = (span.line, span.column, span.end_line, span.end_column)
    return dict(zip(("startLine", "startColumn", "endLine", "endColumn"), place, strict=True))


SARIF = Format("GitHub code scanning, Azure DevOps, editors: SARIF 2.1.0", "sarif", Kind.JSON, findings_sarif)
