"""NextoPID blocks: MV becomes ManualMV, and comes back without a bump (manual, ManualMV and chapter 16)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.operation.rules import (
    Deadband,
    Filter,
    Manual,
    Master,
    Operation,
    Own,
    Rate,
    Smoothing,
    Windup,
)
from pidcfg.encoders.nextopid.bumpless import bumpless_moves
from pidcfg.encoders.nextopid.encode import encode
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from pidcfg.encoders.nextopid.encode import NextopidEncoding
    from pidcfg.schemas.nextopid import Loop, NextopidFile

OWN = Own()
"""Nothing has an address, and nothing else is left out."""


def operations(config: NextopidFile) -> list[Operation]:
    """Of each block (D221, D222, D229); one whose MV is wired or copied into its ManualMV keeps it."""
    encoding, first = encode(config), len(config.blocks)
    return [
        Operation(
            manual=Manual.STAYS if _keeps_output(encoding, first + i, loop) else Manual.JUMPS,
            windup=Windup.PARTIAL,
            deadband=Deadband.HELD,
            smoothing=Smoothing.EXACT,
            rate=Rate.KEPT_UP,
            filter=Filter.SAMPLED if loop.sample_time in {None, config.plc.sample_time} else Filter.CYCLIC,
            master=Master.FOLLOWS if isinstance(getattr(loop, "TRK_IN", None), Wire) else Master.INTEGRATES,
        )
        for i, loop in enumerate(config.loops)
    ]


def _keeps_output(encoding: NextopidEncoding, i: int, loop: Loop) -> bool:
    wire = loop.ManualMV
    if bumpless_moves(encoding, i).holds_mv is not None:
        return True
    return isinstance(wire, Wire) and wire.text == f"{loop.name}.MV"
