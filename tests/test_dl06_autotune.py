"""Both auto-tunes of the virtual DL06 on first-order plants with dead time, against the formulas.

Open loop. The regression line covers a tenth of the response, between about 10 % and 20 % of it or earlier, where a
first-order response has on average 1 - 0.1 of its steepest slope; the gain may thus be up to 10 % high. A window that
is a whole number of points moves it the other way by at most one point in that window. Its line meets the baseline
within half a sample of the dead time, plus what half a count of rounding makes of it.

Closed loop. The relay switches at the first sample behind the crossing, which adds between 0 and one sample to the dead
time: swing X = K M (1 - exp(-L/T)) and period 2 T ln(2 exp(L/T) - 1) bracket the results for L and L + Ts.
"""

from __future__ import annotations

import json
import math
from fractions import Fraction
from itertools import pairwise, product

import pytest

import pidcfg
from dl06_rig import Rig
from pidcfg.sim.controllers.dl06 import equation as bits
from pidcfg.sim.controllers.dl06.autotune import begin_relay, nearest_digit, write_results
from pidcfg.sim.controllers.dl06.equation import MODES, TUNE, TUNE_ERROR, TUNING, Config, State
from rig_plants import FirstOrder, Fixed, Moving


def until_tuned(rig, s, most=20000):
    for _ in range(most):
        rig.step()
        if s.pending & TUNE == 0:
            return
    raise AssertionError("auto-tune did not come to an end")


def open_loop(gain, time_constant, dead_time, ts, *, noise=0.0, reverse=0, out=1500.0, distance=300.0, **fields):
    rig = Rig(base=ts, noise=noise)
    g = -gain if reverse else gain
    plant = FirstOrder(g, time_constant, dead_time, initial=1000.0, offset=1000.0 - g * out)
    sp = 1000.0 + (-distance if reverse else distance)
    _, s = rig.add(plant, out=out, sp=sp, tune_open=1, reverse=reverse, **fields)
    rig.step(20)
    rig.tune()
    return rig, s


def closed_loop(gain, time_constant, dead_time, ts, *, noise=0.0, reverse=0, low=1000.0, high=3000.0, **fields):
    rig = Rig(base=ts, noise=noise)
    g = -gain if reverse else gain
    plant = FirstOrder(g, time_constant, dead_time, initial=2000.0, offset=2000.0 - g * 2000.0)
    _, s = rig.add(
        plant,
        "auto",
        out=2000.0,
        sp=2000.0,
        reverse=reverse,
        output_low_limit=low,
        output_high_limit=high,
        gain=0.5,
        reset=50.0,
        **fields,
    )
    rig.step(20)
    rig.tune()
    return rig, s


PLANTS = [
    (1.0, 20.0, 4.0, 0.5),
    (0.5, 20.0, 4.0, 0.5),
    (0.15, 20.0, 4.0, 0.5),  # answers 1.5 %: the step goes to 20 %
    (2.0, 60.0, 5.0, 1.0),
    (2.0, 60.0, 5.0, 0.05),  # fast sampling: points are averages of many samples
    (5.0, 100.0, 2.0, 0.1),
    (1.0, 10.0, 10.0, 0.5),  # as much dead time as lag
    (1.0, 240.0, 15.0, 2.0),
]


@pytest.mark.parametrize("reverse", [0, 1])
@pytest.mark.parametrize(("gain", "time_constant", "dead_time", "ts"), PLANTS)
def test_open_loop_gains_are_those_of_ziegler_and_nichols(gain, time_constant, dead_time, ts, reverse):
    rig, s = open_loop(gain, time_constant, dead_time, ts, reverse=reverse)
    until_tuned(rig, s)
    kc = 1.2 * time_constant / (gain * dead_time)

    assert (s.tune_done, rig.log) == (1, [])
    assert 0.95 * kc <= s.gain <= 1.10 * kc
    assert s.reset == pytest.approx(2.0 * dead_time, abs=0.5 * ts + 0.05 * dead_time)
    assert s.rate == pytest.approx(0.5 * dead_time, abs=0.25 * ts + 0.05 * dead_time)
    assert s.period / 1e6 == pytest.approx(max(0.056 * s.reset / 2.0, 0.05), abs=0.0064)


def test_open_loop_pi_leaves_the_rate_at_zero():
    rig, s = open_loop(1.0, 20.0, 4.0, 0.5, tune_pi=1, rate=3.0)
    until_tuned(rig, s)

    assert s.rate == 0.0
    assert s.gain == pytest.approx(0.9 * 20.0 / 4.0, rel=0.1)
    assert s.reset == pytest.approx(3.33 * 4.0, rel=0.05)
    assert s.period == pytest.approx(0.12 * 4.0e6, rel=0.05)


