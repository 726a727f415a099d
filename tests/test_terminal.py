"""What a terminal shows: colour where it is wanted, progress that goes away, and text for every code page."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from pidcfg.cli import console
from pidcfg.cli import terminal as colour
from pidcfg.cli import terminal as glyphs
from pidcfg.cli import terminal as progress
from pidcfg.cli.main import COMMANDS, cli
from pidcfg.vendors import VENDORS

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted(path for path in (ROOT / "examples").rglob("*.yaml") if not path.name.endswith(".scenario.yaml"))
MISTAKES = str(ROOT / "examples/mistakes/oven.yaml")
REACTOR = str(ROOT / "examples/dl06/reactor.yaml")
ESCAPE = re.compile("\x1b\\[[0-9;]*m")


# --- colour ----------------------------------------------------------------------------------------------------------


class Stream(io.StringIO):
    """A stream that is a terminal or not."""

    def __init__(self, *, terminal: bool) -> None:
        super().__init__()
        self.terminal = terminal

    def isatty(self) -> bool:
        return self.terminal


@pytest.mark.parametrize(
    ("environment", "terminal", "coloured"),
    [
        ({}, True, True),
        ({}, False, False),
        ({"TERM": "dumb"}, True, False),
        ({"NO_COLOR": "1"}, True, False),
        ({"NO_COLOR": ""}, True, True),
        ({"NO_COLOR": "1", "FORCE_COLOR": "1"}, True, False),
        ({"FORCE_COLOR": "1"}, False, True),
        ({"FORCE_COLOR": "1", "TERM": "dumb"}, False, True),
        ({"FORCE_COLOR": "0"}, False, False),
        ({"CLICOLOR_FORCE": "1"}, False, True),
    ],
)
def test_who_decides_about_colour(environment, terminal, coloured, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert colour.is_coloured(Stream(terminal=terminal)) is coloured


@pytest.mark.parametrize(
    ("options", "environment", "coloured"),
    [
        (["--color", "always", "validate"], {"NO_COLOR": "1"}, True),
        (["validate", "--color", "always"], {}, True),
        (["--color", "never", "validate"], {"FORCE_COLOR": "1"}, False),
        (["validate", "--color=never"], {"FORCE_COLOR": "1"}, False),
        (["--color", "auto", "validate"], {"FORCE_COLOR": "1"}, True),
        (["validate"], {}, False),
    ],
)
def test_the_option_outranks_the_environment_on_either_side_of_the_command(options, environment, coloured):
    result = CliRunner(env=environment).invoke(cli, [*options, MISTAKES], color=True)
    assert ("\x1b[" in result.stdout) is coloured


def drawn(text: str) -> dict[str, str]:
    """The coloured pieces of a text and how they are drawn."""
    found = re.findall("((?:\x1b\\[[0-9;]+m)+)([^\x1b]+)\x1b\\[0m", text)
    return {piece: "".join(re.findall(r"\d+", codes)) for codes, piece in found}


FINDING = """\
oven.yaml:5:19: {severity} DL201: the table starts wrong
    5 | plc: {{loop_table: V7350}}
      |                   ^^^^^
      = cure: move it
