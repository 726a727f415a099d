"""The position equation of the CLICK, every result rounded to single precision as it arises (D110).

CO(n) = Bias(n) + Kp [e(n) + Td/Ts (e(n) - e(n-1))], Bias(n) = Bias(n-1) + Kp Ts/Ti e(n). The factors carry the sign of
the action, which changes no bit of a rounded product. D numbers: see `decisions`.
"""

from __future__ import annotations

from pidcfg.sim.controllers.click.state import FRESH, Config, State
from pidcfg.sim.plc import TICKS
from pidcfg.sim.terms import clamp, single


def coefficients(c: Config, s: State) -> None:
    """Kp Ts/Ti and Td/Ts of the registers as they stand, and the lag of the derivative's filter (D110, D114).

    Only called with a reset time above 0: errors 26 to 28 keep a loop in Manual, where nothing is calculated.
    """
    seconds = single(s.period / TICKS)
    s.kp = -s.gain if c.reverse else s.gain
    s.ki = single(s.kp * single(seconds / s.reset))
    s.kd = single(s.rate / seconds)
    s.lag = 1.0
    if c.limited:
        if c.limit <= 0.0:
            s.kd = 0.0
        elif c.limit < 100.0:
            s.lag = single(seconds / single(seconds + single(s.rate / c.limit)))


def calculate(c: Config, s: State) -> float:
    """The output before its limits; no term acts while the error is inside the deadband (D113).

    The bias goes on, unless it is frozen (D112), and stays within the output's limits (D111); the derivative is that of
    the filtered error (D114).
    """
    e = single(s.sp - s.pv)
    if c.squared:
        e = single(e * abs(e))
    if s.busy & FRESH:
        s.busy &= ~FRESH
        s.e1 = e
        s.y1 = 0.0
    change = single(e - s.e1)
    s.e1 = e
    low = c.out_low
    high = c.out_high
    bias = s.bias
    idle = c.deadband_on and -c.deadband <= e <= c.deadband
    if not (idle or (c.freeze and (s.out >= high or s.out <= low))):
        bias = single(bias + single(s.ki * e))
    s.bias = clamp(bias, low, high)
    if idle:
        s.y1 = 0.0
        return s.bias
    if s.lag < 1.0:
        change = single(s.y1 + single(s.lag * single(change - s.y1)))
    s.y1 = change
    if s.kd != 0.0:
        e = single(e + single(s.kd * change))
    return single(s.bias + single(s.kp * e))
