"""Devices of operands: the blocks of I_MV, and what shares a register."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.maps.dpide import REMARKS, ROWS, WRITTEN_BY_AUTOTUNE
from pidcfg.refs import Decision
from pidcfg.schemas.dpide_devices import D250, LAST_REGISTER, Place, place_of
from pidcfg.validate.rule import Findings, error

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.validate.rules.dpide.context import DpideContext, LoopView

D258 = Decision(
    258,
    "operands may share a device when they can hold the same",
    "Inputs of one type and value may stand in one device, and the MV of one loop in the SV, BIAS or MOUT of another. "
    "What an instruction writes is in no other operand's device beyond that: MV, the MOUT that follows it (MOUT_AUTO "
    "TRUE or with a device), and what an autotune writes (PID_MODE 1 or with a device). A MOUT in the device of its "
    "own MV is that MV. Devices that overlap in part, hold different types or values, or are written by two loops, are "
    "an error.",
    "One start bit for several loops, and a cascade by one register, are what devices are for. The gains that one "
    "loop's autotune finds are another loop's only by mistake.",
)


class Held(NamedTuple):
    """An operand of a loop and the devices that it takes."""

    view: LoopView
    operand: str
    place: Place

    @property
    def name(self) -> str:
        """What a message calls it."""
        return f"{self.view.name}.{self.operand}"

    @property
    def path(self) -> tuple[str, ...]:
        """Where its device stands below the loop."""
        return ("device",) if self.operand == "I_MV" else ("devices", self.operand)


def held(context: DpideContext) -> list[Held]:
    """Every operand with a device, in the order of the file."""
    return [
        Held(view, operand, place_of(operand, device))
        for view in context.loops
        for operand, device in {"I_MV": view.loop.device, **view.loop.devices.given()}.items()
    ]


def overlapping(context: DpideContext) -> Iterator[tuple[Held, Held]]:
    """Pairs of operands that share a device."""
    return ((first, second) for first, second in combinations(held(context), 2) if first.place.overlaps(second.place))


@error(
    "DP701", D250, "{operand} would take {place}, but D{last} is the last one: it may begin at D{latest} at the latest"
)
def device_beyond_bank(context: DpideContext) -> Findings:
    """An operand reaches past the last D register.

    Why: I_MV takes 30 registers, a number two. What lies past the last register does not exist, and the software
    refuses the program.

    Fix: let it begin lower.
    """
    for item in held(context):
        place = item.place
        if place.bank == "D" and place.last > LAST_REGISTER:
            yield item.view.at(
                *item.path,
                operand=item.operand,
                place=place,
                last=LAST_REGISTER,
                latest=LAST_REGISTER - (place.last - place.first),
            )


@error("DP702", REMARKS, "{mine} at {place} overlaps {other} at {other_place}")
def integral_block_overlaps(context: DpideContext) -> Findings:
    """Another operand, or another loop, uses registers of an I_MV block.

    Why: the instruction keeps its integral, the previous error and the previous PV in the 30 registers from I_MV on,
    and writes them each cycle. Two loops in one block run away with each other's integral; a set point in the block is
    overwritten.

    Fix: leave 30 registers to every I_MV.
    """
    for first, second in overlapping(context):
        if "I_MV" in {first.operand, second.operand}:
            yield from _at_operands(first, second)


@error("DP703", D258, "{mine} at {place} and {other} at {other_place} {reason}")
def devices_collide(context: DpideContext) -> Findings:
    """Two operands share devices and cannot hold the same.

    Why: a number takes two registers, so D100 and D101 are not free of each other; and one register holds one value,
    whichever operand it is meant for. The PLC writes MV, the MOUT that follows MV, and after an autotune PID_MODE and
    the coefficients: what else stands there is lost.

    Fix: give each operand devices of its own. Operands may share a device on purpose where type and value are the same,
    or where the MV of one loop is the SV, BIAS or MOUT of another.
    """
    for first, second in overlapping(context):
        reason = None if "I_MV" in {first.operand, second.operand} else conflict(first, second)
        if reason is not None:
            yield from _at_operands(first, second, reason=reason)


def _at_operands(first: Held, second: Held, **values: str) -> Findings:
    """A finding at the operand of each loop; of operands of one loop at the second."""
    pairs = [(second, first)] if first.view is second.view else [(second, first), (first, second)]
    for item, other in pairs:
        finding = item.view.at(
            *item.path, mine=item.name, place=item.place, other=other.name, other_place=other.place
        ).quoting(**values)
        yield finding if len(pairs) == 1 else finding.shared_with(other.view.name)


def conflict(first: Held, second: Held) -> str | None:
    """Why two operands cannot share their devices; None: they can."""
    if first.place != second.place:
        return "overlap in part"
    if ROWS[first.operand].type is not ROWS[second.operand].type:
        return "are of different types"
    if any(item.operand == "MOUT" and item.view.mout_is_mv for item in (first, second)):
        # a conflict with the loop's own MV is reported at that MV
        return None
    outputs = [item for item in (first, second) if is_written(item)]
    if outputs:
        return _conflict_with_output(first, second, outputs)
    contents = [item.view.contents.get(item.operand) for item in (first, second)]
    return "hold different values" if None not in contents and contents[0] != contents[1] else None


def is_written(item: Held) -> bool:
    """Whether the instruction itself writes, or may come to write, an operand."""
    if item.operand == "MOUT":
        return item.view.loop.MOUT_AUTO or item.view.has_device("MOUT_AUTO")
    tunes = item.view.loop.PID_MODE == 1 or item.view.has_device("PID_MODE")
    return item.operand == "MV" or (tunes and item.operand in WRITTEN_BY_AUTOTUNE)


def _conflict_with_output(first: Held, second: Held, outputs: list[Held]) -> str | None:
    """An MV may drive another loop."""
    same_loop = first.view is second.view
    if len(outputs) > 1:
        return "are both written"
    output, reader = outputs[0], second if outputs[0] is first else first
    drives = output.operand == "MV" and reader.operand in {"SV", "BIAS", "MOUT"} and not same_loop
    return None if drives else f"would be an operand that {output.operand} overwrites"
