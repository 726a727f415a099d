"""Structured Text to declarations and statements; what they mean is found by the reader of each vendor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.st.lex import END, NAME, NUMBER, TYPED, Token

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

VARIABLES = frozenset(
    ("VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR_GLOBAL", "VAR_TEMP", "VAR_EXTERNAL", "VAR_STAT", "VAR_CONFIG")
)
QUALIFIERS = frozenset(("CONSTANT", "RETAIN", "NON_RETAIN", "PERSISTENT"))
ENDS = {"IF": "END_IF", "CASE": "END_CASE", "FOR": "END_FOR", "WHILE": "END_WHILE", "REPEAT": "END_REPEAT"}
"""Statements that have others inside."""
DEEPEST = 8
"""Structures in each other."""
MOST_NESTED = 32
"""Statements in each other."""

Initial = tuple[Token, ...] | dict[str, "Member"]
"""The tokens of a literal, or the members of a structure by name."""


class Member(NamedTuple):
    """A member of an initial value."""

    name: Token
    value: Initial


class Declaration(NamedTuple):
    """A variable: its name, its type, its initial value, and the comment behind it."""

    name: Token
    type: tuple[Token, ...]
    initial: Initial | None = None
    note: str = ""
    section: str = "VAR"
    """The word that its block begins with, in capitals."""
    address: tuple[Token, ...] = ()
    """What stands behind AT."""

    @property
    def type_name(self) -> str:
        """The type in capitals, if it is one word."""
        return self.type[0].upper if len(self.type) == 1 else ""


class Statement(NamedTuple):
    """A statement without its semicolon, and the end as its last token."""

    tokens: tuple[Token, ...]

    @property
    def first(self) -> Token:
        """Where it begins."""
        return self.tokens[0]


@dataclass(slots=True)
class Cursor:
    """Tokens, and where reading has come to."""

    tokens: Sequence[Token]
    at: int = 0

    @property
    def here(self) -> Token:
        """The token that comes next."""
        return self.tokens[min(self.at, len(self.tokens) - 1)]

    def take(self) -> Token:
        """The token that comes next, which is then behind."""
        token = self.here
        self.at += 1
        return token

    def expect(self, sign: str, after: str) -> Token:
        """A sign or word that must come next."""
        token = self.take()
        if token.upper != sign or token.kind == END:
            raise token.error(f"{sign!r} is missing after {after}, before {token.text!r}")
        return token

    def until(self, stops: frozenset[str]) -> tuple[Token, ...]:
        """The tokens up to one of these outside of all parentheses."""
        start, depth = self.at, 0
        while self.here.kind != END and not (depth == 0 and self.here.upper in stops):
            depth += (self.here.text in "([") - (self.here.text in ")]") if len(self.here.text) == 1 else 0
            if depth < 0 or self.here.text == ";":
                raise self.here.error(f"unexpected {self.here.text!r}")
            self.at += 1
        return tuple(self.tokens[start : self.at])


SEMICOLON = frozenset(";")


def name_of(cursor: Cursor, after: str) -> Token:
    """A name that must come next."""
    token = cursor.take()
    if token.kind != NAME:
        raise token.error(f"a name is missing after {after}, before {token.text!r}")
    return token


# --- declarations ----------------------------------------------------------------------------------------------------


def declarations(cursor: Cursor) -> Iterator[Declaration]:
    """A block of variables, from VAR to END_VAR."""
    head = cursor.take()
    while cursor.here.upper in QUALIFIERS:
        cursor.take()
    while cursor.here.upper != "END_VAR":
        if cursor.here.kind == END:
            raise head.error(f"{head.text} has no END_VAR")
        names = [name_of(cursor, "the declarations before")]
        while cursor.here.text == ",":
            cursor.take()
            names.append(name_of(cursor, "the comma"))
        address = cursor.until(frozenset((":", ";")))[1:] if cursor.here.upper == "AT" else ()
        cursor.expect(":", names[-1].text)
        kind = cursor.until(frozenset((":=", ";", "END_VAR")))
        initial = None
        if cursor.here.text == ":=":
            cursor.take()
            initial = initial_value(cursor.until(frozenset((";", "END_VAR"))))
        end = cursor.expect(";", "the declaration")
        for name in names:
            yield Declaration(name, kind, initial, end.note, head.upper, address)
    cursor.take()


def initial_value(tokens: tuple[Token, ...], depth: int = 0) -> Initial:
    """An initial value: a structure, ``(SP := 50.0)``, or anything else as it stands."""
    if len(tokens) < 4 or tokens[0].text != "(" or tokens[2].text != ":=":
        return tokens
    if depth > DEEPEST:
        raise tokens[0].error("structures are nested too deeply")
    if tokens[-1].text != ")":
        raise tokens[-1].error(f"{tokens[-1].text!r} stands behind the structure")
    cursor = Cursor((*tokens[1:-1], tokens[-1]._replace(kind=END)))
    members: dict[str, Member] = {}
    while True:
        name = name_of(cursor, "the parenthesis or comma")
        cursor.expect(":=", name.text)
        value = cursor.until(frozenset(","))
        if name.upper in members:
            raise name.error(f"{name.text} stands here again")
        members[name.upper] = Member(name, initial_value(value, depth + 1))
        if cursor.here.kind == END:
            return members
        cursor.expect(",", "the member")


# --- statements ------------------------------------------------------------------------------------------------------


def statement(cursor: Cursor) -> Iterator[Statement]:
    """The next statement; one that is empty is none."""
    start = cursor.at
    if cursor.here.upper in ENDS and cursor.here.kind == NAME:
        _skip_inner(cursor)
        end = cursor.at
        if cursor.here.text == ";":
            cursor.take()
    else:
        cursor.until(SEMICOLON)
        end = cursor.at
        if cursor.here.kind == END:
            raise cursor.tokens[start].error("the statement that begins here has no end: ';' or ')' is missing")
        cursor.take()
    if end > start:
        last = cursor.tokens[end - 1]
        yield Statement((*cursor.tokens[start:end], Token(END, "the end of the statement", last.line, last.column)))


def _skip_inner(cursor: Cursor) -> None:
    """Moves behind a statement with others inside."""
    waiting: list[Token] = []
    while True:
        token = cursor.take()
        if token.kind == END:
            raise waiting[-1].error(f"{waiting[-1].text} has no {ENDS[waiting[-1].upper]}")
        if token.kind == NAME and token.upper in ENDS:
            waiting.append(token)
            if len(waiting) > MOST_NESTED:
                raise token.error(f"more than {MOST_NESTED} statements stand in each other")
        elif token.kind == NAME and token.upper == ENDS[waiting[-1].upper]:
            waiting.pop()
            if not waiting:
                return


class Argument(NamedTuple):
    """An argument of a call: the parameter, ``:=`` or ``=>``, and what stands behind it."""

    name: Token
    sign: str
    value: tuple[Token, ...]


def chain(tokens: Sequence[Token], at: int = 0) -> tuple[Token, ...]:
    """A name with the dots and names behind it, ``TIC_1.ErrBits.Kp``, without the dots."""
    parts: list[Token] = []
    while tokens[at].kind == NAME:
        parts.append(tokens[at])
        if tokens[at + 1].text != "." or tokens[at + 2].kind != NAME:
            break
        at += 2
    return tuple(parts)


def arguments(tokens: Sequence[Token], callee: str) -> list[Argument]:
    """The arguments of a call from its opening parenthesis to the end of the statement; each has a name."""
    cursor = Cursor((*tokens, Token(END, "the end of the statement", tokens[-1].line, tokens[-1].column)))
    cursor.expect("(", callee)
    listed: dict[str, Argument] = {}
    while cursor.here.text != ")":
        name = cursor.take()
        sign = cursor.take()
        if name.kind != NAME or sign.text not in {":=", "=>"}:
            raise name.error(f"an argument of {callee} has no name; write it as in PV := FT_101")
        value = cursor.until(frozenset((",", ")")))
        if not value:
            raise sign.error(f"nothing stands behind {name.text} {sign.text}")
        if name.upper in listed:
            raise name.error(f"{name.text} stands here again")
        listed[name.upper] = Argument(name, sign.text, value)
        if cursor.here.text != ")":
            cursor.expect(",", f"the argument {name.text}")
    cursor.take()
    if cursor.here.kind != END:
        raise cursor.here.error(f"{cursor.here.text!r} stands behind the call of {callee}")
    return [*listed.values()]


def is_literal(token: Token) -> bool:
    """Whether a token is a number, or a literal with a prefix."""
    return token.kind in {NUMBER, TYPED}
