"""Numbers as a file may write them: decimal, exact, finite, of no more digits than a person means."""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import ROUND_HALF_EVEN, Context, Decimal, InvalidOperation
from typing import Any, NoReturn

from pydantic_core import PydanticCustomError

from pidcfg.text.signs import code_point, describe_sign, find_lookalike, to_ascii

# ----------------------------------------------------------------------------------------------------------------------
# What a text that is no number was meant as, in a cure: decimal commas, signs between thousands, units, dashes.
# None of these is ever read as a number: where two readings are possible, a person chooses.

THOUSANDS_SIGNS = "[',.\N{RIGHT SINGLE QUOTATION MARK}\N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}\N{THIN SPACE} ]"
"""Signs that people write between thousands."""
WRITE_ONE_NUMBER = "write one number in digits, with a point where it has decimals, as in 2.5"
"""The cure of a text that is like no number."""
DIGITS = r"[-+]?[0-9]+"
DECIMAL_COMMA = re.compile(rf"(?P<whole>{DIGITS}),(?P<part>[0-9]+)")
GROUPED_NUMBER = re.compile(
    rf"(?P<whole>[-+]?[0-9]{{1,3}}(?P<group>{THOUSANDS_SIGNS})[0-9]{{3}}(?:(?P=group)[0-9]{{3}})*)(?:[.,](?P<part>[0-9]+))?"
)
NUMBER_WITH_UNIT = re.compile(r"(?P<number>[-+]?[0-9][0-9.,']*) *(?P<unit>(?:[^\W\d_]|[%°℃℉]|/(?=[^\W\d_])).*)")
NUMBER_AND_COMMENT = re.compile(r"(?P<number>[-+]?[0-9]+(?:\.[0-9]+)?) *(?P<sign>//|\(\*|--|[#;,])\s*(?P<rest>.*)")
"""A number with a comment of another language, or the end of a line of one, behind it."""
LIKE_DIGITS = str.maketrans("OoIl", "0011")
"""Letters that are typed for digits, in a text that has digits."""
ROMAN_NUMERALS = {"I": "1", "II": "2", "III": "3", "IV": "4"}
SECONDS_BY_UNIT = {"ms": Decimal("0.001"), "min": Decimal(60), "h": Decimal(3600)}
WRITTEN_NUMBER = re.compile(r"[-+]?[0-9]+(?:\.[0-9]+)?")
RANGE_TEXT = re.compile(r"(?P<low>[-+]?[0-9.]+) *(?:-|\.\.+|…|:|to|bis|;|~) *(?P<high>[-+]?[0-9.]+)")
"""Two numbers as people write a range."""
ALLOWED_UNITS = frozenset(
    ("count", "counts", "ms", "s", "sec", "second", "seconds", "min", "minute", "minutes", "h", "hour", "hours")
)
"""Units that may stand behind a number."""


def number_cure(text: str) -> str | None:
    """How to write the number that a text seems to mean; None where nothing can be said."""
    ascii_text = to_ascii(text)
    if cure := _comma_cure(ascii_text) or _comment_cure(ascii_text):
        return cure
    if ascii_text != text and WRITTEN_NUMBER.fullmatch(ascii_text):
        sign = find_lookalike(text)
        return f"write {ascii_text}" + (f": {code_point(sign)} is {describe_sign(sign)}" if sign else "")
    if cure := _letter_cure(ascii_text):
        return cure
    match = NUMBER_WITH_UNIT.fullmatch(ascii_text)
    if match is None:
        return None
    inner_cure, unit = _comma_cure(match["number"]), match["unit"]
    if unit in ALLOWED_UNITS:
        return inner_cure and f"{inner_cure}; {unit} may stay"
    return f"{inner_cure or 'write the number alone'}; it is taken in the key's own unit, which need not be {unit}"


def _letter_cure(text: str) -> str | None:
    """The cure of letters for digits: one for the digit that it is like, or a Roman numeral."""
    digits = ROMAN_NUMERALS.get(text) or text.translate(LIKE_DIGITS)
    meant = text in ROMAN_NUMERALS or (WRITTEN_NUMBER.fullmatch(digits) and any(map(str.isdecimal, text)))
    return f"write {digits}: a letter stands where a digit belongs" if meant else None


def _comment_cure(text: str) -> str | None:
    """The cure of a number with a comment, or the end of a line of another language, behind it."""
    match = NUMBER_AND_COMMENT.fullmatch(text)
    if match is None or (match["rest"] and match["sign"] in ";,"):
        return None
    return f"write {match['number']}{comment_of(match['rest']) if match['rest'] else ': nothing stands behind it'}"


def comment_of(rest: str) -> str:
    """A comment behind a value, as YAML has it, and why."""
    return f"  # {rest.removesuffix('*)').strip()}: a comment begins with two blanks and #"


