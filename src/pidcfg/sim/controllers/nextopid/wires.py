"""What the wires of a block carry at its call: expressions in single precision, as the PLC calculates them.

The shared vector ``aux`` begins with the place of the stack; then follow a row a wire (target, type, where its code
begins and ends), the code in pairs as in `pidcfg.schemas.expressions`, and the delay lines. Constants stand in the code
itself. A wire without a value (a division by zero) leaves its target as it was, and the block says so once (D206; the
operations: D693).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pidcfg.encoders.singles import LARGEST_SINGLE
from pidcfg.refs import Decision
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
)
from pidcfg.schemas.iec import INT
from pidcfg.sim.terms import clamp, nearest, single

if TYPE_CHECKING:
    from collections.abc import MutableSequence, Sequence

    from pidcfg.sim.controllers.nextopid.state import Config, State

D206 = Decision(
    206,
    "a wire without a value keeps the one that it had",
    "Division by zero, the root of a negative number and results beyond single precision leave the parameter as it is; "
    "the run reports the first time. An INT that a REAL is wired to takes the nearest whole number of "
    "its range, which NX614 warns of.",
    "What the PLC does then depends on its settings: a REAL beyond the INT may come out as any number there. It is a "
    "mistake of the program in any case.",
)

LARGEST = float(LARGEST_SINGLE)
ROWS, ROW = 1, 4
"""Where the rows of the wires begin, and how long one is."""
AS_IT_IS, AS_INT = 0, 1
"""Types of a wire's target: REAL and BOOL, or INT."""
LEAST_INT, MOST_INT = float(INT.low), float(INT.high)


def value_of(aux: MutableSequence[float], first: int, last: int, sig: Sequence[float]) -> float:
    """The value of a wire's code (kernel); the first number of the stack tells when there is none."""
    stack = int(aux[0])
    top = stack
    aux[stack] = 0.0
    for at in range(first, last, 2):
        op = aux[at]
        if op == SIGNAL:
            top += 1
            aux[top] = single(sig[int(aux[at + 1])])
        elif op == CONSTANT:
            top += 1
            aux[top] = aux[at + 1]
        elif op == NEGATE:
            aux[top] = -aux[top]
        elif op == NOT:
            aux[top] = 1.0 - aux[top]
        elif op == ABSOLUTE:
            aux[top] = abs(aux[top])
        elif op == ROOT:
            if aux[top] < 0.0:
                aux[stack] = 2.0
                return 0.0
            aux[top] = single(math.sqrt(aux[top]))
        else:
            top -= 1
            if op == DIVIDE and aux[top + 1] == 0.0:
                aux[stack] = 1.0
                return 0.0
            aux[top] = combined(op, aux[top], aux[top + 1])
    value = aux[stack + 1]
    if -LARGEST <= value <= LARGEST:
        return value
    aux[stack] = 3.0
    return 0.0


def combined(op: float, left: float, right: float) -> float:
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
    return compared(op, left, right)


def compared(op: float, left: float, right: float) -> float:
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


def move(s: State, tick: int, aux: MutableSequence[float], sig: MutableSequence[float], first: int, last: int) -> None:
    """Executes moves: of each the row of its condition, and that of its value (kernel)."""
    for wire in range(first, last, 2):
        row = ROWS + ROW * wire
        holds = value_of(aux, int(aux[row + 2]), int(aux[row + 3]), sig)
        fault = int(aux[int(aux[0])])
        row += ROW
        if fault == 0 and holds != 0.0:
            value = value_of(aux, int(aux[row + 2]), int(aux[row + 3]), sig)
            fault = int(aux[int(aux[0])])
            if fault == 0:
                if aux[row + 1] == AS_INT:
                    value = clamp(nearest(value), LEAST_INT, MOST_INT)
                sig[int(aux[row])] = value
        if fault != 0 and s.fault == 0:
            s.fault = fault
            s.fault_target = int(aux[row])
            s.fault_at = tick


def wire_in(c: Config, s: State, aux: MutableSequence[float], sig: MutableSequence[float], last: int) -> None:
    """Renews the wired parameters of a block up to the wire before ``last`` (kernel)."""
    for wire in range(c.wires, last):
        row = ROWS + ROW * wire
        value = value_of(aux, int(aux[row + 2]), int(aux[row + 3]), sig)
        fault = int(aux[int(aux[0])])
        if fault == 0:
            if aux[row + 1] == AS_INT:
                value = clamp(nearest(value), LEAST_INT, MOST_INT)
            sig[int(aux[row])] = value
        elif s.fault == 0:
            s.fault = fault
            s.fault_target = int(aux[row])
