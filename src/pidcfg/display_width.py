"""How many columns a text takes on a terminal: a Chinese, Japanese or Korean sign takes two, a combining one none."""

from __future__ import annotations

WIDE = frozenset("WF")
"""Classes of East Asian width that take two columns (Unicode Standard Annex 11)."""


def width_of(text: str) -> int:
    """The columns that a text takes."""
    if text.isascii():
        return len(text)
    from unicodedata import category, east_asian_width

    return sum(0 if category(c) in {"Mn", "Me", "Cf"} else 1 + (east_asian_width(c) in WIDE) for c in text)


def to_left(text: str, width: int) -> str:
    """The text with blanks behind it up to a width in columns."""
    return text + " " * (width - width_of(text))


def to_right(text: str, width: int) -> str:
    """The text with blanks before it up to a width in columns."""
    return " " * (width - width_of(text)) + text
