"""What a CLICK loop tells the outside: names of modes, alarms and flags as bits, and notices in words."""

from __future__ import annotations

from pidcfg.encoders.click.errors import in_words
from pidcfg.encoders.maps.click import ERRORS
from pidcfg.sim.controllers.click import modes as click_modes
from pidcfg.sim.controllers.click import state as bits
from pidcfg.sim.controllers.click import tune_results as click_tune_results
from pidcfg.sim.notices import notices

MODES = {"manual": bits.MANUAL, "auto": bits.AUTO, "autotune": bits.TUNING}
SIGNALS = ("", "PV", "SP", "CO", "BIAS", "ERROR", "PWM")
"""Signals of a loop in the order of `Config.sig_in` and its followers; the measurement itself belongs to the plant."""
ALARM_BITS = {
    "pv_low_low": bits.LOW_LOW,
    "pv_low": bits.LOW,
    "pv_high": bits.HIGH,
    "pv_high_high": bits.HIGH_HIGH,
    "deviation_high": bits.DEVIATION_HIGH,
    "deviation_high_high": bits.DEVIATION_HIGH_HIGH,
    "rate_of_change": bits.RATE_OF_CHANGE,
}
FLAG_BITS = {"pid_error": bits.PID_ERROR, "autotune_error": bits.TUNE_ERROR}

REASONS = click_modes.REASONS | click_tune_results.REASONS
ABOUT_MODE = set(click_modes.ABOUT_MODE)
for _row, _error in enumerate(ERRORS, start=1):
    _text = in_words(_error)
    REASONS[click_modes.REFUSED_ERROR + _row] = f"refused: {_text}"
    REASONS[click_modes.OVERRIDE_ERROR + _row] = f"to Manual: {_text}"
    REASONS[click_modes.NOTED_ERROR + _row] = _text
    ABOUT_MODE |= {click_modes.REFUSED_ERROR + _row, click_modes.OVERRIDE_ERROR + _row}


def mode_name(status: int) -> str:
    """The mode that a status tells."""
    return next((name for name, bit in MODES.items() if status & bit), "manual")


def describe(notice: int) -> tuple[str, str]:
    """What happened in words: to the mode (refusals and overrides), and apart from it."""
    found: tuple[list[str], list[str]] = [], []
    for _, reason in notices(notice):
        found[0 if reason in ABOUT_MODE else 1].append(REASONS[reason])
    return "; ".join(found[0]), "; ".join(found[1])


def requested(notice: int) -> str | None:
    """The mode that was asked for when the last notice was left; None: nobody asked for one."""
    asked = [mode for mode, _ in notices(notice) if mode]
    return mode_name(asked[-1]) if asked else None
