"""The report of a conversion as text and as JSON: what became of every field of every loop."""

from __future__ import annotations

import json
from collections import Counter
from typing import TYPE_CHECKING, Any

from pidcfg.cli.convert_verify import as_data
from pidcfg.convert.ledger import WORST
from pidcfg.convert.pipeline import shown, text_of

if TYPE_CHECKING:
    from pidcfg.cli.convert_verify import Verified
    from pidcfg.convert.ledger import Change
    from pidcfg.convert.pipeline import Converted

WARN_PERCENT = 1.0
"""A value that the target holds further off than this is warned of."""


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
        count = Counter(change.kind for change in found)
        kinds = ", ".join(f"{count[kind]} {kind}" for kind in WORST if count[kind])
        lines.append(f"\n{name}: {kinds or 'nothing to convert'}")
        for kind in reversed(WORST):
            told = [_line(change) for change in found if change.kind == kind and (kind != "exact" or change.note)]
            lines += dict.fromkeys(told)
    return "\n".join(lines) + "\n"


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
