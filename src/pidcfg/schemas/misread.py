"""What a text that is no number was meant as, in a cure: decimal commas, signs between thousands, units, dashes.

None of these is ever read as a number: where two readings are possible, a person chooses.
"""

from __future__ import annotations

import re

GROUP = "[',.\N{RIGHT SINGLE QUOTATION MARK}\N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}\N{THIN SPACE} ]"
"""Signs that people write between thousands."""
BLANKS = {"\N{NO-BREAK SPACE}": "no-break space", "\N{NARROW NO-BREAK SPACE}": "narrow no-break space"}
DASHES = "\N{HYPHEN}\N{NON-BREAKING HYPHEN}\N{FIGURE DASH}\N{EN DASH}\N{EM DASH}\N{MINUS SIGN}"
QUOTES = (
    "\N{LEFT DOUBLE QUOTATION MARK}\N{RIGHT DOUBLE QUOTATION MARK}\N{DOUBLE LOW-9 QUOTATION MARK}"
    "\N{LEFT SINGLE QUOTATION MARK}\N{RIGHT SINGLE QUOTATION MARK}\N{SINGLE LOW-9 QUOTATION MARK}"
)
"""Quotes of word processors, which are letters to YAML."""
DIGITS = r"[-+]?[0-9]+"
COMMA = re.compile(rf"(?P<whole>{DIGITS}),(?P<part>[0-9]+)")
GROUPED = re.compile(
    rf"(?P<whole>[-+]?[0-9]{{1,3}}(?P<group>{GROUP})[0-9]{{3}}(?:(?P=group)[0-9]{{3}})*)(?:[.,](?P<part>[0-9]+))?"
)
WITH_UNIT = re.compile(r"(?P<number>[-+]?[0-9][0-9.,']*) *(?P<unit>(?:[^\W\d_]|[%°℃℉/]).*)")
KEPT = frozenset(
    ("count", "counts", "ms", "s", "sec", "second", "seconds", "min", "minute", "minutes", "h", "hour", "hours")
)
"""Units that may stand behind a number."""


def cure(text: str) -> str | None:
    """How to write the number that a text seems to mean; None where nothing can be said."""
    plain = "".join("-" if sign in DASHES else " " if sign in BLANKS else sign for sign in text).strip(QUOTES).strip()
    if decimal := _decimal(plain):
        return decimal
    if plain != text and re.fullmatch(rf"{DIGITS}(?:\.[0-9]+)?", plain):
        return f"write {plain}{_odd(text)}"
    match = WITH_UNIT.fullmatch(plain)
    if match is None:
        return None
    inner, unit = _decimal(match["number"]), match["unit"]
    if unit in KEPT:
        return inner and f"{inner}; {unit} may stay"
    return f"{inner or 'write the number alone'}; it is taken in the key's own unit, which need not be {unit}"


def _decimal(text: str) -> str | None:
    """The cure of a decimal comma, or of signs between thousands; both readings where there are two."""
    comma, grouped = COMMA.fullmatch(text), GROUPED.fullmatch(text)
    if comma and grouped:
        return f"write {comma['whole']}.{comma['part']} or {comma['whole']}{comma['part']}: a comma says neither"
    if comma:
        return f"write {comma['whole']}.{comma['part']}: the decimal sign is a point"
    if grouped is None or (grouped["group"] == "." and grouped["part"] is None):
        return None
    whole = grouped["whole"].replace(grouped["group"], "")
    return f"write {whole}{'.' + grouped['part'] if grouped['part'] else ''}: nothing stands between thousands"


def _odd(text: str) -> str:
    """Which sign of a text only looks like the right one."""
    sign = next((sign for sign in text if sign in DASHES or sign in BLANKS or sign in QUOTES), None)
    if sign is None:
        return ""
    kind = "dash" if sign in DASHES else BLANKS.get(sign, "quote")
    looks = {"dash": "a minus", "quote": "a quote of YAML"}.get(kind, "a space")
    return f": U+{ord(sign):04X} is a {kind}, not {looks}"
