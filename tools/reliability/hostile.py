"""Files that mean harm, for every input of every command, and what commands may do with them.

A file is a sound one that was spoiled in one of `SPOILS`' ways; the same seed gives the same bytes. Commands run in
this process, on streams of a code page, and must end with a declared exit code, without a traceback and in time.
"""

from __future__ import annotations

import io
import os
import random
import re
import resource
import signal
import sys
import time
import zlib
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from pidcfg.api import encode
from pidcfg.cli import main as command_line
from pidcfg.cli import terminal as glyphs
from reliability import small

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
CODE_PAGES = (("utf-8", "strict"), ("ascii", "strict"), ("cp1252", "strict"), ("ascii", "surrogateescape"))
"""UTF-8, ASCII, a code page of Windows, and what Python makes of the locale C."""
NAMES = ("", "x\n::error::x", "\x1b[31mx\n::error::x", "\udcff", "\u202e") if os.name == "posix" else ("",)
"""What the name of a file begins with; most systems but Windows take any byte."""
SHOWN = re.compile("[\x1b\x07\x9b\u202e\u2066]|^::error::x", re.MULTILINE)
"""What must reach no terminal and no log."""
FILES = {"export", "decode", "--into"}
"""What prints a file, in the words of another one: as they are, unless a terminal shows it."""
DECLARED = {0, 1, 2}
SECONDS = 20
"""Of CPU for a command; what takes longer counts as a hang."""
CONFIGURATIONS = {
    "dl06": "dl06/reactor.yaml",
    "click": "click/tank.yaml",
    "ezlogix": "ezlogix/oven.yaml",
    "nextopid": "nextopid/cascade.yaml",
    "dpide": "dpide/oven.yaml",
    "generic": "generic/boiler.yaml",
}
LISTINGS = {
    "dl06": ("text", "csv", "json", "modbus", "ihex"),
    "click": ("text", "json", "nickname-csv", "cdv"),
    "ezlogix": ("text", "json", "tags"),
    "nextopid": ("text", "json", "st", "plcopen"),
    "dpide": ("text", "json", "st", "operands", "symbols"),
    "generic": ("text", "csv", "json"),
}
RECORD = "time,out,pv\n" + "".join(
    f"{t},{0 if t < 10 else 20},{50 if t < 14 else 50 + 30 * (1 - 0.9 ** (t - 14)):.3f}\n" for t in range(0, 90, 2)
)
SETTINGS = 'select = ["DL", "PID"]\nstrict = true\nseverity = "info"\n[per-file-ignores]\n"old/**" = ["DL222"]\n'
SCENARIO = """\
pidcfg: 1
scenario: a step
config: base.yaml
duration: 60
signals: {demand: 2}
plants:
  FIC-102: {model: first_order, gain: 0.5, time_constant: 3, dead_time: 0.4}
  TIC-101: {model: first_order, input: FIC-102.PV + min(demand, 10) - sqrt(4) / (1 + abs(-3)), gain: 4.0,
    time_constant: 240, dead_time: 15}
  LIC-103: {model: integrator, gain: -0.02, load: 1.0}
events:
  - {at: 10, loop: TIC-101, set: {setpoint: 80}}
expect:
  - {loop: TIC-101, metric: overshoot, max: 20 %}
"""


@dataclass(frozen=True)
class Case:
    """A file, and the command lines that read it under the name ``{}``."""

    name: str
    data: bytes
    commands: tuple[tuple[str, ...], ...]


@dataclass
class Figures:
    """What a run has found."""

    files: int = 0
    executions: int = 0
    tracebacks: int = 0
    bugs: int = 0
    hangs: int = 0
    slowest: float = 0.0
    memory: int = 0
    failures: list[str] = field(default_factory=list)


# --- spoils ----------------------------------------------------------------------------------------------------------


def _at(data: bytes, rng: random.Random) -> int:
    return rng.randrange(len(data) + 1)


def _insert(data: bytes, rng: random.Random, what: bytes) -> bytes:
    at = _at(data, rng)
    return data[:at] + what + data[at:]


def _number(data: bytes, rng: random.Random, value: bytes) -> bytes:
    found = list(re.finditer(rb"\d+(?:\.\d+)?", data))
    match = rng.choice(found)
    return data[: match.start()] + value + data[match.end() :]


def _word(data: bytes, rng: random.Random, value: bytes) -> bytes:
    match = rng.choice(list(re.finditer(rb"[A-Za-z_]{3,}", data)))
    return data[: match.start()] + value + data[match.end() :]


def _lines(data: bytes, rng: random.Random, times: int) -> bytes:
    rows = data.split(b"\n")
    at = rng.randrange(len(rows))
    return b"\n".join(rows[:at] + [rows[at]] * times + rows[at:])


