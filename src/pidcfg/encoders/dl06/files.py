"""The files that a DL06 image is written to and read from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.files import FileKind, listings
from pidcfg.encoders.ihex import read_ihex, write_ihex
from pidcfg.encoders.maps.dl06 import SPACE
from pidcfg.encoders.modbus import Place

if TYPE_CHECKING:
    from pidcfg.schemas.dl06 import Dl06File


class Numbering:
    """The DirectLOGIC family numbers holding registers by the V-memory address itself."""

    @staticmethod
    def place(number: int) -> Place:
        """Where an address is."""
        return Place("holding", number)

    @staticmethod
    def find(table: str, register: int) -> tuple[int, int] | None:
        """The address of a holding register."""
        return (register, 0) if table == "holding" else None


FORMATS = listings(SPACE, "V-memory listing", Numbering()) | {
    "ihex": FileKind(
        "ihex",
        "Intel HEX, 16-bit words",
        write_ihex,
        read_ihex,
        lambda text: text.startswith(":"),
        carries_comments=False,
        partial=True,
    ),
}


def checklist(config: Dl06File) -> tuple[str, ...]:
    """What to compare by eye after the download, because the manual contradicts itself there."""
    timed = [loop.name for loop in config.loops if loop.tuning.reset.duration is not None]
    if not timed or "reset_decimals" in config.plc.model_fields_set:
        return ()
    item = (
        f"compare the reset time of {', '.join(timed)} in the PID dialog with the file: the manual gives its word one "
        "decimal in one place and two in another; then state `reset_decimals` under `plc`"
    )
    return (item,)
