"""A neutral configuration to its named parameters: one a leaf field, ``TIC-101.tuning.gain``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import route
from pidcfg.encoders.maps.generic import LOOP_TABLE
from pidcfg.encoders.named import Entry, NamedEncoding, Program, store
from pidcfg.encoders.regmap import Misfit
from pidcfg.encoders.values import present
from pidcfg.encoders.words import EncodeError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.named import Parameter
    from pidcfg.schemas.generic import GenericFile, Loop


def encode(config: GenericFile) -> NamedEncoding:
    """All fields of every loop that have a value; names, units and texts stand beside them."""
    entries, misfits = [], []
    for i, loop in enumerate(config.loops):
        for row, value in values_of(loop):
            content = row.type.default
            try:
                content = store(row.type, value)
            except EncodeError as error:
                misfits.append((route(("loops", i), row.name), Misfit(row.name, row, value, error)))
            entries.append(Entry(f"{loop.name}.{row.name}", row.type, content, row.name, loop.name))
    settings = tuple(_settings(loop) for loop in config.loops)
    plc = present({"name": config.name, "description": config.description})
    return NamedEncoding(Program("generic", tuple(entries), settings, plc), tuple(misfits))


def values_of(loop: Loop) -> Iterator[tuple[Parameter, Any]]:
    """Fields with their values; what is not given and has no default is left out."""
    for row in LOOP_TABLE.rows:
        value: Any = loop
        for step in row.name.split("."):
            if value is not None:
                value = value[int(step)] if step.isdigit() else getattr(value, step)
        if value is not None:
            yield row, value


def _settings(loop: Loop) -> dict[str, Any]:
    """What no parameter holds."""
    pv, output = {"unit": loop.pv.unit}, {"unit": loop.output.unit}
    setpoint = {"source": loop.setpoint.source, "follows_pv": loop.setpoint.follows_pv}
    return present(
        {
            "loop": loop.name,
            "description": loop.description,
            "pv": present(pv) or None,
            "output": present(output) or None,
            "setpoint": present(setpoint) or None,
        }
    )
