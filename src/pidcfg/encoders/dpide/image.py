"""A Delta AS configuration to the operands of its DPIDE instructions and back, its gains, and the operands' symbols."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.image import Decoded, Settings
from pidcfg.encoders.maps.dpide import DPIDE_TABLE, LOOPS, REQUIRED_OPERANDS, TUNING_NUMBERS
from pidcfg.encoders.parameters import Content, UnknownContent
from pidcfg.encoders.regmap import LoopTuning
from pidcfg.schemas.dpide import MAX_CYCLE, MIN_CYCLE, DpideFile, Loop
from pidcfg.schemas.iec import Wire
from pidcfg.text.references import Decision

# --- A configuration to the operands of DPIDE instructions ------------------------------------------------------------

encode = LOOPS.encode

# --- The operands of DPIDE instructions back to a configuration -------------------------------------------------------


def decode(
    words: Mapping[str, Content | Wire],
    settings: Sequence[Mapping[str, object]] = (),
    plc: Settings | None = None,
    options: Mapping[str, object] | None = None,
) -> Decoded:
    """The configuration of these operands; raises `DecodeError` with the name of what is no value.

    An operand of which a program says only where it stands is FALSE or 0, and noted; it must be known where the
    instruction cannot do without (D609).
    """
    places = {name: content.text[:40] for name, content in words.items() if isinstance(content, UnknownContent)}
    for name, place in places.items():
        if LOOPS.split_name(name)[1] in REQUIRED_OPERANDS:
            cure = "name a symbol table beside the program, or declare its initial value"
            raise DecodeError(f"{name} stands in {place}, and nothing says what it holds; {cure}", name)
    decoded = LOOPS.decode({name: words[name] for name in words if name not in places}, settings, plc, options)
    notes = [f"{name} stands in {at}; nothing says what it holds: {_default_text(name)}" for name, at in places.items()]
    return replace(decoded, notes=(*notes, *decoded.notes))


def _default_text(name: str) -> str:
    """What a configuration has for an operand that it does not give."""
    default = LOOPS.loop.model_fields[LOOPS.split_name(name)[1]].default
    return f"it is taken for {str(default).upper() if isinstance(default, bool) else default}"


# --- How a DPIDE instruction holds its gains: engineering units, as times or as independent gains ---------------------

MS_PER_SECOND = 1000
"""In a second."""


def tuning_of(config: DpideFile, loop: Loop) -> LoopTuning:
    """The three operands of an instruction."""
    task = config.plc.interrupt_task
    seconds = float(min(max(loop.CYCLE, MIN_CYCLE), MAX_CYCLE) if task is None else task) / MS_PER_SECOND
    return LoopTuning(
        TUNING_NUMBERS,
        raises_pv=loop.PID_DIR,
        independent=not loop.PID_EQ,
        current_values=(loop.Kc_Kp, loop.Ti_Ki, loop.Td_Kd),
        sample_time=seconds,
        derivative_share=seconds / (float(loop.Tf) + seconds),
    )


# --- What ISPSoft calls the operands of a loop: its name and a short suffix -------------------------------------------

D256 = Decision(
    256,
    "symbols are the loop's name and a short suffix",
    "Identifiers have at most 34 characters; suffixes have up to 5, so that loops may have names of 28. Blanks and "
    "signs in a name become underscores. A name that is too long, begins with a digit, or gives an identifier that "
    "another loop has, is refused rather than cut.",
    "A cut name could be that of another loop. An export of ISPSoft with 1,317 symbols has names of up to 34 "
    "characters, 1,088 of them of more than 16; none is known with a longer one.",
)
MAX_SYMBOL_LENGTH = 34
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
WORD_BREAK = re.compile(r"[ .\-/#]+")
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
MAX_LOOP_NAME = MAX_SYMBOL_LENGTH - 1 - max(len(SUFFIXES.get(row.name, row.name)) for row in DPIDE_TABLE.rows)


def symbol_name(loop: str, operand: str) -> str:
    """The symbol of an operand of a loop whose name gives one."""
    return f"{WORD_BREAK.sub('_', loop)}_{SUFFIXES.get(operand, operand)}"


def unusable_reason(loop: str) -> str | None:
    """Why a loop's name gives no symbols; None: it does."""
    if not IDENTIFIER.fullmatch(WORD_BREAK.sub("_", loop)):
        return "it must begin with a letter; letters, digits and signs may follow"
    if len(loop) > MAX_LOOP_NAME:
        return f"it has {len(loop)} characters; at most {MAX_LOOP_NAME} leave room for the suffix"
    return None
