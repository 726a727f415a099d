"""What an input that means harm, or an end at a bad moment, must not do: each was seen once."""

from __future__ import annotations

import ast
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

import pidcfg
from living_rig import GOOD, TWICE, call, run
from pidcfg.api import check, check_text
from pidcfg.cli import interrupts
from pidcfg.cli.files import outputs, temporary
from pidcfg.cli.files.edited import difference
from pidcfg.encoders.ihex import read_ihex
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.nextopid.plcopen_read import read_plcopen
from pidcfg.encoders.nextopid.st_read import read_st
from pidcfg.limits import DEFAULT
from pidcfg.listings import read_listing
from pidcfg.store import Store
from pidcfg.vendors import VENDORS

SOURCE = Path(__file__).parents[1] / "src" / "pidcfg"
EZLOGIX = Path(__file__).parents[1] / "examples" / "ezlogix" / "oven.yaml"
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
        factors.append(calls["factor"])
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


@POSIX
@pytest.mark.parametrize("where", ["config", "baseline", "settings", "input"])
def test_nothing_waits_at_a_pipe_with_a_name(tmp_path, monkeypatch, capsysbinary, where):
    pipe, file = tmp_path / "pipe", tmp_path / "a.yaml"
    os.mkfifo(pipe)
    keep_open = os.open(pipe, os.O_RDWR | os.O_NONBLOCK)  # a reader would find it empty instead of waiting for ever
    os.set_blocking(keep_open, False)
    file.write_text(GOOD, "utf-8")
    scenario = tmp_path / "a.scenario.yaml"
    scenario.write_text("pidcfg: 1\nscenario: x\nconfig: pipe\nduration: 1\n", "utf-8")
    arguments = {
        "config": (scenario,),
        "baseline": (file, "--baseline", pipe),
        "settings": (file, "--config", pipe),
        "input": (pipe,),
    }
    signal.alarm(20)
    found = run(monkeypatch, capsysbinary, *arguments[where])
    signal.alarm(0)
    os.close(keep_open)
    assert "it is a pipe and no file" in found.out + found.err


def test_a_stream_is_no_configuration_of_a_scenario(tmp_path, monkeypatch, capsysbinary):
    (tmp_path / "a.scenario.yaml").write_text("pidcfg: 1\nscenario: x\nconfig: /dev/stdin\nduration: 1\n", "utf-8")
    assert "/dev/stdin is no file" in run(monkeypatch, capsysbinary, tmp_path / "a.scenario.yaml").out


# --- the terminal ----------------------------------------------------------------------------------------------------

WRITERS = {
    "pidcfg.cli.terminal.console": {"echo"},
    "pidcfg.cli.files.edited": {"write"},
    "pidcfg.cli.findings.corrections": {"write"},
}
"""Who writes to the streams: the one exit, and two that hand on the bytes of a user's own file."""


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
    assert difference("x\u202ey.yaml", b"a\n", b"b\n").splitlines()[:2] == [
        '--- "x\\342\\200\\256y.yaml"',
        '+++ "x\\342\\200\\256y.yaml"',
    ]


@pytest.mark.parametrize("columns", ["99999999999999999999", "1", "0", "-1", "x"])
def test_a_terminal_of_any_width_shows_a_rule(monkeypatch, capsysbinary, columns):
    monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert call(monkeypatch, capsysbinary, "rule", "DL242").code == 0


# --- writing ---------------------------------------------------------------------------------------------------------


def test_a_temporary_file_is_named_after_its_target_and_locked(tmp_path):
    target = tmp_path / "a.txt"
    handle, path = temporary.temporary_for(target)
    assert path.name.startswith(".a.txt.")
    second, other = temporary.temporary_for(target)
    assert path.exists(), "another writer's file stays while it is written"
    for number, name in ((handle, path), (second, other)):
        os.close(number)
        temporary.discard(name)
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
    kept = Store.open("x")
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
    for size, found in ((11, 123), (10, None)):
        monkeypatch.setattr("pidcfg.store.ENTRY_BYTES", 11)
        kept.put("aa2", 123)
        monkeypatch.setattr("pidcfg.store.ENTRY_BYTES", size)
        assert kept.get("aa2") == found


