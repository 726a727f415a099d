"""How an EZLogix loop holds its gains: counts of the CV per count of the PV, and seconds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.ezlogix.encode import scales_of
from pidcfg.encoders.maps.ezlogix import TUNED
from pidcfg.encoders.tuned import LoopTuning
from pidcfg.schemas.ezlogix import CV_FULL
from pidcfg.schemas.numbers import EXACT

if TYPE_CHECKING:
    from pidcfg.schemas.ezlogix import EzlogixFile, Loop


def tuning_of(_: EzlogixFile, loop: Loop) -> LoopTuning:
    """The three numbers of a loop; 0 to 4095 counts are more than the PV's range where its counts are fewer."""
    tuning, pv, output = loop.tuning, loop.pv.range, loop.output.range
    counts = scales_of(loop.pv, loop.output, root=loop.pv.square_root)["sp"].format.span
    return LoopTuning(
        TUNED,
        raises_pv=loop.action == TUNED.heating,
        pv_span=None if pv is None else EXACT.divide((pv[1] - pv[0]) * CV_FULL, counts),
        output_span=None if output is None else output[1] - output[0],
        now=(tuning.proportional_gain, tuning.integral_time, tuning.derivative_time),
        off=("off", "off"),
        sample_time=float(loop.sample_rate),
    )
