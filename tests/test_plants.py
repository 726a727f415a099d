"""Plants against their closed-form solutions, dead time to the step, and the behaviour of valves."""

from __future__ import annotations

import json
import math
import random
import re
from array import array
from pathlib import Path
from types import SimpleNamespace as Facts

import pytest
from click.testing import CliRunner

from pidcfg import api
from pidcfg.cli.main import cli
from pidcfg.sim.engine import plants as noise
from pidcfg.sim.engine.choice import fast_normals
from pidcfg.sim.engine.influence import Influence
from pidcfg.sim.engine.plants import (
    MODELS,
    Noise,
    Plant,
    add_noise,
    draw_normals,
    draws_as_python,
    second_order_matrix,
    seed_words,
    set_parameters,
    settle_at,
    step_plants,
    unseeded_state,
)
from pidcfg.sim.engine.run import prepare_network
from pidcfg.sim.judgement.meters import (
    NEVER,
    Band,
    Gauge,
    Meter,
    begin_meter,
    begin_step,
    end_step,
    loop_metrics,
    measure_loop,
    overshoot,
    read_gauges,
    rise_time,
    settling_time,
    watch_bands,
)
from pidcfg.text.source import read_document
from scenario_rig import Controller, scenario

# --- Plants against their closed-form solutions, dead time to the step, and the behaviour of valves -------------------

EXAMPLES = Path(__file__).parents[1] / "examples" / "dl06"
TOLERANCE = 1e-12
"""Relative to a response of order 1: the steps are exact, only rounding adds up."""


def respond(model, inputs, dt=0.1, dead=0, initial=0.0, **numbers):
    """The values after each step, from rest at ``initial``."""
    plant = Plant(MODELS[model], slot=1, measured=1, source=0, length=dead)
    set_parameters(plant, {"gain": 1.0, "load": 0.0, "noise": 0.0, "stiction": 0.0, **numbers}, dt)
    delay = [math.nan] * dead
    settle_at(plant, initial, 0.0, delay)
    signal_values, values = [0.0, plant.y], []
    for k, u in enumerate(inputs):
        signal_values[0] = u
        step_plants(k + 1, 1, [plant], delay, signal_values, [], [], [0.0])
        values.append(signal_values[1])
    return values


def assert_follows(values, wanted, dt=0.1):
    for k, value in enumerate(values, 1):
        assert value == pytest.approx(wanted(k * dt), rel=0, abs=TOLERANCE), k


def test_first_order_follows_its_exponential():
    values = respond("first_order", [2.0] * 200, time_constant=3.0, gain=1.5, load=0.5, initial=0.5)
    assert_follows(values, lambda t: 0.5 + 3.0 * (1 - math.exp(-t / 3)))


def test_first_order_is_exact_however_long_the_step_is():
    values = respond("first_order", [1.0] * 5, dt=50.0, time_constant=3.0)
    assert_follows(values, lambda t: 1 - math.exp(-t / 3), dt=50.0)


def test_two_lags_in_series_follow_their_sum_of_exponentials():
    values = respond("second_order", [1.0] * 300, first=2.0, second=5.0, gain=2.0)
    assert_follows(values, lambda t: 2 * (1 - (5 * math.exp(-t / 5) - 2 * math.exp(-t / 2)) / 3))


def test_two_equal_lags_follow_the_critically_damped_solution():
    values = respond("second_order", [1.0] * 300, first=2.0, second=2.0)
    assert_follows(values, lambda t: 1 - (1 + t / 2) * math.exp(-t / 2))


def test_two_nearly_equal_lags_lose_no_digits():
    values = respond("second_order", [1.0] * 300, first=2.0, second=2.0 + 1e-9)
    assert values == pytest.approx(respond("second_order", [1.0] * 300, first=2.0, second=2.0), rel=0, abs=1e-9)


def test_a_damping_below_one_swings_as_the_textbook_says():
    zeta, period = 0.2, 1.5
    w = math.sqrt(1 - zeta**2) / period
    values = respond("second_order", [1.0] * 300, time_constant=period, damping=zeta)
    shift = zeta / math.sqrt(1 - zeta**2)
    assert_follows(values, lambda t: 1 - math.exp(-zeta * t / period) * (math.cos(w * t) + shift * math.sin(w * t)))
    assert max(values) == pytest.approx(1 + math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2)), abs=1e-3)


