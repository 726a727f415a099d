"""Expressions of two types, numbers and BOOLs: ``NOT Man AND (PV < 4.0 OR Fault)``, as IEC 61131-3 has them.

Design. `Typed` is the parser of plain expressions (`pidcfg.schemas.expressions`) with the levels of Structured Text
above its sums: comparison, equality, AND, XOR, OR; NOT binds like a sign. While it writes code it keeps the type of
everything on the stack, so that a wrong operand is refused at its first character. A condition is the same code as a
sum is, with TRUE as 1 and FALSE as 0; who walks code needs no other walk for it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.schemas.expressions import (
    AND,
    AT_LEAST,
    AT_MOST,
    CONSTANT,
    EQUAL,
    GREATER,
    LESS,
    NOT,
    ONE_OPERAND,
    OR,
    SIGNAL,
    TRUTH,
    UNEQUAL,
    XOR,
    ExpressionError,
    Parser,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.schemas.iec import IecType

COMPARISONS = {"<=": AT_MOST, ">=": AT_LEAST, "<": LESS, ">": GREATER}
EQUALITIES = {"=": EQUAL, "<>": UNEQUAL}
JOINTS = ({"OR": OR}, {"XOR": XOR}, {"AND": AND})
"""Words between BOOLs, one level of binding after the other, the loosest first."""
WORDS = frozenset((*(word for level in JOINTS for word in level), "NOT"))
"""Words that are no names, like those of `TRUTHS`."""
TRUTHS = {"FALSE": 0, "TRUE": 1}
OF_BOOLS = frozenset((NOT, AND, OR, XOR))
"""What takes BOOLs and gives one."""
OF_BOTH = frozenset((EQUAL, UNEQUAL))
"""What takes two of a kind and gives a BOOL."""
OF_NUMBERS = frozenset(COMPARISONS.values())
"""What takes numbers and gives a BOOL."""
CONDITIONAL = OF_BOOLS | OF_BOTH | OF_NUMBERS
FOREIGN = {"==": "=", "!=": "<>", "&&": "AND", "||": "OR", "&": "AND", "|": "OR", "!": "NOT"}
"""Signs of other languages, and what this one has in their place."""
WORD = re.compile(r"[A-Za-z_]+(?![\w.])")
ALLOWED = (
    "allowed are NOT, AND, OR, XOR, < <= > >= = <>, numbers, names of signals, + - * / ( ) and min, max, abs, sqrt"
)
ANY = "any"


class Operand(NamedTuple):
    """Something on the stack: ``bool``, ``number``, ``any`` or another kind, where it begins, what it is in words."""

    kind: str
    start: int
    text: str


KINDS = {"bool": "bool", "real": "number", "whole": "number", "time": "number"}
"""What elementary types count as in expressions; a TIME is a number of seconds."""
THIS = {"bool": "this is a BOOL", "number": "this is a number"}


@dataclass(slots=True)
class Typed(Parser):
    """Reads an expression of any type; ``types`` gives the type of a signal's number, None where nobody knows."""

    types: Callable[[int], IecType | None] = lambda _: None
    operands: list[Operand] = field(default_factory=list)

    @property
    def cure(self) -> str:
        """What can be written instead."""
        for sign, ours in FOREIGN.items():
            if self.text.startswith(sign, self.at):
                return f"write {ours}"
        return ALLOWED

    @property
    def kind(self) -> str:
        """The type of the whole expression."""
        return self.operands[-1].kind

    def whole(self, depth: int, level: int = 0) -> None:
        """Conditions joined by the words of a level, from left to right; below the last level are equalities."""
        if level == len(JOINTS):
            self.equality(depth)
            return
        self.whole(depth, level + 1)
        while (word := self.word()) in JOINTS[level]:
            self.step(len(word))
            self.whole(depth, level + 1)
            self.emit(JOINTS[level][word])

    def equality(self, depth: int) -> None:
        """Comparisons that are equal or not."""
        self.comparison(depth)
        while sign := self.sign(EQUALITIES):
            self.step(len(sign))
            self.comparison(depth)
            self.emit(EQUALITIES[sign])

    def comparison(self, depth: int) -> None:
        """Sums of which one is the larger."""
        self.sum(depth)
        while sign := self.sign(COMPARISONS):
            self.step(len(sign))
            self.sum(depth)
            self.emit(COMPARISONS[sign])

    def factor(self, depth: int) -> None:
        """As in a plain expression, with NOT, TRUE and FALSE."""
        start, inversions = self.at, 0
        while (word := self.word()) == "NOT":
            inversions += 1
            self.step(len(word))
        if word in TRUTHS:
            self.emit(TRUTH, TRUTHS[word])
            self.step(len(word))
        else:
            Parser.factor(self, depth)
        if inversions:
            self.expect(self.operands[-1], "bool", NOT)
            if inversions % 2:
                self.emit(NOT)
            self.operands[-1] = self.operands[-1]._replace(start=start)

    def word(self) -> str:
        """The word that stands here, in capitals; empty where it is a declared name, or none."""
        match = WORD.match(self.text, self.at)
        return match.group().upper() if match and match.group() not in self.names else ""

    def sign(self, signs: dict[str, int]) -> str:
        """Which of these signs stands here; none where it is part of another one."""
        here = self.text[self.at : self.at + 2]
        if here in {*COMPARISONS, *EQUALITIES}:
            return here if here in signs else ""
        return here[:1] if here[:1] in signs and here != "==" else ""

    # --- types -------------------------------------------------------------------------------------------------------

    def emit(self, op: int, operand: int = 0) -> None:
        """One pair of code, and the type of what it leaves; raises `ExpressionError` at an operand of another type."""
        Parser.emit(self, op, operand)
        if op in (CONSTANT, TRUTH):
            kind = "number" if op == CONSTANT else "bool"
            self.operands.append(Operand(kind, self.at, THIS[kind]))
        elif op == SIGNAL:
            self.operands.append(self.named(operand))
        elif op in ONE_OPERAND:
            kind = "bool" if op in OF_BOOLS else "number"
            self.expect(self.operands[-1], kind, op)
            self.operands[-1] = Operand(kind, self.operands[-1].start, THIS[kind])
        else:
            right, left = self.operands.pop(), self.operands.pop()
            self.check(op, left, right)
            kind = "bool" if op in CONDITIONAL else "number"
            self.operands.append(Operand(kind, left.start, THIS[kind]))

    def named(self, number: int) -> Operand:
        """A signal or parameter, which stands here."""
        kind, name = self.types(number), self.name() or ""
        if kind is None:
            return Operand(ANY, self.at, name)
        return Operand(KINDS.get(kind.kind, kind.kind), self.at, f"{name} is {kind.name}")

    def check(self, op: int, left: Operand, right: Operand) -> None:
        """Refuses operands that an operator does not take."""
        wanted = "bool" if op in OF_BOOLS else "number"
        if op in OF_BOTH and "bool" in {left.kind, right.kind}:
            wanted = "bool"
        for operand in (left, right):
            self.expect(operand, wanted, op)

    def expect(self, operand: Operand, wanted: str, op: int = -1) -> None:
        """Refuses an operand of another type than is wanted; without ``op`` it is the whole expression."""
        if operand.kind in {wanted, ANY}:
            return
        if wanted == "number":
            problem, cure = "numbers are wanted", "wire a REAL or an INT"
        else:
            problem = "a BOOL is wanted" if op < 0 or op in OF_BOTH else f"{NAMES[op]} takes BOOLs"
            cure = "put a comparison into parentheses: NOT (PV < 4)" if op == NOT else "compare it, as in PV < 4.0"
        raise ExpressionError(f"{operand.text}; {problem}", operand.start, cure)


NAMES = {
    **{op: word for level in JOINTS for word, op in level.items()},
    NOT: "NOT",
    **{op: sign for sign, op in (*COMPARISONS.items(), *EQUALITIES.items())},
}
"""Operators of conditions as the language writes them."""
