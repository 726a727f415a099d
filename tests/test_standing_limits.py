"""What a loop's signals and its mode must show at the end: each judgement at the limit at which it changes."""

from __future__ import annotations

from types import SimpleNamespace as Facts

import pytest

from pidcfg.schemas.scenario import ForbiddenMode
from pidcfg.sim.judgement import evidence as watch
from pidcfg.sim.judgement import standing as signals
from pidcfg.sim.judgement.evidence import Look, aim_meter
from pidcfg.sim.judgement.expect import NO_STEP_TEXT, MeasuredRun, place_verdict, verdict
from pidcfg.sim.judgement.meters import Gauge, Meter, Onset
from pidcfg.sim.judgement.report import Range
from pidcfg.sim.judgement.standing import (
    judge_alarms,
    judge_drive,
    judge_mode,
    judge_oscillation,
    judge_range,
    pulse_ripple,
)
from scenario_rig import scenario

AUTO, TUNING, HIGH, LOW = 2, 4, 8, 16


def judged(judgement):
    """How a judgement ends, with its words."""
    return judgement.verdict


@pytest.fixture(autouse=True)
def nothing_moves(monkeypatch):
    monkeypatch.setattr(signals, "output_effect", lambda *_: 0.0)
    monkeypatch.setattr(watch, "pv_change", lambda *_, **__: -2.0)
    monkeypatch.setattr(signals, "noise_of", lambda scenario, *_: scenario.noise)


def evidence(**given):
    """A run of 1000 base steps of 0.5 s with one loop, whose PV has a span of 100 and 1000 counts."""
    fields = {name: value for name, value in given.items() if name in Meter.__slots__}
    meter = Meter(
        0,
        1,
        2,
        **{
            "last_third": 667,
            "wanted_bits": AUTO,
            "bits_since_wanted": AUTO,
            "all_status": AUTO,
            "status": AUTO,
            "outer_bits": HIGH | LOW,
            "control_bits": AUTO,
            **fields,
        },
    )
    plc = Facts(
        loops=["A"],
        configs=[Facts(in_slot=0, pv_slot=0, sp_slot=1, out_slot=2, period=500_000)],
        scales=[(0.0, 100.0, 1000)],
        output_limits=lambda *_: (0.0, 100.0),
        pv_range=lambda _: given.get("range", (0.0, 100.0)),
        is_on_off=lambda _: given.get("switches", False),
        pulse_cycle=lambda _: given.get("cycle", 0.0),
        in_run=True,
        tuning_flags=("tuning",),
        flag_bits={"tuning": TUNING},
        alarm_bits={"high": HIGH, "low": LOW},
        outer_alarms=("high", "low"),
        modes={"auto": AUTO},
        mode=lambda status: "auto" if status & AUTO else "manual",
        profile_step=lambda aux: aux,
        mode_keys=(),
    )
    events = given.get("events", [])
    return Facts(
        plc=plc,
        net=None,
        meters=[meter],
        scenario=Facts(expect=given.get("expect", []), noise=given.get("noise", 0.0)),
        influence=Facts(
            is_driven=[given.get("driven", True)],
            can_drive=lambda _: given.get("drives", True),
            moved_by_output=lambda _: {0},
            plants_between=lambda _: [],
            pulse_cycle=lambda _: given.get("cycle", 0.0),
        ),
        effects=[given.get("effect", 50.0)],
        paces=[Facts(integrates=given.get("integrates", False), seconds=given.get("pace", 10.0), lag_time=8.0)],
        span=lambda _: 100.0,
        min_difference=lambda _: 0.2,
        given_set_points=given.get("given", {}),
        unmet_events=given.get("unmet", {}),
        ignored_events=given.get("ignored", {}),
        signal_values=given.get("sig", [50.0, 50.0, 0.0]),
        seconds=lambda k: k / 2,
        last=1000,
        step=500_000,
        swings=given.get("swings", {}),
        reasons=given.get("reasons", {}),
        cascade_loops=lambda _: {0},
        events=lambda: iter(()),
        events_on=lambda _, since: [time for time in events if time >= since / 2],
        last_mode=lambda _: plc.mode(meter.status),
    )


