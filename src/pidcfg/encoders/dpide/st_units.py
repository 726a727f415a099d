"""A text as programs and function blocks, and their statements one by one with the conditions around them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.st.lex import END, NAME, Token, tokens_of
from pidcfg.encoders.st.parse import ENDS, QUALIFIERS, VARIABLES, Cursor, declarations, statement

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.st.lex import Comment
    from pidcfg.encoders.st.parse import Declaration

UNITS = ("PROGRAM", "FUNCTION_BLOCK")
SKIPPED = ("FUNCTION", "TYPE")
"""What has no place for the instruction, and is left out up to its end."""
THEN = frozenset(("THEN",))


class Guard(NamedTuple):
    """A condition around a statement; one that is not ``plain`` is of ELSE, ELSIF or what comes behind one."""

    tokens: tuple[Token, ...]
    plain: bool = True


class Step(NamedTuple):
    """A statement, with the end as its last token; CASE and loops are one with all that is inside."""

    tokens: tuple[Token, ...]
    guards: tuple[Guard, ...] = ()

    @property
    def first(self) -> Token:
        """Where it begins."""
        return self.tokens[0]

    @property
    def is_compound(self) -> bool:
        """Whether others are inside."""
        return self.first.kind == NAME and self.first.upper in ENDS


@dataclass(slots=True)
class Unit:
    """A program or a function block; without a name what stands outside of all."""

    kind: str = "PROGRAM"
    name: Token | None = None
    declarations: list[Declaration] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)


def units_of(text: str) -> tuple[list[Unit], list[Comment], list[int]]:
    """Units, comments, and the lines of what is skipped; raises `ListingError` at what cannot be read."""
    tokens, comments = tokens_of(text)
    cursor, bare, skipped = Cursor(tokens), Unit(), list[int]()
    units = [bare]
    while cursor.here.kind != END:
        word = cursor.here.upper if cursor.here.kind == NAME else ""
        if word in UNITS:
            units.append(_unit(cursor))
        elif word in SKIPPED:
            skipped.append(cursor.here.line)
            _skip(cursor)
        else:
            _part(cursor, bare)
    return units, comments, skipped


def _unit(cursor: Cursor) -> Unit:
    """A program or a function block up to its end."""
    head = cursor.take()
    name = cursor.take()
    if name.kind != NAME:
        raise name.error(f"a name is missing after {head.text}, before {name.text!r}")
    unit, end = Unit(head.upper, name), f"END_{head.upper}"
    while cursor.here.upper != end:
        if cursor.here.kind == END or cursor.here.upper in UNITS:
            raise head.error(f"{head.text} {name.text} has no {end}")
        _part(cursor, unit)
    cursor.take()
    return unit


def _part(cursor: Cursor, unit: Unit) -> None:
    """A block of variables, or a statement."""
    if cursor.here.kind == NAME and cursor.here.upper in VARIABLES:
        unit.declarations += declarations(cursor)
        return
    if cursor.here.kind == NAME and (cursor.here.upper.startswith("END_") or cursor.here.upper in QUALIFIERS):
        raise cursor.here.error(f"{cursor.here.text} stands here without its beginning")
    for whole in statement(cursor):
        unit.steps += steps_of(whole.tokens)


def _skip(cursor: Cursor) -> None:
    head = cursor.take()
    while cursor.here.upper != f"END_{head.upper}":
        if cursor.take().kind == END:
            raise head.error(f"{head.text} has no END_{head.upper}")
    cursor.take()


def steps_of(tokens: tuple[Token, ...], guards: tuple[Guard, ...] = ()) -> Iterator[Step]:
    """The statements of a statement: those inside of IF, each with the conditions around it."""
    if tokens[0].kind != NAME or tokens[0].upper != "IF":
        yield Step(tokens, guards)
        return
    cursor, is_first = Cursor(tokens), True
    while cursor.take().upper in {"IF", "ELSIF"}:
        condition = cursor.until(THEN)
        word = cursor.expect("THEN", "the condition of IF")
        if not condition:
            raise word.error("a condition is missing before THEN")
        yield from _body(cursor, (*guards, Guard(condition, is_first)))
        is_first = False
    if cursor.tokens[cursor.at - 1].upper == "ELSE":
        yield from _body(cursor, (*guards, Guard((cursor.tokens[cursor.at - 1],), plain=False)))


def _body(cursor: Cursor, guards: tuple[Guard, ...]) -> Iterator[Step]:
    while cursor.here.upper not in {"ELSIF", "ELSE", "END_IF"}:
        if cursor.here.kind == END:
            raise cursor.here.error("END_IF is missing")
        for inner in statement(cursor):
            yield from steps_of(inner.tokens, guards)
