"""A neutral configuration to its named parameters: one a leaf field, ``TIC-101.tuning.gain``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.generic import LOOP_TABLE
from pidcfg.encoders.parameters import Entry, Program, ProgramEncoding, stored
from pidcfg.encoders.settings import settings_of
from pidcfg.encoders.values import present
from pidcfg.paths import steps, value_at
from pidcfg.schemas.generic import LoopSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.parameters import Parameter
    from pidcfg.schemas.generic import GenericFile, Loop


def encode(config: GenericFile) -> ProgramEncoding:
    """All fields of every loop that have a value; names, units and texts stand beside them."""
    entries, misfits = [], []
    for i, loop in enumerate(config.loops):
        for row, value in values_of(loop):
            content, misfit = stored(row, value)
            entries.append(Entry(f"{loop.name}.{row.name}", row.type, content, row.name, loop.name))
            if misfit is not None:
                misfits.append((("loops", i, *steps(row.name)), misfit))
    settings = tuple(settings_of(LoopSettings, loop) for loop in config.loops)
    plc = present({"name": config.name, "description": config.description})
    return ProgramEncoding(Program("generic", tuple(entries), settings, plc), tuple(misfits))


def values_of(loop: Loop) -> Iterator[tuple[Parameter, Any]]:
    """Fields with their values; what is not given and has no default is left out."""
    for row in LOOP_TABLE.rows:
        value = value_at(loop, steps(row.name))
        if value is not None:
            yield row, value
