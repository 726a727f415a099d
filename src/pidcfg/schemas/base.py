"""Field types of every vendor's schema: what a text in a YAML file means, decided by the field it stands in.

Each type is a parser that takes the text of a scalar (`pidcfg.document.Plain` or a quoted string) or a native Python
value, and returns a frozen, exact value; numbers are `Decimal`. What cannot be read raises a `PydanticCustomError`
whose type names the kind of mistake (``number_form``, ``leading_zero`` …), so that the validator can give it a code of
its own.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from decimal import ROUND_HALF_EVEN, Context, Decimal, InvalidOperation
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, NoReturn

from pydantic import BaseModel, BeforeValidator, ConfigDict, WithJsonSchema
from pydantic_core import PydanticCustomError
from pydantic_core.core_schema import no_info_plain_validator_function

if TYPE_CHECKING:
    from pydantic_core import CoreSchema

NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
LEADING_ZERO = re.compile(r"[-+]?0[0-9]")
OTHER_NOTATION = re.compile(r"[-+]?(?:0[xob][0-9a-fA-F_]+|[0-9][0-9_]*_[0-9_.]*|[0-9]+(?::[0-9]+)+)")
BASED = re.compile(r"[-+]?(?:0x[0-9a-fA-F]+|0o[0-7]+|0b[01]+)")
BCD = re.compile(r"[-+]?0x(?P<digits>[0-9]+)")
THOUSANDS = re.compile(r"[-+]?[1-9][0-9]{0,2}(?:_[0-9]{3})+")
NOT_FINITE = re.compile(r"[-+]?\.?(?:inf|infinity|nan)", re.IGNORECASE)
TRUTHS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
LOOKS_BOOLEAN = {"yes": "true", "on": "true", "y": "true", "no": "false", "off": "false", "n": "false"}
LOOKS_OFF = frozenset(("none", "no", "never", "disabled", "inf", ".inf"))
NAME = re.compile(r"\w(?:[\w .\-/#]*[\w#])?")
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f]")
MAX_DIGITS = 32
EXACT = Context(prec=100, rounding=ROUND_HALF_EVEN)
"""Three times the digits that a file may write: products are exact, and quotients round as if they were."""
MAX_EXPONENT = 300
"""Of a number that a file may write; a computer can hold 308."""
NAME_LENGTH = 64
FINITE = "write a number that a register can hold"

SECONDS = {"ms": Decimal("0.001"), "s": Decimal(1), "min": Decimal(60), "h": Decimal(3600)}
DURATION = re.compile(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?) ?(ms|s|sec|second|seconds|min|minute|minutes|h|hour|hours)")
UNIT_WORDS = {"sec": "s", "second": "s", "seconds": "s", "minute": "min", "minutes": "min", "hour": "h", "hours": "h"}
DURATION_PATTERN = r"^[-+]?[0-9.]+ ?(ms|s|sec|seconds?|min|minutes?|h|hours?)$"
COUNTS = re.compile(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?) counts?")
COUNTS_PATTERN = r"^[-+]?[0-9.]+ counts?$"


class Model(BaseModel):
    """Base of every schema: frozen, unknown keys refused. A text below a field is its documentation."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Parser(NamedTuple):
    """How a field is read; `pydantic.PlainValidator` would also work out how its type is written, for more time."""

    parse: Callable[[Any], Any]

    def __get_pydantic_core_schema__(self, *_: object) -> CoreSchema:
        return no_info_plain_validator_function(self.parse)


class Quantity(NamedTuple):
    """A value on a PV or output scale: engineering units, or raw counts.

    ``derived``: worked out from what the file says, so that it need not be a whole number of counts.
    """

    value: Decimal
    counts: bool = False
    derived: bool = False

    def __str__(self) -> str:
        return f"{self.value} counts" if self.counts else str(self.value)


class Duration(NamedTuple):
    """A time whose unit may be left to another key."""

    value: Decimal
    unit: str | None = None

    def seconds(self, default: str = "s") -> Decimal:
        """In seconds; a bare number is in ``default``."""
        return self.value * SECONDS[self.unit or default]

    def __str__(self) -> str:
        return f"{self.value} {self.unit}" if self.unit else str(self.value)


