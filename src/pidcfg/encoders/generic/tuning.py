"""How a neutral loop holds its gains: engineering units and seconds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.generic import TUNED
from pidcfg.encoders.tuned import LoopTuning

if TYPE_CHECKING:
    from pidcfg.schemas.generic import GenericFile, Loop


def tuning_of(_: GenericFile, loop: Loop) -> LoopTuning:
    """The three numbers of a loop."""
    tuning = loop.tuning
    return LoopTuning(
        TUNED,
        raises_pv=loop.output_raises_pv,
        now=(tuning.gain, tuning.integral_time, tuning.derivative_time),
        wrong="" if tuning.proportional else "it acts without its proportional term (tuning.proportional)",
        off=("off", "off"),
    )
