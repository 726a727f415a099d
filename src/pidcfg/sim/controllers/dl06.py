"""The virtual DL06: one scan of its loop task.

Design. `scan` is called at every base step and calculates the loops that are due, in ascending order. `sample` is one
calculation of one loop, top to bottom in the order of the manual's block diagrams: PV word and filter, then whatever
rarely happens (`State.busy`: mode requests, ramp/soak, auto-tune), set point, alarms, error, PID equation, limits,
output word. Nothing here knows files, names or units: see `dl06_plc.load` for how words become `Config` and `State`.

Signals of a loop (slots in `Config`): ``sig_in`` is read, in engineering units; ``sig_pv``, ``sig_sp``, ``sig_out`` and
``sig_bias`` are written, as the words say in engineering units. With square-root extract ``sig_sp`` is the PV that
satisfies the set point, so that both can be compared.
"""

from __future__ import annotations

from math import sqrt

from pidcfg.sim.controllers import dl06_alarms, dl06_modes, dl06_ramp_soak
from pidcfg.sim.controllers.dl06_alarms import alarms
from pidcfg.sim.controllers.dl06_modes import OVERRIDE_OVERFLOW, modes, to_manual
from pidcfg.sim.controllers.dl06_ramp_soak import ramp_soak
from pidcfg.sim.controllers.dl06_state import (
    BLIND,
    CASCADE,
    FIRST,
    FRESH,
    GOAL,
    MANUAL,
    MUTE,
    NEAREST,
    OVERFLOW,
    REQUEST,
    RESTORE,
    SOAK,
    STOPPED,
    TICKS,
    TRIP,
    TUNE,
    Config,
    State,
)

LARGEST = 2147483647.0
"""An output beyond a signed 32-bit number of counts is an overflow."""
MODE_WORK = TRIP | RESTORE | REQUEST | GOAL


def coefficients(c: Config, s: State) -> None:
    """The factors of the equation, from the gain words: Ki = Kc Ts/Ti and Kr = Kc Td/Ts, in output counts.

    A gain of 0 takes the proportional term out and leaves Ki = Ts/Ti, Kr = Td/Ts.
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
    """The PV on the set point's scale: itself, or its root."""
    if c.root == 0:
        return pv
    return sqrt(pv) if pv > 0.0 else 0.0


def shaped(c: Config, sp: float, pv: float) -> float:
    """The error as a fraction of the span: root extract, then the square, then the deadband."""
    e = (sp - process(c, pv)) / c.span
    if c.squared:
        e = e * abs(e)
    if -c.deadband <= e <= c.deadband:
        e = 0.0
    return e


def refresh(s: State, e: float, x: float, sp: float) -> None:
    """Give the equation a past that equals the present: no kick after Manual."""
    s.e1 = e
    s.x1 = x
    s.x2 = x
    s.last_sp = sp
    s.busy &= ~FRESH


def stepped_bias(c: Config, s: State, sp: float) -> None:
    """Step bias: a change of the set point changes the bias in proportion, inversely for reverse action."""
    if sp * s.last_sp > 0.0:
        s.bias *= s.last_sp / sp if c.reverse else sp / s.last_sp
    s.last_sp = sp


def velocity(s: State, e: float, x: float) -> float:
    """Change of output: Kc (e(n) - e(n-1)) + Ki e(n) + Kr (e(n) - 2 e(n-1) + e(n-2)), on top of the one before."""
    y = s.x1 + s.lag * (x - s.x1)
    m = s.m + s.kp * (e - s.e1) + s.ki * e + s.kd * (y - 2.0 * s.x1 + s.x2)
    s.x2 = s.x1
    s.x1 = y
    s.e1 = e
    return m


def position(c: Config, s: State, e: float, x: float) -> float:
    """Mx(n) = Mx(n-1) + Ki e(n), within the data range; M(n) = Kc e(n) + Kr (e(n) - e(n-1)) + Mx(n)."""
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
    m = s.kp * e + bias
    if s.kd != 0.0:
        change = s.lag * (x - s.x1)
        s.x1 += change
        m += s.kd * change
    return m


