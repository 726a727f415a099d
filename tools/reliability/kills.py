"""Commands that write or talk to a PLC, ended at random moments: an old file or a new one stays, and nothing else.

A command runs in a copy of this process, which has the program loaded: what is left of its time is reading, work and
writing. How long that takes is measured once, and the moment drawn from the whole of it. A share of the commands is a
process of its own, which is ended while it loads, too. What the new file is a run without an end tells.
"""

from __future__ import annotations

import atexit
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import NoReturn

from pidcfg.__main__ import main
from pidcfg.cli import outputs

ROOT = Path(__file__).parents[2]
REACTOR, TANK = ROOT / "examples/dl06/reactor.yaml", ROOT / "examples/click/tank.yaml"
COMMANDS: tuple[tuple[str, ...], ...] = (
    ("encode", "a.yaml", "-o", "out.txt", "--force"),
    ("encode", "a.yaml", "--format", "json", "-o", "out.txt", "--force"),
    ("convert", "a.yaml", "--to", "generic", "--allow-loss", "-o", "out.txt", "--force"),
    ("report", "a.yaml", "-o", "out.html", "--csv", "tables", "--force"),
    ("validate", "a.yaml", "--report-output", "json=out.txt"),
    ("validate", "wrong.yaml", "--fix"),
    ("validate", "wrong.yaml", "--baseline", "base.json", "--create-baseline"),
    ("decode", "a.lst", "--vendor", "dl06", "-o", "out.txt", "--force"),
    ("export", "a.yaml", "--format", "csv", "-o", "out.txt", "--force"),
    ("init", "--vendor", "click", "-o", "out.txt", "--force"),
    ("schema", "dl06", "-o", "out.txt", "--force"),
    ("simulate", "a.scenario.yaml", "--engine", "python", "--trend", "out.txt", "--force"),
    ("diff", "a.yaml", "other.yaml", "--report-output", "markdown=out.txt"),
    ("tune", "--method", "simc", "--gain", "2", "--time-constant", "60", "--dead-time", "5", "--write", "other.yaml",
     "--force"),
)  # fmt: skip
ROWS = "rows.csv"
PLC = "PLC"
"""In a command the address of the virtual PLC, which a process of its own serves."""
LIVE: tuple[tuple[str, ...], ...] = (
    ("pull", "--plc", PLC, "--like", "tank.yaml", "-o", "out.txt", "--force"),
    ("compare", "tank.yaml", "--plc", PLC, "--report-output", "json=out.txt"),
    ("trend", "--plc", PLC, "--like", "tank.yaml", "-o", ROWS, "--interval", "0.02", "--for", "1"),
    ("serve", "tank.scenario.yaml", "--listen", "127.0.0.1:0", "--for", "1"),
)
ENDINGS = {signal.SIGTERM, signal.SIGINT}
SIGNALS = {signal.SIGTERM: 143, signal.SIGINT: 130, signal.SIGKILL: -9}
OLD = "old\n"
WRONG = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000, reset_decimals: 1}
loops:
  - name: A
    sample_rate: 1
    action: Reverse
    tuning: {gain: 1, reset: 10}
    pv: {range: [0, 100]}
"""
SCENARIO = """\
pidcfg: 1
scenario: a step
config: a.yaml
duration: 120
plants:
  FIC-102: {model: first_order, gain: 0.5, time_constant: 3, dead_time: 0.4}
  TIC-101: {model: first_order, gain: 4.0, time_constant: 240, dead_time: 15}
  LIC-103: {model: integrator, gain: -0.02, load: 1.0}
"""
STILL = """\
pidcfg: 1
scenario: nothing happens
config: tank.yaml
duration: 60
plants:
  TANK1: {model: dead_time, gain: 0, load: 140}
