"""Field types of scenarios: what a bound, a share, a start or an expression may look like as text."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import WithJsonSchema

from pidcfg.schemas.base import (
    DURATION,
    DURATION_FORM,
    DURATION_SCHEMA,
    QUANTITY_SCHEMA,
    TRUTHS,
    Parser,
    Quantity,
    pair_schema,
    parse_flag,
    parse_pair,
    parse_quantity,
    parse_seconds,
    parse_text,
)
from pidcfg.schemas.numbers import SIGNED, number_schema, number_text, parse_integer, parse_number, refuse, text_schema


class Bound(NamedTuple):
    """A limit of an expectation: a number, a share (``%``), or a time (``s``)."""

    value: Decimal
    unit: Literal["", "%", "s"] = ""


class Never(NamedTuple):
    """A mode that a loop must not reach."""

    mode: str


def parse_mode(value: object) -> str | Never:
    """A mode, ``manual``, or one that must not come, ``{never: auto}``."""
    if isinstance(value, Never):
        return value
    if isinstance(value, Mapping):
        if set(value) != {"never"}:
            refuse("mode_form", "a mode is wanted", help="write 'mode: auto', or 'mode: {never: auto}'")
        return Never(parse_text(value["never"]))
    return parse_text(value)


def parse_percent(value: object) -> Decimal:
    """A share in %: ``5 %`` or ``5``."""
    if isinstance(value, str) and value.endswith("%"):
        return number_text(value[:-1].strip())
    return parse_number(value)


def parse_bound(value: object) -> Bound:
    """``10``, ``10 %`` or ``10 min``."""
    if isinstance(value, Bound):
        return value
    if isinstance(value, str) and value.endswith("%"):
        return Bound(parse_percent(value), "%")
    if isinstance(value, str) and DURATION.fullmatch(value):
        return Bound(parse_seconds(value), "s")
    return Bound(parse_number(value))


def parse_initial(value: object) -> Literal["steady"] | dict[str, Quantity]:
    """``steady``, or the output that each loop starts with: ``{TIC-101: 40}``."""
    if value == "steady":
        return "steady"
    if isinstance(value, Mapping):
        return {str(loop): parse_quantity(output) for loop, output in value.items()}
    return refuse("initial_form", f"{value!r} is no way to start", help="write steady, or {TIC-101: 40} with outputs")


def parse_word(value: object) -> int:
    """A 16-bit word: ``0x0008`` or ``8``."""
    if isinstance(value, str) and value[:2].lower() == "0x":
        try:
            word = int(value, 16)
        except ValueError:
            return refuse("number_form", f"{value!r} is not a hexadecimal number")
    else:
        word = int(parse_number(value))
    if not 0 <= word <= 0xFFFF:
        refuse("number_form", f"{value} does not fit a 16-bit word")
    return word


def parse_loop_count(value: object) -> int:
    """A number of loops as a set-up word of four decimal digits takes it."""
    count = parse_integer(value)
    if not 0 <= count <= MOST_LOOPS:
        refuse("number_form", f"{value} does not fit the word", help=f"write 0 to {MOST_LOOPS}")
    return count


def parse_truth(value: object) -> bool | int:
    """What a flag must be: true, false, or the value of a word."""
    if isinstance(value, bool) or (isinstance(value, str) and value in TRUTHS):
        return parse_flag(value)
    return parse_word(value)


def by_key(value: object) -> object:
    """A list as a mapping of its indices, so that both forms of ``plants`` are read the same way."""
    return dict(enumerate(value)) if isinstance(value, list) else value


def both_forms(schema: dict[str, Any]) -> None:
    """The JSON Schema of a mapping, changed so that a list of the same things is as good."""
    items = schema.pop("additionalProperties")
    del schema["type"]
    schema["anyOf"] = [{"type": "object", "additionalProperties": items}, {"type": "array", "items": items}]


def rejoin(value: object) -> object:
    """Puts an expression together that a YAML mapping in braces cut at its commas.

    To YAML ``{input: 1 / max(Fi, 1), load: 2}`` is a value ``1 / max(Fi``, a key ``1)`` without a value, and the rest.
    """
    if not isinstance(value, Mapping):
        return value
    joined: dict[Any, Any] = {}
    cut: Any = None
    for key, item in value.items():
        if cut is not None and item is None:
            joined[cut] = type(joined[cut])(f"{joined[cut]}, {key}")
        else:
            joined[key], cut = item, key
        if not isinstance(joined[cut], str) or joined[cut].count("(") <= joined[cut].count(")"):
            cut = None
    return joined


def whole(data: object) -> object:
    """The data of a scenario file with its expressions put together."""
    if not isinstance(data, Mapping):
        return data
    plants = data.get("plants")
    mended = dict(data)
    if isinstance(plants, Mapping):
        mended["plants"] = {name: rejoin(plant) for name, plant in plants.items()}
    elif isinstance(plants, list):
        mended["plants"] = [rejoin(plant) for plant in plants]
    if "connect" in data:
        mended["connect"] = rejoin(data["connect"])
    return mended


def parse_key(value: object) -> str | int:
    """A loop's name, or the index in a list."""
    return value if isinstance(value, int) else str(value)


