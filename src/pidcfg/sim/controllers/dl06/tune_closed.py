"""Closed-loop auto-tune of the DL06: a relay in place of the controller.

The output switches between its limits whenever the error changes its sign, for three cycles of which the first is left
out. Period T and swing X of the PV (both peak to peak, as the output's M) give the ultimate gain 4 M / (pi X).
"""

from __future__ import annotations

from pidcfg.sim.controllers.dl06.state import FRESH, RELAY, TUNE_ERROR, Config, State
from pidcfg.sim.controllers.dl06.tune_results import SWITCHING, TUNE_AT_LIMITS, TUNE_NO_RESPONSE, end_tune, store
from pidcfg.sim.notices import tell_request
from pidcfg.sim.plc import TICKS
from pidcfg.sim.tuning_rules import (
    LAST_TURN,
    PI,
    RELAY_PATIENCE,
    RELAY_PATIENT,
    begin_cycle,
    cycle_gains,
    cycle_length,
    relay_switch,
    stalled,
)


def begin_relay(c: Config, s: State) -> None:
    """Take the output over; the first switch follows at once. Limits at the ends of the range are reported (D62)."""
    s.tune_phase = SWITCHING
    s.busy |= RELAY
    begin_cycle(s)
    if c.velocity == 0:
        s.tune_out = s.bias
    if c.m_high >= c.out_max or c.m_low <= c.out_min:
        s.status |= TUNE_ERROR
        s.requested = 0
        tell_request(s, TUNE_AT_LIMITS)


def restore_bias(c: Config, s: State) -> None:
    """The controller continues from the bias before the auto-tune, the velocity form from the output (D60)."""
    if c.velocity == 0:
        s.bias = s.tune_out
    s.m = s.tune_out
    s.busy |= FRESH


def switching(c: Config, s: State, p: float, sp: float) -> None:
    """One sample of the relay of three cycles (D60), and their gains (D61); noise widens the hysteresis."""
    band = 3.0 * s.tune_noise if s.tune_noise > 1.0 else 0.0
    side = relay_switch(s, p, sp - p, band)
    if side != 0:
        up = side > 0 if c.reverse == 0 else side < 0
        s.out = c.m_high if up else c.m_low
    if s.tune_turns == LAST_TURN:
        restore_bias(c, s)
        swing = s.tune_swing / 2.0 - band
        ultimate = 4.0 * (c.m_high - c.m_low) / c.out_span / (PI * max(swing, 1.0) / c.span)
        gain, reset, derivative, sample = cycle_gains(c.tune_pi, ultimate, cycle_length(s) * s.period / TICKS)
        store(c, s, gain, reset, derivative, sample)
    elif stalled(s, RELAY_PATIENT, RELAY_PATIENCE):
        restore_bias(c, s)
        end_tune(s, TUNE_NO_RESPONSE)
