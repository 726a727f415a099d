"""An EZLogix configuration to its registers and discretes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Block, Encoding
from pidcfg.encoders.mapping import values_of
from pidcfg.encoders.maps.ezlogix import BANKS, BLOCKS, CV, SPACE, TABLES, counts_format
from pidcfg.encoders.scales import Scale
from pidcfg.encoders.settings import settings_of
from pidcfg.encoders.values import present
from pidcfg.schemas.ezlogix import CV_FULL, LoopSettings, Plc

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.values import Data
    from pidcfg.schemas.ezlogix import EzlogixFile, Loop, OutputSettings, PvSettings
    from pidcfg.schemas.ezlogix import Output as OutputSection
    from pidcfg.schemas.ezlogix import Pv as PvSection

EXPLICIT = frozenset({"output.pulse"})
"""Without it the control output is not enabled, which no register holds."""


def encode(config: EzlogixFile) -> Encoding:
    """Both blocks of every loop; what the PLC itself writes, and the request to tune, are 0."""
    blocks = tuple(block for i, loop in enumerate(config.loops) for block in _blocks(i, loop))
    settings = tuple(settings_of(LoopSettings, loop, BANKS, EXPLICIT) for loop in config.loops)
    return Encoding("ezlogix", blocks, SPACE, settings, _plc_settings(config))


def _blocks(i: int, loop: Loop) -> Iterator[Block]:
    scales = scales_of(loop.pv, loop.output, root=loop.pv.square_root)
    values = values_of(loop, TABLES, unset_limits(scales))
    for key, (prefix, table) in BLOCKS.items():
        start = SPACE.number(prefix, getattr(loop, key))
        yield Block(("loops", i), start, table, table.encode(values, scales), loop.name, scales=scales)


def scales_of(pv: PvSection | PvSettings, output: OutputSection | OutputSettings, *, root: bool) -> dict[str, Scale]:
    """The scales ``pv``, ``sp`` and ``output`` of a loop's registers; ``root``: it extracts the root of its PV."""
    form = counts_format(*(pv.counts or (0, CV_FULL)))
    return {"pv": Scale(form, pv.range), "sp": Scale(form, pv.range, root=root), "output": Scale(CV, output.range)}


def unset_limits(scales: Mapping[str, Scale]) -> Data:
    """The limits of a set point that has none: the ends of its scale."""
    return {f"setpoint.limits.{i}": end for i, end in enumerate(scales["sp"].ends)}


def _plc_settings(config: EzlogixFile) -> dict[str, Any]:
    """What no register holds for the whole file; that the PLC goes on when it is stopped, always."""
    names = config.plc.tag_names
    return present(
        {
            "name": config.name,
            "description": config.description,
            "process_when_stopped": config.plc.process_when_stopped,
            "tag_names": None if names == Plc.model_fields["tag_names"].default else names,
            "map": config.plc.map,
        }
    )
