"""What a DL06 loop knows and calculates: its records, the equation in both forms, and the process alarms."""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import sqrt
from typing import Any, NamedTuple

from pidcfg.encoders.codecs import DecodeError, Scale
from pidcfg.encoders.dl06.image import check_ramp_soak, is_alarm_order_broken
from pidcfg.encoders.maps.dl06 import CPU, FORMATS, LOOP_TABLE, LOOP_TABLES, RAMP_SOAK_PAIR, RAMP_SOAK_SIZE, RESET
from pidcfg.encoders.regmap import Point, RegisterMap
from pidcfg.schemas.base import Quantity
from pidcfg.sim.controllers.kernels import (
    CountsConfig,
    RequestState,
    clamp,
    read_registers,
    register,
    renew_alarm,
    round_half_even,
)
from pidcfg.sim.controllers.plc import TICKS

# ----------------------------------------------------------------------------------------------------------------------
# What a DL06 loop knows: `Config` (decoded words, fixed during a run) and `State` (what the controller writes).
# Words are held as floats with whole values, in counts of their data format; times are in seconds, the clock in ticks
# of a microsecond. Gains are kept in output counts per fraction of PV span with the sign of the action, so that the
# step itself reads like the manual's equation. Everything is an int or a float: the same fields become a NumPy record
# for numba.

UNBOUNDED = 1e18
"""A limit that nothing reaches."""

# Bits of the status word +06
MANUAL, AUTO, CASCADE = 1, 2, 4
MODES = MANUAL | AUTO | CASCADE
LOW_LOW, LOW, HIGH, HIGH_HIGH = 8, 16, 32, 64
PV_ALARMS = LOW_LOW | LOW | HIGH | HIGH_HIGH
YELLOW, RED = 128, 256
DEVIATION_ALARMS = YELLOW | RED
RATE_OF_CHANGE = 512
ALARMS = PV_ALARMS | DEVIATION_ALARMS | RATE_OF_CHANGE
ALARM_ERROR = 1024
OVERFLOW = 2048
TUNING = 4096
TUNE_ERROR = 8192

# Bits of the ramp/soak word +33
RS_START, RS_HOLD, RS_RESUME, RS_JOG = 1, 2, 4, 8
RS_COMPLETE, RS_DEVIATION, RS_HELD = 16, 32, 64
RS_STEP = 256
"""The step number stands in the high byte."""

# What a loop has to attend to besides its equation (`State.pending`)
FIRST_SAMPLE = 1
"""First sample after the program-to-run transition: the PV has no past."""
STOPPED = 2
"""The CPU is in Program mode and the loop with it: no calculation, and the output module is off."""
PV_STALE = 4
"""The CPU is in Program mode and nothing writes the PV word of this independent loop."""
OUTPUT_CUT = 8
"""The CPU is in Program mode and nothing carries the output word to the module."""
PROGRAM = 16
"""The CPU is in Program mode; this loop runs on by itself."""
NO_PAST = 32
"""First calculation after Manual: the error has no past."""
REQUEST = 64
"""`State.request` holds requested mode bits."""
GOAL = 128
"""`State.goal` has not been reached."""
RESTORE = 256
"""Back to `State.prior_mode` without asking."""
SOAK = 512
"""A ramp/soak command waits or a profile runs."""
TUNE = 1024
"""Auto-tune is wanted or runs."""
RELAY = 2048
"""Auto-tune has taken the output over."""
TRIP = 4096
"""To Manual now: an alarm programming error has been written."""


