"""One DL06 loop on its way to the neutral form."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import Missing, Neutral, Said
from pidcfg.conversion.to_neutral.dl06_scales import position
from pidcfg.encoders.mapping import switched_on
from pidcfg.schemas.base import Quantity, decimal_text

if TYPE_CHECKING:
    from pidcfg.encoders.scales import Scale
    from pidcfg.schemas.dl06 import Dl06File, Loop

NOTHING = Quantity(Decimal(0), counts=True)
"""What a word holds that is not given."""
OFF = "switched off here, so it is not carried over"


@dataclass(slots=True)
class Reader:
    """One loop on its way to the neutral form."""

    config: Dl06File
    index: int
    loop: Loop
    scales: dict[str, Scale]
    out: Neutral

    def carry(self, field: str, shown: Any, value: Any, *to: str, note: str = "", assumed: bool = False) -> None:
        """A field that becomes neutral fields; the first gets the value."""
        keys = to[0].split(".")
        section = self.out.loop
        for key in keys[:-1]:
            section = section.setdefault(key, {})
        section[keys[-1]] = value
        self.out.said.append(Said(field, shown, to, note, assumed))

    def drop(self, field: str, shown: Any, note: str) -> None:
        """A field without a twin."""
        self.out.said.append(Said(field, shown, (), note))

    def lacks(self, key: str, message: str) -> None:
        """What the file must say before."""
        self.out.missing.append(Missing(("loops", self.index, *key.split(".")), key.rpartition(".")[2], message))

    def active(self, field: str, value: Any, bit: bool | None) -> bool:  # noqa: FBT001 - a bit is what it is about
        """Whether a value with an enable bit is switched on; a value that is not is dropped."""
        on = switched_on(bit, value)
        if not on and value is not None:
            self.drop(field, shown(value), OFF)
        return on

    def limits(self, field: str, pair: tuple[Quantity, Quantity], scale: Scale) -> None:
        """A pair of limits of the set point or the output."""
        low, high = (position(scale, end) for end in pair)
        if low >= high:
            self.lacks(field, f"correct {field}: {shown(pair[0])} is not below {shown(pair[1])}")
        self.carry(field, [shown(end) for end in pair], [low, high], field)


def shown(value: Any) -> Any:
    """A value as the file writes it."""
    if isinstance(value, Quantity):
        return f"{decimal_text(value.value)} counts" if value.counts else value.value
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        return [shown(part) for part in value]
    return str(value) if isinstance(value, tuple) else value
