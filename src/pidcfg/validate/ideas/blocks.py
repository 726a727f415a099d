"""Blocks of registers at addresses of their own: where they lie, which of them overlap, and how many there may be."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple, Protocol

from pidcfg.validate.views import Placed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.encoders.regmap import RegisterMap
    from pidcfg.validate.rule import Findings


class Extent(NamedTuple):
    """The registers of one block: its key in the file, its bank, first and last number."""

    key: str
    prefix: str
    first: int
    last: int

    def __str__(self) -> str:
        return f"{self.prefix}{self.first} to {self.prefix}{self.last}"


class BlockView(Placed, Protocol):
    """A loop with blocks, in the order of their banks."""

    @property
    def extents(self) -> tuple[Extent, ...]:
        """Its blocks."""


def extents_of(loop: object, blocks: Mapping[str, tuple[str, RegisterMap]]) -> tuple[Extent, ...]:
    """The blocks of a loop, whose keys in the file name their starts."""
    starts = ((key, prefix, getattr(loop, key), table.size) for key, (prefix, table) in blocks.items())
    return tuple(Extent(key, prefix, start, start + size - 1) for key, prefix, start, size in starts)


def block_beyond_bank(view: BlockView, last: Mapping[str, int]) -> Findings:
    """Blocks of a loop that reach past the last address of their bank; ``last``: it, by bank."""
    for extent in view.extents:
        end = last[extent.prefix]
        if extent.last > end:
            latest = end - (extent.last - extent.first)
            yield view.at(extent.key, block=extent.key, extent=extent, prefix=extent.prefix, last=end, latest=latest)


def blocks_overlap(views: Sequence[BlockView]) -> Findings:
    """Each pair of loops whose blocks share registers, at the later one."""
    for first, second in combinations(views, 2):
        for extent, other in zip(second.extents, first.extents, strict=True):
            if extent.first <= other.last and other.first <= extent.last:
                key = extent.key
                yield second.at(key, block=key, extent=extent, loop=second.name, other_extent=other, other=first.name)


def too_many_loops(views: Sequence[Placed], most: int) -> Findings:
    """The first loop of a file that its PLC has no room for."""
    if len(views) > most:
        yield views[most].at_key(number=most + 1, count=len(views), limit=most)