@dataclass(slots=True)
class Config(CountsConfig):
    """One loop's words, decoded."""

    step_slot: int = 5
    """The step of the ramp/soak profile, 1 to 16; 0: none is active."""
    period: int = 50_000
    slow: int = 0
    """Sample rate above 2 s and scans have a length: at most one such loop a scan."""
    independent: int = register("independent_of_cpu_mode", 0)
    out_min: float = 0.0
    out_max: float = 4095.0
    out_span: float = 4095.0
    # PV, set point and error
    filter: float = 1.0
    """Filter constant k; 1 is none."""
    square_root: int = register("pv.square_root", 0)
    span: float = 4095.0
    """What an error is divided by: the PV's span, or its root."""
    shapes_error: int = 0
    """Any of root, squared, deadband: the error is not simply SP - PV."""
    squared: int = register("error.curve", 0, equals="squared")
    deadband: float = 0.0
    """As a fraction of the span."""
    sp_min: float = register("setpoint.limits.0", -UNBOUNDED, enabled_by="setpoint.limits_enabled")
    sp_max: float = register("setpoint.limits.1", UNBOUNDED, enabled_by="setpoint.limits_enabled")
    major: int = -1
    """Index of the loop whose output is the remote set point; -1: the pointer names no output of this table."""
    # equation
    is_special: int = 0
    """Not simply the position form of a linear error: `equation.calculate_output` is needed."""
    velocity: int = register("algorithm", 0, equals="velocity")
    reverse: int = register("action", 0, equals="reverse")
    bumpless: int = 1
    bias_freeze: int = register("bias_freeze", 0)
    derivative_on_pv: int = 0
    """The derivative acts on the PV."""
    gain_limit_on: int = register("derivative_gain_limit_enabled", 0)
    gain_limit: float = register("derivative_gain_limit", 0.0)
    step_bias: int = 0
    output_low_limit: float = 0.0
    """Output limits, within the data range."""
    output_high_limit: float = 4095.0
    interlock: int = 1
    """A PV alarm refuses a request for Auto."""
    # alarms; a group that is off has thresholds that nothing reaches
    low_low: float = register("alarms.pv.low_low", -UNBOUNDED, enabled_by="alarms.pv.enabled")
    low: float = register("alarms.pv.low", -UNBOUNDED, enabled_by="alarms.pv.enabled")
    high: float = register("alarms.pv.high", UNBOUNDED, enabled_by="alarms.pv.enabled")
    high_high: float = register("alarms.pv.high_high", UNBOUNDED, enabled_by="alarms.pv.enabled")
    yellow: float = register("alarms.deviation.yellow", UNBOUNDED, enabled_by="alarms.deviation.enabled")
    red: float = register("alarms.deviation.red", UNBOUNDED, enabled_by="alarms.deviation.enabled")
    rate_of_change: float = register("alarms.rate_of_change", UNBOUNDED, enabled_by="alarms.rate_of_change_enabled")
    hysteresis: float = register("alarms.hysteresis", 0.0)
    # ramp/soak
    rs_enabled: int = register("ramp_soak.enabled", 0)
    rs_table: int = -1
    """Offset of the table in `aux`: target, slope/s, soak seconds, deviation for each of 8 pairs; -1: none."""
    rs_fault: int = 0
    """Bits of +35 that a start reports."""
    # auto-tune
    tune_open: int = register("autotune.method", 0, equals="open")
    tune_pi: int = register("autotune.type", 0, equals="PI")
    reset_unit: float = 1.0
    """Seconds of one unit of the reset word: 1 or 60."""
    reset_step: float = 0.1
    """Last digit of the reset word in its unit."""
    min_period: int = 50_000
    """Shortest sample rate for this number of loops."""


@dataclass(slots=True)
class State(RequestState):
    """One loop's words and memory that the controller writes."""

    period: int = 50_000
    pending: int = FIRST_SAMPLE
    """What has to be attended to, as a set of bits; 0 in quiet operation."""
    last_slow_loop: int = -1
    """In loop 1: the slow loop that was served last."""
    # words +02 to +05, in counts
    bias: float = 0.0
    """With its fraction, which the word does not show."""
    # gains: the words, and the factors calculated from them
    gain: float = 0.0
    """Kc."""
    filter_share: float = 1.0
    """Ts / (Ts + Td / limit)."""
    # past
    unrounded_output: float = 0.0
    """Output before rounding, the velocity form's position."""
    previous_error: float = 0.0
    derivative_input_1: float = 0.0
    """What the derivative acts on, at n-1 and n-2."""
    derivative_input_2: float = 0.0
    previous_sp: float = 0.0
    """Set point of the calculation before, for the step bias."""
    alarm_band_low: float = UNBOUNDED
    """Between these no alarm can change, as long as the set point stays."""
    alarm_band_high: float = -UNBOUNDED
    alarm_band_sp: float = 0.0
    # modes
    prior_mode: int = MANUAL
    """Mode when the CPU left Run."""
    # ramp/soak
    rs_command: int = 0
    rs_step: int = 0
    rs_ticks_left: float = 0.0
    """Ticks of the soak that are left."""
    rs_sp: float = 0.0
    """Set point with its fraction."""
    rs_error: int = 0
    """The word +35."""
    rs_errors: int = 0
    """Every bit of it that was on at some time."""


