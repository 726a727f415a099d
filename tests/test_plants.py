"""Plants against their closed-form solutions, dead time to the step, and the behaviour of valves."""

import math

import pytest

from pidcfg.sim.engine.plants import MODELS, Plant, add_noise, second_order, set_parameters, settle_at, step_plants
from pidcfg.sim.engine.run import prepare
from scenario_rig import Controller, scenario

TOLERANCE = 1e-12
"""Relative to a response of order 1: the steps are exact, only rounding adds up."""


def respond(model, inputs, dt=0.1, dead=0, initial=0.0, **numbers):
    """The values after each step, from rest at ``initial``."""
    plant = Plant(MODELS[model], slot=1, measured=1, source=0, length=dead)
    set_parameters(plant, {"gain": 1.0, "load": 0.0, "noise": 0.0, "stiction": 0.0, **numbers}, dt)
    delay = [math.nan] * dead
    settle_at(plant, initial, 0.0, delay)
    sig, values = [0.0, plant.y], []
    for k, u in enumerate(inputs):
        sig[0] = u
        step_plants(k + 1, [plant], delay, sig, [], [], [0.0])
        values.append(sig[1])
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
    assert all(math.isfinite(value) for value in second_order(100.0, squared, damped))


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


def test_noise_belongs_to_the_measurement_and_not_to_the_plant():
    plant = Plant(MODELS["dead_time"], slot=0, measured=1, sigma=0.5, column=1, y=3.0)
    quiet = Plant(MODELS["dead_time"], slot=2, measured=2, y=4.0)
    sig = [3.0, 0.0, 4.0]
    add_noise(1, 2, [plant, quiet], [9.0, 9.0, 9.0, -2.0], sig)
    assert sig == [3.0, 2.0, 4.0]
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
    net = prepare(scenario(f"plants:\n  A: {text}\n  B: {{model: dead_time}}\n"), Controller.load())
    assert net.longest() == longest
