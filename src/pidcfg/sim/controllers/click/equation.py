"""What a CLICK loop knows and calculates: its records, the position equation, alarms, pulses and its autotune."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from math import isfinite
from typing import Any, NamedTuple

from pidcfg.encoders.codecs import Implied
from pidcfg.encoders.image import default_name
from pidcfg.encoders.maps.click import BLOCKS, ERRORS, SPACE, WORDS_BY_NAME, PidError
from pidcfg.encoders.regmap import SINGLE
from pidcfg.schemas.click import BITS, FLOATS, INTEGERS
from pidcfg.schemas.expressions import LARGEST_VALUE
from pidcfg.sim.controllers.autotune import (
    ANSWERED,
    CANCELLED,
    DONE,
    FAILED,
    LAST_TURN,
    NO_ANSWER,
    NOTHING,
    RELAY_PATIENCE_SAMPLES,
    RELAY_PATIENCE_SECONDS,
    STEP_SHARE,
    TOO_SMALL,
    begin_curve,
    begin_cycle,
    begin_noise,
    curve_gains,
    cycle_gains,
    cycle_length,
    is_stalled,
    judge_response,
    measure_noise,
    record_point,
    relay_switch,
    steepest_line,
    ultimate_gain,
    was_moving,
)
from pidcfg.sim.controllers.kernels import (
    LoopConfig,
    RequestState,
    add_notice,
    clamp,
    read_registers,
    register,
    register_values,
    renew_alarm,
    round_half_even,
    single,
)
from pidcfg.sim.controllers.plc import TICKS

# ----------------------------------------------------------------------------------------------------------------------
# Records of a CLICK loop: `Config` (decoded registers, fixed during a run) and `State` (what the controller writes).
# Numbers are what the PLC's single-precision registers hold; the clock is in ticks of a microsecond. Everything is an
# int or a float: the same fields become a NumPy record for numba.

UNBOUNDED = 1e39
"""A limit that no value reaches: beyond single precision."""
NAN = float("nan")
"""Content of a register whose calculation had no finite result."""

# Bits of `State.status`: modes, the alarms Cn+31 to Cn+37, errors
MANUAL, AUTO, TUNING = 1, 2, 4
MODES = MANUAL | AUTO | TUNING
LOW_LOW, LOW, HIGH, HIGH_HIGH = 8, 16, 32, 64
PV_ALARMS = LOW_LOW | LOW | HIGH | HIGH_HIGH
DEVIATION_HIGH, DEVIATION_HIGH_HIGH = 128, 256
DEVIATION_ALARMS = DEVIATION_HIGH | DEVIATION_HIGH_HIGH
RATE_OF_CHANGE = 512
ALARMS = PV_ALARMS | DEVIATION_ALARMS | RATE_OF_CHANGE
PID_ERROR = 1024
TUNE_ERROR = 2048

# What is pending besides the equation (`State.pending`)
FIRST_SAMPLE = 1
"""First sample after the change from STOP to RUN: the PV has no past."""
STOPPED = 2
"""The PLC is in STOP mode."""
NO_PAST = 4
"""First calculation after Manual or Autotune: the error has no past."""
REQUEST = 8
"""`State.request` holds requested mode bits."""
GOAL = 16
"""`State.goal` has not been reached."""


@dataclass(slots=True)
class Config(LoopConfig):
    """One loop's registers, decoded."""

    error_slot: int = 5
    pwm_slot: int = 6
    # PV, set point and error
    filter_on: int = register("filter_enable", 0)
    filter: float = 1.0
    """Share of the raw PV that is passed each sample: DSn+08 / 100."""
    sp_low_on: int = register("setpoint_lower_enable", 0)
    sp_low: float = register("setpoint_lower", 0.0)
    sp_high_on: int = register("setpoint_upper_enable", 0)
    sp_high: float = register("setpoint_upper", 0.0)
    squared: int = register("error_squared", 0)
    deadband_on: int = 0
    deadband: float = register("deadband", 0.0)
    # equation
    reverse: int = register("action", 0)
    bumpless: int = 1
    freeze_bias: int = register("freeze_bias", 0)
    gain_limit_on: int = register("derivative_limit_enable", 0)
    gain_limit: float = register("derivative_gain_limit", 100.0)
    out_low: float = register("output_lower", 0.0)
    out_high: float = register("output_upper", 100.0)
    # alarms; a disabled group has limits that no value reaches
    low_low: float = register("pv_low_low", -UNBOUNDED, enabled_by="pv_alarm_enable")
    low: float = register("pv_low", -UNBOUNDED, enabled_by="pv_alarm_enable")
    high: float = register("pv_high", UNBOUNDED, enabled_by="pv_alarm_enable")
    high_high: float = register("pv_high_high", UNBOUNDED, enabled_by="pv_alarm_enable")
    deviation_high: float = register("deviation_high", UNBOUNDED, enabled_by="deviation_alarm_enable")
    deviation_high_high: float = register("deviation_high_high", UNBOUNDED, enabled_by="deviation_alarm_enable")
    rate_of_change: float = register("rate_of_change", UNBOUNDED, enabled_by="rate_alarm_enable")
    hysteresis: float = register("hysteresis", 0.0)
    # pulse width modulation
    pwm: int = 0
    """The output drives a discrete output."""
    pwm_period: int = 10_000_000
    """In ticks."""
    # autotune
    tune_closed: int = register("autotune_method", 0)
    tune_pi: int = register("autotune_type", 0)
    tune_hysteresis: float = register("autotune_hysteresis", 1.0)
    tune_buffer: int = -1
    """Offset in `aux` of `autotune.POINTS` floats."""
    pv_low: float = register("pv_lower", 0.0)
    """PV lower and upper limit, the process's range for the whole range of the output."""
    pv_high: float = register("pv_upper", 100.0)


