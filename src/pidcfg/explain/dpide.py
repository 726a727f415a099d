"""What is said about DPIDE: its operands, modes, and the words of I_MV."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.dpide.decode import split as split_name
from pidcfg.encoders.maps.dpide import D254, DPIDE_TABLE, ROWS
from pidcfg.encoders.maps.dpide_meanings import CODES, INTEGRAL, STATES
from pidcfg.explain.named import NamedBook
from pidcfg.explain.texts import key_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

NAME = "DPIDE"


def split(name: str, settings: Sequence[Mapping[str, Any]]) -> tuple[str, str | None, str]:  # noqa: ARG001 - one kind of block
    """``OVEN.SV`` to its loop, the instruction and the operand."""
    loop, operand = split_name(name)
    return loop, NAME if operand in ROWS else None, operand


EXPLAINER = NamedBook(
    key="dpide",
    title="Delta AS",
    tables={NAME: DPIDE_TABLE},
    text=lambda _, name: key_text("dpide", name),
    forms=(
        ("an operand, with its value", "PID_MODE=2"),
        ("an operand of the instruction", "DPIDE.ERR_DBW"),
        ("a double word of I_MV", "I_MV+6"),
    ),
    split=split,
    codes=CODES,
    states=STATES,
    parts=("I_MV", INTEGRAL, str(D254)),
)
