"""The virtual NextoPID: one cycle of the task.

Design. `scan` is called at every base step; it calls the blocks that are due, in the order of execution, each after
its wires have been renewed; what the program around assigns is new in every cycle (D694). What a block is stands in
one module a family: `equation` (with `autotune`), `on_off`, `pwm`, `filters`, `delay`, `selectors`. Nothing here knows
files or names: see `memory` for how a program becomes `Config` and `State`.
"""

from __future__ import annotations

from pidcfg.sim.controllers.nextopid import slots
from pidcfg.sim.controllers.nextopid.delay import delay, delay_lag
from pidcfg.sim.controllers.nextopid.equation import (
    pid,
)
from pidcfg.sim.controllers.nextopid.filters import lag, lead_lag, low_filter
from pidcfg.sim.controllers.nextopid.modes import keep_results, operate
from pidcfg.sim.controllers.nextopid.on_off import on_off
from pidcfg.sim.controllers.nextopid.plc import Nextopid, load
from pidcfg.sim.controllers.nextopid.pwm import pwm
from pidcfg.sim.controllers.nextopid.selectors import select_max, select_min, split_range
from pidcfg.sim.controllers.nextopid.state import Config, State
from pidcfg.sim.controllers.nextopid.wires import move, value_of, wire_in
from pidcfg.sim.costs import COSTS
from pidcfg.sim.plc import NoOptions as Options

__all__ = ["COST", "INLINED", "Config", "Nextopid", "Options", "State", "call", "load", "scan"]


def call(c: Config, s: State, aux: list[float], sig: list[float]) -> None:
    """One call of a block (kernel)."""
    kind = c.kind
    if kind <= slots.PIDA_TUNE_INT:
        pid(c, s, sig)
        sig[c.sig_sp] = s.sp
        if kind >= slots.PIDA_TUNE_REAL:
            keep_results(c, s, sig)
    elif kind == slots.LEAD_LAG:
        lead_lag(c, s, sig)
    elif kind == slots.DELAY:
        delay(c, s, aux, sig)
    elif kind == slots.DELAY_LAG:
        delay_lag(c, s, aux, sig)
    elif kind == slots.LAG:
        lag(c, s, sig)
    elif kind == slots.LOW_FILTER:
        low_filter(c, s, sig)
    else:
        call_switch(c, s, sig)


def call_switch(c: Config, s: State, sig: list[float]) -> None:
    """One call of a block that switches or selects (kernel)."""
    kind = c.kind
    if kind == slots.ON_OFF:
        on_off(c, s, sig)
        sig[c.sig_sp] = s.sp
    elif kind == slots.PWM:
        pwm(c, s, sig)
    elif kind == slots.SELECT_MIN:
        select_min(c, sig)
    elif kind == slots.SELECT_MAX:
        select_max(c, sig)
    else:
        split_range(c, sig)


def scan(tick: int, cfg: list[Config], st: list[State], aux: list[float], sig: list[float]) -> None:
    """The task at ``tick``: the operator's commands, what the program around assigns, moves, calls in turn, moves."""
    count = len(cfg)
    for i in range(count):
        if st[i].command != 0:
            operate(cfg[i], st[i], sig)
        if cfg[i].early > 0:
            wire_in(cfg[i], st[i], aux, sig, cfg[i].wires + cfg[i].early)
    if count > 0 and cfg[0].moves < cfg[0].moves_first:
        move(st[0], tick, aux, sig, cfg[0].moves, cfg[0].moves_first)
    for turn in range(count):
        called = cfg[turn].turn
        c = cfg[called]
        s = st[called]
        if tick >= s.due:
            s.due = tick + s.period
            if c.wires < c.wires_end:
                wire_in(c, s, aux, sig, c.wires_end)
            if s.fault != 0 and s.fault_at < 0:
                s.fault_at = tick
            call(c, s, aux, sig)
            if c.error >= 0 and sig[c.error] != 0.0:
                s.erred = 1
    if count > 0 and cfg[0].moves_first < cfg[0].moves_end:
        move(st[0], tick, aux, sig, cfg[0].moves_first, cfg[0].moves_end)


INLINED = (scan, wire_in, value_of)
"""The hot path of compiled code."""
COST = COSTS["nextopid"]
