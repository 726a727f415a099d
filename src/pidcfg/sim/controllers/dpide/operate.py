"""How a DPIDE instruction is operated and reported: its modes, and what ``set`` may write."""

from __future__ import annotations

from decimal import Decimal

from pidcfg.encoders.maps.dpide import TABLES
from pidcfg.encoders.parameters import Content
from pidcfg.schemas.dpide import parse_milliseconds, parse_time
from pidcfg.schemas.iec import Timed
from pidcfg.schemas.numbers import parse_integer, refuse
from pidcfg.sim.controllers.dpide import autotune as dpide_autotune
from pidcfg.sim.controllers.dpide import equation as bits
from pidcfg.sim.controllers.dpide import equation as dpide_equation
from pidcfg.sim.controllers.dpide.autotune import abandon, start_tune
from pidcfg.sim.controllers.dpide.equation import (
    AUTO,
    FRESH,
    FROM_MANUAL,
    HALTING,
    IN_DEAD_BAND,
    LIMITED,
    MANUAL,
    MODES,
    OFF,
    REQUEST,
    TUNING,
    Config,
    State,
)
from pidcfg.sim.controllers.settings import NamedKeys, parameters_of, parse_plain

# --- The four modes of a DPIDE instruction, as PID_RUN, PID_MODE and PID_MAN make them (D275) -------------------------


def enter_mode(config: Config, state: State, mode: int) -> None:
    """The mode, and what the next calculation has to know of the one before (kernel)."""
    before = state.status & MODES
    state.status = (state.status & ~MODES) | mode
    if before == OFF:
        state.error_sign = 0.0
        state.sv_crossed = 0
    if mode == TUNING:
        start_tune(config, state)
    elif mode == AUTO:
        state.pending |= FRESH
        if before == MANUAL:
            state.pending |= FROM_MANUAL


def stop_block(config: Config, state: State) -> None:
    """PID_RUN is FALSE: MV is 0, and nothing else is written (D273, D688; kernel)."""
    if state.status & TUNING:
        abandon(state)
        state.mode = state.previous_mode
    state.pending &= ~(REQUEST | HALTING)
    state.status = (state.status & ~(MODES | LIMITED | IN_DEAD_BAND)) | OFF
    state.out = 0.0
    if config.mout_is_mv:
        state.mout = 0.0


def switch_mode(config: Config, state: State) -> None:
    """The mode that the operands make takes effect (kernel)."""
    state.pending &= ~(REQUEST | FROM_MANUAL)
    if state.status & TUNING:
        abandon(state)
    enter_mode(config, state, state.wanted_mode)


# --- How a DPIDE instruction is reported: names of modes and flags as bits, and notices in words ----------------------

MODE_BITS = {"manual": bits.MANUAL, "auto": bits.AUTO, "autotune": bits.TUNING, "off": bits.OFF}
SIGNALS = {
    "in_slot": "",
    "pv_slot": "PV",
    "sp_slot": "SV",
    "out_slot": "MV",
    "mout_slot": "MOUT",
    "bias_slot": "I_MV",
    "error_slot": "E",
}
"""Signals of a loop by their slots in `Config`; the measurement itself belongs to the plant."""
FLAG_BITS = {
    "mv_limited": bits.LIMITED,
    "in_dead_band": bits.IN_DEAD_BAND,
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

ABOUT_MODE = (WAITS_FOR_TUNE, WAITS_FOR_PLC)
"""Reasons that concern a requested mode."""
REASONS = {
    **dpide_autotune.REASONS,
    dpide_equation.JUMPS_WITHOUT: "MV jumps at the end of manual: without Ti_Ki there is no I_MV that could carry MOUT",
    WAITS_FOR_TUNE: "waits: PID_MAN has no effect while PID_MODE is 1",
    WAITS_FOR_PLC: "waits: the PLC is stopped",
    TUNE_WAITS: "autotune waits: PID_RUN is FALSE",
    TUNE_WAITS_FOR_PLC: "autotune waits: the PLC is stopped",
    TUNE_RUNS: "autotune is running already",
    TUNE_IDLE: "no autotune to be cancelled",
    IS_STOPPED: "the PLC is stopped: the instruction is not executed, MV stays as it is",
}

# --- What a scenario's ``set`` may write in a running DPIDE instruction: its operands, by their names -----------------
#
# Short forms: ``setpoint`` is SV, ``output`` is MOUT.

PID_MODES = (0, 1, 2)
FIXED = {
    "PV": "it comes from the plant",
    "MV": "the PLC writes it; MOUT does so in manual",
}
"""Operands that cannot be set, and why."""


def parse_mode(value: object) -> int:
    """0, 1 or 2."""
    mode = parse_integer(value)
    if mode not in PID_MODES:
        refuse("choice", f"{mode} is none of {', '.join(map(str, PID_MODES))}")
    return mode


def parse_seconds_in(value: object) -> Decimal:
    """A time in s or a gain, as the configuration has it; `Timed` is a number."""
    return parse_time(value) if isinstance(value, str) else parse_plain(value)


class Seconds(float):
    """A time that was written with a unit, where the other form of the equation wants a gain."""


def with_mark(name: str, value: object, content: Content) -> Content:
    """The content of an operand, marked where its value can be nothing but a time."""
    is_time = name in {"Ti_Ki", "Td_Kd"} and isinstance(value, str) and isinstance(parse_time(value), Timed)
    return Seconds(content) if is_time else content


KEYS = NamedKeys(
    parameters_of(TABLES, FIXED),
    {"setpoint": "SV", "setpoint.value": "SV", "output": "MOUT"},
    {"mode": "mode", "autotune": "autotune"},
    FIXED,
    {
        "PID_MODE": parse_mode,
        "CYCLE": parse_milliseconds,
        "Ti_Ki": parse_seconds_in,
        "Td_Kd": parse_seconds_in,
        "Tf": parse_seconds_in,
    },
)
