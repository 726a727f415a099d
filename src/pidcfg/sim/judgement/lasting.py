"""``saturated`` and ``error-stands``: no error lasts that hardly gets smaller."""

from __future__ import annotations

from collections.abc import Iterator
from math import exp, inf

from pidcfg.sim.engine.influence import pv_change
from pidcfg.sim.judgement.evidence import (
    MIN_SAMPLES,
    NEGLIGIBLE_SHARE,
    PATIENCE_TIMES,
    Evidence,
    Judgement,
    Look,
    LookResult,
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

TURN_TIMES, SETTLING_TIMES = 2, 3
"""Plant times after which an output at its limit has turned the PV round, and moved it about as far as it can."""
VISIBLE_ROUNDINGS = 3
"""Times what rounding does: an error that should have lost so much and did not stands still."""
SHORT_WINDOW_SHARE = 0.02
"""Of the plant time: in less between the halves of a window no PV moves enough to be seen."""
WORKING_OUTPUT_SHARE = 0.05
"""Of the way between an output's limits: with more of it a loop does something."""
SAME_PV_SHARE = 0.05
"""Of the span: two loops whose PVs are further apart do not share one."""


def judge_look(e: Evidence, i: int, look: Look) -> LookResult | None:
    """Judges one loop at the end of a look's window, which is now; None: it is not in control."""
    m = e.meters[i]
    if not m.in_control or not e.plc.in_run:
        return None
    late = _judge_late_control(e, i, look)
    if late:
        return LookResult(look, late, late)
    arrived = abs(e.mean_errors(i)[1]) <= e.bands[i]
    limit = _limit_name(e, i)
    if limit:
        return LookResult(look, _judge_limit(e, i, look, limit), proven_verdict("its output is at a limit"), arrived)
    opponent = next((name for j, name in _opponents(e, i) if _is_working(e, i) and _is_working(e, j)), "")
    saturation = proven_verdict("its output is inside its limits")
    if opponent:
        saturation = open_verdict(f"{opponent} works against it: both move one PV, with opposite effects")
    return LookResult(look, saturation, _judge_offset(e, i, look), arrived)


def _judge_late_control(e: Evidence, i: int, look: Look) -> Judgement | None:
    """Why nothing is known of a loop that came into control in the window; None: it did not, or is at its set point."""
    m = e.meters[i]
    whole = m.control_since <= look.start
    if whole or (m.control_since <= look.middle and abs(e.mean_errors(i)[1]) <= e.bands[i]):
        return None
    return too_early_verdict(f"it is in {e.last_mode(i)} from {e.seconds(m.control_since):g} s on only")


def judge_saturation(e: Evidence, i: int) -> Judgement:
    """Judges one loop by the last look that tells, and by the first if nothing had happened to it then."""
    results = e.judged_looks(i)
    opening = [f.saturation for f in results[:1] if f.look.stage_start == 0]
    ending = next((f.saturation for f in reversed(results) if f.saturation.is_conclusive), results[-1].saturation)
    return _worst_judgement([*opening, ending])


def judge_error(e: Evidence, i: int) -> Judgement:
    """Judges one loop by all its looks."""
    return _worst_judgement([f.lasting_error for f in e.judged_looks(i)])


def _worst_judgement(judgements: list[Judgement]) -> Judgement:
    """The last that failed; else the last."""
    return next((j for j in reversed(judgements) if j.verdict == "failed"), judgements[-1])


def _judge_limit(e: Evidence, i: int, look: Look, limit: str) -> Judgement:
    early, late = abs(e.mean_errors(i)[0]), abs(e.mean_errors(i)[1])
    if late <= e.bands[i]:
        return proven_verdict("is at a limit of its output without an error")
    if look.stage_start > look.start:
        return too_early_verdict(
            f"at {limit} with an error of {late:.4g}: an event at {e.seconds(look.stage_start):g} s"
        )
    pace, time = e.paces[i], _time_of_one_sign(e, i, look)
    stands_still = abs(early - late) < e.min_difference(i)
    must_move = (
        pace.integrates
        and e.span(i) * e.seconds(look.half_length) >= VISIBLE_ROUNDINGS * e.min_difference(i) * pace.seconds
    )
    if (stands_still or late > early) and time < (
        pace.seconds if stands_still and not must_move else TURN_TIMES * pace.turn_time
    ):
        return too_early_verdict(f"at {limit} with an error of {late:.4g}: too little time for its plant to turn round")
    has_settled = not pace.integrates and time >= SETTLING_TIMES * pace.seconds
    if stands_still or late > early or (has_settled and early - late < _expected_decay(e, i, look, early)):
        return excuse_limit(e, i) or _judge_lasting_error(e, i, look, f"at {limit} with an error of")
    return proven_verdict("is at a limit of its output with an error that gets smaller")


def _judge_offset(e: Evidence, i: int, look: Look) -> Judgement:
    early, late = e.mean_errors(i)
    if abs(late) <= e.bands[i]:
        return proven_verdict("its PV comes to its set point, and stays there")
    decay = _expected_decay(e, i, look, abs(early))
    moving = e.min_difference(i) if e.paces[i].integrates else max(decay, e.min_difference(i))
    if abs(early - late) >= moving:
        return proven_verdict("its PV is on its way to its set point")
    if look.stage_start > look.start:
        return too_early_verdict(f"an error of {abs(late):.4g}: an event at {e.seconds(look.stage_start):g} s")
    if is_deselected(e, i):
        return unjudged_verdict("a selector leaves its output out")
    if e.meters[i].sensor_broken:
        return unjudged_verdict("an event has broken its sensor")
    if e.set_point_moves(i) >= e.min_difference(i):
        return unjudged_verdict(f"an error of {abs(late):.4g}: its set point moves")
    if e.plc.profile_step(e.meters[i].last_third_aux | e.meters[i].aux_status):
        return unjudged_verdict("a profile runs")
    still = abs(early - late) < e.min_difference(i) and decay >= VISIBLE_ROUNDINGS * e.min_difference(i)
    needed = TURN_TIMES if still else PATIENCE_TIMES
    if decay < e.min_difference(i) or _time_of_one_sign(e, i, look) < needed * e.paces[i].seconds:
        return too_early_verdict(f"an error of {abs(late):.4g}: too little time for its plant to show whether it lasts")
    return _judge_lasting_error(e, i, look, "inside its output limits with an error of", cause_of_offset(e, i))


def _time_of_one_sign(e: Evidence, i: int, look: Look) -> float:
    """For how long an error of one sign has lasted of which no event and no change of the mode is the reason, in s.

    A run that begins at rest had all the time before it.
    """
    m = e.meters[i]
    if e.scenario.initial == "steady" and max(look.stage_start, m.control_since, m.sign_since) == 0:
        return inf
    return e.seconds(look.end - max(look.stage_start, m.control_since, m.sign_since))


def _expected_decay(e: Evidence, i: int, look: Look, error: float) -> float:
    """By how much an error has to get smaller from one half of the window to the other, to go in time."""
    return error * (1 - exp(-e.seconds(look.half_length) / (PATIENCE_TIMES * e.paces[i].seconds)))


def cause_of_offset(e: Evidence, i: int) -> str:
    """Why a loop leaves an error."""
    dead_band = e.plc.dead_band(i, e.signal_values)
    if dead_band > e.bands[i]:
        return f": its dead band is {dead_band:.4g}{e.unit(i)}"
    return "" if e.plc.is_on_off(i) or e.plc.integrates(i, e.signal_values) else ": it has no integral"


def _judge_lasting_error(e: Evidence, i: int, look: Look, state: str, cause: str = "") -> Judgement:
    """An error that lasts, unless the window is too short to tell."""
    since = e.seconds(look.start)
    early, late = (abs(error) for error in e.mean_errors(i))
    verb, until = ("ends", "") if look.is_final else ("is", f" until the event at {look.next_event_time:g} s")
    text = f"{verb} {state} {late:.4g}{e.unit(i)}, which was {early:.4g} from {since:g} s on{until}{cause}"
    if (look.end - look.start) * e.step < MIN_SAMPLES * e.plc.configs[i].period:
        return too_early_verdict(f"{text}: the run has fewer than {MIN_SAMPLES} samples")
    if e.seconds(look.half_length) < SHORT_WINDOW_SHARE * e.paces[i].seconds:
        return too_early_verdict(f"{text}: too little time for its plant to move")
    return failed_verdict(text, since)


def _limit_name(e: Evidence, i: int) -> str:
    """The limit that a loop's output is at, its own or that of a slave; empty: none."""
    limit = limits_reached(e, i)
    if limit:
        return f"its {limit} output limit"
    for j in e.slaves(i):
        config = e.plc.configs[j]
        if e.meters[j].in_control and limits_reached(e, j):
            return f"the {limits_reached(e, j)} output limit of {e.plc.loops[j]}"
        if e.meters[j].in_control and abs(
            e.signal_values[config.sp_slot] - e.signal_values[e.plc.configs[i].out_slot]
        ) > NEGLIGIBLE_SHARE * e.span(j):
            return f"a set-point limit of {e.plc.loops[j]}"
    return ""


def excuse_limit(e: Evidence, i: int) -> Judgement | None:
    """Why a loop may stay at a limit; None: nothing says so."""
    if is_deselected(e, i):
        return unjudged_verdict("a selector leaves its output out")
    if e.meters[i].sensor_broken:
        return unjudged_verdict("an event has broken its sensor")
    if e.plc.windup_input(i, e.signal_values):
        slaves = [j for j in e.slaves(i) if e.meters[j].in_control]
        if not slaves or any(_limit_name(e, j) and _absolute_error(e, j) > e.bands[j] for j in slaves):
            return unjudged_verdict("its windup input is on")
    others = (
        name
        for j, name in _opponents(e, i)
        if not limits_reached(e, j) and not (_is_working(e, i) and _is_working(e, j))
    )
    other = next(others, "")
    if other and not any(limits_reached(e, j) == "upper" for j in (i, *e.slaves(i))):
        return unjudged_verdict(f"{other} has the PV, with the opposite effect")
    return None


def _opponents(e: Evidence, i: int) -> Iterator[tuple[int, str]]:
    """The loops in control, with their names, that move what is this loop's PV, too, with the opposite effect."""
    for j, name in enumerate(e.plc.loops):
        if j != i and e.meters[j].in_control and _is_opponent(e, i, j):
            yield j, name


def _is_working(e: Evidence, i: int) -> bool:
    """Whether a loop's output is well above its lower limit, where it has the least effect."""
    low, high = e.plc.output_limits(i, e.signal_values)
    return bool(e.signal_values[e.plc.configs[i].out_slot] - low > WORKING_OUTPUT_SHARE * abs(high - low))


def _absolute_error(e: Evidence, i: int) -> float:
    config = e.plc.configs[i]
    return float(abs(e.signal_values[config.sp_slot] - e.signal_values[config.pv_slot]))


def _is_opponent(e: Evidence, i: int, j: int) -> bool:
    """Whether another loop controls what is this loop's PV, too, with the opposite effect."""
    other = pv_change(e.net, e.plc, j, i)
    if not other or pv_change(e.net, e.plc, i) * other >= 0 or other * pv_change(e.net, e.plc, j) <= 0:
        return False
    pvs = [e.signal_values[e.plc.configs[loop].pv_slot] for loop in (i, j)]
    return bool(abs(pvs[0] - pvs[1]) <= SAME_PV_SHARE * e.span(i))
