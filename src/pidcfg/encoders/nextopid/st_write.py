"""A NextoPID program as Structured Text and as PLCopen XML: declarations, and calls in the order of execution."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from html import escape
from itertools import chain
from typing import NamedTuple

from pidcfg.encoders.listing import UnwritableError
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, BlockType
from pidcfg.encoders.nextopid.image import Copy, MoveError, read_moves
from pidcfg.encoders.nextopid.wiring import Instance, Layout, Wires
from pidcfg.encoders.parameters import Content, Entry, Parameter, Program
from pidcfg.encoders.structured_text import comment_text, literal_text, settings_text, wrap_call
from pidcfg.schemas.base import LIKE_BOOLEAN
from pidcfg.schemas.expressions import (
    ABSOLUTE,
    ADD,
    BOOL_VALUES,
    COMPARISONS,
    CONSTANT,
    DIVIDE,
    EQUALITIES,
    FUNCTIONS,
    JOIN_LEVELS,
    MAX_LENGTH,
    MAXIMUM,
    MINIMUM,
    MULTIPLY,
    NEGATE,
    NOT,
    ROOT,
    SIGNAL,
    SUBTRACT,
    TRUTH,
    Expression,
    ExpressionError,
)
from pidcfg.schemas.iec import AUTOTUNE_MODE, BOOL, IecType, Wire, is_numeric, real_text
from pidcfg.schemas.nextopid import Move, Plc
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.frozen import frozen

# --- Expressions in Structured Text and in configuration files: the same code, printed in two dialects ----------------
#
# What is printed here reads back to the same code, so that no sum is taken in another order: `print_expression` sets
# parentheses wherever the order of evaluation is not the one that the language has by itself.

EQUALITY, COMPARISON, SUM, PRODUCT, SIGN, ATOM = range(len(JOIN_LEVELS), len(JOIN_LEVELS) + 6)
"""How tightly a text binds; what words join binds less."""
OPERATORS = {
    **{op: (word, rank) for rank, level in enumerate(JOIN_LEVELS) for word, op in level.items()},
    **{op: (sign, EQUALITY) for sign, op in EQUALITIES.items()},
    **{op: (sign, COMPARISON) for sign, op in COMPARISONS.items()},
    ADD: ("+", SUM),
    SUBTRACT: ("-", SUM),
    MULTIPLY: ("*", PRODUCT),
    DIVIDE: ("/", PRODUCT),
}
BOOL_TEXTS = {value: word for word, value in BOOL_VALUES.items()}


@frozen
class Dialect:
    """How a language writes numbers and functions."""

    number: Callable[[float], str]
    functions: Mapping[int, str]
    max_arguments: Mapping[int, int]
    """Of min and max; more are nested."""
    space: str = " "


class Piece(NamedTuple):
    """Part of an expression as text, how tightly it binds, and the arguments if it is a call."""

    text: str
    rank: int
    op: int = -1
    arguments: tuple[str, ...] = ()


def plain_number_text(value: float) -> str:
    """A number as people write it."""
    return repr(value).removesuffix(".0")


FUNCTION_NAMES = {op: name for name, (op, _, _) in FUNCTIONS.items()}
ST_DIALECT = Dialect(real_text, {op: name.upper() for op, name in FUNCTION_NAMES.items()}, {MINIMUM: 2, MAXIMUM: 2})
PLAIN_DIALECT = Dialect(
    plain_number_text, FUNCTION_NAMES, {FUNCTIONS[name][0]: FUNCTIONS[name][2] for name in ("min", "max")}
)
COMPACT_DIALECT = Dialect(PLAIN_DIALECT.number, PLAIN_DIALECT.functions, PLAIN_DIALECT.max_arguments, "")
"""As configuration files have it, for an expression that would be too long with blanks."""


def print_expression(
    code: Sequence[int], constants: Sequence[float], name: Callable[[int], str], dialect: Dialect
) -> str:
    """The text of an expression's code; ``name`` gives the name of a signal's number.

    A number and nothing else stands in parentheses: it is wired, and not the value of a parameter.
    """
    stack: list[Piece] = []
    for op, operand in zip(code[::2], code[1::2], strict=True):
        if op == CONSTANT:
            stack.append(Piece(dialect.number(constants[operand]), ATOM))
        elif op == SIGNAL:
            stack.append(Piece(name(operand), ATOM))
        elif op == TRUTH:
            stack.append(Piece(BOOL_TEXTS[operand], ATOM))
        elif op in (NEGATE, NOT):
            stack.append(Piece(f"{'-' if op == NEGATE else 'NOT '}{_atom_text(stack.pop())}", SIGN))
        elif op in (ABSOLUTE, ROOT):
            stack.append(_call_piece(op, (stack.pop().text,), dialect))
        else:
            right, left = stack.pop(), stack.pop()
            stack.append(_join_pieces(op, left, right, dialect))
    text = stack.pop().text
    return f"({text})" if is_number(code) else text


def is_number(code: Sequence[int]) -> bool:
    """Whether an expression is a number with or without signs or a truth, and nothing else."""
    return set(code[::2]) <= {CONSTANT, NEGATE, TRUTH}


def _join_pieces(op: int, left: Piece, right: Piece, dialect: Dialect) -> Piece:
    if op in OPERATORS:
        sign, rank = OPERATORS[op]
        left_text = left.text if left.rank >= rank else f"({left.text})"
        right_text = right.text if right.rank > rank and not right.text.startswith("-") else f"({right.text})"
        space = " " if sign.isalpha() else dialect.space
        return Piece(f"{left_text}{space}{sign}{space}{right_text}", rank)
    if left.op == op and len(left.arguments) < dialect.max_arguments[op]:
        return _call_piece(op, (*left.arguments, right.text), dialect)
    return _call_piece(op, (left.text, right.text), dialect)


def _atom_text(piece: Piece) -> str:
    return piece.text if piece.rank == ATOM else f"({piece.text})"


def _call_piece(op: int, arguments: tuple[str, ...], dialect: Dialect) -> Piece:
    return Piece(f"{dialect.functions[op]}({f',{dialect.space}'.join(arguments)})", ATOM, op, arguments)


def wire_text(code: Sequence[int], constants: Sequence[float], name: Callable[[int], str]) -> str:
    """An expression as a configuration has it; a name that would be read as a number or a truth gets parentheses."""
    text = print_expression(code, constants, name, PLAIN_DIALECT)
    text = print_expression(code, constants, name, COMPACT_DIALECT) if len(text) > MAX_LENGTH else text
    return f"({text})" if is_numeric(text) or text.lower() in {*LIKE_BOOLEAN, "null"} else text


def parenthesis_depth(text: str) -> int:
    """How deep the parentheses of a text are nested."""
    max_depth = depth_now = 0
    for character in text:
        depth_now += (character == "(") - (character == ")")
        max_depth = max(max_depth, depth_now)
    return max_depth


# --- A NextoPID program as a programming system holds it: variables, and calls in the order of execution --------------
#
# Design. `Unit` rebuilds wiring and execution order from the listing. Functions have no instance, so their outputs,
# and those of their inputs that something reads, become variables with new names. The comment of each such variable
# says which parameter it is, ``SEL.MV``; the readers of Structured Text and PLCopen XML rely on it.

CONVERSIONS = (
    "INT_TO_REAL",
    "UINT_TO_REAL",
    "USINT_TO_REAL",
    "DINT_TO_REAL",
    "TIME_TO_REAL",
    "REAL_TO_INT",
    "REAL_TO_UINT",
)
RESERVED = frozenset(name.upper() for name in (*BLOCK_TYPES, *CONVERSIONS, AUTOTUNE_MODE.name, *AUTOTUNE_MODE.words))
"""Names that a variable cannot have, in capitals: IEC 61131-3 ignores case."""
UINT_CYCLES = 0xFFFF


class Variable(NamedTuple):
    """A variable of the program: initial values of an instance by parameter, members of a structure with a dot."""

    name: str
    type: str
    initial: Mapping[str, tuple[IecType, Content]] | tuple[IecType, Content] | None = None
    note: str = ""


def is_always_declared(kind: BlockType, row: Parameter) -> bool:
    """Whether a parameter is declared even when it has its default value."""
    field = kind.model.model_fields.get(row.name)
    return field is None or field.is_required() or field.default is None


@dataclass(frozen=True)
class Unit:
    """The variables and calls of a program; raises `UnwritableError` for what Structured Text cannot hold."""

    image: Program

    @cached_property
    def signals(self) -> dict[str, Entry]:
        """Values from outside."""
        return {cell.address: cell for cell in self.image.cells if "." not in cell.address}

    @cached_property
    def layout(self) -> Layout:
        """Names, numbers and types."""
        types = {name: cell.type for name, cell in self.signals.items()}
        blocks = [(entry.get("loop") or entry["block"], BLOCK_TYPES[entry["type"]]) for entry in self.image.settings]
        names_by_upper: dict[str, str] = {}
        names = [*types, *(name for name, _ in blocks)]
        for name in names:
            other = names_by_upper.setdefault(name.upper(), name)
            if other != name or name.upper() in RESERVED or names.count(name) > 1:
                reason = "of a type or function of the library" if name.upper() in RESERVED else f"of another ({other})"
                raise UnwritableError(f"{name}: Structured Text takes the name for that {reason}; rename it")
        return Layout.of(types, blocks)

    @cached_property
    def wires(self) -> Wires:
        """What every wire means."""
        numbers = {block.name: i for i, block in enumerate(self.layout.instances)}
        wires: Wires = {}
        for cell in self.image.cells:
            owner, _, row = cell.address.partition(".")
            if isinstance(cell.raw, Wire):
                try:
                    wires[numbers[owner], row] = self.layout.read_wire(cell.type, cell.raw.text)
                except ExpressionError as error:
                    raise UnwritableError(f"{cell.address}: {error.message}") from None
        return wires

    @cached_property
    def copies(self) -> list[Copy]:
        """What the program copies, in order."""
        wired = {cell.address for cell in self.image.cells if isinstance(cell.raw, Wire)}
        moves = [Move.model_validate(entry) for entry in self.image.plc.get("moves", ())]
        try:
            return read_moves(self.layout, moves, wired, self.cells)
        except MoveError as error:
            raise UnwritableError(f"moves: {error}") from None

    @cached_property
    def order(self) -> list[int]:
        """Instances in the order of execution."""
        return self.layout.execution_order(self.wires)

    @property
    def program(self) -> str:
        """Name of the program."""
        return str(self.image.plc.get("program") or Plc.model_fields["program"].default)

    # --- names -------------------------------------------------------------------------------------------------------

    @property
    def names(self) -> dict[int, str]:
        """The name of every value in the program, by its number."""
        return self._names_and_counters[0]

    @property
    def counters(self) -> dict[int, tuple[str, int]]:
        """Cycle counters of loops that are not called in every cycle: the variable, and the number of cycles."""
        return self._names_and_counters[1]

    @cached_property
    def _names_and_counters(self) -> tuple[dict[int, str], dict[int, tuple[str, int]]]:
        used_names = {
            name.upper() for name in (*self.signals, *(block.name for block in self.layout.instances), self.program)
        }
        used_names |= RESERVED
        names = {number: name for name, number in self.layout.numbers.items()}
        for block in self.layout.instances:
            for offset, row in enumerate(block.kind.table.rows if block.kind.function else ()):
                if row.access == "output" or block.base + offset in self.numbers_read:
                    names[block.base + offset] = unused_name(f"{block.name}_{row.name}", used_names)
        counters = {}
        for i, entry in enumerate(self.image.settings):
            cycles = cycles_of(entry, self.image.plc)
            if cycles != 1:
                counters[i] = (unused_name(f"{self.layout.instances[i].name}_Cycle", used_names), cycles)
        return names, counters

    @cached_property
    def numbers_read(self) -> frozenset[int]:
        """Numbers of all that some wire or move reads."""
        moved = (part.signals for copy in self.copies for part in (copy.value, copy.when) if part is not None)
        return frozenset(chain.from_iterable((*(wire.signals for wire in self.wires.values()), *moved)))

    def type_of(self, number: int) -> IecType:
        """The type of a value."""
        owner = self.layout.owner_of(number)
        if owner is None:
            return list(self.layout.signals.values())[number]
        block = self.layout.instances[owner]
        return block.kind.table.rows[number - block.base].type

    # --- cycles ------------------------------------------------------------------------------------------------------

    def previous_values(self, i: int) -> list[str]:
        """Values of the previous cycle that the call of a block reads."""
        names = []
        for number in sorted(self._numbers_read_by_block.get(i, ())):
            owner = self.layout.owner_of(number)
            if owner is not None and self._position[owner] >= self._position[i] and self._is_changed(owner, number):
                names.append(f"{self.layout.instances[owner].name}.{self._parameter_name(owner, number)}")
        return names

    def _is_changed(self, owner: int, number: int) -> bool:
        """Whether the call of a block changes one of its values: an output, or a wired input."""
        return not self.layout.is_input(number) or (owner, self._parameter_name(owner, number)) in self.wires

    def _parameter_name(self, owner: int, number: int) -> str:
        """The name of one of a block's values: ``MV``."""
        block = self.layout.instances[owner]
        return block.kind.table.rows[number - block.base].name

    @cached_property
    def _position(self) -> dict[int, int]:
        return {number: at for at, number in enumerate(self.order)}

    @cached_property
    def _numbers_read_by_block(self) -> dict[int, set[int]]:
        """Numbers that each block reads."""
        reads: dict[int, set[int]] = {}
        for (i, _), wire in self.wires.items():
            reads.setdefault(i, set()).update(wire.signals)
        return reads

    # --- variables ---------------------------------------------------------------------------------------------------

    def variables(self) -> Iterator[Variable]:
        """All declarations: signals, instances and variables of functions in the order of the file, counters."""
        for name, cell in self.signals.items():
            yield Variable(name, cell.type.name, (cell.type, cell_content(cell)))
        for block in self.layout.instances:
            if block.kind.function:
                yield from self._function_variables(block)
            else:
                yield Variable(block.name, block.kind.name, self.initial_values(block) or None)
        for name, cycles in self.counters.values():
            yield Variable(name, "UINT" if cycles <= UINT_CYCLES else "UDINT")

    def _function_variables(self, block: Instance) -> Iterator[Variable]:
        for offset, row in enumerate(block.kind.table.rows):
            full = f"{block.name}.{row.name}"
            if row.access == "output":
                yield Variable(self.names[block.base + offset], row.type.name, None, full)
            elif block.base + offset in self.numbers_read:
                cell = self.cells.get(full)
                fixed = cell is not None and not isinstance(cell.raw, Wire)
                initial = (row.type, cell_content(cell)) if cell is not None and fixed else None
                yield Variable(self.names[block.base + offset], row.type.name, initial, full)

    @cached_property
    def cells(self) -> dict[str, Entry]:
        """All parameters by their full names."""
        return {cell.address: cell for cell in self.image.cells}

    def initial_values(self, block: Instance) -> dict[str, tuple[IecType, Content]]:
        """Initial values of an instance: required parameters, and those that differ from the default of their type."""
        values = {}
        for row in block.kind.inputs:
            cell = self.cells.get(f"{block.name}.{row.name}")
            if cell is None or isinstance(cell.raw, Wire):
                continue
            if is_always_declared(block.kind, row) or cell.raw != row.type.default:
                values[row.name] = (row.type, cell_content(cell))
        return values


