"""The grammar of expressions, ``1 / max(Fi, 1)`` or ``NOT Man AND PV < 4.0``: read by a whitelist into code."""

from __future__ import annotations

import math
import operator
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.text.frozen import frozen
from pidcfg.text.signs import closest_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from pidcfg.schemas.iec import IecType

# ----------------------------------------------------------------------------------------------------------------------
# The grammar of expressions, ``1 / max(Fi, 1)``: read by a whitelist into pairs of numbers, never evaluated as
# Python.
# The grammar is numbers, declared names, ``+ - * /``, parentheses, and min, max, abs, sqrt. The longest declared name
# wins, so ``TIC-101.PV`` is a signal and not a subtraction. An expression becomes pairs of integers: what to do, with
# which constant or signal; `pidcfg.sim.engine.expressions.evaluate` walks them.

CONSTANT, SIGNAL, ADD, SUBTRACT, MULTIPLY, DIVIDE, NEGATE, MINIMUM, MAXIMUM, ABSOLUTE, ROOT = range(11)
"""What one pair of an expression's code does; only the first two use the second number of the pair."""
NOT, AND, OR, XOR, LESS, AT_MOST, GREATER, AT_LEAST, EQUAL, UNEQUAL, TRUTH = range(11, 22)
"""The same of conditions (`pidcfg.schemas.expressions`): TRUE is 1, FALSE 0, and the number of `TRUTH` its value."""

LARGEST_VALUE = 1e15
"""Beyond this nothing is a signal any more; it keeps every sum in a run finite."""

FUNCTIONS = {"min": (MINIMUM, 2, 16), "max": (MAXIMUM, 2, 16), "abs": (ABSOLUTE, 1, 1), "sqrt": (ROOT, 1, 1)}
"""Name to op code and the smallest and largest number of arguments."""

MAX_LENGTH = 1_000
MAX_DEPTH = 40
ALLOWED = "allowed are numbers, names of signals, + - * / ( ) and min, max, abs, sqrt"