@pytest.mark.parametrize(("squared", "damped"), [(1e-12, 2e-6), (1e-12, 1e-7), (1e18, 2e9), (1e-6, 1e6)])
def test_second_order_coefficients_are_finite_where_exponentials_overflow(squared, damped):
    assert all(math.isfinite(value) for value in second_order_matrix(100.0, squared, damped))


def test_integrator_with_load_is_a_straight_line():
    values = respond("integrator", [3.0] * 100, gain=-0.02, load=1.0, initial=50.0)
    assert values == pytest.approx([50 + (1.0 - 0.06) * 0.1 * k for k in range(1, 101)], rel=1e-13)


def test_integrator_stops_at_its_limits_and_leaves_them_at_once():
    values = respond("integrator", [1.0] * 6 + [-1.0] * 6 + [1.0], dt=1.0, low=0.0, high=4.0)
    assert values == [1, 2, 3, 4, 4, 4, 3, 2, 1, 0, 0, 0, 1]


def test_lead_lag_jumps_by_the_ratio_and_settles_at_the_gain():
    values = respond("lead_lag", [1.0] * 400, lead=10.0, lag=4.0, gain=2.0)
    assert_follows(values, lambda t: 2 * (1 + (10 / 4 - 1) * math.exp(-t / 4)))


def test_dead_time_alone_repeats_its_input_after_exactly_its_steps():
    inputs = [float(k * k) for k in range(1, 21)]
    assert respond("dead_time", inputs, dead=7, gain=2.0, load=1.0, initial=1.0) == (
        [1.0] * 7 + [2 * u + 1 for u in inputs[:13]]
    )


@pytest.mark.parametrize("model", ["first_order", "second_order", "integrator", "lead_lag", "valve"])
@pytest.mark.parametrize("dead", [1, 2, 13])
def test_dead_time_shifts_the_response_by_whole_steps_and_changes_nothing_else(model, dead):
    own = {"time_constant": 2.0, "damping": 0.7, "lag": 2.0, "lead": 1.0}
    inputs = [0.0, 1.0, 3.0, -2.0, *([1.0] * 30)]
    direct = respond(model, inputs, **own)
    assert respond(model, inputs, dead=dead, **own) == [0.0] * dead + direct[:-dead]


@pytest.mark.parametrize("model", ["first_order", "second_order", "lead_lag", "dead_time", "valve"])
def test_a_plant_rests_at_its_initial_value_with_the_input_that_holds_it(model):
    own = {"time_constant": 2.0, "damping": 0.7, "lag": 2.0, "lead": 1.0, "gain": 4.0, "load": 3.0}
    values = respond(model, [8.0] * 50, dead=3, initial=35.0, **own)
    assert values == pytest.approx([35.0] * 50, rel=1e-14)


def test_the_delay_line_of_an_integrator_is_full_of_the_input_that_balances_the_load():
    values = respond("integrator", [0.0] * 5, dt=1.0, dead=3, gain=-0.02, load=1.0, initial=50.0)
    assert values == [50, 50, 50, 51, 52]


def test_without_an_initial_value_a_plant_rests_where_its_input_holds_it():
    plant = Plant(MODELS["first_order"], 1, 1, 0, length=2)
    set_parameters(plant, {"gain": 2.0, "load": 1.0, "noise": 0.0, "time_constant": 5.0}, 0.1)
    delay = [0.0, 0.0]
    settle_at(plant, None, 7.0, delay)
    assert (plant.y, delay) == (15.0, [7.0, 7.0])


def test_the_input_at_rest_is_the_very_number_and_not_one_that_rounding_gives():
    plant = Plant(MODELS["dead_time"], 1, 1, 0, length=1, gain=3.0)
    delay = [0.0]
    settle_at(plant, None, 0.1, delay)
    assert delay == [0.1]
    assert (3.0 * 0.1) / 3.0 != 0.1


def test_a_plant_without_gain_cannot_be_held_and_goes_to_its_load():
    values = respond("first_order", [5.0] * 400, gain=0.0, load=2.0, initial=9.0, time_constant=1.0)
    assert values[0] == pytest.approx(2 + 7 * math.exp(-0.1), abs=TOLERANCE)
    assert values[-1] == pytest.approx(2.0, abs=1e-9)


