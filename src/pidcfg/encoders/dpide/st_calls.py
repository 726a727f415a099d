"""Calls of DPIDE in a program, directly or of a function block with the instruction inside, and what is around them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.dpide.program import EN, ENABLE_INTERRUPTS, INSTRUCTION, OPERANDS, PULSES, TIMER
from pidcfg.encoders.dpide.st_scope import Binding, Scope, joined
from pidcfg.encoders.maps.dpide import ROWS
from pidcfg.encoders.st.lex import END, NAME
from pidcfg.encoders.st.parse import Cursor
from pidcfg.schemas.names import nearest

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.dpide.st_units import Guard, Step, Unit
    from pidcfg.encoders.st.lex import Token

Arguments = dict[str, tuple["Token", tuple["Token", ...]]]
"""What stands at a parameter, by its name, with the place of that."""
SECTIONS = ("VAR_INPUT", "VAR_IN_OUT", "VAR_OUTPUT")
COMMA = frozenset((",", ")"))


@dataclass(frozen=True, slots=True)
class Instruction:
    """A call of the instruction: its place, its operands, and the conditions around."""

    place: Token
    operands: Mapping[str, Binding]
    enable: tuple[Token, ...] = ()
    guards: tuple[Guard, ...] = ()
    block: str = ""
    """The function block that it stands in."""
    instance: str = ""
    scope: Scope = field(default_factory=Scope)
    """The variables where it is called."""


class Template(NamedTuple):
    """A function block with the instruction inside: its parameters in their order, and what stands at each operand."""

    name: Token
    parameters: tuple[str, ...]
    outputs: frozenset[str]
    operands: Mapping[str, tuple[Token, ...]]
    scope: Scope
    sections: Mapping[str, str]


def arguments(step: Step, names: Sequence[str], outputs: frozenset[str], what: str) -> Arguments:
    """The arguments of a call by name or by position (D602); ``names`` in their order, before which EN may stand."""
    cursor = Cursor(step.tokens[1:])
    cursor.expect("(", what)
    listed: list[tuple[Token | None, str, tuple[Token, ...]]] = []
    while cursor.here.text != ")":
        start = cursor.here
        value = cursor.until(frozenset((",", ")", ":=", "=>")))
        sign = cursor.here.text if cursor.here.text in {":=", "=>"} else ""
        if sign:
            if len(value) != 1 or value[0].kind != NAME:
                raise start.error(f"the name of an operand of {what} stands before {sign}, as in SV := D100")
            cursor.take()
            listed.append((value[0], sign, cursor.until(COMMA)))
        else:
            listed.append((None, "", value))
        if not listed[-1][2]:
            raise start.error(f"an operand of {what} is missing before {cursor.here.text!r}")
        if cursor.here.text != ")":
            cursor.expect(",", f"an operand of {what}")
            if cursor.here.text == ")":
                raise cursor.here.error(f"an operand of {what} is missing after the comma")
    cursor.take()
    if cursor.here.kind != END:
        raise cursor.here.error(f"{cursor.here.text!r} stands behind the call of {what}")
    if any(name is not None for name, _, _ in listed):
        return _by_name(listed, names, outputs, what)
    return _by_position([value for _, _, value in listed], names, step.first, what)


def _by_position(values: list[tuple[Token, ...]], names: Sequence[str], at: Token, what: str) -> Arguments:
    order = names if len(values) == len(names) else (EN, *names)
    if len(values) != len(order):
        place = values[len(order)][0] if len(values) > len(order) else at
        wanted = f"{len(names)} operands, or {len(names) + 1} with EN before them"
        raise place.error(f"{what} has {wanted}; {len(values)} stand here: write them all, or write them by name")
    return {name.upper(): (value[0], value) for name, value in zip(order, values, strict=True)}


def _by_name(
    listed: Sequence[tuple[Token | None, str, tuple[Token, ...]]],
    names: Sequence[str],
    outputs: frozenset[str],
    what: str,
) -> Arguments:
    found: Arguments = {}
    known = {name.upper(): name for name in (EN, *names, "ENO")}
    for name, sign, value in listed:
        if name is None:
            raise value[0].error(f"{joined(value)[:40]} has no name; operands of {what} are all named, or none is")
        if name.upper not in known:
            near = nearest(name.upper, known)
            hint = f"; did you mean {known[near]}?" if near else f"; it has {', '.join(names)}"
            raise name.error(f"{what} has no operand {name.text}{hint}")
        wanted = "=>" if name.upper in outputs or name.upper == "ENO" else ":="
        if sign != wanted:
            kind = "an output" if wanted == "=>" else "an input"
            raise name.error(
                f"{name.text} is {kind} of {what}; write {known[name.upper]} {wanted} {joined(value)[:40]}"
            )
        if name.upper in found:
            raise name.error(f"{name.text} stands here again")
        found[name.upper] = (name, value)
    return found


@dataclass(slots=True)
class Calls:
    """Every call of the instruction in the units of a text, in their order, and the statements around them."""

    globals: Scope
    templates: dict[str, Template] = field(default_factory=dict)
    found: list[Instruction] = field(default_factory=list)
    called: dict[str, Token] = field(default_factory=dict)
    """Instances that are called."""
    timers: list[tuple[Step, tuple[tuple[Token, ...], ...]]] = field(default_factory=list)
    pulses: list[tuple[Step, tuple[tuple[Token, ...], ...]]] = field(default_factory=list)
    others: list[tuple[Scope, Step]] = field(default_factory=list)

    def scope_of(self, unit: Unit) -> Scope:
        """The variables of a unit, over those of all."""
        scope = Scope()
        scope.declare(unit.declarations)
        scope.symbols = {**self.globals.symbols, **scope.symbols}
        scope.at = {**self.globals.at, **scope.at}
        return scope

    def add_template(self, unit: Unit) -> None:
        """A function block, if the instruction is inside."""
        scope, steps = self.scope_of(unit), [step for step in unit.steps if step.first.upper == INSTRUCTION]
        if not steps or unit.name is None:
            for step in unit.steps:
                self._refuse_inside(step)
                self.others.append((scope, step))
            return
        if len(steps) > 1:
            raise steps[1].first.error(f"{INSTRUCTION} stands in {unit.name.text} again; one function block has one")
        self._refuse_guarded(steps[0], unit.name.text)
        given = self._operands(steps[0], arguments(steps[0], OPERANDS, OUTPUTS, INSTRUCTION))
        sections = {item.name.upper: item.section for item in unit.declarations}
        parameters = [item.name.text for section in SECTIONS for item in unit.declarations if item.section == section]
        outputs = frozenset(name for name, section in sections.items() if section == "VAR_OUTPUT")
        for name, value in given.items():
            scope.bind(ROWS[name], value)
        self.templates[unit.name.upper] = Template(unit.name, tuple(parameters), outputs, given, scope, sections)
        self.others += [(scope, step) for step in unit.steps if step is not steps[0]]

    def _refuse_guarded(self, step: Step, name: str) -> None:
        if step.guards:
            line = step.guards[0].tokens[0].line
            raise step.first.error(f"{INSTRUCTION} stands inside the IF of line {line} in {name}; call {name} there")

    def take(self, unit: Unit) -> None:
        """The statements of a program."""
        scope = self.scope_of(unit)
        for step in unit.steps:
            word = step.first.upper if step.first.kind == NAME else ""
            symbol = scope.symbols.get(word)
            template = self.templates.get(symbol.declaration.type_name) if symbol else None
            is_call = len(step.tokens) > 1 and step.tokens[1].text == "("
            if word == INSTRUCTION and is_call:
                given = arguments(step, OPERANDS, OUTPUTS, INSTRUCTION)
                enable = given.get(EN, (step.first, ()))[1]
                bound = {name: scope.bind(ROWS[name], value) for name, value in self._operands(step, given).items()}
                self.found.append(Instruction(step.first, bound, enable, step.guards, scope=scope))
            elif template is not None and is_call:
                self._instance(step, template, scope)
            elif word == TIMER and is_call:
                self.timers.append((step, _values(step)))
            elif word == PULSES and is_call:
                self.pulses.append((step, _values(step)))
            elif joined(step.tokens[:-1]).upper() != f"{ENABLE_INTERRUPTS}()":
                self._refuse_inside(step)
                self.others.append((scope, step))

    def _instance(self, step: Step, template: Template, scope: Scope) -> None:
        name = step.first
        if name.upper in self.called:
            raise name.error(f"{name.text} is called again, after line {self.called[name.upper].line}")
        self.called[name.upper] = name
        given = arguments(step, template.parameters, template.outputs, template.name.text)
        bound = {
            operand: self._through(template, operand, value, given, scope, name)
            for operand, value in template.operands.items()
        }
        enable = given.get(EN, (name, ()))[1]
        block, instance = template.name.text, scope.symbols[name.upper].name
        self.found.append(Instruction(name, bound, enable, step.guards, block, instance, scope))

    def _through(
        self,
        template: Template,
        operand: str,
        value: tuple[Token, ...],
        given: Arguments,
        scope: Scope,
        at: Token,
    ) -> Binding:
        """What stands at an operand of a function block's instruction, seen from the call of the block."""
        upper = joined(value).upper()
        section = template.sections.get(upper, "VAR")
        if section not in SECTIONS:
            return template.scope.bind(ROWS[operand], value)
        if upper in given:
            return scope.bind(ROWS[operand], given[upper][1])
        if section == "VAR_INPUT" and template.scope.symbols[upper].declaration.initial:
            return template.scope.bind(ROWS[operand], value)
        raise at.error(f"the call of {template.name.text} has no {joined(value)}, which is {operand} of {INSTRUCTION}")

    def _operands(self, step: Step, given: Arguments) -> dict[str, tuple[Token, ...]]:
        """All operands in the manual's order; raises `ListingError` naming those that are missing."""
        missing = [name for name in OPERANDS if name.upper() not in given]
        if missing:
            count = f"{len(OPERANDS) - len(missing)} of its {len(OPERANDS)} operands"
            raise step.first.error(f"{INSTRUCTION} has {count} here; write {', '.join(missing)}, too")
        return {name: given[name.upper()][1] for name in OPERANDS}

    def _refuse_inside(self, step: Step) -> None:
        """Refuses an instruction inside a statement where nobody knows how often it is executed, or what it gives."""
        for at, token in enumerate(step.tokens):
            is_name = token.kind == NAME and (not at or step.tokens[at - 1].text != ".")
            if is_name and token.upper == INSTRUCTION:
                where = f"inside {step.first.text}" if step.is_compound else "inside another statement"
                raise token.error(f"{INSTRUCTION} stands {where}; a configuration has a call that stands by itself")


OUTPUTS = frozenset(name.upper() for name, row in ROWS.items() if row.access == "output")


def _values(step: Step) -> tuple[tuple[Token, ...], ...]:
    """What stands between the commas of a call, names of operands left out."""
    return tuple(_split(step.tokens[2:-1]))


def _split(tokens: Sequence[Token]) -> Iterator[tuple[Token, ...]]:
    value: list[Token] = []
    for token in tokens:
        if token.text in {",", ")"}:
            yield tuple(value)
            value = []
        elif token.text in {":=", "=>"}:
            value = []
        else:
            value.append(token)
