"""Assignments of a program as moves of a configuration, each with the conditions under which it is executed."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.nextopid.st_calls import MOST_GUARDS, Calls, Guard, Guarded, Label
from pidcfg.encoders.nextopid.st_scope import LONGER, SIGNAL_TYPES, Item, Scope, Wiring
from pidcfg.encoders.nextopid.st_write import wire_text
from pidcfg.encoders.structured_text import Token, content_of
from pidcfg.schemas.expressions import AND, AT_LEAST, AT_MOST, CONSTANT, EQUAL, MAX_LENGTH, NEGATE, NOT, OR, SIGNAL
from pidcfg.schemas.iec import BOOL, REAL, IecType
from pidcfg.text.paths import Data

# --- The conditions of an assignment in Structured Text as one expression of a configuration --------------------------


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


# --- Assignments of a program as moves of a configuration: which concern the blocks, and where they are executed ------
#
# Design. An assignment concerns the blocks when it writes an input of one, or a variable that a wire or such an
# assignment reads. The others are left out, and named by line. A configuration copies before all blocks or behind all
# of them; an assignment between two calls goes where nothing reads or writes what it writes or reads on the way, and
# is refused where there is no such place.


class Target(NamedTuple):
    """What an assignment writes: its name, its type, and the block that it is an input of."""

    name: str
    type: IecType
    item: Item | None = None


class Read(NamedTuple):
    """A move as read: the entry of the listing, what it writes and reads, and the assignment."""

    entry: Data
    target: Target
    reads: frozenset[str]
    source: Guarded


@dataclass(slots=True)
class Needed:
    """The calls that need a value, by its name."""

    writers: dict[str, int] = field(default_factory=dict)
    """The call that makes it."""
    readers: dict[str, tuple[int, int]] = field(default_factory=dict)
    """The first and the last call that reads it."""


@dataclass(slots=True)
class Moves:
    """The assignments of a program that are moves."""

    scope: Scope
    calls: Calls
    everything: bool
    """Whether all that can be read is a move: the comments say that the program was written from a configuration."""
    found: list[Read] = field(default_factory=list)
    conditions: Conditions = field(init=False)

    def __post_init__(self) -> None:
        self.conditions = Conditions(self.scope.resolve)

    def read(self) -> list[Data]:
        """The entries of the listing, in the order of execution."""
        waiting = self._read_concerned()
        if self.everything:
            waiting = [guarded for guarded in waiting if not self._try(guarded)]
        for guarded in waiting:
            self.calls.pass_over(guarded)
        self.found.sort(key=lambda read: read.source.number)
        by_target: dict[str, list[Read]] = {}
        for read in self.found:
            by_target.setdefault(read.target.name, []).append(read)
        for read in self.found:
            self._check_conditions(read, by_target)
        return list(self._placed())

    def _read_concerned(self) -> list[Guarded]:
        """Reads what concerns the blocks, from their inputs back; what is left does not concern them."""
        waiting: dict[str, list[tuple[int, Guarded]]] = {}
        for place, guarded in enumerate(self.calls.branches.found):
            waiting.setdefault(guarded.target[0].upper, []).append((place, guarded))
        names = [name for name in waiting if self.scope.instance(name) is not None or name in self.scope.used]
        while names:
            concerned = sorted((one for name in names for one in waiting.pop(name)), key=itemgetter(0))
            reads = [self._read(guarded) for _, guarded in concerned]
            self.found += reads
            names = [*dict.fromkeys(name.upper() for read in reads for name in read.reads if name.upper() in waiting)]
        return [guarded for _, guarded in sorted((one for row in waiting.values() for one in row), key=itemgetter(0))]

    def _try(self, guarded: Guarded) -> bool:
        try:
            self.found.append(self._read(guarded))
        except ListingError:
            return False
        return True

    # --- reading -----------------------------------------------------------------------------------------------------

    def _target(self, parts: tuple[Token, ...]) -> Target:
        item = self.scope.instance(parts[0].upper)
        if item is not None:
            row = self.scope.row(item, parts[1:], "input") if len(parts) > 1 else None
            if row is None:
                raise parts[0].error(f"{item.name} is assigned as a whole")
            return Target(f"{item.name}.{row.name}", row.type, item)
        declared = self.scope.variables.get(parts[0].upper)
        kind = None if declared is None or len(parts) > 1 else SIGNAL_TYPES.get(declared.type_name)
        if declared is None or kind is None or kind.kind == "time":
            raise parts[0].error(f"{parts[0].text} is assigned here, and is no BOOL, REAL or INT")
        self.scope.used.add(declared.name.upper)
        return Target(declared.name.text, kind)

    def _read(self, guarded: Guarded) -> Read:
        target = self._target(guarded.target)
        condition = self.conditions.of(guarded)
        content = content_of(guarded.value, target.type, target.name)
        names = condition.reads
        if content is None:
            wiring = Wiring.read(guarded.value, target.type, self.scope.resolve)
            names |= {*wiring.names}
            content = wire_text(wiring.code, wiring.constants, wiring.names.__getitem__)
            if len(content) > MAX_LENGTH:
                raise guarded.value[0].error(LONGER)
        entry: Data = {"move": content, "to": target.name}
        if guarded.guards:
            entry["when"] = self._when(guarded, condition)
        return Read(entry, target, names, guarded)

    def _when(self, guarded: Guarded, condition: Condition) -> str:
        """The conditions of an assignment as text; those of one branch are written once."""
        if not condition.text:
            names = condition.names.__getitem__
            condition.text = wire_text(condition.code, condition.constants, names)
        if len(condition.text) > MAX_LENGTH:
            raise too_long(guarded)
        return condition.text

    def _check_conditions(self, read: Read, by_target: Mapping[str, Sequence[Read]]) -> None:
        """Refuses what changes a condition that has been looked at, and is executed once more."""
        for guard in read.source.guards:
            changes = []
            for name in {*self.conditions.of_guard(guard).names}:
                others = by_target.get(name, ())
                at = bisect_left(others, float(guard.opened), key=lambda other: other.source.number)
                changes += [other for other in others[at : at + 1] if other.source.number < read.source.number]
            if changes:
                first = min(changes, key=lambda other: other.source.number)
                message = (
                    f"{first.target.name} is assigned inside the statement whose condition reads it, before line "
                    f"{read.source.line}: assign it last"
                )
                raise first.source.target[0].error(message)

    # --- order -------------------------------------------------------------------------------------------------------

    def _placed(self) -> Iterator[dict[str, object]]:
        needed = self._needed()
        at_start = [self._at_start(read, needed) for read in self.found]
        written, touched = set[str](), set[str]()  # by those before that are executed at the end
        for _, beside in groupby(zip(self.found, at_start, strict=True), lambda one: one[0].source.number):
            same = [*beside]
            for read, first in same:
                if first and (read.target.name in touched or read.reads & written):
                    raise _between(read)
            for read, first in same:
                if not first:
                    written.add(read.target.name)
                    touched |= {read.target.name, *read.reads}
        yield from (read.entry | {"at": "start"} for read, first in zip(self.found, at_start, strict=True) if first)
        yield from (read.entry for read, first in zip(self.found, at_start, strict=True) if not first)

    def _at_start(self, read: Read, needed: Needed) -> bool:
        total, turn = self.calls.turns, read.source.turn
        if turn == total and turn:
            return False
        calls = [read.target.item.turn] if read.target.item is not None and read.target.item.called else []
        calls += needed.readers.get(read.target.name, ())
        calls += (needed.writers[name] for name in read.reads if name in needed.writers)
        if all(call >= turn for call in calls):
            return True
        if any(call >= turn for call in calls):
            raise _between(read)
        return False

    def _needed(self) -> Needed:
        """What calls read and write; it makes a difference on which side of them it is assigned or read."""
        found = Needed()
        called = {item.name: item for item in self.scope.items.values() if item.called}
        for item in called.values():
            found.writers |= {f"{item.name}.{row.name}": item.turn for row in item.kind.outputs}
            for name in self.calls.reads.get(item.name, ()):
                first, last = found.readers.get(name, (item.turn, item.turn))
                found.readers[name] = (min(first, item.turn), max(last, item.turn))
        for name, row in self.calls.assignments:
            if name in called:
                found.writers[f"{name}.{row}"] = called[name].turn
        return found


def _between(read: Read) -> ListingError:
    message = f"{read.target.name} is assigned between two calls, and what stands before and behind needs it there"
    return read.source.target[0].error(f"{message}; wire the expression itself")
