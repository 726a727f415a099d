"""Every option has an environment variable, which the command line outranks and a settings file does not."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from pidcfg.cli.console import print_error
from pidcfg.cli.environment import variable
from pidcfg.cli.main import COMMANDS, cli, load

ROOT = Path(__file__).parents[1]
MISSPELT = "PIDCFG_VALIDATE_STRCT"
OF_THEIR_OWN = {"PIDCFG_NO_CACHE", "PIDCFG_PLC"}
"""Variables that options have declared themselves."""
PAGE = (ROOT / "docs/environment.md").read_text("utf-8")


@pytest.fixture
def oven(tmp_path, monkeypatch):
    """A file with an error, warnings and infos, as the only one of a project."""
    shutil.copyfile(ROOT / "examples/mistakes/oven.yaml", tmp_path / "oven.yaml")
    (tmp_path / ".git").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*words: str, **variables: str):
    return CliRunner().invoke(cli, words, env=variables)


def message(*words: str, **variables: str) -> str:
    """What `main` says about a command line that is refused."""
    runner = CliRunner(env=variables)
    with runner.isolation() as streams:
        with pytest.raises(click.ClickException) as refused:
            cli.main(list(words), standalone_mode=False)
        print_error(refused.value)
        return streams[1].getvalue().decode()


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_of_a_command_has_a_variable_of_its_own_and_the_help_names_it(name):
    command = load(name)
    options = [p for p in command.params if isinstance(p, click.Option) and not p.hidden]
    names = {option.envvar for option in options}
    assert len(names) == len(options)
    assert all(re.fullmatch(rf"PIDCFG_{name.upper()}_[A-Z_]+", found) for found in names - OF_THEIR_OWN)
    text = command.get_help(click.Context(command, info_name=name, terminal_width=400, max_content_width=400))
    assert set(re.findall(r"\[env var: (\w+)", text)) == names


def test_a_variable_is_called_as_the_option_is_not_as_the_code_calls_it():
    assert variable("validate", "--report-output") == "PIDCFG_VALIDATE_REPORT_OUTPUT"
    options = {option.name: option.envvar for option in load("simulate").params if isinstance(option, click.Option)}
    assert (options["fmt"], options["csv"]) == ("PIDCFG_SIMULATE_FORMAT", "PIDCFG_SIMULATE_TREND")
    assert [p.envvar for p in cli.params if p.name != "version"] == ["PIDCFG_COLOR"]
    assert [p.envvar for p in load("rule").params if p.name == "color"] == [None], "one variable for --color"


def test_a_variable_that_an_option_declares_is_the_one_that_counts(oven):
    options = {option.name: option.envvar for option in load("validate").params if isinstance(option, click.Option)}
    assert options["no_cache"] == "PIDCFG_NO_CACHE"


def test_no_variable_prints_the_version(oven):
    assert "checked" in run("validate", "oven.yaml", PIDCFG_VERSION="1").stderr


def test_the_command_line_outranks_the_environment_which_outranks_the_settings_file(oven):
    (oven / "pidcfg.toml").write_text('format = "concise"\nstrict = true\n', "utf-8")
    assert run("validate", "oven.yaml").stdout.startswith("oven.yaml:5:19: error DL201 the")
    assert run("validate", "oven.yaml", PIDCFG_VALIDATE_FORMAT="json").stdout.startswith("{")
    found = run("validate", "oven.yaml", "--format", "github", PIDCFG_VALIDATE_FORMAT="json")
    assert found.stdout.startswith("::error")
    shown = run("validate", "oven.yaml", "--show-settings", PIDCFG_VALIDATE_STRICT="0").stdout
    assert "strict = false  # PIDCFG_VALIDATE_STRICT\n" in shown
    assert 'format = "concise"  # pidcfg.toml\n' in shown


@pytest.mark.parametrize(("value", "code"), [("1", 1), ("true", 1), ("0", 0), ("no", 0), ("", 0)])
def test_a_switch_is_on_or_off(oven, value, code):
    shutil.copyfile(ROOT / "examples/dl06/reactor.yaml", oven / "oven.yaml")
    assert run("validate", "oven.yaml", PIDCFG_VALIDATE_STRICT=value).exit_code == code


def test_an_option_that_may_be_repeated_takes_its_values_separated_by_blanks(oven):
    run("validate", "oven.yaml", PIDCFG_VALIDATE_REPORT_OUTPUT="json=a.json sarif=b.sarif")
    assert {path.name for path in oven.glob("*.*")} >= {"a.json", "b.sarif"}


@pytest.mark.parametrize(
    ("words", "name", "value"),
    [
        (["validate", "oven.yaml"], "PIDCFG_VALIDATE_SEVERITY", "bad"),
        (["validate", "oven.yaml"], "PIDCFG_VALIDATE_STRICT", "maybe"),
        (["validate", "oven.yaml"], "PIDCFG_VALIDATE_SELECT", "XY"),
        (["validate", "oven.yaml"], "PIDCFG_VALIDATE_LIMIT", "nothing"),
        (["simulate", "oven.yaml"], "PIDCFG_SIMULATE_EVERY", "0"),
        (["encode", "oven.yaml"], "PIDCFG_ENCODE_FORMAT", "pdf"),
        (["rule"], "PIDCFG_COLOR", "red"),
    ],
)
def test_a_bad_value_is_refused_with_its_variable(oven, words, name, value):
    text = message(*words, **{name: value})
    assert f"(from {name})" in text.splitlines()[-1]
    assert run(*words, **{name: value}).exit_code == 2
    assert "the environment sets" not in text, "it is said once"


def test_a_bad_value_of_the_command_line_is_refused_without_a_variable(oven):
    text = message("validate", "oven.yaml", "--severity", "bad", PIDCFG_VALIDATE_SEVERITY="info")
    assert "PIDCFG" not in text
    assert "Invalid value for '--severity': 'bad'" in text
    assert "PIDCFG" not in message("decode", "x")


def test_an_error_that_names_no_option_says_what_the_environment_sets(oven):
    text = message("validate", "oven.yaml", PIDCFG_VALIDATE_BASELINE="none.json", PIDCFG_VALIDATE_STRICT="1")
    assert "note: the environment sets PIDCFG_VALIDATE_BASELINE=none.json\n" in text
    assert "note: the environment sets PIDCFG_VALIDATE_STRICT=1\n" in text
    assert "cannot read none.json" in text


def test_an_empty_variable_is_none(oven):
    text = message("validate", "oven.yaml", "--baseline", "none.json", PIDCFG_VALIDATE_BASELINE="")
    assert "PIDCFG_VALIDATE" not in text


def test_a_variable_that_is_none_of_the_command_is_reported_and_changes_nothing(oven):
    found = run("validate", "oven.yaml", "-q", PIDCFG_VALIDATE_STRCT="1", PIDCFG_SIMULATE_STRCT="1")
    note = "note: PIDCFG_VALIDATE_STRCT is no variable of pidcfg validate; did you mean PIDCFG_VALIDATE_STRICT?\n"
    assert found.stderr == note


def test_the_page_names_only_variables_that_exist():
    known = {str(p.envvar) for name in COMMANDS for p in load(name).params} | {"PIDCFG_COLOR"}
    assert set(re.findall(r"PIDCFG_[A-Z]+(?:_[A-Z]+)*", PAGE)) - {"PIDCFG_COMMAND_OPTION", MISSPELT} <= known
