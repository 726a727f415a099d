"""DPIDE in program text: what its names are and what stands at an operand; program units; symbol tables as listings."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from pidcfg.encoders.dpide.image import SUFFIXES
from pidcfg.encoders.dpide.symbols import Row, Table, parse_symbols, registers_of, units_in_comments
from pidcfg.encoders.listing import Listing, ListingError
from pidcfg.encoders.maps.dpide import AUTOTUNE_OPERANDS, DPIDE_TABLE, PROCESS_OPERANDS, ROWS
from pidcfg.encoders.parameter_files import ParameterListing
from pidcfg.encoders.parameters import Content, Parameter, UnknownContent, read_content
from pidcfg.encoders.structured_text import (
    BOOLEAN_WORDS,
    END,
    NAME,
    NUMBER,
    QUALIFIERS,
    STATEMENT_ENDS,
    TYPED_LITERAL,
    VARIABLE_KEYWORDS,
    Comment,
    Cursor,
    Declaration,
    Token,
    name_of,
    number_of,
    read_declarations,
    read_statement,
    tokens_of,
)
from pidcfg.schemas.dpide import BLOCK_REGISTERS, parse_flag_device, parse_register
from pidcfg.schemas.iec import BOOL, REAL, IecType, TimeNumber
from pidcfg.text.paths import Data
from pidcfg.text.references import Decision

# --- DPIDE in program text: what its writer and its reader share ------------------------------------------------------
#
# Design. A program is one text of IEC 61131-3: settings that no variable holds in comments, declarations, and a call
# of the instruction with all 21 operands by name. An operand is a number in the call, or a symbol; a symbol is
# declared with its device and its initial value, as a row of ISPSoft's symbol table has it, and the names are those
# of that table.
#
# - `files` prints an image: numbers where nothing else writes the operand and it has no device, else symbols.
# - `st_scope` takes a text apart into programs and function blocks, and their statements with the conditions around
#   them; it knows what is declared, and what an operand of a call is: a number, a symbol, or a device.
# - `st_read` takes the calls, directly or of a function block with the instruction inside, and what stands around
#   them, and makes a listing: a loop a call, its devices and its first values. What an operand holds that no text says
#   is looked up in a symbol table that is read together with the program.
#
# What is not about DPIDE is left out, and its lines are named.

D602 = Decision(
    602,
    "DPIDE in Structured Text is a call with its operands by name",
    "DPIDE(EN := …, PID_RUN := …, …, I_MV := …, MV => …), in the order of the manual's drawing. Programs by hand may "
    "also have 21 operands by position in this order, or 22 with EN before them; names and positions are not mixed, "
    "and none may be missing.",
    "The manual prints ladder alone, with the names of all inputs on the left and MV on the right. IEC 61131-3 "
    "has both forms; by name no two operands can be swapped. ISPSoft has not compiled it yet.",
)
D603 = Decision(
    603,
    "numbers stand in the call, what is written has a symbol",
    "Operands with a device, and those that the process, the instruction or its autotune may write, are symbols with "
    "device and initial value; all others are numbers. In a function block also what is VAR_IN_OUT.",
    "A number in the call reaches the PLC whatever an import does with initial values (D257). The manual allows no "
    "number for PID_MODE 1, and nothing can be written to a number.",
)
D604 = Decision(
    604,
    "the instruction is enabled by SM400 where nothing else is said",
    "EN := SM400; on the way back SM400, TRUE and no EN are the same. Another bit is `call.EN`. A condition that is no "
    "single bit is not carried over, and is named.",
    "SM400 is the contact before En in the manual's examples 4 and 5, where the instruction is always executed.",
)
D605 = Decision(
    605,
    "MOUT of a function block is VAR_IN_OUT",
    "The function block has PID_MODE, Kc_Kp, Ti_Ki, Td_Kd, Tf, I_MV, and MOUT as VAR_IN_OUT, MV as VAR_OUTPUT and the "
    "others as VAR_INPUT.",
    "The manual lists the first six. With MOUT_AUTO TRUE the instruction writes MOUT, too: a VAR_INPUT would take the "
    "old value again with the next call, and the output would jump when manual begins.",
)
D606 = Decision(
    606,
    "GPWM, TMRH and EI are called by position",
    "TMRH(enable, timer, ms), GPWM(enable, width, cycle, output), EI(). The width is REAL_TO_INT(MV); a timer that has "
    "called the instruction is assigned FALSE.",
    "The drawings of examples 3 to 5 have these operands in this order, without names that can be read; neither can "
    "the name of the conversion in example 3, nor the device of its pulses. The coil of example 4 resets the timer.",
)
D607 = Decision(
    607,
    "a whole number is no REAL in a call",
    "SV := 80 is refused, SV := 80.0 is meant; so is 1000.0 for a DINT. K80 and F80.0 count as 80 and 80.0. As initial "
    "value of a REAL 80 is 80.0.",
    "The operand table wants single-precision numbers; the bits of a whole number are another one (80 is 1.1e-43). "
    "Exports of symbol tables have 0 as initial value of a REAL (D257).",
)
D608 = Decision(
    608,
    "the inner drawing of example 4 has PID_RUN twice",
    "The input of the function block at PID_DIR is PID_DIR.",
    "The drawing repeats PID_RUN in its place; a loop that runs would then always heat. The call of the block in the "
    "same example has DPIDE_DIR at PID_DIR.",
)
D609 = Decision(
    609,
    "what a symbol holds is its initial value",
    "or the number that the program assigns to it without a condition. An operand of which neither the program nor a "
    "symbol table says that is FALSE or 0 (D255), and named; SV, CYCLE, the three coefficients and the limits must be "
    "known. Other assignments are named by line.",
    "A program says where operands stand, and only sometimes what they hold.",
)

INSTRUCTION, TIMER, PULSES, ENABLE_INTERRUPTS = "DPIDE", "TMRH", "GPWM", "EI"
EN = "EN"
ALWAYS_ON_BIT = "SM400"
"""The bit that enables what is always executed (D604)."""
IN_OUT_OPERANDS = (*AUTOTUNE_OPERANDS, "MOUT", "I_MV")
"""What a function block has as VAR_IN_OUT (D605)."""
OPERAND_NAMES = tuple(row.name for row in DPIDE_TABLE.rows)
"""All operands in the manual's order."""
SYMBOL_OPERANDS = frozenset(PROCESS_OPERANDS)
"""Operands that cannot be numbers: the process or the instruction writes them."""
PROGRAM = "PidLoops"
WIDTH_SUFFIX, INSTANCE_SUFFIX = "WIDTH", "FB"
"""Suffixes of the variable with the width of the pulses, and of the instance of a function block."""

