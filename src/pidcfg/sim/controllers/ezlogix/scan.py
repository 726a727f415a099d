"""The virtual EZLogix: its PID loops at one base step.

Design. `scan` is called at every base step; it calculates the loops that are due, in ascending order, and moves the
control outputs, which work between samples too. `sample` is one calculation of one loop: PV, set point, error, then
whatever rarely happens (`State.busy`: a mode, an autotune), equation, saturation, signals. Nothing here knows files,
names or units: see `plc.load` for how registers become `Config` and `State`.

Signals of a loop (slots in `Config`): ``sig_in`` is read, in engineering units; PV, SP, CV and BIAS (integral term and
offset) are written in engineering units, ERROR, STATUS and COUNTDOWN as their registers hold them, O as 0 or 1. With
the square root of the PV, SP is the PV that satisfies the set point, so that both can be compared.
"""

from __future__ import annotations

from math import sqrt

from pidcfg.sim.controllers.ezlogix.autotune import tune
from pidcfg.sim.controllers.ezlogix.equation import FULL, calculate
from pidcfg.sim.controllers.ezlogix.plc import Ezlogix, load
from pidcfg.sim.controllers.ezlogix.pulse import pulse
from pidcfg.sim.controllers.ezlogix.signals import show, show_output, show_setpoint
from pidcfg.sim.controllers.ezlogix.state import (
    AUTO,
    FRESH,
    HELD,
    MODES,
    PV_STALE,
    REQUEST,
    SATURATED,
    STOPPED,
    TUNE,
    Config,
    State,
)
from pidcfg.sim.costs import COSTS
from pidcfg.sim.plc import NoOptions as Options
from pidcfg.sim.terms import NEAREST

__all__ = ["COST", "INLINED", "Config", "Ezlogix", "Options", "State", "load", "sample", "scan"]

ERROR_MOST = 32767.0
"""Base+11, the error, is a signed word that stays within this (D169)."""


def converted(c: Config, value: float) -> float:
    """A measurement as whole counts; the converter saturates at the ends of its range (D670)."""
    pv = (value - c.pv_low) * c.pv_span / c.pv_width + c.pv_min
    if pv >= c.pv_max:
        return c.pv_max
    if pv > c.pv_min:
        return pv + NEAREST - NEAREST
    return c.pv_min


def switch(s: State) -> None:
    """Discrete +0 as it was written; Manual keeps the CV, Auto begins with it."""
    s.busy &= ~REQUEST
    if s.wanted & AUTO and s.status & AUTO == 0:
        s.busy |= FRESH
    s.status = (s.status & ~MODES) | s.wanted


def limit_setpoint(i: int, cfg: list[Config], st: list[State], sig: list[float]) -> None:
    """Limits write the register of the set point (D164), which may be an outer loop's CV too (D177)."""
    c = cfg[i]
    s = st[i]
    if s.sp > c.sp_high:
        s.sp = c.sp_high
    if s.sp < c.sp_low:
        s.sp = c.sp_low
    outer = c.fed_by
    if outer >= 0 and st[outer].out != s.sp:
        st[outer].out = s.sp
        show_output(cfg[outer], st[outer], sig)


def sample(i: int, cfg: list[Config], st: list[State], aux: list[float], sig: list[float]) -> None:
    """One calculation of loop ``i``."""
    c = cfg[i]
    s = st[i]
    busy = s.busy
    if busy & PV_STALE == 0:
        s.pv = converted(c, sig[c.sig_in])
    limit_setpoint(i, cfg, st, sig)
    # a root is that of the register (D163)
    x = s.pv
    if c.root:
        x = sqrt(x) if x > 0.0 else 0.0
    difference = x - s.sp if c.direct else s.sp - x
    x *= c.scale
    e = difference * c.scale
    error = e + NEAREST - NEAREST
    if error > ERROR_MOST:
        error = ERROR_MOST
    elif error < -ERROR_MOST:
        error = -ERROR_MOST
    s.error = error
    # the deadband acts in every term (D170)
    if -c.deadband < difference < c.deadband:
        e = 0.0

    if busy & REQUEST:
        switch(s)
    if busy & TUNE:
        tune(c, s, aux, x)
    # the derivative acts on the PV, with the sign that the error has (D161), or on the error
    if c.velocity == 0:
        x = e
    elif c.direct == 0:
        x = -x
    if s.status & AUTO and s.busy & HELD == 0:
        calculate(c, s, e, x)
    else:
        s.whole = s.out
        s.x1 = x
    # the bit tells of the CV as it is (D167); anti-windup looks at what it would be without its limits
    if 0.0 < s.out < FULL:
        s.status &= ~SATURATED
    else:
        s.status |= SATURATED
    if c.feeds >= 0:
        st[c.feeds].sp = s.out
        show_setpoint(cfg[c.feeds], st[c.feeds], sig)
    show(c, s, sig)


def scan(tick: int, cfg: list[Config], st: list[State], aux: list[float], sig: list[float]) -> None:
    """The PLC at ``tick``: every loop that is due, and every control output."""
    for i in range(len(cfg)):
        s = st[i]
        due = s.due
        if tick >= due:
            due += s.period
            s.due = due if due > tick else tick + s.period
            sample(i, cfg, st, aux, sig)
        if cfg[i].cycle > 0 and s.busy & STOPPED == 0:
            pulse(tick, cfg[i], s, sig)


INLINED = (scan, sample, limit_setpoint, calculate, converted, show, show_setpoint, show_output, pulse)
"""The hot path of compiled code."""
COST = COSTS["ezlogix"]