@dataclass(slots=True)
class State(RequestState):
    """One loop's registers and memory that the controller writes."""

    # registers
    sample_ms: int = register("sample_rate", 100)
    sp: float = register("setpoint", 0.0)
    raw: float = register("raw_pv", 0.0)
    pv: float = register("pv", 0.0)
    bias: float = register("bias", 0.0)
    out: float = register("output", 0.0)
    gain: float = register("proportional_gain", 1.0)
    reset: float = register("reset_time", 1.0)
    rate: float = register("derivative_gain", 0.0)
    error_row: int = 0
    """Row of the table of PID errors that is active, the lowest, from 1; 0: none."""
    error_number: float = 0.0
    """Its number, DSn+00."""
    pending: int = FIRST_SAMPLE
    """What is pending, as bits; 0 in undisturbed operation."""
    # factors calculated from them
    filter_share: float = 1.0
    """Of the derivative's filter, Ts / (Ts + Td / limit)."""
    # past
    previous_error: float = 0.0
    """The error of the calculation before, without the deadband."""
    filtered_difference: float = 0.0
    """The filtered difference of errors."""
    alarm_band_low: float = UNBOUNDED
    """Between these no alarm can change, as long as the set point stays."""
    alarm_band_high: float = -UNBOUNDED
    alarm_band_sp: float = 0.0
    # pulse width modulation
    pulse_start: int = 0
    """Start of the present period."""
    on_time: float = -1.0
    """On-time of the present period in ticks; below 0: none has begun."""
    last_tick: int = 0
    """Tick of the base step before."""


# ----------------------------------------------------------------------------------------------------------------------
# PID errors of a CLICK loop: which one DSn+00 shows, worked out from the registers whenever one is written (D117).


def row_of(number: int) -> int:
    """The row of an error, counted from 1: what `State.error_row` holds."""
    return next(row for row, error in enumerate(ERRORS, start=1) if error.number == number)


BIAS_NUMBER = 25.0
BIAS_ERROR = row_of(int(BIAS_NUMBER))


class Range(NamedTuple):
    """What a register may hold, as it is stored."""

    low: float
    high: float