# --- A text as programs and function blocks, and their statements one by one with the conditions around them ----------

UNIT_KEYWORDS = ("PROGRAM", "FUNCTION_BLOCK")
SKIPPED_UNITS = ("FUNCTION", "TYPE")
"""What has no place for the instruction, and is left out up to its end."""
THEN_WORD = frozenset(("THEN",))


class Guard(NamedTuple):
    """A condition around a statement; one that is not ``plain`` is of ELSE, ELSIF or what comes behind one."""

    tokens: tuple[Token, ...]
    is_plain: bool = True


class Step(NamedTuple):
    """A statement, with the end as its last token; CASE and loops are one with all that is inside."""

    tokens: tuple[Token, ...]
    guards: tuple[Guard, ...] = ()

    @property
    def first_token(self) -> Token:
        """Where it begins."""
        return self.tokens[0]

    @property
    def is_compound(self) -> bool:
        """Whether others are inside."""
        return self.first_token.kind == NAME and self.first_token.upper in STATEMENT_ENDS


@dataclass(slots=True)
class Unit:
    """A program or a function block; without a name what stands outside of all."""

    kind: str = "PROGRAM"
    name: Token | None = None
    declarations: list[Declaration] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)


def units_of(text: str) -> tuple[list[Unit], list[Comment], list[int]]:
    """Units, comments, and the lines of what is skipped; raises `ListingError` at what cannot be read."""
    tokens, comments = tokens_of(text)
    cursor, outer_unit, skipped_lines = Cursor(tokens), Unit(), list[int]()
    units = [outer_unit]
    while cursor.next_token.kind != END:
        word = cursor.next_token.upper if cursor.next_token.kind == NAME else ""
        if word in UNIT_KEYWORDS:
            units.append(_read_unit(cursor))
        elif word in SKIPPED_UNITS:
            skipped_lines.append(cursor.next_token.line)
            _skip_unit(cursor)
        else:
            _read_part(cursor, outer_unit)
    return units, comments, skipped_lines


