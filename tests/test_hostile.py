"""What an input that means harm, or an end at a bad moment, must not do: each was seen once."""

from __future__ import annotations

import ast
import html
import io
import os
import random
import re
import signal
import socket
import subprocess
import sys
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Thread
from types import SimpleNamespace

import click
import pytest
from ruamel.yaml import YAML

import pidcfg
from living_rig import GOOD, TWICE, call, run
from pidcfg.api import check, check_text
from pidcfg.cli import console, interrupts, main, outputs
from pidcfg.cli import outputs as temporary
from pidcfg.cli.outputs import patch_text
from pidcfg.encoders.decoding import read_listing
from pidcfg.encoders.dl06.files import read_ihex
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.nextopid.files import read_plcopen
from pidcfg.encoders.nextopid.st_read import read_st
from pidcfg.text import reader
from pidcfg.text.reader import DEFAULT
from pidcfg.text.signs import break_ci_commands
from pidcfg.text.store import Store, cache_folder
from pidcfg.text.writer import json_line, json_text, yaml_text
from pidcfg.vendors import VENDORS

SOURCE = Path(__file__).parents[1] / "src" / "pidcfg"
EXAMPLES = SOURCE.parents[1] / "examples"
EZLOGIX = EXAMPLES / "ezlogix" / "oven.yaml"
POSIX = pytest.mark.skipif(sys.platform == "win32", reason="signals, locks and pipes of POSIX")


# --- reading ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "word"),
    [("1e1000000000000000000", "large"), ("-1E+99999999999999999999", "large"), ("1e-9999999999999999999", "small")],
)
def test_an_exponent_that_no_decimal_holds_is_refused_at_its_place(number, word):
    (finding,) = [d for d in check_text(GOOD.replace("gain: 1", f"gain: {number}")).findings if d.code == "PID023"]
    assert f"{number} is too {word}" in finding.message
    assert (finding.span.line, finding.span.column) == (8, 20)


@pytest.mark.parametrize(
    "key", ["a." * 40 + "a = 1", '["a"' + " . 'a'" * 40 + "]", "x = 1\ny" + " .\t y" * 33 + " = 2"]
)
def test_a_deep_key_of_a_settings_file_is_refused_before_the_parser_keeps_its_beginnings(
    tmp_path, monkeypatch, capsysbinary, key
):
    (tmp_path / "pidcfg.toml").write_text(key + "\n", "utf-8")
    (tmp_path / "a.yaml").write_text(GOOD, "utf-8")
    found = run(monkeypatch, capsysbinary, tmp_path / "a.yaml")
    assert (found.code, "a key of more than 32 parts" in found.err) == (2, True)


def test_dots_in_texts_and_numbers_are_no_deep_key(tmp_path, monkeypatch, capsysbinary):
    texts = f'# {"a." * 99}\n[tool.x]\na = \'{"." * 99}\'\nb = """{"a." * 99}\n{"." * 99}"""\nc = [{"1.5, " * 99}]\n'
    (tmp_path / "pyproject.toml").write_text(texts + "[tool.pidcfg]\nstrict = true\n", "utf-8")
    (tmp_path / "a.yaml").write_text(GOOD, "utf-8")
    assert run(monkeypatch, capsysbinary, tmp_path / "a.yaml", "--show-settings").out.count("strict = true") == 1


@pytest.mark.parametrize(("lists", "codes"), [(11, ["PID032"]), (12, ["PID013"])])
def test_levels_of_nesting_that_an_alias_brings_count(lists, codes):
    text = f"x: &x {'{a: ' * 20}1{'}' * 20}\ny: {'[' * lists}*x{']' * lists}\n"
    findings = check_text(text).findings
    assert [d.code for d in findings] == codes
    assert codes != ["PID013"] or findings[0].message == "more than 32 levels of nesting"


class Counted(dict):
    """Calls of functions, by name, while a piece of work is done."""

    def __enter__(self):
        sys.setprofile(self._take)
        return self

    def __exit__(self, *_):
        sys.setprofile(None)
        self["all"] = sum(self.values())

    def _take(self, frame, event, _):
        if event in {"call", "c_call"}:
            name = frame.f_code.co_name
            self[name] = self.get(name, 0) + 1


def ignores(n):
    return GOOD + "# pidcfg: ignore[DL999]\n" * n


def unknown(n):
    return GOOD.replace("tuning:", "tuning: {" + ", ".join(f"k{i}: 1" for i in range(n)) + "}\n    tuned:")


def duplicates(n):
    return GOOD + "k: 1\n" * n


def hashes(n):
    return GOOD + "k: [" + "' # ', " * n + "1] # pidcfg: ignore[DL999] because\n"


@pytest.mark.parametrize("text", [ignores, unknown, duplicates, hashes])
def test_twice_the_text_is_twice_the_work(text):
    """Counted in calls, which do not depend on the machine; the square of it would be four times."""
    check_text(text(50))
    counts = []
    for n in (200, 400):
        with Counted() as calls:
            check_text(text(n))
        counts.append(calls["all"])
    assert counts[1] < 2.2 * counts[0], text


def test_twice_the_variables_of_a_program_are_twice_the_work():
    source = "PROGRAM P\nVAR\n{}L : ControlPID;\nEND_VAR\nL(SP := 1.0);\nEND_PROGRAM\n"
    tokens = "x := {} 1;\n"
    for program, part in ((source, "v{} : REAL;\n"), (source.replace("L(SP", tokens + "L(SP"), "")):
        counts = []
        for n in (200, 400):
            body = "".join(part.format(i) for i in range(n)) if part else ""
            text = program.format(body, "a +" * n) if "{} 1" in program else program.format(body)
            with Counted() as calls:
                read_st(text)
            counts.append(calls["all"])
        assert counts[1] < 2.2 * counts[0]


def program(declared, *statements):
    """A NextoPID program whose one loop reads x."""
    call = "L(SP := 1.0, PV := x);\n"
    names = "L : PIDA_REAL; a : REAL; x : REAL; z : REAL; c : INT;\n"
    return f"PROGRAM P\nVAR\n{names}{declared}END_VAR\n{''.join(statements)}{call}END_PROGRAM\n"


def elsif(n, variable="z"):
    branches = "".join(f"ELSIF a > {i}.0 THEN {variable} := 1.0;\n" for i in range(n))
    return program("", f"IF a > 0.5 THEN x := 1.0;\n{branches}END_IF;\n")


