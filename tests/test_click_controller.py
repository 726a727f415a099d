"""The PID equation of the virtual CLICK: native single precision bit for bit, closed forms, limits and direction."""

from __future__ import annotations

import math
import random

import pytest

pytest.importorskip("numpy")
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from click_rig import Rig
from pidcfg.sim.controllers.kernels import single
from rig_plants import FirstOrder, Fixed

F = np.float32


def f(x):
    """Single precision, as the PLC holds a number."""
    return float(F(x))


class Reference:
    """The equation of the help in NumPy's own single precision; reverse action turns the error round."""

    def __init__(self, loop, out):
        self.t, self.loop = loop["tuning"], loop
        self.bias = self.co = F(out)
        self.e1 = self.pv = self.y = None

    def sample(self, sp, raw):
        loop, t = self.loop, self.t
        ts = F(int(loop["sample_rate"].split()[0])) / F(1000)
        k = F(loop["pv"]["filter"]) / F(100)
        raw = F(raw)
        self.pv = raw if self.pv is None else self.pv + k * (raw - self.pv)
        e = self.pv - F(sp) if loop["action"] == "reverse" else F(sp) - self.pv
        if loop["error"]["curve"] == "squared":
            e = e * abs(e)
        low, high = (F(x) for x in loop["output"]["limits"])
        if self.e1 is None:
            self.e1, self.y = e, F(0)
        change, self.e1 = e - self.e1, e
        if abs(e) <= F(loop["error"]["deadband"]):
            self.y = F(0)
            self.bias = min(max(self.bias, low), high)
            self.co = self.bias
            return
        if not (loop["freeze_bias"] and (self.co >= high or self.co <= low)):
            self.bias = self.bias + F(t["proportional_gain"]) * (ts / F(t["reset_time"])) * e
        self.bias = min(max(self.bias, low), high)
        limit, td = loop["derivative_gain_limit"], F(t["derivative_gain"])
        if 0 < limit < 100:
            change = self.y + ts / (ts + td / F(limit)) * (change - self.y)
        self.y = change
        kd = td / ts if limit else F(0)
        co = self.bias + F(t["proportional_gain"]) * (e + kd * change)
        self.co = min(max(co, low), high)


def random_loop(rng):
    span, curve = 10 ** rng.uniform(-1, 4), rng.choice(["linear", "squared"])
    unit = span if curve == "linear" else span * span
    gain = 10 ** rng.uniform(0.5, 2.0) / unit
    return {
        "sample_rate": f"{rng.choice([100, 250, 333, 500, 7777])} ms",
        "action": rng.choice(["direct", "reverse"]),
        "freeze_bias": rng.random() < 0.5,
        "tuning": {
            "proportional_gain": min(max(round(gain, 5), 0.01), 10000),
            "reset_time": round(10 ** rng.uniform(-1, 3), 3),
            "derivative_gain": rng.choice([0, round(10 ** rng.uniform(-2, 1), 3)]),
        },
        "derivative_gain_limit": rng.choice([0, 8, 10, 33, 100]),
        "pv": {"range": [0, round(span, 3)], "filter": rng.choice([5, 20, 80, 100])},
        "error": {"curve": curve, "deadband": round(rng.choice([0.001, 0.01]) * unit, 6)},
        "output": {"limits": rng.choice([[0, 100], [10.1, 70.7]])},
        "setpoint": {"value": round(span * rng.random(), 4)},
    }


def compared(rng):
    """A random loop side by side with NumPy; how many different outputs there were."""
    loop = random_loop(rng)
    span, step = loop["pv"]["range"][1], int(loop["sample_rate"].split()[0]) / 1000
    pv = Fixed(span * rng.random())
    rig = Rig(loop, plants=[pv], base=step)
    rig.set("output", round(rng.uniform(10.1, 70.7), 2))
    s = rig.auto().st[0]
    reference = Reference(loop, s.out)
    outputs = set()
    for _ in range(300):
        near = loop["setpoint"]["value"] + span * rng.gauss(0.0, 0.05)
        pv.value = rng.choice([pv.value, near, span * rng.random()])
        rig.step()
        reference.sample(loop["setpoint"]["value"], pv.value)
        assert (s.pv, s.bias, s.out) == (float(reference.pv), float(reference.bias), float(reference.co)), loop
        assert all(single(x) == x for x in (s.pv, s.bias, s.out, s.previous_error, s.filtered_difference))
        outputs.add(s.out)
    return len(outputs)


