"""A DL06 loop with its scales, and its values as its file writes them."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.to_neutral.dl06_scales import position
from pidcfg.encoders.mapping import switched_on
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.numbers import decimal_text

if TYPE_CHECKING:
    from pidcfg.conversion.builder import NeutralBuilder
    from pidcfg.encoders.scales import Scale
    from pidcfg.schemas.dl06 import Dl06File, Loop

NOTHING = Quantity(Decimal(0), counts=True)
"""What a word holds that is not given."""
OFF = "switched off here, so it is not carried over"


@dataclass(frozen=True, slots=True)
class Dl06Loop:
    """A loop, its file, and the scales of its quantities."""

    config: Dl06File
    loop: Loop
    scales: dict[str, Scale]


def active(b: NeutralBuilder, path: str, value: Any, bit: bool | None) -> bool:  # noqa: FBT001 - an enable bit
    """Whether a value with an enable bit is switched on; a value that is not is dropped."""
    on = switched_on(bit, value)
    if not on and value is not None:
        b.drop(path, shown(value), OFF)
    return on


def limits(b: NeutralBuilder, path: str, pair: tuple[Quantity, Quantity], scale: Scale) -> None:
    """A pair of limits of the set point or the output."""
    low, high = (position(scale, end) for end in pair)
    if low >= high:
        b.need(path, f"correct {path}: {shown(pair[0])} is not below {shown(pair[1])}")
    b.put(path, [shown(end) for end in pair], path, [low, high])


def shown(value: Any) -> Any:
    """A value as the file writes it."""
    if isinstance(value, Quantity):
        return f"{decimal_text(value.value)} counts" if value.counts else value.value
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        return [shown(part) for part in value]
    return str(value) if isinstance(value, tuple) else value
