"""How an EZLogix loop is reported: names of modes and flags as bits, and notices in words."""

from __future__ import annotations

from pidcfg.encoders.maps.ezlogix_meanings import CODES
from pidcfg.sim.controllers.ezlogix import autotune as ezlogix_autotune
from pidcfg.sim.controllers.ezlogix import state as bits

MODES = {"manual": bits.MANUAL, "auto": bits.AUTO}
SIGNALS = {
    "sig_in": "",
    "sig_pv": "PV",
    "sig_sp": "SP",
    "sig_out": "CV",
    "sig_bias": "BIAS",
    "sig_error": "ERROR",
    "sig_status": "STATUS",
    "sig_pulse": "O",
    "sig_countdown": "COUNTDOWN",
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
    ezlogix_autotune.MOVING: "the PV was moving when the autotune began: do not trust its gains (D623)",
}