def cases(n):
    return program("", "CASE c OF\n", *(f"{i}: z := 1.0;\n" for i in range(n)), "END_CASE;\n")


def backwards(n):
    names = "".join(f"v{i} : REAL;\n" for i in range(n + 1))
    return program(names, *(f"v{i} := v{i + 1};\n" for i in reversed(range(n))), "x := v0;\n")


def moves(n):
    names = "".join(f"F{i} : PIDA_REAL; v{i} : REAL;\n" for i in range(n))
    return program(names, *(f"v{i} := a;\nF{i}(SP := 1.0, PV := v{i});\n" for i in range(n)))


def functions(n):
    return program("", "ControlSelectMin(MV1 := a, MV2 := a);\n" * n)


def parameters(n):
    return program("F : PIDA_REAL;\n", f"F({', '.join(f'a{i} := 1' for i in range(n))});\n")


@pytest.mark.parametrize(
    ("text", "size"), [(cases, 80), (backwards, 80), (moves, 80), (functions, 200), (parameters, 80)]
)
def test_twice_a_program_is_twice_the_work(text, size):
    counts = []
    for n in (10, size, 2 * size):
        with Counted() as calls, suppress(ListingError):  # of a parameter that is none
            read_st(text(n))
        counts.append(calls["all"])
    assert counts[2] < 2.2 * counts[1], text


def test_each_condition_of_a_chain_of_branches_is_read_as_it_is_and_inverted_and_no_more():
    factors = []
    for n in (30, 60):
        with Counted() as calls:
            whens = [move["when"] for move in read_st(elsif(n, "x")).plc["moves"]]
        assert whens[n].count("NOT") == n
        factors.append(calls["parse_factor"])
    assert factors[1] < 2.2 * factors[0]


def test_a_chain_of_branches_ends_where_no_condition_can_say_it():
    with pytest.raises(ListingError, match=r"with those of the branches before, .* longer than 1000 char") as error:
        read_st(elsif(1000, "x"))
    assert error.value.line < 100


def pous(n):
    variable = '<variable name="L"><type><derived name="PIDA_REAL"/></type></variable>'
    pou = f'<pou name="Q" pouType="program"><interface><localVars>{variable}</localVars></interface></pou>'
    return f'<project xmlns="http://www.plcopen.org/xml/tc6_0200"><types><pous>{pou * n}</pous></types></project>'


def test_twice_the_programs_of_a_document_are_twice_the_work():
    counts = []
    for n in (10, 40, 80):
        with Counted() as calls, suppress(ListingError):  # of several none is read
            read_plcopen(pous(n))
        counts.append(calls["all"])
    assert counts[2] < 2.2 * counts[1]


def test_statements_in_each_other_have_a_limit():
    text = "PROGRAM P\nVAR a : BOOL; END_VAR\n" + "IF a THEN " * 40 + "END_IF; " * 40 + "\nEND_PROGRAM\n"
    with pytest.raises(ListingError, match="more than 32 statements stand in each other"):
        read_st(text)


HEX = ":02080000001ED8\n"
END_OF_FILE = ":00000001FF"


@pytest.mark.parametrize("behind", [HEX, HEX + END_OF_FILE, END_OF_FILE, "remark"])
def test_what_stands_behind_the_end_of_a_hex_file_is_not_dropped(behind):
    assert read_ihex(f"{HEX.lower()}{END_OF_FILE.lower()}\n \n").words
    with pytest.raises(ListingError, match="behind the end-of-file record") as raised:
        read_ihex(f"{HEX}{END_OF_FILE}\n\n{behind}\n")
    assert raised.value.line == 4


@pytest.mark.parametrize("version", ["99", "true", "1.0", '"1"', "null", "0"])
def test_a_listing_of_another_version_is_refused(version):
    text = f'{{"version": {version}, "vendor": "dl06", "words": [{{"address": "V2000", "value": 1}}]}}'
    with pytest.raises(ListingError, match="has version"):
        read_listing(text.encode(), VENDORS["dl06"], DEFAULT)
    assert read_listing(text.replace(version, "1", 1).encode(), VENDORS["dl06"], DEFAULT).words


OWN_FILES = {
    "text.reader": "the one door",
    "text.store": "entries of the cache",
    "study.certification.samples": "the package's own sources",
    "cli.commands.completion": "a script of the package",
    "cli.commands.demo": "a starter of the package",
    "cli.commands.init": "a starter of the package",
    "output.browser.page": "parts of a page of the package, Python for the browser, and its own sources",
    "validate.__init__": "a table of the package",
    "cli.completion": "a list of the package",
    "cli.findings": "the record of the installation",
    "cli.outputs": "temporary files of its own",
    "cli.main": "a closed stream that goes to nowhere",
    "cli.console": "a closed stream that goes to nowhere",
    "pictures.page": "a style sheet of the package",
    "output.report.formats": "a temporary file of its own",
    "output.explanation.wording": "two tables of the package",
    "output.sheet_reader": "a starter of the package",
    "output.conversion": "starters of the package, whose comments stay behind",
}
"""Who opens files, and which: those of the user and those that files name have one door."""


def opens(node):
    """Whether a call opens a file to read it."""
    if not isinstance(node, ast.Call):
        return False
    words = ast.unparse(node.func)
    reads = [arg for arg in node.args if isinstance(arg, ast.Constant) and str(arg.value).startswith("r")]
    return (
        words in {"open", "os.open", "io.open"}
        or words.endswith((".read_bytes", ".read_text"))
        or (words.endswith(".open") and bool(reads))
    )


def test_every_file_is_opened_by_the_one_function():
    found = {
        path.relative_to(SOURCE).with_suffix("").as_posix().replace("/", ".")
        for path in SOURCE.rglob("*.py")
        if any(word in (text := path.read_text("utf-8")) for word in ("open(", "read_bytes(", "read_text("))
        and any(map(opens, ast.walk(ast.parse(text))))
    }
    assert found <= {*OWN_FILES}, found - {*OWN_FILES}


@contextmanager
def no_waiting():
    """Fails where something waits for what never comes."""

    def waits(*_):
        pytest.fail("it waits")

    before = signal.signal(signal.SIGALRM, waits)
    signal.alarm(20)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def place_of(kind, tmp_path):
    """Something in a folder that is no file, or the name of a device."""
    place = tmp_path / "place"
    if kind == "pipe":
        os.mkfifo(place)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as line:
            line.bind(os.fspath(place))
    elif kind == "link":
        place.symlink_to("/dev/ptmx")
    elif kind == "file of a process":
        place.symlink_to("/proc/self/cmdline")
    else:
        place = Path(kind)
    if not place.exists():
        pytest.skip(f"{kind} is not there")
    return place


