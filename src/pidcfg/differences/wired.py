"""What a wire means, however it is written: two expressions are compared by what they calculate, step by step."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.schemas.conditions import TRUTHS, WORDS, Typed
from pidcfg.schemas.expressions import CONSTANT, FUNCTIONS, SIGNAL, TRUTH, ExpressionError, lengths_of
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from collections.abc import Mapping

WIRED = ("move", "when")
"""Keys of a move that hold a wire."""
NO_NAMES = frozenset((*WORDS, *TRUTHS))
NAME = re.compile(r"[A-Za-z_]\w*(?:\.\w+)*")


class Wired(NamedTuple):
    """The steps of an expression, each with its constant or the name of its signal; else its text."""

    steps: tuple[tuple[int, float | str | None], ...]
    text: str = ""

    def renamed(self, names: Mapping[str, str]) -> Wired:
        """The same with other names of blocks."""
        return Wired(tuple((op, _renamed(operand, names)) for op, operand in self.steps), self.text)


def _renamed(operand: float | str | None, names: Mapping[str, str]) -> float | str | None:
    if not isinstance(operand, str):
        return operand
    block, dot, key = operand.partition(".")
    return f"{names.get(block, block)}{dot}{key}"


def content_of(raw: Any) -> Any:
    """A content as it is compared: of a wire what it means."""
    if not isinstance(raw, Wire):
        return raw
    names = [
        name for name in dict.fromkeys(NAME.findall(raw.text)) if name not in FUNCTIONS and name.upper() not in NO_NAMES
    ]
    try:
        code, constants = _code(raw.text, names)
    except ExpressionError:
        return Wired((), raw.text)
    steps = []
    for op, operand in zip(code[::2], code[1::2], strict=True):
        value = names[operand] if op == SIGNAL else constants[operand] if op == CONSTANT else None
        value = float(operand) if op == TRUTH else value
        steps.append((op, value))
    return Wired(tuple(steps))


def move_content(value: Any) -> Any:
    """What the wires of a move mean, however they are written; None for a content that is no move."""
    if not isinstance(value, dict) or "move" not in value:
        return None
    parts = ((key, content_of(Wire(str(part))) if key in WIRED else part) for key, part in value.items())
    return tuple(sorted(parts))


def executed(entry: Mapping[str, Any]) -> Mapping[str, Any]:
    """What stands beside the parameters, with its moves as they are executed: those before all blocks come first."""
    moves = entry.get("moves")
    if not isinstance(moves, list | tuple):
        return entry
    return {**entry, "moves": sorted(moves, key=lambda move: move.get("at") != "start")}


def _code(text: str, names: list[str]) -> tuple[tuple[int, ...], tuple[float, ...]]:
    expression = Typed(text, {name: i for i, name in enumerate(names)}, lengths_of(names)).read()
    return expression.code, expression.constants