def test_every_operation_is_native_single_precision():
    """Raw bits of PV, bias and output agree with NumPy over random loops and measurements, sample by sample."""
    counts = [compared(random.Random(seed)) for seed in range(60)]

    assert sum(counts) > 60 * 50


def test_the_integral_grows_by_kp_ts_over_ti_of_the_error_each_sample():
    rig = Rig({"tuning": {"proportional_gain": 1.5, "reset_time": 30}, "setpoint": {"value": 20}}, plants=[Fixed(10.0)])
    s = rig.auto().st[0]
    for n in range(1, 20):
        rig.step()
        assert s.bias == pytest.approx(n * 1.5 * 0.1 / 30 * 10.0, rel=1e-6)
        assert s.out == pytest.approx(15.0 + s.bias, rel=1e-6)


def test_p_only_on_a_first_order_plant_follows_the_closed_form():
    """y(n+1) = a y(n) + (1 - a) K Kp (r - y(n)) is geometric; 6000 s of reset time integrate little."""
    plant = FirstOrder(gain=0.8, time_constant=1.0, initial=10.0)
    rig = Rig({"tuning": {"proportional_gain": 2}, "setpoint": {"value": 50}}, plants=[plant])
    rig.auto().step()
    a = math.exp(-0.1)
    q, final = a - (1 - a) * 1.6, 1.6 * 50 / 2.6
    for n in range(1, 40):
        rig.step()
        assert plant.value == pytest.approx(final + (10.0 - final) * q**n, abs=0.02)
    assert plant.value == pytest.approx(final, abs=0.02)


def derivative(**loop):
    """The outputs after a PV that falls by 1 in the third sample, with Kp 2 and Td 1.5 s."""
    pv = Fixed(50.0)
    tuning = {"proportional_gain": 2, "derivative_gain": 1.5}
    rig = Rig({"tuning": tuning, "setpoint": {"value": 50}, **loop}, plants=[pv])
    rig.set("output", 30)
    rig.auto().step(2)
    pv.value = 49.0
    return [out for (out,) in rig.trace(60, "out")]


def test_the_derivative_answers_a_step_of_the_pv_once():
    """Kp Td/Ts = 2 x 15 for one sample, and 2 of the gain for good."""
    outs = derivative()

    assert outs[:4] == pytest.approx([62.0, 32.0, 32.0, 32.0], abs=1e-3)


def test_the_derivative_gain_limit_spreads_the_kick_and_keeps_its_sum():
    lag = 0.1 / (0.1 + 1.5 / 5)
    kicks = [out - 32.0 for out in derivative(derivative_gain_limit=5)]

    assert kicks[:5] == pytest.approx([30 * lag * (1 - lag) ** n for n in range(5)], abs=1e-3)
    assert sum(kicks) == pytest.approx(30.0, abs=0.1)


def test_a_derivative_gain_limit_of_100_filters_nothing_and_0_is_no_derivative():
    assert derivative(derivative_gain_limit=100) == derivative()
    assert derivative(derivative_gain_limit=0)[:3] == pytest.approx([32.0] * 3, abs=1e-3)
    assert derivative(derivative_gain_limit=5, derivative_gain_limit_enabled=False) == derivative()


def test_reverse_action_mirrors_direct_action():
    rows = {}
    for action, sign in (("direct", 1.0), ("reverse", -1.0)):
        plant = FirstOrder(gain=sign * 0.5, time_constant=5.0, initial=40.0, offset=40.0 - sign * 25.0)
        tuning = {"proportional_gain": 2.5, "reset_time": 8, "derivative_gain": 0.5}
        rig = Rig({"action": action, "tuning": tuning, "setpoint": {"value": 45}}, plants=[plant])
        rig.set("output", 50)
        rows[action] = rig.auto().trace(300, "pv", "out")

    assert [pv for pv, _ in rows["direct"]] == pytest.approx([pv for pv, _ in rows["reverse"]], abs=1e-4)
    mirrored = [100.0 - out for _, out in rows["reverse"]]
    assert [out for _, out in rows["direct"]] == pytest.approx(mirrored, abs=1e-3)
    assert rows["direct"][-1][1] > 59.0


