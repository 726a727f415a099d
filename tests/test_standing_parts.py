"""What standing expectations measure: saturation, errors, swings."""

from __future__ import annotations

from itertools import product
from math import exp
from types import SimpleNamespace as Facts

import pytest

from pidcfg.schemas.scenario import Bound, Plant, Scenario
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.costs import Cost
from pidcfg.sim.engine import choice
from pidcfg.sim.engine.events import Journal
from pidcfg.sim.engine.kernel import Span, is_steady
from pidcfg.sim.engine.reference import _program_followers
from pidcfg.sim.engine.run import refused_modes, spans_of, swings_alike, window_steps
from pidcfg.sim.judgement import control
from pidcfg.sim.judgement import lasting as saturation
from pidcfg.sim.judgement import standing as signals
from pidcfg.sim.judgement.evidence import (
    NEGLIGIBLE_SHARE,
    Evidence,
    Look,
    Pace,
    Swings,
    band_of,
    lag_times,
    limits_reached,
)
from pidcfg.sim.judgement.meters import Meter, begin_calm, calm_oscillation, oscillation, watch_swings
from pidcfg.sim.judgement.standing import TOLERATED_SHARE, expected_errors, judge_alarms

# --- Standing expectations, each judgement by itself: what it makes of the facts at their limits ----------------------


@pytest.mark.parametrize(
    ("out", "limit"),
    [(999.5, "upper"), (999.4, ""), (500, ""), (0.6, ""), (0.5, "lower"), (1200, "upper"), (-5, "lower")],
)
def test_an_output_is_at_a_limit_within_half_of_what_is_no_difference(out, limit):
    plc = Facts(output_limits=lambda *_: (0.0, 1000.0), configs=[Facts(out_slot=0)])

    assert NEGLIGIBLE_SHARE == 0.001
    assert limits_reached(Facts(plc=plc, signal_values=[out]), 0) == limit


@pytest.mark.parametrize(
    ("numbers", "times"),
    [
        ({"model": "first_order", "time_constant": 10}, [10]),
        ({"model": "second_order", "time_constants": [5, 3]}, [5, 3]),
        ({"model": "second_order", "time_constant": 10, "damping": 0.3}, [10]),
        ({"model": "second_order", "time_constant": 10, "damping": 2}, [40]),
        ({"model": "lead_lag", "lead": 1, "lag": 4}, [4]),
        ({"model": "dead_time", "dead_time": 2}, []),
    ],
)
def test_the_lags_of_a_plant_are_its_time_constants_and_two_that_do_not_swing_have_their_sum(numbers, times):
    assert [*lag_times(Plant.model_validate({"input": "1", **numbers}))] == times


@pytest.mark.parametrize(("steps", "passed"), [(0, True), (100, True), (101, False)])
def test_an_alarm_that_is_over_may_have_stood_for_a_tenth_of_the_run(steps, passed):
    meter = Facts(past_alarms=1, in_alarm=0, alarm_steps=steps, alarm_since=0, status=0, in_control=0)
    plc = Facts(outer_alarms=("high-high",), alarm_bits={"high-high": 1})
    found = judge_alarms(Facts(meters=[meter], plc=plc, last=1000, seconds=lambda k: k / 10), 0)

    assert TOLERATED_SHARE == 0.1
    assert found.verdict == ("proven" if passed else "failed")
    assert passed or found.text == "high-high stands for 10.1 s, 10 % of the run"


@pytest.mark.parametrize(("other", "excused"), [(20.0, True), (21.9, True), (18.1, True), (22.1, False), (17.9, False)])
def test_a_loop_swings_with_another_that_switches_when_their_periods_are_the_same(monkeypatch, other, excused):
    swings = [Swings(20.0, 3.0, 0), Swings(other, 3.0, 0)]
    monkeypatch.setattr(signals, "_find_swings", lambda _, i: swings[i])
    monkeypatch.setattr(signals, "pulse_ripple", lambda *_: 0.0)
    plc = Facts(
        loops=["A", "B"],
        configs=[Facts(pv_slot=0), Facts(pv_slot=1)],
        is_on_off=lambda i: i == 1,
        pulse_cycle=lambda _: 0.0,
        tuning_flags=(),
        flag_bits={},
        modes={},
        profile_step=lambda _: 0,
    )
    meter = Facts(last_third_status=0, last_third_aux=0, last_third=0, all_status=0, all_aux=0)
    influence = Facts(moved_by_output=lambda _: {0}, pulse_cycle=lambda _: 0.0)
    e = Facts(meters=[meter, meter], plc=plc, seconds=float, influence=influence)

    assert signals._excuse_swings(e, 0, swings[0]) == ("B drives it, whose output is on or off" if excused else "")


