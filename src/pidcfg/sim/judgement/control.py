"""Whether a run proves control: the PV settles after what moved it last, and better than without the loop."""

from __future__ import annotations

from math import ceil, log10
from typing import TYPE_CHECKING

from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.judgement.evidence import (
    MIN_SAMPLES,
    SMOOTHING_SAMPLES,
    Judgement,
    is_deselected,
    open_verdict,
    proven_verdict,
    unjudged_verdict,
)
from pidcfg.sim.judgement.lasting import cause_of_offset, excuse_limit
from pidcfg.sim.judgement.meters import SUSTAINED_SHARE

if TYPE_CHECKING:
    from pidcfg.schemas.scenario import Expectation
    from pidcfg.sim.judgement.evidence import Evidence

# --- ``not-settled``: after the last excitation the PV comes to its set point, and stays there for as long as its plant
# needs to show it -----------------------------------------------------------------------------------------------------

ARRIVAL_TIMES = 4
"""Plant times after which a PV has come to its set point, if it ever does."""
RAMP_PATIENCE_TIMES = 1.5
"""Plant times by which a PV may be behind a set point that moves."""


def judge_settling(e: Evidence, i: int) -> Judgement:
    """Judges one loop, up to the end of the run or of its time in Auto or Cascade."""
    m = e.meters[i]
    if is_deselected(e, i) and any(look.has_arrived for look in e.judged_looks(i)):
        return proven_verdict("was at its set point before a selector left its output out")
    other = _judge_exempt(e, i)
    if other is not None:
        return other
    end = e.last + 1 if m.in_control else m.control_since
    excitation = last_excitation(e, i, end)
    event = last_event(e, i, end)
    if event and end - event <= 2 * e.plc.configs[i].period // e.step:
        return open_verdict(f"what happens at {e.seconds(event):g} s: nothing after it was seen")
    if m.last_outside >= end - 1:
        return _judge_unsettled(e, i, excitation, end)
    entry = max(m.last_outside + 1, excitation)
    stays, needed = e.seconds(end - entry), proof_time(e, i, e.seconds(entry - excitation))
    if stays >= needed:
        limited = _other_set_point(e, i)
        if limited:
            return open_verdict(limited)
        return proven_verdict(
            f"stays within {_number_text(e.bands[i])}{e.unit(i)} of its set point for {_number_text(stays)} s"
        )
    if m.last_outside < 0 and is_unexcited(e, i):
        return unjudged_verdict(NO_EXCITATION_TEXT)
    until = _round_up_time(e.seconds(entry) + needed)
    cure = f"let it run to {until} s" if m.in_control else f"{e.seconds(end):g} s is too early to end its control"
    return open_verdict(f"settled for {_number_text(stays)} s of the {_number_text(needed)} s that show it: {cure}")


def _judge_exempt(e: Evidence, i: int) -> Judgement | None:
    """The verdict on a loop that is exempt, or that an expectation proves; None: it has to prove itself."""
    why = _exemption(e, i)
    if why:
        return unjudged_verdict(why)
    proof = proving_expectation(e, i)
    return proven_verdict(f"an expectation holds that bounds it: {proof}") if proof else None


def _exemption(e: Evidence, i: int) -> str:
    """What keeps a loop from being at its set point, and is no fault of it; empty: nothing."""
    m, plc = e.meters[i], e.plc
    if plc.is_on_off(i):
        return "its output is on or off"
    judgement = excuse_limit(e, i)
    if judgement is not None:
        return judgement.text
    tuning = sum(plc.flag_bits[name] for name in plc.tuning_flags) | plc.modes.get("autotune", 0)
    return "an auto-tune runs" if m.status & tuning else ""


def last_excitation(e: Evidence, i: int, end: int) -> int:
    """When a loop was moved last before base step ``end``: by an event, its start in Auto, or its own set point."""
    m = e.meters[i]
    started = m.control_since if m.in_control else 0
    return max([started, last_event(e, i, end), *([m.sp_moved_at] if e.masters[i] < 0 and m.sp_moved_at < end else [])])


