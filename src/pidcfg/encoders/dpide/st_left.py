"""What is left out of a program, as far as it concerns operands: what may write them, and jumps around the calls."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.dpide.program import INSTRUCTION
from pidcfg.encoders.dpide.st_scope import joined
from pidcfg.encoders.st.lex import NAME

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.dpide.st_units import Step
    from pidcfg.encoders.st.lex import Token

JUMPS = frozenset(("RETURN", "JMP"))
LATCHES = frozenset(("S", "R", "REF"))
"""Words before ``=`` with which a statement sets its variable."""
OPENERS = frozenset(("THEN", "ELSE", "DO", "REPEAT", ":", ";"))
"""Behind which a statement begins."""
FROM_OUTSIDE = ("PV", "MV")
"""Operands whose value comes from the process or the instruction, wherever else they are used."""
IN_A_CALL = f"stands in a call that is not {INSTRUCTION}'s, and may be written there,"


def notes_of(step: Step, operands: Mapping[str, str]) -> Iterator[str]:
    """What a statement that is left out does with operands, by their full names; nothing: it is not about them."""
    tokens = step.tokens
    for jump in (token for token in tokens if token.kind == NAME and token.upper in JUMPS):
        yield f"{jump.text} in line {jump.line} is not carried over: what stands behind is not always executed"
    sign = next((i for i, token in enumerate(tokens) if token.text == ":="), 0)
    if sign and not step.is_compound:
        full = operands.get(joined(tokens[:sign]).upper())
        if full is not None:
            yield f"{full} is assigned in line {tokens[0].line}, which is not carried over"
            return
    told = set[tuple[str, int]]()
    for at, token in enumerate(tokens):
        full = operands.get(token.upper) if token.kind == NAME else None
        how = "" if full is None else _how(tokens, at)
        if full is None or not how or (how == IN_A_CALL and full.endswith(FROM_OUTSIDE)) or (full, token.line) in told:
            continue
        told.add((full, token.line))
        yield f"{full} {how} in line {token.line}, which is not carried over"


def _how(tokens: tuple[Token, ...], at: int) -> str:
    """How a name is used where it stands; empty: it is only read."""
    behind, next_one = tokens[at + 1], tokens[min(at + 2, len(tokens) - 1)]
    latched = behind.upper in LATCHES and next_one.text == "="
    if (behind.text == ":=" and _depth(tokens, at) == 0) or tokens[at - 1].text == "=>" or latched:
        return "is assigned"
    return IN_A_CALL if behind.text != ":=" and _is_argument(tokens, at) else ""


def _depth(tokens: tuple[Token, ...], at: int) -> int:
    return sum((token.text == "(") - (token.text == ")") for token in tokens[:at])


def _is_argument(tokens: tuple[Token, ...], at: int) -> bool:
    """Whether a name alone is an argument of a call that is a statement, or of one inside."""
    before, behind = tokens[at - 1].text, tokens[at + 1].text
    if before not in {"(", ",", ":="} or behind not in {")", ","}:
        return False
    start = max((i for i in range(at) if tokens[i].upper in OPENERS), default=-1) + 1
    return tokens[start].kind == NAME and tokens[start + 1].text == "("
