"""Patterns as git reads them in a ``.gitignore``: each line by itself, and which line of a file counts for an entry.

pathspec turns a line into a regular expression. It is asked for one entry at a time, whose folders are not left out;
so nothing below a folder that is left out can be taken back, as with git.
"""

from __future__ import annotations

import re
import warnings
from math import comb
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

MOST = 2000
"""Lines of a ``.gitignore``, and patterns of a settings file."""
MOST_WAYS = 10_000
"""In which the ``**`` of a pattern may lie over the folders of a path."""
ANY, UP = "**", ".."
STAR, SIGN = r"\[\^/\]\*", r"(?:\\.|\[\^?\]?[^\]]*\]|[^/\\\[(])"
STARS = re.compile(rf"(?:{STAR}){{2,}}")
BETWEEN = re.compile(rf"{STAR}((?:(?!{STAR}){SIGN})+)(?={STAR})", re.DOTALL)
"""In a regular expression of pathspec: a star, and what stands between it and the next one of the same name."""


class Pattern(NamedTuple):
    """One line that names entries, or takes some back."""

    reason: str
    """Why an entry that it names is left out."""
    regex: re.Pattern[str]
    leaves_out: bool
    of_folders: bool
    """Whether it ends with a slash."""
    of_names: bool
    """Whether it has no other slash, and so is compared with the name in whatever folder."""
    jumps: int
    """How many ``**`` it has."""

    def fits(self, path: str, *, folder: bool) -> bool:
        """Whether it names this entry itself; one that would take very long is taken for what leaves nothing out."""
        if self.of_folders and not folder:
            return False
        text = path.rpartition("/")[2] if self.of_names else path
        if self.jumps and comb(text.count("/") + self.jumps, self.jumps) > MOST_WAYS:
            return not self.leaves_out
        match = self.regex.search(text)
        return match is not None and match.lastindex is None  # its group is the slash behind a folder above


class Patterns(NamedTuple):
    """The patterns of one origin, which begin at a folder."""

    base: str
    """The folder, with a slash at its end."""
    rows: list[Pattern]

    def decisive(self, path: str, *, folder: bool) -> Pattern | None:
        """The last pattern that names an entry; None for what lies elsewhere, too."""
        if not path.startswith(self.base):
            return None
        below = path[len(self.base) :]
        return next((row for row in reversed(self.rows) if row.fits(below, folder=folder)), None)


def patterns(base: str, origin: str, lines: Iterable[str], *, numbered: bool = False) -> Patterns:
    """The patterns of some lines; a line that is none is passed over, as git does."""
    rows = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # "[[" in a regular expression
        for number, line in enumerate(lines, 1):
            row = _pattern(f"{origin}:{number}" if numbered else origin, line)
            rows += [row] if row is not None else []
    return Patterns(base, rows)


def _pattern(origin: str, line: str) -> Pattern | None:
    from pathspec.patterns.gitignore.spec import GitIgnoreSpecPattern

    bare = line.rstrip(" ")
    line = f"{bare} " if bare.endswith("\\") and bare != line else bare
    body = line.removesuffix("/")
    try:
        regex, leaves_out = GitIgnoreSpecPattern.pattern_to_regex(body)
        if regex is None or leaves_out is None:
            return None
        compiled = re.compile(BETWEEN.sub(r"(?>[^/]*?\1)", STARS.sub("[^/]*", regex)))
    except (ValueError, re.error):
        return None
    return Pattern(f"{origin}: {line}", compiled, leaves_out, body != line, "/" not in body, body.count(ANY))


def fault(line: str) -> str | None:
    """What is wrong with a pattern of the command line or of a settings file, and its cure."""
    if UP in line.split("/"):
        return f"{line!r} leads out of the folder that patterns begin at; run there, or put the settings there"
    if re.search(r"\\\w", line):
        return f"{line!r} is no pattern of paths; write it with forward slashes"
    if not patterns("/", "", [line]).rows:
        return f"{line!r} is no pattern of paths; write it as a line of .gitignore, such as 'old/' or '*.bak.yaml'"
    return None
