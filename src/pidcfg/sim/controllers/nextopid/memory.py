"""The memory of a virtual NextoPID: parameters as signals, and what the wires of a block carry at its call."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, MutableSequence, Sequence
from decimal import Decimal
from functools import cached_property
from itertools import chain
from typing import NamedTuple

from pidcfg.encoders.codecs import LARGEST_SINGLE, DecodeError
from pidcfg.encoders.image import read_settings
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, MAX_DELAY_SAMPLES
from pidcfg.encoders.nextopid.image import Copy, ItemSettings, MoveError, PlcSettings, read_item, read_moves
from pidcfg.encoders.nextopid.wiring import Layout, Wires
from pidcfg.encoders.parameters import Content, Parameter, Program, type_of_content
from pidcfg.schemas.expressions import (
    ABSOLUTE,
    ADD,
    AND,
    AT_LEAST,
    AT_MOST,
    CONSTANT,
    DIVIDE,
    EQUAL,
    GREATER,
    LESS,
    MAXIMUM,
    MINIMUM,
    MULTIPLY,
    NEGATE,
    NOT,
    OR,
    ROOT,
    SIGNAL,
    SUBTRACT,
    TRUTH,
    Expression,
    ExpressionError,
)
from pidcfg.schemas.iec import INT, IecType, Wire, time_seconds
from pidcfg.sim.controllers.kernels import clamp, round_half_even, single
from pidcfg.sim.controllers.nextopid import terms
from pidcfg.sim.controllers.nextopid.terms import Config, State
from pidcfg.sim.controllers.plc import TICKS, Plc
from pidcfg.sim.engine.expressions import DIVISION_BY_ZERO, NOT_FINITE, ROOT_OF_NEGATIVE
from pidcfg.text.references import Decision

# --- What the wires of a block carry at its call: expressions in single precision, as the PLC calculates them ---------
#
# The shared vector ``aux`` begins with the place of the stack; then follow a row a wire (target, type, where its code
# begins and ends), the code in pairs as in `pidcfg.schemas.expressions`, and the delay lines. Constants stand in the
# code itself. A wire without a value (a division by zero) leaves its target as it was, and the block says so once
# (D206; the operations: D693).

D206 = Decision(
    206,
    "a wire without a value keeps the one that it had",
    "Division by zero, the root of a negative number and results beyond single precision leave the parameter as it is; "
    "the run reports the first time. An INT that a REAL is wired to takes the nearest whole number of "
    "its range, which NX614 warns of.",
    "What the PLC does then depends on its settings: a REAL beyond the INT may come out as any number there. It is a "
    "mistake of the program in any case.",
)

MAX_SINGLE = float(LARGEST_SINGLE)
FIRST_ROW, ROW_SIZE = 1, 4
"""Where the rows of the wires begin, and how long one is."""
REAL_TARGET, INT_TARGET = 0, 1
"""Types of a wire's target: REAL and BOOL, or INT."""
MIN_INT, MAX_INT = float(INT.low), float(INT.high)


def value_of(aux: MutableSequence[float], first: int, last: int, signals: Sequence[float]) -> float:
    """The value of a wire's code (kernel); the first number of the stack tells when there is none."""
    stack = int(aux[0])
    top = stack
    aux[stack] = 0.0
    for position in range(first, last, 2):
        op = aux[position]
        if op == SIGNAL:
            top += 1
            aux[top] = single(signals[int(aux[position + 1])])
        elif op == CONSTANT:
            top += 1
            aux[top] = aux[position + 1]
        elif op == NEGATE:
            aux[top] = -aux[top]
        elif op == NOT:
            aux[top] = 1.0 - aux[top]
        elif op == ABSOLUTE:
            aux[top] = abs(aux[top])
        elif op == ROOT:
            if aux[top] < 0.0:
                aux[stack] = ROOT_OF_NEGATIVE
                return 0.0
            aux[top] = single(math.sqrt(aux[top]))
        else:
            top -= 1
            if op == DIVIDE and aux[top + 1] == 0.0:
                aux[stack] = DIVISION_BY_ZERO
                return 0.0
            aux[top] = apply_operator(op, aux[top], aux[top + 1])
    value = aux[stack + 1]
    if -MAX_SINGLE <= value <= MAX_SINGLE:
        return value
    aux[stack] = NOT_FINITE
    return 0.0


