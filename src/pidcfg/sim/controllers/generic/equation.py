"""The ideal PID in double precision (D299), its anti-windup (D300) and its bumpless changes (D301).

Plain functions of records and numbers, which numba compiles as they are.
D numbers: see `pidcfg.encoders.generic.decisions`.
"""

from __future__ import annotations

from math import isfinite, sqrt
from typing import TYPE_CHECKING

from pidcfg.sim.controllers.generic.state import BUMPLESS, FRESH, IN_DEAD_BAND, LIMITED, SLOWED
from pidcfg.sim.notices import noticed
from pidcfg.sim.terms import clamp, step_to

if TYPE_CHECKING:
    from pidcfg.sim.controllers.generic.state import Config, State

NOTABLE = 0.01
"""Share of the way between the limits that OUT moves by at most without a word when manual ends."""
JUMPS = 1
"""Notice of `calculate`."""


def measure(c: Config, s: State, raw: float) -> None:
    """The PV: root, then filter."""
    x = raw
    if c.root:
        share = (raw - c.base) / c.span
        x = c.base + c.span * sqrt(share) if share > 0.0 else c.base
    if s.busy & FRESH:
        s.pv = x
        s.pv1 = x
    else:
        s.pv1 = s.pv
        s.pv = s.pv + (x - s.pv) * s.pv_share if s.pv_share < 1.0 else x


def compare(c: Config, s: State) -> None:
    """The error as it counts, and that of the sample before."""
    e = s.sp - s.pv if c.raises else s.pv - s.sp
    if abs(e) < c.band:
        e = 0.0
        s.status |= IN_DEAD_BAND
    else:
        s.status &= ~IN_DEAD_BAND
    s.e1 = e if s.busy & FRESH else s.error
    s.error = e


def derivative(c: Config, s: State) -> float:
    """The third action."""
    if c.of_error:
        x = s.error - s.e1
    elif c.raises:
        x = s.pv1 - s.pv
    else:
        x = s.pv - s.pv1
    if s.d_share < 1.0:
        x = s.y + (x - s.y) * s.d_share
    s.y = x
    return s.kd * x


def put_back(s: State, p: float, d: float) -> None:
    """The integral with which the equation makes the present OUT."""
    total = ((s.out - p) - d) - s.bias
    s.integral = total if s.ki > 0.0 and isfinite(total) else 0.0


def move(c: Config, s: State, target: float) -> None:
    """OUT towards a value, as fast as it may, within the limits."""
    out = step_to(s.out, target, c.rate_limit)
    if out != target:
        s.status |= SLOWED
    else:
        s.status &= ~SLOWED
    s.out = clamp(out, c.low, c.high)


def limited(c: Config, s: State, m: float) -> float:
    """A value within the limits of OUT."""
    if c.low <= m <= c.high:
        s.status &= ~LIMITED
        return m
    s.status |= LIMITED
    return clamp(m, c.low, c.high)


def by_hand(c: Config, s: State, p: float, d: float) -> None:
    """OUT is what the operator wants."""
    move(c, s, limited(c, s, s.manual))
    put_back(s, p, d)


def calculate(c: Config, s: State, p: float, d: float) -> None:
    """OUT of the equation."""
    was = s.out
    step = s.ki * s.error
    if s.busy & BUMPLESS:
        put_back(s, p, d)
        step = 0.0
    total = s.integral + step if s.ki > 0.0 else 0.0
    m = ((p + total) + d) + s.bias
    if not isfinite(m):
        return
    if c.windup or not ((m > c.high and step > 0.0) or (m < c.low and step < 0.0)):
        s.integral = total
    move(c, s, limited(c, s, m))
    if s.busy & BUMPLESS and s.ki <= 0.0 and abs(s.out - was) > NOTABLE * (c.high - c.low):
        s.notice = noticed(s.notice, 0, JUMPS)
    s.busy &= ~BUMPLESS