@pytest.mark.parametrize(
    ("given", "found", "text"),
    [
        ({}, "proven", "its output moves its PV"),
        ({"drives": False}, "proven", "a signal that the scenario sets moves its PV"),
        ({"driven": False}, "failed", "nothing that its output does reaches its PV, so nothing is controlled"),
        ({"effect": 0.4}, "proven", "its output moves its PV"),
        ({"effect": 0.39}, "failed", "its whole output moves its PV by no more than 0.39, so nothing is controlled"),
        ({"effect": 0.0}, "proven", "its output moves its PV"),
        ({"effect": 0.0008, "integrates": True}, "proven", "its output moves its PV"),
        (
            {"effect": 0.00079, "integrates": True},
            "failed",
            "its whole output moves its PV by no more than 0.395, so nothing is controlled",
        ),
        ({"blind_steps": 100}, "proven", "its output moves its PV"),
        ({"blind_steps": 101}, "failed", "it is in control for 50.5 s with a sensor that is broken for good"),
        ({"control_steps": 100, "cut_from": 0}, "proven", "its output moves its PV"),
        (
            {"control_steps": 101, "cut_from": 0},
            "failed",
            "it is in control for 50.5 s while a plant without gain keeps its output from its PV",
        ),
        (
            {"blind_steps": 101, "expect": [Facts(loop="A", alarm="high", flag=None, mode=None)]},
            "not-judged",
            "it is in control for 50.5 s with a sensor that is broken for good: an expectation looks at what follows",
        ),
        (
            {"blind_steps": 101, "expect": [Facts(loop="B", alarm="high", flag=None, mode=None)]},
            "failed",
            "it is in control for 50.5 s with a sensor that is broken for good",
        ),
        (
            {"blind_steps": 101, "expect": [Facts(loop="A", alarm=None, flag=None, mode=None)]},
            "failed",
            "it is in control for 50.5 s with a sensor that is broken for good",
        ),
    ],
)
def test_an_output_moves_its_pv_by_four_counts_and_for_nine_tenths_of_the_run(given, found, text):
    judgement = judge_drive(evidence(**given), 0)
    assert (judged(judgement), judgement.text) == (found, text)


@pytest.mark.parametrize(
    ("given", "found", "text"),
    [
        ({}, "proven", "its PV ends inside its range"),
        ({"range": None}, "not-judged", "its configuration gives no range of the PV"),
        ({"sensor_broken": 1, "sig": [200.0, 50.0, 0.0]}, "not-judged", "an event has broken its sensor"),
        ({"sig": [100.2, 50.0, 0.0]}, "proven", "its PV ends inside its range"),
        ({"sig": [-0.2, 50.0, 0.0]}, "proven", "its PV ends inside its range"),
        ({"sig": [100.3, 50.0, 0.0]}, "failed", "its PV ends at 100.3, outside its range of 0 to 100"),
        ({"sig": [-0.3, 50.0, 0.0]}, "failed", "its PV ends at -0.3, outside its range of 0 to 100"),
        ({"sig": [106.0, 50.0, 0.0], "noise": 1.0}, "proven", "its PV ends inside its range"),
        ({"sig": [106.1, 50.0, 0.0], "noise": 1.0}, "failed", "its PV ends at 106.1, outside its range of 0 to 100"),
        ({"range": (100.0, 0.0)}, "proven", "its PV ends inside its range"),
        ({"sig": [50.0, 100.2, 0.0]}, "proven", "its PV ends inside its range"),
        ({"sig": [50.0, 100.3, 0.0]}, "failed", "its set point is 100.3, outside its PV's range of 0 to 100"),
        ({"given": {0: -0.3}}, "failed", "its set point is -0.3, outside its PV's range of 0 to 100"),
        (
            {"sig": [101.0, 50.0, 0.0], "events": [450.0, 460.0]},
            "not-proven",
            "its PV ends at 101, outside its range of 0 to 100: an event at 450 s",
        ),
        ({"sig": [101.0, 50.0, 0.0], "events": [449.0]}, "failed", "its PV ends at 101, outside its range of 0 to 100"),
        (
            {"sig": [101.0, 50.0, 0.0], "events": [440.0], "pace": 60.0},
            "not-proven",
            "its PV ends at 101, outside its range of 0 to 100: an event at 440 s",
        ),
    ],
)
def test_a_pv_and_its_set_point_end_inside_the_range(given, found, text):
    judgement = judge_range(evidence(**given), 0)
    assert (judged(judgement), judgement.text) == (found, text)