def unitless_cure(text: str) -> str:
    """How to write a number where no unit may stand."""
    ascii_text = to_ascii(text)
    match = NUMBER_WITH_UNIT.fullmatch(ascii_text)
    if match and WRITTEN_NUMBER.fullmatch(match["number"]):
        number, factor = match["number"], SECONDS_BY_UNIT.get(match["unit"])
        time = factor and f"write {Decimal(number) * factor:f} alone: times are in s"
        return time or f"write {number} alone, without {match['unit']}"
    return number_cure(text) or WRITE_ONE_NUMBER


def _comma_cure(text: str) -> str | None:
    """The cure of a decimal comma, or of signs between thousands; both readings where there are two."""
    comma, grouped = DECIMAL_COMMA.fullmatch(text), GROUPED_NUMBER.fullmatch(text)
    if comma and grouped:
        return f"write {comma['whole']}.{comma['part']} or {comma['whole']}{comma['part']}: a comma says neither"
    if comma:
        return f"write {comma['whole']}.{comma['part']}: the decimal sign is a point"
    if grouped is None or (grouped["group"] == "." and grouped["part"] is None and text.count(".") < 2):
        return None
    whole = grouped["whole"].replace(grouped["group"], "")
    return f"write {whole}{'.' + grouped['part'] if grouped['part'] else ''}: nothing stands between thousands"


def range_cure(text: str) -> str | None:
    """How to write the range that a text seems to mean; None where nothing can be said."""
    match = RANGE_TEXT.fullmatch(to_ascii(text))
    return f"write [{match['low']}, {match['high']}]" if match else None


# --- Numbers as a file may write them: decimal, exact, finite, and of no more digits than a person means --------------
#
# What cannot be read raises a `PydanticCustomError` whose type names the kind of mistake (``number_form``,
# ``leading_zero`` …), so that the validator can give it a code of its own.

NUMBER = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
LEADING_ZERO = re.compile(r"[-+]?0[0-9]")
OTHER_NOTATION = re.compile(r"[-+]?(?:0[xob][0-9a-fA-F_]+|[0-9][0-9_]*_[0-9_.]*|[0-9]+(?::[0-9]+)+)")
BASE_NOTATION = re.compile(r"[-+]?(?:0x[0-9a-fA-F]+|0o[0-7]+|0b[01]+)")
BCD = re.compile(r"[-+]?0x(?P<digits>[0-9]+)")
THOUSANDS = re.compile(r"[-+]?[1-9][0-9]{0,2}(?:_[0-9]{3})+")
NOT_FINITE = re.compile(r"[-+]?\.?(?:inf|infinity|nan)", re.IGNORECASE)
UNSIGNED_PATTERN = r"(?:(?:0|[1-9][0-9]*)(?:\.[0-9]*)?|\.[0-9]+)"
"""A number that is taken, as a part of a pattern of a JSON Schema."""
SIGNED_PATTERN = rf"[-+]?{UNSIGNED_PATTERN}(?:[eE][-+]?[0-9]+)?"
"""The same with what may stand before and behind it."""
MAX_DIGITS = 32
EXACT_CONTEXT = Context(prec=100, rounding=ROUND_HALF_EVEN)
"""Three times the digits that a file may write: products are exact, and quotients round as if they were."""
MAX_EXPONENT = 300
"""Of a number that a file may write; a computer can hold 308."""
WRITE_FINITE = "write a number that a register can hold"


def plain_number(value: Decimal) -> int | float:
    """A Decimal as JSON and YAML write it: an integer where it is one of not too many digits."""
    return int(value) if value == value.to_integral_value() and value.adjusted() < MAX_DIGITS else float(value)


def decimal_text(value: Decimal) -> str:
    """A Decimal without an exponent or needless zeros."""
    text = f"{value:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


JsonSchema = dict[str, Any]
"""A JSON Schema, or a part of one."""


def refuse(kind: str, message: str, **context: object) -> NoReturn:
    """Raises the error that the validator turns into a finding; ``only``: the one text that can be meant."""
    raise PydanticCustomError(kind, "{text}", {"text": message, **context})


def text_schema(pattern: str, *examples: str) -> JsonSchema:
    """The JSON Schema of a text that a pattern fits from end to end; an editor shows the examples where it does not.

    To an editor it is a regular expression of JavaScript. So that it means the same there as in Python, it has no flags
    and no names of groups, and the ASCII digits and letters in place of their classes.
    """
    return {
        "type": "string",
        "pattern": f"^(?:{pattern})$",
        "examples": list(examples),
        "patternErrorMessage": f"write it like {' or '.join(examples)}",
    }


def number_schema(*texts: JsonSchema) -> JsonSchema:
    """The JSON Schema of a number, or of one of some texts in its place."""
    return {"anyOf": [*texts, {"type": "number"}]}


