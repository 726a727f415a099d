"""A Delta AS configuration to the operands of its DPIDE instructions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.dpide import DPIDE_TABLE
from pidcfg.encoders.parameters import Entry, Program, ProgramEncoding, stored
from pidcfg.encoders.settings import settings_of
from pidcfg.encoders.values import present
from pidcfg.schemas.dpide import LoopSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.parameters import Parameter
    from pidcfg.schemas.dpide import DpideFile, Loop


def encode(config: DpideFile) -> ProgramEncoding:
    """All operands of every loop; PV only where it is given, MV never: they are the process's and the PLC's."""
    entries, misfits = [], []
    for i, loop in enumerate(config.loops):
        devices = loop.devices.given() | {"I_MV": loop.device}
        for row, value in values_of(loop):
            content, misfit = stored(row, value)
            entries.append(
                Entry(f"{loop.name}.{row.name}", row.type, content, row.name, loop.name, devices.get(row.name))
            )
            if misfit is not None:
                misfits.append((("loops", i, row.name), misfit))
    settings = tuple(settings_of(LoopSettings, loop) for loop in config.loops)
    program = Program("dpide", tuple(entries), settings, _plc(config))
    return ProgramEncoding(program, tuple(misfits))


def values_of(loop: Loop) -> Iterator[tuple[Parameter, Any]]:
    """Operands with their values; I_MV begins at 0."""
    for row in DPIDE_TABLE.rows:
        value = 0 if row.name == "I_MV" else getattr(loop, row.name, None)
        if value is not None:
            yield row, value


def _plc(config: DpideFile) -> dict[str, Any]:
    return present(
        {"name": config.name, "description": config.description, "interrupt_task": config.plc.interrupt_task}
    )
