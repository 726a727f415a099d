"""What is said about the neutral form: its fields."""

from __future__ import annotations

from collections.abc import Mapping

from pidcfg.encoders.maps.generic import LOOP_TABLE, LOOPS
from pidcfg.output.explanation.book import Direction
from pidcfg.output.explanation.lookup import PV_RISES
from pidcfg.output.explanation.parameters import ParameterBook

TABLE_NAME = "generic"
DIRECTION_KEY = "output_raises_pv"


def split_name(name: str, _types: Mapping[str, str]) -> tuple[str, str | None, str]:
    """``TIC-101.tuning.gain`` to its loop and field."""
    loop, path = LOOPS.split_name(name)
    return loop, TABLE_NAME if path else None, path


EXPLAINER = ParameterBook(
    key="generic",
    tables={TABLE_NAME: LOOP_TABLE},
    examples=(("a field of the neutral form", "generic.tuning.gain"),),
    split_name=split_name,
    direction=Direction(DIRECTION_KEY, "the process's", {}),
    states={(DIRECTION_KEY, heating): text for heating, text in PV_RISES.items()},
)
