"""``pidcfg simulate`` as a user meets it: reports, exit codes, files, wrong set-ups, hostile input."""

from __future__ import annotations

import json
import random
import re
from pathlib import Path

import pytest

from command import run
from pidcfg.sim.engine.run import Settings
from pidcfg.study.outcome import simulate_document
from pidcfg.text.reader import shorten_path
from pidcfg.text.source import read_document

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples" / "dl06"


@pytest.fixture
def folder(tmp_path):
    """A copy of the reactor and its scenario, shortened to two minutes after the step."""
    for name in ("reactor.yaml", "reactor.scenario.yaml"):
        (tmp_path / name).write_bytes((EXAMPLES / name).read_bytes())
    return tmp_path


def change(folder, name, old, new):
    """Replaces one text in a file; it must be there."""
    path = folder / name
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), "utf-8")


def report(folder, *args):
    """The JSON report of the reactor and the exit code."""
    result = run("simulate", "reactor.scenario.yaml", "--format", "json", *args, cwd=folder)
    assert result.returncode in {0, 1, 2}, result.stderr.decode()
    return json.loads(result.stdout), result.returncode


@pytest.mark.parametrize(
    ("path", "short"),
    [
        ("scenarios/../loops/oven.yaml", "loops/oven.yaml"),
        ("a/scenarios/../../loops/oven.yaml", "loops/oven.yaml"),
        ("../loops/oven.yaml", "../loops/oven.yaml"),
        ("scenarios/../../oven.yaml", "../oven.yaml"),
        ("link/../oven.yaml", "link/../oven.yaml"),
        ("nowhere/../oven.yaml", "nowhere/../oven.yaml"),
        ("/../oven.yaml", "/../oven.yaml"),
    ],
)
def test_paths_are_shortened_where_that_changes_nothing(tmp_path, monkeypatch, path, short):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a/scenarios").mkdir(parents=True)
    (tmp_path / "scenarios").mkdir()
    try:
        (tmp_path / "link").symlink_to("a/scenarios")
    except OSError:
        (tmp_path / "link").unlink(missing_ok=True)  # Windows without the right to make links
    assert shorten_path(Path(path)).as_posix() == short


def test_reports_name_the_configuration_without_a_way_back(folder):
    (folder / "scenarios").mkdir()
    (folder / "reactor.scenario.yaml").rename(folder / "scenarios/reactor.yaml")
    change(folder, "scenarios/reactor.yaml", "config: reactor.yaml", "config: ../reactor.yaml")
    result = run("simulate", "scenarios/reactor.yaml", cwd=folder)
    assert b"  scenarios/reactor.yaml runs reactor.yaml\n" in result.stdout.replace(b"\r", b"")
    assert result.returncode == 0


def simulate_here(folder):
    """The outcome of the reactor's scenario in this process."""
    path = folder / "reactor.scenario.yaml"
    return simulate_document(read_document(path.read_bytes(), path.as_posix()), Settings())


def test_the_reactor_meets_its_expectations(folder):
    result = run("simulate", "reactor.scenario.yaml", cwd=folder)
    text = result.stdout.decode()
    assert result.returncode == 0, text
    assert text.splitlines()[0] == "A step of the temperature set point, a disturbance of the level"
    assert "reactor.scenario.yaml runs reactor.yaml" in text
    assert "  TIC-101  proven  overshoot 4.39 %; settles in 190 s; ends 0.1465 degC from its set point" in text
    assert text.rstrip().endswith("passed: 4 of 4 expectations, 31 of 31 always checked")
    assert "\x1b" not in text
    full = run("simulate", "reactor.scenario.yaml", "-v", cwd=folder).stdout.decode()
    assert "V7642 = 0x0000" in full
    assert "120 s  TIC-101  event: set setpoint to 95" in full
    head = "  1800 s in steps of 0.2 s, after 960 s to the steady state"
    assert full.replace("; engine: python\n  V7642 = 0x0000", "").startswith(text), "the same, and tables behind it"
    assert (head in text, len(text.splitlines())) == (True, 8)


