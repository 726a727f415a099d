"""``saturated`` and ``error-stands``: no error lasts that hardly gets smaller."""

from __future__ import annotations

from collections.abc import Iterator
from math import exp, inf

from pidcfg.sim.engine.influence import answer
from pidcfg.sim.judgement.evidence import (
    PATIENCE,
    SAMPLES,
    SHARE,
    Evidence,
    Found,
    Judgement,
    Look,
    failed_verdict,
    is_deselected,
    limits_reached,
    open_verdict,
    proven_verdict,
    too_early_verdict,
    unjudged_verdict,
)

# Design. Each look (`pidcfg.sim.judgement.evidence`) compares the mean error of the two halves of its window, at the
# moment at which the window ends: limits, selectors and the other loops are as they are then. What a loop does in the
# end is judged at the last look at which it was in control, and what it does before anything happens to it at the
# first; an error that stands inside the output's limits is no event's doing and is judged at every look.

TURNED, SETTLED = 2, 3
"""Plant times after which an output at its limit has turned the PV round, and moved it about as far as it can."""
SEEN = 3
"""Times what rounding does: an error that should have lost so much and did not stands still."""
TOO_SHORT = 0.02
"""Of the plant time: in less between the halves of a window no PV moves enough to be seen."""
WORKING = 0.05
"""Of the way between an output's limits: with more of it a loop does something."""
SAME_PV = 0.05
"""Of the span: two loops whose PVs are further apart do not share one."""


def look_at(e: Evidence, i: int, look: Look) -> Found | None:
    """Judges one loop at the end of a look's window, which is now; None: it is not in control."""
    m = e.meters[i]
    if not m.control or not e.plc.in_run:
        return None
    late = _too_late(e, i, look)
    if late:
        return Found(look, late, late)
    arrived = abs(e.errors(i)[1]) <= e.bands[i]
    limit = _limit(e, i)
    if limit:
        return Found(look, _saturated(e, i, look, limit), proven_verdict("its output is at a limit"), arrived)
    against = next((name for j, name in _opponents(e, i) if _works(e, i) and _works(e, j)), "")
    inside = proven_verdict("its output is inside its limits")
    if against:
        inside = open_verdict(f"{against} works against it: both move one PV, with opposite effects")
    return Found(look, inside, _stands(e, i, look), arrived)


def _too_late(e: Evidence, i: int, look: Look) -> Judgement | None:
    """Why nothing is known of a loop that came into control in the window; None: it did not, or is at its set point."""
    m = e.meters[i]
    whole = m.control_since <= look.start
    if whole or (m.control_since <= look.middle and abs(e.errors(i)[1]) <= e.bands[i]):
        return None
    return too_early_verdict(f"it is in {e.mode(i)} from {e.seconds(m.control_since):g} s on only")


def judge_saturation(e: Evidence, i: int) -> Judgement:
    """Judges one loop by the last look that tells, and by the first if nothing had happened to it then."""
    found = e.found(i)
    opening = [f.saturated for f in found[:1] if f.look.stage == 0]
    ending = next((f.saturated for f in reversed(found) if f.saturated.tells), found[-1].saturated)
    return _worst([*opening, ending])


def judge_error(e: Evidence, i: int) -> Judgement:
    """Judges one loop by all its looks."""
    return _worst([f.stands for f in e.found(i)])


def _worst(judgements: list[Judgement]) -> Judgement:
    """The last that failed; else the last."""
    return next((j for j in reversed(judgements) if j.verdict == "failed"), judgements[-1])


def _saturated(e: Evidence, i: int, look: Look, limit: str) -> Judgement:
    early, late = abs(e.errors(i)[0]), abs(e.errors(i)[1])
    if late <= e.bands[i]:
        return proven_verdict("is at a limit of its output without an error")
    if look.stage > look.start:
        return too_early_verdict(f"at {limit} with an error of {late:.4g}: an event at {e.seconds(look.stage):g} s")
    pace, time = e.paces[i], _with_one_sign(e, i, look)
    still = abs(early - late) < e.least(i)
    moves = pace.integrates and e.span(i) * e.seconds(look.half) >= SEEN * e.least(i) * pace.seconds
    if (still or late > early) and time < (pace.seconds if still and not moves else TURNED * pace.turn):
        return too_early_verdict(f"at {limit} with an error of {late:.4g}: too little time for its plant to turn round")
    settled = not pace.integrates and time >= SETTLED * pace.seconds
    if still or late > early or (settled and early - late < _due(e, i, look, early)):
        return exempt(e, i) or _failed(e, i, look, f"at {limit} with an error of")
    return proven_verdict("is at a limit of its output with an error that gets smaller")


def _stands(e: Evidence, i: int, look: Look) -> Judgement:
    early, late = e.errors(i)
    if abs(late) <= e.bands[i]:
        return proven_verdict("its PV comes to its set point, and stays there")
    due = _due(e, i, look, abs(early))
    moving = e.least(i) if e.paces[i].integrates else max(due, e.least(i))
    if abs(early - late) >= moving:
        return proven_verdict("its PV is on its way to its set point")
    if look.stage > look.start:
        return too_early_verdict(f"an error of {abs(late):.4g}: an event at {e.seconds(look.stage):g} s")
    if is_deselected(e, i):
        return unjudged_verdict("a selector leaves its output out")
    if e.meters[i].broken:
        return unjudged_verdict("an event has broken its sensor")
    if e.set_point_moves(i) >= e.least(i):
        return unjudged_verdict(f"an error of {abs(late):.4g}: its set point moves")
    if e.plc.profile_step(e.meters[i].late_aux | e.meters[i].aux_status):
        return unjudged_verdict("a profile runs")
    still = abs(early - late) < e.least(i) and due >= SEEN * e.least(i)
    needed = TURNED if still else PATIENCE
    if due < e.least(i) or _with_one_sign(e, i, look) < needed * e.paces[i].seconds:
        return too_early_verdict(f"an error of {abs(late):.4g}: too little time for its plant to show whether it lasts")
    return _failed(e, i, look, "inside its output limits with an error of", cause_of_offset(e, i))


