"""What is written takes the place of no input and of no other output, goes through links, and comes whole or not."""

from __future__ import annotations

import io
import os
import struct
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from pidcfg.cli import outputs
from pidcfg.cli import settings as settings_file
from pidcfg.cli.commands import rule
from pidcfg.cli.console import echo_xml
from pidcfg.cli.main import COMMANDS, Exit, cli, load_command
from pidcfg.output.report import cell_text
from pidcfg.output.report.formats import Table, csv_text
from pidcfg.output.report.formats import measured_number as on_page
from pidcfg.output.reporting import shortener

EXAMPLES = Path(__file__).parents[1] / "examples"
SCENARIO = """
pidcfg: 1
scenario: A short look
config: CONFIG
duration: 20 s
plants:
  TIC-201: {model: first_order, gain: 11, load: 25, time_constant: 600, dead_time: 2, initial: 25}
"""
POSIX = pytest.mark.skipif(os.name != "posix", reason="pipes with names, links and rights of files are POSIX's")


def run(*args, **kwargs):
    """A command in this process."""
    return CliRunner().invoke(cli, args, catch_exceptions=False, **kwargs)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An oven, a memory listing of it, and a scenario for each, as the working folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(click.ClickException, "exit_code", int(Exit.UNUSABLE))  # as `main` ends
    Path("oven.yaml").write_bytes((EXAMPLES / "dl06/oven.yaml").read_bytes())
    assert run("encode", "oven.yaml", "--format", "csv", "-o", "words.csv").exit_code == 0
    Path("s.yaml").write_text(SCENARIO.replace("CONFIG", "oven.yaml"), "utf-8")
    Path("l.yaml").write_text(SCENARIO.replace("CONFIG", "words.csv"), "utf-8")
    return tmp_path


