"""A text as one program: its declarations, statements and comments, and what stands beside it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.st.lex import END, NAME, Comment, Token, tokens_of
from pidcfg.encoders.st.parse import VARIABLES, Cursor, Declaration, Statement, declarations, name_of, statement

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

BLOCKS = frozenset(name.upper() for name in BLOCK_TYPES)
"""Types of the library, in capitals."""
SKIPPED = frozenset(("FUNCTION", "FUNCTION_BLOCK", "TYPE"))
"""What may stand beside the program, and is left out up to its end."""
FOREIGN = frozenset(
    (
        "CONFIGURATION",
        "RESOURCE",
        "CLASS",
        "INTERFACE",
        "METHOD",
        "PROPERTY",
        "ACTION",
        "NAMESPACE",
    )
)


@dataclass(slots=True)
class Source:
    """A program as written."""

    program: Token | None = None
    declarations: list[Declaration] = field(default_factory=list)
    statements: list[Statement] = field(default_factory=list)
    comments: list[Comment] = field(default_factory=list)
    skipped: list[int] = field(default_factory=list)
    """Where parts begin that are left out."""


def parse_st(text: str) -> Source:
    """A program; raises `ListingError` at what cannot be read."""
    tokens, comments = tokens_of(text)
    source, cursor, ended = Source(comments=comments), Cursor(tokens), False
    while cursor.here.kind != END:
        word = cursor.here.upper
        if word in VARIABLES:
            source.declarations += declarations(cursor)
        elif word in SKIPPED:
            source.skipped.append(cursor.here.line)
            _skip(cursor)
        elif word == "PROGRAM" or word in FOREIGN:
            token = cursor.take()
            if word != "PROGRAM" or source.program is not None:
                raise token.error(f"{word}: a file holds one PROGRAM, with its variables and statements")
            source.program = name_of(cursor, "PROGRAM")
        elif word == "END_PROGRAM" and not ended:
            ended = bool(cursor.take())
        elif ended:
            raise cursor.here.error(f"{cursor.here.text!r} stands behind END_PROGRAM")
        else:
            source.statements += statement(cursor)
    owners = _owners(source)
    source.statements = [unqualified(whole, owners) for whole in source.statements]
    return source


def _skip(cursor: Cursor) -> None:
    """Moves behind a part that is no program, which has no blocks of the library."""
    head = cursor.take()
    while cursor.here.upper != f"END_{head.upper}":
        token = cursor.take()
        if token.kind == END:
            raise head.error(f"{head.text} has no END_{head.upper}")
        if token.kind == NAME and token.upper in BLOCKS:
            raise token.error(f"{token.text} stands in a {head.text}; blocks of the library are read in a program only")
    cursor.take()


def _owners(source: Source) -> dict[str, set[str]]:
    """The lists of global variables by the names that the program writes before them, each with its variables."""
    declared = {declaration.name.upper for declaration in source.declarations}
    lists: dict[str, Token] = {}
    shared = {one.name.upper for one in source.declarations if one.section == "VAR_GLOBAL"}
    for whole in source.statements:
        for before, first, dot, second in _fours(whole.tokens):
            is_list = first.kind == NAME and dot.text == "." and first.upper not in declared and before.text != "."
            if not is_list or second.upper not in shared:
                continue
            other = lists.setdefault(second.upper, first)
            if other.upper != first.upper:
                raise first.error(f"{second.text} stands in {other.text} in line {other.line} and in {first.text} here")
    owners: dict[str, set[str]] = {}
    for variable, first in lists.items():
        owners.setdefault(first.upper, set()).add(variable)
    return owners


def _fours(tokens: Sequence[Token]) -> Iterator[tuple[Token, ...]]:
    """Each token but the last two, between the one before and the two behind."""
    before = (tokens[0]._replace(kind=END, text=""), *tokens)
    return zip(before, tokens, tokens[1:], tokens[2:], strict=False)


def parse_body(text: str, line: int, source: Source) -> None:
    """Statements alone, which begin in this line of a file."""
    tokens, comments = tokens_of(text, line)
    source.comments += comments
    cursor = Cursor(tokens)
    while cursor.here.kind != END:
        source.statements += statement(cursor)


def unqualified(whole: Statement, owners: Mapping[str, set[str]]) -> Statement:
    """A statement without the names of lists before their variables, ``GVL.TIC_1``."""
    tokens, kept, at = whole.tokens, [], 0
    while at < len(tokens):
        behind = tokens[at + 2].upper if at + 2 < len(tokens) and tokens[at + 1].text == "." else ""
        is_member = at > 0 and tokens[at - 1].text == "."
        if not is_member and tokens[at].kind == NAME and behind in owners.get(tokens[at].upper, ()):
            at += 2
        kept.append(tokens[at])
        at += 1
    return Statement(tuple(kept))
