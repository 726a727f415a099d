"""Findings as text and as JSON, as many commands print them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from pidcfg.control_characters import printable
from pidcfg.results.findings import counts, findings_data
from pidcfg.source import Document
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from pidcfg.diagnostics import Diagnostic

Documents = Mapping[str, Document]
MAX_LINE = 160


def text(findings: Sequence[Diagnostic], documents: Documents) -> str:
    """One block a finding: place, message, the line with a caret, what the PLC does, where it says so, the cure."""
    return "".join(_block(d, documents.get(d.file)) + "\n" for d in findings)


def _block(d: Diagnostic, doc: Document | None) -> str:
    loop = f" [{d.loop}]" if d.loop else ""
    lines = [f"{d.file}:{d.span.line}:{d.span.column}: {d.severity.label} {d.code}: {d.message}{loop}"]
    lines += _excerpt(d, doc)
    lines += [
        f"      = {label}: {value}"
        for label, value in (("PLC", d.plc_effect), ("see", d.reference), ("cure", d.help))
        if value
    ]
    return "\n".join(lines) + "\n"


def _excerpt(d: Diagnostic, doc: Document | None) -> list[str]:
    """The source line with a caret under the value, wherever a tab or a very long line leaves it."""
    rows = doc.lines if doc else []
    if not 0 < d.span.line <= len(rows) or not rows[d.span.line - 1].strip():
        return []
    row, start = printable(rows[d.span.line - 1]), d.span.column - 1
    end = d.span.end_column - 1 if d.span.end_line == d.span.line else len(row.rstrip())
    begin = max(0, start - MAX_LINE // 2) if len(row) > MAX_LINE else 0
    row = row[begin : begin + MAX_LINE]
    start, end = start - begin, min(end - begin, len(row))
    indent = "".join("\t" if c == "\t" else " " for c in row[:start])
    return [f" {d.span.line:>4} | {row.rstrip()}", f"      | {indent}{'^' * max(1, end - start)}"]


def summary(findings: Sequence[Diagnostic], files: int, skipped: int = 0) -> str:
    """One line that says how it went; ``skipped``: YAML files in folders that are not for pidcfg."""
    n = counts(findings)
    parts = [f"{n[s]} {s.label}{'s' if n[s] != 1 else ''}" for s in n]
    others = f"; {skipped} without a pidcfg key skipped" if skipped else ""
    return f"{files} file{'s' if files != 1 else ''} checked: {', '.join(parts)}{others}"


def json_v1(findings: Sequence[Diagnostic], documents: Documents) -> str:
    """The layout of the public interface, version 1."""
    return json_text(findings_data(findings, len(documents)))
