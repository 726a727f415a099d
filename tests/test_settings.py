"""Settings files: where they are looked for, what they may say, and that the command line wins."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

import living_rig
from living_rig import GOOD, run
from pidcfg.cli.commands.schema import document_schema
from pidcfg.cli.console import print_error
from pidcfg.cli.environment import variable_of
from pidcfg.cli.main import COMMANDS, cli, load_command
from pidcfg.cli.settings import REFUSED_KEYS, SETTINGS_KEYS, settings_candidates
from pidcfg.text.paths import matches

TWICE = living_rig.TWICE + "    bias_freeze: true\n"


@pytest.fixture
def project(tmp_path):
    """A repository with a configuration two folders down."""
    root = tmp_path / "outside" / "project"
    (root / "loops" / "old").mkdir(parents=True)
    (root / ".git").mkdir()
    (root / "loops" / "a.yaml").write_text(TWICE, "utf-8")
    (root / "loops" / "old" / "b.yaml").write_text(TWICE, "utf-8")
    return root


@pytest.fixture
def validate(monkeypatch, capsysbinary):
    """``pidcfg validate`` in this process."""
    return lambda *args: run(monkeypatch, capsysbinary, *args)


def put(folder, text, name="pidcfg.toml"):
    (folder / name).write_text(text, "utf-8")


@pytest.mark.parametrize("where", ["", "loops"])
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("pidcfg.toml", 'ignore = ["DL242"]\n'),
        ("pyproject.toml", '[project]\nname = "x"\n[tool.pidcfg]\nignore = ["dl24"]\n'),
        ("pyproject.toml", '[tool]\npidcfg.ignore = ["DL2"]\n'),
        ("pyproject.toml", 'tool = {pidcfg = {ignore = ["DL2"]}}\n'),
    ],
)
def test_settings_are_found_upward_to_the_root_of_the_repository(project, validate, where, name, text):
    assert validate(project / "loops/a.yaml").code == 1
    put(project / where, text, name)
    found = validate(project / "loops/a.yaml")
    assert found.code == 0
    assert "; settings of " in found.err
    assert Path(project.name, where, name).as_posix() in found.err


def test_nothing_above_the_repository_is_read(project, validate):
    put(project.parent, 'ignore = ["DL242"]\n')
    assert validate(project / "loops/a.yaml").code == 1
    (project / ".git").rmdir()
    (project / ".git").write_text("gitdir: elsewhere\n", "utf-8")
    assert validate(project / "loops/a.yaml").code == 1, "a worktree has a file of that name"
    (project / ".git").unlink()
    assert validate(project / "loops/a.yaml").code == 0, "without a repository, upward to the root"


def test_the_search_ends_at_the_root_of_the_file_system(tmp_path):
    folders = [path.parent for path in settings_candidates(str(tmp_path / "none.yaml"))]
    assert folders[0] == tmp_path
    assert folders[-1] == Path(tmp_path.anchor)
    assert len(folders) == len(set(folders)) * 2, "two names a folder, each folder once"


def test_the_nearest_file_counts_alone_and_its_own_name_before_the_shared_one(project, validate):
    put(project, 'ignore = ["DL242"]\n')
    put(project / "loops", "strict = true\n")
    put(project / "loops", "[tool.pidcfg]\nignore = ['DL242']\n", "pyproject.toml")
    assert validate(project / "loops/a.yaml").code == 1


@pytest.mark.parametrize("shared", ['[project]\nname = "pidcfg"\n', '[tool]\nother = "pidcfg"\n', "not toml at all ["])
def test_a_shared_file_without_our_table_is_passed_over(project, validate, shared):
    put(project / "loops", shared, "pyproject.toml")
    put(project, 'ignore = ["DL242"]\n')
    assert validate(project / "loops/a.yaml").code == 0


def test_standard_input_takes_the_settings_of_the_working_directory(project, monkeypatch):
    monkeypatch.chdir(project / "loops")
    assert settings_candidates("-")[0] == project / "loops" / "pidcfg.toml"


def test_config_names_a_file_and_isolated_takes_none(project, validate, tmp_path):
    put(tmp_path, 'ignore = ["DL242"]\n', "ci.toml")
    put(project, "strict = true\n")
    assert validate(project / "loops/a.yaml", "--config", tmp_path / "ci.toml").code == 0
    assert validate("--config", tmp_path / "ci.toml", project / "loops/a.yaml").code == 0, "in any order"
    put(project, 'ignore = ["DL242"]\n')
    assert validate(project / "loops/a.yaml", "--isolated").code == 1
    assert validate(project / "loops/a.yaml", "--isolated", "--config", "x").code == 2


def test_the_command_line_wins(project, validate):
    put(project, 'ignore = ["DL242"]\nformat = "json"\nseverity = "error"\nstrict = true\n')
    path = project / "loops/a.yaml"
    assert json.loads(validate(path).out)["findings"] == []
    assert "DL242" in validate(path, "--ignore", "DL254", "--format", "text").out
    assert len(json.loads(validate(path, "--severity", "info").out)["findings"]) == 1


def test_every_example_of_a_key_is_accepted_and_has_an_effect_on_show_settings(project, validate):
    for key, row in SETTINGS_KEYS.items():
        put(project, f"{key} = {row.example}\n")
        found = validate(project / "loops/a.yaml", "--show-settings")
        assert found.code == 0, found.err
        assert re.match(r"settings file: \S*/project/pidcfg\.toml\n", found.out)
        (line,) = (line for line in found.out.splitlines() if line.startswith(key))
        assert "pidcfg.toml" in line or key == "per-file-ignores"


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ('strict = true\nselct = ["DL2"]\n', "2:1", "unknown key 'selct'; did you mean select?"),
        ("per_file_ignores = {}\n", "1:1", "did you mean per-file-ignores?"),
        ("strict = 1\n", "1:1", "strict must be true or false, not 1"),
        (f"strict = 0x{'f' * 3600}\n", "1:1", "not a number of too many digits"),
        (f"severity = 0x{'f' * 3600}\n", "1:1", "severity is a number of too many digits"),
        (f"severity = [0x{'f' * 3600}]\n", "1:1", "severity is a number of too many digits"),
        (f"strict = {'9' * 4000}\n", "1:1", f"not {'9' * 60}…; write"),
        ('ignore = "DL2"\n', "1:1", "ignore must be a list of codes"),
        ('ignore = [\n  "DL2",\n  "PID977",\n]\n', "3:4", "no rule begins with 'PID977'"),
        ('ignore = [""]\n', "1:", "no rule begins with ''"),
        ('severity = "warn"\n', "1:1", "severity is 'warn', not one of error, warning, info; did you mean warning?"),
        ('format = "xml"\n', "1:1", "not one of text"),
        ("[per-file-ignores]\n'a/*' = ['DL2']\n'b/*' = ['PIDX']\n", "3:11", "no rule begins with 'PIDX'"),
        ("[per-file-ignores]\n'a\\b' = ['DL2']\n", "2:2", "forward slashes"),
        ("per-file-ignores = ['DL2']\n", "1:1", "must be a table"),
        ('exclude = "old/"\n', "1:1", "exclude must be a list of patterns"),
        ('exclude = [\n  "a/",\n  "../b/",\n]\n', "3:4", "'../b/' leads out of the folder"),
        ("exclude = ['a\\b']\n", "1:13", "forward slashes"),
        ('exclude = ["# old"]\n', "1:13", "'# old' is no pattern of paths"),
        (f"exclude = {['a'] * 201}\n", "1:1", "exclude has more than 200 patterns"),
        (
            '# the format = of a "strict" run\nstrict = true  # format = text\nformat = "xml"\n',
            "3:1",
            "not one of text",
        ),
        ('exclude = ["a#b/"]  # format = "text"\nformat = "xml"\n', "2:1", "not one of text"),
        ("strict = tru\n", "1:10", "not TOML"),
        ("strict = true\nstrict = true\n", "2:", "not TOML"),
        ('baseline = "/etc/passwd"\n', "1:1", "leads out of the folder"),
        ('baseline = "../known.json"\n', "1:1", "leads out of the folder"),
        ("baseline = 3\n", "1:1", "must be the path of a file"),
        ("a = " + "[" * 5000 + "\n", "", "brackets are nested too deeply"),
        (f"strict = true\nb = {'9' * 5000}\n", "2:5", "a number of too many digits"),
    ],
)
def test_wrong_settings_are_wrong_usage_with_their_place(project, validate, text, place, words):
    put(project, text)
    found = validate(project / "loops/a.yaml")
    assert found.code == 2
    assert found.out == ""
    assert f"pidcfg.toml:{place}" in found.err if place else "pidcfg.toml" in found.err
    assert words in found.err


def test_the_place_in_a_shared_file_is_below_its_table(project, validate):
    put(project, 'strict = 3\n[tool.pidcfg]\n# strict\nstrict = "no"\n', "pyproject.toml")
    assert "pyproject.toml:4:1: strict must be true or false" in validate(project / "loops/a.yaml").err


@pytest.mark.parametrize("key", [*REFUSED_KEYS, "quiet", "force", "config"])
def test_no_file_can_raise_limits_or_write(project, validate, key):
    put(project, f'{key} = ["file_bytes=99"]\n')
    found = validate(project / "loops/a.yaml")
    assert found.code == 2
    assert "unknown key" in found.err
    assert REFUSED_KEYS.get(key, "") in found.err


def test_a_link_does_not_lead_a_baseline_out_of_its_folder(project, validate, tmp_path):
    (project / "known.json").symlink_to(tmp_path / "elsewhere.json")
    put(project, 'baseline = "known.json"\n')
    assert "leads out of the folder" in validate(project / "loops/a.yaml", "--create-baseline").err
    assert not (tmp_path / "elsewhere.json").exists()


@pytest.mark.parametrize("data", [b"\xff\xfe", b"x" * (1 << 18) + b"xx", b"strict = true\n\0"])
def test_unreadable_settings(project, validate, data):
    (project / "pidcfg.toml").write_bytes(data)
    assert validate(project / "loops/a.yaml").code == 2


def test_settings_with_a_byte_order_mark_and_windows_line_ends(project, validate):
    (project / "pidcfg.toml").write_bytes(b'\xef\xbb\xbfignore = ["DL242"]\r\n')
    assert validate(project / "loops/a.yaml").code == 0


def test_rules_left_out_by_folder(project, validate, monkeypatch):
    put(project, "[per-file-ignores]\n'loops/old/' = ['DL242']\n")
    assert validate(project / "loops/old").code == 0
    assert validate(project / "loops", "--format", "concise").out.count("error DL242") == 2, "of the other file alone"
    monkeypatch.chdir(project / "loops" / "old")
    assert validate("b.yaml").code == 0, "patterns begin at the settings file, wherever the command runs"


def test_what_makes_a_file_unusable_is_left_out_nowhere(project, validate):
    put(project, "[per-file-ignores]\n'**' = ['PID']\n")
    (project / "loops/a.yaml").write_text(GOOD.replace("gain", "gian"), "utf-8")
    (project / "loops/c.yaml").write_text("pidcfg: [\n", "utf-8")
    found = validate(project / "loops", "--strict")
    assert found.code == 2
    assert {"PID020", "PID001"} <= {word.rstrip(":") for word in found.out.split()}


@pytest.mark.parametrize(
    ("pattern", "path", "fits"),
    [
        ("a.yaml", "a.yaml", True),
        ("a.yaml", "x/y/a.yaml", True),
        ("a.yaml", "xa.yaml", False),
        ("x/a.yaml", "x/a.yaml", True),
        ("x/a.yaml", "y/x/a.yaml", False),
        ("*.yaml", "x/b.yaml", True),
        ("x/*", "x/y/z.yaml", True),
        ("x/*.yaml", "x/y/z.yaml", False),
        ("x/**", "x/y/z.yaml", True),
        ("**/z.yaml", "x/y/z.yaml", True),
        ("x/**/z.yaml", "x/z.yaml", True),
        ("x/**/z.yaml", "x/a/b/z.yaml", True),
        ("old", "loops/old/b.yaml", True),
        ("old/", "loops/old/b.yaml", True),
        ("./old/", "old/b.yaml", True),
        ("/a.yaml", "a.yaml", True),
        ("/a.yaml", "x/a.yaml", False),
        ("?.yaml", "b.yaml", True),
        ("?.yaml", "bb.yaml", False),
        ("[ab].yaml", "a.yaml", False),
        ("[ab].yaml", "[ab].yaml", True),
        ("a.yaml", "../a.yaml", False),
        ("**", "../a.yaml", False),
        ("../a.yaml", "../a.yaml", False),
        ("*", "/a.yaml", False),
        ("./a.yaml", "a.yaml", True),
        ("./a.yaml", "x/a.yaml", False),
        ("A.yaml", "a.yaml", False),
    ],
)
def test_patterns(pattern, path, fits):
    assert matches(pattern, path) is fits


@given(st.text("*?/ab", min_size=1, max_size=40).filter(lambda text: text.strip("/")), st.text("ab/", max_size=200))
def test_no_pattern_takes_long(pattern, path):
    assert matches(pattern, path) in {True, False}
    matches("*a" * 60 + "b", "a" * 255)
    matches("**/a/" * 60 + "b", "a/" * 255)


def test_the_schema_for_editors_agrees_with_the_command():
    jsonschema = pytest.importorskip("jsonschema")
    schema = document_schema("settings")
    jsonschema.Draft202012Validator.check_schema(schema)
    assert set(schema["properties"]) == set(SETTINGS_KEYS)
    for key, row in SETTINGS_KEYS.items():
        jsonschema.validate(tomllib.loads(f"{key} = {row.example}\n"), schema)
    for wrong in ({"selct": []}, {"strict": 1}, {"ignore": "DL2"}, {"severity": "warn"}, {"per-file-ignores": []}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(wrong, schema)


def test_the_settings_of_the_pages_are_accepted_and_complete():
    jsonschema = pytest.importorskip("jsonschema")
    pages = [Path(__file__).parents[1] / "docs" / name for name in ("living-with-findings.md", "settings.md")]
    blocks = [
        text
        for page in pages
        for text in re.findall(r"^```toml\n(.*?)^```$", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    ]
    shown = [tomllib.loads(text) for text in blocks if "wrong" not in text]
    for settings in shown:
        jsonschema.validate(settings, document_schema("settings"))
    assert set().union(*shown) == set(SETTINGS_KEYS), "each key is shown"


@pytest.mark.parametrize("order", [("loops/old", "loops/a.yaml"), ("loops/a.yaml", "loops/old")])
def test_paths_with_different_settings_are_refused_in_any_order(project, validate, monkeypatch, order):
    monkeypatch.chdir(project)
    put(project / "loops/old", 'ignore = ["DL242"]\n')
    found = validate(*order)
    assert (found.code, found.out) == (2, "")
    assert "different settings" in found.err
    assert "loops/old: loops/old/pidcfg.toml" in found.err
    assert "loops/a.yaml: none" in found.err
    assert "--config FILE or --isolated" in found.err
    put(project, 'ignore = ["DL242"]\n')
    assert "loops/a.yaml: pidcfg.toml" in validate(*order).err
    assert validate(*order, "--isolated").code == 1
    assert validate(*order, "--config", "pidcfg.toml").code == 0
    (project / "loops/old/pidcfg.toml").unlink()
    assert validate(*order).code == 0


def test_patterns_reach_no_file_outside(project, validate, tmp_path):
    put(project, "[per-file-ignores]\n'*.yaml' = ['DL2']\n")
    (project.parent / "b.yaml").write_text(TWICE, "utf-8")
    config = ("--config", project / "pidcfg.toml")
    assert validate(project.parent / "b.yaml", *config).code == 1
    assert validate(project / "loops/a.yaml", *config).code == 0
    put(project, "[per-file-ignores]\n'./a.yaml' = ['DL2']\n")
    assert validate(project / "loops/a.yaml").code == 1
    put(project, "[per-file-ignores]\n'../b.yaml' = ['DL2']\n")
    found = validate(project / "loops/a.yaml")
    assert found.code == 2
    assert "pidcfg.toml:2:2: '../b.yaml' leads out of the folder" in found.err


@pytest.mark.parametrize("fmt", ["json", "sarif", "junit", "gitlab", "github", "text", "concise"])
def test_every_run_names_the_settings_file_and_a_quiet_one_when_it_hides_something(project, validate, fmt):
    put(project, "strict = true\n")
    path = project / "loops/a.yaml"
    last = validate(path, "--format", fmt).err.rstrip().splitlines()[-1]
    assert last.startswith("1 file checked: 2 errors")
    assert "; settings of " in last
    assert validate(path, "--format", fmt, "-q").err == ""
    put(project, 'ignore = ["DL254"]\n')
    assert "; settings of " in validate(path, "--format", fmt, "-q").err
    put(project, 'severity = "error"\n')
    assert "; settings of " in validate(path, "--format", fmt, "-q").err
    (project / "pidcfg.toml").unlink()
    assert validate(path, "--format", fmt, "-q", "--ignore", "DL254").err == "", "the command line is seen"
    text = path.read_text("utf-8").replace("90}}", "90}}  # pidcfg: ignore[DL242] why")
    path.write_text(text, "utf-8")
    assert "; 2 ignored" in validate(path, "--format", fmt, "-q").err


def test_sarif_carries_what_is_suppressed_and_why(project, validate, monkeypatch):
    monkeypatch.chdir(project)
    path = project / "loops/a.yaml"
    path.write_text(path.read_text("utf-8").replace("90}}", "90}}  # pidcfg: ignore[DL254] the valve sticks"), "utf-8")
    assert validate("loops/a.yaml", "--baseline", "k.json", "--create-baseline").code == 0
    found = validate("loops/a.yaml", "--baseline", "k.json", "--format", "sarif")
    results = json.loads(found.out)["runs"][0]["results"]
    assert [(r["ruleId"], r["suppressions"]) for r in results] == [
        ("DL254", [{"kind": "inSource", "justification": "the valve sticks"}]),
        ("DL242", [{"kind": "external"}]),
        ("DL242", [{"kind": "external"}]),
    ]
    assert len({r["partialFingerprints"]["pidcfgFinding/v1"] for r in results}) == 3
    assert json.loads(validate("loops/a.yaml", "--baseline", "k.json", "--format", "json").out)["findings"] == []
    assert "suppressions" not in validate("loops/a.yaml", "--format", "sarif", "--ignore", "DL254").out


def test_files_are_left_out_from_the_folder_of_the_settings_file(project, validate, monkeypatch):
    put(project, 'exclude = ["/loops/old/", "*.yaml", "!c.yaml"]\n')
    (project / "loops/c.yaml").write_text(GOOD, "utf-8")
    monkeypatch.chdir(project / "loops")
    found = validate(".")
    assert (found.code, found.out) == (0, "")
    summary = "1 folder and 1 file left out (old, a.yaml); settings of ../pidcfg.toml\n"
    assert found.err.endswith(summary)
    assert validate(".", "-q").err.endswith(summary), "settings leave nothing out unseen"
    assert "left out: old/ (exclude of ../pidcfg.toml: /loops/old/)\n" in validate(".", "-v").err
    assert validate(".", "--isolated").code == 1
    assert validate("a.yaml").code == 1, "what is named is read"
    found = validate(".", "--exclude", "old/", "-q")
    assert found.code == 1, "the command line wins"
    assert found.err == ""
    shown = 'exclude = ["old/"]  # command line\n'
    assert shown in validate(".", "--exclude", "old/", "--show-settings").out
    put(project, 'exclude = ["*"]\n')
    found = validate(".", "-q")
    assert found.code == 2, "nothing to check is no success"
    assert (
        ". holds no .yaml or .yml file with a pidcfg key; 1 folder and 2 files left out (old, a.yaml, c.yaml)"
        in found.out
    )


def test_exclude_reaches_no_file_outside(project, validate):
    put(project, 'exclude = ["*"]\n')
    (project.parent / "others").mkdir()
    (project.parent / "others/b.yaml").write_text(GOOD, "utf-8")
    assert validate(project.parent / "others", "--config", project / "pidcfg.toml").code == 0


# --- Every option has an environment variable, which the command line outranks and a settings file does not -----------


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


def run_in(*words: str, **variables: str):
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
    command = load_command(name)
    options = [p for p in command.params if isinstance(p, click.Option) and not p.hidden]
    names = {option.envvar for option in options}
    assert len(names) == len(options)
    assert all(re.fullmatch(rf"PIDCFG_{name.upper()}_[A-Z_]+", found) for found in names - OF_THEIR_OWN)
    text = command.get_help(click.Context(command, info_name=name, terminal_width=400, max_content_width=400))
    assert set(re.findall(r"\[env var: (\w+)", text)) == names


def test_a_variable_is_called_as_the_option_is_not_as_the_code_calls_it():
    assert variable_of("validate", "--report-output") == "PIDCFG_VALIDATE_REPORT_OUTPUT"
    options = {
        option.name: option.envvar for option in load_command("simulate").params if isinstance(option, click.Option)
    }
    assert (options["fmt"], options["csv"]) == ("PIDCFG_SIMULATE_FORMAT", "PIDCFG_SIMULATE_TREND")
    assert [p.envvar for p in cli.params if p.name != "version"] == ["PIDCFG_COLOR"]
    assert [p.envvar for p in load_command("rule").params if p.name == "color"] == [None], "one variable for --color"


def test_a_variable_that_an_option_declares_is_the_one_that_counts(oven):
    options = {
        option.name: option.envvar for option in load_command("validate").params if isinstance(option, click.Option)
    }
    assert options["no_cache"] == "PIDCFG_NO_CACHE"


def test_no_variable_prints_the_version(oven):
    assert "checked" in run_in("validate", "oven.yaml", PIDCFG_VERSION="1").stderr


def test_the_command_line_outranks_the_environment_which_outranks_the_settings_file(oven):
    (oven / "pidcfg.toml").write_text('format = "concise"\nstrict = true\n', "utf-8")
    assert run_in("validate", "oven.yaml").stdout.startswith("oven.yaml:5:19: error DL201 the")
    assert run_in("validate", "oven.yaml", PIDCFG_VALIDATE_FORMAT="json").stdout.startswith("{")
    found = run_in("validate", "oven.yaml", "--format", "github", PIDCFG_VALIDATE_FORMAT="json")
    assert found.stdout.startswith("::error")
    shown = run_in("validate", "oven.yaml", "--show-settings", PIDCFG_VALIDATE_STRICT="0").stdout
    assert "strict = false  # PIDCFG_VALIDATE_STRICT\n" in shown
    assert 'format = "concise"  # pidcfg.toml\n' in shown


@pytest.mark.parametrize(("value", "code"), [("1", 1), ("true", 1), ("0", 0), ("no", 0), ("", 0)])
def test_a_switch_is_on_or_off(oven, value, code):
    shutil.copyfile(ROOT / "examples/dl06/reactor.yaml", oven / "oven.yaml")
    assert run_in("validate", "oven.yaml", PIDCFG_VALIDATE_STRICT=value).exit_code == code


def test_an_option_that_may_be_repeated_takes_its_values_separated_by_blanks(oven):
    run_in("validate", "oven.yaml", PIDCFG_VALIDATE_REPORT_OUTPUT="json=a.json sarif=b.sarif")
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
    assert run_in(*words, **{name: value}).exit_code == 2
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
    found = run_in("validate", "oven.yaml", "-q", PIDCFG_VALIDATE_STRCT="1", PIDCFG_SIMULATE_STRCT="1")
    note = "note: PIDCFG_VALIDATE_STRCT is no variable of pidcfg validate; did you mean PIDCFG_VALIDATE_STRICT?\n"
    assert found.stderr == note


def test_the_page_names_only_variables_that_exist():
    known = {str(p.envvar) for name in COMMANDS for p in load_command(name).params} | {"PIDCFG_COLOR"}
    assert set(re.findall(r"PIDCFG_[A-Z]+(?:_[A-Z]+)*", PAGE)) - {"PIDCFG_COMMAND_OPTION", MISSPELT} <= known
