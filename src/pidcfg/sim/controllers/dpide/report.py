"""What a DPIDE instruction tells the outside: names of modes and flags as bits, and notices in words."""

from __future__ import annotations

from pidcfg.sim.controllers.dpide import autotune as dpide_autotune
from pidcfg.sim.controllers.dpide import equation as dpide_equation
from pidcfg.sim.controllers.dpide import state as bits
from pidcfg.sim.notices import noticed, notices

MODES = {"manual": bits.MANUAL, "auto": bits.AUTO, "autotune": bits.TUNING, "off": bits.OFF}
NUMBERED = tuple(MODES)
"""In a notice, modes are numbered from 1."""
SIGNALS = ("", "PV", "SV", "MV", "MOUT", "I_MV", "E")
"""Signals of a loop in the order of `Config.sig_in` and its followers; the measurement itself belongs to the plant."""
FLAG_BITS = {
    "mv_limited": bits.LIMITED,
    "in_dead_band": bits.SILENT,
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

ABOUT_MODE = {
    WAITS_FOR_TUNE: "waits: PID_MAN has no effect while PID_MODE is 1",
    WAITS_FOR_PLC: "waits: the PLC is stopped",
}
"""Reasons that concern a mode that was asked for."""
REASONS = {
    **dpide_autotune.REASONS,
    dpide_equation.JUMPS_HELD: "MV jumps at the end of manual: in PID_MODE 0 I_MV stays as it was before manual; "
    "PID_MODE 2 works it out of MV",
    dpide_equation.JUMPS_WITHOUT: "MV jumps at the end of manual: without Ti_Ki there is no I_MV that could carry MOUT",
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


def tell(s: bits.State, reason: int, mode: str = "") -> None:
    """Leave a notice for the log; ``mode``: the one that was asked for."""
    s.notice = noticed(s.notice, NUMBERED.index(mode) + 1 if mode else 0, reason)


def mode_name(status: int) -> str:
    """The mode that a status tells."""
    return next(name for name, bit in MODES.items() if status & bit)


def describe(notice: int) -> tuple[str, str]:
    """What happened in words: to the mode (what it waits for), and apart from it."""
    found = [reason for _, reason in notices(notice)]
    about = "; ".join(ABOUT_MODE[reason] for reason in found if reason in ABOUT_MODE)
    return about, "; ".join(REASONS[reason] for reason in found if reason not in ABOUT_MODE)


def requested(notice: int) -> str | None:
    """The mode that was asked for when the last notice was left; None: nobody asked for one."""
    asked = [mode for mode, _ in notices(notice) if mode]
    return NUMBERED[asked[-1] - 1] if asked else None
