"""What is downloaded to a PLC: its words in address order, and beside them what no register holds."""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.spaces import WORD, Kind, NoRegisterError
from pidcfg.frozen import frozen
from pidcfg.paths import steps

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.encoders.regmap import Access, Encoded, Misfit, RegisterMap, Rounded
    from pidcfg.encoders.scales import Scale
    from pidcfg.encoders.spaces import Space
    from pidcfg.paths import Path


@frozen
class Cell:
    """One register: its address as the vendor writes it and as a number, its raw content, and what it is."""

    address: str
    number: int
    raw: int
    field: str
    loop: str | None = None
    kind: Kind = WORD
    access: Access = "setting"

    @property
    def hex(self) -> str:
        """The raw content in hexadecimal digits; BCD words read as their decimal digits."""
        return self.kind.hex(self.raw)

    @property
    def value(self) -> bool | int | float:
        """The content as the vendor shows it."""
        return self.kind.show(self.raw)

    @property
    def text(self) -> str:
        """The content as a listing writes it."""
        return self.kind.text(self.raw)


@frozen
class Image:
    """A vendor's memory, and what no register holds: ``settings`` one mapping a loop, ``plc`` for the whole file."""

    vendor: str
    cells: tuple[Cell, ...]
    settings: tuple[Mapping[str, Any], ...] = ()
    plc: Mapping[str, Any] = field(default_factory=dict)

    @property
    def words(self) -> dict[int, int]:
        """Raw values by address."""
        return {cell.number: cell.raw for cell in self.cells}


@frozen
class Block:
    """A register block at its address, and the place in the configuration that it comes from."""

    place: Path
    start: int
    table: RegisterMap
    encoded: Encoded
    loop: str | None = None
    prefix: str = ""
    scales: Mapping[str, Scale] = field(default_factory=dict)
    """What the quantities of the block are on."""

    def cells(self, space: Space) -> list[Cell]:
        """The registers of the block; flags that only the CPU writes (they belong to no loop) are left out."""
        rows = [w for w in self.table.words if self.loop is not None or w.access != "status"]
        return [
            Cell(
                space.name(a),
                a,
                self.encoded.words[row.offset],
                self.prefix + row.name,
                self.loop,
                space.kind(a),
                row.access,
            )
            for row, a in ((row, self.start + row.offset) for row in rows)
        ]


def no_registers(block: Block, space: Space) -> NoRegisterError:
    """The error of a block that goes on behind the last register of its bank."""
    whose = f" of {block.loop}" if block.loop else ""
    return NoRegisterError(f"the block{whose} at {space.name(block.start)} goes on behind the last register")


@frozen
class Encoding:
    """The blocks of a configuration in the order they are written; where they overlap, the later wins."""

    vendor: str
    blocks: tuple[Block, ...]
    space: Space
    settings: tuple[Mapping[str, Any], ...] = ()
    plc: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def image(self) -> Image:
        """All words in address order; raises `NoRegisterError` where a block leaves its bank, and has no image."""
        if self.outside:
            raise no_registers(self.outside[0], self.space)
        cells = {cell.number: cell for block in self.blocks for cell in block.cells(self.space)}
        return Image(self.vendor, tuple(cells[a] for a in sorted(cells)), self.settings, self.plc)

    @cached_property
    def misfits(self) -> tuple[tuple[Path, Misfit], ...]:
        """Values that their registers cannot hold, each with its place."""
        return tuple(((*b.place, *steps(m.path)), m) for b in self.blocks for m in b.encoded.misfits)

    @cached_property
    def outside(self) -> tuple[Block, ...]:
        """Blocks that go on behind the last register of their bank."""
        return tuple(b for b in self.blocks if not self.space.same_bank(b.start, b.start + b.table.size - 1))

    @property
    def whole(self) -> bool:
        """Whether every value has a register that can hold it: no misfit, and no block that leaves its bank."""
        return not self.outside and not self.misfits

    @cached_property
    def rounded(self) -> tuple[tuple[Path, Rounded], ...]:
        """Values that their registers hold only rounded, each with its place."""
        return tuple(((*b.place, *steps(r.path)), r) for b in self.blocks for r in b.encoded.rounded)


@frozen
class Decoded:
    """A configuration as plain data in the order of its file, and notes on what it could not carry."""

    data: dict[str, Any]
    notes: tuple[str, ...] = ()
    status: tuple[int, ...] = ()
    """Words outside the loops that the PLC writes: a listing may hold them, no configuration does."""
