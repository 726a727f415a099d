"""Autotune of the virtual CLICK: conditions, step response and relay against closed forms, results in registers."""

from __future__ import annotations

import math

import pytest

from click_rig import Rig, image_of, poked
from pidcfg.sim.controllers.autotune import cycle_gains
from pidcfg.sim.controllers.click import equation as bits
from pidcfg.sim.controllers.click.equation import number_of
from rig_plants import FirstOrder, Moving


def settled(
    action="direct",
    gain=1.0,
    time_constant=20.0,
    dead_time=2.0,
    sample_rate="500 ms",
    *,
    out=40.0,
    pv=50.0,
    pv_range=(0, 100),
    noise=0.0,
    **loop,
):
    """A loop in Auto at rest at its set point, and its plant."""
    sign = 1.0 if action == "direct" else -1.0
    plant = FirstOrder(sign * gain, time_constant, dead_time, pv, pv - sign * gain * out)
    base = int(sample_rate.split()[0]) / 1000
    rig = Rig(
        {
            "action": action,
            "sample_rate": sample_rate,
            "setpoint": {"value": pv},
            "pv": {"range": pv_range},
            "tuning": {"proportional_gain": 0.5, "reset_time": 60},
            **loop,
        },
        plants=[plant],
        base=base,
    )
    rig.set("output", out)
    rig.auto().step(4)
    rig.noise = noise
    assert rig.mode() == "auto"
    return rig


def tuned(rig, most=200_000):
    """Starts the autotune and runs to its end."""
    rig.plc.autotune(0, "start")
    rig.step()
    while rig.mode() == "autotune":
        rig.step()
        most -= 1
        assert most
    return rig.plc.tuning_result(0)


PLANTS = [
    # gain, time constant, dead time, sample rate
    (1.0, 20.0, 4.0, "500 ms"),
    (0.3, 60.0, 5.0, "100 ms"),
    (2.5, 10.0, 10.0, "500 ms"),
    (0.15, 20.0, 4.0, "500 ms"),  # answers 1.5 % of the PV's range: the output moves by another 10 %
]


@pytest.mark.parametrize("action", ["direct", "reverse"])
@pytest.mark.parametrize(("gain", "time_constant", "dead_time", "rate"), PLANTS)
def test_open_loop_gains_are_those_of_ziegler_and_nichols(gain, time_constant, dead_time, rate, action):
    rig = settled(action, gain, time_constant, dead_time, rate, autotune={"method": "open"})
    found = tuned(rig)
    ts = int(rate.split()[0]) / 1000
    results = found["results"]

    assert (found["done"], found["error"], found["status"], rig.log) == (True, False, "done", [])
    kp = 1.2 * time_constant / (gain * dead_time)
    assert 0.92 * kp <= results["proportional_gain"] <= 1.12 * kp
    assert results["reset_time"] == pytest.approx(2.0 * dead_time, abs=ts + 0.1 * dead_time)
    assert results["derivative_gain"] == pytest.approx(results["reset_time"] / 4, rel=1e-6)
    least = max(0.028 * results["reset_time"], 0.1)
    assert results["sample_rate"] == pytest.approx(least, abs=0.0006)
    assert rig.mode() == "auto"


def test_open_loop_pi_has_no_derivative():
    results = tuned(settled(autotune={"method": "open", "type": "PI"}))["results"]

    assert results["derivative_gain"] == 0.0
    assert results["proportional_gain"] == pytest.approx(0.9 * 20.0 / 2.0, rel=0.15)
    assert results["reset_time"] == pytest.approx(3.33 * 2.0, rel=0.2)


@pytest.mark.parametrize(("out", "moved"), [(40.0, 50.0), (80.0, 90.0), (80.5, 70.5), (100.0, 90.0), (0.0, 10.0)])
def test_the_output_steps_where_there_is_room_and_returns(out, moved):
    rig = settled(out=out, autotune={"method": "open"})
    seen = set()
    rig.plc.autotune(0, "start")
    rig.step()
    while rig.mode() == "autotune":
        seen.add(round(rig.out(), 4))
        rig.step()

    assert seen == {out, moved}
    assert rig.states[0].bias == pytest.approx(out, abs=5.0)
    assert rig.plc.tuning_result(0)["done"]


def test_the_gain_does_not_depend_on_the_outputs_limits():
    found = [
        tuned(settled(autotune={"method": "open"}, output={"limits": limits}))["results"]["proportional_gain"]
        for limits in ([0, 100], [20, 60])
    ]

    assert found[0] == pytest.approx(found[1], rel=0.05)