KINDS = {
    "pipe": "is a pipe and no file",
    "socket": "is a socket and no file",
    "link": "is a device and no file",
    "file of a process": "lies in /proc and is no file",
    "/dev/ptmx": "is a device and no file",
    "/dev/tty": "is a device and no file",
    "/dev/zero": "is a device and no file",
    "/dev/full": "is a device and no file",
    "/proc/kmsg": "lies in /proc and is no file",
    "/dev": "Is a directory",
}
WHERE = {
    "config": ("a.scenario.yaml", 1),
    "map": ("b.yaml", 1),
    "baseline": ("a.yaml --baseline {}", 2),
    "settings": ("a.yaml --config {}", 2),
    "input": ("{}", 2),
}
"""Who names it: arguments of validate, and its exit code."""


def with_map(name):
    """A configuration that names its map."""
    return EZLOGIX.read_text("utf-8").replace("plc:\n", f"plc:\n  map: {name}\n", 1)


@POSIX
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("where", WHERE)
def test_nothing_that_is_no_file_is_opened(tmp_path, monkeypatch, capsysbinary, where, kind):
    """Some devices are waited for, others never end, and opening one may do something."""
    if (where, kind) == ("input", "/dev"):
        return  # a folder of files
    monkeypatch.chdir(tmp_path)
    place = place_of(kind, tmp_path)
    opened = []
    spy = os.open

    def open_file(path, *rest, **named):
        opened.append(os.fspath(path))
        return spy(path, *rest, **named)

    monkeypatch.setattr(os, "open", open_file)
    Path("a.yaml").write_text(GOOD, "utf-8")
    Path("b.yaml").write_text(with_map(place), "utf-8")
    Path("a.scenario.yaml").write_text(f"pidcfg: 1\nscenario: x\nconfig: {place}\nduration: 1\n", "utf-8")
    with no_waiting():
        found = run(monkeypatch, capsysbinary, *WHERE[where][0].format(place).split())
    assert (found.code, KINDS[kind] in found.out + found.err) == (WHERE[where][1], True)
    assert os.fspath(place) not in opened


DEVICE = "/dev/ptmx"
OTHER = "modbus://127.0.0.1:1"
DOORS = (
    "validate {} --no-cache",
    "validate a.yaml --fix --config {}",
    "validate {} --fix",
    "encode {}",
    "encode a.yaml --format modbus --changed-from {}",
    "encode a.yaml --format modbus --map {}",
    "decode {} --vendor dl06",
    "decode a.txt --vendor dl06 --like {}",
    "convert {} --to click",
    "simulate {}",
    "certify {}",
    f"certify {EXAMPLES / 'dpide' / 'chiller.scenario.yaml'} --samples 1 --resume {{}}",
    "diff {} a.yaml",
    "diff a.yaml {} --vendor dl06",
    "tune --from-csv {} --columns time=t,output=o,pv=p --method simc",
    "tune --method zn-closed --ultimate-gain 2 --ultimate-period 3 --write {} --loop A",
    "report {} -o r.html",
    "explain A A.tuning.gain V2000 --in {}",
    "explain DL242 --loop {}",
    f"pull --plc {OTHER} --like {{}}",
    f"compare {{}} --plc {OTHER}",
    f"trend --plc {OTHER} --like {{}}",
    f"trend --plc {OTHER} --like a.yaml -o {{}} --force",
    "serve {} --listen 127.0.0.1:0",
    "init --from {}",
    "init --scenario {}",
    "export {}",
    "encode a.yaml -o {} --force",
)


@POSIX
@pytest.mark.skipif(not Path(DEVICE).exists(), reason="a device that is waited for")
@pytest.mark.parametrize("command", DOORS)
def test_a_device_that_a_command_line_names_is_one_error(tmp_path, monkeypatch, capsysbinary, command):
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text(GOOD, "utf-8")
    Path("a.txt").write_text("V2000 0000\n", "utf-8")
    with no_waiting():
        found = call(monkeypatch, capsysbinary, *command.format(DEVICE).split())
    assert (found.code, DEVICE in found.out + found.err) == (2, True), found.err


@POSIX
def test_a_file_that_becomes_a_pipe_is_not_waited_for(tmp_path, monkeypatch):
    place = tmp_path / "a.yaml"
    place.write_text(GOOD, "utf-8")
    file = place.stat()
    place.unlink()
    os.mkfifo(place)
    monkeypatch.setattr(reader, "os", SimpleNamespace(**{**vars(os), "stat": lambda _: file}))
    with no_waiting(), pytest.raises(OSError, match="a pipe and no file"):
        check(place)


@POSIX
@pytest.mark.parametrize("form", ["/dev/fd/{}", "/proc/self/fd/{}"])
def test_what_a_process_has_open_is_waited_for(monkeypatch, form):
    end, other = os.pipe()
    place, begun = Path(form.format(end)), Event()
    if not place.exists():
        pytest.skip("no names of what is open")
    monkeypatch.setattr(reader.DISK, "on_open", lambda _: begun.set(), raising=False)

    def write():
        begun.wait(10)
        os.write(other, GOOD.encode())
        os.close(other)

    writer = Thread(target=write)
    writer.start()
    with no_waiting():
        assert check(place).ok
    writer.join()
    os.close(end)


def test_a_link_to_a_file_and_a_file_of_nothing_are_read(tmp_path):
    (tmp_path / "a.yaml").write_text(GOOD, "utf-8")
    with suppress(OSError):  # Windows without the right to make links
        (tmp_path / "b.yaml").symlink_to("a.yaml")
        assert check(tmp_path / "b.yaml").ok
    assert "the file is empty" in check(Path(os.devnull)).findings[0].message


@pytest.mark.parametrize("name", ["/dev/stdin", "/dev/fd/0", "/proc/self/fd/0", os.devnull])
def test_a_stream_is_nothing_that_a_file_names(tmp_path, monkeypatch, capsysbinary, name):
    (tmp_path / "a.yaml").write_text(with_map(name), "utf-8")
    (tmp_path / "a.scenario.yaml").write_text(f"pidcfg: 1\nscenario: x\nconfig: {name}\nduration: 1\n", "utf-8")
    for file in ("a.yaml", "a.scenario.yaml"):
        found = run(monkeypatch, capsysbinary, tmp_path / file)
        assert f"cannot read {name}: it is a stream and no file" in found.out


