"""The three blocks of each CLICK loop: no register says where they are, so a configuration or options do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.areas import Area
from pidcfg.encoders.click.decode import LOOP_OPTIONS, default_name
from pidcfg.encoders.maps.click import BANKS, BLOCKS, SPACE
from pidcfg.encoders.settings import with_options
from pidcfg.schemas.click import BITS, FLOATS, INTEGERS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.encoders.image import Image

PLACES = tuple(row for row in LOOP_OPTIONS if row.option in BANKS)
FIELDS = {"bits": BITS, "integers": INTEGERS, "floats": FLOATS}

MODE_REGISTER = None
"""The help names no register that tells a loop's mode (D874)."""


def areas(words: Mapping[int, int], like: Image | None, options: Mapping[str, Any]) -> list[Area]:  # noqa: ARG001 - they say nothing of places
    """The blocks of all loops; raises `DecodeError` naming the option that is missing."""
    entries = with_options(() if like is None else like.settings, options, PLACES, default_name)
    return [
        Area(SPACE.number(prefix, FIELDS[key].parse(entry[key])), table, str(entry["loop"]))
        for entry in entries
        for key, (prefix, table) in BLOCKS.items()
    ]
