"""What an EZLogix loop tells the outside: names of modes and flags as bits, and notices in words."""

from __future__ import annotations

from pidcfg.encoders.maps.ezlogix_meanings import CODES
from pidcfg.sim.controllers.ezlogix import autotune as ezlogix_autotune
from pidcfg.sim.controllers.ezlogix import state as bits
from pidcfg.sim.notices import noticed, notices

MODES = {"manual": bits.MANUAL, "auto": bits.AUTO}
SIGNALS = ("", "PV", "SP", "CV", "BIAS", "ERROR", "STATUS", "O")
"""Signals of a loop in the order of `Config.sig_in` and its followers; the measurement itself belongs to the plant."""
FLAG_BITS = {
    "saturation": bits.SATURATED,
    "autotune_running": bits.TUNING,
    "autotune_error": bits.TUNE_ERROR,
}

WAITS_FOR_RATE = 1
WAITS_FOR_RUN = 2
IS_STOPPED = 3
IS_BLIND = 4
IS_MUTE = 5
TUNE_RUNS = 6

REASONS = {
    WAITS_FOR_RATE: "waits: the loop is not calculated, its sample rate is below 0.05 s",
    WAITS_FOR_RUN: "waits: the PLC is stopped and the loop is not calculated",
    IS_STOPPED: "the PLC is stopped: the loop is not calculated, its outputs stay as they are",
    IS_BLIND: "the PLC is stopped: the loop goes on, but nothing renews its PV in an R register",
    IS_MUTE: "the PLC is stopped: the loop goes on, but nothing carries its CV from an R register to an output",
    TUNE_RUNS: "autotune is running already",
}
TUNE_STATUS = {code.number: code.title for code in CODES}
"""The manual's table of Base+12 in words."""


def tell(s: bits.State, reason: int, requested: int = 0) -> None:
    """Leave a notice for the log."""
    s.notice = noticed(s.notice, requested, reason)


def mode_name(status: int) -> str:
    """The mode that a status word tells."""
    return "auto" if status & bits.AUTO else "manual"


def in_words(reason: int) -> str:
    """A notice's reason."""
    status = reason - ezlogix_autotune.REASON
    return f"autotune: {TUNE_STATUS[status]} (status {status})" if status in TUNE_STATUS else REASONS[reason]


def describe(notice: int) -> tuple[str, str]:
    """What happened in words: to the mode, and apart from it."""
    found: tuple[list[str], list[str]] = [], []
    for asked, reason in notices(notice):
        found[0 if asked else 1].append(in_words(reason))
    return "; ".join(found[0]), "; ".join(found[1])


def requested(notice: int) -> str | None:
    """The mode that was asked for when the last notice was left; None: nobody asked for one."""
    asked = [mode for mode, _ in notices(notice) if mode]
    return mode_name(asked[-1]) if asked else None