def _limit_value(error: PidError, end: Decimal | None, otherwise: float) -> float:
    """A limit as the register holds it: whole digits, or a single-precision number."""
    codec = WORDS_BY_NAME[error.register].codec
    if end is None:
        return otherwise
    return float(end / codec.step) if isinstance(codec, Implied) else single(float(end))


RANGES = {
    error.register: Range(_limit_value(error, error.low, float("-inf")), _limit_value(error, error.high, float("inf")))
    for error in ERRORS
    if error.low is not None
}
"""The registers with limits."""


def is_active(error: PidError, n: Mapping[str, float]) -> bool:
    """Whether an error's condition holds; infinities are not numbers either, and limits count only when both are on."""
    value = n[error.register]
    if error.upper_register is not None:
        return bool(n["setpoint_lower_enable"] and n["setpoint_upper_enable"] and value > n[error.upper_register])
    if not isfinite(value):
        return True
    limits = RANGES.get(error.register)
    return limits is not None and not limits.low <= value <= limits.high


def lowest_error(n: Mapping[str, float]) -> int:
    """The row of the lowest error that is active, from 1; 0: none."""
    return next((row for row, error in enumerate(ERRORS, start=1) if is_active(error, n)), 0)


def nearest_allowed(register: str, value: float) -> float:
    """A register's value, or the nearest one without an error."""
    limits = RANGES[register]
    return min(max(value, limits.low), limits.high)


# --- From the registers of a CLICK loop to the numbers that the controller calculates with, and back ------------------

BANKS = {"bits": BITS, "integers": INTEGERS, "floats": FLOATS}
ROWS = [
    (key, prefix, row) for key, (prefix, table) in BLOCKS.items() for row in table.words if row.access != "reserved"
]
"""Every register that is not reserved: its block, its bank and its row."""
MILLISECOND = TICKS // 1000


def float_of(raw: int) -> float:
    """The number that single-precision bits are, exactly."""
    value: float = struct.unpack(">f", raw.to_bytes(4, "big"))[0]
    return value


def bits_of(value: float) -> int:
    """The bits of a single-precision number."""
    return int.from_bytes(struct.pack(">f", value), "big")


@dataclass(slots=True)
class Loop:
    """A loop's registers by name, and what no register holds."""

    name: str
    initial_mode: str
    has_setpoint: bool
    """Whether the configuration gives a set point; it may leave that to the operator."""
    pwm: bool
    starts: Mapping[str, int]
    """The number of each block's first register."""
    words: dict[str, int]

    def numbers(self) -> dict[str, float]:
        """What every register holds."""
        return {row.name: number_of(prefix, self.words[row.name]) for _, prefix, row in ROWS}

    def store_results(self, state: State) -> None:
        """Put what the controller has written into the registers."""
        for name, value in register_values(state).items():
            self.words[name] = value & 0xFFFF if isinstance(value, int) else bits_of(value)


def number_of(prefix: str, raw: int) -> float:
    """What a register of a bank holds."""
    kind = SPACE.kind_of(SPACE.number_of(prefix, 1))
    return float_of(raw) if kind is SINGLE else kind.show(raw)


def loop_of(words: Mapping[int, int], index: int, entry: Mapping[str, Any]) -> Loop:
    """A loop from the PLC's memory and its entry in the image's settings; a register that was never written is 0."""
    starts = {key: BANKS[key].parse(entry[key]) for key in BLOCKS}
    contents = {row.name: words.get(SPACE.number_of(prefix, starts[key] + row.offset), 0) for key, prefix, row in ROWS}
    output = entry.get("output") or {}
    name = str(entry.get("loop", default_name(index)))
    return Loop(
        name,
        entry.get("mode", "manual"),
        entry.get("setpoint") is not False,
        output.get("pwm") is not None,
        starts,
        contents,
    )


def configure_loop(config: Config, n: Mapping[str, float]) -> None:
    """Everything in a loop's `Config` that follows from its registers."""
    read_registers(config, n)
    config.filter = single(nearest_allowed("filter", n["filter"]) / 100.0)
    config.deadband_on = int(n["deadband_enable"] and config.deadband > 0.0)
    config.bumpless = 2 if n["bumpless_mode"] else 1
    config.pwm_period = int(nearest_allowed("pwm_period", n["pwm_period"])) * TICKS