# --- the terminal ----------------------------------------------------------------------------------------------------

WRITERS = {
    "pidcfg.cli.console": {"echo", "write"},
    "pidcfg.cli.main": {"write"},
    "pidcfg.sim.engine.compile": {"warn"},
}
"""Who writes to the streams: the one exit, an error in ASCII where no more files may be open to load it, and a warning,
which the command line leads there."""


def test_a_warning_passes_the_one_exit(monkeypatch, capsys):
    monkeypatch.setattr(main.warnings, "showwarning", None)
    monkeypatch.setattr("sys.argv", ["pidcfg", "--version"])
    with pytest.raises(SystemExit):
        main.main()
    main.warnings.showwarning(UserWarning("a\x1b[31m\n::error::b"), UserWarning, "file.py", 1)
    assert capsys.readouterr().err == "note: a\ufffd[31m ::error::b\n"


def test_everything_that_is_printed_passes_the_one_exit():
    found = {}
    for path in SOURCE.rglob("*.py"):
        module = ".".join(("pidcfg", *path.relative_to(SOURCE).with_suffix("").parts))
        text = path.read_text("utf-8")
        for node in ast.walk(ast.parse(text)) if any(word in text for word in ("print", "echo", "std", "warn")) else ():
            if not isinstance(node, ast.Call):
                continue
            words = ast.unparse(node.func)
            streams = ("sys.stdout.", "sys.stderr.", "sys.__stdout__.", "sys.__stderr__.")
            printed = words in {"print", "click.echo", "click.secho", "traceback.print_exc", "warnings.warn"}
            if printed or (words.startswith(streams) and words.endswith(("write", "writelines"))):
                found.setdefault(module, set()).add(words.rpartition(".")[2])
    assert found == WRITERS


NAMES = [
    "x\n::error::forged",
    "x\x1b[31m",
    "x\u202ey",
    "x\u2028::error::forged",
    "x\u200fy",
    "\x1b[31mx\n::error::forged",
]


OBEYED = re.compile(r"^\s*::|##\w*\[")
"""How GitHub's runner knows a command: first on its line, or in the older form anywhere; so do Azure and TeamCity."""
ORDERS = '"::add-mask::x\\n \u3000::stop-commands::y ##[add-mask]z ##vso[task.setvariable variable=z]z"'
HOSTILE = f"""\
pidcfg: 1
vendor: dl06
name: {ORDERS}
description: {ORDERS}
plc: {{loop_table: V2000, reset_decimals: 1}}
loops:
  - name: A
    # ##[add-mask]z
    description: {ORDERS}
    sample_rate: 1
    action: direct
    pv: {{unit: {ORDERS}}}
    tuning: {{gain: 1, reset: 10}}
    alarms: {{pv: {{low_low: 10, low: 15, high: 80, high_high: 90}}}}
"""
RUN = f"""\
pidcfg: 1
scenario: {ORDERS}
config: a.yaml
duration: 20
plants: {{A: {{model: first_order, gain: 0.5, time_constant: 20}}}}
vary: {{plants: {{A: {{gain: ±10 %}}}}}}
expect: [{{loop: A, metric: overshoot, max: 0}}, {{signal: A.PV, final: 1, tolerance: 1}}]
"""
PRINTED = (
    "validate {} --format text",
    "validate {} --format markdown",
    "validate {} --format github",
    "validate {} --format junit",
    "validate - --fix --format text",
    "encode {}",
    "decode a.txt --vendor dl06 --like {}",
    "convert {} --to nextopid --allow-loss",
    "convert {} --to nextopid --allow-loss --report json -o b.yaml",
    "simulate ::s.scenario.yaml --format text",
    "certify ::s.scenario.yaml --samples 1",
    "diff {} a.yaml",
    "diff {} a.yaml --format markdown",
    "tune --method zn-closed --ultimate-gain 2 --ultimate-period 3 --pv-range 0 100 --write {} --diff",
    "report {} -o -",
    "explain A A.tuning.gain V2000 --in {}",
    "init --scenario {}",
    "export {}",
    "export {} --format csv",
    "export ::none",
    "rule ::add-mask::x",
)
"""Every command that prints what a file says."""


@POSIX
@pytest.mark.parametrize("command", PRINTED)
def test_no_text_of_a_file_is_an_order_to_who_keeps_the_log(tmp_path, monkeypatch, capsysbinary, command):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.setattr("pidcfg.sim.engine.choice.is_installed", lambda: False)
    for name, text in {"::a": HOSTILE, "::s.scenario": RUN, "a": GOOD}.items():
        Path(f"{name}.yaml").write_text(text, "utf-8")
    Path("a.txt").write_text(pidcfg.encode(Path("::a.yaml")).text, "utf-8")
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(HOSTILE.encode())))
    found = call(monkeypatch, capsysbinary, *command.format("::a.yaml").split())
    refused = ("error PID040", "Error: no rule", "would be an order to the CI job that keeps this log")
    assert found.code in {0, 1} or any(words in found.err for words in refused), found.err
    ours = ("::error ", "::warning ", "::notice ") if "github" in command else "\0"
    lines = [line for text in (found.out, found.err) for line in re.split("[\r\n]", text)]
    assert [line for line in lines if OBEYED.search(line) and not line.startswith(ours)] == []


def test_no_mix_of_signs_is_an_order_once_it_is_text_for_people():
    draw = random.Random(4)
    signs = ["::", ":", " ", "\u3000", "\t", "#", "##", "[", "add-mask", "vso", "]", "x", "\n", "\r", "\r\n", "\u200b"]
    texts = ["".join(draw.choices(signs, k=12)) for _ in range(3000)]
    assert any(OBEYED.search(line) for text in texts for line in re.split("[\r\n]", text))
    for text in texts:
        safe = break_ci_commands(text)
        assert not any(OBEYED.search(line) for line in re.split("[\r\n]", safe)), repr(text)
        assert break_ci_commands(safe) == safe
        assert safe.replace(" ", "") == text.replace(" ", "")


