"""The verdict on two configurations: a source and what it was converted to, or any two files.

A conversion is held against the twin of its source. Two files without a report are held against each other: of one
vendor they run the same algorithm on the same numbers, so that nothing but a count of rounding is excused.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import chain
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import overlap
from pidcfg.processes import Crew
from pidcfg.verification.battery import Battery, reference_of, side_of, tolerance_of
from pidcfg.verification.comparison import Counts, Tolerance
from pidcfg.verification.keys import field_of
from pidcfg.verification.neutral import loops_of
from pidcfg.verification.overlays import overlay
from pidcfg.verification.trial import finest, new_plc, root_step
from pidcfg.verification.twin import Twin, twin_of
from pidcfg.verification.verdict import Failure, Named, Untried, Verified

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.conversion.pipeline import LoopReport
    from pidcfg.vendors import Vendor
    from pidcfg.verification.battery import Reference
    from pidcfg.verification.trial import Side, Trial
    from pidcfg.verification.twin import Line

Configured = tuple["Vendor", Any]
"""A vendor and a configuration of it."""
SHOWN = ("step 5 %", "disturbance")
"""The stages that pictures and figures are of."""
MANY = 3
"""Loops that several processes judge sooner than one: each takes about as long as a process takes to start."""


@dataclass(frozen=True, slots=True)
class Sides:
    """What is compared, and what of it a report explains."""

    source: Side
    twin: Side
    target: Side
    lines: Twin
    names: tuple[str, str]


def verify(  # noqa: PLR0913
    source: Configured,
    target: Configured,
    pairs: Sequence[tuple[int, int]],
    report: Sequence[LoopReport] = (),
    names: tuple[str, str] = ("source", "result"),
    progress: Callable[[float], None] | None = None,
    *,
    jobs: int = 1,
) -> list[Verified]:
    """The loops of both sides in the battery, pair by pair of their places; one without a neutral form is left out.

    ``report``: of the conversion, by the places of the source; without one both files are held against each other.
    ``names``: what charts call the sides. ``progress`` is called with the share that is done. ``jobs``: processes,
    which are started for `MANY` loops.
    """
    given = (source, target, pairs, report, names)
    sides = _sides(*given)
    comparable = [(i, j) for i, j in pairs if sides.source.loops[i] is not None and sides.target.loops[j] is not None]
    several = jobs > 1 and len(comparable) >= MANY
    found = Crew(jobs, _judge, given).results(comparable) if several else map(_judge(*given), comparable)
    results = []
    for done, one in enumerate(found, start=1):
        results.append(one)
        if progress is not None:
            progress(done / len(comparable))
    return results


def _judge(
    source: Configured,
    target: Configured,
    pairs: Sequence[tuple[int, int]],
    report: Sequence[LoopReport],
    names: tuple[str, str],
) -> Callable[[tuple[int, int]], Verified]:
    """What judges one pair of loops after the other."""
    sides = _sides(source, target, pairs, report, names)
    exactly = not report and source[0] == target[0]
    return lambda pair: _loop(sides, *pair, exactly=exactly)


def _sides(
    source: Configured,
    target: Configured,
    pairs: Sequence[tuple[int, int]],
    report: Sequence[LoopReport],
    names: tuple[str, str],
) -> Sides:
    (one, before), (two, after) = source, target
    twin = twin_of(before, one, after, two, pairs, report) if report else Twin(before)
    first = side_of(one, before)
    second = first if twin.config is before else side_of(one, twin.config, loops_of(before, one))
    return Sides(first, second, side_of(two, after), twin, names)


def _loop(sides: Sides, i: int, j: int, *, exactly: bool) -> Verified:
    """One loop's verdict."""
    other = sides.target.loop(j)
    step = max(root_step(sides.twin, i), root_step(sides.target, j))
    reference = reference_of(sides.twin, i, other, step)
    tolerance = tolerance_of(sides.twin, i, sides.target, j, reference.bench)
    if exactly:
        pv, output = finest(new_plc(sides.twin, (i,)), i)
        tolerance = Tolerance(0.0, Counts(pv, output), Counts(pv, output), pv, output)
    battery = Battery(reference, sides.target, j, tolerance)
    left, followed = sides.lines.left.get(i, []), sides.lines.followed.get(i, [])
    failures, named = [], []
    for difference, line in battery.judged(left):
        if line is None:
            failures.append(Failure(difference, battery.key_of(difference, [*left, *followed])))
        else:
            named.append(Named(difference, line.change))
    original = reference
    if sides.source is not sides.twin and followed:
        original = replace(reference, side=sides.source, i=i, trials={})
        named += _of_twin(original, reference, tolerance, followed)
    return _result(sides, i, reference, original, battery, failures, named)


def _of_twin(
    original: Reference, reference: Reference, tolerance: Tolerance, followed: Sequence[Line]
) -> Iterator[Named]:
    """What the lines that the twin follows change: between the source as it is and its twin."""
    battery = Battery(original, reference.side, reference.i, tolerance, reference)
    for difference in battery.differences():
        field = field_of(difference, original.loop, reference.loop)
        line = next((line for line in followed if field and overlap(field, line.neutral)), None)
        if line is None and len(followed) == 1:
            (line,) = followed
        yield Named(difference, None if line is None else line.change)


def _result(  # noqa: PLR0913, PLR0917
    sides: Sides,
    i: int,
    reference: Reference,
    original: Reference,
    battery: Battery,
    failures: Sequence[Failure],
    named: Sequence[Named],
) -> Verified:
    """The verdict with its figures, and the picture of the step and the disturbance."""
    loop = sides.source.loop(i)
    shown = [stage for stage in reference.stages if stage.name in SHOWN and stage in reference.possible]
    shown = shown or [reference.stages[0]]
    sample = reference.bench.sample
    parts = [(stage, original.trial(stage), battery.trial(stage)) for stage in shown]
    cut = [(round(stage.begin / sample), one, two) for stage, one, two in parts]
    pvs, outputs, setpoints = (
        [list(chain.from_iterable(getattr(side(one, two), key)[first:] for first, one, two in cut)) for side in SIDES]
        for key in ("pv", "output", "setpoint")
    )
    count = len(pvs[0])
    times = [k * sample for k in range(count)]
    ends = [len(one.pv) - first for first, one, _ in cut]
    iae = [sum(abs(sp - pv) for sp, pv in zip(setpoints[0], side, strict=True)) for side in pvs]
    return Verified(
        loop.name,
        100 * max(abs(a - b) for a, b in zip(*pvs, strict=True)) / reference.bench.span,
        100 * max(abs(a - b) for a, b in zip(*outputs, strict=True)),
        iae[1] / iae[0] if iae[0] else None,
        overlay(loop, times, setpoints[0], pvs, outputs, sides.names, (0.0, ends[0] * sample if len(cut) > 1 else 0.0)),
        tuple(stage.name for stage in reference.possible),
        tuple(Untried(stage.name, mode) for stage in reference.stages if (mode := reference.refused(stage))),
        tuple(failures),
        tuple(named),
    )


def _first(one: Trial, _: Trial) -> Trial:
    return one


def _second(_: Trial, two: Trial) -> Trial:
    return two


SIDES = (_first, _second)