@pytest.mark.parametrize("method", ["open", "closed"])
def test_the_process_gain_is_measured_and_not_made_of_the_pv_limits(method):
    """D123: limits twice as wide make no gain half as high; answers and hysteresis are shares of them."""
    narrow, wide = (
        tuned(settled(pv_range=limits, autotune={"method": method, "hysteresis": band}))["results"]
        for limits, band in (([0, 100], 2), ([0, 200], 1))
    )

    assert narrow["proportional_gain"] == pytest.approx(wide["proportional_gain"], rel=0.05)


def test_the_new_parameters_act_at_once_and_without_a_kick():
    """The error that the step has left has no past: P and one sample of I on the old bias, no derivative."""
    rig = settled(gain=0.5, dead_time=10.0, autotune={"method": "open"})
    bias = rig.states[0].bias
    tuned(rig)
    s = rig.states[0]
    error = 50.0 - s.pv

    assert (s.kp, error) == (s.gain, pytest.approx(-5.0, abs=0.5))
    assert s.ki == pytest.approx(s.gain * s.period / 1e6 / s.reset, rel=1e-6)
    assert s.kd == pytest.approx(s.rate / (s.period / 1e6), rel=1e-6)
    assert s.out == pytest.approx(max(bias + s.ki * error + s.kp * error, 0.0), abs=1e-3)
    assert s.out > 0.0


def test_a_small_answer_makes_the_step_a_fifth():
    rig = settled(gain=0.15, autotune={"method": "open"})
    seen = []
    rig.plc.autotune(0, "start")
    rig.step()
    while rig.mode() == "autotune":
        seen += [rig.out()] if rig.out() not in seen else []
        rig.step()

    assert seen == [40.0, 50.0, 60.0]


@pytest.mark.parametrize("action", ["direct", "reverse"])
@pytest.mark.parametrize("hysteresis", [1, 4])
@pytest.mark.parametrize(
    ("gain", "time_constant", "dead_time", "half"),
    [(1.0, 20.0, 4.0, 50.0), (0.5, 60.0, 5.0, 50.0), (1.0, 20.0, 4.0, 30.0)],
)
def test_closed_loop_gains_follow_from_the_relays_cycle(gain, time_constant, dead_time, half, hysteresis, action):
    """Output 50 +- d on a first order plant with dead time L and a switching band h, at a sample's delay:

    A = K d - (K d - h) e^(-L/T), half a period is L + T ln((K d + A) / (K d - h)) (the plant being centred).
    """
    rig = settled(
        action,
        gain,
        time_constant,
        dead_time,
        "100 ms",
        out=50.0,
        autotune={"method": "closed", "hysteresis": hysteresis},
        output={"limits": [50 - half, 50 + half]},
    )
    found = tuned(rig)
    results = found["results"]

    def cycle(dead, band):
        swing = gain * half
        amplitude = swing - (swing - band) * math.exp(-dead / time_constant)
        turn = dead + time_constant * math.log((swing + amplitude) / (swing - band))
        return 4 * half / (math.pi * math.sqrt(amplitude**2 - band**2)), 2 * turn

    (ku, tu), (ku_late, tu_late) = cycle(dead_time, hysteresis), cycle(dead_time + 0.1, hysteresis)
    assert (found["done"], rig.log) == (True, [])
    assert 0.45 * ku_late * 0.97 <= results["proportional_gain"] <= 0.45 * ku * 1.03
    assert 0.60 * (tu - 0.2) <= results["reset_time"] <= 0.60 * (tu_late + 0.2)
    assert results["derivative_gain"] == pytest.approx(results["reset_time"] / 6, rel=1e-5)
    assert results["sample_rate"] == pytest.approx(max(0.014 * results["reset_time"] / 0.6, 0.1), abs=0.0006)


def test_the_hysteresis_is_in_percent_of_the_pv_limits():
    """On limits of 40 the band of 5 % is 2 units: the PV turns beyond it."""
    rig = settled(pv_range=(30, 70), out=50.0, autotune={"method": "closed", "hysteresis": 5})
    rig.plc.autotune(0, "start")
    rig.step(17)
    first = rig.out()
    while rig.out() == first:
        crossed = rig.states[0].pv
        rig.step()

    assert first == 100.0
    assert crossed - 50.0 < 2.0 + 1e-6
    assert rig.states[0].pv - 50.0 > 2.0


@pytest.mark.parametrize("method", ["open", "closed"])
def test_a_tuned_loop_settles(method):
    rig = settled(time_constant=30.0, dead_time=3.0, sample_rate="100 ms", autotune={"method": method})
    tuned(rig)
    rig.set("setpoint", 60)
    rig.run(600)

    assert rig.plants[0].value == pytest.approx(60.0, abs=0.05)