NUMBERS = (b"1e1000000000000000000", b"-0", b"1e400", b"nan", b"9" * 5000, b"0x" + b"F" * 300, b"1e-9999999999", b"1_0")
WORDS = (
    b"\x1b[31m::error::x", "\u202e\u2028".encode(), b"__class__", b"../../../etc/passwd", b"CON", b"=1+1", b"<script>",
    b'"\\e[31mx\\n::error::x"',
    b"${IFS}", b"%n%s", b"a" * 5000, b"a." * 3000 + b"a", b"*x", b"&x [*x]", b"!!python/object:os.system", b"<<",
)  # fmt: skip

SPOILS = {
    "cut": lambda data, rng: data[: _at(data, rng)],
    "head gone": lambda data, rng: data[_at(data, rng) :],
    "empty": lambda *_: b"",
    "zeros": lambda *_: b"\0" * 100,
    "byte": lambda data, rng: _insert(data, rng, bytes([rng.randrange(256)])),
    "escape": lambda data, rng: _insert(data, rng, b"\x1b]0;x\x07\r\n::error::forged\n"),
    "utf-16": lambda data, _: data.decode().encode("utf-16"),
    "latin-1": lambda data, rng: _insert(data, rng, b"\xe9\xb0"),
    "surrogate": lambda data, rng: _insert(data, rng, b"\xed\xa0\x80"),
    "marks": lambda data, _: b"\xef\xbb\xbf" * 2 + data,
    "separators": lambda data, _: data.replace(b"\n", "\u2028".encode()),
    "carriage": lambda data, _: data.replace(b"\n", b"\r"),
    "number": lambda data, rng: _number(data, rng, rng.choice(NUMBERS)),
    "numbers": lambda data, rng: re.sub(rb"\d+", lambda _: rng.choice(NUMBERS), data),
    "word": lambda data, rng: _word(data, rng, rng.choice(WORDS)),
    "brackets": lambda data, rng: _insert(data, rng, rng.choice((b"[", b"{", b"(", b"<a>")) * 3000),
    "closing": lambda data, rng: _insert(data, rng, rng.choice((b"]", b"}", b")", b"</a>", b'"', b"'"))),
    "line again": lambda data, rng: _lines(data, rng, 2),
    "line often": lambda data, rng: _lines(data, rng, 3000),
    "long line": lambda data, rng: _insert(data, rng, b"x" * 200_000),
    "shuffled": lambda data, rng: b"\n".join(rng.sample(rows := data.split(b"\n"), len(rows))),
    "sign": lambda data, rng: _insert(data, rng, rng.choice((b"-", b":", b"#", b"*", b"&", b"%", b",", b";", b"|"))),
    "twice": lambda data, _: data + data,
    "noise": lambda _, rng: rng.randbytes(2000),
}


# --- sound files, and who reads them ---------------------------------------------------------------------------------


@cache
def sources() -> dict[str, tuple[bytes, tuple[tuple[str, ...], ...]]]:
    """Every kind of input by name, with the commands that read it."""
    found: dict[str, tuple[bytes, tuple[tuple[str, ...], ...]]] = {}
    for vendor, name in CONFIGURATIONS.items():
        data = (EXAMPLES / name).read_bytes()
        other = "click" if vendor != "click" else "dl06"
        found[f"{vendor}.yaml"] = data, (
            ("validate", "{}"), ("validate", "{}", "--format", "github"), ("validate", "{}", "--format", "json"),
            ("validate", "{}", "--diff"), ("encode", "{}", "--allow-errors"), ("convert", "{}", "--to", other),
            ("diff", "{}", "base.yaml"), ("explain", "--in", "{}", "V2000"), ("export", "{}"),
            ("export", "{}", "--format", "csv"), ("report", "{}", "-o", "-"), ("validate", "{}", "--format", "junit"),
        )  # fmt: skip
        for kind in LISTINGS[vendor]:
            files = encode(EXAMPLES / name, kind).files
            for ending, text in files.items():
                found[f"{vendor}-{kind}{ending or '.txt'}"] = text.encode(), (
                    ("decode", "{}", "--vendor", vendor), ("decode", "{}", "--vendor", vendor, "--annotate"),
                    ("diff", "{}", str(EXAMPLES / name)),
                )  # fmt: skip
    found["a.scenario.yaml"] = SCENARIO.encode(), (
        ("validate", "{}"), ("simulate", "{}", "--engine", "python", "--limit", "loop_steps=20000"),
        ("certify", "{}", "--samples", "1", "--limit", "loop_steps=20000"),
    )  # fmt: skip
    found["record.csv"] = RECORD.encode(), (("tune", "--method", "simc", "--step", "{}"), ("init", "--from", "{}"))
    found["pidcfg.toml"] = SETTINGS.encode(), (("validate", "base.yaml", "--config", "{}"),)
    found["baseline.json"] = b'{"version": 2, "findings": []}', (("validate", "base.yaml", "--baseline", "{}"),)
    found["sheet.csv"] = b"vendor,dl06\nname,X\nname,mode,tuning.gain\nA,auto,1\nB,auto,2\n", (
        ("init", "--from", "{}"), ("init", "--vendor", "dl06", "--from", "{}"),
    )  # fmt: skip
    found["sheet.xlsx"] = small.packed(small.parts()), (("init", "--from", "{}"),)
    found["map.csv"] = b"symbol,table,register,type\nR0,holding,0,uint16\nS0,coil,0,bool\n", (
        ("encode", str(EXAMPLES / "ezlogix/oven.yaml"), "--format", "modbus", "--map", "{}"),
    )  # fmt: skip
    found["names.csv"] = encode(EXAMPLES / "click/tank.yaml", "nickname-csv").text.encode(), (
        ("encode", str(EXAMPLES / "click/tank.yaml"), "--format", "nickname-csv", "--into", "{}"),
    )  # fmt: skip
    found["kept.state"] = b"0" * 64 + b'\n{"key": "x", "tally": {}, "trial": [0, ""], "ahead": []}\n', (
        ("certify", str(EXAMPLES / "dpide/chiller.scenario.yaml"), "--samples", "1", "--resume", "{}"),
    )  # fmt: skip
    return found


