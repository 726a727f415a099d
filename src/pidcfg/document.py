"""A text file as read: plain data beside a tree of the same shape that knows where everything is written."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pidcfg.diagnostics import START, Diagnostic, Span
from pidcfg.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pidcfg.paths import Path

LINE_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")


class Plain(str):
    """An unquoted scalar as it is written: ``010`` stays ``010`` until a field reads it."""

    __slots__ = ()


class Node:
    """Where a value is written; children by key (with the event of the key) or by index.

    The parser's event is kept and turned into a `Span` only on demand: most values are never reported.
    """

    __slots__ = ("children", "event", "size")

    def __init__(self, event: Any, children: dict[str, tuple[Any, Node]] | list[Node] | None = None) -> None:
        self.event = event
        self.size = 1
        self.children = children

    @property
    def span(self) -> Span:
        """The place of the value."""
        return START if self.event is None else span_of(self.event)

    @property
    def levels(self) -> int:
        """The levels of nesting inside it and with it; a scalar has none."""
        levels, here = 0, [self]
        while here := [node for node in here if node.children is not None]:
            levels += 1
            here = [below for node in here for below in node.items]
        return levels

    @property
    def items(self) -> Iterable[Node]:
        """The nodes one level below."""
        if isinstance(self.children, dict):
            return (node for _, node in self.children.values())
        return self.children or ()

    def child(self, step: str | int) -> tuple[Any, Node] | None:
        """The event of a key (an item: of its value) and the node below it; None when there is none."""
        if isinstance(self.children, dict):
            return self.children.get(step) if isinstance(step, str) else None
        if isinstance(self.children, list) and isinstance(step, int) and 0 <= step < len(self.children):
            return self.children[step].event, self.children[step]
        return None


@frozen
class Document:
    """A file as read: data, positions and what was wrong with its text."""

    file: str
    text: str
    data: dict[str, Any] | None
    root: Node
    problems: tuple[Diagnostic, ...] = ()

    @cached_property
    def lines(self) -> list[str]:
        """The text by lines, counted as the parser counts them; divided once, however many findings ask."""
        return LINE_BREAK.split(self.text)

    def bare(self) -> Document:
        """The text alone: what a report still needs when the data have been checked."""
        return replace(self, data=None, root=Node(None))

    def locate(self, path: Path, *, key: bool = False) -> Span:
        """Where the value at ``path`` is written (``key``: its key), or the closest ancestor that is in the file.

        An ancestor is pointed at by its key, since what is missing there has no place of its own.
        """
        node, key_event = self.root, None
        for step in path:
            entry = node.child(step)
            if entry is None:
                key = True
                break
            key_event, node = entry
        if key or not path:
            return START if key_event is None else span_of(key_event)
        return node.span


def span_of(event: Any) -> Span:
    """The place of a parser's event."""
    start, end = event.start_mark, event.end_mark
    return Span(start.line + 1, start.column + 1, end.line + 1, end.column + 1)
