"""What auto-tunes of several vendors have in common: the reaction curve, noise at rest, the relay."""

from __future__ import annotations

from math import sqrt

from pidcfg.sim.controllers.kernels import CurveState, RelayState
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.tuning import CLOSED_SAMPLE, GENTLE_CLOSED, OPEN_SAMPLE, ZIEGLER_NICHOLS_OPEN

# --- The answer of a process to a step of its input, recorded in little memory: steepest slope and dead time ----------
#
# The response is kept in `POINTS` averages whose width doubles when they are full. Its steepest slope is that of a
# regression line over about a tenth of the response; its dead time ends where this line leaves the PV before the
# step. Kernels; ``first`` is the place of the points in ``aux``.

POINTS = 512
"""Floats of a curve in `aux`."""
STEP_SHARE = 0.10
"""Share of the output's span that it steps by; twice that when the answer is too small."""
MIN_CHANGE_SHARE = 0.02
"""An answer that settles below this share of the span is too small."""
MEASURABLE_SHARE = 0.10
"""A response of this much of the span is enough to measure its slope."""
PATIENCE_SECONDS = 600.0
"""Seconds, or `PATIENCE_SAMPLES` if those last longer, after which a PV that does not move stops the auto-tune."""
PATIENCE_SAMPLES = 256
MAX_DRIFT_SHARE = 0.10
"""Share of the answer's slope by which the PV may move before the step."""
DRIFT_SIGMAS = 4.0 / 340.0**0.5
"""Four standard deviations of the slope a sample, of 16 samples with a noise of 1."""
ROUNDING_SIGMA = 0.3
"""Standard deviation of what rounding to whole counts adds."""
GOES_ON, ANSWERED, TOO_SMALL, NO_ANSWER = 0, 1, 2, 3
"""Results of `judge_response`."""


def begin_curve(state: CurveState) -> None:
    """Before the first sample after the step (kernel)."""
    state.tune_count = 0
    state.tune_points = 0
    state.tune_stride = 1
    state.tune_sum = 0.0