def unused_name(wanted: str, used_names: set[str]) -> str:
    """The wanted name or one with a number after it; it is then in use."""
    name, number = wanted, 1
    while name.upper() in used_names:
        name, number = f"{wanted}_{number}", number + 1
    used_names.add(name.upper())
    return name


def cell_content(cell: Entry) -> Content:
    """The text of a wire, or the content of a parameter that is not wired."""
    return cell.raw.text if isinstance(cell.raw, Wire) else cell.raw


def cycles_of(entry: Mapping[str, object], plc: Mapping[str, object]) -> int:
    """The interval of a loop in cycles of the task; raises `UnwritableError` where it is no multiple."""
    interval, task = entry.get("sample_time"), plc.get("sample_time")
    if interval is None:
        return 1
    times = [Decimal(str(time)) for time in (interval, task or 0)]
    if times[1] <= 0 or times[0] <= 0 or times[0] % times[1]:
        name = entry.get("loop") or entry.get("block")
        raise UnwritableError(f"{name}: {interval} s is no whole number of cycles of the task, {task} s")
    return int(times[0] / times[1])


# --- A NextoPID program as Structured Text: declarations with initial values, and the calls in order of execution -----

MAX_PARENTHESES = 100
"""Levels of parentheses that the reader takes."""


def write_st(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """The program as text."""
    unit = Unit(image)
    lines = [f"(* {text} *)" for text in header_comments(image, checklist)]
    lines += [f"PROGRAM {unit.program}", "VAR"]
    for variable in unit.variables():
        lines += (f"    {line}" for line in declaration_lines(variable))
    lines += ["END_VAR", "", *body_lines(unit), "END_PROGRAM"]
    return "\n".join(lines) + "\n"


def header_comments(image: Program, checklist: tuple[str, ...]) -> Iterator[str]:
    """The comments above: the checklist for people, and what no parameter holds for the way back."""
    yield "NextoPID: declarations, and calls in the order of execution"
    for item in checklist:
        yield f"check after the download: {comment_text(item)}"
    yield f"plc: {settings_text({key: value for key, value in image.plc.items() if key != 'moves'})}"
    for entry in image.settings:
        yield f"loop: {settings_text(entry)}"


# --- declarations ----------------------------------------------------------------------------------------------------


def declaration_lines(variable: Variable) -> list[str]:
    """A variable with its initial value."""
    head, note = f"{variable.name} : {variable.type}", f" (* {variable.note} *)" if variable.note else ""
    if variable.initial is None:
        return [f"{head};{note}"]
    if isinstance(variable.initial, tuple):
        return [f"{head} := {literal_text(*variable.initial)};{note}"]
    return wrap_call(f"{head} := (", member_texts(variable.initial))


def member_texts(initial: Mapping[str, tuple[IecType, Content]]) -> list[str]:
    """Initial values of an instance; those of a structure together."""
    texts: dict[str, list[str]] = {}
    for name, (kind, content) in initial.items():
        first, _, rest = name.partition(".")
        texts.setdefault(first, []).append(
            f"{rest} := {literal_text(kind, content)}" if rest else literal_text(kind, content)
        )
    inside = {row.partition(".")[0] for row in initial if "." in row}
    return [
        f"{name} := ({', '.join(values)})" if name in inside else f"{name} := {values[0]}"
        for name, values in texts.items()
    ]


# --- calls -----------------------------------------------------------------------------------------------------------


def body_lines(unit: Unit) -> Iterator[str]:
    """The calls, between what is copied before them and behind them."""
    yield from copy_lines(unit, [copy for copy in unit.copies if copy.at_start])
    yield from call_lines(unit)
    yield from copy_lines(unit, [copy for copy in unit.copies if not copy.at_start])


def copy_lines(unit: Unit, copies_left: list[Copy]) -> Iterator[str]:
    """Assignments, those of one condition together as long as none of them changes it."""
    begin = 0
    while begin < len(copies_left):
        when, end = copies_left[begin].when, begin + 1
        if when is None:
            yield _assignment_text(unit, copies_left[begin])
            begin = end
            continue
        while end < len(copies_left) and _has_same_condition(copies_left[end], when, copies_left[end - 1].target):
            end += 1
        yield f"IF {wire_content(unit, BOOL, when, 'moves')} THEN"
        yield from (f"    {_assignment_text(unit, copy)}" for copy in copies_left[begin:end])
        yield "END_IF;"
        begin = end


def _has_same_condition(copy: Copy, when: Expression, written_number: int) -> bool:
    """Whether a copy has the condition of the one before it, which has not changed that."""
    same = copy.when is not None and (copy.when.code, copy.when.constants) == (when.code, when.constants)
    return same and written_number not in when.signals


def _assignment_text(unit: Unit, copy: Copy) -> str:
    name = unit.names[copy.target]
    value = copy.literal_content
    text = wire_content(unit, copy.type, copy.value, name) if value is None else literal_text(copy.type, value)
    return f"{name} := {text};"


def call_lines(unit: Unit) -> Iterator[str]:
    """The calls."""
    for i in unit.order:
        late = unit.previous_values(i)
        if late:
            yield f"(* of the previous cycle: {', '.join(late)} *)"
        if i not in unit.counters:
            yield from block_call(unit, i)
            continue
        counter, cycles = unit.counters[i]
        yield f"IF {counter} = 0 THEN"
        yield from (f"    {line}" for line in block_call(unit, i))
        yield "END_IF;"
        yield f"{counter} := ({counter} + 1) MOD {cycles};"


def block_call(unit: Unit, i: int) -> Iterator[str]:
    """The call of a block: every wired parameter, of a function all that is given, and its outputs."""
    block = unit.layout.instances[i]
    arguments = []
    for offset, row in enumerate(block.kind.table.rows):
        name = unit.names[block.base + offset]
        if row.access == "output":
            arguments += [f"{row.name} => {name}"] if block.kind.function else []
            continue
        text = argument_text(unit, i, block, row)
        if text is not None and "." in row.name:
            yield f"{block.name}.{row.name} := {text};"  # a member of a structure cannot be an argument
            continue
        if text is not None and block.kind.function and block.base + offset in unit.numbers_read:
            if (i, row.name) in unit.wires:
                yield f"{name} := {text};"
            text = name
        arguments += [] if text is None else [f"{row.name} := {text}"]
    name = block.kind.name if block.kind.function else block.name
    yield from wrap_call(f"{name}(", arguments)


def argument_text(unit: Unit, i: int, block: Instance, row: Parameter) -> str | None:
    """What stands behind ``:=`` in a call, if anything."""
    wire = unit.wires.get((i, row.name))
    if wire is not None:
        return wire_content(unit, row.type, wire, f"{block.name}.{row.name}")
    cell = unit.cells.get(f"{block.name}.{row.name}")
    if not block.kind.function or cell is None or isinstance(cell.raw, Wire):
        return None
    return literal_text(row.type, cell.raw)


def wire_content(unit: Unit, kind: IecType, wire: Expression, place: str) -> str:
    """A wire as a text of its type."""
    if wire.signal is not None and unit.type_of(wire.signal) == kind:
        return unit.names[wire.signal]
    text = print_expression(wire.code, wire.constants, lambda number: _operand_text(unit, number), ST_DIALECT)
    if parenthesis_depth(text) > MAX_PARENTHESES:
        raise UnwritableError(f"{place}: the expression is nested too deeply for Structured Text; split it")
    if kind.kind != "whole":
        return text
    return f"REAL_TO_{kind.name}{text}" if is_number(wire.code) else f"REAL_TO_{kind.name}({text})"


def _operand_text(unit: Unit, number: int) -> str:
    """A name as an operand: numbers are REAL, and a TIME is its seconds."""
    kind, name = unit.type_of(number), unit.names[number]
    if kind.kind == "time":
        return f"(TIME_TO_REAL({name}) / 1000.0)"
    return f"{kind.name}_TO_REAL({name})" if kind.kind == "whole" else name


# --- A NextoPID program as PLCopen XML (TC6, version 2.01), which CODESYS and its relatives import --------------------
#
# One POU, and the task that calls it: the declarations as ``initialValue/structValue/value[@member]``, the calls as
# Structured Text, and in the documentation what no parameter holds. The dates that the format demands are fixed, so
# that the same configuration gives the same bytes.

NAMESPACE = "http://www.plcopen.org/xml/tc6_0201"
XHTML = "http://www.w3.org/1999/xhtml"
FIXED_DATE = "2000-01-01T00:00:00"
"""A date must stand there, and none means anything."""
ELEMENTARY_TYPES = frozenset(("BOOL", "REAL", "USINT", "UINT", "UDINT", "INT", "DINT", "TIME"))
XML_HEAD = f"""<?xml version="1.0" encoding="utf-8"?>
<project xmlns="{NAMESPACE}">
  <fileHeader companyName="" productName="pidcfg" productVersion="1" creationDateTime="{FIXED_DATE}" />
  <contentHeader name="{{name}}" modificationDateTime="{FIXED_DATE}">
    <coordinateInfo>
      <fbd>
        <scaling x="1" y="1" />
      </fbd>
      <ld>
        <scaling x="1" y="1" />
      </ld>
      <sfc>
        <scaling x="1" y="1" />
      </sfc>
    </coordinateInfo>
  </contentHeader>
  <types>
    <dataTypes />
    <pous>
      <pou name="{{name}}" pouType="program">
        <interface>"""
XML_TAIL = """      </pou>
    </pous>
  </types>
  <instances>
"""
NO_TASK_XML = ("<configurations />",)
TASK_XML = """<configurations>
  <configuration name="Device">
    <resource name="Application">
      <task name="{task}" interval="PT{seconds}S" priority="1">
        <pouInstance name="{name}" typeName="{name}" />
      </task>
    </resource>
  </configuration>
</configurations>"""
"""The names are those that CODESYS gives a new project."""
XML_END = """  </instances>
</project>
"""


def write_plcopen(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """The program as an XML document."""
    unit = Unit(image)
    lines = XML_HEAD.replace("{name}", escape(unit.program)).split("\n")
    variables = [line for variable in unit.variables() for line in _variable_xml(variable)]
    if variables:
        lines += ["          <localVars>", *(f"            {line}" for line in variables), "          </localVars>"]
    lines += ["        </interface>", "        <body>", "          <ST>"]
    lines += [_xhtml_text("\n".join(("", *body_lines(unit), "")), "            ")]
    lines += ["          </ST>", "        </body>", "        <documentation>"]
    lines += [
        _xhtml_text("\n".join(("", *header_comments(image, checklist), "")), "          "),
        "        </documentation>",
    ]
    return "\n".join(lines) + "\n" + XML_TAIL + "".join(f"    {line}\n" for line in _task_lines(unit)) + XML_END


def _task_lines(unit: Unit) -> Sequence[str]:
    """The cyclic task that calls the program; none where nobody says its interval."""
    interval = unit.image.plc.get("sample_time")
    if interval is None:
        return NO_TASK_XML
    used = {name.upper() for name in (*unit.names.values(), *(block.name for block in unit.layout.instances))}
    task = unused_name("PidTask", used | {unit.program.upper()})
    seconds = decimal_text(Decimal(str(interval)))
    return TASK_XML.format(task=task, seconds=seconds, name=escape(unit.program)).split("\n")


def _xhtml_text(text: str, indent: str) -> str:
    return f'{indent}<xhtml xmlns="{XHTML}">{escape(text, quote=False)}</xhtml>'


def _variable_xml(variable: Variable) -> Iterator[str]:
    """A declaration."""
    kind = (
        f"<{variable.type} />" if variable.type in ELEMENTARY_TYPES else f'<derived name="{escape(variable.type)}" />'
    )
    yield f'<variable name="{escape(variable.name)}">'
    yield from ("  <type>", f"    {kind}", "  </type>")
    if variable.initial is not None:
        yield "  <initialValue>"
        if isinstance(variable.initial, tuple):
            yield f"    {_simple_xml(*variable.initial)}"
        else:
            yield from (f"    {line}" for line in _structure_xml(variable.initial))
        yield "  </initialValue>"
    if variable.note:
        yield from ("  <documentation>", _xhtml_text(variable.note, "    "), "  </documentation>")
    yield "</variable>"


def _structure_xml(initial: Mapping[str, tuple[IecType, Content]]) -> Iterator[str]:
    """Initial values by member; members of a structure inside it have a dot in their names."""
    yield "<structValue>"
    members = ""
    for name, value in initial.items():
        first, _, rest = name.rpartition(".")
        if members and members != first:
            yield from ("    </structValue>", "  </value>")
        if first and members != first:
            yield from (f'  <value member="{escape(first)}">', "    <structValue>")
        members, pad = first, "      " if first else "  "
        yield from (f'{pad}<value member="{escape(rest)}">', f"{pad}  {_simple_xml(*value)}", f"{pad}</value>")
    if members:
        yield from ("    </structValue>", "  </value>")
    yield "</structValue>"


def _simple_xml(kind: IecType, content: Content) -> str:
    return f'<simpleValue value="{escape(literal_text(kind, content))}" />'
