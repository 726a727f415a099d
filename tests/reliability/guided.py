"""Inputs that grow towards branches that none has reached (atheris, libFuzzer), for every reader of pidcfg.

``python tests/reliability/guided.py TARGET END SEED FIGURES`` runs one reader in a process that has atheris;
`run_all` runs each with the Python that PIDCFG_ATHERIS names, or this one. The sound files of `reliability.hostile` are
what it begins with, and their words its dictionary. What is raised and not declared is a finding, told with its input;
libFuzzer itself ends a reader that takes 20 s or 1 GB, which is one too.
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

from reliability.readers import TARGETS, reader, seeds

if TYPE_CHECKING:
    from collections.abc import Callable

TESTS = Path(__file__).parents[1]
LONGEST, SLOWEST, LARGEST = 4096, 20, 1024
"""Bytes of an input; seconds and MB that one may take."""
KEPT_EVERY = 5.0
SHOWN = 300
WORD = re.compile(rb"[A-Za-z_][A-Za-z0-9_.]{2,24}")
NEW = re.compile(r"#\d+\s+NEW\s")


def fuzz(target: str, end: float, seed: int, figures: Path) -> None:
    """Runs one target in this process until ``end`` of `time.time`, and does not return."""
    import atheris

    with atheris.instrument_imports(include=["pidcfg"]):
        read, declared = reader(target)
        for data in seeds(target):
            with contextlib.suppress(*declared):  # what is imported at first use, too
                read(data)
    found: dict[str, Any] = {"executions": 0, "failures": []}
    known: set[str] = set()
    kept = time.monotonic()

    def once(data: bytes) -> None:
        nonlocal kept
        found["executions"] += 1
        try:
            read(data)
        except declared:
            pass
        except Exception as error:  # noqa: BLE001 - whatever else is raised is a finding
            last = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{type(error).__name__} in {Path(last.filename).name}:{last.lineno}"
            if where not in known:
                known.add(where)
                found["failures"].append(f"{target}: {where}: {error!s:.{SHOWN}}: {data!r}")
                kept = 0.0
        if time.monotonic() > kept + KEPT_EVERY:
            kept = time.monotonic()
            figures.write_text(json.dumps(found), "utf-8")

    folder = figures.parent / f"{target}.corpus"
    folder.mkdir()
    for number, data in enumerate(seeds(target)):
        (folder / str(number)).write_bytes(data)
    words = sorted({word for data in seeds(target) for word in WORD.findall(data)})
    dictionary = figures.with_suffix(".dict")
    dictionary.write_text("".join(f'"{word.decode()}"\n' for word in words), "utf-8")
    options = {
        "seed": seed,
        "max_total_time": max(1, int(end - time.time())),
        "timeout": SLOWEST,
        "rss_limit_mb": LARGEST,
    }
    options |= {"max_len": max(LONGEST, *(len(data) for data in seeds(target))), "print_final_stats": 1}
    options |= {"dict": dictionary, "artifact_prefix": f"{figures.parent}/{target}-"}
    atheris.Setup([target, str(folder), *(f"-{key}={value}" for key, value in options.items())], once)
    atheris.Fuzz()


def run_all(seed: int, seconds: float, keep: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
    """Every target with its share of the time; what is found is kept after each."""
    python, end = os.environ.get("PIDCFG_ATHERIS", sys.executable), time.time() + seconds
    if subprocess.run([python, "-c", "import atheris"], capture_output=True, check=False).returncode:
        sys.exit("guided: PIDCFG_ATHERIS names no Python that has atheris")
    found: dict[str, Any] = {"targets": {}, "failures": []}
    with tempfile.TemporaryDirectory() as folder:
        for left, target in zip(range(len(TARGETS), 0, -1), TARGETS, strict=True):
            share = time.time() + (end - time.time()) / left
            row, failures = _run(python, target, share, seed, Path(folder) / f"{target}.json")
            found["targets"][target] = row
            found["failures"] += failures
            keep(found)
    return found


def _run(python: str, target: str, until: float, seed: int, figures: Path) -> tuple[dict[str, float], list[str]]:
    command = [python, __file__, target, str(until), str(seed), str(figures)]
    path = os.pathsep.join((str(TESTS.parent / "src"), str(TESTS)))
    begin, last = time.monotonic(), time.monotonic()
    with subprocess.Popen(
        command, env={**os.environ, "PYTHONPATH": path}, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
    ) as process:
        tail: list[str] = []
        for line in process.stderr or ():
            last = time.monotonic() if NEW.match(line) else last
            tail = [*tail[-30:], line]
    end = time.monotonic()
    kept = json.loads(figures.read_text("utf-8")) if figures.exists() else {"executions": 0, "failures": []}
    failures = kept["failures"]
    if process.returncode:
        inputs = [path.read_bytes()[:SHOWN] for path in figures.parent.glob(f"{target}-*")]
        failures.append(f"{target}: ended with {process.returncode}: {inputs}: {''.join(tail)[-SHOWN:]}")
    text = "".join(tail)
    units = re.search(r"number_of_executed_units: (\d+)", text)
    row = {
        "executions": int(units[1]) if units else kept["executions"],
        "seconds": end - begin,
        "quiet": end - last,
        "new": int((re.search(r"new_units_added:\s+(\d+)", text) or [0, 0])[1]),
    }
    return row, [f"{seed} {failure}" for failure in failures]


if __name__ == "__main__":
    fuzz(sys.argv[1], float(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
