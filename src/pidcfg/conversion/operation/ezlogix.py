"""EZLogix loops: the mode is a bit that stays; a change to auto makes the integral of the CV (PID Loop Mode)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.operation.rules import Operation, Transfer, Windup

if TYPE_CHECKING:
    from pidcfg.schemas.ezlogix import EzlogixFile


def operations(config: EzlogixFile) -> list[Operation]:
    """Of each loop (D165, D167, D170); anti-windup looks at 0 and 4095 counts, not at the CV limits."""
    return [
        Operation(
            transfer=Transfer.ON_TOP,
            windup=Windup.CONDITIONAL_AT_ENDS if loop.anti_windup else Windup.ENDLESS,
            smoothing=None,
        )
        for loop in config.loops
    ]