# --- From the words of a loop table to the numbers that the controller calculates with --------------------------------
#
# Every word and bit is decoded by its row of the register map, in counts. A word that is no value of its format (a
# BCD digit above 9, say) counts as 0, which switches its function off, and is reported (D50).

Values = Mapping[str, Any]
"""Decoded values by path; quantities in counts."""

SLOW_PERIOD = 2 * TICKS
"""Sample rates above this are calculated at most one a scan."""


class BadWord(NamedTuple):
    """A word that is no value of its format, in words, and whether it is a setting, not what the PLC writes."""

    text: str
    is_setting: bool


SCALE_CHOICES = ("pv.format", "output.format", "pv.square_root")
"""The choices that decide how counts are written."""
CACHED_TABLES = 64
"""Ramp/soak tables that are kept decoded, and loops: all is decoded anew whenever a word is written, and in a batch the
same words are written again and again."""


def raw_scales(bits: Values) -> dict[str, Scale]:
    """The scales of a loop's words, in counts."""
    pv = FORMATS[bits["pv.format"]]
    output = FORMATS[bits["output.format"] or bits["pv.format"]]
    return {"pv": Scale(pv), "sp": Scale(pv, has_root=bits["pv.square_root"]), "output": Scale(output)}


def decode_block(
    table: RegisterMap, words: Sequence[int], scales: Mapping[str, Scale], start: int = 0
) -> tuple[Values, list[BadWord]]:
    """Every value of a block by path, and its words that have no value; ``start`` is where the block begins."""
    values: dict[str, Any] = {}
    problems: list[BadWord] = []
    points: tuple[Point, ...] = (*table.bits, *table.words)
    for row in points:
        if row.path is None:
            continue
        if not (row.bits or scales):
            scales = raw_scales(values)
        try:
            values[row.path] = row.decode(words[row.offset], scales)
        except DecodeError as error:
            setting = bool(row.bits) or row.access != "status"
            problems.append(BadWord(f"+{start + row.offset:02o} {row.title}: {error}; taken as 0", setting))
            values[row.path] = row.decode(0, scales)
    return values, problems


def decode_loop(words: Sequence[int], reset_decimals: int) -> tuple[Values, list[BadWord]]:
    """The 32 words of a loop, and which of them have no value."""
    values, problems = _decode_words(tuple(words), reset_decimals)
    return dict(values), list(problems)


@lru_cache(maxsize=CACHED_TABLES)
def _decode_words(words: Sequence[int], reset_decimals: int) -> tuple[Values, list[BadWord]]:
    return decode_block(LOOP_TABLES[reset_decimals], words, {})


def count_value(value: Any) -> float:
    """A decoded quantity as a float."""
    return float(value.value)


def configure_loop(config: Config, v: Values, reset_decimals: int, loops: int) -> None:
    """Everything in a loop's `Config` that follows from its words; ``loops`` decides the least sample rate (D51)."""
    read_registers(config, {path: value.value if isinstance(value, Quantity) else value for path, value in v.items()})
    _set_scales(config, v)
    config.bumpless = 1 if v["bumpless"] == "I" else 2
    config.output_low_limit = clamp(count_value(v["output.limits.0"]), config.out_min, config.out_max)
    config.output_high_limit = clamp(count_value(v["output.limits.1"]), config.out_min, config.out_max)
    config.span = sqrt(config.pv_span) if config.square_root else config.pv_span
    config.deadband = count_value(v["error.deadband"]) / config.span if v["error.deadband_enabled"] else 0.0
    config.shapes_error = int(config.square_root or config.squared or config.deadband > 0.0)
    config.is_special = int(config.velocity or config.shapes_error or config.derivative_on_pv or config.step_bias)
    config.fetches_pv = int(isinstance(v["pv.transfer"], tuple))
    config.carries_output = int(isinstance(v["output.transfer"], tuple))
    config.rs_fault = check_ramp_soak(v["ramp_soak.table"])
    config.reset_unit = 60.0 if v["tuning.reset_unit"] == "minutes" else 1.0
    config.reset_step = float(RESET[reset_decimals].step)
    config.min_period = ticks(CPU.fast_rate if loops <= CPU.fast_loops else CPU.slow_rate)
    config.period = max(ticks(v["sample_rate"]), config.min_period)
    config.halt = int(v["sample_rate"] == 0)


def ticks(seconds: Any) -> int:
    """Seconds as ticks."""
    return round(float(seconds) * TICKS)


