"""Format ``sarif``: SARIF 2.1.0, which GitHub code scanning, Azure DevOps and editors read."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pidcfg import __version__
from pidcfg.cli.formats.findings import STDIN, details, fingerprints, uri
from pidcfg.cli.formats.format import Format, Kind
from pidcfg.diagnostics import START, Diagnostic, Edit, Severity, Span, number_of
from pidcfg.validate.catalog import rule_of
from pidcfg.validate.pages import page
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.cli.formats.findings import Findings
    from pidcfg.validate.rule import Rule

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


FORMAT = Format("GitHub code scanning, Azure DevOps, editors: SARIF 2.1.0", "sarif", Kind.JSON, findings_sarif)
