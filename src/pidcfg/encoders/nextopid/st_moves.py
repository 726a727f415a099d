"""Assignments of a program as moves of a configuration: which concern the blocks, and where they are executed.

Design. An assignment concerns the blocks when it writes an input of one, or a variable that a wire or such an
assignment reads. The others are left out, and named by line. A configuration copies before all blocks or behind all
of them; an assignment between two calls goes where nothing reads or writes what it writes or reads on the way, and is
refused where there is no such place.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, field
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.nextopid.st_conditions import Conditions, too_long
from pidcfg.encoders.nextopid.st_expression import wire_text
from pidcfg.encoders.nextopid.st_scope import SIGNAL_TYPES
from pidcfg.encoders.nextopid.st_wiring import LONGER, Wiring
from pidcfg.encoders.st.values import content_of
from pidcfg.schemas.expressions import MAX_LENGTH

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.nextopid.st_branches import Guarded
    from pidcfg.encoders.nextopid.st_calls import Calls
    from pidcfg.encoders.nextopid.st_conditions import Condition
    from pidcfg.encoders.nextopid.st_scope import Item, Scope
    from pidcfg.encoders.st.lex import Token
    from pidcfg.schemas.iec import IecType


class Target(NamedTuple):
    """What an assignment writes: its name, its type, and the block that it is an input of."""

    name: str
    type: IecType
    item: Item | None = None


class Read(NamedTuple):
    """A move as read: the entry of the listing, what it writes and reads, and the assignment."""

    entry: dict[str, Any]
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

    def read(self) -> list[dict[str, Any]]:
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
            content = wire_text(wiring.code, wiring.constants, wiring.names.__getitem__, MAX_LENGTH)
            if len(content) > MAX_LENGTH:
                raise guarded.value[0].error(LONGER)
        entry: dict[str, Any] = {"move": content, "to": target.name}
        if guarded.guards:
            entry["when"] = self._when(guarded, condition)
        return Read(entry, target, names, guarded)

    def _when(self, guarded: Guarded, condition: Condition) -> str:
        """The conditions of an assignment as text; those of one branch are written once."""
        if not condition.text:
            names = condition.names.__getitem__
            condition.text = wire_text(condition.code, condition.constants, names, MAX_LENGTH)
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

    def _placed(self) -> Iterator[dict[str, Any]]:
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
            for name in self.calls.reads_of(item):
                first, last = found.readers.get(name, (item.turn, item.turn))
                found.readers[name] = (min(first, item.turn), max(last, item.turn))
        for name, row in self.calls.assignments:
            if name in called:
                found.writers[f"{name}.{row}"] = called[name].turn
        return found


def _between(read: Read) -> ListingError:
    message = f"{read.target.name} is assigned between two calls, and what stands before and behind needs it there"
    return read.source.target[0].error(f"{message}; wire the expression itself")
