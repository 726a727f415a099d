"""Autotune of the virtual DPIDE: the relay's cycle against describing functions and the true ultimate point."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from dpide_rig import Rig
from pidcfg.cli.formats.runs import autotune_text
from pidcfg.sim.controllers.click.scan import Click
from pidcfg.sim.controllers.dl06.plc import Dl06
from pidcfg.sim.controllers.dpide.equation import (
    PATIENCE_SAMPLES,
    REASONS,
    Config,
    State,
    balance_relay,
    is_usable,
    measure_cycle,
)
from pidcfg.sim.controllers.dpide.scan import Dpide
from pidcfg.sim.controllers.ezlogix.scan import Ezlogix
from pidcfg.sim.controllers.kernels import single
from rig_plants import FirstOrder, Fixed

OVEN = {"PID_MODE": 1, "SV": 80, "CYCLE": 1000, "MV_MAX": 4000, "Kc_Kp": 0, "PID_EQ": True}
"""The manual's example 3: a cold oven, and all gains 0."""


def plant(gain=0.1, time_constant=120.0, dead_time=12.0, initial=20.0):
    return FirstOrder(gain, time_constant, dead_time, initial=initial, offset=20.0)


def tuned(most=20_000, noise=0.0, process=None, **given):
    """A rig after the end of its autotune."""
    rig = Rig({**OVEN, **given}, plants=[process or plant()], base=given.get("CYCLE", 1000) / 1000, noise=noise)
    for _ in range(most):
        if rig.step().mode() != "autotune":
            return rig
    raise AssertionError("the autotune did not come to an end")


def ultimate(gain, time_constant, dead_time):
    """Gain and period at which a proportional loop just keeps swinging, by bisection of its phase."""
    low, high = 1e-6, 100.0
    for _ in range(200):
        w = (low + high) / 2
        low, high = (w, high) if w * dead_time + math.atan(w * time_constant) < math.pi else (low, w)
    return math.hypot(1.0, low * time_constant) / abs(gain), 2 * math.pi / low


PLANTS = [(0.1, 120.0, 12.0), (0.05, 600.0, 30.0), (0.1, 60.0, 20.0), (0.03, 300.0, 40.0)]


@pytest.mark.parametrize("numbers", PLANTS)
def test_the_gains_are_those_of_the_ultimate_cycle(numbers):
    """The period within a tenth; the gain up to a quarter lower, since the swing is no sine but a triangle at most."""
    rig = tuned(process=plant(*numbers))
    found = rig.plc.tuning_result(0)
    gain, period = ultimate(numbers[0], numbers[1], numbers[2] + 0.5)

    assert (found["done"], found["error"], found["status"], rig.log) == (True, False, "done", [])
    assert 0.75 <= found["results"]["Kc_Kp"] * 2.2 / gain <= 1.0
    assert found["results"]["Ti_Ki"] == pytest.approx(2.2 * period, rel=0.1)
    assert found["results"]["Td_Kd"] == pytest.approx(found["results"]["Ti_Ki"] / 2.2 / 6.3, rel=1e-5)
    assert found["results"]["Tf"] == pytest.approx(found["results"]["Td_Kd"] / 10, rel=1e-5)


@pytest.mark.parametrize(("band", "swing"), [(0.0, 5.0), (3.0, 4.0), (4.9, 2.5)])
def test_the_ultimate_cycle_of_a_relay_with_hysteresis(band, swing):
    """Ku = 4 d / (pi sqrt(a^2 - h^2)) with a = 5 and d = 30, never below half of a; 20 samples of 0.5 s are Pu."""
    c = Config(lowest_mv=0.0, highest_mv=100.0, dependent=1)
    s = State(
        period=500_000,
        tune_mv_high=80.0,
        tune_mv_low=20.0,
        tune_swing=20.0,
        tune_band=band,
        tune_count=47,
        tune_start=7,
        tune_sum=40 * 44.0,
        bias=4.0,
        mode=1,
        status=4,
    )
    measure_cycle(c, s)

    assert s.gain == pytest.approx(4 * 30 / (math.pi * swing) / 2.2, rel=1e-6)
    assert (s.reset, s.rate, s.filter_time) == pytest.approx((22.0, 10 / 6.3, 1 / 6.3), rel=1e-6)
    assert (s.integral, s.mode, s.wanted_mode, s.tune_done) == (40.0, 0, 2, 1)


