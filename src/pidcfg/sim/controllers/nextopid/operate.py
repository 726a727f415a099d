"""How a NextoPID program is operated and reported: its modes, and what ``set`` may write."""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence
from decimal import Decimal

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.schemas.base import parse_duration, parse_seconds
from pidcfg.schemas.numbers import refuse
from pidcfg.sim.controllers.nextopid import terms
from pidcfg.sim.controllers.nextopid.terms import (
    AUTO_TUNE,
    CASC,
    FLAGS,
    KP,
    TD_KD,
    TI_KI,
    TUNE_DONE,
    TUNE_ERROR,
    TUNE_FLAGS,
    Config,
    State,
)
from pidcfg.sim.controllers.nextopid.terms import MANUAL as PIDA_MANUAL
from pidcfg.sim.controllers.nextopid.terms import TUNE_RESULT as RESULT
from pidcfg.sim.controllers.settings import NamedKeys, Parser

# --- What an operator does to a loop's parameters, and what becomes of an auto-tuning (kernels) -----------------------

MANUAL_ON, MANUAL_OFF, CASC_ON, CASC_OFF, TUNE_ON, TUNE_OFF, ACCEPT = 1, 2, 4, 8, 16, 32, 64
"""Commands of the operator (`State.command`)."""
MANUAL, CASCADE, TUNE = (MANUAL_ON, MANUAL_OFF), (CASC_ON, CASC_OFF), (TUNE_ON, TUNE_OFF)
NO_RUN, RUNNING, DONE, FAILED, CANCELLED = range(5)
"""State of the last auto-tuning (`State.tune_end`)."""
ON_OFF_MANUAL = terms.PLACES["ControlON_OFF"]["Manual"]


def command(state: State, pair: tuple[int, int], *, on: bool) -> None:
    """A switch is to be written; of several commands before the next cycle the last one counts (D82)."""
    state.command = state.command & ~(pair[0] | pair[1]) | pair[not on]


def operate(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """Writes the parameters that the operator's commands change."""
    manual = config.base + (ON_OFF_MANUAL if config.kind == terms.ON_OFF else PIDA_MANUAL)
    if state.command & (MANUAL_ON | MANUAL_OFF):
        signals[manual] = 1.0 if state.command & MANUAL_ON else 0.0
    if state.command & (CASC_ON | CASC_OFF):
        signals[config.base + CASC] = 1.0 if state.command & CASC_ON else 0.0
    if state.command & ACCEPT:
        signals[config.base + KP] = signals[config.base + RESULT]
        signals[config.base + TI_KI] = signals[config.base + RESULT + 1]
        signals[config.base + TD_KD] = signals[config.base + RESULT + 2]
    if state.command & (TUNE_ON | TUNE_OFF):
        signals[config.base + AUTO_TUNE] = 1.0 if state.command & TUNE_ON else 0.0
    state.command = 0


def keep_results(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """Results for the report: the block clears its own when AutoTune goes off."""
    b = config.base
    if signals[b + AUTO_TUNE] == 0.0:
        if state.tune_end == RUNNING:
            state.tune_end = CANCELLED
    elif signals[b + TUNE_DONE] == 0.0:
        state.tune_end = RUNNING
    elif state.tune_end not in (DONE, FAILED):
        state.tune_end = FAILED if signals[b + TUNE_ERROR] != 0.0 else DONE
        state.result_kp = signals[b + RESULT]
        state.result_ti = signals[b + RESULT + 1]
        state.result_td = signals[b + RESULT + 2]
        state.result_flags = 0
        for i in range(FLAGS):
            if signals[b + TUNE_FLAGS + i] != 0.0:
                state.result_flags |= 1 << i


# --- How a NextoPID loop is reported: names of modes, bits and signals, and notices in words --------------------------

MODE_BITS = {
    "manual": terms.MANUAL_MODE,
    "auto": terms.AUTO_MODE,
    "cascade": terms.CASCADE_MODE,
    "tracking": terms.TRACKING_MODE,
    "autotune": terms.TUNING_MODE,
}
"""The first three can be requested; the others follow from inputs of the block."""
ROWS = [row.name for row in BLOCK_TYPES["PIDA_TUNE_REAL"].table.rows]
ERRORS = [name for name in ROWS if name.startswith("ErrBits.")]
WARNINGS = [name for name in ROWS if name.startswith("WarnBits.")]
FLAG_BITS = {name: terms.ERROR_BASE << i for i, name in enumerate(ERRORS)} | {"overridden": terms.OVERRIDDEN}
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

# --- What a scenario's ``set`` may write in a running program: parameters of loops, blocks, and signals ---------------

TIMES = ("Tfd", "DelayTime", "Tc", "Tlead", "Tlag")
TIMES_OR_GAINS = ("Ti_Ki", "Td_Kd")
"""Times in the dependent form, gains with Indep TRUE."""
SHORT = {"setpoint": "SP", "setpoint.value": "SP", "output": "ManualMV"}
WORDS = {"AutoTuneParam.Mode"}


def parse_tune_mode(value: object) -> str:
    """P, PI or PID."""
    if value not in {"P", "PI", "PID"}:
        refuse("set_value", f"{value!r} is not one of P, PI, PID")
    return f"AUTOTUNE_{value}"


def parse_gain(value: object) -> Decimal:
    """A gain of the independent form, which is no time (D202)."""
    duration = parse_duration(value)
    if duration.unit is not None:
        refuse(
            "set_value", f"{value} is a time, but with Indep TRUE it is a gain", help="write a number without a unit"
        )
    return duration.value


def keys_of(kind: str, name: str, wired: Mapping[str, str], *, independent: bool = False) -> NamedKeys:
    """The parameters of a block that can be set; ``wired``: those that are not, and what they are wired to.

    ``independent``: the program starts with Indep TRUE.
    """
    rows = {row.name: row for row in BLOCK_TYPES[kind].inputs}
    fixed = {row: f"the program wires {text} to {name}.{row}; set that" for row, text in wired.items()}
    if "PV" in rows:
        fixed.setdefault("PV", "the plant writes it; pv: is the event of a broken sensor")
    parsers: dict[str, Parser] = {**dict.fromkeys(TIMES, parse_seconds), **dict.fromkeys(WORDS, parse_tune_mode)}
    parsers |= dict.fromkeys(TIMES_OR_GAINS, parse_gain if independent else parse_seconds)
    short = {key: row for key, row in SHORT.items() if row in rows}
    return NamedKeys(rows, short, {}, fixed, parsers)
