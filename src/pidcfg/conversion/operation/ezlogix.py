"""EZLogix loops: the mode is a bit that stays; a change to auto makes the integral of the CV (PID Loop Mode)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.conversion.operation.rules import Operation, Own, Stopped, Transfer, Windup
from pidcfg.schemas.ezlogix import CV_FULL

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.schemas.ezlogix import EzlogixFile


def _counts(config: EzlogixFile, kept: Sequence[int]) -> dict[str, Any]:
    """How the PVs are counted."""
    return {"pv_counts": [config.loops[i].pv.counts or (0, CV_FULL) for i in kept]}


OWN = Own(
    ("registers", "discretes", "pv.tag", "output.tag", "output.pulse.tag"),
    {"/plc.process_when_stopped": ""},
    _counts,
)
"""Its registers and tags, and whether its loops go on while the PLC is stopped, of which no option speaks."""


def operations(config: EzlogixFile) -> list[Operation]:
    """Of each loop (D165, D167, D170); anti-windup looks at 0 and 4095 counts, not at the CV limits."""
    asked = Stopped.GOES_ON if "process_when_stopped" in config.plc.model_fields_set else Stopped.AS_GIVEN
    stopped = asked if config.plc.process_when_stopped else Stopped.STANDS
    return [
        Operation(
            transfer=Transfer.ON_TOP,
            windup=Windup.CONDITIONAL_AT_ENDS if loop.anti_windup else Windup.ENDLESS,
            smoothing=None,
            stopped=stopped,
        )
        for loop in config.loops
    ]
