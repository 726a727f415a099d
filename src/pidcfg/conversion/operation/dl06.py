"""DL06 loops: new ones begin in Manual, Run brings back the mode of before (manual, PLC Modes' Effect on Loop Modes).

A change to Auto makes the bias of the output (manual, Bumpless Transfers).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.operation.rules import Interlock, Master, Operation, Start, Transfer, Windup, WithoutIntegral
from pidcfg.encoders.dl06.encode import pv_alarms_on

if TYPE_CHECKING:
    from pidcfg.schemas.dl06 import Dl06File


def operations(config: Dl06File) -> list[Operation]:
    """Of each loop (D35, D39, D41 to D43, D45, D49); type I sets the set point to the PV: no error is on top."""
    rules = []
    for loop in config.loops:
        velocity = loop.algorithm == "velocity"
        frozen = Windup.FROZEN_AT_ENDS if loop.bias_freeze else Windup.WITHIN_RANGE
        rules.append(
            Operation(
                start=Start.RETURNS,
                transfer=Transfer.GOES_ON if velocity or loop.bumpless == "I" else Transfer.ON_TOP,
                without_integral=WithoutIntegral.TAKEN_OVER,
                windup=Windup.NONE if velocity else frozen,
                interlock=Interlock.REFUSED if pv_alarms_on(loop) else Interlock.GRANTED,
                master=Master.MANUAL,
            )
        )
    return rules
