"""The files that a DL06 image is written to and read from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.dl06.encode import loop_start
from pidcfg.encoders.files import FileKind, listings
from pidcfg.encoders.ihex import read_ihex, write_ihex
from pidcfg.encoders.maps.dl06 import LOOP_TABLES, SPACE
from pidcfg.encoders.modbus import Place
from pidcfg.schemas.octal import v_name

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


NUMBERING = Numbering()
FORMATS = listings(SPACE, "V-memory listing", NUMBERING) | {
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


TRANSITION = "change the CPU from Program to Run: it reads V7640 and V7641 only then"
CHANGES = "change words of the loop table later only with the loop in Manual and the PLC stopped"


def checklist(config: Dl06File) -> tuple[str, ...]:
    """What no download does, and what to compare by eye because the manual contradicts itself there."""
    items = (_compare_resets(config), _copy_values(config), TRANSITION, _request_modes(config), _later_changes(config))
    return tuple(item for item in items if item) if config.loops else ()


def _request_modes(config: Dl06File) -> str:
    """Loops that are meant for another mode than the one in which they begin."""
    meant = [f"{loop.name} ({loop.mode})" for loop in config.loops if loop.mode != "manual"]
    return f"request the mode of {', '.join(meant)}, inner loops first: new loops begin in Manual" if meant else ""


def _copy_values(config: Dl06File) -> str:
    """PVs and outputs that no auto transfer carries."""
    table = LOOP_TABLES[1]

    def places(word: str, part: str) -> str:
        found = [
            f"{loop.name} ({v_name(loop_start(config.plc, i) + table.offset(word))})"
            for i, loop in enumerate(config.loops)
            if getattr(loop, part).transfer is None and not (part == "output" and loop.name in majors)
        ]
        return ", ".join(found)

    majors = {loop.cascade_from for loop in config.loops}
    pv, output = places("pv", "pv"), places("output", "output")
    parts = [f"the PV into the word of {pv}" if pv else "", f"the output from the word of {output}" if output else ""]
    carried = " and ".join(part for part in parts if part)
    return f"see that the ladder program copies {carried}: no auto transfer does" if carried else ""


def _later_changes(config: Dl06File) -> str:
    """How words are changed, also of loops that do not follow the CPU."""
    apart = [loop.name for loop in config.loops if loop.independent_of_cpu_mode]
    if not apart:
        return CHANGES
    return (
        f"{CHANGES}; of {', '.join(apart)} set bit 15 of +00 to 0 before, so that they follow it, and to 1 afterwards"
    )


def _compare_resets(config: Dl06File) -> str:
    """The reset word has one decimal in one place of the manual and two in another."""
    timed = [loop.name for loop in config.loops if loop.tuning.reset.duration is not None]
    if not timed or "reset_decimals" in config.plc.model_fields_set:
        return ""
    return (
        f"compare the reset time of {', '.join(timed)} in the PID dialog with the file: the manual gives its word one "
        "decimal in one place and two in another; then state `reset_decimals` under `plc`"
    )
