"""--statistics, --verbose, --stdin-filename, and findings as Markdown."""

from __future__ import annotations

import json
import re
import shutil
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from pidcfg.cli import console as module
from pidcfg.cli.console import suggest_next_step
from pidcfg.cli.formats import reports as markdown
from pidcfg.cli.main import cli

# --- --statistics, --verbose, --stdin-filename, and findings as Markdown ----------------------------------------------

ROOT = Path(__file__).parents[1]
MISTAKES = (ROOT / "examples/mistakes/oven.yaml").read_text("utf-8")
REACTOR = (ROOT / "examples/dl06/reactor.yaml").read_text("utf-8")


@pytest.fixture
def project(tmp_path, monkeypatch):
    """Two files in a folder, of a repository of their own."""
    (tmp_path / ".git").mkdir()
    (tmp_path / "loops").mkdir()
    (tmp_path / "loops/oven.yaml").write_text(MISTAKES, "utf-8")
    (tmp_path / "loops/reactor.yaml").write_text(REACTOR, "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*words: str, stdin: str | bytes | None = None, **variables: str):
    return CliRunner().invoke(cli, words, input=stdin, env=variables)


# --- --statistics ----------------------------------------------------------------------------------------------------


def test_statistics_count_by_rule_the_most_frequent_first(project):
    result = run("validate", "loops", "--statistics")
    rows = [line.split(maxsplit=3) for line in result.stdout.splitlines()]
    assert [row[:3] for row in rows] == [
        ["3", "DL211", "warning"],
        ["2", "DL231", "info"],
        ["1", "DL201", "error"],
        ["1", "DL242", "error"],
        ["1", "DL222", "warning"],
    ]
    assert rows[1][3] == "The set point of the file does not survive the change to Auto."
    assert result.exit_code == 1
    assert result.stderr == "2 files checked: 2 errors, 4 warnings, 2 infos\n"


def test_statistics_as_json_have_the_same_numbers_and_the_summary_of_the_findings(project):
    counted = json.loads(run("validate", "loops", "--statistics", "--format", "json").stdout)
    found = json.loads(run("validate", "loops", "--format", "json").stdout)
    assert list(counted) == ["version", "statistics", "summary"]
    assert counted["summary"] == found["summary"]
    codes = [entry["code"] for entry in found["findings"]]
    assert {row["code"]: row["count"] for row in counted["statistics"]} == {code: codes.count(code) for code in codes}
    assert {tuple(row) for row in counted["statistics"]} == {("code", "severity", "title", "count", "fixable")}


def test_statistics_count_what_the_options_leave(project):
    result = run("validate", "loops", "--statistics", "--severity", "error", "--ignore", "DL242")
    assert [line.split()[1] for line in result.stdout.splitlines()] == ["DL201"]


def test_statistics_say_how_many_can_be_corrected(project):
    (project / "loops/oven.yaml").write_text(REACTOR.replace("mode: auto", 'mode: "Auto"'), "utf-8")
    (row,) = [line for line in run("validate", "loops", "--statistics").stdout.splitlines() if "--fix" in line]
    assert re.fullmatch(r"2  PID02\d  error    .* \(2 correctable with --fix\)", row)


def test_statistics_of_nothing_are_nothing(project):
    assert run("validate", "loops", "--statistics", "--select", "DL299").stdout == ""


def test_statistics_are_text_or_json_and_reports_have_the_findings_all_the_same(project):
    assert "text or json, not as sarif" in run("validate", "loops", "--statistics", "--format", "sarif").stderr
    result = run("validate", "loops", "--statistics", "--report-output", "concise=all.txt", GITHUB_ACTIONS="true")
    assert result.stdout.startswith("3  DL211"), "the format of GitHub's jobs was not asked for"
    assert (project / "all.txt").read_text("utf-8").count("DL211") == 3


# --- --verbose -------------------------------------------------------------------------------------------------------


def test_verbose_says_what_was_read_left_out_and_why_a_finding_is_not_reported(project):
    (project / "loops/compose.yaml").write_text("services: {}\n", "utf-8")
    (project / "pidcfg.toml").write_text('ignore = ["DL231"]\n', "utf-8")
    line = next(line for line in MISTAKES.splitlines() if "low: 15," in line)
    text = MISTAKES.replace(line, f"{line}  # pidcfg: ignore[DL242] runs by hand")
    (project / "loops/oven.yaml").write_text(text, "utf-8")
    result = run("validate", "loops", "-v", PIDCFG_VALIDATE_STRICT="1")
    for said in (
        "environment: PIDCFG_VALIDATE_STRICT=1\n",
        "settings: pidcfg.toml\n",
        "read loops/oven.yaml: 3 findings\n",
        "left out, without a pidcfg key: loops/compose.yaml\n",
        "not reported: loops/oven.yaml:16:30: DL242: ignored, runs by hand\n",
        "not reported: 2 findings, by the settings\n",
    ):
        assert said in result.stderr, said
    assert re.match(r"pidcfg \S+, Python 3\.\d+\.\S+, \w+\n", result.stderr)
    assert result.stdout == run("validate", "loops", PIDCFG_VALIDATE_STRICT="1").stdout


def test_verbose_names_what_a_baseline_knows(project):
    run("validate", "loops/oven.yaml", "--baseline", "known", "--create-baseline")
    said = run("validate", "loops/oven.yaml", "--baseline", "known", "--verbose").stderr
    assert "not reported: loops/oven.yaml:5:19: DL201: in the baseline\n" in said


def test_verbose_of_a_simulation_names_its_files_and_engine(project):
    for name in ("reactor.yaml", "reactor.scenario.yaml"):
        shutil.copyfile(ROOT / "examples/dl06" / name, project / name)
    text = (project / "reactor.scenario.yaml").read_text("utf-8")
    (project / "reactor.scenario.yaml").write_text(re.sub(r"duration: .*", "duration: 2", text), "utf-8")
    said = run("simulate", "reactor.scenario.yaml", "-v").stderr
    assert "read reactor.scenario.yaml\nread reactor.yaml\nran reactor.scenario.yaml: 2 s in " in said
    assert re.search(r"engine python\ntook \d+\.\d\d s\n$", said)


@pytest.mark.parametrize("command", ["validate", "simulate"])
def test_verbose_and_quiet_exclude_each_other(project, command):
    assert run(command, "loops", "-v", "-q").exit_code == 2


# --- --stdin-filename ------------------------------------------------------------------------------------------------


def test_standard_input_goes_by_the_name_that_it_is_given(project):
    (project / "loops/pidcfg.toml").write_text('[per-file-ignores]\n"oven.yaml" = ["DL201"]\n', "utf-8")
    words = ("validate", "-", "--format", "concise", "--severity", "error")
    named = run(*words, "--stdin-filename", "loops/oven.yaml", stdin=MISTAKES)
    assert [line.partition(" ")[0] for line in named.stdout.splitlines()] == ["loops/oven.yaml:16:30:"]
    assert "settings of loops/pidcfg.toml" in named.stderr
    unnamed = run(*words, stdin=MISTAKES)
    assert [line.partition(" ")[0] for line in unnamed.stdout.splitlines()] == ["<stdin>:5:19:", "<stdin>:16:30:"]


def test_a_baseline_knows_the_named_text_as_it_knows_the_file(project):
    run("validate", "loops/oven.yaml", "--baseline", "known", "--create-baseline")
    words = ("validate", "-", "--baseline", "known")
    assert run(*words, "--stdin-filename", "loops/oven.yaml", stdin=MISTAKES).exit_code == 0
    assert run(*words, stdin=MISTAKES).exit_code == 1


def test_the_text_of_an_editor_takes_the_place_of_the_file_in_a_folder(project):
    for paths in (("-", "loops"), ("loops", "-")):
        found = run("validate", *paths, "--stdin-filename", "loops/oven.yaml", stdin=REACTOR)
        assert "2 files checked: 0 errors" in found.stderr, paths


def test_fix_never_writes_the_file_that_standard_input_is_called_after(project):
    text = REACTOR.replace("mode: auto", 'mode: "Auto"', 1)
    result = run("validate", "-", "--fix", "-q", "--stdin-filename", "loops/oven.yaml", stdin=text)
    assert result.stdout == REACTOR
    assert (project / "loops/oven.yaml").read_text("utf-8") == MISTAKES
    patch = run("validate", "-", "--diff", "-q", "--stdin-filename", "loops/oven.yaml", stdin=text).stdout
    assert patch.startswith("--- loops/oven.yaml\n+++ loops/oven.yaml\n")


def test_a_scenario_finds_its_configuration_beside_the_name_that_it_is_given(project):
    text = (ROOT / "examples/dl06/reactor.scenario.yaml").read_text("utf-8")
    text = re.sub(r"duration: .*", "duration: 2", text)
    words = ("simulate", "-", "-q")
    named = run(*words, "--stdin-filename", "loops/short.scenario.yaml", stdin=text)
    assert "loops/short.scenario.yaml runs loops/reactor.yaml" in named.stdout
    assert run(*words, stdin=text).exit_code == 2
    assert run("validate", "-", "--stdin-filename", "loops/s.yaml", stdin=text).exit_code == 0


@pytest.mark.parametrize("words", [["encode"], ["convert", "--to", "dpide"]])
def test_other_commands_name_standard_input_too(project, words):
    result = run(*words, "-", "--stdin-filename", "loops/oven.yaml", stdin=MISTAKES)
    assert "loops/oven.yaml:16:30: error DL242" in result.stderr
    assert "<stdin>" not in result.output


def test_a_listing_through_a_pipe_is_read_and_compared_under_its_name(project):
    listing = run("encode", "loops/reactor.yaml", "--format", "csv", "-q").stdout
    result = run("decode", "-", "--vendor", "dl06", "--stdin-filename", "up.csv", stdin=listing.replace("0080", "00xy"))
    assert re.match(r"up\.csv:\d+:", result.stderr)
    compared = run("diff", "loops/reactor.yaml", "-", "--stdin-filename", "up.csv", stdin=listing)
    assert "the same: FIC-102, TIC-101, LIC-103" in compared.stdout
    assert run("diff", "loops/reactor.yaml", "-", stdin=listing).exit_code != 0, "without a name it is YAML"
    for name in ((), ("--stdin-filename", "other.yaml")):
        same = run("diff", "loops/reactor.yaml", "-", *name, stdin=REACTOR)
        assert "the same: FIC-102, TIC-101, LIC-103" in same.stdout


# --- Markdown --------------------------------------------------------------------------------------------------------


def test_findings_as_markdown_are_one_table(project):
    lines = run("validate", "loops/oven.yaml", "--format", "markdown").stdout.splitlines()
    assert lines[:4] == [
        "**1 file checked: 2 errors, 0 warnings, 1 info**",
        "",
        "| | place | rule | finding |",
        "|---|---|---|---|",
    ]
    assert len(lines) == 7
    assert lines[4].startswith("| error | loops/oven.yaml:5:19 | DL201 | the loop table starts at V7350")
    assert "<br>PLC: V7642 bit 0<br>cure: start the table" in lines[4]


def test_no_findings_are_no_table(project):
    result = run("validate", "loops", "--format", "markdown", "--select", "DL299")
    assert result.stdout == "**2 files checked: 0 errors, 0 warnings, 0 infos**\n"


def test_text_of_a_file_stays_in_its_cell(project):
    name = "a|b<img src=x>[c](d)"
    text = MISTAKES.replace("TIC-101", name).replace(f"name: {name}", f'name: "{name}"')
    rows = run(
        "validate", "-", "--stdin-filename", f"{name}.yaml", "--format", "markdown", stdin=text
    ).stdout.splitlines()[4:]
    assert rows
    for row in rows:
        assert len(re.findall(r"(?<!\\)\|", row)) == 5, row
        assert "<img" not in row
        assert "](" not in row


def test_a_table_ends_before_github_refuses_it(project, monkeypatch):
    monkeypatch.setattr(markdown, "MAX_FINDINGS", 2)
    lines = run("validate", "loops", "--format", "markdown").stdout.splitlines()
    assert len([line for line in lines if re.match(r"\| (error|warning|info) ", line)]) == 2
    assert lines[-1] == "… and 6 more"


# --- The line that names what is usually done next: for a person at a terminal, and for nobody else -------------------


@pytest.fixture
def terminal(monkeypatch):
    monkeypatch.delenv("CI", raising=False)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    lines = []
    monkeypatch.setattr(module, "write_remark", lines.append)
    return lines


def test_it_names_the_command(terminal):
    suggest_next_step("validate", "my loops.yaml")
    suggest_next_step("simulate", "a/b.yaml")
    assert terminal == ['next: pidcfg validate "my loops.yaml"', "next: pidcfg simulate a/b.yaml"]


def test_it_is_silent_for_programs_and_where_it_is_not_wanted(terminal, monkeypatch):
    suggest_next_step("validate", "x", quiet=True)
    suggest_next_step("validate", "x", fmt="json")
    monkeypatch.setenv("CI", "1")
    suggest_next_step("validate", "x")
    monkeypatch.delenv("CI")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: False, raising=False)
    suggest_next_step("validate", "x")
    assert terminal == []
