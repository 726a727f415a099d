"""How a CLICK loop is operated and reported: its modes, and what ``set`` may write."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from typing import Any, cast

from pidcfg.encoders.maps.click import ERRORS, TABLES, error_text
from pidcfg.encoders.regmap import Point, Word
from pidcfg.schemas.base import Quantity, Rate, parse_seconds
from pidcfg.schemas.click import parse_sample_rate, parse_unit_rate
from pidcfg.schemas.numbers import parse_integer, parse_number, refuse
from pidcfg.sim.controllers.click import equation as bits
from pidcfg.sim.controllers.click.equation import (
    AUTO,
    FRESH,
    GOAL,
    MANUAL,
    MODES,
    REFUSED_TUNE_MODE,
    REFUSED_TUNE_RANGE,
    REQUEST,
    TUNE_ABORTED,
    TUNE_CANCELLED,
    TUNE_ERROR,
    TUNE_IDLE,
    TUNING,
    Config,
    State,
    abandon,
    start_tune,
    tunable,
)
from pidcfg.sim.controllers.kernels import GOAL_ENDS, tell_request
from pidcfg.sim.controllers.settings import Keys, items_of, rows_of

# --- Mode requests of a CLICK loop: what is granted, refused or overridden, and the bumpless transfer (D119) ----------
#
# Manual is entered from everywhere, Auto from Manual only, Autotune from Auto only; a PID error forces Manual and
# refuses Auto (D118). `REASONS` gives the text of each refusal; kernels leave its number in `State.notice`.

REFUSED_STOP = 1
REFUSED_TUNING = 2
OVERRIDE_STOP = 3
CLEARED = 4
GIVEN_UP = 5
REFUSED_ERROR = 100
OVERRIDE_ERROR = 200
NOTED_ERROR = 300
"""To these the row of the PID error is added."""

MODE_REASONS = {
    REFUSED_STOP: "refused: the PLC is in STOP mode",
    REFUSED_TUNING: "refused: Auto is entered from Manual; clearing the autotune request ends an autotune",
    OVERRIDE_STOP: "to Manual: the PLC went to STOP mode",
    CLEARED: "no PID error any more",
    GIVEN_UP: GOAL_ENDS,
}
MODE_NOTICES = {REFUSED_STOP, REFUSED_TUNING, OVERRIDE_STOP}
"""Reasons that concern the mode."""


def stop_tune(state: State) -> None:
    """A mode other than Auto ends an autotune without results."""
    if state.status & TUNING:
        abandon(state)
        state.status |= TUNE_ERROR
        state.requested = 0
        tell_request(state, TUNE_ABORTED)


def to_manual(state: State, reason: int) -> None:
    """Force a loop into Manual, its output as it stands."""
    if state.status & MANUAL == 0:
        stop_tune(state)
        state.status = (state.status & ~MODES) | MANUAL
        state.requested = 0
        tell_request(state, reason)


def to_auto(config: Config, state: State) -> None:
    """Manual to Auto: the bias becomes the output, and in mode 1 the set point the PV."""
    state.bias = state.out
    if config.bumpless == 1:
        state.sp = state.pv
    state.pending |= FRESH
    state.status = (state.status & ~MODES) | AUTO


def tune_refusal(config: Config, state: State) -> int:
    """Why an autotune cannot start: it needs Auto and PV limits (D123); 0: it can."""
    if state.status & AUTO == 0:
        return REFUSED_TUNE_MODE
    return 0 if tunable(config) else REFUSED_TUNE_RANGE


def request_mode(config: Config, state: State, wanted: int) -> int:
    """Request a mode: it is entered, or the reason of the refusal is returned."""
    state.requested = wanted
    now = state.status & MODES
    if now == wanted:
        return 0
    if wanted == MANUAL:
        stop_tune(state)
        state.status = (state.status & ~MODES) | MANUAL
        return 0
    if wanted == AUTO:
        if now == TUNING:
            return REFUSED_TUNING
        if state.error:
            return REFUSED_ERROR + state.error
        to_auto(config, state)
        return 0
    reason = tune_refusal(config, state)
    if reason:
        state.status |= TUNE_ERROR
    else:
        start_tune(state)
    return reason


def cancel(state: State) -> None:
    """The autotune request is cleared: back to Auto with the registers as they were."""
    state.request &= ~TUNING
    state.requested = 0
    if state.status & TUNING:
        abandon(state)
        state.status = (state.status & ~MODES) | AUTO
        tell_request(state, TUNE_CANCELLED)
    else:
        tell_request(state, TUNE_IDLE)


def approach_goal(config: Config, state: State) -> None:
    """Come one step closer to the goal; at the goal write its set point, as an operator would."""
    if state.status & MODES == state.goal:
        if state.goal_writes:
            state.sp = state.goal_sp
        state.pending &= ~GOAL
        state.goal = 0
        return
    reason = request_mode(config, state, state.goal)
    if reason and (state.refused >> state.error) & 1 == 0:
        state.refused |= 1 << state.error
        tell_request(state, reason)


def update_mode(config: Config, state: State) -> None:
    """Everything that can change the mode at a sample: requests, of which Autotune's comes last, or the goal (D673)."""
    if state.pending & REQUEST:
        state.pending &= ~(REQUEST | GOAL)
        state.goal = 0
        for bit in (state.request & (MANUAL | AUTO), state.request & TUNING):
            reason = request_mode(config, state, bit) if bit else 0
            if reason:
                tell_request(state, reason)
        state.request = 0
    elif state.pending & GOAL:
        approach_goal(config, state)


