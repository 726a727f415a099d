"""Blocks of registers at addresses of their own: where they lie, and which of them overlap."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.regmap import RegisterMap


class Extent(NamedTuple):
    """The registers of one block: its key in the file, its bank, first and last number."""

    key: str
    prefix: str
    first: int
    last: int

    def __str__(self) -> str:
        return f"{self.prefix}{self.first} to {self.prefix}{self.last}"


class Placed(Protocol):
    """A loop with blocks, in the order of their banks."""

    @property
    def extents(self) -> tuple[Extent, ...]:
        """Its blocks."""


V = TypeVar("V", bound=Placed)


def extents_of(loop: object, blocks: Mapping[str, tuple[str, RegisterMap]]) -> tuple[Extent, ...]:
    """The blocks of a loop, whose keys in the file name their starts."""
    starts = ((key, prefix, getattr(loop, key), table.size) for key, (prefix, table) in blocks.items())
    return tuple(Extent(key, prefix, start, start + size - 1) for key, prefix, start, size in starts)


def overlaps(views: Sequence[V]) -> Iterator[tuple[V, Extent, V, Extent]]:
    """Each pair of loops whose blocks share registers: the later loop and its block, the earlier one and its block."""
    for first, second in combinations(views, 2):
        for mine, theirs in zip(second.extents, first.extents, strict=True):
            if mine.first <= theirs.last and theirs.first <= mine.last:
                yield second, mine, first, theirs
