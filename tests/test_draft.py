"""Drafted scenarios: they run, no verdict fails, and their numbers fit the configuration."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

import good_plants
import good_runs
import pidcfg
from pidcfg.cli.main import cli
from pidcfg.study.draft import NoDraftError, draft_scenario, scalar_text
from pidcfg.study.draft_plan import round_to_digits, round_up_time, rounded_value, time_text
from pidcfg.text.reader import DEFAULT
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_source

EXAMPLES = Path(__file__).parents[1] / "examples"
CONFIGURATIONS = sorted(
    path for path in EXAMPLES.glob("*/*.yaml") if ".scenario" not in path.name and path.parent.name != "mistakes"
)


def draft(source, name="plant.yaml"):
    """The drafted scenario of a text, as text and as data."""
    made = draft_scenario(check_source(source, name, None, DEFAULT), name)
    return made, read_document(made.text.encode(), "plant.scenario.yaml").data


def run(source, name="plant.yaml"):
    """The drafted scenario, its data, and its run from the files alone."""
    made, data = draft(source, name)
    text = source.read_text("utf-8") if isinstance(source, Path) else source
    return made, data, pidcfg.simulate(made.text, name="x.scenario.yaml", files={name: text}, engine="python")


@pytest.mark.parametrize("path", CONFIGURATIONS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_every_example_has_a_scenario_that_passes(path):
    _, data, result = run(path, path.name)
    assert result.ok, [d.message for d in result.findings]
    missing = [(v.loop, v.verdict) for v in result.report.standing if v.allowed]
    assert missing == ([("LEVEL", "not-proven")] if path.stem == "booster" else []), "a level of 48 min at 0.1 s"
    assert [d.message for d in result.findings if d.severity.label != "info"] == []
    assert all(e.passed for e in result.report.expectations)
    assert any("set" in event for event in data["events"]) or "FAN" in str(data)


@pytest.mark.parametrize("vendor", good_runs.VENDORS)
def test_random_configurations_have_one_too(vendor):
    for seed in (100, 101, 102):
        text = json.dumps(good_runs.Drawer(seed, vendor).course(seed).config)
        _, _, result = run(text)
        assert result.ok, (seed, [d.message for d in result.findings])
        assert not any(v.allowed for v in result.report.standing)


@pytest.mark.parametrize("vendor", ["dl06", "click", "ezlogix", "nextopid"])
def test_plants_of_eight_loops(vendor):
    _, _, result = run(getattr(good_plants, vendor)("extruder"))
    assert result.ok
    assert not any(v.allowed for v in result.report.standing)


def test_a_master_reads_its_slave_and_its_set_point_alone_moves():
    _, data = draft(EXAMPLES / "dl06" / "reactor.yaml")
    assert data["plants"]["TIC-101"]["input"] == "FIC-102.PV"
    assert "input" not in data["plants"]["FIC-102"]
    assert {e["loop"] for e in data["events"]} == {"TIC-101", "LIC-103"}
    assert float(data["plants"]["LIC-103"]["gain"]) < 0 < float(data["plants"]["FIC-102"]["gain"])
    assert data["plants"]["TIC-101"]["initial"] == "85"


def test_a_cascade_of_three_is_chained():
    _, data = draft(EXAMPLES / "nextopid" / "cascade.yaml")
    inputs = {name: plant.get("input") for name, plant in data["plants"].items()}
    assert inputs == {"TIC_1": "TIC_2.PV", "TIC_2": "FIC_3.PV", "FIC_3": None}
    times = [float(data["plants"][name]["time_constant"]) for name in ("FIC_3", "TIC_2", "TIC_1")]
    assert times == sorted(times)


def test_loops_that_share_a_pv_have_one_plant():
    _, data = draft(EXAMPLES / "ezlogix" / "greenhouse.yaml")
    assert [plant["name"] for plant in data["plants"]] == ["HEAT_process"]
    assert data["connect"] == {"HEAT.PV": "HEAT_process", "VENT.PV": "HEAT_process"}
    assert data["plants"][0]["input"] == "HEAT.CV - VENT.CV"


def test_plants_behind_a_selector_read_its_output_and_one_loop_is_left_out():
    _, data, result = run(EXAMPLES / "nextopid" / "override.yaml", "override.yaml")
    assert {plant["input"] for plant in data["plants"].values()} == {"VALVE.MV"}
    texts = {v.loop: v.text for v in result.report.standing if v.kind == "error-stands"}
    assert texts["PIC_2"] == "a selector leaves its output out"
    assert float(data["plants"]["PIC_2"]["initial"]) < 4.0


def test_a_larger_wins_selector_leaves_out_the_loop_that_asks_for_less():
    text = (EXAMPLES / "nextopid" / "override.yaml").read_text("utf-8").replace("SelectMin", "SelectMax")
    _, data, result = run(text)
    assert float(data["plants"]["PIC_2"]["initial"]) > 4.0
    assert result.ok


def test_a_wild_flow_moves_the_set_point_of_a_ratio():
    _, data = draft(EXAMPLES / "nextopid" / "ratio.yaml")
    assert [e["set"] for e in data["events"] if "set" in e] == [{"Gas": "13.2"}]


def test_the_signal_behind_a_filter_is_wired():
    _, data = draft(EXAMPLES / "nextopid" / "furnace.yaml")
    assert data["connect"] == {"Sensor": "TIC_1_process"}
    assert [p["name"] for p in data["plants"]] == ["TIC_1_process", "FAN"]
    assert all(str(e["set"]["setpoint"]).isdecimal() for e in data["events"] if "set" in e)


def test_a_root_is_fed_with_its_square():
    _, data = draft(EXAMPLES / "ezlogix" / "dosing.yaml")
    assert data["connect"] == {"FLOW.PV": "FLOW_process * FLOW_process / 50"}


def test_a_loop_in_manual_is_brought_to_auto():
    _, data, result = run(EXAMPLES / "nextopid" / "autotune.yaml", "autotune.yaml")
    assert {"at": "0", "loop": "TIC_1", "mode": "auto"} in data["events"]
    assert {"loop": "TIC_1", "mode": "auto"} in data["expect"]
    assert [m.mode for m in result.report.loops["TIC_1"].modes][-1] == "auto"


LOOP = """pidcfg: 1
vendor: dl06
plc: {{loop_table: V2000, reset_decimals: 1}}
loops:
  - name: A
    mode: auto
    sample_rate: 1
    action: {action}
    bias_freeze: true
    bumpless: II
    tuning: {{gain: 2, reset: {reset}}}
    pv: {{range: [-50, 150], unit: degC}}
    setpoint: {{value: {sp}, limits: {limits}}}
    output: {{range: [0, 100], limits: {out}}}
