"""What a CLICK loop tells the outside: names of modes, alarms and flags as bits, and notices in words."""

from __future__ import annotations

from pidcfg.encoders.click.errors import in_words
from pidcfg.encoders.maps.click import ERRORS
from pidcfg.sim.controllers.click import modes as click_modes
from pidcfg.sim.controllers.click import state as bits
from pidcfg.sim.controllers.click import tune_results as click_tune_results

MODES = {"manual": bits.MANUAL, "auto": bits.AUTO, "autotune": bits.TUNING}
SIGNALS = {
    "sig_in": "",
    "sig_pv": "PV",
    "sig_sp": "SP",
    "sig_out": "CO",
    "sig_bias": "BIAS",
    "sig_error": "ERROR",
    "sig_pwm": "PWM",
}
"""Signals of a loop by their slots in `Config`; the measurement itself belongs to the plant."""
ALARM_BITS = {
    "pv_low_low": bits.LOW_LOW,
    "pv_low": bits.LOW,
    "pv_high": bits.HIGH,
    "pv_high_high": bits.HIGH_HIGH,
    "deviation_high": bits.DEVIATION_HIGH,
    "deviation_high_high": bits.DEVIATION_HIGH_HIGH,
    "rate_of_change": bits.RATE_OF_CHANGE,
}
ALARM_LIMITS = {
    "pv_low_low": "low_low",
    "pv_low": "low",
    "pv_high": "high",
    "pv_high_high": "high_high",
    "deviation_high": "deviation_high",
    "deviation_high_high": "deviation_high_high",
    "rate_of_change": "rate_of_change",
}
"""Where `Config` has the limit of each."""
OUTER_ALARMS = ("pv_low_low", "pv_high_high", "deviation_high_high")
FLAG_BITS = {"pid_error": bits.PID_ERROR, "autotune_error": bits.TUNE_ERROR}

REASONS = click_modes.REASONS | click_tune_results.REASONS
ABOUT_MODE = set(click_modes.ABOUT_MODE)
for _row, _error in enumerate(ERRORS, start=1):
    _text = in_words(_error)
    REASONS[click_modes.REFUSED_ERROR + _row] = f"refused: {_text}"
    REASONS[click_modes.OVERRIDE_ERROR + _row] = f"to Manual: {_text}"
    REASONS[click_modes.NOTED_ERROR + _row] = _text
    ABOUT_MODE |= {click_modes.REFUSED_ERROR + _row, click_modes.OVERRIDE_ERROR + _row}
