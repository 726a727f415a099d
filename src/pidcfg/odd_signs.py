"""Signs that only look like those of YAML, of numbers and of keys: what they are called, and what they are taken for.

Word processors, web pages and keyboards of other languages make them. They are letters to YAML, so that nothing is read
as what it looks like: a message names the sign, and a person chooses.
"""

from __future__ import annotations

import re
import unicodedata

BLANKS = {
    "\N{NO-BREAK SPACE}": "a no-break space",
    "\N{NARROW NO-BREAK SPACE}": "a narrow no-break space",
    "\N{FIGURE SPACE}": "a figure space",
    "\N{THIN SPACE}": "a thin space",
    "\N{EN SPACE}": "an en space",
    "\N{EM SPACE}": "an em space",
    "\N{IDEOGRAPHIC SPACE}": "an ideographic space",
    "\N{ZERO WIDTH SPACE}": "a zero width space",
    "\N{ZERO WIDTH NO-BREAK SPACE}": "a byte order mark",
}
DASHES = "\N{HYPHEN}\N{NON-BREAKING HYPHEN}\N{FIGURE DASH}\N{EN DASH}\N{EM DASH}\N{MINUS SIGN}"
QUOTES = {
    "\N{LEFT DOUBLE QUOTATION MARK}": "\N{RIGHT DOUBLE QUOTATION MARK}",
    "\N{RIGHT DOUBLE QUOTATION MARK}": "\N{RIGHT DOUBLE QUOTATION MARK}",
    "\N{DOUBLE LOW-9 QUOTATION MARK}": "\N{LEFT DOUBLE QUOTATION MARK}\N{RIGHT DOUBLE QUOTATION MARK}",
    "\N{LEFT SINGLE QUOTATION MARK}": "\N{RIGHT SINGLE QUOTATION MARK}",
    "\N{RIGHT SINGLE QUOTATION MARK}": "\N{RIGHT SINGLE QUOTATION MARK}",
    "\N{SINGLE LOW-9 QUOTATION MARK}": "\N{LEFT SINGLE QUOTATION MARK}\N{RIGHT SINGLE QUOTATION MARK}",
    "\N{LEFT-POINTING DOUBLE ANGLE QUOTATION MARK}": "\N{RIGHT-POINTING DOUBLE ANGLE QUOTATION MARK}",
    "\N{RIGHT-POINTING DOUBLE ANGLE QUOTATION MARK}": "\N{LEFT-POINTING DOUBLE ANGLE QUOTATION MARK}",
}
"""Quotes of word processors, and those that close them, by language."""
FULL_WIDTH = range(0xFF01, 0xFF5F)
"""The signs of ASCII as wide as a Chinese character."""
BLANK = re.compile("[" + "".join(BLANKS) + "]")


def meant(sign: str) -> str:
    """The sign of ASCII that a sign is taken for; itself where there is none."""
    if sign in BLANKS:
        return " "
    if sign in DASHES:
        return "-"
    if sign in QUOTES:
        return '"'
    if ord(sign) in FULL_WIDTH:
        return chr(ord(sign) - FULL_WIDTH.start + ord("!"))
    digit = unicodedata.decimal(sign, None)
    return sign if digit is None else str(digit)


def plain(text: str) -> str:
    """A text with the signs that its own are taken for, without blanks and quotes around it."""
    return "".join(map(meant, text)).strip(' "')


def code(sign: str) -> str:
    """A sign as a message names it: it may be invisible."""
    return f"U+{ord(sign):04X}"


def what(sign: str) -> str:
    """What a sign is, and what it is not."""
    if sign in BLANKS:
        return f"{BLANKS[sign]}, not a space"
    if sign in DASHES:
        return "a dash, not a minus"
    if sign in QUOTES:
        return "a quote, not a quote of YAML"
    return unicodedata.name(sign, "a sign without a name")


def odd(text: str) -> str | None:
    """The first sign of a text that looks like another one: not ASCII in a word that is, or taken for ASCII."""
    taken = next((sign for sign in text if meant(sign) != sign), None)
    if taken is not None:
        return taken
    latin = any(sign.isascii() and sign.isalpha() for sign in text)
    return next((sign for sign in text if latin and _is_foreign(sign)), None)


def _is_foreign(sign: str) -> bool:
    """Whether a sign is a letter of another alphabet than the Latin one."""
    return sign.isalpha() and not unicodedata.name(sign, "LATIN").startswith("LATIN")


def said_of(text: str) -> str:
    """What a message adds about the odd sign of a text; empty: there is none."""
    sign = odd(text)
    return f": {code(sign)} in it is {what(sign)}" if sign else ""


def in_curly_quotes(text: str) -> bool:
    """Whether a text begins and ends with quotes that are none of YAML's."""
    return len(text) > 1 and text[-1] in QUOTES.get(text[0], "")