def alarms_off(n: Mapping[str, float]) -> int:
    """The alarms of the groups that are off; they go off with the bit (D655)."""
    pv = 0 if n["pv_alarm_enable"] else PV_ALARMS
    deviation = 0 if n["deviation_alarm_enable"] else DEVIATION_ALARMS
    return pv | deviation | (0 if n["rate_alarm_enable"] else RATE_OF_CHANGE)


def write_state(state: State, n: Mapping[str, float]) -> None:
    """The registers that the controller writes too, as they stand in memory; the sample rate within its limits."""
    read_registers(state, n)
    state.period = sample_ticks(n["sample_rate"])
    state.status &= ~alarms_off(n)
    state.alarm_band_low, state.alarm_band_high = UNBOUNDED, -UNBOUNDED


def sample_ticks(milliseconds: float) -> int:
    """The time between two samples, within the register's range even with a PID error (D118)."""
    return int(nearest_allowed("sample_rate", milliseconds)) * MILLISECOND


# --- The position equation of the CLICK, every result rounded to single precision as it arises (D110) -----------------
#
# CO(n) = Bias(n) + Kp [e(n) + Td/Ts (e(n) - e(n-1))], Bias(n) = Bias(n-1) + Kp Ts/Ti e(n). The factors carry the sign
# of the action, which changes no bit of a rounded product. D numbers: see `click.CONTROLLER_DECISIONS`.


def calculate_gains(config: Config, state: State) -> None:
    """Kp Ts/Ti and Td/Ts of the registers as they stand, and the lag of the derivative's filter (D110, D114).

    Only called with a reset time above 0: errors 26 to 28 keep a loop in Manual, where nothing is calculated.
    """
    # Proportional Gain (DFn+05), Integral or Reset Time (DFn+06), Derivative Gain (DFn+07)
    seconds = single(state.period / TICKS)
    state.kp = -state.gain if config.reverse else state.gain
    state.ki = single(state.kp * single(seconds / state.reset))
    state.kd = single(state.rate / seconds)
    # Derivative Gain Limit (DSn+06): Ts / (Ts + Td / limit)
    state.filter_share = 1.0
    if config.gain_limit_on:
        if config.gain_limit <= 0.0:
            state.kd = 0.0
        elif config.gain_limit < 100.0:
            state.filter_share = single(seconds / single(seconds + single(state.rate / config.gain_limit)))


def calculate_output(config: Config, state: State) -> float:
    """The output before its limits; no term acts while the error is inside the deadband (D113).

    The bias goes on, unless it is frozen (D112), and stays within the output's limits (D111); the derivative is that of
    the filtered error (D114).
    """
    # Error = SP - PV; Error Squared Option (Cn+02)
    error = single(state.sp - state.pv)
    if config.squared:
        error = single(error * abs(error))
    if state.pending & NO_PAST:
        state.pending &= ~NO_PAST
        state.previous_error = error
        state.filtered_difference = 0.0
    change = single(error - state.previous_error)
    state.previous_error = error
    # Bias(n) = Bias(n-1) + Kp Ts/Ti e(n), held by Freeze Bias (Anti-Windup, Cn+05) and Error Deadband Option (Cn+03).
    # D111: bias within output limits
    low = config.out_low
    high = config.out_high
    bias = state.bias
    in_deadband = config.deadband_on and -config.deadband <= error <= config.deadband
    if not (in_deadband or (config.freeze_bias and (state.out >= high or state.out <= low))):
        bias = single(bias + single(state.ki * error))
    state.bias = clamp(bias, low, high)
    if in_deadband:
        state.filtered_difference = 0.0
        return state.bias
    # Derivative Gain Limit (Cn+04). D114: filter of the difference of errors
    if state.filter_share < 1.0:
        change = single(
            state.filtered_difference + single(state.filter_share * single(change - state.filtered_difference))
        )
    state.filtered_difference = change
    # Control Output (DFn+08): CO(n) = Bias(n) + Kp (e(n) + Td/Ts (e(n) - e(n-1)))
    if state.kd != 0.0:
        error = single(error + single(state.kd * change))
    return single(state.bias + single(state.kp * error))


