"""Comments and literals of Structured Text as programs of every vendor have them, and the settings in comments.

What no variable of a program holds stands in comments above it as JSON, ``plc: {…}`` and ``loop: {…}``, for the way
back.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from pidcfg.control_characters import CONTROL
from pidcfg.encoders.listing import Listing, ListingError, load_json
from pidcfg.writer import json_line

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from pidcfg.encoders.parameters import Content
    from pidcfg.encoders.st.lex import Comment
    from pidcfg.schemas.iec import IecType

WIDTH = 110
"""Beyond this a declaration or a call gets a line for each parameter."""
BLANKS = re.compile(f"[\\x00-\\x20{CONTROL}]+")
COMMENT_MARKS = re.compile(r"\((?=\*)|\*(?=\))")
"""What would begin or end a comment."""
NOT_IN_COMMENTS = re.compile(f"{COMMENT_MARKS.pattern}|[\\ud800-\\udfff\\ufffe\\uffff]")
"""These, and what no file may hold."""
SETTINGS = re.compile(r"(plc|loop):\s*(?=\{)")
"""Beginning of a comment with settings that no parameter holds."""


def comment_text(text: str) -> str:
    """A text of people's on one line, in which no comment ends or begins."""
    return COMMENT_MARKS.sub(lambda sign: f"{sign.group()} ", BLANKS.sub(" ", text))


def settings_text(entry: Mapping[str, object]) -> str:
    """JSON in which no comment ends or begins; such signs can stand in texts only, where there is another way."""
    return NOT_IN_COMMENTS.sub(lambda sign: f"\\u{ord(sign.group()):04x}", json_line(dict(entry)))


def settings_of(comments: Iterable[Comment], listing: Listing) -> list[Comment]:
    """Reads the settings of the comments into the listing; returns the comments of blocks, in the order of entries."""
    places: list[Comment] = []
    for comment in comments:
        head = SETTINGS.match(comment.text)
        if head is None:
            continue
        try:
            entry = load_json(comment.text[head.end() :])
        except ListingError as error:
            raise ListingError(f"the settings are {error}", comment.line, comment.column) from None
        if head.group(1) == "plc":
            listing.plc = entry
        else:
            listing.settings = (*listing.settings, entry)
            places.append(comment)
    return places


def literal(kind: IecType, content: Content) -> str:
    """A content as the language writes it."""
    if kind.kind == "bool":
        return "TRUE" if content else "FALSE"
    if kind.kind == "word":
        return f"{kind.name}.{content}"
    if kind.kind == "time":
        return str(content)
    return st_real(float(content)) if kind.kind == "real" else str(int(content))


def st_real(value: float) -> str:
    """A REAL literal: always with a point, so that no division is one of whole numbers."""
    mantissa, _, exponent = repr(value + 0.0).partition("e")
    whole = mantissa if "." in mantissa else f"{mantissa}.0"
    return f"{whole}E{int(exponent)}" if exponent else whole


def wrapped(start: str, parts: list[str], end: str) -> list[str]:
    """On one line, or a line for each part."""
    line = f"{start}{', '.join(parts)}{end}"
    if len(line) <= WIDTH:
        return [line]
    return [start, *(f"    {part}," for part in parts[:-1]), f"    {parts[-1]}", end]
