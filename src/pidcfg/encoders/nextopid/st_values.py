"""Literals and expressions of Structured Text."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.nextopid.st_lex import END, NAME, Token
from pidcfg.encoders.nextopid.st_parse import Cursor, chain, is_literal
from pidcfg.encoders.nextopid.st_write import DEEPEST
from pidcfg.encoders.parameters import read
from pidcfg.schemas.base import MAX_DIGITS
from pidcfg.schemas.expressions import (
    ABSOLUTE,
    ADD,
    CONSTANT,
    DIVIDE,
    LARGEST_VALUE,
    MAXIMUM,
    MINIMUM,
    MULTIPLY,
    NEGATE,
    ROOT,
    SIGNAL,
    SUBTRACT,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pidcfg.encoders.parameters import Content
    from pidcfg.schemas.iec import IecType

TRUTHS = {"TRUE": True, "FALSE": False}
BASES = {"2": 2, "8": 8, "16": 16}
INTEGERS = frozenset(
    ("SINT", "INT", "DINT", "LINT", "USINT", "UINT", "UDINT", "ULINT", "BYTE", "WORD", "DWORD", "LWORD")
)
REALS = frozenset(("REAL", "LREAL"))
TO_REAL = frozenset((*(f"{kind}_TO_REAL" for kind in INTEGERS | {"LREAL"}), "TO_REAL"))
"""Conversions that change no number of ours."""
TO_INT = frozenset(("REAL_TO_INT", "TO_INT"))
FUNCTIONS = {"MIN": (MINIMUM, 2), "MAX": (MAXIMUM, 2), "ABS": (ABSOLUTE, 1), "SQRT": (ROOT, 1)}
SUMS, PRODUCTS = {"+": ADD, "-": SUBTRACT}, {"*": MULTIPLY, "/": DIVIDE}
ALLOWED = "numbers, names, + - * / ( ) and MIN, MAX, ABS, SQRT can be wired"


def number_of(token: Token) -> int | Decimal | bool:
    """What a literal means: a whole number, a real one, or a truth."""
    text = token.text.replace("_", "")
    if len(text) > MAX_DIGITS + 8:
        raise token.error(f"a number of more than {MAX_DIGITS} digits")
    prefix, _, rest = text.rpartition("#")
    kind, _, base = prefix.upper().rpartition("#")
    base, kind = (base, kind) if base in BASES else ("", base if not kind else prefix.upper())
    try:
        if kind == "BOOL":
            return {"1": True, "0": False, **TRUTHS}[rest.upper()]
        if base and kind in {"", *INTEGERS}:
            return int(rest, BASES[base])
        if kind in REALS or not kind:
            number = Decimal(rest)
            return int(rest) if not kind and rest.isdigit() else _finite(number, token)
        if kind in INTEGERS:
            return int(rest)
    except (ValueError, ArithmeticError, KeyError):
        raise token.error(f"{token.text} is not a literal") from None
    raise token.error(f"{token.text} is no number; write times as numbers, in s")


def _finite(number: Decimal, token: Token) -> Decimal:
    if not number.is_finite() or abs(number.adjusted()) > MAX_DIGITS * 4:
        raise token.error(f"{token.text} is too large or too small")
    return number


def content_of(tokens: Sequence[Token], kind: IecType, name: str) -> Content | None:
    """The content that a literal means for a variable of this type; None: it is no literal."""
    signs = [token.text for token in tokens if token.text in {"+", "-"}]
    rest = tokens[len(signs) :]
    if kind.kind == "word":
        return _word(tokens, kind, name)
    if len(rest) != 1 or [token.text for token in tokens[: len(signs)]] != signs:
        return None
    token = rest[0]
    truth = TRUTHS.get(token.upper) if token.kind == NAME and not signs else None
    if truth is None and not is_literal(token):
        return None
    value = number_of(token) if truth is None else truth
    if isinstance(value, bool) or kind.kind == "bool":
        plain = value if isinstance(value, bool) else {0: False, 1: True}.get(value if isinstance(value, int) else 2)
        content = read(kind, plain) if not signs else None
    else:
        content = read(kind, float(-value if signs.count("-") % 2 else value))
    if content is None:
        raise tokens[0].error(f"{name}: {''.join(part.text for part in tokens)} is not a value of {kind.name}")
    return content


def _word(tokens: Sequence[Token], kind: IecType, name: str) -> Content | None:
    """A word of an enumeration, with or without its name before it."""
    text = "".join(token.upper for token in tokens)
    for sign in "#.":
        text = text.removeprefix(f"{kind.name}{sign}")
    if text not in kind.words:
        raise tokens[0].error(f"{name}: {text} is none of {', '.join(kind.words)}")
    return text


@dataclass(slots=True)
class Wiring:
    """Reads an expression into the code that `pidcfg.schemas.expressions` has, and its names.

    ``resolve`` gives the full name and the type of a name as written. Whole numbers are told from real ones, since
    the language divides them otherwise.
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
        self = cls(Cursor((*tokens, end, end)), resolve)
        if kind.kind == "whole" and self.cursor.here.upper in TO_INT:
            word = self.cursor.take()
            self.cursor.expect("(", word.text)
            self.sum(1)
            self.cursor.expect(")", "the expression")
        else:
            self.sum(0)
        if self.cursor.here.kind != END:
            raise self.cursor.here.error(f"unexpected {self.cursor.here.text!r}; {ALLOWED}")
        return self

    def emit(self, op: int, operand: int = 0) -> None:
        """One pair of code."""
        self.code += (op, operand)

    def sum(self, depth: int) -> bool:
        """Products, added and subtracted; whether all are whole numbers."""
        if depth > DEEPEST:
            raise self.cursor.here.error(f"more than {DEEPEST} levels of nesting")
        whole = self.product(depth)
        while self.cursor.here.text in SUMS:
            op = SUMS[self.cursor.take().text]
            whole = self.product(depth) and whole
            self.emit(op)
        return whole

    def product(self, depth: int) -> bool:
        """Factors, multiplied and divided."""
        whole = self.factor(depth)
        while self.cursor.here.text in PRODUCTS:
            sign = self.cursor.take()
            whole = self.factor(depth) and whole
            if whole and sign.text == "/":
                raise sign.error("whole numbers are divided without a remainder; write them as REAL, as in 1.0 / 2.0")
            self.emit(PRODUCTS[sign.text])
        return whole

    def factor(self, depth: int) -> bool:
        """A number, a name, a function, parentheses, or one of them with a sign."""
        negative = False
        while self.cursor.here.text in SUMS:
            negative ^= self.cursor.take().text == "-"
        token = self.cursor.here
        if is_literal(token):
            whole = self.constant(self.cursor.take())
        elif token.text == "(":
            self.cursor.take()
            whole = self.sum(depth + 1)
            self.cursor.expect(")", "the expression")
        elif token.kind == NAME:
            whole = self.name_or_call(depth)
        else:
            raise token.error(f"a number or a name is missing before {token.text!r}; {ALLOWED}")
        if negative:
            self.emit(NEGATE)
        return whole

    def constant(self, token: Token) -> bool:
        """A number."""
        value = number_of(token)
        if isinstance(value, bool) or not 0 <= value <= LARGEST_VALUE:
            raise token.error(f"{token.text} cannot stand in an expression")
        self.emit(CONSTANT, len(self.constants))
        self.constants.append(float(value))
        return isinstance(value, int)

    def name_or_call(self, depth: int) -> bool:
        """A name, or a function with its arguments."""
        parts = chain(self.cursor.tokens, self.cursor.at)
        if self.cursor.tokens[self.cursor.at + 1].text == "(":
            return self.call(depth)
        name, kind = self.resolve(parts)
        if kind.kind not in {"real", "whole"}:
            raise parts[0].error(f"{name} is {kind.name}; numbers are wanted")
        self.cursor.at += 2 * len(parts) - 1
        self.emit(SIGNAL, len(self.names))
        self.names.append(name)
        return kind.kind == "whole"

    def call(self, depth: int) -> bool:
        """A function."""
        word = self.cursor.take()
        if word.upper in TO_INT:
            raise word.error(f"{word.text} can only be around the whole expression of an INT parameter")
        if word.upper not in FUNCTIONS and word.upper not in TO_REAL:
            raise word.error(f"{word.text} is a function that cannot be wired; {ALLOWED}")
        op, fewest = FUNCTIONS.get(word.upper, (0, 1))
        self.cursor.expect("(", word.text)
        whole, count = self.sum(depth + 1), 1
        while self.cursor.here.text == ",":
            self.cursor.take()
            whole = self.sum(depth + 1) and whole
            count += 1
            self.emit(op)
        self.cursor.expect(")", "the arguments")
        if count < fewest or (fewest == 1 and count > 1):
            raise word.error(f"{word.text} does not take {count} argument{'s' * (count > 1)}")
        if op in (ABSOLUTE, ROOT):
            self.emit(op)
        return whole and word.upper not in {"SQRT", *TO_REAL}