def test_a_valve_moves_no_faster_than_its_rate():
    values = respond("valve", [10.0] * 5 + [0.0] * 3, dt=0.5, rate_limit=5.0)
    assert values == [2.5, 5.0, 7.5, 10.0, 10.0, 7.5, 5.0, 2.5]


def test_a_sticking_valve_moves_only_when_asked_for_more_than_its_band_and_then_all_the_way():
    assert respond("valve", [0.5, 1.0, 1.001, 1.5, 2.1, 1.2], stiction=1.0) == [0.0, 0.0, 1.001, 1.001, 2.1, 2.1]


def test_a_moving_valve_keeps_moving_inside_its_band_until_it_has_arrived():
    values = respond("valve", [3.0, 3.0, 3.0, 3.0, 3.5], dt=1.0, stiction=2.0, rate_limit=1.0)
    assert values == [1.0, 2.0, 3.0, 3.0, 3.0]


@pytest.mark.parametrize("dt", [0.01, 0.1, 0.3, 0.7, 1.0, 2.5])
def test_pulses_have_the_mean_of_their_input_at_any_base_step_and_are_on_at_the_beginning(dt):
    """Of a period of 10 s an input of 34.56 % has 3.456 s, which the resolution makes 3.46 s."""
    steps = round(70 / dt)
    values = respond("pulses", [34.56] * steps, dt=dt, period=10.0, resolution=0.01, gain=2.0, load=0.5)
    assert sum((value - 0.5) / 2 for value in values) * dt == pytest.approx(7 * 3.46, abs=1e-6)
    whole = int(3.4 / dt)
    assert values[:whole] == pytest.approx([2.5] * whole)
    off = [value for k, value in enumerate(values) if 3.5 <= k * dt % 10 <= 10 - dt - 1e-9]
    assert off == pytest.approx([0.5] * len(off))


def test_pulses_take_their_input_at_the_beginning_of_a_period_alone():
    values = respond("pulses", [50.0, *[0.0] * 9, *[100.0] * 10, *[-5.0] * 10, *[130.0] * 10], dt=1.0, period=10.0)
    assert values == [*[1.0] * 5, *[0.0] * 5, *[1.0] * 10, *[0.0] * 10, *[1.0] * 10]


def test_the_time_on_is_rounded_to_the_resolution_a_thousandth_of_the_period_without_one():
    for resolution, wanted in ({}, 3.33), ({"resolution": 0.5}, 3.5), ({"resolution": 10.0}, 0.0):
        values = respond("pulses", [33.333] * 100, period=10.0, **resolution)
        assert sum(values) * 0.1 == pytest.approx(wanted)


def test_pulses_at_rest_are_their_mean():
    plant = Plant(MODELS["pulses"], slot=1, measured=1, source=0)
    set_parameters(plant, {"gain": 4.0, "load": 1.0, "noise": 0.0, "period": 10.0}, 0.1)
    settle_at(plant, None, 25.0, [])
    assert plant.y == 2.0


PULSES = {
    "pidcfg": 1,
    "scenario": "pulses",
    "config": "x",
    "duration": 100,
    "plants": [{"name": "RELAY", "model": "pulses", "input": "TIC.OUT", "period": 10}],
    "connect": {"TIC.PV": "RELAY"},
}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"period": None}, "pulses needs period"),
        ({"period": 0}, "period is 0 s; it must be above 0 s"),
        ({"resolution": 0}, "resolution is 0 s; it must be above 0 s"),
        ({"resolution": 11}, "the resolution, 11 s, is above the period, 10 s"),
        ({"dead_time": 1}, "pulses have no dead time"),
        ({"stiction": 1}, "pulses has no stiction"),
        ({"model": "first_order", "time_constant": 5}, "first_order has no period"),
        ({"period": 1.5}, "the period of RELAY, 1.5 s, is not 2 base steps of 1 s"),
    ],
)
def test_pulses_that_cannot_be_are_refused(change, says, tmp_path):
    plant = {k: v for k, v in {**PULSES["plants"][0], **change}.items() if v is not None}
    plant["input"] = "TIC-201.OUT"
    text = {**PULSES, "config": str(EXAMPLES / "oven.yaml"), "plants": [plant], "connect": {"TIC-201.PV": "RELAY"}}
    (tmp_path / "s.scenario.yaml").write_text(json.dumps(text), "utf-8")
    result = CliRunner().invoke(cli, ["simulate", str(tmp_path / "s.scenario.yaml")])
    assert result.exit_code == 2
    assert says in result.output