def parse_number(value: object) -> Decimal:
    """A finite decimal number; text must be unquoted."""
    if isinstance(value, bool) or value is None:
        refuse("number_type", f"{strange_value(value)} is not a number")
    if isinstance(value, Decimal | int | float):
        return _check_finite(Decimal(str(value)), str(value))
    if not isinstance(value, str):
        refuse("number_type", f"a {kind_of(value)} stands where a number is wanted")
    if type(value) is str and NUMBER.fullmatch(value):
        refuse(
            "number_type",
            f'"{value}" is text; a number is written without quotes',
            help=f"write {value}",
            only=None if LEADING_ZERO.match(value) else value,
        )
    return parse_number_text(value, unitless=True)


def parse_number_text(text: str, *, unitless: bool = False) -> Decimal:
    """The number that a text spells, by the rules of this file format; ``unitless``: nothing stands behind it."""
    if NUMBER.fullmatch(text):
        if LEADING_ZERO.match(text):
            _refuse_leading_zero(text, unitless=unitless)
        if len(text) > MAX_DIGITS and sum(c.isdigit() for c in text) > MAX_DIGITS:
            refuse("too_many_digits", f"a number of more than {MAX_DIGITS} digits")
        return _check_finite(_exact_number(text), text)
    if NOT_FINITE.fullmatch(text):
        refuse("not_finite", f"{text} is not a finite number", help=WRITE_FINITE)
    if OTHER_NOTATION.fullmatch(text):
        refuse(
            "number_form",
            f"{text} is not a decimal number",
            help=_decimal_cure(text),
            only=_unambiguous_decimal(text) if unitless else None,
        )
    return refuse("number_type", f"{text!r} is not a number", help=help_of(text))


def _exact_number(text: str) -> Decimal:
    """The number of a text; one whose exponent `Decimal` cannot hold is as far outside of the limits as one can be."""
    try:
        return Decimal(text)
    except InvalidOperation:
        mantissa, _, exponent = text.lower().partition("e")
        return Decimal(f"{mantissa}e{'-' * exponent.startswith('-')}{MAX_EXPONENT**2}")


def help_of(text: str) -> str:
    """The cure of a text that is no number."""
    return number_cure(text) or WRITE_ONE_NUMBER


def _refuse_leading_zero(text: str, *, unitless: bool) -> NoReturn:
    sign, digits = ("-", text[1:]) if text[0] == "-" else ("", text.lstrip("+"))
    decimal = sign + (digits.lstrip("0") if digits.lstrip("0")[:1].isdigit() else "0" + digits.lstrip("0"))
    octal = f"{sign}{int(digits, 8)}" if set(digits) <= set("01234567") else decimal
    if octal != decimal:
        refuse(
            "leading_zero",
            f"{text} can be read as octal ({octal}) or as decimal ({decimal})",
            help=f"write {octal} or {decimal}",
        )
    refuse(
        "leading_zero",
        f"{text} has a leading zero, which some read as octal",
        help=f"write {decimal}",
        only=decimal if unitless else None,
    )


def _unambiguous_decimal(text: str) -> str | None:
    """The decimal number of a notation that says its base, or of one that groups thousands."""
    return (
        None
        if _bcd_digits(text) or not (BASE_NOTATION.fullmatch(text) or THOUSANDS.fullmatch(text))
        else _decimal_cure(text)[6:]
    )


def _bcd_digits(text: str) -> str | None:
    """What hexadecimal digits mean where they are a word in BCD, when that is another number."""
    match = BCD.fullmatch(text)
    digits = match["digits"].lstrip("0") if match else ""
    return f"{'-' * text.startswith('-')}{digits}" if len(digits) > 1 else None


def _decimal_cure(text: str) -> str:
    if ":" in text:
        return "write one number; a duration carries a unit, as in 90 min"
    if decimal := _bcd_digits(text):
        return f"write {int(text, 0)}, or {decimal} where the digits are BCD"
    try:
        return f"write {int(text, 0)}"
    except ValueError:
        return f"write {text.replace('_', '')}"


def _check_finite(number: Decimal, text: str) -> Decimal:
    if not number.is_finite():
        refuse("not_finite", f"{text} is not a finite number", help=WRITE_FINITE)
    if number.adjusted() > MAX_EXPONENT:
        refuse("not_finite", f"{text} is too large; the limit is 1e{MAX_EXPONENT}", help="write a smaller number")
    if number.adjusted() < -MAX_EXPONENT:
        refuse("not_finite", f"{text} is too small; the limit is 1e-{MAX_EXPONENT}", help="write 0 where that is meant")
    return number + 0


def kind_of(value: object) -> str:
    """What kind of value stands where another is wanted."""
    if isinstance(value, Mapping):
        return "mapping"
    return "list" if isinstance(value, list | tuple) else type(value).__name__


def strange_value(value: object) -> str:
    """A value that is none of the wanted kind, as a file has it."""
    return "nothing" if value is None else str(value).lower()


def parse_integer(value: object) -> int:
    """A whole number."""
    number = parse_number(value)
    if number != number.to_integral_value():
        refuse("number_type", f"{value} is not a whole number", help="write a number without decimals")
    return int(number)
