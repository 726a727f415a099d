"""How a NextoPID block holds its gains: engineering units, as times or as independent gains."""

from __future__ import annotations

from math import expm1
from typing import TYPE_CHECKING

from pidcfg.encoders.maps.nextopid import TUNED
from pidcfg.encoders.tuned import LoopTuning
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.nextopid import PidaReal

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.schemas.nextopid import Controller, NextopidFile


def tuning_of(config: NextopidFile, loop: Controller) -> LoopTuning:
    """The three parameters of a block."""
    if not isinstance(loop, PidaReal):
        return LoopTuning(TUNED, wrong="it switches on and off, and has no gains")
    wrong = "its form is not known: Indep is wired" if isinstance(loop.Indep, Wire) else ""
    if loop.DisableP is not False and loop.Indep is False:
        wrong = "it may act without its proportional term (DisableP)"
    seconds, filtered = float(loop.sample_time or config.plc.sample_time), float(_number(loop.Tfd) or 0)
    return LoopTuning(
        TUNED,
        raises_pv=None if isinstance(loop.Direct, Wire) else not loop.Direct,
        independent=loop.Indep is True,
        now=(_number(loop.Kp), _number(loop.Ti_Ki), _number(loop.Td_Kd)),
        wrong=wrong,
        sample_time=seconds,
        derivative_share=-expm1(-seconds / filtered) if filtered > 0 else 1.0,
    )


def _number(value: Decimal | Wire) -> Decimal | None:
    return None if isinstance(value, Wire) else value
