"""What is said about DPIDE: its operands, modes, and the words of I_MV."""

from __future__ import annotations

from collections.abc import Mapping

from pidcfg.encoders.maps.dpide import CODES, D254, DPIDE_TABLE, INTEGRAL_WORDS, ROWS, STATES, WRITER_TEXTS
from pidcfg.encoders.parameters import Content, Parameter
from pidcfg.output.explanation.book import Direction, Series
from pidcfg.output.explanation.parameters import ParameterBook, Words
from pidcfg.schemas.dpide import MAX_CYCLE, MIN_CYCLE

INSTRUCTION = "DPIDE"
TERM_NAMES = {
    "Kc_Kp": "proportional term, in the dependent form no control at all",
    "Ti_Ki": "integral",
    "Td_Kd": "derivative",
}
"""The terms that a coefficient of 0 switches off."""


def split_name(name: str, _types: Mapping[str, str]) -> tuple[str, str | None, str]:
    """``OVEN.SV`` to its loop, the instruction and the operand."""
    loop, _, operand = name.rpartition(".")
    return loop, INSTRUCTION if operand in ROWS else None, operand


def number_remark(row: Parameter, raw: Content) -> str:
    """What the PLC makes of a number that is not allowed, or switches a term off."""
    if isinstance(raw, bool | str):
        return ""
    if row.name == "PID_MODE" and raw not in {code.number for code in CODES}:
        return f"no mode; the modes are {', '.join(str(code.number) for code in CODES)}"
    if row.name == "CYCLE" and not MIN_CYCLE <= raw <= MAX_CYCLE:
        return f"the PLC takes {MIN_CYCLE if raw < MIN_CYCLE else MAX_CYCLE} ms"
    if row.name in TERM_NAMES and raw <= 0:
        return f"no {TERM_NAMES[row.name]}" if raw == 0 else f"counts as 0: no {TERM_NAMES[row.name]}"
    return ""


EXPLAINER = ParameterBook(
    key="dpide",
    tables={INSTRUCTION: DPIDE_TABLE},
    examples=(
        ("an operand, with its value", "PID_MODE=2"),
        ("an operand of the instruction", "DPIDE.ERR_DBW"),
        ("a double word of I_MV", "I_MV+6"),
    ),
    split_name=split_name,
    direction=Direction("PID_DIR", "the process's", {"forward": "PID_DIR TRUE", "reverse": "PID_DIR FALSE"}),
    series=(Series("mode", CODES),),
    states=STATES,
    writers=WRITER_TEXTS,
    remark=number_remark,
    words=Words("I_MV", INTEGRAL_WORDS, str(D254)),
)