def apply_operator(op: float, left: float, right: float) -> float:
    """The result of an operator with two operands (kernel)."""
    if op == ADD:
        return single(left + right)
    if op == SUBTRACT:
        return single(left - right)
    if op == MULTIPLY:
        return single(left * right)
    if op == DIVIDE:
        return single(left / right)
    if op in (MINIMUM, AND):
        return min(left, right)
    if op in (MAXIMUM, OR):
        return max(left, right)
    return compare_values(op, left, right)


def compare_values(op: float, left: float, right: float) -> float:
    """1 where a comparison holds, and 0 where not (kernel)."""
    if op == LESS:
        holds = left < right
    elif op == AT_MOST:
        holds = left <= right
    elif op == GREATER:
        holds = left > right
    elif op == AT_LEAST:
        holds = left >= right
    elif op == EQUAL:
        holds = left == right
    else:
        holds = left != right
    return 1.0 if holds else 0.0


def execute_moves(
    state: State, tick: int, aux: MutableSequence[float], signals: MutableSequence[float], first: int, last: int
) -> None:
    """Executes moves: of each the row of its condition, and that of its value (kernel)."""
    for wire in range(first, last, 2):
        row = FIRST_ROW + ROW_SIZE * wire
        holds = value_of(aux, int(aux[row + 2]), int(aux[row + 3]), signals)
        fault = int(aux[int(aux[0])])
        row += ROW_SIZE
        if fault == 0 and holds != 0.0:
            value = value_of(aux, int(aux[row + 2]), int(aux[row + 3]), signals)
            fault = int(aux[int(aux[0])])
            if fault == 0:
                if aux[row + 1] == INT_TARGET:
                    value = clamp(round_half_even(value), MIN_INT, MAX_INT)
                signals[int(aux[row])] = value
        if fault != 0 and state.fault == 0:
            state.fault = fault
            state.fault_target = int(aux[row])
            state.fault_at = tick


def read_wires(
    config: Config, state: State, aux: MutableSequence[float], signals: MutableSequence[float], last: int
) -> None:
    """Renews the wired parameters of a block up to the wire before ``last`` (kernel)."""
    for wire in range(config.wires_begin, last):
        row = FIRST_ROW + ROW_SIZE * wire
        value = value_of(aux, int(aux[row + 2]), int(aux[row + 3]), signals)
        fault = int(aux[int(aux[0])])
        if fault == 0:
            if aux[row + 1] == INT_TARGET:
                value = clamp(round_half_even(value), MIN_INT, MAX_INT)
            signals[int(aux[row])] = value
        elif state.fault == 0:
            state.fault = fault
            state.fault_target = int(aux[row])


# ----------------------------------------------------------------------------------------------------------------------
# The memory of a virtual NextoPID: a program's parameters as signals, its wires as code, its blocks as records.
# Signals are, in this order: those of the program's layout (signals from outside, then every parameter of every
# block); one for each input that nothing in the program is wired to, which plants write; the set point in force of
# each loop.

DELAY_BLOCKS = ("ControlDelay", "ControlDelayLag")
SIGNAL_PARAMETERS = ("PV", "MV", "IntegralAction")
"""Parameters of a loop that are signals of the report, besides the set point in force and wired outputs."""


class WireRow(NamedTuple):
    """A wire: its target, whether that is an INT, and its code in pairs."""

    target: int
    is_int: int
    code: tuple[float, ...]
    depth: int
    is_early: bool
    """Whether it is renewed before the first call of a cycle."""


def number_of(kind: IecType, content: Content) -> float:
    """A content as the kernels have it: a BOOL is 0 or 1, a word its number."""
    if kind.kind == "word":
        return float(kind.words.index(str(content)))
    if kind.kind == "time":
        return single(float(time_seconds(str(content)) or 0))
    return single(float(content)) if kind.kind == "real" else float(content)