def state(folder):
    """Everything in a folder with its contents."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@pytest.mark.parametrize(
    "words",
    [
        ("encode", "oven.yaml"),
        ("convert", "oven.yaml", "--to", "generic", "--allow-loss"),
        ("decode", "words.csv", "--vendor", "dl06"),
        ("export", "oven.yaml"),
        ("init", "--vendor", "click"),
        ("schema", "dl06"),
    ],
)
def test_a_dash_is_standard_output(folder, words):
    before = state(folder)
    printed = run(*words, "-o", "-")
    assert (printed.exit_code, printed.stdout) == (0, run(*words).stdout)
    assert printed.stdout
    assert state(folder) == before


@pytest.mark.parametrize(
    "words",
    [
        ("certify", "s.yaml", "--resume", "-"),
        ("simulate", "s.yaml", "--trend", "-"),
        ("report", "oven.yaml", "--tables", "-"),
        ("report", "oven.yaml", "--xlsx", "-"),
        ("validate", "oven.yaml", "--create-baseline", "--baseline", "-"),
        ("validate", "oven.yaml", "--report-output", "json=-"),
    ],
)
def test_a_dash_is_no_file_where_only_a_file_will_do(folder, words):
    before = sorted(folder.iterdir())
    result = run(*words)
    assert result.exit_code == Exit.UNUSABLE
    assert "Error: Invalid value for" in result.stderr
    assert result.stdout == ""
    assert sorted(folder.iterdir()) == before


# --- inputs ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "args",
    [
        ("simulate", "s.yaml", "--csv", "s.yaml"),
        ("simulate", "s.yaml", "--csv", "oven.yaml"),
        ("simulate", "l.yaml", "--csv", "words.csv"),
        ("simulate", "s.yaml", "--csv", "link"),
        ("simulate", "l.yaml", "--output", "json=words.csv"),
        ("simulate", "page.svg", "--plot", "page.svg"),
        ("report", "l.yaml", "--csv", "."),
        ("convert", "oven.yaml", "--to", "click", "--allow-loss", "-o", "oven.yaml"),
        ("convert", "oven.yaml", "--to", "click", "--allow-loss", "-o", "link"),
        ("decode", "words.csv", "--vendor", "dl06", "-o", "words.csv"),
        ("decode", "words.csv", "--vendor", "dl06", "-o", "./hard"),
        ("encode", "oven.yaml", "-o", "oven.yaml"),
        ("encode", "oven.yaml", "-o", "./link"),
        ("diff", "oven.yaml", "words.csv", "--output", "text=words.csv"),
    ],
)
@POSIX
def test_force_never_replaces_a_file_that_the_run_reads(folder, args):
    Path("link").symlink_to("s.yaml" if args[0] == "simulate" else "oven.yaml")
    Path("hard").hardlink_to("words.csv")
    Path("page.svg").write_bytes(Path("s.yaml").read_bytes())
    before = state(folder)
    force = ["--force"] if not (args[0] == "diff" or "--output" in args) else []
    result = run(*args, *force)
    assert (result.exit_code, "is a file that is read; give the" in " ".join(result.stderr.split())) == (2, True)
    assert state(folder) == before


def test_the_input_of_a_redirection_is_an_input(folder):
    code = "from pidcfg.cli.main import main; main()"
    before = state(folder)
    with Path("words.csv").open("rb") as stream:
        result = subprocess.run(
            [sys.executable, "-c", code, "decode", "-", "--vendor", "dl06", "-o", "words.csv", "--force"],
            stdin=stream,
            capture_output=True,
            check=False,
        )
    assert (result.returncode, b"words.csv is a file that is read" in result.stderr) == (2, True)
    assert state(folder) == before


def test_what_one_run_has_read_the_next_may_write(folder):
    assert run("encode", "oven.yaml", "-o", "image").exit_code == 0
    assert run("decode", "image", "--vendor", "dl06", "-o", "back.yaml").exit_code == 0
    assert run("encode", "oven.yaml", "--format", "json", "-o", "image", "--force").exit_code == 0


# --- outputs among each other ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "args",
    [
        ("simulate", "s.yaml", "--plot", "a.svg", "--output", "junit=a.svg"),
        ("simulate", "s.yaml", "--plot", "a.svg", "--csv", "a.svg"),
        ("simulate", "s.yaml", "--plot", "a.svg", "--plot", "./a.svg"),
        ("simulate", "s.yaml", "--plot", "a.svg", "--plot", "later.svg"),
        ("diff", "oven.yaml", "words.csv", "--plot", "a.svg", "--output", "json=a.svg"),
        ("convert", "oven.yaml", "--to", "click", "--allow-loss", "-o", "a.svg", "--plot", "a.svg"),
        ("convert", "oven.yaml", "--to", "click", "--allow-loss", "--plot", "a.svg", "--report-output", "json=a.svg"),
    ],
)
@POSIX
def test_two_outputs_never_share_a_file(folder, args):
    Path("later.svg").symlink_to("a.svg")
    result = run(*args)
    assert (result.exit_code, result.stdout) == (2, ""), "before anything runs"
    assert "are one file; name two" in " ".join(result.stderr.split())
    assert not Path("a.svg").exists()


@POSIX
def test_files_that_a_command_names_itself_never_share_one(folder):
    Path("page.html").write_text("", "utf-8")
    Path("out").mkdir()
    Path("out/words.csv").symlink_to("../page.html")
    result = run("report", "oven.yaml", "--csv", "out", "-o", "page.html", "--force")
    assert (result.exit_code, "are one file; name two" in result.stderr) == (2, True)
    assert Path("page.html").read_text("utf-8") == ""


# --- the trend -------------------------------------------------------------------------------------------------------


@POSIX
def test_a_trend_is_written_as_every_other_file(folder):
    Path("real.csv").write_text("old", "utf-8")
    Path("real.csv").chmod(0o640)
    Path("t.csv").symlink_to("real.csv")
    assert run("simulate", "s.yaml", "--csv", "t.csv").exit_code == 2
    assert Path("real.csv").read_text("utf-8") == "old"
    assert run("simulate", "s.yaml", "--csv", "t.csv", "--force").exit_code == 0
    assert Path("t.csv").is_symlink()
    assert Path("real.csv").read_text("utf-8").startswith("time")
    assert Path("real.csv").stat().st_mode & 0o777 == 0o640
    assert run("simulate", "s.yaml", "--csv", "t.csv").exit_code == 0, "the same bytes may be written again"
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


@POSIX
def test_a_trend_never_takes_the_place_of_a_pipe(folder):
    os.mkfifo("pipe")
    result = run("simulate", "s.yaml", "--csv", "pipe", "--force")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "pipe is no regular file" in result.stderr
    assert Path("pipe").is_fifo()
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


# --- all or none -----------------------------------------------------------------------------------------------------


@pytest.fixture
def locked(monkeypatch):
    """Names of files that cannot be replaced, as one that a program holds open on Windows."""
    names = set()
    real = Path.replace

    def replace(self, target):
        if Path(target).name in names:
            raise PermissionError(13, "Permission denied")
        return real(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    return names


@pytest.mark.parametrize("links", [True, False])
def test_when_one_file_cannot_be_put_in_place_all_keep_their_contents(tmp_path, monkeypatch, locked, links):
    def refused(*args):
        raise OSError(1, "no links here")

    if not links:
        monkeypatch.setattr(os, "link", refused)
    monkeypatch.chdir(tmp_path)
    Path("a").write_text("old a", "utf-8")
    Path("c").write_text("old c", "utf-8")
    locked.add("c")
    with pytest.raises(click.ClickException, match=r"^cannot write c: Permission denied$"):
        outputs.write_files({"a": "new", "b": "new", "c": "new"}, force=True)
    assert state(tmp_path) == {"a": b"old a", "c": b"old c"}
    locked.clear()
    outputs.write_files({"a": "new", "b": "new", "c": "new"}, force=True)
    assert state(tmp_path) == dict.fromkeys("abc", b"new")


def test_what_cannot_be_taken_back_is_named(tmp_path, monkeypatch, locked):
    def refused(self, *, missing_ok=False):
        if self.name == "a":
            raise PermissionError(13, "Permission denied")
        real(self, missing_ok=missing_ok)

    real = Path.unlink
    monkeypatch.setattr(Path, "unlink", refused)
    monkeypatch.chdir(tmp_path)
    locked.add("b")
    with pytest.raises(click.ClickException, match="cannot write b: Permission denied; a is written all the same"):
        outputs.write_files({"a": "new", "b": "new"})
    assert state(tmp_path) == {"a": b"new"}


@pytest.mark.parametrize("there", ["", "new"])
def test_a_report_that_fails_leaves_no_folder_that_it_made(folder, there):
    if there:
        Path(there).mkdir()
    result = run("report", "oven.yaml", "--csv", "new/deep/er", "-o", "none/x.html")
    assert (result.exit_code, "cannot write none/x.html" in result.stderr) == (2, True)
    assert Path("new").exists() is bool(there)
    assert not Path("new/deep").exists()
    assert run("report", "oven.yaml", "--csv", "new/deep/er").exit_code == 0
    assert Path("new/deep/er/words.csv").exists()


# --- readers that go away --------------------------------------------------------------------------------------------


def unread(*args, both=False):
    """A command whose standard output (``both``: and error) nobody reads: its exit code and what it says."""
    reader, writer = os.pipe()
    os.close(reader)
    error = writer if both else subprocess.PIPE
    try:
        command = [sys.executable, "-m", "pidcfg", *args]
        result = subprocess.run(command, stdout=writer, stderr=error, check=False)
    finally:
        os.close(writer)
    return result.returncode, (result.stderr or b"").decode()


@pytest.mark.parametrize(
    ("args", "code"),
    [
        (("encode", "oven.yaml"), Exit.OK),
        (("rule",), Exit.OK),
        (("schema", "dl06"), Exit.OK),
        (("init", "--vendor", "dl06"), Exit.OK),
        (("--help",), Exit.OK),
        (("--version",), Exit.OK),
        (("encode", "--help"), Exit.OK),
        (("validate", "bad.yaml", "--quiet"), Exit.FINDINGS),
        (("encode", "absent.yaml"), Exit.UNUSABLE),
    ],
)
@POSIX
def test_a_reader_that_goes_away_changes_no_exit_code(folder, args, code):
    Path("bad.yaml").write_text(Path("oven.yaml").read_text("utf-8").replace("V2000", "V1177"), "utf-8")
    found, said = unread(*args)
    assert (found, "Traceback" in said, "BrokenPipe" in said) == (code, False, False)
    assert unread(*args, both=True)[0] == code


def test_a_command_that_is_cut_off_does_not_look_fine(monkeypatch):
    def cut():
        raise BrokenPipeError(32, "Broken pipe")

    monkeypatch.setattr("sys.argv", ["pidcfg", "rule"])
    monkeypatch.setattr("pidcfg.cli.main._drop_stdout", lambda: None)
    monkeypatch.setattr(rule.command, "callback", lambda **_: cut())
    assert CliRunner().invoke(cli, ["rule"], standalone_mode=False).return_value == Exit.FINDINGS


@POSIX
def test_reports_are_written_although_nobody_reads_the_result(folder):
    assert unread("validate", "oven.yaml", "--output", "junit=j.xml", "--format", "json")[0] == Exit.OK
    assert "<testsuites" in Path("j.xml").read_text("utf-8")
    assert unread("simulate", "s.yaml", "--csv", "t.csv", "--output", "json=r.json")[0] == Exit.OK
    assert Path("t.csv").exists()
    assert Path("r.json").exists()


# --- code pages, drives, digits --------------------------------------------------------------------------------------


@pytest.mark.parametrize("encoding", ["latin-1", "cp437"])
def test_a_page_on_standard_output_is_what_it_says_it_is(folder, monkeypatch, encoding):
    assert run("report", "oven.yaml", "-o", "page.html", "--title", "Öfen → Ω").exit_code == 0
    page = Path("page.html").read_text("utf-8")
    style = "".join(part.partition("</style>")[0] for part in page.split("<style>")[1:])
    assert style.isascii(), "no reference is understood in there"
    stream = io.TextIOWrapper(io.BytesIO(), encoding)
    monkeypatch.setattr(sys, "stdout", stream)
    echo_xml(page)
    stream.flush()
    data = stream.buffer.getvalue()
    assert data.isascii()
    assert b"&#214;fen &#8594; &#937;" in data


def test_a_page_goes_to_standard_output_in_references(folder):
    options = ["-o", "-", "--title", "Öfen"]
    result = subprocess.run(
        [sys.executable, "-m", "pidcfg", "report", "oven.yaml", *options],
        capture_output=True,
        check=False,
        env={**os.environ, "PYTHONUTF8": "0", "PYTHONIOENCODING": "latin-1"},
    )
    assert result.stdout.isascii()
    assert b"<title>&#214;fen" in result.stdout


def two_drives(*args):
    """What Windows says of paths on two drives."""
    raise ValueError("path is on mount 'C:', start on mount 'D:'")


def test_files_on_two_drives_keep_their_names_in_a_report(tmp_path, monkeypatch):
    names = [str(tmp_path / "a/x.yaml"), str(tmp_path / "b/y.yaml")]
    assert [shortener(names)(name) for name in names] == ["a/x.yaml", "b/y.yaml"]
    monkeypatch.setattr(os.path, "commonpath", two_drives)
    assert [shortener(names)(name) for name in names] == [Path(name).as_posix() for name in names]


def test_a_baseline_on_another_drive_keeps_its_path(tmp_path, monkeypatch):
    text_ = '[tool]\nbaseline = "known.json"\n'
    monkeypatch.chdir(tmp_path)
    table = {"baseline": "known.json"}
    assert settings_file.check_table(table, "f", text_, "", tmp_path) == {"baseline": "known.json"}
    monkeypatch.setattr(os.path, "relpath", two_drives)
    found = settings_file.check_table(table, "f", text_, "", tmp_path)
    assert found == {"baseline": (tmp_path / "known.json").as_posix()}


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (1234.5678, "1234.5678"),
        (1234567.8, "1234567.8"),
        (0.1, "0.1"),
        (50.0, "50"),
        (1e-05, "0.00001"),
        (123456789012345.0, "123456789012345"),
        (1e16, "1e+16"),
        (3.4028235e38, "3.4028235e+38"),
        (1e-20, "1e-20"),
        (float("inf"), "inf"),
        (0.0, "0"),
        (-2.5, "-2.5"),
        (True, "true"),
        (7, "7"),
    ],
)
def test_numbers_keep_their_digits_in_reports(value, shown):
    assert cell_text(value) == shown
    assert csv_text(Table("t", "T", ("V",), ((value,),))).splitlines()[1] == shown


@pytest.mark.parametrize(
    ("value", "shown"), [(12.3456789, "12.346"), (1234567.8, "1.2346×10⁶"), (999999.6, "1000000"), (None, "–")]
)
def test_measured_numbers_have_engineering_digits(value, shown):
    assert on_page(value) == shown


def test_a_word_stands_beside_its_hexadecimal_with_all_digits(folder):
    config = (EXAMPLES / "click/tank.yaml").read_text("utf-8").replace("value: 140,", "value: 140.1234,")
    Path("tank.yaml").write_text(config, "utf-8")
    assert run("report", "tank.yaml", "-o", "page.html", "--exit-zero", "--full").exit_code == 0
    page = Path("page.html").read_text("utf-8")
    assert (
        f'hex">{struct.unpack(">I", struct.pack(">f", 140.1234))[0]:08X}</td><td class="num decimal">140.1234<' in page
    )


# --- one meaning for an option ----------------------------------------------------------------------------------------

SPELLINGS = {
    ("validate", "oven.yaml"): ("--report-output", "--output", "json={}"),
    ("diff", "oven.yaml", "oven.yaml"): ("--report-output", "--output", "json={}"),
    ("simulate", "s.yaml"): ("--report-output", "--output", "json={}"),
    ("simulate", "s.yaml", "--every", "3"): ("--trend", "--csv", "{}"),
}


@pytest.mark.parametrize(("command", "options"), SPELLINGS.items(), ids=" ".join)
def test_an_older_spelling_writes_the_same(command, options, folder):
    new, old, value = options
    for option, name in ((new, "new.out"), (old, "old.out")):
        assert run(*command, option, value.format(name)).exit_code in {Exit.OK, Exit.FINDINGS}
    assert (folder / "new.out").read_bytes() == (folder / "old.out").read_bytes() != b""


def test_an_older_spelling_writes_the_same_tables(folder):
    run("report", "oven.yaml", "--tables", "new")
    run("report", "oven.yaml", "--csv", "old")
    written = {path.name: path.read_bytes() for path in (folder / "new").iterdir()}
    assert written == {path.name: path.read_bytes() for path in (folder / "old").iterdir()} != {}


def test_output_is_the_result_itself_and_report_output_what_was_found():
    for name in COMMANDS:
        for param in load_command(name).params:
            if "--output" in param.opts and "--report-output" not in param.opts:
                assert "-o" in param.opts, name
            assert "--csv" not in param.opts or len(param.opts) == 2, name


# --- --exit-zero ------------------------------------------------------------------------------------------------------

JUDGED = {
    # a command that ends with 1, and the same with what cannot be used
    ("validate", "oven.yaml", "--strict"): ("validate", "nothing.yaml"),
    ("simulate", "fails.yaml"): ("simulate", "nothing.yaml"),
    ("certify", "fails.yaml", "--samples", "1", "--jobs", "1"): ("certify", "nothing.yaml"),
    ("diff", "oven.yaml", "other.yaml", "--exit-code"): ("diff", "oven.yaml", "nothing.yaml"),
    ("convert", "oven.yaml", "--to", "ezlogix"): ("convert", "nothing.yaml", "--to", "click"),
    ("report", "fails.yaml", "-o", "r.html"): ("report", "nothing.yaml", "-o", "r.html"),
}


@pytest.mark.parametrize(("red", "unusable"), JUDGED.items(), ids=lambda words: words[0])
def test_exit_zero_leaves_a_verdict_without_consequence_and_what_cannot_be_used_with_it(red, unusable, folder):
    Path("other.yaml").write_text(Path("oven.yaml").read_text("utf-8").replace("gain: 12.0", "gain: 13.0"), "utf-8")
    vary = "expect: [{signal: TIC-201.PV, max: 1}]\nvary: {plants: {TIC-201: {gain: ±10 %}}}\n"
    Path("fails.yaml").write_text(SCENARIO.replace("CONFIG", "oven.yaml") + vary, "utf-8")
    before = run(*red)
    assert before.exit_code == Exit.FINDINGS, before.output
    after = run(*red, "--exit-zero", *(["--force"] if red[0] == "report" else []))
    assert (after.exit_code, after.stdout) == (Exit.OK, before.stdout)
    assert run(*unusable, "--exit-zero").exit_code == Exit.UNUSABLE


def test_every_command_that_judges_takes_exit_zero():
    takes = {name for name in COMMANDS if any("--exit-zero" in param.opts for param in load_command(name).params)}
    assert takes == {words[0] for words in JUDGED} | {"compare"}
