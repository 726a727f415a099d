"""What stays as it is while the kernel runs: which records there are, and the fields that no kernel writes.

A `Known` value is one that follows from such fields and from constants. Where the text of the step depends on it (a
branch that is left out, a loop that is written out), it becomes a guard: the text is right for every run whose guards
have the same values.
"""

from __future__ import annotations

import ast
import math
import operator
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Any

from pidcfg.sim.inlining.kernels import Kernel, NotInlinedError, constant, source_of

if TYPE_CHECKING:
    from collections.abc import Sequence

MOST_RECORDS = 8
"""A list with more records is left to the kernels as they are, and so is a loop of more turns."""

BINARY: dict[type[ast.AST], tuple[str, Any]] = {
    ast.Add: ("+", operator.add), ast.Sub: ("-", operator.sub), ast.Mult: ("*", operator.mul),
    ast.BitAnd: ("&", operator.and_), ast.BitOr: ("|", operator.or_), ast.BitXor: ("^", operator.xor),
    ast.Div: ("/", operator.truediv), ast.FloorDiv: ("//", operator.floordiv), ast.Mod: ("%", operator.mod),
    ast.Pow: ("**", operator.pow), ast.LShift: ("<<", operator.lshift), ast.RShift: (">>", operator.rshift),
    ast.Lt: ("<", operator.lt), ast.LtE: ("<=", operator.le), ast.Gt: (">", operator.gt), ast.GtE: (">=", operator.ge),
    ast.Eq: ("==", operator.eq), ast.NotEq: ("!=", operator.ne), ast.In: ("in", lambda a, b: a in b),
    ast.NotIn: ("not in", lambda a, b: a not in b),
}  # fmt: skip
UNARY: dict[type[ast.AST], tuple[str, Any]] = {
    ast.USub: ("-", operator.neg), ast.UAdd: ("+", operator.pos), ast.Invert: ("~", operator.inv),
    ast.Not: ("not ", operator.not_),
}  # fmt: skip
MAY_FAIL = (ast.Div, ast.FloorDiv, ast.Mod, ast.Pow, ast.LShift, ast.RShift)
"""Operators that are left where they stand: what is worked out beforehand must not fail."""


@dataclass(frozen=True, slots=True)
class Known:
    """A value that stays as it is; ``text`` says it in terms of the kernel's lists, or is a literal."""

    text: str
    value: Any
    literal: bool = False
    safe: bool = True
    """Whether it can be worked out before the step, where it may not be needed."""


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """A list of records by the name that the kernel gives it."""

    name: str
    rows: Sequence[Any]
    fixed: bool
    """No kernel writes into its records."""

    @property
    def few(self) -> bool:
        """Whether the text names each of them."""
        return len(self.rows) <= MOST_RECORDS


@dataclass(frozen=True, slots=True)
class Record:
    """One of them."""

    records: Records
    index: int

    @property
    def name(self) -> str:
        """The local variable that holds it."""
        return f"{self.records.name}{self.index}"


Fact = Known | Records | Record


@dataclass(slots=True)
class Frame:
    """A kernel whose text is being written: what each of its names means."""

    kernel: Kernel
    number: int
    names: dict[str, Fact | str] = field(default_factory=dict)
    """Facts, and the new names of local variables."""


def literal(value: Any) -> Known:
    """A number, or a tuple of numbers, as it is written."""
    text = repr(value)
    return Known(f"({text})" if text.startswith("-") else text, value, literal=True)


