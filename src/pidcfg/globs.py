"""Patterns of paths, the same on every system: ``*`` and ``?`` within a name, ``**`` across folders."""

from __future__ import annotations

import re
from functools import cache

PIECE = re.compile(r"\*\*/|/\*\*$|\*\*|\*|\?|[^*?]+")
WORDS = {"**/": "(?:.*/)?", "/**": "/.*", "**": ".*", "*": "[^/]*", "?": "[^/]"}


def matches(pattern: str, path: str) -> bool:
    """Whether a path (relative, with forward slashes) fits; a pattern without a slash is a name at any depth.

    A pattern that fits a folder fits everything below it.
    """
    return _compiled(pattern).fullmatch(path) is not None


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    bare = pattern.removeprefix("./").strip("/")
    anchored = "/" in pattern.removeprefix("./").rstrip("/")
    body = "".join(WORDS.get(piece, re.escape(piece)) for piece in PIECE.findall(bare))
    return re.compile(f"{'' if anchored else '(?:.*/)?'}{body}(?:/.*)?")
