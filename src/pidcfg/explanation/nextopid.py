"""What is said about NextoPID: its blocks, and the bits of their structures."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.maps.nextopid_meanings import BITS, D325, GROUPS, OWN_BITS, STATES
from pidcfg.explanation.direction import Direction
from pidcfg.explanation.find_parameter import Group, NamedBook
from pidcfg.schemas.document import field_texts, models_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


@cache
def _texts(block: str) -> dict[str, str]:
    model = BLOCK_TYPES[block].model
    own = {key: text for found in reversed(models_of(model)) for key, text in field_texts(found).items()}
    return own | field_texts(model)


def text(block: str, name: str) -> str:
    """What an input is, from the schema of its block."""
    return _texts(block).get(name.rpartition(".")[2], "")


def split(name: str, settings: Sequence[Mapping[str, Any]]) -> tuple[str, str | None, str]:
    """``TIC_1.Kp`` to its loop, the type of its block and the parameter."""
    loop, _, parameter = name.partition(".")
    kind = next((s.get("type") for s in settings if loop in {s.get("loop"), s.get("block")}), None)
    return loop, kind if isinstance(kind, str) else None, parameter


EXPLAINER = NamedBook(
    key="nextopid",
    title="Altus NextoPID",
    tables={name: kind.table for name, kind in BLOCK_TYPES.items()},
    text=text,
    forms=(
        ("a structure of bits, with its value", "ErrBits=0x0005"),
        ("one of its bits", "ErrBits.Kp"),
        ("a result of the auto-tuning", "AutoTuneResult.PEAK_TOO_LOW"),
        ("a parameter of a block", "PIDA_REAL.Kp"),
    ),
    split=split,
    direction=Direction("Direct", "the controller's", {"direct": "Direct TRUE", "reverse": "Direct FALSE"}),
    groups=tuple(Group(name, meaning, lambda row: row.type.kind == "bool") for name, meaning in GROUPS.items()),
    bits=BITS,
    own_bits=OWN_BITS,
    states=STATES,
    counted=str(D325),
)
