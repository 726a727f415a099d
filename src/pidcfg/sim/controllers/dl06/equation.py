"""The PID equation of the DL06 in both forms, line by line as the manual prints it.

The engine works in fractions of the data range: the error is a fraction of the PV's span, the factors turn it into
output counts and carry the sign of the action (D30, D32). D numbers: see `decisions`.
"""

from __future__ import annotations

from math import sqrt

from pidcfg.sim.controllers.dl06.state import FRESH, Config, State
from pidcfg.sim.plc import TICKS


def coefficients(c: Config, s: State) -> None:
    """The factors of the equation, from the gain words: Ki = Kc Ts/Ti and Kr = Kc Td/Ts, in output counts (D677).

    A gain of 0 takes the proportional term out and leaves Ki = Ts/Ti, Kr = Td/Ts (D33). The derivative gain limit is a
    filter (D34).
    """
    seconds = s.period / TICKS
    scale = -c.out_span if c.reverse else c.out_span
    factor = s.gain * scale if s.gain > 0.0 else scale
    s.kp = s.gain * scale
    s.ki = factor * seconds / s.reset if s.reset > 0.0 else 0.0
    s.kd = factor * s.rate / seconds
    s.lag = 1.0
    if c.limited:
        s.kd = s.kd if c.limit > 0.0 else 0.0
        s.lag = seconds / (seconds + s.rate / c.limit) if c.limit > 0.0 else 1.0


def process(c: Config, pv: float) -> float:
    """The PV on the set point's scale: itself, or its root (D37)."""
    if c.root == 0:
        return pv
    return sqrt(pv) if pv > 0.0 else 0.0


def shaped(c: Config, sp: float, pv: float) -> float:
    """The error as a fraction of the span: root extract, then the square, then the deadband (D31)."""
    e = (sp - process(c, pv)) / c.span
    if c.squared:
        e = e * abs(e)
    if -c.deadband <= e <= c.deadband:
        e = 0.0
    return e


def refresh(s: State, e: float, x: float, sp: float) -> None:
    """Give the equation a past that equals the present: no kick after Manual (D42)."""
    s.e1 = e
    s.x1 = x
    s.x2 = x
    s.last_sp = sp
    s.busy &= ~FRESH


def stepped_bias(c: Config, s: State, sp: float) -> None:
    """Step bias: a change of the set point changes the bias in proportion, inversely for reverse action (D38).

    The words are signed counts (D647). The velocity form has no bias to change.
    """
    if c.velocity == 0 and sp * s.last_sp > 0.0:
        s.bias *= s.last_sp / sp if c.reverse else sp / s.last_sp
    s.last_sp = sp


def filtered(s: State, x: float) -> float:
    """Y(n) = Y(n-1) + lag (x - Y(n-1)), the signal that the derivative acts on; itself without a limit (D34)."""
    return x if s.lag == 1.0 else s.x1 + s.lag * (x - s.x1)


def velocity(s: State, e: float, x: float) -> float:
    """Change of output: Kc (e(n) - e(n-1)) + Ki e(n) + Kr (e(n) - 2 e(n-1) + e(n-2)), on top of the last output.

    That is within its limits and has its fraction (D649). The change is added up before it is added (D678).
    """
    y = filtered(s, x)
    change = s.kp * (e - s.e1) + s.ki * e + s.kd * (y - 2.0 * s.x1 + s.x2)
    s.x2 = s.x1
    s.x1 = y
    s.e1 = e
    return s.m + change


def position(c: Config, s: State, e: float, x: float) -> float:
    """Mx(n) = Mx(n-1) + Ki e(n), within the data range; M(n) = Kc e(n) + Kr (e(n) - e(n-1)) + Mx(n).

    What the derivative remembers is kept up without a derivative too: one that is switched on does not kick. The
    bias keeps its fraction (D35); the freeze looks at the output of the calculation before (D39).
    """
    bias = s.bias
    change = s.ki * e
    if change != 0.0:
        if c.freeze and ((change > 0.0 and s.out >= c.out_max) or (change < 0.0 and s.out <= c.out_min)):
            change = 0.0
        bias += change
    if bias > c.out_max:
        bias = c.out_max
    elif bias < c.out_min:
        bias = c.out_min
    s.bias = bias
    if s.kd == 0.0:
        s.x1 = x
        return s.kp * e + bias
    y = filtered(s, x)
    slope = y - s.x1
    s.x1 = y
    return s.kp * e + s.kd * slope + bias


def calculate(c: Config, s: State, sp: float, pv: float) -> float:
    """The output in counts, with everything that the plain position form does without."""
    e = shaped(c, sp, pv) if c.curved else (sp - pv) / c.span
    x = -process(c, pv) / c.span if c.on_pv else e
    if s.busy & FRESH:
        refresh(s, e, x, sp)
    if c.step_bias and sp != s.last_sp:
        stepped_bias(c, s, sp)
    return velocity(s, e, x) if c.velocity else position(c, s, e, x)
