"""Blocks of registers that are to be read from a PLC: where each begins, and the table that says what is in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.image import Cell
from pidcfg.encoders.words import DecodeError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.encoders.regmap import RegisterMap, Word
    from pidcfg.encoders.spaces import Space
    from pidcfg.encoders.written import Written


class AreaError(DecodeError):
    """A PLC whose registers do not say where its loops are; the message says which options would."""


class Area(NamedTuple):
    """A block: ``start`` as a plain number of the vendor's space, and the loop that it is of (empty: of none)."""

    start: int
    table: RegisterMap
    loop: str = ""
    prefix: str = ""

    @property
    def numbers(self) -> range:
        """The registers of the block."""
        return range(self.start, self.start + self.table.size)

    def cells(self, space: Space, words: Mapping[int, int]) -> list[Cell]:
        """The block with its contents; a register that ``words`` does not hold is left out."""
        return [
            Cell(space.name(n), n, words[n], self.prefix + row.name, self.loop or None, space.kind(n), row.access)
            for n, row in zip(self.numbers, self.table.words, strict=True)
            if n in words
        ]

    def kept(self, written: tuple[Written, ...]) -> dict[int, int]:
        """The bits of each register that stay as the engineer has set them: what runs, and the operator's, is 0."""
        running = {row.name for row in written if row.kind != "compared"}
        return {self.start + row.offset: self._mask(row, running) for row in self.table.words}

    def _mask(self, row: Word, running: set[str]) -> int:
        if row.access != "setting" or row.name in running:
            return 0
        return ~sum(bits.mask for bits in self.table.bits if bits.offset == row.offset and bits.access != "setting")
