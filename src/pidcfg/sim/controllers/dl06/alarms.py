"""Process alarms of a DL06 loop: four absolute, two deviation, one rate of change.

An alarm comes on as soon as the PV is beyond its threshold and goes off when the PV is back through it by the
hysteresis (D46); the rate of change has none. Groups that are switched off have thresholds that nothing reaches, which
clears their bits.
While no alarm is on, `alarms` leaves behind the band of PVs in which none can come on, so that the step looks at two
numbers instead of six thresholds.
"""

from __future__ import annotations

from pidcfg.sim.controllers.dl06.state import (
    ALARMS,
    HIGH,
    HIGH_HIGH,
    LOW,
    LOW_LOW,
    PV_ALARMS,
    RATE_OF_CHANGE,
    RED,
    UNBOUNDED,
    YELLOW,
    Config,
    State,
)
from pidcfg.sim.terms import latched


def absolute(c: Config, s: State, pv: float) -> None:
    """Renew the four alarms of the PV itself."""
    status = latched(s.status, LOW_LOW, c.low_low - pv, c.hysteresis)
    status = latched(status, LOW, c.low - pv, c.hysteresis)
    status = latched(status, HIGH, pv - c.high, c.hysteresis)
    s.status = latched(status, HIGH_HIGH, pv - c.high_high, c.hysteresis)


def alarms(c: Config, s: State, pv: float, old: float, sp: float) -> None:
    """Renew all alarms, and the band in which nothing will change.

    With square-root extract the set point is on the root's scale; the deviation alarms compare the PV with its square.
    """
    absolute(c, s, pv)
    centre = sp * abs(sp) if c.root else sp
    deviation = abs(pv - centre)
    status = latched(s.status, YELLOW, deviation - c.yellow, c.hysteresis)
    status = latched(status, RED, deviation - c.red, c.hysteresis)
    if abs(pv - old) > c.rate_of_change:
        status |= RATE_OF_CHANGE
    else:
        status &= ~RATE_OF_CHANGE
    s.status = status
    s.quiet_sp = sp
    s.quiet_low = UNBOUNDED
    s.quiet_high = -UNBOUNDED
    if status & ALARMS == 0:
        band = min(c.yellow, c.red)
        s.quiet_low = max(c.low, c.low_low, centre - band)
        s.quiet_high = min(c.high, c.high_high, centre + band)


def alarmed(s: State) -> int:
    """The absolute alarms that are on."""
    return s.status & PV_ALARMS
