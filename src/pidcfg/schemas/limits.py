"""What a manual allows for a number: beside its type, for the JSON Schema and for the rule that checks all of them."""

from __future__ import annotations

from copy import deepcopy
from decimal import Decimal
from functools import cache
from typing import TYPE_CHECKING, Any, get_args

from pidcfg.frozen import frozen
from pidcfg.schemas.numbers import plain_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from pydantic import BaseModel

    from pidcfg.refs import Basis


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
