"""The blocks of registers of a loop in a listing, on their way back to a configuration."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.settings import S, read_settings
from pidcfg.encoders.words import DecodeError
from pidcfg.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.regmap import RegisterMap
    from pidcfg.encoders.scales import Scale
    from pidcfg.encoders.spaces import Space
    from pidcfg.encoders.values import Data


class NoValueError(DecodeError):
    """A register of a listing whose content is no value of its format; ``place`` is its address."""


@frozen
class LoopBlock:
    """One block of a loop in a listing: its raw registers by name, and the values of its settings by path."""

    loop: str
    space: Space
    start: int
    table: RegisterMap
    raw: tuple[int, ...]

    def word(self, name: str) -> int:
        """A register as it is."""
        return self.raw[self.table.offset(name)]

    def address(self, name: str) -> str:
        """Where a register is."""
        return self.space.name(self.start + self.table.offset(name))

    def values(self, scales: Mapping[str, Scale]) -> Data:
        """Values by path; a register that is no value is named with its address."""
        try:
            return self.table.decode(self.raw, scales)
        except DecodeError as error:
            raise self._at_address(error) from None

    def choices(self) -> Data:
        """The choices inside bit words alone, by path; they decide the scales of the words."""
        try:
            return self.table.decode_bits(self.raw)
        except DecodeError as error:
            raise self._at_address(error) from None

    def _at_address(self, error: DecodeError) -> NoValueError:
        address = self.start + (error.place or 0)
        return NoValueError(f"{self.loop}, {self.space.name(address)}: {error}", address)

    def left_out(self) -> Iterator[str]:
        """Says what is not carried over: momentary requests, what the controller writes, reserved registers."""
        for row in self.table.words:
            if row.path is None and self.raw[row.offset]:
                address = self.start + row.offset
                value = self.space.kind(address).text(self.raw[row.offset])
                yield f"{self.loop}: {self.space.name(address)} = {value} ({row.title}) is not carried over"


def read_loops(
    model: type[S],
    settings: Sequence[Mapping[str, Any]],
    words: Mapping[int, int],
    space: Space,
    blocks: Mapping[str, tuple[str, RegisterMap]],
) -> Iterator[tuple[Any, list[LoopBlock]]]:
    """The settings of each loop as ``model`` says, and its blocks, whose addresses stand among them."""
    for i, entry in enumerate(settings):
        loop: Any = read_settings(model, entry, f"settings[{i}]")
        yield (
            loop,
            [
                loop_block(words, space, space.number(prefix, getattr(loop, key)), table, loop.loop)
                for key, (prefix, table) in blocks.items()
            ],
        )


def loop_block(words: Mapping[int, int], space: Space, start: int, table: RegisterMap, loop: str) -> LoopBlock:
    """A loop's block at ``start``; settings must be there, what the controller writes may be missing."""
    missing = next((w for w in table.words if w.access == "setting" and start + w.offset not in words), None)
    if missing is not None:
        name = space.name(start + missing.offset)
        raise DecodeError(f"the listing does not hold {name} ({missing.title}) of {loop}")
    return LoopBlock(loop, space, start, table, tuple(words.get(start + n, 0) for n in range(table.size)))