def test_what_programs_read_says_the_same_without_an_order(monkeypatch, capsys):
    said = YAML(typ="safe").load(ORDERS)
    data = {"a": said, "b": [said], "c": {"d": said}}
    for text in (json_text(data), json_line(data), yaml_text(data)):
        assert not any(map(OBEYED.search, text.splitlines()))
        assert YAML(typ="safe").load(text) == data
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    page = "<a b='##[x]'>\n ::y::</a>"
    console.echo_xml(page)
    out = capsys.readouterr().out
    assert not any(map(OBEYED.search, out.splitlines()))
    assert html.unescape(out) == page


def test_a_result_that_would_be_an_order_goes_to_a_file_alone(tmp_path, monkeypatch, capsys):
    console.echo("::x::\n")
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    for hand_on in (lambda: console.echo("a\n ::x::\n"), lambda: console.write_user_file(b"a\n ::x::\n")):
        with pytest.raises(click.ClickException, match="line 2 of the result would be an order"):
            hand_on()
    assert capsys.readouterr().out == "::x::\n"
    with (tmp_path / "a").open("w", encoding="utf-8") as file:
        monkeypatch.setattr(sys, "stdout", file)
        console.echo("::x::\n")
    assert (tmp_path / "a").read_text("utf-8") == "::x::\n"


@pytest.mark.parametrize("put", [console.show_text, console.write_note, console.show_lines, console.show_markdown])
def test_a_code_page_makes_no_order(monkeypatch, put):
    """Wide signs become narrow ones where a code page lacks them."""
    page = io.TextIOWrapper(io.BytesIO(), "cp1252", errors="strict")
    monkeypatch.setattr(sys, "stdout", page)
    monkeypatch.setattr(sys, "stderr", page)
    put("\uff1a\uff1aadd-mask\uff1a\uff1ax\n\uff03\uff03\uff3badd-mask\uff3dy")
    page.flush()
    assert page.buffer.getvalue().splitlines()[:2] == [b": :add-mask::x", b"# #[add-mask]y"]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("command", ["decode", "diff", "export", "init", "report", "rule", "no such", "baseline"])
def test_no_name_begins_a_line_of_its_own_or_reaches_the_terminal(tmp_path, monkeypatch, capsysbinary, command, name):
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text(GOOD, "utf-8")
    Path(f"{name}.yaml").write_text(GOOD, "utf-8")
    arguments = {
        "decode": ["decode", name, "--vendor", "dl06"],
        "diff": ["diff", name, "a.yaml"],
        "export": ["export", name],
        "init": ["init", "--scenario", f"{name}.yaml"],
        "report": ["report", name],
        "rule": ["rule", name],
        "no such": [name],
        "baseline": ["validate", "a.yaml", "--baseline", name],
    }
    found = call(monkeypatch, capsysbinary, *arguments[command])
    assert found.code in {0, 1, 2}
    shown = found.out + found.err
    assert not set("\x1b\u202e\u2028\u200f") & set(shown)
    assert not any(line.startswith("::error") for line in shown.splitlines())


@pytest.mark.parametrize("variable", ["PIDCFG_ENCODE_CHANGED_FROM", "PIDCFG_ENCODE_NONE\n::error::forged"])
def test_no_variable_begins_a_line_of_its_own(tmp_path, monkeypatch, capsysbinary, variable):
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text(GOOD, "utf-8")
    monkeypatch.setenv(variable, "\x1b[31mx\n::error::forged")
    found = call(monkeypatch, capsysbinary, "encode", "a.yaml", "b.yaml")
    assert (found.code, variable[:18] in found.err) == (2, True)
    assert not any(line.startswith("::error") for line in found.err.splitlines())


@POSIX
@pytest.mark.parametrize("name", ["x\n::error::forged.yaml", "\x1b[31mx\n::error::forged.yaml"])
def test_no_remark_about_a_file_begins_a_line_of_its_own(tmp_path, monkeypatch, capsysbinary, name):
    monkeypatch.chdir(tmp_path)
    outputs = {}
    for words in (
        ["validate", "--fix", name],
        ["validate", "-v", name],
        ["init", "--vendor", "dl06", "-o", f"new{name}"],
    ):
        Path(name).write_text(GOOD.replace("action:", "Action:"), "utf-8")
        outputs[words[1]] = call(monkeypatch, capsysbinary, *words).err
    assert all("forged.yaml" in text for text in outputs.values())
    assert not any(line.startswith("::error") for text in outputs.values() for line in text.splitlines())


def test_a_patch_quotes_a_name_that_turns_the_writing_round():
    assert patch_text("x\u202ey.yaml", b"a\n", b"b\n").splitlines()[:2] == [
        '--- "x\\342\\200\\256y.yaml"',
        '+++ "x\\342\\200\\256y.yaml"',
    ]


@pytest.mark.parametrize("columns", ["99999999999999999999", "1", "0", "-1", "x"])
def test_a_terminal_of_any_width_shows_a_rule(monkeypatch, capsysbinary, columns):
    with monkeypatch.context() as surroundings:  # pytest -v asks for the width of the terminal, too
        surroundings.setenv("COLUMNS", columns)
        surroundings.setenv("FORCE_COLOR", "1")
        assert call(surroundings, capsysbinary, "rule", "DL242").code == 0


# --- writing ---------------------------------------------------------------------------------------------------------


def test_a_temporary_file_is_named_after_its_target_and_locked(tmp_path):
    target = tmp_path / "a.txt"
    handle, path = temporary.open_temporary(target)
    assert path.name.startswith(".a.txt.")
    second, other = temporary.open_temporary(target)
    assert path.exists(), "another writer's file stays while it is written"
    for number, name in ((handle, path), (second, other)):
        os.close(number)
        temporary.discard_file(name)
    assert [*tmp_path.iterdir()] == []


@POSIX
@pytest.mark.skipif(sys.platform == "darwin", reason="names of files that are no UTF-8")
@pytest.mark.parametrize("words", [["report", "-o", "o.html"], ["validate", "--report-output", "json=o.html"]])
def test_a_name_that_is_no_utf_8_stands_in_a_file(tmp_path, monkeypatch, capsysbinary, words):
    monkeypatch.chdir(tmp_path)
    name = os.fsdecode(b"\xff.yaml")
    Path(name).write_text(TWICE, "utf-8")
    found = call(monkeypatch, capsysbinary, *words, name)
    assert (found.code, "?.yaml" in Path("o.html").read_text("utf-8")) == (1, True)


