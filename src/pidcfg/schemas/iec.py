"""Parameters of function blocks and instructions: elementary types of IEC 61131-3, and values that are wired.

A parameter is a literal of its type or, where the field allows it, a `Wire`: an expression of signals and of other
blocks' parameters. What an expression means is known only once all names are (`pidcfg.encoders.nextopid.wiring`).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from decimal import Decimal
from typing import Annotated, Literal, NamedTuple

from pydantic import BeforeValidator, WithJsonSchema

from pidcfg.schemas.base import (
    BOOLEANS,
    DURATION,
    DURATION_FORM,
    LIKE_BOOLEAN,
    Parser,
    parse_duration,
    parse_flag,
    parse_switch,
)
from pidcfg.schemas.numbers import (
    LEADING_ZERO,
    NOT_FINITE,
    NUMBER,
    OTHER_NOTATION,
    SIGNED_PATTERN,
    JsonSchema,
    parse_integer,
    parse_number,
    parse_number_text,
    refuse,
    text_schema,
)
from pidcfg.text.frozen import frozen

Kind = Literal["bool", "whole", "real", "word", "time"]


@frozen
class IecType:
    """An elementary type: its name, for whole numbers its ends, for an enumeration its words."""

    name: str
    kind: Kind
    low: int = 0
    high: int = 0
    words: tuple[str, ...] = ()
    double: bool = False
    """Of a real number: double precision."""

    @property
    def default(self) -> bool | int | float | str:
        """What a variable holds that is given no initial value."""
        if self.kind == "word":
            return self.words[0]
        if self.kind == "time":
            return time_text(0)
        return False if self.kind == "bool" else 0 if self.kind == "whole" else 0.0


BOOL = IecType("BOOL", "bool")
REAL = IecType("REAL", "real")
LREAL = IecType("LREAL", "real", double=True)
INT = IecType("INT", "whole", -0x8000, 0x7FFF)
UINT = IecType("UINT", "whole", 0, 0xFFFF)
USINT = IecType("USINT", "whole", 0, 0xFF)
DINT = IecType("DINT", "whole", -0x80000000, 0x7FFFFFFF)
TIME = IecType("TIME", "time", 0, 0xFFFFFFFF)
"""In ms."""
AUTOTUNE_MODE = IecType("AUTOTUNE_MODE", "word", words=("AUTOTUNE_P", "AUTOTUNE_PI", "AUTOTUNE_PID"))
LOOP_MODE = IecType("LOOP_MODE", "word", words=("manual", "auto", "cascade"))
DERIVATIVE_OF = IecType("DERIVATIVE_OF", "word", words=("pv", "error"))

RESERVED_WORDS = """
ABS ACTION AND ARRAY AT BOOL BY BYTE CASE CONFIGURATION CONSTANT DATE DINT DO DWORD ELSE ELSIF END_CASE END_FOR
END_FUNCTION END_FUNCTION_BLOCK END_IF END_PROGRAM END_REPEAT END_STRUCT END_TYPE END_VAR END_WHILE EXIT FALSE
FOR FROM FUNCTION FUNCTION_BLOCK IF INT LINT LREAL LWORD MAX MIN MOD NOT OF ON OR PROGRAM REAL REPEAT RESOURCE RETAIN
RETURN SINT SQRT STEP STRING STRUCT TASK THEN TIME TO TRANSITION TRUE TYPE UDINT UINT ULINT UNTIL USINT VAR VAR_EXTERNAL
VAR_GLOBAL VAR_INPUT VAR_IN_OUT VAR_OUTPUT VAR_TEMP WHILE WITH WORD WSTRING XOR
DATE_AND_TIME DT LDATE LDT LTIME LTOD TIME_OF_DAY TOD
"""
KEYWORDS = frozenset(RESERVED_WORDS.split())
IDENTIFIER = re.compile(r"[A-Za-z](?:_?[A-Za-z0-9])*")
MAX_IDENTIFIER_LENGTH = 40


class Wire(NamedTuple):
    """An expression in place of a value, as it is written."""

    text: str


class TimeNumber(Decimal):
    """Seconds that were written with a unit, so that they can be nothing but a time."""


class IntNumber(Decimal):
    """A number that was written as INT, ``INT#5``."""


LITERAL_WITH_TYPE = re.compile(r"(BOOL|INT|REAL|TIME|T)#(.*)", re.IGNORECASE | re.ASCII)
"""A literal that says its type."""
TIME_PARTS = re.compile(r"(\d+(?:\.\d+)?)(ms|d|h|m|s)", re.IGNORECASE | re.ASCII)
MILLISECONDS = {"d": 86_400_000, "h": 3_600_000, "m": 60_000, "s": 1000, "ms": 1}


