"""Structured Text executed: types are checked when a text is loaded, values are those of a PLC.

A REAL has single precision after every operation. Nothing is converted by itself: an INT for a REAL, a REAL for a BOOL
and a whole number where a REAL is wanted are faults of the text. A number without a type takes that of its place.
"""

from __future__ import annotations

import math
import operator
import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from iec.syntax import (
    Argument,
    Assignment,
    Call,
    Choice,
    Declaration,
    Expression,
    Initial,
    Literal,
    Operation,
    Path,
    Statement,
    StError,
    Structure,
    Unit,
    parse,
)

# --- Types and values -------------------------------------------------------------------------------------------------

WHOLE = {
    "SINT": (-(2**7), 2**7 - 1),
    "INT": (-(2**15), 2**15 - 1),
    "DINT": (-(2**31), 2**31 - 1),
    "USINT": (0, 2**8 - 1),
    "UINT": (0, 2**16 - 1),
    "UDINT": (0, 2**32 - 1),
}
ELEMENTARY = frozenset((*WHOLE, "BOOL", "REAL", "TIME"))
ANY_INT, ANY_REAL = "a whole number", "a number with a point"
"""Types of numbers without one."""
NUMERIC = frozenset((*WHOLE, "REAL", ANY_INT, ANY_REAL))
TIME_PART = re.compile(r"(\d+(?:\.\d+)?)(MS|D|H|M|S)")
MILLISECONDS = {"D": 86_400_000, "H": 3_600_000, "M": 60_000, "S": 1000, "MS": 1}

Value = bool | int | float
Read = Callable[[], Any]
Do = Callable[[], None]


