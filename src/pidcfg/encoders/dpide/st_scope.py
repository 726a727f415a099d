"""What the names of a program are, and what stands at an operand: a number, a symbol, or a device of the PLC."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.dpide.program import WITHOUT_NUMBER
from pidcfg.encoders.dpide.symbol_table import registers_of
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.parameters import read
from pidcfg.encoders.st.lex import NAME, NUMBER, TYPED
from pidcfg.encoders.st.values import TRUTHS, number_of
from pidcfg.schemas.dpide_devices import BLOCK, parse_flag_device, parse_register
from pidcfg.schemas.iec import BOOL, REAL, Timed

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from pidcfg.encoders.parameters import Content, Parameter
    from pidcfg.encoders.st.lex import Token
    from pidcfg.encoders.st.parse import Declaration
    from pidcfg.schemas.iec import IecType

DEVICE = re.compile(r"(?:X|Y|M|SM|S|D|SR|T|C|HC|E|FR)\d+(?:\.\d+)?", re.IGNORECASE)
CONSTANT = re.compile(r"([KF])([-+]?[0-9.]+(?:E[-+]?[0-9]+)?)", re.IGNORECASE)
"""A number with its sign of ISPSoft before it: K whole, F real."""
SAME_TYPE = {"DINT": frozenset(("DINT", "DWORD"))}
"""Types of a variable that an operand takes; the manual's table has both of these."""
WHOLE, REAL_FORM = re.compile(r"[-+]?[0-9]+"), re.compile(r"[-+]?[0-9]*\.[0-9]+(?:E[-+]?[0-9]+)?", re.IGNORECASE)


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
    declared: Symbol | None = None

    @property
    def text(self) -> str:
        """As it is written."""
        return joined(self.tokens)

    @property
    def names(self) -> set[str]:
        """What it is called in statements, in capitals: its symbol, and its device."""
        return {name.upper() for name in (self.text, self.device, self.declared.name if self.declared else "") if name}


def joined(tokens: Iterable[Token]) -> str:
    """Tokens without what stood between them."""
    return "".join(token.text for token in tokens)


@dataclass(slots=True)
class Scope:
    """The variables of a unit and those of all units, in capitals, since the language ignores case."""

    symbols: dict[str, Symbol] = field(default_factory=dict)
    at: dict[str, Symbol] = field(default_factory=dict)
    """The variable that stands at a device."""

    def declare(self, declarations: Iterable[Declaration]) -> None:
        """Takes variables; a name twice is refused."""
        for declaration in declarations:
            upper = declaration.name.upper
            if upper in self.symbols:
                raise declaration.name.error(f"{declaration.name.text} is declared again")
            device = joined(declaration.address).upper()
            if device and not DEVICE.fullmatch(device):
                text = joined(declaration.address)
                raise declaration.address[0].error(f"{text[:40]} is no device of the PLC; write it like D100 or M10")
            self.symbols[upper] = Symbol(declaration, device)
            if device:
                self.at.setdefault(device, self.symbols[upper])

    # --- operands ----------------------------------------------------------------------------------------------------

    def bind(self, row: Parameter, tokens: tuple[Token, ...]) -> Binding:
        """What stands at an operand; raises `ListingError` for what it does not take."""
        text, first = joined(tokens), tokens[0]
        symbol = self.symbols.get(text.upper())
        if symbol is not None:
            self._check_type(row, symbol, first)
            device = device_of(row, symbol.device, first) if symbol.device else ""
            return Binding(tokens, device=device, symbol=symbol.name, declared=symbol)
        if DEVICE.fullmatch(text):
            device = device_of(row, text.upper(), first)
            return Binding(tokens, device=device, declared=self.at.get(device))
        if is_constant(tokens):
            if row.name in WITHOUT_NUMBER:
                who = "the process" if row.name == "PV" else "the instruction"
                raise first.error(
                    f"{row.name}: {who} writes it, so that it cannot be {text}; write a symbol or a device"
                )
            return Binding(tokens, content=constant(row, tokens))
        if len(tokens) == 1 and first.kind == NAME:
            return Binding(tokens, symbol=first.text)
        kinds = "a symbol or a device" if row.name in WITHOUT_NUMBER else "a number, a symbol or a device"
        raise first.error(f"{row.name}: {text[:60]} is an expression; an operand of DPIDE is {kinds}")

    def _check_type(self, row: Parameter, symbol: Symbol, at: Token) -> None:
        declared = symbol.declaration
        kind = " ".join(token.upper for token in declared.type)
        wanted = SAME_TYPE.get(row.type.name, frozenset((row.type.name,)))
        if row.name == "I_MV" and declared.type and declared.type[0].upper == "ARRAY":
            taken = len(registers_of(" ".join(token.text for token in declared.type), symbol.device or "D0"))
            if taken >= BLOCK:
                return
            raise at.error(f"I_MV takes {BLOCK} registers; {symbol.name} has {taken} (line {declared.name.line})")
        if kind not in wanted:
            types = " or ".join(sorted(wanted))
            raise at.error(
                f"{row.name} is {types}; {symbol.name} is declared as {kind[:40]} in line {declared.name.line}"
            )

    def flag(self, tokens: Sequence[Token]) -> str | None:
        """The bit of the PLC that a condition is; None: it is none, or more than one."""
        text = joined(tokens).upper()
        symbol = self.symbols.get(text)
        device = symbol.device if symbol is not None else text
        try:
            return parse_flag_device(device)
        except ValueError:
            return None


