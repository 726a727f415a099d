"""Autotune of the virtual EZLogix on first-order plants with dead time, against the formulas.

The regression line covers a tenth of the answer, between about 10 % and 20 % of it or earlier, where a first-order
answer has on average 1 - 0.1 of its steepest slope; the gain may thus be up to 10 % high. A window that is a whole
number of points moves it the other way by at most one point in that window. Its line meets the baseline within half a
sample of the dead time, plus what half a count of rounding makes of it.
"""

from __future__ import annotations

import pytest

from ezlogix_rig import SCALED, STATUS, Rig, change, play, plc
from pidcfg.sim.controllers.ezlogix import equation as bits
from pidcfg.sim.controllers.ezlogix.equation import (
    MIN_SETTLED_POINTS,
    Config,
    State,
    are_results_valid,
    compute_results,
    judge_answer,
    tell_moving,
)
from pidcfg.sim.controllers.ezlogix.scan import REASONS, TUNE_STATUS
from pidcfg.sim.controllers.kernels import split_notices
from rig_plants import FirstOrder, Moving


def until_tuned(rig, s, most=20000):
    for _ in range(most):
        rig.step()
        if s.pending & bits.TUNE == 0:
            return
    raise AssertionError("the autotune did not come to an end")


def loop(k, time_constant, dead_time, ts, /, *, noise=0.0, direct=0, out=1500.0, mode="manual", **fields):
    """A loop at rest at 1500 counts of CV and 1000 of PV, whose autotune has been asked for."""
    rig = Rig(base=ts, noise=noise)
    g = -k if direct else k
    plant = FirstOrder(g, time_constant, dead_time, initial=1000.0, offset=1000.0 - g * out)
    _, s = rig.add(plant, mode, out=out, direct=direct, **{"sp": 1000.0, **fields})
    rig.step(20)
    rig.tune()
    return rig, s


PLANTS = [
    (1.0, 20.0, 4.0, 0.5),
    (0.5, 20.0, 4.0, 0.5),
    (0.15, 20.0, 4.0, 0.5),
    (2.0, 60.0, 5.0, 1.0),
    (2.0, 60.0, 5.0, 0.05),
    (5.0, 100.0, 2.0, 0.1),
    (1.0, 10.0, 10.0, 0.5),
    (1.0, 240.0, 16.0, 2.0),
]


@pytest.mark.parametrize("direct", [0, 1])
@pytest.mark.parametrize(("gain", "time_constant", "dead_time", "ts"), PLANTS)
def test_the_gains_are_those_of_ziegler_and_nichols(gain, time_constant, dead_time, ts, direct):
    rig, s = loop(gain, time_constant, dead_time, ts, direct=direct)
    until_tuned(rig, s)
    kp = 1.2 * time_constant / (gain * dead_time)

    assert (s.tune_status, rig.log) == (3, [])
    assert 0.95 * kp <= s.gain <= 1.12 * kp
    assert s.reset == pytest.approx(2.0 * dead_time, abs=0.5 * ts + 0.05 * dead_time + 0.05)
    assert s.rate == pytest.approx(0.5 * dead_time, abs=0.25 * ts + 0.05 * dead_time + 0.05)
    assert (s.tune_gain, s.tune_reset, s.tune_rate) == (s.gain, s.reset, s.rate)


def test_pi_has_no_derivative():
    rig, s = loop(1.0, 20.0, 4.0, 0.5, tune_pi=1, rate=3.0)
    until_tuned(rig, s)

    assert s.rate == 0.0
    assert s.gain == pytest.approx(0.9 * 20.0 / 4.0, rel=0.1)
    assert s.reset == pytest.approx(3.33 * 4.0, rel=0.05)


def test_results_have_the_digits_of_their_registers_and_act():
    rig, s = loop(1.0, 20.0, 4.0, 0.5)
    until_tuned(rig, s)

    for value, digits in ((s.gain, 100), (s.reset, 10), (s.rate, 10)):
        assert value == round(value * digits) / digits > 0.0
    assert (s.kp, s.ki, s.kd) == (s.gain, s.gain * 0.5 / s.reset, s.gain * s.rate / 0.5)
    assert s.period == 500_000, "the sample rate stays"


def test_the_step_is_a_tenth_of_the_range_and_comes_after_a_look_at_the_noise():
    rig, s = loop(1.0, 20.0, 4.0, 0.5)
    rows = []
    while s.pending & bits.TUNE:
        rows += rig.trace(1, "out", "tune_status")
    outs = [out for out, _ in rows]

    assert outs[:15] == [1500.0] * 15
    assert outs[15:-1] == [1910.0] * (len(outs) - 16)
    assert outs[-1] == 1500.0
    assert [status for _, status in rows] == [1] * (len(rows) - 2) + [2, 3]
    assert rig.signal_values[STATUS] == 3.0


def test_noise_is_borne():
    gains = []
    for seed in range(8):
        rig, s = loop(1.0, 20.0, 4.0, 0.5, noise=3.0)
        rig.random.seed(seed)
        until_tuned(rig, s)
        gains.append(s.gain / 6.0)

    assert all(0.7 <= gain <= 1.3 for gain in gains)
    assert sum(gains) / len(gains) == pytest.approx(1.03, abs=0.10)


