"""Mode requests of a DL06 loop: what is granted, refused or overridden, and the bumpless transfers.

A request moves one step along manual - auto - cascade. `REASONS` gives the text of each refusal and override; kernels
leave its number in `State.notice`.
"""

from __future__ import annotations

from math import sqrt

from pidcfg.sim.controllers.dl06.alarms import absolute, alarmed
from pidcfg.sim.controllers.dl06.state import (
    ALARM_ERROR,
    AUTO,
    CASCADE,
    FRESH,
    GOAL,
    MANUAL,
    MODES,
    OVERFLOW,
    REQUEST,
    RESTORE,
    TRIP,
    Config,
    State,
)
from pidcfg.sim.notices import tell_request
from pidcfg.sim.terms import NEAREST

REFUSED_PROGRAM = 1
REFUSED_OFF = 2
REFUSED_STEP = 3
REFUSED_MINOR = 4
REFUSED_ALARM_ERROR = 5
REFUSED_PV_ALARM = 6
REFUSED_NO_REMOTE = 7
LAST_REFUSAL = REFUSED_NO_REMOTE
"""Refusals concern a mode only when one was requested; overrides always do."""
OVERRIDE_ALARM_ERROR = 10
OVERRIDE_OVERFLOW = 11
OVERRIDE_MINOR = 12
OVERRIDE_PROGRAM = 13
RESTORED = 14
OVERRIDE_NO_REMOTE = 15
GIVEN_UP = 16
"""The configured mode and set point (D643); it is not about the mode that is requested, and not in `REASONS`."""

REASONS = {
    REFUSED_PROGRAM: "refused: the CPU is in Program mode and the loop is not independent of it",
    REFUSED_OFF: "refused: the loop is not calculated",
    REFUSED_STEP: "refused: a loop cannot go from Manual to Cascade or back without Auto in between",
    REFUSED_MINOR: "refused: the minor loop is not in Cascade",
    REFUSED_ALARM_ERROR: "refused: alarm programming error (+06 bit 10)",
    REFUSED_PV_ALARM: "refused: a PV alarm is active",
    REFUSED_NO_REMOTE: "refused: the remote set point pointer (+32) names no control output of the loop table",
    OVERRIDE_ALARM_ERROR: "to Manual: alarm programming error (+06 bit 10)",
    OVERRIDE_OVERFLOW: "to Manual: calculation overflow (+06 bit 11)",
    OVERRIDE_MINOR: "to Manual: the minor loop left Cascade",
    OVERRIDE_PROGRAM: "to Manual: the CPU went to Program mode",
    RESTORED: "back to the mode before Program mode",
    OVERRIDE_NO_REMOTE: "to Manual: the remote set point pointer (+32) names no control output any more",
}


def on_sp_scale(c: Config, pv: float) -> float:
    """The set point word that equals a PV word."""
    if c.root == 0:
        return pv
    return sqrt(pv) + NEAREST - NEAREST if pv > 0.0 else 0.0


def to_manual(i: int, cfg: list[Config], st: list[State], reason: int) -> None:
    """Put a loop into Manual, and with it each major loop whose minor thereby leaves Cascade."""
    while i >= 0:
        s = st[i]
        if s.status & MANUAL:
            return
        major = cfg[i].major if s.status & CASCADE else -1
        s.status = (s.status & ~MODES) | MANUAL
        s.requested = 0
        tell_request(s, reason)
        i = major
        reason = OVERRIDE_MINOR


def transfer(i: int, wanted: int, cfg: list[Config], st: list[State]) -> None:
    """Carry out a granted change of mode with its bumpless transfer.

    Type I: manual to auto makes the bias the output and SP the PV, auto to cascade makes the major loop's output this
    loop's PV. Type II only makes the bias the output. The velocity form has no bias (D41). Cascade to auto changes
    nothing but the source of the set point (D646).
    """
    c, s = cfg[i], st[i]
    now = s.status & MODES
    if wanted == MANUAL:
        s.status = (s.status & ~MODES) | MANUAL
        return
    if wanted == AUTO and now == MANUAL:
        s.m = s.out
        if c.velocity == 0:
            s.bias = s.out
        if c.bumpless == 1:
            s.sp = on_sp_scale(c, s.pv)
        s.status &= ~OVERFLOW
        s.busy |= FRESH
    if wanted == AUTO and now == CASCADE and c.major >= 0:
        to_manual(c.major, cfg, st, OVERRIDE_MINOR)
    if wanted == CASCADE and c.bumpless == 1 and c.major >= 0:
        st[c.major].out = on_sp_scale(c, s.pv)
    s.status = (s.status & ~MODES) | wanted


