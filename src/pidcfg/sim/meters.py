"""What is counted about a loop while it runs, so that verdicts need nothing but numbers that a kernel keeps.

Design. A `Meter` a loop. What depends on the loop's status (time in Auto or Cascade, time in alarm, every mode and flag
that there was) is counted when the status changes, and costs nothing between. What depends on its signals is looked at
at each base step, swings of the PV (`pidcfg.sim.swings`) from the last event before the last third on. The journal
lists the same happenings for people; no verdict reads it, so that a batch of runs without a journal is judged alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

NEVER = 1 << 62
"""A base step that no run reaches."""


@dataclass(slots=True)
class Meter:
    """What is known about one loop so far; ``pv``, ``sp``, ``out`` are signals, times are base steps (−1: not yet)."""

    pv: int
    sp: int
    out: int
    status: int = -1
    aux_status: int = -1
    iae: float = 0.0
    ise: float = 0.0
    itae: float = 0.0
    """Sums over base steps in Auto or Cascade: the integrals are these times dt, and times dt² for ``itae``."""
    variation: float = 0.0
    last_out: float = 0.0
    last_sp: float = 0.0
    pv_low: float = 0.0
    pv_high: float = 0.0
    sp_low: float = 0.0
    sp_high: float = 0.0
    out_low: float = 0.0
    out_high: float = 0.0
    event: int = -1
    before: float = 0.0
    after: float = 0.0
    stepped: int = 0
    locked: int = 0
    """Until this base step the new set point may still be limited by the controller."""
    peak_low: float = 0.0
    peak_high: float = 0.0
    rise_from: int = -1
    rise_to: int = -1
    # modes
    control_bits: int = 0
    """The bits of ``status`` that mean Auto or Cascade."""
    control: int = 0
    """Whether one of them is on."""
    control_since: int = 0
    """When that changed last."""
    control_steps: int = 0
    """Base steps in Auto or Cascade, up to the last change."""
    wanted: int = 0
    """The mode bits that are to be reached; 0: the loop is meant for none of ``control_bits``."""
    wanted_since: int = 0
    seen: int = 0
    """Every status bit since the mode was wanted."""
    left: int = -1
    """When a loop that was in its wanted mode left it last."""
    missed: int = -1
    """When a wanted mode that had not been reached was given up for another."""
    ever: int = 0
    """Every status bit of the run, and every auxiliary one."""
    ever_aux: int = 0
    # alarms of the outermost kind, while in Auto or Cascade and with the sensor sound
    outer_bits: int = 0
    broken: int = 0
    """The loop's sensor is broken by an event."""
    blind_from: int = -1
    """The time in Auto or Cascade at which it broke for good; −1: it has not, or has been repaired."""
    blind_steps: int = 0
    """Base steps in Auto or Cascade with a sensor that had broken for good, up to its repair."""
    cut_from: int = -1
    """The time in Auto or Cascade at which a plant lost its gain, so that nothing moves the PV; −1: it has one."""
    alarm: int = 0
    alarm_since: int = 0
    alarm_steps: int = 0
    alarms: int = 0
    """The bits of those that came."""
    # the end of the run, and of what comes before an event
    watched: int = NEVER
    """From here on the loop is looked at."""
    window: int = NEVER
    """Where the error begins to be summed up, for whether it gets smaller."""
    middle: int = NEVER
    """Where the second half of that begins."""
    late: int = NEVER
    """Where the last third begins."""
    late_status: int = 0
    """Every status bit of the last third, and every auxiliary one."""
    late_aux: int = 0
    early_error: float = 0.0
    """The sum of the error over the first half of the window, and over the second."""
    final_error: float = 0.0
    early_sp: float = 0.0
    """The same of the set point."""
    final_sp: float = 0.0
    side: int = 0
    """The set point is above the PV (1) or below it (−1); 0: it has not been looked at yet."""
    since: int = 0
    """From when on."""
    # swings of the PV: in the last third, and since the last event
    swung: int = NEVER
    """From here on they are looked at."""
    least: float = 0.0
    """A move of the PV that is no larger is no swing."""
    course: int = 1
    """The PV rises (1) or falls (−1)."""
    extreme: float = 0.0
    extreme_at: int = -1
    turn_value: float = 0.0
    last_turn: int = 0
    turn_before: int = 0
    """The turning point before the last one."""
    last_swing: float = 0.0
    turns: int = 0
    """Turning points of the last third, the first of which may be none: the run was cut there."""
    first_turn: int = 0
    first_swing: float = 0.0
    swings: float = 0.0
    """The sum of all."""
    shortest: int = 0
    """Base steps of the shortest whole period, and of the longest."""
    longest: int = 0
    calm_turns: int = 0
    """The same since the last event, also from before the last third."""
    calm_first_turn: int = 0
    calm_first_swing: float = 0.0
    calm_swings: float = 0.0
    calm_shortest: int = 0
    calm_longest: int = 0
    growing: int = 0
    """Swings in a row each of which was larger than the one before, up to the last one."""
    grown: int = 0
    """The most of them since the last event."""
    widest: float = 0.0
    """The largest swing since the last event."""


