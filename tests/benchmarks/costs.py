"""Measures what a loop-step takes in CPython, and compiling, by vendor, and writes the table that `auto` decides by.

Run it with ``python tasks.py bench --write-costs``, on an idle machine. The production run of one noisy loop runs
as `pidcfg simulate` runs it, so long that its beginning and its end hardly count; of its rounds the quickest counts.
What is written is small whole numbers of µs and s: the choice needs their size alone, and is the same wherever it is
made.
"""

from __future__ import annotations

import ast
import os
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from production import configuration, loaded, ours, scenario
from rounds import QUICK_ROUNDS, cpu, race

from pidcfg.sim import costs
from pidcfg.sim.costs import COSTS, Cost
from pidcfg.sim.engine import choice as engine
from pidcfg.text.store import FOLDER_VARIABLE

STEPS = 20_000
TABLE = Path(costs.__file__)


def microseconds(vendor: str) -> float:
    """What a loop-step takes in CPython."""
    case = loaded(configuration(vendor, 1), scenario(vendor, 1, STEPS, noise=True))
    times = race({"python": cpu(lambda: ours(case, "python"))}, QUICK_ROUNDS)
    return times["python"].least * 1e6 / STEPS


def seconds_to_compile(vendor: str) -> float:
    """What compiling a vendor's kernels takes beyond running them."""
    case = loaded(configuration(vendor, 1), scenario(vendor, 1, 200, noise=False))
    with TemporaryDirectory() as folder, patch.dict(os.environ, {FOLDER_VARIABLE: folder}):
        engine.KEPT_KERNELS.clear()
        times = [cpu(lambda: ours(case, "numba"))() for _ in range(2)]
    return times[0] - times[1]


def with_table(text: str, measured: dict[str, Cost]) -> str:
    """The module with another table."""
    table = next(node for node in ast.parse(text).body if isinstance(node, ast.Assign))
    lines = text.splitlines(keepends=True)
    rows = [f'    "{key}": Cost({value.loop_step}, {value.compile_seconds}),\n' for key, value in measured.items()]
    return "".join([*lines[: table.lineno - 1], "COSTS = {\n", *rows, "}\n", *lines[table.end_lineno :]])


def main() -> None:
    """All vendors of the table."""
    measured = {}
    engine.fast_normals()
    for vendor, before in COSTS.items():
        measured[vendor] = Cost(max(1, round(microseconds(vendor))), round(seconds_to_compile(vendor)))
        print(f"{vendor:9} {measured[vendor]} (it was {before})", flush=True)
    TABLE.write_text(with_table(TABLE.read_text("utf-8"), measured), "utf-8", newline="\n")


if __name__ == "__main__":
    main()
