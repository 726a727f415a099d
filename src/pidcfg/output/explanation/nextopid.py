"""What is said about NextoPID: its blocks, and the bits of their structures."""

from __future__ import annotations

from collections.abc import Mapping

from pidcfg.encoders.maps.nextopid import BITS, BLOCK_BITS, BLOCK_TYPES, D325, GROUPS, STATES
from pidcfg.output.explanation.book import Direction
from pidcfg.output.explanation.parameters import BitGroup, ParameterBook


def split_name(name: str, types: Mapping[str, str]) -> tuple[str, str | None, str]:
    """``TIC_1.Kp`` to its loop, the type of its block and the parameter."""
    loop, _, parameter = name.partition(".")
    return loop, types.get(loop), parameter


EXPLAINER = ParameterBook(
    key="nextopid",
    tables={name: kind.table for name, kind in BLOCK_TYPES.items()},
    schemas={name: kind.model for name, kind in BLOCK_TYPES.items()},
    examples=(
        ("a structure of bits, with its value", "ErrBits=0x0005"),
        ("one of its bits", "ErrBits.Kp"),
        ("a result of the auto-tuning", "AutoTuneResult.PEAK_TOO_LOW"),
        ("a parameter of a block", "PIDA_REAL.Kp"),
    ),
    split_name=split_name,
    direction=Direction("Direct", "the controller's", {"direct": "Direct TRUE", "reverse": "Direct FALSE"}),
    groups=tuple(BitGroup(name, meaning, lambda row: row.type.kind == "bool") for name, meaning in GROUPS.items()),
    bits=BITS,
    block_bits=BLOCK_BITS,
    states=STATES,
    bit_count_basis=str(D325),
)