RIPPLE = """
pidcfg: 1
scenario: A kettle that goes up and down with its pulses
config: {config}
duration: 1 h
plants:
  - {{name: RELAY, model: pulses, input: TIC-301.OUT, period: 60}}
  - {{name: PRODUCT, model: first_order, input: RELAY * 100, load: 20, time_constant: 300, dead_time: 5, initial: 20}}
connect: {{TIC-301.PV: PRODUCT}}
events:
  - {{at: 60, loop: TIC-301, set: {{setpoint: 60}}}}
"""


def test_the_ripple_of_pulses_is_no_oscillation_of_the_loop():
    text = RIPPLE.format(config=EXAMPLES / "kettle.yaml")
    (found,) = [check for check in api.simulate(text.encode()).to_json()["standing"] if check["kind"] == "oscillates"]
    assert found["verdict"] == "not-judged"
    assert "it is the ripple of its pulses" in found["text"]


def test_noise_belongs_to_the_measurement_and_not_to_the_plant():
    plant = Plant(MODELS["dead_time"], slot=0, measured=1, sigma=0.5, column=1, y=3.0)
    quiet = Plant(MODELS["dead_time"], slot=2, measured=2, y=4.0)
    signal_values = [3.0, 0.0, 4.0]
    add_noise(1, 2, [plant, quiet], [9.0, 9.0, 9.0, -2.0], signal_values)
    assert signal_values == [3.0, 2.0, 4.0]
    assert plant.y == 3.0


@pytest.mark.parametrize(
    ("text", "longest"),
    [
        ("{model: first_order, gain: 0.001, time_constant: 3}", 3.0),
        ("{model: integrator, gain: 0.1}", 10.0),
        ("{model: integrator, gain: -0.1, dead_time: 12}", 12.0),
        ("{model: integrator, gain: 0}", 0.0),
        ("{model: second_order, time_constants: [2, 5]}", 5.0),
        ("{model: lead_lag, lead: 9, lag: 4}", 4.0),
    ],
)
def test_the_longest_time_of_a_network_is_a_lag_a_dead_time_or_what_an_integrator_takes_for_1(text, longest):
    net = prepare_network(scenario(f"plants:\n  A: {text}\n  B: {{model: dead_time}}\n"), Controller.load())
    assert net.longest_time() == longest


# --- Noise of transmitters: whoever draws it, the numbers are those of `random.gauss`, to the bit ---------------------

COUNTS = (1, 2, 3, 700, 1, 625)
"""Odd ones leave the second number of a pair for the next call."""


def gauss(seed, count):
    source = random.Random(seed)
    return array("d", [source.gauss(0.0, 1.0) for _ in range(count)])


@pytest.fixture(scope="module")
def fast():
    pytest.importorskip("numba")
    return fast_normals()


def by_parts(drawn, counts=COUNTS):
    whole = array("d")
    for count in counts:
        whole.extend(drawn.draw_rows(count))
    return whole


def test_the_kernel_as_it_is_written_draws_what_python_draws():
    assert by_parts(Noise(["a"], draw_normals)).tobytes() == gauss("a", sum(COUNTS)).tobytes()


def test_the_compiled_kernel_draws_what_python_draws(fast):
    assert by_parts(Noise(["a"], fast), [*COUNTS, 20_001]).tobytes() == gauss("a", sum(COUNTS) + 20_001).tobytes()


def test_each_column_has_a_source_of_its_own(fast):
    wanted = array("d", bytes(8 * 3 * 500))
    for column, seed in enumerate("abc"):
        wanted[column::3] = gauss(seed, 500)

    for drawn in (Noise([*"abc"]), Noise([*"abc"], fast)):
        assert by_parts(drawn, (1, 2, 497)).tobytes() == wanted.tobytes()


