"""Calls and assignments of a program that concern blocks of the library.

Other statements are skipped, and their lines noted. What a configuration cannot express is refused: a call or an
assignment inside IF, a second call of a block, an assignment after the call.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import compress
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.nextopid.st_branches import BRANCHES, Branches, Guarded, is_latch
from pidcfg.encoders.nextopid.st_foreign import STRUCTURE, Foreign
from pidcfg.encoders.nextopid.st_scope import LIBRARY
from pidcfg.encoders.st.lex import END, NAME, Token
from pidcfg.encoders.st.parse import ENDS, Statement, arguments, chain
from pidcfg.encoders.st.values import INTEGERS, number_of
from pidcfg.schemas.base import parse_seconds
from pidcfg.schemas.numbers import plain_number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from decimal import Decimal

    from pidcfg.encoders.nextopid.st_scope import Item, Scope
    from pidcfg.encoders.parameters import Parameter
    from pidcfg.encoders.st.parse import Argument

RESULTS = ("AutoTuneResult", "ErrBits", "WarnBits")
"""Outputs that are structures."""


class Assignment(NamedTuple):
    """The value that a parameter is assigned: its tokens, and the number of calls before it."""

    item: Item
    row: Parameter
    tokens: tuple[Token, ...]
    turn: int
    place: Guarded | None = None
    """The statement, where it is one of its own before the call."""


@dataclass(slots=True)
class Calls:
    """All calls and assignments of a program."""

    scope: Scope
    assignments: dict[tuple[str, str], Assignment] = field(default_factory=dict)
    turns: int = 0
    left: Foreign = field(init=False)
    """Statements that are left out."""
    gates: list[tuple[Item, Token]] = field(default_factory=list)
    """Loops that are not called in every cycle, each with its cycle counter."""
    counters: set[str] = field(default_factory=set)
    """These counters, in capitals."""
    counts: dict[str, int] = field(default_factory=dict)
    branches: Branches = field(init=False)
    """Assignments that may be moves."""
    reads: dict[str, set[str]] = field(default_factory=dict)
    """What the wires of each block read."""

    def __post_init__(self) -> None:
        self.left = Foreign(self.scope)
        self.branches = Branches(lambda: self.turns, self.left.pass_over)

    def take(self, statement: Statement) -> None:
        """The next statement."""
        tokens = statement.tokens
        if tokens[0].kind == NAME and tokens[0].upper in ENDS:
            if self._counted_call(tokens):
                return
            if tokens[0].upper in BRANCHES:
                self.branches.take(tokens)
            else:
                self.left.pass_over(tokens)
            return
        parts = chain(tokens)
        behind = tokens[2 * len(parts) - 1 :] if parts else tokens
        if parts and behind[0].text == ":=" and len(behind) > 2:
            self._assign(parts, behind[1:-1], tokens)
        elif parts and behind[0].text == "(":
            self._call(parts, behind[:-1], tokens)
        elif parts and is_latch(behind):
            self.branches.take(tokens)
        else:
            self.left.pass_over(tokens)

    # --- calls -------------------------------------------------------------------------------------------------------

    def _call(self, parts: tuple[Token, ...], inside: Sequence[Token], tokens: tuple[Token, ...]) -> None:
        item, kind = self.scope.instance(parts[0].upper), LIBRARY.get(parts[0].upper)
        if len(parts) > 1 or (item is None and kind is None):
            self.left.pass_over(tokens)
            return
        inputs = arguments(inside, parts[0].text)
        if item is None:
            if kind is None or not kind.function:
                raise parts[0].error(f"{parts[0].text} is a function block: declare an instance, and call that")
            item = self._function(LIBRARY[parts[0].upper], inputs, parts[0])
        if item.called:
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
        item.place, item.turn = parts[0], self.turns
        self.turns += 1

    def _function(self, kind: Any, inputs: list[Argument], at: Token) -> Item:
        """The function that is called: the one that the comments at its variables name, or a new one."""
        stems: dict[str, str] = {}
        for argument in inputs:
            if argument.sign != "=>" or len(argument.value) != 1:
                continue
            target = argument.value[0]
            if target.upper in self.scope.aliases:
                item = self.scope.aliases[target.upper][0]
                if item.kind is not kind:
                    raise at.error(f"{target.text} stands for a parameter of {item.name}, which is no {kind.name}")
                return item
            stem = target.text.removesuffix(f"_{argument.name.text}")
            stems[stem.upper()] = stem if stem != target.text else ""
        return self.scope.new_function(kind, next(iter(stems.values())) or None if len(stems) == 1 else None, at)

    def _set_alias(self, item: Item, argument: Argument) -> None:
        """An output is copied to a variable, which from then on is an alias of it."""
        target = argument.value[0]
        prefix = next((name for name in RESULTS if name.upper() == argument.name.upper), "")
        if prefix and len(argument.value) == 1 and target.upper in self.scope.variables:
            self.scope.structures[target.upper] = (item, argument.name)
            return
        row = self.scope.row(item, (argument.name,), "output")
        if len(argument.value) != 1 or target.upper not in self.scope.variables or target.upper in self.scope.items:
            self.left.pass_over(argument.value)
            return
        before = self.scope.aliases.get(target.upper)
        if before is not None and (before[0].name, before[1].name) != (item.name, row.name):
            raise target.error(f"{target.text} stands for {before[0].name}.{before[1].name} already")
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
        row = self.scope.row(item, parts, "input")
        if item.called:
            raise parts[0].error(f"{item.name}.{row.name} is assigned behind the call of {item.name}; assign it before")
        alias = self.scope.aliases.get(value[0].upper)
        if item.kind.function and len(value) == 1 and alias and alias[0] is item and alias[1] is row:
            return  # the variable of this input, which was assigned before or has an initial value
        if (item.name, row.name) in self.assignments:
            raise parts[0].error(f"{item.name}.{row.name} is assigned again")
        self.assignments[item.name, row.name] = Assignment(item, row, value, self.turns)

    # --- assignments -------------------------------------------------------------------------------------------------

    def _assign(self, parts: tuple[Token, ...], value: tuple[Token, ...], tokens: tuple[Token, ...]) -> None:
        item = self.scope.instance(parts[0].upper)
        if item is not None and len(parts) > 1:
            self._assign_input(item, parts, value)
            return
        alias = self.scope.aliases.get(parts[0].upper)
        if alias and len(parts) == 1 and alias[1].access == "input":
            self._set_input(alias[0], (parts[0]._replace(text=alias[1].name),), value)
            return
        if len(parts) == 1 and self._counting(parts[0], value):
            return
        if len(parts) == 1 and not alias and item is None:
            self.branches.take(tokens)
            return
        self.left.pass_over(tokens)

    def _assign_input(self, item: Item, parts: tuple[Token, ...], value: tuple[Token, ...]) -> None:
        """An input of an instance is assigned: a wire before its call, where nothing else assigns it; else a move."""
        row = self.scope.row(item, parts[1:], "input")
        if item.called:
            self.branches.found.append(Guarded(parts, value, (), len(self.branches.found), self.turns))
            return
        self._set_input(item, parts[1:], value)
        place = Guarded(parts, value, (), len(self.branches.found) - 0.5, self.turns)
        self.assignments[item.name, row.name] = self.assignments[item.name, row.name]._replace(place=place)

    def _counted_call(self, tokens: tuple[Token, ...]) -> bool:
        """``IF counter = 0 THEN loop(…); END_IF``: the call of a loop in every n-th cycle."""
        if [token.upper for token in (tokens[0], *tokens[2:5])] != ["IF", "=", "0", "THEN"]:
            return False
        loop = self.scope.instance(tokens[5].upper)
        counter = self.scope.variables.get(tokens[1].upper)
        inner = _parted(tokens[5:-2])
        if loop is None or counter is None or counter.type_name not in INTEGERS or not inner:
            return False
        if any(statement[0].upper != loop.name.upper() for statement in inner) or tokens[1].upper in self.counts:
            return False
        if inner[-1][1].text != "(" or any(statement[1].text != "." for statement in inner[:-1]):
            return False
        if isinstance(counter.initial, dict) or [token.text for token in counter.initial or ()] not in ([], ["0"]):
            raise counter.name.error(f"{counter.name.text} counts the cycles of {loop.name}, and must begin with 0")
        for statement in inner:
            self.take(Statement((*statement, tokens[-1])))
        self.gates.append((loop, tokens[1]))
        self.counters.add(tokens[1].upper)
        return True

    def _counting(self, counter: Token, value: tuple[Token, ...]) -> bool:
        """``counter := (counter + 1) MOD n`` after such a call."""
        texts = [token.upper for token in value]
        if counter.upper not in self.counters or texts[:-1] != ["(", counter.upper, "+", "1", ")", "MOD"]:
            return False
        cycles = number_of(value[-1])
        if isinstance(cycles, bool) or not isinstance(cycles, int) or cycles < 1 or counter.upper in self.counts:
            return False
        self.counts[counter.upper] = cycles
        return True

    def reads_of(self, item: Item) -> set[str]:
        """What the wires of a block read."""
        return self.reads.get(item.name, set())

    def settle_inputs(self) -> None:
        """Inputs that are assigned more than once: all of that are moves; refuses what a call writes over."""
        held = [self.left.is_held(one.target[0]) for one in self.branches.found]
        for guarded in [*compress(self.branches.found, held)]:
            self.pass_over(guarded)
        self.branches.found = [one for one, is_held in zip(self.branches.found, held, strict=True) if not is_held]
        self.left.refuse_written_over()
        for guarded in [*self.branches.found]:
            item = self.scope.instance(guarded.target[0].upper)
            if item is None or len(guarded.target) < 2:
                continue
            row = self.scope.row(item, guarded.target[1:], "input")
            other = self.assignments.get((item.name, row.name))
            if other is not None and other.place is None:
                line = other.tokens[0].line
                message = f"{item.name}.{row.name} is an argument of the call in line {line}, which writes over this"
                raise guarded.target[0].error(message)
            if other is not None and other.place is not None:
                self.branches.found.append(other.place)
                del self.assignments[item.name, row.name]

    def pass_over(self, guarded: Guarded) -> None:
        """An assignment that does not concern the blocks."""
        first, end = guarded.target[0], guarded.value[-1]
        self.scope.assigned.setdefault(first.upper, first)
        inside = (Token("sign", ":=", guarded.line, end.column), *guarded.value)
        self.left.pass_over((*guarded.target, *inside, Token(END, "", end.line, end.column)))

    def sample_times(self, plc: Mapping[str, Any]) -> None:
        """The intervals of the loops that are not called in every cycle; they must agree with the comments."""
        for item, place in self.gates:
            if place.upper not in self.counts or place.upper in self.scope.assigned:
                raise place.error(f"{place.text} is not counted as in {place.text} := ({place.text} + 1) MOD 5")
            item.cycles = self.counts[place.upper]
        task = _seconds(plc.get("sample_time"))
        for item in self.scope.items.values():
            time = _seconds(item.entry.get("sample_time"))
            if item.place is None or (item.cycles == 1 and time is None):
                continue
            if task is None and time is None:
                item.entry["cycles"] = item.cycles
            if time is None and task is not None:
                item.entry["sample_time"] = plain_number(task * item.cycles)
            elif task is not None and time is not None and time != task * item.cycles:
                message = f"{item.name} is called in every {item.cycles} cycles of {task} s, not of {time} s together"
                raise item.place.error(message)


def _parted(tokens: Sequence[Token]) -> list[tuple[Token, ...]]:
    """Statements that each end with a semicolon; none where something else is among them."""
    parts: list[tuple[Token, ...]] = []
    start = 0
    for at, token in enumerate(tokens):
        if token.text == ";":
            parts.append(tuple(tokens[start:at]))
            start = at + 1
    plain = start == len(tokens) and all(len(part) > 1 and part[0].upper not in ENDS for part in parts)
    return parts if plain else []


def _seconds(value: object) -> Decimal | None:
    """A time of the settings; None where it is missing or not a time."""
    try:
        return None if value is None else parse_seconds(value)
    except ValueError:
        return None
