"""Field types of every vendor's schema: numbers with units, times, rates, addresses, and the limits of manuals."""

from __future__ import annotations

import re
from copy import deepcopy
from decimal import Decimal
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, TypeVar, get_args

from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainValidator, WithJsonSchema
from pydantic_core import PydanticCustomError
from pydantic_core.core_schema import no_info_plain_validator_function

from pidcfg.schemas.document import models_in
from pidcfg.schemas.numbers import (
    EXACT_CONTEXT,
    NUMBER,
    SIGNED_PATTERN,
    JsonSchema,
    help_of,
    kind_of,
    number_schema,
    parse_integer,
    parse_number,
    parse_number_text,
    plain_number,
    refuse,
    strange_value,
    text_schema,
)
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import value_at

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pydantic import GetJsonSchemaHandler
    from pydantic_core import CoreSchema

    from pidcfg.text.references import Basis

# --- Field types of every vendor's schema: what a text in a YAML file means, decided by the field it stands in --------
#
# Each type is a parser that takes the text of a scalar (`pidcfg.text.document.Plain` or a quoted string) or a native
# Python value, and returns a frozen, exact value; what cannot be read is refused as in `pidcfg.schemas.numbers`.

BOOLEANS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
LIKE_BOOLEAN = {"yes": "true", "on": "true", "y": "true", "no": "false", "off": "false", "n": "false"}
LIKE_OFF = frozenset(("none", "no", "never", "disabled", "inf", ".inf"))
NAME = re.compile(r"\w(?:[\w .\-/#]*[\w#])?")
CONTROL_CHARACTER = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f]")
MAX_NAME_LENGTH = 64

SECONDS = {"ms": Decimal("0.001"), "s": Decimal(1), "min": Decimal(60), "h": Decimal(3600)}
UNIT_WORDS = {"sec": "s", "second": "s", "seconds": "s", "minute": "min", "minutes": "min", "hour": "h", "hours": "h"}
TIME_UNITS = "|".join((*SECONDS, *UNIT_WORDS))
DURATION = re.compile(rf"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?) ?({TIME_UNITS})")
LIKE_DURATION = re.compile(r"[0-9](?=.* ).*[^\W\d_]|[0-9.,]+(?![OoIl]+$)[^\W\d_]+")  # a number with some unit
DURATION_FORM = f"{SIGNED_PATTERN} ?(?:{TIME_UNITS})"
DURATION_TEXT = text_schema(DURATION_FORM, "250 ms", "2 min")
DURATION_SCHEMA = number_schema(DURATION_TEXT)
COUNTS = re.compile(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?) counts?")
COUNTS_TEXT = text_schema(f"{SIGNED_PATTERN} counts?", "2048 counts")
QUANTITY_SCHEMA = number_schema(COUNTS_TEXT)


T = TypeVar("T")