@POSIX
def test_the_next_run_removes_what_a_killed_one_has_left_for_its_own_target(tmp_path):
    code = (
        "import os, pathlib, signal, sys; from pidcfg.cli.files.temporary import temporary_for\n"
        "temporary_for(pathlib.Path(sys.argv[1])); os.kill(os.getpid(), signal.SIGKILL)"
    )
    for name in ("a.txt", "b.txt"):
        subprocess.run([sys.executable, "-c", code, str(tmp_path / name)], check=False, env=environment())
    left = sorted(path.name for path in tmp_path.iterdir())
    (tmp_path / ".a.txt.notes").write_text("mine", "utf-8")
    outputs.write_files({str(tmp_path / "a.txt"): "new"})
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([".a.txt.notes", left[1], "a.txt"])


def environment():
    return {**os.environ, "PYTHONPATH": str(SOURCE.parent)}


ENDED = """
import os, signal, sys, pathlib
from pidcfg import __main__
from pidcfg.cli import interrupts
from pidcfg.cli.files import outputs
real = pathlib.Path.replace
def replace(self, target):
    done = real(self, target)
    if sys.argv[-1] == "between":
        os.kill(os.getpid(), int(sys.argv[-2]))
    return done
pathlib.Path.replace = replace
stage = outputs._stage
def staged(*arguments):
    path = stage(*arguments)
    if sys.argv[-1] == "staged":
        os.kill(os.getpid(), int(sys.argv[-2]))
    return path
outputs._stage = staged
def command():
    outputs.write_files({"a": "new", "b": "new", "c": "new"}, force=True)
from pidcfg.cli import main
main._run = command
__main__.main()
"""


@POSIX
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
@pytest.mark.parametrize(("when", "content"), [("staged", {"a": "old"}), ("between", dict.fromkeys("abc", "new"))])
def test_a_signal_leaves_the_old_files_or_the_new_ones_and_nothing_else(tmp_path, number, code, when, content):
    (tmp_path / "a").write_text("old", "utf-8")
    command = [sys.executable, "-c", ENDED, str(int(number)), when]
    done = subprocess.run(command, cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False)
    assert (done.returncode, "Traceback" in done.stderr) == (code, False)
    assert {path.name: path.read_text("utf-8") for path in tmp_path.iterdir()} == content


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
        "import os, signal, sys\nfrom pidcfg.cli import errors, interrupts, main\nreal = interrupts.over\n"
        "def over():\n    real()\n    os.kill(os.getpid(), signal.SIGTERM); os.kill(os.getpid(), signal.SIGINT)\n"
        f"interrupts.over = over\nsys.argv[1:] = {words}\nmain.main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", end], cwd=tmp_path, env=environment(), capture_output=True, check=False
    )
    assert (done.returncode, b"Traceback" in done.stderr) == (code, False)


@POSIX
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


def test_a_part_that_is_whole_ends_before_its_signal_counts():
    done = []
    with pytest.raises(interrupts.Terminated), interrupts.whole():  # noqa: PT012 - the end of the block raises it
        interrupts._take(signal.SIGTERM, None)
        with interrupts.whole():
            done.append(1)
        done.append(2)
    assert done == [1, 2]
    with interrupts.whole():
        pass


@POSIX
def test_an_interrupt_while_the_program_is_loaded_shows_no_traceback(tmp_path):
    code = (
        "import builtins, sys; real = builtins.__import__\n"
        "def load(name, *rest):\n"
        "    if name == 'click': raise KeyboardInterrupt\n"
        "    return real(name, *rest)\n"
        "builtins.__import__ = load\n"
        "from pidcfg.__main__ import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], env=environment(), capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "")


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


@pytest.mark.parametrize("time", ["1e999", '"abc"', "[1]", '{"a": 1}', "true"])
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
