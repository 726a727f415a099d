"""Whether a run proves control: the PV settles after what moved it last, and better than without the loop."""

from __future__ import annotations

from math import ceil, log10
from typing import TYPE_CHECKING

from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.judgement.evidence import (
    SAMPLES,
    SMOOTHING,
    Judgement,
    is_deselected,
    open_verdict,
    proven_verdict,
    unjudged_verdict,
)
from pidcfg.sim.judgement.lasting import cause_of_offset, exempt
from pidcfg.sim.judgement.meters import SUSTAINED

if TYPE_CHECKING:
    from pidcfg.schemas.scenario import Expectation
    from pidcfg.sim.judgement.evidence import Evidence

# --- ``not-settled``: after the last excitation the PV comes to its set point, and stays there for as long as its plant
# needs to show it -----------------------------------------------------------------------------------------------------

ARRIVAL = 4
"""Plant times after which a PV has come to its set point, if it ever does."""
RAMP_PATIENCE = 1.5
"""Plant times by which a PV may be behind a set point that moves."""


def judge_settling(e: Evidence, i: int) -> Judgement:
    """Judges one loop, up to the end of the run or of its time in Auto or Cascade."""
    m = e.meters[i]
    if is_deselected(e, i) and any(found.arrived for found in e.found(i)):
        return proven_verdict("was at its set point before a selector left its output out")
    other = _otherwise_judged(e, i)
    if other is not None:
        return other
    end = e.last + 1 if m.control else m.control_since
    excited = last_excitation(e, i, end)
    event = last_event(e, i, end)
    if event and end - event <= 2 * e.plc.configs[i].period // e.step:
        return open_verdict(f"what happens at {e.seconds(event):g} s: nothing after it was seen")
    if m.outside >= end - 1:
        return _not_there(e, i, excited, end)
    entered = max(m.outside + 1, excited)
    stays, needed = e.seconds(end - entered), time_that_shows(e, i, e.seconds(entered - excited))
    if stays >= needed:
        limited = _other_set_point(e, i)
        if limited:
            return open_verdict(limited)
        return proven_verdict(f"stays within {_short(e.bands[i])}{e.unit(i)} of its set point for {_short(stays)} s")
    if m.outside < 0 and is_unexcited(e, i):
        return unjudged_verdict(NO_EXCITATION)
    until = _round_up(e.seconds(entered) + needed)
    cure = f"let it run to {until} s" if m.control else f"{e.seconds(end):g} s is too early to end its control"
    return open_verdict(f"settled for {_short(stays)} s of the {_short(needed)} s that show it: {cure}")


def _otherwise_judged(e: Evidence, i: int) -> Judgement | None:
    """The verdict on a loop that is exempt, or that an expectation proves; None: it has to prove itself."""
    why = _exemption(e, i)
    if why:
        return unjudged_verdict(why)
    said = replaced_by(e, i)
    return proven_verdict(f"an expectation holds that bounds it: {said}") if said else None


def _exemption(e: Evidence, i: int) -> str:
    """What keeps a loop from being at its set point, and is no fault of it; empty: nothing."""
    m, plc = e.meters[i], e.plc
    if plc.only_switches(i):
        return "its output is on or off"
    found = exempt(e, i)
    if found is not None:
        return found.text
    tuning = sum(plc.flag_bits[name] for name in plc.tuning_flags) | plc.modes.get("autotune", 0)
    return "an auto-tune runs" if m.status & tuning else ""


def last_excitation(e: Evidence, i: int, end: int) -> int:
    """When a loop was moved last before base step ``end``: by an event, its start in Auto, or its own set point."""
    m = e.meters[i]
    started = m.control_since if m.control else 0
    return max([started, last_event(e, i, end), *([m.moved] if e.masters[i] < 0 and m.moved < end else [])])


def last_event(e: Evidence, i: int, end: int) -> int:
    """The last event that moves a loop before base step ``end``; what ends its control is no test of it."""
    ended = end if e.meters[i].control else end - SAMPLES * e.plc.configs[i].period // e.step
    return max((k for k, event in e.events() if k < ended and e.influence.concerns(event, i)), default=0)


def time_that_shows(e: Evidence, i: int, arrival: float) -> float:
    """For how long a PV has to stay at its set point after an ``arrival`` of so many s (D911), in s."""
    pace, period = e.paces[i], e.plc.configs[i].period / TICKS
    there_and_back = 2 * pace.dead + arrival if pace.dead or pace.lags else period
    whole = there_and_back if pace.integrates or not pace.lags else min(pace.dead + pace.lags, there_and_back)
    return float(max(whole, SAMPLES * period, e.influence.cycle(i)))


def _other_set_point(e: Evidence, i: int) -> str:
    """That another set point is in force than the last event asked for; empty: the same, or a profile moves it."""
    k, asked = e.asked.get(i, (0, 0.0))
    profile = any(event.loop == e.plc.loops[i] and event.ramp_soak for event in e.scenario.events)
    rooted = bool(e.plc.roots) and e.plc.roots[i] is not None
    if i not in e.asked or e.masters[i] >= 0 or profile or rooted or not e.meters[i].control:
        return ""
    in_force = e.signal_values[e.plc.configs[i].sp_slot]
    if abs(asked - in_force) <= e.bands[i]:
        return ""
    unit = e.unit(i)
    return f"the event at {e.seconds(k):g} s asks for {asked:g}{unit}, and {_short(in_force)}{unit} is in force"


