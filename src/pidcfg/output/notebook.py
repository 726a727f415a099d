"""What notebooks show of results: every text of a file is escaped, and a picture stands in a frame of its own."""

from __future__ import annotations

from base64 import b64encode
from collections import Counter
from html import escape
from typing import TYPE_CHECKING, Any

from pidcfg.text.diagnostics import Severity
from pidcfg.text.signs import to_one_line

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from pidcfg.pictures import Chart
    from pidcfg.text.diagnostics import Diagnostic

MAX_ROWS = 200
"""Of a table, before the rest is counted."""
LEFT_ALIGN_STYLE = "<style>.pidcfg td,.pidcfg th{text-align:left!important;vertical-align:top}</style>"
"""Notebooks put everything in a cell of a table to its right end, sentences too."""
FRAME_STYLE = "width:100%;border:0"
HEAD_HEIGHT, PICTURE_HEIGHT, PANEL_HEIGHT, STRIP_HEIGHT, NOTE_HEIGHT = 90, 225, 125, 22, 18
"""Heights in pixels: of a heading, of a picture beside its panels, of a panel, of a strip and of a note."""


def cell_html(value: object) -> str:
    """A value in a table."""
    return escape(to_one_line("" if value is None else str(value)))


def table_html(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table of texts; of very many rows some."""
    cells = [[cell_html(value) for value in row] for row in rows]
    head = "".join(f"<th>{cell_html(column)}</th>" for column in columns)
    lines = "".join(f"<tr>{''.join(f'<td>{value}</td>' for value in row)}</tr>" for row in cells[:MAX_ROWS])
    more = f"<p>{len(cells) - MAX_ROWS} more rows</p>" if len(cells) > MAX_ROWS else ""
    rows_html = f"<table><thead><tr>{head}</tr></thead><tbody>{lines}</tbody></table>{more}"
    return f'<div class="pidcfg">{LEFT_ALIGN_STYLE}{rows_html}</div>' if cells else ""


def heading_html(title: str, text: str) -> str:
    """A heading with a line beside it."""
    return f"<p><b>{cell_html(title)}</b> {cell_html(text)}</p>"


def findings_html(findings: Sequence[Diagnostic], title: str = "") -> str:
    """Findings with their places and cures."""
    count = Counter(d.severity for d in findings)
    kinds = (Severity.ERROR, Severity.WARNING, Severity.INFO)
    totals = ", ".join(f"{count[s]} {s.label}{'' if count[s] == 1 else 's'}" for s in kinds)
    rows = [
        (f"{d.file}:{d.span.line}", d.severity.label, d.code, d.loop, d.message, d.plc_effect, d.help) for d in findings
    ]
    return heading_html(title, totals) + table_html(
        ("place", "", "rule", "loop", "finding", "what the PLC does", "cure"), rows
    )


def words_html(result: Any) -> str:
    """The memory of a configuration, or why there is none."""
    if result.image is None:
        return findings_html(result.findings, result.document.file)
    cells = result.image.cells
    rows = [(c.address, getattr(c, "hex", ""), getattr(c, "value", c.raw), c.loop, c.field) for c in cells]
    head = heading_html(result.document.file, f"{result.vendor}, {len(cells)} words")
    return head + table_html(("address", "hex", "value", "loop", "field"), rows)


def differences_html(result: Any) -> str:
    """What differs, loop by loop."""
    if result.refused:
        return findings_html(result.findings, result.refused)
    rows: list[tuple[object, ...]] = []
    for loop in result.loops:
        rows += [(loop.loop, state.kind, state.text, "", "", state.address) for state in loop.states]
        rows += [
            (loop.loop, d.risk, d.key or d.field, d.before, f"{d.after} {d.unit}", d.address) for d in loop.differences
        ]
        rows += [(loop.loop, loop.status, "", "", "", "")] if _has_status_only(loop) else []
    verdict = "the same" if result.same else ""
    return heading_html(f"{result.before} → {result.after}", verdict) + table_html(
        ("loop", "risk", "key", "before", "after", "register"), rows
    )


def _has_status_only(loop: Any) -> bool:
    return loop.status in {"added", "removed", "renamed", "moved"} and not (loop.states or loop.differences)


def run_html(result: Any) -> str:
    """The verdict on each loop and each expectation; with the trends where the run was recorded."""
    report = result.report
    if report is None:
        return findings_html(result.findings, "cannot run")
    head = heading_html(report.scenario, "passed" if result.passed else "FAILED")
    loops = table_html(
        ("loop", "verdict", "why"), ((name, one.verdict, one.missing) for name, one in report.loops.items())
    )
    expectations = table_html(
        ("expectation", "", "found"),
        ((v.text, "passed" if v.passed else "FAILED", _four_digits(v.value)) for v in report.expectations),
    )
    findings = findings_html(result.findings) if result.findings else ""
    from pidcfg.study.outcome import charts_of

    charts = charts_of(result.outcome)
    return head + loops + expectations + findings + (frame_of(charts, report.scenario) if charts else "")


def _four_digits(value: object) -> object:
    """A measured number, or the least and the greatest, as a person reads it."""
    if isinstance(value, list | tuple):
        return " to ".join(str(_four_digits(one)) for one in value)
    return f"{value:.4g}" if isinstance(value, float) else value


def frame_of(charts: Sequence[Chart], title: str) -> str:
    """Charts as a page within the page, whose styles touch nothing else."""
    from pidcfg.pictures.page import render_page

    height = HEAD_HEIGHT + sum(
        PICTURE_HEIGHT
        + PANEL_HEIGHT * len(one.panels)
        + STRIP_HEIGHT * len(one.strips)
        + NOTE_HEIGHT * (len(one.notes) + len(one.marks))
        for one in charts
    )
    return frame_of_page(render_page(charts, title=title), height)


def frame_of_page(page: str, height: int = 600) -> str:
    """A page within the page; ``height`` in pixels."""
    source = escape(page, quote=True)
    return f'<iframe sandbox="allow-scripts" style="{FRAME_STYLE};height:{height}px" srcdoc="{source}"></iframe>'


def image_html(kind: str, data: bytes) -> str:
    """An svg or a png; as an image no text in it is more than a picture."""
    mime = "svg+xml" if kind == "svg" else kind
    return f'<img style="max-width:100%" src="data:image/{mime};base64,{b64encode(data).decode()}">'