def test_a_fault_of_one_loop_that_is_expected_excuses_its_cascade_and_one_of_the_plc_all():
    expect = [{"loop": "B", "flag": "odd", "is": True}, {"flag": "V1", "is": 4}]
    scenario = Scenario.model_validate(
        {"pidcfg": 1, "scenario": "S", "config": "a.yaml", "duration": 10, "expect": expect}
    )
    plc = Facts(
        loops=["A", "B", "C"],
        control_bits=2,
        error_loops={},
        error_words={"V1": 4},
        error_flags=("odd",),
        flag_bits={"odd": 16},
        masters=[-1, -1, 1],
    )
    e = Evidence(scenario, plc, None, None, [Facts(all_status=0), Facts(all_status=16), Facts(all_status=0)], 1, 1)

    assert sorted(expected_errors(e)) == [
        (-1, "V1 is expected"),
        (1, "odd of B is expected"),
        (2, "odd of B is expected"),
    ]


@pytest.mark.parametrize(("turns", "k", "found"), [(8, 80, (20.0, 2.0)), (7, 80, None), (8, 81, None)])
def test_an_oscillation_has_three_whole_periods_and_goes_on(turns, k, found):
    meter = Facts(
        calm_turns=turns,
        max_growing_swings=0,
        calm_longest_period=10,
        calm_shortest_period=10,
        last_swing=4.0,
        calm_first_swing=4.0,
        widest_swing=4.0,
        last_turn=60,
        calm_first_turn=0,
        calm_swing_sum=24.0,
    )
    assert calm_oscillation(meter, k) == found


@pytest.mark.parametrize(("half", "judged"), [(9.9, False), (10.0, True), (10.1, True)])
def test_an_error_that_lasts_is_judged_once_its_plant_had_time_to_move(half, judged):
    look = Facts(start=0, end=10_000, half_length=half, is_final=True)
    plc = Facts(configs=[Facts(period=1)])
    pace = Facts(seconds=10.0 / saturation.SHORT_WINDOW_SHARE)
    e = Facts(seconds=float, mean_errors=lambda _: (3.0, -2.5), step=1, plc=plc, paces=[pace], unit=lambda _: " bar")

    found = saturation._judge_lasting_error(e, 0, look, "with an error of")
    assert found.verdict == ("failed" if judged else "not-proven")
    assert found.text.startswith("ends with an error of 2.5 bar, which was 3 from 0 s on")


# --- What is listed of a run, and what is asked of it besides ---------------------------------------------------------

BITS = {"one": 1, "two": 2}


def journal():
    """Of a run with one loop, whose two alarms and two flags are bits 0 and 1 of what is noted."""
    plc = Facts(
        initial_modes=["auto"],
        modes={},
        alarm_bits=BITS,
        flag_bits=BITS,
        aux_bits={},
        tuning_result=lambda _: None,
    )
    return Journal(plc, 0.1)


PRESENT = [(1.0, 1), (2.0, 3), (3.0, 2), (4.0, 2), (5.0, 3), (6.0, 0), (7.0, 2)]
"""Times, and the bits that are on from then."""


def test_a_condition_lasts_from_when_its_flag_comes_on_to_when_it_goes_off():
    found = journal()
    for time, present in PRESENT:
        found._note_flags(time, 0, BITS, present)
    found.close()
    assert [(period.name, period.at, period.until) for period in found.loops[0].conditions] == [
        ("one", 1.0, 3.0),
        ("two", 2.0, 6.0),
        ("one", 5.0, 6.0),
        ("two", 7.0, None),
    ]