def test_results_stand_in_the_operands_and_act():
    rig = tuned()
    s = rig.states[0]

    assert [*rig.plc.tuning_result(0)["results"].values()] == [s.gain, s.reset, s.rate, s.filter_time]
    assert (s.kp, s.mode, rig.mode()) == (s.gain, 0, "auto")
    assert s.ki == pytest.approx(s.gain / s.reset, rel=1e-6)
    assert s.kd == pytest.approx(s.gain * s.rate, rel=1e-6)
    assert rig.plc.periods == [1_000_000], "CYCLE stays"


def test_the_independent_form_gets_gains():
    times, gains = tuned().plc.tuning_result(0)["results"], tuned(PID_EQ=False).plc.tuning_result(0)["results"]

    assert gains["Kc_Kp"] == times["Kc_Kp"]
    assert gains["Ti_Ki"] == pytest.approx(times["Kc_Kp"] / times["Ti_Ki"], rel=1e-6)
    assert gains["Td_Kd"] == pytest.approx(times["Kc_Kp"] * times["Td_Kd"], rel=1e-6)
    assert gains["Tf"] == times["Tf"]


@pytest.mark.parametrize("dependent", [False, True])
def test_everything_that_is_written_is_single_precision(dependent):
    s = tuned(PID_EQ=dependent, BIAS=0.1).states[0]

    for value in (s.gain, s.reset, s.rate, s.filter_time, s.integral, s.tune_mv_low, s.tune_mv_high):
        assert value == single(value)


def test_later_changes_are_no_results():
    rig = tuned()
    found = rig.plc.tuning_result(0)["results"]
    rig.set("Kc_Kp", 1)

    assert rig.plc.tuning_result(0)["results"] == found


def test_a_cold_oven_is_heated_first_and_then_swings_around_sv():
    """As in the manual's picture; the second half of the swings goes evenly around the MV that holds 80 degrees."""
    rig = Rig({**OVEN, "PID_DE": True}, plants=[plant()], base=1.0)
    rows = []
    while rig.mode() == "autotune":
        rows += rig.trace(1, "PV", "MV")
    outs = [mv for _, mv in rows]
    crossed = next(k for k, (pv, _) in enumerate(rows) if pv > 80.0)
    levels = [a for a, b in pairwise(outs) if a != b]

    assert outs[:15] == [0.0] * 15, "MV is held while PV is listened to"
    assert set(outs[16:crossed]) == {4000.0}
    assert levels[:6] == [0.0, 4000.0] * 3
    assert len(set(levels[6:])) == 2
    assert sum({*levels[6:]}) / 2 == pytest.approx(600.0, rel=0.3)
    assert outs[-1] == pytest.approx(600.0, rel=0.05), "the algorithm has taken over"


@pytest.mark.parametrize("share", [0.02, 0.1, 0.5, 0.9, 0.99])
def test_a_strong_oven_is_tuned_as_well_as_a_weak_one(share):
    """``share`` of its power holds SV: heating and cooling differ by a factor of up to 100."""
    gain = 60.0 / (share * 4000.0)
    rig = tuned(process=plant(gain))
    found = rig.plc.tuning_result(0)["results"]
    kc, period = ultimate(gain, 120.0, 12.5)

    assert 0.75 <= found["Kc_Kp"] * 2.2 / kc <= 1.0
    assert found["Ti_Ki"] == pytest.approx(2.2 * period, rel=0.1)
    assert rig.run(1500).signal("PV") == pytest.approx(80.0, abs=0.05)


def test_a_range_that_does_not_begin_at_0():
    """1400 of 1000 to 5000 holds SV."""
    rig = tuned(process=plant(60.0 / 1400.0), MV_MIN=1000, MV_MAX=5000)

    assert rig.plc.tuning_result(0)["results"]["Ti_Ki"] == pytest.approx(2.2 * ultimate(0.1, 120.0, 12.5)[1], rel=0.1)
    assert rig.signal("I_MV") == pytest.approx(1400.0, rel=0.05)


def test_the_balanced_relay_moves_a_little_even_at_a_limit():
    c, s = Config(lowest_mv=1000.0, highest_mv=5000.0), State()
    balance_relay(c, s, 5000.0)

    assert (s.tune_mv_low, s.tune_mv_high, s.tune_rounds) == (4980.0, 5000.0, 1)


