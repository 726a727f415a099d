"""Expressions in Structured Text and in configuration files: the same code, printed in two dialects.

What is printed here reads back to the same code, so that no sum is taken in another order: `printed` sets parentheses
wherever the order of evaluation is not the one that the language has by itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.st.text import st_real
from pidcfg.schemas.base import LOOKS_BOOLEAN
from pidcfg.schemas.conditions import COMPARISONS, EQUALITIES, JOINTS, TRUTHS
from pidcfg.schemas.expressions import (
    ABSOLUTE,
    ADD,
    CONSTANT,
    DIVIDE,
    FUNCTIONS,
    MAXIMUM,
    MINIMUM,
    MULTIPLY,
    NEGATE,
    NOT,
    ROOT,
    SIGNAL,
    SUBTRACT,
    TRUTH,
)
from pidcfg.schemas.iec import is_numeric

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

EQUALITY, COMPARISON, SUM, PRODUCT, SIGN, ATOM = range(len(JOINTS), len(JOINTS) + 6)
"""How tightly a text binds; what words join binds less."""
OPERATORS = {
    **{op: (word, rank) for rank, level in enumerate(JOINTS) for word, op in level.items()},
    **{op: (sign, EQUALITY) for sign, op in EQUALITIES.items()},
    **{op: (sign, COMPARISON) for sign, op in COMPARISONS.items()},
    ADD: ("+", SUM),
    SUBTRACT: ("-", SUM),
    MULTIPLY: ("*", PRODUCT),
    DIVIDE: ("/", PRODUCT),
}
WORDS_OF_TRUTH = {value: word for word, value in TRUTHS.items()}


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a language writes numbers and functions."""

    number: Callable[[float], str]
    functions: Mapping[int, str]
    most_arguments: Mapping[int, int]
    """Of min and max; more are nested."""
    space: str = " "


class Piece(NamedTuple):
    """Part of an expression as text, how tightly it binds, and the arguments if it is a call."""

    text: str
    rank: int
    op: int = -1
    arguments: tuple[str, ...] = ()


def plain_real(value: float) -> str:
    """A number as people write it."""
    return repr(value).removesuffix(".0")


WORDS = {op: name for name, (op, _, _) in FUNCTIONS.items()}
ST = Dialect(st_real, {op: name.upper() for op, name in WORDS.items()}, {MINIMUM: 2, MAXIMUM: 2})
PLAIN = Dialect(plain_real, WORDS, {FUNCTIONS[name][0]: FUNCTIONS[name][2] for name in ("min", "max")})
COMPACT = Dialect(PLAIN.number, PLAIN.functions, PLAIN.most_arguments, "")
"""As configuration files have it, for an expression that would be too long with blanks."""


def printed(code: Sequence[int], constants: Sequence[float], name: Callable[[int], str], dialect: Dialect) -> str:
    """The text of an expression's code; ``name`` gives the name of a signal's number.

    A number and nothing else stands in parentheses: it is wired, and not the value of a parameter.
    """
    stack: list[Piece] = []
    for op, operand in zip(code[::2], code[1::2], strict=True):
        if op == CONSTANT:
            stack.append(Piece(dialect.number(constants[operand]), ATOM))
        elif op == SIGNAL:
            stack.append(Piece(name(operand), ATOM))
        elif op == TRUTH:
            stack.append(Piece(WORDS_OF_TRUTH[operand], ATOM))
        elif op in (NEGATE, NOT):
            stack.append(Piece(f"{'-' if op == NEGATE else 'NOT '}{_atom(stack.pop())}", SIGN))
        elif op in (ABSOLUTE, ROOT):
            stack.append(_call(op, (stack.pop().text,), dialect))
        else:
            right, left = stack.pop(), stack.pop()
            stack.append(_pair(op, left, right, dialect))
    text = stack.pop().text
    return f"({text})" if is_number(code) else text


def is_number(code: Sequence[int]) -> bool:
    """Whether an expression is a number with or without signs or a truth, and nothing else."""
    return set(code[::2]) <= {CONSTANT, NEGATE, TRUTH}


def _pair(op: int, left: Piece, right: Piece, dialect: Dialect) -> Piece:
    if op in OPERATORS:
        sign, rank = OPERATORS[op]
        first = left.text if left.rank >= rank else f"({left.text})"
        second = right.text if right.rank > rank and not right.text.startswith("-") else f"({right.text})"
        space = " " if sign.isalpha() else dialect.space
        return Piece(f"{first}{space}{sign}{space}{second}", rank)
    if left.op == op and len(left.arguments) < dialect.most_arguments[op]:
        return _call(op, (*left.arguments, right.text), dialect)
    return _call(op, (left.text, right.text), dialect)


def _atom(piece: Piece) -> str:
    return piece.text if piece.rank == ATOM else f"({piece.text})"


def _call(op: int, arguments: tuple[str, ...], dialect: Dialect) -> Piece:
    return Piece(f"{dialect.functions[op]}({f',{dialect.space}'.join(arguments)})", ATOM, op, arguments)


def wire_text(code: Sequence[int], constants: Sequence[float], name: Callable[[int], str], longest: int) -> str:
    """An expression as a configuration has it; a name that would be read as a number or a truth gets parentheses."""
    text = printed(code, constants, name, PLAIN)
    text = printed(code, constants, name, COMPACT) if len(text) > longest else text
    return f"({text})" if is_numeric(text) or text.lower() in {*LOOKS_BOOLEAN, "null"} else text


def depth(text: str) -> int:
    """How deep the parentheses of a text are nested."""
    deepest = now = 0
    for character in text:
        now += (character == "(") - (character == ")")
        deepest = max(deepest, now)
    return deepest
