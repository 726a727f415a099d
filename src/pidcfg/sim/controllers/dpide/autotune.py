"""Autotune of DPIDE, PID_MODE 1: a look at the noise, then a relay around SV (D276); how it ends: D277.

From a cold start the relay begins with heating. The gain is in units of MV per unit of PV.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

from pidcfg.sim.controllers.dpide.equation import LARGEST, coefficients
from pidcfg.sim.controllers.dpide.state import AUTO, FRESH, MANUAL, MODES, TUNE_ERROR
from pidcfg.sim.notices import noticed
from pidcfg.sim.plc import TICKS
from pidcfg.sim.terms import clamp, single
from pidcfg.sim.tuning_rules import FIRST_TURN, LAST_TURN, begin_cycle, begin_listening, listen, switched
from pidcfg.tuning.rules import TYREUS_LUYBEN

if TYPE_CHECKING:
    from pidcfg.sim.controllers.dpide.state import Config, State

LISTENING, SWITCHING = 1, 2
"""`State.tune_phase`."""
NOTHING, DONE, FAILED, CANCELLED = 0, 1, 2, 3
"""`State.tune_done`."""

NO_RANGE, NO_RESPONSE, NO_SWITCH, TOO_FAST, OUT_OF_RANGE = 16, 17, 18, 19, 20
"""Why there is no result."""
ABANDONED = 21
REASONS = {
    NO_RANGE: "autotune stopped: MV_MIN and MV_MAX are the same",
    NO_RESPONSE: "autotune stopped: PV does not answer",
    NO_SWITCH: "autotune stopped: PV does not come to SV",
    TOO_FAST: "autotune stopped: PV swings faster than CYCLE can follow",
    OUT_OF_RANGE: "autotune stopped: a result is no number that its operand can hold",
    ABANDONED: "autotune ended without results",
}

PI = 3.141592653589793
GAIN, RESET, RATE = TYREUS_LUYBEN["PID"]
"""Of the ultimate gain and its period."""
SMOOTHING = 0.1
"""Tf is this share of the derivative time."""
LOUD = 4.0
"""The relay's hysteresis in standard deviations of the noise."""
HEARD = 6.0
"""A PV that moves by this many standard deviations of its noise answers."""
PATIENCE, PATIENT = 600.0, 256
"""Seconds and samples without an answer, both, until a PV that does not move is given up."""
LONGEST, MOST = 14400.0, 1000
"""Seconds and samples, both, until an error that keeps its sign is given up."""
LEAST_PERIOD = 6.0
"""Samples of a cycle without which it is not measured."""


def start_tune(c: Config, s: State) -> None:
    """MV stands still while PV is listened to."""
    s.status &= ~TUNE_ERROR
    s.tune_done = NOTHING
    s.tune_phase = LISTENING
    s.out = clamp(s.out, c.low, c.high)
    begin_listening(s)


def leave(c: Config, s: State, mode: int) -> None:
    """PID_MODE becomes another one; PID_MAN has an effect again."""
    s.mode = mode
    s.wanted = MANUAL if c.manual else AUTO
    s.status = (s.status & ~MODES) | s.wanted
    s.busy |= FRESH


def fail(c: Config, s: State, reason: int) -> None:
    """It ends without results, and everything is as before."""
    s.tune_done = FAILED
    s.tune_reason = reason
    s.status |= TUNE_ERROR
    s.notice = noticed(s.notice, 0, reason)
    leave(c, s, s.mode_before)


def abandon(s: State) -> None:
    """It is ended from outside."""
    s.tune_done = CANCELLED
    s.notice = noticed(s.notice, 0, ABANDONED)


def usable(value: float) -> bool:
    """Whether a result is a number above 0."""
    return 0.0 < value < LARGEST


def store(c: Config, s: State, ultimate: float, period: float, mean: float) -> None:
    """Results to their operands, and I_MV such that the algorithm goes on around the mean MV."""
    gain = single(GAIN * ultimate)
    reset = single(RESET * period)
    rate = single(RATE * period)
    tf = single(SMOOTHING * rate)
    if c.dependent == 0:
        reset = single(gain / reset)
        rate = single(gain * rate)
    if not (usable(gain) and usable(reset) and usable(rate) and usable(tf)):
        fail(c, s, OUT_OF_RANGE)
        return
    s.gain = gain
    s.reset = reset
    s.rate = rate
    s.tf = tf
    s.tune_gain = gain
    s.tune_reset = reset
    s.tune_rate = rate
    s.tune_tf = tf
    coefficients(c, s)
    s.integral = single(single(mean) - c.bias)
    s.tune_done = DONE
    leave(c, s, 0)


def measure(c: Config, s: State) -> None:
    """The ultimate cycle from the relay's, which has come to its end."""
    samples = s.tune_count - s.tune_start
    half = s.tune_swing / 4.0
    if half <= 0.0:
        fail(c, s, NO_RESPONSE)
        return
    if samples / 2.0 < LEAST_PERIOD:
        fail(c, s, TOO_FAST)
        return
    swing = sqrt(max(half * half - s.tune_band * s.tune_band, half * half / 4.0))
    ultimate = 2.0 * (c.high - c.low) / (PI * swing)
    store(c, s, ultimate, samples / 2.0 * (s.period / TICKS), s.tune_sum / samples)


def relay(c: Config, s: State, e: float) -> None:
    """One sample of the relay: MV_MAX while the error is above 0, else MV_MIN."""
    side = switched(s, s.pv, e, s.tune_band)
    if side:
        s.out = c.high if side > 0 else c.low
        s.tune_base = s.pv
        s.tune_moved = 0.0
    if s.tune_turns >= LAST_TURN:
        measure(c, s)
        return
    if s.tune_turns == FIRST_TURN and side:
        s.tune_sum = 0.0
    s.tune_sum += s.out
    s.tune_moved = max(s.tune_moved, abs(s.pv - s.tune_base))
    quiet = s.tune_count - s.tune_points
    time = quiet * (s.period / TICKS)
    if quiet > PATIENT and time > PATIENCE and s.tune_moved <= HEARD * s.tune_noise:
        fail(c, s, NO_RESPONSE)
    elif quiet > MOST and time > LONGEST:
        fail(c, s, NO_SWITCH)


def tune(c: Config, s: State, e: float) -> None:
    """One sample of the autotune; ``e`` is the error without the dead band."""
    if c.low >= c.high:
        fail(c, s, NO_RANGE)
    elif s.tune_phase == LISTENING:
        if listen(s, s.pv):
            s.tune_band = LOUD * s.tune_noise
            s.tune_phase = SWITCHING
            begin_cycle(s)
    else:
        relay(c, s, e)
