"""What the EZLogix rules look at: the file, and each loop with what its registers hold.

Values are taken from each loop's own blocks, not read back from the image: where blocks overlap, the image holds only
one of them. Each is worked out once, when the first rule asks for it.
"""

from __future__ import annotations

from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING

from pidcfg.encoders.ezlogix.image import scales_of
from pidcfg.encoders.image import Block, Encoding
from pidcfg.encoders.maps.ezlogix import BLOCKS, R_BLOCK
from pidcfg.schemas.ezlogix import REGISTERS, EzlogixFile, Loop
from pidcfg.text.frozen import frozen
from pidcfg.validate.shared_checks import Context, Extent, View, all_or_none, extents_of, number_with_unit

if TYPE_CHECKING:
    from pidcfg.encoders.codecs import Scale
    from pidcfg.schemas.base import Quantity
    from pidcfg.text.paths import Path

PLACES = {word.name: word.offset for word in R_BLOCK.words}
SETPOINT = PLACES["setpoint"]
ROOT_PLACES = (("setpoint", "value"), ("setpoint", "limits", 0), ("setpoint", "limits", 1))
"""Places whose counts mean nothing where the root of counts that do not begin at 0 is taken."""


@frozen
class LoopView(View[Loop]):
    """A loop, its place in the file, and what its registers hold."""

    block: Block

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """The scales ``pv``, ``sp`` and ``output``."""
        return scales_of(self.loop.pv, self.loop.output, root=self.loop.pv.square_root)

    @cached_property
    def misfits(self) -> frozenset[str]:
        """The registers that their values do not fit."""
        return frozenset(misfit.word.name for misfit in self.block.encoded.misfits)

    def counts(self, name: str) -> int | None:
        """What a register holds; None when the value does not fit (which another rule reports)."""
        return None if name in self.misfits else self.block.encoded.words[PLACES[name]]

    def all_counts(self, *names: str) -> list[int]:
        """What several registers hold; empty as soon as one value does not fit."""
        return all_or_none(map(self.counts, names))

    def register_value(self, name: str) -> Decimal | None:
        """The number that an unscaled register stands for: seconds, or the gain; None when the value does not fit."""
        raw = self.counts(name)
        return None if raw is None else Decimal(R_BLOCK.words[PLACES[name]].decode(raw))

    def register_values(self, *names: str) -> list[Decimal]:
        """The numbers of several registers; empty as soon as one does not fit."""
        return all_or_none(map(self.register_value, names))

    def register(self, name: str) -> str:
        """The address of one of the loop's registers: ``R107``."""
        return f"R{self.loop.registers + PLACES[name]}"

    def pv(self, counts: int) -> str:
        """Counts on the set point's scale as people write them."""
        return quantity_text(self.scales["sp"].value(counts), self.loop.pv.unit)

    def pv_distance(self, counts: int) -> str:
        """A difference on the set point's scale as people write it."""
        return quantity_text(self.scales["sp"].span_value(counts), self.loop.pv.unit)

    def cv(self, counts: int) -> str:
        """Counts of the CV as people write them."""
        return quantity_text(self.scales["output"].value(counts), self.loop.output.unit)

    @cached_property
    def extents(self) -> tuple[Extent, ...]:
        """The registers of its two blocks."""
        return extents_of(self.loop, BLOCKS)

    @cached_property
    def setpoint_limits(self) -> tuple[int, int] | None:
        """The set point limits in counts; None where they do not fit or are crossed."""
        limits = self.all_counts("setpoint_low", "setpoint_high")
        return (limits[0], limits[1]) if limits and limits[0] <= limits[1] else None

    @cached_property
    def cv_limits(self) -> tuple[int, int] | None:
        """The CV limits in counts; None where they do not fit or leave no room."""
        limits = self.all_counts("cv_low", "cv_high")
        return (limits[0], limits[1]) if limits and limits[0] < limits[1] else None

    @cached_property
    def setpoint(self) -> int | None:
        """The set point in counts as its limits leave it; None where it does not fit or its limits are crossed."""
        value, limits = self.counts("setpoint"), self.setpoint_limits
        return None if value is None or limits is None else min(max(value, limits[0]), limits[1])

    @cached_property
    def integrates(self) -> bool:
        """Whether there is an integral term."""
        return bool(self.register_value("integral_time"))

    @cached_property
    def pulses(self) -> tuple[Decimal, Decimal, Decimal] | None:
        """Cycle, minimum on and minimum off time in s; None without control output, or where one does not fit."""
        if self.loop.output.pulse is None:
            return None
        times = self.register_values("cycle_time", "min_on", "min_off")
        return (times[0], times[1], times[2]) if times and times[0] > 0 else None


def quantity_text(value: Quantity, unit: str | None) -> str:
    """A quantity with its unit; raw counts say so themselves."""
    return number_with_unit(value.value, "counts" if value.counts else unit)


def register_number(tag: str) -> int | None:
    """The number of an R tag; None for an input or output register, which lies in no block."""
    return int(tag[1:]) if tag.startswith(REGISTERS.prefix) else None


@frozen
class EzlogixContext(Context[EzlogixFile, Encoding]):
    """A configuration with its encoding, and its loops one by one."""

    @cached_property
    def loops(self) -> tuple[LoopView, ...]:
        """The loops in the order of the file."""
        blocks = self.encoding.blocks[:: len(BLOCKS)]
        return tuple(LoopView(i, loop, blocks[i]) for i, loop in enumerate(self.config.loops))

    def block_owner(self, tag: str) -> tuple[LoopView, int] | None:
        """The loop in whose register block a tag lies, and its offset there."""
        number = register_number(tag)
        if number is None:
            return None
        return next(
            (
                (view, number - first)
                for view in self.loops
                for _, _, first, last in view.extents[:1]
                if first <= number <= last
            ),
            None,
        )

    def inner_loop(self, view: LoopView) -> LoopView | None:
        """The loop whose set point register is this loop's CV tag."""
        owner = self.block_owner(view.loop.output.tag)
        return owner[0] if owner is not None and owner[1] == SETPOINT and owner[0] is not view else None

    @cached_property
    def remote_setpoint_loops(self) -> frozenset[int]:
        """The places of loops whose set point another loop's CV writes."""
        inner = (self.inner_loop(view) for view in self.loops)
        return frozenset(view.index for view in inner if view is not None)

    @cached_property
    def explained(self) -> frozenset[Path]:
        """Places whose limits a rule of EZLogix's own explains better than the rules for every vendor."""
        places: list[Path] = []
        for i, loop in enumerate(self.config.loops):
            if loop.sample_rate == 0:
                places.append(("loops", i, "sample_rate"))
            if loop.output.pulse is not None and loop.output.pulse.cycle_time == 0:
                places.append(("loops", i, "output", "pulse", "cycle_time"))
            if loop.pv.square_root and loop.pv.counts is not None and loop.pv.counts[0]:
                places += [("loops", i, *place) for place in ROOT_PLACES]
        return frozenset(places)