@pytest.mark.parametrize(("key", "value", "ends"), [("CYCLE", 2000, True), ("CYCLE", 1000, False), ("SV", 61.0, False)])
def test_another_sampling_time_ends_an_autotune(key, value, ends):
    rig = Rig(OVEN, plants=[plant()], base=1.0).step(5)
    assert rig.mode() == "autotune"
    rig.set(key, value)
    rig.step()
    assert (rig.mode() != "autotune") == ends
    assert any("the sampling time was changed" in text for _, text in rig.log) == ends


def test_every_autotune_is_balanced_anew():
    rig = tuned(process=plant(60.0 / 200.0))
    first = rig.plc.tuning_result(0)["results"]["Ti_Ki"]
    for _ in range(3):
        rig.plc.autotune(0, "start")
        rig.step()
        while rig.mode() == "autotune":
            rig.step()
        assert rig.plc.tuning_result(0)["results"]["Ti_Ki"] == pytest.approx(first, rel=0.1)


def test_the_loop_goes_on_quietly_and_controls_well():
    rig = tuned(PID_DE=True)
    rig.run(200)
    after = rig.trace(1800, "PV")
    rig.set("SV", 100)
    step = rig.trace(1800, "PV")

    assert max(abs(pv - 80.0) for pv in after) < 2.0
    assert after[-1] == pytest.approx(80.0, abs=0.01)
    assert max(step) < 102.0
    assert step[-1] == pytest.approx(100.0, abs=0.01)


def test_i_mv_goes_on_around_the_mean_of_mv():
    rig = tuned(BIAS=150)

    assert rig.signal("I_MV") + 150.0 == pytest.approx(600.0, rel=0.05)


def test_reverse_action_cools():
    cooled = FirstOrder(-0.1, 120.0, 12.0, initial=90.0, offset=90.0)
    rig = tuned(process=cooled, SV=30, PID_DIR=False)
    outs = rig.trace(1500, "PV")

    assert rig.plc.tuning_result(0)["done"]
    assert outs[-1] == pytest.approx(30.0, abs=0.01)


def test_a_start_above_sv_works_too():
    assert tuned(process=plant(initial=130.0)).plc.tuning_result(0)["done"]


def test_noise_is_borne():
    """It delays the relay by its hysteresis, so the cycle is a little longer."""
    quiet = tuned().plc.tuning_result(0)["results"]
    rig = tuned(noise=0.3)
    loud = rig.plc.tuning_result(0)["results"]

    assert rig.states[0].tune_band == 4.0 * rig.states[0].tune_noise
    assert rig.states[0].tune_noise == pytest.approx(0.3, rel=0.5)
    assert loud["Kc_Kp"] == pytest.approx(quiet["Kc_Kp"], rel=0.3)
    assert loud["Ti_Ki"] == pytest.approx(quiet["Ti_Ki"], rel=0.3)


def test_the_dead_band_has_no_effect():
    assert tuned(ERR_DBW=30).plc.tuning_result(0) == tuned().plc.tuning_result(0)


def test_mout_follows_in_an_autotune_too():
    rig = Rig({**OVEN, "MOUT_AUTO": True}, plants=[plant()], base=1.0)

    assert all(mv == mout for mv, mout in rig.trace(100, "MV", "MOUT"))


def test_mv_stays_within_swapped_limits():
    rig = Rig({**OVEN, "MV_MAX": 100, "MV_MIN": 3000}, plants=[plant()], base=1.0)
    outs = rig.trace(200, "MV")

    assert (min(outs), max(outs)) == (100.0, 3000.0)


# --- asked for while running -----------------------------------------------------------------------------------------


def test_start_writes_1_to_pid_mode_and_its_end_0():
    rig = Rig({**OVEN, "PID_MODE": 2, "Kc_Kp": 5}, plants=[plant()], base=1.0)
    rig.step(10)
    assert rig.plc.tuning_result(0) is None
    rig.plc.autotune(0, "start")
    rig.step(2)
    assert (rig.mode(), rig.states[0].mode) == ("autotune", 1)
    assert rig.plc.tuning_result(0) == {"done": False, "error": False, "status": "running", "results": {}}
    rig.plc.autotune(0, "start")
    while rig.mode() == "autotune":
        rig.step()

    assert (rig.states[0].mode, rig.plc.tuning_result(0)["status"]) == (0, "done")
    assert rig.log == [("L1", "autotune is running already")]


