"""How a CLICK loop holds its gains: % of the output per PV unit, and seconds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.mapping import switched_on
from pidcfg.encoders.maps.click import TUNED
from pidcfg.encoders.tuned import LoopTuning

if TYPE_CHECKING:
    from pidcfg.schemas.click import ClickFile, Loop

UNFILTERED = 100
"""The derivative gain limit that filters nothing."""


def tuning_of(_: ClickFile, loop: Loop) -> LoopTuning:
    """The three numbers of a loop; its integral cannot be switched off, the longest reset time is as good."""
    tuning = loop.tuning
    limit = loop.derivative_gain_limit
    limited = switched_on(loop.derivative_gain_limit_enabled, limit)
    filtered = switched_on(loop.pv.filter_enabled, loop.pv.filter)
    return LoopTuning(
        TUNED,
        raises_pv=loop.action == TUNED.heating,
        now=(tuning.proportional_gain, tuning.reset_time, tuning.derivative_gain),
        wrong="it squares its error (error.curve)" if loop.error.curve == "squared" else "",
        no_derivative="its derivative_gain_limit of 0 removes the derivative" if limited and not limit else "",
        off=(f"{TUNED.no_integral}", "0"),
        sample_time=float(loop.sample_rate),
        pv_share=float(loop.pv.filter or 100) / 100 if filtered else 1.0,
        derivative_limit=float(limit) if limited and limit and limit < UNFILTERED else None,
    )
