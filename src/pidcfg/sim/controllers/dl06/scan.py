"""The virtual DL06: one scan of its loop task.

Design. `scan` is called at every base step and calculates the loops that are due, in ascending order. `sample` is one
calculation of one loop, top to bottom in the order of the manual's block diagrams: PV word and filter, then whatever
rarely happens (`State.busy`: mode requests, ramp/soak, auto-tune), set point, alarms, error, PID equation, limits,
output word. Nothing here knows files, names or units: see `plc.load` for how words become `Config` and `State`.

Signals of a loop (slots in `Config`): ``sig_in`` is read, in engineering units; ``sig_pv``, ``sig_sp``, ``sig_out`` and
``sig_bias`` are written, as the words say in engineering units, and ``sig_step``, the step of the profile. With
square-root extract ``sig_sp`` is the PV that satisfies the set point, so that both can be compared.
"""

from __future__ import annotations

from pidcfg.sim.controllers.dl06.alarms import alarms
from pidcfg.sim.controllers.dl06.autotune import tune
from pidcfg.sim.controllers.dl06.equation import calculate, position
from pidcfg.sim.controllers.dl06.memory import Options
from pidcfg.sim.controllers.dl06.modes import OVERRIDE_OVERFLOW, modes, to_manual
from pidcfg.sim.controllers.dl06.plc import Dl06, load
from pidcfg.sim.controllers.dl06.ramp_soak import ramp_soak
from pidcfg.sim.controllers.dl06.state import (
    CASCADE,
    FIRST,
    FRESH,
    GOAL,
    MANUAL,
    OUTPUT_CUT,
    OVERFLOW,
    PV_STALE,
    RELAY,
    REQUEST,
    RESTORE,
    SOAK,
    STOPPED,
    TRIP,
    TUNE,
    Config,
    State,
)
from pidcfg.sim.costs import COSTS
from pidcfg.sim.terms import NEAREST

__all__ = ["COST", "INLINED", "Config", "Dl06", "Options", "State", "load", "sample", "scan"]

LARGEST = 2147483647.0
"""An output beyond a signed 32-bit number of counts is an overflow (D40)."""
MODE_WORK = TRIP | RESTORE | REQUEST | GOAL


def show_output(c: Config, s: State, sig: list[float]) -> None:
    """The output as its word says."""
    if s.busy & (STOPPED | OUTPUT_CUT) == 0:
        sig[c.sig_out] = c.out_low + (s.out - c.out_min) * c.out_width / c.out_span


def sample(i: int, cfg: list[Config], st: list[State], aux: list[float], sig: list[float]) -> None:
    """One calculation of loop ``i``."""
    c = cfg[i]
    s = st[i]
    busy = s.busy
    if busy & (STOPPED | OUTPUT_CUT):
        sig[c.sig_out] = c.out_low + (0.0 - c.out_min) * c.out_width / c.out_span
        if busy & STOPPED:
            return
    # the A/D converter saturates; the PV word is a whole number of counts (D679)
    low, least = c.pv_low, c.pv_min
    width, span = c.pv_width, c.pv_span
    pv = (sig[c.sig_in] - low) * span / width + least
    if pv >= c.pv_max:
        pv = c.pv_max
    elif pv > least:
        pv = pv + NEAREST - NEAREST
    else:
        pv = least
    old = s.pv
    # the first sample has no past (D48); the filter works on words (D36)
    if busy & FIRST:
        old = pv
    elif busy & PV_STALE:
        pv = old
    if c.filter < 1.0:
        pv = old + c.filter * (pv - old) + NEAREST - NEAREST
    s.pv = pv

    if busy:
        s.busy = busy & ~FIRST
        if busy & MODE_WORK:
            modes(i, cfg, st)
            # into Cascade a bumpless transfer writes the major loop's output (D41)
            if c.major >= 0:
                show_output(cfg[c.major], st[c.major], sig)
        if busy & SOAK:
            ramp_soak(c, s, aux, sig)
        busy = s.busy
    status = s.status

    sp = st[c.major].out if status & CASCADE else s.sp  # in Cascade +02 is left alone (D675)
    if sp < c.sp_min:
        sp = c.sp_min
    elif sp > c.sp_max:
        sp = c.sp_max
    change = pv - old
    fast = c.rate_of_change
    if pv < s.quiet_low or pv > s.quiet_high or sp != s.quiet_sp or change > fast or -change > fast:
        alarms(c, s, pv, old, sp)
        centre = sp * abs(sp) if c.root else sp
        sig[c.sig_sp] = low + (centre - least) * width / span

    if busy & TUNE:
        tune(c, s, aux, sp)
        busy = s.busy
    if status & MANUAL == 0 and busy & RELAY == 0:
        if c.special or busy & FRESH:
            m = calculate(c, s, sp, pv)
        else:
            e = (sp - pv) / c.span
            m = position(c, s, e, e)
        if m > LARGEST or m < -LARGEST:
            s.status |= OVERFLOW
            to_manual(i, cfg, st, OVERRIDE_OVERFLOW)
        else:
            if m > c.m_high:
                m = c.m_high
            if m < c.m_low:
                m = c.m_low
            s.m = m
            s.out = m + NEAREST - NEAREST

    sig[c.sig_pv] = low + (pv - least) * width / span
    low, least = c.out_low, c.out_min
    width, span = c.out_width, c.out_span
    if busy & OUTPUT_CUT == 0:
        sig[c.sig_out] = low + (s.out - least) * width / span
    sig[c.sig_bias] = low + (s.bias + NEAREST - NEAREST - least) * width / span


def next_slow(tick: int, cfg: list[Config], st: list[State]) -> int:
    """The slow loop that this scan calculates: the first due behind the last served (D52); -1: none.

    Loops that Program mode has stopped take no turn (D650).
    """
    n = len(cfg)
    for k in range(1, n + 1):
        i = (st[0].turn + k) % n
        if cfg[i].slow and tick >= st[i].due and st[i].busy & STOPPED == 0:
            st[0].turn = i
            return i
    return -1


def scan(tick: int, cfg: list[Config], st: list[State], aux: list[float], sig: list[float]) -> None:
    """One scan at ``tick``: every fast loop that is due, and at most one slow one where scans have a length."""
    chosen = -2
    for i in range(len(cfg)):
        s = st[i]
        due = s.due
        if tick < due:
            continue
        if cfg[i].slow:
            if chosen == -2:
                chosen = next_slow(tick, cfg, st)
            if i != chosen:
                continue
        due += s.period
        s.due = due if due > tick else tick + s.period
        sample(i, cfg, st, aux, sig)


INLINED = (scan, sample, position)
"""The hot path of compiled code."""
COST = COSTS["dl06"]