def device_of(row: Parameter, device: str, at: Token) -> str:
    """A device that an operand can have; raises `ListingError` with what it can be."""
    try:
        return parse_flag_device(device) if row.type is BOOL else parse_register(device)
    except ValueError as error:
        context = getattr(error, "context", None) or {}
        cure = f"; {context['help']}" if context.get("help") else ""
        raise at.error(f"{row.name} is {row.type.name}: {error}{cure}") from None


# --- numbers ---------------------------------------------------------------------------------------------------------


def is_constant(tokens: Sequence[Token]) -> bool:
    """Whether a number or a truth stands here, perhaps with a sign."""
    rest = [token for token in tokens if token.text not in {"+", "-"}]
    if CONSTANT.fullmatch(joined(tokens)):
        return True
    return len(rest) == 1 and (rest[0].kind in {NUMBER, TYPED} or (rest[0].kind == NAME and rest[0].upper in TRUTHS))


def constant(row: Parameter, tokens: Sequence[Token], *, initial: bool = False) -> Content:
    """The number at an operand, of exactly its type (D607); ``initial``: as an initial value of one."""
    text = joined(tokens)
    if text.count("+") + text.count("-") > 1 + ("E" in text.upper()):
        raise tokens[0].error(f"{row.name}: {text[:40]} has several signs")
    value, form = _value(tokens)
    content = None
    if initial and form == "whole":
        if row.type is REAL:
            value, form = float(value), "real"
        elif row.type is BOOL and value in {0, 1}:
            value, form = bool(value), "bool"
    if _fits(row.type, form):
        content = read(row.type, value)
    if content is None:
        raise tokens[0].error(f"{row.name} is {row.type.name}, not {text[:40]}; {_cure(row.type, value, form)}")
    return content


def _value(tokens: Sequence[Token]) -> tuple[bool | int | float, str]:
    """The value of a literal and what it is: bool, whole, real or time."""
    signed = tokens[0].text in {"+", "-"}
    match = CONSTANT.fullmatch(joined(tokens))
    if match is not None:
        text = match.group(2)
        if match.group(1).upper() == "K" and not WHOLE.fullmatch(text):
            raise tokens[0].error(f"{joined(tokens)[:40]}: K stands before whole numbers")
        try:
            return (int(text), "whole") if match.group(1).upper() == "K" else (float(text), "real")
        except ValueError:
            raise tokens[0].error(f"{joined(tokens)[:40]} is no number") from None
    token = tokens[-1]
    if token.kind == NAME:
        return TRUTHS[token.upper], "other" if signed else "bool"
    number = number_of(token)
    if isinstance(number, bool):
        return number, "bool"
    if isinstance(number, Timed):
        return float(number), "time"
    if signed and tokens[0].text == "-":
        number = -number
    if isinstance(number, int):
        return number, "real" if token.upper.startswith(("REAL#", "LREAL#")) else "whole"
    return float(number), "real"


def _fits(kind: IecType, form: str) -> bool:
    return {"bool": form == "bool", "whole": form == "whole", "real": form == "real"}[kind.kind]


def _cure(kind: IecType, value: float, form: str) -> str:
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


def initial_value(row: Parameter, declared: Symbol | None) -> Content | None:
    """What a variable holds at first, where its declaration says that."""
    initial = None if declared is None else declared.declaration.initial
    if declared is None or not initial or isinstance(initial, dict):
        return None
    if not is_constant(initial):
        raise ListingError(
            f"{declared.name} begins with something that is no number", initial[0].line, initial[0].column
        )
    return constant(row, initial, initial=True)
