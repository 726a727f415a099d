"""Both sides of a ``diff`` in the battery: their verdicts and charts, loop over loop."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.differences.side import Side
    from pidcfg.vendors import Vendor
    from pidcfg.verification.verdict import Verified


def verified_sides(
    sides: tuple[Side, Side],
    sources: Sequence[tuple[Any, Vendor]],
    names: tuple[str, str],
    note: Callable[[str], None],
    progress: Callable[[float], None] | None = None,
    jobs: int = 1,
) -> list[Verified]:
    """A verdict for each loop that both sides have and that can be run; ``note`` is told what cannot, and why."""
    from pidcfg.sim.run import UnusableError
    from pidcfg.verification.verify import verify

    pairs = list(_comparable(*sides, note))
    if not pairs:
        note("not compared: no loop of both sides can be run on the same plant")
        return []
    (one, first), (two, second) = sources
    before, after = (f"{Path(name).name} ({vendor.key})" for name, (_, vendor) in zip(names, sources, strict=True))
    try:
        return verify((first, one), (second, two), pairs, names=(before, after), progress=progress, jobs=jobs)
    except UnusableError as error:
        note(f"not compared: {error}")
    return []


def _comparable(before: Side, after: Side, note: Callable[[str], None]) -> Iterator[tuple[int, int]]:
    """The places of loops with a neutral form on both sides, whose PVs have the same unit."""
    from pidcfg.differences.meaning import matched

    for i, j in matched(before.names, after.names):
        if i is None or j is None:
            name = before.names[i] if i is not None else after.names[j] if j is not None else ""
            note(f"not compared: {name} is on one side only")
            continue
        name, one, two = after.names[j], before.loops[i], after.loops[j]
        if one is None or two is None:
            note(f"not compared: {name} has no ranges in engineering units")
        elif one.pv.unit != two.pv.unit:
            note(f"not compared: the PV of {name} is in {one.pv.unit or 'no unit'} and in {two.pv.unit or 'no unit'}")
        else:
            yield i, j