@POSIX
@pytest.mark.skipif(sys.platform == "darwin", reason="names of files that are no UTF-8")
def test_a_name_that_is_no_utf_8_stands_in_a_workbook(tmp_path, monkeypatch, capsysbinary):
    monkeypatch.chdir(tmp_path)
    name = os.fsdecode(b"\xff.yaml")
    Path(name).write_text(TWICE, "utf-8")
    title = [word for option in ("project", "customer", "author") for word in (f"--{option}", "\udcff")]
    assert call(monkeypatch, capsysbinary, "report", name, "-o", "o.html", "--xlsx", "o.xlsx", *title).code == 1
    assert Path("o.xlsx").stat().st_size


@POSIX
def test_a_pipe_or_what_is_too_long_in_the_cache_is_a_miss(tmp_path, monkeypatch):
    monkeypatch.setenv("PIDCFG_CACHE_DIR", str(tmp_path))
    kept = Store(cache_folder("x"))
    kept.put("aa1", 1)
    place = tmp_path / "x" / "aa" / "aa1"
    assert kept.get("aa1") == 1
    for spoil in (os.mkfifo, os.mkdir):
        place.unlink()
        spoil(place)
        signal.alarm(20)
        assert kept.get("aa1") is None
        signal.alarm(0)
    place.rmdir()
    os.mkfifo(place)
    writer = os.open(place, os.O_RDWR)  # somebody may write to it, and does not
    assert kept.get("aa1") is None
    os.close(writer)
    kept.put("aa2", 123)
    for size, found in ((3, 123), (2, None)):
        assert Store(kept.folder, entry_bytes=size).get("aa2") == found


@POSIX
def test_the_next_run_removes_what_a_killed_one_has_left_for_its_own_target(tmp_path):
    code = (
        "import os, pathlib, signal, sys; from pidcfg.cli.outputs import open_temporary\n"
        "open_temporary(pathlib.Path(sys.argv[1])); os.kill(os.getpid(), signal.SIGKILL)"
    )
    for name in ("a.txt", "b.txt"):
        subprocess.run([sys.executable, "-c", code, str(tmp_path / name)], check=False, env=environment())
    left = sorted(path.name for path in tmp_path.iterdir())
    (tmp_path / ".a.txt.notes").write_text("mine", "utf-8")
    outputs.write_files({str(tmp_path / "a.txt"): "new"})
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([".a.txt.notes", left[1], "a.txt"])


def environment():
    return {**os.environ, "PYTHONPATH": str(SOURCE.parent)}


@pytest.fixture
def deaf_suite():
    """Tests that a shell has put into the background."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGINT, before)


ENDED = """
import os, signal, sys, pathlib
from pidcfg import __main__
from pidcfg.cli import interrupts
from pidcfg.cli import outputs
real = pathlib.Path.replace
def replace(self, target):
    done = real(self, target)
    if sys.argv[-1] == "between":
        os.kill(os.getpid(), int(sys.argv[-2]))
    return done
pathlib.Path.replace = replace
stage = outputs._stage_file
def staged(*arguments):
    path = stage(*arguments)
    if sys.argv[-1] == "staged":
        os.kill(os.getpid(), int(sys.argv[-2]))
    return path
outputs._stage_file = staged
def command():
    outputs.write_files({"a": "new", "b": "new", "c": "new"}, force=True)
from pidcfg.cli import main
main._run_command = command
__main__.main()
"""


@POSIX
@pytest.mark.usefixtures("heeding_interrupts")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
@pytest.mark.parametrize(("when", "content"), [("staged", {"a": "old"}), ("between", dict.fromkeys("abc", "new"))])
def test_a_signal_leaves_the_old_files_or_the_new_ones_and_nothing_else(tmp_path, number, code, when, content):
    (tmp_path / "a").write_text("old", "utf-8")
    command = [sys.executable, "-c", ENDED, str(int(number)), when]
    done = subprocess.run(command, cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False)
    assert (done.returncode, "Traceback" in done.stderr) == (code, False)
    assert {path.name: path.read_text("utf-8") for path in tmp_path.iterdir()} == content


@POSIX
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_command_that_was_started_deaf_to_a_signal_stays_so(tmp_path, number):
    command = [sys.executable, "-c", ENDED, str(int(number)), "between"]
    deaf = lambda: signal.signal(number, signal.SIG_IGN)  # noqa: E731
    done = subprocess.run(command, cwd=tmp_path, env=environment(), check=False, preexec_fn=deaf)
    assert done.returncode == 0
    assert {path.name: path.read_text("utf-8") for path in tmp_path.iterdir()} == dict.fromkeys("abc", "new")


@POSIX
@pytest.mark.usefixtures("deaf_suite", "heeding_interrupts")
def test_a_command_of_these_tests_hears_ctrl_c_wherever_they_run():
    shown = subprocess.run(
        [sys.executable, "-c", "import signal as s; print(s.getsignal(s.SIGINT) is s.default_int_handler)"],
        capture_output=True,
        check=True,
    )
    assert shown.stdout.strip() == b"True"


FEW = """
import errno, os, resource, sys
import pidcfg, pidcfg.cli.console, pidcfg.cli.main as program
pidcfg.encode("a.yaml")  # what takes long, once
def refuse(**_):
    raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))
for free, words in (*((free, ["encode", "a.yaml", "-o", "out.txt"]) for free in range(4)), (0, ["encod"]), (0, [])):
    read, write = os.pipe()
    if not os.fork():
        os.dup2(write, 2)
        os.closerange(3, 256)
        resource.setrlimit(resource.RLIMIT_NOFILE, (3 + free, 3 + free))
        sys.argv[1:] = words
        if words:
            del sys.modules["pidcfg.cli.main"]
        else:
            program.cli = refuse
        program.main()
    os.close(write)
    with open(read) as said:
        text = said.read()
    print(repr((os.waitstatus_to_exitcode(os.wait()[1]), text, sorted(os.listdir()))))