"""


def of_loop(action="direct", reset="60", sp="40", limits="[0, 100]", out="[0, 100]"):
    """The run of one DL06 loop's scenario."""
    return run(LOOP.format(action=action, reset=reset, sp=sp, limits=limits, out=out))


def setpoints(data):
    return [float(e["set"]["setpoint"]) for e in data["events"] if "set" in e]


@pytest.mark.parametrize(
    ("sp", "limits"), [("40", "[0, 100]"), ("95", "[0, 100]"), ("2", "[0, 100]"), ("50", "[45, 55]")]
)
def test_steps_stay_inside_the_limits_of_the_set_point(sp, limits):
    _, data, result = of_loop(sp=sp, limits=limits)
    low, high = json.loads(limits)
    (new,) = setpoints(data)
    assert low < new < high
    assert 0 < abs(new - float(sp)) <= 20.0
    assert result.ok


def test_a_set_point_at_its_limit_is_set_where_the_loop_can_rest():
    _, data, result = of_loop(sp="-50", limits="[-50, 150]")
    assert data["events"][0] == {"at": "0", "loop": "A", "set": {"setpoint": "50"}}
    assert result.ok


def test_no_room_means_no_step():
    _, data, _ = of_loop(sp="50", limits="[50, 50.5]")
    assert not [e for e in data["events"] if "set" in e and float(e["at"]) > 0]


def test_the_action_gives_the_sign_and_the_limits_the_middle():
    _, rising, _ = of_loop()
    _, falling, _ = of_loop(action="reverse", out="[20, 100]")
    one, two = rising["plants"]["A"], falling["plants"]["A"]
    assert (float(one["gain"]) > 0, float(two["gain"]) < 0) == (True, True)
    assert float(one["load"]) + float(one["gain"]) * 50 == pytest.approx(40, abs=0.1)
    assert float(two["load"]) + float(two["gain"]) * 60 == pytest.approx(40, abs=0.1)