SWINGS = signals.Swings(40.0, 3.0, 700)
SAID = "its PV oscillates with a period of 20 s and an amplitude of 3"


@pytest.mark.parametrize(
    ("given", "found", "why"),
    [
        ({}, "failed", ""),
        ({"switches": True}, "not-judged", ": its output is on or off"),
        ({"cycle": 5.0}, "not-judged", ": it is the ripple of its pulses"),
        ({"cycle": 4.99}, "failed", ""),
        ({"last_third_status": TUNING}, "not-judged", ": an auto-tune runs in the last third"),
        ({"all_status": TUNING}, "failed", ""),
        ({"last_third_aux": 1}, "not-judged", ": a profile runs in the last third"),
        ({"all_aux": 1}, "failed", ""),
        ({"last_third": 700, "all_status": TUNING}, "failed", ""),
        ({"last_third": 701, "all_status": TUNING}, "not-judged", ": an auto-tune runs in the run"),
        ({"last_third": 701, "all_aux": 1}, "not-judged", ": a profile runs in the run"),
        ({"last_third": 701, "last_third_status": TUNING}, "failed", ""),
    ],
)
def test_an_oscillation_is_the_loops_own_unless_something_else_makes_it(given, found, why):
    judgement = judge_oscillation(evidence(swings={0: SWINGS}, **given), 0)
    assert (judged(judgement), judgement.text) == (found, SAID + why)
    assert judgement.verdict != "failed" or judgement.at == 350.0


@pytest.mark.parametrize(("events", "found"), [([], "failed"), ([400.0], "failed"), ([350.0, 400.0], "not-judged")])
def test_two_events_in_the_last_third_may_make_a_pv_swing(monkeypatch, events, found):
    monkeypatch.setattr(signals, "oscillation", lambda *_: (40.0, 3.0))
    judgement = judge_oscillation(evidence(events=events), 0)
    assert judged(judgement) == found
    assert judgement.text == SAID + (": 2 events move it in the last third" if events[1:] else "")
    own = judge_oscillation(evidence(events=events, swings={0: SWINGS}), 0)
    assert judged(own) == "failed", "one between two events is no event's"


def test_pulses_of_half_a_cycle_ripple_by_what_the_plant_lets_through():
    assert pulse_ripple(evidence(), 0) == 0.0
    assert pulse_ripple(evidence(cycle=4.0), 0) == 2.0 * 4.0 / (4 * 8.0)
    assert pulse_ripple(evidence(cycle=16.0), 0) == 2.0 / 4


@pytest.mark.parametrize(
    ("given", "text", "at"),
    [
        ({}, "no alarm of the outermost kind stands", None),
        ({"alarm_steps": 100, "past_alarms": HIGH}, "no alarm of the outermost kind stands", None),
        ({"alarm_steps": 150, "past_alarms": HIGH | LOW}, "high and low stands for 75 s, 15 % of the run", None),
        (
            {"in_alarm": 1, "alarm_since": 900, "past_alarms": HIGH, "status": AUTO | HIGH},
            "high stands at the end, since 450 s",
            450,
        ),
        (
            {"in_alarm": 1, "alarm_since": 0, "past_alarms": HIGH | LOW, "status": AUTO | LOW},
            "low stands at the end, since 0 s",
            0,
        ),
    ],
)
def test_an_alarm_may_stand_for_a_tenth_of_the_run_and_not_at_its_end(given, text, at):
    judgement = judge_alarms(evidence(**given), 0)
    assert (judgement.text, judgement.verdict) == (text, "proven" if text.startswith("no ") else "failed")
    assert at is None or judgement.at == at


