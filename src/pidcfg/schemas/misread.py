"""What a text that is no number was meant as, in a cure: decimal commas, signs between thousands, units, dashes.

None of these is ever read as a number: where two readings are possible, a person chooses.
"""

from __future__ import annotations

import re

from pidcfg.odd_signs import code, odd, plain, what

GROUP = "[',.\N{RIGHT SINGLE QUOTATION MARK}\N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}\N{THIN SPACE} ]"
"""Signs that people write between thousands."""
ANY = "write one number in digits, with a point where it has decimals, as in 2.5"
"""The cure of a text that is like no number."""
DIGITS = r"[-+]?[0-9]+"
COMMA = re.compile(rf"(?P<whole>{DIGITS}),(?P<part>[0-9]+)")
GROUPED = re.compile(
    rf"(?P<whole>[-+]?[0-9]{{1,3}}(?P<group>{GROUP})[0-9]{{3}}(?:(?P=group)[0-9]{{3}})*)(?:[.,](?P<part>[0-9]+))?"
)
WITH_UNIT = re.compile(r"(?P<number>[-+]?[0-9][0-9.,']*) *(?P<unit>(?:[^\W\d_]|[%°℃℉]|/(?=[^\W\d_])).*)")
LIKE_DIGITS = str.maketrans("OoIl", "0011")
"""Letters that are typed for digits."""
NUMBER = re.compile(r"[-+]?[0-9]+(?:\.[0-9]+)?")
BETWEEN = re.compile(r"(?P<low>[-+]?[0-9.]+) *(?:-|\.\.+|…|:|to|bis|;|~) *(?P<high>[-+]?[0-9.]+)")
"""Two numbers as people write a range."""
KEPT = frozenset(
    ("count", "counts", "ms", "s", "sec", "second", "seconds", "min", "minute", "minutes", "h", "hour", "hours")
)
"""Units that may stand behind a number."""


def cure(text: str) -> str | None:
    """How to write the number that a text seems to mean; None where nothing can be said."""
    bare = plain(text)
    if decimal := _decimal(bare):
        return decimal
    if bare != text and NUMBER.fullmatch(bare):
        sign = odd(text)
        return f"write {bare}" + (f": {code(sign)} is {what(sign)}" if sign else "")
    if NUMBER.fullmatch(bare.translate(LIKE_DIGITS)):
        return f"write {bare.translate(LIKE_DIGITS)}: a letter stands where a digit belongs"
    match = WITH_UNIT.fullmatch(bare)
    if match is None:
        return None
    inner, unit = _decimal(match["number"]), match["unit"]
    if unit in KEPT:
        return inner and f"{inner}; {unit} may stay"
    return f"{inner or 'write the number alone'}; it is taken in the key's own unit, which need not be {unit}"


def alone(text: str) -> str:
    """How to write a number where no unit may stand."""
    bare = plain(text)
    match = WITH_UNIT.fullmatch(bare)
    if match and NUMBER.fullmatch(match["number"]):
        return f"write {match['number']} alone, without {match['unit']}"
    return cure(text) or ANY


def _decimal(text: str) -> str | None:
    """The cure of a decimal comma, or of signs between thousands; both readings where there are two."""
    comma, grouped = COMMA.fullmatch(text), GROUPED.fullmatch(text)
    if comma and grouped:
        return f"write {comma['whole']}.{comma['part']} or {comma['whole']}{comma['part']}: a comma says neither"
    if comma:
        return f"write {comma['whole']}.{comma['part']}: the decimal sign is a point"
    if grouped is None or (grouped["group"] == "." and grouped["part"] is None and text.count(".") < 2):
        return None
    whole = grouped["whole"].replace(grouped["group"], "")
    return f"write {whole}{'.' + grouped['part'] if grouped['part'] else ''}: nothing stands between thousands"


def range_of(text: str) -> str | None:
    """How to write the range that a text seems to mean; None where nothing can be said."""
    match = BETWEEN.fullmatch(plain(text))
    return f"write [{match['low']}, {match['high']}]" if match else None
