"""The standing expectations: what is expected of every run, whether a scenario writes it or not."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

from pidcfg.schemas.scenario import Event, ForbiddenMode
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.engine.events import describe_event
from pidcfg.sim.engine.expressions import Problem
from pidcfg.sim.engine.influence import output_effect
from pidcfg.sim.judgement.control import judge_benefit, judge_settling
from pidcfg.sim.judgement.evidence import (
    END_DIVISOR,
    NEGLIGIBLE_SHARE,
    NOISE_MARGIN,
    Evidence,
    Judgement,
    Look,
    Swings,
    aim_meter,
    band_of,
    event_steps,
    failed_verdict,
    limits_reached,
    make_looks,
    noise_of,
    open_verdict,
    plant_time,
    proven_verdict,
    pulse_ripple,
    unjudged_verdict,
)
from pidcfg.sim.judgement.lasting import judge_error, judge_look, judge_saturation
from pidcfg.sim.judgement.meters import begin_calm, calm_oscillation, oscillation, time_blind, time_cut, time_in_alarm
from pidcfg.sim.judgement.report import ASSUMED_KIND, SIGN_TEXT, Standing, VerdictWord, ten_digits
from pidcfg.text.paths import dotted_text, leaves

# ----------------------------------------------------------------------------------------------------------------------
# What a loop's signals must show at the end: ``pv-not-driven``, ``out-of-range``, ``oscillates``, ``alarm-stands``.

TOLERATED_SHARE = 0.1
"""The share of a run for which an outermost alarm may stand."""
MIN_MOVED_COUNTS = 4
"""Counts of a PV: less of it is not moved."""
MAX_RIPPLE_CYCLES = 4
"""Cycles of pulses that the period of their ripple takes at most: some are too short and left out."""
PERIOD_TOLERANCE = 0.1
"""By how much two periods may differ that are the same."""
MIN_REPEATED_EVENTS = 2
"""Events in the last third that may make a PV swing."""
NOISE_SIGMAS = 6
"""Standard deviations of its noise that a PV may lie outside its range."""


def judge_drive(e: Evidence, i: int) -> Judgement:
    """Judges one loop."""
    if not e.influence.is_driven[i]:
        return failed_verdict("nothing that its output does reaches its PV, so nothing is controlled")
    reach = max(e.effects[i], output_effect(e.net, e.plc, i)) * (e.seconds(e.last) if e.paces[i].integrates else 1)
    if 0 < reach < max(MIN_MOVED_COUNTS * e.span(i) / e.plc.scales[i][2], NEGLIGIBLE_SHARE * e.span(i)):
        text = f"its whole output moves its PV by no more than {reach:.3g}, so nothing is controlled"
        return failed_verdict(text)
    blind, cut = time_blind(e.meters[i], e.last), time_cut(e.meters[i], e.last)
    if max(blind, cut) <= TOLERATED_SHARE * e.last:
        moved_by = "its output" if e.influence.can_drive(i) else "a signal that the scenario sets"
        return proven_verdict(f"{moved_by} moves its PV")
    text = f"it is in control for {e.seconds(blind):g} s with a sensor that is broken for good"
    if cut > TOLERATED_SHARE * e.last:
        text = f"it is in control for {e.seconds(cut):g} s while a plant without gain keeps its output from its PV"
    is_expected = any(
        expectation.loop == e.plc.loops[i] and (expectation.alarm or expectation.flag or expectation.mode)
        for expectation in e.scenario.expect
    )
    return unjudged_verdict(f"{text}: an expectation looks at what follows") if is_expected else failed_verdict(text)


def judge_range(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by what its sensor shows at the end."""
    ends = e.plc.pv_range(i)
    if ends is None:
        return unjudged_verdict("its configuration gives no range of the PV")
    if e.meters[i].sensor_broken:
        return unjudged_verdict("an event has broken its sensor")
    low, high = sorted(ends)
    value = e.signal_values[e.plc.configs[i].in_slot]
    controlled = bool(e.meters[i].all_status & e.meters[i].control_bits)
    for setpoint in (e.given_set_points.get(i), e.signal_values[e.plc.configs[i].sp_slot]) if controlled else ():
        if setpoint is not None and not low - e.min_difference(i) <= setpoint <= high + e.min_difference(i):
            text = f"its set point is {setpoint:g}, outside its PV's range of {low:g} to {high:g}"
            return failed_verdict(text)
    slack = max(e.min_difference(i), NOISE_SIGMAS * noise_of(e.scenario, e.plc, e.net, i))
    stopped = _stop_text(e, i)
    if stopped:
        return failed_verdict(stopped)
    if low - slack <= value <= high + slack:
        return proven_verdict("its PV ends inside its range")
    text = f"its PV ends at {value:g}, outside its range of {low:g} to {high:g}"
    window = round(max(e.last / END_DIVISOR, e.paces[i].seconds / e.seconds(1)))
    times = e.events_on(i, e.last - window)
    return open_verdict(f"{text}: an event at {times[0]:g} s") if times else failed_verdict(text)


