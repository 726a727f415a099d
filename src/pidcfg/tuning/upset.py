"""A disturbance during a test: a second change of the PV that no change of the output explains, and when it begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.text.references import Decision
from pidcfg.tuning.response import Samples, Segment, lags, least_squares, response, search

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.tuning.response import Fit

D938 = Decision(
    938,
    "a second disturbance in a record is looked for, and refused",
    "The record is fitted again with a step of the load at each of 16 times after the change, at the PV or before the "
    "process. Where the best process leaves more than 0.5 % of the way of the PV on average, and a step leaves less "
    "than 60 % of those squares, by more than 40 variances, and is larger than 3 % of the answer, the record is "
    "refused with the time where it begins and the --until before it; one that has not settled is refused as such. A "
    "second lag is one where it lowers the squares by more than 12 variances; confidences are widened by the "
    "correlation of what is left.",
    "An upset 250 s after a step made gain 2.63 ± 0.07 of a true 1.5, and no warning.",
)

PLACES, FIRST, LAST = 16, 0.15, 0.97
"""Times that are tried, and the part of the answer in which they lie."""
LEAST_GAINED, LEAST_VARIANCES, LEAST_SIZE = 0.6, 40.0, 0.03
LEAST_LEFT = 0.005
"""Of the way of the PV, what the best process leaves on average where a disturbance may be looked for."""
POINTS, ROUNDS = 100, 40
"""Points of the record that are looked at, and rounds of each search."""


def find_upset(samples: Samples, output: Sequence[Segment], best: Fit) -> float | None:
    """When a second change of the PV begins, in s of the record; None: there is none."""
    begin = output[0].time
    few = samples.averaged(POINTS, begin)
    plain = _left(few, output, best)
    if plain <= len(few.time) * (LEAST_LEFT * (max(few.value) - min(few.value))) ** 2:
        return None
    length = few.time[-1] - begin
    found: tuple[float, float, float] | None = None
    for n in range(PLACES):
        at = begin + length * (FIRST + (LAST - FIRST) * n / (PLACES - 1))
        squares, size = _with_step(few, output, best, at)
        if found is None or squares < found[0]:
            found = (squares, at, size)
    if found is None or abs(found[2]) < LEAST_SIZE or found[0] >= LEAST_GAINED * plain:
        return None
    variance = found[0] / max(1, len(few.time) - 5)
    step = length * (LAST - FIRST) / (PLACES - 1)
    return max(begin, found[1] - step / 2) if plain - found[0] > LEAST_VARIANCES * variance else None


def _left(few: Samples, output: Sequence[Segment], best: Fit) -> float:
    """What the best process leaves of these points."""
    columns = [[1.0] * len(few.time), lags(few.time, output, best.dead, best.constant, best.second)]
    return _squares([*columns, *_drift(few, output, best)], few.value)[0]


def _drift(few: Samples, output: Sequence[Segment], best: Fit) -> list[list[float]]:
    return [[t - output[0].time for t in few.time]] if best.drift else []


def _with_step(few: Samples, output: Sequence[Segment], best: Fit, at: float) -> tuple[float, float]:
    """What is left with a step at this time, and its size in answers."""
    length, drift = few.time[-1] - output[0].time, _drift(few, output, best)

    def cost(place: Sequence[float], *, whole: bool = False) -> float:
        dead, constant = abs(place[0]) * length, max(abs(place[1]), 1e-4) * length
        unit = response(few.time, output, dead, constant)
        upset = response(few.time, [Segment(at, 1.0)], 0.0, constant)
        squares, weights = _squares([[1.0] * len(unit), unit, upset, *drift], few.value)
        if whole:
            size = weights[1] * max(map(abs, unit))
            return weights[2] / size if size else 0.0
        return squares

    early = min((at - output[0].time) / length / 3, 0.3)
    starts = [(best.dead / length, min(best.constant / length, 1.0)), (early / 4, early)]
    place = search(cost, min(starts, key=cost), 0.05, ROUNDS)
    return cost(place), cost(place, whole=True)


def _squares(columns: Sequence[Sequence[float]], values: Sequence[float]) -> tuple[float, list[float]]:
    """The sum of squares that these columns leave, and their weights."""
    weights = least_squares(columns, values)
    if weights is None:
        return float("inf"), [0.0] * len(columns)
    left = list(values)
    for weight, column in zip(weights, columns, strict=True):
        left = [y - weight * x for y, x in zip(left, column, strict=True)]
    return sum(y * y for y in left), weights
