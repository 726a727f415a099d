"""The standing expectations: what is expected of every run, whether a scenario writes it or not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from math import exp
from typing import TYPE_CHECKING

from pidcfg.schemas.scenario import Never
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.engine.events import describe_event
from pidcfg.sim.engine.expressions import Problem
from pidcfg.sim.engine.influence import answer, effect
from pidcfg.sim.judgement.evidence import (
    PATIENCE,
    SAMPLES,
    SHARE,
    TENTH,
    Evidence,
    Found,
    Judgement,
    Look,
    Swings,
    aim,
    event_steps,
    is_deselected,
    limits_reached,
    looks_at,
    noise_of,
    plant_time,
    too_early_verdict,
    unjudged_verdict,
)
from pidcfg.sim.judgement.meters import begin_calm, calm_oscillation, oscillation, time_blind, time_cut, time_in_alarm
from pidcfg.sim.judgement.report import Standing, ten_digits
from pidcfg.text.paths import dotted, leaves

if TYPE_CHECKING:
    from pidcfg.schemas.scenario import Event

# --- ``saturated`` and ``error-stands``: no error lasts that hardly gets smaller --------------------------------------
#
# Design. Each look (`pidcfg.sim.judgement.evidence`) compares the mean error of the two halves of its window, at the
# moment at which the window ends: limits, selectors and the other loops are as they are then. What a loop does in the
# end is judged at the last look at which it was in control, and what it does before anything happens to it at the
# first; an error that stands inside the output's limits is no event's doing and is judged at every look.

DEVIATION = 0.01
"""Of the span: an error that is too much, unless the inner deviation alarm is closer."""
SWITCHED = 0.05
"""The same where the output is on or off, and the widest dead band that is left alone."""
OFFSET, LEVEL_OFFSET = 0.05, 0.2
"""The same where an offset belongs to the loop, since it has no integral; and one of a plant that integrates."""
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
    limit = _limit(e, i)
    if limit:
        return Found(look, _saturated(e, i, look, limit), Judgement(passed=True, text="its output is at a limit"))
    against = next((name for j, name in _opponents(e, i) if _works(e, i) and _works(e, j)), "")
    inside = Judgement(passed=True, text="its output is inside its limits")
    if against:
        inside = unjudged_verdict(f"{against} works against it: both move one PV, with opposite effects")
    return Found(look, inside, _stands(e, i, look))


def _too_late(e: Evidence, i: int, look: Look) -> Judgement | None:
    """Why nothing is known of a loop that came into control in the window; None: it did not, or is at its set point."""
    m = e.meters[i]
    whole = m.control_since <= look.start
    if whole or (m.control_since <= look.middle and abs(e.errors(i)[1]) <= allowed_error(e, i)):
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
    return next((j for j in reversed(judgements) if j.judged and not j.passed), judgements[-1])


def _saturated(e: Evidence, i: int, look: Look, limit: str) -> Judgement:
    early, late = abs(e.errors(i)[0]), abs(e.errors(i)[1])
    if late <= allowed_error(e, i):
        return Judgement(passed=True, text="is at a limit of its output without an error")
    if look.stage > look.start:
        return too_early_verdict(f"at {limit} with an error of {late:.4g}: an event at {e.seconds(look.stage):g} s")
    pace, time = e.paces[i], _with_one_sign(e, i, look)
    still = abs(early - late) < e.least(i)
    moves = pace.integrates and e.span(i) * e.seconds(look.half) >= SEEN * e.least(i) * pace.seconds
    if (still or late > early) and time < (pace.seconds if still and not moves else TURNED * pace.turn):
        return too_early_verdict(f"at {limit} with an error of {late:.4g}: too little time for its plant to turn round")
    settled = not pace.integrates and time >= SETTLED * pace.seconds
    if still or late > early or (settled and early - late < _due(e, i, look, early)):
        return _exempt(e, i) or _failed(e, i, look, f"at {limit} with an error of")
    return Judgement(passed=True, text="is at a limit of its output with an error that gets smaller")


def _stands(e: Evidence, i: int, look: Look) -> Judgement:
    early, late = e.errors(i)
    if abs(late) <= allowed_error(e, i):
        return Judgement(passed=True, text="its PV comes to its set point, and stays there")
    due = _due(e, i, look, abs(early))
    moving = e.least(i) if e.paces[i].integrates else max(due, e.least(i))
    if abs(early - late) >= moving:
        return Judgement(passed=True, text="its PV is on its way to its set point")
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
        return unjudged_verdict(f"an error of {abs(late):.4g}: too little time for its plant to show whether it lasts")
    return _failed(e, i, look, "inside its output limits with an error of")


def _with_one_sign(e: Evidence, i: int, look: Look) -> float:
    """For how long an error of one sign has lasted of which no event and no change of the mode is the reason, in s."""
    m = e.meters[i]
    return e.seconds(look.end - max(look.stage, m.control_since, m.since))


def _due(e: Evidence, i: int, look: Look, error: float) -> float:
    """By how much an error has to get smaller from one half of the window to the other, to go in time."""
    return error * (1 - exp(-e.seconds(look.half) / (PATIENCE * e.paces[i].seconds)))


def allowed_error(e: Evidence, i: int) -> float:
    """The error with which a loop may end."""
    inner, span = e.plc.inner_deviation(i), e.span(i)
    offset = LEVEL_OFFSET if e.paces[i].integrates else OFFSET
    share = SWITCHED if e.plc.only_switches(i) else DEVIATION if e.plc.integrates(i, e.signal_values) else offset
    allowed = share * span if inner is None else min(share * span, inner)
    return max(allowed, min(e.plc.dead_band(i, e.signal_values), SWITCHED * span))


def _failed(e: Evidence, i: int, look: Look, what: str) -> Judgement:
    """An error that lasts, unless the window is too short to tell."""
    since = e.seconds(look.start)
    early, late = (abs(error) for error in e.errors(i))
    verb, until = ("ends", "") if look.final else ("is", f" until the event at {look.following:g} s")
    text = f"{verb} {what} {late:.4g}, which was {early:.4g} from {since:g} s on{until}"
    if (look.end - look.start) * e.step < SAMPLES * e.plc.configs[i].period:
        return too_early_verdict(f"{text}: the run has fewer than {SAMPLES} samples")
    if e.seconds(look.half) < TOO_SHORT * e.paces[i].seconds:
        return too_early_verdict(f"{text}: too little time for its plant to move")
    return Judgement(passed=False, text=text, at=since)


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


def _exempt(e: Evidence, i: int) -> Judgement | None:
    """Why a loop may stay at a limit; None: nothing says so."""
    if is_deselected(e, i):
        return unjudged_verdict("a selector leaves its output out")
    if e.meters[i].broken:
        return unjudged_verdict("an event has broken its sensor")
    if e.plc.windup_input(i, e.signal_values):
        slaves = [j for j in e.slaves(i) if e.meters[j].control]
        if not slaves or any(_limit(e, j) and _error(e, j) > allowed_error(e, j) for j in slaves):
            return unjudged_verdict("its windup input is on")
    other = next((name for j, name in _opponents(e, i) if not limits_reached(e, j)), "")
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
    own, other = answer(e.net, e.plc, i), answer(e.net, e.plc, j, i)
    if own * other >= 0 or other * answer(e.net, e.plc, j) <= 0:
        return False
    pvs = [e.signal_values[e.plc.configs[loop].pv_slot] for loop in (i, j)]
    return bool(abs(pvs[0] - pvs[1]) <= SAME_PV * e.span(i))


# ----------------------------------------------------------------------------------------------------------------------
# What a loop's signals must show at the end: ``pv-not-driven``, ``out-of-range``, ``oscillates``, ``alarm-stands``.

LONG_SHARE = 0.1
"""The share of a run for which an outermost alarm may stand."""
COUNTS_SEEN = 4
"""Counts of a PV: less of it is not moved."""
RIPPLE_CYCLES = 4
"""Cycles of pulses that the period of their ripple takes at most: some are too short and left out."""
SAME_PERIOD = 0.1
"""By how much two periods may differ that are the same."""
REPEATED_EVENTS = 2
"""Events in the last third that may make a PV swing."""
PULSE_SWING_DIVISOR = 4
"""Of what a whole cycle would move the PV: the swing of pulses that are on for half of it, d (1 − d)."""
NOISE_DEVIATIONS = 6
"""Standard deviations of its noise that a PV may lie outside its range."""


def judge_drive(e: Evidence, i: int) -> Judgement:
    """Judges one loop."""
    if not e.influence.driven[i]:
        return Judgement(passed=False, text="nothing that its output does reaches its PV, so nothing is controlled")
    reach = max(e.effects[i], effect(e.net, e.plc, i)) * (e.seconds(e.last) if e.paces[i].integrates else 1)
    if 0 < reach < max(COUNTS_SEEN * e.span(i) / e.plc.scales[i][2], SHARE * e.span(i)):
        text = f"its whole output moves its PV by no more than {reach:.3g}, so nothing is controlled"
        return Judgement(passed=False, text=text)
    blind, cut = time_blind(e.meters[i], e.last), time_cut(e.meters[i], e.last)
    if max(blind, cut) <= LONG_SHARE * e.last:
        moved_by = "its output" if e.influence.drives(i) else "a signal that the scenario sets"
        return Judgement(passed=True, text=f"{moved_by} moves its PV")
    text = f"it is in control for {e.seconds(blind):g} s with a sensor that is broken for good"
    if cut > LONG_SHARE * e.last:
        text = f"it is in control for {e.seconds(cut):g} s while a plant without gain keeps its output from its PV"
    said = any(
        wanted.loop == e.plc.loops[i] and (wanted.alarm or wanted.flag or wanted.mode) for wanted in e.scenario.expect
    )
    return (
        unjudged_verdict(f"{text}: an expectation looks at what follows")
        if said
        else Judgement(passed=False, text=text)
    )


def judge_range(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by what its sensor shows at the end."""
    ends = e.plc.pv_range(i)
    if ends is None:
        return unjudged_verdict("its configuration gives no range of the PV")
    if e.meters[i].broken:
        return unjudged_verdict("an event has broken its sensor")
    low, high = sorted(ends)
    value = e.signal_values[e.plc.configs[i].in_slot]
    for wanted in (e.given.get(i), e.signal_values[e.plc.configs[i].sp_slot]):
        if wanted is not None and not low - e.least(i) <= wanted <= high + e.least(i):
            text = f"its set point is {wanted:g}, outside its PV's range of {low:g} to {high:g}"
            return Judgement(passed=False, text=text)
    slack = max(e.least(i), NOISE_DEVIATIONS * noise_of(e.scenario, e.plc, e.net, i))
    if low - slack <= value <= high + slack:
        return Judgement(passed=True, text="its PV ends inside its range")
    text = f"its PV ends at {value:g}, outside its range of {low:g} to {high:g}"
    window = round(max(e.last / TENTH, e.paces[i].seconds / e.seconds(1)))
    times = e.events_on(i, e.last - window)
    return unjudged_verdict(f"{text}: an event at {times[0]:g} s") if times else Judgement(passed=False, text=text)


