"""The conditions of an assignment in Structured Text as one expression of a configuration."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.nextopid.st_branches import MOST_GUARDS
from pidcfg.encoders.nextopid.st_wiring import Wiring
from pidcfg.schemas.expressions import AND, AT_LEAST, AT_MOST, CONSTANT, EQUAL, MAX_LENGTH, NEGATE, NOT, OR, SIGNAL
from pidcfg.schemas.iec import BOOL, REAL

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.encoders.nextopid.st_branches import Guard, Guarded, Label
    from pidcfg.encoders.st.lex import Token
    from pidcfg.schemas.iec import IecType


@dataclass
class Condition:
    """The conditions of an assignment as one: code, constants and names."""

    code: list[int] = field(default_factory=list)
    constants: list[float] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    text: str = ""
    """As a configuration has it, once it was written."""

    @cached_property
    def reads(self) -> frozenset[str]:
        """The names, each once."""
        return frozenset(self.names)

    def add(self, part: Wiring | Condition) -> None:
        """The code of a part, behind what is there."""
        for op, operand in zip(part.code[::2], part.code[1::2], strict=True):
            moved = len(self.constants) if op == CONSTANT else len(self.names) if op == SIGNAL else 0
            self.code += (op, operand + moved)
        self.constants += part.constants
        self.names += part.names

    def number(self, value: float) -> None:
        """A constant; a negative one with its sign behind."""
        self.code += (CONSTANT, len(self.constants))
        self.constants.append(abs(value))
        if value < 0:
            self.emit(NEGATE)

    def emit(self, op: int) -> None:
        """An operator."""
        self.code += (op, 0)


@dataclass(slots=True)
class Conditions:
    """The conditions of assignments, each guard and each row of guards read once."""

    resolve: Callable[[tuple[Token, ...]], tuple[str, IecType]]
    guards: dict[Guard, Condition | ListingError] = field(default_factory=dict)
    """Or what is wrong with one."""
    rows: dict[int, Condition] = field(default_factory=dict)
    """By the identity of the row: the assignments of a branch share it."""

    def of(self, guarded: Guarded) -> Condition:
        """All conditions of an assignment, joined by AND; raises `ListingError` where they are too long."""
        if len(guarded.guards) > MOST_GUARDS:
            raise too_long(guarded)
        whole = self.rows.get(id(guarded.guards))
        if whole is None:
            whole = Condition()
            for i, guard in enumerate(guarded.guards):
                whole.add(self.of_guard(guard))
                if i:
                    whole.emit(AND)
                if len(whole.code) > 2 * MAX_LENGTH:  # each pair of it is a character at least
                    raise too_long(guarded)
            self.rows[id(guarded.guards)] = whole
        return whole

    def of_guard(self, guard: Guard) -> Condition:
        """One condition, or its beginning where it is too long."""
        if guard not in self.guards:
            try:
                self.guards[guard] = self._read(guard)
            except ListingError as error:
                self.guards[guard] = error
        found = self.guards[guard]
        if isinstance(found, ListingError):
            raise found
        return found

    def _read(self, guard: Guard) -> Condition:
        part = Condition()
        if not guard.labels:
            part.add(Wiring.read(guard.tokens, BOOL, self.resolve))
        for j, label in enumerate(guard.labels):
            _compare(part, guard.tokens, label, self.resolve)
            if j:
                part.emit(OR)
            if len(part.code) > 2 * MAX_LENGTH:
                return part
        if guard.inverted and part.code[-2] == NOT:
            del part.code[-2:]
        elif guard.inverted:
            part.emit(NOT)
        return part


def too_long(guarded: Guarded) -> ListingError:
    """Of conditions that are no expression of a configuration."""
    together = f"with those of the branches before, the condition of this is longer than {MAX_LENGTH} characters"
    return guarded.target[0].error(f"{together}: assign a BOOL before, and ask for that")


def _compare(
    whole: Condition,
    tokens: tuple[Token, ...],
    label: Label,
    resolve: Callable[[tuple[Token, ...]], tuple[str, IecType]],
) -> None:
    whole.add(Wiring.read(tokens, REAL, resolve))
    whole.number(label.low)
    if label.high is None:
        whole.emit(EQUAL)
        return
    whole.emit(AT_LEAST)
    whole.add(Wiring.read(tokens, REAL, resolve))
    whole.number(label.high)
    whole.emit(AT_MOST)
    whole.emit(AND)