def test_open_loop_bears_noise():
    """Noise of 3 counts against a response of 410: a regression over some 6 points scatters by about 10 %."""
    gains, resets = [], []
    for seed in range(10):
        rig, s = open_loop(1.0, 20.0, 4.0, 0.5, noise=3.0)
        rig.random.seed(seed)
        until_tuned(rig, s)
        gains.append(s.gain / 6.0)
        resets.append(s.reset / 8.0)

    assert all(0.7 <= gain <= 1.3 for gain in gains)
    assert all(0.8 <= reset <= 1.3 for reset in resets)
    assert sum(gains) / len(gains) == pytest.approx(1.03, abs=0.10)


def test_an_integrating_process_is_tuned_from_its_constant_slope():
    class Integrator(Fixed):
        def step(self, output, dt):
            self.value += dt * 0.01 * (output - 1500.0)

    rig = Rig(base=0.5)
    _, s = rig.add(Integrator(1000.0), out=1500.0, sp=1400.0, tune_open=1)
    rig.step(5)
    rig.tune()
    until_tuned(rig, s)

    # without a dead time one sample takes its place: 1.2 / (0.01 * 0.5) is more than the word holds
    assert s.gain == 99.99
    assert s.reset == pytest.approx(1.0, abs=0.1)


def test_the_output_steps_by_ten_percent_and_returns():
    rig, s = open_loop(1.0, 20.0, 4.0, 0.5)
    outs = []
    while s.pending & TUNE:
        rig.step()
        outs.append(s.out)

    assert sorted(set(outs)) == [1500.0, 1910.0]
    assert outs[-1] == 1500.0


def test_a_small_response_makes_the_step_twenty_percent():
    rig, s = open_loop(0.15, 20.0, 4.0, 0.5)
    outs = []
    while s.pending & TUNE:
        rig.step()
        outs.append(s.out)

    assert sorted(set(outs)) == [1500.0, 1910.0, 2319.0]


@pytest.mark.parametrize("reverse", [0, 1])
@pytest.mark.parametrize(
    ("gain", "time_constant", "dead_time", "ts"),
    [
        (1.0, 20.0, 4.0, 0.5),
        (0.5, 20.0, 4.0, 0.1),
        (2.0, 60.0, 5.0, 0.5),
        (1.0, 10.0, 10.0, 0.2),
    ],
)
def test_closed_loop_gains_follow_from_the_relays_cycle(gain, time_constant, dead_time, ts, reverse):
    rig, s = closed_loop(gain, time_constant, dead_time, ts, reverse=reverse)
    until_tuned(rig, s)

    def cycle(dead):
        ratio = dead / time_constant
        return 4.0 / math.pi / (gain * (1 - math.exp(-ratio))), 2 * time_constant * math.log(2 * math.exp(ratio) - 1)

    (ku, tu), (ku_late, tu_late) = cycle(dead_time), cycle(dead_time + ts)
    rounding = 1.0 + 2.0 / (2000.0 * gain * (1 - math.exp(-dead_time / time_constant)))
    assert (s.tune_done, rig.log) == (1, [])
    assert 0.45 * ku_late / rounding - 0.005 <= s.gain <= 0.45 * ku * rounding + 0.005
    assert 0.60 * (tu - ts) - 0.05 <= s.reset <= 0.60 * (tu_late + ts) + 0.05
    assert s.rate == pytest.approx(s.reset / 6.0, abs=0.02)
    assert s.period == pytest.approx(0.014 * s.reset / 0.6 * 1e6, abs=5_000 + 0.014 * 0.05 / 0.6 * 1e6)


def test_a_relay_begins_anew_whatever_the_last_one_has_left():
    state = bits.State(tune_count=7, tune_turns=5, tune_relay_sign=1, tune_points=3, tune_swing=900.0)
    begin_relay(bits.Config(), state)
    cleared = state.tune_count, state.tune_turns, state.tune_relay_sign, state.tune_points, state.tune_swing
    assert cleared == (0, 0, 0, 0, 0)


def test_closed_loop_pi_leaves_the_rate_at_zero():
    rig, s = closed_loop(1.0, 20.0, 4.0, 0.5, tune_pi=1)
    until_tuned(rig, s)
    other, pid = closed_loop(1.0, 20.0, 4.0, 0.5)
    until_tuned(other, pid)

    assert s.rate == 0.0
    assert s.gain == pytest.approx(pid.gain * 0.30 / 0.45, abs=0.01)
    assert s.reset == pytest.approx(pid.reset / 0.60, abs=0.2)
    assert s.period == pytest.approx(pid.period * 0.03 / 0.014, rel=0.05)


