"""DPIDE instructions as Structured Text: declarations with devices and initial values, and the calls."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from pidcfg.encoders.dpide.symbols import Symbol, identifier, symbols
from pidcfg.encoders.listing import UnwritableError
from pidcfg.encoders.maps.dpide import DPIDE_TABLE, OUTSIDE, WRITTEN_BY_AUTOTUNE
from pidcfg.encoders.parameters import Entry, Parameter, Program
from pidcfg.encoders.structured_text import comment_text, literal, settings_text, wrap_call
from pidcfg.schemas.dpide import Call
from pidcfg.text.references import Decision

# --- DPIDE in program text: what its writer and its reader share ------------------------------------------------------
#
# Design. A program is one text of IEC 61131-3: settings that no variable holds in comments, declarations, and a call
# of the instruction with all 21 operands by name. An operand is a number in the call, or a symbol; a symbol is
# declared with its device and its initial value, as a row of ISPSoft's symbol table has it, and the names are those
# of that table.
#
# - `st_write` prints an image: numbers where nothing else writes the operand and it has no device, else symbols.
# - `st_scope` takes a text apart into programs and function blocks, and knows what is declared and what an operand of
#   a call is: a number, a symbol, or a device.
# - `st_read` takes the calls, directly or of a function block with the instruction inside, with what stands around
#   them, and makes a listing: a loop a call, its devices and its first values.
# - `symbols` has the tables. What an operand holds that no text says stands in a symbol table that is read together
#   with the program.
#
# What is not about DPIDE is left out, and its lines are named.

D602 = Decision(
    602,
    "DPIDE in Structured Text is a call with its operands by name",
    "DPIDE(EN := …, PID_RUN := …, …, I_MV := …, MV => …), in the order of the manual's drawing. Programs by hand may "
    "also have 21 operands by position in this order, or 22 with EN before them; names and positions are not mixed, "
    "and none may be missing.",
    "The manual prints ladder alone, with the names of all inputs on the left and MV on the right. IEC 61131-3 "
    "has both forms; by name no two operands can be swapped. ISPSoft has not compiled it yet.",
)
D603 = Decision(
    603,
    "numbers stand in the call, what is written has a symbol",
    "Operands with a device, and those that the process, the instruction or its autotune may write, are symbols with "
    "device and initial value; all others are numbers. In a function block also what is VAR_IN_OUT.",
    "A number in the call reaches the PLC whatever an import does with initial values (D257). The manual allows no "
    "number for PID_MODE 1, and nothing can be written to a number.",
)
D604 = Decision(
    604,
    "the instruction is enabled by SM400 where nothing else is said",
    "EN := SM400; on the way back SM400, TRUE and no EN are the same. Another bit is `call.EN`. A condition that is no "
    "single bit is not carried over, and is named.",
    "SM400 is the contact before En in the manual's examples 4 and 5, where the instruction is always executed.",
)
D605 = Decision(
    605,
    "MOUT of a function block is VAR_IN_OUT",
    "The function block has PID_MODE, Kc_Kp, Ti_Ki, Td_Kd, Tf, I_MV, and MOUT as VAR_IN_OUT, MV as VAR_OUTPUT and the "
    "others as VAR_INPUT.",
    "The manual lists the first six. With MOUT_AUTO TRUE the instruction writes MOUT, too: a VAR_INPUT would take the "
    "old value again with the next call, and the output would jump when manual begins.",
)
D606 = Decision(
    606,
    "GPWM, TMRH and EI are called by position",
    "TMRH(enable, timer, ms), GPWM(enable, width, cycle, output), EI(). The width is REAL_TO_INT(MV); a timer that has "
    "called the instruction is assigned FALSE.",
    "The drawings of examples 3 to 5 have these operands in this order, without names that can be read; neither can "
    "the name of the conversion in example 3, nor the device of its pulses. The coil of example 4 resets the timer.",
)
D607 = Decision(
    607,
    "a whole number is no REAL in a call",
    "SV := 80 is refused, SV := 80.0 is meant; so is 1000.0 for a DINT. K80 and F80.0 count as 80 and 80.0. As initial "
    "value of a REAL 80 is 80.0.",
    "The operand table wants single-precision numbers; the bits of a whole number are another one (80 is 1.1e-43). "
    "Exports of symbol tables have 0 as initial value of a REAL (D257).",
)
D608 = Decision(
    608,
    "the inner drawing of example 4 has PID_RUN twice",
    "The input of the function block at PID_DIR is PID_DIR.",
    "The drawing repeats PID_RUN in its place; a loop that runs would then always heat. The call of the block in the "
    "same example has DPIDE_DIR at PID_DIR.",
)
D609 = Decision(
    609,
    "what a symbol holds is its initial value",
    "or the number that the program assigns to it without a condition. An operand of which neither the program nor a "
    "symbol table says that is FALSE or 0 (D255), and named; SV, CYCLE, the three coefficients and the limits must be "
    "known. Other assignments are named by line.",
    "A program says where operands stand, and only sometimes what they hold.",
)

INSTRUCTION, TIMER, PULSES, ENABLE_INTERRUPTS = "DPIDE", "TMRH", "GPWM", "EI"
EN = "EN"
ALWAYS = "SM400"
"""The bit that enables what is always executed (D604)."""
IN_OUT = (*WRITTEN_BY_AUTOTUNE, "MOUT", "I_MV")
"""What a function block has as VAR_IN_OUT (D605)."""
OPERANDS = tuple(row.name for row in DPIDE_TABLE.rows)
"""All operands in the manual's order."""
WITHOUT_NUMBER = frozenset(OUTSIDE)
"""Operands that cannot be numbers: the process or the instruction writes them."""
PROGRAM = "PidLoops"
WIDTH, INSTANCE = "WIDTH", "FB"
"""Suffixes of the variable with the width of the pulses, and of the instance of a function block."""

