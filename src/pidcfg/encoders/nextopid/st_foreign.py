"""Statements of a program that do not concern the blocks of the library: skipped, unless they use one of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.encoders.nextopid.st_scope import LIBRARY
from pidcfg.encoders.st.lex import END, NAME, Token
from pidcfg.encoders.st.parse import chain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.encoders.nextopid.st_scope import Scope

JUMPS = frozenset(("RETURN", "JMP"))


@dataclass(slots=True)
class Foreign:
    """What is left out of a program."""

    scope: Scope
    lines: list[int] = field(default_factory=list)
    """Where the statements stand."""

    def pass_over(self, tokens: Sequence[Token]) -> None:
        """Skips a statement that does not concern the library, but remembers the variables that it assigns."""
        if tokens[0].line not in self.lines[-1:]:
            self.lines.append(tokens[0].line)
        depth, padded = 0, (*tokens, *(Token(END, "", token.line, token.column) for token in [tokens[-1]] * 3))
        for at, token in enumerate(tokens):
            before = tokens[at - 1].text if at else ""
            depth += (token.text == "(") - (token.text == ")")
            if token.kind != NAME or before == ".":
                continue
            parts = chain(padded, at)
            follows = padded[at + 2 * len(parts) - 1].text
            self._refuse(token, parts, follows, depth)
            if (follows == ":=" and depth == 0) or before == "=>":
                self.scope.assigned.setdefault(token.upper, token)

    def _refuse(self, token: Token, parts: tuple[Token, ...], follows: str, depth: int) -> None:
        """Refuses jumps, and other uses of a block inside a skipped statement."""
        kind, item = LIBRARY.get(token.upper), self.scope.instance(token.upper)
        if token.upper in JUMPS:
            raise token.error(f"{token.text}: what stands behind is not always executed")
        if kind is not None and kind.function and follows == "(":
            raise token.error(f"{token.text} is called inside another statement")
        if item is None:
            return
        if len(parts) == 1:
            what = "is called" if follows == "(" else "is used as a whole"
            raise token.error(f"{item.name} {what} inside another statement")
        if follows == ":=" and depth == 0:
            raise token.error(f"a parameter of {item.name} is assigned inside another statement")
