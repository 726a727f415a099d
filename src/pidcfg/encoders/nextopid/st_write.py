"""A NextoPID program as Structured Text: declarations with initial values, and the calls in order of execution."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.files import UnwritableError
from pidcfg.encoders.nextopid.st_expression import ST, depth, is_number, printed
from pidcfg.encoders.nextopid.st_program import Unit
from pidcfg.encoders.st.text import comment_text, literal, settings_text, wrapped
from pidcfg.schemas.iec import BOOL, Wire

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.nextopid.moves import Copy
    from pidcfg.encoders.nextopid.st_program import Variable
    from pidcfg.encoders.nextopid.wiring import Instance
    from pidcfg.encoders.parameters import Content, Parameter, Program
    from pidcfg.schemas.expressions import Expression
    from pidcfg.schemas.iec import IecType

DEEPEST = 100
"""Levels of parentheses that the reader takes."""


def write_st(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """The program as text."""
    unit = Unit(image)
    lines = [f"(* {text} *)" for text in header(image, checklist)]
    lines += [f"PROGRAM {unit.program}", "VAR"]
    for variable in unit.variables():
        lines += (f"    {line}" for line in declaration(variable))
    lines += ["END_VAR", "", *statements(unit), "END_PROGRAM"]
    return "\n".join(lines) + "\n"


def header(image: Program, checklist: tuple[str, ...]) -> Iterator[str]:
    """The comments above: the checklist for people, and what no parameter holds for the way back."""
    yield "NextoPID: declarations, and calls in the order of execution"
    for item in checklist:
        yield f"check after the download: {comment_text(item)}"
    yield f"plc: {settings_text({key: value for key, value in image.plc.items() if key != 'moves'})}"
    for entry in image.settings:
        yield f"loop: {settings_text(entry)}"


# --- declarations ----------------------------------------------------------------------------------------------------


def declaration(variable: Variable) -> list[str]:
    """A variable with its initial value."""
    head, note = f"{variable.name} : {variable.type}", f" (* {variable.note} *)" if variable.note else ""
    if variable.initial is None:
        return [f"{head};{note}"]
    if isinstance(variable.initial, tuple):
        return [f"{head} := {literal(*variable.initial)};{note}"]
    return wrapped(f"{head} := (", members(variable.initial), ");")


def members(initial: Mapping[str, tuple[IecType, Content]]) -> list[str]:
    """Initial values of an instance; those of a structure together."""
    texts: dict[str, list[str]] = {}
    for name, (kind, content) in initial.items():
        first, _, rest = name.partition(".")
        texts.setdefault(first, []).append(f"{rest} := {literal(kind, content)}" if rest else literal(kind, content))
    inside = {row.partition(".")[0] for row in initial if "." in row}
    return [f"{name} := ({', '.join(of)})" if name in inside else f"{name} := {of[0]}" for name, of in texts.items()]


# --- calls -----------------------------------------------------------------------------------------------------------


def statements(unit: Unit) -> Iterator[str]:
    """The calls, between what is copied before them and behind them."""
    yield from copies(unit, [copy for copy in unit.copies if copy.at_start])
    yield from calls(unit)
    yield from copies(unit, [copy for copy in unit.copies if not copy.at_start])


def copies(unit: Unit, listed: list[Copy]) -> Iterator[str]:
    """Assignments, those of one condition together as long as none of them changes it."""
    at = 0
    while at < len(listed):
        when, end = listed[at].when, at + 1
        if when is None:
            yield _assignment(unit, listed[at])
            at = end
            continue
        while end < len(listed) and _goes_on(listed[end], when, listed[end - 1].target):
            end += 1
        yield f"IF {wired(unit, BOOL, when, 'moves')} THEN"
        yield from (f"    {_assignment(unit, copy)}" for copy in listed[at:end])
        yield "END_IF;"
        at = end


def _goes_on(copy: Copy, when: Expression, written: int) -> bool:
    """Whether a copy has the condition of the one before it, which has not changed that."""
    same = copy.when is not None and (copy.when.code, copy.when.constants) == (when.code, when.constants)
    return same and written not in when.signals


def _assignment(unit: Unit, copy: Copy) -> str:
    name = unit.names[copy.target]
    value = copy.literal
    text = wired(unit, copy.type, copy.value, name) if value is None else literal(copy.type, value)
    return f"{name} := {text};"


def calls(unit: Unit) -> Iterator[str]:
    """The calls."""
    for i in unit.order:
        late = unit.previous(i)
        if late:
            yield f"(* of the previous cycle: {', '.join(late)} *)"
        if i not in unit.counters:
            yield from call(unit, i)
            continue
        counter, cycles = unit.counters[i]
        yield f"IF {counter} = 0 THEN"
        yield from (f"    {line}" for line in call(unit, i))
        yield "END_IF;"
        yield f"{counter} := ({counter} + 1) MOD {cycles};"


def call(unit: Unit, i: int) -> Iterator[str]:
    """The call of a block: every wired parameter, of a function all that is given, and its outputs."""
    block = unit.layout.instances[i]
    arguments = []
    for offset, row in enumerate(block.kind.table.rows):
        name = unit.names[block.base + offset]
        if row.access == "output":
            arguments += [f"{row.name} => {name}"] if block.kind.function else []
            continue
        text = argument(unit, i, block, row)
        if text is not None and "." in row.name:
            yield f"{block.name}.{row.name} := {text};"  # a member of a structure cannot be an argument
            continue
        if text is not None and block.kind.function and block.base + offset in unit.read:
            if (i, row.name) in unit.wires:
                yield f"{name} := {text};"
            text = name
        arguments += [] if text is None else [f"{row.name} := {text}"]
    name = block.kind.name if block.kind.function else block.name
    yield from wrapped(f"{name}(", arguments, ");")


def argument(unit: Unit, i: int, block: Instance, row: Parameter) -> str | None:
    """What stands behind ``:=`` in a call, if anything."""
    wire = unit.wires.get((i, row.name))
    if wire is not None:
        return wired(unit, row.type, wire, f"{block.name}.{row.name}")
    cell = unit.cells.get(f"{block.name}.{row.name}")
    if not block.kind.function or cell is None or isinstance(cell.raw, Wire):
        return None
    return literal(row.type, cell.raw)


def wired(unit: Unit, kind: IecType, wire: Expression, place: str) -> str:
    """A wire as a text of its type."""
    if wire.signal is not None and unit.type_of(wire.signal) == kind:
        return unit.names[wire.signal]
    text = printed(wire.code, wire.constants, lambda number: _operand(unit, number), ST)
    if depth(text) > DEEPEST:
        raise UnwritableError(f"{place}: the expression is nested too deeply for Structured Text; split it")
    if kind.kind != "whole":
        return text
    return f"REAL_TO_{kind.name}{text}" if is_number(wire.code) else f"REAL_TO_{kind.name}({text})"


def _operand(unit: Unit, number: int) -> str:
    """A name as an operand: numbers are REAL, and a TIME is its seconds."""
    kind, name = unit.type_of(number), unit.names[number]
    if kind.kind == "time":
        return f"(TIME_TO_REAL({name}) / 1000.0)"
    return f"{kind.name}_TO_REAL({name})" if kind.kind == "whole" else name
