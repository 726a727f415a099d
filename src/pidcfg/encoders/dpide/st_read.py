"""Structured Text to a listing: a loop for each call of DPIDE, its devices, and what its operands hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from pidcfg.encoders.dpide.image import SUFFIXES, WORD_BREAK
from pidcfg.encoders.dpide.st_scope import (
    ALWAYS_ON_BIT,
    EN,
    ENABLE_INTERRUPTS,
    IN_OUT_OPERANDS,
    INSTANCE_SUFFIX,
    INSTRUCTION,
    OPERAND_NAMES,
    PULSES,
    SYMBOL_OPERANDS,
    TIMER,
    Binding,
    Guard,
    Scope,
    Step,
    SymbolListing,
    Unit,
    constant_content,
    device_in,
    initial_value,
    is_constant,
    join_tokens,
    units_of,
    value_in,
)
from pidcfg.encoders.dpide.symbols import Row
from pidcfg.encoders.image import default_name
from pidcfg.encoders.listing import Listing, ListingError, shorten_names
from pidcfg.encoders.maps.dpide import LOOPS, ROWS
from pidcfg.encoders.parameter_files import ParameterListing
from pidcfg.encoders.parameters import Content, UnknownContent
from pidcfg.encoders.structured_text import END, NAME, Comment, Cursor, Token, drop_externals, settings_of
from pidcfg.schemas.dpide import parse_timer
from pidcfg.schemas.iec import Wire
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Data
from pidcfg.text.signs import closest_name

# ----------------------------------------------------------------------------------------------------------------------
# What is left out of a program, as far as it concerns operands: what may write them, and jumps around the calls.

JUMPS = frozenset(("RETURN", "JMP"))
LATCH_WORDS = frozenset(("S", "R", "REF"))
"""Words before ``=`` with which a statement sets its variable."""
STATEMENT_OPENERS = frozenset(("THEN", "ELSE", "DO", "REPEAT", ":", ";"))
"""Behind which a statement begins."""
PROCESS_OPERANDS = ("PV", "MV")
"""Operands whose value comes from the process or the instruction, wherever else they are used."""
OTHER_CALL_NOTE = f"stands in a call that is not {INSTRUCTION}'s, and may be written there,"


def use_notes(step: Step, operands: Mapping[str, str]) -> Iterator[str]:
    """What a statement that is left out does with operands, by their full names; nothing: it is not about them."""
    tokens = step.tokens
    for jump in (token for token in tokens if token.kind == NAME and token.upper in JUMPS):
        yield f"{jump.text} in line {jump.line} is not carried over: what stands behind is not always executed"
    sign = next((i for i, token in enumerate(tokens) if token.text == ":="), 0)
    if sign and not step.is_compound:
        operand = operands.get(join_tokens(tokens[:sign]).upper())
        if operand is not None:
            yield f"{operand} is assigned in line {tokens[0].line}, which is not carried over"
            return
    noted_operands = set[tuple[str, int]]()
    for at, token in enumerate(tokens):
        operand = operands.get(token.upper) if token.kind == NAME else None
        use = "" if operand is None else _describe_use(tokens, at)
        if (
            operand is None
            or not use
            or (use == OTHER_CALL_NOTE and operand.endswith(PROCESS_OPERANDS))
            or (operand, token.line) in noted_operands
        ):
            continue
        noted_operands.add((operand, token.line))
        yield f"{operand} {use} in line {token.line}, which is not carried over"


def _describe_use(tokens: tuple[Token, ...], i: int) -> str:
    """How a name is used where it stands; empty: it is only read."""
    next_token, second_token = tokens[i + 1], tokens[min(i + 2, len(tokens) - 1)]
    latched = next_token.upper in LATCH_WORDS and second_token.text == "="
    if (next_token.text == ":=" and _parenthesis_depth(tokens, i) == 0) or tokens[i - 1].text == "=>" or latched:
        return "is assigned"
    return OTHER_CALL_NOTE if next_token.text != ":=" and _is_argument(tokens, i) else ""


def _parenthesis_depth(tokens: tuple[Token, ...], i: int) -> int:
    return sum((token.text == "(") - (token.text == ")") for token in tokens[:i])


def _is_argument(tokens: tuple[Token, ...], index: int) -> bool:
    """Whether a name alone is an argument of a call that is a statement, or of one inside."""
    previous, following = tokens[index - 1].text, tokens[index + 1].text
    if previous not in {"(", ",", ":="} or following not in {")", ","}:
        return False
    start = max((i for i in range(index) if tokens[i].upper in STATEMENT_OPENERS), default=-1) + 1
    return tokens[start].kind == NAME and tokens[start + 1].text == "("


# ----------------------------------------------------------------------------------------------------------------------
# Calls of DPIDE in a program, directly or of a function block with the instruction inside, and what is around them.

Arguments = dict[str, tuple["Token", tuple["Token", ...]]]
"""What stands at a parameter, by its name, with the place of that."""
PARAMETER_SECTIONS = ("VAR_INPUT", "VAR_IN_OUT", "VAR_OUTPUT")
ARGUMENT_ENDS = frozenset((",", ")"))


@frozen
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


def read_arguments(step: Step, names: Sequence[str], outputs: frozenset[str], callee: str) -> Arguments:
    """The arguments of a call by name or by position (D602); ``names`` in their order, before which EN may stand."""
    cursor = Cursor(step.tokens[1:])
    cursor.expect_token("(", callee)
    values: list[tuple[Token | None, str, tuple[Token, ...]]] = []
    while cursor.next_token.text != ")":
        start = cursor.next_token
        value = cursor.take_until(frozenset((",", ")", ":=", "=>")))
        sign = cursor.next_token.text if cursor.next_token.text in {":=", "=>"} else ""
        if sign:
            if len(value) != 1 or value[0].kind != NAME:
                raise start.error(f"the name of an operand of {callee} stands before {sign}, as in SV := D100")
            cursor.take_token()
            values.append((value[0], sign, cursor.take_until(ARGUMENT_ENDS)))
        else:
            values.append((None, "", value))
        if not values[-1][2]:
            raise start.error(f"an operand of {callee} is missing before {cursor.next_token.text!r}")
        if cursor.next_token.text != ")":
            cursor.expect_token(",", f"an operand of {callee}")
            if cursor.next_token.text == ")":
                raise cursor.next_token.error(f"an operand of {callee} is missing after the comma")
    cursor.take_token()
    if cursor.next_token.kind != END:
        raise cursor.next_token.error(f"{cursor.next_token.text!r} stands behind the call of {callee}")
    if any(name is not None for name, _, _ in values):
        return _arguments_by_name(values, names, outputs, callee)
    return _arguments_by_position([value for _, _, value in values], names, step.first_token, callee)


def _arguments_by_position(
    values: list[tuple[Token, ...]], names: Sequence[str], call: Token, callee: str
) -> Arguments:
    order = names if len(values) == len(names) else (EN, *names)
    if len(values) != len(order):
        place = values[len(order)][0] if len(values) > len(order) else call
        expected = f"{len(names)} operands, or {len(names) + 1} with EN before them"
        raise place.error(f"{callee} has {expected}; {len(values)} stand here: write them all, or write them by name")
    return {name.upper(): (value[0], value) for name, value in zip(order, values, strict=True)}


def _arguments_by_name(
    values: Sequence[tuple[Token | None, str, tuple[Token, ...]]],
    names: Sequence[str],
    outputs: frozenset[str],
    callee: str,
) -> Arguments:
    arguments: Arguments = {}
    known = {name.upper(): name for name in (EN, *names, "ENO")}
    for name, sign, value in values:
        if name is None:
            raise value[0].error(
                f"{join_tokens(value)[:40]} has no name; operands of {callee} are all named, or none is"
            )
        if name.upper not in known:
            near = closest_name(name.upper, known)
            hint = f"; did you mean {known[near]}?" if near else f"; it has {', '.join(names)}"
            raise name.error(f"{callee} has no operand {name.text}{hint}")
        expected_sign = "=>" if name.upper in outputs or name.upper == "ENO" else ":="
        if sign != expected_sign:
            kind = "an output" if expected_sign == "=>" else "an input"
            raise name.error(
                f"{name.text} is {kind} of {callee}; "
                f"write {known[name.upper]} {expected_sign} {join_tokens(value)[:40]}"
            )
        if name.upper in arguments:
            raise name.error(f"{name.text} stands here again")
        arguments[name.upper] = (name, value)
    return arguments


@dataclass(slots=True)
class Calls:
    """Every call of the instruction in the units of a text, in their order, and the statements around them."""

    globals: Scope
    templates: dict[str, Template] = field(default_factory=dict)
    instructions: list[Instruction] = field(default_factory=list)
    called_instances: dict[str, Token] = field(default_factory=dict)
    """Instances that are called."""
    timers: list[tuple[Step, tuple[tuple[Token, ...], ...]]] = field(default_factory=list)
    pulses: list[tuple[Step, tuple[tuple[Token, ...], ...]]] = field(default_factory=list)
    other_steps: list[tuple[Scope, Step]] = field(default_factory=list)

    def scope_of(self, unit: Unit) -> Scope:
        """The variables of a unit, over those of all."""
        scope = Scope()
        scope.add_declarations(unit.declarations)
        scope.symbols = {**self.globals.symbols, **scope.symbols}
        scope.by_device = {**self.globals.by_device, **scope.by_device}
        return scope

    def add_template(self, unit: Unit) -> None:
        """A function block, if the instruction is inside."""
        scope, steps = self.scope_of(unit), [step for step in unit.steps if step.first_token.upper == INSTRUCTION]
        if not steps or unit.name is None:
            for step in unit.steps:
                self._refuse_nested(step)
                self.other_steps.append((scope, step))
            return
        if len(steps) > 1:
            raise steps[1].first_token.error(
                f"{INSTRUCTION} stands in {unit.name.text} again; one function block has one"
            )
        self._refuse_guarded(steps[0], unit.name.text)
        operands = self._operand_tokens(steps[0], read_arguments(steps[0], OPERAND_NAMES, OUTPUTS, INSTRUCTION))
        sections = {item.name.upper: item.section for item in unit.declarations}
        parameters = [
            item.name.text for section in PARAMETER_SECTIONS for item in unit.declarations if item.section == section
        ]
        outputs = frozenset(name for name, section in sections.items() if section == "VAR_OUTPUT")
        for name, value in operands.items():
            scope.bind_operand(ROWS[name], value)
        self.templates[unit.name.upper] = Template(unit.name, tuple(parameters), outputs, operands, scope, sections)
        self.other_steps += [(scope, step) for step in unit.steps if step is not steps[0]]

    def _refuse_guarded(self, step: Step, name: str) -> None:
        if step.guards:
            line = step.guards[0].tokens[0].line
            raise step.first_token.error(
                f"{INSTRUCTION} stands inside the IF of line {line} in {name}; call {name} there"
            )

    def read_program(self, unit: Unit) -> None:
        """The statements of a program."""
        scope = self.scope_of(unit)
        for step in unit.steps:
            word = step.first_token.upper if step.first_token.kind == NAME else ""
            symbol = scope.symbols.get(word)
            template = self.templates.get(symbol.declaration.type_name) if symbol else None
            is_call = step.tokens[1].text == "("
            if word == INSTRUCTION and is_call:
                arguments_of_call = read_arguments(step, OPERAND_NAMES, OUTPUTS, INSTRUCTION)
                enable = arguments_of_call.get(EN, (step.first_token, ()))[1]
                bindings = {
                    name: scope.bind_operand(ROWS[name], value)
                    for name, value in self._operand_tokens(step, arguments_of_call).items()
                }
                self.instructions.append(Instruction(step.first_token, bindings, enable, step.guards, scope=scope))
            elif template is not None and is_call:
                self._add_instance(step, template, scope)
            elif word == TIMER and is_call:
                self.timers.append((step, _call_values(step)))
            elif word == PULSES and is_call:
                self.pulses.append((step, _call_values(step)))
            elif join_tokens(step.tokens[:-1]).upper() != f"{ENABLE_INTERRUPTS}()":
                self._refuse_nested(step)
                self.other_steps.append((scope, step))

    def _add_instance(self, step: Step, template: Template, scope: Scope) -> None:
        name = step.first_token
        if name.upper in self.called_instances:
            raise name.error(f"{name.text} is called again, after line {self.called_instances[name.upper].line}")
        self.called_instances[name.upper] = name
        arguments_of_call = read_arguments(step, template.parameters, template.outputs, template.name.text)
        bindings = {
            operand: self._bind_parameter(template, operand, value, arguments_of_call, scope, name)
            for operand, value in template.operands.items()
        }
        enable = arguments_of_call.get(EN, (name, ()))[1]
        block, instance = template.name.text, scope.symbols[name.upper].name
        self.instructions.append(Instruction(name, bindings, enable, step.guards, block, instance, scope))

    def _bind_parameter(
        self,
        template: Template,
        operand: str,
        value: tuple[Token, ...],
        arguments_of_call: Arguments,
        scope: Scope,
        call: Token,
    ) -> Binding:
        """What stands at an operand of a function block's instruction, seen from the call of the block."""
        upper = join_tokens(value).upper()
        section = template.sections.get(upper, "VAR")
        if section not in PARAMETER_SECTIONS:
            return template.scope.bind_operand(ROWS[operand], value)
        if upper in arguments_of_call:
            return scope.bind_operand(ROWS[operand], arguments_of_call[upper][1])
        if section == "VAR_INPUT" and template.scope.symbols[upper].declaration.initial:
            return template.scope.bind_operand(ROWS[operand], value)
        raise call.error(
            f"the call of {template.name.text} has no {join_tokens(value)}, which is {operand} of {INSTRUCTION}"
        )

    def _operand_tokens(self, step: Step, arguments_of_call: Arguments) -> dict[str, tuple[Token, ...]]:
        """All operands in the manual's order; raises `ListingError` naming those that are missing."""
        missing = [name for name in OPERAND_NAMES if name.upper() not in arguments_of_call]
        if missing:
            count = f"{len(OPERAND_NAMES) - len(missing)} of its {len(OPERAND_NAMES)} operands"
            raise step.first_token.error(f"{INSTRUCTION} has {count} here; write {', '.join(missing)}, too")
        return {name: arguments_of_call[name.upper()][1] for name in OPERAND_NAMES}

    def _refuse_nested(self, step: Step) -> None:
        """Refuses an instruction inside a statement where nobody knows how often it is executed, or what it gives."""
        for at, token in enumerate(step.tokens):
            is_name = token.kind == NAME and (not at or step.tokens[at - 1].text != ".")
            if is_name and token.upper == INSTRUCTION:
                where = f"inside {step.first_token.text}" if step.is_compound else "inside another statement"
                raise token.error(f"{INSTRUCTION} stands {where}; a configuration has a call that stands by itself")


