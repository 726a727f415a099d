"""Findings in a user's file: plain data, which only the command line prints."""

from __future__ import annotations

import re
from enum import IntEnum
from functools import total_ordering
from typing import TYPE_CHECKING

from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from pidcfg.text.paths import Path


class Severity(IntEnum):
    """How bad a finding is; errors fail a run."""

    INFO = 1
    WARNING = 2
    ERROR = 3

    @property
    def label(self) -> str:
        """The word used in every output format."""
        return self.name.lower()


@total_ordering
@frozen
class Span:
    """Where something is written: 1-based lines and columns, the end exclusive."""

    line: int
    column: int
    end_line: int
    end_column: int

    def __lt__(self, other: Span) -> bool:
        return (self.line, self.column, self.end_line, self.end_column) < (
            other.line,
            other.column,
            other.end_line,
            other.end_column,
        )


START = Span(1, 1, 1, 1)
"""The place of a finding that concerns a file as a whole."""


@frozen
class Edit:
    """A text to be put in the place of another one."""

    span: Span
    text: str


@frozen
class Diagnostic:
    """One finding, complete: what, where, how bad, what the PLC would do, and the cure."""

    code: str
    severity: Severity
    message: str
    file: str
    span: Span = START
    path: Path = ()
    loop: str = ""
    """The loop that it concerns; empty where it concerns none."""
    with_loops: tuple[str, ...] = ()
    """The other loops of the same fault; each has a finding that names this one."""
    plc_effect: str | None = None
    reference: str | None = None
    help: str | None = None
    edits: tuple[Edit, ...] = ()
    """Edits that correct the text without changing what a plant does; empty where a person has to decide."""
    key: str = ""
    """Where it is written, seen from its loop and without a place in a list: ``tuning.reset``."""
    value: str | None = None
    """What is written there, in one spelling (`pidcfg.validate.fixes`); None where nothing is."""
    quotes: str | None = None
    """What the message quotes of its own loop (`pidcfg.validate.engine`); None where it quotes nothing of it."""

    @property
    def where(self) -> str:
        """The path in the notation of the JSON output: ``loops[1].tuning.reset``."""
        return path_text(self.path)

    @property
    def sort_key(self) -> tuple[str, Span, str, str, str]:
        """Sort key: file, position, number of the code, message, path."""
        return (self.file, self.span, number_of(self.code), self.message, self.where)


def number_of(code: str) -> str:
    """The number of a code (``242`` of ``DL242``), by which findings and rules are put in order."""
    return code[-3:]


def path_text(path: Path) -> str:
    """A path as text: ``loops[1].tuning.reset``; empty for the root."""
    text = "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in path)
    return text.removeprefix(".")


def sort_findings(findings: list[Diagnostic]) -> list[Diagnostic]:
    """Sorted, and each finding of a loop once (a faulty anchor that it uses n times is written in one place)."""
    unique = {(d.file, d.span, d.code, d.message, d.loop): d for d in sorted(findings, key=lambda d: d.sort_key)}
    return list(unique.values())


# --- What a finding says, whichever loop it says it of ----------------------------------------------------------------

REGISTER = re.compile(r"\b[A-Z]{1,3}\d+\b")
"""A register in a message."""


def words_of(d: Diagnostic) -> str:
    """What a finding says, whichever loop it says it of; what concerns several loops names them all.

    Below an error, the loop's own registers, and names that are made of the loop's, are no other words.
    """
    if not d.loop or d.with_loops:
        return d.message
    if d.severity is Severity.ERROR:
        return without_word(d.message, d.loop)
    return REGISTER.sub("", without_word(d.message.replace(f"{d.loop}_", ""), d.loop))


def without_word(text: str, word: str) -> str:
    """A text without a word, wherever no letter, digit or underscore stands beside it."""
    pieces, begin, index = [], 0, text.find(word)
    while index >= 0:
        end = index + len(word)
        if any(c.isalnum() or c == "_" for c in text[max(index - 1, 0) : index] + text[end : end + 1]):
            index = text.find(word, index + 1)
            continue
        pieces.append(text[begin:index])
        begin, index = end, text.find(word, end)
    return "".join(pieces) + text[begin:]
