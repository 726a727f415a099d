"""What a scenario's ``set`` may write in a running program: parameters of loops, blocks, and signals."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.schemas.base import parse_duration, parse_seconds
from pidcfg.schemas.numbers import refuse
from pidcfg.sim.named_settings import NamedKeys

if TYPE_CHECKING:
    from collections.abc import Mapping
    from decimal import Decimal

    from pidcfg.sim.named_settings import Parser

TIMES = ("Tfd", "DelayTime", "Tc", "Tlead", "Tlag")
TIMES_OR_GAINS = ("Ti_Ki", "Td_Kd")
"""Times in the dependent form, gains with Indep TRUE."""
SHORT = {"setpoint": "SP", "setpoint.value": "SP", "output": "ManualMV"}
WORDS = {"AutoTuneParam.Mode"}


def parse_tune_mode(value: object) -> str:
    """P, PI or PID."""
    if value not in {"P", "PI", "PID"}:
        refuse("set_value", f"{value!r} is not one of P, PI, PID")
    return f"AUTOTUNE_{value}"


def parse_gain(value: object) -> Decimal:
    """A gain of the independent form, which is no time (D202)."""
    duration = parse_duration(value)
    if duration.unit is not None:
        refuse(
            "set_value", f"{value} is a time, but with Indep TRUE it is a gain", help="write a number without a unit"
        )
    return duration.value


def keys_of(kind: str, name: str, wired: Mapping[str, str], *, independent: bool = False) -> NamedKeys:
    """The parameters of a block that can be set; ``wired``: those that are not, and what they are wired to.

    ``independent``: the program starts with Indep TRUE.
    """
    rows = {row.name: row for row in BLOCK_TYPES[kind].inputs}
    fixed = {row: f"the program wires {text} to {name}.{row}; set that" for row, text in wired.items()}
    if "PV" in rows:
        fixed.setdefault("PV", "the plant writes it; pv: is the event of a broken sensor")
    parsers: dict[str, Parser] = {**dict.fromkeys(TIMES, parse_seconds), **dict.fromkeys(WORDS, parse_tune_mode)}
    parsers |= dict.fromkeys(TIMES_OR_GAINS, parse_gain if independent else parse_seconds)
    short = {key: row for key, row in SHORT.items() if row in rows}
    return NamedKeys(rows, short, {}, fixed, parsers)
