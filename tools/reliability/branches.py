"""Branches of pidcfg that some work takes (coverage.py): whether changed examples still reach anything new."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from reliability import copies

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

SOURCE = Path(__file__).parents[2] / "src" / "pidcfg"
KEPT = SOURCE.parents[1] / "build" / "branches.json"
"""What runs before this one have taken."""
Arc = tuple[str, int, int]
"""A module, a line and the one that follows it; a negative line is where a function begins or ends."""


def taken(work: Callable[[], object]) -> set[Arc]:
    """Does some work, and gives the branches that it took."""
    import coverage

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        meter = coverage.Coverage(branch=True, data_file=None, config_file=False, include=[f"{SOURCE}/*"])
        with meter.collect():
            work()
        data = meter.get_data()
    files = [(str(Path(file).relative_to(SOURCE)), data.arcs(file) or ()) for file in data.measured_files()]
    return {(name, *arc) for name, arcs in files for arc in arcs}


class Known:
    """The branches that were taken until now, by this run and those before it."""

    def __init__(self) -> None:
        self.arcs = _kept()
        self.since = copies.cpu()

    def new(self, work: Callable[[], object]) -> list[Arc]:
        """Does some work, and gives the branches that nothing has taken before."""
        return sorted(taken(work) - self.arcs)

    def add(self, arcs: Iterable[Sequence[str | int]]) -> int:
        """More branches, from now on known; how many they are."""
        new = {(str(name), int(start), int(end)) for name, start, end in arcs} - self.arcs
        if new:
            self.arcs |= new | _kept()
            self.since = copies.cpu()
            copies.keep(KEPT, json.dumps(sorted(self.arcs)))
        return len(new)

    def quiet(self) -> float:
        """Seconds of CPU since the last new branch."""
        return copies.cpu() - self.since


def _kept() -> set[Arc]:
    return {(name, start, end) for name, start, end in json.loads(KEPT.read_text("utf-8"))} if KEPT.exists() else set()