@pytest.mark.parametrize(
    ("given", "found", "text"),
    [
        ({}, "proven", "reaches auto and ends in it"),
        ({"wanted_bits": 0}, "proven", "reaches each mode that it is meant for"),
        ({"bits_since_wanted": 1, "status": 1}, "failed", "is meant for auto and stays in manual"),
        (
            {"bits_since_wanted": 1, "status": 1, "reasons": {0: "no"}},
            "failed",
            "is meant for auto and stays in manual: no",
        ),
        ({"missed_at": 0}, "failed", "does not come into its mode until 0 s"),
        ({"missed_at": 8, "reasons": {0: "no"}}, "failed", "does not come into its mode until 4 s: no"),
        ({"status": 1, "left_at": 30}, "failed", "is meant for auto and ends in manual, from 15 s"),
        (
            {"status": 1, "left_at": 30, "expect": [Facts(loop="A", mode="manual")]},
            "not-judged",
            "in manual from 15 s: an expectation names manual",
        ),
        (
            {"status": 1, "left_at": 30, "expect": [Facts(loop="B", mode="manual"), Facts(loop="A", mode="auto")]},
            "failed",
            "is meant for auto and ends in manual, from 15 s",
        ),
        (
            {"expect": [Facts(loop="A", mode=ForbiddenMode(mode="auto"))]},
            "not-judged",
            "A is expected never to be in auto",
        ),
        ({"expect": [Facts(loop="A", mode=ForbiddenMode(mode="manual"))]}, "proven", "reaches auto and ends in it"),
        (
            {"unmet": {0: (60, 10)}, "in_control": 1, "control_since": 111},
            "not-proven",
            "the event at 30 s met manual: nothing was tested",
        ),
        ({"unmet": {0: (60, 10)}, "in_control": 1, "control_since": 110}, "proven", "reaches auto and ends in it"),
        (
            {"ignored": {0: 60}, "wanted_bits": 0, "status": 1, "control_since": 60},
            "failed",
            "its set point is changed at 30 s, and it is in manual to the end",
        ),
        ({"ignored": {0: 60}, "in_control": 1}, "proven", "reaches auto and ends in it"),
        (
            {"ignored": {0: 60}, "wanted_bits": 0, "control_since": 61},
            "proven",
            "reaches each mode that it is meant for",
        ),
    ],
)
def test_a_loop_reaches_its_mode_and_ends_in_it(given, found, text):
    judgement = judge_mode(evidence(**given), 0)
    assert (judged(judgement), judgement.text) == (found, text)


@pytest.mark.parametrize(
    ("look", "pace", "watched"),
    [
        (Look(500, 550, 600, 0, is_final=False, next_event_time=1.0), 20.0, 420),
        (Look(500, 550, 600, 450, is_final=False, next_event_time=1.0), 20.0, 450),
        (Look(900, 950, 1000, 0, is_final=True, next_event_time=1.0), 20.0, 667),
    ],
)
def test_a_loop_is_watched_from_four_plant_times_before_the_window_on(look, pace, watched):
    m = Meter(0, 1, 2, last_third=667, early_error=1.0, final_error=1.0, early_sp=1.0, final_sp=1.0, error_sign=1)
    aim_meter(m, look, pace)
    assert (m.window_start, m.window_middle, m.watch_from) == (look.start, look.middle, watched)
    assert (m.early_error, m.final_error, m.early_sp, m.final_sp, m.error_sign) == (0.0, 0.0, 0.0, 0.0, 0)


@pytest.mark.parametrize(
    ("scale", "noise", "least"),
    [((0.0, 100.0, 1000), 0.0, 1.0), ((100.0, 0.0, 200), 0.0, 2.0), ((0.0, 100.0, 1000), 0.5, 5.0)],
)
def test_a_swing_passes_counts_share_of_the_span_and_noise(monkeypatch, scale, noise, least):
    monkeypatch.setattr(watch, "noise_of", lambda *_: noise)
    e = evidence(expect=[Facts(loop="A", alarm="high", never=None), Facts(loop="A", alarm="low", never=True)])
    e.plc.scales, e.plc.initial_modes, e.plc.control_bits = [scale], ["auto"], AUTO
    (m,) = watch.meters_of(e.scenario, e.plc, e.net, 1000)
    assert (m.min_swing, m.last_third, m.wanted_bits, m.control_bits, m.outer_bits) == (least, 667, AUTO, AUTO, LOW)