def _not_there(e: Evidence, i: int, excited: int, end: int) -> Judgement:
    """Of a PV that is not at its set point in the end."""
    m = e.meters[i]
    pace = e.paces[i]
    away = abs(e.errors(i)[1]) if m.control else e.bands[i]
    rate = e.set_point_moves(i) / max(e.seconds(m.middle - m.window), e.seconds(1))
    by_itself = e.masters[i] < 0 and m.moved > last_event(e, i, end) + 2 * e.plc.configs[i].period // e.step
    if by_itself and rate and end - m.moved <= m.middle - m.window:
        if away <= max(e.bands[i], RAMP_PATIENCE * rate * pace.seconds):
            return proven_verdict(f"follows a set point that moves, {_short(away)}{e.unit(i)} behind it")
        return open_verdict(f"is {_short(away)}{e.unit(i)} behind a set point that moves when the run ends")
    halves, swing = m.calm_turns - 2, m.last_swing / 2
    if halves >= 2 and swing > e.bands[i] and m.last_swing >= SUSTAINED * m.calm_first_swing:
        text = f"swings by {_short(swing)}{e.unit(i)} to either side, and no less in the end"
        return Judgement("failed", text, e.seconds(m.calm_first_turn))
    what = "set point" if m.control else "set point when it leaves its mode"
    text = f"is {_short(away)}{e.unit(i)} away from its {what}"
    since, enough = e.seconds(end - excited), ARRIVAL * pace.seconds
    cure = f": let it run to {_round_up(e.seconds(excited) + enough)} s" if m.control and since < enough else ""
    return open_verdict(f"{text}, {since:g} s after what moved it last{cause_of_offset(e, i) or cure}")


def _short(value: float) -> str:
    return f"{value:.4g}"


def _round_up(time: float) -> str:
    """A time of two digits that is not shorter."""
    unit = 10.0 ** max(0, ceil(log10(max(time, 1.0))) - 2)
    return f"{ceil(time / unit) * unit:g}"


# --- What a written expectation proves in the place of the two --------------------------------------------------------


def replaced_by(e: Evidence, i: int) -> str:
    """The first expectation that holds, bounds a loop's PV or error, and does so to the end; empty: none."""
    for wanted, verdict in zip(e.scenario.expect, e.verdicts, strict=False):
        if verdict.passed and _bounds_to_the_end(wanted, e.plc.loops[i]):
            return verdict.text
    return ""


def _bounds_to_the_end(wanted: Expectation, loop: str) -> bool:
    if wanted.signal == f"{loop}.PV":
        both = wanted.min is not None and wanted.max is not None
        return (wanted.final is not None and wanted.tolerance is not None) or (both and wanted.until is None)
    if wanted.loop != loop or wanted.max is None:
        return False
    return wanted.metric in {"settling_time", "iae"} or (wanted.metric == "final_error" and wanted.min is not None)


# --- ``no-better``: with its output held at what it was first, the loop would have done as well -----------------------
#
# Design. A second network runs beside the run with the outputs of all judged loops held. Its error is measured against
# the set point of the run itself, while the loop is in Auto or Cascade and its sensor sound.

NO_REFERENCE = "the run had no reference"
MOST_LEFT = 0.7
"""Of the error without control: with more of it the loop does nothing."""
SLOWEST = 1.5
"""Sums of the lags after the dead time, in which a step of the set point has come 63 % of its way; where the dead time
is long, so is a second one and the lags once, as a robust loop waits for its answer."""
LONGEST = 1.5
"""Of that time, for which the whole step would be missing, if all errors after it stood for a whole one."""


def judge_benefit(e: Evidence, i: int) -> Judgement:
    """Judges one loop by what its plant would have done without it."""
    rival = e.rivals.get(i)
    other = _otherwise_judged(e, i)
    if other is not None:
        return other
    if rival is None:
        if e.plc.loops[i] in e.plc.wired:
            return unjudged_verdict("its PV comes from the PLC's program")
        return open_verdict(f"whether it does better than without control: {NO_REFERENCE}")
    if is_unexcited(e, i):
        return unjudged_verdict(NO_EXCITATION)
    share = rival.error / rival.held_error if rival.held_error else 1.0
    if share > MOST_LEFT:
        return open_verdict(f"no better than without control: {100 * share:.0f} % of the error is left")
    late = _late(e, i)
    if late:
        return open_verdict(f"no better than without control: {late}")
    return proven_verdict(f"leaves {100 * share:.0f} % of the error that there would be without it")


NO_EXCITATION = "no excitation: without it the PV would have stayed at its set point as well"


def is_unexcited(e: Evidence, i: int) -> bool:
    """Whether the run has nothing to control."""
    return i in e.rivals and e.rivals[i].widest <= e.bands[i]


def _late(e: Evidence, i: int) -> str:
    """How slowly a loop follows a step of its set point, where that says something; empty: it does not."""
    m, pace = e.meters[i], e.paces[i]
    if m.event < 0 or not m.stepped or pace.integrates or not pace.lags:
        return ""
    if m.moved > m.locked or abs(m.after - m.before) <= e.bands[i]:
        return ""
    answered = max(SLOWEST * pace.lags, pace.dead + pace.lags)
    needed = pace.dead + answered + SMOOTHING * e.plc.configs[i].period / TICKS
    end = min(e.last if m.control else m.control_since, m.until)
    took = e.seconds((m.reached if m.reached >= 0 else end) - m.event)
    creeps = e.seconds(m.step_error) / abs(m.after - m.before)
    if took <= needed and m.reached >= 0 and creeps > LONGEST * needed:
        return (
            f"the error after the step is that of a whole step for {_short(creeps)} s, more than "
            f"{_short(LONGEST * needed)} s (D912); where it may, expect a settling_time"
        )
    if took <= needed:
        return ""
    verb = "comes 63 % of the way" if m.reached >= 0 else "has not come 63 % of the way"
    text = f"the PV {verb} to its new set point after {took:g} s, later than {_short(needed)} s (D912)"
    return f"{text}; where it may, expect a settling_time"