@pytest.mark.parametrize(("action", "gain"), [("direct", 0.8), ("reverse", -0.8)])
def test_the_right_action_settles_at_the_set_point(action, gain):
    """Direct: the PV rises with the output, as in heating; reverse: it falls, as in cooling."""
    plant = FirstOrder(gain, time_constant=20.0, dead_time=1.0, initial=40.0, offset=40.0 - 50 * gain)
    tuning = {"proportional_gain": 4, "reset_time": 20}
    rig = Rig({"action": action, "tuning": tuning, "setpoint": {"value": 60}, "freeze_bias": True}, plants=[plant])
    rig.set("output", 50)
    first, *_ = rig.auto().trace(1, "out")
    rig.run(300)

    assert (first[0] > 50.0) == (gain > 0), "the PV is too low: heat, or cool less"
    assert plant.value == pytest.approx(60.0, abs=0.01)
    assert rig.out() == pytest.approx(50.0 + 20.0 / gain, abs=0.05)


@pytest.mark.parametrize(("action", "gain"), [("reverse", 0.8), ("direct", -0.8)])
@pytest.mark.parametrize("setpoint", [39.0, 41.0])
def test_the_wrong_action_runs_away_to_a_limit(action, gain, setpoint):
    plant = FirstOrder(gain, time_constant=20.0, dead_time=1.0, initial=40.0, offset=40.0 - 50 * gain)
    tuning = {"proportional_gain": 4, "reset_time": 20}
    rig = Rig({"action": action, "tuning": tuning, "setpoint": {"value": setpoint}}, plants=[plant])
    rig.set("output", 50)
    rig.auto().run(300)

    end = 100.0 if (setpoint > 40.0) == (action == "direct") else 0.0
    assert rig.out() == end
    assert (plant.value > 75.0) if (end == 100.0) == (gain > 0) else (plant.value < 5.0)


def test_the_square_keeps_the_sign_and_comes_before_the_deadband():
    def out(error, **options):
        rig = Rig({"error": {"curve": "squared", **options}, "setpoint": {"value": 50}}, plants=[Fixed(50.0 - error)])
        rig.set("output", 50)
        return rig.auto().step().out() - 50.0

    assert out(3.0) == pytest.approx(9.0, abs=1e-3)
    assert out(-3.0) == pytest.approx(-9.0, abs=1e-3)
    assert out(3.0, deadband=8) == pytest.approx(9.0, abs=1e-3)
    assert out(3.0, deadband=9) == 0.0
    assert out(0.5, deadband=0.3) == 0.0, "0.25 is inside although 0.5 is not"


@pytest.mark.parametrize(("distance", "inside"), [(2.0, True), (-2.0, True), (2.25, False), (-2.25, False)])
def test_inside_the_deadband_there_is_no_error_and_outside_it_is_whole(distance, inside):
    tuning = {"proportional_gain": 1, "reset_time": 10}
    loop = {"tuning": tuning, "error": {"deadband": 2}, "setpoint": {"value": 50}}
    rig = Rig(loop, plants=[Fixed(50.0 - distance)])
    rig.set("output", 50)
    rows = rig.auto().trace(3, "bias", "out")

    step = 0.0 if inside else distance * 0.01
    proportional = 0.0 if inside else distance
    assert [bias for bias, _ in rows] == pytest.approx([50 + n * step for n in (1, 2, 3)], abs=1e-4)
    assert [out - bias for bias, out in rows] == pytest.approx([proportional] * 3, abs=1e-4)


def test_the_deadband_kicks_the_derivative_neither_on_the_way_in_nor_out():
    """A PV that drifts by 0.1 a sample has a derivative of 1 outside, 0 inside, and never one of the band's width."""
    pv = Fixed(45.0)
    tuning = {"proportional_gain": 1, "derivative_gain": 1}
    rig = Rig({"tuning": tuning, "error": {"deadband": 2.05}, "setpoint": {"value": 50}}, plants=[pv])
    rig.set("output", 50)
    rig.auto().step()
    seen = []
    for n in range(1, 100):
        pv.value = 45.0 + 0.1 * n
        rig.step()
        error = 50.0 - pv.value
        seen.append((abs(error) <= 2.05, rig.out() - 50.0 - error))

    assert {round(rest) for inside, rest in seen if not inside} == {-1}
    outs = [rest + (50.0 - 45.0 - 0.1 * n) for n, (inside, rest) in enumerate(seen, start=1) if inside]
    assert outs == pytest.approx([outs[0]] * len(outs), abs=1e-6), "inside the band the output stands still"
    assert len(outs) == 41