# --- Alarms of a CLICK loop: four of the PV, two of its deviation, one of its rate of change (D122) -------------------
#
# An alarm comes on as soon as the PV is beyond its limit and goes off when the PV is back through it by the
# hysteresis; the rate of change has none. Groups that are off have limits that nothing reaches. While no alarm is on,
# `renew_alarms` leaves behind the band of PVs in which none can come on, so that the step looks at two numbers instead
# of six limits.


def renew_pv_alarms(config: Config, status: int, pv: float) -> int:
    """The four alarms of the PV itself."""
    status = renew_alarm(status, LOW_LOW, single(config.low_low - pv), config.hysteresis)
    status = renew_alarm(status, LOW, single(config.low - pv), config.hysteresis)
    status = renew_alarm(status, HIGH, single(pv - config.high), config.hysteresis)
    return renew_alarm(status, HIGH_HIGH, single(pv - config.high_high), config.hysteresis)


def renew_deviation_alarms(config: Config, status: int, deviation: float) -> int:
    """The two alarms of the distance from the set point."""
    status = renew_alarm(status, DEVIATION_HIGH, single(deviation - config.deviation_high), config.hysteresis)
    return renew_alarm(status, DEVIATION_HIGH_HIGH, single(deviation - config.deviation_high_high), config.hysteresis)


def renew_alarms(config: Config, state: State, previous_pv: float) -> None:
    """Renew all alarms, and the band in which nothing will change; ``previous_pv`` is the PV of the sample before."""
    status = renew_pv_alarms(config, state.status, state.pv)
    status = renew_deviation_alarms(config, status, abs(single(state.sp - state.pv)))
    if abs(single(state.pv - previous_pv)) > config.rate_of_change:
        status |= RATE_OF_CHANGE
    else:
        status &= ~RATE_OF_CHANGE
    state.status = status
    state.alarm_band_sp = state.sp
    state.alarm_band_low = UNBOUNDED
    state.alarm_band_high = -UNBOUNDED
    if status & ALARMS == 0:
        band = lower_of(config.deviation_high, lower_of(config.deviation_high_high, UNBOUNDED))
        state.alarm_band_low = -lower_of(-config.low, lower_of(-config.low_low, band - state.sp))
        state.alarm_band_high = lower_of(config.high, lower_of(config.high_high, state.sp + band))


def lower_of(x: float, y: float) -> float:
    """The lower one, and the second where the first is no number, on which ``min`` differs once it is compiled."""
    if x < y:
        return x
    return y


# ----------------------------------------------------------------------------------------------------------------------
# Pulse width modulation: the share of each period for which a discrete output is on is the control output (D121).

ON, OFF = 1.0, 0.0


def set_pulse(config: Config, state: State, tick: int) -> float:
    """The discrete output of the base step that begins at ``tick``: as it is in the middle of the step.

    The first step's length is not known yet; its beginning counts. The on-time is taken where a period begins.
    """
    middle = tick + (tick - state.last_tick) // 2
    state.last_tick = tick
    if state.pending & STOPPED:
        return OFF
    if state.on_time < 0.0 or middle - state.pulse_start >= config.pwm_period:
        if state.on_time < 0.0 or middle - state.pulse_start >= 2 * config.pwm_period:
            state.pulse_start = tick
        else:
            state.pulse_start += config.pwm_period
        duty = state.out / 100.0
        if not duty > 0.0:
            duty = 0.0
        elif duty > 1.0:
            duty = 1.0
        state.on_time = duty * config.pwm_period
    return ON if middle - state.pulse_start < state.on_time else OFF


# --- How an autotune of the CLICK begins and ends: the output is restored, results go to their registers (D125) -------

IDLE, OBSERVING, RESPONSE, SWITCHING = 0, 1, 2, 3
"""`State.tune_phase`."""

