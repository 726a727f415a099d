"""What a scenario's ``set`` may write in a CLICK loop: a key of the configuration to its register.

Keys are those of a loop in the configuration file (``tuning.reset_time``, ``alarms.pv.high``). Short forms:
``setpoint``, ``output`` and ``bias`` with a number, and the last part of a key where only one register has it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from pidcfg.encoders.maps.click import TABLES
from pidcfg.schemas.base import Quantity, parse_seconds
from pidcfg.schemas.click import parse_sample_rate, parse_unit_rate
from pidcfg.schemas.numbers import parse_integer, parse_number, refuse
from pidcfg.schemas.rates import Rate
from pidcfg.sim.settings import Keys, Row, encode_row, items_of, rows_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from decimal import Decimal

    from pidcfg.encoders.regmap import Word

SHORT = {"setpoint": "setpoint.value", "output": "state.output", "bias": "state.bias"}
EVENTS = {"mode": "mode", "autotune": "autotune"}
"""Keys that have an event instead, and the key of that event."""
FIXED = {"state.raw_pv", "state.pv"}
"""What only the controller writes."""


def parse_plain(value: object) -> Decimal:
    """A number in the unit of its register; a PLC with floats has no counts."""
    if isinstance(value, Quantity):
        if value.counts:
            refuse("number_form", f"{value} is in counts, but the register holds a number in its own unit")
        return value.value
    return parse_number(value)


PARSERS: dict[str, Callable[[object], object]] = {
    "sample_rate": parse_sample_rate,
    "tuning.reset_time": parse_seconds,
    "tuning.derivative_gain": parse_seconds,
    "output.pwm.period": parse_seconds,
    "pv.filter": parse_integer,
    "derivative_gain_limit": parse_integer,
    "alarms.rate_of_change": parse_unit_rate,
}
KEYS = Keys(rows_of(TABLES, FIXED), SHORT, EVENTS, PARSERS, lambda _word: parse_plain)


def encode_setting(row: Row, value: Any, sample_rate: Decimal) -> int:
    """A parsed value to the bits of its register; ``sample_rate`` is the present one in s."""
    if isinstance(value, Rate):
        value = value.per_sample(sample_rate).value
    return encode_row(row, value)


def check_setting(path: tuple[str, ...], value: object, sample_rate: Decimal) -> object:
    """The value of a key as its registers take it; a ``PydanticCustomError`` says what is wrong."""
    return KEYS.check(path, value, lambda row, item: encode_setting(row, item, sample_rate))


def settings_of(path: tuple[str, ...], value: Any, sample_rate: Decimal) -> list[tuple[Word, int]]:
    """The registers behind a key, and the bits that a checked value makes in each."""
    items = items_of(KEYS.find(path), value)
    return [(cast("Word", row), encode_setting(row, item, sample_rate)) for row, item in items]