def test_disturbances_come_first_and_ask_for_a_tenth_of_the_output():
    _, data, _ = of_loop()
    push, step = data["events"]
    plant = data["plants"]["A"]
    assert float(push["at"]) < float(step["at"]) < float(data["duration"])
    moved = float(plant["load"]) - float(push["disturb"]["load"])
    assert moved / float(plant["gain"]) == pytest.approx(10, abs=0.1)


def test_a_loop_without_an_integral_is_not_expected_to_arrive():
    _, data, result = of_loop(reset="off")
    assert [e for e in data.get("expect", ()) if "final" in e] == []
    assert not [e for e in data["events"] if "disturb" in e]
    assert result.ok


def test_a_dead_band_widens_the_tolerance_and_the_step_and_the_loop_is_proven():
    text = LOOP.format(action="direct", reset="60", sp="40", limits="[-50, 150]", out="[0, 100]")
    made, data, result = run(text + "    error: {deadband: 10}\n")
    span = result.outcome.axes["A"].pv_range[1] - result.outcome.axes["A"].pv_range[0]
    assert float(data["tolerance"]["A"]) == pytest.approx(10 + 0.02 * span, abs=0.2)
    assert "# its dead band is 10; and 2 % of the range" in made.text
    (new,) = setpoints(data)
    assert abs(new - 40) >= 2 * float(data["tolerance"]["A"])
    assert result.report.loops["A"].verdict == "proven"
    assert "allow" not in data


@pytest.mark.parametrize(("gain", "step"), [("2", 20), ("0.3", 8)])
def test_what_a_loop_without_an_integral_leaves_of_its_step_is_its_tolerance(gain, step):
    text = LOOP.format(action="direct", reset="off", sp="40", limits="[-50, 150]", out="[0, 100]")
    made, data, result = run(text.replace("gain: 2", f"gain: {gain}"))
    assert abs(setpoints(data)[0] - 40) == pytest.approx(step, abs=0.1)
    (new,) = setpoints(data)
    plant, signal = data["plants"]["A"], result.report.signals["A.PV"]
    axes = result.outcome.axes["A"]
    span = axes.pv_range[1] - axes.pv_range[0]
    left = float(data["tolerance"]["A"]) - 0.02 * span
    assert abs(new - signal.final) == pytest.approx(left, rel=0.1)
    assert f"of a step of {abs(new - 40):g}; and 2 % of the range" in made.text
    assert float(plant["initial"]) == 40


def test_a_loop_that_comes_to_its_set_point_has_no_tolerance():
    assert "tolerance" not in of_loop()[1]


def test_a_profile_is_named():
    made, _ = draft(EXAMPLES / "dl06" / "reactor.yaml")
    assert made.remarks == (
        "the profile of TIC-101 does not run; an event {at: …, loop: TIC-101, ramp_soak: start} starts it",
    )
    assert "# - the profile of TIC-101 does not run" in made.text


@pytest.mark.parametrize(("output", "said"), [("[0, 100]", False), (None, True)])
def test_an_output_in_counts_is_named(output, said):
    text = LOOP.format(action="direct", reset="60", sp="40", limits="[0, 100]", out=output or "[0, 4095]")
    made, _, _ = run(text if output else text.replace("range: [0, 100], ", ""))
    remark = "are in counts of the output, 0 to 4095; with an output.range in its unit"
    assert (remark in made.text) == said
    assert any(remark in one for one in made.remarks) == said


def test_a_verdict_that_fails_is_allowed_with_its_reason():
    text = LOOP.format(action="direct", reset="60", sp="40", limits="[0, 100]", out="[0, 100]")
    made, data, result = run(text.replace("gain: 2,", "gain: 2, rate: 0,") + "    error: {deadband: 30}\n")
    assert result.ok
    assert bool(data.get("allow")) == any(v.allowed for v in result.report.standing)
    assert made.text.startswith("# A first scenario for plant.yaml")


