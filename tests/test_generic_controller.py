"""The ideal PID against a textbook loop, closed-form solutions, and what an operator expects."""

from __future__ import annotations

import math
import random

import pytest
from pydantic_core import PydanticCustomError

from generic_rig import Rig
from pidcfg.encoders.parameters import Program
from pidcfg.sim.controllers.generic.equation import REQUEST, UNBOUNDED, Config, State, calculate_derivative
from pidcfg.sim.controllers.generic.scan import load
from rig_plants import FirstOrder

TS = 0.1
WIDE = {"range": [-1e6, 1e6]}


def textbook(pvs, loop):
    """The same loop in the plainest Python."""
    kp, ti, td, tf = (loop[key] for key in ("gain", "ti", "td", "tf"))
    low, high, rate = loop["low"], loop["high"], loop["rate"] * TS
    out, total, y, filtered, before, e_before = 0.0, 0.0, 0.0, None, None, None
    for pv in pvs:
        filtered = pv if filtered is None else filtered + (pv - filtered) * (1 - math.exp(-TS / loop["pv_filter"]))
        sign = 1 if loop["raises"] else -1
        e = sign * (loop["sp"] - filtered)
        e = 0.0 if abs(e) < loop["deadband"] else e
        x = (
            (e - (e if e_before is None else e_before))
            if loop["of_error"]
            else (-sign * (filtered - (filtered if before is None else before)))
        )
        y += (x / TS - y) * (1 - math.exp(-TS / tf))
        before, e_before = filtered, e
        step = kp * TS / ti * e
        want = kp * e * loop["p"] + total + step + kp * td * y + loop["bias"]
        if not ((want > high and step > 0) or (want < low and step < 0)) or loop["windup"]:
            total += step
        out += min(max(min(max(want, low), high) - out, -rate), rate)
        yield out


@pytest.mark.parametrize("seed", range(60))
def test_it_is_a_textbook_loop(seed):
    rng = random.Random(seed)
    loop = {
        "gain": rng.uniform(0.1, 4),
        "ti": rng.uniform(1, 30),
        "td": rng.choice([0, rng.uniform(0.1, 5)]),
        "tf": rng.uniform(0.05, 2),
        "pv_filter": rng.uniform(0.05, 2),
        "p": rng.random() < 0.8,
        "of_error": rng.random() < 0.5,
        "raises": rng.random() < 0.5,
        "sp": rng.uniform(20, 80),
        "bias": rng.uniform(-10, 10),
        "low": -rng.uniform(5, 60),
        "high": rng.uniform(5, 60),
        "rate": rng.choice([1e9, 40.0]),
        "deadband": rng.choice([0, 3.0]),
        "windup": rng.random() < 0.3,
    }
    rig = Rig(
        {
            "output_raises_pv": loop["raises"],
            "setpoint": {"value": loop["sp"]},
            "deadband": loop["deadband"],
            "tuning": {
                "gain": loop["gain"],
                "integral_time": loop["ti"],
                "derivative_time": loop["td"],
                "derivative_filter": loop["tf"],
                "proportional": loop["p"],
                "derivative_on": "error" if loop["of_error"] else "pv",
            },
            "pv": {"range": [0, 100], "filter": loop["pv_filter"]},
            "anti_windup": not loop["windup"],
            "output": {
                "range": [-100, 100],
                "limits": [loop["low"], loop["high"]],
                "bias": loop["bias"],
                "max_rate": loop["rate"],
            },
        }
    )
    pvs = [50 + 40 * math.sin(0.02 * k) + rng.gauss(0, 2) for k in range(600)]

    assert rig.play(pvs) == pytest.approx(list(textbook(pvs, loop)), rel=1e-9, abs=1e-9)


def test_the_integral_of_a_constant_error_is_a_ramp():
    rig = Rig({"setpoint": {"value": 10}, "output": WIDE, "tuning": {"gain": 3, "integral_time": 6}})

    outs = rig.play([0] * 100)

    assert outs == pytest.approx([30 + 30 * TS * (k + 1) / 6 for k in range(100)])
    assert rig.signal("BIAS") == pytest.approx(50)


