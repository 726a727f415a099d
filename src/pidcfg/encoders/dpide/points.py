"""Where the operands of DPIDE may stand in a Delta AS: those with a device, and those that a map names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.dpide import DPIDE_TABLE, LOOPS, ROWS, WRITTEN
from pidcfg.encoders.symbol_map import Point, Symbols
from pidcfg.encoders.written import writer_of
from pidcfg.refs import Decision
from pidcfg.schemas.dpide_devices import BIT, BITS, FLAG, REGISTER

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.parameters import Program
    from pidcfg.encoders.symbol_map import Device

D895 = Decision(
    895,
    "an AS is asked for at most 100 words or 256 bits at once",
    "Requests to a Delta AS are that short, also to those that take more.",
    "Delta's AS Series manual, appendix B.2 (Function Codes and Number of Devices Supported): 1 to 100 words of D, and "
    "1 to 256 bits with firmware 1.06.00, below the protocol's 125 and 2000. The DPIDE manual says nothing of Modbus.",
)
SIGNALS = {"PV": "PV", "SV": "SP", "MV": "OUT"}
"""Operands that are columns of a trend."""
MODE_KEYS = ("PID_RUN", "PID_MAN", "PID_MODE")
MOST = {"coil": 256, "discrete": 256, "holding": 100, "input": 100}
"""What one request may ask of an AS (D895)."""
LITERALS = True
"""An operand without a device is a number of the program."""


def mode_of(values: Mapping[str, Any]) -> str:
    """The mode that these operands make."""
    if not values["PID_RUN"]:
        return "off"
    if values["PID_MODE"] == 1:
        return "autotune"
    return "manual" if values["PID_MAN"] else "auto"


def device_of(text: str) -> Device | None:
    """The bank of a device and its number: bits of words count one after the other, ``X1.0`` behind ``X0.15``."""
    if REGISTER.fullmatch(text):
        return "D", int(text.removeprefix("D"))
    if match := FLAG.fullmatch(text):
        return match.group(1), int(match.group(2))
    if (match := BIT.fullmatch(text)) and int(match.group(3)) < BITS:
        return f"{match.group(1)}.", int(match.group(2)) * BITS + int(match.group(3))
    return None


def points(program: Program) -> Symbols:
    """All operands of the loops of a program."""
    found = {point.name: point for entry in program.settings for point in _of_loop(program, entry)}
    return Symbols("a device or an operand of DPIDE", found, frozenset(ROWS), device_of)


def _of_loop(program: Program, entry: object) -> Iterator[Point]:
    settings = LOOPS.settings.model_validate(entry)
    loop = settings.loop  # type: ignore[attr-defined]  # every vendor's settings have it
    devices = settings.devices.given() | {"I_MV": settings.device}  # type: ignore[attr-defined]  # those of DPIDE
    held = {cell.field: cell.raw for cell in program.cells if cell.loop == loop}
    values = {row.name: held.get(row.name, row.type.default) for row in DPIDE_TABLE.rows}
    for row in DPIDE_TABLE.rows:
        writer = writer_of(WRITTEN, row.name, values)
        runs = writer is not None and writer.kind == "live"
        device = devices.get(row.name, "")
        is_setting = row.name in held and not runs
        is_placed = bool(device)
        yield Point(
            f"{loop}.{row.name}", row.type, loop, is_setting and is_placed, is_setting and not is_placed, device
        )