def last_event(e: Evidence, i: int, end: int) -> int:
    """The last event that moves a loop before base step ``end``; what ends its control is no test of it."""
    ended = end if e.meters[i].in_control else end - MIN_SAMPLES * e.plc.configs[i].period // e.step
    return max((k for k, event in e.events() if k < ended and e.influence.can_move(event, i)), default=0)


def proof_time(e: Evidence, i: int, arrival: float) -> float:
    """For how long a PV has to stay at its set point after an ``arrival`` of so many s (D911), in s."""
    pace, period = e.paces[i], e.plc.configs[i].period / TICKS
    there_and_back = 2 * pace.dead_time + arrival if pace.dead_time or pace.lag_time else period
    whole = (
        there_and_back if pace.integrates or not pace.lag_time else min(pace.dead_time + pace.lag_time, there_and_back)
    )
    return float(max(whole, MIN_SAMPLES * period, e.influence.pulse_cycle(i)))


def _other_set_point(e: Evidence, i: int) -> str:
    """That another set point is in force than the last event asked for; empty: the same, or a profile moves it."""
    k, requested = e.requested_set_points.get(i, (0, 0.0))
    profile = any(event.loop == e.plc.loops[i] and event.ramp_soak for event in e.scenario.events)
    rooted = bool(e.plc.root_zeros) and e.plc.root_zeros[i] is not None
    if i not in e.requested_set_points or e.masters[i] >= 0 or profile or rooted or not e.meters[i].in_control:
        return ""
    in_force = e.signal_values[e.plc.configs[i].sp_slot]
    if abs(requested - in_force) <= e.bands[i]:
        return ""
    unit = e.unit(i)
    return (
        f"the event at {e.seconds(k):g} s asks for {requested:g}{unit}, and {_number_text(in_force)}{unit} is in force"
    )


def _judge_unsettled(e: Evidence, i: int, excitation: int, end: int) -> Judgement:
    """Of a PV that is not at its set point in the end."""
    m = e.meters[i]
    pace = e.paces[i]
    deviation = abs(e.mean_errors(i)[1]) if m.in_control else e.bands[i]
    rate = e.set_point_moves(i) / max(e.seconds(m.window_middle - m.window_start), e.seconds(1))
    by_itself = e.masters[i] < 0 and m.sp_moved_at > last_event(e, i, end) + 2 * e.plc.configs[i].period // e.step
    if by_itself and rate and end - m.sp_moved_at <= m.window_middle - m.window_start:
        if deviation <= max(e.bands[i], RAMP_PATIENCE_TIMES * rate * pace.seconds):
            return proven_verdict(f"follows a set point that moves, {_number_text(deviation)}{e.unit(i)} behind it")
        return open_verdict(f"is {_number_text(deviation)}{e.unit(i)} behind a set point that moves when the run ends")
    halves, swing = m.calm_turns - 2, m.last_swing / 2
    if halves >= 2 and swing > e.bands[i] and m.last_swing >= SUSTAINED_SHARE * m.calm_first_swing:
        text = f"swings by {_number_text(swing)}{e.unit(i)} to either side, and no less in the end"
        return Judgement("failed", text, e.seconds(m.calm_first_turn))
    target = "set point" if m.in_control else "set point when it leaves its mode"
    text = f"is {_number_text(deviation)}{e.unit(i)} away from its {target}"
    since, enough = e.seconds(end - excitation), ARRIVAL_TIMES * pace.seconds
    cure = (
        f": let it run to {_round_up_time(e.seconds(excitation) + enough)} s" if m.in_control and since < enough else ""
    )
    return open_verdict(f"{text}, {since:g} s after what moved it last{cause_of_offset(e, i) or cure}")


def _number_text(value: float) -> str:
    return f"{value:.4g}"


def _round_up_time(time: float) -> str:
    """A time of two digits that is not shorter."""
    unit = 10.0 ** max(0, ceil(log10(max(time, 1.0))) - 2)
    return f"{ceil(time / unit) * unit:g}"


# --- What a written expectation proves in the place of the two --------------------------------------------------------


def proving_expectation(e: Evidence, i: int) -> str:
    """The first expectation that holds, bounds a loop's PV or error, and does so to the end; empty: none."""
    for expectation, verdict in zip(e.scenario.expect, e.verdicts, strict=False):
        if verdict.passed and _is_bounded_to_the_end(expectation, e.plc.loops[i]):
            return verdict.text
    return ""