REFUSED_TUNE_MODE = 30
REFUSED_TUNE_RANGE = 31
TUNE_NO_RANGE = 32
TUNE_NO_RESPONSE = 33
TUNE_ABORTED = 34
TUNE_CANCELLED = 35
TUNE_IDLE = 36
TUNE_MOVING = 37
TUNE_RATE = 38

ASCENDING = "the PV limits (DFn+22, DFn+23) and the output limits (DFn+09, DFn+10) must ascend"
REASONS = {
    REFUSED_TUNE_MODE: "autotune refused: it starts in Auto only",
    REFUSED_TUNE_RANGE: f"autotune refused: {ASCENDING}",
    TUNE_NO_RANGE: f"autotune stopped: {ASCENDING}",
    TUNE_NO_RESPONSE: "autotune stopped: the PV does not answer",
    TUNE_ABORTED: "autotune stopped: the loop went to Manual",
    TUNE_CANCELLED: "autotune cancelled: its request was cleared",
    TUNE_IDLE: "no autotune to be cancelled",
    TUNE_RATE: "autotune stopped: the sample rate was changed (D695)",
    TUNE_MOVING: "the PV was moving when the autotune began: do not trust its gains (D623)",
}

MIN_GAIN, MAX_GAIN = RANGES["proportional_gain"]
MIN_RESET, MAX_RESET = RANGES["reset_time"]
MIN_RATE, MAX_RATE = RANGES["derivative_gain"]
MIN_MS, MAX_MS = RANGES["sample_rate"]
"""What registers without a PID error hold."""


def is_tunable(config: Config) -> bool:
    """Whether the limits of PV and output are ranges."""
    return (
        0.0 < config.pv_high - config.pv_low <= LARGEST_VALUE
        and 0.0 < config.out_high - config.out_low <= LARGEST_VALUE
    )


def start_tune(state: State) -> None:
    """The loop goes to Autotune; its output is held while the noise of the PV is measured (D123)."""
    state.status = (state.status & ~(MODES | TUNE_ERROR)) | TUNING
    state.tune_phase = OBSERVING
    state.tune_done = NOTHING
    state.tune_out = state.out
    state.tune_step = 0.0
    begin_noise(state)


def restore_output(state: State) -> None:
    """The controller continues from the output before the autotune; its bias is unchanged."""
    state.out = state.tune_out
    state.pending |= NO_PAST
    state.tune_phase = IDLE


def abandon_autotune(state: State) -> None:
    """The autotune ends without results."""
    restore_output(state)
    state.tune_done = CANCELLED


def fail_autotune(state: State, reason: int) -> None:
    """Back to Auto with the gains of before."""
    restore_output(state)
    state.tune_done = FAILED
    state.status = (state.status & ~MODES) | AUTO | TUNE_ERROR
    state.requested_mode = 0
    state.notice = add_notice(state.notice, 0, reason)


def change_rate(state: State) -> None:
    """Another sample rate has been written: samples of two rates make no curve and no cycle (D695)."""
    if state.status & TUNING:
        fail_autotune(state, TUNE_RATE)


def write_results(config: Config, state: State, gain: float, reset: float, rate: float, seconds: float) -> None:
    """Write the results, within what the registers hold, and return to Auto."""
    state.gain = single(clamp(gain, MIN_GAIN, MAX_GAIN))
    state.reset = single(clamp(reset, MIN_RESET, MAX_RESET))
    state.rate = single(clamp(rate, MIN_RATE, MAX_RATE))
    state.sample_ms = int(clamp(round_half_even(seconds * 1000.0), MIN_MS, MAX_MS))
    state.period = state.sample_ms * 1000
    calculate_gains(config, state)
    restore_output(state)
    state.tune_done = DONE
    state.status = (state.status & ~MODES) | AUTO


# --- Autotune of the CLICK, sample by sample: the noise, then the step response (D123) or the relay (D124) ------------
#
# The output is in %, the PV in its units, so the gain is % per unit; responses count as shares of the PV limits.

