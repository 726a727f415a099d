"""The PID equation of the EZLogix: the position form, with the derivative of the error or of the PV.

The engine works in counts: an error in counts of the PV times the gain is the CV in counts. D numbers: see `decisions`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.schemas.ezlogix import CV_FULL
from pidcfg.sim.controllers.ezlogix.state import FRESH
from pidcfg.sim.plc import TICKS
from pidcfg.sim.terms import NEAREST

if TYPE_CHECKING:
    from pidcfg.sim.controllers.ezlogix.state import Config, State

FULL = float(CV_FULL)
"""Counts of the CV at 100 %."""
LARGEST = 2147483647.0
"""The integral term stays within a signed 32-bit number (D166)."""


def coefficients(s: State) -> None:
    """The factors of the equation: Kp, Kp Ts/Ti and Kp Td/Ts.

    A gain of 0 takes the proportional term out and leaves Ts/Ti and Td/Ts (D160).
    """
    seconds = s.period / TICKS
    factor = s.gain if s.gain > 0.0 else 1.0
    s.kp = s.gain
    s.ki = factor * seconds / s.reset if s.reset > 0.0 else 0.0
    s.kd = factor * s.rate / seconds


def begin(c: Config, s: State, x: float) -> None:
    """Manual to Auto: the integral term becomes what the CV is without its offset, and nothing has a past (D165)."""
    s.integral = s.out - c.offset
    s.whole = s.out
    s.x1 = x
    s.busy &= ~FRESH


def integrate(c: Config, s: State, e: float) -> None:
    """Kp Ts/Ti times one more error; with anti-windup not while the CV is saturated on the error's side (D167)."""
    change = s.ki * e
    if c.anti_windup and ((change > 0.0 and s.whole >= FULL) or (change < 0.0 and s.whole <= 0.0)):
        return
    total = s.integral + change
    if total > LARGEST:
        total = LARGEST
    elif total < -LARGEST:
        total = -LARGEST
    s.integral = total


def calculate(c: Config, s: State, e: float, x: float) -> None:
    """CV(n) = Kp [E(n) + Ts/Ti sum E + Td/Ts (x(n) - x(n-1))] + CV0, then saturation, then the CV limits.

    ``x`` is what the derivative acts on: the error, or the PV with the error's sign (D161). CV rounded: D168.
    """
    if s.busy & FRESH:
        begin(c, s, x)
    if s.ki > 0.0:
        integrate(c, s, e)
    else:
        s.integral = 0.0
    m = s.kp * e + s.integral + s.kd * (x - s.x1) + c.offset
    s.x1 = x
    if m >= FULL:
        m = FULL
    elif m > 0.0:
        m = m + NEAREST - NEAREST
    else:
        m = 0.0
    s.whole = m
    if m > c.m_high:
        m = c.m_high
    if m < c.m_low:
        m = c.m_low
    s.out = m