def plain_number(value: Decimal) -> int | float:
    """A Decimal as JSON and YAML write it: an integer where it is one of not too many digits."""
    return int(value) if value == value.to_integral_value() and value.adjusted() < MAX_DIGITS else float(value)


def decimal_text(value: Decimal) -> str:
    """A Decimal without an exponent or needless zeros."""
    text = f"{value:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def refuse(kind: str, message: str, **context: Any) -> NoReturn:
    """Raises the error that the validator turns into a finding; ``only``: the one text that can be meant."""
    raise PydanticCustomError(kind, "{text}", {"text": message, **context})


def parse_number(value: object) -> Decimal:
    """A finite decimal number; text must be unquoted."""
    if isinstance(value, bool) or value is None:
        refuse("number_type", f"{_shown(value)} is not a number")
    if isinstance(value, Decimal | int | float):
        return _finite(Decimal(str(value)), str(value))
    if not isinstance(value, str):
        refuse("number_type", f"a {_kind(value)} stands where a number is wanted")
    if type(value) is str and NUMBER.fullmatch(value):
        refuse(
            "number_type",
            f'"{value}" is text; a number is written without quotes',
            help=f"write {value}",
            only=None if LEADING_ZERO.match(value) else value,
        )
    return number_text(value, alone=True)


def number_text(text: str, *, alone: bool = False) -> Decimal:
    """The number that a text spells, by the rules of this file format rather than YAML's; ``alone``: without a unit."""
    if NUMBER.fullmatch(text):
        if LEADING_ZERO.match(text):
            _refuse_leading_zero(text, alone=alone)
        if len(text) > MAX_DIGITS and sum(c.isdigit() for c in text) > MAX_DIGITS:
            refuse("too_many_digits", f"a number of more than {MAX_DIGITS} digits")
        return _finite(_exact(text), text)
    if NOT_FINITE.fullmatch(text):
        refuse("not_finite", f"{text} is not a finite number", help=FINITE)
    if OTHER_NOTATION.fullmatch(text):
        refuse(
            "number_form",
            f"{text} is not a decimal number",
            help=_as_decimal(text),
            only=_only_decimal(text) if alone else None,
        )
    return refuse("number_type", f"{text!r} is not a number", help=_help(text))


def _exact(text: str) -> Decimal:
    """The number of a text; one whose exponent `Decimal` cannot hold is as far outside of the limits as one can be."""
    try:
        return Decimal(text)
    except InvalidOperation:
        mantissa, _, exponent = text.lower().partition("e")
        return Decimal(f"{mantissa}e{'-' * exponent.startswith('-')}{MAX_EXPONENT**2}")


def _help(text: str) -> str:
    """The cure of a text that is no number."""
    from pidcfg.schemas.misread import ANY, cure

    return cure(text) or ANY


def _refuse_leading_zero(text: str, *, alone: bool) -> NoReturn:
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
        only=decimal if alone else None,
    )


def _only_decimal(text: str) -> str | None:
    """The decimal number of a notation that says its base, or of one that groups thousands."""
    return None if _bcd(text) or not (BASED.fullmatch(text) or THOUSANDS.fullmatch(text)) else _as_decimal(text)[6:]


def _bcd(text: str) -> str | None:
    """What hexadecimal digits mean where they are a word in BCD, when that is another number."""
    match = BCD.fullmatch(text)
    digits = match["digits"].lstrip("0") if match else ""
    return f"{'-' * text.startswith('-')}{digits}" if len(digits) > 1 else None


def _as_decimal(text: str) -> str:
    if ":" in text:
        return "write one number; a duration carries a unit, as in 90 min"
    if decimal := _bcd(text):
        return f"write {int(text, 0)}, or {decimal} where the digits are BCD"
    try:
        return f"write {int(text, 0)}"
    except ValueError:
        return f"write {text.replace('_', '')}"


