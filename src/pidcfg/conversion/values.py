"""Values of a configuration as numbers, as JSON has them, and as people read them."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

from pidcfg.schemas.base import Duration, Quantity
from pidcfg.schemas.numbers import decimal_text, plain_number
from pidcfg.schemas.rates import Rate

LONGEST = 20
"""Signs of a number that is shown without an exponent."""


def number_of(value: Any) -> Decimal | None:
    """The number of a value in its own unit; None: it is none."""
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, Quantity | Rate):
        return None if value.counts else value.value
    if isinstance(value, Duration):
        return value.seconds()
    if hasattr(value, "duration"):  # a time that may be off
        return number_of(value.duration)
    if isinstance(value, int | float | Decimal):
        return Decimal(str(value))
    return None


def shown(value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, Decimal):
        return plain_number(value)
    if isinstance(value, Quantity | Duration):
        return str(value)
    if isinstance(value, dict):  # such as the devices of an instruction
        return ", ".join(f"{key}: {shown(inner)}" for key, inner in value.items())
    return [shown(v) for v in value] if isinstance(value, list | tuple) else value


def text_of(value: Any) -> str:
    """A value as people read it."""
    value = shown(value)
    if value is None:
        return "-"
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, int | float):
        return str(value)
    text = decimal_text(Decimal(repr(value)))
    return text if len(text) <= LONGEST else repr(value)
