"""Conditions that are always TRUE, or always FALSE.

Design. A condition is walked with all values that could make a difference: both of a BOOL, and of a number that is
compared with literals only one below, at, between and above each of them. A comparison of anything else may come out
either way, whatever the others do. So a condition that is called constant is constant.
"""

from __future__ import annotations

from decimal import Decimal
from itertools import pairwise, product
from math import prod
from typing import TYPE_CHECKING, Any

from pidcfg.refs import Decision
from pidcfg.schemas.conditions import COMPARISONS, CONDITIONAL, EQUALITIES
from pidcfg.schemas.expressions import CONSTANT, SIGNAL, TRUTH, TWO_OPERANDS
from pidcfg.validate.rule import Finding, Findings, warning

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.schemas.expressions import Expression
    from pidcfg.schemas.iec import IecType
    from pidcfg.validate.rules.nextopid.context import NextopidContext

D550 = Decision(
    550,
    "a condition that no value changes is a mistake",
    "One that comes out the same for every value of its signals is a warning; a signal's first value does not count. "
    "Comparisons of anything but a name with a number are taken to come out either way.",
    "PV < 4.0 OR PV > 3.0 looks like two limits and is TRUE; a switch that is meant to be constant is written as one.",
)
COMPARED = frozenset((*COMPARISONS.values(), *EQUALITIES.values()))
IN_WORDS = {True: "TRUE", False: "FALSE"}
LEAVES = frozenset((SIGNAL, CONSTANT, TRUTH))
MOST_CASES = 4096
"""Combinations that are tried; a condition of more is not judged."""


@warning("NX686", D550, "{key} is always {value}: {text}")
def constant_condition(context: NextopidContext) -> Findings:
    """A condition comes out the same whatever its signals are.

    Why: it looks as if it switched, and never does: `PV < 4.0 OR PV > 3.0` is TRUE for every PV. Mostly an AND stands
    where an OR was meant, or a limit is on the wrong side.

    Fix: correct the condition; write `true` or `false` where a constant is meant.
    """
    kinds = context.encoding.layout.kinds
    for (i, name), expression in context.encoding.wires.items():
        view = context.views[i]
        if view.placed.kind.table.row(name).type.kind == "bool":
            value = constant_value(expression, kinds)
            if value is not None:
                yield view.at(name, key=name, value=IN_WORDS[value], text=expression.text)
    for i, copy in enumerate(context.encoding.copies):
        value = None if copy is None or copy.when is None else constant_value(copy.when, kinds)
        if copy is not None and copy.when is not None and value is not None:
            values = {"key": "when", "value": IN_WORDS[value], "text": copy.when.text}
            yield Finding(("moves", i, "when"), values)


def constant_value(expression: Expression, kinds: Mapping[int, IecType]) -> bool | None:
    """The value that a condition has in all cases; None: it has both, or nobody knows."""
    tree = _tree(expression)
    comparisons = [*_comparisons(tree, kinds)]
    points: dict[Node, set[Decimal]] = {}
    for node in filter(_is_plain, comparisons):
        name, point = sorted(node[1:], key=lambda side: side[0] == CONSTANT)
        points.setdefault(name, set()).add(point[1])
    cases: dict[Node, list[Any]] = {(SIGNAL, n): [False, True] for n in expression.signals if kinds[n].kind == "bool"}
    cases |= {name: _values(found, kinds[name[1]]) for name, found in points.items()}
    cases |= {node: [False, True] for node in comparisons if not _is_plain(node)}
    if prod(len(values) for values in cases.values()) > MOST_CASES:
        return None
    found = {_value(tree, dict(zip(cases, chosen, strict=True))) for chosen in product(*cases.values())}
    return bool(found.pop()) if len(found) == 1 else None


Node = tuple[Any, ...]
"""An operator and its operands; ``SIGNAL`` with its number, ``CONSTANT`` and ``TRUTH`` with their value."""


def _tree(expression: Expression) -> Node:
    stack: list[Node] = []
    for op, operand in zip(expression.code[::2], expression.code[1::2], strict=True):
        if op in (SIGNAL, TRUTH):
            stack.append((op, operand))
        elif op == CONSTANT:
            stack.append((op, Decimal(repr(expression.constants[operand]))))
        elif op in TWO_OPERANDS:
            right = stack.pop()
            stack.append((op, stack.pop(), right))
        else:
            stack.append((op, stack.pop()))
    return stack.pop()


def _comparisons(node: Node, kinds: Mapping[int, IecType]) -> Iterator[Node]:
    """The comparisons of numbers in a condition."""
    if node[0] in LEAVES:
        return
    if node[0] in COMPARED and not any(_is_bool(side, kinds) for side in node[1:]):
        yield node
        return
    for side in node[1:]:
        yield from _comparisons(side, kinds)


def _is_bool(node: Node, kinds: Mapping[int, IecType]) -> bool:
    return node[0] in CONDITIONAL | {TRUTH} or (node[0] == SIGNAL and kinds[node[1]].kind == "bool")


def _is_plain(node: Node) -> bool:
    """Whether a comparison is one of a name and a number."""
    return {side[0] for side in node[1:]} == {SIGNAL, CONSTANT}


def _values(points: set[Decimal], kind: IecType) -> list[Decimal]:
    """Values that make all the difference there is."""
    if kind.kind == "whole":
        near = {point.to_integral_value() + step for point in points for step in (-1, 0, 1)}
        return sorted({min(max(value, Decimal(kind.low)), Decimal(kind.high)) for value in near})
    ends = sorted(points)
    between = {(low + high) / 2 for low, high in pairwise(ends)}
    values = {ends[0] - 1, *ends, *between, ends[-1] + 1}
    return sorted({max(value, Decimal(0)) for value in values} if kind.kind == "time" else values)


def _value(node: Node, case: Mapping[Node, Any]) -> Any:
    """The value of a condition in a case."""
    if node in case:
        return case[node]
    if node[0] in LEAVES:
        return node[1]
    sides = [_value(side, case) for side in node[1:]]
    return TWO_OPERANDS[node[0]](*sides) if len(sides) > 1 else not sides[0]
