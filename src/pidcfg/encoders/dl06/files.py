"""The files that a DL06 image is written to and read from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.files import DecodeOption, FileKind, first_line
from pidcfg.encoders.ihex import read_ihex, write_ihex
from pidcfg.encoders.listing import read_csv, read_json, read_text, write_csv, write_json, write_text
from pidcfg.encoders.modbus import read_modbus, write_modbus
from pidcfg.schemas.octal import HIGHEST, V_ADDRESS

if TYPE_CHECKING:
    from pidcfg.schemas.dl06 import Dl06File


BCD_DIGITS = 4


def parse_address(text: str) -> int | None:
    """``V2000`` to its number; None for anything else."""
    found = V_ADDRESS.fullmatch(text)
    address = int(found.group(1), 8) if found else HIGHEST + 1
    return address if address <= HIGHEST else None


FORMATS = {
    kind.name: kind
    for kind in (
        FileKind("text", "V-memory listing", write_text, lambda text: read_text(text, parse_address),
                 lambda text: first_line(text).startswith("V")),
        FileKind("csv", "V-memory listing for spreadsheets", write_csv, lambda text: read_csv(text, parse_address),
                 lambda text: "address" in first_line(text).split(",") and "register" not in first_line(text)),
        FileKind("json", "V-memory listing for programs", write_json, lambda text: read_json(text, parse_address),
                 lambda text: text.lstrip().startswith("{")),
        FileKind("ihex", "Intel HEX, 16-bit words", write_ihex, read_ihex, lambda text: text.startswith(":")),
        FileKind("modbus", "Modbus holding registers (CSV)", write_modbus, read_modbus,
                 lambda text: first_line(text).startswith("register")),
    )
}  # fmt: skip


def _count(text: str) -> int | None:
    return int(text) if text.isdecimal() and len(text) <= BCD_DIGITS else None


DECODE_OPTIONS = (
    DecodeOption(
        "loop_table", "ADDRESS", "Start of the loop table, for a listing without V7640.", "V2000", parse_address
    ),
    DecodeOption("number_of_loops", "COUNT", "How many loops, for a listing without V7641.", "4", _count),
    DecodeOption("reset_decimals", "1|2", "Implied decimals of the reset words.", "1", {"1": 1, "2": 2}.get),
)


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
