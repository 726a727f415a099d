"""Standing expectations, each judgement by itself: what it makes of the facts at their limits."""

from __future__ import annotations

from types import SimpleNamespace as Facts

import pytest

from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.judgement import standing as saturation
from pidcfg.sim.judgement import standing as signals
from pidcfg.sim.judgement.evidence import SHARE, Evidence, Swings, limits_reached
from pidcfg.sim.judgement.meters import calm_oscillation
from pidcfg.sim.judgement.standing import LONG_SHARE, expected_errors, judge_alarms


@pytest.mark.parametrize(
    ("out", "limit"),
    [(999.5, "upper"), (999.4, ""), (500, ""), (0.6, ""), (0.5, "lower"), (1200, "upper"), (-5, "lower")],
)
def test_an_output_is_at_a_limit_within_half_of_what_is_no_difference(out, limit):
    plc = Facts(output_limits=lambda *_: (0.0, 1000.0), cfg=[Facts(sig_out=0)])

    assert SHARE == 0.001
    assert limits_reached(Facts(plc=plc, sig=[out]), 0) == limit


@pytest.mark.parametrize(("steps", "passed"), [(0, True), (100, True), (101, False)])
def test_an_alarm_that_is_over_may_have_stood_for_a_tenth_of_the_run(steps, passed):
    meter = Facts(alarms=1, alarm=0, alarm_steps=steps, alarm_since=0, status=0)
    plc = Facts(outer_alarms=("high-high",), alarm_bits={"high-high": 1})
    found = judge_alarms(Facts(meters=[meter], plc=plc, last=1000, seconds=lambda k: k / 10), 0)

    assert LONG_SHARE == 0.1
    assert found.passed == passed
    assert passed or found.text == "high-high stands for 10.1 s, 10 % of the run"


@pytest.mark.parametrize(("other", "excused"), [(20.0, True), (21.9, True), (18.1, True), (22.1, False), (17.9, False)])
def test_a_loop_swings_with_another_that_switches_when_their_periods_are_the_same(monkeypatch, other, excused):
    swings = [Swings(20.0, 3.0, 0), Swings(other, 3.0, 0)]
    monkeypatch.setattr(signals, "_swings", lambda _, i: swings[i])
    monkeypatch.setattr(signals, "pulse_ripple", lambda *_: 0.0)
    plc = Facts(
        loops=["A", "B"],
        cfg=[Facts(sig_pv=0), Facts(sig_pv=1)],
        only_switches=lambda i: i == 1,
        pulse_cycle=lambda _: 0.0,
        tuning_flags=(),
        flag_bits={},
        modes={},
        profile_step=lambda _: 0,
    )
    meter = Facts(late_status=0, late_aux=0, late=0, ever=0, ever_aux=0)
    influence = Facts(of_output=lambda _: {0})
    e = Facts(meters=[meter, meter], plc=plc, seconds=float, influence=influence)

    assert signals._excuse(e, 0, swings[0]) == ("B drives it, whose output is on or off" if excused else "")


def test_a_fault_of_one_loop_that_is_expected_excuses_its_cascade_and_one_of_the_plc_all():
    expect = [{"loop": "B", "flag": "odd", "is": True}, {"flag": "V1", "is": 4}]
    scenario = Scenario.model_validate(
        {"pidcfg": 1, "scenario": "S", "config": "a.yaml", "duration": 10, "expect": expect}
    )
    plc = Facts(
        loops=["A", "B", "C"],
        control_bits=2,
        word_owners={},
        flags={"V1": 4},
        error_flags=("odd",),
        flag_bits={"odd": 16},
        masters=[-1, -1, 1],
    )
    e = Evidence(scenario, plc, None, None, [Facts(ever=0), Facts(ever=16), Facts(ever=0)], 1, 1)

    assert sorted(expected_errors(e)) == [
        (-1, "V1 is expected"),
        (1, "odd of B is expected"),
        (2, "odd of B is expected"),
    ]


@pytest.mark.parametrize(("turns", "k", "found"), [(8, 80, (20.0, 2.0)), (7, 80, None), (8, 81, None)])
def test_an_oscillation_has_three_whole_periods_and_goes_on(turns, k, found):
    meter = Facts(
        calm_turns=turns,
        grown=0,
        calm_longest=10,
        calm_shortest=10,
        last_swing=4.0,
        calm_first_swing=4.0,
        widest=4.0,
        last_turn=60,
        calm_first_turn=0,
        calm_swings=24.0,
    )
    assert calm_oscillation(meter, k) == found


@pytest.mark.parametrize(("half", "judged"), [(9.9, False), (10.0, True), (10.1, True)])
def test_an_error_that_lasts_is_judged_once_its_plant_had_time_to_move(half, judged):
    look = Facts(start=0, end=10_000, half=half, final=True)
    plc = Facts(cfg=[Facts(period=1)])
    pace = Facts(seconds=10.0 / saturation.TOO_SHORT)
    e = Facts(seconds=float, errors=lambda _: (3.0, -2.5), step=1, plc=plc, paces=[pace])

    found = saturation._failed(e, 0, look, "with an error of")
    assert found.judged == judged
    assert found.passed != judged
    assert found.text.startswith("ends with an error of 2.5, which was 3 from 0 s on")
