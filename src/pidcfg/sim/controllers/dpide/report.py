"""How a DPIDE instruction is reported: names of modes and flags as bits, and notices in words."""

from __future__ import annotations

from pidcfg.sim.controllers.dpide import autotune as dpide_autotune
from pidcfg.sim.controllers.dpide import equation as dpide_equation
from pidcfg.sim.controllers.dpide import state as bits

MODES = {"manual": bits.MANUAL, "auto": bits.AUTO, "autotune": bits.TUNING, "off": bits.OFF}
SIGNALS = {
    "sig_in": "",
    "sig_pv": "PV",
    "sig_sp": "SV",
    "sig_out": "MV",
    "sig_mout": "MOUT",
    "sig_bias": "I_MV",
    "sig_error": "E",
}
"""Signals of a loop by their slots in `Config`; the measurement itself belongs to the plant."""
FLAG_BITS = {
    "mv_limited": bits.LIMITED,
    "in_dead_band": bits.IN_DEAD_BAND,
    "autotune_running": bits.TUNING,
    "autotune_error": bits.TUNE_ERROR,
}

WAITS_FOR_TUNE = 32
WAITS_FOR_PLC = 33
TUNE_WAITS = 34
TUNE_RUNS = 35
TUNE_IDLE = 36
IS_STOPPED = 37
TUNE_WAITS_FOR_PLC = 38

ABOUT_MODE = (WAITS_FOR_TUNE, WAITS_FOR_PLC)
"""Reasons that concern a requested mode."""
REASONS = {
    **dpide_autotune.REASONS,
    dpide_equation.JUMPS_WITHOUT: "MV jumps at the end of manual: without Ti_Ki there is no I_MV that could carry MOUT",
    WAITS_FOR_TUNE: "waits: PID_MAN has no effect while PID_MODE is 1",
    WAITS_FOR_PLC: "waits: the PLC is stopped",
    TUNE_WAITS: "autotune waits: PID_RUN is FALSE",
    TUNE_WAITS_FOR_PLC: "autotune waits: the PLC is stopped",
    TUNE_RUNS: "autotune is running already",
    TUNE_IDLE: "no autotune to be cancelled",
    IS_STOPPED: "the PLC is stopped: the instruction is not executed, MV stays as it is",
}
TUNE_STATUS = {
    dpide_autotune.DONE: "done",
    dpide_autotune.FAILED: "error",
    dpide_autotune.CANCELLED: "cancelled",
}
"""How an autotune went, by `State.tune_done`."""
