"""What a scenario's ``set`` may write in a running loop, by the keys of its configuration.

Short forms: ``setpoint`` and ``output`` with a number. What the dialog alone holds (action, algorithm, tags) is no
register and cannot be set.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.ezlogix import R_BLOCK, S_BLOCK
from pidcfg.encoders.regmap import Word
from pidcfg.encoders.scales import Position
from pidcfg.schemas.base import parse_off_seconds, parse_quantity, parse_seconds
from pidcfg.schemas.ezlogix import LIMITS
from pidcfg.schemas.numbers import parse_integer, parse_number
from pidcfg.sim.settings import Keys, rows_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

CV = Word(-1, "cv", "output.value", Position("output"), "output", "Control Variable", "-", LIMITS)
"""The CV stands in its tag, outside the block."""

EVENTS = {"mode": "mode", "autotune": "autotune"}
PARSERS: Mapping[str, Callable[[object], object]] = {
    "sample_rate": parse_seconds,
    "tuning.proportional_gain": parse_number,
    "tuning.integral_time": parse_off_seconds,
    "tuning.derivative_time": parse_off_seconds,
    "autotune.timeout": parse_integer,
    "output.pulse.cycle_time": parse_seconds,
    "output.pulse.min_on": parse_seconds,
    "output.pulse.min_off": parse_seconds,
}
KEYS = Keys(
    {**rows_of((R_BLOCK, S_BLOCK), EVENTS), str(CV.path): CV},
    {"setpoint": "setpoint.value", "output": str(CV.path)},
    EVENTS,
    PARSERS,
    lambda _word: parse_quantity,
)