# --- DPIDE instructions as Structured Text: declarations with devices and initial values, and the calls ---------------

IN_TEXT = ("device", "devices", "call")
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
            or operand in OUTSIDE
            or (tunes and operand in WRITTEN_BY_AUTOTUNE)
            or (follows and operand == "MOUT")
            or (self.call.function_block is not None and operand in IN_OUT)
        )

    def argument(self, row: Parameter) -> str:
        """What stands at an operand."""
        if self.is_symbol(row.name):
            return self.symbols[row.name].name
        return literal(row.type, self.cells[row.name].content)

    def declared(self) -> Iterator[str]:
        """The variables of the loop."""
        for row in DPIDE_TABLE.rows:
            if self.is_symbol(row.name):
                symbol = self.symbols[row.name]
                cell = None if row.name in {"I_MV", "MV"} else self.cells.get(row.name)
                place = f" AT {symbol.address}" if symbol.address else ""
                value = "" if cell is None else f" := {literal(row.type, cell.content)}"
                note = comment_text(symbol.comment)
                yield f"{symbol.name}{place} : {row.type.name}{value}; (* {note} *)"
        if self.call.GPWM is not None:
            yield f"{identifier(self.name, WIDTH)} : INT; (* time on in ms, for {PULSES} *)"
        if self.call.function_block is not None:
            yield f"{identifier(self.name, INSTANCE)} : {self.call.function_block};"

    @property
    def cycle(self) -> str:
        """What stands at CYCLE."""
        return next(self.argument(row) for row in ROWS if row.name == "CYCLE")

    def statements(self, sharing: list[Instruction]) -> Iterator[str]:
        """The call, and what stands around it; ``sharing``: all loops with its timer, which runs once for them."""
        call, block = self.call, self.call.function_block
        if block is None:
            lines = call_text(INSTRUCTION, {EN: call.EN or ALWAYS}, {row.name: self.argument(row) for row in ROWS})
        else:
            enable = {} if call.EN is None else {EN: call.EN}
            lines = call_text(identifier(self.name, INSTANCE), enable, {row.name: self.argument(row) for row in ROWS})
        yield f"(* {comment_text(self.name)} *)"
        if call.timer is None:
            yield from lines
        else:
            if self is sharing[0]:
                yield f"{TIMER}({ALWAYS}, {call.timer}, {self.cycle});"
            yield f"IF {call.timer} THEN"
            yield from (f"    {line}" for line in lines)
            if self is sharing[-1]:
                yield f"    {call.timer} := FALSE;"
            yield "END_IF;"
        if call.GPWM is not None:
            width = identifier(self.name, WIDTH)
            yield f"{width} := REAL_TO_INT({self.symbols['MV'].name});"
            yield f"{PULSES}({ALWAYS}, {width}, {call.GPWM.cycle}, {call.GPWM.output});"


ROWS = DPIDE_TABLE.rows


def call_text(name: str, enable: Mapping[str, str], arguments: Mapping[str, str]) -> list[str]:
    """A call with its operands by name; outputs have another sign."""
    outputs = {row.name for row in ROWS if row.access == "output"}
    listed = [f"{key} := {value}" for key, value in enable.items()]
    listed += [f"{key} {'=>' if key in outputs else ':='} {value}" for key, value in arguments.items()]
    return wrap_call(f"{name}(", listed)


