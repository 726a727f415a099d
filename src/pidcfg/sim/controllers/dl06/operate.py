"""How a DL06 loop is operated and reported: its modes, ramp/soak, and what ``set`` may write."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from decimal import Decimal
from functools import cache
from math import sqrt
from typing import Any

from pidcfg.encoders.codecs import Bcd, Scale
from pidcfg.encoders.maps.dl06 import LOOP_TABLES, RESET
from pidcfg.encoders.regmap import Point, Word
from pidcfg.schemas.base import Rate, parse_quantity, parse_rate, parse_seconds, parse_text, parse_v_address
from pidcfg.schemas.dl06 import Reset, parse_reset
from pidcfg.schemas.numbers import parse_number
from pidcfg.sim.controllers.dl06 import autotune as dl06_tune_results
from pidcfg.sim.controllers.dl06 import equation as bits
from pidcfg.sim.controllers.dl06.autotune import stop_tune
from pidcfg.sim.controllers.dl06.equation import (
    ALARM_ERROR,
    AUTO,
    CASCADE,
    GOAL,
    MANUAL,
    MODES,
    NO_PAST,
    OVERFLOW,
    PROGRAM,
    REQUEST,
    RESTORE,
    RS_COMPLETE,
    RS_DEVIATION,
    RS_HELD,
    RS_HOLD,
    RS_JOG,
    RS_RESUME,
    RS_START,
    RS_STEP,
    SOAK,
    TRIP,
    Config,
    State,
    active_pv_alarms,
    renew_pv_alarms,
)
from pidcfg.sim.controllers.kernels import GOAL_ENDED, ROUNDING_MAGIC, step_to, tell_request
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.controllers.settings import Keys, check_fit, rows_of

# --- Mode requests of a DL06 loop: what is granted, refused or overridden, and the bumpless transfers -----------------
#
# A request moves one step along manual - auto - cascade. `REASONS` gives the text of each refusal and override;
# kernels leave its number in `State.notice`.

REFUSED_PROGRAM = 1
REFUSED_OFF = 2
REFUSED_STEP = 3
REFUSED_MINOR = 4
REFUSED_ALARM_ERROR = 5
REFUSED_PV_ALARM = 6
REFUSED_NO_REMOTE = 7
LAST_REFUSAL = REFUSED_NO_REMOTE
"""Refusals concern a mode only when one was requested; overrides always do."""
OVERRIDE_ALARM_ERROR = 10
OVERRIDE_OVERFLOW = 11
OVERRIDE_MINOR = 12
OVERRIDE_PROGRAM = 13
RESTORED = 14
OVERRIDE_NO_REMOTE = 15
GIVEN_UP = 16
"""The configured mode and set point (D643); it is not about the mode that is requested, and not in `REASONS`."""

MODE_REASONS = {
    REFUSED_PROGRAM: "refused: the CPU is in Program mode and the loop is not independent of it",
    REFUSED_OFF: "refused: the loop is not calculated",
    REFUSED_STEP: "refused: a loop cannot go from Manual to Cascade or back without Auto in between",
    REFUSED_MINOR: "refused: the minor loop is not in Cascade",
    REFUSED_ALARM_ERROR: "refused: alarm programming error (+06 bit 10)",
    REFUSED_PV_ALARM: "refused: a PV alarm is active",
    REFUSED_NO_REMOTE: "refused: the remote set point pointer (+32) names no control output of the loop table",
    OVERRIDE_ALARM_ERROR: "to Manual: alarm programming error (+06 bit 10)",
    OVERRIDE_OVERFLOW: "to Manual: calculation overflow (+06 bit 11)",
    OVERRIDE_MINOR: "to Manual: the minor loop left Cascade",
    OVERRIDE_PROGRAM: "to Manual: the CPU went to Program mode",
    RESTORED: "back to the mode before Program mode",
    OVERRIDE_NO_REMOTE: "to Manual: the remote set point pointer (+32) names no control output any more",
}


def on_sp_scale(config: Config, pv: float) -> float:
    """The set point word that equals a PV word."""
    if config.square_root == 0:
        return pv
    return sqrt(pv) + ROUNDING_MAGIC - ROUNDING_MAGIC if pv > 0.0 else 0.0


def to_manual(i: int, configs: list[Config], states: list[State], reason: int) -> None:
    """Put a loop into Manual, and with it each major loop whose minor thereby leaves Cascade."""
    while i >= 0:
        state = states[i]
        if state.status & MANUAL:
            return
        major = configs[i].major if state.status & CASCADE else -1
        stop_tune(state)
        state.status = (state.status & ~MODES) | MANUAL
        state.requested_mode = 0
        tell_request(state, reason)
        i = major
        reason = OVERRIDE_MINOR


def transfer_mode(i: int, wanted: int, configs: list[Config], states: list[State]) -> None:
    """Carry out a granted change of mode with its bumpless transfer.

    Type I: manual to auto makes the bias the output and SP the PV, auto to cascade makes the major loop's output this
    loop's PV. Type II only makes the bias the output. The velocity form has no bias (D41). Cascade to auto changes
    nothing but the source of the set point (D646).
    """
    config, state = configs[i], states[i]
    now = state.status & MODES
    stop_tune(state)
    if wanted == MANUAL:
        state.status = (state.status & ~MODES) | MANUAL
        return
    if wanted == AUTO and now == MANUAL:
        state.unrounded_output = state.out
        if config.velocity == 0:
            state.bias = state.out
        if config.bumpless == 1:
            state.sp = on_sp_scale(config, state.pv)
        state.status &= ~OVERFLOW
        state.pending |= NO_PAST
    if wanted == AUTO and now == CASCADE and config.major >= 0:
        to_manual(config.major, configs, states, OVERRIDE_MINOR)
    if wanted == CASCADE and config.bumpless == 1 and config.major >= 0:
        states[config.major].out = on_sp_scale(config, state.pv)
    state.status = (state.status & ~MODES) | wanted


def refusal_reason(i: int, wanted: int, configs: list[Config], states: list[State]) -> int:
    """Why a requested mode is refused, by alarms (D43) or in a cascade (D44); 0: it is granted."""
    config, state = configs[i], states[i]
    now = state.status & MODES
    if now | wanted == MANUAL | CASCADE:
        return REFUSED_STEP
    if wanted == CASCADE and config.major < 0:
        return REFUSED_NO_REMOTE
    if now != MANUAL or wanted != AUTO:
        return 0
    if state.status & ALARM_ERROR:
        return REFUSED_ALARM_ERROR
    if config.interlock and active_pv_alarms(state):
        return REFUSED_PV_ALARM
    for j in range(len(configs)):
        if configs[j].major == i and states[j].status & CASCADE == 0:
            return REFUSED_MINOR
    return 0


def request_mode(i: int, wanted: int, configs: list[Config], states: list[State]) -> int:
    """Request a mode: it is entered, or the reason of the refusal is returned."""
    state = states[i]
    state.requested_mode = wanted
    if state.status & MODES == wanted:
        return 0
    reason = refusal_reason(i, wanted, configs, states)
    if reason == 0:
        transfer_mode(i, wanted, configs, states)
    return reason


def waits_for_minor(i: int, configs: list[Config], states: list[State]) -> bool:
    """Whether a minor loop of this one is still on its way to Cascade, unrefused: the order is inside out (D644)."""
    for j in range(len(configs)):
        state = states[j]
        minor = configs[j].major == i and configs[j].halt == 0
        if minor and state.goal == CASCADE and state.refused_reasons == 0 and state.status & CASCADE == 0:
            return True
    return False


def approach_goal(i: int, configs: list[Config], states: list[State]) -> None:
    """Come one step closer to the goal; at the goal write its set point, as an operator would (D45, D643)."""
    state = states[i]
    now = state.status & MODES
    if now == state.goal:
        if state.goal_has_sp:
            state.sp = state.goal_sp
        state.pending &= ~GOAL
        state.goal = 0
        return
    wanted = state.goal if now == AUTO else AUTO
    if now == MANUAL and waits_for_minor(i, configs, states):
        return
    reason = request_mode(i, wanted, configs, states)
    if reason and (state.refused_reasons >> reason) & 1 == 0:
        state.refused_reasons |= 1 << reason
        tell_request(state, reason)


def restore_mode(i: int, configs: list[Config], states: list[State]) -> None:
    """Return to the mode before Program mode; the CPU forces it, so nothing refuses."""
    state = states[i]
    state.pending &= ~RESTORE
    state.requested_mode = 0
    if state.status & MODES == state.prior_mode:
        return
    if state.status & ALARM_ERROR:
        state.requested_mode = state.prior_mode
        tell_request(state, REFUSED_ALARM_ERROR)
        return
    transfer_mode(i, AUTO, configs, states)
    if state.prior_mode == CASCADE and configs[i].major < 0:
        state.requested_mode = CASCADE
        tell_request(state, REFUSED_NO_REMOTE)
        return
    if state.prior_mode == CASCADE:
        transfer_mode(i, CASCADE, configs, states)
    tell_request(state, RESTORED)


def update_mode(i: int, configs: list[Config], states: list[State]) -> None:
    """Everything that can change the mode in one sample: override, restoring, request, goal."""
    state = states[i]
    if state.pending & TRIP:
        state.pending &= ~TRIP
        to_manual(i, configs, states, OVERRIDE_ALARM_ERROR)
    if state.pending & RESTORE:
        restore_mode(i, configs, states)
    if state.pending & (REQUEST | GOAL):
        renew_pv_alarms(configs[i], state, state.pv)
    if state.pending & REQUEST:
        state.pending &= ~(REQUEST | GOAL)
        state.goal = 0
        reason = request_mode(i, state.request, configs, states)
        state.request = 0
        if reason:
            tell_request(state, reason)
    if state.pending & GOAL:
        approach_goal(i, configs, states)


# --- The ramp/soak generator of a DL06 loop: it writes the set point word, sample by sample ---------------------------
#
# A segment begins and ends at a sample. A ramp moves the set point by its slope each second until its end value
# stands, a soak then lasts its minutes. A slope of 0 and the end of the table complete the profile. The set point
# with its fraction is `State.rs_sp`; only its rounded value is a word.

STEPS = 16
PAIR_SIZE = 4
"""Floats of a pair in `aux`: target, slope a second, seconds to soak, allowed deviation (0: any)."""

REFUSED_RS_OFF = 20
REFUSED_RS_CASCADE = 21
REFUSED_RS_TABLE = 22
REFUSED_RS_PROGRAM = 23
REFUSED_RS_IDLE = 24
HELD_BY_CASCADE = 25

RAMP_SOAK_REASONS = {
    REFUSED_RS_OFF: "ramp/soak refused: not enabled (+00 bit 11)",
    REFUSED_RS_CASCADE: "ramp/soak refused: the loop is in Cascade",
    REFUSED_RS_TABLE: "ramp/soak refused: the table is not in user memory (+35)",
    REFUSED_RS_PROGRAM: "ramp/soak refused: the CPU is in Program mode",
    REFUSED_RS_IDLE: "ramp/soak refused: no profile is running",
    HELD_BY_CASCADE: "ramp/soak held: the loop went to Cascade",
}


def end_profile(state: State, flags: int) -> None:
    """The generator stops; the step byte returns to 0."""
    state.rs_step = 0
    state.aux_status = flags
    state.pending &= ~SOAK


def begin_step(config: Config, state: State, aux: list[float], step: int) -> None:
    """Enter a step; the profile ends behind step 16 and at a slope of 0 (D55)."""
    if step > STEPS or (step % 2 == 1 and aux[config.rs_table + (step - 1) // 2 * PAIR_SIZE + 1] <= 0.0):
        end_profile(state, RS_COMPLETE)
        return
    state.rs_step = step
    if step % 2 == 0:
        state.rs_ticks_left = aux[config.rs_table + (step - 1) // 2 * PAIR_SIZE + 2] * TICKS
    state.aux_status = (state.aux_status & RS_HELD) | step * RS_STEP


def start_profile(config: Config, state: State, aux: list[float]) -> None:
    """A rising start bit: the first ramp begins at the present set point, and moves at the next sample (D652)."""
    state.rs_error = config.rs_fault
    state.rs_errors |= config.rs_fault
    if config.rs_fault or config.rs_table < 0:
        tell_request(state, REFUSED_RS_TABLE)
        end_profile(state, 0)
        return
    state.aux_status = 0
    state.rs_sp = state.sp
    begin_step(config, state, aux, 1)


def execute_command(config: Config, state: State, aux: list[float]) -> None:
    """Read and clear the command bits; start works alone, hold comes before resume and jog (D56, D653)."""
    command = state.rs_command
    state.rs_command = 0
    if state.pending & PROGRAM:
        tell_request(state, REFUSED_RS_PROGRAM)
    elif state.status & CASCADE:
        tell_request(state, REFUSED_RS_CASCADE)
    elif command == RS_START:
        start_profile(config, state, aux)
    elif state.rs_step == 0:
        tell_request(state, REFUSED_RS_IDLE)
    elif command & RS_HOLD:
        state.aux_status |= RS_HELD
    elif command & RS_RESUME:
        state.aux_status &= ~RS_HELD
        # the set point goes on with its fraction, unless somebody has written the word meanwhile
        if state.rs_sp + ROUNDING_MAGIC - ROUNDING_MAGIC != state.sp:
            state.rs_sp = state.sp
    elif command & RS_JOG:
        begin_step(config, state, aux, state.rs_step + 1)


def advance_step(config: Config, state: State, aux: list[float]) -> None:
    """One sample of the step that is active."""
    pair = config.rs_table + (state.rs_step - 1) // 2 * PAIR_SIZE
    if state.rs_step % 2 == 1:
        target = aux[pair]
        state.rs_sp = step_to(state.rs_sp, target, aux[pair + 1] * (state.period / TICKS))
        state.sp = state.rs_sp + ROUNDING_MAGIC - ROUNDING_MAGIC
        if state.rs_sp == target:
            begin_step(config, state, aux, state.rs_step + 1)
        return
    state.rs_ticks_left -= state.period
    if state.rs_ticks_left < 0.5 * state.period:
        begin_step(config, state, aux, state.rs_step + 1)


def check_deviation(config: Config, state: State, aux: list[float]) -> None:
    """Renew the soak deviation bit; it is on only while a soak sees the PV too far from the set point."""
    state.aux_status &= ~RS_DEVIATION
    if state.rs_step and state.rs_step % 2 == 0:
        allowed = aux[config.rs_table + (state.rs_step - 1) // 2 * PAIR_SIZE + 3]
        if allowed > 0.0 and abs(state.sp - on_sp_scale(config, state.pv)) > allowed:
            state.aux_status |= RS_DEVIATION


def ramp_soak(config: Config, state: State, aux: list[float], signals: list[float]) -> None:
    """Commands first, then the active step (D676), then its deviation bit; the step number is a signal."""
    advance_profile(config, state, aux)
    signals[config.step_slot] = state.rs_step * 1.0


def advance_profile(config: Config, state: State, aux: list[float]) -> None:
    """One sample of the generator."""
    if config.rs_enabled == 0:
        if state.rs_command:
            tell_request(state, REFUSED_RS_OFF)
        state.rs_command = 0
        end_profile(state, state.aux_status & RS_COMPLETE)
        return
    active_step = state.rs_step
    if state.rs_command:
        started = state.rs_command == RS_START
        execute_command(config, state, aux)
        if active_step == 0 or state.rs_step != active_step or started:
            active_step = 0
    if active_step and state.status & CASCADE and state.aux_status & RS_HELD == 0:
        state.aux_status |= RS_HELD
        tell_request(state, HELD_BY_CASCADE)
    if active_step and state.aux_status & RS_HELD == 0 and state.pending & PROGRAM == 0:
        advance_step(config, state, aux)
    if state.rs_step == 0:
        state.pending &= ~SOAK
    else:
        check_deviation(config, state, aux)


# --- How a DL06 loop is reported: names of modes, alarms and flags as bits, and notices in words ----------------------

MODE_BITS = {"manual": bits.MANUAL, "auto": bits.AUTO, "cascade": bits.CASCADE}
COMMANDS = {"start": bits.RS_START, "hold": bits.RS_HOLD, "resume": bits.RS_RESUME, "jog": bits.RS_JOG}
REASONS = MODE_REASONS | RAMP_SOAK_REASONS | dl06_tune_results.REASONS | {GIVEN_UP: GOAL_ENDED}
SIGNALS = {
    "in_slot": "",
    "pv_slot": "PV",
    "sp_slot": "SP",
    "out_slot": "OUT",
    "bias_slot": "BIAS",
    "step_slot": "STEP",
}
"""Signals of a loop by their slots in `Config`; the measurement itself belongs to the plant."""
ALARM_BITS = {
    "pv_low_low": bits.LOW_LOW,
    "pv_low": bits.LOW,
    "pv_high": bits.HIGH,
    "pv_high_high": bits.HIGH_HIGH,
    "deviation_yellow": bits.YELLOW,
    "deviation_red": bits.RED,
    "rate_of_change": bits.RATE_OF_CHANGE,
}
ALARM_LIMITS = {
    "pv_low_low": "low_low",
    "pv_low": "low",
    "pv_high": "high",
    "pv_high_high": "high_high",
    "deviation_yellow": "yellow",
    "deviation_red": "red",
    "rate_of_change": "rate_of_change",
}
"""Where `Config` has the limit of each."""
OUTER_ALARMS = ("pv_low_low", "pv_high_high", "deviation_red")
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

# ----------------------------------------------------------------------------------------------------------------------
# What a scenario's ``set`` may write: a key of the configuration to its register, by the register map's own codecs.
# Keys are those of a loop in the configuration file (``tuning.gain``, ``alarms.pv.high``). Short forms: ``setpoint``,
# ``output`` and ``bias`` with a number, and the last part of a key where only one register has it (``gain``).

SHORT_FORMS = {"setpoint": "setpoint.value", "output": "state.output", "bias": "state.bias"}
EVENT_KEYS = {"mode": "mode", "autotune": "autotune", "autotune.start": "autotune", "ramp_soak.request": "ramp_soak"}
"""Keys that have an event instead, and the key of that event."""
UNSETTABLE_FIELDS = {"pv.transfer", "output.transfer", "state.pv"}
"""Cannot be set in a running loop: wiring, and the word that the analog input overwrites."""
CASCADE_FROM = "cascade_from"

PARSERS: Mapping[str, Callable[[object], object]] = {
    "tuning.reset": parse_reset,
    "tuning.rate": parse_seconds,
    "sample_rate": parse_seconds,
    "alarms.rate_of_change": parse_rate,
    "remote_setpoint": parse_v_address,
    "ramp_soak.table": parse_v_address,
}

Scales = Mapping[str, Scale]


@cache
def settable_keys(reset_decimals: int) -> Keys:
    """What can be set in a loop whose reset word has so many decimals."""
    rows = rows_of([LOOP_TABLES[reset_decimals]], UNSETTABLE_FIELDS | set(EVENT_KEYS))
    return Keys(rows, SHORT_FORMS, EVENT_KEYS, PARSERS, parser_of)


def parser_of(word: Word) -> Callable[[object], object]:
    """How the value of a register is written that is not in `PARSERS`."""
    return parse_number if isinstance(word.codec, Bcd) else parse_quantity


def find_rows(path: tuple[str, ...], reset_decimals: int = 1) -> list[Point]:
    """The registers behind a key: one, or both ends of a pair of limits."""
    return settable_keys(reset_decimals).find(("remote_setpoint",) if path == (CASCADE_FROM,) else path)


def parse_setting(path: tuple[str, ...], rows: list[Point], value: object) -> object:
    """The value of a key as its registers take it; every number of decimals is written alike."""
    return parse_text(value) if path == (CASCADE_FROM,) else settable_keys(1).parse(rows, value)


def encode_setting(row: Point, value: Any, values: Mapping[str, Any], scales: Scales) -> int:
    """A parsed value to its word, or to its bits in place; `EncodeError` when the word cannot hold it.

    Raw counts are the content of the word, of a root loop's set point too (D651).
    """
    if isinstance(value, Reset):
        if value.is_9999:
            return RESET[1].encode(RESET[1].high)
        value = reset_digits(value, str(values["tuning.reset_unit"]))
    elif isinstance(value, Rate):
        value = value.per_sample(values["sample_rate"])
    return row.encode(value, scales)


def reset_digits(reset: Reset, unit: str) -> Decimal:
    """A reset time in the unit of its word; 0 when it is off."""
    if reset.duration is None:
        return Decimal(0)
    if reset.duration.unit is None:
        return reset.duration.value
    return reset.duration.seconds() / (60 if unit == "minutes" else 1)


def stored_rate(row: Point, value: Any) -> Decimal:
    """A sample rate as its word holds it, in s."""
    word = encode_setting(row, value, {}, {})
    return Decimal(row.decode(word))


def refuse_misfit(rows: list[Point], value: Any, values: Mapping[str, Any], scales: Scales) -> None:
    """Refuses a value that its word cannot hold."""
    check_fit(rows, value, lambda row, item: encode_setting(row, item, values, scales))
