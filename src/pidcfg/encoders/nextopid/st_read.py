"""Structured Text to a listing: what the program declares and calls, and what its comments say beside."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.listing import Listing, ListingError, few
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.st_calls import Calls
from pidcfg.encoders.nextopid.st_expression import wire_text
from pidcfg.encoders.nextopid.st_moves import Moves
from pidcfg.encoders.nextopid.st_scope import SIGNAL_TYPES, Scope, can_wire, check_name
from pidcfg.encoders.nextopid.st_source import parse_st
from pidcfg.encoders.nextopid.st_wiring import Wiring
from pidcfg.encoders.nextopid.wiring import Layout
from pidcfg.encoders.st.values import content_of
from pidcfg.schemas.base import parse_seconds
from pidcfg.schemas.expressions import MAX_LENGTH, ExpressionError
from pidcfg.schemas.iec import REAL, Wire
from pidcfg.schemas.nextopid import Plc
from pidcfg.schemas.numbers import decimal_text, plain_number

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from decimal import Decimal
    from typing import Any

    from pidcfg.encoders.nextopid.st_calls import Assignment
    from pidcfg.encoders.nextopid.st_scope import Item
    from pidcfg.encoders.nextopid.st_source import Source
    from pidcfg.encoders.nextopid.wiring import Wires
    from pidcfg.encoders.parameters import Content, Parameter
    from pidcfg.encoders.st.lex import Token
    from pidcfg.encoders.st.parse import Declaration, Initial


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
    for statement in source.statements:
        calls.take(statement)
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


def _with_task(plc: Mapping[str, Any], interval: Decimal, at: Token) -> dict[str, Any]:
    """What is beside the parameters, with the interval of the task; raises `ListingError` where the comments differ."""
    said = plc.get("sample_time")
    if said is not None and not _is_time(said, interval):
        raise at.error(f"the task calls the program every {decimal_text(interval)} s, and the comments say {said}")
    return {**plc, "sample_time": plain_number(interval)}


def _is_time(said: Any, interval: Decimal) -> bool:
    """Whether a comment says that time; what is none is another one."""
    try:
        return parse_seconds(said) == interval
    except (ValueError, TypeError):
        return False


def _with_program(plc: Mapping[str, Any], program: Token) -> dict[str, Any]:
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
        return Wire(wire_text(wiring.code, wiring.constants, wiring.names.__getitem__, MAX_LENGTH))

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
