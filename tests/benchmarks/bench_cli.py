"""How fast the command is, as ratios to yardsticks measured in the same run.

Run it with ``python tests/benchmarks/bench_cli.py [--quick]``. What is compared takes turns, so that a busy machine
slows both. CPU is user and system time of the process, where the system tells it. Start-up is judged by CPU, which
other programs disturb least; many files by wall time, since they are shared out among the processors.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from rounds import QUICK_ROUNDS, ROUNDS, Times, beside, is_quick

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples" / "dl06").glob("*.yaml"))
REACTOR = str(ROOT / "examples" / "dl06" / "reactor.yaml")
FILES, QUICK_FILES = 1000, 200
LOOPS = (250, 500, 1000)
"""Loops, each with a finding, in a file whose findings are printed."""
LOOP = (
    "  - {{name: L{}, sample_time: 1 s, tuning: {{gain: 1, integral_time: 20 s}}, output_raises_pv: true,\n"
    "     pv: {{range: [0, 10]}}, setpoint: {{value: {}}}, output: {{range: [0, 100]}}}}\n"
)
"""A loop whose set point is out of range, each with a number of its own: no two findings are told as one."""
PRINTED_GOAL = 0.7
"""Seconds for the most of them."""
TWICE = 2.6
"""Twice as many findings may take this much longer: more is not linear."""
BIN = Path(sys.executable).parent
PIDCFG = (sys.executable, "-m", "pidcfg")
YARDSTICK = str(BIN / "check-jsonschema")
ONE_FILE = (0.95, 0.6)
"""validate one file / check-jsonschema --version: anew, and from the cache."""
MANY_FILES = (2.0, 8.0)
"""check-jsonschema / validate on the same files."""


@dataclass(frozen=True)
class Side:
    """A command; ``before`` is done before each run and takes no time of it."""

    command: Sequence[str]
    before: Callable[[], None] = lambda: None
    codes: tuple[int, ...] = (0,)


def children() -> float:
    """CPU seconds of all child processes so far; 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0.0
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def clock(side: Side) -> tuple[float, float]:
    """CPU and wall seconds of one run, which must end well."""
    side.before()
    cpu, wall = children(), time.perf_counter()
    done = subprocess.run(side.command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode not in side.codes:
        sys.exit(f"{' '.join(side.command[:4])} ... ended with exit code {done.returncode}\n{done.stderr[-2000:]}")
    wall = time.perf_counter() - wall
    return children() - cpu or wall, wall


def race(sides: Mapping[str, Side], rounds: int) -> tuple[dict[str, Times], dict[str, Times]]:
    """CPU and wall times of all sides, once for nothing, then in turn."""
    runs: dict[str, list[tuple[float, float]]] = {name: [] for name in sides}
    for side in sides.values():
        clock(side)
    for _ in range(rounds):
        for name, side in sides.items():
            runs[name].append(clock(side))
    cpu, wall = ({name: Times(tuple(run[i] for run in runs[name])) for name in sides} for i in (0, 1))
    return cpu, wall


def told(title: str, value: tuple[float, float], goal: str = "") -> None:
    """One line of the report: the ratio of the medians, that of the minima, and the goal."""
    print(f"{title:<64} {value[0]:6.2f} ({value[1]:.2f})  {goal}", flush=True)


def share(over: Times, under: Times) -> tuple[float, float]:
    """The ratio of the medians and that of the minima."""
    return over.median / under.median, over.least / under.least


def one_file(rounds: int) -> None:
    """What an editor or a pre-commit hook waits for."""
    sides = {
        "theirs": Side((YARDSTICK, "--version")),
        "cold": Side((*PIDCFG, "validate", "--no-cache", REACTOR)),
        "kept": Side((*PIDCFG, "validate", REACTOR)),
        "version": Side((*PIDCFG, "--version")),
        "click": Side((sys.executable, "-c", "import click")),
    }
    cpu, _ = race(sides, rounds)
    cold, kept = share(cpu["cold"], cpu["theirs"]), share(cpu["kept"], cpu["theirs"])
    told("validate one file / check-jsonschema --version (CPU)", cold, beside(cold[0], ONE_FILE[0], most=True))
    told("validate one unchanged file / the same (CPU)", kept, beside(kept[0], ONE_FILE[1], most=True))
    told("pidcfg --version / import click (CPU)", share(cpu["version"], cpu["click"]))


def many_files(folder: Path, cache: Path, rounds: int, count: int) -> None:
    """A repository of configurations."""
    sources = [text for text in (path.read_text("utf-8") for path in EXAMPLES) if "\nvendor:" in text]
    names = []
    for number in range(count):
        path = folder / f"{number:04}.yaml"
        path.write_text(f"# copy {number}\n{sources[number % len(sources)]}", "utf-8", newline="\n")
        names.append(str(path))
    schema = str(folder / "dl06.schema.json")
    subprocess.run([*PIDCFG, "schema", "dl06", "-o", schema], check=True)
    validate = (*PIDCFG, "validate", "--quiet", *names)
    sides = {
        "theirs": Side((YARDSTICK, "--schemafile", schema, *names)),
        "cold": Side(validate, lambda: shutil.rmtree(cache, ignore_errors=True)),
        "kept": Side(validate),
    }
    _, wall = race(sides, rounds)
    for name, what, goal in zip(("cold", "kept"), ("new", "unchanged"), MANY_FILES, strict=True):
        value = share(wall["theirs"], wall[name])
        told(f"check-jsonschema / validate, {count} {what} files (wall)", value, beside(value[0], goal))


def findings(folder: Path, rounds: int) -> None:
    """Text output of a file with a finding a loop."""
    sides = {}
    for count in LOOPS:
        path = folder / f"loops-{count}.yaml"
        rows = "".join(LOOP.format(i, 1000 + i) for i in range(count))
        path.write_text(f"pidcfg: 1\nvendor: generic\nloops:\n{rows}", "utf-8", newline="\n")
        sides[str(count)] = Side((*PIDCFG, "validate", "--no-cache", str(path)), codes=(0, 1))
    cpu, _ = race(sides, rounds)
    most = cpu[str(LOOPS[-1])]
    goal = beside(most.median, PRINTED_GOAL, most=True)
    told(f"findings of {LOOPS[-1]} loops as text, seconds (CPU)", (most.median, most.least), goal)
    for fewer, more in pairwise(LOOPS):
        value = share(cpu[str(more)], cpu[str(fewer)])
        told(f"findings of {more} loops / of {fewer} (CPU)", value, beside(value[0], TWICE, most=True))


IMPORTS = """
import json, sys
from pidcfg.cli.main import main
sys.argv = ["pidcfg", *json.loads(sys.argv[1])]
try:
    main()
except SystemExit:
    pass
print(json.dumps(sorted({name.split(".")[2] for name in sys.modules if name.startswith("pidcfg.schemas.")})),
      file=sys.stderr)
"""
VENDORS = {"dl06", "click", "ezlogix", "nextopid", "dpide", "generic"}


def asked_for(rounds: int) -> None:
    """Commands that need one vendor, or none."""
    commands = {
        "encode one file": ("encode", REACTOR),
        "rule PID101": ("rule", "PID101"),
        "explain V7642=0008": ("explain", "V7642=0008"),
    }
    sides = {name: Side((*PIDCFG, *words)) for name, words in commands.items()}
    cpu, _ = race({"click": Side((sys.executable, "-c", "import click")), **sides}, rounds)
    for name, words in commands.items():
        command = [sys.executable, "-c", IMPORTS, json.dumps(words)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        loaded = sorted(VENDORS & set(json.loads(done.stderr.splitlines()[-1])))
        told(
            f"{name} / import click (CPU)",
            share(cpu[name], cpu["click"]),
            f"vendors loaded: {', '.join(loaded) or '-'}",
        )


def _keep_bytecode(folder: Path) -> None:
    """Lets all sides run compiled, as an installer leaves them, whatever this shell says; the first run compiles."""
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = str(folder)


def main() -> None:
    """All of them, with a cache and compiled sources of their own."""
    quick = is_quick("how fast the command is")
    rounds = QUICK_ROUNDS if quick else ROUNDS
    print(f"{'The command: ratios of the medians (of the minima)':<64}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ["PIDCFG_CACHE_DIR"] = str(folder / "cache")
        _keep_bytecode(folder / "bytecode")
        one_file(rounds)
        findings(folder, rounds)
        asked_for(rounds)
        many_files(folder, folder / "cache", rounds, QUICK_FILES if quick else FILES)


if __name__ == "__main__":
    main()
