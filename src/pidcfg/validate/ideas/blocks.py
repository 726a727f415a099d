"""Blocks of registers at addresses of their own: where they lie, which of them overlap, and how many there may be."""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING, NamedTuple, Protocol

from pidcfg.validate.rule import finding
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
    """Loops whose blocks share registers, at each of them."""
    for view, other in permutations(views, 2):
        for extent, theirs in zip(view.extents, other.extents, strict=True):
            if extent.first <= theirs.last and theirs.first <= extent.last:
                key = extent.key
                finding = view.at(key, block=key, extent=extent, loop=view.name, other_extent=theirs, other=other.name)
                yield finding.shared_with(other.name)


def too_many_loops(views: Sequence[Placed], most: int) -> Findings:
    """A file with more loops than its PLC has room for."""
    if len(views) > most:
        yield finding("loops", key=True, count=len(views), limit=most)
