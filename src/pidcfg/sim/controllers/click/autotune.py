"""Autotune of the CLICK, sample by sample: the noise, then the step response (D123) or the relay (D124).

The output is in %, the PV in its units, so the gain is % per unit; responses count as shares of the PV limits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.click.tune_results import (
    OBSERVING,
    RESPONSE,
    SWITCHING,
    TUNE_MOVING,
    TUNE_NO_RANGE,
    TUNE_NO_RESPONSE,
    fail,
    store,
    tunable,
)
from pidcfg.sim.notices import noticed
from pidcfg.sim.plc import TICKS
from pidcfg.sim.reaction_curve import (
    ANSWERED,
    NO_ANSWER,
    STEP,
    TOO_SMALL,
    begin_curve,
    judge_response,
    record,
    steepest_line,
    was_moving,
)
from pidcfg.sim.terms import single
from pidcfg.sim.tuning_rules import (
    LAST_TURN,
    RELAY_PATIENCE,
    RELAY_PATIENT,
    begin_cycle,
    curve_gains,
    cycle_gains,
    cycle_length,
    measure_noise,
    relay_switch,
    stalled,
    ultimate_gain,
)

if TYPE_CHECKING:
    from pidcfg.sim.controllers.click.state import Config, State

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