def test_tables_show_an_output_without_a_range_in_per_cent_and_data_in_counts(folder):
    path = folder / "reactor.yaml"
    text = path.read_text("utf-8")
    assert text.count('output: {range: [0, 100], unit: "%"}') == 1
    path.write_text(text.replace('output: {range: [0, 100], unit: "%"}', "output: {}"), "utf-8")
    scenario = folder / "reactor.scenario.yaml"
    scenario.write_text(scenario.read_text("utf-8").replace("gain: -0.02, load: 1.0", "gain: -0.000488, load: 1.0"))
    full = run("simulate", "reactor.scenario.yaml", "-v", cwd=folder).stdout.decode()
    final = report(folder)[0]["signals"]["LIC-103.OUT"]["final"]
    (shown,) = re.findall(r"LIC-103\.OUT .* ([0-9.]+) %\n", full)
    assert final > 100
    assert float(shown) == pytest.approx(final / 40.95, abs=0.01)
    assert re.search(r"LIC-103\.BIAS .* [0-9.]+ %\n", full)
    assert not re.search(r"TIC-101\.OUT .*%\n", full)


def test_the_json_report_has_the_published_layout(folder):
    data, code = report(folder)
    assert code == 0
    assert set(data) == {
        "version",
        "scenario",
        "file",
        "engine",
        "plc_flags",
        "loops",
        "signals",
        "expectations",
        "standing",
        "notes",
        "findings",
        "passed",
    }
    assert (data["version"], data["passed"], data["plc_flags"]) == (1, True, {"V7642": "0x0000"})
    loop = data["loops"]["TIC-101"]
    assert list(loop["metrics"]) == [
        "overshoot",
        "settling_time",
        "rise_time",
        "iae",
        "ise",
        "itae",
        "total_variation",
        "final_error",
        "oscillation_period",
        "oscillation_amplitude",
    ]
    assert loop["time_in_control"] == 1800.0
    assert {tuple(v) for v in data["standing"]} == {
        ("kind", "loop", "passed", "judged", "verdict", "at", "text", "allowed")
    }
    assert loop["alarms"][0].keys() == {"alarm", "at", "cleared"}
    assert loop["modes"] == [{"at": 0.0, "requested": "auto", "mode": "auto", "reason": None}]
    assert loop["flags"]["alarm_programming_error"] is False
    assert data["signals"]["TIC-101.PV"].keys() == {"min", "max", "final"}
    assert [e.keys() for e in data["expectations"]] == [{"text", "passed", "value"}] * 4


def test_the_report_agrees_with_the_trend(folder):
    data, _ = report(folder, "--csv", "trend.csv")
    head, *lines = [line.split(",") for line in (folder / "trend.csv").read_text("utf-8").splitlines()]
    columns = {name: [float(line[i]) for line in lines] for i, name in enumerate(head)}
    assert (columns["time"][0], columns["time"][1], columns["time"][-1]) == (0, 0.2, 1800)
    for name, seen in data["signals"].items():
        assert (min(columns[name]), max(columns[name]), columns[name][-1]) == (seen["min"], seen["max"], seen["final"])
    error = [sp - pv for sp, pv in zip(columns["LIC-103.SP"], columns["LIC-103.PV"], strict=True)]
    assert data["loops"]["LIC-103"]["metrics"]["iae"] == pytest.approx(sum(abs(e) for e in error[:-1]) * 0.2, rel=1e-6)
    high = 120 / 0.2
    pv, step = columns["TIC-101.PV"], columns["TIC-101.SP"][-1] - columns["TIC-101.SP"][0]
    overshoot = (max(pv[int(high) :]) - columns["TIC-101.SP"][-1]) / step * 100
    assert data["loops"]["TIC-101"]["metrics"]["overshoot"] == pytest.approx(overshoot, rel=1e-6)


def test_the_same_files_give_the_same_bytes(folder):
    first = run("simulate", "reactor.scenario.yaml", "--csv", "a.csv", "--format", "json", cwd=folder)
    second = run("simulate", "reactor.scenario.yaml", "--csv", "b.csv", "--format", "json", cwd=folder)
    assert first.stdout == second.stdout
    assert (folder / "a.csv").read_bytes() == (folder / "b.csv").read_bytes()


