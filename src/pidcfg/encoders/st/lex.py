"""Structured Text as words and signs with their places, and its comments."""

from __future__ import annotations

import re
from typing import NamedTuple

from pidcfg.encoders.listing import ListingError

NAME, NUMBER, TYPED, OTHER, SIGN, END = "name", "number", "typed", "other", "sign", "end"
"""What a token is: ``typed`` is a literal with a prefix (``16#FF``), ``other`` a text or a location."""


class Token(NamedTuple):
    """A word or sign of the program."""

    kind: str
    text: str
    line: int
    column: int
    note: str = ""
    """The comment that stands behind it on the same line."""

    @property
    def upper(self) -> str:
        """In capitals, since the language does not tell them from small letters."""
        return self.text.upper()

    def error(self, message: str) -> ListingError:
        """A fault at this place."""
        return ListingError(message, self.line, self.column)


class Comment(NamedTuple):
    """What people read, and where it stands."""

    text: str
    line: int
    column: int


PARTS = (
    ("skip", r"[ \t\r\n\f\ufeff]+"),
    ("line", r"//[^\n]*"),
    ("block", r"\(\*|/\*"),
    ("pragma", r"\{[^}]*\}"),
    (OTHER, r"""'(?:\$.|[^'$\n])*'|"(?:\$.|[^"$\n])*"|%[\w.*]+"""),
    (TYPED, r"(?:[DLT]*(?:TIME|DATE|T|D|DT|TOD|TIME_OF_DAY|DATE_AND_TIME)#[-+\w.:]+|\w+(?:#\w+)?#[-+]?[\w.]+)"),
    (NUMBER, r"\d[\d_]*(?:\.\d[\d_]*)?(?:[eE][-+]?\d+)?(?![^\W\d])"),
    (NAME, r"[^\W\d]\w*"),
    (SIGN, r":=|=>|<=|>=|<>|\*\*|\.\.|[-+*/=<>()\[\],;:.&^#@]"),
)
PATTERN = re.compile("|".join(f"(?P<{kind}>{form})" for kind, form in PARTS), re.DOTALL)
ENDS = {"(*": re.compile(r"\(\*|\*\)"), "/*": re.compile(r"\*/")}
"""Comments in parentheses may stand in each other."""

CONDITIONAL = re.compile(r"\{\s*(IF|ELSIF|ELSE|END_IF)\b", re.IGNORECASE)
OPENING = re.compile(r"[\s\ufeff]+|(?P<line>//[^\n]*)|(?P<block>\(\*|/\*)|\{[^}]*\}(?=\s*[A-Z(/{])", re.IGNORECASE)
"""What may stand before a program; a pragma has a word behind it, which JSON has not."""


def opening(text: str) -> int:
    """Where the first word of a text begins, behind comments and pragmas; the end, where a comment has none."""
    at = 0
    while match := OPENING.match(text, at):
        at = match.end()
        if match.lastgroup == "block":
            try:
                at = _comment_end(text, match.group(), at, 1, 1)
            except ListingError:
                return len(text)
    return at


def tokens_of(text: str, line: int = 1) -> tuple[list[Token], list[Comment]]:
    """All tokens, the last of which is the end, and all comments; raises `ListingError`."""
    tokens: list[Token] = []
    comments: list[Comment] = []
    at, begin = 0, 0
    while at < len(text):
        match = PATTERN.match(text, at)
        if match is None:
            raise ListingError(f"{text[at]!r} is nothing that Structured Text has here", line, at - begin + 1)
        kind, column, end = match.lastgroup or "", at - begin + 1, match.end()
        if kind in {"line", "block"}:
            end = _comment_end(text, match.group(), end, line, column)
            inner = text[at + 2 : end if kind == "line" else end - 2].strip()
            comments.append(Comment(inner, line, column))
            if tokens and tokens[-1].line == line and not tokens[-1].note:
                tokens[-1] = tokens[-1]._replace(note=inner)
        elif kind == "pragma" and (condition := CONDITIONAL.match(match.group())):
            word = condition.group(1)
            message = f"{{{word} …}}: what stands behind is compiled on a condition only; write down what is compiled"
            raise ListingError(message, line, column)
        elif kind not in {"skip", "pragma"}:
            tokens.append(Token(kind, match.group(), line, column))
        breaks = text.count("\n", at, end)
        if breaks:
            line, begin = line + breaks, text.rindex("\n", at, end) + 1
        at = end
    tokens.append(Token(END, "the end of the file", line, at - begin + 1))
    return tokens, comments


def _comment_end(text: str, sign: str, at: int, line: int, column: int) -> int:
    """Where a comment ends."""
    if sign not in ENDS:
        return at
    open_comments = 1
    for match in ENDS[sign].finditer(text, at):
        open_comments += 1 if match.group() == sign else -1
        if not open_comments:
            return match.end()
    raise ListingError(f"the comment that begins here with {sign} has no end", line, column)
