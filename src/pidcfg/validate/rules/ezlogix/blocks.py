"""The blocks of registers and discretes: where they end, what they share, and how many loops there may be."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.ezlogix import LOOPS, SPACE
from pidcfg.refs import EZLOGIX
from pidcfg.schemas.ezlogix import D152
from pidcfg.validate.ideas import blocks
from pidcfg.validate.rule import Findings, error, per_loop

if TYPE_CHECKING:
    from pidcfg.validate.rules.ezlogix.context import EzlogixContext, LoopView

BLOCK = EZLOGIX.at("PID Setup")
COUNT = EZLOGIX.at("PID on EZLogix")
LAST = {bank.prefix: bank.last for bank in SPACE.banks}


@per_loop
@error(
    "EZ401",
    D152,
    "{block} would occupy {extent}, but there is nothing beyond {prefix}{last}: it may begin at "
    "{prefix}{latest} at the latest",
)
def block_beyond_bank(view: LoopView) -> Findings:
    """A block of registers or discretes reaches past the highest address.

    Why: a loop needs 32 consecutive registers and 8 consecutive discretes. What lies past the last address does not
    exist: the dialog refuses the base, and a writer of the image fails.

    Fix: let the block begin lower.
    """
    return blocks.block_beyond_bank(view, LAST)


@error("EZ402", BLOCK, "{block} {extent} of {loop} overlaps {other_extent} of {other}")
def blocks_overlap(context: EzlogixContext) -> Findings:
    """Two loops share registers or discretes.

    Why: each loop reads its gains, limits and mode from its blocks, and writes its error and saturation there. Two
    loops in one block change each other's set points and modes. The registers that are reserved count as well.

    Fix: leave 32 registers and 8 discretes to every loop.
    """
    return blocks.blocks_overlap(context.loops)


@error("EZ403", COUNT, "{count} loops are listed; an EZLogix PLC calculates at most {limit}")
def too_many_loops(context: EzlogixContext) -> Findings:
    """The file has more loops than the PLC.

    Why: the dialog offers eight loops; nothing calculates a ninth one.

    Fix: move the loop to another PLC, and to a file of its own.
    """
    return blocks.too_many_loops(context.loops, LOOPS)