def cases(seed: int, rounds: int = 1) -> list[Case]:
    """Every kind of input spoiled in every way, ``rounds`` times."""
    found = []
    for kind, (data, commands) in sources().items():
        for spoil, spoiled in SPOILS.items():
            for number in range(rounds):
                rng = random.Random(f"{seed} {kind} {spoil} {number}")
                try:
                    text = spoiled(data, rng)
                except (UnicodeDecodeError, IndexError):  # nothing of that kind in it
                    continue
                found.append(Case(f"{spoil.replace(' ', '-')}-{number}-{kind}", text, commands))
    return found


# --- running ---------------------------------------------------------------------------------------------------------


class HangError(BaseException):
    """A command that takes too long."""


def _hangs(*_: object) -> None:
    raise HangError


class _Stream(io.TextIOWrapper):
    """A stream of a code page that keeps what was written."""

    def text(self) -> str:
        self.flush()
        return self.buffer.getvalue().decode("utf-8", "replace")  # type: ignore[attr-defined]


def command(words: list[str], code_page: tuple[str, str] = CODE_PAGES[0]) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a command in this process; -1: it was ended for its time."""
    encoding, errors = code_page
    streams = [_Stream(io.BytesIO(), encoding=encoding, errors=errors) for _ in range(2)]
    before = sys.stdout, sys.stderr, sys.argv
    sys.stdout, sys.stderr, sys.argv = *streams, ["pidcfg", *words]
    glyphs.install_fallback()
    signal.signal(signal.SIGVTALRM, _hangs)
    signal.setitimer(signal.ITIMER_VIRTUAL, SECONDS)
    try:
        command_line.main()
        code = 0
    except SystemExit as end:
        code = int(end.code or 0)
    except HangError:
        code = -1
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        sys.stdout, sys.stderr, sys.argv = before
    return code, streams[0].text(), streams[1].text()


def judge(case: Case, folder: Path, code_page: tuple[str, str], figures: Figures, only: int | None = None) -> None:
    """Runs the commands of a case in a folder, or one of them; what must not be is counted and told."""
    name = re.sub(r"[^\w.-]", "", case.name)
    name = f"{NAMES[zlib.crc32(name.encode()) % len(NAMES)]}{name}"
    (folder / name).write_bytes(case.data)
    figures.files += 1
    commands = case.commands if only is None else [case.commands[only % len(case.commands)]]
    for words in commands:
        line = [name if word == "{}" else word for word in words]
        begin = time.process_time()
        code, out, err = command(line, code_page)
        taken = time.process_time() - begin
        figures.executions += 1
        figures.slowest = max(figures.slowest, taken)
        traceback = "Traceback (most recent call last)" in out + err
        figures.tracebacks += traceback
        figures.bugs += code == 3
        figures.hangs += code == -1
        escapes = None if FILES & {*words} else SHOWN.search(f"{out}\n{err}")
        if code not in DECLARED or traceback or escapes:
            last = err.strip().splitlines()[-2:]
            figures.failures.append(f"{' '.join(line)} [{code_page[0]}]: exit {code}, {taken:.1f} s: {last}")
    (folder / name).unlink()
    figures.memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def prepare(folder: Path) -> None:
    """The sound files that commands read beside the spoiled one."""
    (folder / "base.yaml").write_bytes((EXAMPLES / CONFIGURATIONS["dl06"]).read_bytes())