"""


@pytest.mark.parametrize(("severity", "code"), [("error", "311"), ("warning", "331"), ("info", "361")])
def test_a_finding_wears_the_colour_of_its_severity(severity, code):
    text = FINDING.format(severity=severity)
    found = drawn(colour.paint_report(text))
    assert {found[piece] for piece in (severity, "DL201", "^^^^^")} == {code}
    assert found["oven.yaml:5:19:"] == "1"
    assert {"    5 |", "= cure:"} <= set(found)


@pytest.mark.parametrize(
    ("line", "pieces"),
    [
        ("PID101  error    value-out-of-range  A number", {"PID101", "error", "value-out-of-range"}),
        ("3 files checked: 2 errors, 0 warnings, 1 infos", {"2 errors"}),
        ("3 files checked: 0 errors, 2 warnings, 1 infos", {"2 warnings"}),
        ("  passed  TIC-101 overshoot: 4", {"passed"}),
        ("      FAILED      0 %       0 %     all  TIC-21.PV at most 6.6", {"FAILED"}),
        ("  NOT PROVEN  96.66 %   89.87 %    90 %  TIC-21.PV at most 7.9", {"NOT PROVEN"}),
        ("FAILED: 1 of 2 expectations", {"FAILED:"}),
        ("  120 s  TIC-101  alarm pv_high, until 206 s", {"alarm pv_high"}),
        ("  high      tuning.gain: 1 -> 4", {"high"}),
        ("TIC-101: removed", {"TIC-101", "removed"}),
        (" !dropped  pv.transfer: slot 1", {"dropped"}),
        ("Error: no such file", {"Error:"}),
        ("    7 | oven.yaml:5:19: error DL201: quoted", {"    7 |"}),
        ("an error DL201 in a sentence", set()),
    ],
)
def test_what_stands_out(line, pieces):
    assert set(drawn(colour.paint_report(line))) == pieces


@pytest.mark.parametrize(
    "arguments",
    [
        ["validate", MISTAKES],
        ["validate", MISTAKES, "--format", "concise"],
        ["rule", "DL2"],
        ["diff", REACTOR, MISTAKES.replace("mistakes", "dl06")],
    ],
)
def test_colour_adds_nothing_but_colour(arguments):
    plain = CliRunner().invoke(cli, arguments)
    painted = CliRunner().invoke(cli, ["--color", "always", *arguments], color=True)
    assert "\x1b[" in painted.stdout
    assert ESCAPE.sub("", painted.stdout) == plain.stdout
    assert painted.exit_code == plain.exit_code


@pytest.mark.parametrize(
    "arguments",
    [
        *(["validate", MISTAKES, "--format", fmt] for fmt in ("json", "sarif", "github", "gitlab", "junit")),
        ["encode", REACTOR],
        ["convert", REACTOR, "--to", "generic", "--allow-loss"],
        ["diff", REACTOR, MISTAKES.replace("mistakes", "dl06"), "--format", "markdown"],
        ["init", "--vendor", "dl06"],
        ["schema", "dl06"],
        ["completion", "bash"],
    ],
)
def test_files_and_formats_of_programs_are_never_coloured(arguments):
    result = CliRunner(env={"FORCE_COLOR": "1"}).invoke(cli, arguments, color=True)
    assert result.stdout
    assert "\x1b" not in result.stdout


def test_a_page_is_formatted_where_colour_is_wanted():
    plain = CliRunner().invoke(cli, ["rule", "DL242"]).stdout
    formatted = CliRunner(env={"FORCE_COLOR": "1"}).invoke(cli, ["rule", "DL242"], color=True).stdout
    assert plain.startswith("# DL242")
    assert "\x1b[1" in formatted
    assert "# DL242" not in formatted


# --- progress --------------------------------------------------------------------------------------------------------

WORK = """
import sys, threading, time
from pidcfg.cli import terminal as progress
from pidcfg.cli.console import echo, write_note
progress.DELAY_SECONDS = 0
{before}
progress.LINE.begin()
for _ in progress.progress(range(3), "counting", 3):
    while {waits} and progress.LINE._bar is None:
        time.sleep(0.01)
{after}
"""


def on_a_terminal(
    before: str = "", after: str = "progress.LINE.end()", *, waits: bool = True, **environment: str
) -> str:
    """What a terminal gets from a program that works."""
    pty = pytest.importorskip("pty", reason="terminals of POSIX")
    ours, theirs = pty.openpty()
    code = WORK.format(before=before, after=after, waits=waits)
    variables = {**os.environ, "TERM": "xterm", "PYTHONPATH": str(ROOT / "src"), **environment}
    process = subprocess.Popen([sys.executable, "-c", code], stdout=theirs, stderr=theirs, env=variables)
    os.close(theirs)
    found = b""
    try:
        while chunk := os.read(ours, 4096):
            found += chunk
    except OSError:  # Linux says so when the other end is closed
        pass
    os.close(ours)
    assert process.wait() == 0, found
    return found.decode()


def screen(text: str) -> str:
    """What is left of a terminal's text after its erasures: enough of a terminal for one line."""
    lines, row = [""], 0
    for piece in re.findall("\x1b\\[\\??[0-9;]*[A-Za-z]|\r|\n|[^\x1b\r\n]+", text):
        if piece == "\n":
            row += 1
            lines += [""] * (row + 1 - len(lines))
        elif piece == "\x1b[2K":
            lines[row] = ""
        elif re.fullmatch("\x1b\\[[0-9]*A", piece):
            row = max(0, row - int(piece[2:-1] or 1))
        elif not piece.startswith(("\x1b", "\r")):
            lines[row] += piece
    return "\n".join(line for line in lines if line)


