"""What a scenario's ``set`` may write in a running program: parameters of loops, blocks, and signals."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.schemas.base import parse_seconds, refuse
from pidcfg.sim.named_settings import NamedKeys

if TYPE_CHECKING:
    from collections.abc import Mapping

TIMES = ("Tfd", "DelayTime", "Tc", "Tlead", "Tlag")
SHORT = {"setpoint": "SP", "setpoint.value": "SP", "output": "ManualMV"}
WORDS = {"AutoTuneParam.Mode"}


def parse_tune_mode(value: object) -> str:
    """P, PI or PID."""
    if value not in {"P", "PI", "PID"}:
        refuse("set_value", f"{value!r} is not one of P, PI, PID")
    return f"AUTOTUNE_{value}"


def keys_of(kind: str, name: str, wired: Mapping[str, str]) -> NamedKeys:
    """The parameters of a block that can be set; ``wired``: those that are not, and what they are wired to."""
    rows = {row.name: row for row in BLOCK_TYPES[kind].inputs}
    fixed = {row: f"the program wires {text} to {name}.{row}; set that" for row, text in wired.items()}
    if "PV" in rows:
        fixed.setdefault("PV", "the plant writes it; pv: is the event of a broken sensor")
    parsers = dict.fromkeys(TIMES, parse_seconds) | dict.fromkeys(WORDS, parse_tune_mode)
    short = {key: row for key, row in SHORT.items() if row in rows}
    return NamedKeys(rows, short, {}, fixed, parsers)