def _set_scales(config: Config, v: Values) -> None:
    pv, output = raw_scales(v)["pv"].format, raw_scales(v)["output"].format
    config.pv_min, config.pv_max, config.pv_span = float(pv.minimum), float(pv.maximum), float(pv.span)
    config.out_min, config.out_max, config.out_span = float(output.minimum), float(output.maximum), float(output.span)
    k = float(v["pv.filter"])
    config.filter = k if v["pv.filter_enabled"] and 0.0 < k <= 1.0 else 1.0


PV_LIMITS = ("low_low", "low", "high", "high_high")
DEVIATION_LIMITS = ("yellow", "red")


def alarm_error(v: Values) -> bool:
    """Whether limits of an enabled group are out of order: bit 10 of +06, which forces Manual (D47)."""
    pv = [int(v[f"alarms.pv.{name}"].value) for name in PV_LIMITS] if v["alarms.pv.enabled"] else None
    deviation = [int(v[f"alarms.deviation.{n}"].value) for n in DEVIATION_LIMITS]
    return is_alarm_order_broken(pv, deviation if v["alarms.deviation.enabled"] else None)


def set_gains(config: Config, state: State, v: Values, reset_decimals: int) -> None:
    """The gain words and the sample rate; a reset of all zeros or all nines is off."""
    codec = RESET[reset_decimals]
    reset = v["tuning.reset"]
    state.gain = float(v["tuning.gain"])
    state.reset = 0.0 if reset / codec.step in codec.off else float(reset) * config.reset_unit
    state.rate = float(v["tuning.rate"])
    state.period = config.period


def decode_profile(words: Sequence[int], v: Values) -> Sequence[tuple[Values, list[BadWord]]]:
    """The pairs of a ramp/soak table, each with its words that have no value."""
    return _word_pairs(tuple(words), *(v[path] for path in SCALE_CHOICES))


@lru_cache(maxsize=CACHED_TABLES)
def _word_pairs(words: Sequence[int], *formats: Any) -> Sequence[tuple[Values, list[BadWord]]]:
    scales = raw_scales(dict(zip(SCALE_CHOICES, formats, strict=True)))
    size = RAMP_SOAK_PAIR.size
    starts = range(0, RAMP_SOAK_SIZE, size)
    return [decode_block(RAMP_SOAK_PAIR, words[at : at + size], scales, at) for at in starts]


def read_profile(words: Sequence[int], v: Values) -> Sequence[float]:
    """A ramp/soak table as the kernels want it: target, slope a second, seconds to soak, deviation for each pair."""
    return _decode_profile(tuple(words), *(v[path] for path in SCALE_CHOICES))


@lru_cache(maxsize=CACHED_TABLES)
def _decode_profile(words: Sequence[int], *formats: Any) -> Sequence[float]:
    table: list[float] = []
    for pair, _ in _word_pairs(words, *formats):
        table += [
            count_value(pair["ramp_to"]),
            count_value(pair["slope"]),
            float(pair["soak"] * 60),
            count_value(pair["deviation"]),
        ]
    return table


def major_of(pointer: int, start: int, loops: int, minor: int) -> int:
    """The loop of the table at ``start`` whose output word the remote set point pointer names; -1: none."""
    index, offset = divmod(pointer - start, LOOP_TABLE.size)
    named = offset == LOOP_TABLE.offset_of("output") and 0 <= index < loops and index != minor
    return index if named else -1


def write_state(state: State, v: Values, path: str) -> None:
    """Words that the controller also writes: a value from outside replaces theirs."""
    if path == "setpoint.value":
        state.sp = state.goal_sp = count_value(v[path])
        state.goal_has_sp = 1
    elif path == "state.pv":
        state.pv = count_value(v[path])
    elif path == "state.bias":
        state.bias = count_value(v[path])
    elif path == "state.output":
        state.out = state.unrounded_output = count_value(v[path])