@pytest.mark.parametrize("environment", [{}, {"NO_COLOR": "1"}])
def test_progress_is_shown_and_taken_away(environment):
    text = on_a_terminal(**environment)
    assert "counting" in text
    assert screen(text) == ""
    assert bool(re.search("\x1b\\[[0-9;]*3[0-9]", text)) is not environment, "NO_COLOR takes the colour and no more"


def test_results_and_notes_take_the_line_away_first():
    text = on_a_terminal(after="echo('result\\n'); write_note('remark')")
    assert "counting" in text
    assert screen(text) == "result\nremark"


@pytest.mark.parametrize(
    ("before", "environment"),
    [("progress.LINE.silence()", {}), ("", {"TERM": "dumb"}), ("progress.DELAY_SECONDS = 1e6", {})],
    ids=["quiet", "dumb", "quick"],
)
def test_nothing_is_shown(before, environment):
    assert on_a_terminal(before, waits=False, **environment) == ""


@pytest.mark.parametrize(
    ("terminal", "shown"), [(True, "a\ufffd]0;x\ufffdb\n::c\n"), (False, "a\x1b]0;x\x07b\r\n::c\n")]
)
def test_a_files_text_does_nothing_to_a_terminal_and_is_the_same_elsewhere(monkeypatch, terminal, shown):
    monkeypatch.setattr(sys, "stdout", Stream(terminal=terminal))
    console.echo("a\x1b]0;x\x07b\r\n::c\n")
    assert sys.stdout.getvalue() == shown


def test_nothing_is_shown_where_stderr_is_no_terminal(capsys, monkeypatch):
    line = progress.ProgressLine()
    monkeypatch.setattr(progress, "DELAY_SECONDS", 0)
    line.begin()
    assert line.end() is False
    assert capsys.readouterr().err == ""


def test_the_line_is_held_while_processes_are_forked(monkeypatch):
    monkeypatch.setattr(progress, "is_watched", lambda: True)
    monkeypatch.setattr(progress, "DELAY_SECONDS", 1e6)
    monkeypatch.setattr(progress, "LINE", line := progress.ProgressLine())
    before = threading.active_count()
    line.begin()
    assert threading.active_count() == before + 1
    with progress.hold_line():
        assert threading.active_count() == before
    assert threading.active_count() == before + 1
    assert line.end() is True
    with progress.hold_line():
        pass
    assert threading.active_count() == before, "what was not there is not begun"


def test_the_line_is_gone_before_click_says_that_it_was_interrupted(monkeypatch):
    """click ends the line of a Ctrl-C first, and a bar could no longer be erased."""
    seen = []
    monkeypatch.setattr(progress.LINE, "end", lambda: seen.append("end"))
    monkeypatch.setattr(click.core, "echo", lambda *_, **__: seen.append("click"))

    @click.command("schema")
    def command() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "get_command", lambda *_: command)
    with pytest.raises(click.Abort):
        cli(["schema"], standalone_mode=False)
    assert seen == ["end", "click"]


def test_quiet_silences_the_line(monkeypatch):
    monkeypatch.setattr(progress, "LINE", line := progress.ProgressLine())
    CliRunner().invoke(cli, ["validate", REACTOR])
    assert line.silent is False
    CliRunner().invoke(cli, ["validate", REACTOR, "--quiet"])
    assert line.silent is True


def test_simulations_and_verifications_say_how_far_they_are(monkeypatch):
    told: list[tuple[str, float | None]] = []
    monkeypatch.setattr(progress.LINE, "update", lambda label, share=None: told.append((label, share)))
    scenarios = [str(ROOT / f"examples/{name}.scenario.yaml") for name in ("ezlogix/oven", "click/tank")]
    CliRunner().invoke(cli, ["simulate", *scenarios])
    shares = [share for label, share in told if share is not None]
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert {label for label, _ in told} == {"simulating oven.scenario.yaml", "simulating tank.scenario.yaml"}


# --- code pages ------------------------------------------------------------------------------------------------------

CODE_PAGES = ("cp1252", "cp437", "ascii")
SIGNS = "… · − × ± √ ² ³ ° º ℃ ℉ ′ ″ ’ π Φ ζ → ≤ │ ─ ┌ █ ◉ ⠿ é ß"


