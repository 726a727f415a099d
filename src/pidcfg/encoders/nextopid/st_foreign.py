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

STRUCTURE = "AutoTuneParam"
"""The input that is a structure."""
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
            if token.kind != NAME:
                continue
            if before == ".":
                self._refuse_member(token, padded[at + 1].text)
                continue
            parts = chain(padded, at)
            behind = at + 2 * len(parts) - 1
            follows = padded[behind].text
            self._refuse(token, parts, follows, depth)
            refers = [part.upper for part in padded[behind : behind + 2]] == ["REF", "="]
            if (follows == ":=" and depth == 0) or before == "=>" or refers:
                self.scope.assigned.setdefault(token.upper, token)

    def is_held(self, name: Token) -> bool:
        """Whether a variable stands for a parameter."""
        return name.upper in self.scope.aliases or name.upper in self.scope.structures

    def refuse_written_over(self) -> None:
        """Variables that stand for inputs are not assigned besides; what is read of outputs is refused where it is."""
        for upper, (item, row) in self.scope.aliases.items():
            at = self.scope.assigned.get(upper)
            if at is not None and row.access == "input":
                raise at.error(f"{at.text} is assigned in line {at.line}, and is {row.name} of {item.name}: wire it")
        for upper, (item, name) in self.scope.structures.items():
            at = self.scope.assigned.get(upper)
            if at is not None and name.upper == STRUCTURE.upper():
                what = f"{at.text} is assigned in line {at.line}, and is {STRUCTURE} of {item.name} in line {name.line}"
                raise at.error(f"{what}: assign {item.name}.{STRUCTURE} itself, member by member")

    def _refuse_member(self, token: Token, follows: str) -> None:
        """Refuses the call of a block by another name than it is declared with."""
        item = self.scope.instance(token.upper)
        if item is not None and follows == "(":
            raise token.error(f"{item.name} is called here with another name before it; write {item.name}(…) alone")

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