def test_a_long_run_is_cut_and_says_so():
    rows = good_plants.click("waterworks")
    made, data = draft(rows)
    assert any("is short for the slowest loop" in remark for remark in made.remarks)
    assert float(data["duration"]) < 13 * 3600


def test_errors_have_no_draft():
    with pytest.raises(NoDraftError, match="has errors; run 'pidcfg validate"):
        draft(EXAMPLES / "mistakes" / "oven.yaml")


@pytest.mark.parametrize("name", ["TIC 1", "1A", "true", "A/B", "Ofen-ä"])
def test_names_of_any_kind(name):
    text = LOOP.format(action="direct", reset="60", sp="40", limits="[0, 100]", out="[0, 100]")
    _, _, result = run(text.replace("name: A", f'name: "{name}"'))
    assert result.ok, [d.message for d in result.findings]


@pytest.mark.parametrize(
    ("value", "text"),
    [("TIC-1", "TIC-1"), ("true", '"true"'), ("a, b", '"a, b"'), ("30 %", "30 %"), (True, "true"), (1.5, "1.5")],
)
def test_scalars(value, text):
    assert scalar_text(value) == text


def test_numbers_as_people_write_them():
    assert [round_up_time(x) for x in (1.0, 1.1, 7.3, 480, 481, 0.013)] == [1, 1.2, 8, 500, 500, 0.016]
    assert [round_to_digits(x) for x in (2.66666, 3.0, -93.345)] == [2.667, 3, -93.34]
    assert [rounded_value(12.3456, span) for span in (0.5, 100, 30000)] == [12.3456, 12.3, 12]
    assert [time_text(x) for x in (90, 600, 7200)] == ["90 s", "10 min", "2 h"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "reactor.yaml").write_bytes((EXAMPLES / "dl06" / "reactor.yaml").read_bytes())
    return tmp_path


def call(*words):
    return CliRunner().invoke(cli, list(words))


def test_init_writes_a_scenario_that_finds_its_configuration(folder):
    (folder / "runs").mkdir()
    assert call("init", "--scenario", "reactor.yaml", "-o", "runs/first.yaml").exit_code == 0
    assert "config: ../reactor.yaml\n" in (folder / "runs/first.yaml").read_text("utf-8")
    assert call("validate", "runs/first.yaml").exit_code == 0
    assert call("simulate", "runs/first.yaml").exit_code == 0


def test_init_prints_without_a_name_and_never_overwrites(folder):
    printed = call("init", "--scenario", "reactor.yaml")
    assert printed.stdout.startswith("# A first scenario for reactor.yaml")
    (folder / "x.yaml").write_text("mine", encoding="utf-8")
    refused = call("init", "--scenario", "reactor.yaml", "-o", "x.yaml")
    assert (refused.exit_code, (folder / "x.yaml").read_text("utf-8")) == (1, "mine")
    assert call("init", "--scenario", "reactor.yaml", "-o", "x.yaml", "--force").exit_code == 0


def test_init_refuses_what_does_not_go_together(folder):
    assert "--scenario goes with neither" in call("init", "--scenario", "reactor.yaml", "--vendor", "dl06").stderr
    assert "what shall be written?" in call("init").stderr
    wrong = call("init", "--scenario", str(EXAMPLES / "mistakes" / "oven.yaml"))
    assert (wrong.exit_code, wrong.stdout) == (1, "")
    assert "DL242" in wrong.stderr


def test_the_remark_on_a_draft_keeps_out_of_results(folder):
    loud, quiet = call("simulate", "reactor.yaml", "--format", "json"), call("simulate", "reactor.yaml", "-q")
    assert json.loads(loud.stdout)["passed"]
    assert "it runs with a drafted scenario" in loud.stderr
    assert quiet.stderr == ""


def test_the_runs_that_try_a_scenario_keep_to_the_limit_of_loop_steps():
    path = EXAMPLES / "dl06" / "oven.yaml"
    checked = check_source(path, None, None, DEFAULT)
    with pytest.raises(NoDraftError, match=r"no scenario runs with it \(2001 loop-steps; the limit is 1000\)"):
        draft_scenario(checked, path.name, max_loop_steps=1000)
    found = pidcfg.simulate(path, limits=replace(DEFAULT, loop_steps=1000)).findings
    assert "the limit is 1000" in next(d.message for d in found if d.code == "PID058")
