"""What a loop is called against its action, for every vendor: the words of heating and cooling, and what they tell."""

from __future__ import annotations

import pytest

import pidcfg
from pidcfg.cli.formats.runs import simulations_text
from pidcfg.sim.engine.influence import pv_change, wrong_actions
from pidcfg.sim.engine.network import initial_values, settle_plants
from pidcfg.sim.engine.run import Settings, prepare_network
from pidcfg.study.draft import draft_scenario, simulate_draft
from pidcfg.study.outcome import simulate_document
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.validate.shared_checks import purpose_of
from scenario_rig import Controller, scenario

LOOPS = {
    "dl06": "sample_rate: 1, action: {action}, tuning: {{gain: 1, reset: 60}}, pv: {{range: [0, 200]{unit}}}",
    "click": "bits: C1, integers: DS1, floats: DF1, sample_rate: 1 s, action: {action}, "
    "tuning: {{proportional_gain: 2, reset_time: 60}}, pv: {{range: [0, 200]{unit}}}, setpoint: {{value: 60}}",
    "ezlogix": "registers: R1, discretes: S1, algorithm: position, action: {action}, sample_rate: 1, "
    "tuning: {{proportional_gain: 2, integral_time: 60}}, pv: {{tag: IR1, range: [0, 200]{unit}}}, "
    "setpoint: {{value: 60}}, output: {{tag: OR1, range: [0, 100]}}",
    "nextopid": "type: PIDA_REAL, SP: 60, Kp: 2, Ti_Ki: 60, Td_Kd: 0, MinMV: 0, MaxMV: 100, MinPV: 0, "
    "MaxPV: 200, Direct: {action}, pv: {{unit: {plain_unit}}}",
    "dpide": "device: D0, SV: 60, CYCLE: 1000, Kc_Kp: 2, Ti_Ki: 60, Td_Kd: 0, PID_EQ: true, PID_DIR: {action}, "
    "MV_MAX: 100, MV_MIN: 0, pv: {{unit: {plain_unit}}}",
    "generic": "output_raises_pv: {action}, sample_time: 1, tuning: {{gain: 1, integral_time: 60}}, "
    "pv: {{range: [0, 200]{unit}}}, output: {{range: [0, 100]}}",
}
"""A loop of each vendor, with its action and the unit of its PV left open."""
PLC = {"dl06": "plc: {loop_table: V2000}\n", "nextopid": "plc: {sample_time: 1}\n"}
HEATING = {"dl06": "direct", "click": "direct", "ezlogix": "reverse", "nextopid": False, "dpide": True, "generic": True}
"""The action of a heater."""
KEYS = {"nextopid": "Direct", "dpide": "PID_DIR", "generic": "output_raises_pv"}
OPPOSITE = {"direct": "reverse", "reverse": "direct", True: False, False: True}
HEATED = ["Oven 2", "OVEN_2", "ovenTemp", "Pre-heater", "Heating zone", "heat", "heated tank", "kiln", "BURNER"]
HEATED += ["Ofen", "Glühofen 3", "Drehofen", "Öfen", "Ofentemperatur", "Heizung", "Vorheizer", "beheizt", "Heizkreis"]
HEATED += ["Erhitzer", "Vorwärmer", "Brenner", "Brennertemperatur", "Vorwaermung"]
COOLED = ["cooling", "Cooler", "COOL", "chilled water", "cold store", "freezer", "air-conditioning", "Kühlung"]
COOLED += ["KÜHLER", "Mantelkühlung", "Kuehlwasser", "Kälte", "Kaltwasser", "Gefrierraum", "Tiefkühlhaus"]
UNKNOWN = ["", "wheat", "cheater", "coolant", "scold", "Provence", "heat exchanger", "heat pump", "offen", "Kaltleiter"]
UNKNOWN += ["Brennerei", "Pfaffenhofen", "cooling water heater", "Heizen und Kühlen", "oven exhaust fan"]
UNKNOWN += ["heater, air-to-close valve", "cooling, normally open", "inverse heater", "Ofen, Feder öffnet"]
UNKNOWN += ["Heizung umgekehrt", "Ofen Abluft", "Lüfter der Kühlung", "cooler bypass"]
NO_UNIT = ["Cooling water flow", "FIC-101 cooling water", "Kühlwassermenge", "Druck der Heizung", "LIC 3 boiler"]
"""What tells something of a temperature alone."""