# --- What a CLICK loop tells the outside: names of modes, alarms and flags as bits, and notices in words --------------

MODE_BITS = {"manual": bits.MANUAL, "auto": bits.AUTO, "autotune": bits.TUNING}
SIGNALS = {
    "in_slot": "",
    "pv_slot": "PV",
    "sp_slot": "SP",
    "out_slot": "CO",
    "bias_slot": "BIAS",
    "error_slot": "ERROR",
    "pwm_slot": "PWM",
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

REASONS = MODE_REASONS | bits.REASONS
ABOUT_MODE = set(MODE_NOTICES)
for _row, _error in enumerate(ERRORS, start=1):
    _text = error_text(_error)
    REASONS[REFUSED_ERROR + _row] = f"refused: {_text}"
    REASONS[OVERRIDE_ERROR + _row] = f"to Manual: {_text}"
    REASONS[NOTED_ERROR + _row] = _text
    ABOUT_MODE |= {REFUSED_ERROR + _row, OVERRIDE_ERROR + _row}

# --- What a scenario's ``set`` may write in a CLICK loop: a key of the configuration to its register ------------------
#
# Keys are those of a loop in the configuration file (``tuning.reset_time``, ``alarms.pv.high``). Short forms:
# ``setpoint``, ``output`` and ``bias`` with a number, and the last part of a key where only one register has it.

SHORT = {"setpoint": "setpoint.value", "output": "state.output", "bias": "state.bias"}
EVENTS = {"mode": "mode", "autotune": "autotune"}
"""Keys that have an event instead, and the key of that event."""
FIXED = {"state.raw_pv", "state.pv"}
"""What only the controller writes."""


def parse_plain(value: object) -> Decimal:
    """A number in the unit of its register; a PLC with floats has no counts."""
    if isinstance(value, Quantity):
        if value.counts:
            refuse("number_form", f"{value} is in counts, but the register holds a number in its own unit")
        return value.value
    return parse_number(value)


PARSERS: dict[str, Callable[[object], object]] = {
    "sample_rate": parse_sample_rate,
    "tuning.reset_time": parse_seconds,
    "tuning.derivative_gain": parse_seconds,
    "output.pwm.period": parse_seconds,
    "pv.filter": parse_integer,
    "derivative_gain_limit": parse_integer,
    "alarms.rate_of_change": parse_unit_rate,
}
KEYS = Keys(rows_of(TABLES, FIXED), SHORT, EVENTS, PARSERS, lambda _word: parse_plain)


def encode_setting(row: Point, value: Any, sample_rate: Decimal) -> int:
    """A parsed value to the bits of its register; ``sample_rate`` is the present one in s."""
    if isinstance(value, Rate):
        value = value.per_sample(sample_rate).value
    return row.encode(value)


def check_setting(path: tuple[str, ...], value: object, sample_rate: Decimal) -> object:
    """The value of a key as its registers take it; a ``PydanticCustomError`` says what is wrong."""
    return KEYS.check(path, value, lambda row, item: encode_setting(row, item, sample_rate))


def settings_of(path: tuple[str, ...], value: Any, sample_rate: Decimal) -> list[tuple[Word, int]]:
    """The registers behind a key, and the bits that a checked value makes in each."""
    items = items_of(KEYS.find(path), value)
    return [(cast("Word", row), encode_setting(row, item, sample_rate)) for row, item in items]
