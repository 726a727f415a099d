"""What an EZLogix loop knows and calculates: its records, the position equation, its signals and pulses."""

from __future__ import annotations

from collections.abc import MutableSequence
from dataclasses import dataclass

from pidcfg.encoders.maps.ezlogix import DUTY_FULL
from pidcfg.schemas.ezlogix import CV_FULL
from pidcfg.sim.controllers.kernels import NEAREST, CountsConfig, CurveState, register
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
FRESH = 8
"""First calculation in Auto: the integral term follows the CV, and nothing has a past."""
REQUEST = 16
"""Discrete +0 has been written: `State.wanted_mode`."""
TUNE = 32
"""An autotune is started, cancelled, or runs."""
HELD = 64
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
    tune_last: int = 0
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

FULL = float(CV_FULL)
"""Counts of the CV at 100 %."""
LARGEST = 2147483647.0
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
    state.pending &= ~FRESH


def integrate_error(config: Config, state: State, error: float) -> None:
    """Kp Ts/Ti times one more error; with anti-windup not while the CV is saturated on the error's side (D167)."""
    # Anti-Windup: nothing is added that drives the CV further into saturation
    change = state.ki * error
    if config.anti_windup and (
        (change > 0.0 and state.unlimited_cv >= FULL) or (change < 0.0 and state.unlimited_cv <= 0.0)
    ):
        return
    total = state.integral + change
    if total > LARGEST:
        total = LARGEST
    elif total < -LARGEST:
        total = -LARGEST
    state.integral = total


def calculate_cv(config: Config, state: State, error: float, derivative_input: float) -> None:
    """CV(n) = Kp [E(n) + Ts/Ti sum E + Td/Ts (x(n) - x(n-1))] + CV0, then saturation, then the CV limits.

    x, ``derivative_input``, is the error, or the PV with the error's sign (D161).
    """
    # PID Loop Mode: from manual to auto
    if state.pending & FRESH:
        begin_auto(config, state, derivative_input)
    if state.ki > 0.0:
        integrate_error(config, state, error)
    else:
        state.integral = 0.0
    # Position Algorithm and Velocity Algorithm; CV0 is the CV Offset
    cv = state.kp * error + state.integral + state.kd * (derivative_input - state.derivative_input_1) + config.offset
    state.derivative_input_1 = derivative_input
    # Saturation at 0 and 4095. D168: the CV is whole counts
    if cv >= FULL:
        cv = FULL
    elif cv > 0.0:
        cv = cv + NEAREST - NEAREST
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
        signals[config.out_slot] = config.out_low + state.out * config.out_width / FULL


def show_signals(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """Renew them (kernel); BIAS has no limits (D657)."""
    signals[config.pv_slot] = config.pv_low + (state.pv - config.pv_min) * config.pv_width / config.pv_span
    show_setpoint(config, state, signals)
    show_output(config, state, signals)
    signals[config.bias_slot] = config.out_low + (state.integral + config.offset) * config.out_width / FULL
    signals[config.error_slot] = state.error
    signals[config.status_slot] = state.tune_status * 1.0
    signals[config.countdown_slot] = state.tune_countdown // TICKS * 1.0


# --- The control output of the EZLogix: pulses whose width is proportional to the CV, between samples as well ---------
#
# The on-time of a cycle is taken from the CV at its beginning. Pulses shorter than the minimum on time are left out,
# and so are gaps shorter than the minimum off time (D176). Cycles begin when the PLC starts (D174) and are as fine as
# the base step (D175).

DUTY = float(DUTY_FULL)
"""Counts that are a duty cycle of 100 %."""


def begin_cycle(tick: int, config: Config, state: State) -> None:
    """The next cycle follows the last one without a gap, unless that one is long over."""
    start = state.cycle_end
    if tick - start >= config.cycle:
        start = tick
    state.cycle_start = start
    state.cycle_end = start + config.cycle
    on = state.out * config.cycle / DUTY
    if on <= 0.0 or on < config.min_on:
        on = 0.0
    elif config.cycle - on < config.min_off:
        on = UNBOUNDED
    state.on_time = on


def pulse(tick: int, config: Config, state: State, signals: list[float]) -> None:
    """The output for the base step that begins now: what it is in the middle of that step."""
    middle = tick + (tick - state.last_tick) / 2.0
    state.last_tick = tick
    if middle >= state.cycle_end:
        begin_cycle(tick, config, state)
    signals[config.pulse_slot] = 1.0 if state.on_time > 0.0 and middle - state.cycle_start <= state.on_time else 0.0
