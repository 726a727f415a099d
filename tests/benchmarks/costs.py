"""Measures what a loop-step takes in CPython, vendor by vendor, and writes the table that `auto` decides by.

Run it with ``python tasks.py bench --write-costs``, on a machine that is idle. Every shipped example runs as `pidcfg
simulate` runs it, kernel by kernel; of its rounds the quickest counts, of a vendor's examples the median. What is
written is small whole numbers of µs: the choice needs their size alone, and is the same wherever it is made.
"""

from __future__ import annotations

import ast
import statistics
from pathlib import Path

from production import ours
from rounds import QUICK_ROUNDS, cpu, race

from pidcfg.limits import Limits
from pidcfg.reader import DISK
from pidcfg.scenario.load import Loaded, load
from pidcfg.sim import costs, pieces
from pidcfg.sim.costs import LOOP_STEPS
from pidcfg.source import read_document

EXAMPLES = Path(__file__).parents[2] / "examples"
TABLE = Path(costs.__file__)


def examples(vendor: str) -> list[Loaded]:
    """The scenarios of a vendor that are shipped, ready to run."""
    limits, found = Limits(), []
    for path in sorted((EXAMPLES / vendor).glob("*.scenario.yaml")):
        case = load(read_document(path.read_bytes(), path.as_posix(), limits), limits, DISK)
        if case.scenario is None or case.image is None:
            raise SystemExit(f"{path} cannot run")
        found.append(case)
    return found


def microseconds(case: Loaded) -> float:
    """What a loop-step of an example takes in CPython."""
    report = ours(case, "python")
    times = race({"python": cpu(lambda: ours(case, "python"))}, QUICK_ROUNDS)
    return times["python"].least * 1e6 / (report.steps * len(report.loops))


def written(text: str, measured: dict[str, int]) -> str:
    """The module with another table."""
    table = next(node for node in ast.parse(text).body if isinstance(node, ast.Assign))
    lines = text.splitlines(keepends=True)
    rows = ["LOOP_STEPS = {\n", *(f'    "{key}": {value},\n' for key, value in measured.items()), "}\n"]
    return "".join([*lines[: table.lineno - 1], *rows, *lines[table.end_lineno :]])


def main() -> None:
    """All vendors of the table."""
    pieces.FEWEST_STEPS = 1 << 62
    measured = {}
    for vendor, before in LOOP_STEPS.items():
        measured[vendor] = max(1, round(statistics.median(map(microseconds, examples(vendor)))))
        print(f"{vendor:9} {measured[vendor]:3} µs (it was {before})", flush=True)
    TABLE.write_text(written(TABLE.read_text("utf-8"), measured), "utf-8", newline="\n")


if __name__ == "__main__":
    main()
