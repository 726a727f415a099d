"""The registers of a PLC whose parameters have names, read until two readings say the same.

A program's structure is no register: block types, wires and literals are those of the configuration that is read like.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.iec_registers import content_of
from pidcfg.encoders.listing import csv_text
from pidcfg.encoders.map_rows import shown as shown_place
from pidcfg.encoders.parameter_files import COLUMNS, csv_row
from pidcfg.encoders.symbol_map import with_contents
from pidcfg.encoders.words import DecodeError
from pidcfg.encoders.written import writer_of
from pidcfg.live.errors import PlcError
from pidcfg.live.link import MOST
from pidcfg.live.reading import Registers
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.encoders.parameters import Program
    from pidcfg.encoders.symbol_map import NamedNumbering
    from pidcfg.live.link import Link
    from pidcfg.vendors import Vendor


class NamedRegisters(Registers):
    """Where a program's parameters are in a PLC, by a map, and how they are read from there."""

    def __init__(self, vendor: Vendor, numbering: NamedNumbering, like: Any) -> None:
        self.vendor, self.named = vendor, numbering
        self.numbering: Any = numbering
        self.most = getattr(vendor.module("points"), "MOST", MOST)
        self.program: Program = like
        cells = [cell for cell in self.program.cells if not isinstance(cell.raw, Wire)]
        self.names: list[Any] = [cell.address for cell in cells if cell.address in numbering.places]
        table = vendor.load("written")
        self._kept: Any = {}
        for cell in cells:
            writer = writer_of(table, cell.field, _values(self.program, cell.loop))
            self._kept[cell.address] = -1 if writer is None or writer.kind == "compared" else 0

    def name(self, number: Any) -> str:
        """A parameter as messages name it."""
        return str(number)

    def owners(self) -> Mapping[Any, str]:
        """The loop that each parameter is of."""
        return {name: point.loop or "" for name, point in self.named.points.items()}

    async def image(self, link: Link) -> Any:
        """The program with the contents of the PLC; raises `PlcError`."""
        words: Mapping[Any, int] = await self.read(link)
        return with_contents(self.program, {name: self.content(name, words[name], link) for name in self.names})

    async def _once(self, link: Link) -> dict[int, int]:
        return await self.words(link, self.names)

    def content(self, name: str, raw: int, link: Link) -> Any:
        """The content of a parameter; raises `PlcError` where its registers hold no value of its type."""
        kind = self.named.points[name].type
        try:
            return content_of(kind, raw)
        except DecodeError as error:
            where = shown_place(self.named.place(name))
            raise PlcError(f"{link.address}: {name}, {where}, is no {kind.name}: {error}") from None


def _values(program: Program, loop: str | None) -> dict[str, Any]:
    return {cell.field: cell.raw for cell in program.cells if cell.loop == loop}


def written(program: Program) -> bytes:
    """A program as a listing, with nothing beside its parameters."""
    return csv_text(COLUMNS, map(csv_row, program.cells), ()).encode()