def _is_bounded_to_the_end(expectation: Expectation, loop: str) -> bool:
    if expectation.signal == f"{loop}.PV":
        both = expectation.min is not None and expectation.max is not None
        return (expectation.final is not None and expectation.tolerance is not None) or (
            both and expectation.until is None
        )
    if expectation.loop != loop or expectation.max is None:
        return False
    return expectation.metric in {"settling_time", "iae"} or (
        expectation.metric == "final_error" and expectation.min is not None
    )


# --- ``no-better``: with its output held at what it was first, the loop would have done as well -----------------------
#
# Design. A second network runs beside the run with the outputs of all judged loops held. Its error is measured against
# the set point of the run itself, while the loop is in Auto or Cascade and its sensor sound.

NO_REFERENCE_TEXT = "the run had no reference"
MAX_ERROR_SHARE = 0.7
"""Of the error without control: with more of it the loop does nothing."""
MAX_ANSWER_LAGS = 1.5
"""Sums of the lags after the dead time, in which a step of the set point has come 63 % of its way; where the dead time
is long, so is a second one and the lags once, as a robust loop waits for its answer."""
MAX_ERROR_TIMES = 1.5
"""Of that time, for which the whole step would be missing, if all errors after it stood for a whole one."""


def judge_benefit(e: Evidence, i: int) -> Judgement:
    """Judges one loop by what its plant would have done without it."""
    benefit = e.benefits.get(i)
    other = _judge_exempt(e, i)
    if other is not None:
        return other
    if benefit is None:
        if e.plc.loops[i] in e.plc.wired_loops:
            return unjudged_verdict("its PV comes from the PLC's program")
        return open_verdict(f"whether it does better than without control: {NO_REFERENCE_TEXT}")
    if is_unexcited(e, i):
        return unjudged_verdict(NO_EXCITATION_TEXT)
    error_share = benefit.error / benefit.held_error if benefit.held_error else 1.0
    if error_share > MAX_ERROR_SHARE:
        return open_verdict(f"no better than without control: {100 * error_share:.0f} % of the error is left")
    late = _slow_answer(e, i)
    if late:
        return open_verdict(f"no better than without control: {late}")
    return proven_verdict(f"leaves {100 * error_share:.0f} % of the error that there would be without it")


NO_EXCITATION_TEXT = "no excitation: without it the PV would have stayed at its set point as well"


def is_unexcited(e: Evidence, i: int) -> bool:
    """Whether the run has nothing to control."""
    return i in e.benefits and e.benefits[i].widest_error <= e.bands[i]


def _slow_answer(e: Evidence, i: int) -> str:
    """How slowly a loop follows a step of its set point, where that says something; empty: it does not."""
    m, pace = e.meters[i], e.paces[i]
    if m.event_at < 0 or not m.has_step or pace.integrates or not pace.lag_time:
        return ""
    if m.sp_moved_at > m.locked_until or abs(m.sp_after - m.sp_before) <= e.bands[i]:
        return ""
    answered = max(MAX_ANSWER_LAGS * pace.lag_time, pace.dead_time + pace.lag_time)
    limit = pace.dead_time + answered + SMOOTHING_SAMPLES * e.plc.configs[i].period / TICKS
    end = min(e.last if m.in_control else m.control_since, m.step_until)
    delay = e.seconds((m.reached_at if m.reached_at >= 0 else end) - m.event_at)
    error_time = e.seconds(m.step_error) / abs(m.sp_after - m.sp_before)
    if delay <= limit and m.reached_at >= 0 and error_time > MAX_ERROR_TIMES * limit:
        return (
            f"the error after the step is that of a whole step for {_number_text(error_time)} s, more than "
            f"{_number_text(MAX_ERROR_TIMES * limit)} s (D912); where it may, expect a settling_time"
        )
    if delay <= limit:
        return ""
    verb = "comes 63 % of the way" if m.reached_at >= 0 else "has not come 63 % of the way"
    text = f"the PV {verb} to its new set point after {delay:g} s, later than {_number_text(limit)} s (D912)"
    return f"{text}; where it may, expect a settling_time"
