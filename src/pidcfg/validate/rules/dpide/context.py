"""What the DPIDE rules look at: the file, and each loop with what its operands hold."""

from __future__ import annotations

from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING

from pidcfg.encoders.codecs import EncodeError
from pidcfg.encoders.maps.dpide import LOOPS
from pidcfg.encoders.parameters import Content, ProgramEncoding, store
from pidcfg.schemas.dpide import LONGEST_CYCLE, SHORTEST_CYCLE, DpideFile, Loop
from pidcfg.text.frozen import frozen
from pidcfg.validate.shared_checks import Context, View, number_with_unit

if TYPE_CHECKING:
    from pidcfg.text.paths import Path


@frozen
class LoopView(View[Loop]):
    """A loop, its place in the file, and what its operands hold."""

    interrupt_task: int | None

    @cached_property
    def contents(self) -> dict[str, Content]:
        """Content by operand; one that its value does not fit is missing (another rule reports it)."""
        contents: dict[str, Content] = {}
        for row, value in LOOPS.values_of(self.loop):
            try:
                contents[row.name] = store(row.type, value)
            except EncodeError:
                continue
        return contents

    def operand_values(self, *operands: str) -> list[Decimal]:
        """The numbers of several operands; empty as soon as one does not fit."""
        values = [Decimal(repr(self.contents[name])) for name in operands if name in self.contents]
        return values if len(values) == len(operands) else []

    def number(self, operand: str) -> Decimal | None:
        """The number of an operand; None where it does not fit."""
        return next(iter(self.operand_values(operand)), None)

    def coefficient(self, operand: str) -> Decimal:
        """A coefficient as the PLC uses it: below 0 it counts as 0."""
        return max(Decimal(0), self.number(operand) or Decimal(0))

    @cached_property
    def cycle(self) -> Decimal:
        """The sampling time in s that the PLC uses."""
        ms = self.interrupt_task or min(max(self.loop.CYCLE, SHORTEST_CYCLE), LONGEST_CYCLE)
        return Decimal(ms) / 1000

    @cached_property
    def times(self) -> tuple[Decimal, Decimal] | None:
        """Integral and derivative time in s in either form, 0 for a term that is off; None without a gain."""
        gain, integral, derivative = (self.coefficient(name) for name in ("Kc_Kp", "Ti_Ki", "Td_Kd"))
        if self.loop.PID_EQ:
            return integral, derivative
        if not gain:
            return None
        return (gain / integral if integral else Decimal(0)), derivative / gain

    @cached_property
    def limits(self) -> tuple[Decimal, Decimal] | None:
        """Lowest and highest MV, in order as the PLC uses them; None where they do not fit or leave no room."""
        limits = sorted(self.operand_values("MV_MIN", "MV_MAX"))
        return (limits[0], limits[1]) if limits and limits[0] < limits[1] else None

    def gives(self, key: str) -> bool:
        """Whether the file has this key."""
        return key in self.loop.model_fields_set

    def has_device(self, operand: str) -> bool:
        """Whether the operand has a device, so that its value is only the first one."""
        return operand in self.loop.devices.given()

    @property
    def mout_is_mv(self) -> bool:
        """Whether MOUT stands in the device of the loop's own MV, so that both are one value."""
        return self.has_device("MV") and self.loop.devices.MOUT == self.loop.devices.MV

    def pv(self, value: Decimal) -> str:
        """A number of the PV with its unit."""
        return number_with_unit(value, self.loop.pv.unit)

    def mv(self, value: Decimal) -> str:
        """A number of the output with its unit."""
        return number_with_unit(value, self.loop.output.unit)


@frozen
class DpideContext(Context[DpideFile, ProgramEncoding]):
    """A configuration with its encoding, and its loops one by one."""

    @cached_property
    def loops(self) -> tuple[LoopView, ...]:
        """The loops in the order of the file."""
        return tuple(LoopView(i, loop, self.config.plc.interrupt_task) for i, loop in enumerate(self.config.loops))

    @property
    def explained(self) -> frozenset[Path]:
        """Places that a rule of DPIDE's own explains better: a direction that is not given."""
        return frozenset(("loops", view.index, "PID_DIR") for view in self.loops if not view.gives("PID_DIR"))
