"""The action, the container and what a hosting site reads, by the programs that others wrote for them."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from ruamel.yaml import YAML
from trove_classifiers import classifiers

import pidcfg
from pidcfg.cli.main import cli
from pidcfg.vendors import VENDORS

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
ACTION = YAML(typ="safe").load((ROOT / "action.yml").read_text("utf-8"))
DOCKERFILE = (ROOT / "Dockerfile").read_text("utf-8")
FORMS = sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml"))
SCHEMAS = {
    "action.yml": "vendor.github-actions",
    "CITATION.cff": "vendor.citation-file-format",
    ".github/ISSUE_TEMPLATE/config.yml": "vendor.github-issue-config",
    ".github/workflows/ci.yml": "vendor.github-workflows",
    ".github/workflows/release.yml": "vendor.github-workflows",
    ".github/dependabot.yml": "vendor.dependabot",
    ".readthedocs.yaml": "vendor.readthedocs",
    **{path.relative_to(ROOT).as_posix(): "vendor.github-issue-forms" for path in FORMS if path.stem != "config"},
}
needs_bash = pytest.mark.skipif(os.name == "nt" or not shutil.which("bash"), reason="the action's steps are for bash")


def program(name: str) -> str:
    """A program of the development tools, or of the system."""
    folders = os.pathsep.join((sysconfig.get_path("scripts"), os.environ["PATH"]))
    found = shutil.which(name, path=folders)
    if found is None:
        pytest.skip(f"{name} is not installed; python tasks.py test installs it where there is one")
    return found


def said(*command: str | Path) -> str:
    """What a program objects to; nothing when it is content."""
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return "" if result.returncode == 0 else result.stdout + result.stderr


@pytest.mark.parametrize("file", SCHEMAS)
def test_a_file_meets_the_schema_of_the_site_that_reads_it(file):
    pytest.importorskip("check_jsonschema")
    check = (sys.executable, "-m", "check_jsonschema", "--force-filetype", "yaml", "--builtin-schema", SCHEMAS[file])
    assert not said(*check, file)


WORKFLOWS = ["action.yml", "docs/ci/github-workflow.yml", *(f for f in SCHEMAS if f.startswith(".github/workflows"))]


@pytest.mark.parametrize("file", [*WORKFLOWS, ".github/dependabot.yml"])
def test_nothing_in_a_workflow_is_unsafe(file):
    assert not said(program("zizmor"), "--offline", "--no-progress", "--config", ".github/zizmor.yml", file)


def test_a_release_is_made_by_hand_and_only_its_last_step_may_publish():
    """No password is kept: PyPI trusts the workflow, and nothing but the publishing job may say who it is."""
    release = YAML(typ="safe").load((ROOT / ".github/workflows/release.yml").read_text("utf-8"))
    assert release["on"] == {"workflow_dispatch": None}
    assert release["permissions"] == {}
    jobs = release["jobs"]
    assert jobs["publish"]["permissions"] == {"id-token": "write"}
    assert jobs["publish"]["needs"] == ["build", "windows"]
    assert all("refs/tags/v" in jobs[name]["if"] for name in jobs["publish"]["needs"])
    assert not any("secrets" in str(step) for job in jobs.values() for step in job["steps"])


def test_zizmor_sees_an_input_that_a_shell_would_run(tmp_path):
    """The check above can fail."""
    text = (ROOT / "action.yml").read_text("utf-8")
    (tmp_path / "action.yml").write_text(text.replace("${PACKAGE:-$GITHUB_ACTION_PATH}", "${{ inputs.package }}"))
    assert "template-injection" in said(program("zizmor"), "--offline", "--no-progress", tmp_path / "action.yml")


# --- the action ------------------------------------------------------------------------------------------------------


@pytest.fixture
def runner(tmp_path):
    """Runs a step of the action as GitHub would, with `pidcfg` where the first step has put it."""
    temp, work = tmp_path / "temp", tmp_path / "work"
    (temp / "pidcfg/bin").mkdir(parents=True)
    work.mkdir()
    command = temp / "pidcfg/bin/pidcfg"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m pidcfg "$@"\n', "utf-8")
    command.chmod(0o755)
    (temp / "pidcfg/bin/python").write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n', "utf-8")
    (temp / "pidcfg/bin/python").chmod(0o755)
    shutil.copyfile(ROOT / "examples/mistakes/oven.yaml", work / "oven.yaml")
    shutil.copyfile(ROOT / "examples/dl06/reactor.yaml", work / "with blank.yaml")
    defaults = {name: entry["default"] for name, entry in ACTION["inputs"].items()}

    def run(step: str, **inputs: str) -> tuple[int, str, str]:
        (found,) = (entry for entry in ACTION["runs"]["steps"] if entry["name"] == step)
        values = {**defaults, **inputs}
        variables = {key: re.sub(r"\$\{\{ inputs\.(\w+) \}\}", lambda m: values[m[1]], text)
                     for key, text in found["env"].items()}  # fmt: skip
        summary = temp / "summary.md"
        surroundings = {"RUNNER_TEMP": temp, "GITHUB_STEP_SUMMARY": summary, "GITHUB_ACTIONS": "true"}
        surroundings["GITHUB_OUTPUT"] = temp / "output"
        (temp / "output").write_text("", "utf-8")
        environment = {**os.environ, **variables, **{key: str(value) for key, value in surroundings.items()}}
        environment |= {"PYTHONPATH": str(ROOT / "src"), "GITHUB_ACTION_PATH": str(ROOT)}
        shell = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", found["run"]]
        result = subprocess.run(shell, cwd=work, env=environment, capture_output=True, text=True, check=False)
        return result.returncode, result.stdout + result.stderr, summary.read_text("utf-8") if summary.exists() else ""

    run.work = work  # type: ignore[attr-defined]
    run.temp = temp  # type: ignore[attr-defined]
    return run


@needs_bash
def test_the_action_annotates_fails_and_writes_the_summary_of_the_job(runner):
    code, output, summary = runner("Validate")
    assert code == 1
    assert "::error file=oven.yaml,line=5" in output
    assert summary.startswith("**2 files checked: 2 errors, ")
    assert "| error | oven.yaml:16:30 | DL242 | low is 15 degC" in summary


@needs_bash
def test_the_inputs_of_the_action_are_the_options_of_the_command(runner):
    good = "with blank.yaml\n\n"
    assert runner("Validate", paths=good)[0] == 0
    assert runner("Validate", paths=good, strict="true")[0] == 1
    assert runner("Validate", paths="oven.yaml\nwith blank.yaml", sarif="found.sarif")[0] == 1
    assert '"DL242"' in (runner.work / "found.sarif").read_text("utf-8")
    baseline = (sys.executable, "-m", "pidcfg", "validate", "oven.yaml", "--baseline", "known", "--create-baseline")
    subprocess.run(baseline, cwd=runner.work, env={**os.environ, "PYTHONPATH": str(ROOT / "src")}, check=True)
    assert runner("Validate", paths="oven.yaml", baseline="known")[0] == 0


@needs_bash
def test_the_action_hands_on_how_much_was_found_and_where_it_stands(runner):
    assert {*ACTION["outputs"]} == {"files", "errors", "warnings", "infos", "json"}
    for name, output in ACTION["outputs"].items():
        assert output["value"] == f"${{{{ steps.validate.outputs.{name} }}}}"
    runner("Validate")
    told = dict(line.split("=", 1) for line in (runner.temp / "output").read_text("utf-8").splitlines())
    assert {*told} == {*ACTION["outputs"]}
    found = json.loads(Path(told["json"]).read_text("utf-8"))
    assert {name: int(count) for name, count in told.items() if name != "json"} == found["summary"]
    assert (found["summary"]["files"], found["summary"]["errors"]) == (2, 2)
    assert sum(found["summary"].values()) == 2 + len(found["findings"])
    runner("Validate", paths="")
    assert (runner.temp / "output").read_text("utf-8") == "", "what could not be read has no counts"


@needs_bash
def test_the_summary_never_shows_the_findings_of_an_earlier_step(runner):
    first = runner("Validate", paths="oven.yaml")[2]
    code, output, summary = runner("Validate", paths="")
    assert (code, summary) == (2, first)
    assert "Missing argument" in output


@needs_bash
def test_an_input_of_the_action_is_never_run_by_the_shell_nor_taken_for_an_option(runner):
    code, output, _ = runner("Validate", paths='$(touch made)\n"; touch made; "\n--fix')
    assert code == 2
    assert "cannot read --fix" in output
    assert not (runner.work / "made").exists()


@needs_bash
def test_the_action_installs_itself_unless_another_package_is_named(runner):
    shutil.rmtree(runner.temp / "pidcfg")
    asked = runner.temp / "asked"
    for name in ("python3", "python"):
        tool = runner.temp / name
        tool.write_text(
            '#!/bin/sh\nif [ "$2" = venv ]; then mkdir -p "$3/bin"; cp "$0" "$3/bin/python"\n'
            f'else echo "$@" > "{asked}"\nfi\n'
        )
        tool.chmod(0o755)
    path = f"{runner.temp}{os.pathsep}{os.environ['PATH']}"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", path)
        assert runner("Install pidcfg")[0] == 0
        assert asked.read_text().split()[-1] == str(ROOT)
        assert runner("Install pidcfg", package="pidcfg==0.2.0")[0] == 0
        assert asked.read_text().split()[-1] == "pidcfg==0.2.0"


# --- the container ---------------------------------------------------------------------------------------------------


def test_hadolint_finds_nothing_in_the_dockerfile():
    assert not said(program("hadolint"), "Dockerfile")


def test_the_dockerfile_copies_what_is_there_and_the_build_sees(tmp_path):
    copied = [
        word for line in re.findall(r"^COPY (?!--from)(.+) \S+$", DOCKERFILE, re.MULTILINE) for word in line.split()
    ]
    assert {"src", "docs/man", "pyproject.toml", "README.md"} <= set(copied)
    seen = {line.removeprefix("!") for line in (ROOT / ".dockerignore").read_text("utf-8").splitlines()}
    for name in copied:
        assert (ROOT / name).exists()
        assert {name, name.split("/")[0]} & seen, f"{name} is ignored"


def test_the_image_that_the_container_is_built_from_can_be_named_by_its_digest():
    assert re.findall(r"^FROM (\S+)", DOCKERFILE, re.MULTILINE) == ["${BASE}", "${BASE}"]
    assert re.search(r"^ARG BASE=python:3\.\d+-slim\nFROM ", DOCKERFILE, re.MULTILINE)


def test_the_container_runs_pidcfg_as_nobody_in_particular():
    last = DOCKERFILE.rpartition("FROM ")[2]
    labels = dict(re.findall(r'org\.opencontainers\.image\.(\w+)="(.+)"', last))
    assert labels == {
        "title": PROJECT["name"],
        "description": PROJECT["description"],
        "licenses": PROJECT["license"],
        "version": pidcfg.__version__,
    }
    assert re.search(r"^USER (?!0\b|root)\d+:\d+$", last, re.MULTILINE)
    assert '\nENTRYPOINT ["pidcfg"]\n' in last


# --- what a hosting site and an index read ---------------------------------------------------------------------------


def test_the_classifiers_are_those_of_the_index_and_agree_with_what_is_required():
    named = PROJECT["classifiers"]
    assert set(named) <= classifiers
    oldest = PROJECT["requires-python"].removeprefix(">=")
    assert min(found for text in named if (found := text.rpartition(" :: ")[2]).startswith("3.")) == oldest


def test_the_action_has_what_a_marketplace_shows():
    assert ACTION["branding"]["color"] in {"white", "black", "yellow", "blue", "green", "orange", "red", "purple"}
    assert ACTION["branding"]["icon"] == "sliders"  # one of Feather's
    assert len(ACTION["description"]) < 125


def test_what_a_workspace_in_a_container_runs_is_there():
    """The development container's own schema is not among those that are kept here."""
    workspace = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text("utf-8"))
    assert workspace["postCreateCommand"] == "python tasks.py test --version"
    assert re.fullmatch(r"mcr\.microsoft\.com/devcontainers/python:3\.\d+", workspace["image"])