def test_the_derivative_of_a_ramp_is_its_slope_and_the_filter_decays_by_its_time_constant():
    tuning = {"gain": 2, "derivative_time": 5, "derivative_filter": 1.5, "proportional": False}
    rig = Rig({"output": WIDE, "tuning": tuning})

    outs = rig.play([0.3 * k for k in range(200)])

    assert outs == pytest.approx([-2 * 5 * 3 * (1 - math.exp(-k * TS / 1.5)) for k in range(200)], abs=1e-9)


def test_a_step_of_the_filtered_pv_is_an_exponential():
    rig = Rig({"pv": {"range": [0, 100], "filter": 2}})

    pvs = rig.play([0] + [80] * 50, "PV")

    assert pvs == pytest.approx([80 * (1 - math.exp(-k * TS / 2)) for k in range(51)])


def test_a_loop_with_a_first_order_plant_is_the_closed_form():
    """Pole and zero cancel with Ti = T: the closed loop is of first order with the time constant T / (K Kp)."""
    ts, t, k, kp = 0.001, 10.0, 2.0, 1.5
    tuning = {"gain": kp, "integral_time": t}
    rig = Rig(
        {"sample_time": "1 ms", "setpoint": {"value": 30}, "output": WIDE, "tuning": tuning},
        plants=[FirstOrder(k, t)],
        base=ts,
    )
    rig.step(10_000)

    for _ in range(5):
        rig.step(1000)
        seconds = (rig.tick / 1e6) - 2 * ts
        assert rig.signal("PV") == pytest.approx(30 * (1 - math.exp(-seconds * k * kp / t)), abs=0.01)


@pytest.mark.parametrize(
    ("limits", "outs"), [([10, 80], [10, 14, 18, 22]), ([-80, 80], [4, 8, 12, 16]), ([2, 80], [4, 8, 12, 16])]
)
def test_an_output_that_moves_slowly_begins_at_0_whatever_its_limits(limits, outs):
    output = {"range": [-100, 100], "limits": limits, "max_rate": 4 / TS}
    rig = Rig({"setpoint": {"value": 90}, "output": output, "tuning": {"gain": 3}})

    assert rig.play([0] * 4) == pytest.approx(outs)


@pytest.mark.parametrize(("on", "delay"), [(True, 1), (False, 60)])
def test_anti_windup_lets_the_output_leave_its_limit_at_once(on, delay):
    rig = Rig(
        {
            "setpoint": {"value": 10},
            "anti_windup": on,
            "output": {"range": [0, 20]},
            "tuning": {"gain": 1, "integral_time": 1, "proportional": False},
        }
    )
    rig.play([0] * 100)
    assert rig.signal("OUT") == 20
    assert rig.flags() == {"out_limited"}

    outs = rig.play([20] * 200)

    assert (next(k for k, out in enumerate(outs) if out < 19) > 10) != on
    assert outs[delay + 25] < 20


def test_manual_holds_and_auto_goes_on_without_a_bump():
    rig = Rig(
        {
            "setpoint": {"value": 50},
            "output": {"range": [0, 100], "bias": 9},
            "tuning": {"gain": 1, "integral_time": 20, "derivative_time": 1},
        }
    )
    held = rig.play([40 + 0.1 * k for k in range(30)])[-1]
    rig.plc.request(0, "manual")
    assert rig.play([43, 47, 20]) == [held] * 3
    assert rig.mode() == "manual"

    assert rig.set("output", 66) is None
    rig.play([20])
    assert rig.signal("OUT") == 66
    rig.plc.request(0, "auto")

    first, second = rig.play([20.05, 20.05])
    assert first == pytest.approx(66)
    assert second != first


CASCADE = (
    {
        "setpoint": {"value": 50},
        "output": {"range": [0, 40], "limits": [4, 36]},
        "tuning": {"gain": 0.5, "integral_time": 60},
    },
    {
        "pv": {"range": [0, 40]},
        "setpoint": {"value": 20, "source": "L1"},
        "output": {"range": [0, 100]},
        "tuning": {"gain": 2, "integral_time": 5},
    },
)


def test_pulses_are_the_share_of_the_output_in_their_period():
    rig = Rig({"mode": "manual", "output": {"range": [0, 10], "manual": 3, "pulse": {"period": 10}}})

    assert sum(rig.play([0] * 300, "PULSE")) == 90


