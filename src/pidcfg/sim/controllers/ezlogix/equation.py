"""What an EZLogix loop knows and calculates: its records, the position equation, signals, pulses and its autotune."""

from __future__ import annotations

from collections.abc import MutableSequence
from dataclasses import dataclass

from pidcfg.encoders.maps.ezlogix import DUTY_COUNTS, HUNDREDTHS, TENTHS, maximum
from pidcfg.schemas.ezlogix import CV_FULL, DERIVATIVE, GAIN, INTEGRAL
from pidcfg.sim.controllers.autotune import (
    begin_curve,
    begin_noise,
    curve_gains,
    mean_of_points,
    measure_noise,
    record_point,
    steepest_line,
    was_moving,
)
from pidcfg.sim.controllers.kernels import (
    ROUNDING_MAGIC,
    CountsConfig,
    CurveState,
    add_notice,
    register,
    round_half_even,
)
from pidcfg.sim.controllers.plc import TICKS

# ----------------------------------------------------------------------------------------------------------------------
# Records of an EZLogix loop: `Config` (registers and dialog, fixed during a run) and `State` (what the PLC writes).
# Registers are held as floats with whole values, in counts; gains and times in their units, the clock in ticks of a
# microsecond. Everything is an int or a float: the same fields become a NumPy record for numba.

UNBOUNDED = 1e18
"""Longer than any cycle."""

# `State.status`
MANUAL, AUTO = 1, 2
MODES = MANUAL | AUTO
SATURATED = 4
"""Discrete +3: the CV is 0 or 4095."""
TUNING = 8
"""An autotune collects or calculates."""
TUNE_ERROR = 16
"""The last autotune ended with an error."""

# What is pending besides the equation (`State.pending`)
STOPPED = 1
"""The PLC is stopped and the loop with it."""
PV_STALE = 2
"""The PLC is stopped and nothing writes the PV's register."""
OUTPUT_CUT = 4
"""The PLC is stopped and nothing carries the CV to an output."""
NO_PAST = 8
"""First calculation in Auto: the integral term follows the CV, and nothing has a past."""
REQUEST = 16
"""Discrete +0 has been written: `State.wanted_mode`."""
TUNE = 32
"""An autotune is started, cancelled, or runs."""
CV_HELD = 64
"""The autotune has taken the CV over."""


@dataclass(slots=True)
class Config(CountsConfig):
    """One loop's registers and dialog."""

    runs_when_stopped: int = 0
    """The dialog's "Process PID when PLC is Stopped"."""
    inner_loop: int = -1
    """The loop whose set point register is this one's CV tag (D177); -1: none."""
    outer_loop: int = -1
    """The loop whose CV tag is this one's set point register (D177); -1: none."""
    error_slot: int = 5
    status_slot: int = 6
    pulse_slot: int = 7
    countdown_slot: int = 8
    # set point and error
    direct: int = register("action", 0, equals="direct")
    """The controller's action: direct is E = PV - SP, reverse E = SP - PV."""
    square_root: int = register("square_root", 0)
    """The square root of the PV is used (D163)."""
    scale: float = 1.0
    """What makes a difference of roots an error in counts."""
    deadband: float = register("deadband", 0.0)
    """On the set point's scale."""
    sp_low: float = register("setpoint_low", 0.0)
    sp_high: float = register("setpoint_high", 4095.0)
    # equation
    velocity: int = register("algorithm", 0, equals="velocity")
    """The derivative acts on the PV."""
    anti_windup: int = register("anti_windup", 0)
    offset: float = register("cv_offset", 0.0)
    cv_low_limit: float = 0.0
    """CV limits, within 0 to 4095."""
    cv_high_limit: float = 4095.0
    # control output; 0: it is not enabled, or its cycle time is 0
    cycle: int = 0
    """Ticks of a cycle."""
    min_on: int = 0
    min_off: int = 0
    # autotune
    tune_pi: int = register("tuning_type", 0)
    timeout: int = 600_000_000
    """In ticks."""


