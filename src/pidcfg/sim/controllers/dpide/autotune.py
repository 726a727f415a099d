"""Autotune of DPIDE, PID_MODE 1: the noise, then a relay around SV (D276), and the operands at its end (D277).

From a cold start the relay begins with heating. It swings between the limits, and where that makes uneven halves of a
cycle evenly around its mean: an oven that heats much faster than it cools would show a far too long period otherwise.
The gain is in units of MV per unit of PV.
"""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from pidcfg.sim.controllers.autotune import (
    CANCELLED,
    DONE,
    FAILED,
    FIRST_TURN,
    LAST_TURN,
    NOTHING,
    begin_cycle,
    begin_noise,
    cycle_length,
    measure_noise,
    relay_switch,
    stalled,
    ultimate_gain,
)
from pidcfg.sim.controllers.dpide.equation import AUTO, FRESH, MANUAL, MODES, TUNE_ERROR, coefficients
from pidcfg.sim.controllers.kernels import clamp, noticed, single
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.tuning.rules import TYREUS_LUYBEN

if TYPE_CHECKING:
    from pidcfg.sim.controllers.dpide.equation import Config, State

OBSERVING, SWITCHING = 1, 2
"""`State.tune_phase`."""

NO_RANGE, NO_RESPONSE, NO_SWITCH, TOO_FAST, UNEVEN, OUT_OF_RANGE = 16, 17, 18, 19, 20, 21
"""Why there is no result."""
ABANDONED = 22
REASONS = {
    NO_RANGE: "autotune stopped: MV_MIN and MV_MAX are the same",
    NO_RESPONSE: "autotune stopped: PV does not answer",
    NO_SWITCH: "autotune stopped: PV does not come to SV",
    TOO_FAST: "autotune stopped: PV swings faster than CYCLE can follow",
    UNEVEN: "autotune stopped: MV does not swing evenly, a limit is too near the MV that holds SV",
    OUT_OF_RANGE: "autotune stopped: a result is no number that its operand can hold",
    ABANDONED: "autotune ended without results",
}

GAIN, RESET, RATE = TYREUS_LUYBEN["PID"]
"""Of the ultimate gain and its period."""
SMOOTHING = 0.1
"""Tf is this share of the derivative time."""
HYSTERESIS = 4.0
"""The relay's hysteresis in standard deviations of the noise."""
RESPONDS = 6.0
"""A PV that moves by this many standard deviations of its noise answers."""
PATIENCE, PATIENT = 600.0, 256
"""Seconds and samples, both, after which a PV that does not move stops the autotune."""
LONGEST, MOST = 14400.0, 1000
"""Seconds and samples, both, after which an error that keeps its sign stops the autotune."""
BALANCE_TURN = 6
"""Switch at which a whole cycle, from `FIRST_TURN` on, tells the mean MV."""
EVEN, TOLERABLE = 0.1, 0.3
"""How far the share of a cycle in which the error is above 0 may be from a half: without another round, and at all."""
ROUNDS = 4
"""Times that the relay is put around its mean at most."""
LEAST_SWING = 0.005
"""Share of the way between the limits that MV moves from its mean at least."""
LEAST_PERIOD = 6.0
"""Samples of a cycle without which it is not measured."""


def start_tune(c: Config, s: State) -> None:
    """MV is held while the noise of PV is measured."""
    s.status &= ~TUNE_ERROR
    s.tune_done = NOTHING
    s.tune_phase = OBSERVING
    s.out = clamp(s.out, c.low, c.high)
    begin_noise(s)


def leave(c: Config, s: State, mode: int) -> None:
    """PID_MODE changes; PID_MAN has an effect again."""
    s.mode = mode
    s.wanted = MANUAL if c.manual else AUTO
    s.status = (s.status & ~MODES) | s.wanted
    s.busy |= FRESH


def fail(c: Config, s: State, reason: int) -> None:
    """The autotune ends without results, and the operands are those of before."""
    s.tune_done = FAILED
    s.tune_reason = reason
    s.status |= TUNE_ERROR
    s.notice = noticed(s.notice, 0, reason)
    leave(c, s, s.mode_before)


def abandon(s: State) -> None:
    """The autotune is ended by the operator or the program."""
    s.tune_done = CANCELLED
    s.notice = noticed(s.notice, 0, ABANDONED)


def usable(value: float) -> bool:
    """Whether a result is a number above 0."""
    return value > 0.0 and isfinite(value)


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
    s.integral = single(single(mean) - s.bias)
    s.tune_done = DONE
    leave(c, s, 0)


def mean(s: State) -> float:
    """MV over the cycles that count so far."""
    return s.tune_sum / (s.tune_count - s.tune_start)


def uneven(s: State) -> float:
    """How far the share of MV's higher value is from a half of the cycle."""
    return abs((mean(s) - s.tune_bottom) / (s.tune_top - s.tune_bottom) - 0.5)


def measure(c: Config, s: State) -> None:
    """The ultimate cycle from the relay's, which has come to its end."""
    samples = cycle_length(s)
    half = s.tune_swing / 4.0
    if half <= 0.0:
        fail(c, s, NO_RESPONSE)
    elif samples < LEAST_PERIOD:
        fail(c, s, TOO_FAST)
    elif uneven(s) > TOLERABLE:
        fail(c, s, UNEVEN)
    else:
        ultimate = ultimate_gain(s, s.tune_top - s.tune_bottom, s.tune_band, half * half / 4.0)
        store(c, s, ultimate, samples * (s.period / TICKS), mean(s))


def begin_relay(s: State, low: float, high: float) -> None:
    """It switches between these from the next sample on."""
    s.tune_bottom = single(low)
    s.tune_top = single(high)
    begin_cycle(s)


def balance(c: Config, s: State, middle: float) -> None:
    """From now on MV swings as far up from its mean as down: both halves of the cycle then last equally long."""
    way = max(min(middle - c.low, c.high - middle), LEAST_SWING * (c.high - c.low))
    s.tune_rounds += 1
    begin_relay(s, max(c.low, middle - way), min(c.high, middle + way))


def relay(c: Config, s: State, e: float) -> None:
    """One sample of the relay: the higher MV while the error is above 0, else the lower one."""
    side = relay_switch(s, s.pv, e, s.tune_band)
    if side:
        if s.tune_turns == BALANCE_TURN and s.tune_rounds < ROUNDS and uneven(s) > EVEN:
            balance(c, s, mean(s))
        s.out = clamp(s.tune_top if side > 0 else s.tune_bottom, c.low, c.high)
        s.tune_base = s.pv
        s.tune_moved = 0.0
    if s.tune_turns >= LAST_TURN:
        measure(c, s)
        return
    if s.tune_turns == FIRST_TURN and side:
        s.tune_sum = 0.0
    s.tune_sum += s.out
    s.tune_moved = max(s.tune_moved, abs(s.pv - s.tune_base))
    if s.tune_moved <= RESPONDS * s.tune_noise and stalled(s, PATIENT, PATIENCE):
        fail(c, s, NO_RESPONSE)
    elif stalled(s, MOST, LONGEST):
        fail(c, s, NO_SWITCH)


def tune(c: Config, s: State, e: float) -> None:
    """One sample of the autotune; ``e`` is the error without the dead band."""
    if c.low >= c.high:
        fail(c, s, NO_RANGE)
    elif s.tune_phase == OBSERVING:
        if measure_noise(s, s.pv):
            s.tune_band = HYSTERESIS * s.tune_noise
            s.tune_phase = SWITCHING
            s.tune_rounds = 0
            begin_relay(s, c.low, c.high)
    else:
        relay(c, s, e)