def test_a_root_loop_is_tuned_on_the_root_of_its_pv():
    """At 1024 counts a root moves by 1/64 of the PV; in counts of full scale that is as much again."""
    rig = Rig(base=0.5)
    plant = FirstOrder(1.0, 20.0, 4.0, initial=1024.0, offset=1024.0 - 1500.0)
    _, s = rig.add(plant, out=1500.0, sp=32.0, square_root=1, scale=64.0)
    rig.step(20)
    rig.tune()
    until_tuned(rig, s)

    assert s.gain == pytest.approx(1.2 * 20.0 / 4.0, rel=0.15)


# --- the process before the start ------------------------------------------------------------------------------------

MOVING = "the PV was moving when the autotune began: do not trust its gains (D623)"


@pytest.mark.parametrize("moves", [0.0, 0.3, -0.3, 2.0, 4.0, -2.0])
@pytest.mark.parametrize("noise", [0.0, 2.0])
def test_a_start_on_a_moving_pv_is_told(moves, noise):
    """The answer rises by 10 counts a sample: 0.3 before it are nothing, 2 shorten the dead time and raise the gain."""
    rig, s = loop(1.0, 20.0, 4.0, 0.5, noise=noise)
    rig.plants[0] = Moving(rig.plants[0], moves)
    until_tuned(rig, s)
    assert (MOVING in rig.log) is (abs(moves) >= 2.0)
    if not noise and moves >= 0.0:
        assert s.tune_status == 3
        assert (s.gain > 1.2 * 6.2) is (moves >= 2.0)


# --- in any mode -----------------------------------------------------------------------------------------------------


def test_a_loop_in_auto_is_tuned_and_goes_on_from_its_old_cv():
    rig, s = loop(1.0, 20.0, 4.0, 0.5, mode="auto", gain=0.5, reset=40.0, offset=100.0)
    until_tuned(rig, s)

    assert s.status & bits.MODES == bits.AUTO
    assert s.tune_status == 3
    e = 1000.0 - s.pv
    assert s.integral == pytest.approx(1500.0 - 100.0 + s.ki * e)
    assert s.out == pytest.approx(max(1500.0 + s.gain * e + s.ki * e - 30.0, 0.0), abs=30.0)
    rig.run(300)
    assert s.pv == pytest.approx(1000.0, abs=2.0)


# --- how it ends -----------------------------------------------------------------------------------------------------


def test_a_cancel_without_an_autotune_does_nothing():
    rig, s = loop(1.0, 20.0, 4.0, 0.5)
    rig.tune(on=False)
    rig.step(5)

    assert (s.tune_status, s.pending, s.out, rig.log) == (0, 0, 1500.0, [])


def test_in_auto_a_refused_step_does_not_disturb_the_loop():
    rig, s = loop(1.0, 20.0, 4.0, 0.5, out=3900.0, mode="auto", gain=0.5, reset=40.0, offset=100.0)
    before = s.integral
    rig.plants[0].value = s.pv = 990.0
    rig.step()

    assert s.tune_status == 5
    assert s.integral == pytest.approx(before, abs=1.0)
    assert s.pending & bits.NO_PAST == 0


@pytest.mark.parametrize("direct", [0, 1])
def test_a_small_answer_counts_once_it_has_settled(direct):
    """Eight counts: too few to compare slopes, enough to be told from nothing."""
    rig, s = loop(0.02, 20.0, 20.0, 0.5, direct=direct)
    until_tuned(rig, s)

    assert s.tune_status == 3
    assert rig.tick < 200e6
    assert 0.5 < s.gain / (1.2 * 20.0 / (0.02 * 20.0)) < 1.6


@pytest.mark.parametrize(
    ("results", "only_pi", "expected"),
    [
        ((1.0, 1.0, 1.0), 0, True),
        ((9999.0, 60000.0, 6000.0), 0, True),
        ((1.0, 1.0, 0.0), 1, True),
        ((0.0, 1.0, 1.0), 0, False),
        ((10000.0, 1.0, 1.0), 0, False),
        ((1.0, 0.0, 1.0), 0, False),
        ((1.0, 60001.0, 1.0), 0, False),
        ((1.0, 1.0, 0.0), 0, False),
        ((1.0, 1.0, 6001.0), 0, False),
    ],
)
def test_the_ranges_of_results_are_those_of_the_manual(results, only_pi, expected):
    assert are_results_valid(*results, only_pi) is expected


def test_a_curve_without_a_slope_gives_no_gains():
    c, s = Config(), State(tune_points=40, tune_change=8.0, gain=1.5, out=1910.0, tune_out=1500.0, pending=bits.CV_HELD)
    compute_results(c, s, [0.0] * 512)

    assert (s.tune_status, s.gain, s.out, s.pending) == (7, 1.5, 1500.0, 0)


# --- from outside ----------------------------------------------------------------------------------------------------