def real_text(value: float) -> str:
    """A REAL literal: always with a point, so that no division is one of whole numbers."""
    mantissa, _, exponent = repr(value + 0.0).partition("e")
    whole = mantissa if "." in mantissa else f"{mantissa}.0"
    return f"{whole}E{int(exponent)}" if exponent else whole


def time_text(milliseconds: int) -> str:
    """A TIME as it is stored in listings and programs: ``T#1500ms``."""
    return f"T#{milliseconds}ms"


def time_seconds(text: str) -> Decimal | None:
    """The seconds that a TIME literal means, ``T#1m30s``; None where it is none."""
    body = text.partition("#")[2].replace("_", "")
    if not re.fullmatch(f"(?:{TIME_PARTS.pattern})+", body, TIME_PARTS.flags):
        return None
    parts = TIME_PARTS.findall(body)
    order = [[*MILLISECONDS].index(unit.lower()) for _, unit in parts]
    if order != sorted({*order}) or any("." in number for number, _ in parts[:-1]):
        return None
    return sum((Decimal(number) * MILLISECONDS[unit.lower()] for number, unit in parts), Decimal(0)) / 1000


def is_numeric(text: str) -> bool:
    """Whether a text is a number, or so much like one that nothing else can be meant."""
    return any(form.fullmatch(text) for form in (NUMBER, LEADING_ZERO, OTHER_NOTATION, NOT_FINITE))


def _parse_wire(value: str) -> Wire:
    text = " ".join(str(value).split())
    if text.lower() in LIKE_BOOLEAN or text.lower() in {"true", "false", "null", "~", ""}:
        is_word = text.lower() in LIKE_BOOLEAN
        cure = f"a signal of this name is written ({text})" if is_word else None
        refuse("number_type", f"{text!r} is neither a number nor an expression", help=cure)
    if LEADING_ZERO.match(text):
        refuse("leading_zero", f"{text!r} begins with a leading zero, which some read as octal")
    return Wire(text)


def parse_identifier(value: object) -> str:
    """A name as IEC 61131-3 has it: a letter, then letters, digits and single underscores."""
    if not isinstance(value, str) or not IDENTIFIER.fullmatch(value):
        shown = value if isinstance(value, str) else str(value).lower()
        refuse(
            "name_form",
            f"{shown!r} is not usable as the name of an instance",
            help="begin with a letter; letters, digits and single underscores may follow",
        )
    if len(value) > MAX_IDENTIFIER_LENGTH:
        refuse("name_form", f"a name of {len(value)} characters; at most {MAX_IDENTIFIER_LENGTH} are allowed")
    if value.upper() in KEYWORDS:
        refuse("name_form", f"{value} is a word of the programming language", help=f"write {value}_1")
    return str(value)


def parse_real_in(value: object) -> Decimal | Wire:
    """A number, or an expression of numbers."""
    if isinstance(value, Wire):
        return value
    if isinstance(value, str) and not is_numeric(value):
        return _parse_wire(value)
    return parse_number(value)


def parse_uint_in(value: object) -> int | Wire:
    """A whole number, or an expression of numbers."""
    if isinstance(value, Wire):
        return value
    return _parse_wire(value) if isinstance(value, str) and not is_numeric(value) else parse_integer(value)


def parse_time_in(value: object) -> Decimal | Wire:
    """A time in s, a text with a unit (``500 ms``), or an expression of numbers."""
    if isinstance(value, str) and DURATION.fullmatch(value):
        return TimeNumber(parse_duration(value).seconds())
    return parse_real_in(value)


def parse_bool_in(value: object) -> bool | Wire:
    """``true``, ``false``, or the name of a BOOL."""
    if isinstance(value, Wire):
        return value
    if isinstance(value, str) and value not in BOOLEANS and value.lower() not in {*LIKE_BOOLEAN, "true", "false"}:
        return _parse_wire(value)
    return parse_switch(value, only_bool=False)


def parse_move_in(value: object) -> Decimal | bool | Wire:
    """What is moved: a number, true or false, or an expression of either type."""
    if isinstance(value, bool) or (isinstance(value, str) and value in BOOLEANS):
        return parse_flag(value)
    return parse_real_in(value)


def parse_signal(value: object) -> Decimal | bool:
    """The value of a signal, which says its type: a number, true or false, ``INT#5``, ``T#500ms`` or ``500 ms``."""
    if isinstance(value, bool) or (isinstance(value, str) and value in BOOLEANS):
        return parse_flag(value)
    if isinstance(value, TimeNumber | IntNumber):
        return value
    if isinstance(value, str) and DURATION.fullmatch(value):
        return TimeNumber(parse_duration(value).seconds())
    typed = LITERAL_WITH_TYPE.fullmatch(value) if isinstance(value, str) else None
    return parse_number(value) if typed is None else _parse_literal(str(value), typed.group(1).upper(), typed.group(2))


