"""The virtual controller of neutral loops: what is done at each base step.

Design. `scan` is called at every base step; it calculates the loops whose sample time has passed, in the order of the
file, and renews the pulses. `sample` is one calculation of one loop: PV, mode, set point, error, then the master of a
slave that is not in cascade, manual or the equation, and the alarms. Nothing here knows files, names or units: see
`plc.load` for how parameters become `Config` and `State`.

Signals of a loop (slots in `Config`): ``sig_in`` is read, in PV's unit; PV, SP, OUT, BIAS (bias and integral) and, for
a loop with a pulse output, PULSE are written.
"""

from __future__ import annotations

from pidcfg.sim.controllers.generic.equation import (
    AUTO,
    BUMPLESS,
    CASCADE,
    FRESH,
    LIMITED,
    MANUAL,
    MANUAL_SET,
    MODES,
    REQUEST,
    SLOWED,
    SP_SET,
    TRACKING,
    Config,
    State,
    by_hand,
    calculate,
    compare,
    derivative,
    measure,
    pulse,
    put_back,
    watch,
)
from pidcfg.sim.controllers.generic.plc import Generic, load
from pidcfg.sim.controllers.kernels import clamp
from pidcfg.sim.controllers.plc import ScanOptions as Options
from pidcfg.sim.costs import COSTS

__all__ = ["COST", "INLINED", "Config", "Generic", "Options", "State", "load", "sample", "scan"]


def switch(c: Config, s: State) -> None:
    """The requested mode takes effect, without a bump (D301)."""
    if s.wanted == MANUAL and not s.status & MANUAL:
        if s.busy & MANUAL_SET == 0:
            s.manual = s.out
    elif s.status & MANUAL and s.wanted != MANUAL:
        s.busy |= BUMPLESS
        if c.follows and s.wanted == AUTO and s.busy & SP_SET == 0:
            s.sp = s.pv
    s.busy &= ~(REQUEST | MANUAL_SET | SP_SET)
    s.status = (s.status & ~MODES) | s.wanted


def follows(i: int, cfg: list[Config], st: list[State]) -> bool:
    """Whether the loop has slaves, and none of them is in cascade."""
    if cfg[i].slave < 0:
        return False
    for j in range(len(cfg)):  # noqa: SIM110 - a generator cannot be compiled
        if cfg[j].source == i and st[j].status & CASCADE:
            return False
    return True


def sample(i: int, cfg: list[Config], st: list[State], sig: list[float]) -> None:
    """One calculation of a loop."""
    c = cfg[i]
    s = st[i]
    measure(c, s, sig[c.sig_in])
    if s.busy & REQUEST:
        switch(c, s)
    if s.status & CASCADE and c.source >= 0:
        s.sp = st[c.source].out
    s.sp = clamp(s.sp, c.sp_low, c.sp_high)
    compare(c, s)
    p = s.kp * s.error if c.proportional else 0.0
    d = derivative(c, s)
    s.busy &= ~FRESH
    s.status &= ~TRACKING
    if s.status & MANUAL:
        by_hand(c, s, p, d)
    elif follows(i, cfg, st):
        s.status = (s.status & ~(LIMITED | SLOWED)) | TRACKING
        s.out = clamp(st[c.slave].sp, c.low, c.high)
        put_back(s, p, d)
        s.busy |= BUMPLESS
    else:
        calculate(c, s, p, d)
    watch(c, s)
    sig[c.sig_pv] = s.pv
    sig[c.sig_sp] = s.sp
    sig[c.sig_out] = s.out
    sig[c.sig_bias] = s.bias + s.integral


def scan(tick: int, cfg: list[Config], st: list[State], aux: list[float], sig: list[float]) -> None:  # noqa: ARG001
    """The loops that are due at ``tick``, and the pulses of all."""
    for i in range(len(cfg)):
        s = st[i]
        due = s.due
        if tick >= due:
            due += s.period
            s.due = due if due > tick else tick + s.period
            sample(i, cfg, st, sig)
        if cfg[i].pulses:
            pulse(tick, cfg[i], s, sig)


INLINED = (scan, sample, measure, compare, derivative, calculate, watch)
"""The hot path of compiled code."""
COST = COSTS["generic"]
