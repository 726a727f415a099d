"""What the rules of the neutral form look at: the file, and each loop with its place."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pidcfg.schemas.base import decimal_text
from pidcfg.validate.rule import Finding

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.diagnostics import Path
    from pidcfg.encoders.parameters import ProgramEncoding
    from pidcfg.schemas.generic import GenericFile, Loop

DIGITS = 12
"""More of a number than a message shows."""
Pair = tuple["Decimal", "Decimal"]


@dataclass(frozen=True)
class LoopView:
    """A loop and its place in the file."""

    index: int
    loop: Loop

    @property
    def limits(self) -> Pair:
        """Lowest and highest output; the ends of the range where they are not given."""
        return self.loop.output.limits or self.loop.output.range

    def pv(self, value: Decimal) -> str:
        """A number of the PV with its unit."""
        return with_unit(value, self.loop.pv.unit)

    def out(self, value: Decimal) -> str:
        """A number of the output with its unit."""
        return with_unit(value, self.loop.output.unit)

    def find(self, *path: str | int, **values: Any) -> Finding:
        """A finding below this loop."""
        return Finding(("loops", self.index, *path), values)

    def find_key(self, *path: str | int, **values: Any) -> Finding:
        """A finding that points at a key: what it opens is a block of lines."""
        return Finding(("loops", self.index, *path), values, key=True)


def with_unit(value: Decimal, unit: str | None) -> str:
    """A number as people write it, with its unit."""
    return f"{number_text(value)} {unit}" if unit else number_text(value)


def number_text(value: Decimal) -> str:
    """A number as people write it; more than 12 digits are shortened."""
    text = decimal_text(value)
    return text if len(text) <= DIGITS else f"{float(value):.6g}"


def outside(value: Decimal, pair: Pair) -> bool:
    """Whether a number is not between two others."""
    return not pair[0] <= value <= pair[1]


@dataclass(frozen=True)
class GenericContext:
    """A configuration with its encoding, and its loops one by one."""

    config: GenericFile
    encoding: ProgramEncoding

    @cached_property
    def loops(self) -> tuple[LoopView, ...]:
        """The loops in the order of the file."""
        return tuple(LoopView(i, loop) for i, loop in enumerate(self.config.loops))

    @cached_property
    def by_name(self) -> dict[str, LoopView]:
        """The loops by their names; of two with the same one the first."""
        return {view.loop.name: view for view in reversed(self.loops)}

    @property
    def explained(self) -> frozenset[Path]:
        """No limit is explained better elsewhere."""
        return frozenset()
