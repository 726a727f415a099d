"""What a configuration says of a name that no register map has: a loop, or a tag, point or signal that a key names."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pidcfg.explanation.page import Page

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.explanation.configuration import Configured
    from pidcfg.explanation.page import Origin
    from pidcfg.paths import Path

PROSE = frozenset(("description", "unit", "vendor"))
"""Keys whose texts name nothing."""


def mentions(config: Configured, name: str) -> list[Page]:
    """The page of a name, with every line that says it; none where no line does."""
    vendor = config.checked.vendor
    data: Any = config.document.data
    word = re.compile(rf"(?<![\w.]){re.escape(name)}(?![\w])", re.IGNORECASE)
    origins = [origin for path, text in _texts(data) if word.search(text) and (origin := _origin(config, path))]
    signals = data.get("signals")
    if isinstance(signals, dict):
        origins += [o for key in signals if word.fullmatch(key) and (o := config.origin(("signals", key), None))]
    loop = next((one for one in config.loops if one.lower() == name.lower()), None)
    if vendor is None or not (origins or loop):
        return []
    title = "a loop of this configuration" if loop else _title(origins)
    notes = _blocks(config, loop) if loop else ()
    description = next((str(one.get("description") or "") for one in data["loops"] if one.get("name") == loop), "")
    page = Page("named", loop or name, title, vendor.key, vendor.title, holds=description, loop=loop, notes=notes)
    return [replace(page, origins=tuple(origins))]


def _texts(data: Any, above: Path = ()) -> Iterator[tuple[Path, str]]:
    """Every text of a configuration that may name something."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        if isinstance(value, str) and key not in PROSE:
            yield (*above, key), value
        elif isinstance(value, dict | list):
            yield from _texts(value, (*above, key))


def _origin(config: Configured, path: Path) -> Origin | None:
    loop = config.loops[path[1]] if path[0] == "loops" and isinstance(path[1], int) else None
    return config.origin(path, loop)


def _title(origins: list[Origin]) -> str:
    """What it is to the first line that names it."""
    first = origins[0]
    key = re.sub(r"^\w+\[\d+\]\.", "", first.key)
    return f"named at {key}" + (f" of {first.loop}" if first.loop else "")


def _blocks(config: Configured, loop: str) -> tuple[str, ...]:
    """Where the loop's registers are."""
    encoding: Any = config.checked.encoding
    ends: dict[str, tuple[int, int]] = {}
    for block in config.blocks:
        if block.loop == loop:
            first, last = ends.get(block.table.title, (block.start, 0))
            ends[block.table.title] = min(first, block.start), max(last, block.start + block.table.size - 1)
    name = encoding.space.name if ends else str
    return tuple(f"{title}: {name(first)} to {name(last)}" for title, (first, last) in ends.items())
