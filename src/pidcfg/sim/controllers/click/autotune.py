"""Autotune of the CLICK, sample by sample, and how it begins and ends."""

from __future__ import annotations

from pidcfg.schemas.expressions import LARGEST_VALUE
from pidcfg.sim.controllers.autotune import (
    ANSWERED,
    CANCELLED,
    DONE,
    FAILED,
    LAST_TURN,
    NO_ANSWER,
    NOTHING,
    RELAY_PATIENCE,
    RELAY_PATIENT,
    STEP,
    TOO_SMALL,
    begin_curve,
    begin_cycle,
    begin_noise,
    curve_gains,
    cycle_gains,
    cycle_length,
    judge_response,
    measure_noise,
    record,
    relay_switch,
    stalled,
    steepest_line,
    ultimate_gain,
    was_moving,
)
from pidcfg.sim.controllers.click.equation import (
    AUTO,
    FRESH,
    MODES,
    RANGES,
    TUNE_ERROR,
    TUNING,
    Config,
    State,
    coefficients,
)
from pidcfg.sim.controllers.kernels import clamp, nearest, noticed, single
from pidcfg.sim.controllers.plc import TICKS

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

ASCENDING = "the PV limits (DFn+22, DFn+23) and the output limits (DFn+09, DFn+10) must ascend"
REASONS = {
    REFUSED_TUNE_MODE: "autotune refused: it starts in Auto only",
    REFUSED_TUNE_RANGE: f"autotune refused: {ASCENDING}",
    TUNE_NO_RANGE: f"autotune stopped: {ASCENDING}",
    TUNE_NO_RESPONSE: "autotune stopped: the PV does not answer",
    TUNE_ABORTED: "autotune stopped: the loop went to Manual",
    TUNE_CANCELLED: "autotune cancelled: its request was cleared",
    TUNE_IDLE: "no autotune to be cancelled",
    TUNE_MOVING: "the PV was moving when the autotune began: do not trust its gains (D623)",
}

LEAST_GAIN, MOST_GAIN = RANGES["proportional_gain"]
LEAST_RESET, MOST_RESET = RANGES["reset_time"]
LEAST_RATE, MOST_RATE = RANGES["derivative_gain"]
LEAST_MS, MOST_MS = RANGES["sample_rate"]
"""What registers without a PID error hold."""


def tunable(c: Config) -> bool:
    """Whether the limits of PV and output are ranges."""
    return 0.0 < c.pv_high - c.pv_low <= LARGEST_VALUE and 0.0 < c.out_high - c.out_low <= LARGEST_VALUE


def start_tune(s: State) -> None:
    """The loop goes to Autotune; its output is held while the noise of the PV is measured (D123)."""
    s.status = (s.status & ~(MODES | TUNE_ERROR)) | TUNING
    s.tune_phase = OBSERVING
    s.tune_done = NOTHING
    s.tune_out = s.out
    s.tune_step = 0.0
    begin_noise(s)


def restore_output(s: State) -> None:
    """The controller continues from the output before the autotune; its bias is unchanged."""
    s.out = s.tune_out
    s.busy |= FRESH
    s.tune_phase = IDLE


def abandon(s: State) -> None:
    """The autotune ends without results."""
    restore_output(s)
    s.tune_done = CANCELLED


def fail(s: State, reason: int) -> None:
    """Back to Auto with the gains of before."""
    restore_output(s)
    s.tune_done = FAILED
    s.status = (s.status & ~MODES) | AUTO | TUNE_ERROR
    s.requested = 0
    s.notice = noticed(s.notice, 0, reason)


def store(c: Config, s: State, gain: float, reset: float, rate: float, seconds: float) -> None:
    """Write the results, within what the registers hold, and return to Auto."""
    s.gain = single(clamp(gain, LEAST_GAIN, MOST_GAIN))
    s.reset = single(clamp(reset, LEAST_RESET, MOST_RESET))
    s.rate = single(clamp(rate, LEAST_RATE, MOST_RATE))
    s.sample_ms = int(clamp(nearest(seconds * 1000.0), LEAST_MS, MOST_MS))
    s.period = s.sample_ms * 1000
    coefficients(c, s)
    restore_output(s)
    s.tune_done = DONE
    s.status = (s.status & ~MODES) | AUTO