def write_st(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """The program as text; raises `UnwritableError` for a loop whose name gives no symbols."""
    loops = [*instructions(image)]
    lines = [f"(* {text} *)" for text in header(image, checklist)]
    for block in blocks(loops):
        lines += [*function_block(block), ""]
    if "interrupt_task" in image.plc:
        lines += ["(* in a cyclic task *)", "PROGRAM Main", f"{ENABLE_INTERRUPTS}();", "END_PROGRAM", ""]
        lines += [f"(* in the timed interrupt task of {image.plc['interrupt_task']} ms *)"]
    declared = [f"    {line}" for loop in loops for line in loop.declared()]
    lines += [f"PROGRAM {PROGRAM}", "VAR", *declared, "END_VAR"]
    timers = loops_of_timers(loops)
    for loop in loops:
        lines += ["", *loop.statements(timers.get(loop.call.timer or "", []))]
    return "\n".join([*lines, "END_PROGRAM"]) + "\n"


def header(image: Program, checklist: tuple[str, ...]) -> Iterator[str]:
    """The comments above: the checklist for people, and what no variable holds for the way back."""
    yield "Delta AS: DPIDE instructions (API 0708) in Structured Text"
    for item in checklist:
        yield f"check after the download: {comment_text(item)}"
    yield f"plc: {settings_text(image.plc)}"
    for entry in image.settings:
        yield f"loop: {settings_text({key: value for key, value in entry.items() if key not in IN_TEXT})}"


def instructions(image: Program) -> Iterator[Instruction]:
    """The loops of an image with their symbols."""
    named = iter([*symbols(image)])
    for entry in image.settings:
        loop = str(entry["loop"])
        yield Instruction(
            loop,
            Call.model_validate(entry.get("call") or {}),
            frozenset(entry.get("devices") or ()) | {"I_MV"},
            {cell.field: cell for cell in image.cells if cell.loop == loop},
            {row.name: next(named) for row in ROWS},
        )


def loops_of_timers(loops: Iterable[Instruction]) -> dict[str, list[Instruction]]:
    """The loops that each timer calls; raises `UnwritableError` where one timer would run for two times."""
    found: dict[str, list[Instruction]] = {}
    for loop in loops:
        if loop.call.timer is not None:
            first = found.setdefault(loop.call.timer, [])
            first.append(loop)
            if loop.cells["CYCLE"].raw != first[0].cells["CYCLE"].raw:
                cycles = f"{first[0].cells['CYCLE'].raw} ms of {first[0].name}"
                message = (
                    f"loop {loop.name}: {loop.call.timer} cannot run for {loop.cells['CYCLE'].raw} ms and {cycles}"
                )
                raise UnwritableError(f"{message}; give every CYCLE a timer of its own")
    return found


def blocks(loops: Iterable[Instruction]) -> list[str]:
    """The function blocks, each once; raises `UnwritableError` for one that takes another's name, or a symbol's."""
    loops = [*loops]
    taken = {symbol.name.casefold() for loop in loops for symbol in loop.symbols.values()}
    taken |= {identifier(loop.name, suffix).casefold() for loop in loops for suffix in (WIDTH, INSTANCE)}
    taken |= {name.casefold() for name in (INSTRUCTION, TIMER, PULSES, ENABLE_INTERRUPTS, PROGRAM, "Main")}
    found: dict[str, str] = {}
    for loop in loops:
        block = loop.call.function_block
        if block is None:
            continue
        other = found.setdefault(block.casefold(), block)
        if other != block or block.casefold() in taken:
            raise UnwritableError(f"loop {loop.name}: the function block {block} has a name that something else has")
    return [*found.values()]


def function_block(name: str) -> Iterator[str]:
    """A function block with the instruction inside (D605)."""
    yield f"FUNCTION_BLOCK {name}"
    for section, rows in (
        ("VAR_INPUT", [row for row in ROWS if row.access == "input" and row.name not in IN_OUT]),
        ("VAR_IN_OUT", [row for row in ROWS if row.name in IN_OUT]),
        ("VAR_OUTPUT", [row for row in ROWS if row.access == "output"]),
    ):
        yield section
        yield from (f"    {row.name} : {row.type.name}; (* {comment_text(row.title)} *)" for row in rows)
        yield "END_VAR"
    yield from call_text(INSTRUCTION, {EN: ALWAYS}, {row.name: row.name for row in ROWS})
    yield "END_FUNCTION_BLOCK"