@pytest.mark.parametrize("method", ["open", "closed"])
def test_autotune_bears_noise(method):
    clean = tuned(settled(time_constant=30.0, dead_time=3.0, autotune={"method": method}))["results"]
    noisy = tuned(settled(time_constant=30.0, dead_time=3.0, noise=0.15, autotune={"method": method}))["results"]

    for name in ("proportional_gain", "reset_time"):
        assert noisy[name] == pytest.approx(clean[name], rel=0.3)


def test_the_output_stands_still_while_the_pv_is_listened_to():
    rig = settled(noise=0.5, autotune={"method": "closed"})
    before = rig.out()
    rig.plc.autotune(0, "start")
    outs = [out for (out,) in rig.trace(18, "out")]

    assert outs[:16] == [before] * 16
    assert outs[16] in {0.0, 100.0}


# --- conditions and ends ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "registers",
    [
        {"pv_upper": 0.0},
        {"pv_upper": math.nan},
        {"pv_upper": math.inf},
        {"output_upper": 0.0},
        {"output_upper": math.inf},
    ],
)
@pytest.mark.parametrize("method", ["open", "closed"])
def test_it_needs_ranges_of_pv_and_output(registers, method):
    rig = Rig(image=poked(image_of({"autotune": {"method": method}}), **registers))
    rig.auto().step(2)
    rig.plc.autotune(0, "start")
    rig.step(3)

    assert rig.mode() == "auto"
    assert "autotune refused: the PV limits" in rig.log[0][1]


def test_results_stand_in_the_registers_in_single_precision():
    rig = settled(autotune={"method": "open"})
    results = tuned(rig)["results"]
    own = rig.plc._loops[0]
    own.store_results(rig.states[0])

    for name in ("proportional_gain", "reset_time", "derivative_gain"):
        assert (
            number_of("DF", own.words[name])
            == results[name]
            == getattr(
                rig.states[0], {"proportional_gain": "gain", "reset_time": "reset", "derivative_gain": "rate"}[name]
            )
        )
    assert number_of("DS", own.words["sample_rate"]) == results["sample_rate"] * 1000
    rig.set("setpoint", 51)
    assert rig.states[0].gain == results["proportional_gain"], "a later write leaves the results alone"
    assert rig.plc.periods == [round(results["sample_rate"] * 1e6)]


def test_results_stay_within_what_the_registers_hold():
    """A plant without dead time at 100 ms: the sample rate would be far below 100 ms."""
    rig = settled(
        dead_time=0.0,
        time_constant=2000.0,
        gain=0.01,
        pv_range=(49, 51),
        sample_rate="100 ms",
        autotune={"method": "open"},
    )
    results = tuned(rig)["results"]

    assert results["sample_rate"] == 0.1
    assert results["proportional_gain"] == 10000.0
    assert rig.plc.error_words == {"DS1": 0}


@pytest.mark.parametrize(("moves", "told"), [(0.0, False), (0.002, False), (0.05, True), (-0.05, True)])
def test_an_open_loop_autotune_on_a_moving_pv_is_told(moves, told):
    """The answer rises by 0.25 a sample."""
    rig = settled(time_constant=20.0, dead_time=4.0, tuning={"proportional_gain": 0.01, "reset_time": 6000})
    rig.plants[0] = Moving(rig.plants[0], moves)
    rig.step(10)
    tuned(rig)
    assert any("the PV was moving when the autotune began" in text for text in map(str, rig.log)) is told


@pytest.mark.parametrize(("amplitude", "taken"), [(1e-5, 1e-5), (1e-6, 1e-6), (1e-7, 1e-6), (0.0, 1e-6)])
def test_a_swing_below_a_millionth_of_the_range_is_taken_for_that(monkeypatch, amplitude, taken):
    """Shares of the range of the PV; a swing of nothing would be an infinite gain."""
    found = []
    monkeypatch.setattr(bits, "relay_switch", lambda *_: 0)
    monkeypatch.setattr(bits, "write_results", lambda *values: found.append(values[2]))
    config = bits.Config(pv_low=-50.0, pv_high=150.0, out_low=0.0, out_high=80.0, tune_hysteresis=0.0)
    state = bits.State(tune_turns=bits.LAST_TURN, tune_swing=4 * amplitude * 200.0, period=1)
    bits.run_relay(config, state)
    ultimate = 2 * 80.0 / (math.pi * taken * 200.0)
    assert found == [pytest.approx(cycle_gains(0, ultimate, 1.0)[0])]


def test_a_relay_begins_anew_whatever_the_last_one_has_left():
    state = bits.State(tune_count=7, tune_turns=5, tune_relay_sign=1, tune_points=3, tune_swing=900.0)
    bits.begin_relay(state)
    cleared = state.tune_count, state.tune_turns, state.tune_relay_sign, state.tune_points, state.tune_swing
    assert cleared == (0, 0, 0, 0, 0)
