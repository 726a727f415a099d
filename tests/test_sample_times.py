"""A plant is the same plant at any sample time: fractional dead times, and what plants read of each other."""

from __future__ import annotations

import cmath
import io
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import pidcfg
import pidcfg.sim.engine.run as engine
from pidcfg.sim.engine.network import MAX_DELAY, MAX_PARTS
from pidcfg.sim.engine.plants import MODELS, Plant, set_parameters, settle_at, step_plants
from pidcfg.sim.engine.run import Settings, begin_run, prepare_network
from pidcfg.study.scenario import load_scenario
from pidcfg.text.source import read_document
from scenario_rig import MODES, Controller, rows, scenario

# --- A plant alone: dead times of any length against solutions that know of no steps ----------------------------------
#
# Time is counted in `TICKS` a step. What holds for a held input is added up from answers to steps; what a limit bends
# is followed tick by tick, which is exact as well, since a plant without a swing comes to a limit once.

TICKS = 40
DT = 0.7
TICK = DT / TICKS


def respond(model, inputs, dead, limits=None, **numbers):
    """The values after each step from rest at 0; ``dead`` in ticks."""
    plant = Plant(
        MODELS[model], slot=1, measured=1, source=0, length=-(-dead // TICKS), late_share=dead % TICKS / TICKS
    )
    low, high = limits or (-1e15, 1e15)
    given_numbers = {"gain": 1.0, "load": 0.0, "noise": 0.0, "stiction": 0.0, "low": low, "high": high}
    set_parameters(plant, given_numbers | numbers, DT)
    delay = [math.nan] * plant.length
    settle_at(plant, 0.0, 0.0, delay)
    signals, values = [0.0, 0.0], []
    for k, u in enumerate(inputs):
        signals[0] = u
        step_plants(k + 1, 1, [plant], delay, signals, [], [], [0.0])
        values.append(signals[1])
    return values


def two_lags(t, one, other):
    """The answer of two lags in series to a step of 1; two complex ones swing."""
    value = 1 - (one * cmath.exp(-t / one) - other * cmath.exp(-t / other)) / (one - other)
    return value.real


ANSWERS = {
    "first_order": (lambda t: 1 - math.exp(-t / 3), {"time_constant": 3.0}),
    "second_order": (lambda t: two_lags(t, 2.0, 5.0), {"first": 2.0, "second": 5.0}),
    "swinging": (
        lambda t: two_lags(t, 2 * complex(0.3, math.sqrt(1 - 0.09)), 2 * complex(0.3, -math.sqrt(1 - 0.09))),
        {"time_constant": 2.0, "damping": 0.3},
    ),
    "integrator": (lambda t: t, {}),
    "lead_lag": (lambda t: 1 + (2.5 / 4 - 1) * math.exp(-t / 4), {"lead": 2.5, "lag": 4.0}),
    "dead_time": (lambda _t: 1.0, {}),
    "valve": (lambda _t: 1.0, {}),
}
"""What each model answers to an input of 1 from time 0 on, and its numbers."""

INPUTS = st.lists(st.floats(-100, 100), min_size=1, max_size=12)


@pytest.mark.parametrize("name", ANSWERS)
@given(INPUTS, st.integers(0, 4 * TICKS), st.floats(0.1, 10))
def test_a_plant_answers_to_each_change_of_its_input_one_dead_time_later(name, inputs, dead, gain):
    answer, numbers = ANSWERS[name]
    values = respond("second_order" if name == "swinging" else name, inputs, dead, gain=gain, **numbers)

    moves = [after - before for before, after in zip([0.0, *inputs], inputs, strict=False)]
    for k, value in enumerate(values, 1):
        ages = [(k - at) * TICKS - dead for at in range(k)]
        wanted = sum(gain * move * answer(age * TICK) for move, age in zip(moves, ages, strict=False) if age > 0)
        assert value == pytest.approx(wanted, rel=1e-9, abs=1e-9)


def followed(inputs, dead, limits, move):
    """Values after each step by ticks; ``move`` takes a value and an input one tick on."""
    shown = [0.0] * dead + [u for u in inputs for _ in range(TICKS)]
    values, y = [], 0.0
    for tick, u in enumerate(shown[: TICKS * len(inputs)], 1):
        y = min(max(move(y, u), limits[0]), limits[1])
        if tick % TICKS == 0:
            values.append(y)
    return values


def at_rate(x, u):
    return x + min(max(u - x, -2.0 * TICK), 2.0 * TICK)


MOVES = {
    "first_order": (lambda y, u: u + (y - u) * math.exp(-TICK / 3), {"time_constant": 3.0}),
    "integrator": (lambda y, u: y + u * TICK, {}),
    "valve": (at_rate, {"rate_limit": 2.0}),
}
"""One tick of each model, and its numbers."""


@pytest.mark.parametrize("model", MOVES)
@given(INPUTS, st.integers(0, 3 * TICKS))
def test_a_plant_comes_to_its_limits_and_leaves_them_within_a_step(model, inputs, dead):
    move, numbers = MOVES[model]
    # a valve's position goes on beyond what its value shows, so that its limits are none here
    limits = (-1e9, 1e9) if model == "valve" else (-4.0, 4.0)
    values = respond(model, inputs, dead, limits, **numbers)
    assert values == pytest.approx(followed(inputs, dead, limits, move), rel=1e-9, abs=1e-9)


def test_limits_of_a_valve_are_no_limit_of_its_rate():
    assert respond("valve", [80.0, -80.0], 0, (-5.0, 0.0)) == [0.0, -5.0]


# --- Runs: the same plants at base steps that are fine and coarse -----------------------------------------------------

CONFIG = """\
pidcfg: 1
vendor: generic
name: Slow samples
loops:
  - name: A
    mode: manual
    output_raises_pv: true
    sample_time: 90 s
    tuning: {gain: 1, integral_time: 300 s}
    pv: {range: [0, 100]}
    setpoint: {value: 50}
    output: {range: [0, 100], manual: 20}
"""
EVENTS = """\
events:
  - {at: 90, loop: A, set: {output.manual: 60}}
  - {at: 900, loop: A, set: {output.manual: 30}}
"""
SAMPLE = 90


def values_of(plants, step, name="z", more="connect: {A.PV: z}\n", events=EVENTS):
    """A signal by time, in Manual with two steps of the output, and the result."""
    head = f"pidcfg: 1\nscenario: s\nconfig: c.yaml\nduration: 1800\nstep: {step}\nplants:\n"
    trend = io.StringIO()
    text = head + plants + more + events
    result = pidcfg.simulate(text, name="s.yaml", files={"c.yaml": CONFIG}, trend=trend)
    table = rows(trend.getvalue())
    return dict(zip(table["time"], table[name], strict=True)), result


@pytest.mark.parametrize(
    "model",
    [
        "first_order, time_constant: 60",
        "second_order, time_constants: [60, 25]",
        "second_order, time_constant: 60, damping: 0.2",
        "integrator, gain: 0.001",
        "lead_lag, lead: 20, lag: 60",
        "valve, rate_limit: 0.1",
    ],
)
@pytest.mark.parametrize("dead", [0, 10, 100, 270])
def test_a_plant_has_the_same_pv_whatever_the_base_step_is(model, dead):
    plants = f"  A: {{model: {model}, dead_time: {dead}}}\n"
    fine, _ = values_of(plants, 1, "A.PV", "")
    coarse, result = values_of(plants, SAMPLE, "A.PV", "")

    assert [coarse[t] for t in coarse] == pytest.approx([fine[t] for t in coarse], rel=1e-8)
    assert not [f for f in result.findings if f.code == "PID056"]


def test_ten_seconds_of_dead_time_are_seen_at_a_sample_time_of_ninety():
    with_it, _ = values_of("  A: {model: first_order, time_constant: 60, dead_time: 10}\n", SAMPLE, "A.PV", "")
    without, _ = values_of("  A: {model: first_order, time_constant: 60}\n", SAMPLE, "A.PV", "")

    assert with_it[180] == pytest.approx(60 - 40 * math.exp(-80 / 60), rel=1e-9)
    assert without[180] == pytest.approx(60 - 40 * math.exp(-90 / 60), rel=1e-9)


FIRST = "  - {name: a, model: first_order, input: A.OUT, time_constant: 60}\n"
NETWORKS = {
    "two lags in series": FIRST + "  - {name: z, model: first_order, input: a, time_constant: 45, dead_time: 10}\n",
    "three lags in series": FIRST + "  - {name: z, model: second_order, input: a, time_constants: [60, 20]}\n",
    "a lead behind a lag": FIRST + "  - {name: z, model: lead_lag, input: a, lead: 60, lag: 20}\n",
    "a delay behind a lag": FIRST + "  - {name: z, model: dead_time, input: a, dead_time: 10}\n",
    "a ring": FIRST.replace("A.OUT", "A.OUT - 0.5 * z")
    + "  - {name: z, model: first_order, input: a, time_constant: 200}\n",
    "a tank that drains by its level": "  - {name: z, model: integrator, input: A.OUT - 8 * sqrt(max(z, 0)), "
    "gain: 0.01, initial: 6.25, limits: [0, 100]}\n",
    "a swing that a limit ends": "  - {name: z, model: second_order, input: A.OUT, time_constant: 60, damping: 0.2, "
    "limits: [0, 70]}\n",
}
NEAR = 0.02
"""Of the way that the value goes: what parts of a tenth of a lag leave of the error."""


@pytest.mark.parametrize("name", NETWORKS)
def test_plants_that_read_each_other_come_near_to_a_fine_run_at_a_coarse_step(name):
    fine, _ = values_of(NETWORKS[name], 0.5)
    way = max(fine.values()) - min(fine.values())
    for step in (10, 30, SAMPLE):
        coarse, result = values_of(NETWORKS[name], step)
        assert max(abs(value - fine[t]) for t, value in coarse.items()) < NEAR * way
        assert len(coarse) == 1800 / step + 1
        assert not [f for f in result.findings if f.code == "PID056"]


@pytest.mark.parametrize("event", ["plant: z, disturb: {load: 0}", "loop: A, set: {setpoint.value: 55}"])
@pytest.mark.parametrize("name", NETWORKS)
def test_an_event_that_concerns_no_plant_changes_none(name, event):
    """It works out coefficients anew, or moves the plants before it writes what the PLC holds."""
    plain, _ = values_of(NETWORKS[name], 30)
    assert values_of(NETWORKS[name], 30, events=f"{EVENTS}  - {{at: 180, {event}}}\n")[0] == plain


def test_the_way_to_the_steady_start_is_as_long_in_parts():
    plants = NETWORKS["two lags in series"].replace("time_constant: 60", "time_constant: 60, initial: 0")
    settled = [
        values_of(plants, step, more="connect: {A.PV: z}\ninitial: steady\n")[1].report.settled for step in (1, 90)
    ]
    assert settled[0] == settled[1] > 500


def test_without_control_the_same_plants_go_the_same_way():
    """In Manual the run itself is without control."""
    text = (
        "signals: {x: 5}\nplants:\n"
        "  - {name: pipe, model: first_order, input: x, time_constant: 60, dead_time: 10}\n"
        "  - {name: tank, model: first_order, input: pipe - sqrt(tank), time_constant: 45, dead_time: 3.3}\n"
        "  - {name: arm, model: second_order, input: pipe, time_constant: 20, damping: 0.2, limits: [0, 45]}\n"
        "connect: {A.PV: tank, B.PV: arm}\n"
        "events: [{at: 3, set: {x: 60}}, {at: 150, plant: tank, disturb: {time_constant: 30}}]\n"
    )
    plc = Controller.load(goals=["manual", "manual"])
    for state in plc.states:
        state.status = MODES["manual"]
    run = begin_run(scenario(text, step=7, duration=700), lambda: plc, Controller, Settings("python"))
    for _ in run.steps_to_end():
        pass

    assert run.net.parts > 1
    assert [plant.late_share > 0 for plant in run.net.plants] == [True, True, False]
    assert [plant.y for plant in run.machine.reference.plants] == [plant.y for plant in run.net.plants]
    assert [plant.y for plant in run.net.plants] == pytest.approx([60, 52.74, 45], rel=1e-3)


# --- How many parts a base step has -----------------------------------------------------------------------------------


def network(plants, step=1, more=""):
    return prepare_network(scenario(f"plants:\n{plants}{more}", step=step), Controller.load())


A = "  - {name: a, model: first_order, input: A.OUT, time_constant: 0.001}\n"
"""Its input is held, so that its lag does not count."""


@pytest.mark.parametrize(
    ("plant", "parts"),
    [
        ("first_order, input: A.OUT, time_constant: 3", 1),
        ("first_order, input: a, time_constant: 10", 1),
        ("first_order, input: a, time_constant: 9.99", 2),
        ("first_order, input: a, time_constant: 3", 4),
        ("first_order, input: 2 * a + A.OUT, time_constant: 3", 4),
        ("first_order, input: 1 - z, time_constant: 3", 4),
        ("second_order, input: a, time_constants: [3, 20]", 4),
        ("second_order, input: A.OUT, time_constants: [3, 20]", 1),
        ("second_order, input: A.OUT, time_constants: [3, 20], limits: [0, 9]", 4),
        ("first_order, input: A.OUT, time_constant: 3, limits: [0, 9]", 1),
        ("lead_lag, input: a, lead: 9, lag: 3", 4),
        ("integrator, input: a, gain: -0.5", 5),
        ("integrator, input: a, gain: 0", 1),
        ("dead_time, input: a, dead_time: 3.2", 4),
        ("dead_time, input: a, dead_time: 3", 1),
        ("first_order, input: a, time_constant: 30, dead_time: 0.2", 1),
        ("valve, input: a, stiction: 1", 1),
        ("first_order, input: a, time_constant: 0.1", 100),
        ("first_order, input: a, time_constant: 0.01", MAX_PARTS),
    ],
)
def test_a_base_step_has_as_many_parts_as_the_shortest_lag_wants_whose_input_is_not_held(plant, parts):
    net = network(A + f"  - {{name: z, model: {plant}}}\n")
    assert net.parts == parts
    assert bool([p for p in net.problems if p.kind == "rounded"]) == ("0.01" in plant)


def test_an_event_that_shortens_a_lag_has_its_parts_from_the_start():
    z = "  - {name: z, model: first_order, input: a, time_constant: 30}\n"
    event = "  - {{at: 3, plant: {}, disturb: {{time_constant: {}}}}}\n"
    events = f"events:\n{event.format('a', 0.01)}{event.format('z', 2)}"
    assert (network(A + z).parts, network(A + z, more=events).parts) == (1, 5)


def test_a_lag_that_wants_more_parts_than_there_are_is_named():
    net = network(A + "  - {name: z, model: first_order, input: a, time_constant: 0.04}\n", step=2)
    [found] = [p for p in net.problems if p.message.startswith("the shortest lag")]
    assert (found.path, found.severity) == (("plants", 1), "info")
    assert found.message == (
        "the shortest lag of z is 0.04 s, the base step 2 s: the plants go through it in 100 parts, and 500 are wanted"
    )


def test_steps_of_plants_count_when_the_engine_is_chosen(monkeypatch):
    asked = []
    monkeypatch.setattr(engine, "choose_engine", lambda _wanted, work, *_more: asked.append(work) or "python")
    for lag in (10, 2):
        text = f"plants:\n{A}  - {{name: z, model: first_order, input: a, time_constant: {lag}}}\n"
        begin_run(scenario(text), Controller.load, Controller, Settings("auto"))
    assert asked == [11 * 2, 11 * 2 * (1 + (5 - 1) / 4)]


def test_blocks_that_are_no_loops_count_when_the_engine_is_chosen(monkeypatch):
    asked = []
    monkeypatch.setattr(engine, "choose_engine", lambda _wanted, work, *_more: asked.append(work) or "python")
    path = Path(__file__).parents[1] / "examples" / "nextopid" / "pump.scenario.yaml"
    case = load_scenario(read_document(path.read_bytes(), str(path)))
    run = begin_run(case.scenario, case.new_plc, case.controller, Settings("auto"))
    assert asked == [(run.last + 1) * 3]
    assert (len(run.plc.loops), len(run.plc.configs)) == (2, 3)


def test_a_delay_line_is_as_long_as_its_dead_time_in_steps_and_in_parts():
    lines = "".join(
        f"  - {{name: p{i}, model: dead_time, input: A.OUT, dead_time: {t}}}\n" for i, t in enumerate([0, 3, 3.25, 0.1])
    )
    net = network(lines)
    assert [(p.delay, p.length, p.late_share) for p in net.plants] == [(0, 0, 0), (0, 3, 0), (3, 4, 0.25), (7, 1, 0.1)]
    net = network(lines + A + "  - {name: z, model: first_order, input: a, time_constant: 5}\n")
    assert [(p.length, p.late_share) for p in net.plants[:4]] == [(0, 0), (6, 0), (7, 0.5), (1, 0.2)]


@pytest.mark.parametrize(("dead", "refused"), [(MAX_DELAY, False), (MAX_DELAY + 0.5, True), (10**12, True)])
def test_delay_lines_that_no_memory_should_hold_are_refused(dead, refused):
    net = network(f"  - {{name: z, model: dead_time, input: A.OUT, dead_time: {dead}}}\n")
    assert ("dead times of more than 1000000 steps" in [p.message for p in net.problems]) == refused
