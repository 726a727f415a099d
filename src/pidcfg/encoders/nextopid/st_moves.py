"""Assignments of a program as moves of a configuration: which concern the blocks, and where they are executed.

Design. An assignment concerns the blocks when it writes an input of one, or a variable that a wire or such an
assignment reads. The others are left out, and named by line. A configuration copies before all blocks or behind all
of them; an assignment between two calls goes where nothing reads or writes what it writes or reads on the way, and is
refused where there is no such place.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.nextopid.st_branches import condition_of
from pidcfg.encoders.nextopid.st_expression import wire_text
from pidcfg.encoders.nextopid.st_scope import SIGNAL_TYPES
from pidcfg.encoders.nextopid.st_wiring import Wiring
from pidcfg.encoders.st.values import content_of
from pidcfg.schemas.expressions import MAX_LENGTH

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.encoders.nextopid.st_branches import Guarded
    from pidcfg.encoders.nextopid.st_calls import Calls
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
class Moves:
    """The assignments of a program that are moves."""

    scope: Scope
    calls: Calls
    everything: bool
    """Whether all that can be read is a move: the comments say that the program was written from a configuration."""
    found: list[Read] = field(default_factory=list)

    def read(self) -> list[dict[str, Any]]:
        """The entries of the listing, in the order of execution."""
        waiting = [*self.calls.branches.found]
        while True:
            concerned = [guarded for guarded in waiting if self._concerns(guarded)]
            if not concerned:
                break
            waiting = [guarded for guarded in waiting if guarded not in concerned]
            self.found += (self._read(guarded) for guarded in concerned)
        if self.everything:
            waiting = [guarded for guarded in waiting if not self._try(guarded)]
        for guarded in waiting:
            self.calls.pass_over(guarded)
        self.found.sort(key=lambda read: read.source.number)
        for read in self.found:
            self._check_conditions(read)
        return list(self._placed())

    def _concerns(self, guarded: Guarded) -> bool:
        first = guarded.target[0]
        return self.scope.instance(first.upper) is not None or first.upper in self.scope.used

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
        condition = condition_of(guarded.guards, self.scope.resolve)
        content = content_of(guarded.value, target.type, target.name)
        names = {*condition.names}
        if content is None:
            wiring = Wiring.read(guarded.value, target.type, self.scope.resolve)
            names |= {*wiring.names}
            content = wire_text(wiring.code, wiring.constants, wiring.names.__getitem__, MAX_LENGTH)
        entry: dict[str, Any] = {"move": content, "to": target.name}
        if guarded.guards:
            entry["when"] = wire_text(condition.code, condition.constants, condition.names.__getitem__, MAX_LENGTH)
        return Read(entry, target, frozenset(names), guarded)

    def _check_conditions(self, read: Read) -> None:
        """Refuses what changes a condition that has been looked at, and is executed once more."""
        for guard in read.source.guards:
            names = {*condition_of((guard,), self.scope.resolve).names}
            for other in self.found:
                if guard.opened <= other.source.number < read.source.number and other.target.name in names:
                    message = (
                        f"{other.target.name} is assigned inside the statement whose condition reads it, before line "
                        f"{read.source.line}: assign it last"
                    )
                    raise other.source.target[0].error(message)

    # --- order -------------------------------------------------------------------------------------------------------

    def _placed(self) -> Iterator[dict[str, Any]]:
        total = self.calls.turns
        starts = [read for read in self.found if self._at_start(read, total)]
        ends = [read for read in self.found if read not in starts]
        for read in starts:
            passed = [end for end in ends if end.source.number < read.source.number]
            if any(_touch(read, other) for other in passed):
                raise _between(read)
            yield read.entry | {"at": "start"}
        yield from (read.entry for read in ends)

    def _at_start(self, read: Read, total: int) -> bool:
        turn = read.source.turn
        if turn == total and turn:
            return False
        if not any(self._meets(read, item) for item in self._called(0, turn)):
            return True
        if any(self._meets(read, item) for item in self._called(turn, total)):
            raise _between(read)
        return False

    def _called(self, first: int, last: int) -> Sequence[Item]:
        return [item for item in self.scope.items.values() if first <= item.turn < last]

    def _meets(self, read: Read, item: Item) -> bool:
        """Whether it makes a difference on which side of a call an assignment stands."""
        writes = {f"{item.name}.{row.name}" for row in item.kind.outputs}
        writes |= {f"{item.name}.{row}" for name, row in self.calls.assignments if name == item.name}
        return read.target.item is item or bool(read.reads & writes) or read.target.name in self.calls.reads_of(item)


def _touch(one: Read, other: Read) -> bool:
    """Whether the order of two moves makes a difference."""
    same = one.target.name == other.target.name
    return same or one.target.name in other.reads or other.target.name in one.reads


def _between(read: Read) -> ListingError:
    message = f"{read.target.name} is assigned between two calls, and what stands before and behind needs it there"
    return read.source.target[0].error(f"{message}; wire the expression itself")