class Model(BaseModel):
    """Base of every schema: frozen, unknown keys refused. A text below a field is its documentation."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Parser(NamedTuple):
    """How a field is read; `pydantic.PlainValidator` would also work out how its type is written, for more time."""

    parse: Callable[[object], object]
    spell: Callable[[int], str] | None = None
    """Of an address: its name by its number."""

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


def parse_flag(value: object) -> bool:
    """``true`` or ``false`` and nothing else: ``yes`` and ``on`` are text."""
    return parse_switch(value, only_bool=True)


def parse_switch(value: object, *, only_bool: bool) -> bool:
    """A switch; ``only_bool``: no name can stand in its place, so that a word has its one meaning."""
    if isinstance(value, bool):
        return value
    if isinstance(value, str):
        if type(value) is not str and value in BOOLEANS:
            return BOOLEANS[value]
        word = LIKE_BOOLEAN.get(value.lower()) or (value.lower() if value.lower() in BOOLEANS else None)
        help_text = f"write {word}" if word else "write true or false"
        refuse("boolean_form", f"{value!r} is not true or false", help=help_text, only=word if only_bool else None)
    return refuse("boolean_form", f"a {kind_of(value)} stands where true or false is wanted")


def parse_text(value: object) -> str:
    """One or more lines of text without control characters."""
    if not isinstance(value, str):
        refuse(
            "text_type",
            f"{strange_value(value)} stands where text is wanted"
            if value is None
            else f"a {kind_of(value)} stands where text is wanted",
        )
    text = str(value)
    if CONTROL_CHARACTER.search(text):
        refuse("text_type", "a control character in a text", help="delete it")
    return text


def parse_name(value: object) -> str:
    """A tag: letters, digits and ``_ - . / #`` and single blanks inside, so that it is safe in every output."""
    text = parse_text(value)
    if len(text) > MAX_NAME_LENGTH:
        message = f"a name of {len(text)} characters; the limit is {MAX_NAME_LENGTH}"
        refuse("name_form", message, help="shorten it; a long text can stand in description")
    if not NAME.fullmatch(text) or "  " in text:
        from pidcfg.text.signs import lookalike_remark

        refuse(
            "name_form",
            f"{text!r} is not usable as a name{lookalike_remark(text)}",
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
            return Duration(parse_number_text(match.group(1)), UNIT_WORDS.get(unit, unit))
        if LIKE_DURATION.fullmatch(value.strip()):
            unit = re.split(r"[0-9., ]", value.strip())[-1]
            known = unit in {*SECONDS, *UNIT_WORDS} and help_of(value)
            refuse(
                "duration_form", f"{value!r} is not a time", help=known or "units are ms, s, min and h, as in 250 ms"
            )
    return Duration(parse_number(value))


def parse_seconds(value: object) -> Decimal:
    """A duration in seconds; a bare number is seconds."""
    return parse_duration(value).seconds()


def parse_whole_seconds(value: object) -> int:
    """A whole number of seconds; a text may carry another unit."""
    number = parse_seconds(value)
    if number != number.to_integral_value():
        refuse("number_type", f"{value} is not a whole number of s", help=f"write {round(number)}")
    return int(number)


def parse_off_seconds(value: object) -> Decimal:
    """A time in seconds; ``off`` is 0, which removes the term."""
    if isinstance(value, str) and value.casefold() in LIKE_OFF:
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
            return Quantity(parse_number_text(match.group(1)), counts=True)
    return Quantity(parse_number(value))


def parse_pair(parse: Callable[[object], T], title: str) -> Callable[[object], tuple[T, T]]:
    """A parser of a list of two."""

    def parse_values(value: object) -> tuple[T, T]:
        if not isinstance(value, list | tuple) or isinstance(value, Quantity) or len(value) != 2:
            number = len(value) if isinstance(value, list | tuple) and not isinstance(value, Quantity) else 0
            given = f", not of {number}" if number else ""
            comma = "; if a comma was to be a decimal sign: that is a point" if number > 2 else ""
            help_text = _range_help(value) or f"write [low, high]{comma}"
            refuse("pair_type", f"{title} is wanted: a list of two values{given}", help=help_text)
        return parse_item(value, 0), parse_item(value, 1)

    def parse_item(value: Sequence[object], step: int) -> T:
        try:
            return parse(value[step])
        except PydanticCustomError as error:
            context = {**(error.context or {}), "item": step}
            raise PydanticCustomError(error.type, error.message_template, context) from None

    return parse_values


def _range_help(value: object) -> str | None:
    """How to write the range that a text seems to mean."""
    from pidcfg.schemas.numbers import range_cure

    return range_cure(value) if isinstance(value, str) else None


def parse_range(value: object) -> tuple[Decimal, Decimal]:
    """Engineering values at 0 % and 100 %, ascending."""
    low, high = parse_pair(parse_number, "a range")(value)
    if low >= high:
        help_text = _ascending_help(high, low) if low > high else "the two ends must differ"
        refuse("range_order", f"the range [{low}, {high}] does not ascend", help=help_text)
    return low, high


def _ascending_help(low: Decimal, high: Decimal) -> str:
    """How a range is written that does not ascend, also where the signal falls as the value rises."""
    mirrored = f"{low + high} - v" if low + high else "-v"
    return (
        f"write the lower end first, [{low}, {high}], which is all where the PLC holds the value itself. Where it "
        "holds counts that fall as the value rises, turn the signal round in the module or the program; else write "
        f"each value v on this scale as {mirrored}, low alarms and limits as high ones, and the other action"
    )


def pair_schema(item: JsonSchema) -> JsonSchema:
    """The JSON Schema of a list of two."""
    return {"type": "array", "items": item, "minItems": 2, "maxItems": 2}


Number = Annotated[Decimal, Parser(parse_number), WithJsonSchema({"type": "number"})]
Integer = Annotated[int, Parser(parse_integer), WithJsonSchema({"type": "integer"})]
FormatVersion = Annotated[Literal[1], BeforeValidator(parse_integer)]
Flag = Annotated[bool, Parser(parse_flag), WithJsonSchema({"type": "boolean"})]
Text = Annotated[str, Parser(parse_text), WithJsonSchema({"type": ["string", "number", "boolean"]})]
Name = Annotated[str, Parser(parse_name), WithJsonSchema({"type": ["string", "number"], "maxLength": MAX_NAME_LENGTH})]
Seconds = Annotated[Decimal, Parser(parse_seconds), WithJsonSchema(DURATION_SCHEMA)]
WholeSeconds = Annotated[
    int,
    Parser(parse_whole_seconds),
    WithJsonSchema({"anyOf": [text_schema(DURATION_FORM, "90 s", "2 min"), {"type": "integer"}]}),
]
OffSeconds = Annotated[
    Decimal, Parser(parse_off_seconds), WithJsonSchema(number_schema(DURATION_TEXT, {"const": "off"}))
]
Minutes = Annotated[Decimal, Parser(parse_minutes), WithJsonSchema(DURATION_SCHEMA)]
AnyQuantity = Annotated[Quantity, Parser(parse_quantity), WithJsonSchema(QUANTITY_SCHEMA)]
Range = Annotated[tuple[Decimal, Decimal], Parser(parse_range), WithJsonSchema(pair_schema({"type": "number"}))]
QuantityPair = Annotated[
    tuple[Quantity, Quantity],
    Parser(parse_pair(parse_quantity, "a pair of limits")),
    WithJsonSchema(pair_schema(QUANTITY_SCHEMA)),
]

# --- What the files of every vendor say in the same words -------------------------------------------------------------


class ConfigurationFile(Model):
    """The head of a configuration; each vendor adds its loops."""

    pidcfg: FormatVersion
    """Version of the file format."""
    vendor: str
    """The PLC family."""
    name: Text | None = None
    """Name of the machine or plant section."""
    description: Text | None = None
    """Anything worth knowing."""

    if TYPE_CHECKING:

        @property
        def loops(self) -> tuple[Any, ...]:
            """The loops, each of the vendor's own model."""


class SectionSettings(Model):
    """What a listing says beside its words for the whole file."""

    name: Text | None = None
    """Name of the machine or plant section."""
    description: Text | None = None
    """Anything worth knowing."""


class LoopNameSettings(Model):
    """What a listing says beside its words of one loop."""

    loop: Name
    """Name of the loop."""
    description: Text | None = None
    """What the loop does."""


# --- Rates of change of a PV, for the alarms of every vendor ----------------------------------------------------------


Per = Literal["sample", "s", "min"]
"""What a rate is counted in."""


class Rate(NamedTuple):
    """A rate of change of the PV: per sample, or per a unit of time (``"15 /min"``)."""

    value: Decimal
    counts: bool = False
    per: Per = "sample"

    def per_sample(self, sample_rate: Decimal) -> Quantity:
        """The change in one sample of ``sample_rate`` seconds (manual: rate / 60 x counts per unit x sample rate)."""
        if self.per == "sample":
            return Quantity(self.value, self.counts)
        change = EXACT_CONTEXT.multiply(self.value, sample_rate)
        return Quantity(
            EXACT_CONTEXT.divide(change, Decimal(60)) if self.per == "min" else change, self.counts, derived=True
        )

    def __str__(self) -> str:
        return f"{Quantity(self.value, self.counts)} /{self.per}"


def parse_rate(value: object) -> Rate:
    """A quantity per sample, or a text ``15 /min``, ``0.25 /s``, ``40 counts/min``."""
    if isinstance(value, Rate):
        return value
    if isinstance(value, str) and "/" in value:
        amount, _, unit = value.partition("/")
        amount, per = amount.strip(), next((per for per in get_args(Per) if per == unit.strip()), None)
        number = amount.removesuffix("counts").strip()
        if per is None or not NUMBER.fullmatch(number):
            refuse("duration_form", f"{value!r} is not a rate", help="write 0.5 (per sample), 15 /min or 0.25 /s")
        return Rate(parse_number_text(number), number != amount, per)
    quantity = parse_quantity(value)
    return Rate(quantity.value, quantity.counts)


PER_TIME = r"\s*/\s*(?:sample|s|min)\s*"
UNIT_RATE_SCHEMA = number_schema(text_schema(rf"\s*{SIGNED_PATTERN}{PER_TIME}", "15 /min", "0.25 /s"))
COUNT_RATE_TEXT = text_schema(rf"\s*{SIGNED_PATTERN}\s*(?:counts)?{PER_TIME}", "15 /min", "0.25 /s", "40 counts/min")
AnyRate = Annotated[Rate, Parser(parse_rate), WithJsonSchema(number_schema(COUNT_RATE_TEXT, COUNTS_TEXT))]

# --- Decimal addresses with a prefix, ``DS101``: a bank with its limits, and the field type that it gives -------------

MAX_ADDRESS_DIGITS = 9
"""Digits of an address that still reads as one."""
LIKE_ADDRESS = re.compile(r" *([A-Z]+) *([0-9]+) *")
"""Blanks between digits may stand for anything: ``C10 1`` is no address."""


class BankRange(NamedTuple):
    """The addresses of one bank, first and last inclusive; ``what`` names them for messages."""

    prefix: str
    first: int
    last: int
    title: str

    def parse(self, value: object) -> int:
        """The number of an address of this bank; another spelling of one is refused with the right one."""
        if isinstance(value, int) and not isinstance(value, bool):
            return self._check_number(value)
        example = f"write it like {self._example}"
        if not isinstance(value, str):
            refuse("address_form", f"{self.title} is wanted", help=example)
        match = LIKE_ADDRESS.fullmatch(value.upper())
        if match is None or match.group(1) != self.prefix or len(match.group(2)) > MAX_ADDRESS_DIGITS:
            refuse("address_form", f"{value!r} is not {self.title}", help=example)
        number = self._check_number(int(match.group(2)))
        spelling = self.name(number)
        if value != spelling:
            refuse("address_form", f"{value!r} is not spelled as an address", help=f"write {spelling}", only=spelling)
        return number

    def name(self, number: int) -> str:
        """The name of an address by its number: ``C101``."""
        return f"{self.prefix}{number}"

    def _check_number(self, number: int) -> int:
        if not self.first <= number <= self.last:
            refuse(
                "address_form",
                f"{self.prefix}{number} does not exist",
                help=f"addresses go from {self.prefix}{self.first} to {self.prefix}{self.last}",
            )
        return number

    @property
    def _example(self) -> str:
        return f"{self.prefix}{self.first + 100}"

    @property
    def schema(self) -> JsonSchema:
        """The JSON Schema of an address."""
        return text_schema(f"{self.prefix}[1-9][0-9]{{0,{len(str(self.last)) - 1}}}", self._example)


# ----------------------------------------------------------------------------------------------------------------------
# V-memory addresses of the DirectLOGIC family: octal, written ``V2000`` as in the manual, held as plain numbers.

V_ADDRESS = re.compile(r"V([0-7]{1,6})")
DIGITS_ONLY = re.compile(r"[0-9]+")
LAST_V_ADDRESS = 0o177777


def v_name(address: int) -> str:
    """The manual's spelling of an address: ``v_name(1024) == "V2000"``."""
    return f"V{address:o}"


def parse_v_address(value: object) -> int:
    """``V2000`` to 1024; every other spelling is refused with the right one."""
    if isinstance(value, int) and not isinstance(value, bool):
        return _check_v_address(value, v_name(value))
    if not isinstance(value, str):
        refuse("address_form", "a V-memory address is wanted", help="write it like V2000")
    match = V_ADDRESS.fullmatch(value)
    if match:
        return _check_v_address(int(match.group(1), 8), value)
    digits = value.lstrip("vV0") or "0"
    if not DIGITS_ONLY.fullmatch(value.lstrip("vV")):
        refuse("address_form", f"{value!r} is not a V-memory address", help="write it like V2000")
    wrong_digit = next((d for d in digits if d in "89"), None)
    if wrong_digit:
        refuse(
            "address_form",
            f"{value} is not octal: {wrong_digit} is not an octal digit",
            help="V-memory addresses have the digits 0 to 7",
        )
    if DIGITS_ONLY.fullmatch(value):
        refuse(
            "address_form", f"{value} can be read as octal V{digits} or as decimal {digits}", help=f"write V{digits}"
        )
    spelling = value.upper() if V_ADDRESS.fullmatch(value.upper()) else None
    _check_v_address(int(digits, 8), f"V{digits}")
    return refuse("address_form", f"{value!r} is not spelled as an address", help=f"write V{digits}", only=spelling)


def _check_v_address(address: int, spelling: str) -> int:
    if not 0 <= address <= LAST_V_ADDRESS:
        refuse("address_form", f"{spelling} is beyond {v_name(LAST_V_ADDRESS)}, the last address that a word can hold")
    return address


VAddress = Annotated[int, Parser(parse_v_address, v_name), WithJsonSchema(text_schema("V[01]?[0-7]{1,5}", "V2000"))]

# --- The Modbus map that a configuration names: a file, never a host --------------------------------------------------

HOST_PREFIXES = ("//", "\\\\")
"""How a name begins that is looked for on another machine."""


def parse_map_file(value: object) -> str:
    """The name of a file; what names another machine is refused."""
    name = parse_text(value)
    if "://" in name or name.startswith(HOST_PREFIXES):
        cure = "name a file beside the configuration; the PLC's address stands on the command line (--plc)"
        refuse("text_type", f"{name!r} is no file of this machine", help=cure)
    if not name.strip():
        refuse("text_type", "the name of the map is empty", help="name a file such as oven-map.csv")
    return name


MapFile = Annotated[str, PlainValidator(parse_map_file), WithJsonSchema({"type": "string"})]


# ----------------------------------------------------------------------------------------------------------------------
# What a manual allows for a number: beside its type, for the JSON Schema and for the rule that checks all of them.


@frozen
class Limits:
    """What the manual allows for a number: inclusive, in ``unit``; ``severity`` of passing them is an error."""

    low: str | None
    high: str | None
    unit: str
    basis: Basis
    effect: str | None = None
    """What the PLC itself reports about a value outside."""

    def __get_pydantic_json_schema__(self, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchema:
        """Adds ``minimum``, ``maximum`` and the unit where an editor looks for them."""
        schema = deepcopy(handler(core_schema))
        if self.unit:
            schema["x-unit"] = self.unit
        number = next((s for s in schema.get("anyOf", []) if s.get("type") in {"number", "integer"}), schema)
        for key, bound in (("minimum", self.low), ("maximum", self.high)):
            if bound is not None:
                number[key] = plain_number(Decimal(bound))
        return schema

    def holds(self, value: Decimal) -> bool:
        """Whether ``value`` lies inside."""
        return (self.low is None or value >= number_of(self.low)) and (
            self.high is None or value <= number_of(self.high)
        )


@cache
def number_of(text: str) -> Decimal:
    """The number of a limit."""
    return Decimal(text)


@cache
def limits_at(model: type[BaseModel], path: str) -> Limits | None:
    """The limits of a key, by its path through sections and lists; None where it has none."""
    key, _, rest = path.partition(".")
    field = model.model_fields[key]
    if not rest:
        return next((m for m in (*field.metadata, *_annotation_parts(field.annotation)) if isinstance(m, Limits)), None)
    inside = (inner for inner in models_in(field.annotation) if rest.partition(".")[0] in inner.model_fields)
    inner = next(inside, None)
    return None if inner is None else limits_at(inner, rest)


def _annotation_parts(annotation: object) -> Iterator[object]:
    """An annotation, its metadata, and all that it is made of."""
    yield annotation
    yield from getattr(annotation, "__metadata__", ())
    for inner in get_args(annotation):
        yield from _annotation_parts(inner)


# --- Units of tables in the words of a loop ---------------------------------------------------------------------------

SIDES = ("pv", "output")
"""The two ends of a loop, which have units of their own."""
RESET_UNIT = "s, or min by reset_unit"
"""The unit of DL06's reset time in tables: a bit of the loop says which of both."""
RESET_UNITS = {"seconds": "s", "minutes": "min"}


def units_of(loop: object) -> dict[str, str]:
    """The units of PV and output that a loop, or what a listing says of one, gives; of the reset time, if it tells."""
    units = {side: str(unit) for side in SIDES if (unit := value_at(loop, (side, "unit")))}
    reset = RESET_UNITS.get(str(value_at(loop, ("tuning", "reset_unit"))))
    return {**units, RESET_UNIT: reset} if reset else units


def unit_text(unit: str, units: Mapping[str, str], nested_divider: str = " per ") -> str:
    """A unit of a table with the loop's own for ``pv`` and ``output``: ``pv/s`` is ``degC/s``, or ``m3/h per s``.

    ``nested_divider`` divides where a part is a quotient itself. A part without a unit is left out: ``per s``.
    """
    if " per " in unit:
        return " per ".join(unit_text(part, units, nested_divider).removeprefix("per ") for part in unit.split(" per "))
    first, *others = (units.get(part, part) for part in unit.split("/"))
    others = [part for part in others if part]
    if not first and others:
        return f"per {'/'.join(others)}"
    parts = [first, *others]
    return (nested_divider if len(parts) > 1 and any("/" in part for part in parts) else "/").join(parts)


# --- Keys on a scale: the PLC holds them in counts, of which a range of their side makes engineering units ------------

SIDE_KEYS = {"pv": ("setpoint", "value"), "output": ("output", "limits")}
"""A key on the scale of each side."""


def is_scaled(model: type[BaseModel], path: Sequence[str]) -> bool:
    """Whether a key of a file holds counts where its side has no range."""
    key, *rest = path
    field = model.model_fields.get(key)
    if field is None:
        return False
    if rest:
        return any(is_scaled(inner, rest) for inner in models_in(field.annotation))
    return any(part in (Quantity, Rate) for part in _annotation_parts(field.annotation))


@cache
def scaled_sides(model: type[BaseModel]) -> frozenset[str]:
    """The sides of a loop that the PLC of a file holds in counts."""
    return frozenset(side for side, path in SIDE_KEYS.items() if is_scaled(model, ("loops", *path)))
