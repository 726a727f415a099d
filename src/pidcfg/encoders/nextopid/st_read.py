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

from pidcfg.encoders.listing import Listing, ListingError, shorten_names
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.st_calls import MAX_GUARDS, Assignment, Calls, Guard, GuardedAssignment, Label
from pidcfg.encoders.nextopid.st_scope import (
    SIGNAL_TYPES,
    TOO_LONG_TEXT,
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
    listing.has_settings = has_settings = bool(listing.plc)
    if task is not None:
        listing.plc = _with_task(listing.plc, *task)
    calls = Calls(scope)
    calls.skipped.lines += source.skipped
    for statement in source.statements:
        calls.read_statement(statement)
    calls.settle_inputs()
    reader = _Reader(scope, calls, listing)
    reader.initial_values()
    reader.call_values()
    moves = Moves(scope, calls, takes_all=has_settings).read_entries()
    calls.sample_times(listing.plc)
    signals = list(scope.find_signals(takes_all=has_settings))
    words, lines = listing.words, listing.lines
    listing.words, listing.lines, listing.shown_addresses = {}, {}, {}
    for signal in signals:
        listing.add(signal.name.text, _first_value(signal), signal.name.text, signal.name.line, signal.name.column)
    for name, value in words.items():
        listing.add(name, value, name, lines[name])
    if moves:
        listing.plc = {**listing.plc, "moves": moves}
    if source.program is not None:
        listing.plc = _with_program(listing.plc, source.program)
    listing.settings = tuple(item.entry for item in scope.items.values())
    listing.notes = tuple(reader.make_notes(signals))
    return listing


def add_zeros(listing: Listing) -> Listing:
    """What a program does not mention of its instances is 0, as IEC 61131-3 has it; a note says which."""
    for entry in listing.settings:
        kind, name = BLOCK_TYPES[entry["type"]], entry.get("loop") or entry.get("block")
        zero_names = []
        for row in () if kind.function else kind.inputs:
            field, name_of_word = kind.model.model_fields.get(row.name), f"{name}.{row.name}"
            if field is not None and field.is_required() and name_of_word not in listing.words:
                listing.add(name_of_word, row.type.default, name_of_word)
                zero_names.append(row.name)
        if zero_names:
            listing.notes = (
                *listing.notes,
                f"{name}: {', '.join(zero_names)} are not given in the program, and so are 0",
            )
    return listing


def _with_task(plc: Mapping[str, object], interval: Decimal, token: Token) -> dict[str, object]:
    """What is beside the parameters, with the interval of the task; raises `ListingError` where the comments differ."""
    stated = plc.get("sample_time")
    if stated is not None and not _is_time(stated, interval):
        raise token.error(f"the task calls the program every {decimal_text(interval)} s, and the comments say {stated}")
    return {**plc, "sample_time": plain_number(interval)}


def _is_time(time: object, interval: Decimal) -> bool:
    """Whether a comment says that time; what is none is another one."""
    try:
        return parse_seconds(time) == interval
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
        wired_inputs = {*self.calls.assignments}
        for item in self.scope.items.values():
            declared = self.scope.variables.get(item.name.upper())
            if declared is None or item.kind.function or declared.initial is None:
                continue
            if not isinstance(declared.initial, dict):
                raise declared.name.error(
                    f"{item.name}: initial values of an instance stand in parentheses, (SP := 50.0)"
                )
            self._add_members(item, (), declared.initial, wired_inputs)
        for upper, (item, row) in self.scope.aliases.items():
            initial = self.scope.variables[upper].initial
            if row.access == "input" and initial is not None and (item.name, row.name) not in wired_inputs:
                self._add_literal(item, row, initial, self.scope.variables[upper].name)

    def _add_members(self, item: Item, outer: tuple[Token, ...], initial: Initial, wires: set[tuple[str, str]]) -> None:
        for name, value in initial.values() if isinstance(initial, dict) else ():
            if isinstance(value, dict):
                self._add_members(item, (*outer, name), value, wires)
                continue
            row = self.scope.find_parameter(item, (*outer, name), "input")
            if (item.name, row.name) not in wires:
                self._add_literal(item, row, value, name)

    def _add_literal(self, item: Item, row: Parameter, value: Initial, token: Token) -> None:
        name_of_word = f"{item.name}.{row.name}"
        content = content_of(value, row.type, name_of_word) if value and not isinstance(value, dict) else None
        if content is None:
            raise token.error(f"{name_of_word} begins with something that is no literal")
        self.listing.add(name_of_word, content, name_of_word, token.line, token.column)

    def call_values(self) -> None:
        """Arguments and assignments."""
        for assignment in self.calls.assignments.values():
            item, row, tokens = assignment[:3]
            name_of_word = f"{item.name}.{row.name}"
            content = content_of(tokens, row.type, name_of_word)
            if content is None:
                if not can_wire(item.kind.model, row.name):
                    raise tokens[0].error(f"{name_of_word} takes a literal, and cannot be wired")
                self.places[item.name, row.name] = assignment
            value = self._read_wire(item, row, tokens) if content is None else content
            self.listing.add(name_of_word, value, name_of_word, tokens[0].line, tokens[0].column)

    def _read_wire(self, item: Item, row: Parameter, tokens: tuple[Token, ...]) -> Wire:
        wiring = Wiring.parse(tokens, row.type, self.scope.resolve)
        self.calls.reads.setdefault(item.name, set()).update(wiring.names)
        return Wire(wire_text(wiring.code, wiring.constants, wiring.names.__getitem__))

    # --- order -------------------------------------------------------------------------------------------------------

    def make_notes(self, signals: list[Declaration]) -> Iterator[str]:
        """What was passed over, and what will be executed in another order; checks every wire."""
        layout = Layout.of(
            {signal.name.text: SIGNAL_TYPES.get(signal.type_name, REAL) for signal in signals},
            [(item.name, item.kind) for item in self._ordered_items()],
        )
        wires: Wires = {}
        numbers = {block.name: i for i, block in enumerate(layout.instances)}
        for (name, row), assignment in self.places.items():
            wire = self.listing.words[f"{name}.{row}"]
            try:
                wires[numbers[name], row] = layout.read_wire(assignment.row.type, wire.text)
            except ExpressionError as error:
                raise assignment.tokens[0].error(f"{name}.{row}: {error.message}") from None
        yield from self._missing_call_notes()
        yield from self._order_notes(layout, wires)
        if self.calls.skipped.lines:
            lines = shorten_names([str(line) for line in sorted({*self.calls.skipped.lines})])
            yield f"statements that are not about blocks of the library are left out: lines {lines}"
        used_names = {*self.scope.items, *self.scope.aliases, *self.scope.structures}
        used_names |= {signal.name.upper for signal in signals} | {*self.calls.counters}
        unused = [d.name.text for upper, d in self.scope.variables.items() if upper not in used_names]
        if unused:
            yield f"variables that no block reads are left out: {shorten_names(unused)}"
        numbers_only = [d.name.text for d in signals if d.type_name not in SIGNAL_TYPES]
        if numbers_only:
            names = shorten_names(numbers_only)
            yield f"these variables are not REAL in the program, and are REAL signals here: {names}"

    def _ordered_items(self) -> list[Item]:
        """As a configuration has them: blocks before loops."""
        return sorted(self.scope.items.values(), key=lambda item: "loop" in item.entry)

    def _missing_call_notes(self) -> Iterator[str]:
        missing = [item for item in self.scope.items.values() if not item.is_called]
        functions = [item.name for item in missing if item.kind.function]
        if functions:
            raise ListingError(f"{functions[0]} is a function of the comments, and nothing calls it")
        if missing and self.calls.call_count:
            yield f"these blocks are declared and never called: {shorten_names([item.name for item in missing])}"

    def _order_notes(self, layout: Layout, wires: Wires) -> Iterator[str]:
        """Where a value of the previous cycle becomes one of the same, or the other way round."""
        positions = {i: at for at, i in enumerate(layout.execution_order(wires))}
        items = {block.name: self.scope.items[block.name.upper()] for block in layout.instances}
        for (i, row), wire in wires.items():
            assignment = self.places[layout.instances[i].name, row]
            for number in sorted(wire.signals):
                owner = layout.owner_of(number)
                if owner is None or (layout.is_input(number) and not self._is_wired(layout, wires, number)):
                    continue
                other = items[layout.instances[owner].name]
                is_earlier = 0 <= other.calls_before < assignment.calls_before
                if other.is_called and is_earlier != (positions[owner] < positions[i]):
                    cycle_word = "same" if is_earlier else "previous"
                    name = layout.instances[i].name
                    yield (
                        f"{name}.{row} reads {other.name} of the {cycle_word} cycle in the program, and of the "
                        f"{'previous' if is_earlier else 'same'} one in the order of the configuration"
                    )

    def _is_wired(self, layout: Layout, wires: Wires, number: int) -> bool:
        block = layout.instances[layout.owner_of(number) or 0]
        return (layout.owner_of(number), block.kind.table.rows[number - block.base].name) in wires


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
    def names_read(self) -> frozenset[str]:
        """The names, each once."""
        return frozenset(self.names)

    def append_code(self, part: Wiring | Condition) -> None:
        """The code of a part, behind what is there."""
        for op, operand in zip(part.code[::2], part.code[1::2], strict=True):
            shift = len(self.constants) if op == CONSTANT else len(self.names) if op == SIGNAL else 0
            self.code += (op, operand + shift)
        self.constants += part.constants
        self.names += part.names

    def append_number(self, value: float) -> None:
        """A constant; a negative one with its sign behind."""
        self.code += (CONSTANT, len(self.constants))
        self.constants.append(abs(value))
        if value < 0:
            self.append_operator(NEGATE)

    def append_operator(self, op: int) -> None:
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

    def read_guards(self, assignment: GuardedAssignment) -> Condition:
        """All conditions of an assignment, joined by AND; raises `ListingError` where they are too long."""
        if len(assignment.guards) > MAX_GUARDS:
            raise too_long_error(assignment)
        condition = self.rows.get(id(assignment.guards))
        if condition is None:
            condition = Condition()
            for i, guard in enumerate(assignment.guards):
                condition.append_code(self.read_guard(guard))
                if i:
                    condition.append_operator(AND)
                if len(condition.code) > 2 * MAX_LENGTH:  # each pair of it is a character at least
                    raise too_long_error(assignment)
            self.rows[id(assignment.guards)] = condition
        return condition

    def read_guard(self, guard: Guard) -> Condition:
        """One condition, or its beginning where it is too long."""
        if guard not in self.guards:
            try:
                self.guards[guard] = self._parse_guard(guard)
            except ListingError as error:
                self.guards[guard] = error
        condition = self.guards[guard]
        if isinstance(condition, ListingError):
            raise condition
        return condition

    def _parse_guard(self, guard: Guard) -> Condition:
        condition = Condition()
        if not guard.labels:
            condition.append_code(Wiring.parse(guard.tokens, BOOL, self.resolve))
        for j, label in enumerate(guard.labels):
            _compare_label(condition, guard.tokens, label, self.resolve)
            if j:
                condition.append_operator(OR)
            if len(condition.code) > 2 * MAX_LENGTH:
                return condition
        if guard.is_inverted and condition.code[-2] == NOT:
            del condition.code[-2:]
        elif guard.is_inverted:
            condition.append_operator(NOT)
        return condition


def too_long_error(guarded: GuardedAssignment) -> ListingError:
    """Of conditions that are no expression of a configuration."""
    together = f"with those of the branches before, the condition of this is longer than {MAX_LENGTH} characters"
    return guarded.target[0].error(f"{together}: assign a BOOL before, and ask for that")


def _compare_label(
    condition: Condition,
    tokens: tuple[Token, ...],
    label: Label,
    resolve: Callable[[tuple[Token, ...]], tuple[str, IecType]],
) -> None:
    condition.append_code(Wiring.parse(tokens, REAL, resolve))
    condition.append_number(label.low)
    if label.high is None:
        condition.append_operator(EQUAL)
        return
    condition.append_operator(AT_LEAST)
    condition.append_code(Wiring.parse(tokens, REAL, resolve))
    condition.append_number(label.high)
    condition.append_operator(AT_MOST)
    condition.append_operator(AND)


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


class MoveRead(NamedTuple):
    """A move as read: the entry of the listing, what it writes and reads, and the assignment."""

    entry: Data
    target: Target
    names_read: frozenset[str]
    source: GuardedAssignment


@dataclass(slots=True)
class CallNeeds:
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
    takes_all: bool
    """Whether all that can be read is a move: the comments say that the program was written from a configuration."""
    moves: list[MoveRead] = field(default_factory=list)
    conditions: Conditions = field(init=False)

    def __post_init__(self) -> None:
        self.conditions = Conditions(self.scope.resolve)

    def read_entries(self) -> list[Data]:
        """The entries of the listing, in the order of execution."""
        unread = self._read_block_moves()
        if self.takes_all:
            unread = [guarded for guarded in unread if not self._try_read(guarded)]
        for guarded in unread:
            self.calls.skip_assignment(guarded)
        self.moves.sort(key=lambda read: read.source.number)
        by_target: dict[str, list[MoveRead]] = {}
        for read in self.moves:
            by_target.setdefault(read.target.name, []).append(read)
        for read in self.moves:
            self._check_conditions(read, by_target)
        return list(self._ordered_entries())

    def _read_block_moves(self) -> list[GuardedAssignment]:
        """Reads what concerns the blocks, from their inputs back; what is left does not concern them."""
        waiting: dict[str, list[tuple[int, GuardedAssignment]]] = {}
        for place, guarded in enumerate(self.calls.branches.assignments):
            waiting.setdefault(guarded.target[0].upper, []).append((place, guarded))
        names = [
            name for name in waiting if self.scope.find_instance(name) is not None or name in self.scope.used_variables
        ]
        while names:
            concerned = sorted((entry for name in names for entry in waiting.pop(name)), key=itemgetter(0))
            reads = [self._read_move(guarded) for _, guarded in concerned]
            self.moves += reads
            names = [
                *dict.fromkeys(name.upper() for read in reads for name in read.names_read if name.upper() in waiting)
            ]
        return [
            guarded for _, guarded in sorted((entry for row in waiting.values() for entry in row), key=itemgetter(0))
        ]

    def _try_read(self, guarded: GuardedAssignment) -> bool:
        try:
            self.moves.append(self._read_move(guarded))
        except ListingError:
            return False
        return True

    # --- reading -----------------------------------------------------------------------------------------------------

    def _find_target(self, parts: tuple[Token, ...]) -> Target:
        item = self.scope.find_instance(parts[0].upper)
        if item is not None:
            row = self.scope.find_parameter(item, parts[1:], "input") if len(parts) > 1 else None
            if row is None:
                raise parts[0].error(f"{item.name} is assigned as a whole")
            return Target(f"{item.name}.{row.name}", row.type, item)
        declared = self.scope.variables.get(parts[0].upper)
        kind = None if declared is None or len(parts) > 1 else SIGNAL_TYPES.get(declared.type_name)
        if declared is None or kind is None or kind.kind == "time":
            raise parts[0].error(f"{parts[0].text} is assigned here, and is no BOOL, REAL or INT")
        self.scope.used_variables.add(declared.name.upper)
        return Target(declared.name.text, kind)

    def _read_move(self, guarded: GuardedAssignment) -> MoveRead:
        target = self._find_target(guarded.target)
        condition = self.conditions.read_guards(guarded)
        content = content_of(guarded.value, target.type, target.name)
        names = condition.names_read
        if content is None:
            wiring = Wiring.parse(guarded.value, target.type, self.scope.resolve)
            names |= {*wiring.names}
            content = wire_text(wiring.code, wiring.constants, wiring.names.__getitem__)
            if len(content) > MAX_LENGTH:
                raise guarded.value[0].error(TOO_LONG_TEXT)
        entry: Data = {"move": content, "to": target.name}
        if guarded.guards:
            entry["when"] = self._condition_text(guarded, condition)
        return MoveRead(entry, target, names, guarded)

    def _condition_text(self, guarded: GuardedAssignment, condition: Condition) -> str:
        """The conditions of an assignment as text; those of one branch are written once."""
        if not condition.text:
            names = condition.names.__getitem__
            condition.text = wire_text(condition.code, condition.constants, names)
        if len(condition.text) > MAX_LENGTH:
            raise too_long_error(guarded)
        return condition.text

    def _check_conditions(self, read: MoveRead, by_target: Mapping[str, Sequence[MoveRead]]) -> None:
        """Refuses what changes a condition that has been looked at, and is executed once more."""
        for guard in read.source.guards:
            changes = []
            for name in {*self.conditions.read_guard(guard).names}:
                others = by_target.get(name, ())
                at = bisect_left(others, float(guard.assignments_before), key=lambda other: other.source.number)
                changes += [other for other in others[at : at + 1] if other.source.number < read.source.number]
            if changes:
                first = min(changes, key=lambda other: other.source.number)
                message = (
                    f"{first.target.name} is assigned inside the statement whose condition reads it, before line "
                    f"{read.source.line}: assign it last"
                )
                raise first.source.target[0].error(message)

    # --- order -------------------------------------------------------------------------------------------------------

    def _ordered_entries(self) -> Iterator[dict[str, object]]:
        needed = self._call_needs()
        at_start = [self._is_at_start(read, needed) for read in self.moves]
        written_names, used_names = set[str](), set[str]()  # by those before that are executed at the end
        for _, group in groupby(zip(self.moves, at_start, strict=True), lambda one: one[0].source.number):
            entries = [*group]
            for read, first in entries:
                if first and (read.target.name in used_names or read.names_read & written_names):
                    raise _between_error(read)
            for read, first in entries:
                if not first:
                    written_names.add(read.target.name)
                    used_names |= {read.target.name, *read.names_read}
        yield from (read.entry | {"at": "start"} for read, first in zip(self.moves, at_start, strict=True) if first)
        yield from (read.entry for read, first in zip(self.moves, at_start, strict=True) if not first)

    def _is_at_start(self, read: MoveRead, needed: CallNeeds) -> bool:
        total, turn = self.calls.call_count, read.source.calls_before
        if turn == total and turn:
            return False
        calls = [read.target.item.calls_before] if read.target.item is not None and read.target.item.is_called else []
        calls += needed.readers.get(read.target.name, ())
        calls += (needed.writers[name] for name in read.names_read if name in needed.writers)
        if all(call >= turn for call in calls):
            return True
        if any(call >= turn for call in calls):
            raise _between_error(read)
        return False

    def _call_needs(self) -> CallNeeds:
        """What calls read and write; it makes a difference on which side of them it is assigned or read."""
        needs = CallNeeds()
        called_items = {item.name: item for item in self.scope.items.values() if item.is_called}
        for item in called_items.values():
            needs.writers |= {f"{item.name}.{row.name}": item.calls_before for row in item.kind.outputs}
            for name in self.calls.reads.get(item.name, ()):
                first, last = needs.readers.get(name, (item.calls_before, item.calls_before))
                needs.readers[name] = (min(first, item.calls_before), max(last, item.calls_before))
        for name, row in self.calls.assignments:
            if name in called_items:
                needs.writers[f"{name}.{row}"] = called_items[name].calls_before
        return needs


def _between_error(read: MoveRead) -> ListingError:
    message = f"{read.target.name} is assigned between two calls, and what stands before and behind needs it there"
    return read.source.target[0].error(f"{message}; wire the expression itself")
