"""How a DL06 loop is reported: names of modes, alarms and flags as bits, and notices in words."""

from __future__ import annotations

from pidcfg.sim.controllers.dl06 import modes as dl06_modes
from pidcfg.sim.controllers.dl06 import ramp_soak as dl06_ramp_soak
from pidcfg.sim.controllers.dl06 import state as bits
from pidcfg.sim.controllers.dl06 import tune_results as dl06_tune_results
from pidcfg.sim.notices import GOAL_ENDS

MODES = {"manual": bits.MANUAL, "auto": bits.AUTO, "cascade": bits.CASCADE}
COMMANDS = {"start": bits.RS_START, "hold": bits.RS_HOLD, "resume": bits.RS_RESUME, "jog": bits.RS_JOG}
REASONS = dl06_modes.REASONS | dl06_ramp_soak.REASONS | dl06_tune_results.REASONS | {dl06_modes.GIVEN_UP: GOAL_ENDS}
SIGNALS = {
    "sig_in": "",
    "sig_pv": "PV",
    "sig_sp": "SP",
    "sig_out": "OUT",
    "sig_bias": "BIAS",
    "sig_step": "STEP",
}
"""Signals of a loop by their slots in `Config`; the measurement itself belongs to the plant."""
ALARM_BITS = {
    "pv_low_low": bits.LOW_LOW,
    "pv_low": bits.LOW,
    "pv_high": bits.HIGH,
    "pv_high_high": bits.HIGH_HIGH,
    "deviation_yellow": bits.YELLOW,
    "deviation_red": bits.RED,
    "rate_of_change": bits.RATE_OF_CHANGE,
}
ALARM_LIMITS = {
    "pv_low_low": "low_low",
    "pv_low": "low",
    "pv_high": "high",
    "pv_high_high": "high_high",
    "deviation_yellow": "yellow",
    "deviation_red": "red",
    "rate_of_change": "rate_of_change",
}
"""Where `Config` has the limit of each."""
OUTER_ALARMS = ("pv_low_low", "pv_high_high", "deviation_red")
FLAG_BITS = {
    "alarm_programming_error": bits.ALARM_ERROR,
    "overflow": bits.OVERFLOW,
    "autotune_running": bits.TUNING,
    "autotune_error": bits.TUNE_ERROR,
}
AUX_BITS = {
    "ramp_soak_complete": bits.RS_COMPLETE,
    "ramp_soak_deviation": bits.RS_DEVIATION,
    "ramp_soak_hold": bits.RS_HELD,
}
