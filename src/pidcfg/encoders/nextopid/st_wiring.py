"""Expressions of Structured Text as the code of `pidcfg.schemas.expressions`, with the type of everything.

A program tells whole numbers from real ones, and divides them otherwise; it joins BOOLs, and has times. What means the
same in a configuration is read; a type that an operator does not take is refused where it stands.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.encoders.nextopid.st_expression import EQUALITY, OPERATORS, PRODUCT, SUM
from pidcfg.encoders.nextopid.st_write import DEEPEST
from pidcfg.encoders.st.lex import END, NAME, Token
from pidcfg.encoders.st.parse import Cursor, chain, is_literal
from pidcfg.encoders.st.values import INTEGERS, TRUTHS, number_of
from pidcfg.schemas.conditions import KINDS
from pidcfg.schemas.expressions import (
    ABSOLUTE,
    CONSTANT,
    LARGEST_VALUE,
    MAX_LENGTH,
    MAXIMUM,
    MINIMUM,
    NEGATE,
    NOT,
    ROOT,
    SIGNAL,
    TRUTH,
)
from pidcfg.schemas.iec import Timed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pidcfg.schemas.iec import IecType

TO_REAL = frozenset((*(f"{kind}_TO_REAL" for kind in INTEGERS | {"LREAL"}), "TO_REAL"))
"""Conversions that change no number of ours."""
TO_WHOLE = {"INT": frozenset(("REAL_TO_INT", "TO_INT")), "UINT": frozenset(("REAL_TO_UINT", "TO_UINT"))}
"""Conversions of a whole expression, by the type of the parameter that it is for."""
TIME_TO_REAL = "TIME_TO_REAL"
MILLI = 1000
FUNCTIONS = {"MIN": (MINIMUM, 2), "MAX": (MAXIMUM, 2), "ABS": (ABSOLUTE, 1), "SQRT": (ROOT, 1)}
SUMS = ("+", "-")
SIGNS = {sign: (op, rank) for op, (sign, rank) in OPERATORS.items()}
"""Operators between two operands, and how tightly they bind."""
AMPERSANDS = {"&": "AND"}
ALLOWED = "numbers, names, conditions, + - * / ( ) and MIN, MAX, ABS, SQRT can be wired"
LONGER = f"the expression is longer than {MAX_LENGTH} characters: assign a part of it to a variable before"
BOOL, REAL, WHOLE, TIME = "bool", "real", "whole", "time"
IN_WORDS = {BOOL: "a BOOL", REAL: "a REAL", WHOLE: "a whole number", TIME: "a TIME"}
NUMBERS = frozenset((REAL, WHOLE))


@dataclass(slots=True)
class Wiring:
    """Reads an expression into code and names; ``resolve`` gives the full name and the type of a name as written.

    Every part returns the kind of what it has read: ``bool``, ``real``, ``whole`` or ``time``.
    """

    cursor: Cursor
    resolve: Callable[[tuple[Token, ...]], tuple[str, IecType]]
    code: list[int] = field(default_factory=list)
    constants: list[float] = field(default_factory=list)
    names: list[str] = field(default_factory=list)

    @classmethod
    def read(
        cls, tokens: Sequence[Token], kind: IecType, resolve: Callable[[tuple[Token, ...]], tuple[str, IecType]]
    ) -> Wiring:
        """The expression that is wired to a parameter of this type."""
        end = Token(END, "the end of the expression", tokens[-1].line, tokens[-1].column)
        self = cls(Cursor((*tokens, end, end, end, end, end)), resolve)
        if self.cursor.here.upper in TO_WHOLE.get(kind.name, ()):
            word = self.cursor.take()
            self.cursor.expect("(", word.text)
            found = self.expression(1)
            self.cursor.expect(")", "the expression")
        else:
            found = self.expression(0)
        if len(self.code) > 2 * MAX_LENGTH:  # each pair of it is a character at least
            raise tokens[0].error(LONGER)
        if self.cursor.here.kind != END:
            raise self.cursor.here.error(f"unexpected {self.cursor.here.text!r}; {ALLOWED}")
        wanted = "a BOOL is wanted" if kind.kind == "bool" else "numbers are wanted"
        what = f"{self.names[0]} is" if self.code[::2] == [SIGNAL] else "this is"
        want((found in NUMBERS) == (KINDS[kind.kind] == "number"), tokens[0], f"{what} {IN_WORDS[found]}; {wanted}")
        return self

    def emit(self, op: int, operand: int = 0) -> None:
        """One pair of code."""
        self.code += (op, operand)

    def expression(self, depth: int, least: int = 0) -> str:
        """Operands and the operators between them that bind as tightly as ``least``, from left to right."""
        if depth > DEEPEST:
            raise self.cursor.here.error(f"more than {DEEPEST} levels of nesting")
        kind = REAL if least <= PRODUCT and self.seconds() else self.factor(depth)
        while True:
            sign = self.cursor.here
            op, rank = SIGNS.get(AMPERSANDS.get(sign.text, sign.upper), (0, -1))
            if rank < least:
                return kind
            self.cursor.take()
            kind = self.joined(sign, rank, kind, self.expression(depth, rank + 1))
            self.emit(op)

    def joined(self, sign: Token, rank: int, left: str, right: str) -> str:
        """The kind that an operator gives; refuses operands that it does not take."""
        both = {left, right}
        if rank < EQUALITY:
            want(both == {BOOL}, sign, f"{sign.text} takes BOOLs")
        elif rank < SUM:
            alike = both <= NUMBERS or both == {TIME} or (both == {BOOL} and rank == EQUALITY)
            want(alike, sign, f"{IN_WORDS[left]} and {IN_WORDS[right]} are compared here")
        else:
            times = both == {TIME} and rank == SUM
            want(both <= NUMBERS or times, sign, f"{sign.text} takes two numbers")
            if both == {WHOLE} and sign.text == "/":
                raise sign.error("whole numbers are divided without a remainder; write them as REAL, as in 1.0 / 2.0")
            return left if left == right else REAL
        return BOOL

    def seconds(self) -> bool:
        """``TIME_TO_REAL(x) / 1000.0``: a time in s, as it counts in a configuration; False where that is not here."""
        cursor, at = self.cursor, self.cursor.at
        if cursor.here.upper != TIME_TO_REAL or cursor.tokens[at + 1].text != "(":
            return False
        parts = chain(cursor.tokens, at + 2)
        behind = at + 2 + max(2 * len(parts) - 1, 0)
        close, slash, number = (cursor.tokens[min(behind + i, len(cursor.tokens) - 1)] for i in range(3))
        if not parts or (close.text, slash.text) != (")", "/") or not is_literal(number) or number_of(number) != MILLI:
            return False
        name, kind = self.resolve(parts)
        want(kind.kind == TIME, parts[0], f"{name} is {kind.name}; a TIME is wanted")
        self.signal(name)
        cursor.at = behind + 3
        return True

    def factor(self, depth: int) -> str:
        """A number, a name, a function, parentheses, or one of them with a sign or NOT."""
        cursor = self.cursor
        if cursor.here.upper == "NOT" and cursor.here.kind == NAME:
            return self.inverted(depth)
        negative, signs = False, cursor.at
        while cursor.here.text in SUMS:
            negative ^= cursor.take().text == "-"
        token, signed = cursor.here, cursor.at > signs
        if is_literal(token):
            kind = self.constant(cursor.take())
        elif token.text == "(":
            cursor.take()
            kind = self.expression(depth + 1)
            cursor.expect(")", "the expression")
        elif token.kind == NAME:
            kind = self.name_or_call(depth)
        else:
            raise token.error(f"a number or a name is missing before {token.text!r}; {ALLOWED}")
        want(not signed or kind in NUMBERS, token, "a sign wants a number")
        if negative:
            self.emit(NEGATE)
        return kind

    def inverted(self, depth: int) -> str:
        """NOT, any number of times, and its BOOL."""
        count = 0
        while self.cursor.here.upper == "NOT":
            self.cursor.take()
            count += 1
        start = self.cursor.here
        want(self.factor(depth) == BOOL, start, "NOT takes a BOOL; put a comparison into parentheses: NOT (PV < 4.0)")
        if count % 2:
            self.emit(NOT)
        return BOOL

    def constant(self, token: Token) -> str:
        """A number, a time in s, or a truth with its type before it."""
        value = number_of(token)
        if isinstance(value, bool):
            self.emit(TRUTH, int(value))
            return BOOL
        if not 0 <= value <= LARGEST_VALUE:
            raise token.error(f"{token.text} cannot stand in an expression")
        self.emit(CONSTANT, len(self.constants))
        self.constants.append(float(value))
        return TIME if isinstance(value, Timed) else WHOLE if isinstance(value, int) else REAL

    def signal(self, name: str) -> None:
        """The value of a name."""
        self.emit(SIGNAL, len(self.names))
        self.names.append(name)

    def name_or_call(self, depth: int) -> str:
        """A name, TRUE or FALSE, or a function with its arguments."""
        cursor = self.cursor
        parts = chain(cursor.tokens, cursor.at)
        if cursor.tokens[cursor.at + 1].text == "(":
            return self.call(depth)
        if len(parts) == 1 and parts[0].upper in TRUTHS:
            self.emit(TRUTH, int(TRUTHS[parts[0].upper]))
            cursor.take()
            return BOOL
        name, kind = self.resolve(parts)
        want(kind.kind in IN_WORDS, parts[0], f"{name} is {kind.name}; numbers and BOOLs can be wired")
        cursor.at += 2 * len(parts) - 1
        self.signal(name)
        return kind.kind

    def call(self, depth: int) -> str:
        """A function."""
        word = self.cursor.take()
        if any(word.upper in words for words in TO_WHOLE.values()):
            raise word.error(f"{word.text} can only be around the whole expression of an INT parameter")
        if word.upper not in {*FUNCTIONS, *TO_REAL, TIME_TO_REAL}:
            raise word.error(f"{word.text} is a function that cannot be wired; {ALLOWED}")
        op, fewest = FUNCTIONS.get(word.upper, (0, 1))
        self.cursor.expect("(", word.text)
        kinds = [self.expression(depth + 1)]
        while self.cursor.here.text == ",":
            self.cursor.take()
            kinds.append(self.expression(depth + 1))
            self.emit(op)
        self.cursor.expect(")", "the arguments")
        if len(kinds) < fewest or (fewest == 1 and len(kinds) > 1):
            raise word.error(f"{word.text} does not take {len(kinds)} argument{'s' * (len(kinds) > 1)}")
        if word.upper == TIME_TO_REAL:
            want(kinds == [TIME], word, f"{word.text} takes a TIME")
            raise word.error(f"{word.text} gives ms; write {word.text}(…) / 1000.0, since a configuration has s")
        want({*kinds} <= NUMBERS, word, f"{word.text} takes numbers")
        if op in (ABSOLUTE, ROOT):
            self.emit(op)
        return REAL if word.upper in {"SQRT", *TO_REAL} or REAL in kinds else WHOLE


def want(holds: bool, token: Token, message: str) -> None:  # noqa: FBT001 - what is wanted
    """Refuses what is not so, where it stands."""
    if not holds:
        raise token.error(message)