def test_compiled_and_plain_runs_give_the_same_bytes(folder):
    change(folder, "reactor.scenario.yaml", "duration: 30 min", "duration: 5 min")
    change(folder, "reactor.scenario.yaml", "at: 900", "at: 200")
    change(
        folder,
        "reactor.scenario.yaml",
        "events:",
        "events:\n  - {at: 30, loop: FIC-102, mode: auto}\n"
        "  - {at: 40, loop: FIC-102, mode: cascade}\n  - {at: 150, loop: LIC-103, pv: 0, for: 10}",
    )
    plain, _ = report(folder, "--csv", "a.csv", "--engine", "python")
    compiled, _ = report(folder, "--csv", "b.csv", "--engine", "numba")
    assert (plain.pop("engine"), compiled.pop("engine")) == ("python", "numba")
    assert plain == compiled
    assert (folder / "a.csv").read_bytes() == (folder / "b.csv").read_bytes()


def test_a_failed_expectation_is_exit_1_and_says_what_was_measured(folder):
    change(folder, "reactor.scenario.yaml", "max: 10 %", "max: 1 %")
    result = run("simulate", "reactor.scenario.yaml", cwd=folder)
    assert result.returncode == 1
    lines = result.stdout.decode().splitlines()
    assert any(line.startswith("  FAILED  TIC-101 overshoot at most 1 %: 4.") for line in lines)
    assert lines[-1] == "FAILED: 1 of 4 expectations"


@pytest.mark.parametrize(
    ("old", "new", "flag", "line_says"),
    [
        ("loop_table: V2000 ", "loop_table: V700", "0x0001", "loop_table"),
        ("loop_table: V2000 ", "loop_table: V17750", "0x0002", "loop_table"),
    ],
)
def test_a_wrong_table_start_stops_the_loop_task_and_the_report_names_the_line(folder, old, new, flag, line_says):
    change(folder, "reactor.yaml", old, new)
    change(folder, "reactor.scenario.yaml", "expect:", f"expect:\n  - {{flag: V7642, is: {flag}}}")
    data, code = report(folder)
    assert code == 1, "the reactor's own expectations cannot hold"
    assert data["plc_flags"] == {"V7642": flag}
    assert data["expectations"][0]["passed"]
    assert all(loop["modes"] == [] for loop in data["loops"].values())
    assert data["signals"]["TIC-101.OUT"] == {"min": 0.0, "max": 0.0, "final": 0.0}
    causes = [f for f in data["findings"] if (f["plc_effect"] or "").startswith("V7642")]
    assert causes, data["findings"]
    lines = (folder / "reactor.yaml").read_text("utf-8").splitlines()
    assert all(f["file"] == "reactor.yaml" and line_says in lines[f["line"] - 1] for f in causes)


@pytest.mark.parametrize(
    ("start", "loops", "flag"),
    [
        ("V2000", 9, "0x0004"),
        ("V7340", 8, "0x0008"),
        ("V7340", 6, "0x0008"),
        ("V7340", 5, "0x0000"),
        ("V2000", 8, "0x0000"),
        ("V7340", 9, "0x000C"),
    ],
)
def test_a_wrong_number_of_loops_can_be_written_down_and_seen_to_fail(folder, start, loops, flag):
    change(folder, "reactor.yaml", "loop_table: V2000", f"loop_table: {start}")
    line = f"plc: {{number_of_loops: {loops}}}"
    change(folder, "reactor.scenario.yaml", "seed: 7\n", f"seed: 7\n{line}\n")
    data, code = report(folder)
    assert data["plc_flags"] == {"V7642": flag}
    assert code == (0 if flag == "0x0000" else 1)
    found = [f["line"] for f in data["findings"] if f["path"] == "plc.number_of_loops"]
    text = (folder / "reactor.scenario.yaml").read_text("utf-8").splitlines()
    assert [text[at - 1] for at in found] == ([] if flag == "0x0000" else [line])


