"""Scenario files: both ways to write plants, and everything that is refused, with its place and its cure."""

from __future__ import annotations

from dataclasses import asdict
from decimal import Decimal
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from pydantic import ValidationError

import pidcfg
from certify_rig import CONFIG
from nextopid_rig import run
from pidcfg.cli.main import cli
from pidcfg.encoders.maps.click import TABLES
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.scenario import Bound
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.engine.events import idle_events
from pidcfg.sim.engine.influence import read_signals
from pidcfg.sim.engine.kernel import Channel
from pidcfg.sim.engine.run import CYCLE_WINDOWS, base_step, plc_options, prepare_network, swings_alike
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from scenario_rig import Controller, problems, scenario

# --- Scenario files: both ways to write plants, and everything that is refused, with its place and its cure -----------

WIRED = "connect: {A.PV: 1, B.PV: 1}\n"
PLANTS = "plants:\n  B: {model: dead_time}\n  A: "


def test_a_plant_keyed_by_its_loop_reads_the_output_of_that_loop():
    net = prepare_network(
        scenario("plants:\n  A: {model: dead_time}\n  B: {model: dead_time, input: A.PV}\n"), Controller.load()
    )
    a, b = (net.plants[net.plant_index[name]] for name in "AB")
    assert (a.source, a.measured) == (3, 0), "A.OUT to the input of A"
    assert b.source == a.slot
    assert not net.problems


def test_plants_in_a_list_have_names_and_are_connected_by_expressions():
    text = "plants:\n  - {name: p, model: dead_time, input: A.OUT + 1}\nconnect: {A.PV: p * 2, B.PV: p}\n"
    net = prepare_network(scenario(text), Controller.load())
    assert not net.problems
    assert net.slots["p"] == net.plants[0].measured
    assert [channel.target for channel in net.channels] == [0, 5]


def test_an_expression_in_braces_is_put_together_again_where_yaml_cut_it():
    plants = "plants:\n  - {name: p, model: dead_time, input: 1 / max(A.OUT, 1, 2), gain: 3}\n"
    text = plants + "connect: {A.PV: min(p, 2), B.PV: p}\n"
    read = scenario(text)
    assert read.plants[0].input == "1 / max(A.OUT, 1, 2)"
    assert read.plants[0].gain == 3
    assert read.connect == {"A.PV": "min(p, 2)", "B.PV": "p"}


def test_a_key_without_a_value_that_belongs_to_no_expression_is_still_refused():
    with pytest.raises(ValidationError):
        scenario("plants:\n  - {name: p, model: dead_time, input: A.OUT, gian}\n")


@pytest.mark.parametrize(
    ("written", "bound"),
    [("10", Bound(Decimal(10))), ("10 %", Bound(Decimal(10), "%")), ("2 min", Bound(Decimal(120), "s"))],
)
def test_bounds_carry_their_unit(written, bound):
    assert scenario(f"expect: [{{loop: A, metric: iae, max: {written}}}]\n").expect[0].max == bound


def test_a_scenario_starts_steady_or_with_outputs():
    assert scenario("initial: steady\n").initial == "steady"
    assert scenario('initial: {A: 40, B: "100 counts"}\n').initial == {
        "A": Quantity(Decimal(40)),
        "B": Quantity(Decimal(100), counts=True),
    }
    with pytest.raises(ValidationError, match="no way to start"):
        scenario("initial: warm\n")


def test_flags_are_expected_as_truths_or_words():
    read = scenario("expect: [{flag: V1, is: true}, {flag: V1, is: 0x0008}, {flag: V1, is: 8}]\n").expect
    assert [expectation.value for expectation in read] == [True, 8, 8]
    for wrong in ("0x1G", "70000", "-1"):
        with pytest.raises(ValidationError):
            scenario(f"expect: [{{flag: V1, is: {wrong}}}]\n")


def test_unknown_keys_are_refused():
    with pytest.raises(ValidationError, match="Extra inputs"):
        scenario("plnats: {}\n")


def test_the_base_step_is_given_or_the_scan_time_or_what_fits_all_sample_rates():
    plc = Controller.load(base_ticks=200_000)
    assert base_step(scenario(""), plc) == 200_000
    assert base_step(scenario("", step="50 ms"), plc) == 50_000
    assert base_step(scenario("plc: {scan_time: 0.01}\n"), plc) == 10_000
    stopped = Controller.load(base_ticks=0, running=False)
    assert base_step(scenario(""), stopped) == 1_000_000


