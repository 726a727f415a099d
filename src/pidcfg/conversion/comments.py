"""Comments of a configuration that survive its conversion: those at its head, and those of each loop."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pidcfg.source import Document

QUOTED = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'(?:[^']|'')*'")
KEY = re.compile(r"[\s{,-]*([\w.]+):")
ITEM = "  - "
"""How a loop begins in a file that pidcfg writes."""


def comment_of(line: str) -> str | None:
    """The comment of a line, with its key in front when it stands behind a value; None: there is none."""
    bare = QUOTED.sub(lambda text: "x" * len(text.group()), line)
    start = next((i for i, c in enumerate(bare) if c == "#" and (i == 0 or bare[i - 1].isspace())), None)
    if start is None:
        return None
    text = line[start + 1 :].strip()
    key = KEY.match(line[:start])
    return f"{key.group(1)}: {text}" if key and text else text


def comments(doc: Document, loops: int) -> tuple[list[str], list[list[str]]]:
    """The comments above the loops, and those of each loop: before it, and behind its values."""
    lines = doc.lines
    starts = [_first_line(doc, lines, i) for i in range(loops)]
    texts: list[list[str]] = []
    for i, start in enumerate(starts):
        end = starts[i + 1] if i + 1 < loops else len(lines)
        texts.append(_texts(lines[start:end]))
    return _texts(lines[: starts[0]] if starts else lines), texts


def _first_line(doc: Document, lines: list[str], loop: int) -> int:
    """Where a loop begins, with the comment lines directly above it."""
    line = doc.locate(("loops", loop)).line - 1
    while line > 0 and lines[line - 1].lstrip().startswith("#") and lines[line - 1][:1].isspace():
        line -= 1
    return line


def _texts(lines: list[str]) -> list[str]:
    return [text for line in lines if (text := comment_of(line))]


def with_comments(text: str, head: list[str], loops: list[list[str]]) -> str:
    """A file with comments at its head and above its loops."""
    out = [f"# {comment}" for comment in head]
    number, within = 0, False
    for line in text.splitlines():
        if within and line.startswith(ITEM) and number < len(loops):
            out += [f"  # {comment}" for comment in loops[number]]
            number += 1
        within = line.startswith("loops:") or (within and (line.startswith(" ") or not line))
        out.append(line)
    return "\n".join(out) + "\n"