@pytest.mark.parametrize(
    ("sigmas", "events", "noise"),
    [([], [], 0.0), ([3.0], [], 3.0), ([3.0, 4.0], [], 5.0), ([3.0, 4.0], [5, 0], 41**0.5), ([3.0], [2], 3.0)],
)
def test_the_noise_of_a_pv_is_that_of_all_transmitters_at_its_largest(monkeypatch, sigmas, events, noise):
    monkeypatch.setattr(watch, "_pv_change", lambda *found: found[-1])
    monkeypatch.setattr(watch, "_noise_sources", lambda net, *_: net.noisy_plants)
    names = [f"p{n}" for n, _ in enumerate(sigmas)]
    net = Facts(
        noisy_plants=names,
        plant_index={name: n for n, name in enumerate(names)},
        plants=[Facts(sigma=sigma, measured=0) for sigma in sigmas],
    )
    later = [Facts(plant=None, loop="p0", disturb={"noise": event}) for event in events]
    other = Facts(plant="p0", loop=None, disturb={"gain": 99})
    assert (
        watch.noise_of(Facts(events=[*later, other, Facts(plant="p0", loop=None, disturb=None)]), None, net, 0) == noise
    )


# --- What each expectation says of what was measured, at its bounds: passed or not, the value, and the words ----------