def test_a_deadband_of_nothing_is_none():
    """An error that is exactly 0 keeps its derivative."""
    pv = Fixed(49.0)
    loop = {"tuning": {"derivative_gain": 1}, "error": {"deadband": 0}, "setpoint": {"value": 50}}
    rig = Rig(loop, plants=[pv])
    rig.set("output", 30)
    rig.auto().step(2)
    pv.value = 50.0

    assert rig.step().out() == pytest.approx(20.0, abs=0.01)


def test_the_filter_passes_its_share_each_sample_and_starts_full():
    pv = Fixed(20.0)
    rig = Rig({"pv": {"filter": 25}}, plants=[pv])
    rig.step()
    first = rig.st[0].pv
    pv.value = 60.0
    rows = rig.trace(3, "pv", "raw")

    assert first == 20.0
    assert rows == [(30.0, 60.0), (37.5, 60.0), (43.125, 60.0)]
    assert Rig({"pv": {"filter": 25, "filter_enabled": False}}, plants=[pv]).step(2).st[0].pv == 60.0


def test_without_freeze_the_bias_winds_up_to_the_limits_of_the_output_and_recovers_late():
    """The same loss of the PV for a minute: the frozen bias is back long before the wound-up one."""
    recovered = {}
    for freeze in (False, True):
        plant = FirstOrder(1.0, time_constant=5.0, initial=40.0)
        tuning = {"proportional_gain": 3, "reset_time": 10}
        rig = Rig({"tuning": tuning, "setpoint": {"value": 40}, "freeze_bias": freeze}, plants=[plant])
        rig.set("output", 40)
        rig.auto().run(10)
        kept, rig.plants[0] = rig.plants[0], Fixed(0.0)
        rig.run(60)
        bias = rig.st[0].bias
        assert rig.out() == 100.0
        assert (bias == 100.0) is not freeze
        assert bias < 42.0 or not freeze, "frozen with the first sample at the limit"
        rig.plants[0] = kept
        steps = 0
        while abs(rig.st[0].bias - 40.0) > 1.0 or abs(kept.value - 40.0) > 0.5:
            steps += 1
            rig.step()
        recovered[freeze] = steps
    assert recovered[True] < recovered[False] / 4


@pytest.mark.parametrize(("sp", "end"), [(90.0, 70.0), (10.0, 30.0)])
def test_freeze_bias_works_at_the_outputs_own_limits_and_lets_go(sp, end):
    pv = Fixed(50.0)
    loop = {
        "tuning": {"proportional_gain": 1, "reset_time": 1},
        "setpoint": {"value": sp},
        "freeze_bias": True,
        "output": {"limits": [30, 70]},
    }
    rig = Rig(loop, plants=[pv])
    rig.set("output", 50)
    rig.auto().step(2)
    frozen = rig.st[0].bias
    rig.run(60)
    assert (rig.out(), rig.st[0].bias) == (end, frozen)

    pv.value = sp + (1.0 if sp > 50 else -1.0)
    rig.step(2)
    assert rig.out() != end
    assert (rig.st[0].bias < frozen) if sp > 50 else (rig.st[0].bias > frozen)


@pytest.mark.parametrize("freeze", [False, True])
def test_a_transfer_from_beyond_the_limits_recovers(freeze):
    """Manual knows no limits: from an output of 100 and an upper limit of 60 the loop must find its way back."""
    plant = FirstOrder(1.0, time_constant=5.0, initial=60.0)
    loop = {
        "tuning": {"proportional_gain": 0.5, "reset_time": 5},
        "setpoint": {"value": 40},
        "freeze_bias": freeze,
        "output": {"limits": [10, 60]},
    }
    rig = Rig(loop, plants=[plant])
    rig.set("output", 100)
    rig.step(2)
    assert rig.out() == 100.0
    rig.auto().step()
    assert rig.out() == pytest.approx(60.0 + 0.5 * (40.0 - rig.st[0].pv), abs=1.0), "from the limit, not from 100"
    rig.run(200)

    assert plant.value == pytest.approx(40.0, abs=1e-3)


