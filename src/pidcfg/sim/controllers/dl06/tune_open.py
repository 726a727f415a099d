"""Open-loop auto-tune of the DL06: the reaction curve of a step of the output.

The output steps up by 10 % of its span, to 20 % when the PV settles after less than 2 %. The gains follow from
the steepest slope R and the dead time L of the response (Ziegler and Nichols).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.dl06.tune_results import (
    RESPONSE,
    TUNE_FULL_SCALE,
    TUNE_MOVING,
    TUNE_NO_RESPONSE,
    end_tune,
    store,
)
from pidcfg.sim.notices import noticed
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
from pidcfg.sim.reaction_curve import POINTS as CURVE
from pidcfg.sim.terms import NEAREST
from pidcfg.sim.tuning_rules import curve_gains

if TYPE_CHECKING:
    from pidcfg.sim.controllers.dl06.state import Config, State

POINTS = CURVE
"""Floats of a loop's buffer in `aux`."""


def step_output(c: Config, s: State) -> None:
    """Step the output up by another 10 % of its span and start recording."""
    s.tune_step += STEP
    wanted = s.tune_out + s.tune_step * c.out_span
    if wanted >= c.out_max:
        s.out = s.tune_out
        end_tune(s, TUNE_FULL_SCALE)
        return
    s.out = wanted + NEAREST - NEAREST
    s.tune_phase = RESPONSE
    begin_curve(s)


def measure(c: Config, s: State, aux: list[float], change: float) -> None:
    """Slope and dead time of the recorded response, and the gains they give."""
    slope, dead = steepest_line(s, c.tune_buffer, aux, change)
    s.out = s.tune_out
    if slope <= 0.0:
        end_tune(s, TUNE_NO_RESPONSE)
        return
    if was_moving(s, slope, c.span / c.pv_span):
        s.notice = noticed(s.notice, 0, TUNE_MOVING)
    gain, reset, derivative, sample = curve_gains(c.tune_pi, STEP / (dead * (slope / c.span)), dead)
    store(c, s, gain, reset, derivative, sample)


def respond(c: Config, s: State, aux: list[float], p: float) -> None:
    """One sample of the step response, until it is large enough or settled (D59), or fails to come (D63)."""
    rise = s.tune_base - p if c.reverse else p - s.tune_base
    if not record(s, c.tune_buffer, aux, rise):
        return
    second = int(s.tune_step > STEP)
    verdict, change = judge_response(s, c.tune_buffer, aux, c.span, c.span / c.pv_span, 1.0, second)
    if verdict == ANSWERED:
        measure(c, s, aux, change)
    elif verdict == TOO_SMALL:
        s.tune_base += -change if c.reverse else change
        step_output(c, s)
    elif verdict == NO_ANSWER and second:
        s.out = s.tune_out
        end_tune(s, TUNE_NO_RESPONSE)
    elif verdict == NO_ANSWER:
        step_output(c, s)
