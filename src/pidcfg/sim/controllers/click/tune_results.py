"""How an autotune of the CLICK begins and ends: the output is restored, results go to their registers (D125)."""

from __future__ import annotations

from pidcfg.schemas.expressions import LARGEST_VALUE
from pidcfg.sim.controllers.click.equation import coefficients
from pidcfg.sim.controllers.click.errors import RANGES
from pidcfg.sim.controllers.click.state import AUTO, FRESH, MODES, TUNE_ERROR, TUNING, Config, State
from pidcfg.sim.notices import noticed
from pidcfg.sim.terms import clamp, nearest, single
from pidcfg.sim.tuning_rules import CANCELLED, DONE, FAILED, NOTHING, begin_noise

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
