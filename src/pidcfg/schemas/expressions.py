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
ALLOWED_TOKENS = "allowed are numbers, names of signals, + - * / ( ) and min, max, abs, sqrt"

NUMBER = re.compile(r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
WORD = re.compile(r"[^\W\d][\w.\-]*")
DECIMAL_COMMA = re.compile(r"(?P<whole>[0-9]+)(?P<comma>,)(?P<part>[0-9]+)")
SPACE = re.compile(r"\s*")


class ExpressionError(ValueError):
    """An expression that cannot be read: what is wrong, at which character (0-based), and the cure."""

    def __init__(self, message: str, offset: int, cure: str = ALLOWED_TOKENS) -> None:
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
    position: int = 0
    code: list[int] = field(default_factory=list)
    constants: list[float] = field(default_factory=list)
    stack_height: int = 0
    max_stack_height: int = 0

    def read(self) -> Expression:
        """The whole text."""
        if len(self.text) > MAX_LENGTH:
            raise ExpressionError(f"the expression is longer than {MAX_LENGTH} characters", MAX_LENGTH, "split it")
        self.skip_space()
        self.parse_expression(0)
        if self.position < len(self.text):
            raise ExpressionError(f"unexpected {self.next_sign()}", self.position, self.rest_cure())
        signals = frozenset(self.code[i + 1] for i in range(0, len(self.code), 2) if self.code[i] == SIGNAL)
        return Expression(self.text, tuple(self.code), tuple(self.constants), signals, self.max_stack_height)

    @property
    def cure(self) -> str:
        """What can be done about something that has no meaning here."""
        return ALLOWED_TOKENS

    def parse_expression(self, depth: int) -> None:
        """What stands in parentheses, or as the whole expression."""
        self.parse_sum(depth)

    def parse_sum(self, depth: int) -> None:
        """Products, added and subtracted from left to right."""
        if depth > MAX_DEPTH:
            raise ExpressionError(f"more than {MAX_DEPTH} levels of nesting", self.position, "split the expression")
        self.parse_product(depth)
        while self.position < len(self.text) and self.text[self.position] in "+-":
            op = ADD if self.text[self.position] == "+" else SUBTRACT
            self.move_past(1)
            self.parse_product(depth)
            self.emit_code(op)

    def parse_product(self, depth: int) -> None:
        """Factors, multiplied and divided from left to right."""
        self.parse_factor(depth)
        while self.position < len(self.text) and self.text[self.position] in "*/":
            op = MULTIPLY if self.text[self.position] == "*" else DIVIDE
            self.move_past(1)
            self.parse_factor(depth)
            self.emit_code(op)

    def parse_factor(self, depth: int) -> None:
        """A number, a signal, a function, parentheses, or one of them with a sign."""
        is_negative = False
        while (
            (name := self.find_name()) is None and self.position < len(self.text) and self.text[self.position] in "+-"
        ):
            is_negative ^= self.text[self.position] == "-"
            self.move_past(1)
        if name is not None:
            self.emit_code(SIGNAL, self.names[name])
            self.move_past(len(name))
        elif number := NUMBER.match(self.text, self.position):
            self.parse_number(number.group())
        elif self.position < len(self.text) and self.text[self.position] == "(":
            self.move_past(1)
            self.parse_expression(depth + 1)
            self.close_parenthesis()
        else:
            self.parse_call(depth)
        if is_negative:
            self.emit_code(NEGATE)

    def find_name(self) -> str | None:
        """The longest declared name that stands here, and is not the beginning of a longer word."""
        for length in self.lengths:
            end = self.position + length
            name = self.text[self.position : end]
            if name in self.names and not self.is_longer_word(name, end):
                return name
        return None

    def is_longer_word(self, name: str, end: int) -> bool:
        """Whether the text at ``end`` makes the name the beginning of something else."""
        next_sign = self.text[end : end + 1]
        in_word = name[-1:].isalnum() and (next_sign.isalnum() or next_sign == "_")
        is_part = next_sign == "." and self.text[end + 1 : end + 2].isalpha()
        is_call = name in FUNCTIONS and self.text[end:].lstrip().startswith("(")
        return in_word or is_part or is_call

    def parse_number(self, literal: str) -> None:
        """A constant; one that is not finite is refused."""
        if float(literal) > LARGEST_VALUE:
            raise ExpressionError(f"{literal} is too large", self.position, f"the largest number is {LARGEST_VALUE:g}")
        end = self.position + len(literal)
        if end < len(self.text) and (self.text[end].isalpha() or self.text[end] == "_"):
            word = self.text[self.position :].split()[0]
            raise ExpressionError(f"{word!r} is no number and no declared name", self.position, self.suggest_name(word))
        self.emit_code(CONSTANT, len(self.constants))
        self.constants.append(float(literal))
        self.move_past(len(literal))

    def parse_call(self, depth: int) -> None:
        """A function with its arguments; anything else that stands here has no meaning."""
        start = self.position
        word = WORD.match(self.text, self.position)
        if word is None:
            raise ExpressionError(f"a number or a name is missing before {self.next_sign()}", self.position, self.cure)
        self.move_past(len(word.group()))
        is_call = self.position < len(self.text) and self.text[self.position] == "("
        if word.group() not in FUNCTIONS:
            noun = "function" if is_call else "declared name"
            raise ExpressionError(f"{word.group()!r} is no {noun}", start, self.suggest_name(word.group()))
        if not is_call:
            raise ExpressionError(f"{word.group()} needs its arguments in parentheses", start)
        op, low, high = FUNCTIONS[word.group()]
        count = 1
        self.move_past(1)
        self.parse_expression(depth + 1)
        while self.position < len(self.text) and self.text[self.position] == ",":
            self.move_past(1)
            self.parse_expression(depth + 1)
            self.emit_code(op)
            count += 1
        self.close_parenthesis()
        if not low <= count <= high:
            expected = str(low) if low == high else f"{low} to {high}"
            raise ExpressionError(f"{word.group()} takes {expected} argument{'s' * (high > 1)}, not {count}", start)
        if high == 1:
            self.emit_code(op)

    def rest_cure(self) -> str:
        """What to do about something behind an expression, such as a decimal comma or a unit."""
        number = next(
            (match for match in DECIMAL_COMMA.finditer(self.text) if match.start("comma") == self.position), None
        )
        if number is not None:
            return f"write {number['whole']}.{number['part']}: the decimal sign is a point"
        unit = (
            "a number has no unit here; "
            if self.text[self.position].isalpha() or self.text[self.position] in "°%"
            else ""
        )
        return f"{unit}{self.cure}"

    def suggest_name(self, word: str) -> str:
        """A cure: the declared name or function that looks most like the word."""
        near = closest_name(word, [*self.names, *FUNCTIONS])
        return f"did you mean {near!r}?" if near else self.cure

    def close_parenthesis(self) -> None:
        """The end of parentheses."""
        if self.position >= len(self.text) or self.text[self.position] != ")":
            raise ExpressionError(f"a closing parenthesis is missing before {self.next_sign()}", self.position)
        self.move_past(1)

    def emit_code(self, op: int, operand: int = 0) -> None:
        """One pair of code, and how high the stack is after it."""
        self.code += (op, operand)
        if op in (CONSTANT, SIGNAL, TRUTH):
            self.stack_height += 1
            self.max_stack_height = max(self.max_stack_height, self.stack_height)
        elif op not in ONE_OPERAND:
            self.stack_height -= 1

    def move_past(self, characters: int) -> None:
        """Moves past something and the space behind it."""
        self.position += characters
        self.skip_space()

    def skip_space(self) -> None:
        """Moves past space."""
        space = SPACE.match(self.text, self.position)
        self.position = space.end() if space else self.position

    def next_sign(self) -> str:
        """What stands here, for a message."""
        return repr(self.text[self.position]) if self.position < len(self.text) else "the end"


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
# Design. `TypedParser` is the parser of plain expressions above, with the levels of Structured Text
# above its sums: comparison, equality, AND, XOR, OR; NOT binds like a sign. While it writes code it keeps the type of
# everything on the stack, so that a wrong operand is refused at its first character. A condition is the same code as
# a sum is, with TRUE as 1 and FALSE as 0; who walks code needs no other walk for it.

COMPARISONS = {"<=": AT_MOST, ">=": AT_LEAST, "<": LESS, ">": GREATER}
EQUALITIES = {"=": EQUAL, "<>": UNEQUAL}
JOIN_LEVELS = ({"OR": OR}, {"XOR": XOR}, {"AND": AND})
"""Words between BOOLs, one level of binding after the other, the loosest first."""
OPERATOR_WORDS = frozenset((*(word for level in JOIN_LEVELS for word in level), "NOT"))
"""Words that are no names, like those of `BOOL_VALUES`."""
BOOL_VALUES = {"FALSE": 0, "TRUE": 1}
BOOL_OPERATORS = frozenset((NOT, AND, OR, XOR))
"""What takes BOOLs and gives one."""
EQUALITY_OPERATORS = frozenset((EQUAL, UNEQUAL))
"""What takes two of a kind and gives a BOOL."""
NUMBER_OPERATORS = frozenset(COMPARISONS.values())
"""What takes numbers and gives a BOOL."""
CONDITION_OPERATORS = BOOL_OPERATORS | EQUALITY_OPERATORS | NUMBER_OPERATORS
FOREIGN_SIGNS = {"==": "=", "!=": "<>", "&&": "AND", "||": "OR", "&": "AND", "|": "OR", "!": "NOT"}
"""Signs of other languages, and what this one has in their place."""
OPERATOR_WORD = re.compile(r"[A-Za-z_]+(?![\w.])")
ALLOWED_IN_CONDITIONS = (
    "allowed are NOT, AND, OR, XOR, < <= > >= = <>, numbers, names of signals, + - * / ( ) and min, max, abs, sqrt"
)
ANY_KIND = "any"


class Operand(NamedTuple):
    """Something on the stack: ``bool``, ``number``, ``any`` or another kind, where it begins, what it is in words."""

    kind: str
    start: int
    text: str


KINDS_BY_TYPE = {"bool": "bool", "real": "number", "whole": "number", "time": "number"}
"""What elementary types count as in expressions; a TIME is a number of seconds."""
KIND_TEXTS = {"bool": "this is a BOOL", "number": "this is a number"}


@dataclass(slots=True)
class TypedParser(Parser):
    """Reads an expression of any type; ``types`` gives the type of a signal's number, None where nobody knows."""

    types: Callable[[int], IecType | None] = lambda _: None
    operands: list[Operand] = field(default_factory=list)

    @property
    def cure(self) -> str:
        """What can be written instead."""
        for sign, own_sign in FOREIGN_SIGNS.items():
            if self.text.startswith(sign, self.position):
                return f"write {own_sign}"
        return ALLOWED_IN_CONDITIONS

    @property
    def kind(self) -> str:
        """The type of the whole expression."""
        return self.operands[-1].kind

    def parse_expression(self, depth: int, level: int = 0) -> None:
        """Conditions joined by the words of a level, from left to right; below the last level are equalities."""
        if level == len(JOIN_LEVELS):
            self.parse_equality(depth)
            return
        self.parse_expression(depth, level + 1)
        while (word := self.next_word()) in JOIN_LEVELS[level]:
            self.move_past(len(word))
            self.parse_expression(depth, level + 1)
            self.emit_code(JOIN_LEVELS[level][word])

    def parse_equality(self, depth: int) -> None:
        """Comparisons that are equal or not."""
        self.parse_comparison(depth)
        while sign := self.next_operator(EQUALITIES):
            self.move_past(len(sign))
            self.parse_comparison(depth)
            self.emit_code(EQUALITIES[sign])

    def parse_comparison(self, depth: int) -> None:
        """Sums of which one is the larger."""
        self.parse_sum(depth)
        while sign := self.next_operator(COMPARISONS):
            self.move_past(len(sign))
            self.parse_sum(depth)
            self.emit_code(COMPARISONS[sign])

    def parse_factor(self, depth: int) -> None:
        """As in a plain expression, with NOT, TRUE and FALSE."""
        start, inversions = self.position, 0
        while (word := self.next_word()) == "NOT":
            inversions += 1
            self.move_past(len(word))
        if word in BOOL_VALUES:
            self.emit_code(TRUTH, BOOL_VALUES[word])
            self.move_past(len(word))
        else:
            Parser.parse_factor(self, depth)
        if inversions:
            self.expect_kind(self.operands[-1], "bool", NOT)
            if inversions % 2:
                self.emit_code(NOT)
            self.operands[-1] = self.operands[-1]._replace(start=start)

    def next_word(self) -> str:
        """The word that stands here, in capitals; empty where it is a declared name, or none."""
        match = OPERATOR_WORD.match(self.text, self.position)
        return match.group().upper() if match and match.group() not in self.names else ""

    def next_operator(self, signs: dict[str, int]) -> str:
        """Which of these signs stands here; none where it is part of another one."""
        sign = self.text[self.position : self.position + 2]
        if sign in {*COMPARISONS, *EQUALITIES}:
            return sign if sign in signs else ""
        return sign[:1] if sign[:1] in signs and sign != "==" else ""

    # --- types -------------------------------------------------------------------------------------------------------

    def emit_code(self, op: int, operand: int = 0) -> None:
        """One pair of code, and the type of what it leaves; raises `ExpressionError` at an operand of another type."""
        Parser.emit_code(self, op, operand)
        if op in (CONSTANT, TRUTH):
            kind = "number" if op == CONSTANT else "bool"
            self.operands.append(Operand(kind, self.position, KIND_TEXTS[kind]))
        elif op == SIGNAL:
            self.operands.append(self.signal_operand(operand))
        elif op in ONE_OPERAND:
            kind = "bool" if op in BOOL_OPERATORS else "number"
            self.expect_kind(self.operands[-1], kind, op)
            self.operands[-1] = Operand(kind, self.operands[-1].start, KIND_TEXTS[kind])
        else:
            right, left = self.operands.pop(), self.operands.pop()
            self.check_operands(op, left, right)
            kind = "bool" if op in CONDITION_OPERATORS else "number"
            self.operands.append(Operand(kind, left.start, KIND_TEXTS[kind]))

    def signal_operand(self, number: int) -> Operand:
        """A signal or parameter, which stands here."""
        kind, name = self.types(number), self.find_name() or ""
        if kind is None:
            return Operand(ANY_KIND, self.position, name)
        return Operand(KINDS_BY_TYPE.get(kind.kind, kind.kind), self.position, f"{name} is {kind.name}")

    def check_operands(self, op: int, left: Operand, right: Operand) -> None:
        """Refuses operands that an operator does not take."""
        kind = "bool" if op in BOOL_OPERATORS else "number"
        if op in EQUALITY_OPERATORS and "bool" in {left.kind, right.kind}:
            kind = "bool"
        for operand in (left, right):
            self.expect_kind(operand, kind, op)

    def expect_kind(self, operand: Operand, kind: str, op: int = -1) -> None:
        """Refuses an operand of another type than is wanted; without ``op`` it is the whole expression."""
        if operand.kind in {kind, ANY_KIND}:
            return
        if kind == "number":
            problem, cure = "numbers are wanted", "wire a REAL or an INT"
        else:
            problem = "a BOOL is wanted" if op < 0 or op in EQUALITY_OPERATORS else f"{OPERATOR_NAMES[op]} takes BOOLs"
            cure = "put a comparison into parentheses: NOT (PV < 4)" if op == NOT else "compare it, as in PV < 4.0"
        raise ExpressionError(f"{operand.text}; {problem}", operand.start, cure)


OPERATOR_NAMES = {
    **{op: word for level in JOIN_LEVELS for word, op in level.items()},
    NOT: "NOT",
    **{op: sign for sign, op in (*COMPARISONS.items(), *EQUALITIES.items())},
}
"""Operators of conditions as the language writes them."""