NUMBER = re.compile(r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
WORD = re.compile(r"[^\W\d][\w.\-]*")
DECIMAL_COMMA = re.compile(r"(?P<whole>[0-9]+)(?P<comma>,)(?P<part>[0-9]+)")
SPACE = re.compile(r"\s*")


class ExpressionError(ValueError):
    """An expression that cannot be read: what is wrong, at which character (0-based), and the cure."""

    def __init__(self, message: str, offset: int, cure: str = ALLOWED) -> None:
        super().__init__(message)
        self.message, self.offset, self.cure = message, offset, cure


@frozen
class Expression:
    """An expression as read: pairs of op code and operand, the constants, and the signals it uses."""

    text: str
    code: tuple[int, ...]
    constants: tuple[float, ...]
    signals: frozenset[int]
    depth: int

    @property
    def signal(self) -> int | None:
        """The signal's number when the expression is nothing but one signal."""
        return self.code[1] if len(self.code) == 2 and self.code[0] == SIGNAL else None


def lengths_of(names: Iterable[str]) -> list[int]:
    """How long names are, the longest first; for who reads many expressions with the same names."""
    return sorted({len(name) for name in names}, reverse=True)


def parse(text: str, names: Mapping[str, int], lengths: list[int] | None = None) -> Expression:
    """The expression of ``text`` with ``names`` of signals and their numbers; raises `ExpressionError`."""
    return Parser(text, names, lengths_of(names) if lengths is None else lengths).read()


@dataclass(slots=True)
class Parser:
    """Recursive descent, at most `MAX_DEPTH` deep; writes the code in the order in which it is run."""

    text: str
    names: Mapping[str, int]
    lengths: list[int]
    at: int = 0
    code: list[int] = field(default_factory=list)
    constants: list[float] = field(default_factory=list)
    height: int = 0
    deepest: int = 0

    def read(self) -> Expression:
        """The whole text."""
        if len(self.text) > MAX_LENGTH:
            raise ExpressionError(f"the expression is longer than {MAX_LENGTH} characters", MAX_LENGTH, "split it")
        self.skip()
        self.whole(0)
        if self.at < len(self.text):
            raise ExpressionError(f"unexpected {self.here()}", self.at, self.rest_cure())
        signals = frozenset(self.code[i + 1] for i in range(0, len(self.code), 2) if self.code[i] == SIGNAL)
        return Expression(self.text, tuple(self.code), tuple(self.constants), signals, self.deepest)

    @property
    def cure(self) -> str:
        """What can be done about something that has no meaning here."""
        return ALLOWED

    def whole(self, depth: int) -> None:
        """What stands in parentheses, or as the whole expression."""
        self.sum(depth)

    def sum(self, depth: int) -> None:
        """Products, added and subtracted from left to right."""
        if depth > MAX_DEPTH:
            raise ExpressionError(f"more than {MAX_DEPTH} levels of nesting", self.at, "split the expression")
        self.product(depth)
        while self.at < len(self.text) and self.text[self.at] in "+-":
            op = ADD if self.text[self.at] == "+" else SUBTRACT
            self.step(1)
            self.product(depth)
            self.emit(op)

    def product(self, depth: int) -> None:
        """Factors, multiplied and divided from left to right."""
        self.factor(depth)
        while self.at < len(self.text) and self.text[self.at] in "*/":
            op = MULTIPLY if self.text[self.at] == "*" else DIVIDE
            self.step(1)
            self.factor(depth)
            self.emit(op)

    def factor(self, depth: int) -> None:
        """A number, a signal, a function, parentheses, or one of them with a sign."""
        negative = False
        while (name := self.name()) is None and self.at < len(self.text) and self.text[self.at] in "+-":
            negative ^= self.text[self.at] == "-"
            self.step(1)
        if name is not None:
            self.emit(SIGNAL, self.names[name])
            self.step(len(name))
        elif number := NUMBER.match(self.text, self.at):
            self.number(number.group())
        elif self.at < len(self.text) and self.text[self.at] == "(":
            self.step(1)
            self.whole(depth + 1)
            self.close()
        else:
            self.call(depth)
        if negative:
            self.emit(NEGATE)

    def name(self) -> str | None:
        """The longest declared name that stands here, and is not the beginning of a longer word."""
        for length in self.lengths:
            end = self.at + length
            name = self.text[self.at : end]
            if name in self.names and not self.goes_on(name, end):
                return name
        return None

    def goes_on(self, name: str, end: int) -> bool:
        """Whether the text at ``end`` makes the name the beginning of something else."""
        after = self.text[end : end + 1]
        in_word = name[-1:].isalnum() and (after.isalnum() or after == "_")
        is_part = after == "." and self.text[end + 1 : end + 2].isalpha()
        is_call = name in FUNCTIONS and self.text[end:].lstrip().startswith("(")
        return in_word or is_part or is_call

    def number(self, written: str) -> None:
        """A constant; one that is not finite is refused."""
        if float(written) > LARGEST_VALUE:
            raise ExpressionError(f"{written} is too large", self.at, f"the largest number is {LARGEST_VALUE:g}")
        end = self.at + len(written)
        if end < len(self.text) and (self.text[end].isalpha() or self.text[end] == "_"):
            word = self.text[self.at :].split()[0]
            raise ExpressionError(f"{word!r} is no number and no declared name", self.at, self.similar(word))
        self.emit(CONSTANT, len(self.constants))
        self.constants.append(float(written))
        self.step(len(written))

    def call(self, depth: int) -> None:
        """A function with its arguments; anything else that stands here has no meaning."""
        start = self.at
        word = WORD.match(self.text, self.at)
        if word is None:
            raise ExpressionError(f"a number or a name is missing before {self.here()}", self.at, self.cure)
        self.step(len(word.group()))
        is_call = self.at < len(self.text) and self.text[self.at] == "("
        if word.group() not in FUNCTIONS:
            what = "function" if is_call else "declared name"
            raise ExpressionError(f"{word.group()!r} is no {what}", start, self.similar(word.group()))
        if not is_call:
            raise ExpressionError(f"{word.group()} needs its arguments in parentheses", start)
        op, fewest, most = FUNCTIONS[word.group()]
        count = 1
        self.step(1)
        self.whole(depth + 1)
        while self.at < len(self.text) and self.text[self.at] == ",":
            self.step(1)
            self.whole(depth + 1)
            self.emit(op)
            count += 1
        self.close()
        if not fewest <= count <= most:
            wanted = str(fewest) if fewest == most else f"{fewest} to {most}"
            raise ExpressionError(f"{word.group()} takes {wanted} argument{'s' * (most > 1)}, not {count}", start)
        if most == 1:
            self.emit(op)

    def rest_cure(self) -> str:
        """What to do about something behind an expression, such as a decimal comma or a unit."""
        number = next((one for one in DECIMAL_COMMA.finditer(self.text) if one.start("comma") == self.at), None)
        if number is not None:
            return f"write {number['whole']}.{number['part']}: the decimal sign is a point"
        unit = "a number has no unit here; " if self.text[self.at].isalpha() or self.text[self.at] in "°%" else ""
        return f"{unit}{self.cure}"

    def similar(self, word: str) -> str:
        """A cure: the declared name or function that looks most like the word."""
        near = closest_name(word, [*self.names, *FUNCTIONS])
        return f"did you mean {near!r}?" if near else self.cure

    def close(self) -> None:
        """The end of parentheses."""
        if self.at >= len(self.text) or self.text[self.at] != ")":
            raise ExpressionError(f"a closing parenthesis is missing before {self.here()}", self.at)
        self.step(1)

    def emit(self, op: int, operand: int = 0) -> None:
        """One pair of code, and how high the stack is after it."""
        self.code += (op, operand)
        if op in (CONSTANT, SIGNAL, TRUTH):
            self.height += 1
            self.deepest = max(self.deepest, self.height)
        elif op not in ONE_OPERAND:
            self.height -= 1

    def step(self, characters: int) -> None:
        """Moves past something and the space behind it."""
        self.at += characters
        self.skip()

    def skip(self) -> None:
        """Moves past space."""
        space = SPACE.match(self.text, self.at)
        self.at = space.end() if space else self.at

    def here(self) -> str:
        """What stands here, for a message."""
        return repr(self.text[self.at]) if self.at < len(self.text) else "the end"


ONE_OPERAND: dict[int, Callable[[float], float]] = {
    NEGATE: operator.neg,
    ABSOLUTE: abs,
    ROOT: math.sqrt,
    NOT: operator.not_,
}
TWO_OPERANDS: dict[int, Callable[[float, float], float]] = {
    ADD: operator.add,
    SUBTRACT: operator.sub,
    MULTIPLY: operator.mul,
    DIVIDE: operator.truediv,
    MINIMUM: min,
    MAXIMUM: max,
    AND: min,
    OR: max,
    XOR: operator.ne,
    LESS: operator.lt,
    AT_MOST: operator.le,
    GREATER: operator.gt,
    AT_LEAST: operator.ge,
    EQUAL: operator.eq,
    UNEQUAL: operator.ne,
}

# --- Expressions of two types, numbers and BOOLs: ``NOT Man AND (PV < 4.0 OR Fault)``, as IEC 61131-3 has them --------
#
# Design. `Typed` is the parser of plain expressions (`pidcfg.schemas.expressions`) with the levels of Structured Text
# above its sums: comparison, equality, AND, XOR, OR; NOT binds like a sign. While it writes code it keeps the type of
# everything on the stack, so that a wrong operand is refused at its first character. A condition is the same code as
# a sum is, with TRUE as 1 and FALSE as 0; who walks code needs no other walk for it.

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
OPERATOR_WORD = re.compile(r"[A-Za-z_]+(?![\w.])")
ALLOWED_IN_CONDITIONS = (
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
        return ALLOWED_IN_CONDITIONS

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
        match = OPERATOR_WORD.match(self.text, self.at)
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
