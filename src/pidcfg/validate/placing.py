"""Values put into a file at their places: texts are spliced, every other byte stays, and what was made is read again.

A key that is missing goes behind the one that it follows, as that one is written: on a line of its own with the same
indentation, or behind a comma within braces. Where the new text would say anything else besides (an alias stands for
the whole section, an anchor is used elsewhere), nothing is made.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pidcfg.diagnostics import Edit, Span
from pidcfg.document import LINE_BREAK, Plain, span_of
from pidcfg.paths import has_key, put
from pidcfg.source import read_document
from pidcfg.validate.edits import QUOTES
from pidcfg.validate.fixes import BOM, same, splice

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.document import Document
    from pidcfg.paths import Path

ALIAS = re.compile(r"[\"']?\s*:\s+(?P<name>\*[^\s,\[\]{}]+)")
"""What follows a key whose value is an alias."""
ANCHOR = re.compile(r"&[^\s,\[\]{}]+[ \t]+")


class PlacingError(ValueError):
    """A value that cannot be put at its place without changing something else: why, and the line."""

    def __init__(self, message: str, line: int) -> None:
        super().__init__(message)
        self.line = line


def with_values(data: bytes, doc: Document, values: Mapping[Path, str], after: Mapping[Path, Path]) -> bytes:
    """The bytes of a file with other texts at some paths; ``doc`` is that file as read.

    A text with a blank inside keeps the quotes that it had. ``after``: which key of the file a missing one goes behind.
    Raises `PlacingError`.
    """
    wanted = _apart(doc.data)
    edits: list[Edit] = []
    added: dict[Path, str] = {}
    for path, text in values.items():
        if has_key(doc.data, path):
            place = _Place.of(doc, path)
            quote = place.quote if " " in text else ""
            edits.append(Edit(place.value, f"{quote}{text}{quote}"))
            put(wanted, path, text if quote else Plain(text))
        else:
            neighbour = after[path]
            text_beside = _Place.of(doc, neighbour).beside(doc, str(path[-1]), text)
            added[neighbour] = added.get(neighbour, "") + text_beside
            put(wanted, path, Plain(text))
    edits += [Edit(_Place.of(doc, key).end(doc), text) for key, text in added.items()]
    mark = BOM if data.startswith(BOM) else b""
    made = mark + splice(doc.text, edits).encode()
    new = read_document(made, doc.file)
    if mark + doc.text.encode() != data or new.data is None or not same(_apart(new.data), wanted):
        line = doc.locate(next(iter(values))).line
        raise PlacingError("the file shares what stands there with other places, by a template or an anchor (&)", line)
    return made


def _apart(data: Any) -> Any:
    """Data in which aliases share nothing."""
    if isinstance(data, dict):
        return {key: _apart(value) for key, value in data.items()}
    return [_apart(item) for item in data] if isinstance(data, list) else data


@dataclass(frozen=True, slots=True)
class _Place:
    """Where a key and its value are written."""

    key: Span
    value: Span
    """Without an anchor; of an alias its name."""
    quote: str
    in_braces: bool

    @classmethod
    def of(cls, doc: Document, path: Path) -> _Place:
        """The place of a key that is in the file."""
        node, in_braces, key = doc.root, False, None
        for step in path:
            in_braces = bool(getattr(node.event, "flow_style", False))
            entry = node.child(step)
            if entry is None:
                raise KeyError(path)
            key, node = entry
        at, value = span_of(key), node.span
        row = doc.lines[at.end_line - 1]
        alias = ALIAS.match(row, at.end_column - 1)
        if alias is not None:
            value = Span(at.line, alias.start("name") + 1, at.line, alias.end("name") + 1)
        anchor = ANCHOR.match(doc.lines[value.line - 1], value.column - 1)
        if anchor is not None:
            value = Span(value.line, anchor.end() + 1, value.end_line, value.end_column)
        first = doc.lines[value.line - 1][value.column - 1 : value.column]
        return cls(at, value, first if first in {*QUOTES} else "", in_braces)

    def beside(self, doc: Document, key: str, text: str) -> str:
        """Another key with its value, to be put behind this one."""
        row = doc.lines[self.key.line - 1]
        mark = row[self.key.column - 1 : self.key.column]
        key = f"{mark}{key}{mark}" if mark in {*QUOTES} else key
        if self.in_braces:
            return f", {key}: {text}"
        return f"{_line_break(doc.text)}{' ' * (self.key.column - 1)}{key}: {text}"

    def end(self, doc: Document) -> Span:
        """Where another key goes: behind the value within braces, else behind the line."""
        line = self.value.end_line
        column = self.value.end_column if self.in_braces else len(doc.lines[line - 1]) + 1
        return Span(line, column, line, column)


def _line_break(text: str) -> str:
    """How lines of a file end: as its first one."""
    found = LINE_BREAK.search(text)
    return found.group() if found else "\n"
