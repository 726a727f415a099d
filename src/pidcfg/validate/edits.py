"""Edits that correct a finding without changing the meaning of the file; `fixes` applies them."""

from __future__ import annotations

import re
from collections import Counter
from copy import deepcopy
from itertools import islice
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from pidcfg.diagnostics import Edit, Span
from pidcfg.document import span_of
from pidcfg.paths import Path, value_at

if TYPE_CHECKING:
    from pydantic import BaseModel

    from pidcfg.document import Document, Node

MOST_KEYS, MOST_TRIES = 200, 30
"""Unknown keys of one file that are looked at, and how often: each time costs a reading of the whole."""
QUOTES = "'\""
UNQUOTED = re.compile(r"[%@`][\w%/.°²³-]*(?=[ \t]*(?:$|[,}\]]|[ \t]#))")
"""A word that begins with what no value may begin with, up to where any value ends."""


def of_quotes(doc: Document, span: Span) -> tuple[Edit, ...]:
    """Quotes around a value such as ``%``, whose first character begins nothing in YAML."""
    row = doc.lines[span.line - 1]
    match = UNQUOTED.match(row, span.column - 1)
    if match is None or not row[: match.start()].rstrip(" ").endswith((":", "[", ",")):
        return ()
    place = Span(span.line, match.start() + 1, span.line, match.end() + 1)
    return (Edit(place, f'"{match.group()}"'),)


def of_value(doc: Document, path: Path, text: str) -> tuple[Edit, ...]:
    """Another text in the place of a value; none where an alias shares it, or where it takes several lines."""
    entry = _at(doc, path)
    if entry is None or not hasattr(entry[1].event, "value") or entry[1].event.anchor is not None:
        return ()
    span = span_of(entry[1].event)
    return (Edit(span, text),) if span.line == span.end_line else ()


def of_key(doc: Document, path: Path, key: str) -> tuple[Edit, ...]:
    """Another key; quotes stay."""
    entry = _at(doc, path)
    if entry is None or entry[0] is None or entry[0].anchor is not None:
        return ()
    span = span_of(entry[0])
    quote = doc.lines[span.line - 1][span.column - 1 : span.column]
    return (Edit(span, f"{quote}{key}{quote}" if quote in QUOTES else key),) if span.line == span.end_line else ()


def _at(doc: Document, path: Path) -> tuple[Any, Node] | None:
    """The event of the key and the node of a value."""
    node, key = doc.root, None
    for step in path:
        entry = node.child(step)
        if entry is None:
            return None
        key, node = entry
    return key, node


def key_edits(
    new_keys: dict[Path, str], faults: list[Any], model: type[BaseModel], doc: Document
) -> dict[Path, tuple[Edit, ...]]:
    """The edits of keys that may be renamed: nothing has the new key yet, and its value is right for it."""
    uses = Counter((path[:-1], key) for path, key in new_keys.items())
    new_keys = {path: key for path, key in new_keys.items() if uses[path[:-1], key] == 1}
    accepted: dict[Path, str] = {}
    waiting, tries = [new_keys] if new_keys else [], 0
    while waiting and tries < MOST_TRIES:
        group, tries = waiting.pop(), tries + 1
        if _fits(model, doc.data, group, faults):
            accepted |= group
        elif len(group) > 1:
            half = len(group) // 2
            waiting += [dict(islice(group.items(), half, None)), dict(islice(group.items(), half))]
    return {path: edits for path, key in accepted.items() if (edits := of_key(doc, path, key))}


def _fits(model: type[BaseModel], data: Any, new_keys: dict[Path, str], faults: list[Any]) -> bool:
    """Whether data with other keys lose faults, and get none that is new."""
    copy = deepcopy(data)
    if not all(_rename(copy, path, key) for path, key in new_keys.items()):
        return False
    try:
        model.model_validate(copy)
    except ValidationError as error:
        old = {(e["type"], e["loc"]) for e in faults}
        left = [(e["type"], e["loc"]) for e in error.errors(include_url=False)]
        return old.issuperset(left) and len(left) <= len(faults) - len(new_keys)
    return True


def _rename(data: Any, path: Path, key: str) -> bool:
    """Renames one key, wherever an alias shares its mapping; False where the new key is taken or has no value."""
    parent = value_at(data, path[:-1])
    if path[-1] not in parent:
        return key in parent  # renamed through another path to the same mapping
    if key in parent or parent[path[-1]] is None:
        return False
    parent[key] = parent.pop(path[-1])
    return True