@dataclass(slots=True)
class State(CurveState):
    """One loop's registers and memory that the PLC writes."""

    wanted_mode: int = MANUAL
    """Discrete +0."""
    error: float = 0.0
    """Base+11, with its sign."""
    # gains: the registers, and the factors calculated from them
    gain: float = 0.0
    """Kp."""
    # past
    integral: float = 0.0
    """The integral term in counts of the CV."""
    derivative_input_1: float = 0.0
    """What the derivative acts on, at n-1."""
    unlimited_cv: float = 0.0
    """The CV before its limits, which anti-windup looks at."""
    # control output
    last_tick: int = 0
    """Tick of the last look."""
    cycle_start: int = 0
    cycle_end: int = 0
    on_time: float = 0.0
    """On-time of this cycle in ticks."""
    # autotune
    tune_command: int = 0
    """What became of discrete +4 since the last sample: 1 on, 2 off."""
    tune_status: int = 0
    """Base+12."""
    last_tune_status: int = 0
    """How the last autotune ended, as Base+12 tells it."""
    tune_countdown: int = 0
    """Base+13: the countdown, in ticks."""
    tune_change: float = 0.0
    """How far the PV has come."""
    tune_gain: float = 0.0
    """Result of the last successful autotune, as in the register; likewise the next two."""
    tune_reset: float = 0.0
    tune_rate: float = 0.0


# --- The PID equation of the EZLogix: the position form, with the derivative of the error or of the PV ----------------
#
# The engine works in counts: an error in counts of the PV times the gain is the CV in counts. The manual: 6.1, PID
# Algorithms used in EZLogix, and 6.2, PID Setup.

FULL_CV = float(CV_FULL)
"""Counts of the CV at 100 %."""
MAX_INTEGRAL = 2147483647.0
"""The integral term stays within a signed 32-bit number (D166)."""


def calculate_gains(state: State) -> None:
    """The factors of the equation: Kp, Kp Ts/Ti and Kp Td/Ts.

    A gain of 0 takes the proportional term out and leaves Ts/Ti and Td/Ts (D160).
    """
    # PID Parameters: Proportional Gain Kp, Integral Time Ti, Derivative Time Td, Sample Rate Ts
    seconds = state.period / TICKS
    factor = state.gain if state.gain > 0.0 else 1.0
    state.kp = state.gain
    state.ki = factor * seconds / state.reset if state.reset > 0.0 else 0.0
    state.kd = factor * state.rate / seconds


def begin_auto(config: Config, state: State, derivative_input: float) -> None:
    """Manual to Auto: the integral term becomes what the CV is without its offset, and nothing has a past (D165)."""
    state.integral = state.out - config.offset
    state.unlimited_cv = state.out
    state.derivative_input_1 = derivative_input
    state.pending &= ~NO_PAST


def integrate_error(config: Config, state: State, error: float) -> None:
    """Kp Ts/Ti times one more error; with anti-windup not while the CV is saturated on the error's side (D167)."""
    # Anti-Windup: nothing is added that drives the CV further into saturation
    change = state.ki * error
    if config.anti_windup and (
        (change > 0.0 and state.unlimited_cv >= FULL_CV) or (change < 0.0 and state.unlimited_cv <= 0.0)
    ):
        return
    total = state.integral + change
    if total > MAX_INTEGRAL:
        total = MAX_INTEGRAL
    elif total < -MAX_INTEGRAL:
        total = -MAX_INTEGRAL
    state.integral = total


def calculate_cv(config: Config, state: State, error: float, derivative_input: float) -> None:
    """CV(n) = Kp [E(n) + Ts/Ti sum E + Td/Ts (x(n) - x(n-1))] + CV0, then saturation, then the CV limits.

    x, ``derivative_input``, is the error, or the PV with the error's sign (D161).
    """
    # PID Loop Mode: from manual to auto
    if state.pending & NO_PAST:
        begin_auto(config, state, derivative_input)
    if state.ki > 0.0:
        integrate_error(config, state, error)
    else:
        state.integral = 0.0
    # Position Algorithm and Velocity Algorithm; CV0 is the CV Offset
    cv = state.kp * error + state.integral + state.kd * (derivative_input - state.derivative_input_1) + config.offset
    state.derivative_input_1 = derivative_input
    # Saturation at 0 and 4095. D168: the CV is whole counts
    if cv >= FULL_CV:
        cv = FULL_CV
    elif cv > 0.0:
        cv = cv + ROUNDING_MAGIC - ROUNDING_MAGIC
    else:
        cv = 0.0
    state.unlimited_cv = cv
    # CV Low Limit and CV High Limit
    if cv > config.cv_high_limit:
        cv = config.cv_high_limit
    if cv < config.cv_low_limit:
        cv = config.cv_low_limit
    state.out = cv