"""
TEXTS = {
    "wrong.yaml": WRONG,
    "a.scenario.yaml": SCENARIO,
    "tank.scenario.yaml": STILL,
    "out.txt": OLD,
    "out.html": OLD,
}
PROCESS_EVERY = 8
"""Commands of which one is a process of its own."""
LATEST = 1.2
"""The last moment, in the time that the command takes."""

Files = dict[str, bytes]


@dataclass
class Kills:
    """How many commands were ended by what, and what was left that must not be."""

    ended: dict[str, int] = field(default_factory=dict)
    finished: int = 0
    cleaned: int = 0
    """Commands that ran again after SIGKILL, and removed what was left."""
    failures: list[str] = field(default_factory=list)


def environment() -> dict[str, str]:
    """The product of this folder, without a cache."""
    return {**os.environ, "PYTHONPATH": str(ROOT / "src"), "PIDCFG_CACHE_DIR": __file__}


def prepared(folder: Path) -> None:
    """A configuration, a listing of it, and the file that is there before."""
    (folder / "a.yaml").write_bytes(REACTOR.read_bytes())
    (folder / "other.yaml").write_bytes((REACTOR.parent / "oven.yaml").read_bytes())
    (folder / "a.lst").write_bytes((REACTOR.parent / "golden" / "reactor.txt").read_bytes())
    (folder / "tank.yaml").write_bytes(TANK.read_bytes())
    for name, text in TEXTS.items():
        (folder / name).write_text(text, "utf-8")


def content(folder: Path) -> Files:
    """Every file of a folder."""
    paths = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


@cache
def plc() -> str:
    """Where the virtual PLC is that live commands read; it is there until this process ends."""
    folder = Path(tempfile.mkdtemp())
    prepared(folder)
    command = [sys.executable, "-m", "pidcfg", "serve", "tank.scenario.yaml", "--listen", "127.0.0.1:0"]
    null, pipe = subprocess.DEVNULL, subprocess.PIPE
    server = subprocess.Popen(command, cwd=folder, env=environment(), stdout=null, stderr=pipe, text=True)
    atexit.register(shutil.rmtree, folder)
    atexit.register(server.communicate)
    atexit.register(server.terminate)
    assert server.stderr is not None
    return f"modbus://{server.stderr.readline().partition(' at ')[2].partition(',')[0]}"


def started(words: tuple[str, ...], folder: Path, *, alone: bool = False) -> int:
    """The process that does a command in a folder: a copy of this one, or one of its own."""
    words = tuple(plc() if word == PLC else word for word in words)
    if alone:
        null = subprocess.DEVNULL
        command = [sys.executable, "-m", "pidcfg", *words]
        return subprocess.Popen(command, cwd=folder, env=environment(), stdout=null, stderr=null).pid
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, ENDINGS)  # until the copy is the command
    child = os.fork()
    if not child:
        _be_the_command(words, folder, mask)
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    return child


def _be_the_command(words: tuple[str, ...], folder: Path, mask: set[signal.Signals]) -> NoReturn:
    code = 3
    atexit._clear()  # what this process does at its end is none of the copy's business, but what the command does
    atexit.register(outputs._remove_all)
    try:
        for number in (signal.SIGTERM, signal.SIGVTALRM):
            signal.signal(number, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        os.chdir(folder)
        null = os.open(os.devnull, os.O_RDWR)
        for number in (0, 1, 2):
            os.dup2(null, number)
        sys.argv = ["pidcfg", *words]
        sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)  # noqa: SIM115
        main()
    except SystemExit as end:
        code = int(end.code or 0)
    except KeyboardInterrupt:  # before the handlers are set, as while a program is loaded
        code = 130
    finally:
        atexit._run_exitfuncs()
        os._exit(code)


@cache
def whole(words: tuple[str, ...]) -> tuple[Files, Files, float]:
    """The files before and after a run to its end, and the seconds it takes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepared(folder)
        before, begin = content(folder), time.monotonic()
        os.waitpid(started(words, folder), 0)
        return before, content(folder), time.monotonic() - begin


def run(kills: Kills, seed: int, number: int) -> None:
    """One command that is ended at a random moment, and what its folder then holds."""
    rng = random.Random(f"{seed} {number}")
    words, (ending, code) = rng.choice(COMMANDS + LIVE), rng.choice(list(SIGNALS.items()))
    before, after, seconds = whole(words)
    alone = number % PROCESS_EVERY == 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepared(folder)
        child = started(words, folder, alone=alone)
        time.sleep(rng.uniform(0, LATEST * seconds + alone))
        os.kill(child, ending)
        end = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        label = f"{seed} {number} {' '.join(words[:2])} {ending.name}: exit {end}"
        if end in {code, -ending}:
            kills.ended[ending.name] = kills.ended.get(ending.name, 0) + 1
        elif end in {0, 1}:
            kills.finished += 1
        else:
            kills.failures.append(f"{label}, which is none of its exit codes")
        kills.failures += [f"{label}: {fault}" for fault in _faults(content(folder), before, after, ending)]
        if ending is signal.SIGKILL:
            os.waitpid(started(words, folder), 0)
            kills.cleaned += 1
            left = set(content(folder)) - set(after) - set(before)
            kills.failures += [f"{label}: {name} is still there after the next run" for name in sorted(left)]


def whole_rows(data: bytes) -> bool:
    """Whether a file has nothing but whole rows: one that grows by a row at a time may end anywhere else."""
    lines = data.decode().splitlines(keepends=True)
    return all(line.endswith("\n") and line.count(",") == lines[0].count(",") for line in lines)


def _faults(found: Files, before: Files, after: Files, ending: signal.Signals) -> list[str]:
    """What is neither the old file nor the new one, and what is left beside them."""
    parts = [f"{name} is neither old nor new" for name, data in found.items()
             if name in before | after and data not in {before.get(name), after.get(name)}
             and not (name == ROWS and whole_rows(data))]  # fmt: skip
    gone = [f"{name} is gone" for name in before if name not in found and name in after]
    left = [f"{name} is left" for name in found if name not in before | after and ending is not signal.SIGKILL]
    return parts + gone + left
