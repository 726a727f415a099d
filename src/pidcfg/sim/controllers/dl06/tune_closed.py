"""Closed-loop auto-tune of the DL06: a relay in place of the controller.

The output switches between its limits whenever the error changes its sign, for three cycles of which the first is left
out. Period T and swing X of the PV (both peak to peak, as the output's M) give the ultimate gain 4 M / (pi X).
"""

from __future__ import annotations

from pidcfg.sim.controllers.dl06.modes import tell
from pidcfg.sim.controllers.dl06.state import FRESH, RELAY, TUNE_ERROR, Config, State
from pidcfg.sim.controllers.dl06.tune_results import SWITCHING, TUNE_AT_LIMITS, TUNE_NO_RESPONSE, end_tune, store
from pidcfg.sim.plc import TICKS

PI = 3.141592653589793
RELAY_PATIENCE = 3600.0
"""Seconds, or `RELAY_PATIENT` samples if those are longer, until an error that keeps its sign is given up."""
RELAY_PATIENT = 1000
FIRST_TURN, LAST_TURN = 4, 8
"""Switches between which the swing is measured; the first one only takes the output over."""


def begin_relay(c: Config, s: State) -> None:
    """Take the output over; the first switch follows at once. Limits at the ends of the range: D62."""
    s.tune_phase = SWITCHING
    s.busy |= RELAY
    s.tune_count = 0
    s.tune_turns = 0
    s.tune_side = 0
    s.tune_points = 0
    s.tune_swing = 0.0
    if c.velocity == 0:
        s.tune_out = s.bias
    if c.m_high >= c.out_max or c.m_low <= c.out_min:
        s.status |= TUNE_ERROR
        s.requested = 0
        tell(s, TUNE_AT_LIMITS)


def turn(c: Config, s: State, side: int) -> None:
    """The error changed its sign: switch the output, and close a half cycle (D60)."""
    s.tune_side = side
    up = side > 0 if c.reverse == 0 else side < 0
    s.out = c.m_high if up else c.m_low
    s.tune_turns += 1
    s.tune_points = s.tune_count
    if s.tune_turns == FIRST_TURN:
        s.tune_start = s.tune_count
    elif s.tune_turns > FIRST_TURN and s.tune_turns % 2 == 0:
        s.tune_swing += s.tune_high - s.tune_low
    if s.tune_turns % 2 == 0:
        s.tune_high = -1e18
        s.tune_low = 1e18


def give_back(s: State) -> None:
    """The controller goes on from the bias it had before."""
    s.bias = s.tune_out
    s.m = s.tune_out
    s.busy |= FRESH


def switching(c: Config, s: State, p: float, sp: float) -> None:
    """One sample of the relay; noise widens band and swing by three deviations. Gains: D61."""
    seconds = s.period / TICKS
    s.tune_count += 1
    e = sp - p
    band = 3.0 * s.tune_noise if s.tune_noise > 1.0 else 0.0
    if s.tune_turns:
        s.tune_high = max(s.tune_high, p)
        s.tune_low = min(s.tune_low, p)
    if s.tune_side == 0:
        turn(c, s, -1 if e < 0.0 else 1)
    elif s.tune_side > 0 and e < -band:
        turn(c, s, -1)
    elif s.tune_side < 0 and e > band:
        turn(c, s, 1)
    quiet = s.tune_count - s.tune_points
    if s.tune_turns == LAST_TURN:
        give_back(s)
        swing = s.tune_swing / 2.0 - band
        period = (s.tune_count - s.tune_start) / 2.0 * seconds
        gain = 4.0 * (c.m_high - c.m_low) / c.out_span / (PI * max(swing, 1.0) / c.span)
        if c.tune_pi:
            store(c, s, 0.30 * gain, 1.00 * period, 0.0, 0.03 * period)
        else:
            store(c, s, 0.45 * gain, 0.60 * period, 0.10 * period, 0.014 * period)
    elif quiet > RELAY_PATIENT and quiet * seconds > RELAY_PATIENCE:
        give_back(s)
        end_tune(s, TUNE_NO_RESPONSE)