@pytest.mark.parametrize(("out", "on"), [(0, 0), (0.9, 0), (1, 10), (9, 90), (9.1, 100), (10, 100)])
def test_short_pulses_are_left_out_and_short_gaps_closed(out, on):
    pulse = {"period": 10, "min_on": 1, "min_off": 1}
    rig = Rig({"mode": "manual", "output": {"range": [0, 10], "manual": out, "pulse": pulse}})

    assert sum(rig.play([0] * 100, "PULSE")) == on


def test_only_a_loop_with_pulses_has_the_signal():
    assert "L1.PULSE" not in Rig({}).plc.signals
    assert Rig({}).plc.signals[:5] == ["", "L1.PV", "L1.SP", "L1.OUT", "L1.BIAS"]


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("tuning.gian", 1, "tuning.gain"),
        ("tuning.gain", -1, "at least 0"),
        ("sample_time", 0, "above 0"),
        ("pv.range.0", 1, "scales do not change"),
        ("setpoint.source", "L1", "who the master is"),
        ("mode", "auto", "an event of its own"),
        ("tuning.derivative_on", "sp", "none of"),
    ],
)
def test_what_cannot_be_set_is_refused(key, value, said):
    with pytest.raises(PydanticCustomError) as found:
        Rig({}).set(key, value)

    assert said in f"{found.value.message()} {(found.value.context or {}).get('help', '')}"


def test_set_takes_the_keys_of_the_file():
    rig = Rig({"output": WIDE})
    rig.set("tuning.gain", 3)
    rig.set("setpoint.value", 20)
    rig.set("tuning.integral_time", "off")
    rig.set("alarms.pv.high", 5)
    assert rig.play([10]) == [30]
    assert rig.flags() == {"high"}
    assert "manual only" in rig.set("output", 5)
    assert rig.plc.new_period(0, ("sample_time",), rig.plc.check_set(0, ("sample_time",), "250 ms")) == 250_000
    assert rig.plc.new_period(0, ("deadband",), 3) == 0


def test_a_set_point_in_cascade_is_the_masters():
    rig = Rig(CASCADE[0], {**CASCADE[1], "mode": "cascade"})

    assert "master" in rig.set("setpoint", 3, 1)


def test_a_set_point_in_cascade_does_not_follow():
    rig = Rig(CASCADE[0], {**CASCADE[1], "mode": "manual", "setpoint": {**CASCADE[1]["setpoint"], "follows_pv": True}})
    rig.play([25], i=1)
    rig.plc.request(1, "cascade")
    rig.play([25], i=1)
    assert rig.signal("SP", 1) == rig.signal("OUT", 0) != 25


def test_a_listing_with_gaps_is_told():
    plc = load(Program("generic", (), ({"loop": "A"},)))

    assert [p.text for p in plc.problems] == [
        "output_raises_pv is missing, False is taken",
        "sample_time is missing, 1.0 is taken",
        "tuning.gain is missing, 0.0 is taken",
        "pv.range.0 is missing, 0.0 is taken",
        "pv.range.1 is missing, 100.0 is taken",
        "output.range.0 is missing, 0.0 is taken",
        "output.range.1 is missing, 100.0 is taken",
    ]
    c, s = plc.configs[0], plc.states[0]
    assert (c.period, c.pv_span, c.limit_low, c.limit_high, c.rate_limit, s.ki, s.kd) == (
        1_000_000,
        100,
        0,
        100,
        UNBOUNDED,
        0,
        0,
    )


def test_a_result_that_is_no_number_leaves_the_output():
    rig = Rig({"setpoint": {"value": 10}, "tuning": {"gain": 1}})
    rig.play([5])

    assert rig.play([float("nan"), float("-inf")]) == [5, 5]


def test_a_mode_that_holds_already_is_no_request():
    rig = Rig({})
    rig.step()
    s = rig.states[0]
    s.pending = 0
    rig.plc.request(0, "auto" if rig.mode() == "manual" else "manual")
    assert s.pending == REQUEST
    rig.plc.request(0, rig.mode())
    assert s.pending == 0


def test_without_a_filter_the_derivative_is_exact_whatever_came_before():
    s = State(pv=3.0, previous_pv=1.0, kd=2.0, derivative_share=1.0, filtered_difference=1e17)
    assert calculate_derivative(Config(derivative_on_error=0, output_raises_pv=0), s) == 4.0
    assert s.filtered_difference == 2.0