def _read_unit(cursor: Cursor) -> Unit:
    """A program or a function block up to its end."""
    head = cursor.take_token()
    name = name_of(cursor, head.text)
    unit, end = Unit(head.upper, name), f"END_{head.upper}"
    while cursor.next_token.upper != end:
        if cursor.next_token.kind == END or cursor.next_token.upper in UNIT_KEYWORDS:
            raise head.error(f"{head.text} {name.text} has no {end}")
        _read_part(cursor, unit)
    cursor.take_token()
    return unit


def _read_part(cursor: Cursor, unit: Unit) -> None:
    """A block of variables, or a statement."""
    if cursor.next_token.kind == NAME and cursor.next_token.upper in VARIABLE_KEYWORDS:
        unit.declarations += read_declarations(cursor)
        return
    if cursor.next_token.kind == NAME and (
        cursor.next_token.upper.startswith("END_") or cursor.next_token.upper in QUALIFIERS
    ):
        raise cursor.next_token.error(f"{cursor.next_token.text} stands here without its beginning")
    for statement_read in read_statement(cursor):
        unit.steps += steps_of(statement_read.tokens)


def _skip_unit(cursor: Cursor) -> None:
    head = cursor.take_token()
    while cursor.next_token.upper != f"END_{head.upper}":
        if cursor.take_token().kind == END:
            raise head.error(f"{head.text} has no END_{head.upper}")
    cursor.take_token()


def steps_of(tokens: tuple[Token, ...], guards: tuple[Guard, ...] = ()) -> Iterator[Step]:
    """The statements of a statement: those inside of IF, each with the conditions around it."""
    if tokens[0].kind != NAME or tokens[0].upper != "IF":
        yield Step(tokens, guards)
        return
    cursor, is_first = Cursor(tokens), True
    while cursor.take_token().upper in {"IF", "ELSIF"}:
        condition = cursor.take_until(THEN_WORD)
        word = cursor.expect_token("THEN", "the condition of IF")
        if not condition:
            raise word.error("a condition is missing before THEN")
        yield from _body_steps(cursor, (*guards, Guard(condition, is_first)))
        is_first = False
    if cursor.tokens[cursor.position - 1].upper == "ELSE":
        yield from _body_steps(cursor, (*guards, Guard((cursor.tokens[cursor.position - 1],), is_plain=False)))
        cursor.expect_token("END_IF", "the statements of ELSE")


def _body_steps(cursor: Cursor, guards: tuple[Guard, ...]) -> Iterator[Step]:
    while cursor.next_token.upper not in {"ELSIF", "ELSE", "END_IF"}:
        for inner in read_statement(cursor):
            yield from steps_of(inner.tokens, guards)


# --- What the names of a program are, and what stands at an operand: a number, a symbol, or a device of the PLC -------

DEVICE_PATTERN = re.compile(r"(?:X|Y|M|SM|S|D|SR|T|C|HC|E|FR)\d+(?:\.\d+)?", re.IGNORECASE)
CONSTANT_PATTERN = re.compile(r"([KF])([-+]?[0-9.]+(?:E[-+]?[0-9]+)?)", re.IGNORECASE)
"""A number with its sign of ISPSoft before it: K whole, F real."""
COMPATIBLE_TYPES = {"DINT": frozenset(("DINT", "DWORD"))}
"""Types of a variable that an operand takes; the manual's table has both of these."""
WHOLE_NUMBER_PATTERN = re.compile(r"[-+]?[0-9]+")
SIGNS = {"+", "-"}