def _stop_text(e: Evidence, i: int) -> str:
    """The integrator that a loop drives to where it stops; empty: none, or it rests there with the output at 0 %."""
    if limits_reached(e, i) == "lower":
        return ""
    for name in e.influence.plants_between(i):
        text, plant = e.net.texts[name][1], e.net.plants[e.net.plant_index[name]]
        if text.model == "integrator" and text.limits is not None:
            low, high = (float(end) for end in text.limits)
            slack = NEGLIGIBLE_SHARE * abs(high - low)
            if not low + slack < plant.y < high - slack:
                return f"{name} ends at {plant.y:g}, the limit where it stops"
    return ""


def judge_oscillation(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by the swings of its PV in the last third of the run, and since the last event before it."""
    swings, free_swings = _find_swings(e, i), e.swings.get(i)
    if swings is None:
        return proven_verdict("its PV does not oscillate in the last third of the run")
    period = e.seconds(swings.period)
    text = f"its PV oscillates with a period of {period:.4g} s and an amplitude of {swings.amplitude:.4g}"
    why = _excuse_swings(e, i, swings)
    times = e.events_on(i, e.meters[i].last_third)
    if not why and free_swings is None and len(times) >= MIN_REPEATED_EVENTS:
        why = f"{len(times)} events move it in the last third"
    return unjudged_verdict(f"{text}: {why}") if why else failed_verdict(text, e.seconds(swings.since))


def _find_swings(e: Evidence, i: int) -> Swings | None:
    """An oscillation of a loop's PV: one between two events, or one of the whole last third."""
    m = e.meters[i]
    whole = oscillation(m, e.last)
    return e.swings.get(i) or (None if whole is None else Swings(*whole, m.first_turn))


def _excuse_swings(e: Evidence, i: int, swings: Swings) -> str:
    """Why an oscillation need not be the loop's fault."""
    m, plc, period = e.meters[i], e.plc, e.seconds(swings.period)
    if plc.is_on_off(i):
        return "its output is on or off"
    if period <= MAX_RIPPLE_CYCLES * e.influence.pulse_cycle(i) or swings.amplitude <= pulse_ripple(e, i):
        return "it is the ripple of its pulses"
    for j, name in enumerate(plc.loops):
        other = _find_swings(e, j)
        drives = (plc.is_on_off(j) or e.influence.pulse_cycle(j)) and plc.configs[
            i
        ].pv_slot in e.influence.moved_by_output(j)
        if j != i and drives and other and abs(e.seconds(other.period) - period) <= PERIOD_TOLERANCE * period:
            return f"{name} drives it, whose output is on or off"
    tuning = sum(plc.flag_bits[name] for name in plc.tuning_flags) | plc.modes.get("autotune", 0)
    status, aux_status, when = m.last_third_status, m.last_third_aux, "in the last third"
    if swings.since < m.last_third:
        status, aux_status, when = m.all_status, m.all_aux, "in the run"
    if status & tuning:
        return f"an auto-tune runs {when}"
    return f"a profile runs {when}" if plc.profile_step(aux_status) else ""


def judge_alarms(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by its outermost alarms while it controls and its sensor is sound."""
    m, plc = e.meters[i], e.plc
    names = [name for name in plc.outer_alarms if m.past_alarms & plc.alarm_bits[name]]
    now = m.status & m.outer_bits if m.in_control and not m.sensor_broken else 0
    if m.in_alarm or now:
        stand = [name for name in plc.outer_alarms if m.status & m.outer_bits & plc.alarm_bits[name]]
        since = e.seconds(m.alarm_since if m.in_alarm else 0)
        return failed_verdict(f"{' and '.join(stand)} stands at the end, since {since:g} s", since)
    steps = time_in_alarm(m, e.last)
    if steps > TOLERATED_SHARE * e.last:
        text = f"{' and '.join(names)} stands for {e.seconds(steps):g} s, {100 * steps / e.last:.0f} % of the run"
        return failed_verdict(text)
    return proven_verdict("no alarm of the outermost kind stands")


# ----------------------------------------------------------------------------------------------------------------------
# ``set-up-error``: the PLC finds no fault with the set-up; and what follows from a fault that a scenario expects.


def judge_set_up(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by its flags and its error words."""
    m, plc = e.meters[i], e.plc
    words = [
        f"{name} = {plc.error_format.format(plc.error_words[name])}"
        for name, j in plc.error_loops.items()
        if j == i and plc.error_words[name]
    ]
    flags = [name for name in plc.error_flags if m.all_status & plc.flag_bits.get(name, 0)]
    errors = [*flags, *words, *plc.set_up_errors(i)]
    return failed_verdict(", ".join(errors)) if errors else proven_verdict("no error of the set-up")


def judge_plc(e: Evidence) -> Judgement:
    """Judges the PLC: the error words that concern all loops, and blocks that are no loops."""
    plc = e.plc
    words = [
        f"{name} = {plc.error_format.format(word)}"
        for name, word in plc.error_words.items()
        if word and name not in plc.error_loops
    ]
    errors = [*words, *plc.program_errors(e.signal_values)]
    return failed_verdict(", ".join(errors)) if errors else proven_verdict("no error of the set-up")


def expected_errors(e: Evidence) -> Iterator[tuple[int, str]]:
    """The loops whose verdicts follow from a fault that a written expectation names (−1: all), and which it is.

    A fault that does not come excuses nothing; the expectation fails.
    """
    plc = e.plc
    for expectation in e.scenario.expect:
        owner = -1 if expectation.loop is None else plc.loops.index(expectation.loop)
        text = ""
        if isinstance(expectation.mode, ForbiddenMode) and e.is_control(expectation.mode.mode):
            if not e.meters[owner].all_status & plc.control_bits:
                text = f"{expectation.loop} is expected never to be in {expectation.mode.mode}"
        elif expectation.flag is not None and expectation.value is not False and expectation.value != 0:
            if expectation.loop is None:
                owner = plc.error_loops.get(expectation.flag, -1)
            if _error_has_come(e, expectation.flag, owner, is_loop_flag=expectation.loop is not None):
                text = f"{expectation.flag} {f'of {plc.loops[owner]} ' if owner >= 0 else ''}is expected"
        if text:
            yield from ((j, text) for j in (e.cascade_loops(owner) if owner >= 0 else (-1,)))


def _error_has_come(e: Evidence, flag: str, owner: int, *, is_loop_flag: bool) -> bool:
    """Whether an error has come: a word of the PLC, or a flag of a loop that means an error of its set-up."""
    if not is_loop_flag:
        return bool(e.plc.error_words[flag])
    return flag in e.plc.error_flags and bool(e.meters[owner].all_status & e.plc.flag_bits.get(flag, 0))


# --- ``not-in-mode``: a loop that is meant for Auto or Cascade reaches it, and ends in it -----------------------------

SLACK_SAMPLES = 10
"""Samples within which a loop answers to what takes its mode away."""


def judge_mode(e: Evidence, i: int) -> Judgement:
    """Judges one loop; what it is meant for is known to its meter, since events change it."""
    m, name = e.meters[i], e.plc.loops[i]
    if m.missed_at >= 0:
        until = e.seconds(m.missed_at)
        return failed_verdict(f"does not come into its mode until {until:g} s{_reason_text(e, i)}", 0.0)
    ignored_verdict = _judge_ignored_event(e, i)
    if ignored_verdict is not None and not m.wanted_bits:
        return ignored_verdict
    if not m.wanted_bits:
        return proven_verdict("reaches each mode that it is meant for")
    target, mode = e.plc.mode(m.wanted_bits), e.last_mode(i)
    if any(x.loop == name and isinstance(x.mode, ForbiddenMode) and x.mode.mode == target for x in e.scenario.expect):
        return unjudged_verdict(f"{name} is expected never to be in {target}")
    if not m.bits_since_wanted & m.wanted_bits:
        return failed_verdict(f"is meant for {target} and stays in {mode}{_reason_text(e, i)}", 0.0)
    if ignored_verdict is not None:
        return ignored_verdict
    k, since = e.unmet_events.get(i, (0, 0))
    if i in e.unmet_events and m.control_since - since > TOLERATED_SHARE * e.last:
        return open_verdict(f"the event at {e.seconds(k):g} s met {e.plc.mode(0)}: nothing was tested")
    if m.status & m.wanted_bits:
        return proven_verdict(f"reaches {target} and ends in it")
    at = e.seconds(m.left_at)
    cause = _leaving_event(e, i) or next(
        (f"an expectation names {mode}" for x in e.scenario.expect if x.loop == name and x.mode == mode), ""
    )
    if cause:
        return unjudged_verdict(f"in {mode} from {at:g} s: {cause}")
    return failed_verdict(f"is meant for {target} and ends in {mode}, from {at:g} s{_reason_text(e, i)}", at)


def _judge_ignored_event(e: Evidence, i: int) -> Judgement | None:
    """The verdict on a loop whose set point was changed last while it did not control, as it does not in the end."""
    m, k = e.meters[i], e.ignored_events.get(i)
    controls = m.in_control and e.plc.in_run
    if k is None or controls or (not m.in_control and m.control_since > k):
        return None
    state = f"it is in {e.last_mode(i)}" if e.plc.in_run else "the PLC is stopped"
    return failed_verdict(f"its set point is changed at {e.seconds(k):g} s, and {state} to the end", e.seconds(k))


def _reason_text(e: Evidence, i: int) -> str:
    reason = e.reasons.get(i)
    return f": {reason}" if reason else ""


def _leaving_event(e: Evidence, i: int) -> str:
    """The event after which a loop left its mode: on itself, its cascade, its mode inputs or the CPU."""
    m = e.meters[i]
    slack = -(-SLACK_SAMPLES * max(e.plc.configs[j].period for j in e.cascade_loops(i)) // e.step)
    for k, event in reversed(list(e.events())):
        if m.left_at - slack <= k <= m.left_at and _acts_on_mode(e, event, i):
            where = f" on {event.loop}" if event.loop else ""
            return f"the event at {e.seconds(k):g} s{where}, {describe_event(event)}"
    return ""


def _acts_on_mode(e: Evidence, event: Event, i: int) -> bool:
    """Whether an event may take a loop's mode away."""
    if event.plc is not None:
        return True
    family = e.cascade_loops(i)
    if event.loop is None:
        return any(slot in e.plc.mode_inputs(j) for slot in e.influence.written_signals(event) for j in family)
    of_mode = (
        event.mode is not None or event.autotune is not None or any(key in e.plc.mode_keys for key in event_keys(event))
    )
    return of_mode and event.loop in e.plc.loops and e.plc.loops.index(event.loop) in family


def event_keys(event: Event) -> Iterator[str]:
    """The keys that an event sets."""
    return (dotted_text(keys) for keys, _, _ in leaves(event.set or {}))


# --- All standing expectations of a run: which loops are judged by which, and what the scenario allows ----------------

Judge = Callable[[Evidence, int], Judgement]

STANDING_JUDGES: dict[str, tuple[Judge, str]] = {
    "not-in-mode": (judge_mode, "meant"),
    "set-up-error": (judge_set_up, ""),
    "pv-not-driven": (judge_drive, "controlled"),
    "saturated": (judge_saturation, "in control"),
    "error-stands": (judge_error, "in control"),
    "out-of-range": (judge_range, ""),
    "oscillates": (judge_oscillation, "controlled"),
    "alarm-stands": (judge_alarms, ""),
    "not-settled": (judge_settling, "controlled"),
    "no-better": (judge_benefit, "controlled"),
}
"""What judges a loop by each kind, and which loops."""


def judge_standing(e: Evidence) -> list[Standing]:
    """The verdicts: of the PLC first, then of its loops, by kind."""
    expected = list(expected_errors(e))
    common_reason = next((why for i, why in expected if i < 0), "")
    judgement = unjudged_verdict(common_reason) if common_reason else judge_plc(e)
    verdicts = [_make_standing("set-up-error", "", judgement)]
    for i, name in enumerate(e.plc.loops):
        why = _left_out_reason(e, i) or common_reason or next((text for j, text in expected if j == i), "")
        for kind, (judge, scope) in STANDING_JUDGES.items():
            reason = why or _unjudged_reason(e, i, scope)
            verdicts.append(_make_standing(kind, name, unjudged_verdict(reason) if reason else judge(e, i)))
        if name in e.scenario.assumed_signs:
            verdicts.append(
                _make_standing(ASSUMED_KIND, name, unjudged_verdict(f"whether its action is right: {SIGN_TEXT}"))
            )
    verdicts = [_add_allowance(e, verdict) for verdict in verdicts]
    reason_by_loop = {v.loop: v.allowed for v in verdicts if v.allowed is not None and v.kind in EXCUSING_KINDS}
    return [
        replace(v, allowed=v.allowed or reason_by_loop[v.loop])
        if v.kind in PROVING_KINDS and v.fails and v.loop in reason_by_loop
        else v
        for v in verdicts
    ]


def _left_out_reason(e: Evidence, i: int) -> str:
    chosen = e.scenario.loops
    return "" if chosen is None or e.plc.loops[i] in chosen else "the scenario's loops leave it out"


def _unjudged_reason(e: Evidence, i: int, scope: str) -> str:
    """What keeps a loop from being judged, by the loops that a kind is for."""
    m = e.meters[i]
    controlled = bool(m.all_status & m.control_bits)
    words = [name for name, word in e.plc.error_words.items() if word and name not in e.plc.error_loops]
    if scope == "meant" and not controlled and words:
        return f"{' and '.join(words)} keeps the loop task off"
    if scope == "meant" and not controlled and not m.wanted_bits and m.missed_at < 0 and i not in e.ignored_events:
        return "is meant for manual"
    if scope in {"controlled", "in control"} and not controlled:
        return f"in {e.last_mode(i)} from start to end"
    if scope == "in control" and not e.judged_looks(i):
        return "the PLC has been stopped" if not e.plc.in_run else f"ends in {e.last_mode(i)}"
    return ""


def _make_standing(kind: str, loop: str, judgement: Judgement) -> Standing:
    at = None if judgement.at is None else ten_digits(judgement.at)
    return Standing(kind, loop, judgement.verdict, judgement.text, at)


PROVING_KINDS = ("not-settled", "no-better")
"""The kinds that prove that a loop controls."""
EXCUSING_KINDS = ("saturated", "error-stands", "oscillates", "out-of-range")
"""Those that nobody can expect to settle whom the scenario allows them."""


def loop_verdict(verdicts: Sequence[Standing]) -> tuple[VerdictWord, str]:
    """Whether a run proves that a loop controls, by what is said of it, and what keeps it from being proven."""
    failed = [v for v in verdicts if v.fails and v.verdict == "failed"]
    missing = [v for v in verdicts if v.fails and v.verdict == "not-proven"]
    excused = [v for v in verdicts if v.allowed is not None or (v.kind in PROVING_KINDS and not v.is_judged)]
    groups: tuple[tuple[VerdictWord, list[Standing]], ...]
    groups = ("failed", failed), ("not-proven", missing), ("not-judged", excused)
    for word, group in groups:
        if group:
            return word, "; ".join(f"{texts}{reason}" for reason, texts in _texts_by_reason(group))
    return ("proven", "") if verdicts else ("not-judged", "nothing is judged")


def _texts_by_reason(verdicts: Sequence[Standing]) -> Iterator[tuple[str, str]]:
    """What is said of a loop, each reason for which some of it is allowed once."""
    for reason in dict.fromkeys(v.allowed for v in verdicts):
        texts = dict.fromkeys(v.text for v in verdicts if v.allowed == reason)
        yield "" if reason is None else f" (allowed: {reason})", "; ".join(texts)


def _add_allowance(e: Evidence, verdict: Standing) -> Standing:
    kinds = {verdict.kind, verdict.verdict}
    reasons = (a.reason for a in e.scenario.allow if a.kind in kinds and a.loop == verdict.loop)
    return verdict if verdict.passed else replace(verdict, allowed=next(reasons, None))


def unused_allowances(e: Evidence, verdicts: list[Standing]) -> Iterator[Problem]:
    """Warnings of entries of ``allow`` that allow nothing."""
    used = {(kind, v.loop) for v in verdicts if v.allowed is not None for kind in (v.kind, v.verdict)}
    for i, entry in enumerate(e.scenario.allow):
        if (entry.kind, entry.loop) not in used:
            message = f"{entry.loop} does not fail by {entry.kind}: there is nothing to allow"
            yield Problem(("allow", i), message, "idle_allowance", "warning", "remove the entry", loop=entry.loop)


# --- Looks at the loops of a run while it runs: aims the meters, and judges when a window ends ------------------------


@dataclass
class LoopWatch:
    """The looks of a run; ``evidence`` gathers what they show."""

    evidence: Evidence
    pending_looks: dict[int, list[Look]] = field(default_factory=dict)
    """The looks at each loop that are still to come."""
    late_events: dict[int, list[int]] = field(default_factory=dict)
    """When events move each loop in the last third of the run."""

    def __post_init__(self) -> None:
        e = self.evidence
        e.looks = {i: [] for i in range(len(e.plc.loops))}
        e.given_set_points = {i: e.plc.given_set_point(i, e.signal_values) for i in e.looks if e.masters[i] < 0}
        e.paces = [plant_time(e.plc, e.influence, i) for i in e.looks]
        e.effects = [output_effect(e.net, e.plc, i) for i in e.looks]
        e.bands = [band_of(e, i) for i in e.looks]
        for i in e.looks:
            noise = NOISE_MARGIN * noise_of(e.scenario, e.plc, e.net, i)
            e.meters[i].band = e.bands[i] + noise + pulse_ripple(e, i)
        for i in e.looks:
            self.pending_looks[i] = make_looks(e.scenario, e.plc, e.influence, i, e.step, e.last)
            self._aim_meter(i)
            moved = {k for k, event in event_steps(e.scenario, e.step, e.last) if e.influence.can_move(event, i)}
            e.meters[i].swings_from = max((k for k in moved if k <= e.meters[i].last_third), default=0)
            self.late_events[i] = sorted(k for k in moved if k > e.meters[i].last_third)

    def _aim_meter(self, i: int) -> None:
        e = self.evidence
        aim_meter(e.meters[i], self.pending_looks[i][0], e.paces[i].seconds * TICKS / e.step)

    def stops(self) -> Iterator[tuple[int, Callable[[int], None]]]:
        """Base steps before which a window has ended that is not the end of the run, and what is done there."""
        e = self.evidence
        for i, looks in self.pending_looks.items():
            yield from ((look.end + 1, partial(self._end_look, i)) for look in looks[:-1])
            yield from ((k, partial(self._end_calm, i)) for k in self.late_events[i])
            set_point_events = ((k, event) for k, event in e.events() if e.set_point_of(event, i) is not None)
            yield from ((k, partial(self._note_set_point, i, event)) for k, event in set_point_events)

    def _note_set_point(self, i: int, event: Event, k: int) -> None:
        """Notes whether a loop is there to follow the new set point that an event is about to give it."""
        e, m = self.evidence, self.evidence.meters[i]
        for notes in (e.unmet_events, e.ignored_events, e.requested_set_points):
            notes.pop(i, None)
        with suppress(ValueError):
            if e.is_set_point(event, i):
                e.requested_set_points[i] = k, float(str(e.set_point_of(event, i)))
        if not (m.in_control and e.plc.in_run):
            e.ignored_events[i] = k
            if m.wanted_bits and not m.in_control:
                e.unmet_events[i] = k, m.wanted_since

    def _end_calm(self, i: int, k: int) -> None:
        m = self.evidence.meters[i]
        swings = calm_oscillation(m, k)
        if swings is not None:
            self.evidence.swings.setdefault(i, Swings(*swings, m.calm_first_turn))
        begin_calm(m)

    def _end_look(self, i: int, _k: int) -> None:
        look = self.pending_looks[i].pop(0)
        self._judge_look(i, look)
        self._aim_meter(i)

    def _judge_look(self, i: int, look: Look) -> None:
        e = self.evidence
        last, e.last = e.last, look.end
        result = judge_look(e, i, look)
        e.last = last
        if result is not None:
            e.looks[i].append(result)

    def finish(self) -> None:
        """Looks at how the run ends."""
        for i, looks in self.pending_looks.items():
            self._judge_look(i, looks[0])
            self._end_calm(i, self.evidence.last)
