"""Findings as text and as JSON, as many commands print them."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING

from pidcfg.control_characters import one_line, printable
from pidcfg.diagnostics import Severity
from pidcfg.display_width import width_of
from pidcfg.results.findings import counts, findings_data
from pidcfg.source import Document
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from pidcfg.diagnostics import Diagnostic

Documents = Mapping[str, Document]
MAX_LINE = 160
MOST_PLACES = 24
"""Further places that a line names before it only counts."""


def text(findings: Sequence[Diagnostic], documents: Documents) -> str:
    """One block a rule and cure: place, message, the line with a caret, the PLC, the manual, the cure, further places.

    Grouping is for the eye alone: findings are collected, counted, ignored and known one by one before.
    """
    groups: dict[Hashable, list[Diagnostic]] = {}
    for d in findings:
        groups.setdefault((d.file, d.code, d.severity, d.reference, d.help, d.plc_effect is None), []).append(d)
    return "".join(_block(group, documents.get(group[0].file)) + "\n" for group in groups.values())


def _block(group: Sequence[Diagnostic], doc: Document | None) -> str:
    d = group[0]
    loop = f" [{d.loop}]" if d.loop else ""
    lines = [f"{d.file}:{d.span.line}:{d.span.column}: {d.severity.label} {d.code}: {d.message}{loop}"]
    lines += _excerpt(d, doc)
    lines += [
        f"      = {label}: {value}"
        for label, value in (("PLC", d.plc_effect), ("see", d.reference), ("cure", d.help))
        if value
    ]
    lines += [f"      = also: {row}" for row in _further(group)]
    return "\n".join(map(one_line, lines)) + "\n"


def _further(group: Sequence[Diagnostic]) -> list[str]:
    """The other findings of a group: those that say the same, and infos, by name; of the rest what each says."""
    kinds: dict[str, list[Diagnostic]] = {}
    for d in group:
        kinds.setdefault("" if d.severity is Severity.INFO else _words(d), []).append(d)
    (_, *same), *rest = kinds.values()
    rows = [_places(same)] if same else []
    for first, *others in rest:
        loop = f" [{first.loop}]" if first.loop else ""
        also = f", and {_places(others)}" if others else ""
        rows.append(f"{first.span.line}:{first.span.column}: {first.message}{loop}{also}")
    return rows


def _places(findings: Sequence[Diagnostic]) -> str:
    """Loops and lines of findings."""
    places = [f"{d.loop} (line {d.span.line})" if d.loop else f"line {d.span.line}" for d in findings]
    if len(places) > MOST_PLACES:
        places[MOST_PLACES:] = [f"{len(places) - MOST_PLACES} more (--format concise has a line for each)"]
    return ", ".join(places)


def _words(d: Diagnostic) -> str:
    """What a finding says, whichever loop it says it of; what concerns several loops names them all."""
    if not d.loop or d.with_loops:
        return d.message
    return without_word(d.message, d.loop)


def without_word(text: str, word: str) -> str:
    """A text without a word, wherever no letter, digit or underscore stands beside it."""
    left, kept, at = [], 0, text.find(word)
    while at >= 0:
        end = at + len(word)
        if any(c.isalnum() or c == "_" for c in text[max(at - 1, 0) : at] + text[end : end + 1]):
            at = text.find(word, at + 1)
            continue
        left.append(text[kept:at])
        kept, at = end, text.find(word, end)
    return "".join(left) + text[kept:]


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
    indent = "".join("\t" if c == "\t" else " " * width_of(c) for c in row[:start])
    return [f" {d.span.line:>4} | {row.rstrip()}", f"      | {indent}{'^' * max(1, width_of(row[start:end]))}"]


def summary(findings: Sequence[Diagnostic], files: int, skipped: int = 0, left_out: str = "") -> str:
    """One line that says how it went; ``skipped``: YAML files in folders that are not for pidcfg."""
    n = counts(findings)
    parts = [f"{n[s]} {s.label}{'s' if n[s] != 1 else ''}" for s in n]
    others = f"; {skipped} without a pidcfg key skipped" if skipped else ""
    others += f"; {one_line(left_out)}" if left_out else ""
    return f"{files} file{'s' if files != 1 else ''} checked: {', '.join(parts)}{others}"


def json_v1(findings: Sequence[Diagnostic], documents: Documents) -> str:
    """The layout of the public interface, version 1."""
    return json_text(findings_data(findings, len(documents)))
