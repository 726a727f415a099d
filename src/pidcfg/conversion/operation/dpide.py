"""DPIDE instructions: MOUT_AUTO decides about manual, PID_MODE about the way back (manual, PID_MODE and MOUT_AUTO)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.operation.rules import Deadband, Manual, Operation, Own, Windup
from pidcfg.conversion.to_neutral.dpide import AROUND, BACK_CALCULATED

if TYPE_CHECKING:
    from pidcfg.schemas.dpide import DpideFile, Loop

OWN = Own(("device", "devices"), dict.fromkeys(AROUND, ""))
"""Its devices, and how the program calls it."""


def operations(config: DpideFile) -> list[Operation]:
    """Of each instruction (D268 to D274)."""
    return [
        Operation(
            manual=Manual.STAYS if loop.MOUT_AUTO or _is_one_device(loop) else Manual.JUMPS,
            windup=Windup.WORKED_OUT if loop.PID_MODE == BACK_CALCULATED else Windup.HELD_BEYOND,
            deadband=Deadband.CROSSED,
        )
        for loop in config.loops
    ]


def _is_one_device(loop: Loop) -> bool:
    """Whether MOUT stands in the device of MV."""
    return loop.devices.MV is not None and loop.devices.MOUT == loop.devices.MV
