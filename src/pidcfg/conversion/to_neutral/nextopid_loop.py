"""Parameters of a NextoPID loop, with what their wires stand for, told to the neutral loop."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import product, rounded
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from pidcfg.conversion.builder import Teller
    from pidcfg.conversion.to_neutral.nextopid_wires import Network, Value

D293 = Decision(
    293,
    "a wired setting becomes its first value",
    "What a parameter is wired to is followed to signals and literals; the number that it begins with is converted, "
    "and reported as assumed with its expression. A wire to something that a block calculates has none: it is "
    "dropped, or asked for where nothing can be converted without it. A wired BIAS is a feed-forward and always "
    "dropped.",
    "A signal stands for an operator's entry or a recipe, which has a place in every PLC, but none in its parameters.",
)


class Reader:
    """One loop on its way."""

    def __init__(self, network: Network, number: int, teller: Teller) -> None:
        self.network, self.number, self.t = network, number, teller
        self.item: Any = network.items[number].item

    def of(self, key: str) -> Value:
        """A parameter's first value."""
        return self.network.value(self.number, key)

    def is_on(self, key: str) -> bool:
        """Whether a switch is TRUE at the start."""
        return bool(self.of(key).value)

    def given(self, key: str) -> bool:
        """Whether a parameter is wired or not what it is without an entry."""
        return bool(getattr(self.item, key))

    def say(self, key: str, *to: str, note: str = "") -> None:
        """A parameter that is part of neutral fields which are set elsewhere; a wire with what it is followed to."""
        own = self.of(key)
        followed = f"wired to {own.wire}, which is {_text(own.value)} at the start" if own.wire else ""
        text = "; ".join(part for part in (followed, note) if part)
        self.t.say(key, own.wire or own.value, *to, note=text, assumed=bool(own.wire))

    def keep(self, key: str, to: str, value: Any, note: str = "") -> None:
        """A parameter and the neutral field that it became."""
        self.t.keep(key, None, to, value)
        self.t.neutral.said.pop()
        self.say(key, to, note=note)

    def lose(self, key: str, note: str) -> None:
        """A parameter without a twin, with its expression."""
        own = self.of(key)
        self.t.lose(key, own.wire or own.value, f"{own.wire}: {note}" if own.wire else note)

    def number_or_lost(self, key: str, to: str, note: str, factor: Decimal = Decimal(1), said: str = "") -> None:
        """An optional number; wired to what nobody knows it is dropped."""
        own = self.of(key)
        if own.value is None:
            self.lose(key, note)
        elif own.value or own.wire:
            self.keep(key, to, rounded(product(own.value, factor)), said)

    def switch(self, key: str, to: str, note: str = "") -> None:
        """A BOOL. Wired to what nobody knows it is dropped."""
        if self.of(key).value is None:
            self.lose(key, "switch in the program; it counts as FALSE")
        elif self.given(key):
            self.say(key, to, note=note)


def _text(value: Any) -> str:
    return str(value).upper() if isinstance(value, bool) else "not known" if value is None else f"{value}"
