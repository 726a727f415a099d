"""How a neutral loop holds its gains: engineering units and seconds."""

from __future__ import annotations

from math import expm1
from typing import TYPE_CHECKING

from pidcfg.encoders.maps.generic import TUNED
from pidcfg.encoders.tuned import LoopTuning

if TYPE_CHECKING:
    from pidcfg.schemas.generic import GenericFile, Loop


def tuning_of(_: GenericFile, loop: Loop) -> LoopTuning:
    """The three numbers of a loop."""
    tuning, seconds = loop.tuning, float(loop.sample_time)
    return LoopTuning(
        TUNED,
        raises_pv=loop.output_raises_pv,
        now=(tuning.gain, tuning.integral_time, tuning.derivative_time),
        wrong="" if tuning.proportional else "it acts without its proportional term (tuning.proportional)",
        off=("off", "off"),
        sample_time=seconds,
        pv_share=_share(float(loop.pv.filter), seconds),
        derivative_share=_share(float(tuning.derivative_filter), seconds),
    )


def _share(time: float, seconds: float) -> float:
    """What a filter with this time constant takes of a difference in each sample."""
    return -expm1(-seconds / time) if time > 0 else 1.0
