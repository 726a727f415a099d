"""Parameters of a NextoPID loop, with what their wires stand for, on the way to the neutral loop."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import product, rounded
from pidcfg.conversion.builder import NeutralBuilder
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from pidcfg.conversion.to_neutral.nextopid_wires import Network, Surroundings, Value

D293 = Decision(
    293,
    "a wired setting becomes its first value",
    "What a parameter is wired to is followed to signals and literals; the number that it begins with is converted, "
    "and reported as assumed with its expression. A wire to something that a block calculates has none: it is "
    "dropped, or asked for where nothing can be converted without it. A wired BIAS is a feed-forward and always "
    "dropped.",
    "A signal stands for an operator's entry or a recipe, which has a place in every PLC, but none in its parameters.",
)


@dataclass(slots=True, kw_only=True)
class ParameterBuilder(NeutralBuilder):
    """Fills a neutral loop from the parameters of a block; a wire is reported with its expression."""

    network: Network
    number: int
    """Of the block."""

    @property
    def item(self) -> Any:
        """The block."""
        return self.network.items[self.number].item

    @property
    def around(self) -> Surroundings:
        """Blocks around a PID that the neutral loop has, too."""
        return self.network.around[self.number]

    @property
    def sample_time(self) -> Decimal:
        """In s: the block's, or the task's."""
        time: Decimal | None = self.item.sample_time
        return self.network.config.plc.sample_time if time is None else time

    def value(self, key: str) -> Value:
        """A parameter's first value."""
        return self.network.value(self.number, key)

    def is_on(self, key: str) -> bool:
        """Whether a switch is TRUE at the start."""
        return bool(self.value(key).value)

    def is_given(self, key: str) -> bool:
        """Whether a parameter is wired or not what it is without an entry."""
        return bool(getattr(self.item, key))

    def put_parameter(self, key: str, to: str, became: Any, note: str = "") -> None:
        """A parameter, and the neutral field with what it became."""
        self.set(to, became)
        self.mark_parameter(key, to, note=note)

    def mark_parameter(self, key: str, *to: str, note: str = "") -> None:
        """A parameter that is part of neutral fields which are set elsewhere; a wire with what it is followed to."""
        value = self.value(key)
        self.mark(key, value.written, *to, note=value.note(note), assumed=bool(value.wire))

    def drop_parameter(self, key: str, note: str) -> None:
        """A parameter that the neutral form does not have, with its expression."""
        value = self.value(key)
        self.drop(key, value.written, f"{value.wire}: {note}" if value.wire else note)

    def put_number(self, key: str, to: str, instead: str, factor: Decimal = Decimal(1), note: str = "") -> None:
        """An optional number; one that nobody knows is dropped, with what to program ``instead``."""
        value = self.value(key)
        if value.value is None:
            self.drop_parameter(key, instead)
        elif value.value or value.wire:
            self.put_parameter(key, to, rounded(product(value.value, factor)), note)

    def mark_switch(self, key: str, to: str, note: str = "") -> None:
        """A BOOL; one that nobody knows is dropped."""
        if self.value(key).value is None:
            self.drop_parameter(key, "switch in the program; it counts as FALSE")
        elif self.is_given(key):
            self.mark_parameter(key, to, note=note)
