"""What is said about the EZLogix: its blocks, the status of its autotune, and its tags."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.ezlogix.encode import scales_of
from pidcfg.encoders.maps.ezlogix import BLOCKS, R_BLOCK, S_BLOCK, SPACE, VARIABLES
from pidcfg.encoders.maps.ezlogix_meanings import CODES, WORDS
from pidcfg.encoders.settings import read_settings
from pidcfg.encoders.words import SIGN
from pidcfg.explanation.annotate import Claim, Start, block_claims
from pidcfg.explanation.direction import Direction
from pidcfg.explanation.find_register import Block, RegisterBook, Series
from pidcfg.explanation.unstored_keys import DIALOG, FILE
from pidcfg.explanation.values import Setting
from pidcfg.schemas.ezlogix import OutputSettings, PvSettings

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.regmap import Word
    from pidcfg.schemas.ezlogix import Loop
    from pidcfg.schemas.ezlogix import Output as OutputSection
    from pidcfg.schemas.ezlogix import Pv as PvSection

ERROR = R_BLOCK.word("error")
ROOT = S_BLOCK.offset("square_root")


def setting_of(loop: Loop, config: object) -> Setting:  # noqa: ARG001 - the signature of all vendors' own
    """The scales and units of a loop of a configuration."""
    return _setting(loop.pv, loop.output, root=loop.pv.square_root)


def _setting(pv: PvSection | PvSettings, output: OutputSection | OutputSettings, *, root: bool) -> Setting:
    units = {key: part.unit for key, part in (("pv", pv), ("output", output)) if part.unit}
    return Setting(scales_of(pv, output, root=root), units)


def claims(
    words: Mapping[int, int], settings: Any, plc: Mapping[str, Any], options: Mapping[str, Any]
) -> Iterator[tuple[int, Claim]]:
    """What each address of a listing is, by the blocks that stand beside it or are named by options."""
    del plc
    for own, blocks in block_claims(settings, options, BLOCKS, SPACE, "LOOP-{}"):
        pv = read_settings(PvSettings, {"tag": "IR1", **own.get("pv", {})}, "settings.pv")
        output = read_settings(OutputSettings, {"tag": "OR1", **own.get("output", {})}, "settings.output")
        discretes = next((start for _, start, table in blocks if table is S_BLOCK), 0)
        known = _setting(pv, output, root=bool(words.get(discretes + ROOT)))
        for loop, start, table in blocks:
            yield from ((start + word.offset, Claim(table, word, loop, known)) for word in table.words)


def special(word: Word, raw: int, known: Setting) -> str | None:
    """The error is a signed number of counts (D169), of the root where the loop takes it."""
    if word is not ERROR:
        return None
    scale = known.scales.get("sp")
    return f"{raw - 0x10000 if raw & SIGN else raw} counts of the {'root of the PV' if scale and scale.root else 'PV'}"


BESIDE = {
    **dict.fromkeys(
        (
            "registers",
            "discretes",
            "algorithm",
            "action",
            "pv.tag",
            "output.tag",
            "output.pulse.tag",
            "plc.process_when_stopped",
        ),
        DIALOG,
    ),
    **dict.fromkeys(
        ("plc.tag_names", "name", "description", "pv.range", "pv.unit", "pv.counts", "output.range", "output.unit"),
        FILE,
    ),
}
"""Keys that no register holds."""

EXPLAINER = RegisterBook(
    key="ezlogix",
    title="EZAutomation EZLogix",
    space=SPACE,
    blocks=(
        Block("R", R_BLOCK, "R101", ("base", "basereg", "registerbase", "r")),
        Block("S", S_BLOCK, "S101", ("base", "discretebase", "s")),
    ),
    words=WORDS,
    bits={},
    series=(
        Series(
            ("at", "autotune", "autotunestatus"), "autotune status", CODES, "a number that the manual does not list"
        ),
    ),
    forms=(
        ("an autotune status", "AT5"),
        ("a register or discrete of a loop", "R113=5 --block R101"),
        ("the same where the blocks begin at R101 and S101", "S104 --loop"),
        ("an offset from the base", "Base+12=5"),
        ("a tag's variable", "ATStatus=5"),
    ),
    settings=setting_of,
    direction=Direction("action", "the controller's", {"direct": "direct", "reverse": "reverse"}),
    beside=BESIDE,
    starts=tuple(Start(key, prefix, f"{prefix}101") for key, (prefix, _) in BLOCKS.items()),
    claims=claims,
    special=special,
    aliases={variable: name for name, variable in VARIABLES.items()},
)