@pytest.mark.parametrize("seed", ["", "a", "9223372036854775807/TIC-101", "ä" * 2500])
def test_a_seed_gives_the_state_that_python_makes_of_it(seed):
    key, state, spare = unseeded_state(seed)
    seed_words(key, state)
    assert (3, tuple(state), None) == random.Random(seed).getstate()
    assert spare.tolist() == [0.0, 0.0]


def test_a_state_with_the_second_number_of_a_pair_goes_on_with_it():
    source = random.Random(3)
    source.gauss(0.0, 1.0)
    _, words, second = source.getstate()
    drawn = array("d", bytes(8 * 5))
    draw_normals(5, 0, 1, [], array("q", words), array("d", [second, 1.0]), drawn)

    assert drawn.tolist() == [source.gauss(0.0, 1.0) for _ in range(5)]


def test_without_noise_there_are_no_numbers():
    assert len(Noise([]).draw_rows(100)) == 0


@pytest.mark.parametrize("wrong", [0, noise.TRIED_NUMBERS - 1])
def test_one_number_that_is_off_by_its_last_bit_is_seen_and_python_draws(wrong):
    def off(*words):
        done, drawn = draw_normals(*words), words[-1]
        drawn[wrong] = math.nextafter(drawn[wrong], 9.0)
        return done

    assert draws_as_python(draw_normals)
    assert not draws_as_python(off)


# --- The metrics of a loop, worked out sample by sample by hand: each at its limits -----------------------------------


def measured(pvs, *, before=0.0, after=10.0, event=2, period=0, share=0.1, control=1, set_points=None, until=None):
    """A meter and a band after such PVs, 0 up to the event and from there on one a base step; the set point steps.

    Something else moves the loop at base step ``until``.
    """
    m, band = Meter(0, 1, 2, in_control=control), Band(0, share)
    begin_meter(m, [before, before, 0.0])
    for k, pv in enumerate([before] * event + pvs):
        sp = before if k < event else set_points[k - event] if set_points else after
        if k == event:
            begin_step(m, k, before, period, [before, before, 0.0])
        if k == until:
            end_step(m, k)
        signal_values = [pv, sp, 0.0]
        measure_loop(k, m, signal_values)
        watch_bands(k, [band], [m], signal_values)
    return m, band