@given(
    st.fixed_dictionaries(
        {
            "proportional_gain": st.floats(0.01, 10000),
            "reset_time": st.floats(0.01, 6000),
            "derivative_gain": st.floats(0, 6000),
        }
    ),
    st.booleans(),
    st.integers(0, 40),
    st.integers(1, 60),
    st.lists(st.floats(-1e9, 1e9), min_size=5, max_size=40),
)
@settings(max_examples=60, deadline=None)
def test_neither_output_nor_bias_leaves_the_limits_in_auto(tuning, freeze, low, width, pvs):
    pv = Fixed(pvs[0])
    tuning = {key: round(value, 4) for key, value in tuning.items()}
    output = {"limits": [low, low + width]}
    loop = {"tuning": tuning, "freeze_bias": freeze, "output": output, "setpoint": {"value": 50}}
    rig = Rig(loop, plants=[pv])
    rig.set("output", low)
    rig.auto()
    for pv.value in pvs:
        rig.step()
        assert rig.mode() == "auto"
        assert low <= rig.st[0].out <= low + width
        assert low <= rig.st[0].bias <= low + width


def test_in_manual_the_output_limits_have_no_effect():
    rig = Rig({"output": {"limits": [10, 60]}})
    rig.set("output", 95.5)
    rig.step(3)

    assert rig.out() == 95.5


def test_contradicting_output_limits_end_at_the_lower_one():
    rig = Rig({"output": {"limits": [60, 20]}, "setpoint": {"value": 50}})

    assert rig.auto().step(3).out() == 60.0


def test_a_bias_written_from_outside_moves_the_output_at_once():
    rig = Rig({"setpoint": {"value": 50}}, plants=[Fixed(50.0)])
    rig.set("output", 30)
    rig.auto().step(3)
    rig.set("bias", 55)

    assert rig.step().out() == 55.0


def test_a_slow_integrator_stalls_where_single_precision_ends():
    """Ki e is 1.7e-8 of a bias of 60, whose last digit is 3.8e-6."""
    rig = Rig({"tuning": {"proportional_gain": 0.01}, "setpoint": {"value": 50.1}}, plants=[Fixed(50.0)])
    rig.set("output", 60)

    assert rig.auto().step(500).st[0].bias == 60.0


def test_an_infinite_error_leaves_the_output_where_it_is():
    """Squares beyond single precision: infinity less infinity is no number, and is not written."""
    pv = Fixed(-1e15)
    tuning = {"proportional_gain": 1, "derivative_gain": 1}
    rig = Rig({"tuning": tuning, "error": {"curve": "squared"}, "setpoint": {"value": 1}}, plants=[pv])
    rig.auto().step(2)
    assert rig.out() == 100.0
    rig.set("setpoint", 1e30)
    rig.step(3)

    assert (rig.out(), rig.mode()) == (100.0, "auto")
    rig.set("setpoint", 1)
    pv.value = 1.0
    rig.step(3)
    assert rig.mode() == "auto"
    assert math.isfinite(rig.st[0].filtered_difference)
    assert rig.out() < 100.0 or rig.st[0].bias == 100.0


def test_between_samples_the_output_is_held():
    pv = Fixed(10.0)
    rig = Rig({"sample_rate": "400 ms", "setpoint": {"value": 50}}, plants=[pv])
    rig.auto()
    outs = []
    for n in range(20):
        pv.value = 10.0 + n
        outs.append(rig.step().out())

    assert outs == pytest.approx([40.0 - 4 * (n // 4) for n in range(20)], abs=0.1)


def test_a_missed_sample_is_taken_late_and_the_grid_is_kept():
    """Base steps of 0.3 s and a sample rate of 0.5 s: samples at 0, 0.6, 1.2, 1.5, 2.1 …"""
    rig = Rig({"sample_rate": "500 ms"}, base=0.3)
    taken = []
    for k in range(10):
        due = rig.st[0].due
        rig.step()
        taken += [k] if rig.st[0].due != due else []

    assert taken == [0, 2, 4, 5, 7, 9]