RESOLUTION = 1.0 / 4000.0
"""Resolution of the PV, as a share of its range."""
MIN_SWING = 1e-6
"""Least amplitude of a cycle, as a share of the PV's range."""


def step_output(config: Config, state: State) -> None:
    """Step the output by another 10 % of its range: up, or down where the way up is too short."""
    span = config.out_high - config.out_low
    if state.tune_step == 0.0:
        state.tune_step = STEP_SHARE if state.tune_out + 2.0 * STEP_SHARE * span <= config.out_high else -STEP_SHARE
    else:
        state.tune_step += state.tune_step
    state.out = single(state.tune_out + state.tune_step * span)
    state.tune_phase = RESPONSE
    begin_curve(state)


def begin_relay(state: State) -> None:
    """The first switch follows at the next sample."""
    state.tune_phase = SWITCHING
    begin_cycle(state)


def step_sign(config: Config, state: State) -> float:
    """1 when the step moves the PV up, else -1."""
    return 1.0 if (state.tune_step > 0.0) == (config.reverse == 0) else -1.0


def measure_response(config: Config, state: State, aux: list[float], change: float) -> None:
    """Slope and dead time of the recorded response, and the gains they give."""
    slope, dead = steepest_line(state, config.tune_buffer, aux, change)
    if slope <= 0.0:
        fail_autotune(state, TUNE_NO_RESPONSE)
        return
    if was_moving(state, slope, 0.0):
        state.notice = add_notice(state.notice, 0, TUNE_MOVING)
    gain, reset, rate, sample = curve_gains(
        config.tune_pi, STEP_SHARE * (config.out_high - config.out_low) / (dead * slope), dead
    )
    write_results(config, state, gain, reset, rate, sample)


def record_response(config: Config, state: State, aux: list[float]) -> None:
    """One sample of the step response, until there is enough of it or it has settled."""
    if not record_point(state, config.tune_buffer, aux, step_sign(config, state) * (state.pv - state.tune_base)):
        return
    span = config.pv_high - config.pv_low
    is_second_step = int(abs(state.tune_step) > STEP_SHARE)
    count = span * RESOLUTION
    verdict, change = judge_response(state, config.tune_buffer, aux, span, count, count, is_second_step)
    if verdict == ANSWERED:
        measure_response(config, state, aux, change)
    elif verdict == TOO_SMALL:
        state.tune_base += step_sign(config, state) * change
        step_output(config, state)
    elif verdict == NO_ANSWER and is_second_step:
        fail_autotune(state, TUNE_NO_RESPONSE)
    elif verdict == NO_ANSWER:
        step_output(config, state)


def run_relay(config: Config, state: State) -> None:
    """One sample of the relay, whose hysteresis is that of DFn+21 in % of the PV limits."""
    span = config.pv_high - config.pv_low
    band = config.tune_hysteresis * span / 100.0
    side = relay_switch(state, state.pv, state.sp - state.pv, band)
    if side:
        state.out = config.out_high if (side > 0) == (config.reverse == 0) else config.out_low
    if state.tune_turns == LAST_TURN:
        ultimate = ultimate_gain(state, config.out_high - config.out_low, band, MIN_SWING * span * (MIN_SWING * span))
        gain, reset, rate, sample = cycle_gains(config.tune_pi, ultimate, cycle_length(state) * state.period / TICKS)
        write_results(config, state, gain, reset, rate, sample)
    elif is_stalled(state, RELAY_PATIENCE_SAMPLES, RELAY_PATIENCE_SECONDS):
        fail_autotune(state, TUNE_NO_RESPONSE)


def run_autotune(config: Config, state: State, aux: list[float]) -> None:
    """One sample of the autotune; its limits may be written meanwhile."""
    if not is_tunable(config):
        fail_autotune(state, TUNE_NO_RANGE)
    elif state.tune_phase == OBSERVING:
        if measure_noise(state, state.pv):
            if config.tune_closed:
                begin_relay(state)
            else:
                step_output(config, state)
    elif state.tune_phase == RESPONSE:
        record_response(config, state, aux)
    else:
        run_relay(config, state)
