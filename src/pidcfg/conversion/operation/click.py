"""CLICK loops: each starts in manual, and a change to auto makes the bias of the output (help CL246)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.operation.rules import Deadband, Operation, Own, Start, Transfer, Windup, WithoutIntegral

if TYPE_CHECKING:
    from pidcfg.schemas.click import ClickFile

OWN = Own(("bits", "integers", "floats"))
"""Its blocks."""


def operations(config: ClickFile) -> list[Operation]:
    """Of each loop (D111 to D113, D119); mode 1 sets the set point to the PV, so that there is no error on top."""
    return [
        Operation(
            start=Start.WAITS,
            transfer=Transfer.GOES_ON if loop.bumpless == 1 else Transfer.ON_TOP,
            without_integral=WithoutIntegral.TAKEN_OVER,
            windup=Windup.FROZEN if loop.freeze_bias else Windup.WITHIN_LIMITS,
            deadband=Deadband.ONLY_BIAS,
        )
        for loop in config.loops
    ]