@dataclass(slots=True)
class Onset:
    """When a bit of a loop's status came on for the first time (−1: not yet)."""

    loop: int
    bit: int
    first: int = -1


def change_status(k: int, m: Meter, status: int, aux_status: int) -> None:
    """A loop's status has changed with base step ``k`` (kernel)."""
    if m.status & m.wanted and m.status > 0 and status & m.wanted == 0:
        m.left = k
    m.status = status
    m.aux_status = aux_status
    m.seen |= status
    m.ever |= status
    m.ever_aux |= aux_status
    if k >= m.late:
        m.late_status |= status
        m.late_aux |= aux_status
    control = 1 if status & m.control_bits else 0
    if control != m.control:
        if m.control == 1:
            m.control_steps += k - m.control_since
        m.control = control
        m.control_since = k
    count_alarm(k, m)


def note_onsets(k: int, loop: int, status: int, onsets: Sequence[Onset]) -> None:
    """Bits that somebody waits for, with a loop's new status at base step ``k`` (kernel)."""
    for i in range(len(onsets)):
        onset = onsets[i]
        if onset.loop == loop and onset.first < 0 and status & onset.bit:
            onset.first = k


def count_alarm(k: int, m: Meter) -> None:
    """An alarm of the outermost kind has come or gone, or no longer counts (kernel)."""
    bits = m.status & m.outer_bits if m.control == 1 and m.broken == 0 else 0
    m.alarms |= bits
    alarm = 1 if bits else 0
    if alarm != m.alarm:
        if m.alarm == 1:
            m.alarm_steps += k - m.alarm_since
        m.alarm = alarm
        m.alarm_since = k


def watch_end(k: int, m: Meter, pv: float, sp: float) -> None:
    """What only the end of a run, or of a part of it, tells: the error in a window, and swings of the PV (kernel)."""
    if sp > pv:
        if m.side <= 0:
            m.side = 1
            m.since = k
    elif m.side >= 0:
        m.side = -1
        m.since = k
    if k >= m.middle:
        m.final_error += sp - pv
        m.final_sp += sp
    elif k >= m.window:
        m.early_error += sp - pv
        m.early_sp += sp
    if k == m.late:
        m.late_status |= m.status
        m.late_aux |= m.aux_status


# --- between two segments, and at the end ----------------------------------------------------------------------------


def want(m: Meter, k: int, bits: int, grace: int) -> None:
    """Another mode is wanted from base step ``k`` on.

    The one before is missed if it had not been reached in more than ``grace`` base steps.
    """
    if m.wanted and not m.seen & m.wanted and m.missed < 0 and k - m.wanted_since > grace:
        m.missed = k
    m.wanted = bits & m.control_bits
    m.wanted_since = k
    m.seen = max(m.status, 0)
    m.left = -1


def time_in_control(m: Meter, last: int) -> int:
    """Base steps in Auto or Cascade, of those up to ``last``."""
    return m.control_steps + (last - m.control_since if m.control else 0)


def break_sensor(m: Meter, k: int, *, for_good: bool) -> None:
    """A loop's sensor breaks at base step ``k``; if it was broken before, it is otherwise from now on."""
    repair_sensor(m, k)
    m.broken = 1
    m.blind_from = time_in_control(m, k) if for_good else -1
    count_alarm(k, m)


def repair_sensor(m: Meter, k: int) -> None:
    """A loop's sensor is sound again."""
    if m.blind_from >= 0:
        m.blind_steps += time_in_control(m, k) - m.blind_from
    m.broken, m.blind_from = 0, -1
    count_alarm(k, m)


def time_blind(m: Meter, last: int) -> int:
    """Base steps in Auto or Cascade with a sensor that had broken for good, of those up to ``last``."""
    return m.blind_steps + (time_in_control(m, last) - m.blind_from if m.blind_from >= 0 else 0)


def cut_off(m: Meter, k: int, *, cut: bool) -> None:
    """From base step ``k`` on nothing moves a loop's PV, or something does again."""
    if not cut:
        m.cut_from = -1
    elif m.cut_from < 0:
        m.cut_from = time_in_control(m, k)


def time_cut(m: Meter, last: int) -> int:
    """Base steps in Auto or Cascade, of those up to ``last``, since nothing moves the PV any more."""
    return time_in_control(m, last) - m.cut_from if m.cut_from >= 0 else 0


def time_in_alarm(m: Meter, last: int) -> int:
    """Base steps in an alarm of the outermost kind, of those up to ``last``."""
    return m.alarm_steps + (last - m.alarm_since if m.alarm else 0)
