"""Differences as text, JSON and Markdown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.cli.formats.markdown import cell
from pidcfg.cli.formats.verification import verdict_markdown, verdict_text
from pidcfg.conversion.values import text_of
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from pidcfg.differences.result import Difference
    from pidcfg.results.differences import DiffResult


def render(fmt: str, result: DiffResult) -> str:
    """The differences in one of the formats."""
    return {"text": as_text, "json": json_v1, "markdown": as_markdown}[fmt](result)


def json_v1(result: DiffResult) -> str:
    """The public layout."""
    return json_text(result.to_json())


def as_text(result: DiffResult) -> str:
    """Loops that differ, the gravest difference first."""
    lines = [f"{result.before} -> {result.after}"]
    for entry in result.loops:
        if entry.status in {"added", "removed"}:
            lines += ["", f"{entry.loop}: {entry.status}"]
        elif entry.differences:
            lines += ["", entry.loop, *(_row(d) for d in entry.differences)]
    same = [entry.loop for entry in result.loops if entry.status == "same"]
    if same:
        lines += ["", f"the same: {', '.join(same)}"]
    if result.verified is not None:
        lines += ["", verdict_text(result.verified, pictures=False).rstrip()]
    return "\n".join(lines) + "\n"


def _row(d: Difference) -> str:
    note_text = f"  ({d.note})" if d.note else ""
    return f"  {d.risk:<8}  {d.field}: {text_of(d.before)} -> {text_of(d.after)}{note_text}"


def as_markdown(result: DiffResult) -> str:
    """Tables for a pull request."""
    lines = [f"### PID loops: `{result.before}` to `{result.after}`"]
    for entry in result.loops:
        if entry.status in {"added", "removed"}:
            lines += ["", f"**{entry.loop}** {entry.status}"]
        elif entry.differences:
            lines += ["", f"**{entry.loop}**", "", "| risk | field | before | after | |", "|---|---|---|---|---|"]
            lines += [
                "| "
                + " | ".join(cell(t) for t in (d.risk, d.field, text_of(d.before), text_of(d.after), d.note))
                + " |"
                for d in entry.differences
            ]
    if all(entry.status == "same" for entry in result.loops):
        lines += ["", "No difference."]
    if result.verified is not None:
        lines += verdict_markdown(result.verified)
    return "\n".join(lines) + "\n"