OUTPUTS = frozenset(name.upper() for name, row in ROWS.items() if row.access == "output")


def _call_values(step: Step) -> tuple[tuple[Token, ...], ...]:
    """What stands between the commas of a call, names of operands left out."""
    return tuple(_split_values(step.tokens[2:-1]))


def _split_values(tokens: Sequence[Token]) -> Iterator[tuple[Token, ...]]:
    value: list[Token] = []
    for token in tokens:
        if token.text in {",", ")"}:
            yield tuple(value)
            value = []
        elif token.text in {":=", "=>"}:
            value = []
        else:
            value.append(token)


# ----------------------------------------------------------------------------------------------------------------------
# Structured Text to a listing: a loop for each call of DPIDE, its devices, and what its operands hold at first.


@dataclass(slots=True)
class ProgramListing(ParameterListing):
    """The listing of a program; a symbol table that is read together with it says what its symbols hold."""

    symbols: dict[str, Binding] = field(default_factory=dict)
    """What stands at each operand that is no number, by its full name."""

    def join(self, other: Listing) -> None:
        """Takes devices and first values of a symbol table; anything else as usual."""
        if not isinstance(other, SymbolListing):
            super(ProgramListing, self).join(other)
            return
        rows = {row.address: row for row in other.table.rows if row.cells and row.address}
        entries = {entry["loop"]: dict(entry) for entry in self.settings}
        for name, binding in self.symbols.items():
            loop, operand = LOOPS.split_name(name)
            found = other.table.by_name.get(binding.symbol.casefold()) if binding.symbol else rows.get(binding.device)
            if found is None:
                continue
            self._set_device(entries[loop], operand, binding, found)
            content = value_in(ROWS[operand], found)
            program = self.words.get(name, UnknownContent(""))
            if content is not None and isinstance(program, UnknownContent):
                self.words[name] = content
            elif content and program != content:
                text = f"{name}: the program says {program}, the symbol table {content}; the program's counts"
                self.notes = (*self.notes, text)
        self.settings = tuple(entries.values())
        others = [str(entry["loop"]) for entry in other.settings if entry["loop"] not in entries]
        if others:
            self.notes = (
                *self.notes,
                f"the symbol table has symbols of {shorten_names(others)}, which the program does not call",
            )

    def _set_device(self, entry: Data, operand: str, binding: Binding, row: Row) -> None:
        """The device of a symbol; raises `ListingError` where the program has another one."""
        device = device_in(ROWS[operand], row)
        if binding.device and device != binding.device:
            where = device or "no device"
            message = f"{row.name} is {binding.device} in the program, and has {where} in line {row.line} of the table"
            raise binding.tokens[0].error(message)
        if device and not binding.device:
            if operand == "I_MV":
                entry["device"] = device
            else:
                entry["devices"] = {**entry.get("devices", {}), operand: device}