def spelled(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def configuration(vendor: str, action: object, name: str = "L", words: str = "", unit: str = "degC") -> str:
    """A file of one loop."""
    plc = PLC.get(vendor, "")
    text = (
        LOOPS[vendor]
        .format(action=spelled(action), unit=f", unit: {unit}" if unit else "", plain_unit=unit or "null")
        .replace(", pv: {unit: null}", "")
    )
    described = f'description: "{words}", ' if words else ""
    return f'pidcfg: 1\nvendor: {vendor}\n{plc}loops:\n  - {{name: "{name}", {described}{text}}}\n'


def document(*args: str, **options: str):
    return read_document(configuration(*args, **options).encode(), "c.yaml")


def told(*args: object, **options: str) -> list[str]:
    """What the rule says."""
    found = check_document(document(*args, **options)).findings
    assert not [d.message for d in found if d.severity.label == "error"]
    return [d.message for d in found if d.code == "PID110"]


def purpose(words: str, unit: str = "degC"):
    return purpose_of(check_document(document("dl06", "direct", words=words, unit=unit)).config.loops[0])


@pytest.mark.parametrize("place", ["name", "description"])
@pytest.mark.parametrize(("words", "heats"), [("Ofen", True), ("HEATER", True), ("Kuehlung", False), ("cooler", False)])
@pytest.mark.parametrize("vendor", LOOPS)
def test_the_wrong_action_is_named_with_the_word_and_the_right_one_is_none(vendor, words, heats, place):
    right = HEATING[vendor] if heats else OPPOSITE[HEATING[vendor]]
    wrong = OPPOSITE[right]
    texts = {"name": words} if place == "name" else {"words": words}
    key = KEYS.get(vendor, "action")

    assert told(vendor, right, **texts) == []
    way, purposed = ("falls", "heating") if heats else ("rises", "cooling")
    [text] = told(vendor, wrong, **texts)
    assert text == (
        f"{key}: {spelled(wrong)} is for a PV that {way} when the output rises, but the {place} says {words!r} "
        f"({purposed}), which needs {key}: {spelled(right)}"
    )


@pytest.mark.parametrize("words", HEATED)
def test_words_of_heating(words):
    assert purpose(words).heats


@pytest.mark.parametrize("words", COOLED)
def test_words_of_cooling(words):
    assert not purpose(words).heats


@pytest.mark.parametrize("words", UNKNOWN)
def test_other_words_tell_nothing(words):
    assert purpose(words) is None


@pytest.mark.parametrize("words", NO_UNIT)
def test_without_a_unit_words_of_other_quantities_tell_nothing(words):
    assert purpose(words, unit="") is None
    assert purpose(words, unit="°C") is not None


@pytest.mark.parametrize("unit", ["degC", "°C", "C", "degF", "K", "Grad", "Grad C", ""])
def test_temperatures_are_heated(unit):
    assert purpose("Ofen", unit).heats


@pytest.mark.parametrize("unit", ["bar", "m3/h", "'%'", "l/min"])
def test_nothing_else_is(unit):
    assert purpose("Ofen", unit) is None


def test_a_direction_that_is_not_given_is_told_once():
    text = configuration("dpide", True, name="OVEN").replace("PID_DIR: true, ", "")
    found = check_document(read_document(text.encode(), "c.yaml")).findings
    assert [d.code for d in found if d.code in {"DP781", "PID110"}] == ["DP781"]


def test_an_expression_is_no_action():
    text = configuration("nextopid", True, name="OVEN").replace("Direct: true", "Direct: Cooling")
    text = text.replace("loops:", "signals: {Cooling: false}\nloops:")
    found = check_document(read_document(text.encode(), "c.yaml")).findings
    assert "PID110" not in {d.code for d in found}


# --- A drafted scenario takes the sign of its plant from the word, or says that it is assumed -------------------------


def drafted(vendor: str, action: object, **texts: str):
    """The scenario that is drafted for a loop, and what becomes of its run."""
    doc = document(vendor, action, **texts)
    return draft_scenario(check_document(doc), "c.yaml").text, simulate_draft(doc, Settings("python"))


@pytest.mark.parametrize(("words", "heats"), [("Ofen", True), ("Kuehlung", False)])
@pytest.mark.parametrize("vendor", LOOPS)
def test_a_wrong_action_fails_in_the_draft_where_a_word_tells_it(vendor, words, heats):
    right = HEATING[vendor] if heats else OPPOSITE[HEATING[vendor]]
    text, outcome = drafted(vendor, right, words=words)
    assert "assumed_signs" not in text
    assert outcome.passed
    assert [v.kind for v in outcome.report.standing if v.kind == "wrong-action"] == []

    text, outcome = drafted(vendor, OPPOSITE[right], words=words)
    purposed = "heating" if heats else "cooling"
    here = f"{KEYS.get(vendor, 'action')}: {spelled(OPPOSITE[right])}"
    assert f"# - L fails: the description says '{words}' ({purposed}), and {here} is for the opposite\n" in text
    assert "allow:" not in text
    assert not outcome.passed
    assert "PID060" in {d.code for d in outcome.findings}
    assert outcome.report.loops["L"].verdict == "failed"


@pytest.mark.parametrize("action", [True, False])
@pytest.mark.parametrize("vendor", LOOPS)
def test_without_a_word_the_sign_is_assumed_and_the_action_not_judged(vendor, action):
    text, outcome = drafted(vendor, HEATING[vendor] if action else OPPOSITE[HEATING[vendor]])
    said = f"# sign of the plant assumed from `{KEYS.get(vendor, 'action')}`: check, and take the loop off the list\n"
    assert f"{said}assumed_signs: [L]\n" in text
    assert outcome.passed
    [verdict] = [v for v in outcome.report.standing if v.kind == "wrong-action"]
    assert (verdict.loop, verdict.is_judged, verdict.passed) == ("L", False, True)
    line = "  L  not judged  whether the action is right: the sign of the plant is assumed from it\n"
    assert line in simulations_text([outcome])
    open_ones = sum(not v.is_judged for v in outcome.report.standing)
    assert simulations_text([outcome]).splitlines()[-1].endswith(f", {open_ones} not judged")

    checked = text.replace(f"{said}assumed_signs: [L]\n", "")
    config = configuration(vendor, HEATING[vendor] if action else OPPOSITE[HEATING[vendor]])
    by_hand = pidcfg.simulate(checked, files={"c.yaml": config}, engine="python")
    assert by_hand.passed
    assert [v for v in by_hand.report.standing if v.kind == "wrong-action"] == []


def test_a_loop_of_the_list_that_is_none_is_told():
    text, _ = drafted("click", "direct")
    found = pidcfg.simulate(
        text.replace("assumed_signs: [L]", "assumed_signs: [M]"), files={"c.yaml": configuration("click", "direct")}
    )
    assert [(d.code, d.path) for d in found.findings] == [("PID050", ("assumed_signs", 0))]


# --- The action of every vendor, by simulation: the right one settles, the wrong one is flagged (PID060) --------------


CONFIGURATIONS = {
    "dl06": """pidcfg: 1
vendor: dl06
plc: {loop_table: V2000}
loops:
  - {name: L, mode: auto, action: ACTION, sample_rate: 1, bumpless: II, bias_freeze: true,
     tuning: {gain: 2, reset: 60}, pv: {range: [0, 100]}, setpoint: {value: 60}, output: {range: [0, 100]}}
""",
    "click": """pidcfg: 1
vendor: click
loops:
  - {name: L, bits: C1, integers: DS1, floats: DF1, mode: auto, action: ACTION, sample_rate: 1 s, bumpless: 2,
     freeze_bias: true, tuning: {proportional_gain: 2, reset_time: 60}, pv: {range: [0, 100]}, setpoint: {value: 60}}
""",
    "ezlogix": """pidcfg: 1
vendor: ezlogix
loops:
  - {name: L, registers: R1, discretes: S1, mode: auto, algorithm: position, action: ACTION, sample_rate: 1,
     tuning: {proportional_gain: 2, integral_time: 60}, pv: {tag: IR1, range: [0, 100]}, setpoint: {value: 60},
     output: {tag: OR1, range: [0, 100]}}
""",
}
OUT = {"dl06": "OUT", "click": "CO", "ezlogix": "CV"}
HEATING_ACTION = {"dl06": "direct", "click": "direct", "ezlogix": "reverse"}
OTHER_ACTION = {"direct": "reverse", "reverse": "direct"}
PLANTS = {
    "heating": "{model: first_order, gain: 0.8, load: 15, time_constant: 40, initial: 50}",
    "cooling": "{model: first_order, gain: -0.8, load: 95, time_constant: 40, initial: 70}",
}
CHAIN = """plants:
  - {name: p, model: dead_time, input: q}
  - {name: q, model: dead_time, gain: -1, input: A.OUT}
connect: {A.PV: p}
"""


def run(folder, vendor: str, process: str, action: str):
    """The outcome of ten minutes with one action on one process."""
    (folder / "c.yaml").write_text(CONFIGURATIONS[vendor].replace("ACTION", action), "utf-8")
    text = (
        f"pidcfg: 1\nscenario: s\nconfig: {folder.as_posix()}/c.yaml\nduration: 600\nplants: {{L: {PLANTS[process]}}}\n"
    )
    return simulate_document(read_document(text.encode(), "s.yaml"), Settings(engine="python"))


@pytest.mark.parametrize("process", PLANTS)
@pytest.mark.parametrize("vendor", CONFIGURATIONS)
def test_the_right_action_settles(tmp_path, vendor, process):
    action = HEATING_ACTION[vendor] if process == "heating" else OTHER_ACTION[HEATING_ACTION[vendor]]
    outcome = run(tmp_path, vendor, process, action)
    assert outcome.passed
    assert outcome.report.signals["L.PV"].final == pytest.approx(60, abs=0.2)


@pytest.mark.parametrize("process", PLANTS)
@pytest.mark.parametrize("vendor", CONFIGURATIONS)
def test_the_wrong_action_runs_away_and_is_flagged(tmp_path, vendor, process):
    action = OTHER_ACTION[HEATING_ACTION[vendor]] if process == "heating" else HEATING_ACTION[vendor]
    outcome = run(tmp_path, vendor, process, action)
    assert not outcome.passed
    [found] = [d for d in outcome.findings if d.code == "PID060"]
    assert found.loop == "L"
    assert "positive feedback" in found.message
    out, pv = (outcome.report.signals[f"L.{name}"].final for name in (OUT[vendor], "PV"))
    assert out in {0, 100}, "the output stays at its limit"
    assert abs(pv - 60) > 25


@pytest.mark.parametrize(
    ("text", "sign"),
    [
        ("plants: {A: {model: dead_time}}\n", 1),
        ("plants: {A: {model: integrator, gain: -0.1}}\n", -1),
        ("plants: {A: {model: first_order, time_constant: 1, input: 100 - A.OUT}}\n", -1),
        ("plants: {A: {model: dead_time, input: min(A.OUT, -5)}}\n", 0),
        ("plants: {A: {model: dead_time, input: B.OUT}}\n", 0),
        ("plants:\n  - {name: p, model: dead_time, input: A.OUT, gain: -2}\nconnect: {A.PV: 0 - p * 3}\n", 1),
        (CHAIN, -1),
        ("plants: {A: {model: dead_time, noise: 1, gain: -1}}\n", -1),
        ("plants: {A: {model: dead_time, input: 1 / A.OUT}}\n", 0),
        ("connect: {A.PV: sqrt(A.OUT)}\n", 1),
    ],
)
def test_the_way_from_output_to_pv_is_followed(text, sign):
    plc = Controller.load()
    net = prepare_network(scenario(text), plc)
    assert not any(p.severity == "error" for p in net.problems), net.problems
    settle_plants(net, initial_values(net))
    change = pv_change(net, plc, 0)
    assert (change > 0) - (change < 0) == sign
    plc.output_raises_pv = (False,) * 8
    assert len(list(wrong_actions(net, plc))) == (sign > 0)
    plc.output_raises_pv = (True,) * 8
    assert len(list(wrong_actions(net, plc))) == (sign < 0)


@pytest.mark.parametrize("where", ["scenario", "configuration"])
def test_a_key_that_stands_twice_is_not_run_as_a_guess(tmp_path, where):
    again = "vendor: click\n" if where == "configuration" else ""
    (tmp_path / "c.yaml").write_text(CONFIGURATIONS["click"].replace("ACTION", "direct") + again, "utf-8")
    twice = "duration: 9\n" if where == "scenario" else ""
    head = f"pidcfg: 1\nscenario: s\nconfig: {tmp_path.as_posix()}/c.yaml\nduration: 60\n{twice}"
    text = f"{head}plants: {{L: {PLANTS['heating']}}}\n"
    outcome = simulate_document(read_document(text.encode(), "s.yaml"), Settings(engine="python"))
    assert outcome.report is None
    assert [d.code for d in outcome.findings] == ["PID004" if where == "scenario" else "PID058"]
