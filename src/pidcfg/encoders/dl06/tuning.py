"""How a DL06 loop holds its gains: shares of both spans, the reset in its own unit and decimals."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.dl06.encode import reset_value
from pidcfg.encoders.mapping import switched_on
from pidcfg.encoders.maps.dl06 import LOOP_TABLES, RESET, TUNED
from pidcfg.encoders.tuned import LoopTuning

if TYPE_CHECKING:
    from pidcfg.schemas.dl06 import Dl06File, Loop


def tuning_of(config: Dl06File, loop: Loop) -> LoopTuning:
    """The three numbers of a loop, and what they are counted in."""
    tuning, pv, output = loop.tuning, loop.pv.range, loop.output.range
    reset, codec = reset_value(loop), RESET[config.plc.reset_decimals]
    is_off = any(reset == digits * codec.step for digits in codec.off)
    limit = loop.derivative_gain_limit
    limited = switched_on(loop.derivative_gain_limit_enabled, limit)
    filtered, share = switched_on(loop.pv.filter_enabled, loop.pv.filter), float(loop.pv.filter or 0)
    return LoopTuning(
        replace(TUNED, table=LOOP_TABLES[config.plc.reset_decimals]),
        raises_pv=loop.action == TUNED.heating,
        pv_span=None if pv is None else pv[1] - pv[0],
        output_span=None if output is None else output[1] - output[0],
        minutes=tuning.reset_unit == "minutes",
        now=(tuning.gain, Decimal(0) if is_off else reset, tuning.rate),
        wrong="it squares its error (error.curve)" if loop.error.curve == "squared" else "",
        no_derivative="its derivative_gain_limit of 0 removes the derivative" if limited and not limit else "",
        off=("off", "0"),
        sample_time=float(loop.sample_rate),
        pv_share=share if filtered and 0 < share <= 1 else 1.0,
        derivative_limit=float(limit) if limited and limit else None,
    )