@pytest.mark.parametrize("seed", range(5))
def test_closed_loop_bears_noise(seed):
    clean, reference = closed_loop(1.0, 20.0, 4.0, 0.5)
    until_tuned(clean, reference)
    rig, s = closed_loop(1.0, 20.0, 4.0, 0.5, noise=5.0)
    rig.random.seed(seed)
    until_tuned(rig, s)

    # D60: 4 M/(pi X) with both peak to peak, X as it is measured
    assert s.gain == pytest.approx(0.45 * 4.0 * 2000.0 / (math.pi * s.tune_swing / 2.0), abs=0.0051)
    # the band of 15 counts delays each switch of a PV that crosses at about 45 counts a second by one sample at most
    assert s.gain == pytest.approx(reference.gain, rel=0.12)
    assert s.reset == pytest.approx(reference.reset, rel=0.12)


def test_the_relay_takes_three_full_cycles_between_the_limits_and_gives_the_bias_back():
    rig, s = closed_loop(1.0, 20.0, 4.0, 0.5)
    outs = []
    while s.pending & TUNE:
        rig.step()
        outs.append(s.out)
    relay = [out for out in outs if out in (1000.0, 3000.0)]
    switches = sum(a != b for a, b in pairwise(relay))

    assert switches == 6, "the seventh ends the third cycle, and the controller goes on in the same sample"
    assert outs[-1] == pytest.approx(2000.0, abs=s.gain * 4.0 * 100)
    assert s.status & MODES == bits.AUTO


def test_results_are_whole_digits_of_their_words():
    rig, s = open_loop(1.0, 20.0, 4.0, 0.5, reset_unit=60.0, reset_step=0.01)
    until_tuned(rig, s)

    assert s.gain * 100 == pytest.approx(round(s.gain * 100), abs=1e-9)
    assert s.reset / 60 * 100 == pytest.approx(round(s.reset / 60 * 100), abs=1e-9)
    assert s.reset == pytest.approx(8.0, abs=0.4)
    assert s.period % 10_000 == 0


def test_digits_of_every_cycle_are_those_of_exact_fractions():
    for half_samples, ticks in product(range(2, 200), (50_000, 250_000, 300_000, 750_000)):
        seconds, exact = half_samples / 2 * ticks / 1e6, Fraction(half_samples * ticks, 2_000_000)
        assert nearest_digit(0.6 * seconds / (60.0 * 0.01)) == round(exact * Fraction("0.6") / 60 * 100)


@pytest.mark.parametrize(("period", "hundredths"), [(1.5, 2), (2.5, 2), (3.5, 4), (1.49999, 1)])
def test_a_result_half_way_between_two_digits_is_rounded_to_the_even_one(period, hundredths):
    """0.6 times 1.5 s are 0.9 s, 1.5 hundredths of a minute, which binary fractions come to a little above or below."""
    rig, s = open_loop(1.0, 20.0, 4.0, 0.5, reset_unit=60.0, reset_step=0.01)
    write_results(rig.configs[0], s, 1.0, 0.6 * period, 0.0, 0.5)

    assert s.reset == pytest.approx(hundredths * 0.6, rel=1e-12)


def test_the_sample_rate_stays_above_the_least_of_its_number_of_loops():
    rig, s = open_loop(2.0, 60.0, 0.5, 0.05, min_period=100_000)
    until_tuned(rig, s)

    assert s.period == 100_000


@pytest.mark.parametrize(("moves", "told"), [(0.0, False), (0.3, False), (2.0, True)])
def test_an_open_loop_auto_tune_on_a_moving_pv_is_told(moves, told):
    """The answer rises by 10 counts a sample (D623)."""
    rig, s = open_loop(1.0, 20.0, 4.0, 0.5, distance=600.0)
    rig.plants[0] = Moving(rig.plants[0], moves)
    until_tuned(rig, s)
    assert any("the PV was moving when the auto-tune began" in text for text in map(str, rig.log)) is told


def test_results_below_one_digit_are_one_digit_since_0_would_switch_them_off():
    rig, s = open_loop(1.0, 20.0, 4.0, 0.5, reset_unit=60.0, reset_step=0.01)
    write_results(rig.configs[0], s, 0.0001, 0.0001, 0.0001, 0.5)

    assert (s.gain, s.reset, s.rate) == (0.01, pytest.approx(0.6), 0.0)