class Symbol(NamedTuple):
    """A declared variable: its declaration, and its device where it says one."""

    declaration: Declaration
    device: str = ""

    @property
    def name(self) -> str:
        """As it is declared."""
        return self.declaration.name.text


class Binding(NamedTuple):
    """What stands at an operand: a number, or a device, or neither where ISPSoft places the symbol."""

    tokens: tuple[Token, ...]
    content: Content | None = None
    device: str = ""
    symbol: str = ""
    declared_symbol: Symbol | None = None

    @property
    def text(self) -> str:
        """As it is written."""
        return join_tokens(self.tokens)

    @property
    def names(self) -> set[str]:
        """What it is called in statements, in capitals: its symbol, and its device."""
        return {
            name.upper()
            for name in (self.text, self.device, self.declared_symbol.name if self.declared_symbol else "")
            if name
        }


def join_tokens(tokens: Iterable[Token]) -> str:
    """Tokens without what stood between them."""
    return "".join(token.text for token in tokens)


@dataclass(slots=True)
class Scope:
    """The variables of a unit and those of all units, in capitals, since the language ignores case."""

    symbols: dict[str, Symbol] = field(default_factory=dict)
    by_device: dict[str, Symbol] = field(default_factory=dict)
    """The variable that stands at a device."""

    def add_declarations(self, declarations: Iterable[Declaration]) -> None:
        """Takes variables; a name twice is refused."""
        for declaration in declarations:
            upper = declaration.name.upper
            if upper in self.symbols:
                raise declaration.name.error(f"{declaration.name.text} is declared again")
            device = join_tokens(declaration.address).upper()
            if device and not DEVICE_PATTERN.fullmatch(device):
                text = join_tokens(declaration.address)
                raise declaration.address[0].error(f"{text[:40]} is no device of the PLC; write it like D100 or M10")
            self.symbols[upper] = Symbol(declaration, device)
            if device:
                self.by_device.setdefault(device, self.symbols[upper])

    # --- operands ----------------------------------------------------------------------------------------------------

    def bind_operand(self, row: Parameter, tokens: tuple[Token, ...]) -> Binding:
        """What stands at an operand; raises `ListingError` for what it does not take."""
        text, first = join_tokens(tokens), tokens[0]
        symbol = self.symbols.get(text.upper())
        if symbol is not None:
            self._check_type(row, symbol, first)
            device = device_of(row, symbol.device, first) if symbol.device else ""
            return Binding(tokens, device=device, symbol=symbol.name, declared_symbol=symbol)
        if DEVICE_PATTERN.fullmatch(text):
            device = device_of(row, text.upper(), first)
            return Binding(tokens, device=device, declared_symbol=self.by_device.get(device))
        if is_constant(tokens):
            if row.name in SYMBOL_OPERANDS:
                who = "the process" if row.name == "PV" else "the instruction"
                raise first.error(
                    f"{row.name}: {who} writes it, so that it cannot be {text}; write a symbol or a device"
                )
            return Binding(tokens, content=constant_content(row, tokens))
        if len(tokens) == 1 and first.kind == NAME:
            return Binding(tokens, symbol=first.text)
        kinds = "a symbol or a device" if row.name in SYMBOL_OPERANDS else "a number, a symbol or a device"
        raise first.error(f"{row.name}: {text[:60]} is an expression; an operand of DPIDE is {kinds}")

    def _check_type(self, row: Parameter, symbol: Symbol, place: Token) -> None:
        declaration = symbol.declaration
        kind = " ".join(token.upper for token in declaration.type)
        types_allowed = COMPATIBLE_TYPES.get(row.type.name, frozenset((row.type.name,)))
        if row.name == "I_MV" and declaration.type and declaration.type[0].upper == "ARRAY":
            count = len(registers_of(" ".join(token.text for token in declaration.type), symbol.device or "D0"))
            if count >= BLOCK_REGISTERS:
                return
            raise place.error(
                f"I_MV takes {BLOCK_REGISTERS} registers; {symbol.name} has {count} (line {declaration.name.line})"
            )
        if kind not in types_allowed:
            types = " or ".join(sorted(types_allowed))
            raise place.error(
                f"{row.name} is {types}; {symbol.name} is declared as {kind[:40]} in line {declaration.name.line}"
            )

    def flag_device(self, tokens: Sequence[Token]) -> str | None:
        """The bit of the PLC that a condition is; None: it is none, or more than one."""
        text = join_tokens(tokens).upper()
        symbol = self.symbols.get(text)
        device = symbol.device if symbol is not None else text
        try:
            return parse_flag_device(device)
        except ValueError:
            return None