def test_the_site_is_made_by_its_host_as_it_is_here():
    made = YAML(typ="safe").load((ROOT / ".readthedocs.yaml").read_text("utf-8"))
    assert made["sphinx"] == {"configuration": "docs/conf.py", "fail_on_warning": True}
    named = re.findall(r"-r (\S+)", " ".join(made["build"]["jobs"]["install"]))
    assert named
    assert all((ROOT / name).is_file() for name in named)


def test_the_citation_names_this_version():
    citation = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert (citation["version"], citation["license"]) == (pidcfg.__version__, PROJECT["license"])


def test_the_form_for_a_wrong_value_knows_every_vendor():
    form = YAML(typ="safe").load((ROOT / ".github/ISSUE_TEMPLATE/wrong-value.yml").read_text("utf-8"))
    (choice,) = (entry for entry in form["body"] if entry.get("id") == "vendor")
    assert choice["attributes"]["options"] == list(VENDORS)


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", "SECURITY.md", "CODE_OF_CONDUCT.md"])
def test_the_links_of_a_page_at_the_root_lead_somewhere(name):
    text = (ROOT / name).read_text("utf-8")
    for target in re.findall(r"\]\(([^)#]+)", text):
        assert (ROOT / target).exists(), target


@pytest.mark.skipif(not shutil.which("man") or not shutil.which("groff"), reason="no man or groff")
def test_the_manual_pages_are_what_man_reads():
    pages = sorted((ROOT / "docs/man").glob("*.1"))
    command = ["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", *pages]
    environment = {**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "90", "MANPAGER": "cat"}
    result = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert result.stderr == ""
    text = re.sub(r"\x1b\[[\d;]*m|.\x08", "", result.stdout)
    assert "PIDCFG_VALIDATE_REPORT_OUTPUT" in text
    assert "--bits C,C…" in text
    assert "pidcfg validate loops/ --severity warning --strict\n" in text


# --- The files of docs/ci are what CI systems read, and their steps do what the page says -----------------------------


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
