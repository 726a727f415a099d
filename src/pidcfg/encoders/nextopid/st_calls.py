"""Calls and assignments of a program that concern blocks of the library, also in IF and CASE."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from itertools import compress
from typing import Any, NamedTuple

from pidcfg.encoders.nextopid.st_scope import LIBRARY, Item, Scope
from pidcfg.encoders.parameters import Parameter
from pidcfg.encoders.structured_text import (
    END,
    INTEGER_TYPES,
    NAME,
    STATEMENT_ENDS,
    Argument,
    Cursor,
    Statement,
    Token,
    call_arguments,
    is_literal,
    name_chain,
    number_of,
    read_statement,
)
from pidcfg.schemas.base import parse_seconds
from pidcfg.schemas.expressions import MAX_LENGTH
from pidcfg.schemas.numbers import plain_number

# --- IF and CASE of Structured Text as assignments, each with the conditions under which it is executed ---------------
#
# Design. `assignments` walks a statement and gives its assignments in order, each a `GuardedAssignment` with conditions
# of all branches around it. Whoever reads them takes every condition where its assignment stands, and not where IF
# does; so each `Guard` knows what was assigned before it was looked at, and `pidcfg.encoders.nextopid.st_read` finds
# a change in between.

BRANCHES = frozenset(("IF", "CASE"))
LATCH_VALUES = {"S": "TRUE", "R": "FALSE"}
"""What ``x S= y`` and ``x R= y`` make of x when y is TRUE."""
THEN_WORD, OF_WORD = frozenset(("THEN",)), frozenset(("OF",))
MAX_GUARDS = MAX_LENGTH // len("a AND ") + 1
"""Conditions of an assignment; more are no expression, however short each of them is."""


class Label(NamedTuple):
    """A value of CASE, or a range of them."""

    low: float
    high: float | None = None

    @property
    def high_end(self) -> float:
        """The highest value."""
        return self.low if self.high is None else self.high


@dataclass(slots=True)
class Labels:
    """The values that branches of a CASE have, as ranges in ascending order that do not meet."""

    lows: list[float] = field(default_factory=list)
    highs: list[float] = field(default_factory=list)

    def has_value(self, label: Label) -> bool:
        """Whether a value of a label is there; a range that does not ascend has none."""
        return label.low <= label.high_end and self._first_index(label) < self._end_index(label)

    def add(self, label: Label) -> None:
        """Adds the values of a label."""
        if label.low > label.high_end:
            return
        first, behind = self._first_index(label), self._end_index(label)
        self.lows[first:behind] = [min([label.low, *self.lows[first:behind]])]
        self.highs[first:behind] = [max([label.high_end, *self.highs[first:behind]])]

    def _first_index(self, label: Label) -> int:
        return bisect_left(self.highs, label.low)

    def _end_index(self, label: Label) -> int:
        return bisect_right(self.lows, label.high_end)


@dataclass(frozen=True, slots=True, eq=False)
class Guard:
    """A condition that must hold, or must not: of IF, or that a number has one of some values."""

    tokens: tuple[Token, ...]
    assignments_before: int
    """Of how many assignments it was looked at behind."""
    labels: tuple[Label, ...] = ()
    is_inverted: bool = False

    def invert(self) -> Guard:
        """The condition of the branches behind."""
        return Guard(self.tokens, self.assignments_before, self.labels, not self.is_inverted)


class GuardedAssignment(NamedTuple):
    """An assignment: what to, what, under which conditions, its number among all, and the calls before it."""

    target: tuple[Token, ...]
    value: tuple[Token, ...]
    guards: tuple[Guard, ...]
    number: float
    calls_before: int

    @property
    def line(self) -> int:
        """Where it stands."""
        return self.target[0].line


@dataclass(slots=True)
class Branches:
    """Walks statements; what is no assignment is handed to `skip`."""

    count_calls: Callable[[], int]
    skip: Callable[[tuple[Token, ...]], None]
    assignments: list[GuardedAssignment] = field(default_factory=list)

    def read_statement(self, tokens: tuple[Token, ...], guards: tuple[Guard, ...] = ()) -> None:
        """A statement, which ends with the end as its last token."""
        word = tokens[0].upper if tokens[0].kind == NAME else ""
        if word in BRANCHES:
            cursor = Cursor(tokens)
            cursor.take_token()
            (self._read_if if word == "IF" else self._read_case)(cursor, guards)
            return
        parts = name_chain(tokens)
        behind = tokens[2 * len(parts) - 1 :] if parts else tokens
        if parts and behind[0].text == ":=" and len(behind) > 2:
            self._add_assignment(parts, tuple(behind[1:-1]), guards)
        elif is_latch(behind):
            truth = behind[0]._replace(text=LATCH_VALUES[behind[0].upper])
            self._add_assignment(parts, (truth,), (*guards, Guard(tuple(behind[2:-1]), len(self.assignments))))
        else:
            self.skip(tokens)

    def _add_assignment(self, target: tuple[Token, ...], value: tuple[Token, ...], guards: tuple[Guard, ...]) -> None:
        self.assignments.append(GuardedAssignment(target, value, guards, len(self.assignments), self.count_calls()))

    def _read_if(self, cursor: Cursor, guards: tuple[Guard, ...]) -> None:
        assignments_before, guards_before = len(self.assignments), guards
        while True:
            guard = Guard(_condition_tokens(cursor, THEN_WORD, "IF"), assignments_before)
            self._read_body(cursor, (*guards_before, guard), ("ELSIF", "ELSE", "END_IF"))
            guards_before = (*guards_before, guard.invert())[: MAX_GUARDS + 1]
            if cursor.take_token().upper != "ELSIF":
                break
        if cursor.tokens[cursor.position - 1].upper == "ELSE":
            self._read_body(cursor, guards_before, ("END_IF",))

    def _read_case(self, cursor: Cursor, guards: tuple[Guard, ...]) -> None:
        assignments_before, used_labels = len(self.assignments), Labels()
        cases: list[Guard] = []
        selector = _condition_tokens(cursor, OF_WORD, "CASE")
        while cursor.next_token.upper not in {"ELSE", "END_CASE"}:
            token = cursor.next_token
            guard = Guard(selector, assignments_before, tuple(_read_labels(cursor)))
            if any(map(used_labels.has_value, guard.labels)):
                raise token.error("this value stands in the CASE again")
            for label in guard.labels:
                used_labels.add(label)
            cases.append(guard)
            self._read_body(cursor, (*guards, guard), ("ELSE", "END_CASE"))
        if cursor.take_token().upper == "ELSE":
            else_guards = (*guards, *(case.invert() for case in cases[: MAX_GUARDS + 1]))
            self._read_body(cursor, else_guards, ("END_CASE",))

    def _read_body(self, cursor: Cursor, guards: tuple[Guard, ...], ends: tuple[str, ...]) -> None:
        """The statements of a branch, up to the next one."""
        while cursor.next_token.upper not in ends and not _begins_label(cursor):
            for inner in read_statement(cursor):
                self.read_statement(inner.tokens, guards)


def is_latch(behind: Sequence[Token]) -> bool:
    """Whether what stands behind a name is ``S=`` or ``R=`` with a condition (CODESYS)."""
    return behind[0].kind == NAME and behind[0].upper in LATCH_VALUES and behind[1].text == "=" and len(behind) > 3


def _condition_tokens(cursor: Cursor, word: frozenset[str], keyword: str) -> tuple[Token, ...]:
    """The tokens up to a word, which must come."""
    tokens = cursor.take_until(word)
    (name,) = word
    cursor.expect_token(name, f"the condition of {keyword}")
    if not tokens:
        raise cursor.next_token.error(f"a condition is missing after {keyword}")
    return tokens


def _begins_label(cursor: Cursor) -> bool:
    """Whether a value of CASE stands here: a number, with or without a sign."""
    sign = cursor.next_token.text == "-"
    return is_literal(cursor.tokens[min(cursor.position + sign, len(cursor.tokens) - 1)])


def _read_labels(cursor: Cursor) -> Iterator[Label]:
    """The values before a colon."""
    while True:
        low = _read_label(cursor)
        if cursor.next_token.text == "..":
            cursor.take_token()
            yield Label(low, _read_label(cursor))
        else:
            yield Label(low)
        if cursor.next_token.text != ",":
            cursor.expect_token(":", "the value of CASE")
            return
        cursor.take_token()


def _read_label(cursor: Cursor) -> float:
    negative = cursor.next_token.text == "-"
    if negative:
        cursor.take_token()
    token = cursor.take_token()
    if not is_literal(token):
        raise token.error(f"{token.text}: only numbers are read as values of CASE")
    value = float(number_of(token))
    return -value if negative else value


# --- Statements of a program that do not concern the blocks of the library: skipped, unless they use one of them ------

STRUCTURE = "AutoTuneParam"
"""The input that is a structure."""
JUMPS = frozenset(("RETURN", "JMP"))


@dataclass(slots=True)
class SkippedCode:
    """What is left out of a program."""

    scope: Scope
    lines: list[int] = field(default_factory=list)
    """Where the statements stand."""

    def skip_statement(self, tokens: Sequence[Token]) -> None:
        """Skips a statement that does not concern the library, but remembers the variables that it assigns."""
        self.lines.append(tokens[0].line)
        depth, padded = 0, (*tokens, *(Token(END, "", token.line, token.column) for token in [tokens[-1]] * 3))
        for index, token in enumerate(tokens):
            previous = tokens[index - 1].text if index else ""
            depth += (token.text == "(") - (token.text == ")")
            if token.kind != NAME:
                continue
            if previous == ".":
                self._refuse_member(token, padded[index + 1].text)
                continue
            parts = name_chain(padded, index)
            end = index + 2 * len(parts) - 1
            next_text = padded[end].text
            self._refuse_block_use(token, parts, next_text, depth)
            is_reference = [part.upper for part in padded[end : end + 2]] == ["REF", "="]
            if (next_text == ":=" and depth == 0) or previous == "=>" or is_reference:
                self.scope.assigned_variables.setdefault(token.upper, token)

    def is_alias(self, name: Token) -> bool:
        """Whether a variable stands for a parameter."""
        return name.upper in self.scope.aliases or name.upper in self.scope.structures

    def refuse_written_over(self) -> None:
        """Variables that stand for inputs are not assigned besides; what is read of outputs is refused where it is."""
        for upper, (item, row) in self.scope.aliases.items():
            token = self.scope.assigned_variables.get(upper)
            if token is not None and row.access == "input":
                raise token.error(
                    f"{token.text} is assigned in line {token.line}, and is {row.name} of {item.name}: wire it"
                )
        for upper, (item, name) in self.scope.structures.items():
            token = self.scope.assigned_variables.get(upper)
            if token is not None and name.upper == STRUCTURE.upper():
                line = token.line
                problem = (
                    f"{token.text} is assigned in line {line}, and is {STRUCTURE} of {item.name} in line {name.line}"
                )
                raise token.error(f"{problem}: assign {item.name}.{STRUCTURE} itself, member by member")

    def _refuse_member(self, token: Token, next_text: str) -> None:
        """Refuses the call of a block by another name than it is declared with."""
        item = self.scope.find_instance(token.upper)
        if item is not None and next_text == "(":
            raise token.error(f"{item.name} is called here with another name before it; write {item.name}(…) alone")

    def _refuse_block_use(self, token: Token, parts: tuple[Token, ...], next_text: str, depth: int) -> None:
        """Refuses jumps, and other uses of a block inside a skipped statement."""
        kind, item = LIBRARY.get(token.upper), self.scope.find_instance(token.upper)
        if token.upper in JUMPS:
            raise token.error(f"{token.text}: what stands behind is not always executed")
        if kind is not None and kind.function and next_text == "(":
            raise token.error(f"{token.text} is called inside another statement")
        if item is None:
            return
        if len(parts) == 1:
            use = "is called" if next_text == "(" else "is used as a whole"
            raise token.error(f"{item.name} {use} inside another statement")
        if next_text == ":=" and depth == 0:
            raise token.error(f"a parameter of {item.name} is assigned inside another statement")


# --- Calls and assignments of a program that concern blocks of the library --------------------------------------------
#
# Other statements are skipped, and their lines noted. What a configuration cannot express is refused: a call or an
# assignment inside IF, a second call of a block, an assignment after the call.

RESULT_STRUCTURES = ("AutoTuneResult", "ErrBits", "WarnBits")
"""Outputs that are structures."""


class Assignment(NamedTuple):
    """The value that a parameter is assigned: its tokens, and the number of calls before it."""

    item: Item
    row: Parameter
    tokens: tuple[Token, ...]
    calls_before: int
    place: GuardedAssignment | None = None
    """The statement, where it is one of its own before the call."""


@dataclass(slots=True)
class Calls:
    """All calls and assignments of a program."""

    scope: Scope
    assignments: dict[tuple[str, str], Assignment] = field(default_factory=dict)
    call_count: int = 0
    skipped: SkippedCode = field(init=False)
    """Statements that are left out."""
    counted_loops: list[tuple[Item, Token]] = field(default_factory=list)
    """Loops that are not called in every cycle, each with its cycle counter."""
    counters: set[str] = field(default_factory=set)
    """These counters, in capitals."""
    cycles_by_counter: dict[str, int] = field(default_factory=dict)
    branches: Branches = field(init=False)
    """Assignments that may be moves."""
    reads: dict[str, set[str]] = field(default_factory=dict)
    """What the wires of each block read."""

    def __post_init__(self) -> None:
        self.skipped = SkippedCode(self.scope)
        self.branches = Branches(lambda: self.call_count, self.skipped.skip_statement)

    def read_statement(self, statement: Statement) -> None:
        """The next statement."""
        tokens = statement.tokens
        if tokens[0].kind == NAME and tokens[0].upper in STATEMENT_ENDS:
            if self._counted_call(tokens):
                return
            if tokens[0].upper in BRANCHES:
                self.branches.read_statement(tokens)
            else:
                self.skipped.skip_statement(tokens)
            return
        parts = name_chain(tokens)
        behind = tokens[2 * len(parts) - 1 :] if parts else tokens
        if parts and behind[0].text == ":=" and len(behind) > 2:
            self._read_assignment(parts, behind[1:-1], tokens)
        elif parts and behind[0].text == "(":
            self._read_call(parts, behind[:-1], tokens)
        else:
            self.branches.read_statement(tokens)

    # --- calls -------------------------------------------------------------------------------------------------------

    def _read_call(self, parts: tuple[Token, ...], inside: Sequence[Token], tokens: tuple[Token, ...]) -> None:
        item, kind = self.scope.find_instance(parts[0].upper), LIBRARY.get(parts[0].upper)
        if len(parts) > 1 or (item is None and kind is None):
            self.skipped.skip_statement(tokens)
            return
        inputs = call_arguments(inside, parts[0].text)
        if item is None:
            if kind is None or not kind.function:
                raise parts[0].error(f"{parts[0].text} is a function block: declare an instance, and call that")
            item = self._called_function(LIBRARY[parts[0].upper], inputs, parts[0])
        if item.is_called:
            raise parts[0].error(f"{item.name} is called again")
        for argument in inputs:
            if argument.name.upper in {"EN", "ENO"}:
                raise argument.name.error(f"{item.name} is called on a condition; a configuration has none")
            if argument.sign == "=>":
                self._set_alias(item, argument)
            elif argument.name.upper == STRUCTURE.upper() and self._set_structure(item, argument):
                continue
            else:
                self._set_input(item, (argument.name,), argument.value)
        item.place, item.calls_before = parts[0], self.call_count
        self.call_count += 1

    def _called_function(self, kind: Any, inputs: list[Argument], token: Token) -> Item:
        """The function that is called: the one that the comments at its variables name, or a new one."""
        stems: dict[str, str] = {}
        for argument in inputs:
            if argument.sign != "=>" or len(argument.value) != 1:
                continue
            target = argument.value[0]
            if target.upper in self.scope.aliases:
                item = self.scope.aliases[target.upper][0]
                if item.kind is not kind:
                    raise token.error(f"{target.text} stands for a parameter of {item.name}, which is no {kind.name}")
                return item
            stem = target.text.removesuffix(f"_{argument.name.text}")
            stems[stem.upper()] = stem if stem != target.text else ""
        return self.scope.new_function(kind, next(iter(stems.values())) or None if len(stems) == 1 else None, token)

    def _set_alias(self, item: Item, argument: Argument) -> None:
        """An output is copied to a variable, which from then on is an alias of it."""
        target = argument.value[0]
        prefix = next((name for name in RESULT_STRUCTURES if name.upper() == argument.name.upper), "")
        if prefix and len(argument.value) == 1 and target.upper in self.scope.variables:
            self.scope.structures[target.upper] = (item, argument.name)
            return
        row = self.scope.find_parameter(item, (argument.name,), "output")
        if len(argument.value) != 1 or target.upper not in self.scope.variables or target.upper in self.scope.items:
            self.skipped.skip_statement(argument.value)
            return
        alias = self.scope.aliases.get(target.upper)
        if alias is not None and (alias[0].name, alias[1].name) != (item.name, row.name):
            raise target.error(f"{target.text} stands for {alias[0].name}.{alias[1].name} already")
        self.scope.aliases[target.upper] = (item, row)

    def _set_structure(self, item: Item, argument: Argument) -> bool:
        """AutoTuneParam from a variable: its members are those that the variable begins with."""
        declared = self.scope.variables.get(argument.value[0].upper) if len(argument.value) == 1 else None
        if declared is None or not isinstance(declared.initial, dict):
            return False
        for member in declared.initial.values():
            if not isinstance(member.value, dict):
                self._set_input(item, (argument.name, member.name), member.value)
        self.scope.structures[declared.name.upper] = (item, argument.name)
        return True

    def _set_input(self, item: Item, parts: tuple[Token, ...], value: tuple[Token, ...]) -> None:
        """An input gets a value, by an argument or an assignment; once, and before the call."""
        row = self.scope.find_parameter(item, parts, "input")
        if item.is_called:
            raise parts[0].error(f"{item.name}.{row.name} is assigned behind the call of {item.name}; assign it before")
        alias = self.scope.aliases.get(value[0].upper)
        if item.kind.function and len(value) == 1 and alias and alias[0] is item and alias[1] is row:
            return  # the variable of this input, which was assigned before or has an initial value
        if (item.name, row.name) in self.assignments:
            raise parts[0].error(f"{item.name}.{row.name} is assigned again")
        self.assignments[item.name, row.name] = Assignment(item, row, value, self.call_count)

    # --- assignments -------------------------------------------------------------------------------------------------

    def _read_assignment(self, parts: tuple[Token, ...], value: tuple[Token, ...], tokens: tuple[Token, ...]) -> None:
        item = self.scope.find_instance(parts[0].upper)
        if item is not None and len(parts) > 1:
            self._assign_input(item, parts, value)
            return
        alias = self.scope.aliases.get(parts[0].upper)
        if alias and len(parts) == 1 and alias[1].access == "input":
            self._set_input(alias[0], (parts[0]._replace(text=alias[1].name),), value)
            return
        if len(parts) == 1 and self._is_counting(parts[0], value):
            return
        if len(parts) == 1 and not alias and item is None:
            self.branches.read_statement(tokens)
            return
        self.skipped.skip_statement(tokens)

    def _assign_input(self, item: Item, parts: tuple[Token, ...], value: tuple[Token, ...]) -> None:
        """An input of an instance is assigned: a wire before its call, where nothing else assigns it; else a move."""
        row = self.scope.find_parameter(item, parts[1:], "input")
        if item.is_called:
            self.branches.assignments.append(
                GuardedAssignment(parts, value, (), len(self.branches.assignments), self.call_count)
            )
            return
        self._set_input(item, parts[1:], value)
        place = GuardedAssignment(parts, value, (), len(self.branches.assignments) - 0.5, self.call_count)
        self.assignments[item.name, row.name] = self.assignments[item.name, row.name]._replace(place=place)

    def _counted_call(self, tokens: tuple[Token, ...]) -> bool:
        """``IF counter = 0 THEN loop(…); END_IF``: the call of a loop in every n-th cycle."""
        if [token.upper for token in (tokens[0], *tokens[2:5])] != ["IF", "=", "0", "THEN"]:
            return False
        loop = self.scope.find_instance(tokens[5].upper)
        counter = self.scope.variables.get(tokens[1].upper)
        inner = _split_statements(tokens[5:-2])
        if loop is None or counter is None or counter.type_name not in INTEGER_TYPES or not inner:
            return False
        if (
            any(statement[0].upper != loop.name.upper() for statement in inner)
            or tokens[1].upper in self.cycles_by_counter
        ):
            return False
        if inner[-1][1].text != "(" or any(statement[1].text != "." for statement in inner[:-1]):
            return False
        if isinstance(counter.initial, dict) or [token.text for token in counter.initial or ()] not in ([], ["0"]):
            raise counter.name.error(f"{counter.name.text} counts the cycles of {loop.name}, and must begin with 0")
        for call in inner:
            self.read_statement(Statement((*call, tokens[-1])))
        self.counted_loops.append((loop, tokens[1]))
        self.counters.add(tokens[1].upper)
        return True

    def _is_counting(self, counter: Token, value: tuple[Token, ...]) -> bool:
        """``counter := (counter + 1) MOD n`` after such a call."""
        texts = [token.upper for token in value]
        if counter.upper not in self.counters or texts[:-1] != ["(", counter.upper, "+", "1", ")", "MOD"]:
            return False
        cycles = number_of(value[-1])
        if (
            isinstance(cycles, bool)
            or not isinstance(cycles, int)
            or cycles < 1
            or counter.upper in self.cycles_by_counter
        ):
            return False
        self.cycles_by_counter[counter.upper] = cycles
        return True

    def settle_inputs(self) -> None:
        """Inputs that are assigned more than once: all of that are moves; refuses what a call writes over."""
        are_aliases = [self.skipped.is_alias(assignment.target[0]) for assignment in self.branches.assignments]
        for assignment_left in [*compress(self.branches.assignments, are_aliases)]:
            self.skip_assignment(assignment_left)
        self.branches.assignments = [
            assignment
            for assignment, is_alias in zip(self.branches.assignments, are_aliases, strict=True)
            if not is_alias
        ]
        self.skipped.refuse_written_over()
        for assignment_left in [*self.branches.assignments]:
            item = self.scope.find_instance(assignment_left.target[0].upper)
            if item is None or len(assignment_left.target) < 2:
                continue
            row = self.scope.find_parameter(item, assignment_left.target[1:], "input")
            other = self.assignments.get((item.name, row.name))
            if other is not None and other.place is None:
                line = other.tokens[0].line
                message = f"{item.name}.{row.name} is an argument of the call in line {line}, which writes over this"
                raise assignment_left.target[0].error(message)
            if other is not None and other.place is not None:
                self.branches.assignments.append(other.place)
                del self.assignments[item.name, row.name]

    def skip_assignment(self, guarded: GuardedAssignment) -> None:
        """An assignment that does not concern the blocks."""
        first, end = guarded.target[0], guarded.value[-1]
        self.scope.assigned_variables.setdefault(first.upper, first)
        inside = (Token("sign", ":=", guarded.line, end.column), *guarded.value)
        self.skipped.skip_statement((*guarded.target, *inside, Token(END, "", end.line, end.column)))

    def sample_times(self, plc: Mapping[str, object]) -> None:
        """The intervals of the loops that are not called in every cycle; they must agree with the comments."""
        used_otherwise = {*self.scope.assigned_variables, *self.scope.used_variables}
        for item, place in self.counted_loops:
            if place.upper not in self.cycles_by_counter or place.upper in used_otherwise:
                raise place.error(f"{place.text} is not counted as in {place.text} := ({place.text} + 1) MOD 5")
            item.cycles = self.cycles_by_counter[place.upper]
        task = _time_seconds(plc.get("sample_time"))
        for item in self.scope.items.values():
            time = _time_seconds(item.entry.get("sample_time"))
            if item.place is None or (item.cycles == 1 and time is None):
                continue
            if task is None and time is None:
                item.entry["cycles"] = item.cycles
            if time is None and task is not None:
                item.entry["sample_time"] = plain_number(task * item.cycles)
            elif task is not None and time is not None and time != task * item.cycles:
                message = f"{item.name} is called in every {item.cycles} cycles of {task} s, not of {time} s together"
                raise item.place.error(message)


def _split_statements(tokens: Sequence[Token]) -> list[tuple[Token, ...]]:
    """Statements that each end with a semicolon; none where something else is among them."""
    parts: list[tuple[Token, ...]] = []
    start = 0
    for at, token in enumerate(tokens):
        if token.text == ";":
            parts.append(tuple(tokens[start:at]))
            start = at + 1
    is_complete = start == len(tokens) and all(len(part) > 1 and part[0].upper not in STATEMENT_ENDS for part in parts)
    return parts if is_complete else []


def _time_seconds(value: object) -> Decimal | None:
    """A time of the settings; None where it is missing or not a time."""
    try:
        return None if value is None else parse_seconds(value)
    except ValueError:
        return None
