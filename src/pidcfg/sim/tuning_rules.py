"""What auto-tunes of several vendors have in common: noise at rest, the relay's cycle, and the gains that follow.

Kernels on the ``tune_`` fields of a loop's state; each vendor moves its output itself.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

from pidcfg.sim.plc import TICKS
from pidcfg.tuning.rules import CLOSED_SAMPLE, GENTLE_CLOSED, OPEN_SAMPLE, ZIEGLER_NICHOLS_OPEN

OBSERVED = 16
"""Samples at rest from which the noise of a PV is estimated."""
SPREAD = OBSERVED * (OBSERVED * OBSERVED - 1) / 12.0
"""Sum of the squares of the samples' distances from the middle one."""
SECOND_DIFFERENCE = 1.9544
"""Mean of |y(n) - 2 y(n-1) + y(n-2)| of white noise in standard deviations: sqrt(6) sqrt(2 / pi)."""
FIRST_TURN, LAST_TURN = 4, 8
"""Switches of a relay between which its swing is measured; the first one only starts the relay."""
PI = 3.141592653589793
RELAY_PATIENCE = 3600.0
"""Seconds, or `RELAY_PATIENT` samples if those are longer, after which a relay without a switch is stopped."""
RELAY_PATIENT = 1000
NOTHING, DONE, FAILED, CANCELLED = 0, 1, 2, 3
"""How an autotune went, as `RelayState.tune_done`."""
TUNE_STATUS = {DONE: "done", FAILED: "error", CANCELLED: "cancelled"}

if TYPE_CHECKING:
    from pidcfg.sim.records import CurveState, RelayState

CURVE_PI, CURVE_PI_RESET, _ = ZIEGLER_NICHOLS_OPEN["PI"]
CURVE_PID, CURVE_PID_RESET, CURVE_PID_RATE = ZIEGLER_NICHOLS_OPEN["PID"]
CYCLE_PI, CYCLE_PI_RESET, _ = GENTLE_CLOSED["PI"]
CYCLE_PID, CYCLE_PID_RESET, CYCLE_PID_RATE = GENTLE_CLOSED["PID"]
CURVE_PI_SAMPLE, CURVE_PID_SAMPLE = OPEN_SAMPLE["PI"], OPEN_SAMPLE["PID"]
CYCLE_PI_SAMPLE, CYCLE_PID_SAMPLE = CLOSED_SAMPLE["PI"], CLOSED_SAMPLE["PID"]

Gains = tuple[float, float, float, float]
"""Gain, reset and rate in s, and the sample rate in s."""


def begin_noise(s: CurveState) -> None:
    """Before the first sample at rest (kernel)."""
    s.tune_count = 0
    s.tune_sum = 0.0
    s.tune_base = 0.0
    s.tune_drift = 0.0


def measure_noise(s: CurveState, p: float) -> bool:
    """One more sample at rest (kernel).

    After the last one the noise, from second differences, the mean and the slope of a regression line are known.
    """
    if s.tune_count >= 2:
        s.tune_sum += abs(p - 2.0 * s.tune_a + s.tune_b)
    s.tune_b = s.tune_a
    s.tune_a = p
    s.tune_base += p
    s.tune_drift += (s.tune_count - (OBSERVED - 1) / 2.0) * p
    s.tune_count += 1
    if s.tune_count < OBSERVED:
        return False
    s.tune_noise = s.tune_sum / (OBSERVED - 2.0) / SECOND_DIFFERENCE
    s.tune_base /= OBSERVED
    s.tune_drift /= SPREAD
    return True


def begin_cycle(s: RelayState) -> None:
    """The relay has not switched yet (kernel)."""
    s.tune_count = 0
    s.tune_turns = 0
    s.tune_side = 0
    s.tune_points = 0
    s.tune_swing = 0.0


def relay_switch(s: RelayState, p: float, e: float, band: float) -> int:
    """One sample under the relay: 0, or the sign of the error that switches it, once beyond the band (kernel)."""
    s.tune_count += 1
    if s.tune_turns:
        s.tune_high = max(s.tune_high, p)
        s.tune_low = min(s.tune_low, p)
    side = 0
    if s.tune_side == 0:
        side = -1 if e < 0.0 else 1
    elif s.tune_side > 0 and e < -band:
        side = -1
    elif s.tune_side < 0 and e > band:
        side = 1
    if side == 0:
        return 0
    s.tune_side = side
    s.tune_turns += 1
    s.tune_points = s.tune_count
    if s.tune_turns == FIRST_TURN:
        s.tune_start = s.tune_count
    elif s.tune_turns > FIRST_TURN and s.tune_turns % 2 == 0:
        s.tune_swing += s.tune_high - s.tune_low
    if s.tune_turns % 2 == 0:
        s.tune_high = -1e18
        s.tune_low = 1e18
    return side


def stalled(s: RelayState, samples: int, seconds: float) -> bool:
    """Whether the relay has not switched for longer than so many samples and so many seconds, both (kernel)."""
    quiet = s.tune_count - s.tune_points
    return quiet > samples and quiet * (s.period / TICKS) > seconds


def cycle_length(s: RelayState) -> float:
    """Samples of one cycle, at the last switch (kernel)."""
    return (s.tune_count - s.tune_start) / 2.0


def ultimate_gain(s: RelayState, step: float, band: float, least: float) -> float:
    """From the describing function of a relay that switches its output by ``step``, at the last switch (kernel).

    ``band`` is its hysteresis, ``least`` the least square that is taken for the swing's amplitude without it.
    """
    half = s.tune_swing / 4.0
    return 2.0 * step / (PI * sqrt(max(half * half - band * band, least)))


def curve_gains(only_pi: int, gain: float, dead: float) -> Gains:
    """Ziegler and Nichols for a reaction curve: ``gain`` is 1 / (dead time x rate) of a unit step (kernel)."""
    if only_pi:
        return CURVE_PI * gain, CURVE_PI_RESET * dead, 0.0, CURVE_PI_SAMPLE * dead
    return CURVE_PID * gain, CURVE_PID_RESET * dead, CURVE_PID_RATE * dead, CURVE_PID_SAMPLE * dead


def cycle_gains(only_pi: int, gain: float, period: float) -> Gains:
    """The gains for a relay's cycle, of the ultimate gain and its period (kernel)."""
    if only_pi:
        return CYCLE_PI * gain, CYCLE_PI_RESET * period, 0.0, CYCLE_PI_SAMPLE * period
    return CYCLE_PID * gain, CYCLE_PID_RESET * period, CYCLE_PID_RATE * period, CYCLE_PID_SAMPLE * period
