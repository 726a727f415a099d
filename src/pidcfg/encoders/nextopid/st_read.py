"""Structured Text to a listing: what a program declares and calls, what its comments say, and what it assigns when."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

from pidcfg.encoders.listing import Listing, ListingError, few
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.st_calls import MOST_GUARDS, Assignment, Calls, Guard, Guarded, Label
from pidcfg.encoders.nextopid.st_scope import (
    LONGER,
    SIGNAL_TYPES,
    Item,
    Scope,
    Source,
    Wiring,
    can_wire,
    check_name,
    parse_st,
)
from pidcfg.encoders.nextopid.st_write import wire_text
from pidcfg.encoders.nextopid.wiring import Layout, Wires
from pidcfg.encoders.parameters import Content, Parameter
from pidcfg.encoders.structured_text import (
    Declaration,
    Initial,
    Token,
    content_of,
)
from pidcfg.schemas.base import parse_seconds
from pidcfg.schemas.expressions import (
    AND,
    AT_LEAST,
    AT_MOST,
    CONSTANT,
    EQUAL,
    MAX_LENGTH,
    NEGATE,
    NOT,
    OR,
    SIGNAL,
    ExpressionError,
)
from pidcfg.schemas.iec import BOOL, REAL, IecType, Wire
from pidcfg.schemas.nextopid import Plc
from pidcfg.schemas.numbers import decimal_text, plain_number
from pidcfg.text.paths import Data

# --- Structured Text to a listing: what the program declares and calls, and what its comments say beside --------------


def read_st(text: str) -> Listing:
    """The parameters and wires of a program; raises `ListingError` at what cannot be read or would change meaning."""
    return read_source(parse_st(text))


def read_source(source: Source, task: tuple[Decimal, Token] | None = None) -> Listing:
    """As `read_st`, of what has been taken apart; ``task``: the interval of the task in s, and where it stands."""
    listing = Listing(vendor="nextopid")
    scope = Scope.of(source, listing)
    listing.described = described = bool(listing.plc)
    if task is not None:
        listing.plc = _with_task(listing.plc, *task)
    calls = Calls(scope)
    calls.left.lines += source.skipped
    for one in source.statements:
        calls.take(one)
    calls.settle_inputs()
    reader = _Reader(scope, calls, listing)
    reader.initial_values()
    reader.call_values()
    calls.sample_times(listing.plc)
    moves = Moves(scope, calls, everything=described).read()
    signals = list(scope.signals(everything=described))
    words, lines = listing.words, listing.lines
    listing.words, listing.lines, listing.shown = {}, {}, {}
    for signal in signals:
        listing.add(signal.name.text, _first_value(signal), signal.name.text, signal.name.line, signal.name.column)
    for name, value in words.items():
        listing.add(name, value, name, lines[name])
    if moves:
        listing.plc = {**listing.plc, "moves": moves}
    if source.program is not None:
        listing.plc = _with_program(listing.plc, source.program)
    listing.settings = tuple(item.entry for item in scope.items.values())
    listing.notes = tuple(reader.notes(signals))
    return listing


def with_zeros(listing: Listing) -> Listing:
    """What a program does not mention of its instances is 0, as IEC 61131-3 has it; a note says which."""
    for entry in listing.settings:
        kind, name = BLOCK_TYPES[entry["type"]], entry.get("loop") or entry.get("block")
        left = []
        for row in () if kind.function else kind.inputs:
            field, full = kind.model.model_fields.get(row.name), f"{name}.{row.name}"
            if field is not None and field.is_required() and full not in listing.words:
                listing.add(full, row.type.default, full)
                left.append(row.name)
        if left:
            listing.notes = (*listing.notes, f"{name}: {', '.join(left)} are not given in the program, and so are 0")
    return listing


def _with_task(plc: Mapping[str, object], interval: Decimal, at: Token) -> dict[str, object]:
    """What is beside the parameters, with the interval of the task; raises `ListingError` where the comments differ."""
    said = plc.get("sample_time")
    if said is not None and not _is_time(said, interval):
        raise at.error(f"the task calls the program every {decimal_text(interval)} s, and the comments say {said}")
    return {**plc, "sample_time": plain_number(interval)}


def _is_time(said: object, interval: Decimal) -> bool:
    """Whether a comment says that time; what is none is another one."""
    try:
        return parse_seconds(said) == interval
    except (ValueError, TypeError):
        return False


def _with_program(plc: Mapping[str, object], program: Token) -> dict[str, object]:
    """What is beside the parameters, with the name that the program has."""
    check_name(program.text, program.line, program.column)
    entry = {key: value for key, value in plc.items() if key != "program"}
    return entry if program.text == Plc.model_fields["program"].default else entry | {"program": program.text}


def _first_value(signal: Declaration) -> Content:
    """What a signal begins with."""
    kind = SIGNAL_TYPES.get(signal.type_name, REAL)
    if signal.initial is None:
        return kind.default
    value = (
        None
        if isinstance(signal.initial, dict) or not signal.initial
        else content_of(signal.initial, kind, signal.name.text)
    )
    if value is None:
        raise signal.name.error(f"{signal.name.text} is read by a block, and begins with something that is no literal")
    return value


class _Reader:
    """Turns initial values and arguments into words."""

    def __init__(self, scope: Scope, calls: Calls, listing: Listing) -> None:
        self.scope, self.calls, self.listing = scope, calls, listing
        self.places: dict[tuple[str, str], Assignment] = {}

    # --- values ------------------------------------------------------------------------------------------------------

    def initial_values(self) -> None:
        """Those of instances, and of variables that stand for inputs of functions."""
        wired = {*self.calls.assignments}
        for item in self.scope.items.values():
            declared = self.scope.variables.get(item.name.upper())
            if declared is None or item.kind.function or declared.initial is None:
                continue
            if not isinstance(declared.initial, dict):
                raise declared.name.error(
                    f"{item.name}: initial values of an instance stand in parentheses, (SP := 50.0)"
                )
            self._members(item, (), declared.initial, wired)
        for upper, (item, row) in self.scope.aliases.items():
            initial = self.scope.variables[upper].initial
            if row.access == "input" and initial is not None and (item.name, row.name) not in wired:
                self._literal(item, row, initial, self.scope.variables[upper].name)

    def _members(self, item: Item, above: tuple[Token, ...], initial: Initial, wired: set[tuple[str, str]]) -> None:
        for name, value in initial.values() if isinstance(initial, dict) else ():
            if isinstance(value, dict):
                self._members(item, (*above, name), value, wired)
                continue
            row = self.scope.row(item, (*above, name), "input")
            if (item.name, row.name) not in wired:
                self._literal(item, row, value, name)

    def _literal(self, item: Item, row: Parameter, value: Initial, at: Token) -> None:
        full = f"{item.name}.{row.name}"
        content = content_of(value, row.type, full) if value and not isinstance(value, dict) else None
        if content is None:
            raise at.error(f"{full} begins with something that is no literal")
        self.listing.add(full, content, full, at.line, at.column)

    def call_values(self) -> None:
        """Arguments and assignments."""
        for assignment in self.calls.assignments.values():
            item, row, tokens = assignment[:3]
            full = f"{item.name}.{row.name}"
            content = content_of(tokens, row.type, full)
            if content is None:
                if not can_wire(item.kind.model, row.name):
                    raise tokens[0].error(f"{full} takes a literal, and cannot be wired")
                self.places[item.name, row.name] = assignment
            value = self._wire(item, row, tokens) if content is None else content
            self.listing.add(full, value, full, tokens[0].line, tokens[0].column)

    def _wire(self, item: Item, row: Parameter, tokens: tuple[Token, ...]) -> Wire:
        wiring = Wiring.read(tokens, row.type, self.scope.resolve)
        self.calls.reads.setdefault(item.name, set()).update(wiring.names)
        return Wire(wire_text(wiring.code, wiring.constants, wiring.names.__getitem__))

    # --- order -------------------------------------------------------------------------------------------------------

    def notes(self, signals: list[Declaration]) -> Iterator[str]:
        """What was passed over, and what will be executed in another order; checks every wire."""
        layout = Layout.of(
            {signal.name.text: SIGNAL_TYPES.get(signal.type_name, REAL) for signal in signals},
            [(item.name, item.kind) for item in self._in_order()],
        )
        wires: Wires = {}
        numbers = {block.name: i for i, block in enumerate(layout.instances)}
        for (name, row), assignment in self.places.items():
            wire = self.listing.words[f"{name}.{row}"]
            try:
                wires[numbers[name], row] = layout.read(assignment.row.type, wire.text)
            except ExpressionError as error:
                raise assignment.tokens[0].error(f"{name}.{row}: {error.message}") from None
        yield from self._missing_calls()
        yield from self._other_order(layout, wires)
        if self.calls.left.lines:
            lines = few([str(line) for line in sorted({*self.calls.left.lines})])
            yield f"statements that are not about blocks of the library are left out: lines {lines}"
        used = {*self.scope.items, *self.scope.aliases, *self.scope.structures}
        used |= {signal.name.upper for signal in signals} | {*self.calls.counters}
        left = [d.name.text for upper, d in self.scope.variables.items() if upper not in used]
        if left:
            yield f"variables that no block reads are left out: {few(left)}"
        whole = [d.name.text for d in signals if d.type_name not in SIGNAL_TYPES]
        if whole:
            yield f"these variables are not REAL in the program, and are REAL signals here: {few(whole)}"

    def _in_order(self) -> list[Item]:
        """As a configuration has them: blocks before loops."""
        return sorted(self.scope.items.values(), key=lambda item: "loop" in item.entry)

    def _missing_calls(self) -> Iterator[str]:
        missing = [item for item in self.scope.items.values() if not item.called]
        functions = [item.name for item in missing if item.kind.function]
        if functions:
            raise ListingError(f"{functions[0]} is a function of the comments, and nothing calls it")
        if missing and self.calls.turns:
            yield f"these blocks are declared and never called: {few([item.name for item in missing])}"

    def _other_order(self, layout: Layout, wires: Wires) -> Iterator[str]:
        """Where a value of the previous cycle becomes one of the same, or the other way round."""
        turn = {i: at for at, i in enumerate(layout.order(wires))}
        items = {block.name: self.scope.items[block.name.upper()] for block in layout.instances}
        for (i, row), wire in wires.items():
            assignment = self.places[layout.instances[i].name, row]
            for number in sorted(wire.signals):
                owner = layout.owner(number)
                if owner is None or (layout.is_input(number) and not self._wired(layout, wires, number)):
                    continue
                other = items[layout.instances[owner].name]
                was_before = 0 <= other.turn < assignment.turn
                if other.called and was_before != (turn[owner] < turn[i]):
                    which = "same" if was_before else "previous"
                    name = layout.instances[i].name
                    yield (
                        f"{name}.{row} reads {other.name} of the {which} cycle in the program, and of the "
                        f"{'previous' if was_before else 'same'} one in the order of the configuration"
                    )

    def _wired(self, layout: Layout, wires: Wires, number: int) -> bool:
        block = layout.instances[layout.owner(number) or 0]
        return (layout.owner(number), block.kind.table.rows[number - block.base].name) in wires


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
