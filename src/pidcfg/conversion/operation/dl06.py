"""DL06 loops: new ones begin in Manual, Run brings back the mode of before (manual, PLC Modes' Effect on Loop Modes).

A change to Auto makes the bias of the output (manual, Bumpless Transfers).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.conversion.operation.rules import (
    Interlock,
    Master,
    Operation,
    Own,
    Start,
    Stopped,
    Transfer,
    Windup,
    WithoutIntegral,
)
from pidcfg.encoders.dl06.encode import pv_alarms_on

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.schemas.dl06 import Dl06File

READ_AS = ("reset_decimals", "derivative")
"""Keys of ``plc``, and options, that say what words mean."""


def _formats(config: Dl06File, kept: Sequence[int]) -> dict[str, Any]:
    """The data format where all loops have the same, and how reset and rate words are read."""
    formats = {config.loops[i].pv.format for i in kept}
    own: dict[str, Any] = {"data_format": formats.pop()} if len(formats) == 1 else {}
    return own | {key: getattr(config.plc, key) for key in READ_AS if key in config.plc.model_fields_set}


OWN = Own(
    ("/plc.loop_table",),
    {"pv.transfer": "", "output.transfer": "", **{f"/plc.{key}": key for key in READ_AS}},
    _formats,
)
"""Its table, its auto transfers, and how its words are read."""


def operations(config: Dl06File) -> list[Operation]:
    """Of each loop (D35, D39, D41 to D43, D45, D49); type I sets the set point to the PV: no error is on top."""
    rules = []
    for loop in config.loops:
        velocity = loop.algorithm == "velocity"
        frozen = Windup.FROZEN_AT_ENDS if loop.bias_freeze else Windup.WITHIN_RANGE
        rules.append(
            Operation(
                start=Start.RETURNS,
                stopped=Stopped.GOES_ON if loop.independent_of_cpu_mode else Stopped.STANDS,
                transfer=Transfer.GOES_ON if velocity or loop.bumpless == "I" else Transfer.ON_TOP,
                without_integral=WithoutIntegral.TAKEN_OVER,
                windup=Windup.NONE if velocity else frozen,
                interlock=Interlock.REFUSED if pv_alarms_on(loop) else Interlock.GRANTED,
                master=Master.MANUAL,
            )
        )
    return rules
