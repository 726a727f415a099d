"""What a neutral loop knows and calculates: its records, the ideal PID, alarms and pulses."""

from __future__ import annotations

from collections.abc import MutableSequence
from dataclasses import dataclass
from math import isfinite, sqrt

from pidcfg.sim.controllers.kernels import LoopConfig, LoopState, add_notice, clamp, register, renew_alarm, step_to

# --- The records of a neutral loop: `Config` (what it reads) and `State` (what it writes) -----------------------------
#
# Everything is an int or a float: the same fields become a NumPy record for numba. The clock is in ticks of a
# microsecond.

# `State.status`
MANUAL, AUTO, CASCADE = 1, 2, 4
MODES = MANUAL | AUTO | CASCADE
LIMITED = 8
"""What the equation makes of OUT is beyond a limit."""
SLOWED = 16
"""OUT moves as fast as it may."""
TRACKING = 32
"""OUT is the set point of a slave that is not in cascade (D302)."""
IN_DEAD_BAND = 64
"""The error is inside the dead band."""
LOW_LOW, LOW, HIGH, HIGH_HIGH = 128, 256, 512, 1024
DEVIATION, DEVIATION_2, RATE = 2048, 4096, 8192

# `State.pending`
NO_PAST = 1
"""There was no sample yet."""
REQUEST = 2
"""`State.wanted_mode` is another mode."""
BUMPLESS = 4
"""The next calculation goes on from OUT (D301)."""
MANUAL_SET = 8
"""`State.manual_output` has been set since manual was requested."""
SP_SET = 16
"""The set point has been set since the mode was requested."""

UNBOUNDED = float("inf")
"""An alarm point that no value reaches."""


@dataclass(slots=True)
class Config(LoopConfig):
    """What a loop only reads."""

    pulse_slot: int = 5
    output_raises_pv: int = register("output_raises_pv", 1)
    proportional_on: int = register("tuning.proportional", 1)
    derivative_on_error: int = register("tuning.derivative_on", 0, equals="error")
    square_root: int = register("pv.square_root", 0)
    without_anti_windup: int = register("anti_windup", 0, equals=False)
    """There is no anti-windup."""
    master: int = -1
    """The master's number; -1: none."""
    first_slave: int = -1
    """Number of the first loop whose master this one is; -1: none."""
    sp_follows_pv: int = 0
    """On the way from manual to auto the set point becomes the PV."""
    has_pulses: int = 0
    pv_low: float = register("pv.range.0", 0.0)
    pv_span: float = 1.0
    sp_low: float = register("setpoint.limits.0", -UNBOUNDED)
    sp_high: float = register("setpoint.limits.1", UNBOUNDED)
    limit_low: float = 0.0
    limit_high: float = 100.0
    deadband: float = register("deadband", 0.0)
    out_low: float = register("output.range.0", 0.0)
    out_span: float = 100.0
    rate_limit: float = UNBOUNDED
    """Fastest change of OUT in a sample."""
    low_low_at: float = register("alarms.pv.low_low", -UNBOUNDED)
    low_at: float = register("alarms.pv.low", -UNBOUNDED)
    high_at: float = register("alarms.pv.high", UNBOUNDED)
    high_high_at: float = register("alarms.pv.high_high", UNBOUNDED)
    deviation_at: float = register("alarms.deviation.high", UNBOUNDED)
    deviation_2_at: float = register("alarms.deviation.high_high", UNBOUNDED)
    rate_at: float = UNBOUNDED
    """Fastest change of the PV in a sample."""
    hysteresis: float = register("alarms.hysteresis", 0.0)
    cycle: float = 0.0
    """Period of the pulses in ticks; likewise the next two."""
    min_on: float = 0.0
    min_off: float = 0.0


@dataclass(slots=True)
class State(LoopState):
    """What a loop writes; ``kp``, ``ki`` and ``kd`` are the factors of the error, its sum and its difference."""

    gain: float = register("tuning.gain", 0.0)
    reset: float = register("tuning.integral_time", 0.0)
    rate: float = register("tuning.derivative_time", 0.0)
    wanted_mode: int = AUTO
    """The mode that was requested last."""
    manual_output: float = 0.0
    """OUT in manual."""
    bias: float = register("output.bias", 0.0)
    integral: float = 0.0
    pv_share: float = 1.0
    """What the PV's filter takes of a difference; likewise that of the derivative."""
    derivative_share: float = 1.0
    error: float = 0.0
    """The error as it counts."""
    previous_error: float = 0.0
    """That of the sample before, likewise the PV."""
    previous_pv: float = 0.0
    filtered_difference: float = 0.0
    cycle_start: int = 0
    cycle_end: int = 0
    on_time: float = 0.0
    """How long the pulse of this cycle is, in ticks."""
    last_tick: int = 0
    """The base step before."""


# --- The ideal PID in double precision (D299), its anti-windup (D300) and its bumpless changes (D301) -----------------
#
# Plain functions of records and numbers, which numba compiles as they are. D numbers: see
# `pidcfg.encoders.generic.image`.

NOTABLE_JUMP_SHARE = 0.01
"""Share of the way between the limits that OUT moves by at most without a word when manual ends."""
OUTPUT_JUMPS = 1
"""Notice of `calculate_output`."""


def measure_pv(config: Config, state: State, raw: float) -> None:
    """The PV: root, then filter."""
    pv = raw
    if config.square_root:
        share = (raw - config.pv_low) / config.pv_span
        pv = config.pv_low + config.pv_span * sqrt(share) if share > 0.0 else config.pv_low
    if state.pending & NO_PAST:
        state.pv = pv
        state.previous_pv = pv
    else:
        state.previous_pv = state.pv
        state.pv = state.pv + (pv - state.pv) * state.pv_share if state.pv_share < 1.0 else pv


