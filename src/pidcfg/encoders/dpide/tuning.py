"""How a DPIDE instruction holds its gains: engineering units, as times or as independent gains."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dpide import TUNED
from pidcfg.encoders.tuned import LoopTuning
from pidcfg.schemas.dpide import LONGEST_CYCLE, SHORTEST_CYCLE

if TYPE_CHECKING:
    from pidcfg.schemas.dpide import DpideFile, Loop

MILLISECONDS = 1000
"""In a second."""


def tuning_of(config: DpideFile, loop: Loop) -> LoopTuning:
    """The three operands of an instruction."""
    task = config.plc.interrupt_task
    seconds = float(min(max(loop.CYCLE, SHORTEST_CYCLE), LONGEST_CYCLE) if task is None else task) / MILLISECONDS
    return LoopTuning(
        TUNED,
        raises_pv=loop.PID_DIR,
        independent=not loop.PID_EQ,
        now=(loop.Kc_Kp, loop.Ti_Ki, loop.Td_Kd),
        sample_time=seconds,
        derivative_share=seconds / (float(loop.Tf) + seconds),
    )