# --- The signals of an EZLogix loop: what its registers say, in engineering units -------------------------------------


def show_setpoint(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """The set point within its limits, though the register is written at the next calculation (kernel)."""
    sp = state.sp
    if sp > config.sp_high:
        sp = config.sp_high
    if sp < config.sp_low:
        sp = config.sp_low
    if config.square_root:
        sp *= sp
    signals[config.sp_slot] = config.pv_low + (sp - config.pv_min) * config.pv_width / config.pv_span


def show_output(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """The CV; one that nothing carries on stays as it is (D672; kernel)."""
    if state.pending & (OUTPUT_CUT | STOPPED) == 0:
        signals[config.out_slot] = config.out_low + state.out * config.out_width / FULL_CV


def show_signals(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """Renew them (kernel); BIAS has no limits (D657)."""
    signals[config.pv_slot] = config.pv_low + (state.pv - config.pv_min) * config.pv_width / config.pv_span
    show_setpoint(config, state, signals)
    show_output(config, state, signals)
    signals[config.bias_slot] = config.out_low + (state.integral + config.offset) * config.out_width / FULL_CV
    signals[config.error_slot] = state.error
    signals[config.status_slot] = state.tune_status * 1.0
    signals[config.countdown_slot] = state.tune_countdown // TICKS * 1.0


# --- The control output of the EZLogix: pulses whose width is proportional to the CV, between samples as well ---------
#
# The on-time of a cycle is taken from the CV at its beginning. Pulses shorter than the minimum on time are left out,
# and so are gaps shorter than the minimum off time (D176). Cycles begin when the PLC starts (D174) and are as fine as
# the base step (D175).

FULL_DUTY = float(DUTY_COUNTS)
"""Counts that are a duty cycle of 100 %."""


def begin_cycle(tick: int, config: Config, state: State) -> None:
    """The next cycle follows the last one without a gap, unless that one is long over."""
    start = state.cycle_end
    if tick - start >= config.cycle:
        start = tick
    state.cycle_start = start
    state.cycle_end = start + config.cycle
    on = state.out * config.cycle / FULL_DUTY
    if on <= 0.0 or on < config.min_on:
        on = 0.0
    elif config.cycle - on < config.min_off:
        on = UNBOUNDED
    state.on_time = on


def set_pulse(tick: int, config: Config, state: State, signals: list[float]) -> None:
    """The output for the base step that begins now: what it is in the middle of that step."""
    middle = tick + (tick - state.last_tick) / 2.0
    state.last_tick = tick
    if middle >= state.cycle_end:
        begin_cycle(tick, config, state)
    signals[config.pulse_slot] = 1.0 if state.on_time > 0.0 and middle - state.cycle_start <= state.on_time else 0.0


# The manual's table of Base+12
IDLE, COLLECTING, CALCULATING, DONE, CANCELLED = 0, 1, 2, 3, 4
NO_STEP, NO_FIT, NO_DIVISOR, NO_DEAD_TIME, OUT_OF_RANGE, NO_MEMORY = 5, 6, 7, 8, 9, 10

OBSERVING, RESPOND, COMPUTE = 1, 2, 3
"""`State.tune_phase`."""
ON, OFF = 1, 2
"""`State.tune_command`."""

STEP_COUNTS = 410.0
"""Counts: 10 % of the CV's range."""
MEASURABLE_SHARE = 0.10
"""An answer of this much of the PV's span is enough to measure its slope."""
MIN_CHANGE_SHARE = 0.02
DETECTABLE_COUNTS = 4.0
"""Counts that the PV must move by to count as an answer, or six standard deviations of its noise."""
RISE_BLOCKS = 6
CLEAR_RISE = 8.0
"""Counts, or eight standard deviations, that make a rise between two of these comparable with others."""
FINAL_CHANGE_FACTOR = 1.5
"""What a first-order answer comes to, once it rises half as fast as it did."""
MIN_SETTLED_POINTS = 24
"""Points without which nothing counts as settled."""
MAX_GAIN, MAX_RESET, MAX_RATE = maximum(GAIN, HUNDREDTHS), maximum(INTEGRAL, TENTHS), maximum(DERIVATIVE, TENTHS)
"""What the registers may hold by the manual."""
REASON_BASE = 32
"""Base+12 as the reason of a notice: it is added to this."""
FAR_FROM_SP, PV_MOVING = 7, 8
"""Reasons of notices: an autotune that begins far from the set point (D622), or on a moving PV (D623)."""
PLC_STOPPED, RATE_WRITTEN = 9, 10
"""Reasons of notices: a stop of the PLC (D173) or another sample rate (D695) has ended an autotune."""
MAX_START_SHARE = 0.10
"""Share of the PV's span."""


def end_autotune(config: Config, state: State, status: int) -> None:
    """End the autotune with the CV of before; a loop in Auto continues with its integral term of before."""
    if state.pending & CV_HELD:
        state.out = state.tune_out
    state.pending &= ~(TUNE | CV_HELD)
    state.status &= ~TUNING
    state.tune_status = status
    state.last_tune_status = status
    state.tune_countdown = config.timeout
    if status > CANCELLED:
        state.status |= TUNE_ERROR


def end_tune(config: Config, state: State, status: int) -> None:
    """End the autotune, and tell of one without results."""
    end_autotune(config, state, status)
    if status != DONE:
        state.notice = add_notice(state.notice, 0, REASON_BASE + status)


def stop_tune(config: Config, state: State) -> None:
    """The PLC runs again: an autotune that it has stopped does not go on, since samples are missing (D173)."""
    if state.status & TUNING:
        end_autotune(config, state, CANCELLED)
        state.notice = add_notice(state.notice, 0, PLC_STOPPED)


def change_rate(config: Config, state: State) -> None:
    """Another sample rate has been written: samples of two rates make no curve (D695)."""
    if state.status & TUNING:
        end_autotune(config, state, NO_FIT)
        state.notice = add_notice(state.notice, 0, RATE_WRITTEN)


def switch_tune(config: Config, state: State) -> None:
    """Discrete +4: on starts, or ends a finished autotune; off cancels one that runs."""
    command = state.tune_command
    state.tune_command = 0
    if state.status & TUNING:
        if command == OFF:
            end_tune(config, state, CANCELLED)
        return
    state.pending &= ~TUNE
    if command == OFF:
        return
    state.status &= ~TUNE_ERROR
    if state.tune_status != IDLE:
        state.tune_status = IDLE
        return
    if state.out + STEP_COUNTS > config.cv_high_limit:
        end_tune(config, state, NO_STEP)
        return
    state.pending |= TUNE | CV_HELD
    state.tune_out = state.out
    state.status |= TUNING
    state.tune_status = COLLECTING
    state.tune_countdown = config.timeout
    state.tune_phase = OBSERVING
    begin_noise(state)
    if abs(state.error) > MAX_START_SHARE * config.pv_span:
        state.notice = add_notice(state.notice, 0, FAR_FROM_SP)


def tell_moving(state: State, slope: float) -> None:
    """Leave a notice when the PV was moving before the step."""
    if was_moving(state, slope, 1.0):
        state.notice = add_notice(state.notice, 0, PV_MOVING)


def are_results_valid(gain: float, reset: float, rate: float, only_pi: int) -> bool:
    """Whether results, in last digits of their registers, lie within the manual's ranges and are not 0."""
    if gain < 1.0 or gain > MAX_GAIN or reset < 1.0 or reset > MAX_RESET or rate > MAX_RATE:
        return False
    return only_pi == 1 or rate >= 1.0


def compute_results(config: Config, state: State, aux: list[float]) -> None:
    """Slope and dead time of the recorded answer, the gains that they give, and their registers."""
    slope, dead = steepest_line(state, config.tune_buffer, aux, state.tune_change)
    tell_moving(state, slope)
    if slope <= 0.0:
        end_tune(config, state, NO_DIVISOR)
        return
    gain, reset, rate, _ = curve_gains(config.tune_pi, STEP_COUNTS / (dead * slope), dead)
    gain = round_half_even(gain * 100.0)
    reset = round_half_even(reset * 10.0)
    rate = round_half_even(rate * 10.0)
    if not are_results_valid(gain, reset, rate, config.tune_pi):
        end_tune(config, state, OUT_OF_RANGE)
        return
    state.gain = gain / 100.0
    state.reset = reset / 10.0
    state.rate = rate / 10.0
    state.tune_gain = state.gain
    state.tune_reset = state.reset
    state.tune_rate = state.rate
    calculate_gains(state)
    end_tune(config, state, DONE)


def is_flattening(state: State, first: int, aux: list[float]) -> bool:
    """Whether the answer rises half as fast as it did, between sixths of it: the steepest slope lies behind."""
    width = state.tune_points // RISE_BLOCKS
    start = first + state.tune_points - width
    later_mean = mean_of_points(aux, start, width)
    last_rise = 0.0
    max_rise = 0.0
    for j in range(1, RISE_BLOCKS):
        earlier_mean = mean_of_points(aux, start - j * width, width)
        rise = later_mean - earlier_mean
        later_mean = earlier_mean
        if j == 1:
            last_rise = rise
        if rise > max_rise:
            max_rise = rise
    return max_rise > max(CLEAR_RISE, 8.0 * state.tune_noise) and last_rise <= max_rise / 2.0


def judge_answer(config: Config, state: State, aux: list[float]) -> int:
    """Whether the answer is complete: 0 not yet, 1 it is, 2 it goes the wrong way."""
    n = state.tune_points
    window = max(1, n // 12)
    last = config.tune_buffer + n
    state.tune_change = mean_of_points(aux, last - window, window)
    change = abs(state.tune_change)
    detectable = max(DETECTABLE_COUNTS, 6.0 * state.tune_noise)
    if change <= detectable:
        return 0
    has_settled = False
    if n >= MIN_SETTLED_POINTS:
        moved = abs(state.tune_change - mean_of_points(aux, last - n // 3, window))
        has_settled = moved <= max(MIN_CHANGE_SHARE * change, state.tune_noise, 1.0)
    if state.tune_change < 0.0:
        return 2 if has_settled else 0
    if has_settled or change >= MEASURABLE_SHARE * config.pv_span:
        return 1
    if n >= MIN_SETTLED_POINTS and is_flattening(state, config.tune_buffer, aux):
        state.tune_change *= FINAL_CHANGE_FACTOR
        return 1
    return 0


def record_response(config: Config, state: State, aux: list[float], x: float) -> None:
    """One sample of the answer to the step."""
    rise = state.tune_base - x if config.direct else x - state.tune_base
    if not record_point(state, config.tune_buffer, aux, rise):
        return
    verdict = judge_answer(config, state, aux)
    if verdict == 1:
        state.tune_status = CALCULATING
        state.tune_phase = COMPUTE
    elif verdict == 2:
        tell_moving(state, 0.0)
        end_tune(config, state, NO_FIT)


def run_autotune(config: Config, state: State, aux: list[float], x: float) -> None:
    """One sample of the autotune; ``x`` is the PV, or its root, in counts of the PV."""
    if state.tune_command:
        switch_tune(config, state)
        if state.status & TUNING == 0:
            return
    if state.tune_phase == COMPUTE:
        compute_results(config, state, aux)
        return
    if state.tune_countdown <= 0:
        detected = state.tune_phase == RESPOND and abs(state.tune_change) > max(
            DETECTABLE_COUNTS, 6.0 * state.tune_noise
        )
        if detected:
            tell_moving(state, 0.0)
        end_tune(config, state, NO_FIT if detected else NO_DEAD_TIME)
        return
    state.tune_countdown -= state.period
    if state.tune_phase == RESPOND:
        record_response(config, state, aux, x)
    elif measure_noise(state, x):
        state.out = state.tune_out + STEP_COUNTS
        state.tune_change = 0.0
        state.tune_phase = RESPOND
        begin_curve(state)
