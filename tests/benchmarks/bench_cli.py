"""How fast the command is, as ratios to yardsticks measured in the same run.

Run it with ``python tests/benchmarks/bench_cli.py``. What is compared takes turns, so that a busy machine slows both;
each ratio is one of medians. CPU is user and system time of the process, where the system tells it. Start-up is judged
by CPU, which other programs disturb least; many files by wall time, since they are shared out among the processors.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "dl06").glob("*.yaml"))
REACTOR = next(path for path in EXAMPLES if path.name == "reactor.yaml")
FILES = 1000
WIDTH = 54
BIN = Path(sys.executable).parent
PIDCFG = str(BIN / "pidcfg")
YARDSTICK = str(BIN / "check-jsonschema")


@dataclass(frozen=True)
class Race:
    """Our command against a yardstick; `aim` is the highest ratio of our time to its time that is good enough."""

    title: str
    ours: tuple[str, ...]
    theirs: tuple[str, ...]
    aim: float
    rounds: int
    judged: Literal["CPU", "wall"]


def children() -> float:
    """CPU seconds of all child processes so far; 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0.0
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def clock(command: tuple[str, ...]) -> tuple[float, float]:
    """CPU and wall seconds of one run, which must succeed."""
    cpu, wall = children(), time.perf_counter()
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command[:3])} ... ended with exit code {done.returncode}\n{done.stderr[-2000:]}")
    return children() - cpu, time.perf_counter() - wall


def hold(race: Race) -> str:
    """One line of the report."""
    ours, theirs = [], []
    for _ in range(race.rounds):
        ours.append(clock(race.ours))
        theirs.append(clock(race.theirs))
    (our_cpu, our_wall), (their_cpu, their_wall) = (
        [statistics.median(column) for column in zip(*runs, strict=True)] for runs in (ours, theirs)
    )
    wall = our_wall / their_wall
    cpu = our_cpu / their_cpu if their_cpu else wall
    columns = f"{our_cpu * 1000:8.0f} {their_cpu * 1000:8.0f} {cpu:7.2f}"
    columns += f" {our_wall * 1000:9.0f} {their_wall * 1000:8.0f} {wall:7.2f}"
    verdict = "reached" if (cpu if race.judged == "CPU" else wall) <= race.aim else "missed"
    return f"{race.title:<{WIDTH}} {columns}   {race.judged:>4} <= {race.aim:.2f} {verdict}"


def many_files(folder: Path) -> list[str]:
    """The examples again and again, each copy with a name of its own."""
    sources = [text for text in (path.read_text("utf-8") for path in EXAMPLES) if "\nvendor:" in text]
    names = []
    for number in range(FILES):
        path = folder / f"{number:04}.yaml"
        path.write_text(f"# copy {number}\n{sources[number % len(sources)]}", "utf-8", newline="\n")
        names.append(str(path))
    return names


def main() -> None:
    """Hold all races."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = many_files(folder)
        schema = str(folder / "dl06.schema.json")
        subprocess.run([PIDCFG, "schema", "dl06", "-o", schema], check=True)
        clock((PIDCFG, "validate", str(REACTOR)))  # byte code and files into the caches
        clock((YARDSTICK, "--schemafile", schema, str(REACTOR)))
        version, reactor = (YARDSTICK, "--version"), str(REACTOR)
        races = (
            Race(
                "pidcfg --version / import click",
                (PIDCFG, "--version"),
                (sys.executable, "-c", "import click"),
                1.25,
                25,
                "CPU",
            ),
            Race(
                "validate one file / check-jsonschema --version", (PIDCFG, "validate", reactor), version, 1.2, 25, "CPU"
            ),
            Race(
                f"validate {FILES} files / check-jsonschema on the same",
                (PIDCFG, "validate", "--quiet", *files),
                (YARDSTICK, "--schemafile", schema, *files),
                1 / 3,
                3,
                "wall",
            ),
        )
        print(f"{'':<{WIDTH}} {'CPU ms':>8} {'their':>8} {'ratio':>7} {'wall ms':>9} {'their':>8} {'ratio':>7}    aim")
        for race in races:
            print(hold(race), flush=True)


if __name__ == "__main__":
    main()
