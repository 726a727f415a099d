"""What a scenario's ``set`` may write: a key of the configuration to its register, by the register map's own codecs.

Keys are those of a loop in the configuration file (``tuning.gain``, ``alarms.pv.high``). Short forms: ``setpoint``,
``output`` and ``bias`` with a number, and the last part of a key where only one register has it (``gain``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from decimal import Decimal
from functools import cache
from typing import Any

from pidcfg.encoders.maps.dl06 import LOOP_TABLES, RESET
from pidcfg.encoders.regmap import Bits, Word, decode_one
from pidcfg.encoders.scales import Scale
from pidcfg.encoders.words import Bcd
from pidcfg.schemas.base import parse_quantity, parse_seconds, parse_text
from pidcfg.schemas.dl06 import Reset, parse_reset
from pidcfg.schemas.numbers import parse_number
from pidcfg.schemas.octal import parse_v_address
from pidcfg.schemas.rates import Rate, parse_rate
from pidcfg.sim.settings import Keys, Row, check_fit, encode_row, rows_of

SHORT = {"setpoint": "setpoint.value", "output": "state.output", "bias": "state.bias"}
EVENTS = {"mode": "mode", "autotune": "autotune", "autotune.start": "autotune", "ramp_soak.request": "ramp_soak"}
"""Keys that have an event instead, and the key of that event."""
FIXED = {"pv.transfer", "output.transfer", "state.pv"}
"""Cannot be set in a running loop: wiring, and the word that the analog input overwrites."""
CASCADE_FROM = "cascade_from"

PARSERS: Mapping[str, Callable[[object], object]] = {
    "tuning.reset": parse_reset,
    "tuning.rate": parse_seconds,
    "sample_rate": parse_seconds,
    "alarms.rate_of_change": parse_rate,
    "remote_setpoint": parse_v_address,
    "ramp_soak.table": parse_v_address,
}

Scales = Mapping[str, Scale]


@cache
def keys(reset_decimals: int) -> Keys:
    """What can be set in a loop whose reset word has so many decimals."""
    rows = rows_of([LOOP_TABLES[reset_decimals]], FIXED | set(EVENTS))
    return Keys(rows, SHORT, EVENTS, PARSERS, parser_of)


def parser_of(word: Word) -> Callable[[object], object]:
    """How the value of a register is written that is not in `PARSERS`."""
    return parse_number if isinstance(word.codec, Bcd) else parse_quantity


def find_rows(path: tuple[str, ...], reset_decimals: int = 1) -> list[Row]:
    """The registers behind a key: one, or both ends of a pair of limits."""
    return keys(reset_decimals).find(("remote_setpoint",) if path == (CASCADE_FROM,) else path)


def parse_setting(path: tuple[str, ...], rows: list[Row], value: object) -> object:
    """The value of a key as its registers take it; every number of decimals is written alike."""
    return parse_text(value) if path == (CASCADE_FROM,) else keys(1).parse(rows, value)


def encode_setting(row: Row, value: Any, values: Mapping[str, Any], scales: Scales) -> int:
    """A parsed value to its word, or to its bits in place; `EncodeError` when the word cannot hold it.

    Raw counts are the content of the word, of a root loop's set point too (D651).
    """
    if isinstance(value, Reset):
        if value.nines:
            return RESET[1].encode(RESET[1].high)
        value = reset_digits(value, str(values["tuning.reset_unit"]))
    elif isinstance(value, Rate):
        value = value.per_sample(values["sample_rate"])
    return encode_row(row, value, scales)


def reset_digits(reset: Reset, unit: str) -> Decimal:
    """A reset time in the unit of its word; 0 when it is off."""
    if reset.duration is None:
        return Decimal(0)
    if reset.duration.unit is None:
        return reset.duration.value
    return reset.duration.seconds() / (60 if unit == "minutes" else 1)


def stored_rate(row: Row, value: Any) -> Decimal:
    """A sample rate as its word holds it, in s."""
    word = encode_setting(row, value, {}, {})
    return Decimal(row.decode(word) if isinstance(row, Bits) else decode_one(row.codec, word, {}))


def fits(rows: list[Row], value: Any, values: Mapping[str, Any], scales: Scales) -> None:
    """Refuses a value that its word cannot hold."""
    check_fit(rows, value, lambda row, item: encode_setting(row, item, values, scales))
