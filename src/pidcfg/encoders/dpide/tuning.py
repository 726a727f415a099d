"""How a DPIDE instruction holds its gains: engineering units, as times or as independent gains."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dpide import TUNED
from pidcfg.encoders.tuned import LoopTuning

if TYPE_CHECKING:
    from pidcfg.schemas.dpide import DpideFile, Loop


def tuning_of(_: DpideFile, loop: Loop) -> LoopTuning:
    """The three operands of an instruction."""
    return LoopTuning(
        TUNED, raises_pv=loop.PID_DIR, independent=not loop.PID_EQ, now=(loop.Kc_Kp, loop.Ti_Ki, loop.Td_Kd)
    )