def test_alarms_in_the_wrong_order_keep_the_loop_in_manual_and_name_the_line(folder):
    change(folder, "reactor.yaml", "high: 130, high_high: 140", "high: 145, high_high: 140")
    data, code = report(folder)
    loop = data["loops"]["TIC-101"]
    assert code == 1
    assert loop["flags"]["alarm_programming_error"] is True
    assert [(m["mode"], m["requested"]) for m in loop["modes"]] == [("manual", "auto")]
    assert "bit 10" in loop["modes"][0]["reason"]
    lines = (folder / "reactor.yaml").read_text("utf-8").splitlines()
    causes = [f for f in data["findings"] if f["file"] == "reactor.yaml" and f["severity"] == "error"]
    assert any("high: 145" in lines[f["line"] - 1] and "bit 10" in f["plc_effect"] for f in causes), data["findings"]


def test_a_memory_listing_runs_like_the_configuration_it_was_made_of(folder):
    whole, _ = report(folder)
    for kind, name in (("json", "reactor.json"), ("text", "reactor.txt"), ("csv", "reactor.csv")):
        assert run("encode", "reactor.yaml", "--format", kind, "-o", name, cwd=folder).returncode == 0
        change(folder, "reactor.scenario.yaml", "config: ", f"config: {name} # ")
        assert report(folder) == (whole, 0)
        change(folder, "reactor.scenario.yaml", f"config: {name} # ", "config: ")


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("config: reactor.yaml", "config: nowhere.yaml", 3, "cannot read nowhere.yaml"),
        ("config: reactor.yaml", "config: reactor.scenario.yaml", 3, "is a scenario"),
        ("config: reactor.yaml", "config: .", 3, "cannot read ."),
        ("config: reactor.yaml", f"config: {'x' * 300}", 3, "cannot read"),
        ("loop: TIC-101, set: {setpoint: 95}", "loop: TIC-110, set: {setpoint: 95}", 12, "'TIC-110' is no loop"),
        ("loop: TIC-101, set: {setpoint: 95}", "loop: TIC-101, set: {sepoint: 95}", 12, "sepoint"),
        ("metric: iae", "metric: iea", 18, "iea"),
        ("input: FIC-102.PV", "input: FIC-102.PW", 8, "'FIC-102.PW' is no declared name"),
        ("alarm: pv_high_high", "alarm: pv_hihg", 17, "'pv_hihg' is no alarm"),
        ("plants:", "plans:", 6, "plans"),
        ("initial: steady", "initial: {FIC-102: 101}", 5, "does not fit"),
        ("duration: 30 min", "duration: 3e9 h", 4, "beyond"),
        ("duration: 30 min", "duration: 1e7 h", 4, "the limit is 100000000"),
    ],
)
def test_what_cannot_run_is_exit_2_with_the_line_in_every_format(folder, old, new, line, message):
    change(folder, "reactor.scenario.yaml", old, new)
    data, code = report(folder)
    assert code == 2
    assert (data["passed"], data["loops"]) == (False, {})
    assert any(f["line"] == line and message in f["message"] for f in data["findings"]), data["findings"]
    text = run("simulate", "reactor.scenario.yaml", cwd=folder)
    assert text.returncode == 2
    assert f"reactor.scenario.yaml:{line}:" in text.stdout.decode()


def test_an_expression_is_faulted_at_its_character(folder):
    change(folder, "reactor.scenario.yaml", "input: FIC-102.PV", "input: 2 * FIC-102.PW")
    data, _ = report(folder)
    (finding,) = data["findings"]
    line = (folder / "reactor.scenario.yaml").read_text("utf-8").splitlines()[finding["line"] - 1]
    assert line[finding["column"] - 1 :].startswith("FIC-102.PW")
    assert finding["help"] == "did you mean 'FIC-102.PV'?"


def test_validate_reports_the_same_about_a_scenario(folder):
    change(folder, "reactor.scenario.yaml", "alarm: pv_high_high", "alarm: pv_hihg")
    result = run("validate", "reactor.scenario.yaml", cwd=folder)
    assert result.returncode == 1
    assert "reactor.scenario.yaml:17:28: error PID050: 'pv_hihg' is no alarm" in result.stdout.decode()


def test_warnings_pass_unless_strict(folder):
    change(folder, "reactor.scenario.yaml", "at: 900", "at: 9000")
    data, code = report(folder)
    assert code == 0
    assert [(f["severity"], f["code"]) for f in data["findings"]] == [("warning", "PID054")]
    assert report(folder, "--strict")[1] == 1


