"""Alarms of a CLICK loop: four of the PV, two of its deviation, one of its rate of change (D122).

An alarm comes on as soon as the PV is beyond its limit and goes off when the PV is back through it by the hysteresis;
the rate of change has none. Groups that are off have limits that nothing reaches.
While no alarm is on, `alarms` leaves behind the band of PVs in which none can come on, so that the step looks at two
numbers instead of six limits.
"""

from __future__ import annotations

from pidcfg.sim.controllers.click.state import (
    ALARMS,
    DEVIATION_HIGH,
    DEVIATION_HIGH_HIGH,
    HIGH,
    HIGH_HIGH,
    LOW,
    LOW_LOW,
    RATE_OF_CHANGE,
    UNBOUNDED,
    Config,
    State,
)
from pidcfg.sim.terms import latched, single


def absolute(c: Config, status: int, pv: float) -> int:
    """The four alarms of the PV itself."""
    status = latched(status, LOW_LOW, single(c.low_low - pv), c.hysteresis)
    status = latched(status, LOW, single(c.low - pv), c.hysteresis)
    status = latched(status, HIGH, single(pv - c.high), c.hysteresis)
    return latched(status, HIGH_HIGH, single(pv - c.high_high), c.hysteresis)


def deviation(c: Config, status: int, away: float) -> int:
    """The two alarms of the distance from the set point."""
    status = latched(status, DEVIATION_HIGH, single(away - c.deviation_high), c.hysteresis)
    return latched(status, DEVIATION_HIGH_HIGH, single(away - c.deviation_high_high), c.hysteresis)


def alarms(c: Config, s: State, old: float) -> None:
    """Renew all alarms, and the band in which nothing will change; ``old`` is the PV of the sample before."""
    status = absolute(c, s.status, s.pv)
    status = deviation(c, status, abs(single(s.sp - s.pv)))
    if abs(single(s.pv - old)) > c.rate_of_change:
        status |= RATE_OF_CHANGE
    else:
        status &= ~RATE_OF_CHANGE
    s.status = status
    s.quiet_sp = s.sp
    s.quiet_low = UNBOUNDED
    s.quiet_high = -UNBOUNDED
    if status & ALARMS == 0:
        band = lower(c.deviation_high, lower(c.deviation_high_high, UNBOUNDED))
        s.quiet_low = -lower(-c.low, lower(-c.low_low, band - s.sp))
        s.quiet_high = lower(c.high, lower(c.high_high, s.sp + band))


def lower(x: float, y: float) -> float:
    """The lower one, and the second where the first is no number, on which ``min`` differs once it is compiled."""
    if x < y:
        return x
    return y