def device_of(row: Parameter, device: str, token: Token) -> str:
    """A device that an operand can have; raises `ListingError` with what it can be."""
    try:
        return parse_flag_device(device) if row.type is BOOL else parse_register(device)
    except ValueError as error:
        context = getattr(error, "context", None) or {}
        cure = f"; {context['help']}" if context.get("help") else ""
        raise token.error(f"{row.name} is {row.type.name}: {error}{cure}") from None


# --- numbers ---------------------------------------------------------------------------------------------------------


def is_constant(tokens: Sequence[Token]) -> bool:
    """Whether a number or a truth stands here, perhaps with a sign."""
    unsigned = [token for token in tokens if token.text not in SIGNS]
    if CONSTANT_PATTERN.fullmatch(join_tokens(tokens)):
        return True
    return len(unsigned) == 1 and (
        unsigned[0].kind in {NUMBER, TYPED_LITERAL} or (unsigned[0].kind == NAME and unsigned[0].upper in BOOLEAN_WORDS)
    )


def constant_content(row: Parameter, tokens: Sequence[Token], *, initial: bool = False) -> Content:
    """The number at an operand, of exactly its type (D607); ``initial``: as an initial value of one."""
    text = join_tokens(tokens)
    if sum(token.text in SIGNS for token in tokens) > 1:
        raise tokens[0].error(f"{row.name}: {text[:40]} has several signs")
    value, form = _literal_value(tokens)
    content = None
    if initial and form == "whole":
        if row.type is REAL:
            value, form = float(value), "real"
        elif row.type is BOOL and value in {0, 1}:
            value, form = bool(value), "bool"
    if _has_form(row.type, form):
        content = read_content(row.type, value)
    if content is None:
        raise tokens[0].error(
            f"{row.name} is {row.type.name}, not {text[:40]}; {_constant_cure(row.type, value, form)}"
        )
    return content


def _literal_value(tokens: Sequence[Token]) -> tuple[bool | int | float, str]:
    """The value of a literal and what it is: bool, whole, real or time."""
    has_sign = tokens[0].text in SIGNS
    match = CONSTANT_PATTERN.fullmatch(join_tokens(tokens))
    if match is not None:
        text = match.group(2)
        if match.group(1).upper() == "K" and not WHOLE_NUMBER_PATTERN.fullmatch(text):
            raise tokens[0].error(f"{join_tokens(tokens)[:40]}: K stands before whole numbers")
        try:
            return (int(text), "whole") if match.group(1).upper() == "K" else (float(text), "real")
        except ValueError:
            raise tokens[0].error(f"{join_tokens(tokens)[:40]} is no number") from None
    token = tokens[-1]
    if token.kind == NAME:
        return BOOLEAN_WORDS[token.upper], "other" if has_sign else "bool"
    number = number_of(token)
    if isinstance(number, bool):
        return number, "bool"
    if isinstance(number, TimeNumber):
        return float(number), "time"
    if has_sign and tokens[0].text == "-":
        number = -number
    if isinstance(number, int):
        return number, "real" if token.upper.startswith(("REAL#", "LREAL#")) else "whole"
    return float(number), "real"


def _has_form(kind: IecType, form: str) -> bool:
    return {"bool": form == "bool", "whole": form == "whole", "real": form == "real"}[kind.kind]


def _constant_cure(kind: IecType, value: float, form: str) -> str:
    """What to write instead."""
    if kind is BOOL:
        return "write TRUE or FALSE"
    if kind is REAL:
        if form == "real":
            return "single precision goes up to 3.4E38"
        return f"write {float(value)}" if form == "whole" else "write a number with a point, as in 80.0"
    if form == "real" and value == int(value):
        return f"write {int(value)}"
    return f"write a whole number from {kind.low} to {kind.high}"


