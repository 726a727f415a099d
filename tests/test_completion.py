"""What the Tab key offers, in each shell that is here and by the protocol of those that are not."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from pidcfg.cli import completion as candidates
from pidcfg.cli import completion as shells
from pidcfg.cli.commands import completion
from pidcfg.cli.main import COMMANDS, COMPLETE_VARIABLE, cli
from pidcfg.validate.catalog import find_rules
from pidcfg.vendors import VENDORS, format_names

ROOT = Path(__file__).parents[1]


def in_shell(name: str):
    """Marks a test that needs a shell."""
    missing = os.name == "nt" or not shutil.which(name)
    return pytest.mark.skipif(missing, reason=f"{name} is not installed")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with files of every kind, one of them broken."""
    for name in ("reactor.yaml", "reactor.scenario.yaml"):
        shutil.copyfile(ROOT / "examples/dl06" / name, tmp_path / name)
    (tmp_path / "loops").mkdir()
    (tmp_path / "my loops.yaml").write_text("pidcfg: 1\nvendor: dl06\nloops: [{name: A}, {name: B}, 3]\n", "utf-8")
    (tmp_path / "reads.txt").write_text("scenario: no\n", "utf-8")
    (tmp_path / "broken.yaml").write_bytes(b"pidcfg: [\n\xff\0")
    (tmp_path / ".hidden.yaml").write_text("pidcfg: 1\n", "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def hostile(folder):
    """A folder with names that a shell would run, split or take for options."""
    (folder / "e.yaml").write_text("pidcfg: 1\nvendor: dl06\nloops: []\n", "utf-8")
    (folder / "e.scenario.yaml").write_text("pidcfg: 1\nscenario: e\nconfig: e.yaml\n", "utf-8")
    for name in ("-x.yaml", "~x.yaml", "$(touch PWNED).yaml"):
        (folder / name).write_text("pidcfg: 1\n", "utf-8")
    return folder


@pytest.fixture
def complete(monkeypatch):
    """The raw answer to a line, as a shell gets it."""

    def answer(line: str, shell: str = "fish") -> str:
        monkeypatch.setenv(COMPLETE_VARIABLE, f"{shell}_complete")
        monkeypatch.setenv("COMP_WORDS", line)
        shells.register_shells()
        result = CliRunner().invoke(cli, [], prog_name="pidcfg", complete_var=COMPLETE_VARIABLE)
        assert (result.exit_code, result.stderr) == (0, "")
        return result.stdout

    return answer


@pytest.fixture
def offered(complete):
    """The values that are offered for a line."""
    return lambda line: [row.partition(",")[2].partition("\t")[0] for row in complete(line).splitlines() if row]


# --- what is offered -------------------------------------------------------------------------------------------------


def test_commands_and_their_help(complete, offered):
    assert offered("pidcfg ") == list(COMMANDS)
    assert complete("pidcfg va") == f"plain,validate\t{COMMANDS['validate'][1]}\n"
    assert {"--version", "--color"} <= set(offered("pidcfg --"))


def test_options_and_choices(offered):
    assert {"--select", "--severity", "--skip-foreign"} <= set(offered("pidcfg validate --s"))
    assert offered("pidcfg validate --severity ") == ["error", "warning", "info"]
    assert offered("pidcfg validate --severity=w") == ["--severity=warning"]
    assert offered("pidcfg init --vendor=n") == ["--vendor=nextopid"]
    assert offered("pidcfg completion po") == ["powershell"]


def test_rule_codes_with_their_titles(complete, offered):
    table = find_rules()
    assert offered("pidcfg rule ") == list(table)
    assert complete("pidcfg rule pid101") == f"plain,PID101\t{table['PID101'].title}\n"
    assert offered("pidcfg validate --ignore PID101,PID10")[0] == "PID101,PID102"
    assert offered("pidcfg validate --select=DL220") == ["--select=DL220"]


def test_files_by_what_they_hold(folder, offered):
    assert offered("pidcfg simulate ") == ["loops/", "reactor.scenario.yaml"]
    assert offered("pidcfg encode ") == ["broken.yaml", "loops/", "my loops.yaml", "reactor.yaml"]
    assert offered("pidcfg validate re") == ["reactor.scenario.yaml", "reactor.yaml"]
    assert "reads.txt" in offered("pidcfg decode ")
    assert offered("pidcfg validate .h") == [".hidden.yaml"]
    assert offered("pidcfg validate ./rea") == ["./reactor.scenario.yaml", "./reactor.yaml"]
    assert offered("pidcfg validate nowhere/") == []


def test_formats_and_their_files(folder, offered):
    assert offered("pidcfg validate x.yaml --output sa") == ["sarif="]
    assert offered("pidcfg validate x.yaml --output sarif=rea") == [
        f"sarif={name}" for name in ("reactor.scenario.yaml", "reactor.yaml", "reads.txt")
    ]
    assert offered("pidcfg validate --limit file_") == ["file_bytes="]


def test_what_goes_wrong_is_silent(folder, monkeypatch, complete):
    monkeypatch.setattr(candidates, "rule_titles", lambda: 1 / 0)
    assert complete("pidcfg rule ").strip() == ""
    assert complete("pidcfg validate 'open quo").strip() == ""


def test_every_parameter_completes_to_something():
    """An argument, or an option that names a file, offers files at least."""
    for name in COMMANDS:
        command = cli.get_command(click.Context(cli), name)
        for param in command.params:
            if isinstance(param, click.Argument) and not isinstance(param.type, click.Choice):
                assert candidates.source_of(name, param) is not None, (name, param.name)


def test_completing_commands_options_and_codes_loads_no_slow_package():
    code = """
import sys
from pidcfg.cli.main import main
try:
    main()
except SystemExit as end:
    assert not end.code
print([name for name in ("pydantic", "rich", "ruamel") if name in sys.modules])
"""
    for line in ("pidcfg ", "pidcfg validate --", "pidcfg validate --select DL2"):
        environment = {**os.environ, "COMP_WORDS": line, COMPLETE_VARIABLE: "zsh_complete"}
        run = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        assert run.stdout.splitlines()[-1] == "[]"


def test_files_that_look_like_options_or_homes_are_named_from_here(hostile, offered):
    assert {"./-x.yaml", "./~x.yaml", "e.yaml"} <= set(offered("pidcfg validate "))
    assert offered("pidcfg validate ./-") == ["./-x.yaml"]
    assert offered("pidcfg validate x.yaml --output json=-") == ["json=-x.yaml"]
    assert "json=./-x.yaml" in offered("pidcfg validate x.yaml --output json=")


def test_formats_are_those_of_the_file_s_vendor(folder, offered):
    own = list(VENDORS["dl06"].load("formats"))
    assert offered("pidcfg encode reactor.yaml --format ") == own
    assert own != format_names()
    for line in ("pidcfg encode --format ", "pidcfg encode broken.yaml --format ", "pidcfg encode none.yaml --format "):
        assert offered(line) == format_names()


# --- each shell ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shell", completion.SCRIPTS)
def test_the_command_prints_what_click_would(shell, monkeypatch):
    script = CliRunner().invoke(cli, ["completion", shell]).stdout
    assert "pidcfg" in script
    assert script.isascii()
    monkeypatch.setenv(COMPLETE_VARIABLE, f"{shell}_source")
    shells.register_shells()
    assert CliRunner().invoke(cli, [], prog_name="pidcfg", complete_var=COMPLETE_VARIABLE).stdout == script


def test_how_each_shell_gets_its_answer(folder, complete):
    title = find_rules()["DL242"].title
    assert complete("pidcfg rule DL242", "zsh") == f"plain\nDL242\n{title}\n"
    assert complete("pidcfg rule DL242", "powershell") == f"plain\nDL242\n{title}\n"
    assert complete("pidcfg validate my", "zsh") == "path\nmy loops.yaml\n_\n"
    assert complete("pidcfg validate my", "powershell") == "path\n'my loops.yaml'\n_\n"
    assert complete(r"pidcfg validate .\my", "powershell").strip() == "" if os.name != "nt" else True
    assert complete("pidcfg validate --format=js", "powershell") == "plain\n--format=json\n_\n"
    assert complete("pidcfg validate --format=js", "bash") == "plain,json\n", "bash has a word of its own behind ="
    assert complete("pidcfg validate --output sarif=rep", "bash").strip() == ""
    assert complete("pidcfg validate --output sarif=reac", "bash").splitlines()[1] == "path,reactor.yaml"


def test_powershell_gets_every_quote_twice(folder, complete):
    """It takes typographic ones for the end of a text as well."""
    (folder / "o\u2019; calc ;\u2018.yaml").write_text("pidcfg: 1\n", "utf-8")
    assert complete("pidcfg validate o", "powershell") == "path\n'o\u2019\u2019; calc ;\u2018\u2018.yaml'\n_\n"


def test_powershell_gets_ascii(complete):
    assert complete("pidcfg rule ", "powershell").isascii()


@pytest.fixture
def environment(tmp_path_factory):
    """An environment with `pidcfg` on the path."""
    tools = tmp_path_factory.mktemp("tools")
    (tools / "pidcfg").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m pidcfg "$@"\n', "utf-8")
    (tools / "pidcfg").chmod(0o755)
    return {**os.environ, "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": str(ROOT / "src")}


BASH = """
compopt() { :; }  # works while a person types only
eval "$(pidcfg completion bash)"
complete -p pidcfg
for COMP_LINE in 'pidcfg simulate re' 'pidcfg validate --format=js' 'FOO=1 pidcfg rule DL24'; do
    COMP_POINT=${#COMP_LINE}
    _pidcfg pidcfg
    printf '%s\\n' "${COMPREPLY[*]}"
done
"""


@in_shell("bash")
def test_bash(folder, environment):
    run = subprocess.run(["bash", "--norc", "-c", BASH], env=environment, capture_output=True, text=True, check=True)
    assert run.stderr == ""
    assert run.stdout.splitlines() == [
        "complete -o nosort -F _pidcfg pidcfg",
        "reactor.scenario.yaml",
        "json",
        " ".join(find_rules("DL24")),
    ]


QUOTING = """
compopt() { :; }
eval "$(pidcfg completion bash)"
env() { printf '%s\\n' "$answer"; }  # whatever pidcfg answers
answer=$1 COMP_WORDS=(pidcfg validate "$2") COMP_CWORD=2
_pidcfg pidcfg
printf '<%s>\\n' "${COMPREPLY[@]}"
"""


@in_shell("bash")
@pytest.mark.parametrize(
    ("answer", "typed", "line"),
    [
        ("plain,TIC 101", "T", r"<TIC\ 101>"),
        ("part,TIC 101.", "", r"<TIC\ 101.>"),
        ("plain,TIC 101", '"T', "<TIC 101>"),
        ("plain,$(touch PWNED);`x`", "", r"<\$\(touch\ PWNED\)\;\`x\`>"),
        ("plain,$(touch PWNED)", '"', "<>"),
        ("plain,it's", "'", "<>"),
        ("plain,PID101,PID102", "PID101,", "<PID101,PID102>"),
        ("part,json=", "js", "<json=>"),
        ("path,my loops.yaml", "my", "<my loops.yaml>"),
    ],
)
def test_what_bash_inserts_is_one_word_and_is_not_run(environment, answer, typed, line):
    """Whatever comes; names of files are quoted by bash itself."""
    run = subprocess.run(
        ["bash", "--norc", "-c", QUOTING, "bash", answer, typed],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert (run.stdout, run.stderr) == (f"{line}\n", "")


LIVE = r"""
PS1=
eval "$(pidcfg completion bash)"
bind 'set enable-bracketed-paste off'
bind -x '"\C-xs": printf "%s" "$READLINE_LINE" > shown; exit'
echo ready''now
"""


@in_shell("bash")
@pytest.mark.parametrize(
    ("typed", "line"),
    [
        ("validate '$", "validate '$(touch PWNED).yaml' "),
        ("validate \\$", r"validate \$\(touch\ PWNED\).yaml "),
    ],
)
def test_bash_at_a_terminal(hostile, environment, typed, line):
    """Line by line as a person types it."""
    import pty

    (hostile / "rc").write_text(LIVE, "utf-8")
    master, slave = pty.openpty()
    shell = subprocess.Popen(
        ["bash", "--noprofile", "--rcfile", "rc", "-i"],
        stdin=slave,
        stdout=slave,
        stderr=slave,
        cwd=hostile,
        env={**environment, "TERM": "xterm"},
        start_new_session=True,
    )
    os.close(slave)
    shown = b""
    while b"readynow" not in shown:
        shown += os.read(master, 4096)
    os.write(master, f"pidcfg {typed}\t\x18s".encode())
    with contextlib.suppress(OSError):  # the end of a terminal
        while os.read(master, 4096):
            pass
    shell.wait(600)
    os.close(master)
    assert (hostile / "shown").read_text("utf-8") == f"pidcfg {line}"
    assert not (hostile / "PWNED").exists()


@in_shell("bash")
def test_bash_that_is_too_old_says_so(environment):
    script = completion.completion_script("bash").replace("BASH_VERSINFO", "OLD")
    run = subprocess.run(
        ["bash", "--norc", "-c", f"OLD=(3 2)\n{script}\ncomplete -p pidcfg"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "needs bash 4.4" in run.stderr
    assert "_pidcfg" not in run.stdout


@in_shell("fish")
def test_fish(folder, environment):
    script = "pidcfg completion fish | source; for line in $argv; complete -C $line; end"
    lines = ["pidcfg simulate re", "pidcfg validate --format=js", "pidcfg rule DL242"]
    run = subprocess.run(
        ["fish", "--no-config", "-c", script, "--", *lines], env=environment, capture_output=True, text=True, check=True
    )
    assert run.stdout.splitlines() == [
        "reactor.scenario.yaml",
        "--format=json",
        f"DL242\t{find_rules()['DL242'].title}",
    ]


@in_shell("fish")
def test_fish_quotes_what_it_inserts(hostile, environment):
    script = "pidcfg completion fish | source; for line in $argv; complete --escape -C $line; end"
    lines = ["pidcfg validate my", "pidcfg validate \\$"]
    run = subprocess.run(
        ["fish", "--no-config", "-c", script, "--", *lines], env=environment, capture_output=True, text=True, check=True
    )
    assert run.stdout.splitlines() == [r"my\ loops.yaml", r"\$\(touch\ PWNED\).yaml"]


ZSH = """
zmodload zsh/zpty
zpty z zsh -f -i
zpty -w z "PS1=; unsetopt zle_bracketed_paste 2>/dev/null; autoload -U compinit; compinit -D"
zpty -w z 'eval "$(pidcfg completion zsh)"'
zpty -w z 'show() { print -r -- $BUFFER > shown; exit }; zle -N show; bindkey ^Xs show'
zpty -w z 'print ready''now'
zpty -r z line '*readynow*'
zpty -w -n z $1$'\\t\\x18s'
while zpty -r z line; do :; done
"""


@in_shell("zsh")
@pytest.mark.parametrize(
    ("typed", "line"),
    [
        ("pidcfg sim", "pidcfg simulate "),
        ("pidcfg simulate re", "pidcfg simulate reactor.scenario.yaml "),
        ("pidcfg validate my", r"pidcfg validate my\ loops.yaml "),
        ("pidcfg simulate lo", "pidcfg simulate loops/"),
        ("pidcfg validate --format=js", "pidcfg validate --format=json "),
        (r"pidcfg validate \$", r"pidcfg validate \$\(touch\ PWNED\).yaml "),
    ],
)
def test_zsh(hostile, environment, typed, line):
    subprocess.run(
        ["zsh", "-f", "-c", ZSH, "zsh", typed], env=environment, capture_output=True, check=False, timeout=600
    )
    assert (hostile / "shown").read_text("utf-8").rstrip("\n") == line
