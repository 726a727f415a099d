"""Which way a change of a loop's MV goes: through the wires and blocks of the file back to its PV.

Only signs are followed: that of a value (1 not negative, -1 not positive, 0 nothing, None nobody knows) and that of its
answer to a rise of MV. A process is a ControlLag or ControlDelayLag on the way, whose sign is that of Gs. Another PID
controller on the way turns a rise of its set point into one of its MV, or with Direct into a fall.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.schemas import expressions as grammar

if TYPE_CHECKING:
    from collections.abc import Callable
    from decimal import Decimal

    from pidcfg.schemas.expressions import Expression
    from pidcfg.validate.rules.nextopid.program import BlockView, Program

Sign = int | None
Item = tuple[Sign, Sign]
"""The sign of a value, and that of its answer."""

DEEPEST = 40
"""Blocks behind each other that are followed; beyond that the sign is unknown."""
PROCESSES = frozenset(("ControlLag", "ControlDelayLag"))
PLAIN = frozenset(("ControlLowFilter", "ControlDelay"))
SELECTORS = frozenset(("ControlSelectMax", "ControlSelectMin"))
FALLING = {("MV1", 4), ("MV2", 1), ("MV2", 3)}
"""Outputs of ControlSplitRange, with the modes in which they fall when MV rises."""


def times(a: Sign, b: Sign) -> Sign:
    """The sign of a product."""
    return 0 if 0 in (a, b) else None if a is None or b is None else a * b


def plus(a: Sign, b: Sign) -> Sign:
    """The sign of a sum."""
    return b if a == 0 else a if b in {0, a} else None


def minus(a: Sign) -> Sign:
    """The other sign."""
    return None if a is None else -a


def sign_of(value: Decimal | float | None) -> Sign:
    """The sign of a number."""
    return None if value is None else (value > 0) - (value < 0)


def answer(expression: Expression, item: Callable[[int], Item]) -> Sign:
    """The sign with which an expression answers, from those of what it reads."""
    stack: list[Item] = []
    for op, operand in zip(expression.code[::2], expression.code[1::2], strict=True):
        if op == grammar.CONSTANT:
            stack.append((sign_of(expression.constants[operand]), 0))
        elif op == grammar.SIGNAL:
            stack.append(item(operand))
        elif op in {grammar.NEGATE, grammar.ABSOLUTE, grammar.ROOT}:
            stack.append(_single(op, stack.pop()))
        else:
            second = stack.pop()
            stack.append(_pair(op, stack.pop(), second))
    return stack[-1][1]


def _single(op: int, a: Item) -> Item:
    if op == grammar.NEGATE:
        return minus(a[0]), minus(a[1])
    return (1, times(a[0], a[1])) if op == grammar.ABSOLUTE else (1, a[1])


def _pair(op: int, a: Item, b: Item) -> Item:
    if op == grammar.ADD:
        return plus(a[0], b[0]), plus(a[1], b[1])
    if op == grammar.SUBTRACT:
        return plus(a[0], minus(b[0])), plus(a[1], minus(b[1]))
    if op in {grammar.MINIMUM, grammar.MAXIMUM}:
        strong = -1 if op == grammar.MINIMUM else 1
        value = strong if {strong, 0} & {a[0], b[0]} else a[0] if a[0] == b[0] else None
        return value, plus(a[1], b[1])
    left, right = times(a[1], b[0]), times(a[0], b[1])
    return times(a[0], b[0]), plus(left, right if op == grammar.MULTIPLY else minus(right))


@dataclass
class Ring:
    """The way from a loop's MV to its PV."""

    context: Program
    loop: BlockView
    processes: list[BlockView] = field(default_factory=list)
    passed: set[int] = field(default_factory=set)
    """The numbers of other controllers on the way."""
    _answers: dict[int, Sign] = field(default_factory=dict)
    _waiting: set[int] = field(default_factory=set)

    def sign(self) -> Sign:
        """The sign with which PV answers to MV; 0 where they are not wired together, None where it is unknown."""
        return self._wired(self.loop, "PV")

    def _wired(self, view: BlockView, key: str) -> Sign:
        expression = view.wire(key)
        return 0 if expression is None else answer(expression, self._item)

    def _item(self, number: int) -> Item:
        return self._value(number), self._answer(number)

    def _value(self, number: int) -> Sign:
        """The sign of what a name holds: of a value, or of the limits of an output. The 0 of a signal tells nothing."""
        owner = self.context.owner(number)
        known = self.context.known(number)
        if known is not None and not isinstance(known.value, bool):
            return sign_of(known.value) or None
        if owner is None:
            return None
        view, key = owner[0], owner[1].name
        low, high = ("Min_OutVar", "Max_OutVar") if key == "OutVar" else ("MinMV", "MaxMV")
        if (
            key in view.placed.kind.model.model_fields
            or key not in {"OutVar", "MV"}
            or low not in view.placed.kind.model.model_fields
        ):
            return None
        ends = view.number_of(low), view.number_of(high)
        return 1 if ends[0] is not None and ends[0] >= 0 else -1 if ends[1] is not None and ends[1] <= 0 else None

    def _answer(self, number: int) -> Sign:
        if number in self._answers:
            return self._answers[number]
        owner = self.context.owner(number)
        if owner is None:
            return 0
        view, row = owner
        if view is self.loop and row.name == "MV":
            return 1
        if number in self._waiting or len(self._waiting) > DEEPEST:
            return None
        self._waiting.add(number)
        result = self._through(view, row.name)
        self._waiting.remove(number)
        self._answers[number] = result
        return result

    def _through(self, view: BlockView, key: str) -> Sign:
        """The answer of a parameter: of an input that of its wire, of an output that of the block."""
        if key in view.placed.kind.model.model_fields:
            return self._wired(view, key)
        if view.is_pid:
            return self._other_loop(view, key)
        if view.type in SELECTORS:
            return plus(self._wired(view, "MV1"), self._wired(view, "MV2")) if key == "MV" else None
        if view.type == "ControlSplitRange":
            mode = view.item.Mode
            return times(-1 if (key, mode) in FALLING else 1, self._wired(view, "MV")) if key != "Error" else None
        return self._filtered(view) if key == "OutVar" else None

    def _filtered(self, view: BlockView) -> Sign:
        inner = self._wired(view, "InVar")
        if view.type in PLAIN:
            return inner
        if view.type in PROCESSES:
            if inner != 0 and view not in self.processes:
                self.processes.append(view)
            return times(inner, sign_of(view.number_of("Gs")))
        return times(inner, sign_of(view.number_of("G"))) if view.type == "ControlLeadLag" else None

    def _other_loop(self, view: BlockView, key: str) -> Sign:
        """Another controller moves its MV so that its PV follows its set point."""
        if key != "MV":
            return None
        point = self._wired(view, "SP_CASC") if view.may_be_on("CASC") else 0
        if view.is_wired("CASC") or not view.is_on("CASC"):
            point = plus(point, self._wired(view, "SP"))
        if point != 0:
            self.passed.add(view.number)
        direct = view.is_on("Direct")
        action = None if direct is None else -1 if direct else 1
        return plus(times(action, point), self._wired(view, "BIAS"))