def test_what_a_scenario_chooses_about_the_plc_reaches_it_in_ticks():
    text = "plc: {number_of_loops: 9, auto_interlock: false, scan_time: 20 ms}\n"
    given = plc_options(scenario(text), Controller)
    assert asdict(given) == {"number_of_loops": 9, "auto_interlock": False, "scan_time": TICKS // 50}


def test_a_sample_rate_that_is_no_multiple_of_the_step_is_said():
    found = problems(WIRED, step=0.3)
    assert found == [
        (path, f"the sample rate of {loop}, 1 s, is no multiple of the step, 0.3 s")
        for path, loop in (("step", "A"), ("step", "B"))
    ]


def test_a_set_up_that_the_scenario_spoils_points_at_its_line():
    plc = Controller.load(error_words={"V1": 4})
    found = prepare_network(scenario(WIRED + "plc: {number_of_loops: 9}\n"), plc).problems
    assert [(p.path, p.severity) for p in found] == [(("plc", "number_of_loops"), "warning")]
    assert "V1 = 0x0004" in found[0].message
    assert found[0].effect == "V1 bit 2"


def test_a_loop_without_a_plant_is_a_warning():
    assert problems("connect: {A.PV: 1}\n") == [("plants", "nothing is wired to the PV of B; it stays at 0")]


def test_loops_of_one_name_cannot_be_told_apart():
    plc = Controller.load(loops=["A", "A"])
    found = [(p.path, p.message) for p in prepare_network(scenario("connect: {A.PV: 1}\n"), plc).problems]
    assert (("config",), "the configuration has several loops with the name A") in found


REFUSED = [
    # scenario, path of the finding with a colon where a key is at fault and not its value, what it says
    ("plants:\n  C: {model: dead_time}\n", "plants.C:", "'C' is no loop"),
    ("plants:\n  - {model: dead_time, input: 1}\n", "plants.0", "needs a name"),
    ("plants:\n  A: {name: x, model: dead_time}\n", "plants.A.name:", "no other name"),
    ("plants:\n  - {name: p, model: dead_time}\n", "plants.0:", "has no input"),
    (
        "plants:\n  - {name: p, model: dead_time, input: 1}\n  - {name: p, model: dead_time, input: 1}\n",
        "plants.1",
        "taken",
    ),
    ("signals: {p: 1}\nplants:\n  - {name: p, model: dead_time, input: 1}\n", "plants.0", "taken"),
    ("signals: {A.PV: 1}\n", "signals.A.PV:", "a signal of the PLC"),
    (PLANTS + "{model: dead_time, input: A.OTU}\n", "plants.A.input", "'A.OTU' is no declared name"),
    (PLANTS + "{model: dead_time, input: 1 +}\n", "plants.A.input", "missing before the end"),
    (PLANTS + "{model: first_order}\n", "plants.A.model", "first_order needs time_constant"),
    (PLANTS + "{model: first_order, time_constant: 0}\n", "plants.A.time_constant", "above 0"),
    (PLANTS + "{model: first_order, time_constant: 1, lead: 2}\n", "plants.A.lead:", "has no lead"),
    (
        PLANTS + "{model: second_order, time_constant: 1}\n",
        "plants.A.model",
        "needs time_constants or time_constant and damping",
    ),
    (PLANTS + "{model: second_order, time_constants: [1, 0]}\n", "plants.A.time_constants", "above 0"),
    (PLANTS + "{model: second_order, time_constant: 1, damping: -0.1}\n", "plants.A.damping", "negative"),
    (PLANTS + "{model: lead_lag, lead: 1}\n", "plants.A.model", "needs lead and lag"),
    (PLANTS + "{model: valve, rate_limit: 0}\n", "plants.A.rate_limit", "above 0"),
    (PLANTS + "{model: dead_time, dead_time: -1}\n", "plants.A.dead_time", "negative"),
    (PLANTS + "{model: dead_time, noise: -1}\n", "plants.A.noise", "negative"),
    (PLANTS + "{model: dead_time, gain: 1e13}\n", "plants.A.gain", "beyond"),
    (PLANTS + "{model: dead_time, dead_time: 1e9}\n", "plants.A.dead_time", "more than 1000000 steps"),
    (PLANTS + "{model: dead_time}\nconnect: {A.PV: 1}\n", "connect.A.PV:", "a plant of its own"),
    ("connect: {A.PV: 1, B.PV: 1, C.PV: 1}\n", "connect.C.PV:", "no loop's PV"),
    ("connect: {A.PV: 1, B.PV: Q}\n", "connect.B.PV", "'Q' is no declared name"),
    ("signals: {x: 1e13}\n", "signals.x", "beyond"),
    ("signals: {x: 1}\nevents: [{at: 1, set: {x: -1e13}}]\n", "events.0.set.x", "beyond"),
    ("initial: {C: 1}\n", "initial.C:", "'C' is no loop"),
    ("signals: {2: 1}\n", "signals.2", "already means something"),
    ("plants:\n  - {name: max, model: dead_time, input: 1}\n", "plants.0.name", "already means something"),
    ("events: [{at: 1}]\n", "events.0:", "does nothing"),
    ("events: [{at: 1, loop: A, mode: auto, pv: 3}]\n", "events.0:", "mode and pv in one event"),
    ("events: [{at: -1, loop: A, mode: auto}]\n", "events.0.at", "before time 0"),
    ("events: [{at: 11, loop: A, mode: auto}]\n", "events.0.at", "after the end"),
    ("events: [{at: 1, loop: C, mode: auto}]\n", "events.0.loop", "'C' is no loop"),
    ("events: [{at: 1, mode: auto}]\n", "events.0.mode:", "needs a loop"),
    ("events: [{at: 1, loop: A, mode: atuo}]\n", "events.0.mode", "'atuo' is no mode"),
    ("events: [{at: 1, loop: A, mode: auto, for: 3}]\n", "events.0.for:", "'for' is the time"),
    ("events: [{at: 1, loop: A, pv: 3, for: 0}]\n", "events.0.for:", "'for' is the time"),
    ("events: [{at: 1, loop: A, plant: A, mode: auto}]\n", "events.0.plant:", "only a disturbance"),
    ("events: [{at: 1, loop: A, plc: run}]\n", "events.0.loop:", "the whole PLC"),
    ("events: [{at: 1, plc: stop}]\n", "events.0.plc", "'stop' is no command of plc on this PLC"),
    ("events: [{at: 1, loop: A, autotune: cancel}]\n", "events.0.autotune", "'cancel' is no command of autotune"),
    ("events: [{at: 1, set: {heat: 3}}]\n", "events.0.set.heat:", "'heat' is no signal"),
    ("signals: {heat: 1}\nevents: [{at: 1, set: {heat: hot}}]\n", "events.0.set.heat", "'hot' is not a number"),
    ("events: [{at: 1, loop: A, set: {}}]\n", "events.0.set:", "set changes nothing"),
    ("events: [{at: 1, loop: A, set: {setpoint: {}}}]\n", "events.0.set:", "set changes nothing"),
    (PLANTS + "{model: dead_time}\nevents: [{at: 1, loop: A, disturb: {}}]\n", "events.0.disturb:", "changes nothing"),
    (PLANTS + "{model: integrator, initial: 5, limits: [0, 4]}\n", "plants.A.initial", "outside its limits, 0 to 4"),
    ("events: [{at: 1, loop: A, set: {setpoint: high}}]\n", "events.0.set.setpoint", "'high' is not a number"),
    ("events: [{at: 1, loop: A, set: {setpoint: {x: y}}}]\n", "events.0.set.setpoint.x", "'y' is not"),
    ("events: [{at: 1, loop: A, set: {setpoint.x: y}}]\n", "events.0.set.setpoint.x", "'y' is not"),
    ("events: [{at: 1, loop: A, disturb: {load: 1}}]\n", "events.0.loop", "no plant of the scenario"),
    ("events: [{at: 1, plant: p, disturb: {load: 1}}]\n", "events.0.plant", "no plant of the scenario"),
    (
        PLANTS + "{model: dead_time}\nevents: [{at: 1, loop: A, disturb: {laod: 1}}]\n",
        "events.0.disturb.laod:",
        "no number of A",
    ),
    (
        PLANTS + "{model: dead_time}\nevents: [{at: 1, loop: A, disturb: {lag: 1}}]\n",
        "events.0.disturb.lag:",
        "no number of A",
    ),
    (
        PLANTS + "{model: dead_time}\nevents: [{at: 1, loop: A, disturb: {noise: -1}}]\n",
        "events.0.disturb.noise",
        "cannot be",
    ),
    *(
        (
            PLANTS + f"{{model: first_order, time_constant: 1}}\nevents: [{{at: 1, loop: A, disturb: {number}}}]\n",
            "events.0.disturb.time_constant",
            "time_constant cannot be",
        )
        for number in ("{time_constant: 0}", "{time_constant: 1e-13}")
    ),
    ("plc: {step_bias: true}\n", "plc.step_bias:", "'step_bias' is no option of this PLC"),
    ("step: 1\nplc: {scan_time: 1}\n", "step:", "do not go together"),
    ("expect: [{loop: A, max: 3}]\n", "expect.0:", "about nothing"),
    ("expect: [{loop: A, metric: iae, alarm: high, max: 3}]\n", "expect.0:", "about metric and alarm"),
    ("expect: [{loop: A, metric: iae}]\n", "expect.0:", "nothing is expected"),
    ("expect: [{metric: iae, max: 3}]\n", "expect.0.metric:", "needs a loop"),
    ("expect: [{loop: C, metric: iae, max: 3}]\n", "expect.0.loop", "'C' is no loop"),
    ("expect: [{loop: A, metric: iae, max: 3, never: true}]\n", "expect.0.never:", "does not go with metric"),
    ("expect: [{loop: A, metric: iae, max: 3 %}]\n", "expect.0.max", "cannot be in %"),
    ("expect: [{loop: A, metric: overshoot, max: 3 s}]\n", "expect.0.max", "cannot be in s"),
    ("expect: [{loop: A, metric: iae, band: 3 %, max: 3}]\n", "expect.0.band:", "settling_time"),
    ("expect: [{loop: A, metric: settling_time, band: 100 %, max: 3}]\n", "expect.0.band:", "below 100 %"),
    ("expect: [{loop: A, metric: iae, min: 4, max: 3}]\n", "expect.0.min", "min 4 is above max 3"),
    ("expect: [{signal: A.VP, max: 3}]\n", "expect.0.signal", "'A.VP' is no signal"),
    ("expect: [{signal: A.PV}]\n", "expect.0:", "nothing is expected"),
    ("expect: [{signal: A.PV, final: 3}]\n", "expect.0:", "belong together"),
    ("expect: [{loop: A, metric: iae, max: -1}]\n", "expect.0.max", "iae is never below 0: no value passes"),
    ("expect: [{loop: A, metric: overshoot, max: -5 %}]\n", "expect.0.max", "overshoot is never below 0"),
    ("expect: [{loop: A, metric: rise_time, min: 11}]\n", "expect.0.min", "rise_time is never above the 10 s that"),
    ("expect: [{signal: A.PV, final: 3, tolerance: -1}]\n", "expect.0.tolerance", "no value passes"),
    ("expect: [{loop: A, alarm: high, at: 3, tolerance: -1 s}]\n", "expect.0.tolerance", "no value passes"),
    ("expect: [{loop: A, alarm: high, before: 3, after: 5}]\n", "expect.0.after", "before 3 s and after 5 s: no alarm"),
    ("expect: [{loop: A, flag: odd, is: 5}]\n", "expect.0.is", "a loop's flag is true or false"),
    ("expect: [{signal: A.PV, max: 3, from: 11}]\n", "expect.0.from", "outside the scenario"),
    ("expect: [{signal: A.PV, max: 3, until: -1}]\n", "expect.0.until", "outside the scenario"),
    ("expect: [{signal: A.PV, max: 3, from: 5, until: 4}]\n", "expect.0.from", "after until"),
    ("expect: [{loop: A, alarm: hihg, never: true}]\n", "expect.0.alarm", "'hihg' is no alarm"),
    ("expect: [{loop: A, alarm: high, never: true, at: 3}]\n", "expect.0.never:", "has no time"),
    ("expect: [{loop: A, alarm: high, never: false, before: 3}]\n", "expect.0.never:", "has no time"),
    ("expect: [{loop: A, alarm: high, at: 30}]\n", "expect.0.at", "outside the scenario"),
    ("expect: [{loop: A, mode: cascade}]\n", "expect.0.mode", "'cascade' is no mode"),
    ("expect: [{loop: A, flag: even}]\n", "expect.0.flag", "'even' is no flag"),
    ("expect: [{flag: V2}]\n", "expect.0.flag", "'V2' is no flag"),
    ("expect: [{loop: A, autotune: reset, min: 1}]\n", "expect.0.autotune", "'reset' is no result"),
    ("expect: [{loop: A, autotune: done, max: 1}]\n", "expect.0:", "true or false"),
    ("tolerance: {C: 1}\n", "tolerance.C:", "'C' is no loop"),
    ("tolerance: {A: 0}\n", "tolerance.A", "must be above 0"),
    ("tolerance: {A: 3 s}\n", "tolerance.A", "must be above 0"),
    ("tolerance: {A: 100 %}\n", "tolerance.A", "passes whatever the PV of A does"),
    ("allow: [{loop: C, kind: not-proven, reason: old}]\n", "allow.0.loop", "'C' is no loop"),
    ("allow: [{loop: A, kind: not-proven, reason: ' '}]\n", "allow.0.reason", "the reason is empty"),
    ("assumed_signs: [A, C]\n", "assumed_signs.1", "'C' is no loop"),
    ("loops: [C]\n", "loops.0", "'C' is no loop"),
    ("loops: []\n", "loops", "no loop is judged"),
]


@pytest.mark.parametrize(("text", "path", "message"), REFUSED, ids=[row[2] for row in REFUSED])
def test_what_makes_no_sense_is_refused_where_it_stands(text, path, message):
    rest = "" if "connect" in text or "plants" in text else WIRED
    found = prepare_network(scenario(text + rest), Controller.load()).problems
    marked = [(".".join(map(str, one.path)) + ":" * one.key, one.message) for one in found]
    assert any(where == path and message in what for where, what in marked), marked


@pytest.mark.parametrize("end", ["min", "max"])
@pytest.mark.parametrize(
    ("metric", "units"),
    [
        ("iae", [""]),
        ("overshoot", ["", "%"]),
        ("settling_time", ["", "s"]),
        ("rise_time", ["", "s"]),
        ("oscillation_period", ["", "s"]),
    ],
)
def test_a_bound_is_in_a_unit_of_what_it_bounds(metric, units, end):
    for unit in ("", "%", "s"):
        text = f"expect: [{{loop: A, metric: {metric}, {end}: {f'3 {unit}'.strip()}}}]\n"
        found = prepare_network(scenario(text + WIRED), Controller.load()).problems
        told = [one.help for one in found if f"{end} of {metric} cannot be in {unit}" in one.message]
        has = " or ".join(name or "a plain number" for name in units)
        assert told == ([] if unit in units else [f"write {has}"])


def test_a_disturbed_time_may_carry_its_unit():
    plant = PLANTS + "{model: lead_lag, lead: 1, lag: 5}\n"
    text = plant + "events: [{at: 1, loop: A, disturb: {lead: 500 ms, lag: 2 min, gain: 3}}]\n"
    read = scenario(text)
    assert not prepare_network(read, Controller.load()).problems[1:]
    assert read.events[0].disturb == {"lead": Decimal("0.5"), "lag": 120, "gain": 3}
    with pytest.raises(ValidationError, match="'2 s' is not a number"):
        scenario(plant + "events: [{at: 1, loop: A, disturb: {gain: 2 s}}]\n")


def test_misspelt_names_are_met_with_the_one_that_was_meant():
    plc = Controller.load()
    text = WIRED + "events: [{at: 1, loop: A, mode: atuo}]\nexpect: [{loop: A, alarm: hihg, never: true}]\n"
    cures = [p.help for p in prepare_network(scenario(text), plc).problems]
    assert cures == ["did you mean auto?", "did you mean high?"]


@pytest.mark.parametrize("key", ["duration", "step"])
@pytest.mark.parametrize("time", ["0", "-1", "1e13"])
def test_times_are_above_zero_and_within_reason(key, time):
    assert any(path == key for path, _ in problems(WIRED, **{key: time}))


def test_a_step_has_whole_microseconds():
    assert ("step", "step is no whole number of microseconds") in problems(WIRED, step=0.0000015)


@pytest.mark.parametrize("count", ["-1", "10000", "1.5", "many"])
def test_a_number_of_loops_fits_its_word(count):
    with pytest.raises(ValidationError):
        scenario(f"plc: {{number_of_loops: {count}}}\n")
    assert scenario("plc: {number_of_loops: 9999}\n").plc.number_of_loops == 9999


def test_a_plc_without_ramp_soak_refuses_it():
    plc = Controller.load()
    plc.commands = plc.commands | {"ramp_soak": ()}
    found = prepare_network(scenario("events: [{at: 1, loop: A, ramp_soak: start}]\n" + WIRED), plc).problems
    assert (("events", 0, "ramp_soak"), "this PLC has no ramp/soak") in [(p.path, p.message) for p in found]


@pytest.mark.parametrize("event", ["{at: 1, loop: A, mode: auto, pv: 3}", "{at: 1}"])
def test_an_event_of_no_or_two_actions_is_marked_at_its_beginning(event):
    (found,) = (
        p
        for p in prepare_network(scenario(WIRED + f"events: [{event}]\n"), Controller.load()).problems
        if p.path[0] == "events"
    )
    assert found.key


@pytest.mark.parametrize(("flag", "count", "told"), [(0, 2, False), (4, 9, True), (4, None, False)])
def test_a_set_up_error_is_told_where_the_scenario_gives_the_number_of_loops(flag, count, told):
    plc = Controller.load()
    plc.error_words["V1"] = flag
    option = "" if count is None else f"plc: {{number_of_loops: {count}}}\n"

    assert (
        any(p.path == ("plc", "number_of_loops") for p in prepare_network(scenario(WIRED + option), plc).problems)
        == told
    )


def test_a_signal_with_the_name_of_one_of_the_plc_is_reported_at_its_name():
    text = "pidcfg: 1\nscenario: x\nconfig: loop.yaml\nduration: 10\nsignals: {TIC-1.PV: 77}\nplants: {}\n"
    found = pidcfg.check(text, name="x.scenario.yaml", files={"loop.yaml": CONFIG}).findings
    assert [(d.span.line, d.span.column) for d in found if "a signal of the PLC" in d.message] == [(5, 11)]


def test_a_plant_that_reads_the_first_signal_is_influenced_by_it():
    assert read_signals(SimpleNamespace(), Channel(target=3, source=0)) == (0,)


# --- Every limit of a scenario's numbers at its edge: the last value that is taken, and the first that is not ---------

LIMIT_WIRED = "connect: {A.PV: 1, B.PV: 1}\n"
PLANT = "plants:\n  B: {model: dead_time}\n  A: "
LAG = PLANT + "{model: first_order, time_constant: 1, KEY: VALUE}\n"
DISTURBED = PLANT + "{model: MODEL}\nevents: [{at: 1, loop: A, disturb: {KEY: VALUE}}]\n"
LIMITS = [
    # scenario, path of the finding, values that are taken, values that are not
    ("events: [{at: VALUE, loop: A, mode: auto}]\n", "events.0.at", ["0", "10"], ["-0.001", "10.001"]),
    ("events: [{at: 1, loop: A, pv: 3, for: VALUE}]\n", "events.0.for", ["0.001"], ["0", "-1"]),
    ("expect: [{signal: A.PV, max: 3, share: VALUE}]\n", "expect.0.share", ["0.1 %", "99.9 %"], ["0 %", "100 %"]),
    ("expect: [{loop: A, alarm: high, at: VALUE}]\n", "expect.0.at", ["0", "10"], ["-0.001", "10.001"]),
    ("expect: [{loop: A, alarm: high, before: VALUE}]\n", "expect.0.before", ["0", "10"], ["-0.001", "10.001"]),
    ("expect: [{loop: A, alarm: high, after: VALUE}]\n", "expect.0.after", ["0", "10"], ["-0.001", "10.001"]),
    ("expect: [{signal: A.PV, max: 3, from: VALUE}]\n", "expect.0.from", ["0", "10"], ["-0.001", "10.001"]),
    ("expect: [{signal: A.PV, max: 3, until: VALUE}]\n", "expect.0.until", ["0", "10"], ["-0.001", "10.001"]),
    ("expect: [{signal: A.PV, max: 3, until: 5, from: VALUE}]\n", "expect.0.from", ["4.999", "5"], ["5.001"]),
    ("expect: [{signal: A.PV, max: 3, min: VALUE}]\n", "expect.0.min", ["2.999", "3"], ["3.001"]),
    (
        "expect: [{loop: A, metric: settling_time, max: 3, band: VALUE}]\n",
        "expect.0.band",
        ["0.1 %", "99.9 %"],
        ["0 %", "100 %"],
    ),
    ("signals: {x: VALUE}\n", "signals.x", ["1e12", "-1e12"], ["1000000000001", "-1000000000001"]),
    (
        "signals: {x: 1}\nevents: [{at: 1, set: {x: VALUE}}]\n",
        "events.0.set.x",
        ["1e12", "-1e12"],
        ["1000000000001", "-1000000000001"],
    ),
    *(
        (LAG.replace("KEY", key), f"plants.A.{key}", ["1e12", "-1e12"], ["1000000000001", "-1000000000001"])
        for key in ("gain", "load", "initial")
    ),
    *((LAG.replace("KEY", key), f"plants.A.{key}", ["0"], ["-0.001"]) for key in ("noise", "dead_time")),
    (PLANT + "{model: first_order, time_constant: VALUE}\n", "plants.A.time_constant", ["0.001", "1e12"], ["0", "-1"]),
    (PLANT + "{model: dead_time, dead_time: VALUE}\n", "plants.A.dead_time", ["1000000"], ["1000001"]),
    (
        PLANT + "{model: second_order, time_constants: [1, VALUE]}\n",
        "plants.A.time_constants",
        ["0.001", "1e12"],
        ["0", "1000000000001"],
    ),
    (
        PLANT + "{model: second_order, time_constant: 1, damping: VALUE}\n",
        "plants.A.damping",
        ["0", "1e12"],
        ["-0.001", "1000000000001"],
    ),
    (PLANT + "{model: lead_lag, lag: 1, lead: VALUE}\n", "plants.A.lead", ["0"], ["-0.001"]),
    (PLANT + "{model: lead_lag, lead: 1, lag: VALUE}\n", "plants.A.lag", ["0.001"], ["0"]),
    (PLANT + "{model: valve, stiction: VALUE}\n", "plants.A.stiction", ["0"], ["-0.001"]),
    (PLANT + "{model: valve, rate_limit: VALUE}\n", "plants.A.rate_limit", ["0.001"], ["0"]),
    (PLANT + "{model: dead_time, limits: [0, VALUE]}\n", "plants.A.limits", ["1e12"], ["1000000000001"]),
    *(
        (DISTURBED.replace("MODEL", model).replace("KEY", key), f"events.0.disturb.{key}", taken, refused)
        for model, key, taken, refused in (
            ("dead_time", "gain", ["1e12", "-1e12"], ["1000000000001", "-1000000000001"]),
            ("dead_time", "load", ["1e12", "-1e12"], ["1000000000001", "-1000000000001"]),
            ("dead_time, noise: 1", "noise", ["0"], ["-0.001"]),
            ("first_order, time_constant: 1", "time_constant", ["0.001"], ["0"]),
            ("second_order, time_constant: 1, damping: 1", "damping", ["0"], ["-0.001"]),
            ("lead_lag, lead: 1, lag: 1", "lead", ["0"], ["-0.001"]),
            ("lead_lag, lead: 1, lag: 1", "lag", ["0.001"], ["0"]),
            ("valve, stiction: 1", "stiction", ["0"], ["-0.001"]),
            ("valve, rate_limit: 1", "rate_limit", ["0.001"], ["0"]),
        )
    ),
]


@pytest.mark.parametrize(("text", "path", "taken", "refused"), LIMITS, ids=[row[0] for row in LIMITS])
def test_a_limit_itself_is_taken_and_what_is_beyond_it_is_not(text, path, taken, refused):
    rest = "" if "plants" in text else LIMIT_WIRED
    found = {value: problems(text.replace("VALUE", value) + rest) for value in (*taken, *refused)}
    assert [value for value in taken if found[value]] == []
    assert [value for value in refused if [where for where, _ in found[value]] != [path]] == []


@pytest.mark.parametrize(("key", "shortest"), [("duration", "1"), ("step", "0.000001")])
def test_a_time_is_above_0_and_at_most_1e12_s(key, shortest):
    for time, taken in ((shortest, True), ("1e12", True), ("0", False), ("1000000000001", False)):
        found = problems(LIMIT_WIRED, **{"duration": "1e12", "step": "1", key: time})
        refused = any(where == key and what.startswith(f"{key} is") for where, what in found)
        assert refused != taken, time


@pytest.mark.parametrize(
    ("duration", "told"),
    [
        ("10", None),
        ("9.999", "9.999 s are shorter than 10 samples of any loop, 10 s"),
        ("2", "2 s are shorter than 10 samples of any loop, 10 s"),
        ("1.999", "1.999 s are shorter than a sample of the slowest loop, 2 s"),
    ],
)
def test_a_run_has_a_sample_of_the_slowest_loop_and_ten_of_the_fastest(duration, told):
    plc = Controller.load()
    plc.configs[1].period = 2_000_000
    found = [p.message for p in prepare_network(scenario(LIMIT_WIRED, duration=duration), plc).problems]
    assert found == ([told] if told else [])


def test_what_a_share_of_samples_means_is_told_for_either_end():
    cures = {}
    for share in ("0 %", "100 %"):
        text = LIMIT_WIRED + f"expect: [{{signal: A.PV, max: 3, share: {share}}}]\n"
        (problem,) = prepare_network(scenario(text), Controller.load()).problems
        cures[share] = problem.message, problem.help
    assert cures == {
        "0 %": ("samples cannot show a share of 0 %", "write it like 99 %"),
        "100 %": ("samples cannot show a share of 100 %", "without share no sample may fail"),
    }


# --- Which events of a scenario change nothing: what each kind writes is looked at in the order of time ---------------

IDLE_WIRED = """\
signals: {load: 5}
plants:
  A: {model: first_order, gain: 2, time_constant: 3}
  B: {model: dead_time}
"""
EVENTS = [
    # events, each with whether it changes anything
    ["loop: A, set: {setpoint: 50} -", "loop: A, set: {setpoint: 51} +", "loop: A, set: {setpoint: 50} +"],
    ["loop: A, set: {setpoint: 51} +", "loop: A, set: {setpoint: 51} -", "loop: B, set: {setpoint: 51} +"],
    ["loop: A, set: {setpoint: 50, gain: 2} -", "loop: A, set: {setpoint: 50, gain: 3} +"],
    ["loop: A, set: {gain: 3, setpoint: 50} +", "loop: A, set: {gain: 3} -"],
    ["loop: A, disturb: {gain: 2} -", "loop: A, disturb: {gain: 3} +", "loop: A, disturb: {gain: 3} -"],
    ["loop: A, disturb: {gain: 2, load: 1} +", "loop: A, disturb: {load: 1} -", "loop: B, disturb: {gain: 2} +"],
    ["set: {load: 5} -", "set: {load: 6} +", "set: {load: 6} -"],
    ["loop: A, pv: 3 +", "loop: A, set: {setpoint: 50} +", "loop: B, set: {setpoint: 50} -"],
    ["loop: A, mode: auto +", "loop: A, set: {setpoint: 50} +", "loop: B, set: {setpoint: 50} -"],
    ["loop: A, autotune: start +", "loop: A, set: {gain: 2} +", "loop: B, set: {gain: 2} -"],
    ["plc: run -", "loop: A, set: {setpoint: 50} -", "plc: program +", "loop: A, set: {setpoint: 50} +"],
    ["plc: program +", "plc: program -", "plc: run +", "plc: run -", "loop: B, set: {setpoint: 50} +"],
]


def shown():
    """A PLC whose signals show the set points that its loops have."""
    plc = Controller.load()
    for c, s in zip(plc.configs, plc.states, strict=True):
        plc.signal_values[c.sp_slot] = s.sp
    return plc


@pytest.mark.parametrize("events", EVENTS, ids=[" / ".join(row) for row in EVENTS])
def test_an_event_that_writes_what_is_there_changes_nothing(events):
    rows = [(at, event[:-2], event[-1] == "-") for at, event in enumerate(events, 1)]
    text = "".join(f"  - {{at: {at}, {event}}}\n" for at, event, _ in reversed(rows))
    read = scenario(f"{IDLE_WIRED}events:\n{text}")
    net = prepare_network(read, shown())
    assert not net.problems

    assert [float(event.at) for event in idle_events(read, shown, net)] == [at for at, _, idle in rows if idle]


# --- Listings of PLCs into which nothing was written: they are read, their faults are told, and their runs show them --

STARTERS = Path(__file__).parents[1] / "src/pidcfg/cli/starters"
SCENARIO = """\
pidcfg: 1
scenario: Nothing was written
config: fresh.csv
duration: 20
plants:
  {loop}: {{model: first_order, gain: 1, time_constant: 5, initial: 20}}
"""


def invoke(*args):
    """The command in this process."""
    return CliRunner().invoke(cli, list(map(str, args)))


def listing(vendor, folder, keep=()):
    """The starter's listing with every register 0 but for those whose fields are named; and its first loop."""
    made = invoke("encode", STARTERS / f"{vendor}.yaml", "--format", "csv", "-o", folder / "written.csv")
    assert made.exit_code == 0, made.output
    lines = []
    for line in (folder / "written.csv").read_text("utf-8").splitlines():
        parts = line.split(",")
        if len(parts) == 5 and parts[0] != "address" and not line.startswith("#") and parts[4] not in keep:
            parts[1:3] = "0" * len(parts[1]), "0"
        lines.append(",".join(parts))
    path = folder / "fresh.csv"
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


def codes(path):
    return {d.code for d in check_document(read_document(path.read_bytes(), path.name)).findings}


@pytest.mark.parametrize(("vendor", "expected"), [("click", {"CK321", "CK361", "PID101"}), ("ezlogix", {"EZ430"})])
def test_a_listing_of_zeros_is_read_and_its_faults_are_told(vendor, expected, tmp_path):
    path = listing(vendor, tmp_path)
    decoded = invoke("decode", path, "--vendor", vendor, "-o", tmp_path / "fresh.yaml")
    assert decoded.exit_code == 0, decoded.output
    assert expected <= codes(tmp_path / "fresh.yaml")


@pytest.mark.parametrize(
    ("vendor", "exit_code", "says"),
    [("click", 1, "PID error 10: sample rate"), ("ezlogix", 0, "no loop was in Auto")],
)
def test_a_listing_of_zeros_runs_as_far_as_its_plc_would(vendor, exit_code, says, tmp_path):
    listing(vendor, tmp_path)
    ran = simulate(vendor, tmp_path)
    assert ran.exit_code == exit_code, ran.output
    assert says in ran.output


def test_without_a_process_range_a_click_controls_all_the_same(tmp_path):
    """The equation does not use it (D620)."""
    zeroed = {"pv_lower", "pv_upper"}
    path = listing("click", tmp_path, keep={row.name for t in TABLES for row in t.words if row.name not in zeroed})
    decoded = invoke("decode", path, "--vendor", "click", "-o", tmp_path / "fresh.yaml")
    assert decoded.exit_code == 0, decoded.output
    found = codes(tmp_path / "fresh.yaml")
    assert "CK321" in found
    assert not found & {"CK315", "CK316", "CK333", "CK334", "CK373", "CK377", "CK384"}, "they measure by the range"
    ran = simulate("click", tmp_path)
    assert "not-in-mode" not in ran.output, "it controls"
    assert invoke("diff", path, tmp_path / "written.csv", "--vendor", "click").output.count("pv.range.1") == 1
    refused = invoke("convert", tmp_path / "fresh.yaml", "--to", "dl06", "-o", tmp_path / "converted.yaml")
    assert refused.exit_code == 1
    assert "CK321" in refused.output
    assert not (tmp_path / "converted.yaml").exists()


@pytest.mark.parametrize("vendor", ["click", "ezlogix"])
def test_rest_is_not_taken_for_control(vendor, tmp_path):
    """With `initial: steady` a loop whose Auto is refused rests in Manual, which is told."""
    listing(vendor, tmp_path)
    simulate(vendor, tmp_path)
    path = tmp_path / "fresh.scenario.yaml"
    path.write_text(path.read_text("utf-8").replace("duration: 20", "duration: 20\ninitial: steady"), "utf-8")
    text = invoke("simulate", path).output
    assert ("rests in manual, though auto is meant" in text) is (vendor == "click")


def simulate(vendor, folder):
    """A run of a fresh PLC with the starter's loop."""
    loop = read_document((STARTERS / f"{vendor}.yaml").read_bytes(), "starter").data["loops"][0]["name"]
    (folder / "fresh.scenario.yaml").write_text(SCENARIO.format(loop=loop), "utf-8")
    return invoke("simulate", folder / "fresh.scenario.yaml")


# --- `initial: steady` where an output is on or off, or pulses: the cycle that comes back is the steady state ---------

SCALE = (0.0, 100.0, 2**24)
RELAY = "  - {name: OO, type: ControlON_OFF, SP: 50, DeadBand: 2, MaxPV: 100, MinPV: 0}\n"
OVEN = "  OO: {model: first_order, gain: 80, time_constant: 6, dead_time: 0.5, load: 20, initial: 20}\n"
GIVEN = "type: PIDA_REAL, SP: 50, Td_Kd: 0, MinMV: 0, MaxMV: 100, MinPV: 0, MaxPV: 100"
OTHER = "  L: {model: first_order, gain: 1, time_constant: 2, dead_time: 1.5, initial: 20}\n"


def steady(loops: str, plants: str, duration: int = 60, blocks: str = ""):
    """The report of a run that begins in the steady state."""
    return run(f"{blocks}loops:\n{loops}", f"duration: {duration}\ninitial: steady\nplants:\n{plants}")


def test_a_relay_begins_in_its_cycle():
    report = steady(RELAY, OVEN)
    assert not report.problems
    assert report.settled
    plain = run(f"loops:\n{RELAY}", f"duration: 60\nplants:\n{OVEN}")
    pv, start = report.signals["OO.PV"], plain.signals["OO.PV"]
    assert start.low == 20
    assert 44 < pv.low < 48
    assert 52 < pv.high < 57
    assert start.high == pytest.approx(pv.high, abs=0.3), "the same cycle, reached from 20"


def test_a_loop_that_a_relay_moves_may_swing_and_another_one_may_not():
    moved = f"  - {{name: L, {GIVEN}, Kp: 0.3, Ti_Ki: 4}}\n"
    hunting = moved.replace("Kp: 0.3, Ti_Ki: 4", "Kp: 9, Ti_Ki: 1")
    follows = OTHER.replace("gain: 1", "input: L.MV + OO.MV * 5, gain: 1")
    assert not steady(RELAY + moved, OVEN + OTHER).problems
    assert not steady(RELAY + moved, OVEN + follows).problems
    problems = steady(RELAY + hunting, OVEN + OTHER).problems
    assert [(p.kind, p.loop) for p in problems] == [("no_steady_state", "L")]


def test_a_relay_that_never_comes_to_its_cycle_is_an_error():
    drifting = "  OO: {model: integrator, gain: 0.01, load: 0.2, initial: 5}\n"
    assert [p.kind for p in steady(RELAY, drifting).problems] == ["no_steady_state"]


def test_pulses_begin_in_their_cycle():
    blocks = "blocks:\n  - {name: PWM, type: ControlPWM, MV: L.MV, MinMV: 0, MaxMV: 100, Period: 20}\n"
    loop = f"  - {{name: L, {GIVEN}, Kp: 0.5, Ti_Ki: 6}}\n"
    plants = "  L: {model: first_order, gain: 100, time_constant: 8, dead_time: 1, input: PWM.PWM}\n"
    report = steady(loop, plants, blocks=blocks)
    assert not report.problems
    assert report.signals["L.PV"].low > 40


@pytest.mark.parametrize(
    ("before", "now", "comes"),
    [
        ((45.0, 55.0), (45.0, 55.0), True),
        ((45.0, 55.0), (45.1, 55.1), True),
        ((45.0, 55.0), (45.0, 55.3), False),
        ((45.0, 55.0), (44.7, 55.0), False),
        ((20.0, 55.0), (45.0, 55.0), False),
    ],
)
def test_extremes_come_back_within_a_share_of_the_swing(before, now, comes):
    assert swings_alike([before] * CYCLE_WINDOWS + [now] * CYCLE_WINDOWS, SCALE) == comes
    assert not swings_alike([now] * (2 * CYCLE_WINDOWS - 1), SCALE), "too few windows"
    half = (50.0, now[1])
    longer = [half, (now[0], 50.0)] * CYCLE_WINDOWS
    assert swings_alike(longer, SCALE), "a cycle over two windows"