def test_several_scenarios_and_folders_run_one_after_the_other(folder):
    (folder / "second.yaml").write_bytes((folder / "reactor.scenario.yaml").read_bytes())
    change(folder, "second.yaml", "max: 10 %", "max: 1 %")
    result = run("simulate", ".", "--format", "json", cwd=folder)
    data = json.loads(result.stdout)
    assert result.returncode == 1
    assert [(run["file"], run["passed"]) for run in data["runs"]] == [
        ("reactor.scenario.yaml", True),
        ("second.yaml", False),
    ]
    assert (data["version"], data["passed"]) == (1, False)


def test_a_configuration_runs_with_a_drafted_scenario(folder):
    result = run("simulate", "reactor.yaml", "--format", "json", cwd=folder)
    data = json.loads(result.stdout)
    assert (result.returncode, data["file"], data["passed"]) == (0, "reactor.yaml", True)
    assert result.stderr.decode() == (
        "reactor.yaml is a configuration: it runs with a drafted scenario, which "
        "'pidcfg init --scenario reactor.yaml -o reactor.scenario.yaml' writes\n"
    )


def test_a_scenario_may_come_from_standard_input(folder):
    result = run("simulate", "-", cwd=folder, stdin=(folder / "reactor.scenario.yaml").read_bytes())
    assert result.returncode == 0, result.stdout.decode()


def test_a_trend_never_replaces_a_different_file_without_force(folder):
    (folder / "trend.csv").write_text("mine\n", "utf-8")
    refused = run("simulate", "reactor.scenario.yaml", "--csv", "trend.csv", cwd=folder)
    assert refused.returncode == 2
    assert "trend.csv exists and differs" in refused.stderr.decode()
    assert (folder / "trend.csv").read_text("utf-8") == "mine\n"
    assert run("simulate", "reactor.scenario.yaml", "--csv", "trend.csv", "--force", cwd=folder).returncode == 0
    assert (folder / "trend.csv").read_text("utf-8").startswith("time,FIC-102.PV,")
    assert sorted(p.name for p in folder.iterdir()) == ["reactor.scenario.yaml", "reactor.yaml", "trend.csv"]


def test_a_trend_takes_one_scenario(folder):
    (folder / "second.scenario.yaml").write_bytes((folder / "reactor.scenario.yaml").read_bytes())
    result = run("simulate", ".", "--csv", "trend.csv", cwd=folder)
    assert result.returncode == 2
    assert "--trend takes one scenario, not 2" in result.stderr.decode()


def test_nothing_is_left_when_a_trend_cannot_be_finished(folder):
    change(folder, "reactor.scenario.yaml", "plants:", "plans:")
    assert run("simulate", "reactor.scenario.yaml", "--csv", "trend.csv", cwd=folder).returncode == 2
    assert sorted(p.name for p in folder.iterdir()) == ["reactor.scenario.yaml", "reactor.yaml"]


def test_every_thins_the_trend(folder):
    report(folder, "--csv", "trend.csv", "--every", "500")
    times = [line.split(",")[0] for line in (folder / "trend.csv").read_text("utf-8").splitlines()]
    assert times == ["time", *(str(100 * i) for i in range(19))]


def test_the_limit_on_loop_steps_can_be_raised_and_lifted(folder):
    assert report(folder, "--limit", "loop_steps=27002")[1] == 2
    assert report(folder, "--limit", "loop_steps=27003", "--no-limit")[1] == 0
    assert report(folder, "--limit", "loop_steps=5000", "--no-limit")[1] == 0


WORDS = [
    "",
    "-1",
    "0",
    "1e300",
    "1e-300",
    "nan",
    ".inf",
    "[]",
    "{}",
    "true",
    "null",
    "x" * 300,
    "1 h",
    "5 %",
    "TIC-101",
    "1/0",
    "sqrt(-1)",
    "((((",
    "*a",
    "&a",
    "!!x",
    '"',
    "'",
    "- -",
    "0x10",
    "010",
]


