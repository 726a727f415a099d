"""How an EZLogix loop is reported, and what ``set`` may write."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pidcfg.encoders.codecs import Position
from pidcfg.encoders.maps.ezlogix import CODES, R_BLOCK, S_BLOCK
from pidcfg.encoders.regmap import Word
from pidcfg.schemas.base import parse_off_seconds, parse_quantity, parse_seconds, parse_whole_seconds
from pidcfg.schemas.ezlogix import LIMITS
from pidcfg.schemas.numbers import parse_number
from pidcfg.sim.controllers.ezlogix import autotune as ezlogix_autotune
from pidcfg.sim.controllers.ezlogix import equation as bits
from pidcfg.sim.controllers.settings import Keys, rows_of

# --- How an EZLogix loop is reported: names of modes and flags as bits, and notices in words --------------------------

MODE_BITS = {"manual": bits.MANUAL, "auto": bits.AUTO}
SIGNALS = {
    "in_slot": "",
    "pv_slot": "PV",
    "sp_slot": "SP",
    "out_slot": "CV",
    "bias_slot": "BIAS",
    "error_slot": "ERROR",
    "status_slot": "STATUS",
    "pulse_slot": "O",
    "countdown_slot": "COUNTDOWN",
}
"""Signals of a loop by their slots in `Config`; the measurement itself belongs to the plant."""
FLAG_BITS = {
    "saturation": bits.SATURATED,
    "autotune_running": bits.TUNING,
    "autotune_error": bits.TUNE_ERROR,
}

WAITS_FOR_RATE = 1
WAITS_FOR_RUN = 2
IS_STOPPED = 3
PV_IS_STALE = 4
OUTPUT_IS_CUT = 5
TUNE_RUNS = 6

TUNE_STATUS = {code.number: code.title for code in CODES}
"""The manual's table of Base+12 in words."""
REASONS = {
    **{ezlogix_autotune.REASON + n: f"autotune: {title} (status {n})" for n, title in TUNE_STATUS.items()},
    WAITS_FOR_RATE: "waits: the loop is not calculated, its sample rate is below 0.05 s",
    WAITS_FOR_RUN: "waits: the PLC is stopped and the loop is not calculated",
    IS_STOPPED: "the PLC is stopped: the loop is not calculated, its outputs stay as they are",
    PV_IS_STALE: "the PLC is stopped: the loop goes on, but nothing renews its PV in an R register",
    OUTPUT_IS_CUT: "the PLC is stopped: the loop goes on, but nothing carries its CV from an R register to an output",
    TUNE_RUNS: "autotune is running already",
    ezlogix_autotune.FAR: "the autotune begins with the PV more than 10 % of its span from the set point (D622)",
    ezlogix_autotune.PLC_STOPPED: "autotune cancelled: the PLC was stopped (status 4)",
    ezlogix_autotune.RATE_WRITTEN: "autotune: the sample rate was changed (status 6, D695)",
    ezlogix_autotune.MOVING: "the PV was moving when the autotune began: do not trust its gains (D623)",
}

# --- What a scenario's ``set`` may write in a running loop, by the keys of its configuration --------------------------
#
# Short forms: ``setpoint`` and ``output`` with a number. What the dialog alone holds (action, algorithm, tags) is no
# register and cannot be set.

CV = Word(-1, "cv", "output.value", Position("output"), "output", "Control Variable", "-", LIMITS)
"""The CV stands in its tag, outside the block."""

EVENTS = {"mode": "mode", "autotune": "autotune"}
PARSERS: Mapping[str, Callable[[object], object]] = {
    "sample_rate": parse_seconds,
    "tuning.proportional_gain": parse_number,
    "tuning.integral_time": parse_off_seconds,
    "tuning.derivative_time": parse_off_seconds,
    "autotune.timeout": parse_whole_seconds,
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
