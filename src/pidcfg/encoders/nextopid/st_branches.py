"""IF and CASE of Structured Text as assignments, each with the conditions under which it is executed.

Design. `assignments` walks a statement and gives its assignments in their order, each `Guarded` by the conditions of
all branches around it. Whoever reads them takes every condition where its assignment stands, and not where IF does;
so each `Guard` knows what was assigned before it was looked at, and `pidcfg.encoders.nextopid.st_moves` finds
a change in between.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.st.lex import END, NAME, Token
from pidcfg.encoders.st.parse import Cursor, chain, is_literal, statement
from pidcfg.encoders.st.values import number_of
from pidcfg.schemas.expressions import MAX_LENGTH

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

BRANCHES = frozenset(("IF", "CASE"))
LATCHES = {"S": "TRUE", "R": "FALSE"}
"""What ``x S= y`` and ``x R= y`` make of x when y is TRUE."""
THEN, OF = frozenset(("THEN",)), frozenset(("OF",))
MOST_GUARDS = MAX_LENGTH // len("a AND ") + 1
"""Conditions of an assignment; more are no expression, however short each of them is."""


class Label(NamedTuple):
    """A value of CASE, or a range of them."""

    low: float
    high: float | None = None

    @property
    def last(self) -> float:
        """The highest value."""
        return self.low if self.high is None else self.high


@dataclass(slots=True)
class Labels:
    """The values that branches of a CASE have, as ranges in ascending order that do not meet."""

    lows: list[float] = field(default_factory=list)
    highs: list[float] = field(default_factory=list)

    def hold(self, label: Label) -> bool:
        """Whether a value of a label is there; a range that does not ascend has none."""
        return label.low <= label.last and self._first(label) < self._behind(label)

    def add(self, label: Label) -> None:
        """Adds the values of a label."""
        if label.low > label.last:
            return
        first, behind = self._first(label), self._behind(label)
        self.lows[first:behind] = [min([label.low, *self.lows[first:behind]])]
        self.highs[first:behind] = [max([label.last, *self.highs[first:behind]])]

    def _first(self, label: Label) -> int:
        return bisect_left(self.highs, label.low)

    def _behind(self, label: Label) -> int:
        return bisect_right(self.lows, label.last)


@dataclass(frozen=True, slots=True, eq=False)
class Guard:
    """A condition that must hold, or must not: of IF, or that a number has one of some values."""

    tokens: tuple[Token, ...]
    opened: int
    """Of how many assignments it was looked at behind."""
    labels: tuple[Label, ...] = ()
    inverted: bool = False

    def inverse(self) -> Guard:
        """The condition of the branches behind."""
        return Guard(self.tokens, self.opened, self.labels, not self.inverted)


class Guarded(NamedTuple):
    """An assignment: what to, what, under which conditions, its number among all, and the calls before it."""

    target: tuple[Token, ...]
    value: tuple[Token, ...]
    guards: tuple[Guard, ...]
    number: float
    turn: int

    @property
    def line(self) -> int:
        """Where it stands."""
        return self.target[0].line


@dataclass(slots=True)
class Branches:
    """Walks statements; what is no assignment is handed to ``other``."""

    turn: Callable[[], int]
    other: Callable[[tuple[Token, ...]], None]
    found: list[Guarded] = field(default_factory=list)

    def take(self, tokens: tuple[Token, ...], guards: tuple[Guard, ...] = ()) -> None:
        """A statement, which ends with the end as its last token."""
        word = tokens[0].upper if tokens[0].kind == NAME else ""
        if word in BRANCHES:
            cursor = Cursor(tokens)
            cursor.take()
            (self._if if word == "IF" else self._case)(cursor, guards)
            return
        parts = chain(tokens)
        behind = tokens[2 * len(parts) - 1 :] if parts else tokens
        if parts and behind[0].text == ":=" and len(behind) > 2:
            self._assign(parts, tuple(behind[1:-1]), guards)
        elif is_latch(behind):
            truth = behind[0]._replace(text=LATCHES[behind[0].upper])
            self._assign(parts, (truth,), (*guards, Guard(tuple(behind[2:-1]), len(self.found))))
        else:
            self.other(tokens)

    def _assign(self, target: tuple[Token, ...], value: tuple[Token, ...], guards: tuple[Guard, ...]) -> None:
        self.found.append(Guarded(target, value, guards, len(self.found), self.turn()))

    def _if(self, cursor: Cursor, guards: tuple[Guard, ...]) -> None:
        opened, before = len(self.found), guards
        while True:
            guard = Guard(_wanted(cursor, THEN, "IF"), opened)
            self._body(cursor, (*before, guard), ("ELSIF", "ELSE", "END_IF"))
            before = (*before, guard.inverse())[: MOST_GUARDS + 1]
            if cursor.take().upper != "ELSIF":
                break
        if cursor.tokens[cursor.at - 1].upper == "ELSE":
            self._body(cursor, before, ("END_IF",))

    def _case(self, cursor: Cursor, guards: tuple[Guard, ...]) -> None:
        opened, taken = len(self.found), Labels()
        cases: list[Guard] = []
        selector = _wanted(cursor, OF, "CASE")
        while cursor.here.upper not in {"ELSE", "END_CASE"}:
            here = cursor.here
            guard = Guard(selector, opened, tuple(_labels(cursor)))
            if any(map(taken.hold, guard.labels)):
                raise here.error("this value stands in the CASE again")
            for label in guard.labels:
                taken.add(label)
            cases.append(guard)
            self._body(cursor, (*guards, guard), ("ELSE", "END_CASE"))
        if cursor.take().upper == "ELSE":
            others = (*guards, *(case.inverse() for case in cases[: MOST_GUARDS + 1]))
            self._body(cursor, others, ("END_CASE",))

    def _body(self, cursor: Cursor, guards: tuple[Guard, ...], ends: tuple[str, ...]) -> None:
        """The statements of a branch, up to the next one."""
        while cursor.here.upper not in ends and not _begins_label(cursor):
            if cursor.here.kind == END:
                raise cursor.here.error(f"{ends[-1]} is missing")
            for inner in statement(cursor):
                self.take(inner.tokens, guards)


def is_latch(behind: Sequence[Token]) -> bool:
    """Whether what stands behind a name is ``S=`` or ``R=`` with a condition (CODESYS)."""
    return behind[0].kind == NAME and behind[0].upper in LATCHES and behind[1].text == "=" and len(behind) > 3


def _wanted(cursor: Cursor, word: frozenset[str], after: str) -> tuple[Token, ...]:
    """The tokens up to a word, which must come."""
    tokens = cursor.until(word)
    (name,) = word
    cursor.expect(name, f"the condition of {after}")
    if not tokens:
        raise cursor.here.error(f"a condition is missing after {after}")
    return tokens


def _begins_label(cursor: Cursor) -> bool:
    """Whether a value of CASE stands here: a number, with or without a sign."""
    sign = cursor.here.text == "-"
    return is_literal(cursor.tokens[min(cursor.at + sign, len(cursor.tokens) - 1)])


def _labels(cursor: Cursor) -> Iterator[Label]:
    """The values before a colon."""
    while True:
        low = _label(cursor)
        if cursor.here.text == "..":
            cursor.take()
            yield Label(low, _label(cursor))
        else:
            yield Label(low)
        if cursor.here.text != ",":
            cursor.expect(":", "the value of CASE")
            return
        cursor.take()


def _label(cursor: Cursor) -> float:
    negative = cursor.here.text == "-"
    if negative:
        cursor.take()
    token = cursor.take()
    if not is_literal(token):
        raise token.error(f"{token.text}: only numbers are read as values of CASE")
    value = float(number_of(token))
    return -value if negative else value
