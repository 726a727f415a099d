"""The action of every vendor, by simulation: the right one settles, the wrong one runs away and is flagged (PID060)."""

from __future__ import annotations

import pytest

from pidcfg.sim.engine.influence import answer, wrong_actions
from pidcfg.sim.engine.network import initial_values, rest
from pidcfg.sim.engine.run import Settings, prepare
from pidcfg.study.outcome import simulate_document
from pidcfg.text.source import read_document
from scenario_rig import Controller, scenario

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
HEATING = {"dl06": "direct", "click": "direct", "ezlogix": "reverse"}
OPPOSITE = {"direct": "reverse", "reverse": "direct"}
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
    action = HEATING[vendor] if process == "heating" else OPPOSITE[HEATING[vendor]]
    outcome = run(tmp_path, vendor, process, action)
    assert outcome.passed
    assert outcome.report.signals["L.PV"].final == pytest.approx(60, abs=0.2)


@pytest.mark.parametrize("process", PLANTS)
@pytest.mark.parametrize("vendor", CONFIGURATIONS)
def test_the_wrong_action_runs_away_and_is_flagged(tmp_path, vendor, process):
    action = OPPOSITE[HEATING[vendor]] if process == "heating" else HEATING[vendor]
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
    net = prepare(scenario(text), plc)
    assert not any(p.severity == "error" for p in net.problems), net.problems
    rest(net, initial_values(net))
    change = answer(net, plc, 0)
    assert (change > 0) - (change < 0) == sign
    plc.rises = (False,) * 8
    assert len(list(wrong_actions(net, plc))) == (sign > 0)
    plc.rises = (True,) * 8
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
