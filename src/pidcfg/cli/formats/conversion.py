"""The report of a conversion as text, JSON and Markdown: what became of every field of every loop."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from decimal import Decimal
from textwrap import fill
from typing import TYPE_CHECKING

from pidcfg.cli.formats.markdown import cell
from pidcfg.cli.formats.verification import verdict_markdown, verdict_text
from pidcfg.control_characters import one_line
from pidcfg.conversion.ledger import LOSSES, WORST
from pidcfg.conversion.values import text_of
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pidcfg.conversion.ledger import Change
    from pidcfg.conversion.pipeline import LoopReport
    from pidcfg.results.conversion import ConvertResult

TABLE = ("", "| kind | field | before | after | |", "|---|---|---|---|---|")
WIDTH = 100
WARN_PERCENT = 1.0
"""A value that the target holds further off than this is warned of."""


def render(fmt: str, result: ConvertResult) -> str:
    """The report in one of its formats."""
    return {"text": text, "json": json_v1, "markdown": as_markdown}[fmt](result)


def json_v1(result: ConvertResult) -> str:
    """The public layout."""
    return json_text(result.to_json())


def text(result: ConvertResult, *, changes: bool = True, losses: bool = False, apart: bool = True) -> str:
    """For people: the changes, or the losses alone, and the verdict of the battery where that was asked for."""
    parts = [as_text(result) if changes else losses_of(result)] if changes or losses else []
    return "".join(parts + ([verdict_text(result.verified)] if apart and result.verified is not None else []))


def as_text(result: ConvertResult) -> str:
    """Every change that is worth reading, loop by loop; what came over exactly and needs no word is counted."""
    lines = [f"{result.source} to {result.target}"]
    for loop in result.loops:
        lines.append(f"\n{loop.loop}: {_counted(loop)}")
        lines += dict.fromkeys(_line(change) for change in _worth_reading(loop.changes))
        if unneeded := _unneeded(loop.changes):
            lines.append(fill(f"  not needed there: {', '.join(unneeded)}", WIDTH, subsequent_indent="    "))
    if result.faults and result.ok:
        lines += ["", f"what the rules of {result.target} say about the result:"]
        for d in result.faults:
            where = f" [{d.loop}]" if d.loop else ""
            lines.append(f"  {d.severity.label} {d.code}: {one_line(d.message + where)}")
    return "\n".join(lines) + "\n"


def losses_of(result: ConvertResult) -> str:
    """What is lost, loop by loop, and nothing else."""
    lines = []
    for loop in result.loops:
        rows = dict.fromkeys(_line(change) for change in _worth_reading(loop.changes) if change.loss)
        if rows or loop.status == "dropped":
            lines += [f"{loop.loop}: {_counted(loop)}", *rows]
    return "\n".join(lines) + "\n"


def _counted(loop: LoopReport) -> str:
    if loop.status == "dropped":
        return f"dropped: {loop.reason}"
    changes = [change for change in loop.changes if not _is_unneeded(change)]
    count = Counter(change.kind for change in changes)
    text = ", ".join(f"{count[kind]} {kind}" for kind in WORST if count[kind]) or "nothing to convert"
    lost = sum(change.loss for change in changes)
    return f"{text}; {lost} lost" if lost else text


def _is_unneeded(change: Change) -> bool:
    """Whether a field is gone and nothing is lost with it."""
    return change.kind == "dropped" and not change.loss


def _unneeded(changes: Sequence[Change]) -> list[str]:
    return [change.field for change in changes if _is_unneeded(change)]


def _worth_reading(changes: Sequence[Change]) -> list[Change]:
    """Losses first, then by kind; without what came over exactly and needs no word, or is not needed."""
    noted = [row for row in changes if (row.kind != "exact" or row.note) and not _is_unneeded(row)]
    return sorted(map(_apart(changes), noted), key=lambda row: (not row.loss, -WORST.index(row.kind)))


def _apart(changes: Sequence[Change]) -> Callable[[Change], Change]:
    """Names the key of the result, too, where one of the source goes to several."""
    places: dict[str, set[str]] = {}
    for row in changes:
        places.setdefault(row.field, set()).add(row.target_field)
    return lambda row: (
        replace(row, field=f"{row.field} to {row.target_field}")
        if row.target_field and len(places[row.field] - {""}) > 1
        else row
    )


def as_markdown(result: ConvertResult) -> str:
    """A table a loop, as in ``pidcfg diff --format markdown``."""
    lines = [f"### PID loops: {result.source} to {result.target}"]
    for loop in result.loops:
        lines += ["", f"**{cell(loop.loop)}**: {cell(_counted(loop))}"]
        rows = dict.fromkeys(_cells(change) for change in _worth_reading(loop.changes))
        lines += [*TABLE, *rows] if rows else []
        if unneeded := _unneeded(loop.changes):
            lines += ["", f"Not needed there: {cell(', '.join(unneeded))}"]
    if result.faults:
        lines += ["", f"**What the rules of {result.target} say about the result**", ""]
        lines += ["| severity | code | loop | finding |", "|---|---|---|---|"]
    for d in result.faults:
        lines.append(f"| {d.severity.label} | {d.code} | {cell(d.loop or '')} | {cell(d.message)} |")
    if result.verified is not None:
        lines += verdict_markdown(result.verified)
    return "\n".join(lines) + "\n"


def _error(change: Change) -> str:
    """How far a value is off, with both sides in one unit where the line shows them in two."""
    if not change.error_percent:
        return ""
    text, terms = f"{change.error_percent:.3g} % off", change.terms
    if terms is None or (text_of(change.source), text_of(change.target)) == (_short(terms.wanted), _short(terms.held)):
        return text
    return f"{text}: {_short(terms.wanted)} becomes {_short(terms.held)} {terms.unit}".rstrip()


def _short(value: Decimal) -> str:
    return text_of(Decimal(f"{value:.7g}"))


def _cells(change: Change) -> str:
    remark = "; ".join(part for part in (_error(change), change.note) if part)
    kind = f"{change.kind} (loss)" if change.loss and change.kind not in LOSSES else change.kind
    values = (kind, change.field, text_of(change.source), text_of(change.target), remark)
    return f"| {' | '.join(cell(value) for value in values)} |"


def _line(change: Change) -> str:
    values = f"{text_of(change.source)} -> {text_of(change.target)}"
    if change.target is None:
        values = text_of(change.source)
    elif change.source is None:
        values = text_of(change.target)
    error = f" ({_error(change)})" if change.error_percent else ""
    mark = "!" if change.loss or change.error_percent > WARN_PERCENT else " "
    note = f"\n             {one_line(change.note)}" if change.note else ""
    return f" {mark}{change.kind:<8} {change.field}: {one_line(values)}{error}{note}"
