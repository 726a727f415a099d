"""Structured Text to a listing: a loop for each call of DPIDE, its devices, and what its operands hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from pidcfg.encoders.dpide.image import BREAK, SUFFIXES
from pidcfg.encoders.dpide.st_scope import (
    ALWAYS,
    EN,
    ENABLE_INTERRUPTS,
    IN_OUT,
    INSTANCE,
    INSTRUCTION,
    OPERANDS,
    PULSES,
    TIMER,
    WITHOUT_NUMBER,
    Binding,
    Guard,
    Scope,
    Step,
    SymbolListing,
    Unit,
    constant,
    device_in,
    initial_value,
    is_constant,
    join_tokens,
    units_of,
    value_in,
)
from pidcfg.encoders.dpide.symbols import Row
from pidcfg.encoders.image import default_name
from pidcfg.encoders.listing import Listing, ListingError, few
from pidcfg.encoders.maps.dpide import LOOPS, ROWS
from pidcfg.encoders.parameter_files import ParameterListing
from pidcfg.encoders.parameters import Content, Elsewhere
from pidcfg.encoders.structured_text import END, NAME, Comment, Cursor, Token, settings_of
from pidcfg.schemas.dpide import parse_timer
from pidcfg.schemas.iec import Wire
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Data
from pidcfg.text.signs import closest_name

# ----------------------------------------------------------------------------------------------------------------------
# What is left out of a program, as far as it concerns operands: what may write them, and jumps around the calls.

JUMPS = frozenset(("RETURN", "JMP"))
LATCHES = frozenset(("S", "R", "REF"))
"""Words before ``=`` with which a statement sets its variable."""
OPENERS = frozenset(("THEN", "ELSE", "DO", "REPEAT", ":", ";"))
"""Behind which a statement begins."""
FROM_OUTSIDE = ("PV", "MV")
"""Operands whose value comes from the process or the instruction, wherever else they are used."""
IN_A_CALL = f"stands in a call that is not {INSTRUCTION}'s, and may be written there,"


def notes_of(step: Step, operands: Mapping[str, str]) -> Iterator[str]:
    """What a statement that is left out does with operands, by their full names; nothing: it is not about them."""
    tokens = step.tokens
    for jump in (token for token in tokens if token.kind == NAME and token.upper in JUMPS):
        yield f"{jump.text} in line {jump.line} is not carried over: what stands behind is not always executed"
    sign = next((i for i, token in enumerate(tokens) if token.text == ":="), 0)
    if sign and not step.is_compound:
        full = operands.get(join_tokens(tokens[:sign]).upper())
        if full is not None:
            yield f"{full} is assigned in line {tokens[0].line}, which is not carried over"
            return
    told = set[tuple[str, int]]()
    for at, token in enumerate(tokens):
        full = operands.get(token.upper) if token.kind == NAME else None
        how = "" if full is None else _how(tokens, at)
        if full is None or not how or (how == IN_A_CALL and full.endswith(FROM_OUTSIDE)) or (full, token.line) in told:
            continue
        told.add((full, token.line))
        yield f"{full} {how} in line {token.line}, which is not carried over"


def _how(tokens: tuple[Token, ...], at: int) -> str:
    """How a name is used where it stands; empty: it is only read."""
    behind, next_one = tokens[at + 1], tokens[min(at + 2, len(tokens) - 1)]
    latched = behind.upper in LATCHES and next_one.text == "="
    if (behind.text == ":=" and _depth(tokens, at) == 0) or tokens[at - 1].text == "=>" or latched:
        return "is assigned"
    return IN_A_CALL if behind.text != ":=" and _is_argument(tokens, at) else ""


def _depth(tokens: tuple[Token, ...], at: int) -> int:
    return sum((token.text == "(") - (token.text == ")") for token in tokens[:at])


def _is_argument(tokens: tuple[Token, ...], at: int) -> bool:
    """Whether a name alone is an argument of a call that is a statement, or of one inside."""
    before, behind = tokens[at - 1].text, tokens[at + 1].text
    if before not in {"(", ",", ":="} or behind not in {")", ","}:
        return False
    start = max((i for i in range(at) if tokens[i].upper in OPENERS), default=-1) + 1
    return tokens[start].kind == NAME and tokens[start + 1].text == "("


# ----------------------------------------------------------------------------------------------------------------------
# Calls of DPIDE in a program, directly or of a function block with the instruction inside, and what is around them.

Arguments = dict[str, tuple["Token", tuple["Token", ...]]]
"""What stands at a parameter, by its name, with the place of that."""
SECTIONS = ("VAR_INPUT", "VAR_IN_OUT", "VAR_OUTPUT")
COMMA = frozenset((",", ")"))


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
            raise value[0].error(f"{join_tokens(value)[:40]} has no name; operands of {what} are all named, or none is")
        if name.upper not in known:
            near = closest_name(name.upper, known)
            hint = f"; did you mean {known[near]}?" if near else f"; it has {', '.join(names)}"
            raise name.error(f"{what} has no operand {name.text}{hint}")
        wanted = "=>" if name.upper in outputs or name.upper == "ENO" else ":="
        if sign != wanted:
            kind = "an output" if wanted == "=>" else "an input"
            raise name.error(
                f"{name.text} is {kind} of {what}; write {known[name.upper]} {wanted} {join_tokens(value)[:40]}"
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
            elif join_tokens(step.tokens[:-1]).upper() != f"{ENABLE_INTERRUPTS}()":
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
        upper = join_tokens(value).upper()
        section = template.sections.get(upper, "VAR")
        if section not in SECTIONS:
            return template.scope.bind(ROWS[operand], value)
        if upper in given:
            return scope.bind(ROWS[operand], given[upper][1])
        if section == "VAR_INPUT" and template.scope.symbols[upper].declaration.initial:
            return template.scope.bind(ROWS[operand], value)
        raise at.error(
            f"the call of {template.name.text} has no {join_tokens(value)}, which is {operand} of {INSTRUCTION}"
        )

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
        for full, binding in self.symbols.items():
            loop, operand = LOOPS.split(full)
            found = other.table.by_name.get(binding.symbol.casefold()) if binding.symbol else rows.get(binding.device)
            if found is None:
                continue
            self._place(entries[loop], operand, binding, found)
            content = value_in(ROWS[operand], found)
            program = self.words.get(full, Elsewhere(""))
            if content is not None and isinstance(program, Elsewhere):
                self.words[full] = content
            elif content and program != content:
                text = f"{full}: the program says {program}, the symbol table {content}; the program's counts"
                self.notes = (*self.notes, text)
        self.settings = tuple(entries.values())
        others = [str(entry["loop"]) for entry in other.settings if entry["loop"] not in entries]
        if others:
            self.notes = (
                *self.notes,
                f"the symbol table has symbols of {few(others)}, which the program does not call",
            )

    def _place(self, entry: Data, operand: str, binding: Binding, row: Row) -> None:
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
    return _Reader(text).read()


@dataclass
class _Reader:
    """A text on its way to a listing."""

    text: str
    listing: ProgramListing = field(default_factory=lambda: ProgramListing(leads=True))
    notes: list[str] = field(default_factory=list)
    names: dict[str, Token] = field(default_factory=dict)
    used: set[int] = field(default_factory=set)
    """Statements around the calls that are carried over."""

    def read(self) -> Listing:
        """All of it."""
        units, comments, skipped = units_of(self.text)
        places = settings_of(comments, self.listing)
        self.listing.described = bool(self.listing.plc)
        self.described = self._described(places)
        top = Scope()
        top.declare(item for unit in units for item in unit.declarations if self._is_global(unit, item))
        self.calls = Calls(top)
        for unit in units:
            unit.declarations = [item for item in unit.declarations if not self._is_global(unit, item)]
            if unit.kind == "FUNCTION_BLOCK":
                self.calls.add_template(unit)
        for unit in units:
            if unit.kind == "PROGRAM":
                self.calls.take(unit)
        if not self.calls.found:
            raise ListingError(f"the program has no call of {INSTRUCTION}, and none of a function block with it inside")
        self.changes = self._changes()
        self.timers = {
            join_tokens(values[1]).upper(): one for one in reversed(self.calls.timers) if len(values := one[1]) == 3
        }
        self.pulses = self._by_output()
        self.listing.settings = tuple(self._loop(i, found) for i, found in enumerate(self.calls.found))
        self._notes(skipped)
        self.listing.notes = tuple(self.notes)
        return self.listing

    def _is_global(self, unit: Any, item: Any) -> bool:
        return unit.name is None or item.section in {"VAR_GLOBAL", "VAR_EXTERNAL"}

    def _described(self, places: list[Comment]) -> dict[str, tuple[Mapping[str, object], Comment]]:
        """What the comments say of each loop, by how its symbols begin."""
        found: dict[str, tuple[Mapping[str, Any], Comment]] = {}
        for entry, place in zip(self.listing.settings, places, strict=True):
            name = entry.get("loop")
            if not isinstance(name, str):
                raise ListingError("the comment names no loop", place.line, place.column)
            if found.setdefault(BREAK.sub("_", name).casefold(), (entry, place))[1] is not place:
                raise ListingError(f"{name} stands in a comment again", place.line, place.column)
        return found

    # --- loops -------------------------------------------------------------------------------------------------------

    def _loop(self, number: int, found: Instruction) -> Data:
        """The words of an instruction, and what stands beside them."""
        entry = self._entry(number, found)
        name = entry["loop"]
        if name.casefold() in self.names:
            line = self.names[name.casefold()].line
            raise found.place.error(f"{name} is called again, after line {line}: every call has an I_MV of its own")
        self.names[name.casefold()] = found.place
        devices, placeless = {}, []
        for operand, binding in found.operands.items():
            if binding.device:
                devices[operand] = binding.device
            elif binding.symbol and operand not in WITHOUT_NUMBER:
                placeless.append(operand)
            if binding.symbol or binding.device:
                self.listing.symbols[f"{name}.{operand}"] = binding
            self._word(name, operand, found)
        block = devices.pop("I_MV", None)
        entry |= {} if block is None else {"device": block}
        entry |= {"devices": devices} if devices else {}
        call = dict(self._call(name, found))
        return entry | ({"call": call} if call else {})

    def _entry(self, number: int, found: Instruction) -> Data:
        """What the comments say of the loop; its name without one is that of its symbols, or its number."""
        stems = [found.operands["I_MV"].symbol, found.instance]
        for text, suffix in zip(stems, (SUFFIXES["I_MV"], INSTANCE), strict=True):
            stem = text[: -len(suffix) - 1] if text.casefold().endswith(f"_{suffix}".casefold()) else ""
            if stem.casefold() in self.described:
                return dict(self.described.pop(stem.casefold())[0])
            if stem:
                return {"loop": stem}
        return {"loop": found.instance or default_name(number)}

    def _word(self, name: str, operand: str, found: Instruction) -> None:
        """What an operand holds, as far as the program says it."""
        binding, full = found.operands[operand], f"{name}.{operand}"
        if operand in {"I_MV", "MV"}:
            return
        row, at = ROWS[operand], binding.tokens[0]
        content: Content | Wire | None = binding.content
        if content is None:
            content = self._assigned(operand, binding)
        if content is None:
            content = initial_value(row, binding.declared)
        if content is None and operand != "PV":
            content = Elsewhere(binding.text)
        if content is not None:
            self.listing.add(full, content, full, at.line, at.column)

    def _assigned(self, operand: str, binding: Binding) -> Content | None:
        """The number that a statement without a condition assigns to an operand, by its symbol or its device."""
        changes = [step for name in binding.names for step in self.changes.get(name, [])]
        if len(changes) != 1 or changes[0].guards or not is_constant(changes[0].tokens[2:-1]):
            return None
        self.used.add(id(changes[0]))
        return constant(ROWS[operand], changes[0].tokens[2:-1])

    def _changes(self) -> dict[str, list[Step]]:
        """The assignments of the programs by what they assign."""
        found: dict[str, list[Step]] = {}
        for _, step in self.calls.others:
            sign = next((i for i, token in enumerate(step.tokens) if token.text == ":="), 0)
            if sign and not step.is_compound:
                found.setdefault(join_tokens(step.tokens[:sign]).upper(), []).append(step)
        return found

    # --- what stands around ------------------------------------------------------------------------------------------

    def _call(self, name: str, found: Instruction) -> Iterator[tuple[str, Any]]:
        """The section `call` of a loop; what it cannot say becomes a note."""
        conditions = [(found.enable, True), *((guard.tokens, guard.plain) for guard in found.guards)]
        enable = timer = None
        for tokens, plain in conditions:
            text = join_tokens(tokens).upper()
            if not tokens or (plain and text in {ALWAYS, "TRUE"}):
                continue
            flag = found.scope.flag(tokens) if plain else None
            if plain and timer is None and self._is_timer(text, name, found):
                timer = text
            elif flag is not None and enable is None:
                enable = flag
            else:
                shown = " ".join(token.text for token in tokens)[:60]
                self.notes.append(
                    f"{name} is executed on a condition in line {tokens[0].line}, {shown}, which is not carried over"
                )
        yield from (("EN", enable),) if enable else ()
        yield from (("function_block", found.block),) if found.block else ()
        yield from (("timer", timer),) if timer else ()
        pulses = self._pulses(found)
        yield from (("GPWM", pulses),) if pulses else ()

    def _is_timer(self, text: str, name: str, found: Instruction) -> bool:
        """Whether a bit is that of a timer, which then has CYCLE."""
        try:
            parse_timer(text)
        except ValueError:
            return False
        if text not in self.timers:
            return False
        step, values = self.timers[text]
        cycle, time = found.operands["CYCLE"], join_tokens(values[2])
        held = self.listing.words.get(f"{name}.CYCLE")
        if time.upper() != cycle.text.upper() and self._whole(values[2], found.scope) != held:
            where = f"{time[:40]} in line {step.first.line}"
            self.notes.append(f"{name}: {text} runs for {where}, and CYCLE is {cycle.text[:40]}")
        self.used |= {id(step), *(id(reset) for reset in self.changes.get(text, []))}
        return True

    def _by_output(self) -> dict[str, list[tuple[Step, Step, tuple[tuple[Token, ...], ...]]]]:
        """The calls of GPWM whose width is one variable, by what that is made of, with the statement that makes it."""
        found: dict[str, list[tuple[Step, Step, tuple[tuple[Token, ...], ...]]]] = {}
        for step, values in self.calls.pulses:
            widths = self.changes.get(join_tokens(values[1]).upper(), []) if len(values) == 4 else []
            if len(widths) == 1 and not widths[0].guards and not step.guards:
                made = join_tokens(widths[0].tokens[:-1]).upper().removeprefix(f"{join_tokens(values[1])}:=".upper())
                found.setdefault(made, []).append((step, widths[0], values))
        return found

    def _pulses(self, found: Instruction) -> dict[str, object] | None:
        """GPWM whose width is the MV of an instruction."""
        output = found.operands["MV"].text.upper()
        for step, width, values in self.pulses.get(f"REAL_TO_INT({output})", ()):
            flag = found.scope.flag(values[3])
            if flag is None or join_tokens(values[0]).upper() not in {ALWAYS, "TRUE"}:
                continue
            cycle = self._whole(values[2], found.scope)
            if cycle is not None:
                self.used |= {id(step), id(width)}
                return {"cycle": cycle, "output": flag}
        return None

    def _whole(self, tokens: tuple[Token, ...], scope: Scope) -> Content | None:
        """A time in ms: a number, or a symbol with an initial value."""
        row = ROWS["CYCLE"]
        if is_constant(tokens):
            return constant(row, tokens)
        return initial_value(row, scope.symbols.get(join_tokens(tokens).upper()))

    # --- notes -------------------------------------------------------------------------------------------------------

    def _notes(self, skipped: list[int]) -> None:
        """What is passed over, and what is taken otherwise than it is written."""
        operands = {name: full for full, binding in self._written() for name in binding.names}
        left = list(skipped)
        for _, step in [*self.calls.others, *((None, step) for step, _ in (*self.calls.timers, *self.calls.pulses))]:
            if id(step) in self.used:
                continue
            told = [*notes_of(step, operands)]
            self.notes += told
            left += [] if told else [step.first.line]
        for template in self.calls.templates.values():
            wrong = [
                join_tokens(value)
                for name, value in template.operands.items()
                if name in IN_OUT
                and name != "MOUT"
                and template.sections.get(join_tokens(value).upper()) == "VAR_INPUT"
            ]
            if wrong:
                self.notes.append(f"{template.name.text}: {', '.join(wrong)} should be VAR_IN_OUT, as the manual says")
        for entry, place in self.described.values():
            self.notes.append(f"the comment in line {place.line} is about {entry['loop']}, which nothing calls")
        if left:
            lines = few([str(line) for line in sorted({*left})])
            self.notes.append(f"statements that are not about {INSTRUCTION} are left out: lines {lines}")

    def _written(self) -> Iterator[tuple[str, Any]]:
        for entry, found in zip(self.listing.settings, self.calls.found, strict=True):
            yield from ((f"{entry['loop']}.{name}", binding) for name, binding in found.operands.items())
