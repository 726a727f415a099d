"""The ordinary tests in other orders and on other numbers of workers: each passes as it does by itself.

As a plugin of pytest (``-p reliability.order``) it puts the tests into the order of a seed, which is the same on every
worker, and keeps how each of them ended. What fails in such an order is run again alone: a test that passes then has
flipped, for it depends on what ran before it or beside it.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import tempfile
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

ROOT = Path(__file__).parents[2]
SEED, FREELY, OUTCOMES = "ORDER_SEED", "ORDER_FREELY", "ORDER_OUTCOMES"
"""Variables of the plugin: the seed; whether tests leave their file; where the outcomes are written."""
WORKERS = (2, 3, 1)
"""Processes of the three runs."""
WORST = ("passed", "skipped", "failed")
"""Outcomes of a test's setup, call and teardown: the last of these is the test's."""


def shuffled(names: Sequence[str], seed: int, *, freely: bool) -> list[int]:
    """The places of tests in the order of a seed: files in any order and the tests inside of each, or all freely."""
    rng = random.Random(seed)
    places = list(range(len(names)))
    if freely:
        rng.shuffle(places)
        return places
    files = [list(group) for _, group in groupby(places, lambda i: names[i].partition("::")[0])]
    rng.shuffle(files)
    for group in files:
        rng.shuffle(group)
    return [place for group in files for place in group]


# --- the plugin ------------------------------------------------------------------------------------------------------

PHASES: dict[str, str] = {}
ENDS: dict[str, str] = {}


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Behind what pytest sorts by fixtures."""
    if SEED in os.environ:
        names = [item.nodeid for item in items]
        places = shuffled(names, int(os.environ[SEED]), freely=FREELY in os.environ)
        items[:] = [items[place] for place in places]
    if OUTCOMES in os.environ:
        Path(os.environ[OUTCOMES]).with_suffix(".count").write_text(str(len(items)), "utf-8")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """The worst of what a test's three phases say, once the last one has ended; xdist's workers tell their parent."""
    worst = PHASES[report.nodeid] = max(PHASES.get(report.nodeid, "passed"), report.outcome, key=WORST.index)
    if report.when == "teardown" or worst == "failed":
        ENDS[report.nodeid] = worst


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Kept by the process that heard of all tests."""
    if OUTCOMES in os.environ and not hasattr(session.config, "workerinput"):
        Path(os.environ[OUTCOMES]).write_text(json.dumps(ENDS), "utf-8")


# --- the runs --------------------------------------------------------------------------------------------------------


def outcomes(arguments: Sequence[str], **variables: str) -> dict[str, str]:
    """How each test of a run of pytest ended; tests that did not run, because it broke off, are a failure in one."""
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder) / "outcomes.json"
        paths = os.pathsep.join(filter(None, (str(ROOT / "tools"), str(ROOT / "tests"), os.environ.get("PYTHONPATH"))))
        env = {**os.environ, "CI": "true", "PYTHONPATH": paths, OUTCOMES: str(kept), **variables}
        command = (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "reliability.order")
        subprocess.run((*command, *arguments), cwd=ROOT, env=env, check=False, stdout=subprocess.DEVNULL)
        found: dict[str, str] = json.loads(kept.read_text("utf-8")) if kept.exists() else {}
        count = kept.with_suffix(".count")
        missing = int(count.read_text("utf-8")) - len(found) if count.exists() else 0
        return {**found, f"{missing} tests that did not run": "failed"} if missing else found


def run_one(
    tests: Sequence[str],
    seed: int,
    workers: int,
    *,
    freely: bool,
    ran: Callable[..., dict[str, str]] = outcomes,
) -> dict[str, Any]:
    """One order: how many tests ended how, which of them pass alone, and which fail alone, too."""
    variables = {SEED: str(seed), **({FREELY: "1"} if freely else {})}
    ends = ran([*tests, "--numprocesses", str(workers), "--dist", "worksteal"], **variables)
    failed = sorted(name for name, end in ends.items() if end == "failed")
    flips = [name for name in failed if ran([name]).get(name) == "passed"]
    counts = {end: sum(1 for other in ends.values() if other == end) for end in WORST}
    broken = [name for name in failed if name not in flips]
    return {"seed": seed, "workers": workers, "freely": freely, **counts, "flips": flips, "broken": broken}


def run_all(seed: int, tests: Sequence[str], workers: Sequence[int], *, freely: bool) -> dict[str, Any]:
    """An order for each number of workers, with seeds one after the other."""
    runs = [run_one(tests, seed + i, number, freely=freely) for i, number in enumerate(workers)]
    none = [f"no test ran with {run['workers']} workers and seed {run['seed']}" for run in runs if not run["passed"]]
    wrong = [
        f"{name}: {what} with {run['workers']} workers and seed {run['seed']}"
        for run in runs
        for what in ("flips", "broken")
        for name in run[what]
    ]
    return {"runs": runs, "failures": none + wrong}
