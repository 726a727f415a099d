"""The report of a conversion as text, JSON and Markdown: what became of every field of every loop."""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

from pidcfg.cli.files.plots import in_characters
from pidcfg.cli.formats.markdown import cell
from pidcfg.conversion.ledger import WORST
from pidcfg.conversion.values import text_of
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion.ledger import Change
    from pidcfg.results.conversion import ConvertResult
    from pidcfg.scenario.verify import Verified

TABLE = ("", "| kind | field | before | after | |", "|---|---|---|---|---|")
WARN_PERCENT = 1.0
"""A value that the target holds further off than this is warned of."""


def render(fmt: str, result: ConvertResult) -> str:
    """The report in one of its formats."""
    return {"text": text, "json": json_v1, "markdown": as_markdown}[fmt](result)


def json_v1(result: ConvertResult) -> str:
    """The public layout."""
    return json_text(result.to_json())


def text(result: ConvertResult, *, changes: bool = True, apart: bool = True) -> str:
    """For people: the changes, and how far both sides lie apart where that was asked for."""
    parts = [as_text(result)] if changes else []
    return "".join(parts + ([verified_text(result.verified)] if apart and result.verified is not None else []))


def verified_text(loops: Sequence[Verified]) -> str:
    """How far both sides lie apart, loop by loop, with a picture of each for the terminal that stderr is."""
    lines = ["verified by simulation: a step of the set point, then a disturbance"]
    for loop in loops:
        ratio = "" if loop.iae_ratio is None else f", ratio of IAE {loop.iae_ratio:.4g}"
        apart = f"PV at most {loop.pv_percent:.3g} % of its range apart, output {loop.output_percent:.3g} %"
        lines += [f"\n{loop.loop}: {apart}{ratio}", in_characters(replace(loop.chart, title=""), sys.stderr)]
    return "\n".join(lines) + "\n"


def as_text(result: ConvertResult) -> str:
    """Every change that is worth reading, loop by loop; what came over exactly and needs no word is counted."""
    lines = [f"{result.source} to {result.target}"]
    for name, changes in result.loops:
        lines.append(f"\n{name}: {_counted(changes)}")
        lines += dict.fromkeys(_line(change) for change in _worth_reading(changes))
    return "\n".join(lines) + "\n"


def _counted(changes: Sequence[Change]) -> str:
    count = Counter(change.kind for change in changes)
    return ", ".join(f"{count[kind]} {kind}" for kind in WORST if count[kind]) or "nothing to convert"


def _worth_reading(changes: Sequence[Change]) -> list[Change]:
    """The gravest changes first; without what came over exactly and needs no word."""
    noted = [change for change in changes if change.kind != "exact" or change.note]
    return sorted(noted, key=lambda change: -WORST.index(change.kind))


def as_markdown(result: ConvertResult) -> str:
    """A table a loop, as in ``pidcfg diff --format markdown``."""
    lines = [f"### PID loops: {result.source} to {result.target}"]
    for name, changes in result.loops:
        lines += ["", f"**{cell(name)}**: {_counted(changes)}"]
        rows = dict.fromkeys(_cells(change) for change in _worth_reading(changes))
        lines += [*TABLE, *rows] if rows else []
    if result.verified is not None:
        lines += ["", "**Verified by simulation**: a step of the set point, then a disturbance", ""]
        lines += ["| loop | PV apart, % of its range | output apart, % | ratio of IAE |", "|---|---|---|---|"]
    for entry in result.verified or ():
        ratio = "-" if entry.iae_ratio is None else f"{entry.iae_ratio:.4g}"
        lines.append(f"| {cell(entry.loop)} | {entry.pv_percent:.3g} | {entry.output_percent:.3g} | {ratio} |")
    return "\n".join(lines) + "\n"


def _cells(change: Change) -> str:
    error = f"{change.error_percent:.3g} % off" if change.error_percent else ""
    remark = "; ".join(part for part in (error, change.note) if part)
    values = (change.kind, change.field, text_of(change.source), text_of(change.target), remark)
    return f"| {' | '.join(cell(value) for value in values)} |"


def _line(change: Change) -> str:
    values = f"{text_of(change.source)} -> {text_of(change.target)}"
    if change.kind == "dropped":
        values = text_of(change.source)
    elif change.source is None:
        values = text_of(change.target)
    error = f" ({change.error_percent:.3g} % off)" if change.error_percent else ""
    mark = "!" if change.error_percent > WARN_PERCENT else " "
    note = f"\n             {change.note}" if change.note else ""
    return f" {mark}{change.kind:<8} {change.field}: {values}{error}{note}"
