"""The two blocks of each EZLogix loop: no register says where they are, so a configuration or options do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.areas import Area
from pidcfg.encoders.ezlogix.decode import LOOP_OPTIONS
from pidcfg.encoders.maps.ezlogix import BANKS, BLOCKS, MAP_SPACE, SPACE
from pidcfg.encoders.scales import Position
from pidcfg.encoders.settings import with_options
from pidcfg.schemas.ezlogix import DISCRETES, REGISTERS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.image import Image

PLACES = tuple(row for row in LOOP_OPTIONS if row.option in BANKS)
FIELDS = {"registers": REGISTERS, "discretes": DISCRETES}
MODE_REGISTER = "mode"
"""The discrete that tells a loop's mode."""


def mode_of(raw: int) -> str:
    """The mode that the discrete tells."""
    return "auto" if raw else "manual"


def areas(words: Mapping[int, int], like: Image | None, options: Mapping[str, Any]) -> list[Area]:  # noqa: ARG001 - they say nothing of places
    """The blocks of all loops; raises `DecodeError` naming the option that is missing."""
    entries = with_options(() if like is None else like.settings, options, PLACES)
    return [
        Area(SPACE.number(prefix, FIELDS[key].parse(entry[key])), table, str(entry["loop"]))
        for entry in entries
        for key, (prefix, table) in BLOCKS.items()
    ]


def tags(entry: Mapping[str, Any]) -> Iterator[tuple[str, int, Position]]:
    """PV and output of a loop, which stand outside of its blocks: the signal, its register, and what it is on."""
    for signal, key, scale in (("PV", "pv", "pv"), ("OUT", "output", "output")):
        number = MAP_SPACE.parse(str(entry[key]["tag"]))
        if number is not None:
            yield signal, number, Position(scale)
