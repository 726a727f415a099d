"""Cascades: loops that take their set points from each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence


def rings(masters: Sequence[int | None]) -> Iterator[list[int]]:
    """The loops that follow each other in a circle, each circle once: from its first loop on, each before its master.

    ``masters`` has the index of each loop's master; a loop that is its own master is a ring of one.
    """
    done: set[int] = set()
    for start in range(len(masters)):
        way: dict[int, int] = {}
        at: int | None = start
        while at is not None and at not in way and at not in done:
            way[at] = len(way)
            at = masters[at]
        done.update(way)
        if at in way:
            ring = list(way)[way[at] :]
            first = ring.index(min(ring))
            yield ring[first:] + ring[:first]