def _finite(number: Decimal, text: str) -> Decimal:
    if not number.is_finite():
        refuse("not_finite", f"{text} is not a finite number", help=FINITE)
    if number.adjusted() > MAX_EXPONENT:
        refuse("not_finite", f"{text} is too large; the limit is 1e{MAX_EXPONENT}", help="write a smaller number")
    if number.adjusted() < -MAX_EXPONENT:
        refuse("not_finite", f"{text} is too small; the limit is 1e-{MAX_EXPONENT}", help="write 0 where that is meant")
    return number + 0


def _kind(value: object) -> str:
    return (
        "mapping" if isinstance(value, Mapping) else "list" if isinstance(value, list | tuple) else type(value).__name__
    )


def _shown(value: object) -> str:
    return "nothing" if value is None else str(value).lower()


def parse_integer(value: object) -> int:
    """A whole number."""
    number = parse_number(value)
    if number != number.to_integral_value():
        refuse("number_type", f"{value} is not a whole number")
    return int(number)


def parse_flag(value: object) -> bool:
    """``true`` or ``false`` and nothing else: ``yes`` and ``on`` are text."""
    return flag(value, alone=True)


def flag(value: object, *, alone: bool) -> bool:
    """A switch; ``alone``: no name can stand in its place, so that a word has its one meaning."""
    if isinstance(value, bool):
        return value
    if isinstance(value, str):
        if type(value) is not str and value in TRUTHS:
            return TRUTHS[value]
        word = LOOKS_BOOLEAN.get(value.lower()) or (value.lower() if value.lower() in TRUTHS else None)
        help_text = f"write {word}" if word else "write true or false"
        refuse("boolean_form", f"{value!r} is not true or false", help=help_text, only=word if alone else None)
    return refuse("boolean_form", f"a {_kind(value)} stands where true or false is wanted")


def parse_text(value: object) -> str:
    """One or more lines of text without control characters."""
    if not isinstance(value, str):
        refuse(
            "text_type",
            f"{_shown(value)} stands where text is wanted"
            if value is None
            else f"a {_kind(value)} stands where text is wanted",
        )
    text = str(value)
    if CONTROL.search(text):
        refuse("text_type", "a control character in a text", help="delete it")
    return text


def parse_name(value: object) -> str:
    """A tag: letters, digits and ``_ - . / #`` and single blanks inside, so that it is safe in every output."""
    text = parse_text(value)
    if len(text) > NAME_LENGTH:
        message = f"a name of {len(text)} characters; the limit is {NAME_LENGTH}"
        refuse("name_form", message, help="shorten it; a long text can stand in description")
    if not NAME.fullmatch(text) or "  " in text:
        from pidcfg.odd_signs import said_of

        refuse(
            "name_form",
            f"{text!r} is not usable as a name{said_of(text)}",
            help="begin with a letter or digit; letters, digits, blanks and _ - . / # may follow",
        )
    return text


def parse_duration(value: object) -> Duration:
    """A number (its unit is the field's) or a text with a unit: ``250 ms``, ``2 min``, ``1 h``."""
    if isinstance(value, Duration):
        return value
    if isinstance(value, str):
        match = DURATION.fullmatch(value)
        if match:
            unit = match.group(2)
            return Duration(number_text(match.group(1)), UNIT_WORDS.get(unit, unit))
        if not NUMBER.fullmatch(value) and value[:1].isdigit() and value[-1:].isalpha() and " " in value.strip():
            help_text = _help(value) if value.split()[-1] in {*SECONDS, *UNIT_WORDS} else None
            help_text = help_text or "units are ms, s, min and h, as in 250 ms"
            refuse("duration_form", f"{value!r} is not a time", help=help_text)
    return Duration(parse_number(value))


def parse_seconds(value: object) -> Decimal:
    """A duration in seconds; a bare number is seconds."""
    return parse_duration(value).seconds()


def parse_off_seconds(value: object) -> Decimal:
    """A time in seconds; ``off`` is 0, which removes the term."""
    if isinstance(value, str) and value.casefold() in LOOKS_OFF:
        refuse("number_type", f"{value!r} is not a time", help="write off, which removes the term, or a time")
    return Decimal(0) if value == "off" else parse_seconds(value)