def single(value: float) -> float:
    """The nearest number of single precision; beyond them it is infinite."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


class RunError(Exception):
    """What a PLC does with this is not defined: a division by zero, a number that its type cannot hold."""


def fit(kind: str, value: Value) -> Value:
    """A result as its type holds it; raises `RunError`."""
    if kind == "REAL":
        return single(value)
    if kind in WHOLE:
        low, high = WHOLE[kind]
        if not low <= value <= high:
            raise RunError(f"{value} is no {kind}")
    return value


def time_value(text: str, line: int) -> int:
    """A duration in ms: ``1H30M``."""
    digits = text.lstrip("+-")
    parts = TIME_PART.findall(digits)
    if not parts or "".join(number + unit for number, unit in parts) != digits:
        raise StError(f"T#{text} is no duration", line)
    total = sum(float(number) * MILLISECONDS[unit] for number, unit in parts)
    return round(-total if text.startswith("-") else total)


@dataclass(slots=True, eq=False)
class Cell:
    """The place of a value."""

    type: str
    value: Value
    constant: bool = False
    initialized: bool = False
    """Whether a declaration has an initial value for it."""


def zero(kind: str) -> Value:
    """What a variable without an initial value has."""
    return {"BOOL": False, "REAL": 0.0}.get(kind, 0)


# --- What the surroundings give: blocks, functions, enumerations, devices ---------------------------------------------


@dataclass(frozen=True)
class Parameter:
    """Of a block, in the order of its declaration; a member of a structure has a point in its name."""

    name: str
    type: str
    direction: str
    """``input``; ``output``; ``in_out``: a variable; ``operand``: a value, or a variable that the block may write."""
    initial: Value = 0


Cells = dict[str, Cell]


@dataclass(frozen=True)
class Block:
    """A function block of a library, or a function that is called as a statement."""

    name: str
    parameters: tuple[Parameter, ...]
    run: Callable[[Cells], None]
    """Executes a call. The cells of an instance stay the same ones; those of a function are new in every call, apart
    from variables at ``in_out`` and ``operand``."""
    function: bool = False


@dataclass(frozen=True)
class Surroundings:
    """What a text may use without declaring it."""

    blocks: Mapping[str, Block] = field(default_factory=dict)
    enumerations: Mapping[str, Sequence[str]] = field(default_factory=dict)
    devices: Callable[[str], str] = lambda _: ""
    """The type of a device by its name; empty: there is none."""


# --- Operators and standard functions ---------------------------------------------------------------------------------


def divide_whole(left: int, right: int) -> int:
    """Toward zero, as IEC 61131-3 has it."""
    quotient = abs(left) // abs(right)
    return quotient if (left < 0) == (right < 0) else -quotient


def remainder(left: int, right: int) -> int:
    """Of a division toward zero; 0 where the divisor is 0 (IEC 61131-3, function MOD)."""
    return left - divide_whole(left, right) * right if right else 0


def to_whole(value: float) -> int:
    """Rounded half to even (IEC 61131-3, type conversion)."""
    if not math.isfinite(value):
        raise RunError(f"{value} is no whole number")
    return round(value)


ARITHMETIC: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "**": operator.pow,
}
COMPARISONS: Mapping[str, Callable[[Any, Any], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "=": operator.eq,
    "<>": operator.ne,
}
LOGIC: Mapping[str, Callable[[Any, Any], Any]] = {"AND": operator.and_, "OR": operator.or_, "XOR": operator.xor}
FUNCTIONS: Mapping[str, tuple[Callable[..., Any], int, int]] = {
    "ABS": (abs, 1, 1),
    "SQRT": (math.sqrt, 1, 1),
    "MIN": (min, 2, 99),
    "MAX": (max, 2, 99),
    "LIMIT": (lambda low, value, high: min(max(value, low), high), 3, 3),
}
"""By name: what they do, and how many arguments they have."""
CONVERSION = re.compile(f"({'|'.join(ELEMENTARY)})_TO_({'|'.join(ELEMENTARY)})")


@dataclass(frozen=True)
class Typed:
    """An expression that has been checked: its type, and how to read it."""

    type: str
    read: Read


# --- A program or block with its variables ----------------------------------------------------------------------------


class Scope:
    """The variables of a unit, and its statements as functions; instances of its blocks are scopes of their own."""

    def __init__(self, unit: Unit, machine: Machine) -> None:
        self.machine = machine
        self.name = unit.name
        self.cells: Cells = {}
        self.instances: dict[str, Instance] = {}
        for declaration in unit.variables:
            self.declare(declaration)
        self.body = self.block(unit.body)

    def declare(self, declared: Declaration) -> None:
        """A variable or an instance."""
        name, kind, line = declared.name, declared.type, declared.line
        if name in self.cells or name in self.instances:
            raise StError(f"{name} is declared twice", line)
        block = self.machine.block(kind)
        if block is not None and not block.function:
            self.instances[name] = Instance.of(block)
            self.set_members(self.instances[name].cells, "", declared.initial)
        elif kind in ELEMENTARY or kind in self.machine.around.enumerations:
            cell = self.cells[name] = self.machine.cell(declared)
            if declared.initial is not None:
                value = self.constant(declared.initial, kind)
                if cell.initialized and cell.value != value:
                    raise StError(f"{declared.address} begins with {cell.value} elsewhere", line)
                cell.value, cell.initialized = value, True
        else:
            raise StError(f"{kind} is no type", line)

    def set_members(self, cells: Cells, prefix: str, initial: Initial | None) -> None:
        """The initial values of an instance."""
        if initial is None:
            return
        if isinstance(initial, Structure):
            for name, value in initial.members:
                self.set_members(cells, f"{prefix}.{name}" if prefix else name, value)
        elif prefix not in cells:
            raise StError(f"{prefix or 'the instance'} has no value of its own", initial.line)
        else:
            cells[prefix].value = self.constant(initial, cells[prefix].type)

    def constant(self, initial: Initial, kind: str) -> Value:
        """An initial value."""
        if isinstance(initial, Structure):
            raise StError(f"members are no {kind}", initial.line)
        value: Value = self.typed(initial, kind).read()
        return value

    # --- names -------------------------------------------------------------------------------------------------------

    def cell(self, path: Path) -> Cell:
        """The place of a variable, a member of an instance, or a device."""
        first, rest = path.names[0], ".".join(path.names[1:])
        if first in self.instances:
            cells = self.instances[first].cells
            if rest in cells:
                return cells[rest]
        elif not rest:
            found = self.cells.get(first) or self.machine.globals.get(first) or self.machine.device(first)
            if found is not None:
                return found
        raise StError(f"{path} is not declared", path.line)

    def word(self, path: Path) -> Typed | None:
        """The word of an enumeration."""
        words = self.machine.around.enumerations.get(path.names[0])
        if words is None or len(path.names) != 2:
            return None
        upper = [word.upper() for word in words]
        if path.names[1] not in upper:
            raise StError(f"{path} is no word of {path.names[0]}", path.line)
        number = upper.index(path.names[1])
        return Typed(path.names[0], lambda: number)

    # --- expressions -------------------------------------------------------------------------------------------------

    def typed(self, expression: Expression, wanted: str) -> Typed:
        """An expression that must have a type."""
        return self.as_type(self.read(expression), wanted, expression.line)

    def as_type(self, found: Typed, wanted: str, line: int) -> Typed:
        """A number without a type takes the one that is wanted; nothing else does."""
        if found.type == ANY_INT and wanted in WHOLE:
            fit(wanted, found.read())
            return Typed(wanted, found.read)
        if found.type == ANY_REAL and wanted == "REAL":
            value = single(found.read())
            return Typed(wanted, lambda: value)
        if found.type != wanted:
            raise StError(f"{found.type} stands where {wanted} must stand", line)
        return found

    def read(self, expression: Expression) -> Typed:
        """An expression with the type that it has by itself."""
        if isinstance(expression, Literal):
            return literal(expression)
        if isinstance(expression, Path):
            if word := self.word(expression):
                return word
            cell = self.cell(expression)
            return Typed(cell.type, lambda: cell.value)
        if isinstance(expression, Call):
            return self.function(expression)
        if len(expression.operands) == 1:
            return self.one_operand(expression)
        return self.two_operands(expression)

    def one_operand(self, expression: Operation) -> Typed:
        """NOT and the sign."""
        operand = self.read(expression.operands[0])
        kind, read = operand.type, operand.read
        if expression.sign == "NOT" and kind == "BOOL":
            return Typed(kind, lambda: not read())
        if expression.sign == "NEGATE" and (kind in NUMERIC or kind == "TIME"):
            return Typed(kind, lambda: fit(kind, -read()))
        raise StError(f"{expression.sign} has no meaning for {kind}", expression.line)

    def together(self, operands: Sequence[Expression], line: int) -> tuple[str, list[Read]]:
        """Operands that must have one type."""
        found = [self.read(operand) for operand in operands]
        kinds = [operand.type for operand in found if operand.type not in {ANY_INT, ANY_REAL}]
        kind = kinds[0] if kinds else found[0].type
        if not kinds and any(operand.type != kind for operand in found):
            raise StError(f"{ANY_INT} and {ANY_REAL} do not go together", line)
        return kind, [self.as_type(operand, kind, line).read for operand in found]

    def two_operands(self, expression: Operation) -> Typed:
        """Arithmetic, comparisons and logic."""
        sign, line = expression.sign, expression.line
        kind, (left, right) = self.together(expression.operands, line)
        if sign in COMPARISONS:
            compare = COMPARISONS[sign]
            return Typed("BOOL", lambda: compare(left(), right()))
        if sign in LOGIC:
            join = LOGIC[sign]
            if kind != "BOOL":
                raise StError(f"{sign} has no meaning for {kind}", line)
            return Typed(kind, lambda: join(left(), right()))
        whole = kind in WHOLE or kind == ANY_INT
        if kind not in NUMERIC or (sign == "MOD" and not whole) or (sign == "**" and whole):
            raise StError(f"{sign} has no meaning for {kind}", line)
        if sign == "MOD":
            return Typed(kind, lambda: remainder(left(), right()))
        if sign == "/":
            return Typed(kind, lambda: divide(kind, left(), right()))
        calculate = ARITHMETIC[sign]
        held = "REAL" if kind == ANY_REAL else kind
        return Typed(kind, lambda: fit(held, calculate(left(), right())))

    def function(self, call: Call) -> Typed:
        """A standard function."""
        if any(argument.name for argument in call.arguments):
            raise StError(f"{call.name} takes its arguments by position", call.line)
        values = [argument.value for argument in call.arguments]
        if (match := CONVERSION.fullmatch(call.name)) and len(values) == 1:
            return self.conversion(match[1], match[2], values[0])
        if call.name not in FUNCTIONS:
            raise StError(f"there is no function {call.name}", call.line)
        work, least, most = FUNCTIONS[call.name]
        if not least <= len(values) <= most:
            raise StError(f"{call.name} has {least} arguments or more, and no more than {most}", call.line)
        kind, reads = self.together(values, call.line)
        if kind not in NUMERIC or (call.name == "SQRT" and kind not in {"REAL", ANY_REAL}):
            raise StError(f"{call.name} has no meaning for {kind}", call.line)
        held = "REAL" if kind == ANY_REAL else kind

        def apply() -> Value:
            try:
                return fit(held, work(*(read() for read in reads)))
            except ValueError:
                raise RunError(f"{call.name} of a number that has none") from None

        return Typed(kind, apply)

    def conversion(self, source: str, target: str, value: Expression) -> Typed:
        """``INT_TO_REAL``; a TIME is its milliseconds."""
        read = self.typed(value, source).read
        if target == "BOOL":
            return Typed(target, lambda: read() != 0)
        if target == "REAL":
            return Typed(target, lambda: single(float(read())))
        return Typed(target, lambda: fit(target, to_whole(read())))

    # --- statements --------------------------------------------------------------------------------------------------

    def block(self, statements: Sequence[Statement]) -> Do:
        """One after the other."""
        steps = [self.statement(statement) for statement in statements]

        def run() -> None:
            for step in steps:
                step()

        return run

    def statement(self, statement: Statement) -> Do:
        """An assignment, IF, or a call."""
        if isinstance(statement, Assignment):
            return self.assign(statement.target, self.typed(statement.value, self.target(statement.target).type).read)
        if isinstance(statement, Call):
            return self.call(statement)
        return self.choice(statement)

    def target(self, path: Path) -> Cell:
        """What may be written."""
        cell = self.cell(path)
        if cell.constant:
            raise StError(f"{path} is a constant", path.line)
        return cell

    def assign(self, path: Path, read: Read) -> Do:
        """A new value."""
        cell = self.target(path)

        def run() -> None:
            cell.value = read()

        return run

    def choice(self, statement: Choice) -> Do:
        """IF: the first branch whose condition holds."""
        branches = [
            (None if condition is None else self.typed(condition, "BOOL").read, self.block(body))
            for condition, body in statement.branches
        ]

        def run() -> None:
            for condition, body in branches:
                if condition is None or condition():
                    body()
                    return

        return run

    def call(self, call: Call) -> Do:
        """An instance, or a function without a result."""
        instance = self.instances.get(call.name)
        if instance is not None:
            return self.call_instance(instance, call)
        block = self.machine.block(call.name)
        if block is None or not block.function:
            raise StError(f"{call.name} is neither an instance nor a function", call.line)
        return self.call_function(block, call)

    def call_instance(self, instance: Instance, call: Call) -> Do:
        """Inputs that are not given keep their values."""
        enabled, arguments = self.arguments(instance.block, call)
        before: list[Do] = []
        after: list[Do] = []
        for row, argument in arguments:
            inner = instance.cells[row.name.upper()]
            if row.direction != "output":
                before.append(copy_to(inner, self.typed(argument.value, row.type).read))
            if row.direction in {"in_out", "output"}:
                self.same_type(row, self.cell(variable(row, argument, call)), call)
                after.append(self.assign(variable(row, argument, call), lambda inner=inner: inner.value))  # type: ignore[misc]
        given = {row.name for row, _ in arguments}
        missing = {row.name for row in instance.block.parameters if row.direction == "in_out"} - given
        if missing:
            raise StError(f"{call.name}: {', '.join(sorted(missing))} must be given", call.line)

        def run() -> None:
            if enabled():
                for step in before:
                    step()
                instance.block.run(instance.cells)
                for step in after:
                    step()

        return run

    def call_function(self, block: Block, call: Call) -> Do:
        """Nothing is kept; variables that the function writes are its own cells during the call."""
        enabled, arguments = self.arguments(block, call)
        given: dict[str, Callable[[], Cell]] = {}
        after: list[tuple[str, Cell]] = []
        for row, argument in arguments:
            name = row.name.upper()
            if row.direction == "output":
                after.append((name, self.target(variable(row, argument, call))))
                self.same_type(row, after[-1][1], call)
            elif row.direction == "in_out" or (row.direction == "operand" and self.is_variable(argument.value)):
                cell = self.target(variable(row, argument, call))
                self.same_type(row, cell, call)
                given[name] = lambda cell=cell: cell  # type: ignore[misc]
            else:
                read = self.typed(argument.value, row.type).read
                given[name] = lambda kind=row.type, read=read: Cell(kind, read())  # type: ignore[misc]
        rows = block.parameters

        def run() -> None:
            if not enabled():
                return
            cells = {row.name.upper(): Cell(row.type, row.initial) for row in rows if row.name.upper() not in given}
            cells.update((name, make()) for name, make in given.items())
            block.run(cells)
            for name, target in after:
                target.value = cells[name].value

        return run

    def arguments(self, block: Block, call: Call) -> tuple[Read, list[tuple[Parameter, Argument]]]:
        """Every argument with its parameter, and EN, without which a call is always executed."""
        rows = {row.name.upper(): row for row in block.parameters}
        found: dict[str, tuple[Parameter, Argument]] = {}
        enabled: Read = lambda: True  # noqa: E731 - a condition that always holds
        if any(argument.name for argument in call.arguments):
            for argument in call.arguments:
                if argument.name == "EN" and "EN" not in rows:
                    enabled = self.typed(argument.value, "BOOL").read
                    continue
                row = rows.get(argument.name)
                if row is None or argument.output != (row.direction == "output") or argument.name in found:
                    raise StError(f"{call.name} takes no {argument.name or 'other argument'} here", call.line)
                found[argument.name] = row, argument
            return enabled, list(found.values())
        if call.arguments and len(call.arguments) != len(rows):
            raise StError(f"{call.name} has {len(rows)} arguments, and not {len(call.arguments)}", call.line)
        return enabled, list(zip(block.parameters, call.arguments, strict=False)) if call.arguments else []

    def is_variable(self, value: Expression) -> bool:
        """Whether a block could write there."""
        return isinstance(value, Path) and self.word(value) is None

    @staticmethod
    def same_type(row: Parameter, cell: Cell, call: Call) -> None:
        """A variable that a block writes has the type of its parameter."""
        if cell.type != row.type:
            raise StError(f"{call.name}: {cell.type} stands where {row.type} {row.name} must stand", call.line)


def variable(row: Parameter, argument: Argument, call: Call) -> Path:
    """The variable of an argument that a block writes."""
    if not isinstance(argument.value, Path):
        raise StError(f"{call.name}: {row.name} wants a variable", call.line)
    return argument.value


def copy_to(cell: Cell, read: Read) -> Do:
    """A value for an input."""

    def run() -> None:
        cell.value = read()

    return run


def literal(found: Literal) -> Typed:
    """A constant."""
    if found.type == "BOOL":
        if found.text not in {"TRUE", "FALSE", "0", "1"}:
            raise StError(f"{found.text} is no BOOL", found.line)
        truth = found.text in {"TRUE", "1"}
        return Typed("BOOL", lambda: truth)
    if found.type == "TIME":
        duration = time_value(found.text, found.line)
        return Typed("TIME", lambda: duration)
    number, kind = number_of(found)
    if not kind:
        return Typed(ANY_INT if isinstance(number, int) else ANY_REAL, lambda: number)
    if kind == "REAL" or (kind in WHOLE and isinstance(number, int)):
        held = fit(kind, number)
        return Typed(kind, lambda: held)
    raise StError(f"{found.text} is no {kind}", found.line)


def number_of(found: Literal) -> tuple[int | float, str]:
    """The number of a constant, and its type if it has one: ``16#FF``, ``INT#5``."""
    try:
        if found.type in {"2", "8", "16"}:
            return int(found.text, int(found.type)), ""
        return (float(found.text) if "." in found.text else int(found.text)), found.type
    except ValueError:
        raise StError(f"{found.text} is no number", found.line) from None