def test_an_alarm_lasts_from_when_its_bit_comes_on_to_when_it_goes_off():
    found, before = journal(), 0
    for time, present in PRESENT:
        found._note_alarms(time, 0, present, before ^ present)
        before = present
    found.close()
    assert [(alarm.alarm, alarm.at, alarm.cleared) for alarm in found.loops[0].alarms] == [
        ("one", 1.0, 3.0),
        ("two", 2.0, 6.0),
        ("one", 5.0, 6.0),
        ("two", 7.0, None),
    ]


def test_signals_that_follow_one_follow_through_others():
    plc = Facts(signal_links=[(1, 2), (2, 3), (3, 2), (3, 4), (5, 6), (6, 4)])
    assert {slot: _program_followers(plc, slot) for slot in (1, 3, 4, 5, 7)} == {
        1: {2, 3, 4},
        3: {2, 3, 4},
        4: set(),
        5: {4, 6},
        7: set(),
    }


@pytest.mark.parametrize(
    ("excuse", "proof", "found"),
    [
        ("", "", None),
        ("its output is on or off", "", ("not-judged", "its output is on or off")),
        ("an auto-tune runs", "PV 60 ± 30", ("not-judged", "an auto-tune runs")),
        ("", "PV 60 ± 30", ("proven", "an expectation holds that bounds it: PV 60 ± 30")),
    ],
)
def test_a_loop_is_exempt_then_bounded_by_an_expectation_or_has_to_prove_itself(monkeypatch, excuse, proof, found):
    monkeypatch.setattr(control, "_exemption", lambda *_: excuse)
    monkeypatch.setattr(control, "proving_expectation", lambda *_: proof)
    judgement = control._judge_exempt(Facts(), 0)
    assert (judgement and (judgement.verdict, judgement.text)) == found


WORKED = choice.LOADING_TIME + 1_000_000 * 7
"""µs of CPython that a run takes for which compiling for 7 s and loading pay."""