def _with_one_sign(e: Evidence, i: int, look: Look) -> float:
    """For how long an error of one sign has lasted of which no event and no change of the mode is the reason, in s.

    A run that begins at rest had all the time before it.
    """
    m = e.meters[i]
    if e.scenario.initial == "steady" and max(look.stage, m.control_since, m.since) == 0:
        return inf
    return e.seconds(look.end - max(look.stage, m.control_since, m.since))


def _due(e: Evidence, i: int, look: Look, error: float) -> float:
    """By how much an error has to get smaller from one half of the window to the other, to go in time."""
    return error * (1 - exp(-e.seconds(look.half) / (PATIENCE * e.paces[i].seconds)))


def cause_of_offset(e: Evidence, i: int) -> str:
    """Why a loop leaves an error."""
    dead_band = e.plc.dead_band(i, e.signal_values)
    if dead_band > e.bands[i]:
        return f": its dead band is {dead_band:.4g}{e.unit(i)}"
    return "" if e.plc.only_switches(i) or e.plc.integrates(i, e.signal_values) else ": it has no integral"


def _failed(e: Evidence, i: int, look: Look, what: str, cause: str = "") -> Judgement:
    """An error that lasts, unless the window is too short to tell."""
    since = e.seconds(look.start)
    early, late = (abs(error) for error in e.errors(i))
    verb, until = ("ends", "") if look.final else ("is", f" until the event at {look.following:g} s")
    text = f"{verb} {what} {late:.4g}{e.unit(i)}, which was {early:.4g} from {since:g} s on{until}{cause}"
    if (look.end - look.start) * e.step < SAMPLES * e.plc.configs[i].period:
        return too_early_verdict(f"{text}: the run has fewer than {SAMPLES} samples")
    if e.seconds(look.half) < TOO_SHORT * e.paces[i].seconds:
        return too_early_verdict(f"{text}: too little time for its plant to move")
    return failed_verdict(text, since)


def _limit(e: Evidence, i: int) -> str:
    """The limit that a loop's output is at, its own or that of a slave; empty: none."""
    limit = limits_reached(e, i)
    if limit:
        return f"its {limit} output limit"
    for j in e.slaves(i):
        config = e.plc.configs[j]
        if e.meters[j].control and limits_reached(e, j):
            return f"the {limits_reached(e, j)} output limit of {e.plc.loops[j]}"
        if e.meters[j].control and abs(
            e.signal_values[config.sp_slot] - e.signal_values[e.plc.configs[i].out_slot]
        ) > SHARE * e.span(j):
            return f"a set-point limit of {e.plc.loops[j]}"
    return ""


def exempt(e: Evidence, i: int) -> Judgement | None:
    """Why a loop may stay at a limit; None: nothing says so."""
    if is_deselected(e, i):
        return unjudged_verdict("a selector leaves its output out")
    if e.meters[i].broken:
        return unjudged_verdict("an event has broken its sensor")
    if e.plc.windup_input(i, e.signal_values):
        slaves = [j for j in e.slaves(i) if e.meters[j].control]
        if not slaves or any(_limit(e, j) and _error(e, j) > e.bands[j] for j in slaves):
            return unjudged_verdict("its windup input is on")
    others = (name for j, name in _opponents(e, i) if not limits_reached(e, j) and not (_works(e, i) and _works(e, j)))
    other = next(others, "")
    if other and not any(limits_reached(e, j) == "upper" for j in (i, *e.slaves(i))):
        return unjudged_verdict(f"{other} has the PV, with the opposite effect")
    return None


def _opponents(e: Evidence, i: int) -> Iterator[tuple[int, str]]:
    """The loops in control, with their names, that move what is this loop's PV, too, with the opposite effect."""
    for j, name in enumerate(e.plc.loops):
        if j != i and e.meters[j].control and _has_the_pv(e, i, j):
            yield j, name


def _works(e: Evidence, i: int) -> bool:
    """Whether a loop's output is well above its lower limit, where it has the least effect."""
    low, high = e.plc.output_limits(i, e.signal_values)
    return bool(e.signal_values[e.plc.configs[i].out_slot] - low > WORKING * abs(high - low))


def _error(e: Evidence, i: int) -> float:
    config = e.plc.configs[i]
    return float(abs(e.signal_values[config.sp_slot] - e.signal_values[config.pv_slot]))


def _has_the_pv(e: Evidence, i: int, j: int) -> bool:
    """Whether another loop controls what is this loop's PV, too, with the opposite effect."""
    other = answer(e.net, e.plc, j, i)
    if not other or answer(e.net, e.plc, i) * other >= 0 or other * answer(e.net, e.plc, j) <= 0:
        return False
    pvs = [e.signal_values[e.plc.configs[loop].pv_slot] for loop in (i, j)]
    return bool(abs(pvs[0] - pvs[1]) <= SAME_PV * e.span(i))
