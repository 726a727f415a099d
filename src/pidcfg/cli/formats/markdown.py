"""Format ``markdown``: tables for comments of pull requests and for the summary of a job."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from pidcfg.cli.formats.findings import sentence
from pidcfg.cli.formats.format import Format, Kind
from pidcfg.cli.formats.reporters import summary
from pidcfg.control_characters import one_line

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.cli.formats.findings import Findings
    from pidcfg.diagnostics import Diagnostic

MARKS = re.compile(r"[\\|]|(?<=\])\(")
"""What would end a cell, and the sign that makes a link of a text in brackets."""
MOST = 500
"""Rows of a table: GitHub drops a summary of more than a megabyte."""


def cell(text: str) -> str:
    """Text that stays in its cell of a Markdown table, and is no picture or link there."""
    return MARKS.sub(r"\\\g<0>", one_line(text)).replace("&", "&amp;").replace("<", "&lt;")


def findings_markdown(findings: Findings) -> str:
    """How many findings there are, and a row for each of the first ones."""
    return "".join(f"{line}\n" for line in _lines(findings))


def _lines(findings: Findings) -> Iterator[str]:
    yield f"**{summary(findings.reported, len(findings.documents))}**"
    if not findings.reported:
        return
    yield from ("", "| | place | rule | finding |", "|---|---|---|---|")
    yield from map(_row, findings.reported[:MOST])
    if len(findings.reported) > MOST:
        yield from ("", f"… and {len(findings.reported) - MOST} more")


def _row(d: Diagnostic) -> str:
    """A finding: what it is, and below it in the same cell what the PLC would do and the cure."""
    more = ((d.plc_effect, "PLC"), (d.help, "cure"))
    said = [sentence(d), *(f"{label}: {text}" for text, label in more if text)]
    place = f"{d.file}:{d.span.line}:{d.span.column}"
    cells = (d.severity.label, cell(place), d.code, "<br>".join(map(cell, said)))
    return f"| {' | '.join(cells)} |"


FORMAT = Format("comments of pull requests, summaries of jobs", "md", Kind.LINES, findings_markdown)