@pytest.mark.parametrize(
    ("pvs", "time"),
    [
        ([0, 0.99, 1.0, 5, 8.99, 9.0], 3.0),
        ([0, 1.0, 1.0, 9.0, 9.5], 2.0),
        ([9.0], 0.0),
        ([0, 1.0, 8.99], None),
        ([0, 5, 0, 5, 9.5], 3.0),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_pv_rises_from_a_tenth_to_nine_tenths_of_the_step_up_or_down(pvs, time, sign):
    m, _ = measured([20 + sign * pv for pv in pvs], before=20.0, after=20.0 + sign * 10)
    assert rise_time(m, 0.5) == (None if time is None else time / 2)


@pytest.mark.parametrize(
    ("pvs", "time"),
    [
        ([0, 5, 9.0, 9.5], 1.0),
        ([0, 5, 8.99, 9.5], 1.5),
        ([0, 11.0, 10.0], 0.5),
        ([0, 11.01, 10.0], 1.0),
        ([0, 11.01, 11.01], None),
        ([10.0, 9.5, 10.0], 0.0),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_pv_has_settled_when_it_stays_within_the_band(pvs, time, sign):
    m, band = measured([20 + sign * pv for pv in pvs], before=20.0, after=20.0 + sign * 10)
    assert settling_time(m, band, 2 + len(pvs) - 1, 0.5) == time


def test_a_step_at_the_very_beginning_has_a_rise_time_of_its_own():
    m, _ = measured([9.0, 0.0, 9.0], event=0)
    assert (rise_time(m, 0.5), m.rise_from, m.rise_to) == (0.0, 0, 0)
    m, _ = measured([1.0, 9.0, 9.5], event=0)
    assert rise_time(m, 0.5) == 0.5


def test_an_earlier_step_and_a_loop_that_left_auto_settle_nothing():
    m, band = measured([10.0, 10.0])
    band.last_outside = 1
    assert settling_time(m, band, 3, 1.0) == 0.0
    m.in_control, m.control_since = 0, 3
    band.last_outside = 2
    assert settling_time(m, band, 9, 1.0) is None
    band.last_outside = 1
    assert settling_time(m, band, 9, 1.0) == 0.0
    m.has_step = 0
    assert settling_time(m, band, 9, 1.0) is None


@pytest.mark.parametrize(
    ("pvs", "past"), [([0, 10, 12.5, 9], 25.0), ([0, 9.9], 0.0), ([0, 10.0], 0.0), ([0, -5, 10.5], 5.0)]
)
@pytest.mark.parametrize("sign", [1, -1])
def test_overshoot_is_a_share_of_the_step(pvs, past, sign):
    m, band = measured([20 + sign * pv for pv in pvs], before=20.0, after=20.0 + sign * 10, share=9.0)
    assert overshoot(m, band) == pytest.approx(past)


@pytest.mark.parametrize(
    ("until", "past", "rise", "settled"),
    [
        (1, 50.0, 3.0, 5.0),  # before the step, and with it: no end
        (2, 50.0, 3.0, 5.0),
        (3, None, None, None),
        (4, None, None, None),
        (5, None, None, None),
        (6, 0.0, 3.0, 3.0),
        (7, None, 3.0, None),
        (8, 50.0, 3.0, 5.0),
        (9, 50.0, 3.0, 5.0),
    ],
)
def test_a_step_is_measured_up_to_the_next_event(until, past, rise, settled):
    m, band = measured([1.0, 5.0, 8.0, 9.0, 15.0, 10.0, 10.0, *[20.0, 0.0] * (until == 9)], until=until)
    assert (overshoot(m, band), rise_time(m, 1.0), settling_time(m, band, 99, 1.0)) == (past, rise, settled)


def test_of_two_events_the_first_ends_a_step_and_a_new_step_begins_anew():
    m, _ = measured([1.0, 9.0])
    end_step(m, 5)
    end_step(m, 7)
    assert m.step_until == 5
    begin_step(m, 8, 0.0, 0, [0.0, 0.0, 0.0])
    assert m.step_until == NEVER


@pytest.mark.parametrize(("period", "after"), [(1, 8.0), (2, 9.0), (3, 9.0)])
def test_a_set_point_that_is_limited_a_sample_later_is_the_one_that_is_stepped_to(period, after):
    m, _ = measured([0.0, 0.0, 0.0, 0.0], period=period, set_points=[10.0, 8.0, 9.0, 9.0])
    assert m.sp_after == after


def test_nothing_is_a_step_where_the_set_point_stays_or_the_loop_is_not_in_control():
    for given in ({"after": 0.0}, {"control": 0}):
        m, band = measured([0.0, 5.0], **given)
        assert (overshoot(m, band), rise_time(m, 1.0), settling_time(m, band, 3, 1.0)) == (None, None, None)


def test_the_integrals_count_base_steps_in_control_and_time_in_s():
    m = Meter(0, 1, 2, in_control=1)
    begin_meter(m, [0.0, 0.0, 5.0])
    for k, (pv, sp, out) in enumerate([(1, 3, 5), (3, 3, 8), (6, 3, 8), (4, 2, 2)]):
        measure_loop(k, m, [float(pv), float(sp), float(out)])
    found = loop_metrics(m, Band(0, 0.05), 3, 0.5, [4.0, 2.0])

    assert (found["iae"], found["ise"], found["itae"]) == (7 * 0.5, 17 * 0.5, 12 * 0.25)
    assert (found["total_variation"], found["final_error"]) == (9.0, -2.0)
    assert (m.pv_low, m.pv_high, m.sp_low, m.sp_high, m.out_low, m.out_high) == (0, 6, 0, 3, 2, 8)


@pytest.mark.parametrize("steps", [0, 1, 2])
def test_a_single_base_step_in_control_has_integrals(steps):
    found = loop_metrics(Meter(0, 1, 2, control_steps=steps), Band(0, 0.05), 9, 1.0, [4.0, 2.0])
    assert {found[name] for name in ("iae", "ise", "itae")} == {0.0 if steps else None}


def test_a_loop_that_was_never_in_control_has_no_integrals_and_no_final_error():
    found = loop_metrics(Meter(0, 1, 2), Band(0, 0.05), 9, 1.0, [4.0, 2.0])
    assert {name for name, value in found.items() if value is not None} == {"total_variation"}


@pytest.mark.parametrize(("first", "last", "seen"), [(0, 9, (1, 5)), (1, 3, (2, 4)), (4, 4, (1, 1)), (2, 2, (4, 4))])
def test_a_window_has_both_its_ends(first, last, seen):
    gauge = Gauge(1, first=first, last=last)
    for k, value in enumerate([5.0, 2.0, 4.0, 3.0, 1.0]):
        read_gauges(k, [gauge], [-9.0, value])
    assert (gauge.low, gauge.high) == seen


def test_an_event_that_changes_nothing_concerns_no_loop():
    """Another event of the same words may change something."""
    configs = [Facts(out_slot=0, pv_slot=1, sp_slot=2), Facts(out_slot=3, pv_slot=4, sp_slot=5)]
    event, same = (Facts(plc=None, disturb=None, loop="A", pv=None, set={"setpoint": 50}) for _ in range(2))
    influence = Influence(Facts(), Facts(configs=configs, loops=["A", "B"]), idle_events=[event])

    assert [influence.can_move(one, loop) for one in (event, same) for loop in (0, 1)] == [False, False, True, False]


def test_nothing_is_known_of_a_loop_before_its_first_base_step():
    """−1 is not yet, or never; every sum and every bit is 0."""
    meter = Meter(0, 0, 0)
    known = {name: value for name in Meter.__slots__ if (value := getattr(meter, name)) != 0}
    not_yet = (
        "status",
        "aux_status",
        "event_at",
        "rise_from",
        "rise_to",
        "left_at",
        "missed_at",
        "blind_from",
        "cut_from",
    )
    later = ("step_until", "watch_from", "window_start", "window_middle", "last_third", "swings_from")
    assert known == {
        **dict.fromkeys((*not_yet, "extreme_at", "last_outside", "reached_at"), -1),
        **dict.fromkeys(later, NEVER),
        "direction": 1,
    }


# --- The axis of an output has its whole range and its unit, also where the configuration writes neither --------------

STARTERS = Path(__file__).parents[1] / "src/pidcfg/cli/starters"
SCENARIO = """\
pidcfg: 1
scenario: Axes
config: config.yaml
duration: 60
plants:
  {loop}: {{model: first_order, gain: 0.1, time_constant: 20, initial: 40}}
"""


def axis(text, name, folder):
    """What a picture writes beside the panel of the output: the numbers, and the title."""
    (folder / "config.yaml").write_text(text, "utf-8")
    loop = read_document(text.encode(), "config.yaml").data["loops"][0]["name"]
    (folder / "axes.scenario.yaml").write_text(SCENARIO.format(loop=loop), "utf-8")
    plot = folder / "axes.svg"
    result = CliRunner().invoke(cli, ["simulate", str(folder / "axes.scenario.yaml"), "--plot", str(plot)])
    assert plot.exists(), result.output
    texts = re.findall(r"<text[^>]*>([^<]*)", plot.read_text("utf-8"))
    end = next(i for i, text in enumerate(texts) if text.split(" ")[0] == name)
    numbers = []
    for number in reversed(texts[:end]):
        if not re.fullmatch(r"-?[0-9.]+", number):
            break
        numbers.insert(0, float(number))
    return numbers, texts[end]


@pytest.mark.parametrize(
    ("vendor", "change", "title", "ends"),
    [
        ("click", None, "CO (%)", (0, 100)),
        ("click", ("limits: [0, 100]", "limits: [40, 60]"), "CO (%)", (0, 100)),
        ("dpide", None, "MV (ms)", (0, 4000)),
    ],
)
def test_the_axis_of_an_output_has_its_whole_range(vendor, change, title, ends, tmp_path):
    text = (STARTERS / f"{vendor}.yaml").read_text("utf-8")
    if change:
        assert change[0] in text
        text = text.replace(*change)
    numbers, written = axis(text, title.split(" ")[0], tmp_path)
    assert written == title
    assert (numbers[-5], numbers[-1]) == ends