def test_commands_and_report():
    machine = plc({**SCALED, "tuning": {"proportional_gain": 2}})
    play(machine, 1, [50.0])
    assert machine.tuning_result(0) is None
    machine.autotune(0, "start")
    play(machine, 2, [50.0], start=1)
    assert machine.tuning_result(0) == {"done": False, "error": False, "status": "1: collecting data", "results": {}}
    machine.autotune(0, "start")
    assert play(machine, 1, [50.0], start=3) == [(3, "L1", None, "autotune is running already")]
    assert change(machine, "output", 10) == "the autotune holds the CV"
    machine.autotune(0, "cancel")
    play(machine, 1, [50.0], start=4)
    assert machine.tuning_result(0) == {"done": False, "error": False, "status": "4: cancelled", "results": {}}
    assert change(machine, "output", 45) is None
    for k in (5, 6):
        machine.autotune(0, "start")
        play(machine, 1, [50.0], start=k)

    assert machine.tuning_result(0) == {
        "done": False,
        "error": True,
        "status": "5: the CV could not be incremented",
        "results": {},
    }


def test_results_have_the_names_of_the_configuration_and_stand_in_the_registers():
    machine = plc({"sample_rate": 0.5, "tuning": {"proportional_gain": 1}})
    machine.states[0].out = 1500.0
    plant = FirstOrder(1.0, 20.0, 4.0, initial=1000.0, offset=-500.0)
    machine.autotune(0, "start")
    for k in range(200):
        if k:
            plant.step(machine.states[0].out, 0.5)
        play(machine, 1, [plant.value], base=500_000, start=k)
    tuned = machine.tuning_result(0)

    assert (tuned["done"], tuned["error"], tuned["status"]) == (True, False, "3: done")
    assert list(tuned["results"]) == ["proportional_gain", "integral_time", "derivative_time"]
    found = tuple(tuned["results"].values())
    assert found == (machine.states[0].gain, machine.states[0].reset, machine.states[0].rate)
    change(machine, "deadband", 3)
    assert found == (machine.states[0].gain, machine.states[0].reset, machine.states[0].rate), (
        "the registers hold the results"
    )
    change(machine, "tuning.proportional_gain", 1)
    assert machine.tuning_result(0)["results"]["proportional_gain"] == found[0]


def test_the_timeout_register_is_the_countdown():
    machine = plc({"autotune": {"timeout": 600}})
    machine.autotune(0, "start")
    play(machine, 5, [0.0])
    assert machine.states[0].tune_countdown == 600_000_000 - 500_000
    change(machine, "autotune.timeout", 0)
    said = play(machine, 1, [0.0], start=5)

    assert said == [(5, "L1", None, "autotune: no dead time was found (status 8)")]


@pytest.mark.parametrize("given", [{"sample_rate": 0.1}, {"process_when_stopped": False}])
def test_what_is_not_calculated_waits_with_its_autotune(given):
    stopped = "process_when_stopped" in given
    machine = plc({"sample_rate": 0.1}, **(given if stopped else {}))
    play(machine, 1, [0.0])
    if stopped:
        machine.program(machine.signal_values)
    else:
        change(machine, "sample_rate", 0)
    play(machine, 1, [0.0], start=1)
    machine.autotune(0, "start")
    said = play(machine, 3, [0.0], start=2)
    assert [text.split(":")[0] for *_, text in said] == ["waits"]
    assert machine.states[0].tune_status == 0
    if stopped:
        machine.run(500_000)
    else:
        change(machine, "sample_rate", 0.1)
    play(machine, 1, [0.0], start=5)

    assert machine.states[0].tune_status == 1


def test_every_state_of_the_manual_has_words():
    assert sorted(TUNE_STATUS) == list(range(11))


@pytest.mark.parametrize(("points", "complete"), [(MIN_SETTLED_POINTS - 1, 0), (MIN_SETTLED_POINTS, 1)])
def test_an_answer_that_stands_has_settled_after_so_many_points(points, complete):
    """Ten counts are an answer, and far from a tenth of the span."""
    assert judge_answer(Config(), State(tune_points=points), [10.0] * points) == complete


@pytest.mark.parametrize(("drift", "said"), [(0.0, []), (5.0, [MOVING])])
def test_a_pv_that_moves_is_told_and_nobody_asked_for_a_mode(drift, said):
    s = State(tune_drift=drift)
    tell_moving(s, 1.0)

    assert [(requested, REASONS[reason]) for requested, reason in split_notices(s.notice)] == [
        (0, text) for text in said
    ]


@pytest.mark.parametrize(("points", "complete"), [(MIN_SETTLED_POINTS - 1, 0), (MIN_SETTLED_POINTS, 1)])
def test_an_answer_that_flattens_is_complete_after_so_many_points(points, complete):
    """20 counts a point, then 5: it rises a quarter as fast as it did, and has not settled."""
    s = State(tune_points=points)
    curve = [20.0 * min(k, 12) + 5.0 * max(k - 12, 0) for k in range(points)]

    assert judge_answer(Config(), s, curve) == complete
    assert s.tune_change == pytest.approx((curve[-1] + curve[-1 - complete]) / 2 * (1.5 if complete else 1))
