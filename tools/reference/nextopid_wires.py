"""Expressions of wires and moves, ``Manual_1 OR LT_101 < 4.0``: read, and worked out in single precision."""

from __future__ import annotations

import re

import numpy as np

from reference.single import F, finite

TOKEN = re.compile(r"\s*(\d+\.?\d*(?:[eE][-+]?\d+)?|[A-Za-z_][\w.]*|<=|>=|<>|[-+*/()<>=,])")
WORDS = {"NOT", "AND", "OR", "XOR", "TRUE", "FALSE", "min", "max", "abs", "sqrt"}
LEVELS = (("OR",), ("XOR",), ("AND",), ("=", "<>"), ("<", "<=", ">", ">="), ("+", "-"), ("*", "/"))
"""Operators that bind alike, the loosest first (IEC 61131-3)."""


class NoValueError(Exception):
    """A division by zero, the root of a negative number, a result beyond single precision (D206)."""


def read(text):
    """An expression as a tree: a number, a BOOL, a name as ``("name", …)``, or an operator with its operands."""
    if isinstance(text, bool | int | float):
        return text if isinstance(text, bool) else F(text)
    tokens = TOKEN.findall(text)
    tree, rest = level(tokens, 0)
    assert not rest, (text, rest)
    return tree


def level(tokens, depth):
    """Operands joined by the operators of a level, from left to right."""
    if depth == len(LEVELS):
        return unary(tokens)
    left, tokens = level(tokens, depth + 1)
    while tokens and tokens[0] in LEVELS[depth]:
        right, rest = level(tokens[1:], depth + 1)
        left, tokens = (tokens[0], left, right), rest
    return left, tokens


def unary(tokens):
    """What has a sign or NOT, stands in parentheses, or stands by itself."""
    head, *rest = tokens
    if head in {"-", "+", "NOT"}:
        operand, rest = unary(rest)
        return (operand if head == "+" else ("negative" if head == "-" else head, operand)), rest
    if head == "(":
        inner, rest = level(rest, 0)
        return inner, rest[1:]
    if head in {"min", "max", "abs", "sqrt"}:
        operands = []
        while rest[0] in {"(", ","}:
            operand, rest = level(rest[1:], 0)
            operands.append(operand)
        return (head, *operands), rest[1:]
    if head in {"TRUE", "FALSE"}:
        return head == "TRUE", rest
    return (F(head) if head[0].isdigit() else ("name", head)), rest


def names(tree):
    """The names that a tree reads."""
    if not isinstance(tree, tuple):
        return set()
    if tree[0] == "name":
        return {tree[1]}
    return set().union(*(names(operand) for operand in tree[1:]))


def value(tree, lookup):
    """What a tree comes to; `NoValueError` where that is nothing, or no number of single precision (D206, D693)."""
    result = part(tree, lookup)
    if not isinstance(result, bool) and not finite(result):
        raise NoValueError(tree)
    return result


def part(tree, lookup):
    """What a part of a tree comes to; it may be infinite."""
    if not isinstance(tree, tuple):
        return tree
    if tree[0] == "name":
        return lookup(tree[1])
    result = OPERATORS[tree[0]](*(part(operand, lookup) for operand in tree[1:]))
    return bool(result) if isinstance(result, np.bool_) else result


def root(number):
    """The square root."""
    if number < 0:
        raise NoValueError(number)
    return np.sqrt(number)


def quotient(one, other):
    """The quotient."""
    if other == 0:
        raise NoValueError(other)
    return one / other


OPERATORS = {
    "OR": lambda a, b: a or b,
    "XOR": lambda a, b: a != b,
    "AND": lambda a, b: a and b,
    "NOT": lambda a: not a,
    "=": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": quotient,
    "negative": lambda a: -a,
    "min": min,
    "max": max,
    "abs": abs,
    "sqrt": root,
}
