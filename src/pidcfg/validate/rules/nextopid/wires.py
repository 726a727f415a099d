"""Wires and names: what means nothing, what nobody reads, and names that stand for two things."""

from __future__ import annotations

import re
from itertools import chain
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.encode import WireError
from pidcfg.encoders.nextopid.wiring import D204, D205
from pidcfg.refs import NEXTOPID, Decision
from pidcfg.schemas.names import nearest
from pidcfg.validate.ideas.duplicates import in_words
from pidcfg.validate.rule import Finding, Findings, error, info, warning

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.paths import Path
    from pidcfg.validate.rules.nextopid.context import NextopidContext

BLOCKS = NEXTOPID.at("chapter 1: Introduction")
LOOP = "the loop"

D209 = Decision(
    209,
    "a name stands for one thing",
    "Capital and small letters are one. The program, its signals and its blocks have names of their own, and none has "
    "that of a type of the library (error) or of a standard function or function block (warning).",
    "It is what IEC 61131-3 says of identifiers; the manual says nothing of names.",
)
D210 = Decision(
    210,
    "a filter, delay or lag that nothing reads is a mistake",
    "An output of ControlLowFilter, ControlDelay, ControlLag, ControlDelayLag and ControlLeadLag that no wire reads is "
    "a warning, a signal that no wire reads an info. MV of loops, selectors and PWM may go to the program around.",
    "They are made to be wired to another block; the valve is connected outside.",
)

STRUCTURES = (
    "PIDA_ERROR_BITS PIDA_WARNING_BITS ON_OFF_ERROR_BITS ON_OFF_WARNING_BITS AUTOTUNE_PARAM AUTOTUNE_RESULT "
    "AUTOTUNE_MODE AUTOTUNE_P AUTOTUNE_PI AUTOTUNE_PID"
)
LIBRARY = {name.casefold(): name for name in (*BLOCK_TYPES, *STRUCTURES.split())}
FUNCTIONS = """
    SIN COS TAN ASIN ACOS ATAN EXPT ADD SUB MUL DIV MOVE SHL SHR ROL ROR GT GE EQ LE LT NE LEN LEFT RIGHT MID CONCAT
    EXP LN LOG LIMIT SEL MUX INSERT DELETE REPLACE FIND TRUNC ADR SIZEOF SR RS SEMA R_TRIG F_TRIG CTU CTD CTUD TP TON
    TOF RTC POINTER REFERENCE METHOD THIS SUPER INTERFACE UNION BIT EN ENO PUBLIC PRIVATE PERSISTENT CONTINUE JMP
"""
_REFUSED = """
    SEL LIMIT ADR THIS SUPER BIT METHOD INI PROPERTY CONTINUE JMP POINTER REFERENCE INTERFACE UNION
"""
REFUSED = frozenset(_REFUSED.split())
"""Names that CODESYS does not compile as those of a variable; conversions, INT_TO_REAL, are others."""
STANDARD = frozenset(FUNCTIONS.split()) | REFUSED
_TYPE = "(BOOL|BYTE|WORD|DWORD|LWORD|U?[SDL]?INT|L?REAL|TIME|DATE|STRING|ANY)"
CONVERSION = re.compile(rf"{_TYPE}_TO_\w+|TO_{_TYPE}")
PASSIVE = ("ControlLowFilter", "ControlDelay", "ControlLag", "ControlDelayLag", "ControlLeadLag")
"""Blocks whose output is of use only to other blocks."""


@error("NX601", D205, "{key}: {problem}")
def wire_without_meaning(context: NextopidContext) -> Findings:
    """A parameter is wired to something that does not exist, has another type, or cannot be read.

    Why: the program that is written from it would not compile, or the parameter would keep 0. A BOOL takes the name of
    a BOOL, a number an expression of numbers: declared signals, `NAME.Parameter`, + - * / and min, max, abs, sqrt.

    Fix: correct the character that the message points at.
    """
    for path, misfit in context.encoding.misfits:
        error = misfit.error
        if isinstance(error, WireError):
            cure = _cure(context, str(misfit.value), error)
            yield Finding(path, {"key": misfit.word.name, "problem": str(error)}, fix=cure, offset=error.offset)


def _cure(context: NextopidContext, text: str, error: WireError) -> str:
    """The cure; for ``NAME.Parameter`` the nearest parameter of the block, if there is such a block."""
    word = re.match(r"(\w+)\.(\w[\w.]*)", text[error.offset :])
    kinds = {placed.item.name: placed.kind for placed in context.encoding.items}
    if word is None or word.group(1) not in kinds or word.group() in context.encoding.layout.types:
        return error.cure
    near = nearest(word.group(2), [row.name for row in kinds[word.group(1)].table.rows])
    return f"did you mean '{word.group(1)}.{near}'?" if near else error.cure


