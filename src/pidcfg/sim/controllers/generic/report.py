"""What a neutral loop tells the outside: names of modes, alarms and flags as bits, and notices in words."""

from __future__ import annotations

from pidcfg.sim.controllers.generic import equation
from pidcfg.sim.controllers.generic import state as bits
from pidcfg.sim.notices import noticed, notices

MODES = {"manual": bits.MANUAL, "auto": bits.AUTO, "cascade": bits.CASCADE}
NUMBERED = tuple(MODES)
"""In a notice, modes are numbered from 1."""
SIGNALS = ("", "PV", "SP", "OUT", "BIAS", "PULSE")
"""Signals of a loop in the order of `Config.sig_in` and its followers; the measurement itself belongs to the plant."""
ALARM_BITS = {
    "high_high": bits.HIGH_HIGH,
    "low_low": bits.LOW_LOW,
    "high": bits.HIGH,
    "low": bits.LOW,
    "deviation_high_high": bits.DEVIATION_2,
    "deviation_high": bits.DEVIATION,
    "rate_of_change": bits.RATE,
}
FLAG_BITS = {
    "out_limited": bits.LIMITED,
    "rate_limited": bits.SLOWED,
    "tracking": bits.TRACKING,
    "in_deadband": bits.SILENT,
}
NO_SOURCE = 32
ABOUT_MODE = {NO_SOURCE: "refused: the loop has no setpoint.source"}
"""Reasons that concern a mode that was asked for."""
REASONS = {equation.JUMPS: "OUT jumps: without an integral time nothing can carry it on"}


def refuse_mode(s: bits.State, mode: str) -> None:
    """Leave a notice for the log."""
    s.notice = noticed(s.notice, NUMBERED.index(mode) + 1, NO_SOURCE)


def mode_name(status: int) -> str:
    """The mode that a status tells."""
    return next(name for name, bit in MODES.items() if status & bit)


def describe(notice: int) -> tuple[str, str]:
    """What happened in words: to the mode (a refusal), and apart from it."""
    found = [reason for _, reason in notices(notice)]
    about = "; ".join(ABOUT_MODE[reason] for reason in found if reason in ABOUT_MODE)
    return about, "; ".join(REASONS[reason] for reason in found if reason in REASONS)


def requested(notice: int) -> str | None:
    """The mode that was asked for when the last notice was left; None: nobody asked for one."""
    asked = [mode for mode, _ in notices(notice) if mode]
    return NUMBERED[asked[-1] - 1] if asked else None
