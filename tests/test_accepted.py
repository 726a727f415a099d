"""Runs that a person has accepted: what a run differs in is red, what agrees is green, and how the file is written."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from accepted_spoils import EXAMPLES, SPOILS, files_of, loops_that_differ, run
from command import run as command
from pidcfg import certify, check, simulate
from pidcfg.cli.formats.runs import render_runs
from pidcfg.output.arguments import ArgumentError
from pidcfg.schemas.scenario import AcceptedRun, AlarmTimes, ModeBegin
from pidcfg.study.accepted import differences_by_loop
from standing_rig import SCENARIO, SIDES, failures, outcome, unproven, verdict

GOOD = "good.json"
KIND = "differs-from-accepted"
SHORT = ("duration: 200", "duration: 92")
FASTER = ("gain: 2.00", "gain: 3.00")
NO_LOOP = ("gain: 2.00", "gain: 0.00")


def accepted(*edits, **how):
    """The text of the file of a run that is accepted."""
    text = outcome("dl06", *edits, accept=GOOD, **how).accepted
    assert text is not None
    return text


def against(text, *edits, **how):
    """A run that is held against an accepted one."""
    return outcome("dl06", *edits, against=text, against_name=GOOD, **how)


# --- mistakes that only intent knows ---------------------------------------------------------------------------------

UNSEEN = {
    "click/brewery": ["high: 26"],  # the fermenter stays below 19 degC
    "dpide/chiller": ["Td_Kd: 30.0"],  # the load comes slowly
    "nextopid/heatexchanger": ["Kp: 1.0", "Ti_Ki: 10.0"],  # the feed-forward leaves nothing to correct
}
"""The spoils that change nothing beyond the tolerances."""


@pytest.mark.parametrize("example", SPOILS)
def test_every_mistake_that_changes_a_run_is_red_and_the_run_itself_is_green(example):
    good = run(example, accept=GOOD)
    text = good.accepted
    assert text is not None, [v for v in good.report.standing if v.fails]
    again = run(example, against=text, against_name=GOOD)
    assert again.passed, [v for v in again.report.standing if v.fails]
    assert run(example, accept=GOOD).accepted == text
    unseen = []
    for old, new in SPOILS[example]:
        spoiled = run(example, old, new, against=text, against_name=GOOD)
        red = {v.loop for v in spoiled.report.standing if v.kind == KIND and v.fails}
        assert loops_that_differ(json.loads(text), good.to_json(), spoiled.to_json()) <= red, (old, new)
        assert not (red and spoiled.passed)
        unseen += [] if red else [old]
    assert unseen == UNSEEN.get(example, [])


def test_what_differs_is_told_in_units_with_the_tolerance():
    unit = ("range: [0, 100]}\n    setpoint", "range: [0, 100], unit: degC}\n    setpoint")
    result = against(accepted(config=[unit]), config=[FASTER, unit])
    found = verdict(result, KIND)
    assert found.verdict == "failed"
    assert "rise_time 12.5 s instead of 20.5 s ± 1.025 s; " in found.text
    assert "; itae 7177 degC s² instead of 1.227e+04 degC s² ± 1227 degC s²; " in found.text
    assert found.text.endswith("(good.json)")
    assert result.report.loops["TANK"].verdict == "failed"
    assert result.report.loops["TANK"].missing == found.text


def test_the_range_of_a_transmitter_is_compared_though_no_signal_shows_it():
    found = verdict(
        against(accepted(), config=[("range: [0, 100]}\n    setpoint", "range: [0, 120]}\n    setpoint")]), KIND
    )
    assert found.text.startswith("its PV's range is 0 to 120 instead of 0 to 100")


# --- proven, failed, not proven --------------------------------------------------------------------------------------


def test_what_is_not_proven_is_proven_as_it_was_accepted():
    assert unproven(outcome("dl06", SHORT)) == {"not-settled"}
    result = against(accepted(SHORT), SHORT)
    assert result.passed
    assert result.report.loops["TANK"].verdict == "proven"
    found = verdict(result, "not-settled")
    assert (found.verdict, found.word) == ("proven", "accepted")
    assert found.text.startswith("as accepted in good.json: settled for ")
    text = render_runs("text", [result.outcome], tables=True)
    assert "  accepted  TANK not-settled  as accepted in good.json: settled for " in text
    assert verdict(result, KIND).text == "as accepted in good.json"


def test_without_the_run_without_control_it_is_proven_as_it_was_accepted():
    assert unproven(outcome("dl06", reference=False)) == {"no-better"}
    assert against(accepted(), reference=False).passed


def test_a_difference_leaves_not_proven_what_was():
    result = against(accepted(SHORT), SHORT, config=[FASTER])
    assert unproven(result) == {"not-settled"}
    assert failures(result) == {KIND}


def test_a_signal_outside_of_the_loops_that_differs_leaves_not_proven_what_was():
    data = json.loads(accepted(SHORT))
    data["signals"] = {"valve": {"min": 0.0, "max": 1.0, "final": 1.0}}
    result = against(json.dumps(data), SHORT)
    assert verdict(result, KIND, "").text == "there is no signal valve (good.json)"
    assert unproven(result) == {"not-settled"}
    assert not verdict(result, KIND).fails


def test_an_alarm_that_comes_twice_is_on_for_both_times():
    config = SIDES["dl06"].alarms
    loop = outcome("dl06", ("setpoint: 65", "setpoint: 75"), accept=GOOD, config=[config])
    spans = [a for a in loop.report.loops["TANK"].alarms if a.alarm == "deviation_yellow"]
    assert len(spans) > 1
    kept = json.loads(loop.accepted)["loops"]["TANK"]["alarms"]["deviation_yellow"]
    assert kept["first"] == spans[0].at
    assert kept["total"] == pytest.approx(sum(a.cleared - a.at for a in spans), rel=1e-5)


def test_what_has_failed_stays_failed_and_is_not_accepted():
    assert outcome("dl06", accept=GOOD, config=[SIDES["dl06"].gain]).accepted is None
    text = accepted(more="allow:\n  - {kind: oscillates, loop: TANK, reason: on loan}\n", config=[SIDES["dl06"].gain])
    result = against(text, config=[SIDES["dl06"].gain])
    assert not verdict(result, KIND).fails
    assert failures(result) == {"oscillates"}
    assert result.report.loops["TANK"].verdict == "failed"


def test_an_expectation_that_does_not_hold_is_not_accepted():
    more = "expect:\n  - {signal: TANK.PV, max: 50}\n"
    assert outcome("dl06", more=more, accept=GOOD).accepted is None


def test_loops_that_the_scenario_leaves_out_are_not_compared():
    files = files_of("dl06/reactor")
    scenario = files["reactor.scenario.yaml"] + "loops: [LIC-103]\n"
    text = simulate(scenario, name="s.yaml", files=files, accept=GOOD).accepted
    assert list(json.loads(text)["loops"]) == ["LIC-103"]
    spoiled = files_of("dl06/reactor", "gain: 2.50", "gain: 1.00")
    result = simulate(scenario, name="s.yaml", files=spoiled, against=text)
    assert result.passed
    assert [v.loop for v in result.report.standing if v.kind == KIND] == ["LIC-103"]


# --- tolerances ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def base():
    """An accepted run with a bit of everything."""
    run = AcceptedRun.model_validate_json(accepted())
    loop = run.loops["TANK"]
    metrics = {**dict.fromkeys(loop.metrics, 100.0), "oscillation_amplitude": 0.5}
    alarms = {"pv_high": AlarmTimes(first=100.0, total=50.0)}
    modes = [ModeBegin(at=0.0, mode="manual"), ModeBegin(at=100.0, mode="auto")]
    given = {"metrics": metrics, "alarms": alarms, "modes": modes, "output_unit": "%"}
    signals = {"valve": loop.signals["pv"]}
    return run.model_copy(update={"loops": {"TANK": loop.model_copy(update=given)}, "signals": signals})


def changed(base, place, value):
    """The run with another value at a place of its loop."""
    data = base.model_dump()
    *way, last = place
    part = data if "valve" in way else data["loops"]["TANK"]
    for step in way:
        part = part[step]
    part[last] = value
    return AcceptedRun.model_validate(data)


# The loop: samples of 0.5 s, a span of 100, an output of 0 to 100 %, a run of 200 s.
@pytest.mark.parametrize(
    ("place", "value", "least"),
    [
        (("metrics", "overshoot"), 100.0, 10.0),
        (("metrics", "settling_time"), 100.0, 5.0),
        (("metrics", "rise_time"), 100.0, 5.0),
        (("metrics", "rise_time"), 2.0, 1.0),
        (("metrics", "overshoot"), 3.0, 2.0),
        (("metrics", "iae"), 100.0, 10.0),
        (("metrics", "iae"), 1.0, 4.0),
        (("metrics", "ise"), 100.0, 20.0),
        (("metrics", "ise"), 1.0, 2.0),
        (("metrics", "itae"), 10_000.0, 1000.0),
        (("metrics", "itae"), 1.0, 400.0),
        (("metrics", "total_variation"), 100.0, 10.0),
        (("metrics", "total_variation"), 1.0, 2.0),
        (("metrics", "final_error"), 100.0, 1.0),
        (("metrics", "oscillation_period"), 100.0, 5.0),
        (("metrics", "oscillation_amplitude"), 0.5, 1.0),
        (("signals", "pv", "final"), 50.0, 1.0),
        (("signals", "setpoint", "min"), 50.0, 1.0),
        (("signals", "output", "max"), 50.0, 2.0),
        (("modes", 1, "at"), 100.0, 5.0),
        (("modes", 1, "at"), 4.0, 1.0),
        (("alarms", "pv_high", "first"), 100.0, 5.0),
        (("alarms", "pv_high", "total"), 50.0, 2.5),
    ],
    ids=str,
)
def test_a_value_may_differ_by_its_tolerance_and_no_more(base, place, value, least):
    was = changed(base, place, value)
    for sign in (-1, 1):
        assert differences_by_loop(was, changed(base, place, value + sign * least * 0.99)) == {}
        told = differences_by_loop(was, changed(base, place, value + sign * least * 1.01))
        assert list(told) == ["TANK"]
        assert f" ± {least:.4g}" in told["TANK"][0]


def test_an_output_may_differ_by_a_share_of_its_own_range(base):
    was = changed(changed(base, ("output_range",), (10.0, 30.0)), ("signals", "output", "final"), 20.0)
    assert differences_by_loop(was, changed(was, ("signals", "output", "final"), 20.39)) == {}
    told = differences_by_loop(was, changed(was, ("signals", "output", "final"), 20.41))
    assert told == {"TANK": ["output at the end 20.41 % instead of 20 % ± 0.4 %"]}


@pytest.mark.parametrize(
    ("place", "value", "told"),
    [
        (("metrics", "settling_time"), None, "settling_time none instead of 100 s"),
        (("metrics", "final_error"), None, "final_error none instead of 100"),
        (
            ("modes", 1, "mode"),
            "cascade",
            "mode manual at 0 s, cascade at 100 s instead of manual at 0 s, auto at 100 s",
        ),
        (("modes",), [{"at": 0.0, "mode": "auto"}], "mode auto at 0 s instead of manual at 0 s, auto at 100 s"),
        (("alarms",), {}, "pv_high does not come, and came at 100 s"),
        (
            ("alarms", "pv_low"),
            {"first": 7.0, "total": 1.0},
            "pv_low comes at 7 s, and did not come",
        ),
        (("pv_range",), (0.0, 150.0), "its PV's range is 0 to 150 instead of 0 to 100"),
    ],
    ids=str,
)
def test_what_is_the_same_or_not_is_told(base, place, value, told):
    assert differences_by_loop(base, changed(base, place, value)) == {"TANK": [told]}


def test_what_is_measured_in_both_or_neither_is_no_difference(base):
    none = changed(base, ("metrics", "overshoot"), None)
    assert differences_by_loop(none, none) == {}
    assert differences_by_loop(base, changed(base, ("metrics", "oscillation_period"), None)) == {}
    still = changed(base, ("metrics", "oscillation_amplitude"), None)
    assert differences_by_loop(base, still) == {}
    swings = changed(base, ("metrics", "oscillation_amplitude"), 4.0)
    assert differences_by_loop(still, swings) == {"TANK": ["oscillation_amplitude 4 instead of 0 ± 1"]}


def test_a_signal_of_the_plant_may_differ_by_a_share_of_its_largest_value(base):
    largest = max(abs(base.signals["valve"].min), abs(base.signals["valve"].max))
    least, final = 0.02 * largest, base.signals["valve"].final
    assert differences_by_loop(base, changed(base, ("signals", "valve", "final"), final + 0.99 * least)) == {}
    (told,) = differences_by_loop(base, changed(base, ("signals", "valve", "final"), final + 1.01 * least))[""]
    assert told.startswith("valve at the end ")
    assert differences_by_loop(base, base.model_copy(update={"signals": {}})) == {"": ["there is no signal valve"]}


def test_what_is_taken_out_of_the_file_is_not_compared(base):
    loop = base.loops["TANK"]
    less = base.model_copy(update={"loops": {"TANK": loop.model_copy(update={"metrics": {}, "signals": {}})}})
    assert differences_by_loop(less, changed(base, ("metrics", "iae"), 1e6)) == {}


def test_the_most_telling_difference_comes_first_and_the_rest_is_counted(base):
    data = base.model_dump()
    loop = data["loops"]["TANK"]
    loop["metrics"] = {**dict.fromkeys(loop["metrics"], 115.0), "itae": 1e6, "oscillation_amplitude": 0.5}
    loop["alarms"] = {}
    (texts,) = differences_by_loop(base, AcceptedRun.model_validate(data)).values()
    assert [text.partition(" ")[0] for text in texts[:2]] == ["pv_high", "itae"]
    assert len(texts) > 6
    found = verdict(against(accepted(), config=[NO_LOOP]), KIND)
    assert found.text.count(" instead of ") == 6
    assert " more (good.json)" in found.text


# --- formats ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("named", [True, False], ids=["reference", "--against"])
def test_every_format_names_the_difference_at_the_line_that_names_the_file(named):
    scenario = SCENARIO.replace("duration", "reference: good.json\nduration") if named else SCENARIO
    files = {"tank.yaml": SIDES["dl06"].config.replace(*FASTER), GOOD: accepted()}
    how = {} if named else {"against": Path(GOOD)}
    result = simulate(scenario, name="tank.scenario.yaml", files=files, **how)
    message = f"{KIND}: TANK: {verdict(result, KIND).text}"
    file, line = ("tank.scenario.yaml", 4) if named else ("tank.yaml", 5)
    outcomes = [result.outcome]
    assert f"  FAILED  TANK {KIND}  " in render_runs("text", outcomes)
    assert render_runs("text", outcomes).rstrip().endswith("FAILED: 1 of 12 always checked")
    data = json.loads(render_runs("json", outcomes))
    assert [v["kind"] for v in data["standing"] if v["verdict"] == "failed"] == [KIND]
    assert data["passed"] is False
    junit = render_runs("junit", outcomes)
    assert f'name="TANK {KIND}"' in junit
    assert junit.count('type="failed"') == 1
    (sarif,) = json.loads(render_runs("sarif", outcomes))["runs"][0]["results"]
    place = sarif["locations"][0]["physicalLocation"]
    assert (place["artifactLocation"]["uri"], place["region"]["startLine"]) == (file, line)
    assert sarif["ruleId"] == "PID063"
    github = render_runs("github", outcomes)
    assert f"file={file},line={line}" in github
    assert message.replace("%", "%25") in github
    assert json.loads(render_runs("gitlab", outcomes))[0]["location"]["lines"]["begin"] == line


def test_another_failure_stands_at_the_loop_though_the_scenario_names_a_reference():
    scenario = SCENARIO.replace("duration", "reference: good.json\nduration")
    files = {"tank.yaml": SIDES["dl06"].config.replace(*SIDES["dl06"].gain), GOOD: accepted()}
    result = simulate(scenario, name="tank.scenario.yaml", files=files)
    assert failures(result) == {"oscillates", KIND}
    rows = json.loads(render_runs("gitlab", [result.outcome]))
    places = {row["description"].split(":")[0]: row["location"]["path"] for row in rows}
    assert places["oscillates"] == "tank.yaml"
    assert places[KIND] == "tank.scenario.yaml"


# --- the command -----------------------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path):
    """The heated tank as files."""
    (tmp_path / "tank.scenario.yaml").write_text(SCENARIO, "utf-8")
    (tmp_path / "tank.yaml").write_text(SIDES["dl06"].config, "utf-8")
    return tmp_path


def tank(folder, *args):
    """A run of the tank: exit code, standard output and standard error."""
    done = command("simulate", "tank.scenario.yaml", *args, cwd=folder)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def spoil(folder, name="tank.yaml", old=FASTER[0], new=FASTER[1]):
    """Replaces a text in a file."""
    path = folder / name
    assert old in path.read_text("utf-8")
    path.write_text(path.read_text("utf-8").replace(old, new), "utf-8")


def test_a_run_is_accepted_and_held_against(folder):
    code, out, err = tank(folder, "--accept", GOOD)
    assert (code, out.rstrip().splitlines()[-1]) == (0, "passed: 0 of 0 expectations, 12 of 12 always checked")
    assert "good.json: written; review it" in err
    text = (folder / GOOD).read_text("utf-8")
    assert text == accepted()
    assert tank(folder, "--against", GOOD)[0] == 0
    assert tank(folder, "--accept", GOOD)[0] == 0
    spoil(folder)
    assert tank(folder, "--against", GOOD)[0] == 1
    code, out, err = tank(folder, "--accept", GOOD)
    assert code == 2
    assert "good.json exists and differs: TANK: " in err
    assert "TANK: rise_time 12.5 s instead of 20.5 s ± 1.025 s; TANK: " in err
    assert "use --force to overwrite it" in err
    assert (folder / GOOD).read_text("utf-8") == text
    assert tank(folder, "--accept", GOOD, "--force")[0] == 0
    assert (folder / GOOD).read_text("utf-8") != text
    assert tank(folder, "--against", GOOD)[0] == 0


@pytest.mark.parametrize(
    ("there", "said"),
    [
        ("{}", "good.json exists and is no accepted run: pidcfg: field required; use --force"),
        ("no", "good.json exists and is no accepted run: invalid JSON"),
        (None, "good.json exists and differs, within the tolerances; use --force"),
        ("other", "good.json exists and differs: the scenario is 'A heated tank' instead of 'other'; use --force"),
    ],
)
def test_a_file_that_differs_is_never_written_over(folder, there, said):
    kept = json.loads(accepted())
    kept["loops"]["TANK"]["metrics"]["iae"] *= 1.01
    kept["accepted"] = "other" if there == "other" else kept["accepted"]
    text = json.dumps(kept) if there in {None, "other"} else there
    (folder / GOOD).write_text(text, "utf-8")
    code, _, err = tank(folder, "--accept", GOOD)
    assert code == 2
    assert said in err
    assert (folder / GOOD).read_text("utf-8") == text


def test_a_run_that_has_failed_is_not_written(folder):
    spoil(folder, "tank.yaml", *SIDES["dl06"].gain)
    code, out, err = tank(folder, "--accept", GOOD)
    assert code == 1
    assert "FAILED" in out
    assert "good.json is not written: the run has failed" in err
    assert not (folder / GOOD).exists()


def test_the_reference_of_a_scenario_is_relative_to_it_and_the_option_wins(folder):
    (folder / "kept").mkdir()
    assert tank(folder, "--accept", "kept/good.json")[0] == 0
    spoil(folder, "tank.scenario.yaml", "duration", "reference: kept/good.json\nduration")
    assert command("simulate", f"{folder.name}/tank.scenario.yaml", cwd=folder.parent).returncode == 0
    assert command("validate", "tank.scenario.yaml", cwd=folder).returncode == 0
    spoil(folder)
    assert tank(folder)[0] == 1
    assert tank(folder, "--accept", "new.json")[0] == 0
    assert tank(folder, "--against", "new.json")[0] == 0
    assert tank(folder, "--accept", "kept/good.json")[0] == 2
    assert tank(folder, "--accept", "kept/good.json", "--force")[0] == 0
    assert tank(folder)[0] == 0


def test_no_other_output_takes_the_place_of_the_reference(folder):
    assert tank(folder, "--accept", GOOD)[0] == 0
    spoil(folder, "tank.scenario.yaml", "duration", "reference: good.json\nduration")
    code, _, err = tank(folder, "--trend", GOOD, "--force")
    assert (code, "good.json is a file that is read" in err) == (2, True)
    code, _, err = tank(folder, "--accept", "tank.yaml", "--force")
    assert (code, "tank.yaml is a file that is read" in err) == (2, True)


OTHER = ('"accepted": "A heated tank"', '"accepted": "A cold tank"')


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (*OTHER, "is of another scenario: 'A cold tank', not 'A heated tank'"),
        ('"duration": 200.0', '"duration": 300.0', "is of another duration: 300 s, not 200 s"),
        ('"TANK": {', '"OVEN": {', "is of other loops: it has no TANK and it has OVEN"),
        ('"pidcfg": 1', '"pidcfg": 2', "is no accepted run: pidcfg: "),
        ('"final_error"', '"final_eror"', "is no accepted run: loops.TANK.metrics."),
        ('"modes": [', '"modes": [1,', "is no accepted run: loops.TANK.modes.0: "),
        ('"duration": 200.0', '"duration": "200"', "is no accepted run: duration: "),
        ('"duration": 200.0', '"duration": NaN', "is no accepted run: duration: "),
        ("{", "", "is no accepted run: invalid JSON"),
    ],
    ids=["title", "duration", "loops", "version", "metric", "list", "text", "nan", "no JSON"],
)
def test_a_file_that_cannot_be_used_is_one_error_and_nothing_runs(folder, old, new, said):
    text = accepted()
    assert old in text
    (folder / GOOD).write_text(text.replace(old, new, 1), "utf-8")
    code, out, _ = tank(folder, "--against", GOOD)
    assert code == 2
    assert out.count("error PID068") == 1
    assert f"good.json {said}" in out
    spoil(folder, "tank.scenario.yaml", "duration", "reference: good.json\nduration")
    assert f"tank.scenario.yaml:4:12: error PID068: good.json {said}" in tank(folder)[1]
    assert tank(folder)[0] == 2


def test_a_file_that_is_missing_is_one_error(folder):
    code, out, err = tank(folder, "--against", GOOD)
    assert (code, err) == (2, "Error: cannot read good.json: No such file or directory\n")
    assert out == ""
    spoil(folder, "tank.scenario.yaml", "duration", "reference: good.json\nduration")
    code, out, _ = tank(folder)
    assert (code, "tank.scenario.yaml:4:12: error PID068: cannot read good.json" in out) == (2, True)
    assert [d.code for d in check(folder / "tank.scenario.yaml").findings] == ["PID068"]


def test_what_stands_in_a_file_outside_of_the_folder_is_not_told(folder, tmp_path_factory):
    secret = tmp_path_factory.mktemp("home") / "secret.json"
    secret.write_text('{"token": 1}', "utf-8")
    spoil(folder, "tank.scenario.yaml", "duration", f"reference: {secret}\nduration")
    code, out, _ = tank(folder)
    assert code == 2
    assert "secret.json is no accepted run\n" in out
    assert "token" not in out


def test_one_file_is_of_one_scenario(folder):
    shutil.copy(folder / "tank.scenario.yaml", folder / "second.scenario.yaml")
    for option in ("--against", "--accept"):
        done = command("simulate", ".", option, GOOD, cwd=folder)
        assert done.returncode == 2
        assert f"{option} takes one scenario, not 2" in done.stderr.decode()
    code, _, err = tank(folder, "--against", GOOD, "--accept", GOOD)
    assert (code, "--against and --accept exclude each other" in err) == (2, True)
    code, _, err = tank(folder, "--accept", GOOD, "--watch")
    assert (code, "--watch and --accept exclude each other" in err) == (2, True)


def test_several_scenarios_have_references_of_their_own(folder):
    assert tank(folder, "--accept", GOOD)[0] == 0
    spoil(folder, "tank.scenario.yaml", "duration", "reference: good.json\nduration")
    shutil.copy(folder / "tank.scenario.yaml", folder / "second.scenario.yaml")
    assert command("simulate", ".", "--jobs", "2", cwd=folder).returncode == 0
    spoil(folder, "second.scenario.yaml", "config: tank.yaml", "config: other.yaml")
    (folder / "other.yaml").write_text(SIDES["dl06"].config.replace(*FASTER), "utf-8")
    done = command("simulate", ".", "--jobs", "2", "--format", "json", cwd=folder)
    assert done.returncode == 1
    assert [one["passed"] for one in json.loads(done.stdout)["runs"]] == [False, True]


def test_a_configuration_without_a_scenario_is_accepted_too(folder):
    assert command("simulate", "tank.yaml", "--accept", GOOD, cwd=folder).returncode == 0
    assert command("simulate", "tank.yaml", "--against", GOOD, cwd=folder).returncode == 0
    spoil(folder)
    done = command("simulate", "tank.yaml", "--against", GOOD, cwd=folder)
    assert (done.returncode, KIND in done.stdout.decode()) == (1, True)


# --- the calls -------------------------------------------------------------------------------------------------------


def test_the_call_takes_texts_files_and_names():
    text = accepted()
    assert against(text).passed
    assert outcome("dl06", against=text.encode()).passed
    found = verdict(outcome("dl06", SHORT, against=accepted(SHORT)), "not-settled")
    assert found.text.startswith("as accepted in <text>: ")
    assert outcome("dl06").accepted is None
    with pytest.raises(ArgumentError, match="exclude each other"):
        outcome("dl06", against=text, accept=GOOD)
    with pytest.raises(ArgumentError, match="`against_name` is for `against`"):
        outcome("dl06", against_name=GOOD)


def test_certify_looks_at_no_reference():
    vary = "reference: none.json\nvary: {plants: {TANK: {gain: ±1 %}}}\n"
    result = certify(SCENARIO + vary, name="s.yaml", files={"tank.yaml": SIDES["dl06"].config}, samples=2)
    assert result.certification.all_passed == 2


def test_the_file_of_an_example_is_what_its_run_gives():
    path = EXAMPLES / "nextopid" / "heatexchanger.scenario.yaml"
    kept = path.with_name("heatexchanger.accepted.json")
    assert simulate(path, accept=kept.name).accepted == kept.read_text("utf-8")
    assert simulate(path).passed