def refusal(i: int, wanted: int, cfg: list[Config], st: list[State]) -> int:
    """Why a requested mode is refused, by alarms (D43) or in a cascade (D44); 0: it is granted."""
    c, s = cfg[i], st[i]
    now = s.status & MODES
    if now | wanted == MANUAL | CASCADE:
        return REFUSED_STEP
    if wanted == CASCADE and c.major < 0:
        return REFUSED_NO_REMOTE
    if now != MANUAL or wanted != AUTO:
        return 0
    if s.status & ALARM_ERROR:
        return REFUSED_ALARM_ERROR
    if c.interlock and alarmed(s):
        return REFUSED_PV_ALARM
    for j in range(len(cfg)):
        if cfg[j].major == i and st[j].status & CASCADE == 0:
            return REFUSED_MINOR
    return 0


def request_mode(i: int, wanted: int, cfg: list[Config], st: list[State]) -> int:
    """Request a mode: it is entered, or the reason of the refusal is returned."""
    s = st[i]
    s.requested = wanted
    if s.status & MODES == wanted:
        return 0
    reason = refusal(i, wanted, cfg, st)
    if reason == 0:
        transfer(i, wanted, cfg, st)
    return reason


def waits(i: int, cfg: list[Config], st: list[State]) -> bool:
    """Whether a minor loop of this one is still on its way to Cascade, unrefused: the order is inside out (D644)."""
    for j in range(len(cfg)):
        s = st[j]
        minor = cfg[j].major == i and cfg[j].halt == 0
        if minor and s.goal == CASCADE and s.refused == 0 and s.status & CASCADE == 0:
            return True
    return False


def pursue(i: int, cfg: list[Config], st: list[State]) -> None:
    """Come one step closer to the goal; at the goal write its set point, as an operator would (D45, D643)."""
    s = st[i]
    now = s.status & MODES
    if now == s.goal:
        if s.goal_writes:
            s.sp = s.goal_sp
        s.busy &= ~GOAL
        s.goal = 0
        return
    wanted = s.goal if now == AUTO else AUTO
    if now == MANUAL and waits(i, cfg, st):
        return
    reason = request_mode(i, wanted, cfg, st)
    if reason and (s.refused >> reason) & 1 == 0:
        s.refused |= 1 << reason
        tell_request(s, reason)


def restore(i: int, cfg: list[Config], st: list[State]) -> None:
    """Return to the mode before Program mode; the CPU forces it, so nothing refuses."""
    s = st[i]
    s.busy &= ~RESTORE
    s.requested = 0
    if s.status & MODES == s.prior:
        return
    if s.status & ALARM_ERROR:
        s.requested = s.prior
        tell_request(s, REFUSED_ALARM_ERROR)
        return
    transfer(i, AUTO, cfg, st)
    if s.prior == CASCADE and cfg[i].major < 0:
        s.requested = CASCADE
        tell_request(s, REFUSED_NO_REMOTE)
        return
    if s.prior == CASCADE:
        transfer(i, CASCADE, cfg, st)
    tell_request(s, RESTORED)


def modes(i: int, cfg: list[Config], st: list[State]) -> None:
    """Everything that can change the mode in one sample: override, restoring, request, goal."""
    s = st[i]
    if s.busy & TRIP:
        s.busy &= ~TRIP
        to_manual(i, cfg, st, OVERRIDE_ALARM_ERROR)
    if s.busy & RESTORE:
        restore(i, cfg, st)
    if s.busy & (REQUEST | GOAL):
        absolute(cfg[i], s, s.pv)
    if s.busy & REQUEST:
        s.busy &= ~(REQUEST | GOAL)
        s.goal = 0
        reason = request_mode(i, s.request, cfg, st)
        s.request = 0
        if reason:
            tell_request(s, reason)
    if s.busy & GOAL:
        pursue(i, cfg, st)
