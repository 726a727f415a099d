"""Structured Text to a listing: what the program declares and calls, and what its comments say beside."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.listing import Listing, ListingError
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.st_calls import Calls
from pidcfg.encoders.nextopid.st_expression import wire_text
from pidcfg.encoders.nextopid.st_parse import parse_st
from pidcfg.encoders.nextopid.st_scope import Scope, can_wire, check_name
from pidcfg.encoders.nextopid.st_values import Wiring, content_of
from pidcfg.encoders.nextopid.wiring import Layout
from pidcfg.schemas.expressions import MAX_LENGTH, ExpressionError
from pidcfg.schemas.iec import BOOL, REAL, Wire
from pidcfg.schemas.nextopid import Plc

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Any

    from pidcfg.encoders.nextopid.st_calls import Given
    from pidcfg.encoders.nextopid.st_lex import Token
    from pidcfg.encoders.nextopid.st_parse import Declaration, Initial, Source
    from pidcfg.encoders.nextopid.st_scope import Item
    from pidcfg.encoders.nextopid.wiring import Wires
    from pidcfg.encoders.parameters import Content, Parameter

FEW = 12
"""Names that a note lists before it only counts."""


def read_st(text: str) -> Listing:
    """The parameters and wires of a program; raises `ListingError` at what cannot be read or would change meaning."""
    return read_source(parse_st(text))


def read_source(source: Source) -> Listing:
    """As `read_st`, of what has been taken apart."""
    found = Listing(vendor="nextopid")
    scope = Scope.of(source, found)
    described = bool(found.plc)
    calls = Calls(scope)
    for statement in source.statements:
        calls.take(statement)
    reader = _Reader(scope, calls, found)
    reader.initial_values()
    reader.call_values()
    calls.sample_times(found.plc)
    signals = list(scope.signals(everything=described))
    words, lines = found.words, found.lines
    found.words, found.lines, found.shown = {}, {}, {}
    for own in signals:
        found.add(own.name.text, _first_value(own), own.name.text, own.name.line, own.name.column)
    for name, value in words.items():
        found.add(name, value, name, lines[name])
    if source.program is not None:
        found.plc = _with_program(found.plc, source.program)
    found.settings = tuple(item.entry for item in scope.items.values())
    found.notes = tuple(reader.notes(signals))
    return found


def with_zeros(found: Listing) -> Listing:
    """What a program does not mention of its instances is 0, as IEC 61131-3 has it; a note says which."""
    for entry in found.settings:
        kind, name = BLOCK_TYPES[entry["type"]], entry.get("loop") or entry.get("block")
        left = []
        for row in () if kind.function else kind.inputs:
            field, full = kind.model.model_fields.get(row.name), f"{name}.{row.name}"
            if field is not None and field.is_required() and full not in found.words:
                found.add(full, row.type.default, full)
                left.append(row.name)
        if left:
            found.notes = (*found.notes, f"{name}: {', '.join(left)} are not given in the program, and so are 0")
    return found


def _with_program(plc: Mapping[str, Any], program: Token) -> dict[str, Any]:
    """What is beside the parameters, with the name that the program has."""
    check_name(program.text, program.line, program.column)
    entry = {key: value for key, value in plc.items() if key != "program"}
    return entry if program.text == Plc.model_fields["program"].default else entry | {"program": program.text}


def _first_value(own: Declaration) -> Content:
    """What a signal begins with."""
    kind = BOOL if own.type_name == "BOOL" else REAL
    if own.initial is None:
        return kind.default
    value = None if isinstance(own.initial, dict) or not own.initial else content_of(own.initial, kind, own.name.text)
    if value is None:
        raise own.name.error(f"{own.name.text} is read by a block, and begins with something that is no literal")
    return value


class _Reader:
    """Turns initial values and arguments into words."""

    def __init__(self, scope: Scope, calls: Calls, found: Listing) -> None:
        self.scope, self.calls, self.found = scope, calls, found
        self.places: dict[tuple[str, str], Given] = {}

    # --- values ------------------------------------------------------------------------------------------------------

    def initial_values(self) -> None:
        """Those of instances, and of variables that stand for inputs of functions."""
        wired = {*self.calls.given}
        for own in self.scope.items.values():
            declared = self.scope.variables.get(own.name.upper())
            if declared is None or own.kind.function or declared.initial is None:
                continue
            if not isinstance(declared.initial, dict):
                raise declared.name.error(
                    f"{own.name}: initial values of an instance stand in parentheses, (SP := 50.0)"
                )
            self._members(own, (), declared.initial, wired)
        for upper, (own, row) in self.scope.stands.items():
            initial = self.scope.variables[upper].initial
            if row.access == "input" and initial is not None and (own.name, row.name) not in wired:
                self._literal(own, row, initial, self.scope.variables[upper].name)

    def _members(self, own: Item, above: tuple[Token, ...], initial: Initial, wired: set[tuple[str, str]]) -> None:
        for name, value in initial.values() if isinstance(initial, dict) else ():
            if isinstance(value, dict):
                self._members(own, (*above, name), value, wired)
                continue
            row = self.scope.row(own, (*above, name), "input")
            if (own.name, row.name) not in wired:
                self._literal(own, row, value, name)

    def _literal(self, own: Item, row: Parameter, value: Initial, at: Token) -> None:
        full = f"{own.name}.{row.name}"
        content = content_of(value, row.type, full) if value and not isinstance(value, dict) else None
        if content is None:
            raise at.error(f"{full} begins with something that is no literal")
        self.found.add(full, content, full, at.line, at.column)

    def call_values(self) -> None:
        """Arguments and assignments."""
        for given in self.calls.given.values():
            own, row, tokens, _ = given
            full = f"{own.name}.{row.name}"
            content = content_of(tokens, row.type, full)
            if content is None:
                field = own.kind.model.model_fields.get(row.name)
                if field is None or not can_wire(field.annotation):
                    raise tokens[0].error(f"{full} takes a literal, and cannot be wired")
                self.places[own.name, row.name] = given
            value = self._wire(row, tokens) if content is None else content
            self.found.add(full, value, full, tokens[0].line, tokens[0].column)

    def _wire(self, row: Parameter, tokens: tuple[Token, ...]) -> Wire:
        if row.type is BOOL:
            names = tokens[::2]
            if len(names) * 2 - 1 != len(tokens) or any(token.text != "." for token in tokens[1::2]):
                raise tokens[0].error(f"a BOOL is wired by the name of another BOOL; {row.name} is not")
            return Wire(self.scope.resolve(names)[0])
        wiring = Wiring.read(tokens, row.type, self.scope.resolve)
        return Wire(wire_text(wiring.code, wiring.constants, wiring.names.__getitem__, MAX_LENGTH))

    # --- order -------------------------------------------------------------------------------------------------------

    def notes(self, signals: list[Declaration]) -> Iterator[str]:
        """What was passed over, and what will be executed in another order; checks every wire."""
        layout = Layout.of(
            {own.name.text: BOOL if own.type_name == "BOOL" else REAL for own in signals},
            [(item.name, item.kind) for item in self._in_order()],
        )
        wires: Wires = {}
        numbers = {own.name: i for i, own in enumerate(layout.instances)}
        for (name, row), given in self.places.items():
            wire = self.found.words[f"{name}.{row}"]
            try:
                wires[numbers[name], row] = layout.read(given.row.type, wire.text)
            except ExpressionError as error:
                raise given.tokens[0].error(f"{name}.{row}: {error.message}") from None
        yield from self._missing_calls()
        yield from self._other_order(layout, wires)
        if self.calls.foreign:
            lines = _few([str(line) for line in self.calls.foreign])
            yield f"statements that are not about blocks of the library are left out: lines {lines}"
        own = {declaration.name.upper for declaration in signals} | {*self.scope.items} | {*self.scope.stands}
        left = [d.name.text for upper, d in self.scope.variables.items() if upper not in own | self.calls.counters]
        if left:
            yield f"variables that no block reads are left out: {_few(left)}"
        whole = [d.name.text for d in signals if d.type_name not in {"BOOL", "REAL"}]
        if whole:
            yield f"these variables are not REAL in the program, and are REAL signals here: {_few(whole)}"

    def _in_order(self) -> list[Item]:
        """As a configuration has them: blocks before loops."""
        return sorted(self.scope.items.values(), key=lambda item: "loop" in item.entry)

    def _missing_calls(self) -> Iterator[str]:
        missing = [item for item in self.scope.items.values() if not item.known]
        functions = [item.name for item in missing if item.kind.function]
        if functions:
            raise ListingError(f"{functions[0]} is a function of the comments, and nothing calls it")
        if missing and self.calls.turns:
            yield f"these blocks are declared and never called: {_few([item.name for item in missing])}"

    def _other_order(self, layout: Layout, wires: Wires) -> Iterator[str]:
        """Where a value of the previous cycle becomes one of the same, or the other way round."""
        turn = {i: at for at, i in enumerate(layout.order(wires))}
        items = {own.name: self.scope.items[own.name.upper()] for own in layout.instances}
        for (i, row), wire in wires.items():
            given = self.places[layout.instances[i].name, row]
            for number in sorted(wire.signals):
                owner = layout.owner(number)
                if owner is None or (layout.is_input(number) and not self._wired(layout, wires, number)):
                    continue
                other = items[layout.instances[owner].name]
                was_before = 0 <= other.turn < given.turn
                if other.known and was_before != (turn[owner] < turn[i]):
                    which = "same" if was_before else "previous"
                    name = layout.instances[i].name
                    yield (
                        f"{name}.{row} reads {other.name} of the {which} cycle in the program, and of the "
                        f"{'previous' if was_before else 'same'} one in the order of the configuration"
                    )

    def _wired(self, layout: Layout, wires: Wires, number: int) -> bool:
        own = layout.instances[layout.owner(number) or 0]
        return (layout.owner(number), own.kind.table.rows[number - own.base].name) in wires


def _few(names: list[str]) -> str:
    return ", ".join(names[:FEW]) + (f" and {len(names) - FEW} more" if len(names) > FEW else "")