TUNED_AUTO, HIGH_LIMIT, ODD, COMPLETE, EVEN = 2, 8, 16, 1, 2
TUNED = {"done": True, "error": False, "results": {"gain": 2.5, "reset": None}}
PLC = Facts(
    loops=["B", "A"],
    modes={"manual": 1, "auto": TUNED_AUTO},
    mode=lambda status: "auto" if status & TUNED_AUTO else "manual",
    error_words={"V1": 4, "V2": 0},
    error_format="0x{:04X}",
    flag_bits={"odd": ODD},
    aux_bits={"complete": COMPLETE, "even": EVEN},
    tuning_result=lambda loop: TUNED if loop == 1 else None,
)
METRICS = {"iae": 3.0, "overshoot": 5.0, "settling_time": None, "rise_time": None, "oscillation_period": None}
OUT = MeasuredRun(
    PLC,
    [{**dict.fromkeys(METRICS), "iae": None}, METRICS],
    [
        Meter(0, 0, 0, status=1, all_status=1),
        Meter(0, 0, 0, status=TUNED_AUTO, all_status=TUNED_AUTO | ODD, all_aux=COMPLETE, event_at=3, has_step=1),
    ],
    {"A.PV": Range(10.0, 60.0, 50.0), "B.PV": Range(-1.0, 1.0, 0.0)}.__getitem__,
    0.5,
    100,
    {("B", "high")},
    {7: "manual"},
)
NONE, AT_4, AT_0 = Onset(1, HIGH_LIMIT), Onset(1, HIGH_LIMIT, 8), Onset(1, HIGH_LIMIT, 0)
NARROW = Gauge(0, low=20.0, high=30.0)
TIMELESS = Gauge(0, low=1.0, high=-1.0)
ON_B = Onset(0, HIGH_LIMIT)
VERDICTS = [
    # expectation, what was measured for it alone, passed, value, words
    ("loop: A, metric: iae, max: 3", None, True, 3.0, "A iae at most 3"),
    ("loop: A, metric: iae, max: 2.999", None, False, 3.0, "A iae at most 2.999"),
    ("loop: A, metric: iae, min: 3", None, True, 3.0, "A iae at least 3"),
    ("loop: A, metric: iae, min: 3.001", None, False, 3.0, "A iae at least 3.001"),
    ("loop: A, metric: overshoot, min: 1, max: 5 %", None, True, 5.0, "A overshoot at least 1 % and at most 5 %"),
    ("loop: A, metric: settling_time, max: 3", None, False, None, "A settling_time at most 3 s"),
    (
        "loop: A, metric: oscillation_period, max: 3",
        None,
        False,
        None,
        "A oscillation_period at most 3 s (nothing was measured: the PV does not oscillate)",
    ),
    (
        "loop: B, metric: rise_time, max: 3",
        None,
        False,
        None,
        f"B rise_time at most 3 s (nothing was measured: {NO_STEP_TEXT})",
    ),
    (
        "loop: B, metric: iae, max: 3",
        None,
        False,
        None,
        "B iae at most 3 (nothing was measured: the loop was not in Auto or Cascade)",
    ),
    ("signal: A.PV, max: 60", None, True, 60.0, "A.PV at most 60"),
    ("signal: A.PV, max: 59.9", None, False, 60.0, "A.PV at most 59.9"),
    ("signal: A.PV, min: 10", None, True, 10.0, "A.PV at least 10"),
    ("signal: A.PV, min: 10.1", None, False, 10.0, "A.PV at least 10.1"),
    ("signal: A.PV, min: 10, max: 60", None, True, [10.0, 60.0], "A.PV at least 10 and at most 60"),
    ("signal: A.PV, final: 51, tolerance: 1", None, True, 50.0, "A.PV 51 ± 1 at the end"),
    ("signal: A.PV, final: 49, tolerance: 1", None, True, 50.0, "A.PV 49 ± 1 at the end"),
    ("signal: A.PV, final: 51, tolerance: 0.9", None, False, 50.0, "A.PV 51 ± 0.9 at the end"),
    ("signal: A.PV, max: 50, final: 50, tolerance: 1", None, False, 60.0, "A.PV at most 50, 50 ± 1 at the end"),
    ("signal: A.PV, min: 20, final: 50, tolerance: 1", None, False, 10.0, "A.PV at least 20, 50 ± 1 at the end"),
    ("signal: A.PV, max: 30, from: 1, until: 2", NARROW, True, 30.0, "A.PV at most 30 from 1 s until 2 s"),
    ("signal: A.PV, min: 20, from: 1", NARROW, True, 20.0, "A.PV at least 20 from 1 s"),
    ("signal: A.PV, max: 29, until: 2", NARROW, False, 30.0, "A.PV at most 29 until 2 s"),
    ("signal: A.PV, max: 29, until: 2", TIMELESS, False, None, "A.PV: no base step lies in its time"),
    ("loop: A, alarm: high, never: true", NONE, True, None, "A alarm high never"),
    ("loop: A, alarm: high, never: true", AT_0, False, 0.0, "A alarm high never"),
    ("loop: A, alarm: high, never: false", NONE, False, None, "A alarm high at some time"),
    ("loop: A, alarm: high, never: false", AT_4, True, 4.0, "A alarm high at some time"),
    ("loop: A, alarm: high, never: true, before: 4", AT_4, True, 4.0, "A alarm high never before 4 s"),
    ("loop: A, alarm: high, never: true, before: 4.1", AT_4, False, 4.0, "A alarm high never before 4.1 s"),
    ("loop: A, alarm: high, never: true, before: 4", NONE, True, None, "A alarm high never before 4 s"),
    (
        "loop: B, alarm: high, never: true",
        ON_B,
        False,
        None,
        "B alarm high never (nothing was measured: the alarm is off)",
    ),
    ("loop: A, alarm: high, at: 4.25", AT_4, True, 4.0, "A alarm high at 4.25 s"),
    ("loop: A, alarm: high, at: 3.75", AT_4, True, 4.0, "A alarm high at 3.75 s"),
    ("loop: A, alarm: high, at: 4.3", AT_4, False, 4.0, "A alarm high at 4.3 s"),
    ("loop: A, alarm: high, at: 5.25, tolerance: 1", AT_4, True, 4.0, "A alarm high at 5.25 s ± 1 s"),
    ("loop: A, alarm: high, at: 5.3, tolerance: 1", AT_4, False, 4.0, "A alarm high at 5.3 s ± 1 s"),
    ("loop: A, alarm: high, at: 0", NONE, False, None, "A alarm high at 0 s"),
    ("loop: A, alarm: high, at: 0", AT_0, True, 0.0, "A alarm high at 0 s"),
    ("loop: A, alarm: high, before: 4", AT_4, True, 4.0, "A alarm high before 4 s"),
    ("loop: A, alarm: high, before: 3.9", AT_4, False, 4.0, "A alarm high before 3.9 s"),
    ("loop: A, alarm: high, after: 4", AT_4, True, 4.0, "A alarm high after 4 s"),
    ("loop: A, alarm: high, after: 4.1", AT_4, False, 4.0, "A alarm high after 4.1 s"),
    ("loop: A, alarm: high, before: 9, after: 1", AT_4, True, 4.0, "A alarm high before 9 s and after 1 s"),
    ("loop: A, alarm: high, at: 4, after: 5", AT_4, False, 4.0, "A alarm high at 4 s and after 5 s"),
    ("flag: V1", None, True, "0x0004", "V1 is set"),
    ("flag: V1, is: 4", None, True, "0x0004", "V1 is 0x0004"),
    ("flag: V1, is: 5", None, False, "0x0004", "V1 is 0x0005"),
    ("flag: V1, is: false", None, False, "0x0004", "V1 is clear"),
    ("flag: V2, is: false", None, True, "0x0000", "V2 is clear"),
    ("flag: V2", None, False, "0x0000", "V2 is set"),
    ("loop: A, flag: odd", None, True, True, "A flag odd on"),
    ("loop: A, flag: odd, is: false", None, False, True, "A flag odd off"),
    ("loop: A, flag: complete", None, True, True, "A flag complete on"),
    ("loop: A, flag: even", None, False, False, "A flag even on"),
    ("loop: B, flag: odd, is: false", None, True, False, "B flag odd off"),
    ("loop: A, autotune: done", None, True, True, "A autotune done is true"),
    ("loop: A, autotune: done, is: false", None, False, True, "A autotune done is false"),
    ("loop: A, autotune: error", None, False, False, "A autotune error is true"),
    ("loop: A, autotune: error, is: false", None, True, False, "A autotune error is false"),
    ("loop: B, autotune: done, is: false", None, False, None, "B autotune done is false"),
    ("loop: A, autotune: gain, min: 2.5, max: 2.5", None, True, 2.5, "A autotune gain at least 2.5 and at most 2.5"),
    ("loop: A, autotune: gain, max: 2.4", None, False, 2.5, "A autotune gain at most 2.4"),
    ("loop: A, autotune: gain", None, True, 2.5, "A autotune gain is found"),
    ("loop: A, autotune: reset", None, False, None, "A autotune reset is found"),
    ("loop: B, autotune: gain, max: 9", None, False, None, "B autotune gain at most 9"),
    ("loop: A, mode: auto", None, True, "auto", "A mode is auto at the end"),
    ("loop: A, mode: manual", None, False, "auto", "A mode is manual at the end"),
    ("loop: B, mode: manual", None, True, "manual", "B mode is manual at the end"),
    ("loop: A, mode: {never: manual}", None, True, None, "A mode is never manual"),
    ("loop: A, mode: {never: auto}", None, False, "auto", "A mode is never auto"),
]