def is_open(kind_name: str, row: Parameter) -> bool:
    """Whether the surrounding program writes an input that the configuration leaves out."""
    field = BLOCK_TYPES[kind_name].model.model_fields.get(row.name)
    return field is not None and field.default is None and row.type.kind != "bool"


class Memory(Plc):
    """The records and vectors that the kernels work with."""

    configs: Sequence[Config]
    states: Sequence[State]

    def __init__(self, image: Program) -> None:
        self.words: Mapping[str, Content | Wire] = image.words
        self.items = [read_item(entry, i) for i, entry in enumerate(image.settings)]
        plc = read_settings(PlcSettings, image.plc, "plc")
        if plc.sample_time is None:
            raise DecodeError("the listing does not say the interval of the task")
        self.task_ticks = ticks(plc.sample_time)
        types = {
            name: type_of_content(content)
            for name, content in self.words.items()
            if "." not in name and not isinstance(content, Wire)
        }
        self.layout = Layout.of(types, [(item.name, BLOCK_TYPES[item.type]) for item in self.items])
        self.wires = self._read_wires()
        self.copies = self._read_copies(plc)
        self.signal_values = [0.0] * self.layout.size
        self.outside_inputs: dict[str, int] = {}
        """Slots of inputs that nothing is wired to, by name."""
        for name, content in self.words.items():
            if not isinstance(content, Wire) and name in self.layout.numbers:
                self.signal_values[self.layout.numbers[name]] = number_of(self.layout.types[name], content)
        self.listed_items = sorted(range(len(self.items)), key=lambda i: self.items[i].loop is None)
        """Numbers of the items as the records are listed: loops first."""
        self.loops = [item.name for item in self.items if item.loop is not None]
        self.configs = [Config() for _ in self.items]
        self.states = [State() for _ in self.items]
        self._fill_records()

    @cached_property
    def read_signals(self) -> frozenset[int]:
        """Numbers of everything that a wire reads."""
        moved = (part.signals for copy in self.copies for part in (copy.value, copy.when) if part is not None)
        return frozenset(chain.from_iterable((*(wire.signals for wire in self.wires.values()), *moved)))

    def _read_wires(self) -> Wires:
        wires: Wires = {}
        for i, instance in enumerate(self.layout.instances):
            for row in instance.kind.inputs:
                content = self.words.get(f"{instance.name}.{row.name}")
                if isinstance(content, Wire):
                    try:
                        wires[i, row.name] = self.layout.read_wire(row.type, content.text)
                    except ExpressionError as error:
                        raise DecodeError(f"{instance.name}.{row.name}: {error.message}") from None
        return wires

    def _read_copies(self, plc: PlcSettings) -> list[Copy]:
        wired = {name for name, content in self.words.items() if isinstance(content, Wire)}
        try:
            return read_moves(self.layout, plc.moves, wired, self.words)
        except MoveError as error:
            raise DecodeError(f"moves: {error}") from None

    def _fill_records(self) -> None:
        """Records in the order of `listed_items`, and the shared vector."""
        rows: list[WireRow] = []
        for record, i in enumerate(self.listed_items):
            config, state, instance = self.configs[record], self.states[record], self.layout.instances[i]
            config.kind, config.base = terms.KINDS[instance.kind.name], instance.base
            self._set_period(config, state, self.items[i])
            config.is_integer = int(instance.kind.name.endswith("INT"))
            wires = sorted(self._wires_of(i), key=lambda row: not row.is_early)
            config.wires_begin, config.early_wires = len(rows), sum(row.is_early for row in wires)
            rows += wires
            config.wires_end = len(rows)
            config.error_slot = self.layout.numbers.get(f"{instance.name}.Error", -1)
            if self.items[i].loop is not None:
                self._loop_slots(config, instance.name)
            elif config.kind == terms.ON_OFF:
                self._set_point_slot(config, instance.name)
        record_of = {i: record for record, i in enumerate(self.listed_items)}
        for position, i in enumerate(self.layout.execution_order(self.wires)):
            self.configs[position].call_order = record_of[i]
        if self.copies and self.configs:
            first = self.configs[0]
            first.moves_begin, first.early_moves_end = (
                len(rows),
                len(rows) + 2 * sum(copy.at_start for copy in self.copies),
            )
            rows += (row for copy in self.copies for row in _move_rows(copy))
            first.moves_end = len(rows)
        self.aux = self._aux_vector(rows)

    def _set_period(self, config: Config, state: State, item: ItemSettings) -> None:
        config.period = self.task_ticks if item.sample_time is None else ticks(item.sample_time)
        config.sample_time, state.period = single(config.period / TICKS), config.period

    def _loop_slots(self, config: Config, name: str) -> None:
        numbers = self.layout.numbers
        config.pv_slot, config.out_slot = numbers[f"{name}.PV"], numbers[f"{name}.MV"]
        config.in_slot = self.outside_inputs.get(f"{name}.PV", config.pv_slot)
        config.bias_slot = numbers.get(f"{name}.BIAS", config.out_slot)
        self._set_point_slot(config, name)

    def _set_point_slot(self, config: Config, name: str) -> None:
        """Room for the set point in force."""
        self.signal_values.append(self.signal_values[self.layout.numbers[f"{name}.SP"]])
        config.sp_slot = len(self.signal_values) - 1

    def _wires_of(self, i: int) -> Iterator[WireRow]:
        """The wires of a block; an open input is wired to a signal of the surrounding program.

        The surrounding program assigns that before the first call: what other wires read of it is early.
        """
        instance = self.layout.instances[i]
        for offset, row in enumerate(instance.kind.table.rows):
            name, target = f"{instance.name}.{row.name}", instance.base + offset
            expression, early = self.wires.get((i, row.name)), False
            if (
                expression is None
                and row.access == "input"
                and name not in self.words
                and is_open(instance.kind.name, row)
            ):
                self.outside_inputs[name] = len(self.signal_values)
                self.signal_values.append(0.0)
                expression = Expression(name, (SIGNAL, self.outside_inputs[name]), (), frozenset(), 1)
                early = target in self.read_signals
            if expression is not None:
                whole = INT_TARGET if row.type.kind == "whole" else REAL_TARGET
                yield WireRow(target, whole, tuple(_expression_code(expression)), expression.depth, early)

    def _aux_vector(self, rows: Sequence[WireRow]) -> list[float]:
        """The place of the stack, the rows, the code, the delay lines, and the stack."""
        aux = [0.0]
        position = 1 + 4 * len(rows)
        for row in rows:
            aux += [float(row.target), float(row.is_int), float(position), float(position + len(row.code))]
            position += len(row.code)
        for row in rows:
            aux += row.code
        for record, i in enumerate(self.listed_items):
            if self.layout.instances[i].kind.name in DELAY_BLOCKS:
                self.configs[record].buffer = len(aux)
                aux += [0.0] * MAX_DELAY_SAMPLES
        aux[0] = float(len(aux))
        return aux + [0.0] * (2 + max((row.depth for row in rows), default=0))


def _move_rows(copy: Copy) -> Iterator[WireRow]:
    """The condition of a move, which has no target, and its value."""
    always = Expression("TRUE", (TRUTH, 1), (), frozenset(), 1)
    when = copy.when or always
    yield WireRow(0, REAL_TARGET, tuple(_expression_code(when)), when.depth, is_early=False)
    whole = INT_TARGET if copy.type.kind == "whole" else REAL_TARGET
    yield WireRow(copy.target, whole, tuple(_expression_code(copy.value)), copy.value.depth, is_early=False)


def _expression_code(expression: Expression) -> Iterator[float]:
    """Pairs of operator and operand; a constant stands in the pair itself."""
    for op, operand in zip(expression.code[::2], expression.code[1::2], strict=True):
        yield float(CONSTANT if op == TRUTH else op)
        yield single(expression.constants[operand]) if op == CONSTANT else float(operand)


def ticks(seconds: Decimal) -> int:
    """Seconds as ticks."""
    return max(1, int(seconds * TICKS))