def divide(kind: str, left: Any, right: Any) -> Value:
    """A quotient; raises `RunError` for one by zero."""
    if right == 0:
        raise RunError("a division by zero")
    if kind in WHOLE or kind == ANY_INT:
        return fit(kind, divide_whole(left, right))
    return single(left / right)


# --- Instances, and everything together -------------------------------------------------------------------------------


@dataclass(eq=False)
class Instance:
    """A function block with the values that it keeps."""

    block: Block
    cells: Cells

    @classmethod
    def of(cls, block: Block) -> Instance:
        """A new one."""
        return cls(block, {row.name.upper(): Cell(row.type, row.initial) for row in block.parameters})


class Machine:
    """A text, loaded: its programs by name, and what they share. Raises `StError`."""

    def __init__(self, text: str, around: Surroundings) -> None:
        source = parse(text)
        self.around = around
        self.places: dict[str, Cell] = {}
        self.own = {unit.name: unit for unit in source.units if unit.kind == "FUNCTION_BLOCK"}
        self.globals: Cells = {}
        shared = Scope(Unit("PROGRAM", "", source.globals, ()), self)
        self.globals.update(shared.cells)
        self.programs = {unit.name: Scope(unit, self) for unit in source.units if unit.kind == "PROGRAM"}

    def block(self, name: str) -> Block | None:
        """A block by its name; of the text's own ones a new one with its own variables."""
        unit = self.own.get(name)
        if unit is None:
            return next((block for key, block in self.around.blocks.items() if key.upper() == name), None)
        inner = Scope(unit, self)
        rows = [
            Parameter(row.name, row.type, row.section[4:].lower(), inner.cells[row.name].value)
            for row in unit.variables
            if row.section in {"VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT"}
        ]

        def run(cells: Cells) -> None:
            for row in rows:
                if row.direction != "output":
                    inner.cells[row.name].value = cells[row.name].value
            inner.body()
            for row in rows:
                if row.direction != "input":
                    cells[row.name].value = inner.cells[row.name].value

        return Block(unit.name, tuple(rows), run)

    def cell(self, declared: Declaration) -> Cell:
        """The place of a variable: that of its device, if it has one."""
        if not declared.address:
            return Cell(declared.type, zero(declared.type), declared.constant)
        found = self.places.setdefault(declared.address, Cell(declared.type, zero(declared.type)))
        if found.type != declared.type:
            raise StError(f"{declared.address} is {found.type} elsewhere, and not {declared.type}", declared.line)
        return found

    def device(self, name: str) -> Cell | None:
        """A device that stands in the text itself."""
        kind = self.around.devices(name)
        return self.places.setdefault(name, Cell(kind, zero(kind))) if kind else None

    def run(self, program: str) -> None:
        """Executes a program once; raises `RunError`."""
        self.programs[program.upper()].body()