@pytest.mark.parametrize(
    ("work", "kept", "runs", "engine"),
    [
        # with kernels that the process has kept: from where copying pays; else where loading does, or compiling
        (choice.COPYING_TIME - 1, True, None, "python"),
        (choice.COPYING_TIME, True, None, "numba"),
        (choice.COPYING_TIME, True, 1, "python"),
        (choice.LOADING_TIME - 1, False, None, "python"),
        (choice.LOADING_TIME, False, None, "cached"),
        (choice.LOADING_TIME, True, 1, "cached"),
        (WORKED - 1, False, None, "cached"),
        (WORKED, False, None, "compiled"),
        (WORKED // 10, False, 10, "compiled"),
    ],
)
def test_auto_takes_the_engine_that_is_done_first(monkeypatch, work, kept, runs, engine):
    controller = Facts(COST=Cost(1, 7), scan=object())
    monkeypatch.setattr(choice, "inlined_kernels", lambda _: ())
    monkeypatch.setattr(choice, "KEPT_KERNELS", {controller.scan: None} if kept else {})
    for installed, cached in product((False, True), repeat=2):
        monkeypatch.setattr(choice, "is_installed", lambda found=installed: found)
        monkeypatch.setattr(choice, "_in_cache", lambda *_, found=cached: found)
        pays = {"python": False, "numba": True, "cached": installed and cached, "compiled": installed}[engine]
        assert choice.choose_engine("auto", work, controller, runs=runs) == ("numba" if pays else "python")
        assert choice.choose_engine("python", work, controller, runs=runs) == "python"


# --- The ladder of questions behind ``saturated`` and ``error-stands``: each at the limit at which its answer changes -

DUE = 1 - exp(-1 / 4)
"""Of an error: what it loses in a plant time when it goes in four of them."""
CFG = [Facts(period=1, out_slot=0, sp_slot=1, pv_slot=2), Facts(period=1, out_slot=3, sp_slot=4, pv_slot=5)]


@pytest.fixture(autouse=True)
def alone(monkeypatch):
    """No selector, and no other loop."""
    monkeypatch.setattr(saturation, "is_deselected", lambda e, _: e.away)
    monkeypatch.setattr(saturation, "_opponents", lambda e, _: e.against)


def evidence(early=3.0, late=3.0, *, least=0.1, pace=10.0, turn=10.0, integrates=False, **given):
    """A loop with an error, which may be 1, for 100 s; a base step is a second."""
    meter = Facts(
        control_since=given.pop("control_since", 0),
        sign_since=0,
        sensor_broken=0,
        last_third_aux=0,
        aux_status=0,
        in_control=1,
    )
    plc = Facts(
        configs=CFG,
        loops=["A", "B"],
        inner_deviation=lambda _: given.get("inner"),
        is_on_off=lambda _: given.get("switches", False),
        integrates=lambda *_: given.get("integral", True),
        dead_band=lambda *_: given.get("dead_band", 0.0),
        output_limits=lambda *_: (0.0, 100.0),
        windup_input=lambda *_: given.get("windup", False),
        profile_step=lambda _: given.get("profile", 0),
        in_run=True,
    )
    return Facts(
        plc=plc,
        scenario=Facts(initial=given.get("initial")),
        meters=[meter, Facts(in_control=1)],
        mean_errors=lambda _: (early, late),
        min_difference=lambda _: least,
        span=lambda _: 100.0,
        seconds=float,
        set_point_moves=lambda _: given.get("moves", 0.0),
        paces=[Pace(0.0, pace, turn, 0.0, integrates)] * 2,
        step=1,
        slaves=lambda i: given.get("slaves", []) if i == 0 else [],
        bands=[1.0, 1.0],
        unit=lambda _: " degC",
        signal_values=given.get("signal_values", [50.0, 0.0, 0.0, 50.0, 0.0, 0.0]),
        away=given.get("away", False),
        against=given.get("against", ()),
    )


def look(start=80, end=99, stage=0):
    """Twenty base steps, ten in either half."""
    return Look(start, (start + end + 1) // 2, end, stage, is_final=True, next_event_time=100.0)


def of(judgement):
    return judgement.verdict


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({}, "failed"),
        ({"early": 1.0, "late": 1.0}, "proven"),
        ({"early": 1.0, "late": 1.001}, "failed"),
        ({"early": -1.0, "late": -1.001}, "failed"),
        ({"early": 3.0, "late": 3.0 - 3.0 * DUE - 0.001}, "proven"),
        ({"early": 3.0, "late": 3.0 - 3.0 * DUE + 0.001}, "failed"),
        ({"integrates": True, "early": 30.0, "late": 29.5, "least": 0.5}, "proven"),
        ({"integrates": True, "early": 30.0, "late": 29.501, "least": 0.5}, "failed"),
        ({"moves": 0.1}, "not-judged"),
        ({"moves": 0.099}, "failed"),
        ({"profile": 1}, "not-judged"),
        ({"away": True}, "not-judged"),
        ({"control_since": 79}, "failed"),
        ({"control_since": 80}, "not-proven"),
        ({"control_since": 59, "late": 2.8}, "failed"),
        ({"control_since": 60, "late": 2.8}, "not-proven"),
        ({"least": 3.0 * DUE}, "failed"),
        ({"least": 3.0 * DUE / 3 + 0.001, "control_since": 60}, "not-proven"),
        ({"least": 3.0 * DUE / 3 - 0.001, "control_since": 60}, "failed"),
    ],
)
def test_an_error_inside_the_limits_lasts(given, found):
    """The allowed one is 1; it should lose e^(−1/4) of itself between the halves of its window."""
    assert of(saturation._judge_offset(evidence(**given), 0, look())) == found