@pytest.mark.parametrize(("text", "watch", "passed", "value", "words"), VERDICTS, ids=[row[0] for row in VERDICTS])
def test_an_expectation_at_its_bounds(text, watch, passed, value, words):
    (wanted,) = scenario(f"expect: [{{{text}}}]\n").expect
    found = verdict(0, wanted, watch, OUT)
    assert (found.passed, found.value, found.text) == (passed, value, words)
    assert type(found.value) is type(value)


def test_a_mode_at_a_time_is_what_was_seen_then():
    (wanted,) = scenario("expect: [{loop: A, mode: manual, at: 2.5}]\n").expect
    found = verdict(7, wanted, None, OUT)
    assert (found.passed, found.value, found.text) == (True, "manual", "A mode is manual at 2.5 s")


@pytest.mark.parametrize(
    ("text", "loop", "at"),
    [
        ("loop: A, mode: auto", "A", None),
        ("loop: A, mode: auto, at: 3", "A", 3.0),
        ("signal: B.PV, max: 3", "B", None),
        ("flag: V1", None, None),
    ],
)
def test_a_verdict_has_its_loop_and_its_time(text, loop, at):
    (wanted,) = scenario(f"expect: [{{{text}}}]\n").expect
    found = place_verdict(verdict(0, wanted, None, OUT), wanted)
    assert (found.loop, found.at) == (loop, at)