def test_a_relay_that_nothing_answers_is_given_up_and_the_controller_goes_on_as_before():
    rig = Rig(base=5.0)
    _, s = rig.add(
        Fixed(2000.0),
        "auto",
        out=1500.0,
        bias=1500.0,
        sp=2000.0,
        output_low_limit=1000.0,
        output_high_limit=3000.0,
        gain=0.5,
    )
    rig.step(3)
    bias = s.bias
    rig.tune()
    until_tuned(rig, s)

    assert rig.log == [(0, "auto-tune stopped: the PV does not answer")]
    assert s.status & (TUNING | TUNE_ERROR) == TUNE_ERROR
    assert (s.bias, s.unrounded_output) == (bias, bias)


@pytest.mark.parametrize(
    ("results", "stored"),
    [
        ((1e9, 1e9, 1e9, 1e9), (99.99, 999.8, 99.99, 99_990_000)),
        ((99.99, 999.8, 99.99, 99.99), (99.99, 999.8, 99.99, 99_990_000)),
        ((99.98, 999.7, 99.98, 99.98), (99.98, 999.7, 99.98, 99_980_000)),
        ((0.0, 0.0, -5.0, 0.0), (0.01, 0.1, 0.0, 50_000)),
        ((0.01, 0.1, 0.0, 0.05), (0.01, 0.1, 0.0, 50_000)),
        ((0.02, 0.2, 0.01, 0.06), (0.02, 0.2, 0.01, 60_000)),
    ],
)
def test_results_are_stored_within_what_their_words_hold(results, stored):
    s = State()
    write_results(Config(reset_unit=1.0, reset_step=0.1, min_period=50_000), s, *results)
    assert (s.gain, s.reset, s.rate, s.period) == pytest.approx(stored)


DISTANCES = [
    # data format, root, method, what DL299 says, the last distance with a start and the first without one
    ("12-bit unipolar", False, "open", "205 counts", 205, 204),
    ("12-bit bipolar", False, "open", "410 counts", 410, 409),
    ("15-bit unipolar", False, "open", "1641 counts", 1641, 1640),
    ("15-bit bipolar", False, "open", "3281 counts", 3281, 3280),
    ("16-bit unipolar", False, "open", "3281 counts", 3281, 3280),
    ("12-bit unipolar", False, "closed", "205 counts", 205, 206),
    ("15-bit unipolar", False, "closed", "1640 counts", 1640, 1641),
    ("15-bit bipolar", False, "closed", "3280 counts", 3280, 3281),
    ("16-bit unipolar", False, "closed", "3280 counts", 3280, 3281),
    # the root of the PV: 205 / 4095 of sqrt(4095) are 3.2036; the root of 1353 is 36.783, that of 1354 36.797
    ("12-bit unipolar", True, "open", "3.21 counts of the set point's scale", 1600 - 1353, 1600 - 1354),
    ("12-bit unipolar", True, "closed", "3.2 counts of the set point's scale", 1600 - 1354, 1600 - 1353),
]


@pytest.mark.parametrize(("form", "root", "method", "named", "starts", "refused"), DISTANCES)
def test_an_auto_tune_starts_at_the_distance_that_validate_names(form, root, method, named, starts, refused):
    loop = {
        "name": "L",
        "mode": "manual" if method == "open" else "auto",
        "sample_rate": 1,
        "action": "direct",
        "bumpless": "II",
        "tuning": {"gain": 1, "reset": 100},
        "pv": {"format": form, "square_root": root},
        "setpoint": {"value": 40 if root else 4000},
        "output": {"limits": [100, 4000]},
        "autotune": {"method": method},
    }
    text = json.dumps({"pidcfg": 1, "vendor": "dl06", "plc": {"loop_table": "V2000"}, "loops": [loop]})
    (message,) = (f.message for f in pidcfg.check(text, name="c.yaml").findings if f.code == "DL299")
    errors = {}
    for distance in (starts, refused):
        scenario = {
            "pidcfg": 1,
            "scenario": "start",
            "config": "c.yaml",
            "duration": 30,
            "signals": {"pv": (1600 if root else 4000) - distance},
            "connect": {"L.PV": "pv"},
            "events": [{"at": 10, "loop": "L", "autotune": "start"}],
        }
        run = pidcfg.simulate(json.dumps(scenario), name="s.yaml", files={"c.yaml": text}, reference=False)
        errors[distance] = run.to_json()["loops"]["L"]["flags"]["autotune_error"]

    assert named in message
    assert errors == {starts: False, refused: True}
