"""Auto-tune of the DL06, sample by sample: start conditions, a look at the noise, then open or closed loop.

A few samples measure the noise of the PV before the output is changed: it widens the relay's band and the
regression of the step response.
"""

from __future__ import annotations

from pidcfg.sim.controllers.dl06.equation import process
from pidcfg.sim.controllers.dl06.state import AUTO, MANUAL, TUNE_ERROR, TUNING, Config, State
from pidcfg.sim.controllers.dl06.tune_closed import begin_relay, switching
from pidcfg.sim.controllers.dl06.tune_open import respond, step_output
from pidcfg.sim.controllers.dl06.tune_results import (
    OBSERVE,
    REFUSED_TUNE_APART,
    REFUSED_TUNE_DISTANCE,
    REFUSED_TUNE_MODE,
    REQUESTED,
    RESPONSE,
    TUNE_ABORTED,
    TUNE_NO_SWING,
    end_tune,
)
from pidcfg.sim.tuning_rules import begin_noise, measure_noise

DISTANCE = 205.0 / 4095.0
"""For the open loop the least distance of the PV below the set point (reverse action: above), for the closed loop the
greatest one on either side, as a share of the span."""


def check_start(c: Config, s: State, p: float, sp: float) -> None:
    """The start bit: check mode and distance from the set point (D57), then measure the noise."""
    s.status &= ~TUNE_ERROR
    s.tune_done = 0
    below = p - sp if c.reverse else sp - p
    if s.status & (MANUAL if c.tune_open else AUTO) == 0:
        end_tune(s, REFUSED_TUNE_MODE)
    elif c.tune_open and below < DISTANCE * c.span:
        end_tune(s, REFUSED_TUNE_DISTANCE)
    elif c.tune_open == 0 and abs(below) > DISTANCE * c.span:
        end_tune(s, REFUSED_TUNE_APART)
    elif c.tune_open == 0 and c.m_high <= c.m_low:
        end_tune(s, TUNE_NO_SWING)
    else:
        s.status |= TUNING
        s.tune_phase = OBSERVE
        begin_noise(s)


def observe(c: Config, s: State, p: float) -> None:
    """Estimate the noise from second differences, and the PV at rest from the mean (D58)."""
    if not measure_noise(s, p):
        return
    s.tune_out = s.out
    s.tune_step = 0.0
    if c.tune_open:
        step_output(c, s)
    else:
        begin_relay(c, s)


def tune(c: Config, s: State, aux: list[float], sp: float) -> None:
    """One sample of the auto-tune; a change of mode stops it (D64)."""
    p = process(c, s.pv)
    if s.tune_phase == REQUESTED:
        check_start(c, s, p, sp)
    elif s.status & (MANUAL if c.tune_open else AUTO) == 0:
        end_tune(s, TUNE_ABORTED)
    elif s.tune_phase == OBSERVE:
        observe(c, s, p)
    elif s.tune_phase == RESPONSE:
        respond(c, s, aux, p)
    else:
        switching(c, s, p, sp)