def initial_value(row: Parameter, symbol: Symbol | None) -> Content | None:
    """What a variable holds at first, where its declaration says that."""
    initial = None if symbol is None else symbol.declaration.initial
    if symbol is None or not initial or isinstance(initial, dict):
        return None
    if not is_constant(initial):
        raise ListingError(f"{symbol.name} begins with something that is no number", initial[0].line, initial[0].column)
    return constant_content(row, initial, initial=True)


# --- A symbol table of ISPSoft to a listing: the loops whose symbols have the names that pidcfg gives them (D610) -----

D610 = Decision(
    610,
    "a symbol table holds the loops whose symbols are all there",
    "A loop is read where a symbol ends in _IMV and those of all other operands stand beside it, with the suffixes of "
    "D256. Its name is what they begin with; units, ranges and the interval of an interrupt task are not in the table. "
    "With a program beside it, the program says which symbols are operands, whatever their names.",
    "Nothing else in a table says what a symbol is for; one that is missing would leave a default in its place.",
)
BLOCK_SUFFIX = f"_{SUFFIXES['I_MV']}"


@dataclass(slots=True)
class SymbolListing(ParameterListing):
    """The listing of a symbol table, with all of its rows."""

    table: Table = field(default_factory=Table)


def read_symbols(text: str) -> Listing:
    """The loops of a symbol table; raises `ListingError` at a row that is none."""
    listing = SymbolListing(table=parse_symbols(text.lstrip("\ufeff")))
    listing.settings = tuple(_loop_settings(listing))
    listing.is_mixed = True
    return listing


def _loop_settings(listing: SymbolListing) -> Iterator[Data]:
    rows = listing.table.by_name
    for block in [row for row in listing.table.rows if any(row.cells) and _is_block(row)]:
        loop = block.name[: -len(BLOCK_SUFFIX)]
        names = {row.name: f"{loop}_{SUFFIXES.get(row.name, row.name)}".casefold() for row in DPIDE_TABLE.rows}
        missing = [operand for operand, name in names.items() if name not in rows]
        if len(missing) == len(names) - 1:
            continue
        if missing:
            shown = ", ".join(f"{loop}_{SUFFIXES.get(name, name)}" for name in missing)
            raise ListingError(f"{loop} has no symbol {shown}; a loop has one for each operand", block.line)
        devices = {}
        for operand, name in names.items():
            row = rows[name]
            if device := device_in(ROWS[operand], row):
                devices[operand] = device
            content = value_in(ROWS[operand], row)
            if operand in {"I_MV", "MV"} or (operand == "PV" and content is None):
                continue
            full = f"{loop}.{operand}"
            listing.add(full, UnknownContent(row.name) if content is None else content, full, row.line)
        entry: dict[str, object] = {"loop": loop}
        entry |= {"device": devices.pop("I_MV")} if "I_MV" in devices else {}
        units = units_in_comments({operand: rows[name].comment for operand, name in names.items()})
        yield entry | ({"devices": devices} if devices else {}) | units


def _is_block(row: Row) -> bool:
    return row.name.casefold().endswith(BLOCK_SUFFIX.casefold()) and len(row.name) > len(BLOCK_SUFFIX)


def device_in(row: Parameter, symbol: Row) -> str:
    """The device of an operand's symbol; raises `ListingError` for one that it cannot have."""
    if not symbol.address:
        return ""
    return device_of(row, symbol.address, tokens_of(symbol.address, symbol.line)[0][0])


def value_in(row: Parameter, symbol: Row) -> Content | None:
    """The initial value of an operand's symbol; raises `ListingError` for one that is none of its type."""
    if not symbol.value or row.name in {"I_MV", "MV"}:
        return None
    tokens = tokens_of(symbol.value, symbol.line)[0][:-1]
    if not is_constant(tokens):
        raise ListingError(f"{symbol.name} begins with {symbol.value[:40]}, which is no number", symbol.line)
    return constant_content(row, tokens, initial=True)
