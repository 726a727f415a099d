"""Structured Text to a listing: a loop for each call of DPIDE, its devices, and what its operands hold at first."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.dpide.program import ALWAYS, IN_OUT, INSTANCE, INSTRUCTION, WITHOUT_NUMBER
from pidcfg.encoders.dpide.st_calls import Calls, Instruction
from pidcfg.encoders.dpide.st_left import notes_of
from pidcfg.encoders.dpide.st_scope import Binding, Scope, constant, initial_value, is_constant, joined
from pidcfg.encoders.dpide.st_units import Step, units_of
from pidcfg.encoders.dpide.symbol_read import SymbolListing, device_in, value_in
from pidcfg.encoders.dpide.symbols import BREAK, SUFFIXES
from pidcfg.encoders.listing import Listing, ListingError, few
from pidcfg.encoders.maps.dpide import LOOPS, ROWS
from pidcfg.encoders.parameter_files import ParameterListing
from pidcfg.encoders.parameters import Elsewhere
from pidcfg.encoders.settings import default_name
from pidcfg.encoders.st.text import settings_of
from pidcfg.schemas.dpide_call import parse_timer

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.dpide.symbol_table import Row
    from pidcfg.encoders.parameters import Content
    from pidcfg.encoders.st.lex import Comment, Token
    from pidcfg.schemas.iec import Wire


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

    def _place(self, entry: dict[str, Any], operand: str, binding: Binding, row: Row) -> None:
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
            joined(values[1]).upper(): one for one in reversed(self.calls.timers) if len(values := one[1]) == 3
        }
        self.pulses = self._by_output()
        self.listing.settings = tuple(self._loop(i, found) for i, found in enumerate(self.calls.found))
        self._notes(skipped)
        self.listing.notes = tuple(self.notes)
        return self.listing

    def _is_global(self, unit: Any, item: Any) -> bool:
        return unit.name is None or item.section in {"VAR_GLOBAL", "VAR_EXTERNAL"}

    def _described(self, places: list[Comment]) -> dict[str, tuple[Mapping[str, Any], Comment]]:
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

    def _loop(self, number: int, found: Instruction) -> dict[str, Any]:
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

    def _entry(self, number: int, found: Instruction) -> dict[str, Any]:
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
                found.setdefault(joined(step.tokens[:sign]).upper(), []).append(step)
        return found

    # --- what stands around ------------------------------------------------------------------------------------------

    def _call(self, name: str, found: Instruction) -> Iterator[tuple[str, Any]]:
        """The section `call` of a loop; what it cannot say becomes a note."""
        conditions = [(found.enable, True), *((guard.tokens, guard.plain) for guard in found.guards)]
        enable = timer = None
        for tokens, plain in conditions:
            text = joined(tokens).upper()
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
        cycle, time = found.operands["CYCLE"], joined(values[2])
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
            widths = self.changes.get(joined(values[1]).upper(), []) if len(values) == 4 else []
            if len(widths) == 1 and not widths[0].guards and not step.guards:
                made = joined(widths[0].tokens[:-1]).upper().removeprefix(f"{joined(values[1])}:=".upper())
                found.setdefault(made, []).append((step, widths[0], values))
        return found

    def _pulses(self, found: Instruction) -> dict[str, Any] | None:
        """GPWM whose width is the MV of an instruction."""
        output = found.operands["MV"].text.upper()
        for step, width, values in self.pulses.get(f"REAL_TO_INT({output})", ()):
            flag = found.scope.flag(values[3])
            if flag is None or joined(values[0]).upper() not in {ALWAYS, "TRUE"}:
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
        return initial_value(row, scope.symbols.get(joined(tokens).upper()))

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
                joined(value)
                for name, value in template.operands.items()
                if name in IN_OUT and name != "MOUT" and template.sections.get(joined(value).upper()) == "VAR_INPUT"
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
