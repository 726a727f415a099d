"""The PID equation of the virtual CLICK: native single precision bit for bit, and closed forms."""

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
    s = rig.auto().states[0]
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
        bias = rig.states[0].bias
        assert rig.out() == 100.0
        assert (bias == 100.0) is not freeze
        assert bias < 42.0 or not freeze, "frozen with the first sample at the limit"
        rig.plants[0] = kept
        steps = 0
        while abs(rig.states[0].bias - 40.0) > 1.0 or abs(kept.value - 40.0) > 0.5:
            steps += 1
            rig.step()
        recovered[freeze] = steps
    assert recovered[True] < recovered[False] / 4


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
        assert low <= rig.states[0].out <= low + width
        assert low <= rig.states[0].bias <= low + width


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
    assert math.isfinite(rig.states[0].filtered_difference)
    assert rig.out() < 100.0 or rig.states[0].bias == 100.0
