"""The files that operands of DPIDE are written to and read from."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from pidcfg.encoders.dpide.st_read import read_st
from pidcfg.encoders.dpide.st_scope import read_symbols
from pidcfg.encoders.dpide.st_write import write_st
from pidcfg.encoders.dpide.symbols import (
    COLUMNS,
    ENCODING,
    merge_symbols,
    read_csv_devices,
    read_json_devices,
    read_operands,
    write_operands,
    write_symbols,
)
from pidcfg.encoders.listing import FileKind, columns
from pidcfg.encoders.maps.dpide import DPIDE_TABLE, OUTSIDE, ROWS, WRITTEN, WRITTEN_BY_AUTOTUNE
from pidcfg.encoders.modbus_map import Device, Point, Symbols, map_kind, symbol_rows
from pidcfg.encoders.parameter_files import parameter_listings
from pidcfg.encoders.parameters import Program
from pidcfg.encoders.regmap import writer_of
from pidcfg.encoders.structured_text import opening
from pidcfg.schemas.dpide import BIT, BITS, FLAG, REGISTER, DpideFile, Loop, LoopSettings, place_of
from pidcfg.text.references import Decision

OFFERED = ("PV", "MV", "PID_RUN", "PID_MAN", "PID_MODE")
"""Operands that run, and that a trend or an operator wants."""
UNIT = re.compile(r"(?:PROGRAM|FUNCTION_BLOCK|VAR(?:_[A-Z_]+)?)\s", re.IGNORECASE)
CALL = re.compile(r"^[^,;#\"]*\bDPIDE\s*\(", re.IGNORECASE | re.MULTILINE)


def looks_like_st(text: str) -> bool:
    """Whether a text begins like a program behind its comments, or calls the instruction."""
    return bool(UNIT.match(text, opening(text))) or bool(CALL.search(text))


PLAIN = parameter_listings("operand listing")
FORMATS = {
    "text": PLAIN["text"],
    "csv": replace(PLAIN["csv"], read=read_csv_devices),
    "json": replace(
        PLAIN["json"],
        read=read_json_devices,
        looks_like=lambda text: PLAIN["json"].looks_like(text) and not looks_like_st(text),
    ),
    "st": FileKind("st", "program in Structured Text", write_st, read_st, looks_like_st, carries_checklist=True),
    "operands": FileKind(
        "operands",
        "operand table (CSV)",
        write_operands,
        read_operands,
        lambda text: {"operand", "value"} <= set(columns(text)),
    ),
    "symbols": FileKind(
        "symbols",
        "symbol table of ISPSoft (CSV)",
        write_symbols,
        read_symbols,
        lambda text: {name.lower() for name in COLUMNS[:3]} <= set(columns(text)),
        encoding=ENCODING,
        merge=merge_symbols,
        whole=False,
    ),
    "modbus-map": map_kind(lambda image: symbol_rows(points(image), OFFERED)),
}


def checklist(config: DpideFile) -> tuple[str, ...]:
    """What no file does by itself: devices, the direction, and where the instruction stands."""
    if not config.loops:
        return ()
    blocks = ", ".join(f"{loop.name} {place_of('I_MV', loop.device)}" for loop in config.loops)
    items = [
        f"nothing else in the program may use the registers of I_MV: {blocks}",
        f"direction of control: {'; '.join(_direction(loop) for loop in config.loops)}",
    ]
    numbers = [f"{loop.name} {', '.join(rows)}" for loop in config.loops if (rows := _without_device(loop))]
    if numbers:
        items.append(
            f"give these operands devices in the program, since they change while it runs: {'; '.join(numbers)}"
        )
    interval = config.plc.interrupt_task
    if interval is not None:
        items.append(f"call the instructions in a timed interrupt task of {interval} ms; CYCLE has no effect there")
    else:
        items += _calls(config.loops)
    pulses = [f"{loop.name} {loop.call.GPWM.output}" for loop in config.loops if loop.call.GPWM is not None]
    if pulses:
        items.append(
            f"MV is the time on in ms, and GPWM behind the instruction makes pulses of it: {', '.join(pulses)}"
        )
    items.append("see that the analog module converts each PV at least as often as its instruction calculates")
    items.append("of a symbol table, compare the initial values of REAL after the import; known exports have 0 only")
    return tuple(items)


def _calls(loops: Iterable[Loop]) -> Iterator[str]:
    """How often the program calls the instructions."""
    scanned = [f"{loop.name} {loop.CYCLE} ms" for loop in loops if loop.call.timer is None]
    timed = [f"{loop.name} {loop.call.timer}, {loop.CYCLE} ms" for loop in loops if loop.call.timer is not None]
    if scanned:
        cycles = ", ".join(scanned)
        yield f"call the instructions in every scan of a cyclic task; they wait for CYCLE themselves: {cycles}"
    if timed:
        yield f"these instructions are called by timers that run for CYCLE: {'; '.join(timed)}"


def _direction(loop: Loop) -> str:
    if loop.PID_DIR:
        return f"{loop.name} PID_DIR TRUE, MV rises while PV is below SV (heating)"
    return f"{loop.name} PID_DIR FALSE, MV rises while PV is above SV (cooling)"


def _without_device(loop: Loop) -> list[str]:
    """Operands that the PLC may write and that have no device in the file."""
    written = [*OUTSIDE, *(WRITTEN_BY_AUTOTUNE if loop.PID_MODE == 1 else ()), *(["MOUT"] if loop.MOUT_AUTO else [])]
    return [name for name in written if name != "I_MV" and name not in loop.devices.given()]


# --- Where the operands of DPIDE may stand in a Delta AS: those with a device, and those that a map names -------------

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


def mode_of(values: Mapping[str, object]) -> str:
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
    settings = LoopSettings.model_validate(entry)
    loop = settings.loop
    devices = settings.devices.given() | {"I_MV": settings.device}
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
