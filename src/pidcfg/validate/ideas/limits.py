"""Numbers that lie outside the limits or the range which they belong to."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, TypeVar

from pidcfg.validate.views import Placed, number_text

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from pidcfg.validate.rule import Findings

Number = TypeVar("Number", int, Decimal)
"""Counts, or a number in its own unit."""
NUMBERS = ("value", "low", "high")
"""What a message quotes."""


def outside_limits(
    view: Placed,
    *path: str | int,
    value: Number | None,
    limits: tuple[Number, Number] | None,
    shown: Callable[[Number], str],
    units: Collection[str] = ("value", "high"),
    field: str = "value",
    **values: object,
) -> Findings:
    """A finding at a key whose value is not within limits; none where either is not known.

    ``shown`` writes a number with its unit, which those of value, ``low`` and ``high`` carry that ``units`` names. In
    the message the value is called ``field``.
    """
    if value is None or limits is None or limits[0] <= value <= limits[1]:
        return
    numbers = {"value": value, "low": limits[0], "high": limits[1]}
    texts = {key: shown(number) if key in units else number_text(Decimal(number)) for key, number in numbers.items()}
    yield view.at(*path, **{field: texts.pop("value")}, **texts, **values)
