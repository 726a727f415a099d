"""DPIDE instructions as Structured Text: declarations with devices and initial values, and the calls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.encoders.dpide.program import (
    ALWAYS,
    EN,
    ENABLE_INTERRUPTS,
    IN_OUT,
    INSTANCE,
    INSTRUCTION,
    PROGRAM,
    PULSES,
    TIMER,
    WIDTH,
)
from pidcfg.encoders.dpide.symbols import Symbol, identifier, symbols
from pidcfg.encoders.files import UnwritableError
from pidcfg.encoders.maps.dpide import DPIDE_TABLE, OUTSIDE, WRITTEN_BY_AUTOTUNE
from pidcfg.encoders.st.text import comment_text, literal, settings_text, wrapped
from pidcfg.schemas.dpide_call import Call

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from pidcfg.encoders.parameters import Entry, Parameter, Program

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
        return literal(row.type, self.cells[row.name].raw)  # type: ignore[arg-type]

    def declared(self) -> Iterator[str]:
        """The variables of the loop."""
        for row in DPIDE_TABLE.rows:
            if self.is_symbol(row.name):
                symbol = self.symbols[row.name]
                cell = None if row.name in {"I_MV", "MV"} else self.cells.get(row.name)
                place = f" AT {symbol.address}" if symbol.address else ""
                value = "" if cell is None else f" := {literal(row.type, cell.raw)}"  # type: ignore[arg-type]
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
            lines = called(INSTRUCTION, {EN: call.EN or ALWAYS}, {row.name: self.argument(row) for row in ROWS})
        else:
            enable = {} if call.EN is None else {EN: call.EN}
            lines = called(identifier(self.name, INSTANCE), enable, {row.name: self.argument(row) for row in ROWS})
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


def called(name: str, enable: Mapping[str, str], arguments: Mapping[str, str]) -> list[str]:
    """A call with its operands by name; outputs have another sign."""
    outputs = {row.name for row in ROWS if row.access == "output"}
    listed = [f"{key} := {value}" for key, value in enable.items()]
    listed += [f"{key} {'=>' if key in outputs else ':='} {value}" for key, value in arguments.items()]
    return wrapped(f"{name}(", listed, ");")


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
    yield from called(INSTRUCTION, {EN: ALWAYS}, {row.name: row.name for row in ROWS})
    yield "END_FUNCTION_BLOCK"
