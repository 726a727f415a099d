"""The files of docs/ci are what CI systems read, and their steps do what the page says."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from ruamel.yaml import YAML

from pidcfg.cli.main import cli

ROOT = Path(__file__).parents[1]
CI = ROOT / "docs" / "ci"
PAGE = (ROOT / "docs/ci.md").read_text("utf-8")
WORKFLOW = YAML(typ="safe").load((CI / "github-workflow.yml").read_text("utf-8"))
GITLAB = YAML(typ="safe").load((CI / "gitlab-ci.yml").read_text("utf-8"))
HOOKS = {hook["id"]: hook for hook in YAML(typ="safe").load((ROOT / ".pre-commit-hooks.yaml").read_text("utf-8"))}
REACTOR = ROOT / "examples/dl06/reactor.yaml"
SCENARIO = """\
pidcfg: 1
scenario: short
config: reactor.yaml
duration: 20
initial: steady
plants:
  FIC-102: {model: first_order, gain: 0.5, time_constant: 3, dead_time: 0.4, initial: 20}
  TIC-101: {model: first_order, input: FIC-102.PV, gain: 4.0, time_constant: 240, dead_time: 15, initial: 80}
  LIC-103: {model: integrator, gain: -0.02, load: 1.0, initial: 50}
expect: [{signal: TIC-101.PV, max: %s}]
"""
needs_bash = pytest.mark.skipif(os.name == "nt" or not shutil.which("bash"), reason="the jobs' steps are for bash")
needs_git = pytest.mark.skipif(not shutil.which("git"), reason="the job compares commits of git")


# --- their own readers -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("schema", "file"),
    [
        ("vendor.github-workflows", "github-workflow.yml"),
        ("custom.github-workflows-require-timeout", "github-workflow.yml"),
        ("vendor.gitlab-ci", "gitlab-ci.yml"),
    ],
)
def test_the_files_meet_the_schemas_of_their_systems(schema, file):
    pytest.importorskip("check_jsonschema")
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", schema, str(CI / file)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize("file", ["github-workflow.yml", "gitlab-ci.yml"])
def test_the_page_shows_the_whole_file(file):
    assert f"```yaml\n{(CI / file).read_text('utf-8')}```\n" in PAGE


def test_every_command_on_the_page_and_in_the_hooks_is_understood():
    """Parsed, not run: options that do not exist would be refused."""
    lines = [hook["entry"] for hook in HOOKS.values()]
    lines += re.findall(r"`(pidcfg [^`…]*)`", PAGE) + re.findall(
        r"^\s*(?:- |run: |entry: )(pidcfg .*)$", PAGE, re.MULTILINE
    )
    assert len(lines) > 10
    for line in lines:
        _, name, *arguments = line.split()
        command = cli.get_command(click.Context(cli), name)
        known = {option for param in command.params for option in param.opts}
        assert {word for word in arguments if word.startswith("-")} <= known, line


# --- pre-commit ------------------------------------------------------------------------------------------------------


def test_the_hooks_have_the_keys_of_a_manifest():
    keys = {"id", "name", "description", "entry", "args", "language", "types", "pass_filenames", "require_serial"}
    for hook in HOOKS.values():
        assert {"id", "name", "entry", "language", "types"} <= set(hook) <= keys
        assert (hook["language"], hook["types"], hook["require_serial"]) == ("python", ["yaml"], True)
    assert HOOKS["pidcfg-simulate"]["pass_filenames"] is False
    for name in re.findall(r"- id: (\S+)", PAGE):
        assert name in HOOKS


def hook(name: str, *files: str) -> tuple[int, str]:
    """What pre-commit runs: the entry, its arguments, the names of files."""
    entry = HOOKS[name]
    passed = files if entry.get("pass_filenames", True) else ()
    words = [*entry["entry"].split()[1:], *entry.get("args", ()), *passed]
    result = CliRunner().invoke(cli, words)
    return result.exit_code, result.output


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A small project with a file of somebody else's."""
    shutil.copyfile(REACTOR, tmp_path / "reactor.yaml")
    (tmp_path / "short.scenario.yaml").write_text(SCENARIO % 200, "utf-8")
    (tmp_path / "compose.yaml").write_text("services: {}\n", "utf-8")
    shutil.copyfile(CI / "gitlab-ci.yml", tmp_path / ".gitlab-ci.yml")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_hook_is_silent_when_nothing_is_wrong(project):
    code, output = hook("pidcfg-validate", "compose.yaml", ".gitlab-ci.yml")
    assert (code, output) == (0, "")


def test_the_hook_is_not_fooled_by_foreign_files_beside_a_mistake(project):
    text = REACTOR.read_text("utf-8").replace("gain: 0.80", "gain: 120")
    (project / "reactor.yaml").write_text(text, "utf-8")
    code, output = hook("pidcfg-validate", "compose.yaml", "reactor.yaml")
    assert code == 1
    assert "PID101" in output
    assert "compose.yaml" not in output


def test_named_files_are_foreign_only_where_that_was_asked_for(project):
    assert CliRunner().invoke(cli, ["validate", "compose.yaml"]).exit_code != 0
    result = CliRunner().invoke(cli, ["validate", "--skip-foreign", "compose.yaml", "reactor.yaml"])
    assert result.exit_code == 0
    assert "1 file checked" in result.stderr
    assert "1 without a pidcfg key skipped" in result.stderr
    missing = CliRunner().invoke(cli, ["validate", "--skip-foreign", "none.yaml"])
    assert missing.exit_code == 2, "a file that cannot be read is nobody's to skip"


