"""Where a YAML text has comments: a ``#`` inside a scalar is none, and only the parser knows where scalars end."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections import defaultdict
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.diagnostics import Span
from pidcfg.document import LINE_BREAK, span_of
from pidcfg.source import parser

if TYPE_CHECKING:
    from collections.abc import Iterator

START = re.compile(r"(?:^|(?<=[ \t]))#")
"""What begins a comment outside of a scalar."""
REST = 1 << 30
"""A column behind every line."""
BLOCK_STYLES = frozenset("|>")


class Comment(NamedTuple):
    """A comment with its ``#``: where it stands, and whether its line holds nothing else."""

    line: int
    column: int
    text: str
    alone: bool


def comments_in(text: str) -> Iterator[Comment]:
    """The comments of a text that the parser accepts, in order."""
    taken: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for event in parser().parse(text):
        if hasattr(event, "value"):
            _take(span_of(event), taken, block=event.style in BLOCK_STYLES)
    for number, line in enumerate(LINE_BREAK.split(text), start=1):
        if "#" not in line:
            continue
        scalars = taken[number]
        for mark in START.finditer(line):
            at = mark.start()
            before = bisect_right(scalars, (at, REST)) - 1  # of scalars, which stand one behind the other
            if before < 0 or at >= scalars[before][1]:
                yield Comment(number, at + 1, line[at:], not line[:at].strip())
                break


def _take(span: Span, taken: dict[int, list[tuple[int, int]]], *, block: bool) -> None:
    """Marks the columns (0-based) of every line that a scalar takes; the head of a block scalar may have a comment."""
    if block:
        taken[span.line].append((span.column - 1, span.column))
        span = Span(span.line + 1, 1, span.end_line, span.end_column)
    for line in range(span.line, span.end_line + 1):
        first = span.column - 1 if line == span.line else 0
        taken[line].append((first, span.end_column - 1 if line == span.end_line else REST))
