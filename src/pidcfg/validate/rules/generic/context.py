"""What the rules of the neutral form look at: the file, and each loop with its place."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from pidcfg.encoders.parameters import ProgramEncoding
from pidcfg.schemas.generic import GenericFile, Loop
from pidcfg.text.frozen import frozen
from pidcfg.validate.shared_checks import Context, Pair, View, number_with_unit

if TYPE_CHECKING:
    from decimal import Decimal


@frozen
class LoopView(View[Loop]):
    """A loop and its place in the file."""

    @property
    def limits(self) -> Pair:
        """Lowest and highest output; the ends of the range where they are not given."""
        return self.loop.output.limits or self.loop.output.range

    def pv(self, value: Decimal) -> str:
        """A number of the PV with its unit."""
        return number_with_unit(value, self.loop.pv.unit)

    def out(self, value: Decimal) -> str:
        """A number of the output with its unit."""
        return number_with_unit(value, self.loop.output.unit)


@frozen
class GenericContext(Context[GenericFile, ProgramEncoding]):
    """A configuration with its encoding, and its loops one by one."""

    @cached_property
    def loops(self) -> tuple[LoopView, ...]:
        """The loops in the order of the file."""
        return tuple(LoopView(i, loop) for i, loop in enumerate(self.config.loops))

    @cached_property
    def by_name(self) -> dict[str, LoopView]:
        """The loops by their names; of two with the same one the first."""
        return {view.name: view for view in reversed(self.loops)}