def read_st(text: str) -> Listing:
    """The instructions of a program; raises `ListingError` at what cannot be read or would change meaning."""
    return _Reader(text).read_program()


@dataclass
class _Reader:
    """A text on its way to a listing."""

    text: str
    listing: ProgramListing = field(default_factory=lambda: ProgramListing(is_leading=True))
    notes: list[str] = field(default_factory=list)
    loop_names: dict[str, Token] = field(default_factory=dict)
    used_steps: set[int] = field(default_factory=set)
    """Statements around the calls that are carried over."""

    def read_program(self) -> Listing:
        """All of it."""
        units, comments, skipped = units_of(self.text)
        places = settings_of(comments, self.listing)
        self.listing.has_settings = bool(self.listing.plc)
        self.described_loops = self._describe_loops(places)
        top = Scope()
        declared = (item for unit in units for item in unit.declarations if self._is_global(unit, item))
        top.add_declarations(drop_externals(declared))
        self.calls = Calls(top)
        for unit in units:
            unit.declarations = [item for item in unit.declarations if not self._is_global(unit, item)]
            if unit.kind == "FUNCTION_BLOCK":
                self.calls.add_template(unit)
        for unit in units:
            if unit.kind == "PROGRAM":
                self.calls.read_program(unit)
        if not self.calls.instructions:
            raise ListingError(f"the program has no call of {INSTRUCTION}, and none of a function block with it inside")
        self.assignments = self._find_assignments()
        self.timers = {
            join_tokens(values[1]).upper(): call for call in reversed(self.calls.timers) if len(values := call[1]) == 3
        }
        self.pulses = self._pulses_by_output()
        self.listing.settings = tuple(
            self._loop_settings(i, instruction) for i, instruction in enumerate(self.calls.instructions)
        )
        self._add_notes(skipped)
        self.listing.notes = tuple(self.notes)
        return self.listing

    def _is_global(self, unit: Any, item: Any) -> bool:
        return unit.name is None or item.section in {"VAR_GLOBAL", "VAR_EXTERNAL"}

    def _describe_loops(self, comments: list[Comment]) -> dict[str, tuple[Mapping[str, object], Comment]]:
        """What the comments say of each loop, by how its symbols begin."""
        by_stem: dict[str, tuple[Mapping[str, Any], Comment]] = {}
        for entry, place in zip(self.listing.settings, comments, strict=True):
            name = entry.get("loop")
            if not isinstance(name, str):
                raise ListingError("the comment names no loop", place.line, place.column)
            if by_stem.setdefault(WORD_BREAK.sub("_", name).casefold(), (entry, place))[1] is not place:
                raise ListingError(f"{name} stands in a comment again", place.line, place.column)
        return by_stem

    # --- loops -------------------------------------------------------------------------------------------------------

    def _loop_settings(self, number: int, instruction: Instruction) -> Data:
        """The words of an instruction, and what stands beside them."""
        entry = self._loop_entry(number, instruction)
        name = entry["loop"]
        if name.casefold() in self.loop_names:
            line = self.loop_names[name.casefold()].line
            raise instruction.place.error(
                f"{name} is called again, after line {line}: every call has an I_MV of its own"
            )
        self.loop_names[name.casefold()] = instruction.place
        devices, unplaced = {}, []
        for operand, binding in instruction.operands.items():
            if binding.device:
                devices[operand] = binding.device
            elif binding.symbol and operand not in SYMBOL_OPERANDS:
                unplaced.append(operand)
            if binding.symbol or binding.device:
                self.listing.symbols[f"{name}.{operand}"] = binding
            self._add_word(name, operand, instruction)
        block = devices.pop("I_MV", None)
        entry |= {} if block is None else {"device": block}
        entry |= {"devices": devices} if devices else {}
        call = dict(self._call_settings(name, instruction))
        return entry | ({"call": call} if call else {})

    def _loop_entry(self, number: int, instruction: Instruction) -> Data:
        """What the comments say of the loop; its name without one is that of its symbols, or its number."""
        stems = [instruction.operands["I_MV"].symbol, instruction.instance]
        for text, suffix in zip(stems, (SUFFIXES["I_MV"], INSTANCE_SUFFIX), strict=True):
            stem = text[: -len(suffix) - 1] if text.casefold().endswith(f"_{suffix}".casefold()) else ""
            if stem.casefold() in self.described_loops:
                return dict(self.described_loops.pop(stem.casefold())[0])
            if stem:
                return {"loop": stem}
        return {"loop": instruction.instance or default_name(number)}

    def _add_word(self, name: str, operand: str, instruction: Instruction) -> None:
        """What an operand holds, as far as the program says it."""
        binding, name_of_word = instruction.operands[operand], f"{name}.{operand}"
        if operand in {"I_MV", "MV"}:
            return
        row, token = ROWS[operand], binding.tokens[0]
        content: Content | Wire | None = binding.content
        if content is None:
            content = self._assigned_content(operand, binding)
        if content is None:
            content = initial_value(row, binding.declared_symbol)
        if content is None and operand != "PV":
            content = UnknownContent(binding.text)
        if content is not None:
            self.listing.add(name_of_word, content, name_of_word, token.line, token.column)

    def _assigned_content(self, operand: str, binding: Binding) -> Content | None:
        """The number that a statement without a condition assigns to an operand, by its symbol or its device."""
        changes = [step for name in binding.names for step in self.assignments.get(name, [])]
        if len(changes) != 1 or changes[0].guards or not is_constant(changes[0].tokens[2:-1]):
            return None
        self.used_steps.add(id(changes[0]))
        return constant_content(ROWS[operand], changes[0].tokens[2:-1])

    def _find_assignments(self) -> dict[str, list[Step]]:
        """The assignments of the programs by what they assign."""
        assignments: dict[str, list[Step]] = {}
        for _, step in self.calls.other_steps:
            sign = next((i for i, token in enumerate(step.tokens) if token.text == ":="), 0)
            if sign and not step.is_compound:
                assignments.setdefault(join_tokens(step.tokens[:sign]).upper(), []).append(step)
        return assignments

    # --- what stands around ------------------------------------------------------------------------------------------

    def _call_settings(self, name: str, instruction: Instruction) -> Iterator[tuple[str, Any]]:
        """The section `call` of a loop; what it cannot say becomes a note."""
        conditions = [(instruction.enable, True), *((guard.tokens, guard.is_plain) for guard in instruction.guards)]
        enable = timer = None
        for tokens, plain in conditions:
            text = join_tokens(tokens).upper()
            if not tokens or (plain and text in {ALWAYS_ON_BIT, "TRUE"}):
                continue
            flag = instruction.scope.flag_device(tokens) if plain else None
            if plain and timer is None and self._is_timer(text, name, instruction):
                timer = text
            elif flag is not None and enable is None:
                enable = flag
            else:
                shown = " ".join(token.text for token in tokens)[:60]
                self.notes.append(
                    f"{name} is executed on a condition in line {tokens[0].line}, {shown}, which is not carried over"
                )
        yield from (("EN", enable),) if enable else ()
        yield from (("function_block", instruction.block),) if instruction.block else ()
        yield from (("timer", timer),) if timer else ()
        pulses = self._find_pulses(instruction)
        yield from (("GPWM", pulses),) if pulses else ()

    def _is_timer(self, text: str, name: str, instruction: Instruction) -> bool:
        """Whether a bit is that of a timer, which then has CYCLE."""
        try:
            parse_timer(text)
        except ValueError:
            return False
        if text not in self.timers:
            return False
        step, values = self.timers[text]
        cycle, time = instruction.operands["CYCLE"], join_tokens(values[2])
        cycle_content = self.listing.words.get(f"{name}.CYCLE")
        if time.upper() != cycle.text.upper() and self._milliseconds(values[2], instruction.scope) != cycle_content:
            where = f"{time[:40]} in line {step.first_token.line}"
            self.notes.append(f"{name}: {text} runs for {where}, and CYCLE is {cycle.text[:40]}")
        self.used_steps |= {id(step), *(id(reset) for reset in self.assignments.get(text, []))}
        return True

    def _pulses_by_output(self) -> dict[str, list[tuple[Step, Step, tuple[tuple[Token, ...], ...]]]]:
        """The calls of GPWM whose width is one variable, by what that is made of, with the statement that makes it."""
        by_source: dict[str, list[tuple[Step, Step, tuple[tuple[Token, ...], ...]]]] = {}
        for step, values in self.calls.pulses:
            widths = self.assignments.get(join_tokens(values[1]).upper(), []) if len(values) == 4 else []
            if len(widths) == 1 and not widths[0].guards and not step.guards:
                source = join_tokens(widths[0].tokens[:-1]).upper().removeprefix(f"{join_tokens(values[1])}:=".upper())
                by_source.setdefault(source, []).append((step, widths[0], values))
        return by_source

    def _find_pulses(self, instruction: Instruction) -> dict[str, object] | None:
        """GPWM whose width is the MV of an instruction."""
        output = instruction.operands["MV"].text.upper()
        for step, width, values in self.pulses.get(f"REAL_TO_INT({output})", ()):
            flag = instruction.scope.flag_device(values[3])
            if flag is None or join_tokens(values[0]).upper() not in {ALWAYS_ON_BIT, "TRUE"}:
                continue
            cycle = self._milliseconds(values[2], instruction.scope)
            if cycle is not None:
                self.used_steps |= {id(step), id(width)}
                return {"cycle": cycle, "output": flag}
        return None

    def _milliseconds(self, tokens: tuple[Token, ...], scope: Scope) -> Content | None:
        """A time in ms: a number, or a symbol with an initial value."""
        row = ROWS["CYCLE"]
        if is_constant(tokens):
            return constant_content(row, tokens)
        return initial_value(row, scope.symbols.get(join_tokens(tokens).upper()))

    # --- notes -------------------------------------------------------------------------------------------------------

    def _add_notes(self, skipped: list[int]) -> None:
        """What is passed over, and what is taken otherwise than it is written."""
        operands = {name: full for full, binding in self._named_bindings() for name in binding.names}
        lines_left_out = list(skipped)
        for _, step in [
            *self.calls.other_steps,
            *((None, step) for step, _ in (*self.calls.timers, *self.calls.pulses)),
        ]:
            if id(step) in self.used_steps:
                continue
            notes = [*use_notes(step, operands)]
            self.notes += notes
            lines_left_out += [] if notes else [step.first_token.line]
        for template in self.calls.templates.values():
            inputs = [
                join_tokens(value)
                for name, value in template.operands.items()
                if name in IN_OUT_OPERANDS
                and name != "MOUT"
                and template.sections.get(join_tokens(value).upper()) == "VAR_INPUT"
            ]
            if inputs:
                self.notes.append(f"{template.name.text}: {', '.join(inputs)} should be VAR_IN_OUT, as the manual says")
        for entry, place in self.described_loops.values():
            self.notes.append(f"the comment in line {place.line} is about {entry['loop']}, which nothing calls")
        if lines_left_out:
            lines = shorten_names([str(line) for line in sorted({*lines_left_out})])
            self.notes.append(f"statements that are not about {INSTRUCTION} are left out: lines {lines}")

    def _named_bindings(self) -> Iterator[tuple[str, Any]]:
        for entry, instruction in zip(self.listing.settings, self.calls.instructions, strict=True):
            yield from ((f"{entry['loop']}.{name}", binding) for name, binding in instruction.operands.items())
