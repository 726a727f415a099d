"""Pulse width modulation: the share of each period for which a discrete output is on is the control output (D121)."""

from __future__ import annotations

from pidcfg.sim.controllers.click.state import STOPPED, Config, State

ON, OFF = 1.0, 0.0


def pulse(c: Config, s: State, tick: int) -> float:
    """The discrete output of the base step that begins at ``tick``: as it is in the middle of the step.

    The first step's length is not known yet; its beginning counts. The on-time is taken where a period begins.
    """
    middle = tick + (tick - s.last_tick) // 2
    s.last_tick = tick
    if s.busy & STOPPED:
        return OFF
    if s.pulse < 0.0 or middle - s.pulse_at >= c.pwm_period:
        if s.pulse < 0.0 or middle - s.pulse_at >= 2 * c.pwm_period:
            s.pulse_at = tick
        else:
            s.pulse_at += c.pwm_period
        share = s.out / 100.0
        if not share > 0.0:
            share = 0.0
        elif share > 1.0:
            share = 1.0
        s.pulse = share * c.pwm_period
    return ON if middle - s.pulse_at < s.pulse else OFF
