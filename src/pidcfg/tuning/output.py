"""What the output of a record does: levels that are held, or a ramp, from its first change on."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean
from typing import TYPE_CHECKING

from pidcfg.tuning.response import Segment
from pidcfg.tuning.samples import RecordError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.tuning.samples import Record

STRAY = 0.05
"""How far a held output may stray, in its range."""
MOST_TURNS = 8
"""How often the output of a test turns round at most."""


@dataclass(frozen=True, slots=True)
class Path:
    """The output from its first change on."""

    segments: Sequence[Segment]
    first: int
    """The first sample that is not at rest."""
    span: float
    """The largest change from rest."""


def output_path(record: Record, rest: float | None) -> Path:
    """How the output goes from rest; ``rest`` is its value before the record, where it changed at the first sample.

    Raises `RecordError`.
    """
    output = record.output
    levels = [*output, *([] if rest is None else [rest])]
    reach = max(levels) - min(levels)
    if reach == 0:
        cure = "record a step of the output in manual mode"
        if rest is None:
            cure += "; where it stepped at the first sample, give the output before it with --rest"
        raise RecordError(f"the output never changes, it is {output[0]:g}", cure)
    turns = _turns(output, STRAY * reach)
    if turns > MOST_TURNS:
        raise RecordError(
            f"the output turns round {turns} times, as in a closed loop",
            "put the loop into Manual, step the output once, and record until the PV is at rest",
        )
    held = _held(output, STRAY * reach)
    path = output if held is None else held
    before = path[0] if rest is None else rest
    first = next((i for i, u in enumerate(path) if abs(u - before) > STRAY * reach / 10), len(path) - 1)
    start = first if held is not None else max(first - 1, 0)
    segments = _segments(record.time, [u - before for u in path], start, ramps=held is None)
    return Path(segments, first, max((u - before for u in path), key=abs))


def _held(output: Sequence[float], stray: float) -> list[float] | None:
    """The output without its jitter, each level its mean; None where it does not stay on levels, as in a ramp."""
    levels: list[list[float]] = [[output[0]]]
    for a, b in pairwise(output):
        if abs(b - a) > stray:
            levels.append([])
        levels[-1].append(b)
    means = [fmean(level) for level in levels]
    if any(abs(u - mean) > stray for level, mean in zip(levels, means, strict=True) for u in level):
        return None
    if len(levels) > 3 and sum(len(level) == 1 for level in levels) * 2 > len(levels):
        return None
    return [mean for level, mean in zip(levels, means, strict=True) for _ in level]


def _segments(times: Sequence[float], path: Sequence[float], start: int, *, ramps: bool) -> list[Segment]:
    """The output as levels that are held, or as straight lines between its samples."""
    out: list[Segment] = []
    for i in range(start, len(path)):
        ahead = times[i + 1] - times[i] if i + 1 < len(path) else 0.0
        slope = (path[i + 1] - path[i]) / ahead if ramps and ahead > 0 else 0.0
        last = out[-1] if out else None
        if last is None or path[i] != last.value + last.slope * (times[i] - last.time) or slope != last.slope:
            out.append(Segment(times[i], path[i], slope))
    return out


def _turns(path: Sequence[float], stray: float) -> int:
    """How often a path turns round by more than its stray."""
    turns, way, end = 0, 0, path[0]
    for u in path:
        if abs(u - end) > stray:
            now = 1 if u > end else -1
            turns += way not in {0, now}
            way, end = now, u
        elif way and (u - end) * way > 0:
            end = u
    return turns