@dataclass(slots=True)
class Facts:
    """Values that are known, and the guards that follow from their use."""

    written: frozenset[str]
    """Fields that some kernel writes, by name."""
    guards: dict[str, Any] = field(default_factory=dict)

    def of(self, node: ast.expr, frame: Frame) -> Fact | None:
        """What an expression is known to be."""
        match node:
            case ast.Constant(value=int() | float() as value):
                return literal(value)
            case ast.Name(id=name):
                return self._name(name, frame)
            case ast.Attribute(value=base, attr=attr):
                return self._field(base, attr, frame)
            case ast.Subscript(value=base, slice=index):
                return self._item(base, index, frame)
            case ast.Call(func=ast.Name(id="len"), args=[argument]):
                records = self.of(argument, frame)
                return Known(f"len({records.name})", len(records.rows)) if isinstance(records, Records) else None
            case ast.BinOp(left=left, op=op, right=right):
                return self._binary(left, op, right, frame)
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                return self._binary(left, op, right, frame)
            case ast.UnaryOp(op=op, operand=operand):
                return self._unary(op, operand, frame)
            case ast.Tuple(elts=elements):
                return self._tuple(elements, frame)
        return None

    def _name(self, name: str, frame: Frame) -> Fact | None:
        if name in frame.names:
            meant = frame.names[name]
            return None if isinstance(meant, str) else meant
        return _written(None if name in source_of(frame.kernel).stores else constant(frame.kernel, name))

    def _field(self, base: ast.expr, attr: str, frame: Frame) -> Known | None:
        if isinstance(base, ast.Name) and base.id not in frame.names:
            module = frame.kernel.__globals__.get(base.id)
            return _written(getattr(module, attr, None) if isinstance(module, ModuleType) else None)
        record = self.of(base, frame)
        if isinstance(record, Record) and (record.records.fixed or attr not in self.written):
            row = record.records.rows[record.index]
            return Known(f"{record.records.name}[{record.index}].{attr}", getattr(row, attr))
        return None

    def _item(self, base: ast.expr, index: ast.expr, frame: Frame) -> Record | None:
        records = self.of(base, frame)
        if not isinstance(records, Records):
            return None
        place = self.of(index, frame)
        if not isinstance(place, Known) or not records.few:
            raise NotInlinedError(ast.unparse(base))
        self.decide(place)
        return Record(records, range(len(records.rows))[place.value])

    def _binary(self, left: ast.expr, op: ast.AST, right: ast.expr, frame: Frame) -> Known | None:
        a, b = self.of(left, frame), self.of(right, frame)
        if type(op) not in BINARY or not isinstance(a, Known) or not isinstance(b, Known):
            return None
        sign, function = BINARY[type(op)]
        try:
            value = function(a.value, b.value)
        except ArithmeticError:
            return None
        safe = a.safe and b.safe and not isinstance(op, MAY_FAIL)
        return self._known(f"({a.text} {sign} {b.text})", value, a, b, safe=safe)

    def _unary(self, op: ast.AST, operand: ast.expr, frame: Frame) -> Known | None:
        a = self.of(operand, frame)
        if not isinstance(a, Known):
            return None
        sign, function = UNARY[type(op)]
        return self._known(f"({sign}{a.text})", function(a.value), a, safe=a.safe)

    def _tuple(self, elements: list[ast.expr], frame: Frame) -> Known | None:
        parts = [self.of(one, frame) for one in elements]
        known = [one for one in parts if isinstance(one, Known) and one.literal]
        return literal(tuple(one.value for one in known)) if len(known) == len(parts) else None

    @staticmethod
    def _known(text: str, value: Any, *parts: Known, safe: bool) -> Known:
        if all(part.literal for part in parts) and _finite(value):
            return literal(value)
        return Known(text, value, safe=safe)

    def decide(self, known: Known) -> Any:
        """The value, on which the text depends from now on."""
        if not known.literal:
            self.guards[known.text] = known.value
        return known.value

    def truth(self, node: ast.expr, frame: Frame) -> bool | None:
        """Whether a condition holds, where that is known."""
        if isinstance(node, ast.BoolOp):
            ends = isinstance(node.op, ast.Or)
            for one in node.values:
                truth = self.truth(one, frame)
                if truth is None or truth is ends:
                    return truth
            return not ends
        known = self.of(node, frame)
        if not isinstance(known, Known):
            return None
        if not known.literal:
            self.guards[f"bool({known.text})"] = bool(known.value)
        return bool(known.value)


def _written(value: Any) -> Known | None:
    """A constant as it is written; None for what is no number, and for infinities, which have no literal."""
    return literal(value) if isinstance(value, int | float | tuple) and _finite(value) else None


def _finite(value: Any) -> bool:
    return all(math.isfinite(one) for one in (value if isinstance(value, tuple) else (value,)))