@error("NX602", D204, "{names} within the same cycle")
def ring_without_delay(context: NextopidContext) -> Findings:
    """Blocks that answer at once are wired in a ring.

    Why: selectors, split ranges, lead-lags and delays of 0 s pass their input on within the same call. In a ring of
    nothing else the value depends on which of them is called first, and runs away.

    Fix: put a filter, a lag or a delay into the ring, or take one of the wires away.
    """
    for ring in context.encoding.rings:
        names = [context.views[i].name for i in ring]
        several = f"{', '.join(names[:-1])} and {names[-1]} feed each other"
        text = f"{names[0]} feeds itself" if len(names) == 1 else several
        loops = [context.views[i].name for i in ring if context.views[i].placed.is_loop]
        for view in (context.views[i] for i in ring):
            yield view.at("name", names=text).shared_with(*(name for name in loops if name != view.name))


@error("NX603", BLOCKS, "{name} is the library's own {taken}")
def name_of_a_library_block(context: NextopidContext) -> Findings:
    """A signal or an instance has the name of one of the library's blocks, functions or structures.

    Why: a declaration such as `ControlPWM : ControlPWM` does not compile, or hides the block from the program.

    Fix: name it after what it does, such as TIC101 or VALVE_PWM.
    """
    for _, name, path in named(context):
        if name.casefold() in LIBRARY:
            yield Finding(path, {"name": name, "taken": LIBRARY[name.casefold()]}, key=path[0] == "signals")


@error("NX604", D209, "the name {name} is also that of {others}{letters}")
def name_used_twice(context: NextopidContext) -> Findings:
    """The program, its signals and its blocks do not all have names of their own.

    Why: the names are variables of one program, where capital and small letters are the same: the second declaration
    does not compile, and a wire could mean either.

    Fix: rename one of them.
    """
    groups: dict[str, list[tuple[str, str, Path]]] = {}
    for row in named(context):
        groups.setdefault(row[1].casefold(), []).append(row)
    for rows in groups.values():
        for what, name, path in rows if len(rows) > 1 else ():
            mine = (what, name) if what == LOOP else None  # loops of one name have PID106
            others = [row for row in rows if row[2] != path and row[:2] != mine]
            if others:
                same = all(row[1] == name for row in others)
                letters = "" if same else ": capital and small letters are the same"
                values = {"name": name, "others": in_words([" ".join(row[:2]) for row in others]), "letters": letters}
                loops = (row[1] for row in others if row[0] == LOOP)
                yield Finding(path, values, key=path[0] == "signals").shared_with(*loops)


@info("NX605", D210, "no wire reads the signal {name}")
def unused_signal(context: NextopidContext) -> Findings:
    """A signal is declared, and nothing reads it and no move writes it.

    Why: it has no effect. Often it was meant for a parameter that still holds a number.

    Fix: wire it, or remove it.
    """
    used = _read(context) | {move.to for move in context.config.moves}
    for name in context.config.signals:
        if name not in used:
            yield Finding(("signals", name), {"name": name}, key=True)


@warning("NX606", D209, "{name} is also a standard function or function block")
def name_of_a_standard_function(context: NextopidContext) -> Findings:
    """A signal or an instance shadows a standard function or function block.

    Why: within the program the name means the variable, and the standard function cannot be called any more. CODESYS
    does not compile some of them, such as SEL, LIMIT and INT_TO_REAL: those are errors.

    Fix: choose another name.
    """
    for _, name, path in named(context):
        refused = name.upper() in REFUSED or CONVERSION.fullmatch(name.upper())
        if refused or name.upper() in STANDARD:
            severity = Severity.ERROR if refused else None
            yield Finding(path, {"name": name}, key=path[0] == "signals", severity=severity)


@warning("NX607", D210, "nothing reads {name}.OutVar")
def unused_output(context: NextopidContext) -> Findings:
    """A filter, delay or lag works for nobody.

    Why: its output reaches no loop. A PV filter beside the loop filters nothing, and a feed-forward that is not wired
    to BIAS does not act; both look complete.

    Fix: wire the output to the parameter that it was made for, or remove the block.
    """
    read = _read(context)
    for view in context.of(*PASSIVE):
        if f"{view.name}.OutVar" not in read:
            yield view.at("name", name=view.name)


def named(context: NextopidContext) -> Iterator[tuple[str, str, Path]]:
    """Everything of the program that has a name: what it is, its name, and where that stands."""
    yield "the program", context.config.plc.program, ("plc", "program")
    for name in context.config.signals:
        yield "the signal", name, ("signals", name)
    for placed in context.encoding.items:
        yield LOOP if placed.is_loop else "the block", placed.item.name, (*placed.place, "name")


def _read(context: NextopidContext) -> set[str]:
    """The names that wires and moves read, also those that mean nothing."""
    wires = context.encoding.wires.values()
    copies = (copy for copy in context.encoding.copies if copy is not None)
    moved = (part for copy in copies for part in (copy.value, copy.when) if part is not None)
    read = {context.names[number] for number in chain.from_iterable(wire.signals for wire in (*wires, *moved))}
    texts = (str(m.value) for _, m in context.encoding.misfits if isinstance(m.error, WireError))
    return read | set(chain.from_iterable(re.findall(r"\w[\w.]*", text) for text in texts))