@pytest.mark.parametrize(("stage", "found"), [(80, "failed"), (81, "not-proven")])
def test_an_event_within_the_window_leaves_the_error_open(stage, found):
    assert of(saturation._judge_offset(evidence(pace=5.0), 0, look(stage=stage))) == found


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({"early": 1.0, "late": 1.0}, "proven"),
        ({"early": 1.001, "late": 1.001}, "failed"),
        ({"early": -3.0, "late": -3.0}, "failed"),
        ({"control_since": 89}, "failed"),
        ({"control_since": 90}, "not-proven"),
        ({"early": 2.9, "turn": 4.5, "control_since": 90}, "failed"),
        ({"early": 2.9, "turn": 4.5, "control_since": 91}, "not-proven"),
        ({"early": 3.1, "control_since": 69}, "failed"),
        ({"early": 3.1, "control_since": 70}, "proven"),
        ({"early": 3.0 / (1 - DUE) + 0.01, "control_since": 0}, "proven"),
        ({"early": 3.0 / (1 - DUE) - 0.01, "control_since": 0}, "failed"),
        ({"integrates": True, "early": 30.1, "late": 30.0}, "proven"),
        ({"integrates": True, "early": 30.0, "late": 30.0, "least": 34.0, "control_since": 89}, "failed"),
        ({"integrates": True, "early": 30.0, "late": 30.0, "least": 33.0, "control_since": 89}, "not-proven"),
        ({"integrates": True, "early": 30.0, "late": 30.0, "least": 33.0, "control_since": 79}, "failed"),
        ({"away": True}, "not-judged"),
        ({"windup": True}, "not-judged"),
    ],
)
def test_an_error_at_a_limit_lasts(given, found):
    """It stands for a plant time, or grows for two; or it gets smaller too slowly for three of them."""
    assert of(saturation._judge_limit(evidence(**given), 0, look(), "its upper output limit")) == found


@pytest.mark.parametrize(
    ("given", "band"),
    [
        ({}, 2.0),
        ({"integral": False, "dead_band": 9.0}, 2.0),
        ({"switches": True}, 5.0),
        ({"inner": 0.5}, 0.5),
        ({"inner": 3.0}, 2.0),
        ({"inner": 0.05}, 0.1),
        ({"tolerance": Bound(4)}, 4.0),
        ({"tolerance": Bound(4, "%"), "inner": 0.5}, 8.0),
    ],
)
def test_a_pv_may_rest_within_a_fiftieth_of_its_span_its_inner_deviation_alarm_or_what_the_scenario_says(given, band):
    tolerance = given.pop("tolerance", None)
    e = evidence(**given)
    e.scenario = Facts(tolerance={} if tolerance is None else {"A": tolerance})
    e.span = lambda _: 200.0 if tolerance is not None and tolerance.unit else 100.0
    assert band_of(e, 0) == band


@pytest.mark.parametrize(
    ("start", "end", "pace", "found"),
    [(80, 90, 1.0, "failed"), (80, 89, 1.0, "not-proven"), (80, 90, 274.9, "failed"), (80, 90, 275.1, "not-proven")],
)
def test_a_window_of_ten_samples_and_a_fiftieth_of_the_plant_time_tells(start, end, pace, found):
    assert look(start, end).half_length == (end + 1 - start) / 2
    assert of(saturation._judge_lasting_error(evidence(pace=pace), 0, look(start, end), "with")) == found


@pytest.mark.parametrize(
    ("sig", "limit"),
    [
        ([50.0, 0, 0, 50.0, 50.0, 0], ""),
        ([99.95, 0, 0, 50.0, 99.95, 0], "its upper output limit"),
        ([50.0, 0, 0, 0.05, 50.0, 0], "the lower output limit of B"),
        ([50.0, 0, 0, 50.0, 50.09, 0], ""),
        ([50.0, 0, 0, 50.0, 50.11, 0], "a set-point limit of B"),
    ],
)
def test_a_limit_is_that_of_the_loop_or_of_a_slave_in_control(sig, limit):
    e = evidence(slaves=[1], signal_values=sig)
    assert saturation._limit_name(e, 0) == limit
    e.meters[1].in_control = 0
    assert saturation._limit_name(e, 0) == (limit if "its" in limit else "")


@pytest.mark.parametrize(("out", "works"), [(5.0, False), (5.1, True)])
def test_a_loop_works_with_more_than_a_twentieth_of_its_output(out, works):
    assert saturation._is_working(evidence(signal_values=[out, 0, 0, 0, 0, 0]), 0) == works


# --- A PV that swings, and one that is at rest: each limit of what counts as an oscillation and as a steady state -----


