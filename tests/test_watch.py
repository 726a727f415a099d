"""--watch: again when a file changes, however it is saved; the pauses are scripted, so nothing waits for a clock."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from pidcfg.cli import findings as collect
from pidcfg.cli import watch
from pidcfg.cli.main import cli

ROOT = Path(__file__).parents[1]
GOOD = (ROOT / "examples/dl06/reactor.yaml").read_text("utf-8")
BAD = GOOD.replace("gain: 0.80", "gain: 120")
SCENARIO = """\
pidcfg: 1
scenario: short
config: reactor.yaml
duration: 2
plants:
  FIC-102: {model: first_order, gain: 0.5, time_constant: 3, initial: 20}
  TIC-101: {model: first_order, input: FIC-102.PV, gain: 4.0, time_constant: 240, initial: 80}
  LIC-103: {model: integrator, gain: -0.02, load: 1.0, initial: 50}
expect: [{signal: TIC-101.PV, max: 200}]
"""


@pytest.fixture
def project(tmp_path, monkeypatch):
    (tmp_path / ".git").mkdir()
    Path(tmp_path / "reactor.yaml").write_text(GOOD, "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def watching(project, monkeypatch):
    """Runs a command; each pause does the next thing of a list, and Ctrl-C is pressed behind the last one."""

    def run(*words: str, doing=()):
        things = iter(doing)

        def pause(_seconds: float) -> None:
            thing = next(things, interrupt)
            thing()

        monkeypatch.setattr(watch.time, "sleep", pause)
        return CliRunner().invoke(cli, [*words, "--watch"])

    return run


def interrupt():
    raise KeyboardInterrupt


def nothing():
    pass


def write(name: str, text: str):
    """Saves in place, with a time of its own: a disk may keep times too coarsely."""

    def save():
        path = Path(name)
        path.write_text(text, "utf-8")
        write.at += 1_000_000_000
        os.utime(path, ns=(write.at, write.at))

    return save


write.at = 2_000_000_000_000_000_000


def move(old: str, new: str):
    return lambda: Path(old).replace(new)


def runs(result) -> list[str]:
    """What the runs said, one after the other, by the line that counts the findings of each."""
    return [line.split(": ", 1)[1] for line in result.stderr.splitlines() if " checked: " in line]


def test_a_change_is_checked_and_the_last_run_decides(watching):
    result = watching("validate", "reactor.yaml", doing=[nothing, write("reactor.yaml", BAD), nothing])
    assert [line.partition(",")[0] for line in runs(result)] == ["0 errors", "1 error"]
    assert result.exit_code == 1
    assert "changed: reactor.yaml\n" in result.stderr
    assert result.stderr.endswith("stopped; the last run ended with exit code 1\n")


def test_without_a_change_there_is_one_run(watching):
    result = watching("validate", "reactor.yaml", doing=[nothing] * 5)
    assert len(runs(result)) == 1
    assert result.exit_code == 0
    assert "watching 1 file; Ctrl-C ends\n" in result.stderr


def test_a_save_in_several_steps_is_one_change(watching):
    """An editor that writes twice: the first half is never checked."""
    doing = [write("reactor.yaml", GOOD[:300]), write("reactor.yaml", GOOD[:400]), write("reactor.yaml", BAD), nothing]
    assert [line.partition(",")[0] for line in runs(watching("validate", "reactor.yaml", doing=doing))] == [
        "0 errors",
        "1 error",
    ]


def test_a_save_by_renaming_is_one_change_and_the_file_is_never_reported_missing(watching, project):
    write("new~", BAD)()
    doing = [move("reactor.yaml", "old~"), nothing, nothing, move("new~", "reactor.yaml"), nothing]
    result = watching("validate", "reactor.yaml", doing=doing)
    assert "PID040" not in result.stdout
    assert [line.partition(",")[0] for line in runs(result)] == ["0 errors", "1 error"]


def test_a_file_that_stays_away_is_reported_and_found_again(watching, monkeypatch):
    monkeypatch.setattr(watch, "RENAME_SECONDS", 0.0)
    doing = [move("reactor.yaml", "old~"), nothing, nothing, move("old~", "reactor.yaml"), nothing]
    result = watching("validate", "reactor.yaml", doing=doing)
    assert "error PID040" in result.stdout
    assert len(runs(result)) == 3
    assert result.exit_code == 0


def test_a_change_shows_in_time_size_or_file_alone(watching, project):
    """The disk may keep times coarsely, and a new text may be as long as the old one."""

    def same_time():
        before = Path("reactor.yaml").stat()
        Path("new").write_text(GOOD.replace("0.80", "0.90"), "utf-8")
        os.utime("new", ns=(before.st_atime_ns, before.st_mtime_ns))
        Path("new").replace("reactor.yaml")

    assert len(runs(watching("validate", "reactor.yaml", doing=[same_time, nothing]))) == 2
    assert len(runs(watching("validate", "reactor.yaml", doing=[write("reactor.yaml", GOOD), nothing]))) == 2


def test_a_baseline_and_named_settings_are_watched(watching, project):
    write("reactor.yaml", BAD)()
    write("other.toml", "")()
    CliRunner().invoke(cli, ["validate", "reactor.yaml", "--baseline", "known", "--create-baseline"])
    text = (project / "known").read_text("utf-8")
    doing = [write("known", text.replace("PID101", "PID102")), nothing]
    doing += [write("other.toml", 'ignore = ["PID101"]\n'), nothing]
    result = watching("validate", "reactor.yaml", "--baseline", "known", "--config", "other.toml", doing=doing)
    assert [line[0] for line in runs(result)] == ["0", "1", "0"]


def test_hidden_folders_are_left_alone(watching, project):
    (project / ".cache").mkdir()
    assert len(runs(watching("validate", ".", doing=[write(".cache/x.yaml", BAD), nothing]))) == 1


def test_a_terminal_is_cleared_for_each_run_but_the_first(watching, monkeypatch):
    cleared = []
    monkeypatch.setattr(watch.click, "clear", lambda: cleared.append(1))
    doing = [write("reactor.yaml", BAD), nothing]
    watching("validate", "reactor.yaml", doing=doing)
    assert not cleared
    monkeypatch.setattr(watch.terminal, "is_terminal", lambda _stream: True)
    watching(
        "validate", "reactor.yaml", doing=[write("reactor.yaml", GOOD), nothing, write("reactor.yaml", BAD), nothing]
    )
    assert cleared == [1, 1]


def test_a_new_file_of_a_folder_is_checked(watching):
    result = watching("validate", ".", doing=[write("other.yaml", BAD), nothing])
    assert [line[0] for line in runs(result)] == ["0", "1"]
    assert "changed: other.yaml" in result.stderr


def test_settings_are_read_anew_and_wrong_ones_end_nothing(watching):
    doing = [
        *(write("reactor.yaml", BAD), nothing),
        *(write("pidcfg.toml", "bad = 1\n"), nothing),
        *(write("pidcfg.toml", 'ignore = ["PID1"]\n'), nothing),
    ]
    result = watching("validate", "reactor.yaml", doing=doing)
    assert "Error: pidcfg.toml:1:1: unknown key 'bad'" in result.stderr
    assert [line[0] for line in runs(result)] == ["0", "1", "0"]
    assert result.exit_code == 0


def test_what_a_scenario_names_is_watched_also_while_it_is_missing(watching, project):
    (project / "short.scenario.yaml").write_text(SCENARIO, "utf-8")
    Path("reactor.yaml").rename("later")
    doing = [nothing, move("later", "reactor.yaml"), nothing, write("reactor.yaml", BAD), nothing]
    result = watching("simulate", "short.scenario.yaml", doing=doing)
    assert result.stderr.count("changed: reactor.yaml") == 2
    assert result.stdout.count("reactor.yaml: No such file") == 1
    assert "(1 of 1 expectations passed)" in result.stdout
    assert "gain is 120 %/%" in result.stdout
    assert result.exit_code == 2, "the last run could not use the configuration"


def test_a_quiet_run_says_nothing_of_watching_and_no_run_writes_terminal_codes(watching):
    doing = [write("reactor.yaml", BAD), nothing]
    result = watching("validate", "reactor.yaml", "-q", "--severity", "error", doing=doing)
    assert result.stderr == "stopped; the last run ended with exit code 1\n"
    assert "\x1b" not in result.output


def test_ctrl_c_within_the_first_run_is_no_verdict(watching, monkeypatch):
    monkeypatch.setattr("pidcfg.cli.findings.check_input", lambda *_: interrupt())
    result = watching("validate", "reactor.yaml")
    assert (result.exit_code, result.stderr) == (130, "interrupted\n")


def test_a_run_knows_nothing_of_the_files_that_an_earlier_one_read(watching, project):
    """A file number that an editor has set free may become that of a report."""

    def reuse():
        Path("reactor.yaml").replace("found.json")
        write("reactor.yaml", BAD)()

    doing = [reuse, nothing]
    result = watching("validate", "reactor.yaml", "--report-output", "json=found.json", doing=doing)
    assert "another name" not in result.stderr
    assert len(runs(result)) == 2
    assert '"PID101"' in (project / "found.json").read_text("utf-8")


def test_a_change_while_a_run_lasts_is_not_lost(watching, monkeypatch):
    save, check = write("reactor.yaml", BAD), collect.check_input

    def slow(*arguments):
        save()
        return check(*arguments)

    monkeypatch.setattr(collect, "check_input", slow)
    assert [line[0] for line in runs(watching("validate", "reactor.yaml", doing=[nothing]))][:2] == ["0", "1"]


@pytest.mark.parametrize("words", [["-"], ["reactor.yaml", "--fix"], ["reactor.yaml", "--diff"]])
def test_what_cannot_be_watched_is_refused(watching, words):
    result = watching("validate", *words)
    assert result.exit_code == 2
    assert "--watch" in result.stderr


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no signal to one process")
def test_ctrl_c_in_a_process_ends_with_a_clean_line(project, heeding_interrupts):
    command = [sys.executable, "-m", "pidcfg", "validate", "reactor.yaml", "--watch"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, env=environment
    ) as run:
        while "watching" not in run.stderr.readline():
            assert run.poll() is None
        run.send_signal(signal.SIGINT)
        assert run.stderr.read() == "stopped; the last run ended with exit code 0\n"
        assert run.wait() == 0


def test_a_folder_that_is_not_there_is_refused_at_once(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("missing/", "missing/x.yaml"):
        result = CliRunner().invoke(cli, ["validate", name, "--watch"])
        assert (result.exit_code, "there is no folder missing" in result.output) == (2, True)


def test_what_is_left_out_is_not_watched_until_it_is_taken_back(watching, project):
    for name in ("node_modules/a.yaml", "old/b.yaml", "ignored/c.yaml"):
        (project / name).parent.mkdir()
        (project / name).write_text(GOOD, "utf-8")
    (project / ".gitignore").write_text("ignored/\n", "utf-8")
    changes = [write(name, BAD) for name in ("node_modules/a.yaml", "old/b.yaml", "ignored/c.yaml")]
    doing = [*changes, write("pidcfg.toml", "exclude = []\n"), *[nothing] * 2, write(".gitignore", ""), *[nothing] * 2]
    (project / "pidcfg.toml").write_text('exclude = ["old/"]\n', "utf-8")
    found = runs(watching("validate", ".", doing=doing))
    assert [line.partition(",")[0] for line in found] == ["0 errors", "1 error", "2 errors"]
    assert ["3 folders left out" in found[0], "2 folders left out" in found[1], "1 folder left out" in found[2]] == [
        True
    ] * 3
