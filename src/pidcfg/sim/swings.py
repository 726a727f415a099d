"""Swings of a loop's PV: its turning points while it controls, and what makes an oscillation of them.

Design. Two counts run side by side: one over the last third of the run, which the metrics tell, and one since the last
event that moves the loop, so that what an event stirs up is not taken for what the loop does by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.meters import NEVER

if TYPE_CHECKING:
    from pidcfg.sim.meters import Meter

GROWTH = 1.1
"""Times the swing before: one that is larger grows."""
GROWN = 3
"""Swings in a row that grow, and make an oscillation however few there are."""
PERIODS = 3
"""Whole periods that make an oscillation."""
EVEN = 2
"""Times the shortest period that the longest one may last: what noise stirs up is less even."""
SUSTAINED = 0.8
"""Of the first swing that the last one must have."""


def watch_swings(k: int, m: Meter, pv: float) -> None:
    """The PV's turning points while the loop controls (kernel)."""
    if m.control == 0 or m.extreme_at < 0:
        m.extreme = pv
        m.extreme_at = k
        m.turns = 0
        m.calm_turns = 0
    elif m.course > 0:
        if pv > m.extreme:
            m.extreme = pv
            m.extreme_at = k
        elif m.extreme - pv > m.least:
            turn(k, m, pv)
    elif pv < m.extreme:
        m.extreme = pv
        m.extreme_at = k
    elif pv - m.extreme > m.least:
        turn(k, m, pv)


def turn(k: int, m: Meter, pv: float) -> None:
    """The PV has come so far from its last extreme that this was a turning point (kernel)."""
    before, swing = m.last_swing, abs(m.extreme - m.turn_value)
    period = m.extreme_at - m.turn_before
    m.last_swing = swing
    if m.extreme_at >= m.late:
        if m.turns == 0 and m.calm_turns > 0:
            m.turns = 1
        if m.turns == 1:
            m.first_turn = m.extreme_at
            m.swings = 0.0
            m.shortest = NEVER
            m.longest = 0
        elif m.turns > 1:
            m.swings += swing
            if m.turns == 2:
                m.first_swing = swing
            else:
                m.shortest = min(m.shortest, period)
                m.longest = max(m.longest, period)
        m.turns += 1
    if m.calm_turns == 1:
        m.calm_first_turn = m.extreme_at
        m.calm_swings = 0.0
        m.widest = 0.0
        m.calm_shortest = NEVER
        m.calm_longest = 0
    elif m.calm_turns > 1:
        m.calm_swings += swing
        m.widest = max(m.widest, swing)
        if m.calm_turns == 2:
            m.calm_first_swing = swing
            m.growing = 0
            m.grown = 0
        else:
            m.calm_shortest = min(m.calm_shortest, period)
            m.calm_longest = max(m.calm_longest, period)
            m.growing = m.growing + 1 if swing > GROWTH * before else 0
            m.grown = max(m.grown, m.growing)
    m.calm_turns += 1
    m.turn_value = m.extreme
    m.turn_before = m.last_turn
    m.last_turn = m.extreme_at
    m.course = -m.course
    m.extreme = pv
    m.extreme_at = k


# --- between two segments, and at the end ----------------------------------------------------------------------------


def oscillation(m: Meter, last: int) -> tuple[float, float] | None:
    """Period in base steps and amplitude (half peak to peak) of a sustained oscillation in the last third."""
    halves = m.turns - 2
    if halves < 2 * PERIODS or m.last_swing < SUSTAINED * m.first_swing or m.longest > EVEN * m.shortest:
        return None
    period = 2 * (m.last_turn - m.first_turn) / halves
    return (period, m.swings / halves / 2) if last - m.last_turn <= period else None


def calm_oscillation(m: Meter, k: int) -> tuple[float, float] | None:
    """The same of one since the last event, up to base step ``k``; one that grows need not have three periods."""
    halves = m.calm_turns - 2
    if halves < 2 * PERIODS and (halves < 1 or m.grown < GROWN):
        return None
    if m.calm_longest > EVEN * m.calm_shortest:
        return None
    if m.last_swing < SUSTAINED * (m.widest if m.grown >= GROWN else m.calm_first_swing):
        return None
    period = 2 * (m.last_turn - m.calm_first_turn) / halves
    return (period, m.calm_swings / halves / 2) if k - m.last_turn <= period else None


def calm(m: Meter) -> None:
    """An event moves the loop: what swings after it, swings anew."""
    m.calm_turns = 0
