"""Alarms of a CLICK loop: four of the PV, two of its deviation, one of its rate of change (D122).

An alarm comes on as soon as the PV is beyond its limit and goes off when the PV is back through it by the hysteresis;
the rate of change has none. A group that is off clears its bits.
"""

from __future__ import annotations

from pidcfg.sim.controllers.click.state import (
    ALARMS,
    DEVIATION_ALARMS,
    DEVIATION_HIGH,
    DEVIATION_HIGH_HIGH,
    HIGH,
    HIGH_HIGH,
    LOW,
    LOW_LOW,
    PV_ALARMS,
    RATE_OF_CHANGE,
    Config,
    State,
)
from pidcfg.sim.terms import single


def latched(status: int, bit: int, excess: float, hysteresis: float) -> int:
    """The status with one alarm bit renewed; ``excess`` is how far the PV is beyond the limit."""
    if excess > 0.0:
        return status | bit
    if excess <= -hysteresis:
        return status & ~bit
    return status


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
    """Renew all alarms; ``old`` is the PV of the sample before."""
    status = s.status
    if c.pv_alarms:
        status = absolute(c, status, s.pv)
    else:
        status &= ~PV_ALARMS
    if c.deviation_alarms:
        status = deviation(c, status, abs(single(s.sp - s.pv)))
    else:
        status &= ~DEVIATION_ALARMS
    if c.rate_alarm and abs(single(s.pv - old)) > c.rate_of_change:
        status |= RATE_OF_CHANGE
    else:
        status &= ~RATE_OF_CHANGE
    s.status = status


def alarmed(s: State) -> int:
    """The alarms that are on."""
    return s.status & ALARMS