# --- Autotune of the CLICK, sample by sample: the noise, then the step response (D123) or the relay (D124) ------------
#
# The output is in %, the PV in its units, so the gain is % per unit; responses count as shares of the PV limits.

RESOLUTION = 1.0 / 4000.0
"""Resolution of the PV, as a share of its range."""
LEAST_SWING = 1e-6
"""Least amplitude of a cycle, as a share of the PV's range."""


def step_output(c: Config, s: State) -> None:
    """Step the output by another 10 % of its range: up, or down where the way up is too short."""
    span = c.out_high - c.out_low
    if s.tune_step == 0.0:
        s.tune_step = STEP if s.tune_out + 2.0 * STEP * span <= c.out_high else -STEP
    else:
        s.tune_step += s.tune_step
    s.out = single(s.tune_out + s.tune_step * span)
    s.tune_phase = RESPONSE
    begin_curve(s)


def begin_relay(s: State) -> None:
    """The first switch follows at the next sample."""
    s.tune_phase = SWITCHING
    begin_cycle(s)


def sign(c: Config, s: State) -> float:
    """1 when the step moves the PV up, else -1."""
    return 1.0 if (s.tune_step > 0.0) == (c.reverse == 0) else -1.0


def measure(c: Config, s: State, aux: list[float], change: float) -> None:
    """Slope and dead time of the recorded response, and the gains they give."""
    slope, dead = steepest_line(s, c.tune_buffer, aux, change)
    if slope <= 0.0:
        fail(s, TUNE_NO_RESPONSE)
        return
    if was_moving(s, slope, 0.0):
        s.notice = noticed(s.notice, 0, TUNE_MOVING)
    gain, reset, rate, sample = curve_gains(c.tune_pi, STEP * (c.out_high - c.out_low) / (dead * slope), dead)
    store(c, s, gain, reset, rate, sample)


def respond(c: Config, s: State, aux: list[float]) -> None:
    """One sample of the step response, until there is enough of it or it has settled."""
    if not record(s, c.tune_buffer, aux, sign(c, s) * (s.pv - s.tune_base)):
        return
    span = c.pv_high - c.pv_low
    second = int(abs(s.tune_step) > STEP)
    count = span * RESOLUTION
    verdict, change = judge_response(s, c.tune_buffer, aux, span, count, count, second)
    if verdict == ANSWERED:
        measure(c, s, aux, change)
    elif verdict == TOO_SMALL:
        s.tune_base += sign(c, s) * change
        step_output(c, s)
    elif verdict == NO_ANSWER and second:
        fail(s, TUNE_NO_RESPONSE)
    elif verdict == NO_ANSWER:
        step_output(c, s)


def relay(c: Config, s: State) -> None:
    """One sample of the relay, whose hysteresis is that of DFn+21 in % of the PV limits."""
    span = c.pv_high - c.pv_low
    band = c.tune_hysteresis * span / 100.0
    side = relay_switch(s, s.pv, s.sp - s.pv, band)
    if side:
        s.out = c.out_high if (side > 0) == (c.reverse == 0) else c.out_low
    if s.tune_turns == LAST_TURN:
        ultimate = ultimate_gain(s, c.out_high - c.out_low, band, LEAST_SWING * span * (LEAST_SWING * span))
        gain, reset, rate, sample = cycle_gains(c.tune_pi, ultimate, cycle_length(s) * s.period / TICKS)
        store(c, s, gain, reset, rate, sample)
    elif stalled(s, RELAY_PATIENT, RELAY_PATIENCE):
        fail(s, TUNE_NO_RESPONSE)


def tune(c: Config, s: State, aux: list[float]) -> None:
    """One sample of the autotune; its limits may be written meanwhile."""
    if not tunable(c):
        fail(s, TUNE_NO_RANGE)
    elif s.tune_phase == OBSERVING:
        if measure_noise(s, s.pv):
            if c.tune_closed:
                begin_relay(s)
            else:
                step_output(c, s)
    elif s.tune_phase == RESPONSE:
        respond(c, s, aux)
    else:
        relay(c, s)