"""


@POSIX
def test_where_few_files_may_be_open_a_command_works_or_says_so(tmp_path):
    (tmp_path / "a.yaml").write_text(GOOD, "utf-8")
    command = [sys.executable, "-c", FEW]
    done = subprocess.run(command, cwd=tmp_path, env=environment(), capture_output=True, text=True, check=True)
    none, one, two, (code, _, files), usage, refused = map(ast.literal_eval, done.stdout.splitlines())
    assert (code, files) == (0, ["a.yaml", "out.txt"])
    for code, text, left in (none, one, two):
        assert (code, left) == (2, ["a.yaml"])
        assert "Too many open files" in text.splitlines()[0]
    assert usage[:2] == (2, "Error: no such command: encod; did you mean encode?\n")
    assert refused[:2] == (2, "Error: cannot write or read: Too many open files\n")


@POSIX
def test_the_command_line_sets_the_handlers_and_the_api_does_not():
    code = "import signal as s, pidcfg.api as api; api.check_text('a: 1'); print(s.getsignal(s.SIGTERM) is s.SIG_DFL)"
    shown = subprocess.run([sys.executable, "-c", code], env=environment(), capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "True"


@pytest.mark.parametrize(
    ("code", "printed"), [(130, "said registered left"), (143, "said registered left"), (2, "said registered")]
)
def test_an_ended_command_does_not_wait_until_it_is_taken_apart(code, printed):
    end = (
        "import atexit, os\nfrom pidcfg import __main__ as program\nfrom pidcfg.cli import main\n"
        "leave = os._exit\nos._exit = lambda code: (os.write(1, b'left'), leave(code))\n"
        f"def run(): print('said'); raise SystemExit({code})\n"
        "atexit.register(print, 'registered', flush=True)\nmain.main = run\nprogram.main()"
    )
    done = subprocess.run([sys.executable, "-c", end], env=environment(), capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.split()) == (code, printed.split())


@POSIX
@pytest.mark.parametrize(("words", "code"), [(["validate", "none.yaml"], 2), (["--version"], 0)])
def test_a_signal_at_the_very_end_changes_nothing(tmp_path, words, code):
    end = (
        "import os, signal, sys\nfrom pidcfg.cli import interrupts, main\nreal = interrupts.finish_command\n"
        "def over():\n    real()\n    os.kill(os.getpid(), signal.SIGTERM); os.kill(os.getpid(), signal.SIGINT)\n"
        f"interrupts.finish_command = over\nsys.argv[1:] = {words}\nmain.main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", end], cwd=tmp_path, env=environment(), capture_output=True, check=False
    )
    assert (done.returncode, b"Traceback" in done.stderr) == (code, False)


@POSIX
@pytest.mark.usefixtures("heeding_interrupts")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130), (0, 3)])
def test_a_signal_of_which_a_library_makes_an_error_of_its_own_is_no_bug(number, code):
    """pydantic does while it builds a model: SchemaError, with the text of whatever was raised."""
    end = (
        "import os, signal, sys\nfrom pidcfg.cli import main\ndef cli(**_):\n"
        f"    try:\n        os.kill(os.getpid(), {int(number)}); os.stat('.'); raise ValueError\n"
        "    except BaseException as error:\n        raise ValueError(repr(error)) from None\n"
        "main.cli = cli\nmain.main()"
    )
    done = subprocess.run([sys.executable, "-c", end], env=environment(), capture_output=True, text=True, check=False)
    assert (done.returncode, "This is a bug" in done.stderr) == (code, code == 3)


def test_a_part_that_is_whole_ends_before_its_signal_counts(monkeypatch):
    monkeypatch.setattr(interrupts._SignalState, "has_begun", True)
    done = []
    with pytest.raises(interrupts.Terminated), interrupts.defer_signals():  # noqa: PT012 - the end of the block raises it
        interrupts._take_signal(signal.SIGTERM, None)
        with interrupts.defer_signals():
            done.append(1)
        done.append(2)
    assert done == [1, 2]
    with interrupts.defer_signals():
        pass


STARTED = """
import os, signal, sys
class Finder:
    def find_spec(self, name, *_):
        self.left -= name not in {"pidcfg", "pidcfg.__main__"}  # before these there is no line of ours
        if not self.left:
            os.kill(os.getpid(), signal.SIGINT)
import click  # what takes long, once
for name in ("signal", "contextlib", "typing", "enum"):
    sys.modules.pop(name, None)