@pytest.mark.parametrize("code_page", CODE_PAGES)
def test_signs_become_what_one_would_type(code_page):
    text = glyphs.encodable(SIGNS, code_page)
    text.encode(code_page)
    assert "?" not in text
    assert glyphs.encodable(SIGNS, "utf-8") == SIGNS
    if code_page == "ascii":
        assert text == "... - - x +/- sqrt ^2 ^3 deg deg degC degF ' \" ' pi phi zeta -> <= | - + # o . e ss"


def test_every_sign_in_the_program_has_a_fallback():
    texts = (path.read_text("utf-8") for path in (ROOT / "src").rglob("*") if path.suffix in {".py", ".yaml", ".txt"})
    signs = {c for text in texts for c in text if not c.isascii()}
    assert signs
    assert {c for c in signs if "?" in glyphs.encodable(c, "ascii")} == set()


def test_what_has_no_fallback_is_a_question_mark():
    assert glyphs.encodable("炉\udc80", "ascii") == "??"
    assert glyphs.encodable("\udc80", "utf-8") == "?"


class Page(io.TextIOWrapper):
    """Standard output or error of a terminal with a code page."""

    def __init__(self, code_page: str) -> None:
        super().__init__(io.BytesIO(), encoding=code_page, errors="strict", newline="")

    def text(self) -> str:
        self.flush()
        return self.buffer.getvalue().decode(self.encoding)  # type: ignore[attr-defined]


def printed(monkeypatch, code_page: str, *arguments: str) -> str:
    """Both streams of a command, in this process."""
    out, err = Page(code_page), Page(code_page)
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", out)
        patch.setattr(sys, "stderr", err)
        glyphs.install_fallback()
        try:
            cli(list(arguments), standalone_mode=False, prog_name="pidcfg")
        except click.exceptions.Exit:
            pass
        except click.ClickException as error:
            console.write_note(error.format_message())
        return out.text() + err.text()


def outputs(example: Path) -> list[tuple[str, ...]]:
    """The commands that print text about an example; its golden listings are read back."""
    file, vendor = str(example), example.parent.name
    found = [("validate", file), ("validate", file, "--format", "concise"), ("encode", file, "--allow-errors")]
    found += [("convert", file, "--to", "click" if vendor == "generic" else "generic", "--allow-loss")]
    return [*found, ("diff", REACTOR, file), ("diff", file, REACTOR, "--format", "markdown")]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_every_example_prints_on_every_code_page(example, monkeypatch):
    for arguments in outputs(example):
        expected = printed(monkeypatch, "utf-8", *arguments)
        for code_page in CODE_PAGES if str(example) == REACTOR else ("ascii",):
            assert "Traceback" not in (text := printed(monkeypatch, code_page, *arguments))
            assert text.count("?") == expected.count("?"), arguments


@pytest.mark.parametrize("code_page", CODE_PAGES)
def test_pages_and_helps_print_on_every_code_page(code_page, monkeypatch):
    lines = [("rule",), ("rule", "DL212"), ("schema",)]
    if code_page == "cp437":  # on ASCII, which it takes for a mistake, click prints its helps as UTF-8
        lines += [(name, "--help") for name in COMMANDS] + [("--help",)]
    lines += [("init", "--vendor", vendor) for vendor in VENDORS] + [("schema", "dl06")]
    lines += [("tune", "--method", "zn-open", "--gain", "2", "--time-constant", "10", "--dead-time", "1")]
    lines += [("simulate", str(ROOT / "examples/ezlogix/oven.scenario.yaml"))]
    for arguments in lines:
        expected = printed(monkeypatch, "utf-8", *arguments)
        assert expected
        assert printed(monkeypatch, code_page, *arguments).count("?") == expected.count("?"), arguments


def test_a_result_that_changes_says_so(tmp_path, monkeypatch):
    path = tmp_path / "reactor.yaml"
    path.write_text(Path(REACTOR).read_text("utf-8").replace("unit: degC", 'unit: "°C"', 1), "utf-8")
    text = printed(monkeypatch, "ascii", "encode", str(path))
    assert '"unit": "degC"' in text
    assert r"note: the code page ascii lacks '\xb0'" in text
    assert "code page" not in printed(monkeypatch, "cp1252", "encode", str(path))
    assert "code page" not in printed(monkeypatch, "ascii", "validate", str(path)), "a report is not a file"
