"""Characters that are no text: what would move a cursor, end a line, or hide what is written."""

from __future__ import annotations

import re

CONTROL = "\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
"""DEL, the control characters of Latin-1, separators of lines, and what turns the direction of writing round."""
UNPRINTABLE = re.compile(f"[\x00-\x08\x0b-\x1f{CONTROL}]")
"""What must reach no terminal, log or page as it is."""


def printable(text: str) -> str:
    """Text for people and logs: a control character other than tab and line feed shows as U+FFFD."""
    return UNPRINTABLE.sub("\N{REPLACEMENT CHARACTER}", text)


def one_line(text: str) -> str:
    """Text that has one line of an output to itself: a line break in it would begin another one, of any meaning."""
    return " ".join(printable(text).splitlines())
