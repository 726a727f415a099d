"""How an auto-tune of the DL06 ends: the output is restored, results go to their words, or a reason is logged."""

from __future__ import annotations

from pidcfg.sim.controllers.dl06.equation import coefficients
from pidcfg.sim.controllers.dl06.state import RELAY, TUNE, TUNE_ERROR, TUNING, Config, State
from pidcfg.sim.notices import tell_request
from pidcfg.sim.terms import clamp, nearest

IDLE, REQUESTED, OBSERVE, RESPONSE, SWITCHING = 0, 1, 2, 3, 4
"""`State.tune_phase`."""

REFUSED_TUNE_MODE = 30
REFUSED_TUNE_DISTANCE = 31
TUNE_FULL_SCALE = 32
TUNE_NO_RESPONSE = 33
TUNE_ABORTED = 34
TUNE_AT_LIMITS = 35
TUNE_NO_SWING = 36
REFUSED_TUNE_APART = 37
TUNE_MOVING = 38
TUNE_RUNS = 39

REASONS = {
    REFUSED_TUNE_MODE: "auto-tune refused: open loop needs Manual, closed loop needs Auto",
    REFUSED_TUNE_DISTANCE: "auto-tune refused: the PV is not 205 of 4095 counts below SP (direct) or above (reverse)",
    TUNE_FULL_SCALE: "auto-tune stopped: the output step reaches full scale",
    TUNE_NO_RESPONSE: "auto-tune stopped: the PV does not answer",
    TUNE_ABORTED: "auto-tune stopped: the mode was changed",
    TUNE_AT_LIMITS: "auto-tune: the output goes to the ends of its range, which the manual calls an error (+06 bit 13);"
    " the gains are written all the same, output limits inside the range avoid it",
    TUNE_NO_SWING: "auto-tune stopped: output limits leave nothing to switch between",
    REFUSED_TUNE_APART: "auto-tune refused: PV and SP are more than 5 % of full scale (205 of 4095 counts) apart",
    TUNE_RUNS: "auto-tune is running already (D683)",
    TUNE_MOVING: "the PV was moving when the auto-tune began: do not trust its gains (D623)",
}


def end_tune(s: State, error: int) -> None:
    """The auto-tune releases the loop; ``error`` is a reason, 0 for success."""
    s.status &= ~TUNING
    s.busy &= ~(TUNE | RELAY)
    s.tune_phase = IDLE
    if error:
        s.status |= TUNE_ERROR
        s.requested = 0
        tell_request(s, error)
    else:
        s.tune_done = 1


def digits(x: float) -> float:
    """The nearest whole number, half to even; what only a rounding error keeps from a half is one."""
    return nearest(nearest(x * 1e6) / 1e6)


def store(c: Config, s: State, gain: float, reset: float, rate: float, seconds: float) -> None:
    """Write the results to their words: rounded to the last digit, within what the words hold (D65)."""
    s.gain = clamp(digits(gain * 100.0), 1.0, 9999.0) / 100.0
    steps = clamp(digits(reset / (c.reset_unit * c.reset_step)), 1.0, 9998.0)
    s.reset = steps * c.reset_step * c.reset_unit
    s.rate = clamp(digits(rate * 100.0), 0.0, 9999.0) / 100.0
    s.period = int(clamp(digits(seconds * 100.0) * 10000.0, c.least_period * 1.0, 99990000.0))
    coefficients(c, s)
    end_tune(s, 0)
