"""What a DL06 loop tells the outside: names of modes, alarms and flags as bits, and notices in words."""

from __future__ import annotations

from pidcfg.sim.controllers.dl06 import modes as dl06_modes
from pidcfg.sim.controllers.dl06 import ramp_soak as dl06_ramp_soak
from pidcfg.sim.controllers.dl06 import state as bits
from pidcfg.sim.controllers.dl06 import tune_results as dl06_tune_results
from pidcfg.sim.notices import notices

MODES = {"manual": bits.MANUAL, "auto": bits.AUTO, "cascade": bits.CASCADE}
COMMANDS = {"start": bits.RS_START, "hold": bits.RS_HOLD, "resume": bits.RS_RESUME, "jog": bits.RS_JOG}
REASONS = dl06_modes.REASONS | dl06_ramp_soak.REASONS | dl06_tune_results.REASONS
SIGNALS = ("", "PV", "SP", "OUT", "BIAS")
"""Signals of a loop in the order of `Config.sig_in` and its followers; the measurement itself belongs to the plant."""
ALARM_BITS = {
    "pv_low_low": bits.LOW_LOW,
    "pv_low": bits.LOW,
    "pv_high": bits.HIGH,
    "pv_high_high": bits.HIGH_HIGH,
    "deviation_yellow": bits.YELLOW,
    "deviation_red": bits.RED,
    "rate_of_change": bits.RATE_OF_CHANGE,
}
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


def mode_name(status: int) -> str:
    """The mode that a status word tells."""
    return next((name for name, bit in MODES.items() if status & bit), "manual")


def profile_step(aux_status: int) -> str:
    """The step byte of the ramp/soak word: odd steps are ramps, even ones soaks."""
    step = aux_status // bits.RS_STEP
    return f"{step} {'ramp' if step % 2 else 'soak'}" if step else ""


def describe(notice: int) -> tuple[str, str]:
    """What happened in words: to the mode (refusals and overrides), and apart from it."""
    found: tuple[list[str], list[str]] = [], []
    for asked, reason in notices(notice):
        about_mode = reason in dl06_modes.REASONS and (asked or reason > dl06_modes.LAST_REFUSAL)
        found[0 if about_mode else 1].append(REASONS[reason])
    return "; ".join(found[0]), "; ".join(found[1])


def requested(notice: int) -> str | None:
    """The mode that was asked for when the last notice was left; None: nobody asked for one."""
    asked = [mode for mode, _ in notices(notice) if mode]
    return mode_name(asked[-1]) if asked else None