def watched(pvs, *, least=1.0, late=0, **fields):
    """A meter that has seen these PVs, one a base step."""
    m = Meter(0, 1, 2, in_control=1, min_swing=least, last_third=late, **fields)
    for k, pv in enumerate(pvs):
        watch_swings(k, m, pv)
    return m


def zigzag(*extremes):
    """PVs that go from one extreme to the next by 1 a base step."""
    pvs = [float(extremes[0])]
    for end in extremes[1:]:
        pvs += [pvs[-1] + (1.0 if end > pvs[-1] else -1.0) * (n + 1) for n in range(int(abs(end - pvs[-1])))]
    return pvs


def test_turning_points_are_where_the_pv_has_come_back_by_more_than_the_least_move():
    pvs = zigzag(0, 5, 0, 5, 0, 5, 0, 5, 0, 5, 0)
    m = watched(pvs)
    assert (m.turns, m.last_turn, m.last_swing) == (9, 45, 5.0)
    assert (m.shortest_period, m.longest_period) == (10, 10)
    assert oscillation(m, 50) == (10.0, 2.5)
    assert calm_oscillation(m, 50) == (10.0, 2.5)
    assert watched(pvs, least=4.0).turns == 9
    assert watched(pvs, least=5.0).turns == 0


def test_the_first_swing_of_the_last_third_and_of_the_calm_is_left_out():
    """Each began before it, so that it may have been cut."""
    m = watched(zigzag(0, 9, 0, 5, 1, 5, 1, 5, 1, 5, 1, 5, 1, 5), late=20)
    assert (m.first_turn, m.first_swing, m.swing_sum) == (23, 4.0, 36.0)
    assert (m.calm_first_turn, m.calm_first_swing) == (18, 5.0)


def test_an_event_and_a_loop_out_of_control_begin_anew():
    m = watched(zigzag(0, 5, 0, 5, 0, 5, 0))
    assert (m.turns, m.calm_turns) == (5, 5)
    begin_calm(m)
    assert (m.turns, m.calm_turns) == (5, 0)
    m.in_control = 0
    watch_swings(99, m, 7.0)
    assert (m.turns, m.calm_turns, m.extreme, m.extreme_at) == (0, 0, 7.0, 99)


SWINGING = {
    "turns": 8,
    "first_swing": 5.0,
    "last_swing": 4.0,
    "shortest_period": 10,
    "longest_period": 20,
    "first_turn": 10,
    "last_turn": 55,
    "swing_sum": 27.0,
}
CALM = {
    "calm_turns": 8,
    "calm_first_swing": 5.0,
    "last_swing": 4.0,
    "calm_shortest_period": 10,
    "calm_longest_period": 20,
    "calm_first_turn": 10,
    "last_turn": 55,
    "calm_swing_sum": 27.0,
    "widest_swing": 99.0,
}


@pytest.mark.parametrize(
    ("changed", "last", "found"),
    [
        ({}, 70, True),
        ({}, 71, False),
        ({"turns": 7}, 70, False),
        ({"last_swing": 3.999}, 70, False),
        ({"longest_period": 21}, 70, False),
    ],
)
def test_three_even_periods_of_swings_that_hardly_get_smaller_are_an_oscillation(changed, last, found):
    """Six half periods of 45 base steps: 15 of a period, and swings of 4.5."""
    assert oscillation(Meter(0, 1, 2, **{**SWINGING, **changed}), last) == ((15.0, 2.25) if found else None)


@pytest.mark.parametrize(
    ("changed", "k", "found"),
    [
        ({}, 70, True),
        ({}, 71, False),
        ({"calm_turns": 7, "max_growing_swings": 2}, 70, False),
        ({"last_swing": 3.999}, 70, False),
        ({"calm_longest_period": 21}, 70, False),
        ({"max_growing_swings": 3}, 70, False),
        ({"max_growing_swings": 3, "widest_swing": 5.0}, 70, True),
        ({"max_growing_swings": 2}, 70, True),
    ],
)
def test_an_oscillation_since_the_last_event_is_held_against_its_widest_swing_where_it_grew(changed, k, found):
    assert calm_oscillation(Meter(0, 1, 2, **{**CALM, **changed}), k) == ((15.0, 2.25) if found else None)