def mutated(text, rng):
    """The text with one to four small accidents."""
    for _ in range(rng.randint(1, 4)):
        kind, at = rng.randrange(6), rng.randrange(len(text))
        lines = text.splitlines(keepends=True)
        if kind == 0:
            text = text[:at] + text[at + rng.randint(1, 12) :]
        elif kind == 1:
            text = text[:at] + rng.choice(",:{}[]\n#&*!|>'\"%@` \t-") + text[at:]
        elif kind == 2:
            lines.insert(rng.randrange(len(lines)), rng.choice(lines))
            text = "".join(lines)
        elif kind == 3:
            del lines[rng.randrange(len(lines))]
            text = "".join(lines)
        else:
            places = [i for i, c in enumerate(text) if c == ":"]
            begin = rng.choice(places) + 1
            ends = [i for i in (text.find(c, begin) for c in ",}\n") if i >= 0]
            text = f"{text[:begin]} {rng.choice(WORDS)}{text[min(ends) if ends else begin :]}"
        text = text or "x: y"
    return text


def test_mutated_scenarios_never_give_a_traceback_and_never_a_number_that_is_none(folder):
    whole = (
        (folder / "reactor.scenario.yaml").read_text("utf-8").replace("30 min", "20").replace("initial: steady\n", "\n")
    )
    rng = random.Random(20)
    ran = 0
    for _ in range(400):
        (folder / "reactor.scenario.yaml").write_text(mutated(whole, rng), "utf-8", newline="")
        settings = Settings(max_loop_steps=20_000)
        path = folder / "reactor.scenario.yaml"
        outcome = simulate_document(read_document(path.read_bytes(), path.as_posix()), settings)
        if outcome.report is None:
            assert outcome.findings
            continue
        ran += 1
        for seen in outcome.report.signals.values():
            assert seen.low <= seen.final <= seen.high
    assert 20 < ran < 390, "some run, some are refused"


def test_mutated_configurations_run_or_are_refused(folder):
    change(folder, "reactor.scenario.yaml", "duration: 30 min", "duration: 20")
    change(folder, "reactor.scenario.yaml", "initial: steady", "")
    whole = (folder / "reactor.yaml").read_text("utf-8")
    rng = random.Random(21)
    ran = 0
    for _ in range(200):
        (folder / "reactor.yaml").write_text(mutated(whole, rng), "utf-8", newline="")
        outcome = simulate_here(folder)
        ran += outcome.report is not None
        assert outcome.report is not None or outcome.findings
    assert ran > 10


@pytest.mark.parametrize(
    ("old", "new", "cure"),
    [
        ("noise: 0.05", "nosie: 0.05", "did you mean noise?"),
        ("at: 120", "att: 120", "did you mean at?"),
        ("band: 5 %", "frm: 5", "did you mean from?"),
        ("duration:", "duratoin:", "did you mean duration?"),
    ],
)
def test_a_misspelt_key_is_met_with_the_one_that_was_meant(folder, old, new, cure):
    change(folder, "reactor.scenario.yaml", old, new)
    assert cure in [f["help"] for f in report(folder)[0]["findings"]]


def test_with_a_scan_time_the_report_estimates_the_scan_with_loops(folder):
    """The manual's formula: 50 ms with loops every 0.2, 2 and 1 s adds 0.05 (1/0.2 + 1/2 + 1/1) 250 us."""
    change(folder, "reactor.scenario.yaml", "seed: 7\n", "seed: 7\nplc: {scan_time: 50 ms}\n")
    data, _ = report(folder)
    assert data["scan_time"] == {"minimum": 0.05004875, "typical": 0.05008125, "maximum": 0.05011375}
    text = run("simulate", "reactor.scenario.yaml", "-v", cwd=folder).stdout.decode()
    assert "scan time with these loops: 50.081 ms (50.049 to 50.114 ms)" in text
    assert "1800 s in steps of 0.05 s" in text


def test_a_listing_without_settings_runs_in_counts_under_numbered_names(folder):
    run("encode", "reactor.yaml", "-o", "reactor.txt", cwd=folder)
    words = [line for line in (folder / "reactor.txt").read_text("utf-8").splitlines() if not line.startswith("#")]
    (folder / "words.txt").write_text("\n".join(words) + "\n", "utf-8")
    text = "pidcfg: 1\nscenario: bare words\nconfig: words.txt\nduration: 10\nconnect: {LOOP-1.PV: 100}\n"
    (folder / "reactor.scenario.yaml").write_text(text, "utf-8")
    data, code = report(folder)
    assert code == 0, data
    assert list(data["loops"]) == ["LOOP-1", "LOOP-2", "LOOP-3"]
    assert data["signals"]["LOOP-1.PV"]["final"] == 100


