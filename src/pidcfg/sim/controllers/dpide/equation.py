"""The equation of DPIDE, every result rounded to single precision as it arises (D265).

MV = P + I_MV + D + BIAS. Independent: P = Kp E, I_MV sums Ki E Ts, D = Kd x. Dependent: P = Kc E, I_MV sums Kc/Ti E Ts,
D = Kc Td x. ``x`` is the derivative of the error, or that of PV with the sign that makes it act like one. D numbers:
see `decisions`.
"""

from __future__ import annotations

from math import isfinite, isnan
from typing import TYPE_CHECKING

from pidcfg.sim.controllers.dpide.state import FRESH, FROM_MANUAL, IN_DEAD_BAND, LIMITED
from pidcfg.sim.notices import noticed
from pidcfg.sim.plc import TICKS
from pidcfg.sim.terms import clamp, single

if TYPE_CHECKING:
    from pidcfg.sim.controllers.dpide.state import Config, State

NOTABLE = 0.01
"""Share of the way between the limits that MV moves by at most without a word when manual ends (D272)."""
JUMPS_WITHOUT = 2
"""Notice of `calculate`."""


def coefficients(c: Config, s: State) -> None:
    """The factors of the equation; what is below 0 counts as 0."""
    seconds = single(s.period / TICKS)
    gain = max(0.0, s.gain)
    rate = max(0.0, s.rate)
    s.kp = gain
    s.ki = 0.0
    if c.dependent:
        if s.reset > 0.0:
            s.ki = single(single(gain * seconds) / s.reset)
        s.kd = single(gain * rate)
    else:
        if s.reset > 0.0:
            s.ki = single(s.reset * seconds)
        s.kd = rate
    s.seconds = seconds
    s.lag = single(seconds / single(s.tf + seconds)) if s.tf > 0.0 else 1.0


def effective(c: Config, s: State, e: float) -> float:
    """The error as it counts: 0 inside the dead band once PV has crossed SV there (D268)."""
    if -c.band < e < c.band:
        if s.side * e < 0.0:
            s.crossed = 1
    else:
        s.crossed = 0
    if e > 0.0:
        s.side = 1.0
    elif e < 0.0:
        s.side = -1.0
    if s.crossed:
        s.status |= IN_DEAD_BAND
        return 0.0
    s.status &= ~IN_DEAD_BAND
    return e


def derivative(c: Config, s: State, e: float) -> float:
    """What the derivative's gain is multiplied with; the first one is 0 (D267), the gain comes last (D686)."""
    if s.busy & FRESH:
        s.y = 0.0
        s.e1 = e
        s.pv1 = s.pv
    if c.of_pv == 0:
        change = single(e - s.e1)
    elif s.crossed:
        change = 0.0
    elif c.forward:
        change = single(s.pv1 - s.pv)
    else:
        change = single(s.pv - s.pv1)
    s.e1 = e
    s.pv1 = s.pv
    x = single(change / s.seconds)
    if s.lag < 1.0:
        x = single(s.y + single(s.lag * single(x - s.y)))
    s.y = x
    return x


def put_back(s: State, out: float, p: float, d: float) -> None:
    """I_MV as it is when MV is ``out`` (D270)."""
    total = single(single(single(out - p) - d) - s.bias)
    if isfinite(total):
        s.integral = total


def calculate(c: Config, s: State, e: float) -> None:
    """MV of the algorithm, and I_MV with its anti-windup; what is no number is not written (D265, D689)."""
    was = s.out
    x = derivative(c, s, e)
    p = single(s.kp * e)
    d = single(s.kd * x) if s.kd > 0.0 else 0.0
    total = 0.0
    if s.ki > 0.0:
        if s.busy & FROM_MANUAL:
            put_back(s, was, p, d)
        total = single(s.integral + single(s.ki * e))
    else:
        # without integral time I_MV is 0 (D271)
        s.integral = 0.0
    m = single(single(single(p + total) + d) + s.bias)
    if isnan(m):
        s.out = clamp(was, c.low, c.high)
        s.busy |= FRESH
        return
    if c.low <= m <= c.high:
        s.status &= ~LIMITED
        s.out = m
        s.integral = total
    else:
        s.status |= LIMITED
        s.out = c.high if m > c.high else c.low
        # beyond the limits PID_MODE 0 holds I_MV (D269)
        if s.ki > 0.0 and s.mode == 2:
            put_back(s, s.out, p, d)
    if s.busy & FROM_MANUAL and s.ki <= 0.0 and abs(s.out - was) > NOTABLE * (c.high - c.low):
        s.notice = noticed(s.notice, 0, JUMPS_WITHOUT)
    s.busy &= ~(FRESH | FROM_MANUAL)
