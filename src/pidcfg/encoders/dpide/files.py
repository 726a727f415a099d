"""The files that operands of DPIDE are written to and read from, and its instructions as Structured Text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from pidcfg.encoders.dpide.st_read import read_st
from pidcfg.encoders.dpide.st_scope import (
    ALWAYS_ON_BIT,
    EN,
    ENABLE_INTERRUPTS,
    IN_OUT_OPERANDS,
    INSTANCE_SUFFIX,
    INSTRUCTION,
    PROGRAM,
    PULSES,
    TIMER,
    WIDTH_SUFFIX,
    read_symbols,
)
from pidcfg.encoders.dpide.symbols import (
    COLUMNS,
    ENCODING,
    Symbol,
    identifier,
    make_symbols,
    merge_symbols,
    read_csv_devices,
    read_json_devices,
    read_operands,
    write_operands,
    write_symbols,
)
from pidcfg.encoders.listing import FileKind, UnwritableError, column_names
from pidcfg.encoders.maps.dpide import AUTOTUNE_OPERANDS, DPIDE_TABLE, PROCESS_OPERANDS, ROWS, WRITERS
from pidcfg.encoders.modbus_map import Device, Point, Symbols, map_kind, symbol_template_rows
from pidcfg.encoders.parameter_files import parameter_listings
from pidcfg.encoders.parameters import Entry, Parameter, Program
from pidcfg.encoders.regmap import writer_of
from pidcfg.encoders.structured_text import comment_text, first_word_offset, literal_text, settings_text, wrap_call
from pidcfg.schemas.dpide import BIT, BITS, FLAG, REGISTER, Call, DpideFile, Loop, LoopSettings, device_range
from pidcfg.text.references import Decision

TREND_OPERANDS = ("PV", "MV", "PID_RUN", "PID_MAN", "PID_MODE")
"""Operands that run, and that a trend or an operator wants."""
UNIT_START = re.compile(r"(?:PROGRAM|FUNCTION_BLOCK|VAR(?:_[A-Z_]+)?)\s", re.IGNORECASE)
CALL_START = re.compile(r"^[^,;#\"]*\bDPIDE\s*\(", re.IGNORECASE | re.MULTILINE)


def looks_like_st(text: str) -> bool:
    """Whether a text begins like a program behind its comments, or calls the instruction."""
    return bool(UNIT_START.match(text, first_word_offset(text))) or bool(CALL_START.search(text))


# --- DPIDE instructions as Structured Text: declarations with devices and initial values, and the calls ---------------

TEXT_SETTINGS = ("device", "devices", "call")
"""Settings that stand in declarations and calls."""


@dataclass(frozen=True)
class Instruction:
    """One loop of the image on its way to a call."""

    name: str
    call: Call
    devices: frozenset[str]
    """Operands with a device."""
    cells: Mapping[str, Entry]
    symbols: Mapping[str, Symbol]

    def is_symbol(self, operand: str) -> bool:
        """Whether an operand is a symbol in the call, and not a number (D603)."""
        tunes = self.cells["PID_MODE"].raw == 1 or "PID_MODE" in self.devices
        follows = bool(self.cells["MOUT_AUTO"].raw) or "MOUT_AUTO" in self.devices
        return (
            operand in self.devices
            or operand in PROCESS_OPERANDS
            or (tunes and operand in AUTOTUNE_OPERANDS)
            or (follows and operand == "MOUT")
            or (self.call.function_block is not None and operand in IN_OUT_OPERANDS)
        )

    def operand_text(self, row: Parameter) -> str:
        """What stands at an operand."""
        if self.is_symbol(row.name):
            return self.symbols[row.name].name
        return literal_text(row.type, self.cells[row.name].content)

    def declarations(self) -> Iterator[str]:
        """The variables of the loop."""
        for row in DPIDE_TABLE.rows:
            if self.is_symbol(row.name):
                symbol = self.symbols[row.name]
                cell = None if row.name in {"I_MV", "MV"} else self.cells.get(row.name)
                place = f" AT {symbol.address}" if symbol.address else ""
                value = "" if cell is None else f" := {literal_text(row.type, cell.content)}"
                note = comment_text(symbol.comment)
                yield f"{symbol.name}{place} : {row.type.name}{value}; (* {note} *)"
        if self.call.GPWM is not None:
            yield f"{identifier(self.name, WIDTH_SUFFIX)} : INT; (* time on in ms, for {PULSES} *)"
        if self.call.function_block is not None:
            yield f"{identifier(self.name, INSTANCE_SUFFIX)} : {self.call.function_block};"

    @property
    def cycle_text(self) -> str:
        """What stands at CYCLE."""
        return self.operand_text(ROWS["CYCLE"])

    def call_lines(self, sharers: list[Instruction]) -> Iterator[str]:
        """The call, and what stands around it; ``sharers``: all loops with its timer, which runs once for them."""
        call, block = self.call, self.call.function_block
        arguments = {row.name: self.operand_text(row) for row in DPIDE_TABLE.rows}
        if block is None:
            lines = call_text(INSTRUCTION, {EN: call.EN or ALWAYS_ON_BIT}, arguments)
        else:
            lines = call_text(
                identifier(self.name, INSTANCE_SUFFIX), {} if call.EN is None else {EN: call.EN}, arguments
            )
        yield f"(* {comment_text(self.name)} *)"
        if call.timer is None:
            yield from lines
        else:
            if self is sharers[0]:
                yield f"{TIMER}({ALWAYS_ON_BIT}, {call.timer}, {self.cycle_text});"
            yield f"IF {call.timer} THEN"
            yield from (f"    {line}" for line in lines)
            if self is sharers[-1]:
                yield f"    {call.timer} := FALSE;"
            yield "END_IF;"
        if call.GPWM is not None:
            width = identifier(self.name, WIDTH_SUFFIX)
            yield f"{width} := REAL_TO_INT({self.symbols['MV'].name});"
            yield f"{PULSES}({ALWAYS_ON_BIT}, {width}, {call.GPWM.cycle}, {call.GPWM.output});"


def call_text(name: str, enable: Mapping[str, str], arguments: Mapping[str, str]) -> list[str]:
    """A call with its operands by name; outputs have another sign."""
    outputs = {row.name for row in DPIDE_TABLE.rows if row.access == "output"}
    arguments_text = [f"{key} := {value}" for key, value in enable.items()]
    arguments_text += [f"{key} {'=>' if key in outputs else ':='} {value}" for key, value in arguments.items()]
    return wrap_call(f"{name}(", arguments_text)


def write_st(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """The program as text; raises `UnwritableError` for a loop whose name gives no symbols."""
    loops = [*make_instructions(image)]
    lines = [f"(* {text} *)" for text in header_comments(image, checklist)]
    for block in function_blocks(loops):
        lines += [*function_block_text(block), ""]
    if "interrupt_task" in image.plc:
        lines += ["(* in a cyclic task *)", "PROGRAM Main", f"{ENABLE_INTERRUPTS}();", "END_PROGRAM", ""]
        lines += [f"(* in the timed interrupt task of {image.plc['interrupt_task']} ms *)"]
    declared = [f"    {line}" for loop in loops for line in loop.declarations()]
    lines += [f"PROGRAM {PROGRAM}", "VAR", *declared, "END_VAR"]
    timers = loops_of_timers(loops)
    for loop in loops:
        lines += ["", *loop.call_lines(timers.get(loop.call.timer or "", []))]
    return "\n".join([*lines, "END_PROGRAM"]) + "\n"


def header_comments(image: Program, checklist: tuple[str, ...]) -> Iterator[str]:
    """The comments above: the checklist for people, and what no variable holds for the way back."""
    yield "Delta AS: DPIDE instructions (API 0708) in Structured Text"
    for item in checklist:
        yield f"check after the download: {comment_text(item)}"
    yield f"plc: {settings_text(image.plc)}"
    for entry in image.settings:
        yield f"loop: {settings_text({key: value for key, value in entry.items() if key not in TEXT_SETTINGS})}"


def make_instructions(image: Program) -> Iterator[Instruction]:
    """The loops of an image with their symbols."""
    symbol_iterator = iter([*make_symbols(image)])
    for entry in image.settings:
        loop = str(entry["loop"])
        yield Instruction(
            loop,
            Call.model_validate(entry.get("call") or {}),
            frozenset(entry.get("devices") or ()) | {"I_MV"},
            {cell.field: cell for cell in image.cells if cell.loop == loop},
            {row.name: next(symbol_iterator) for row in DPIDE_TABLE.rows},
        )


def loops_of_timers(loops: Iterable[Instruction]) -> dict[str, list[Instruction]]:
    """The loops that each timer calls; raises `UnwritableError` where one timer would run for two times."""
    by_timer: dict[str, list[Instruction]] = {}
    for loop in loops:
        if loop.call.timer is not None:
            sharing = by_timer.setdefault(loop.call.timer, [])
            sharing.append(loop)
            if loop.cells["CYCLE"].raw != sharing[0].cells["CYCLE"].raw:
                cycles = f"{sharing[0].cells['CYCLE'].raw} ms of {sharing[0].name}"
                message = (
                    f"loop {loop.name}: {loop.call.timer} cannot run for {loop.cells['CYCLE'].raw} ms and {cycles}"
                )
                raise UnwritableError(f"{message}; give every CYCLE a timer of its own")
    return by_timer


def function_blocks(loops: Iterable[Instruction]) -> list[str]:
    """The function blocks, each once; raises `UnwritableError` for one that takes another's name, or a symbol's."""
    loops = [*loops]
    names = {symbol.name.casefold() for loop in loops for symbol in loop.symbols.values()}
    names |= {identifier(loop.name, suffix).casefold() for loop in loops for suffix in (WIDTH_SUFFIX, INSTANCE_SUFFIX)}
    names |= {name.casefold() for name in (INSTRUCTION, TIMER, PULSES, ENABLE_INTERRUPTS, PROGRAM, "Main")}
    by_name: dict[str, str] = {}
    for loop in loops:
        block = loop.call.function_block
        if block is None:
            continue
        other = by_name.setdefault(block.casefold(), block)
        if other != block or block.casefold() in names:
            raise UnwritableError(f"loop {loop.name}: the function block {block} has a name that something else has")
    return [*by_name.values()]


def function_block_text(name: str) -> Iterator[str]:
    """A function block with the instruction inside (D605)."""
    yield f"FUNCTION_BLOCK {name}"
    for section, rows in (
        ("VAR_INPUT", [row for row in DPIDE_TABLE.rows if row.access == "input" and row.name not in IN_OUT_OPERANDS]),
        ("VAR_IN_OUT", [row for row in DPIDE_TABLE.rows if row.name in IN_OUT_OPERANDS]),
        ("VAR_OUTPUT", [row for row in DPIDE_TABLE.rows if row.access == "output"]),
    ):
        yield section
        yield from (f"    {row.name} : {row.type.name}; (* {comment_text(row.title)} *)" for row in rows)
        yield "END_VAR"
    yield from call_text(INSTRUCTION, {EN: ALWAYS_ON_BIT}, {row.name: row.name for row in DPIDE_TABLE.rows})
    yield "END_FUNCTION_BLOCK"


# --- The files, and what a person checks after a download -------------------------------------------------------------

PLAIN_LISTINGS = parameter_listings("operand listing")
FORMATS = {
    "text": PLAIN_LISTINGS["text"],
    "csv": replace(PLAIN_LISTINGS["csv"], read=read_csv_devices),
    "json": replace(
        PLAIN_LISTINGS["json"],
        read=read_json_devices,
        looks_like=lambda text: PLAIN_LISTINGS["json"].looks_like(text) and not looks_like_st(text),
    ),
    "st": FileKind("st", "program in Structured Text", write_st, read_st, looks_like_st, carries_checklist=True),
    "operands": FileKind(
        "operands",
        "operand table (CSV)",
        write_operands,
        read_operands,
        lambda text: {"operand", "value"} <= set(column_names(text)),
    ),
    "symbols": FileKind(
        "symbols",
        "symbol table of ISPSoft (CSV)",
        write_symbols,
        read_symbols,
        lambda text: {name.lower() for name in COLUMNS[:3]} <= set(column_names(text)),
        encoding=ENCODING,
        merge=merge_symbols,
        is_complete=False,
    ),
    "modbus-map": map_kind(lambda image: symbol_template_rows(points(image), TREND_OPERANDS)),
}


def checklist(config: DpideFile) -> tuple[str, ...]:
    """What no file does by itself: devices, the direction, and where the instruction stands."""
    if not config.loops:
        return ()
    blocks = ", ".join(f"{loop.name} {device_range('I_MV', loop.device)}" for loop in config.loops)
    items = [
        f"nothing else in the program may use the registers of I_MV: {blocks}",
        f"direction of control: {'; '.join(_direction_text(loop) for loop in config.loops)}",
    ]
    numbers = [f"{loop.name} {', '.join(rows)}" for loop in config.loops if (rows := _unplaced_operands(loop))]
    if numbers:
        items.append(
            f"give these operands devices in the program, since they change while it runs: {'; '.join(numbers)}"
        )
    interval = config.plc.interrupt_task
    if interval is not None:
        items.append(f"call the instructions in a timed interrupt task of {interval} ms; CYCLE has no effect there")
    else:
        items += _call_advice(config.loops)
    pulses = [f"{loop.name} {loop.call.GPWM.output}" for loop in config.loops if loop.call.GPWM is not None]
    if pulses:
        items.append(
            f"MV is the time on in ms, and GPWM behind the instruction makes pulses of it: {', '.join(pulses)}"
        )
    items.append("see that the analog module converts each PV at least as often as its instruction calculates")
    items.append("of a symbol table, compare the initial values of REAL after the import; known exports have 0 only")
    return tuple(items)


def _call_advice(loops: Iterable[Loop]) -> Iterator[str]:
    """How often the program calls the instructions."""
    scanned = [f"{loop.name} {loop.CYCLE} ms" for loop in loops if loop.call.timer is None]
    timed = [f"{loop.name} {loop.call.timer}, {loop.CYCLE} ms" for loop in loops if loop.call.timer is not None]
    if scanned:
        cycles = ", ".join(scanned)
        yield f"call the instructions in every scan of a cyclic task; they wait for CYCLE themselves: {cycles}"
    if timed:
        yield f"these instructions are called by timers that run for CYCLE: {'; '.join(timed)}"


def _direction_text(loop: Loop) -> str:
    if loop.PID_DIR:
        return f"{loop.name} PID_DIR TRUE, MV rises while PV is below SV (heating)"
    return f"{loop.name} PID_DIR FALSE, MV rises while PV is above SV (cooling)"


def _unplaced_operands(loop: Loop) -> list[str]:
    """Operands that the PLC may write and that have no device in the file."""
    written_operands = [
        *PROCESS_OPERANDS,
        *(AUTOTUNE_OPERANDS if loop.PID_MODE == 1 else ()),
        *(["MOUT"] if loop.MOUT_AUTO else []),
    ]
    return [name for name in written_operands if name != "I_MV" and name not in loop.devices.by_operand()]


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
MAX_PER_REQUEST = {"coil": 256, "discrete": 256, "holding": 100, "input": 100}
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
    found = {point.name: point for entry in program.settings for point in _loop_points(program, entry)}
    return Symbols("a device or an operand of DPIDE", found, frozenset(ROWS), device_of)


def _loop_points(program: Program, entry: object) -> Iterator[Point]:
    settings = LoopSettings.model_validate(entry)
    loop = settings.loop
    devices = settings.devices.by_operand() | {"I_MV": settings.device}
    contents = {cell.field: cell.raw for cell in program.cells if cell.loop == loop}
    values = {row.name: contents.get(row.name, row.type.default) for row in DPIDE_TABLE.rows}
    for row in DPIDE_TABLE.rows:
        writer = writer_of(WRITERS, row.name, values)
        is_live = writer is not None and writer.kind == "live"
        device = devices.get(row.name, "")
        is_setting = row.name in contents and not is_live
        is_placed = bool(device)
        yield Point(
            f"{loop}.{row.name}", row.type, loop, is_setting and is_placed, is_setting and not is_placed, device
        )
