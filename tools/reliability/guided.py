"""Inputs that grow towards branches that none has reached (atheris, libFuzzer), for every reader of pidcfg.

`run_all` starts the Python that PIDCFG_ATHERIS names, or this one. There ``guided.py SECONDS SEED TARGET...`` loads
pidcfg once with counters at its branches, which takes longer than many a target needs, and runs each target in a copy
of itself for its share of the time. Small sound inputs are what a target begins with, and their words its dictionary.
What is raised and not declared is a finding, told with its input; libFuzzer itself ends a target at an input that takes
20 s or 1 GB, which is one too.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reliability.readers import TARGETS, reader
from reliability.small import seeds

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

ROOT = Path(__file__).parents[2]
LONGEST, SLOWEST, LARGEST = 4096, 20, 1024
"""Bytes of an input; seconds and MB that one may take."""
SHOWN = 300
TAIL = 30
"""Lines that libFuzzer's last figures stand in."""
WORD = re.compile(rb"[A-Za-z_][A-Za-z0-9_.]{2,24}")
NEW = re.compile(r"#\d+\s+NEW\s")


def run_all(
    seed: int, seconds: float, keep: Callable[[dict[str, Any]], None], targets: Sequence[str] = ()
) -> dict[str, Any]:
    """Every target, or some, with its share of the time; what is found is kept after each."""
    python = os.environ.get("PIDCFG_ATHERIS", sys.executable)
    if subprocess.run([python, "-c", "import atheris"], capture_output=True, check=False).returncode:
        sys.exit("guided: PIDCFG_ATHERIS names no Python that has atheris")
    found: dict[str, Any] = {"targets": {}, "failures": []}
    command = [python, __file__, str(seconds), str(seed), *(targets or TARGETS)]
    path = os.pathsep.join(str(ROOT / name) for name in ("src", "tools", "tests"))
    with subprocess.Popen(
        command, env={**os.environ, "PYTHONPATH": path}, stderr=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
    ) as process:
        for line in process.stdout or ():
            target, row, failures = json.loads(line)
            found["targets"][target] = row
            found["failures"] += [f"{seed} {failure}" for failure in failures]
            keep(found)
    missing = set(targets or TARGETS) - set(found["targets"])
    found["failures"] += [f"{seed} {target}: was not run" for target in sorted(missing)]
    return found


def fuzz_all(seconds: float, seed: int, targets: Sequence[str]) -> None:
    """In a Python with atheris: prints the row and the findings of each target."""
    import atheris

    with atheris.instrument_imports(include=["pidcfg"]):
        for target in targets:  # what is imported at first use, too
            read, _ = reader(target)
            for data in seeds(target):
                with contextlib.suppress(Exception):
                    read(data)
    end = time.monotonic() + seconds
    with tempfile.TemporaryDirectory() as folder:
        for left, target in zip(range(len(targets), 0, -1), targets, strict=True):
            share = (end - time.monotonic()) / left
            row = _in_a_copy(target, share, seed, Path(folder) / target)
            sys.stdout.write(f"{json.dumps([target, *row])}\n")
            sys.stdout.flush()


def _in_a_copy(target: str, seconds: float, seed: int, folder: Path) -> tuple[dict[str, float], list[str]]:
    """Figures of a target that runs in a copy of this process, and what it has found."""
    folder.mkdir()
    from_copy, to_here = os.pipe()
    begin = last = time.monotonic()
    copy = os.fork()
    if not copy:
        os.dup2(to_here, sys.stderr.fileno())
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        os.close(from_copy)
        try:
            _fuzz(target, seconds, seed, folder)
        finally:
            os._exit(1)  # what this process cleans up at its end is not the copy's
    os.close(to_here)
    tail: list[str] = []
    with os.fdopen(from_copy, encoding="utf-8", errors="replace") as lines:
        for line in lines:
            last = time.monotonic() if NEW.match(line) else last
            tail = [*tail[-TAIL:], line]
    _, status, used = os.wait4(copy, 0)
    end, text = time.monotonic(), "".join(tail)
    kept = folder / "failures"
    failures = kept.read_text("utf-8").splitlines() if kept.exists() else []
    if status:
        inputs = [path.read_bytes()[:SHOWN] for path in folder.glob("input-*")]
        failures.append(f"{target}: ended with {status}: {inputs}: {text[-SHOWN:]}")
    row = {
        "executions": _figure("number_of_executed_units", text),
        "seconds": end - begin,
        "cpu": used.ru_utime + used.ru_stime,
        "quiet": end - last,
        "new": _figure("new_units_added", text),
    }
    return row, failures


def _figure(name: str, text: str) -> int:
    found = re.search(rf"stat::{name}:\s+(\d+)", text)
    return int(found[1]) if found else 0


def _fuzz(target: str, seconds: float, seed: int, folder: Path) -> None:
    """Runs a target in this process, and does not return."""
    import atheris

    read, declared = reader(target)
    known: set[str] = set()

    def once(data: bytes) -> None:
        try:
            read(data)
        except declared:
            pass
        except Exception as error:  # noqa: BLE001 - whatever else is raised is a finding
            last = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{type(error).__name__} in {Path(last.filename).name}:{last.lineno}"
            if where not in known:
                known.add(where)
                with (folder / "failures").open("a", encoding="utf-8") as stream:
                    stream.write(f"{target}: {where}: {str(error)[:SHOWN]!r}: {data!r}\n")

    sound = seeds(target)
    (folder / "corpus").mkdir()
    for number, data in enumerate(sound):
        (folder / "corpus" / str(number)).write_bytes(data)
    words = sorted({word for data in sound for word in WORD.findall(data)})
    dictionary = folder / "words"
    dictionary.write_text("".join(f'"{word.decode()}"\n' for word in words), "utf-8")
    options: dict[str, Any] = {"seed": seed, "max_total_time": max(1, round(seconds)), "print_final_stats": 1}
    options |= {"timeout": SLOWEST, "rss_limit_mb": LARGEST, "max_len": max(LONGEST, *(len(data) for data in sound))}
    options |= {"artifact_prefix": f"{folder}/input-"} | ({"dict": dictionary} if words else {})
    atheris.Setup([target, str(folder / "corpus"), *(f"-{key}={value}" for key, value in options.items())], once)
    atheris.Fuzz()


if __name__ == "__main__":
    fuzz_all(float(sys.argv[1]), int(sys.argv[2]), sys.argv[3:])
