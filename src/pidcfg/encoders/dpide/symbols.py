"""The symbol table of ISPSoft: a CSV file in GBK with a symbol for each operand."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.dpide.operands import device_of, unit_of
from pidcfg.encoders.files import UnwritableError
from pidcfg.encoders.maps.dpide import DPIDE_TABLE, OUTSIDE
from pidcfg.encoders.parameters import shown
from pidcfg.refs import Decision
from pidcfg.schemas.dpide_devices import place_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Any

    from pidcfg.encoders.parameters import Parameter, Program

D256 = Decision(
    256,
    "symbols are the loop's name and a short suffix",
    "Identifiers have at most 34 characters; suffixes have up to 5, so that loops may have names of 28. Blanks and "
    "signs in a name become underscores. A name that is too long, begins with a digit, or gives an identifier that "
    "another loop has, is refused rather than cut.",
    "A cut name could be that of another loop. An export of ISPSoft with 1,317 symbols has names of up to 34 "
    "characters, 1,088 of them of more than 16; none is known with a longer one.",
)
D257 = Decision(
    257,
    "initial values other than 0 of rows of REAL are not confirmed",
    "The symbol table has class VAR, GBK without a mark, CRLF, and the types BOOL, DINT and REAL; the checklist says "
    "that the values of REAL rows must be compared after the import.",
    "An export of ISPSoft has rows of REAL with an initial value, all of them 0, so how it writes others is not known.",
)

COLUMNS = ("Class", "Identifiers", "Address", "Type", "Initial Value", "Comment")
ENCODING = "gbk"
LONGEST = 34
ZERO = "0"
"""How exports of ISPSoft write the initial value of a REAL that is 0 (D257)."""
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
BREAK = re.compile(r"[ .\-/#]+")
SUFFIXES = {
    "PID_RUN": "RUN",
    "PID_MODE": "MODE",
    "PID_MAN": "MAN",
    "MOUT_AUTO": "AUTO",
    "Kc_Kp": "KP",
    "Ti_Ki": "KI",
    "Td_Kd": "KD",
    "Tf": "TF",
    "PID_EQ": "EQ",
    "PID_DE": "DE",
    "PID_DIR": "DIR",
    "ERR_DBW": "DBW",
    "MV_MAX": "MAX",
    "MV_MIN": "MIN",
    "I_MV": "IMV",
}
"""Ends of identifiers; the others are the operand's name."""
LONGEST_LOOP = LONGEST - 1 - max(len(SUFFIXES.get(row.name, row.name)) for row in DPIDE_TABLE.rows)


class Symbol(NamedTuple):
    """A row of the table; device and initial value are empty where there is none."""

    name: str
    address: str
    type: str
    value: str
    comment: str
    registers: range
    """The D registers that it takes."""


def write_symbols(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """A symbol for each operand; raises `UnwritableError` for a loop whose name gives none."""
    del checklist
    lines = [",".join(COLUMNS), *(symbol_line(symbol) for symbol in symbols(image))]
    return "".join(f"{line}\r\n" for line in lines)


def symbol_line(symbol: Symbol) -> str:
    """A symbol as a row, without a line end."""
    return f"VAR,{symbol.name},{symbol.address},{symbol.type},{symbol.value},{symbol.comment}"


def symbols(image: Program) -> Iterator[Symbol]:
    """The symbols of all operands; raises `UnwritableError` for a loop whose name gives none."""
    taken: dict[str, str] = {}
    for settings in image.settings:
        contents = {cell.field: cell for cell in image.cells if cell.loop == settings["loop"]}
        dependent = bool(contents["PID_EQ"].raw)
        for row in DPIDE_TABLE.rows:
            name = identifier(str(settings["loop"]), row.name)
            other = taken.setdefault(name.casefold(), str(settings["loop"]))
            if other != settings["loop"]:
                raise UnwritableError(f"loops {other} and {settings['loop']} would share the symbol {name}")
            content = "" if row.name in OUTSIDE else shown(row.type, contents[row.name].raw)  # type: ignore[arg-type]
            content = ZERO if content == "0.0" else content
            comment = _plain(", ".join(_comment(row, settings, dependent=dependent)))
            device = device_of(settings, row.name) or ""
            yield Symbol(name, device, row.type.name, content, comment, _registers(row.name, device))


def _registers(operand: str, device: str) -> range:
    place = place_of(operand, device) if device else None
    return range(place.first, place.last + 1) if place is not None and place.bank == "D" else range(0)


def identifier(loop: str, operand: str) -> str:
    """The symbol of an operand."""
    reason = unusable(loop)
    if reason is not None:
        raise UnwritableError(f"loop {loop}: no symbols can be made of the name: {reason}")
    return f"{BREAK.sub('_', loop)}_{SUFFIXES.get(operand, operand)}"


def unusable(loop: str) -> str | None:
    """Why a loop's name gives no symbols; None: it does."""
    if not IDENTIFIER.fullmatch(BREAK.sub("_", loop)):
        return "it must begin with a letter; letters, digits and signs may follow"
    if len(loop) > LONGEST_LOOP:
        return f"it has {len(loop)} characters; at most {LONGEST_LOOP} leave room for the suffix"
    return None


def _comment(row: Parameter, settings: Mapping[str, Any], *, dependent: bool) -> Iterator[str]:
    yield f"{row.name}: {row.title}"
    if row.name == "I_MV":
        yield f"30 registers {place_of(row.name, settings['device'])}"
    if unit := unit_of(row, settings, dependent=dependent):
        yield unit


def _plain(text: str) -> str:
    """A comment without commas and quotes, of characters that GBK has."""
    bare = text.replace(",", ";").replace('"', "'")
    return bare.encode(ENCODING, "replace").decode(ENCODING)
