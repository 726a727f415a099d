"""Where a value is used: an alias (``*name``) shares the text of its anchor, but stands at a place of its own."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

from pidcfg.document import Document, Node, span_of
from pidcfg.limits import Limits
from pidcfg.source import read_document

if TYPE_CHECKING:
    from pidcfg.diagnostics import Diagnostic
    from pidcfg.paths import Path

ANY_SIZE = Limits(*[1 << 40] * len(fields(Limits)))
"""The text has been read within its limits before."""


@dataclass(slots=True)
class Places:
    """The lines that findings of one file belong to."""

    doc: Document
    root: Node | None = field(default=None, init=False)

    def line(self, finding: Diagnostic) -> int:
        """Where a finding is written; of one that was reached through an alias the line of the alias's key."""
        if "*" not in self.doc.text:
            return finding.span.line
        if self.root is None:
            kept = self.doc.root.children is not None
            self.root = self.doc.root if kept else read_document(self.doc.text.encode(), "", ANY_SIZE).root
        alias = _alias(self.root, finding.path)
        return finding.span.line if alias is None else alias


def _alias(node: Node, path: Path) -> int | None:
    """The line of the first key on a path whose value stands above it, which only an alias does; 0 in a list."""
    for step in path:
        entry = node.child(step)
        if entry is None:
            return None
        key, value = entry
        if isinstance(node.children, list):
            before = [_start(node), *(_start(item) for item in node.children[: int(step)])]
            if _start(value) <= max(before):
                return 0
        elif span_of(key) > value.span:
            return span_of(key).line
        node = value
    return None


def _start(node: Node) -> Any:
    return node.span.line, node.span.column