def _parse_literal(text: str, kind: str, body: str) -> Decimal | bool:
    """The value of a literal that says its type."""
    if kind == "BOOL":
        return parse_flag({"1": True, "0": False, "true": True, "false": False}.get(body.lower(), body))
    if kind in {"TIME", "T"}:
        seconds = time_seconds(text)
        if seconds is None:
            refuse("time_form", f"{text!r} is not a TIME", help="write it as in T#1m30s, T#500ms or 500 ms")
        return TimeNumber(seconds)
    number = parse_number_text(body)
    return IntNumber(number) if kind == "INT" else number


def signal_type(value: Signal) -> IecType:
    """The type that the value of a signal says."""
    if isinstance(value, bool):
        return BOOL
    return TIME if isinstance(value, TimeNumber) else INT if isinstance(value, IntNumber) else REAL


def strip_mode_prefix(value: object) -> object:
    """``PID`` for the manual's own ``AUTOTUNE_PID``."""
    return value.removeprefix("AUTOTUNE_") if isinstance(value, str) else value


WIRE_SCHEMA = {"type": "string"}


def _field_metadata(parse: Callable[[object], object], *schemas: JsonSchema) -> tuple[Parser, WithJsonSchema]:
    return Parser(parse), WithJsonSchema({"anyOf": [*schemas]} if len(schemas) > 1 else schemas[0])


NUMBER_SCHEMA = {"type": "number"}
RealIn = Annotated[Decimal | Wire, *_field_metadata(parse_real_in, NUMBER_SCHEMA, WIRE_SCHEMA), REAL]
TimeIn = Annotated[Decimal | Wire, *_field_metadata(parse_time_in, NUMBER_SCHEMA, WIRE_SCHEMA), REAL]
IntIn = Annotated[Decimal | Wire, *_field_metadata(parse_real_in, {"type": "integer"}, WIRE_SCHEMA), INT]
BoolIn = Annotated[bool | Wire, *_field_metadata(parse_bool_in, {"type": "boolean"}, WIRE_SCHEMA), BOOL]
MoveIn = Annotated[
    Decimal | bool | Wire, *_field_metadata(parse_move_in, NUMBER_SCHEMA, {"type": "boolean"}, WIRE_SCHEMA)
]
Real = Annotated[Decimal, *_field_metadata(parse_number, NUMBER_SCHEMA), REAL]
"""Without wires, like the next ones."""
Bool = Annotated[bool, *_field_metadata(parse_flag, {"type": "boolean"}), BOOL]
UIntIn = Annotated[int | Wire, *_field_metadata(parse_uint_in, {"type": "integer"}, WIRE_SCHEMA), UINT]
UInt = Annotated[int, *_field_metadata(parse_integer, {"type": "integer"}), UINT]
USInt = Annotated[int, *_field_metadata(parse_integer, {"type": "integer"}), USINT]
DInt = Annotated[int, *_field_metadata(parse_integer, {"type": "integer"}), DINT]
TuneMode = Annotated[Literal["P", "PI", "PID"], BeforeValidator(strip_mode_prefix), AUTOTUNE_MODE]
Identifier = Annotated[
    str,
    Parser(parse_identifier),
    WithJsonSchema({**text_schema(IDENTIFIER.pattern, "TIC_101"), "maxLength": MAX_IDENTIFIER_LENGTH}),
]


def _any_case(words: str) -> str:
    """A pattern of small letters that fits capitals as well; JavaScript has no flag for that within a pattern."""
    return re.sub("[a-z]", lambda letter: f"[{letter[0].upper()}{letter[0]}]", words)


_BOOL = _any_case("bool#(?:1|0|true|false)")
_NUMBER = f"{_any_case('(?:int|real)#')}{SIGNED_PATTERN}"
_TIME = f"{_any_case('t(?:ime)?#')}(?:[0-9_]+(?:\\.[0-9_]+)?{_any_case('(?:ms|d|h|m|s)')})+_*"
SIGNAL_TEXT = text_schema(f"{_BOOL}|{_NUMBER}|{_TIME}|{DURATION_FORM}", "INT#5", "BOOL#1", "500 ms", "T#1m30s")
Signal = Annotated[Decimal | bool, *_field_metadata(parse_signal, SIGNAL_TEXT, NUMBER_SCHEMA, {"type": "boolean"})]