@pytest.mark.parametrize("before", [0, 2])
def test_cancel_brings_back_pid_mode_and_leaves_the_gains(before):
    rig = Rig({**OVEN, "PID_MODE": before, "Kc_Kp": 5, "Ti_Ki": 90}, plants=[plant()], base=1.0)
    rig.step(10)
    kept = rig.signal("I_MV")
    rig.plc.autotune(0, "start")
    rig.step(60)
    rig.plc.autotune(0, "cancel")
    rig.step()

    assert (rig.mode(), rig.states[0].mode) == ("auto", before)
    assert (rig.states[0].gain, rig.states[0].reset) == (5.0, 90.0)
    assert rig.plc.tuning_result(0) == {"done": False, "error": False, "status": "cancelled", "results": {}}
    assert rig.log == [("L1", "autotune ended without results")]
    assert rig.signal("I_MV") == kept or before == 2


def test_a_stopped_plc_begins_it_again():
    rig = Rig(OVEN, plants=[plant()], base=1.0).step(60)
    rig.plc.program(rig.signal_values)
    rig.step(5)
    rig.plc.run(rig.tick)
    held = rig.signal("MV")

    assert rig.trace(15, "MV") == [held] * 15
    assert rig.states[0].tune_phase == 1


# --- no result -------------------------------------------------------------------------------------------------------


def failed(rig):
    found = rig.plc.tuning_result(0)
    assert (found["done"], found["error"], found["results"]) == (False, True, {})
    assert rig.states[0].status & rig.plc.flag_bits["autotune_error"]
    assert (rig.mode(), rig.states[0].mode) == ("auto", 0)
    return found["status"], rig.log[-1][1]


class Stuck(FirstOrder):
    """It stays where it is once it is above 80."""

    def step(self, output, dt):
        return self.value if self.value > 80.0 else super().step(output, dt)


def test_a_pv_that_answers_no_more():
    rig = Rig(OVEN, plants=[Stuck(0.1, 120.0, 12.0, initial=20.0, offset=20.0)], base=1.0)
    while rig.plants[0].value <= 80.0:
        rig.step()
    rig.run(580)
    assert rig.mode() == "autotune"
    rig.run(40)

    assert failed(rig)[0] == "error: PV does not answer"


def test_a_swing_of_nothing_is_no_answer():
    c, s = Config(highest_mv=100.0), State(tune_mv_high=100.0, tune_count=40)
    measure_cycle(c, s)

    assert (s.tune_done, REASONS[s.tune_reason]) == (2, "autotune stopped: PV does not answer")


def test_few_samples_are_waited_for_by_their_number():
    rig = tuned(process=Fixed(20.0), CYCLE=40_000)

    assert rig.tick / 40e6 == pytest.approx(PATIENCE_SAMPLES + 18, abs=2)


def test_a_result_beyond_single_precision():
    """The gain is MV per PV: 1e38 over a PV that swings by millionths."""
    process = FirstOrder(1e-41, 60.0, 10.0, initial=0.0)

    assert failed(tuned(process=process, SV=1e-5, MV_MAX=3e38))[0].endswith("that its operand can hold")
    assert is_usable(1.0)
    assert not any(map(is_usable, (0.0, -1.0, math.inf, math.nan)))


def test_a_failure_in_pid_mode_2_goes_back_there():
    rig = Rig({**OVEN, "PID_MODE": 2}, base=1.0)
    rig.plc.autotune(0, "start")
    rig.step(700)

    assert (rig.mode(), rig.states[0].mode, rig.plc.tuning_result(0)["error"]) == ("auto", 2, True)


@pytest.mark.parametrize(
    ("vendor", "rule"), [(Dpide, "D276, D277"), (Click, "D123, D125"), (Ezlogix, "D178"), (Dl06, "")]
)
def test_results_whose_rule_no_manual_prints_say_so(vendor, rule):
    plc = object.__new__(vendor)
    done = plc.tune_report("done", [1.0] * len(vendor.tuned_names), done=True, error=False)
    assert rule in done.get("rule", "")
    assert bool(done.get("rule")) == bool(rule)
    assert "rule" not in plc.tune_report("running", [], done=False, error=False)
    assert autotune_text(done).endswith(f"({rule})" if rule else " 1")
