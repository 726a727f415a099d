"""What the rules of all vendors look at: a configuration, its loops, and numbers as messages write them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from pidcfg.frozen import frozen
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Finding

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from decimal import Decimal

    from pidcfg.diagnostics import Severity
    from pidcfg.paths import Path
    from pidcfg.refs import Basis

DIGITS = 12
"""More of a number than a message shows."""
Pair = tuple["Decimal", "Decimal"]


class Named(Protocol):
    """A loop of any vendor."""

    @property
    def name(self) -> str:
        """Its name, which is unique in the file."""


class Placed(Protocol):
    """A loop at its place in the file, for rules that report findings there."""

    @property
    def name(self) -> str:
        """The loop's name."""

    @property
    def at(self) -> Callable[..., Finding]:
        """Makes a finding at a place below the loop."""

    @property
    def at_key(self) -> Callable[..., Finding]:
        """Makes a finding at a key."""


LoopT = TypeVar("LoopT", bound=Named)
ConfigT = TypeVar("ConfigT")
EncodingT = TypeVar("EncodingT")
Value = TypeVar("Value")


@frozen
class View(Generic[LoopT]):
    """A loop and its place in the file."""

    index: int
    loop: LoopT

    @property
    def name(self) -> str:
        """The loop's name."""
        return self.loop.name

    def at(
        self,
        *path: str | int,
        plc_effect: str | None = None,
        severity: Severity | None = None,
        fix: str | None = None,
        basis: Basis | None = None,
        **values: object,
    ) -> Finding:
        """A finding at a place below this loop, with the values of the message and what differs from the label."""
        place = ("loops", self.index, *path)
        return Finding(place, values, plc_effect=plc_effect, severity=severity, fix=fix, basis=basis)

    def at_key(
        self,
        *path: str | int,
        plc_effect: str | None = None,
        severity: Severity | None = None,
        **values: object,
    ) -> Finding:
        """A finding that points at a key: what it opens is a block of lines."""
        return Finding(("loops", self.index, *path), values, key=True, plc_effect=plc_effect, severity=severity)


@frozen
class Context(Generic[ConfigT, EncodingT]):
    """A configuration with its encoding."""

    config: ConfigT
    encoding: EncodingT

    @property
    def explained(self) -> frozenset[Path]:
        """Places that a rule of the vendor's own explains better than the rules for every vendor."""
        return frozenset()


def complete(values: Iterable[Value | None]) -> list[Value]:
    """All of some values; empty as soon as one of them is None."""
    items = list(values)
    known = [value for value in items if value is not None]
    return known if len(known) == len(items) else []


def value_or_switch(part: object, key: str) -> str:
    """The key to point at where a feature is on: its value's, or that of its switch where no value is given."""
    return key if getattr(part, key) is not None else f"{key}_enabled"


def number_text(value: Decimal) -> str:
    """A number as people write it; more than 12 digits are shortened."""
    text = decimal_text(value)
    return text if len(text) <= DIGITS else f"{float(value):.6g}"


def with_unit(value: Decimal, unit: str | None) -> str:
    """A number as people write it, with its unit."""
    return f"{number_text(value)} {unit}" if unit else number_text(value)