def judge_oscillation(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by the swings of its PV in the last third of the run, and since the last event before it."""
    found, by_itself = _swings(e, i), e.swings.get(i)
    if found is None:
        return Judgement(passed=True, text="its PV does not oscillate in the last third of the run")
    period = e.seconds(found.period)
    text = f"its PV oscillates with a period of {period:.4g} s and an amplitude of {found.amplitude:.4g}"
    why = _excuse(e, i, found)
    times = e.events_on(i, e.meters[i].late)
    if not why and by_itself is None and len(times) >= REPEATED_EVENTS:
        why = f"{len(times)} events move it in the last third"
    return unjudged_verdict(f"{text}: {why}") if why else Judgement(passed=False, text=text, at=e.seconds(found.since))


def _swings(e: Evidence, i: int) -> Swings | None:
    """An oscillation of a loop's PV: one between two events, or one of the whole last third."""
    m = e.meters[i]
    whole = oscillation(m, e.last)
    return e.swings.get(i) or (None if whole is None else Swings(*whole, m.first_turn))


def _excuse(e: Evidence, i: int, found: Swings) -> str:
    """Why an oscillation need not be the loop's fault."""
    m, plc, period = e.meters[i], e.plc, e.seconds(found.period)
    if plc.only_switches(i):
        return "its output is on or off"
    if period <= RIPPLE_CYCLES * plc.pulse_cycle(i) or found.amplitude <= pulse_ripple(e, i):
        return "it is the ripple of its pulses"
    for j, name in enumerate(plc.loops):
        other = _swings(e, j)
        drives = (plc.only_switches(j) or plc.pulse_cycle(j)) and plc.configs[i].pv_slot in e.influence.of_output(j)
        if j != i and drives and other and abs(e.seconds(other.period) - period) <= SAME_PERIOD * period:
            return f"{name} drives it, whose output is on or off"
    tuning = sum(plc.flag_bits[name] for name in plc.tuning_flags) | plc.modes.get("autotune", 0)
    status, aux_status, when = m.late_status, m.late_aux, "in the last third"
    if found.since < m.late:
        status, aux_status, when = m.ever, m.ever_aux, "in the run"
    if status & tuning:
        return f"an auto-tune runs {when}"
    return f"a profile runs {when}" if plc.profile_step(aux_status) else ""


def pulse_ripple(e: Evidence, i: int) -> float:
    """How far the PV goes up and down with pulses that are on for half of their cycle; 0: there are none."""
    cycle = e.plc.pulse_cycle(i)
    return abs(answer(e.net, e.plc, i)) * cycle / (PULSE_SWING_DIVISOR * max(e.paces[i].lags, cycle)) if cycle else 0.0


def judge_alarms(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by its outermost alarms while it controls and its sensor is sound."""
    m, plc = e.meters[i], e.plc
    names = [name for name in plc.outer_alarms if m.alarms & plc.alarm_bits[name]]
    if m.alarm:
        stand = [name for name in names if m.status & plc.alarm_bits[name]]
        since = e.seconds(m.alarm_since)
        return Judgement(passed=False, text=f"{' and '.join(stand)} stands at the end, since {since:g} s", at=since)
    steps = time_in_alarm(m, e.last)
    if steps > LONG_SHARE * e.last:
        text = f"{' and '.join(names)} stands for {e.seconds(steps):g} s, {100 * steps / e.last:.0f} % of the run"
        return Judgement(passed=False, text=text)
    return Judgement(passed=True, text="no alarm of the outermost kind stands")


# ----------------------------------------------------------------------------------------------------------------------
# ``set-up-error``: the PLC finds no fault with the set-up; and what follows from a fault that a scenario expects.


def judge_set_up(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by its flags and its error words."""
    m, plc = e.meters[i], e.plc
    words = [
        f"{name} = {plc.word_of_flags.format(plc.flags[name])}"
        for name, j in plc.word_owners.items()
        if j == i and plc.flags[name]
    ]
    flags = [name for name in plc.error_flags if m.ever & plc.flag_bits.get(name, 0)]
    errors = [*flags, *words, *plc.set_up_errors(i)]
    return Judgement(passed=not errors, text=", ".join(errors) or "no error of the set-up")


def judge_plc(e: Evidence) -> Judgement:
    """Judges the PLC: the error words that concern all loops, and blocks that are no loops."""
    plc = e.plc
    words = [
        f"{name} = {plc.word_of_flags.format(word)}"
        for name, word in plc.flags.items()
        if word and name not in plc.word_owners
    ]
    errors = [*words, *plc.program_errors(e.signal_values)]
    return Judgement(passed=not errors, text=", ".join(errors) or "no error of the set-up")


def expected_errors(e: Evidence) -> Iterator[tuple[int, str]]:
    """The loops whose verdicts follow from a fault that a written expectation names (−1: all), and which it is.

    A fault that does not come excuses nothing; the expectation fails.
    """
    plc = e.plc
    for wanted in e.scenario.expect:
        owner = -1 if wanted.loop is None else plc.loops.index(wanted.loop)
        text = ""
        if isinstance(wanted.mode, Never) and e.is_control(wanted.mode.mode):
            if not e.meters[owner].ever & plc.control_bits:
                text = f"{wanted.loop} is expected never to be in {wanted.mode.mode}"
        elif wanted.flag is not None and wanted.value is not False and wanted.value != 0:
            if wanted.loop is None:
                owner = plc.word_owners.get(wanted.flag, -1)
            if _came(e, wanted.flag, owner, of_loop=wanted.loop is not None):
                text = f"{wanted.flag} {f'of {plc.loops[owner]} ' if owner >= 0 else ''}is expected"
        if text:
            yield from ((j, text) for j in (e.family(owner) if owner >= 0 else (-1,)))


def _came(e: Evidence, flag: str, owner: int, *, of_loop: bool) -> bool:
    """Whether an error has come: a word of the PLC, or a flag of a loop that means an error of its set-up."""
    if not of_loop:
        return bool(e.plc.flags[flag])
    return flag in e.plc.error_flags and bool(e.meters[owner].ever & e.plc.flag_bits.get(flag, 0))


# --- ``not-in-mode``: a loop that is meant for Auto or Cascade reaches it, and ends in it -----------------------------

SLACK_SAMPLES = 10
"""Samples within which a loop answers to what takes its mode away."""


def judge_mode(e: Evidence, i: int) -> Judgement:
    """Judges one loop; what it is meant for is known to its meter, since events change it."""
    m, name = e.meters[i], e.plc.loops[i]
    if m.missed >= 0:
        until = e.seconds(m.missed)
        return Judgement(passed=False, text=f"does not come into its mode until {until:g} s{_why(e, i)}", at=0.0)
    if not m.wanted:
        return Judgement(passed=True, text="reaches each mode that it is meant for")
    wanted, mode = e.plc.mode(m.wanted), e.mode(i)
    if any(x.loop == name and isinstance(x.mode, Never) and x.mode.mode == wanted for x in e.scenario.expect):
        return unjudged_verdict(f"{name} is expected never to be in {wanted}")
    if not m.seen & m.wanted:
        return Judgement(passed=False, text=f"is meant for {wanted} and stays in {mode}{_why(e, i)}", at=0.0)
    if m.status & m.wanted:
        return Judgement(passed=True, text=f"reaches {wanted} and ends in it")
    at = e.seconds(m.left)
    said = _said_by(e, i) or next(
        (f"an expectation names {mode}" for x in e.scenario.expect if x.loop == name and x.mode == mode), ""
    )
    if said:
        return unjudged_verdict(f"in {mode} from {at:g} s: {said}")
    return Judgement(passed=False, text=f"is meant for {wanted} and ends in {mode}, from {at:g} s{_why(e, i)}", at=at)


def _why(e: Evidence, i: int) -> str:
    reason = e.reasons.get(i)
    return f": {reason}" if reason else ""


def _said_by(e: Evidence, i: int) -> str:
    """The event after which a loop left its mode: on itself, its cascade, its mode inputs or the CPU."""
    m = e.meters[i]
    slack = -(-SLACK_SAMPLES * max(e.plc.configs[j].period for j in e.family(i)) // e.step)
    for k, event in reversed(list(e.events())):
        if m.left - slack <= k <= m.left and _acts_on_mode(e, event, i):
            where = f" on {event.loop}" if event.loop else ""
            return f"the event at {e.seconds(k):g} s{where}, {describe_event(event)}"
    return ""


def _acts_on_mode(e: Evidence, event: Event, i: int) -> bool:
    """Whether an event may take a loop's mode away."""
    if event.plc is not None:
        return True
    family = e.family(i)
    if event.loop is None:
        return any(slot in e.plc.mode_inputs(j) for slot in e.influence.signals_set(event) for j in family)
    of_mode = (
        event.mode is not None or event.autotune is not None or any(key in e.plc.mode_keys for key in keys_set(event))
    )
    return of_mode and event.loop in e.plc.loops and e.plc.loops.index(event.loop) in family


def keys_set(event: Event) -> Iterator[str]:
    """The keys that an event sets."""
    return (dotted(keys) for keys, _, _ in leaves(event.set or {}))


# --- All standing expectations of a run: which loops are judged by which, and what the scenario allows ----------------

Judge = Callable[[Evidence, int], Judgement]

KINDS: dict[str, tuple[Judge, str]] = {
    "not-in-mode": (judge_mode, "meant"),
    "set-up-error": (judge_set_up, ""),
    "pv-not-driven": (judge_drive, "controlled"),
    "saturated": (judge_saturation, "in control"),
    "error-stands": (judge_error, "in control"),
    "out-of-range": (judge_range, "controlled"),
    "oscillates": (judge_oscillation, "controlled"),
    "alarm-stands": (judge_alarms, "controlled"),
}
"""What judges a loop by each kind, and which loops."""


def standing(e: Evidence) -> list[Standing]:
    """The verdicts: of the PLC first, then of its loops, by kind."""
    expected = list(expected_errors(e))
    everywhere = next((why for i, why in expected if i < 0), "")
    found = unjudged_verdict(everywhere) if everywhere else judge_plc(e)
    verdicts = [_verdict("set-up-error", "", found)]
    for i, name in enumerate(e.plc.loops):
        why = _left_to_others(e, i) or everywhere or next((text for j, text in expected if j == i), "")
        for kind, (judge, who) in KINDS.items():
            said = why or _kept(e, i, who)
            verdicts.append(_verdict(kind, name, unjudged_verdict(said) if said else judge(e, i)))
    return [_with_allowance(e, verdict) for verdict in verdicts]


def _left_to_others(e: Evidence, i: int) -> str:
    chosen = e.scenario.loops
    return "" if chosen is None or e.plc.loops[i] in chosen else "the scenario's loops leave it out"


def _kept(e: Evidence, i: int, who: str) -> str:
    """What keeps a loop from being judged, by the loops that a kind is for."""
    m = e.meters[i]
    controlled = bool(m.ever & m.control_bits)
    words = [name for name, word in e.plc.flags.items() if word and name not in e.plc.word_owners]
    if who == "meant" and not controlled and words:
        return f"{' and '.join(words)} keeps the loop task off"
    if who == "meant" and not controlled and not m.wanted and m.missed < 0:
        return "is meant for manual"
    if who in {"controlled", "in control"} and not controlled:
        return f"in {e.mode(i)} from start to end"
    if who == "in control" and not e.found(i):
        return "the PLC has been stopped" if not e.plc.in_run else f"ends in {e.mode(i)}"
    return ""


def _verdict(kind: str, loop: str, found: Judgement) -> Standing:
    at = None if found.at is None else ten_digits(found.at)
    return Standing(kind, loop, found.passed, found.judged, found.text, at)


def _with_allowance(e: Evidence, verdict: Standing) -> Standing:
    reasons = (a.reason for a in e.scenario.allow if (a.kind, a.loop) == (verdict.kind, verdict.loop))
    return verdict if verdict.passed else replace(verdict, allowed=next(reasons, None))


def unused_allowances(e: Evidence, verdicts: list[Standing]) -> Iterator[Problem]:
    """Warnings of entries of ``allow`` that allow nothing."""
    used = {(v.kind, v.loop) for v in verdicts if v.allowed is not None}
    for i, entry in enumerate(e.scenario.allow):
        if (entry.kind, entry.loop) not in used:
            message = f"{entry.loop} does not fail by {entry.kind}: there is nothing to allow"
            yield Problem(("allow", i), message, "idle_allowance", "warning", "remove the entry", loop=entry.loop)


# --- Looks at the loops of a run while it runs: aims the meters, and judges when a window ends ------------------------


@dataclass
class LoopWatch:
    """The looks of a run; ``evidence`` gathers what they show."""

    evidence: Evidence
    waiting: dict[int, list[Look]] = field(default_factory=dict)
    """The looks at each loop that are still to come."""
    stirred: dict[int, list[int]] = field(default_factory=dict)
    """When events move each loop in the last third of the run."""

    def __post_init__(self) -> None:
        e = self.evidence
        e.looks = {i: [] for i in range(len(e.plc.loops))}
        e.given = {i: e.plc.given_set_point(i, e.signal_values) for i in e.looks if e.masters[i] < 0}
        e.paces = [plant_time(e.plc, e.influence, i) for i in e.looks]
        e.effects = [effect(e.net, e.plc, i) for i in e.looks]
        for i in e.looks:
            self.waiting[i] = looks_at(e.scenario, e.plc, e.influence, i, e.step, e.last)
            self._aim(i)
            moved = {k for k, event in event_steps(e.scenario, e.step, e.last) if e.influence.concerns(event, i)}
            e.meters[i].swung = max((k for k in moved if k <= e.meters[i].late), default=0)
            self.stirred[i] = sorted(k for k in moved if k > e.meters[i].late)

    def _aim(self, i: int) -> None:
        e = self.evidence
        aim(e.meters[i], self.waiting[i][0], e.paces[i].seconds * TICKS / e.step)

    def stops(self) -> Iterator[tuple[int, Callable[[int], None]]]:
        """Base steps before which a window has ended that is not the end of the run, and what is done there."""
        for i, looks in self.waiting.items():
            yield from ((look.end + 1, partial(self._look, i)) for look in looks[:-1])
            yield from ((k, partial(self._stir, i)) for k in self.stirred[i])

    def _stir(self, i: int, k: int) -> None:
        m = self.evidence.meters[i]
        found = calm_oscillation(m, k)
        if found is not None:
            self.evidence.swings.setdefault(i, Swings(*found, m.calm_first_turn))
        begin_calm(m)

    def _look(self, i: int, _k: int) -> None:
        look = self.waiting[i].pop(0)
        self._judge(i, look)
        self._aim(i)

    def _judge(self, i: int, look: Look) -> None:
        found = look_at(replace(self.evidence, last=look.end), i, look)
        if found is not None:
            self.evidence.looks[i].append(found)

    def finish(self) -> None:
        """Looks at how the run ends."""
        for i, looks in self.waiting.items():
            self._judge(i, looks[0])
            self._stir(i, self.evidence.last)