def record_point(state: CurveState, first: int, aux: list[float], rise: float) -> bool:
    """Keep one more sample of the response; True when it completes a point (kernel)."""
    state.tune_count += 1
    state.tune_sum += rise
    if state.tune_count % state.tune_stride:
        return False
    if state.tune_points == POINTS:
        for j in range(POINTS // 2):
            aux[first + j] = (aux[first + 2 * j] + aux[first + 2 * j + 1]) / 2.0
        state.tune_points = POINTS // 2
        state.tune_stride *= 2
        if state.tune_count % state.tune_stride:
            return False
    aux[first + state.tune_points] = state.tune_sum / state.tune_stride
    state.tune_points += 1
    state.tune_sum = 0.0
    return True


def mean_of_points(aux: list[float], first: int, count: int) -> float:
    """The mean of some points (kernel)."""
    total = 0.0
    for j in range(first, first + count):
        total += aux[j]
    return total / count


def first_crossing(state: CurveState, first: int, aux: list[float], level: float) -> int:
    """The first point at or above a level (kernel)."""
    for j in range(state.tune_points):
        if aux[first + j] >= level:
            return j
    return state.tune_points - 1


def steepest_line(state: CurveState, first: int, aux: list[float], change: float) -> tuple[float, float]:
    """Slope a second of the steepest line, 0 when there is none, and the dead time in s, at least a sample (kernel)."""
    rise_needed = max(0.1 * change, min(12.0 * state.tune_noise, 0.2 * change))
    width = first_crossing(state, first, aux, 2.0 * rise_needed) - first_crossing(state, first, aux, rise_needed)
    width = min(max(width, 1), state.tune_points - 1)
    spread = width * (width + 1.0) * (width + 2.0) / 12.0
    max_slope = 0.0
    start = 0
    for j in range(state.tune_points - width):
        slope = 0.0
        for k in range(width + 1):
            slope += (k - width / 2.0) * aux[first + j + k]
        if slope > max_slope:
            max_slope = slope
            start = j
    if max_slope <= 0.0:
        return 0.0, 0.0
    max_slope /= spread
    seconds = state.period / TICKS
    middle = (start + width / 2.0) * state.tune_stride + (state.tune_stride + 1) / 2.0
    dead_time = middle - mean_of_points(aux, first + start, width + 1) / max_slope * state.tune_stride
    return max_slope / (state.tune_stride * seconds), max(dead_time, 1.0) * seconds


def was_moving(state: CurveState, slope: float, count: float) -> bool:
    """Whether the PV moved before the step by a tenth of the ``slope`` a second, and surely (kernel).

    Surely: by four standard deviations of the slope of 16 samples; ``count`` is the resolution of the PV.
    """
    drift = abs(state.tune_drift)
    return drift > MAX_DRIFT_SHARE * slope * (state.period / TICKS) and drift > DRIFT_SIGMAS * max(
        state.tune_noise, ROUNDING_SIGMA * count
    )


def judge_response(
    state: CurveState, first: int, aux: list[float], span: float, count: float, rest_change: float, last_step: int
) -> tuple[int, float]:
    """The judgement of a response at one of its points, and its change so far (kernel).

    ``count`` is the resolution of the PV and ``rest_change`` what a PV at rest may still move; after the ``last_step``
    every answer above the noise counts.
    """
    points = state.tune_points
    window = max(1, points // 12)
    last = first + points
    change = mean_of_points(aux, last - window, window)
    detectable = max(4.0 * count, 6.0 * state.tune_noise)
    if change >= MEASURABLE_SHARE * span and change >= detectable:
        return ANSWERED, change
    if change > detectable and points >= 24:
        moved = change - mean_of_points(aux, last - points // 3, window)
        if moved <= max(MIN_CHANGE_SHARE * change, state.tune_noise, rest_change):
            if last_step or change >= MIN_CHANGE_SHARE * span:
                return ANSWERED, change
            return TOO_SMALL, change
    elif state.tune_count > PATIENCE_SAMPLES and state.tune_count * (state.period / TICKS) > PATIENCE_SECONDS:
        return NO_ANSWER, change
    return GOES_ON, change


# ----------------------------------------------------------------------------------------------------------------------
# What auto-tunes of several vendors have in common: noise at rest, the relay's cycle, and the gains that follow.
# Kernels on the ``tune_`` fields of a loop's state; each vendor moves its output itself.

NOISE_SAMPLES = 16
"""Samples at rest from which the noise of a PV is estimated."""
TIME_SQUARE_SUM = NOISE_SAMPLES * (NOISE_SAMPLES * NOISE_SAMPLES - 1) / 12.0
"""Sum of the squares of the samples' distances from the middle one."""
SECOND_DIFFERENCE = 1.9544
"""Mean of |y(n) - 2 y(n-1) + y(n-2)| of white noise in standard deviations: sqrt(6) sqrt(2 / pi)."""
FIRST_TURN, LAST_TURN = 4, 8
"""Switches of a relay between which its swing is measured; the first one only starts the relay."""
PI = 3.141592653589793
RELAY_PATIENCE_SECONDS = 3600.0
"""Seconds, or `RELAY_PATIENCE_SAMPLES` samples if those are longer, after which a relay without a switch is stopped."""
RELAY_PATIENCE_SAMPLES = 1000
NOTHING, DONE, FAILED, CANCELLED = 0, 1, 2, 3
"""How an autotune went, as `RelayState.tune_done`."""
TUNE_STATUS = {DONE: "done", FAILED: "error", CANCELLED: "cancelled"}

CURVE_PI, CURVE_PI_RESET, _ = ZIEGLER_NICHOLS_OPEN["PI"]
CURVE_PID, CURVE_PID_RESET, CURVE_PID_RATE = ZIEGLER_NICHOLS_OPEN["PID"]
CYCLE_PI, CYCLE_PI_RESET, _ = GENTLE_CLOSED["PI"]
CYCLE_PID, CYCLE_PID_RESET, CYCLE_PID_RATE = GENTLE_CLOSED["PID"]
CURVE_PI_SAMPLE, CURVE_PID_SAMPLE = OPEN_SAMPLE["PI"], OPEN_SAMPLE["PID"]
CYCLE_PI_SAMPLE, CYCLE_PID_SAMPLE = CLOSED_SAMPLE["PI"], CLOSED_SAMPLE["PID"]

Gains = tuple[float, float, float, float]
"""Gain, reset and rate in s, and the sample rate in s."""


def begin_noise(state: CurveState) -> None:
    """Before the first sample at rest (kernel)."""
    state.tune_count = 0
    state.tune_sum = 0.0
    state.tune_base = 0.0
    state.tune_drift = 0.0


def measure_noise(state: CurveState, pv: float) -> bool:
    """One more sample at rest (kernel).

    After the last one the noise, from second differences, the mean and the slope of a regression line are known.
    """
    if state.tune_count >= 2:
        state.tune_sum += abs(pv - 2.0 * state.tune_pv_1 + state.tune_pv_2)
    state.tune_pv_2 = state.tune_pv_1
    state.tune_pv_1 = pv
    state.tune_base += pv
    state.tune_drift += (state.tune_count - (NOISE_SAMPLES - 1) / 2.0) * pv
    state.tune_count += 1
    if state.tune_count < NOISE_SAMPLES:
        return False
    state.tune_noise = state.tune_sum / (NOISE_SAMPLES - 2.0) / SECOND_DIFFERENCE
    state.tune_base /= NOISE_SAMPLES
    state.tune_drift /= TIME_SQUARE_SUM
    return True


def begin_cycle(state: RelayState) -> None:
    """The relay has not switched yet (kernel)."""
    state.tune_count = 0
    state.tune_turns = 0
    state.tune_relay_sign = 0
    state.tune_points = 0
    state.tune_swing = 0.0


def relay_switch(state: RelayState, pv: float, error: float, band: float) -> int:
    """One sample under the relay: 0, or the sign of the error that switches it, once beyond the band (kernel)."""
    state.tune_count += 1
    if state.tune_turns:
        state.tune_high = max(state.tune_high, pv)
        state.tune_low = min(state.tune_low, pv)
    side = 0
    if state.tune_relay_sign == 0:
        side = -1 if error < 0.0 else 1
    elif state.tune_relay_sign > 0 and error < -band:
        side = -1
    elif state.tune_relay_sign < 0 and error > band:
        side = 1
    if side == 0:
        return 0
    state.tune_relay_sign = side
    state.tune_turns += 1
    state.tune_points = state.tune_count
    if state.tune_turns == FIRST_TURN:
        state.tune_start = state.tune_count
    elif state.tune_turns > FIRST_TURN and state.tune_turns % 2 == 0:
        state.tune_swing += state.tune_high - state.tune_low
    if state.tune_turns % 2 == 0:
        state.tune_high = -1e18
        state.tune_low = 1e18
    return side


def is_stalled(state: RelayState, samples: int, seconds: float) -> bool:
    """Whether the relay has not switched for longer than so many samples and so many seconds, both (kernel)."""
    quiet = state.tune_count - state.tune_points
    return quiet > samples and quiet * (state.period / TICKS) > seconds


def cycle_length(state: RelayState) -> float:
    """Samples of one cycle, at the last switch (kernel)."""
    return (state.tune_count - state.tune_start) / 2.0


def ultimate_gain(state: RelayState, step: float, band: float, min_square: float) -> float:
    """From the describing function of a relay that switches its output by ``step``, at the last switch (kernel).

    ``band`` is its hysteresis, ``min_square`` the least square that is taken for the swing's amplitude without it.
    """
    amplitude = state.tune_swing / 4.0
    return 2.0 * step / (PI * sqrt(max(amplitude * amplitude - band * band, min_square)))


def curve_gains(only_pi: int, gain: float, dead_time: float) -> Gains:
    """Ziegler and Nichols for a reaction curve: ``gain`` is 1 / (dead time x rate) of a unit step (kernel)."""
    if only_pi:
        return CURVE_PI * gain, CURVE_PI_RESET * dead_time, 0.0, CURVE_PI_SAMPLE * dead_time
    return CURVE_PID * gain, CURVE_PID_RESET * dead_time, CURVE_PID_RATE * dead_time, CURVE_PID_SAMPLE * dead_time


def cycle_gains(only_pi: int, gain: float, period: float) -> Gains:
    """The gains for a relay's cycle, of the ultimate gain and its period (kernel)."""
    if only_pi:
        return CYCLE_PI * gain, CYCLE_PI_RESET * period, 0.0, CYCLE_PI_SAMPLE * period
    return CYCLE_PID * gain, CYCLE_PID_RESET * period, CYCLE_PID_RATE * period, CYCLE_PID_SAMPLE * period
