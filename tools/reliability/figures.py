"""The figures of the programme, a file each part. The page is written from them alone.

What is tried with random numbers is tried often: such a part keeps every run, and the page has their sum.
"""

from __future__ import annotations

import json
from operator import itemgetter
from pathlib import Path
from typing import Any

from reliability import copies

FOLDER = Path(__file__).with_name("figures")
SUMMED = frozenset({"examples", "codecs", "words", "guided", "kills", "order"})
"""Parts of which every run is kept, one for each seed, and the sum is shown."""
LISTED = "mutants-"
"""So begin the parts of which every run is kept and shown; of all others only the last one is."""


def kept() -> dict[str, Any]:
    """The figures of all parts that were run: added, or the list of runs, where every run is kept."""
    return {path.stem: total(_read(path)) if path.stem in SUMMED else _read(path) for path in _paths()}


def runs(part: str) -> list[dict[str, Any]]:
    """The runs of a part of which every run is kept."""
    path = FOLDER / f"{part}.json"
    return _read(path) if path.exists() else []


def run_of(part: str, seed: int) -> dict[str, Any]:
    """The run of a seed; raises `ValueError` where there was none."""
    found = [run for run in runs(part) if run["seed"] == seed]
    if not found:
        raise ValueError(f"{part} was not run with seed {seed}")
    return found[0]


def keep(part: str, found: dict[str, Any]) -> None:
    """The figures of a run in place of those of the same seed, or of the part's earlier run."""
    every: Any = found
    if part in SUMMED or part.startswith(LISTED):
        every = sorted([*(run for run in runs(part) if run["seed"] != found["seed"]), found], key=itemgetter("seed"))
    copies.keep(FOLDER / f"{part}.json", json.dumps(every, indent=1, sort_keys=True) + "\n")


def total(every: list[dict[str, Any]]) -> dict[str, Any]:
    """Runs as one: numbers and counts added, what was found in one list, the seeds in a row."""
    found: dict[str, Any] = {}
    for run in every:
        found = _added(found, {**run, "seed": [run["seed"]]})
    return {**found, "seed": ", ".join(map(str, sorted(found["seed"])))}


def _added(one: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """The values of two sides by name; one without a name leaves the other's value."""
    return {**one, **{name: _sum(one[name], value) if name in one else value for name, value in other.items()}}


def _sum(one: Any, other: Any) -> Any:
    return _added(one, other) if isinstance(one, dict) else one + other


def _paths() -> list[Path]:
    return sorted(FOLDER.glob("*.json"))


def _read(path: Path) -> Any:
    return json.loads(path.read_text("utf-8"))
