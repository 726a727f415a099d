"""What is said about the CLICK: its blocks, error numbers and nicknames."""

from __future__ import annotations

from functools import partial

from pidcfg.encoders.maps.click import (
    BLOCKS,
    C_BLOCK,
    CODES,
    DF_BLOCK,
    DS_BLOCK,
    INFERRED_REMARKS,
    SPACE,
    SUFFIXES,
    WORD_MEANINGS,
    WRITER_TEXTS,
)
from pidcfg.output.explanation.book import Direction, Series, Start, block_claims
from pidcfg.output.explanation.page import Scaling
from pidcfg.output.explanation.registers import IN_DIALOG_TEXT, IN_FILE_TEXT, Block, RegisterBook
from pidcfg.schemas.base import units_of


def scaling_of(loop: object, *_others: object) -> Scaling:
    """The units of a loop, by its configuration or beside a listing; its registers are engineering units already."""
    return Scaling({}, units_of(loop))


UNSTORED_KEYS = {
    **dict.fromkeys(("bits", "integers", "floats", "output.pwm.bit"), IN_DIALOG_TEXT),
    **dict.fromkeys(
        ("name", "description", "mode", "action_verified", "pv.input_range", "pv.unit", "output.unit"), IN_FILE_TEXT
    ),
}
"""Keys that no register holds."""

ERROR_PREFIXES = ("ck", "clickerror", "piderror", "error", "errorcode", "pidfehler", "fehler")
"""What people write before an error number."""

EXPLAINER = RegisterBook(
    key="click",
    space=SPACE,
    blocks=(
        Block("C", C_BLOCK, "C101", ("c", "cn")),
        Block("DS", DS_BLOCK, "DS101", ("ds", "dsn")),
        Block("DF", DF_BLOCK, "DF101", ("df", "dfn")),
    ),
    words=WORD_MEANINGS,
    series=(Series("PID error", CODES, "a number that the help does not list", ERROR_PREFIXES),),
    examples=(
        ("a PID error number", "CK27"),
        ("a register of a loop", "DF106=120 --block DF101"),
        ("the same where the blocks begin at C101, DS101, DF101", "C102 --loop"),
        ("an offset in a block", "Cn+33"),
        ("a nickname", "TANK1_PID_ErrorCode=200"),
    ),
    scaling=scaling_of,
    direction=Direction("action", "the process's", {"direct": "direct", "forward": "direct", "reverse": "reverse"}),
    unstored_keys=UNSTORED_KEYS,
    starts=tuple(Start(key, prefix, f"{prefix}101") for key, (prefix, _) in BLOCKS.items()),
    remark=lambda word, _raw, _scaling: INFERRED_REMARKS.get(word.name, ""),
    writers=WRITER_TEXTS,
    placements=partial(block_claims, BLOCKS, SPACE, "LOOP{}", scaling_of),
    aliases={suffix: name for name, suffix in SUFFIXES.items()},
)
