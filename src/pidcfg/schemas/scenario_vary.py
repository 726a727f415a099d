"""What a scenario says of what is uncertain: numbers of plants and of loops, and how each is spread."""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Decimal  # noqa: TC003 - a field of a type that pydantic reads
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, WithJsonSchema

from pidcfg.schemas.base import Integer, Model, Name, Parser, pair_schema, parse_pair
from pidcfg.schemas.numbers import NUMBER, UNSIGNED, decimal_text, number_text, parse_number, refuse, text_schema

AMOUNT = re.compile(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?) *([^\s0-9.].*)")
SHARE = re.compile(r"(?:±|\+-|\+/-) ?([0-9.]+) ?%")
FORMS = "write ±30 %, {uniform: [40, 90]} or {normal: [8, 2], limits: [4, 14]}"


class Amount(NamedTuple):
    """A number, and the unit that is written behind it: ``40``, ``2 min``."""

    value: Decimal
    unit: str = ""

    def __str__(self) -> str:
        return f"{decimal_text(self.value)} {self.unit}".rstrip()


class Spread(NamedTuple):
    """How a number is spread.

    ``share``: uniform around the file's value, ``pair[0]`` % of its amount to either side. ``uniform``: between the
    pair. ``normal``: the pair is mean and standard deviation; within ``limits`` where there are some.
    """

    kind: Literal["share", "uniform", "normal"]
    pair: tuple[Amount, Amount]
    limits: tuple[Amount, Amount] | None = None

    def __str__(self) -> str:
        first, second = self.pair
        if self.kind == "share":
            return f"±{decimal_text(first.value)} %"
        within = "" if self.limits is None else f" within {self.limits[0]} to {self.limits[1]}"
        return f"{first} to {second}" if self.kind == "uniform" else f"{first}, deviation {second}{within}"


def parse_amount(value: object) -> Amount:
    """A number, with or without a unit."""
    match = AMOUNT.fullmatch(value) if isinstance(value, str) and not NUMBER.fullmatch(value) else None
    return Amount(number_text(match[1]), match[2].strip()) if match else Amount(parse_number(value))


def parse_spread(value: object) -> Spread:
    """``±30 %``, ``{uniform: [40, 90]}`` or ``{normal: [8, 2], limits: [4, 14]}``."""
    if isinstance(value, Spread):
        return value
    if isinstance(value, str) and (match := SHARE.fullmatch(value)):
        share = number_text(match[1])
        if share <= 0:
            refuse("number_form", f"{value} leaves nothing to vary", help=FORMS)
        return Spread("share", (Amount(share, "%"), Amount(share, "%")))
    if not isinstance(value, Mapping):
        refuse("spread_form", f"{value!r} does not say how the number is spread", help=FORMS)
    keys = set(value)
    if keys == {"uniform"}:
        return Spread("uniform", _ascending(value["uniform"], "uniform"))
    if keys in ({"normal"}, {"normal", "limits"}):
        mean, sigma = _pair(value["normal"], "mean and standard deviation")
        if sigma.value <= 0:
            refuse("number_form", f"the standard deviation {sigma} is not above 0", help=FORMS)
        limits = _ascending(value["limits"], "limits") if "limits" in keys else None
        if limits is not None and limits[0].unit != mean.unit:
            refuse("number_form", f"normal is in {mean.unit or 'plain numbers'}, limits in another unit", help=FORMS)
        return Spread("normal", (mean, sigma), limits)
    return refuse(
        "spread_form", f"{', '.join(map(str, value)) or 'nothing'} does not say how a number varies", help=FORMS
    )


def _pair(value: object, what: str) -> tuple[Amount, Amount]:
    """Two amounts of one unit."""
    first, second = parse_pair(parse_amount, what)(value)
    if first.unit != second.unit:
        refuse("number_form", f"{first} and {second} are not in one unit", help="write both in the same unit")
    return first, second


def _ascending(value: object, what: str) -> tuple[Amount, Amount]:
    """Two ends, the lower one first."""
    low, high = _pair(value, "a pair of ends")
    if low.value >= high.value:
        refuse("range_order", f"{what} [{low}, {high}] does not ascend", help="write the lower end first")
    return low, high


_AMOUNT_SCHEMA: dict[str, Any] = {"type": ["number", "string"]}
_PAIR_SCHEMA = pair_schema(_AMOUNT_SCHEMA)
_SPREAD_SCHEMA: dict[str, Any] = {
    "anyOf": [
        text_schema(rf"(?:±|\+-|\+/-) ?{UNSIGNED} ?%", "±30 %"),
        {
            "type": "object",
            "properties": {"uniform": _PAIR_SCHEMA},
            "required": ["uniform"],
            "additionalProperties": False,
        },
        {
            "type": "object",
            "properties": {"normal": _PAIR_SCHEMA, "limits": _PAIR_SCHEMA},
            "required": ["normal"],
            "additionalProperties": False,
        },
    ]
}
AnySpread = Annotated[Spread, Parser(parse_spread), WithJsonSchema(_SPREAD_SCHEMA)]


class Vary(Model):
    """What is uncertain; ``pidcfg certify`` draws it anew for each sample, other commands run the file's values."""

    seed: Integer | None = None
    """Seed of the samples; not given: that of the scenario."""
    plants: Annotated[dict[Name, dict[str, AnySpread]], Field(default_factory=dict)]
    """By plant its keys: ``gain: ±30 %``, ``dead_time: {normal: [8, 2], limits: [4, 14]}``."""
    loops: Annotated[dict[Name, dict[str, AnySpread]], Field(default_factory=dict)]
    """By loop keys that an event may ``set``: ``tuning.gain: ±10 %``."""
