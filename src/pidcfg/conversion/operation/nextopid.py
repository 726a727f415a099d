"""NextoPID blocks: MV becomes ManualMV, and comes back without a bump (manual, ManualMV and chapter 16)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.operation.rules import Deadband, Manual, Master, Operation, Own, Smoothing, Windup
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from pidcfg.schemas.nextopid import Loop, NextopidFile

OWN = Own()
"""Nothing has an address, and nothing else is left out."""


def operations(config: NextopidFile) -> list[Operation]:
    """Of each block (D221, D222, D229); one whose ManualMV is wired to its own MV keeps it."""
    return [
        Operation(
            manual=Manual.STAYS if _keeps_output(loop) else Manual.JUMPS,
            windup=Windup.PARTIAL,
            deadband=Deadband.HELD,
            smoothing=Smoothing.EXACT,
            master=Master.FOLLOWS if isinstance(getattr(loop, "TRK_IN", None), Wire) else Master.INTEGRATES,
        )
        for loop in config.loops
    ]


def _keeps_output(loop: Loop) -> bool:
    wire = loop.ManualMV
    return isinstance(wire, Wire) and wire.text == f"{loop.name}.MV"
