"""What is no text where it stands: what would move a cursor, end a line, hide what is written, or command a CI job."""

from __future__ import annotations

import re

CONTROL = "\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
"""DEL, the control characters of Latin-1, separators of lines, and what turns the direction of writing round."""
UNPRINTABLE = re.compile(f"[\x00-\x08\x0b-\x1f{CONTROL}]")
"""What must reach no terminal, log or page as it is."""
ORDER = re.compile(r"(?:^|(?<=\r))[^\S\r\n]*:(?=:)|#(?=#\w*\[)", re.MULTILINE)
"""How an order begins that a CI system takes out of a log: ``::add-mask::`` of GitHub first on a line, and anywhere its
``##[add-mask]``, ``##vso[…]`` of Azure and ``##teamcity[…]``; a sign behind it is the end of the order."""
FORMULA = ("=", "+", "-", "@", "\uff1d", "\uff0b", "\uff0d", "\uff20", "\t", "\r", "\n", "'")
"""How a text begins that a spreadsheet would calculate, the wide signs too, or whose first character it would drop."""


def printable(text: str) -> str:
    """Text for people and logs: a control character other than tab and line feed shows as U+FFFD."""
    return UNPRINTABLE.sub("\N{REPLACEMENT CHARACTER}", text)


def first_order(text: str) -> re.Match[str] | None:
    """Where a CI system finds an order first."""
    return ORDER.search(text) if "::" in text or "##" in text else None


def without_orders(text: str) -> str:
    """Text for people and logs in which no CI system finds an order: a blank stands where one would begin."""
    return text if first_order(text) is None else ORDER.sub(lambda begin: f"{begin[0]} ", text)


def one_line(text: str) -> str:
    """Text that has one line of an output to itself: a line break in it would begin another one, of any meaning."""
    return " ".join(printable(text).splitlines())
