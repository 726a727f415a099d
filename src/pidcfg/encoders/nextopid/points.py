"""What the memory of a NextoPID program may hold: signals, and the parameters of every instance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, SIGNAL, WRITTEN
from pidcfg.encoders.symbol_map import Point, Symbols
from pidcfg.encoders.written import writer_of
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.parameters import Program

PARAMETERS = frozenset(row.name for kind in BLOCK_TYPES.values() for row in kind.table.rows)

SIGNALS = {"PV": "PV", "SP": "SP", "MV": "OUT"}
"""Parameters that are columns of a trend."""
MODE_KEYS = ("Manual", "CASC")
LITERALS = False


def mode_of(values: Mapping[str, Any]) -> str:
    """The mode that these parameters ask for."""
    if values["Manual"]:
        return "manual"
    return "cascade" if values.get("CASC") else "auto"


def points(program: Program) -> Symbols:
    """All signals, and the parameters of all blocks and loops; a function keeps nothing, and has none (D893)."""
    found = {cell.address: Point(cell.address, cell.type) for cell in program.cells if "." not in cell.address}
    for entry in program.settings:
        found |= {point.name: point for point in _of_block(program, entry)}
    return Symbols("a parameter or a signal of the program", found, PARAMETERS)


def _of_block(program: Program, entry: Mapping[str, Any]) -> Iterator[Point]:
    kind = BLOCK_TYPES[entry["type"]]
    name, loop = str(entry.get("loop") or entry.get("block")), entry.get("loop")
    if kind.function:
        return
    words = program.words
    for row in kind.table.rows:
        full = f"{name}.{row.name}"
        writer = writer_of(WRITTEN, row.name, {SIGNAL: None})
        runs = writer is not None and writer.kind == "live"
        needed = full in words and not isinstance(words[full], Wire) and not runs
        yield Point(full, row.type, loop, needed)
