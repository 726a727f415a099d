"""What a loop's signals must show at the end: ``pv-not-driven``, ``out-of-range``, ``oscillates``, ``alarm-stands``."""

from __future__ import annotations

from pidcfg.sim.feedback import answer, effect
from pidcfg.sim.meters import time_blind, time_cut, time_in_alarm
from pidcfg.sim.standing.evidence import SHARE, Evidence, Judgement, Swings, unjudged
from pidcfg.sim.standing.looks import TENTH
from pidcfg.sim.standing.watch import noise_of
from pidcfg.sim.swings import oscillation

LONG = 0.1
"""The share of a run for which an outermost alarm may stand."""
COUNTS_SEEN = 4
"""Counts of a PV: less of it is not moved."""
RIPPLE = 4
"""Cycles of pulses that the period of their ripple takes at most: some are too short and left out."""
SAME = 0.1
"""By how much two periods may differ that are the same."""
REPEATED = 2
"""Events in the last third that may make a PV swing."""
QUARTER = 4
"""Of what a whole cycle would move the PV: the swing of pulses that are on for half of it, d (1 − d)."""
NOISES = 6
"""Standard deviations of its noise that a PV may lie outside its range."""


def pv_not_driven(e: Evidence, i: int) -> Judgement:
    """Judges one loop."""
    if not e.influence.driven[i]:
        return Judgement(passed=False, text="nothing that its output does reaches its PV, so nothing is controlled")
    reach = max(e.effects[i], effect(e.net, e.plc, i)) * (e.seconds(e.last) if e.paces[i].integrates else 1)
    if 0 < reach < max(COUNTS_SEEN * e.span(i) / e.plc.scales[i][2], SHARE * e.span(i)):
        text = f"its whole output moves its PV by no more than {reach:.3g}, so nothing is controlled"
        return Judgement(passed=False, text=text)
    blind, cut = time_blind(e.meters[i], e.last), time_cut(e.meters[i], e.last)
    if max(blind, cut) <= LONG * e.last:
        moved_by = "its output" if e.influence.drives(i) else "a signal that the scenario sets"
        return Judgement(passed=True, text=f"{moved_by} moves its PV")
    text = f"it is in control for {e.seconds(blind):g} s with a sensor that is broken for good"
    if cut > LONG * e.last:
        text = f"it is in control for {e.seconds(cut):g} s while a plant without gain keeps its output from its PV"
    said = any(
        wanted.loop == e.plc.loops[i] and (wanted.alarm or wanted.flag or wanted.mode) for wanted in e.scenario.expect
    )
    return unjudged(f"{text}: an expectation looks at what follows") if said else Judgement(passed=False, text=text)


def out_of_range(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by what its sensor shows at the end."""
    ends = e.plc.pv_range(i)
    if ends is None:
        return unjudged("its configuration gives no range of the PV")
    if e.meters[i].broken:
        return unjudged("an event has broken its sensor")
    low, high = sorted(ends)
    value = e.sig[e.plc.cfg[i].sig_in]
    for wanted in (e.given.get(i), e.sig[e.plc.cfg[i].sig_sp]):
        if wanted is not None and not low - e.least(i) <= wanted <= high + e.least(i):
            text = f"its set point is {wanted:g}, outside its PV's range of {low:g} to {high:g}"
            return Judgement(passed=False, text=text)
    slack = max(e.least(i), NOISES * noise_of(e.scenario, e.plc, e.net, i))
    if low - slack <= value <= high + slack:
        return Judgement(passed=True, text="its PV ends inside its range")
    text = f"its PV ends at {value:g}, outside its range of {low:g} to {high:g}"
    window = round(max(e.last / TENTH, e.paces[i].seconds / e.seconds(1)))
    times = e.events_on(i, e.last - window)
    return unjudged(f"{text}: an event at {times[0]:g} s") if times else Judgement(passed=False, text=text)


def oscillates(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by the swings of its PV in the last third of the run, and since the last event before it."""
    found, by_itself = _swings(e, i), e.swings.get(i)
    if found is None:
        return Judgement(passed=True, text="its PV does not oscillate in the last third of the run")
    period = e.seconds(found.period)
    text = f"its PV oscillates with a period of {period:.4g} s and an amplitude of {found.amplitude:.4g}"
    why = _excuse(e, i, found)
    times = e.events_on(i, e.meters[i].late)
    if not why and by_itself is None and len(times) >= REPEATED:
        why = f"{len(times)} events move it in the last third"
    return unjudged(f"{text}: {why}") if why else Judgement(passed=False, text=text, at=e.seconds(found.since))


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
    if period <= RIPPLE * plc.pulse_cycle(i) or found.amplitude <= pulse_ripple(e, i):
        return "it is the ripple of its pulses"
    for j, name in enumerate(plc.loops):
        other = _swings(e, j)
        drives = (plc.only_switches(j) or plc.pulse_cycle(j)) and plc.cfg[i].sig_pv in e.influence.of_output(j)
        if j != i and drives and other and abs(e.seconds(other.period) - period) <= SAME * period:
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
    return abs(answer(e.net, e.plc, i)) * cycle / (QUARTER * max(e.paces[i].lags, cycle)) if cycle else 0.0


def alarm_stands(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by its outermost alarms while it controls and its sensor is sound."""
    m, plc = e.meters[i], e.plc
    names = [name for name in plc.outer_alarms if m.alarms & plc.alarm_bits[name]]
    if m.alarm:
        stand = [name for name in names if m.status & plc.alarm_bits[name]]
        since = e.seconds(m.alarm_since)
        return Judgement(passed=False, text=f"{' and '.join(stand)} stands at the end, since {since:g} s", at=since)
    steps = time_in_alarm(m, e.last)
    if steps > LONG * e.last:
        text = f"{' and '.join(names)} stands for {e.seconds(steps):g} s, {100 * steps / e.last:.0f} % of the run"
        return Judgement(passed=False, text=text)
    return Judgement(passed=True, text="no alarm of the outermost kind stands")
