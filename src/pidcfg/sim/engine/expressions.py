"""Expressions of signals as they run, and what is wrong with a scenario."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from random import Random
from typing import TYPE_CHECKING, NamedTuple

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
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import closest_name

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, MutableSequence, Sequence

    from pidcfg.schemas.expressions import Expression
    from pidcfg.text.paths import Path

# --- What is wrong with a scenario: data with a path, so that the command line can point at the line ------------------
#
# A kind is a row of `KINDS`; the command line gives it its code.

PROBLEM_KINDS = (
    "unknown_name",
    "expression",
    "combination",
    "value",
    "limit",
    "too_late",
    "missing_plant",
    "rounded",
    "set_up",
    "no_steady_state",
    "wrong_action",
    "idle_allowance",
)
"""Kinds of problems; the last seven do not keep a scenario from running."""


@frozen
class Problem:
    """One fault: where it stands, what it is, and the cure. ``offset`` is the character within an expression."""

    path: Path
    message: str
    kind: str = "combination"
    severity: str = "error"
    help: str | None = None
    key: bool = False
    offset: int = 0
    loop: str | None = None
    effect: str | None = None
    """What the PLC shows of it: ``V7642 bit 2``."""


class BadValue(NamedTuple):
    """A word or parameter whose content is no value of its format, and what is taken for it.

    ``loop`` is its loop's number. A setting that is none is an error of the set-up; what the PLC writes itself,
    such as the output, only begins the run.
    """

    loop: int
    text: str
    is_setting: bool = True


def unknown_name(path: Path, what: str, name: object, known: Iterable[str], *, key: bool = False) -> Problem:
    """A name that is unknown here, with the nearest known one as help."""
    names = list(known)
    near = _find_signal(str(name), names) or closest_name(str(name), names)
    few = ", ".join(names[:12]) + (", …" if len(names) > 12 else "")
    cure = f"did you mean {near}?" if near else f"known: {few}" if names else f"there is no {what} here to be named"
    return Problem(path, f"{str(name)[:60]!r} is no {what}", "unknown_name", help=cure, key=key)


SIGNAL_SYNONYMS = {"output": "out", "mv": "out", "cv": "out", "setpoint": "sp", "sv": "sp", "process_value": "pv"}
"""Other words for the signals of a loop."""


def _find_signal(name: str, names: Sequence[str]) -> str | None:
    """The only name that one is in other capitals, by another word, or without its loop."""
    loop, point, part = name.casefold().rpartition(".")
    wanted = f"{loop}{point}{SIGNAL_SYNONYMS.get(part, part)}"
    folded = [(one.casefold(), one) for one in names]
    for matches in (
        [one for text, one in folded if text == name.casefold()],
        [one for text, one in folded if text == wanted],
        [one for text, one in folded if not point and text.endswith(f".{wanted}")],
    ):
        if matches:
            return matches[0] if len(matches) == 1 else None
    return None


# --- Expressions of signals as they run: numbers on a stack -----------------------------------------------------------
#
# Division by zero, the square root of a negative number and a result beyond all bounds have no value. `evaluate` says
# so in ``stack[0]``; the signal then keeps the value it had, and the run reports the first time this happened.

DIVISION_BY_ZERO, ROOT_OF_NEGATIVE, NOT_FINITE = 1.0, 2.0, 3.0
"""Numbers in `FAULTS`, as a float since they stand on the stack."""
NOT_FINITE_TEXT = f"a result beyond {LARGEST_VALUE:g}".replace("+", "")
FAULTS = ("", "division by zero", "square root of a negative number", NOT_FINITE_TEXT)
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

    def new_stack(self) -> list[float]:
        """Room for the deepest expression, and the fault number in front of it."""
        return [0.0] * (self.depth + 1)


def evaluate(
    code: Sequence[int],
    constants: Sequence[float],
    first: int,
    last: int,
    signals: Sequence[float],
    stack: MutableSequence[float],
) -> float:
    """The value of the code from ``first`` to ``last``; ``stack[0]`` tells why there is none (kernel)."""
    stack[0] = 0.0
    top = 0
    for position in range(first, last, 2):
        op = code[position]
        if op == SIGNAL:
            top += 1
            stack[top] = signals[code[position + 1]]
        elif op == CONSTANT:
            top += 1
            stack[top] = constants[code[position + 1]]
        elif op == NEGATE:
            stack[top] = -stack[top]
        elif op == ABSOLUTE:
            stack[top] = abs(stack[top])
        elif op == ROOT:
            if stack[top] < 0.0:
                stack[0] = ROOT_OF_NEGATIVE
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
                    stack[0] = DIVISION_BY_ZERO
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
    stack[0] = NOT_FINITE
    return 0.0


# --- Whether an expression's value follows one of its signals at all: ``0 * TIC.OUT`` does not ------------------------

MAX_TRIES = 40
"""Points at which two values of a signal are tried."""
TRIED_DECADES = (-2.0, 3.0)


def depends_on(
    value: Callable[[Sequence[float]], float | None], signals: Sequence[float], read_slots: Collection[int], slot: int
) -> bool:
    """Whether ``value`` of the signals (None: it has none there) is another one at two values of ``slot``.

    All signals that it reads, the slots ``read_slots``, are drawn anew for each try, from 0, 1 and numbers of
    either sign.
    """
    random = Random(slot)

    def draw_number() -> float:
        number = 10 ** random.uniform(*TRIED_DECADES)
        return random.choice((0.0, 1.0, number, number, number, -number))

    trial = list(signals)
    for _ in range(MAX_TRIES):
        for number in read_slots:
            trial[number] = draw_number()
        first = value(trial)
        trial[slot] = draw_number()
        other = value(trial)
        if first is not None and other is not None and first != other:
            return True
    return False
