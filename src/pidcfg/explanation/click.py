"""What is said about the CLICK: its blocks, error numbers and nicknames."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.click import BLOCKS, C_BLOCK, DF_BLOCK, DS_BLOCK, SPACE, SUFFIXES
from pidcfg.encoders.maps.click_meanings import CODES, DOUBTS, WORDS, WRITERS
from pidcfg.explanation.annotate import Claim, Start, block_claims
from pidcfg.explanation.direction import Direction
from pidcfg.explanation.find_register import Block, RegisterBook, Series
from pidcfg.explanation.unstored_keys import DIALOG, FILE
from pidcfg.explanation.values import Setting

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.schemas.click import Loop


def setting_of(loop: Loop, config: object) -> Setting:  # noqa: ARG001 - the signature of all vendors' own
    """The units of a loop of a configuration; its registers are engineering units already."""
    return Setting({}, {key: unit for key, unit in (("pv", loop.pv.unit), ("output", loop.output.unit)) if unit})


def claims(
    words: Mapping[int, int], settings: Any, plc: Mapping[str, Any], options: Mapping[str, Any]
) -> Iterator[tuple[int, Claim]]:
    """What each address of a listing is, by the blocks that stand beside it or are named by options."""
    del words, plc
    for own, blocks in block_claims(settings, options, BLOCKS, SPACE, "LOOP{}"):
        known = Setting({}, {key: str(own[key]["unit"]) for key in ("pv", "output") if _has_unit(own.get(key))})
        for loop, start, table in blocks:
            yield from ((start + word.offset, Claim(table, word, loop, known)) for word in table.words)


def _has_unit(part: Any) -> bool:
    return isinstance(part, dict) and bool(part.get("unit"))


BESIDE = {
    **dict.fromkeys(("bits", "integers", "floats", "output.pwm.bit"), DIALOG),
    **dict.fromkeys(
        ("name", "description", "mode", "action_verified", "pv.input_range", "pv.unit", "output.unit"), FILE
    ),
}
"""Keys that no register holds."""

EXPLAINER = RegisterBook(
    key="click",
    title="AutomationDirect CLICK",
    space=SPACE,
    blocks=(
        Block("C", C_BLOCK, "C101", ("c", "cn")),
        Block("DS", DS_BLOCK, "DS101", ("ds", "dsn")),
        Block("DF", DF_BLOCK, "DF101", ("df", "dfn")),
    ),
    words=WORDS,
    bits={},
    series=(
        Series(("ck", "clickerror", "piderror", "error"), "PID error", CODES, "a number that the help does not list"),
    ),
    forms=(
        ("a PID error number", "CK27"),
        ("a register of a loop", "DF106=120 --block DF101"),
        ("the same where the blocks begin at C101, DS101, DF101", "C102 --loop"),
        ("an offset in a block", "Cn+33"),
        ("a nickname", "TANK1_PID_ErrorCode=200"),
    ),
    settings=setting_of,
    direction=Direction("action", "the process's", {"direct": "direct", "forward": "direct", "reverse": "reverse"}),
    beside=BESIDE,
    starts=tuple(Start(key, prefix, f"{prefix}101") for key, (prefix, _) in BLOCKS.items()),
    remark=lambda word, _raw, _known: DOUBTS.get(word.name, ""),
    writers=WRITERS,
    claims=claims,
    aliases={suffix: name for name, suffix in SUFFIXES.items()},
)
