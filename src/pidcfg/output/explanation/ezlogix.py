"""What is said about the EZLogix: its blocks, the status of its autotune, and its tags."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from pidcfg.encoders.codecs import SIGN_BIT
from pidcfg.encoders.ezlogix.image import scales_of
from pidcfg.encoders.image import read_settings
from pidcfg.encoders.maps.ezlogix import BLOCKS, CODES, DUTY_COUNTS, R_BLOCK, S_BLOCK, SPACE, VARIABLES, WORD_MEANINGS
from pidcfg.encoders.regmap import Word
from pidcfg.output.explanation.book import Direction, Series, Start, block_claims
from pidcfg.output.explanation.page import Scaling
from pidcfg.output.explanation.registers import IN_DIALOG_TEXT, IN_FILE_TEXT, Block, RegisterBook
from pidcfg.schemas.base import units_of
from pidcfg.schemas.ezlogix import CV_FULL, Loop, OutputSettings, PvSettings
from pidcfg.text.frozen import frozen

ERROR_WORD = R_BLOCK.find_word("error")
ROOT_OFFSET = S_BLOCK.offset_of("square_root")


@frozen
class ListedSides:
    """PV and output of a loop, as a listing says them."""

    pv: PvSettings
    output: OutputSettings


def scaling_of(loop: Loop, _config: object) -> Scaling:
    """The scales and units of a loop of a configuration."""
    return _scaling(loop, root=loop.pv.square_root)


def _scaling(loop: Loop | ListedSides, *, root: bool) -> Scaling:
    return Scaling(scales_of(loop.pv, loop.output, root=root), units_of(loop))


def listed_scaling(settings: Mapping[str, Any], starts: Mapping[str, int], words: Mapping[int, int]) -> Scaling:
    """The scales and units of a loop of a listing."""
    pv = read_settings(PvSettings, {"tag": "IR1", **settings.get("pv", {})}, "settings.pv")
    output = read_settings(OutputSettings, {"tag": "OR1", **settings.get("output", {})}, "settings.output")
    return _scaling(ListedSides(pv, output), root=bool(words.get(starts.get("discretes", 0) + ROOT_OFFSET)))


def error_text(word: Word, raw: int, scaling: Scaling) -> str:
    """The error is a signed number of counts (D169), of the root where the loop takes it."""
    if word is not ERROR_WORD:
        return ""
    scale = scaling.scales.get("sp")
    quantity = "root of the PV" if scale and scale.has_root else "PV"
    return f"{raw - 0x10000 if raw & SIGN_BIT else raw} counts of the {quantity}"


DUTY_NAMES = {"cv_low": "Min", "cv_high": "Max"}
"""The dialog's display of a CV limit where the control output is enabled (Min Duty Cycle, Max Duty Cycle)."""


def duty_cycle(word: Word, raw: int, _scaling: Scaling) -> str:
    """What the dialog shows for a CV limit: limit / 4096 x 100; of one beyond the CV's range, that it is."""
    if word.name not in DUTY_NAMES:
        return ""
    if raw > CV_FULL:
        return f"not within 0 to {CV_FULL}, the range of the CV"
    return f"{DUTY_NAMES[word.name]} Duty Cycle {100 * raw / DUTY_COUNTS:.4g} %"


UNSTORED_KEYS = {
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
        IN_DIALOG_TEXT,
    ),
    **dict.fromkeys(
        ("plc.tag_names", "name", "description", "pv.range", "pv.unit", "pv.counts", "output.range", "output.unit"),
        IN_FILE_TEXT,
    ),
}
"""Keys that no register holds."""

EXPLAINER = RegisterBook(
    key="ezlogix",
    space=SPACE,
    blocks=(
        Block("R", R_BLOCK, "R101", ("base", "basereg", "registerbase", "r")),
        Block("S", S_BLOCK, "S101", ("base", "discretebase", "s")),
    ),
    words=WORD_MEANINGS,
    series=(
        Series(
            "autotune status", CODES, "a number that the manual does not list", ("at", "autotune", "autotunestatus")
        ),
    ),
    examples=(
        ("an autotune status", "AT5"),
        ("a register or discrete of a loop", "R113=5 --block R101"),
        ("the same where the blocks begin at R101 and S101", "S104 --loop"),
        ("an offset from the base", "Base+12=5"),
        ("a tag's variable", "ATStatus=5"),
    ),
    scaling=scaling_of,
    direction=Direction("action", "the controller's", {"direct": "direct", "reverse": "reverse"}),
    unstored_keys=UNSTORED_KEYS,
    starts=tuple(Start(key, prefix, f"{prefix}101") for key, (prefix, _) in BLOCKS.items()),
    placements=partial(block_claims, BLOCKS, SPACE, "LOOP-{}", listed_scaling),
    word_text=error_text,
    remark=duty_cycle,
    aliases={variable: name for name, variable in VARIABLES.items()},
)
