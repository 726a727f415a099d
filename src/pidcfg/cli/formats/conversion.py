"""The report of a conversion as text, JSON and Markdown: what became of every field of every loop."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pidcfg.cli.formats.markdown import cell
from pidcfg.conversion.ledger import WORST
from pidcfg.conversion.pipeline import shown, text_of
from pidcfg.scenario.verify import as_data
from pidcfg.scenario.verify import as_text as verified_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion.ledger import Change
    from pidcfg.conversion.pipeline import Converted
    from pidcfg.scenario.verify import Verified

TABLE = ("", "| kind | field | before | after | |", "|---|---|---|---|---|")
WARN_PERCENT = 1.0
"""A value that the target holds further off than this is warned of."""


@dataclass(frozen=True, slots=True)
class Told:
    """A conversion, and how far its sides lie apart where that was asked for."""

    source: str
    target: str
    converted: Converted
    verified: list[Verified] | None = None

    @property
    def pv_percent(self) -> float:
        """How far a PV is off at most, in % of its range."""
        return max((found.pv_percent for found in self.verified or ()), default=0.0)

    def json(self) -> str:
        """The public layout."""
        return as_json(self.source, self.target, self.converted, self.verified)

    def text(self, *, changes: bool = True, apart: bool = True) -> str:
        """For people: the changes, and the comparison."""
        parts = [as_text(self.source, self.target, self.converted)] if changes else []
        return "".join(parts + ([verified_text(self.verified)] if apart and self.verified is not None else []))

    def markdown(self) -> str:
        """For a pull request."""
        return as_markdown(self.source, self.target, self.converted, self.verified)

    def render(self, fmt: str) -> str:
        """One of these formats by its name."""
        return {"text": self.text, "json": self.json, "markdown": self.markdown}[fmt]()


def as_json(source: str, target: str, converted: Converted, verified: list[Verified] | None = None) -> str:
    """The layout of the public interface, version 1."""
    loops = [{"loop": name, "changes": [_row(change) for change in found]} for name, found in converted.loops]
    document = {"version": 1, "from": source, "to": target, "loops": loops}
    if verified is not None:
        document["verify"] = as_data(verified)
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def _row(change: Change) -> dict[str, Any]:
    return {
        "field": change.field,
        "kind": change.kind,
        "from": shown(change.source),
        "to": shown(change.target),
        "error_percent": round(change.error_percent, 6),
        "note": change.note,
    }


def as_text(source: str, target: str, converted: Converted) -> str:
    """Every change that is worth reading, loop by loop; what came over exactly and needs no word is counted."""
    lines = [f"{source} to {target}"]
    for name, found in converted.loops:
        lines.append(f"\n{name}: {_counted(found)}")
        lines += dict.fromkeys(_line(change) for change in _worth_reading(found))
    return "\n".join(lines) + "\n"


def _counted(found: Sequence[Change]) -> str:
    count = Counter(change.kind for change in found)
    return ", ".join(f"{count[kind]} {kind}" for kind in WORST if count[kind]) or "nothing to convert"


def _worth_reading(found: Sequence[Change]) -> list[Change]:
    """The gravest changes first; without what came over exactly and needs no word."""
    told = [change for change in found if change.kind != "exact" or change.note]
    return sorted(told, key=lambda change: -WORST.index(change.kind))


def as_markdown(source: str, target: str, converted: Converted, verified: list[Verified] | None = None) -> str:
    """A table a loop, as in ``pidcfg diff --format markdown``."""
    lines = [f"### PID loops: {source} to {target}"]
    for name, found in converted.loops:
        lines += ["", f"**{cell(name)}**: {_counted(found)}"]
        rows = dict.fromkeys(_cells(change) for change in _worth_reading(found))
        lines += [*TABLE, *rows] if rows else []
    if verified is not None:
        lines += ["", "**Verified by simulation**: a step of the set point, then a disturbance", ""]
        lines += ["| loop | PV apart, % of its range | output apart, % | ratio of IAE |", "|---|---|---|---|"]
    for entry in verified or ():
        ratio = "-" if entry.iae_ratio is None else f"{entry.iae_ratio:.4g}"
        lines.append(f"| {cell(entry.loop)} | {entry.pv_percent:.3g} | {entry.output_percent:.3g} | {ratio} |")
    return "\n".join(lines) + "\n"


def _cells(change: Change) -> str:
    error = f"{change.error_percent:.3g} % off" if change.error_percent else ""
    told = "; ".join(part for part in (error, change.note) if part)
    values = (change.kind, change.field, text_of(change.source), text_of(change.target), told)
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