def parse_minutes(value: object) -> Decimal:
    """A duration in minutes; a bare number is minutes."""
    duration = parse_duration(value)
    return duration.value if duration.unit in {None, "min"} else duration.seconds() / SECONDS["min"]


def parse_quantity(value: object) -> Quantity:
    """A number in engineering units (raw where there is no range), or a text ``2048 counts``."""
    if isinstance(value, Quantity):
        return value
    if isinstance(value, str):
        match = COUNTS.fullmatch(value)
        if match:
            return Quantity(number_text(match.group(1)), counts=True)
    return Quantity(parse_number(value))


def parse_pair(parse: Callable[[object], Any], what: str) -> Callable[[object], tuple[Any, Any]]:
    """A parser of a list of two."""

    def pair(value: object) -> tuple[Any, Any]:
        if not isinstance(value, list | tuple) or isinstance(value, Quantity) or len(value) != 2:
            number = len(value) if isinstance(value, list | tuple) and not isinstance(value, Quantity) else 0
            given = f", not of {number}" if number else ""
            comma = "; if a comma was to be a decimal sign: that is a point" if number > 2 else ""
            help_text = _range_help(value) or f"write [low, high]{comma}"
            refuse("pair_type", f"{what} is wanted: a list of two values{given}", help=help_text)
        return parse(value[0]), parse(value[1])

    return pair


def _range_help(value: object) -> str | None:
    """How to write the range that a text seems to mean."""
    from pidcfg.schemas.misread import range_of

    return range_of(value) if isinstance(value, str) else None


def parse_range(value: object) -> tuple[Decimal, Decimal]:
    """Engineering values at 0 % and 100 %, ascending."""
    low, high = parse_pair(parse_number, "a range")(value)
    if low >= high:
        help_text = "write the lower end first" if low > high else "the two ends must differ"
        refuse("range_order", f"the range [{low}, {high}] does not ascend", help=help_text)
    return low, high


def _quantity_schema() -> dict[str, Any]:
    return {"anyOf": [{"type": "number"}, {"type": "string", "pattern": COUNTS_PATTERN}]}


def _duration_schema() -> dict[str, Any]:
    return {"anyOf": [{"type": "number"}, {"type": "string", "pattern": DURATION_PATTERN}]}


def _pair_schema(item: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": item, "minItems": 2, "maxItems": 2}


Number = Annotated[Decimal, Parser(parse_number), WithJsonSchema({"type": "number"})]
Integer = Annotated[int, Parser(parse_integer), WithJsonSchema({"type": "integer"})]
FormatVersion = Annotated[Literal[1], BeforeValidator(parse_integer)]
Flag = Annotated[bool, Parser(parse_flag), WithJsonSchema({"type": "boolean"})]
Text = Annotated[str, Parser(parse_text), WithJsonSchema({"type": ["string", "number", "boolean"]})]
Name = Annotated[str, Parser(parse_name), WithJsonSchema({"type": ["string", "number"], "maxLength": NAME_LENGTH})]
Seconds = Annotated[Decimal, Parser(parse_seconds), WithJsonSchema(_duration_schema())]
OffSeconds = Annotated[
    Decimal,
    Parser(parse_off_seconds),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string", "pattern": DURATION_PATTERN}, {"const": "off"}]}),
]
Minutes = Annotated[Decimal, Parser(parse_minutes), WithJsonSchema(_duration_schema())]
AnyQuantity = Annotated[Quantity, Parser(parse_quantity), WithJsonSchema(_quantity_schema())]
Range = Annotated[tuple[Decimal, Decimal], Parser(parse_range), WithJsonSchema(_pair_schema({"type": "number"}))]
QuantityPair = Annotated[
    tuple[Quantity, Quantity],
    Parser(parse_pair(parse_quantity, "a pair of limits")),
    WithJsonSchema(_pair_schema(_quantity_schema())),
]
