"""Structured Text to declarations and statements: words, then a tree."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NamedTuple

# --- Words ------------------------------------------------------------------------------------------------------------

NAME, NUMBER, TYPED, SIGN, END = "name", "number", "typed", "sign", "end"
WORD = re.compile(
    r"(?P<skip>\s+|//[^\n]*)"
    r"|(?P<comment>\(\*)"
    r"|(?P<typed>\w+\#[-+]?[\w.]+)"
    r"|(?P<number>\d[\d_]*(?:\.\d[\d_]*(?:[eE][-+]?\d+)?)?(?![\w]))"
    r"|(?P<name>[A-Za-z_]\w*(?:\.\d+)?)"
    r"|(?P<sign>:=|=>|<=|>=|<>|\*\*|[-+*/=<>(),;:.&])"
)
COMMENT = re.compile(r"\(\*|\*\)")
# fmt: off
KEYWORDS = frozenset((
    "PROGRAM", "END_PROGRAM", "FUNCTION_BLOCK", "END_FUNCTION_BLOCK", "VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT",
    "VAR_GLOBAL", "END_VAR", "CONSTANT", "RETAIN", "AT", "IF", "THEN", "ELSIF", "ELSE", "END_IF", "AND", "OR", "XOR",
    "NOT", "MOD", "TRUE", "FALSE", "CASE", "FOR", "WHILE", "REPEAT", "RETURN", "EXIT",
))
# fmt: on
"""Words that are no names of variables."""


class StError(Exception):
    """What the language does not have, or what a text may not do, with its line."""

    def __init__(self, message: str, line: int) -> None:
        super().__init__(f"line {line}: {message}")
        self.line = line


class Token(NamedTuple):
    """A word; `at` and `until` are its place in the text."""

    kind: str
    text: str
    line: int
    at: int
    until: int

    @property
    def upper(self) -> str:
        """In capitals: the language does not tell them from small letters."""
        return self.text.upper()


def tokens_of(text: str) -> list[Token]:
    """The words of a text without comments; the last one is the end."""
    tokens: list[Token] = []
    at, line = 0, 1
    while at < len(text):
        match = WORD.match(text, at)
        if match is None:
            raise StError(f"{text[at]!r} begins nothing", line)
        until = _comment_end(text, match.end(), line) if match.lastgroup == "comment" else match.end()
        if match.lastgroup not in {"skip", "comment"}:
            tokens.append(Token(str(match.lastgroup), match.group(), line, at, until))
        line += text.count("\n", at, until)
        at = until
    return [*tokens, Token(END, "the end", line, at, at)]


def _comment_end(text: str, at: int, line: int) -> int:
    """Where a comment ends; one may stand in another."""
    open_comments = 1
    for match in COMMENT.finditer(text, at):
        open_comments += 1 if match.group() == "(*" else -1
        if not open_comments:
            return match.end()
    raise StError("a comment without an end", line)


# --- The tree ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Literal:
    """A constant; ``type`` is empty for a number that takes the type of its place."""

    type: str
    text: str
    line: int


@dataclass(frozen=True)
class Path:
    """A variable, a member, or the word of an enumeration: names in capitals."""

    names: tuple[str, ...]
    line: int

    def __str__(self) -> str:
        return ".".join(self.names)


@dataclass(frozen=True)
class Operation:
    """An operator and its one or two operands."""

    sign: str
    operands: tuple[Expression, ...]
    line: int


@dataclass(frozen=True)
class Argument:
    """``name := value``, ``name => target`` (then ``output``), or a value alone (``name`` is empty)."""

    name: str
    value: Expression
    output: bool = False


@dataclass(frozen=True)
class Call:
    """A function in an expression, or a function or an instance as a statement."""

    name: str
    arguments: tuple[Argument, ...]
    line: int


Expression = Literal | Path | Operation | Call


@dataclass(frozen=True)
class Assignment:
    """``target := value``."""

    target: Path
    value: Expression
    line: int


@dataclass(frozen=True)
class Choice:
    """IF, ELSIF and ELSE; an ELSE is a branch without a condition."""

    branches: tuple[tuple[Expression | None, tuple[Statement, ...]], ...]
    line: int


Statement = Assignment | Call | Choice


@dataclass(frozen=True)
class Structure:
    """An initial value by member."""

    members: tuple[tuple[str, Initial], ...]
    line: int


Initial = Structure | Literal | Path | Operation | Call


@dataclass(frozen=True)
class Declaration:
    """A variable."""

    name: str
    type: str
    initial: Initial | None
    address: str
    section: str
    constant: bool
    line: int


@dataclass(frozen=True)
class Unit:
    """A program or a function block."""

    kind: str
    name: str
    variables: tuple[Declaration, ...]
    body: tuple[Statement, ...]


@dataclass(frozen=True)
class Source:
    """Everything in a text."""

    globals: tuple[Declaration, ...]
    units: tuple[Unit, ...]


# --- From words to the tree -------------------------------------------------------------------------------------------

LEVELS = (("OR",), ("XOR",), ("AND", "&"), ("=", "<>"), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/", "MOD"), ("**",))
"""Operators from those that bind least (IEC 61131-3, operators of the language ST)."""
SECTIONS = ("VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR_GLOBAL")


class Parser:
    """Reads the words of a text one by one."""

    def __init__(self, text: str) -> None:
        self.tokens = tokens_of(text)
        self.at = 0

    @property
    def here(self) -> Token:
        """The next word."""
        return self.tokens[self.at]

    def take(self) -> Token:
        """The next word, which is then read."""
        token = self.here
        self.at += 1
        return token

    def accept(self, *words: str) -> str:
        """The next word in capitals if it is one of these; else nothing is read."""
        if self.here.kind in {NAME, SIGN} and self.here.upper in words:
            return self.take().upper
        return ""

    def expect(self, *words: str) -> str:
        """The next word, which must be one of these."""
        found = self.accept(*words)
        if not found:
            raise StError(f"{self.here.text} stands where {' or '.join(words)} must stand", self.here.line)
        return found

    def name(self) -> str:
        """A name in capitals."""
        token = self.take()
        if token.kind != NAME or token.upper in KEYWORDS:
            raise StError(f"{token.text} stands where a name must stand", token.line)
        return token.upper

    # --- declarations ------------------------------------------------------------------------------------------------

    def source(self) -> Source:
        """The whole text."""
        variables: list[Declaration] = []
        units: list[Unit] = []
        while self.here.kind != END:
            if self.here.upper == "VAR_GLOBAL":
                variables += self.section()
                continue
            kind = self.expect("PROGRAM", "FUNCTION_BLOCK")
            name, inner = self.name(), list[Declaration]()
            while self.here.upper in SECTIONS:
                inner += self.section()
            units.append(Unit(kind, name, tuple(inner), self.statements(f"END_{kind}")))
            self.expect(f"END_{kind}")
        return Source(tuple(variables), tuple(units))

    def section(self) -> list[Declaration]:
        """``VAR … END_VAR``."""
        section = self.expect(*SECTIONS)
        constant = False
        while word := self.accept("CONSTANT", "RETAIN"):
            constant |= word == "CONSTANT"
        found = []
        while not self.accept("END_VAR"):
            line, names = self.here.line, [self.name()]
            while self.accept(","):
                names.append(self.name())
            address = self.name() if self.accept("AT") else ""
            self.expect(":")
            kind = self.name()
            initial = self.initial() if self.accept(":=") else None
            self.expect(";")
            found += [Declaration(name, kind, initial, address, section, constant, line) for name in names]
        return found

    def initial(self) -> Initial:
        """An initial value: an expression, or members in parentheses."""
        ahead = self.tokens[self.at : self.at + 3]
        if ahead[0].text != "(" or ahead[1].kind != NAME or ahead[2].text != ":=":
            return self.expression()
        line, members = self.take().line, []
        while True:
            name = self.name()
            self.expect(":=")
            members.append((name, self.initial()))
            if self.expect(",", ")") == ")":
                return Structure(tuple(members), line)

    # --- statements --------------------------------------------------------------------------------------------------

    def statements(self, *ends: str) -> tuple[Statement, ...]:
        """Up to one of these words."""
        found = []
        while self.here.kind != END and self.here.upper not in ends:
            if not self.accept(";"):
                found.append(self.statement())
        return tuple(found)

    def statement(self) -> Statement:
        """One with its semicolon."""
        line = self.here.line
        if self.accept("IF"):
            found: Statement = self.choice(line)
        else:
            path = self.path()
            found = Assignment(path, self.expression(), line) if self.accept(":=") else self.call(path)
        self.expect(";")
        return found

    def choice(self, line: int) -> Choice:
        """Behind IF, up to END_IF."""
        branches: list[tuple[Expression | None, tuple[Statement, ...]]] = []
        word = "IF"
        while word != "END_IF":
            condition = None if word == "ELSE" else self.expression()
            if condition is not None:
                self.expect("THEN")
            follow = ("END_IF",) if word == "ELSE" else ("ELSIF", "ELSE", "END_IF")
            branches.append((condition, self.statements(*follow)))
            word = self.expect(*follow)
        return Choice(tuple(branches), line)

    # --- expressions -------------------------------------------------------------------------------------------------

    def expression(self, level: int = 0) -> Expression:
        """Operators of the same level are taken from left to right."""
        if level == len(LEVELS):
            return self.signed()
        found = self.expression(level + 1)
        line = self.here.line
        while sign := self.accept(*LEVELS[level]):
            sign = "AND" if sign == "&" else sign
            found = Operation(sign, (found, self.expression(level + 1)), line)
        return found

    def signed(self) -> Expression:
        """A sign or NOT binds more than every operator with two operands."""
        line = self.here.line
        if self.accept("+"):
            return self.signed()
        if sign := self.accept("-", "NOT"):
            return Operation("NEGATE" if sign == "-" else sign, (self.signed(),), line)
        if self.accept("("):
            found = self.expression()
            self.expect(")")
            return found
        token = self.here
        if token.kind == NAME and token.upper not in KEYWORDS:
            path = self.path()
            return self.call(path) if self.here.text == "(" else path
        return self.literal()

    def literal(self) -> Literal:
        """A number with or without a type, or a truth."""
        token = self.take()
        if token.upper in {"TRUE", "FALSE"}:
            return Literal("BOOL", token.upper, token.line)
        if token.kind == NUMBER:
            return Literal("", token.text.replace("_", ""), token.line)
        if token.kind == TYPED:
            kind, _, text = token.upper.partition("#")
            return Literal("TIME" if kind == "T" else kind, text.replace("_", ""), token.line)
        raise StError(f"{token.text} stands where a value must stand", token.line)

    def path(self) -> Path:
        """Names with points between them."""
        line, names = self.here.line, [self.name()]
        while self.accept("."):
            names.append(self.name())
        return Path(tuple(names), line)

    def call(self, path: Path) -> Call:
        """The arguments of what has this name."""
        self.expect("(")
        arguments: list[Argument] = []
        while not self.accept(")"):
            if arguments:
                self.expect(",")
            arguments.append(self.argument())
        return Call(str(path), tuple(arguments), path.line)

    def argument(self) -> Argument:
        """By name, or by position."""
        sign = self.tokens[self.at + 1].text
        if self.here.kind != NAME or sign not in {":=", "=>"}:
            return Argument("", self.expression())
        name = self.name()
        self.take()
        return Argument(name, self.path() if sign == "=>" else self.expression(), sign == "=>")


def parse(text: str) -> Source:
    """The tree of a text; raises `StError`."""
    return Parser(text).source()