def sample(i: int, cfg: list[Config], st: list[State], aux: list[float], sig: list[float]) -> None:
    """One calculation of loop ``i``."""
    c = cfg[i]
    s = st[i]
    busy = s.busy
    if busy & (STOPPED | MUTE):
        sig[c.sig_out] = c.out_low + (0.0 - c.out_min) * c.out_width / c.out_span
        if busy & STOPPED:
            return
    # the A/D converter saturates; the PV word is a whole number of counts
    pv = (sig[c.sig_in] - c.pv_low) * c.pv_span / c.pv_width + c.pv_min
    if pv >= c.pv_max:
        pv = c.pv_max
    elif pv > c.pv_min:
        pv = pv + NEAREST - NEAREST
    else:
        pv = c.pv_min
    old = s.pv
    if busy & FIRST:
        old = pv
    elif busy & BLIND:
        pv = old
    if c.filter < 1.0:
        pv = old + c.filter * (pv - old) + NEAREST - NEAREST
    s.pv = pv

    if busy:
        s.busy = busy & ~FIRST
        if busy & MODE_WORK:
            modes(i, cfg, st)
        if busy & SOAK:
            ramp_soak(c, s, aux)
        busy = s.busy
    status = s.status

    sp = st[c.major].out if status & CASCADE else s.sp
    if sp < c.sp_min:
        sp = c.sp_min
    elif sp > c.sp_max:
        sp = c.sp_max
    change = pv - old
    fast = c.rate_of_change
    if pv < s.quiet_low or pv > s.quiet_high or sp != s.quiet_sp or change > fast or -change > fast:
        alarms(c, s, pv, old, sp)
        centre = sp * sp if c.root else sp
        sig[c.sig_sp] = c.pv_low + (centre - c.pv_min) * c.pv_width / c.pv_span

    if status & MANUAL == 0 and busy & TUNE == 0:
        e = shaped(c, sp, pv) if c.curved else (sp - pv) / c.span
        x = -process(c, pv) / c.span if c.on_pv else e
        if busy & FRESH:
            refresh(s, e, x, sp)
        if c.step_bias and sp != s.last_sp:
            stepped_bias(c, s, sp)
        m = velocity(s, e, x) if c.velocity else position(c, s, e, x)
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

    sig[c.sig_pv] = c.pv_low + (pv - c.pv_min) * c.pv_width / c.pv_span
    if busy & MUTE == 0:
        sig[c.sig_out] = c.out_low + (s.out - c.out_min) * c.out_width / c.out_span
    sig[c.sig_bias] = c.out_low + (s.bias + NEAREST - NEAREST - c.out_min) * c.out_width / c.out_span


def next_slow(tick: int, cfg: list[Config], st: list[State]) -> int:
    """The slow loop that this scan calculates: the first due one behind the one that was served last; -1: none."""
    n = len(cfg)
    for k in range(1, n + 1):
        i = (st[0].turn + k) % n
        if cfg[i].slow and tick >= st[i].due:
            st[0].turn = i
            return i
    return -1


def scan(tick: int, cfg: list[Config], st: list[State], aux: list[float], sig: list[float]) -> None:
    """One scan at ``tick``: every fast loop that is due, and at most one slow one where scans have a length."""
    chosen = -2
    for i in range(len(cfg)):
        s = st[i]
        if tick < s.due:
            continue
        if cfg[i].slow:
            if chosen == -2:
                chosen = next_slow(tick, cfg, st)
            if i != chosen:
                continue
        due = s.due + s.period
        s.due = due if due > tick else tick + s.period
        sample(i, cfg, st, aux, sig)


KERNELS = (
    *dl06_alarms.KERNELS,
    *dl06_modes.KERNELS,
    *dl06_ramp_soak.KERNELS,
    coefficients,
    process,
    shaped,
    refresh,
    stepped_bias,
    velocity,
    position,
    sample,
    next_slow,
    scan,
)