def parse_expression(value: object) -> str:
    """An expression of signals as text; it is read when the names are known."""
    if isinstance(value, int | float | Decimal) and not isinstance(value, bool):
        return str(value)
    if not isinstance(value, str):
        refuse("text_type", "an expression is wanted", help="write a signal's name, or 1 / max(Fi, 1)")
    return str(value)


MOST_LOOPS = 9999

_PERCENT_FORM = rf"\s*{SIGNED}\s*%"
_PERCENT_TEXT = text_schema(_PERCENT_FORM, "5 %")
_BOUND_TEXT = text_schema(f"{_PERCENT_FORM}|{DURATION_FORM}", "10 %", "10 min")
_MODE_SCHEMA = {
    "anyOf": [
        {"type": "string"},
        {
            "type": "object",
            "properties": {"never": {"type": "string"}},
            "required": ["never"],
            "additionalProperties": False,
        },
    ]
}
_INITIAL_SCHEMA = {"anyOf": [{"const": "steady"}, {"type": "object", "additionalProperties": QUANTITY_SCHEMA}]}

Initial = Annotated[Literal["steady"] | dict[str, Quantity], Parser(parse_initial), WithJsonSchema(_INITIAL_SCHEMA)]
LoopCount = Annotated[
    int, Parser(parse_loop_count), WithJsonSchema({"type": "integer", "minimum": 0, "maximum": MOST_LOOPS})
]
AnyBound = Annotated[Bound, Parser(parse_bound), WithJsonSchema(number_schema(_BOUND_TEXT))]
Percent = Annotated[Decimal, Parser(parse_percent), WithJsonSchema(number_schema(_PERCENT_TEXT))]
AnyMode = Annotated[str | Never, Parser(parse_mode), WithJsonSchema(_MODE_SCHEMA)]
Truth = Annotated[bool | int, Parser(parse_truth), WithJsonSchema({"type": ["boolean", "integer", "string"]})]
Times = Annotated[
    tuple[Decimal, Decimal],
    Parser(parse_pair(parse_seconds, "a pair of times")),
    WithJsonSchema(pair_schema(DURATION_SCHEMA)),
]
Expression = Annotated[str, Parser(parse_expression), WithJsonSchema({"type": ["string", "number"], "maxLength": 1000})]
Key = Annotated[str | int, Parser(parse_key), WithJsonSchema({"type": "string"})]
ModelName = Literal["first_order", "second_order", "integrator", "lead_lag", "dead_time", "valve"]
Metric = Literal[
    "overshoot",
    "settling_time",
    "rise_time",
    "iae",
    "ise",
    "itae",
    "total_variation",
    "final_error",
    "oscillation_period",
    "oscillation_amplitude",
]
StandingKind = Literal[
    "not-in-mode",
    "set-up-error",
    "pv-not-driven",
    "saturated",
    "error-stands",
    "out-of-range",
    "oscillates",
    "alarm-stands",
]
"""What a standing expectation can find, in the order of the report."""