def test_the_simulation_hook_judges_scenarios_whose_configuration_has_changed(project):
    assert hook("pidcfg-simulate", "reactor.yaml")[0] == 0
    (project / "short.scenario.yaml").write_text(SCENARIO % -300, "utf-8")
    code, output = hook("pidcfg-simulate", "reactor.yaml")
    assert code == 1
    assert "FAILED" in output


# --- the jobs --------------------------------------------------------------------------------------------------------


@pytest.fixture
def shell(project, tmp_path_factory, monkeypatch):
    """Runs a step with `pidcfg` on the path, and `gh` as a program that writes down what it is asked."""
    tools = tmp_path_factory.mktemp("tools")
    for name, body in (
        ("pidcfg", f'exec "{sys.executable}" -m pidcfg "$@"'),
        ("gh", f'echo "$@" > "{tools}/asked"'),
    ):
        (tools / name).write_text(f"#!/bin/sh\n{body}\n", "utf-8")
        (tools / name).chmod(0o755)
    environment = {**os.environ, "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": str(ROOT / "src")}

    def run(script: str, **more: str) -> subprocess.CompletedProcess[str]:
        command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script]
        return subprocess.run(command, capture_output=True, text=True, check=False, env={**environment, **more})

    run.asked = tools / "asked"  # type: ignore[attr-defined]
    return run


def steps(job: str) -> dict[str, str]:
    """The steps of a job that run something, by name."""
    return {step["name"]: step["run"] for step in WORKFLOW["jobs"][job]["steps"] if "run" in step}


def break_gain(project: Path) -> None:
    """A gain that no DL06 holds."""
    path = project / "reactor.yaml"
    path.write_text(path.read_text("utf-8").replace("gain: 0.80", "gain: 120"), "utf-8")


@needs_bash
def test_the_workflow_annotates_and_reports(project, shell):
    break_gain(project)
    found = shell(steps("check")["Validate"], GITHUB_ACTIONS="true")
    assert found.returncode == 1
    assert re.search(r"^::error file=reactor\.yaml,line=17,.*PID101", found.stdout, re.MULTILINE)
    sarif = json.loads((project / "pidcfg.sarif").read_text("utf-8"))
    assert "PID101" in {result["ruleId"] for result in sarif["runs"][0]["results"]}
    assert pytest.importorskip("junitparser").JUnitXml.fromfile(str(project / "pidcfg-validate.xml")).failures


@needs_bash
def test_the_workflow_passes_a_sound_project(project, shell):
    for name in ("Validate", "Simulate"):
        step = shell(steps("check")[name], GITHUB_ACTIONS="true")
        assert step.returncode == 0, step.stdout + step.stderr
    suites = pytest.importorskip("junitparser").JUnitXml.fromfile(str(project / "pidcfg-simulate.xml"))
    assert suites.failures == suites.errors == 0
    names = [case.name for suite in suites for case in suite]
    assert [name for name in names if "TIC-101.PV" in name]
    assert [name for name in names if "pv-not-driven" in name]


@needs_bash
def test_a_project_that_has_no_scenario_yet_passes(project, shell):
    (project / "short.scenario.yaml").unlink()
    for script in (
        *(steps("check")[name] for name in ("Validate", "Simulate")),
        *("\n".join(GITLAB[name]["script"]) for name in ("pidcfg validate", "pidcfg simulate")),
    ):
        job = shell(script, GITHUB_ACTIONS="true")
        assert job.returncode == 0, job.stdout + job.stderr
    assert "no scenario there, so nothing was run" in job.stdout + job.stderr
    assert pytest.importorskip("junitparser").JUnitXml.fromfile(str(project / "pidcfg-simulate.xml")).tests == 0


def git(*arguments: str) -> str:
    """git with a name and without the user's settings."""
    who = ["-c", "user.name=t", "-c", "user.email=t@example.com", "-c", "commit.gpgsign=false"]
    environment = {**os.environ, "GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1"}
    command = ["git", *who, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout.strip()


@needs_bash
@needs_git
def test_the_workflow_comments_what_a_pull_request_changes(project, shell, tmp_path_factory):
    git("init", "-q", "-b", "main")
    git("add", ".")
    git("commit", "-q", "-m", "base")
    path = project / "reactor.yaml"
    path.write_text(path.read_text("utf-8").replace("gain: 0.80", "gain: 8.0"), "utf-8")
    (project / "compose.yaml").write_text("services: {more: {}}\n", "utf-8")
    base = git("rev-parse", "HEAD")
    git("commit", "-q", "-a", "-m", "change")
    summary = tmp_path_factory.mktemp("github") / "summary.md"
    found = shell(steps("compare")["Compare"], BASE=base, GITHUB_STEP_SUMMARY=str(summary))
    assert found.returncode == 0, found.stderr
    text = (project / "diff.md").read_text("utf-8")
    assert text == summary.read_text("utf-8")
    assert "**FIC-102**" in text
    assert re.search(r"\| \*\*high\*\* \| tuning.gain \| .* \| .* \|", text), text
    assert "compose" not in text
    assert not (project / "before").exists()
    assert shell(steps("compare")["Comment"], NUMBER="7").returncode == 0
    assert shell.asked.read_text("utf-8").split()[:5] == ["pr", "comment", "7", "--body-file", "diff.md"]


@needs_bash
def test_the_gitlab_jobs_write_the_reports_that_they_publish(project, shell):
    break_gain(project)
    for name, expected in (("pidcfg validate", 1), ("pidcfg simulate", 2)):
        job = GITLAB[name]
        found = shell("\n".join(job["script"]))
        assert found.returncode == expected, found.stdout + found.stderr
        for report in job["artifacts"]["reports"].values():
            assert (project / report).stat().st_size
    issues = json.loads((project / "gl-code-quality.json").read_text("utf-8"))
    assert "PID101" in {issue["check_name"] for issue in issues}
