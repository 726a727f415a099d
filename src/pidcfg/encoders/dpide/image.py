"""A Delta AS configuration to the operands of its DPIDE instructions and back, where they may stand, and its gains."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.maps.dpide import DPIDE_TABLE, LOOPS, NEEDED, ROWS, TUNED, WRITTEN
from pidcfg.encoders.modbus_map import Point, Symbols
from pidcfg.encoders.parameters import Elsewhere
from pidcfg.encoders.regmap import LoopTuning, writer_of
from pidcfg.schemas.dpide import BIT, BITS, FLAG, LONGEST_CYCLE, REGISTER, SHORTEST_CYCLE
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.image import Decoded
    from pidcfg.encoders.modbus_map import Device
    from pidcfg.encoders.parameters import Content, Program
    from pidcfg.schemas.dpide import DpideFile, Loop
    from pidcfg.schemas.iec import Wire

# --- A configuration to the operands of DPIDE instructions ------------------------------------------------------------

encode = LOOPS.encode

# --- The operands of DPIDE instructions back to a configuration -------------------------------------------------------


def decode(
    words: Mapping[str, Content | Wire],
    settings: Sequence[Mapping[str, Any]] = (),
    plc: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,
) -> Decoded:
    """The configuration of these operands; raises `DecodeError` with the name of what is no value.

    An operand of which a program says only where it stands is FALSE or 0, and noted; it must be known where the
    instruction cannot do without (D609).
    """
    places = {name: content.text[:40] for name, content in words.items() if isinstance(content, Elsewhere)}
    for name, place in places.items():
        if LOOPS.split(name)[1] in NEEDED:
            cure = "name a symbol table beside the program, or declare its initial value"
            raise DecodeError(f"{name} stands in {place}, and nothing says what it holds; {cure}", name)
    decoded = LOOPS.decode({name: words[name] for name in words if name not in places}, settings, plc, options)
    notes = [f"{name} stands in {at}; nothing says what it holds: {_default(name)}" for name, at in places.items()]
    return replace(decoded, notes=(*notes, *decoded.notes))


def _default(name: str) -> str:
    """What a configuration has for an operand that it does not give."""
    default = LOOPS.loop.model_fields[LOOPS.split(name)[1]].default
    return f"it is taken for {str(default).upper() if isinstance(default, bool) else default}"


# --- How a DPIDE instruction holds its gains: engineering units, as times or as independent gains ---------------------

MILLISECONDS = 1000
"""In a second."""


def tuning_of(config: DpideFile, loop: Loop) -> LoopTuning:
    """The three operands of an instruction."""
    task = config.plc.interrupt_task
    seconds = float(min(max(loop.CYCLE, SHORTEST_CYCLE), LONGEST_CYCLE) if task is None else task) / MILLISECONDS
    return LoopTuning(
        TUNED,
        raises_pv=loop.PID_DIR,
        independent=not loop.PID_EQ,
        now=(loop.Kc_Kp, loop.Ti_Ki, loop.Td_Kd),
        sample_time=seconds,
        derivative_share=seconds / (float(loop.Tf) + seconds),
    )


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
