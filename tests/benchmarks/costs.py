"""Measures what a loop-step takes in CPython, and compiling, by vendor, and writes the table that `auto` decides by.

Run it with ``python tasks.py bench --write-costs``, on a machine that is idle. Every shipped example runs as `pidcfg
simulate` runs it; of its rounds the quickest counts, of a vendor's examples the median. What is
written is small whole numbers of µs and s: the choice needs their size alone, and is the same wherever it is made.
"""

from __future__ import annotations

import ast
import os
import statistics
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from production import configuration, loaded, ours, scenario
from rounds import QUICK_ROUNDS, cpu, race

from pidcfg.sim import costs
from pidcfg.sim.costs import COSTS, Cost
from pidcfg.sim.engine import choice as engine
from pidcfg.study.scenario import Loaded, load
from pidcfg.text.source import read_document
from pidcfg.text.store import PLACE

EXAMPLES = Path(__file__).parents[2] / "examples"
TABLE = Path(costs.__file__)


def examples(vendor: str) -> list[Loaded]:
    """The scenarios of a vendor that are shipped, ready to run."""
    found = []
    for path in sorted((EXAMPLES / vendor).glob("*.scenario.yaml")):
        case = load(read_document(path.read_bytes(), path.as_posix()))
        if case.scenario is None or case.image is None:
            raise SystemExit(f"{path} cannot run")
        found.append(case)
    return found


def microseconds(case: Loaded) -> float:
    """What a loop-step of an example takes in CPython."""
    report = ours(case, "python")
    times = race({"python": cpu(lambda: ours(case, "python"))}, QUICK_ROUNDS)
    return times["python"].least * 1e6 / (report.steps * len(report.loops))


def seconds_to_compile(vendor: str) -> float:
    """What compiling a vendor's kernels takes beyond running them."""
    case = loaded(configuration(vendor, 1), scenario(vendor, 1, 200, noise=False))
    with TemporaryDirectory() as folder, patch.dict(os.environ, {PLACE: folder}):
        engine.KEPT.clear()
        times = [cpu(lambda: ours(case, "numba"))() for _ in range(2)]
    return times[0] - times[1]


def with_table(text: str, measured: dict[str, Cost]) -> str:
    """The module with another table."""
    table = next(node for node in ast.parse(text).body if isinstance(node, ast.Assign))
    lines = text.splitlines(keepends=True)
    rows = [f'    "{key}": Cost({value.loop_step}, {value.compiling}),\n' for key, value in measured.items()]
    return "".join([*lines[: table.lineno - 1], "COSTS = {\n", *rows, "}\n", *lines[table.end_lineno :]])


def main() -> None:
    """All vendors of the table."""
    measured = {}
    engine.fast_normals()
    for vendor, before in COSTS.items():
        step = statistics.median(map(microseconds, examples(vendor)))
        measured[vendor] = Cost(max(1, round(step)), round(seconds_to_compile(vendor)))
        print(f"{vendor:9} {measured[vendor]} (it was {before})", flush=True)
    TABLE.write_text(with_table(TABLE.read_text("utf-8"), measured), "utf-8", newline="\n")


if __name__ == "__main__":
    main()
