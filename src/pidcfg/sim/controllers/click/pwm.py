"""Pulse width modulation: the share of each period for which a discrete output is on is the control output (D121)."""

from __future__ import annotations

from pidcfg.sim.controllers.click.state import STOPPED, Config, State

ON, OFF = 1.0, 0.0


def pulse(c: Config, s: State, tick: int) -> float:
    """The discrete output at ``tick``; its on-time is taken at the start of each period and ends at the nearest tick.

    A period that began before the tick goes on from where it should have begun.
    """
    step = tick - s.last_tick
    s.last_tick = tick
    if s.busy & STOPPED:
        return OFF
    if tick - s.pulse_at >= c.pwm_period or s.pulse < 0.0:
        if s.pulse < 0.0 or tick - s.pulse_at >= 2 * c.pwm_period:
            s.pulse_at = tick
        else:
            s.pulse_at += c.pwm_period
        share = s.out / 100.0
        if not share > 0.0:
            share = 0.0
        elif share > 1.0:
            share = 1.0
        s.pulse = share * c.pwm_period
    if s.pulse >= c.pwm_period:
        return ON
    left = s.pulse - (tick - s.pulse_at)
    return ON if left > 0.0 and left >= step / 2.0 else OFF