@pytest.mark.parametrize("mode", ["[]", "1e300", "true", '"sideways"'])
def test_a_listing_with_unsound_settings_is_refused(folder, mode):
    run("encode", "reactor.yaml", "--format", "json", "-o", "reactor.json", cwd=folder)
    change(folder, "reactor.json", '"cascade"', mode)
    change(folder, "reactor.scenario.yaml", "config: reactor.yaml", "config: reactor.json")
    outcome = simulate_here(folder)
    assert outcome.report is None
    assert "settings[0]" in outcome.findings[0].message


VELOCITY = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000}
loops:
  - {name: A, sample_rate: 1, action: reverse, algorithm: velocity, bumpless: II, tuning: {gain: 1, reset: 10}}
"""
"""The velocity form needs Bumpless I: an error that leaves no flag in the PLC."""
BARE = "pidcfg: 1\nscenario: bare\nconfig: reactor.yaml\nduration: 10\nconnect: {A.PV: 100}\n"


@pytest.mark.parametrize(
    ("expect", "code"),
    [("", 1), ("expect: [{loop: A, mode: manual}]\n", 0), ("expect: [{loop: A, mode: auto}]\n", 1)],
)
def test_errors_of_the_configuration_are_shown_and_pass_only_when_expectations_hold(folder, expect, code):
    (folder / "reactor.yaml").write_text(VELOCITY, "utf-8")
    (folder / "reactor.scenario.yaml").write_text(BARE + expect, "utf-8")
    data, found = report(folder)
    assert found == code
    assert data["passed"] is (code == 0)
    errors = [f for f in data["findings"] if f["severity"] == "error"]
    assert [(f["file"], f["line"], f["plc_effect"]) for f in errors] == [("reactor.yaml", 5, None)]
    text = run("simulate", "reactor.scenario.yaml", cwd=folder).stdout.decode()
    assert errors[0]["code"] in text
    assert ("nothing is expected of the run" in text) is (not expect)


@pytest.mark.parametrize("engine", ["python", "numba"])
def test_a_configuration_without_loops_runs(folder, engine):
    if engine == "numba":
        pytest.importorskip("numba")
    (folder / "reactor.yaml").write_text("pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2000}\nloops: []\n", "utf-8")
    (folder / "reactor.scenario.yaml").write_text(BARE.replace("connect", "# connect"), "utf-8")
    data, _ = report(folder, "--engine", engine)
    assert (data["engine"], data["loops"]) == (engine, {})


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("plc: {number_of_loops: 10000}", "number_of_loops: 10000 does not fit the word"),
        ("plc: {number_of_loops: -1}", "number_of_loops: -1 does not fit the word"),
        ("plc: {cpu: 5}", "unknown key 'cpu'"),
    ],
)
def test_an_option_of_the_plc_that_makes_no_sense_is_refused_at_its_line(folder, line, message):
    change(folder, "reactor.scenario.yaml", "seed: 7\n", f"seed: 7\n{line}\n")
    data, code = report(folder)
    assert code == 2
    text = (folder / "reactor.scenario.yaml").read_text("utf-8").splitlines()
    assert [(text[f["line"] - 1], f["message"]) for f in data["findings"]] == [(line, message)]


def test_ramp_soak_and_auto_tune_speak_in_notes_not_in_modes(folder):
    change(folder, "reactor.scenario.yaml", "events:\n", "events:\n  - {at: 1, loop: TIC-101, ramp_soak: jog}\n")
    data, _ = report(folder)
    notes = [(n["at"], n["loop"]) for n in data["notes"] if n["text"].startswith("ramp/soak refused: ")]
    assert notes == [(2.0, "TIC-101")], "with the next sample"
    assert not any("ramp/soak" in (m["reason"] or "") for loop in data["loops"].values() for m in loop["modes"])
    text = run("simulate", "reactor.scenario.yaml", cwd=folder).stdout.decode()
    assert "  note  TIC-101 at 2 s  ramp/soak refused" in text
