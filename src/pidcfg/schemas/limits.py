"""What a manual allows for a number, beside its type; and the units of tables in the words of a loop."""

from __future__ import annotations

from copy import deepcopy
from decimal import Decimal
from functools import cache
from typing import TYPE_CHECKING, Any, get_args

from pidcfg.schemas.base import Quantity, Rate
from pidcfg.schemas.numbers import plain_number
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import value_at

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pydantic import BaseModel

    from pidcfg.text.references import Basis


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

    def __get_pydantic_json_schema__(
        self, core_schema: Any, handler: Callable[[Any], dict[str, Any]]
    ) -> dict[str, Any]:
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
        return next((m for m in (*field.metadata, *_inside(field.annotation)) if isinstance(m, Limits)), None)
    inside = (inner for inner in _inside(field.annotation) if rest.partition(".")[0] in _fields(inner))
    inner = next(inside, None)
    return None if inner is None else limits_at(inner, rest)


def _inside(annotation: Any) -> Iterator[Any]:
    """An annotation, its metadata, and all that it is made of."""
    yield annotation
    yield from getattr(annotation, "__metadata__", ())
    for inner in get_args(annotation):
        yield from _inside(inner)


def _fields(annotation: Any) -> Any:
    return getattr(annotation, "model_fields", ())


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


def unit_text(unit: str, units: Mapping[str, str], nested: str = " per ") -> str:
    """A unit of a table with the loop's own for ``pv`` and ``output``: ``pv/s`` is ``degC/s``, or ``m3/h per s``.

    ``nested`` divides where a part is a quotient itself.
    """
    if " per " in unit:
        return " per ".join(unit_text(part, units, nested) for part in unit.split(" per "))
    parts = [units.get(part, part) for part in unit.split("/")]
    return (nested if len(parts) > 1 and any("/" in part for part in parts) else "/").join(parts)


# --- Keys on a scale: the PLC holds them in counts, of which a range of their side makes engineering units ------------

ON_SIDES = {"pv": ("setpoint", "value"), "output": ("output", "limits")}
"""A key on the scale of each side."""


def is_scaled(model: type[BaseModel], path: Sequence[str]) -> bool:
    """Whether a key of a file holds counts where its side has no range."""
    key, *rest = path
    field = model.model_fields.get(key)
    inside = [] if field is None else [*_inside(field.annotation)]
    if rest:
        return any(is_scaled(inner, rest) for inner in inside if _fields(inner))
    return Quantity in inside or Rate in inside


@cache
def scaled_sides(model: type[BaseModel]) -> frozenset[str]:
    """The sides of a loop that the PLC of a file holds in counts."""
    return frozenset(side for side, path in ON_SIDES.items() if is_scaled(model, ("loops", *path)))