@pytest.mark.parametrize(("turns", "grown", "found"), [(3, 3, True), (2, 3, False), (3, 2, False)])
def test_one_that_grows_three_times_need_not_have_three_periods(turns, grown, found):
    m = Meter(
        0,
        1,
        2,
        **{**CALM, "calm_turns": turns, "max_growing_swings": grown, "widest_swing": 4.0, "calm_first_turn": 50},
    )
    assert (calm_oscillation(m, 55) is not None) == found


@pytest.mark.parametrize(
    ("low", "high", "mean", "steady"),
    [
        (50.0, 50.00009, 50.0, True),
        (49.75, 50.25, 50.0, True),
        (49.75, 50.26, 50.0, False),
        (49.74, 50.25, 50.0, False),
        (49.75, 50.25, 49.99, False),
    ],
)
def test_a_pv_is_at_rest_within_two_counts_of_its_mean(low, high, mean, steady):
    """Of 800 counts in 100; or when it moves by less than a millionth of the range."""
    assert is_steady(Span(0, 100.0, 800, low, high, 8 * mean), 8) == steady
    assert is_steady(Span(0, 100.0, 10**9, 50.0, 50.0001, 0.0), 8) is False


def test_a_window_looks_at_what_the_sensors_show_whichever_way_their_ranges_go():
    configs = [Facts(in_slot=3), Facts(in_slot=5), Facts(in_slot=7)]
    plc = Facts(configs=configs, scales=[(0.0, 100.0, 800), (100.0, 50.0, 4000)])
    assert spans_of(plc) == [Span(3, 100.0, 800), Span(5, 50.0, 4000)], "the third is no loop"


@pytest.mark.parametrize(
    ("now", "same"),
    [((10.0, 20.0), True), ((10.2, 20.2), True), ((9.79, 20.0), False), ((10.0, 20.21), False), ((10.21, 20.0), False)],
)
def test_a_pv_that_swings_comes_back_to_its_extremes_of_four_windows_before(now, same):
    """Within a fiftieth of the swing, and two counts."""
    before = [(12.0, 18.0), (10.0, 15.0), (12.0, 20.0), (13.0, 13.0)]
    past = [(0.0, 99.0), *before, (13.0, 13.0), now, (13.0, 13.0), (13.0, 13.0)]
    assert swings_alike(past, (0.0, 100.0, 1000)) == same
    assert swings_alike(before + [now] * 3, (0.0, 100.0, 1000)) is False, "there are only seven windows"


@pytest.mark.parametrize(
    ("periods", "longest", "step", "window"),
    [
        ([1.0], 7.0, 0.5, 14),
        ([1.0], 7.5, 0.5, 16),
        ([1.0], 0.0, 0.5, 8),
        ([2.0, 3.0], 5.0, 0.5, 24),
        ([2.0, 3.0], 13.0, 0.5, 36),
        ([0.7, 1.1], 0.77, 0.1, 77),
        ([0.7, 1.1, 1.3], 1.0, 0.1, 52),
        ([], 3.0, 0.5, 6),
    ],
)
def test_a_window_is_the_longest_time_constant_in_whole_samples(periods, longest, step, window):
    plc = Facts(configs=[Facts(period=round(period * TICKS)) for period in periods], longest_time=0.0)
    machine = Facts(plc=plc, net=Facts(longest_time=lambda: longest), step=round(step * TICKS))
    assert window_steps(machine) == window


@pytest.mark.parametrize(
    ("status", "goal", "told"), [(1, "auto", True), (1, "manual", False), (2, "auto", False), (2, "cascade", False)]
)
def test_a_loop_that_rests_in_manual_though_it_is_meant_for_more_is_told(status, goal, told):
    plc = Facts(
        loops=["A"],
        states=[Facts(status=status)],
        initial_modes=[goal],
        modes={"manual": 1},
        mode={1: "manual", 2: "auto"}.get,
    )
    found = [(p.path, p.message, p.severity, p.loop) for p in refused_modes(Facts(plc=plc))]
    assert found == ([(("initial",), f"A rests in manual, though {goal} is meant", "warning", "A")] if told else [])
