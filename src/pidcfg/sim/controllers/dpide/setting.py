"""What a scenario's ``set`` may write in a running DPIDE instruction: its operands, by their names.

Short forms: ``setpoint`` is SV, ``output`` is MOUT.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dpide import TABLES
from pidcfg.schemas.dpide import parse_time
from pidcfg.schemas.dpide_call import parse_milliseconds
from pidcfg.schemas.iec import Timed
from pidcfg.schemas.numbers import parse_integer, refuse
from pidcfg.sim.named_settings import NamedKeys, parameters_of, parse_plain

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.encoders.parameters import Content

PID_MODES = (0, 1, 2)
FIXED = {
    "PV": "it comes from the plant",
    "MV": "the PLC writes it; MOUT does so in manual",
}
"""Operands that cannot be set, and why."""


def parse_mode(value: object) -> int:
    """0, 1 or 2."""
    mode = parse_integer(value)
    if mode not in PID_MODES:
        refuse("choice", f"{mode} is none of {', '.join(map(str, PID_MODES))}")
    return mode


def parse_seconds_in(value: object) -> Decimal:
    """A time in s or a gain, as the configuration has it; `Timed` is a number."""
    return parse_time(value) if isinstance(value, str) else parse_plain(value)


class Seconds(float):
    """A time that was written with a unit, where the other form of the equation wants a gain."""


def with_mark(name: str, value: object, content: Content) -> Content:
    """The content of an operand, marked where its value can be nothing but a time."""
    is_time = name in {"Ti_Ki", "Td_Kd"} and isinstance(value, str) and isinstance(parse_time(value), Timed)
    return Seconds(content) if is_time else content


KEYS = NamedKeys(
    parameters_of(TABLES, FIXED),
    {"setpoint": "SV", "setpoint.value": "SV", "output": "MOUT"},
    {"mode": "mode", "autotune": "autotune"},
    FIXED,
    {
        "PID_MODE": parse_mode,
        "CYCLE": parse_milliseconds,
        "Ti_Ki": parse_seconds_in,
        "Td_Kd": parse_seconds_in,
        "Tf": parse_seconds_in,
    },
)
