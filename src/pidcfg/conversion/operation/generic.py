"""Neutral loops: nothing bumps (D301), and the integral stops at the limits (D300)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.operation.rules import Master, Operation, Own, Rate, Smoothing, Stopped, Windup

if TYPE_CHECKING:
    from pidcfg.schemas.generic import GenericFile

OWN = Own()
"""Nothing has an address, and nothing else is left out."""


def operations(config: GenericFile) -> list[Operation]:
    """Of each loop (D300, D301)."""
    return [
        Operation(
            windup=Windup.CONDITIONAL if loop.anti_windup else Windup.ENDLESS,
            smoothing=Smoothing.EXACT,
            rate=Rate.KEPT_UP,
            master=Master.FOLLOWS,
            stopped=Stopped.UNSAID,
        )
        for loop in config.loops
    ]
