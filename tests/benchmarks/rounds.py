"""How the benchmarks measure: sides take turns, round after round, and only their ratios count.

A busy machine slows all sides of a round alike. Each side says how long it took; of the rounds the median and the
minimum are told, the median beside its goal.
"""

from __future__ import annotations

import argparse
import gc
import statistics
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

ROUNDS, QUICK_ROUNDS = 9, 3


@dataclass(frozen=True)
class Times:
    """Seconds of one side by round."""

    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        """Half of the rounds took longer."""
        return statistics.median(self.seconds)

    @property
    def least(self) -> float:
        """The quickest round."""
        return min(self.seconds)


def cpu(work: Callable[[], Any]) -> Callable[[], float]:
    """A side that does ``work`` and tells the CPU seconds of this process."""

    def side() -> float:
        started = time.process_time()
        work()
        return time.process_time() - started

    return side


def race(sides: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, Times]:
    """Every side once for nothing, then all of them in turn."""
    seconds: dict[str, list[float]] = {name: [] for name in sides}
    for side in sides.values():
        side()
    for _ in range(rounds):
        for name, side in sides.items():
            gc.collect()
            seconds[name].append(side())
    return {name: Times(tuple(values)) for name, values in seconds.items()}


def ratio(over: Times, under: Times, scale: float = 1.0) -> tuple[float, float]:
    """The ratio of the medians and that of the minima."""
    return over.median / under.median * scale, over.least / under.least * scale


def beside(value: float, goal: float, *, most: bool = False) -> str:
    """A goal and whether a figure meets it; ``most``: it is an upper bound."""
    met = value <= goal if most else value >= goal
    return f"goal {'<=' if most else '>='} {goal:g} {'met' if met else 'NOT met'}"


def is_quick(what: str) -> bool:
    """Whether the command line asks for the quick benchmark."""
    parser = argparse.ArgumentParser(description=what)
    parser.add_argument("--quick", action="store_true", help="fewer rounds and cases, within a minute or so")
    return bool(parser.parse_args().quick)
