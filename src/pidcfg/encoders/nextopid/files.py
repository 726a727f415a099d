"""The files that a NextoPID program is written to and read from."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

from pidcfg.encoders.image import Settings
from pidcfg.encoders.listing import FileKind
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, SIGNAL, WRITTEN
from pidcfg.encoders.modbus_map import Point, Symbols, map_kind, symbol_rows
from pidcfg.encoders.nextopid.st_read import read_plcopen, read_st, with_zeros
from pidcfg.encoders.nextopid.st_write import write_plcopen, write_st
from pidcfg.encoders.parameter_files import parameter_listings
from pidcfg.encoders.parameters import Program
from pidcfg.encoders.regmap import writer_of
from pidcfg.encoders.structured_text import opening
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.nextopid import NextopidFile, Plc
from pidcfg.schemas.numbers import decimal_text

BEGIN = re.compile(r"(?:PROGRAM|FUNCTION(?:_BLOCK)?|TYPE|VAR(?:_[A-Z_]+)?)\s", re.IGNORECASE)


OFFERED = ("PV", "MV", "Manual", "CASC", "SP_CASC")
"""Parameters that run, and that a trend or an operator wants."""


def _program(image: Program) -> str:
    """The name of the program."""
    return str(image.plc.get("program", Plc.model_fields["program"].default))


def looks_like_st(text: str) -> bool:
    """Whether a text begins like a program, behind its comments and pragmas."""
    return bool(BEGIN.match(text, opening(text)))


def looks_like_xml(text: str) -> bool:
    """Whether a text is a document of XML."""
    return text.lstrip("\ufeff \t\r\n").startswith("<")


LISTINGS = parameter_listings("parameter listing")
FORMATS = {
    **LISTINGS,
    "json": replace(
        LISTINGS["json"], looks_like=lambda text: text.lstrip().startswith("{") and not looks_like_st(text)
    ),
    "st": FileKind(
        "st",
        "program in Structured Text",
        write_st,
        lambda text: with_zeros(read_st(text)),
        looks_like_st,
        carries_checklist=True,
    ),
    "plcopen": FileKind(
        "plcopen",
        "program in PLCopen XML",
        write_plcopen,
        lambda text: with_zeros(read_plcopen(text)),
        looks_like_xml,
        carries_checklist=True,
        read_program=lambda text, name: with_zeros(read_plcopen(text, name)),
    ),
    "modbus-map": map_kind(lambda image: symbol_rows(points(image), OFFERED, f"{_program(image)}.")),
}
"""A pragma, with which a program may begin, begins like JSON."""


def checklist(config: NextopidFile) -> tuple[str, ...]:
    """What the program around has to do."""
    items = [f"call the program in a cyclic task of {decimal_text(config.plc.sample_time)} s"]
    outside = [
        f"{item.name}.{key}"
        for item in (*config.blocks, *config.loops)
        for key in ("PV", "InVar", "MV")
        if key in type(item).model_fields and getattr(item, key) is None
    ]
    if outside:
        items.append(f"assign before the calls, since nothing is wired to them: {', '.join(outside)}")
    written = {move.to for move in config.moves if move.when is True}
    outside = [name for name in config.signals if name not in written]
    if outside:
        items.append(f"assign the signals from outside: {', '.join(outside)}")
    return tuple(items)


# --- What the memory of a NextoPID program may hold: signals, and the parameters of every instance --------------------

PARAMETERS = frozenset(row.name for kind in BLOCK_TYPES.values() for row in kind.table.rows)

SIGNALS = {"PV": "PV", "SP": "SP", "MV": "OUT"}
"""Parameters that are columns of a trend."""
MODE_KEYS = ("Manual", "CASC")
LITERALS = False


def mode_of(values: Mapping[str, object]) -> str:
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


def _of_block(program: Program, entry: Settings) -> Iterator[Point]:
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
