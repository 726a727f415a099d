"""Expressions of signals as they run: numbers on a stack.

Division by zero, the square root of a negative number and a result beyond all bounds have no value. `evaluate` says
so in ``stack[0]``; the signal then keeps the value it had, and the run reports the first time this happened.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.schemas.expressions import (
    ABSOLUTE,
    ADD,
    CONSTANT,
    DIVIDE,
    LARGEST_VALUE,
    MINIMUM,
    MULTIPLY,
    NEGATE,
    ROOT,
    SIGNAL,
    SUBTRACT,
)

if TYPE_CHECKING:
    from collections.abc import MutableSequence, Sequence

    from pidcfg.schemas.expressions import Expression

NO_FAULT, DIVISION_BY_ZERO, ROOT_OF_NEGATIVE, NOT_FINITE = range(4)
BEYOND = f"a result beyond {LARGEST_VALUE:g}".replace("+", "")
FAULTS = ("", "division by zero", "square root of a negative number", BEYOND)
"""Why an expression has no value, by the number that `evaluate` leaves in ``stack[0]``."""


@dataclass(slots=True)
class Pool:
    """The code of all expressions of a run, one after the other, as the kernels read it."""

    code: list[int] = field(default_factory=list)
    constants: list[float] = field(default_factory=list)
    depth: int = 0

    def add(self, expression: Expression) -> tuple[int, int]:
        """Where the expression's code begins and ends in the pool."""
        first, base = len(self.code), len(self.constants)
        for op, operand in zip(expression.code[::2], expression.code[1::2], strict=True):
            self.code += (op, operand + base if op == CONSTANT else operand)
        self.constants += expression.constants
        self.depth = max(self.depth, expression.depth)
        return first, len(self.code)

    def stack(self) -> list[float]:
        """Room for the deepest expression, and the fault number in front of it."""
        return [0.0] * (self.depth + 1)


def evaluate(
    code: Sequence[int],
    constants: Sequence[float],
    first: int,
    last: int,
    sig: Sequence[float],
    stack: MutableSequence[float],
) -> float:
    """The value of the code from ``first`` to ``last``; ``stack[0]`` tells why there is none (kernel)."""
    stack[0] = 0.0
    top = 0
    for at in range(first, last, 2):
        op = code[at]
        if op == SIGNAL:
            top += 1
            stack[top] = sig[code[at + 1]]
        elif op == CONSTANT:
            top += 1
            stack[top] = constants[code[at + 1]]
        elif op == NEGATE:
            stack[top] = -stack[top]
        elif op == ABSOLUTE:
            stack[top] = abs(stack[top])
        elif op == ROOT:
            if stack[top] < 0.0:
                stack[0] = 2.0
                return 0.0
            stack[top] = math.sqrt(stack[top])
        else:
            right = stack[top]
            top -= 1
            if op == ADD:
                stack[top] += right
            elif op == SUBTRACT:
                stack[top] -= right
            elif op == MULTIPLY:
                stack[top] *= right
            elif op == DIVIDE:
                if right == 0.0:
                    stack[0] = 1.0
                    return 0.0
                stack[top] /= right
            elif op == MINIMUM:
                if right < stack[top]:
                    stack[top] = right
            elif right > stack[top]:
                stack[top] = right
    value = stack[1]
    if -LARGEST_VALUE <= value <= LARGEST_VALUE:
        return value
    stack[0] = 3.0
    return 0.0