count, code = 0, None
while code != 0:
    count += 1
    read, write = os.pipe()
    if not (child := os.fork()):
        os.dup2(write, 1), os.dup2(write, 2)
        Finder.left, sys.argv[1:] = count, ["--version"]
        sys.meta_path.insert(0, Finder())
        from pidcfg.__main__ import main
        main()
    os.close(write)
    with open(read) as said:
        text = said.read()
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    print(code, repr(text))
"""


@POSIX
@pytest.mark.usefixtures("heeding_interrupts")
def test_ctrl_c_at_each_import_of_the_start_shows_no_traceback():
    command = [sys.executable, "-c", STARTED]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=True)
    *ended, whole = done.stdout.splitlines()
    assert whole == f"0 'pidcfg, version {pidcfg.__version__}\\n'"
    assert len(ended) >= 10
    assert set(ended) == {"130 ''"}


@POSIX
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a disk that is full")
def test_remarks_that_cannot_be_written_change_no_exit_code(tmp_path):
    (tmp_path / "a.yaml").write_text(GOOD, "utf-8")
    command = [sys.executable, "-m", "pidcfg"]
    with Path("/dev/full").open("wb") as full:
        for words, code in ((["validate", "a.yaml"], 0), (["validate", "none.yaml"], 2), (["nonsense"], 2)):
            done = subprocess.run(
                [*command, *words], cwd=tmp_path, env=environment(), stdout=subprocess.DEVNULL, stderr=full, check=False
            )
            assert done.returncode == code, words


# --- options ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("option", ["gain", "time-constant", "dead-time", "sample-time"])
@pytest.mark.parametrize("value", ["0", "-1", "1e13", "nan"])
def test_a_number_of_tune_is_finite_and_not_nothing(monkeypatch, capsysbinary, option, value):
    words = {"gain": "2", "time-constant": "10", "dead-time": "1", "sample-time": "0.5", option: value}
    given = [word for name, number in words.items() for word in (f"--{name}", number)]
    found = call(monkeypatch, capsysbinary, "tune", "--method", "zn-open", *given)
    assert (found.code, f"--{option}" in found.err) == ((0, False) if (option, value) == ("gain", "-1") else (2, True))


@pytest.mark.parametrize(
    "text", ["V2000 hunter2", "address,hex\nhunter2,1", '{"version": "hunter2", "words": []}', "hunter2"]
)
def test_a_file_that_a_scenario_names_outside_of_its_folder_is_not_quoted(tmp_path, text):
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "secret.txt").write_text(text, "utf-8")
    (inner / "secret.txt").write_text(text, "utf-8")
    for name, quoted in (("../secret.txt", False), ("secret.txt", text != "hunter2")):
        (inner / "a.scenario.yaml").write_text(f"pidcfg: 1\nscenario: x\nconfig: {name}\nduration: 1\n", "utf-8")
        found = check(inner / "a.scenario.yaml").findings
        assert any("secret.txt: line" in d.message for d in found)
        assert ("hunter2" in repr(found)) == quoted


def test_no_command_quotes_a_file_outside_of_the_folder(tmp_path, monkeypatch, capsysbinary):
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / ".env").write_text("KEY=hunter2,abc", "utf-8")
    plc = "pidcfg: 1\nvendor: ezlogix\nplc: {map: ../.env}\n"
    oven = EZLOGIX.read_text("utf-8").partition("loops:\n")[2]
    (inner / "a.yaml").write_text(f"{plc}loops:\n{oven}", "utf-8")
    (inner / "a.scenario.yaml").write_text("pidcfg: 1\nscenario: x\nconfig: ../.env\nduration: 1\n", "utf-8")
    lines = ("validate --no-cache", "validate --no-cache --format json", "simulate", "encode --format modbus")
    for line in lines:
        for name in ("a.yaml", "a.scenario.yaml"):
            found = call(monkeypatch, capsysbinary, *line.split(), inner / name)
            assert "hunter2" not in found.out + found.err, (line, name)
            assert found.code in {1, 2} or (line, name) == ("simulate", "a.yaml"), (line, name)


# --- numbers ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", ["1_0", "\u0661\u0662", "\u00b2", "9" * 5000])
@pytest.mark.parametrize(
    "words",
    [
        "validate a.yaml --limit loops={}",
        "certify a.yaml --samples {}",
        "certify a.yaml --seed {}",
        "diff a.yaml a.yaml --jobs {}",
        "tune --method simc --gain {} --time-constant 60 --dead-time 5",
        "convert a.yaml --to click --max-deviation {}",
        "convert a.yaml --to click --max-loss gain={}%",
        "compare a.yaml --plc modbus://127.0.0.1:1 --watch {}",
    ],
)
def test_an_option_takes_a_number_as_everybody_writes_it(tmp_path, monkeypatch, capsysbinary, words, number):
    """Python reads digits of all scripts, and 1_0 as 10."""
    (tmp_path / "a.yaml").write_text(GOOD, "utf-8")
    monkeypatch.chdir(tmp_path)
    found = call(monkeypatch, capsysbinary, *words.format(number).split())
    assert (found.code, "This is a bug" in found.err) == (2, False)
    assert "Error: " in found.err


@pytest.mark.parametrize(("number", "code"), [("0" * 5000 + "7", 2), ("007", 0), ("0", 2), ("-7", 2)])
def test_a_limit_is_a_whole_number_above_0(tmp_path, monkeypatch, capsysbinary, number, code):
    (tmp_path / "a.yaml").write_text(GOOD, "utf-8")
    found = call(monkeypatch, capsysbinary, "validate", tmp_path / "a.yaml", "--limit", f"loops={number}")
    assert (found.code, "write NAME=VALUE" in found.err) == (code, code == 2)


@pytest.mark.parametrize("digits", [4096, 4097])
def test_a_number_without_end_in_a_listing_is_refused_where_it_stands(tmp_path, monkeypatch, capsysbinary, digits):
    (tmp_path / "a.lst").write_text(f"table,register,value\nholding,{'0' * (digits - 4)}1024,1\n", "utf-8")
    found = call(monkeypatch, capsysbinary, "decode", tmp_path / "a.lst", "--vendor", "dl06")
    told = "a.lst:2:9: error PID041: a number of 4097 digits; the limit is 4096"
    assert (found.code, "This is a bug" in found.err, told in found.err) == (2, False, digits == 4097)


@pytest.mark.parametrize("vendor", ["ezlogix", "nextopid", "dpide"])
def test_a_modbus_listing_by_a_map_is_refused_with_what_to_do(tmp_path, monkeypatch, capsysbinary, vendor):
    (tmp_path / "m.csv").write_text("table,register,value\nholding,0,1\n", "utf-8")
    found = call(monkeypatch, capsysbinary, "decode", tmp_path / "m.csv", "--vendor", vendor)
    told = "m.csv:1:1: error PID041: this is a Modbus listing, whose registers only a map of the project explains: "
    assert (found.code, told in found.err) == (2, True)
    assert "or read the PLC itself with 'pidcfg pull --map'" in found.err


@pytest.mark.parametrize("time", ['"abc"', "[1]", '{"a": 1}', "true"])
def test_a_program_whose_comments_say_no_time_of_its_task_is_refused(tmp_path, monkeypatch, capsysbinary, time):
    examples = Path(__file__).parents[1] / "examples"
    text = pidcfg.encode(examples / "nextopid/cascade.yaml", "plcopen").text
    assert '"sample_time": 0.2' in text
    (tmp_path / "a.xml").write_text(text.replace('"sample_time": 0.2', f'"sample_time": {time}'), "utf-8")
    found = call(monkeypatch, capsysbinary, "decode", tmp_path / "a.xml", "--vendor", "nextopid")
    assert (found.code, "and the comments say" in found.err) == (2, True)


# --- plants ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ("model: second_order, time_constant: 1e-300, damping: 1", "time_constant"),
        ("model: second_order, time_constants: [1e-200, 1e-200]", "time_constants"),
        ("model: lead_lag, lead: 1e12, lag: 1e-300", "lag"),
    ],
)
@pytest.mark.parametrize("number", ["1e-13", "1e-300"])
def test_a_plant_so_fast_that_its_numbers_are_lost_is_refused(tmp_path, monkeypatch, capsysbinary, keys, key, number):
    (tmp_path / "a.yaml").write_text(GOOD, "utf-8")
    scenario = tmp_path / "a.scenario.yaml"
    text = f"pidcfg: 1\nscenario: x\nconfig: a.yaml\nduration: 60\nplants:\n  A: {{{keys}}}\n"
    scenario.write_text(text.replace("1e-200", "1e-300").replace("1e-300", number), "utf-8")
    found = call(monkeypatch, capsysbinary, "simulate", scenario)
    assert (found.code, f"{key} is below 1e-12" in found.out + found.err) == (2, True)
    scenario.write_text(text.replace("1e-200", "1e-300").replace("1e-300", "1e-12"), "utf-8")
    assert call(monkeypatch, capsysbinary, "simulate", scenario).code in {0, 1}
