"""Values as the plain data of a configuration file has them."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.schemas.base import Quantity
from pidcfg.schemas.numbers import plain_number

if TYPE_CHECKING:
    from collections.abc import Mapping

Data = dict[str, Any]


def quantity(value: Quantity | Decimal) -> int | float | str:
    """A value as the file writes it."""
    if isinstance(value, Quantity):
        return f"{value.value} counts" if value.counts else plain_number(value.value)
    return plain_number(value)


def plain(value: Any) -> Any:
    """A field's value as the file writes it; a pair is a list."""
    if isinstance(value, Quantity | Decimal):
        return quantity(value)
    return [plain(end) for end in value] if isinstance(value, tuple) else value


def present(data: Mapping[str, Any]) -> Data:
    """Without what is not given."""
    return {key: value for key, value in data.items() if value is not None}
