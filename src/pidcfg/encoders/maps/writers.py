"""Who writes a register that not the PLC alone writes, by the title of its block and its name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.click import DF_BLOCK
from pidcfg.encoders.maps.dl06 import LOOP_TABLE

if TYPE_CHECKING:
    from collections.abc import Mapping

BY_PLC = "written by the PLC"
IN_MANUAL = "written by the PLC; in Manual by the operator"
# fmt: off
WRITERS: Mapping[tuple[str, str], tuple[str, str, str]] = {
    # block              register   setting        where the PLC is told to fetch it        else
    (LOOP_TABLE.title,   "pv"):     ("pv.transfer", BY_PLC + ", which fetches it from the input", "written by the program"),
    (LOOP_TABLE.title,   "bias"):   ("",            "",                     "written by the PLC; a program may add to it"),
    (LOOP_TABLE.title,   "output"): ("",            "",                     IN_MANUAL),
    (DF_BLOCK.title,     "output"): ("",            "",                     IN_MANUAL),
    (DF_BLOCK.title,     "raw_pv"): ("",            "",                     "written by the program"),
}
# fmt: on


def writer(block: str, register: str, loop: Any) -> str:
    """Who writes a status register; ``loop``: its loop in the configuration, or None."""
    path, fetched, otherwise = WRITERS.get((block, register), ("", "", BY_PLC))
    for key in filter(None, path.split(".")):
        loop = getattr(loop, key, None)
    return fetched if path and loop is not None else otherwise
