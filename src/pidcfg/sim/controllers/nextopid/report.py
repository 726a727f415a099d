"""How a NextoPID loop is reported: names of modes, bits and signals, and notices in words."""

from __future__ import annotations

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.sim.controllers.nextopid import state as bits

MODES = {
    "manual": bits.MANUAL_MODE,
    "auto": bits.AUTO_MODE,
    "cascade": bits.CASCADE_MODE,
    "tracking": bits.TRACKING_MODE,
    "autotune": bits.TUNING_MODE,
}
"""The first three can be requested; the others follow from inputs of the block."""
ROWS = [row.name for row in BLOCK_TYPES["PIDA_TUNE_REAL"].table.rows]
ERRORS = [name for name in ROWS if name.startswith("ErrBits.")]
WARNINGS = [name for name in ROWS if name.startswith("WarnBits.")]
FLAG_BITS = {name: bits.ERROR_BASE << i for i, name in enumerate(ERRORS)} | {"overridden": bits.OVERRIDDEN}
AUX_BITS = {name: 1 << i for i, name in enumerate(WARNINGS)}
RESULT_FLAGS = [name.removeprefix("AutoTuneResult.") for name in ROWS[ROWS.index("AutoTuneResult.Bad_PercAmpMV") :]]

IS_WIRED = 1
"""Reasons of notices; one for each of the three requests that a wire prevents."""
CASC_IS_WIRED = 2
TUNE_IS_WIRED = 3
NO_TUNE = 4
NO_CASCADE = 5
NOTHING_TO_ACCEPT = 6
COMES_ABOUT = 7

REASONS = {
    IS_WIRED: "Manual is wired in the program; set what it is wired to",
    CASC_IS_WIRED: "CASC is wired in the program; set what it is wired to",
    TUNE_IS_WIRED: "AutoTune is wired in the program; set what it is wired to",
    NO_TUNE: "this block has no auto-tuning; use PIDA_TUNE_REAL or PIDA_TUNE_INT",
    NO_CASCADE: "ControlON_OFF has no cascade mode",
    COMES_ABOUT: "this mode comes about by itself; ask for manual, auto or cascade, or for autotune: start",
    NOTHING_TO_ACCEPT: "there are no results without error to accept",
}

TUNE_STATUS = ("idle", "running", "done", "failed", "cancelled")