def show_signals(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """The signals of a loop as its words say; a remote set point stays the one that was calculated with last (D67)."""
    out = 0.0 if state.pending & (STOPPED | OUTPUT_CUT) else state.out
    if state.status & CASCADE == 0 or config.major < 0:
        sp = clamp(state.sp, config.sp_min, config.sp_max)
        centre = sp * abs(sp) if config.square_root else sp
        signals[config.sp_slot] = config.pv_low + (centre - config.pv_min) * config.pv_width / config.pv_span
    signals[config.pv_slot] = config.pv_low + (state.pv - config.pv_min) * config.pv_width / config.pv_span
    signals[config.out_slot] = config.out_low + (out - config.out_min) * config.out_width / config.out_span
    signals[config.step_slot] = float(state.rs_step)
    signals[config.bias_slot] = (
        config.out_low + (round_half_even(state.bias) - config.out_min) * config.out_width / config.out_span
    )


# --- The PID equation of the DL06 in both forms, line by line as the manual prints it ---------------------------------
#
# The engine works in fractions of the data range: the error is a fraction of the PV's span, the factors turn it into
# output counts and carry the sign of the action (D30, D32). D numbers: see `dl06.ENGINE_DECISIONS`.


def calculate_gains(config: Config, state: State) -> None:
    """The factors of the equation, from the gain words: Ki = Kc Ts/Ti and Kr = Kc Td/Ts, in output counts (D677).

    A gain of 0 takes the proportional term out and leaves Ki = Ts/Ti, Kr = Td/Ts (D33). The derivative gain limit is a
    filter (D34).
    """
    # P-I-D Loop Terms: Kc, Ki = Kc Ts/Ti, Kr = Kc Td/Ts
    seconds = state.period / TICKS
    scale = -config.out_span if config.reverse else config.out_span
    factor = state.gain * scale if state.gain > 0.0 else scale
    state.kp = state.gain * scale
    state.ki = factor * seconds / state.reset if state.reset > 0.0 else 0.0
    state.kd = factor * state.rate / seconds
    # Derivative Gain Limiting (D34: the limit is a filter)
    state.filter_share = 1.0
    if config.gain_limit_on:
        state.kd = state.kd if config.gain_limit > 0.0 else 0.0
        state.filter_share = seconds / (seconds + state.rate / config.gain_limit) if config.gain_limit > 0.0 else 1.0


def pv_on_sp_scale(config: Config, pv: float) -> float:
    """The PV on the set point's scale: itself, or its root (D37)."""
    if config.square_root == 0:
        return pv
    return sqrt(pv) if pv > 0.0 else 0.0


def calculate_error(config: Config, sp: float, pv: float) -> float:
    """The error as a fraction of the span: root extract, then the square, then the deadband (D31)."""
    # Error Term Configuration: Error = SP - PV, or SP less the root of PV; Error Squared keeps the sign; Error Deadband
    error = (sp - pv_on_sp_scale(config, pv)) / config.span
    if config.squared:
        error = error * abs(error)
    if -config.deadband <= error <= config.deadband:
        error = 0.0
    return error


def reset_past(state: State, error: float, derivative_input: float, sp: float) -> None:
    """Give the equation a past that equals the present: no kick after Manual (D42)."""
    state.previous_error = error
    state.derivative_input_1 = derivative_input
    state.derivative_input_2 = derivative_input
    state.previous_sp = sp
    state.pending &= ~NO_PAST


def scale_bias(config: Config, state: State, sp: float) -> None:
    """Step bias: a change of the set point changes the bias in proportion, inversely for reverse action (D38).

    The words are signed counts (D647). The velocity form has no bias to change.
    """
    if config.velocity == 0 and sp * state.previous_sp > 0.0:
        state.bias *= state.previous_sp / sp if config.reverse else sp / state.previous_sp
    state.previous_sp = sp


def filter_derivative(state: State, derivative_input: float) -> float:
    """The signal that the derivative acts on, smoothed by the derivative gain limit; itself without one (D34)."""
    # Derivative Gain Limiting
    if state.filter_share == 1.0:
        return derivative_input
    return state.derivative_input_1 + state.filter_share * (derivative_input - state.derivative_input_1)


def calculate_velocity(state: State, error: float, derivative_input: float) -> float:
    """Change of output: Kc (e(n) - e(n-1)) + Ki e(n) + Kr (e(n) - 2 e(n-1) + e(n-2)), on top of the last output.

    That is within its limits and has its fraction (D649). The change is added up before it is added (D678).
    """
    # Velocity Algorithm: dM(n) = M(n) - M(n-1)
    filtered_input = filter_derivative(state, derivative_input)
    change = (
        state.kp * (error - state.previous_error)
        + state.ki * error
        + state.kd * (filtered_input - 2.0 * state.derivative_input_1 + state.derivative_input_2)
    )
    state.derivative_input_2 = state.derivative_input_1
    state.derivative_input_1 = filtered_input
    state.previous_error = error
    return state.unrounded_output + change


def calculate_position(config: Config, state: State, error: float, derivative_input: float) -> float:
    """Mx(n) = Mx(n-1) + Ki e(n), within the data range; M(n) = Kc e(n) + Kr (e(n) - e(n-1)) + Mx(n).

    What the derivative remembers is kept up without a derivative too: one that is switched on does not kick. The
    bias keeps its fraction (D35); the freeze looks at the output of the calculation before (D39).
    """
    # Bias Term, reset action: Mx(n) = Mx(n-1) + Ki e(n)
    bias = state.bias
    change = state.ki * error
    if change != 0.0:
        # Bias Freeze. D39: looks at last output
        if config.bias_freeze and (
            (change > 0.0 and state.out >= config.out_max) or (change < 0.0 and state.out <= config.out_min)
        ):
            change = 0.0
        bias += change
    # D30: bias stays in range
    if bias > config.out_max:
        bias = config.out_max
    elif bias < config.out_min:
        bias = config.out_min
    state.bias = bias
    # Position Algorithm: M(n) = Kc e(n) + Kr (e(n) - e(n-1)) + Mx(n)
    if state.kd == 0.0:
        state.derivative_input_1 = derivative_input
        return state.kp * error + bias
    filtered_input = filter_derivative(state, derivative_input)
    slope = filtered_input - state.derivative_input_1
    state.derivative_input_1 = filtered_input
    return state.kp * error + state.kd * slope + bias


def calculate_output(config: Config, state: State, sp: float, pv: float) -> float:
    """The output in counts, with everything that the plain position form does without."""
    # Error Term Configuration; derivative on error or PV; bumpless start; Step Bias
    error = calculate_error(config, sp, pv) if config.shapes_error else (sp - pv) / config.span
    derivative_input = -pv_on_sp_scale(config, pv) / config.span if config.derivative_on_pv else error
    if state.pending & NO_PAST:
        reset_past(state, error, derivative_input, sp)
    if config.step_bias and sp != state.previous_sp:
        scale_bias(config, state, sp)
    return (
        calculate_velocity(state, error, derivative_input)
        if config.velocity
        else calculate_position(config, state, error, derivative_input)
    )


# --- Process alarms of a DL06 loop: four absolute, two deviation, one rate of change ----------------------------------
#
# An alarm comes on as soon as the PV is beyond its threshold and goes off when the PV is back through it by the
# hysteresis (D46); the rate of change has none. Groups that are switched off have thresholds that nothing reaches,
# which clears their bits. While no alarm is on, `renew_alarms` leaves behind the band of PVs in which none can come on,
# so that the step looks at two numbers instead of six thresholds.


def renew_pv_alarms(config: Config, state: State, pv: float) -> None:
    """Renew the four alarms of the PV itself."""
    status = renew_alarm(state.status, LOW_LOW, config.low_low - pv, config.hysteresis)
    status = renew_alarm(status, LOW, config.low - pv, config.hysteresis)
    status = renew_alarm(status, HIGH, pv - config.high, config.hysteresis)
    state.status = renew_alarm(status, HIGH_HIGH, pv - config.high_high, config.hysteresis)


def renew_alarms(config: Config, state: State, pv: float, previous_pv: float, sp: float) -> None:
    """Renew all alarms, and the band in which nothing will change.

    With square-root extract the set point is on the root's scale; the deviation alarms compare the PV with its square.
    """
    renew_pv_alarms(config, state, pv)
    centre = sp * abs(sp) if config.square_root else sp
    deviation = abs(pv - centre)
    status = renew_alarm(state.status, YELLOW, deviation - config.yellow, config.hysteresis)
    status = renew_alarm(status, RED, deviation - config.red, config.hysteresis)
    if abs(pv - previous_pv) > config.rate_of_change:
        status |= RATE_OF_CHANGE
    else:
        status &= ~RATE_OF_CHANGE
    state.status = status
    state.alarm_band_sp = sp
    state.alarm_band_low = UNBOUNDED
    state.alarm_band_high = -UNBOUNDED
    if status & ALARMS == 0:
        band = min(config.yellow, config.red)
        state.alarm_band_low = max(config.low, config.low_low, centre - band)
        state.alarm_band_high = min(config.high, config.high_high, centre + band)


def active_pv_alarms(state: State) -> int:
    """The absolute alarms that are on."""
    return state.status & PV_ALARMS