def calculate_error(config: Config, state: State) -> None:
    """The error as it counts, and that of the sample before."""
    error = state.sp - state.pv if config.output_raises_pv else state.pv - state.sp
    if abs(error) < config.deadband:
        error = 0.0
        state.status |= IN_DEAD_BAND
    else:
        state.status &= ~IN_DEAD_BAND
    state.previous_error = error if state.pending & NO_PAST else state.error
    state.error = error


def calculate_derivative(config: Config, state: State) -> float:
    """D, of the error or of the PV: Kd times its difference, after the derivative's filter."""
    if config.derivative_on_error:
        change = state.error - state.previous_error
    elif config.output_raises_pv:
        change = state.previous_pv - state.pv
    else:
        change = state.pv - state.previous_pv
    if state.derivative_share < 1.0:
        change = state.filtered_difference + (change - state.filtered_difference) * state.derivative_share
    state.filtered_difference = change
    return state.kd * change


def restore_integral(state: State, proportional_term: float, derivative_term: float) -> None:
    """The integral with which the equation makes the present OUT."""
    integral = ((state.out - proportional_term) - derivative_term) - state.bias
    state.integral = integral if state.ki > 0.0 and isfinite(integral) else 0.0


def move_output(config: Config, state: State, target: float) -> None:
    """OUT towards a value, as fast as it may, within the limits."""
    output = step_to(state.out, target, config.rate_limit)
    if output != target:
        state.status |= SLOWED
    else:
        state.status &= ~SLOWED
    state.out = clamp(output, config.limit_low, config.limit_high)


def limit_output(config: Config, state: State, output: float) -> float:
    """A value within the limits of OUT."""
    if config.limit_low <= output <= config.limit_high:
        state.status &= ~LIMITED
        return output
    state.status |= LIMITED
    return clamp(output, config.limit_low, config.limit_high)


def output_manual(config: Config, state: State, proportional_term: float, derivative_term: float) -> None:
    """OUT is what the operator wants."""
    move_output(config, state, limit_output(config, state, state.manual_output))
    restore_integral(state, proportional_term, derivative_term)


def calculate_output(config: Config, state: State, proportional_term: float, derivative_term: float) -> None:
    """OUT = P + I + D + BIAS, where I sums Ki e (D299)."""
    # I. D301: bumpless first calculation
    previous_output = state.out
    step = state.ki * state.error
    if state.pending & BUMPLESS:
        restore_integral(state, proportional_term, derivative_term)
        step = 0.0
    integral = state.integral + step if state.ki > 0.0 else 0.0
    output = ((proportional_term + integral) + derivative_term) + state.bias
    if not isfinite(output):
        return
    # D300: anti-windup at limits
    if config.without_anti_windup or not (
        (output > config.limit_high and step > 0.0) or (output < config.limit_low and step < 0.0)
    ):
        state.integral = integral
    move_output(config, state, limit_output(config, state, output))
    if (
        state.pending & BUMPLESS
        and state.ki <= 0.0
        and abs(state.out - previous_output) > NOTABLE_JUMP_SHARE * (config.limit_high - config.limit_low)
    ):
        state.notice = add_notice(state.notice, 0, OUTPUT_JUMPS)
    state.pending &= ~BUMPLESS


# --- Alarms and the pulse output of a neutral loop (both: D303) -------------------------------------------------------

FOREVER = float("inf")


def renew_alarms(config: Config, state: State) -> None:
    """Renew the alarms (kernel)."""
    status = renew_alarm(state.status, LOW_LOW, config.low_low_at - state.pv, config.hysteresis)
    status = renew_alarm(status, LOW, config.low_at - state.pv, config.hysteresis)
    status = renew_alarm(status, HIGH, state.pv - config.high_at, config.hysteresis)
    status = renew_alarm(status, HIGH_HIGH, state.pv - config.high_high_at, config.hysteresis)
    away = abs(state.sp - state.pv)
    status = renew_alarm(status, DEVIATION, away - config.deviation_at, config.hysteresis)
    status = renew_alarm(status, DEVIATION_2, away - config.deviation_2_at, config.hysteresis)
    state.status = renew_alarm(status, RATE, abs(state.pv - state.previous_pv) - config.rate_at, 0.0)


def begin_cycle(tick: int, config: Config, state: State) -> None:
    """The next period follows the last one without a gap, unless that one is long over (kernel)."""
    start = state.cycle_end
    if tick - start >= config.cycle:
        start = tick
    state.cycle_start = start
    state.cycle_end = start + int(config.cycle)
    on = (state.out - config.out_low) / config.out_span * config.cycle
    if on <= 0.0 or on < config.min_on:
        on = 0.0
    elif config.cycle - on < config.min_off or on >= config.cycle:
        on = FOREVER
    state.on_time = on


def set_pulse(tick: int, config: Config, state: State, signals: MutableSequence[float]) -> None:
    """The output for the base step that begins now: what it is in the middle of that step (kernel)."""
    half = (tick - state.last_tick) / 2.0
    state.last_tick = tick
    if tick >= state.cycle_end:
        begin_cycle(tick, config, state)
    passed = tick - state.cycle_start + half
    signals[config.pulse_slot] = 1.0 if state.on_time > 0.0 and passed <= state.on_time else 0.0
