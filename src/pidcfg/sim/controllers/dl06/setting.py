"""What a scenario's ``set`` may write: a key of the configuration to its register, by the register map's own codecs.

Keys are those of a loop in the configuration file (``tuning.gain``, ``alarms.pv.high``). Short forms: ``setpoint``,
``output`` and ``bias`` with a number, and the last part of a key where only one register has it (``gain``).
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from decimal import Decimal
from typing import Any

from pidcfg.encoders.maps.dl06 import LOOP_TABLES
from pidcfg.encoders.regmap import Bits, Word, decode_one, encode_one
from pidcfg.encoders.scales import Scale
from pidcfg.encoders.words import Bcd, EncodeError
from pidcfg.schemas.base import parse_flag, parse_number, parse_quantity, parse_seconds, parse_text, refuse
from pidcfg.schemas.dl06 import Reset, parse_reset
from pidcfg.schemas.octal import parse_v_address
from pidcfg.schemas.rates import Rate, parse_rate

SHORT = {"setpoint": "setpoint.value", "output": "state.output", "bias": "state.bias"}
EVENTS = {"mode": "mode", "autotune": "autotune", "autotune.start": "autotune", "ramp_soak.request": "ramp_soak"}
"""Keys that are events of their own."""
FIXED = {"pv.transfer", "output.transfer", "state.pv"}
"""What a running controller has no use for: wiring, and the word that the input overwrites."""
CASCADE_FROM = "cascade_from"

Row = Word | Bits
Scales = Mapping[str, Scale]


def rows_by_path(reset_decimals: int) -> dict[str, Row]:
    """Every register and choice of the loop table that can be set."""
    table = LOOP_TABLES[reset_decimals]
    rows: tuple[Row, ...] = (*table.words, *table.bits)
    return {str(r.path): r for r in rows if r.path is not None and r.path not in FIXED | set(EVENTS)}


def find_rows(path: tuple[str, ...], reset_decimals: int = 1) -> list[Row]:
    """The registers behind a key: one, or both ends of a pair of limits."""
    rows = rows_by_path(reset_decimals)
    key = ".".join(path)
    key = "remote_setpoint" if key == CASCADE_FROM else SHORT.get(key, key)
    if key in EVENTS:
        refuse("set_key", f"{key} is an event of its own", help=f"write {EVENTS[key]}: in place of set:")
    if key in rows:
        return [rows[key]]
    if f"{key}.0" in rows:
        return [rows[f"{key}.0"], rows[f"{key}.1"]]
    same = [row for name, row in rows.items() if name.rpartition(".")[2] == key and name != SHORT["setpoint"]]
    if len(same) == 1:
        return same
    near = difflib.get_close_matches(key, [*SHORT, *rows], 1, 0.5)
    return refuse("set_key", f"{key!r} is nothing that can be set in a running loop",
                  help=f"did you mean {near[0]}?" if near else "write a key of the loop's configuration")  # fmt: skip


def parse_setting(path: tuple[str, ...], rows: list[Row], value: object) -> object:
    """The value of a key as its registers take it."""
    if path == (CASCADE_FROM,):
        return parse_text(value)
    if len(rows) == 1:
        return parse_row(rows[0], value)
    if not isinstance(value, list | tuple) or len(value) != len(rows):
        refuse("pair_type", "both limits are wanted", help="write [low, high]")
    return tuple(parse_row(row, item) for row, item in zip(rows, value, strict=True))


def parse_row(row: Row, value: object) -> object:
    """One register's value by the same parser as in the configuration file."""
    if isinstance(row, Word):
        return parser_of(row)(value)
    if set(row.choices.values()) == {False, True}:
        return parse_flag(value)
    known = [str(choice) for choice in row.choices.values() if choice is not None]
    if str(value) not in known:
        refuse("choice", f"{value!r} is none of {', '.join(dict.fromkeys(known))}")
    return str(value)


def parser_of(row: Word) -> Callable[[object], object]:
    """How a register's value is written."""
    special: dict[str, Callable[[object], object]] = {
        "tuning.reset": parse_reset,
        "tuning.rate": parse_seconds,
        "sample_rate": parse_seconds,
        "alarms.rate_of_change": parse_rate,
        "remote_setpoint": parse_v_address,
        "ramp_soak.table": parse_v_address,
    }
    return special.get(str(row.path), parse_number if isinstance(row.codec, Bcd) else parse_quantity)


def encode_setting(row: Row, value: Any, values: Mapping[str, Any], scales: Scales) -> int:
    """A parsed value to its word, or to its bits in place; `EncodeError` when the word cannot hold it."""
    if isinstance(row, Bits):
        return row.encode(value)
    if isinstance(value, Reset):
        value = reset_digits(value, str(values["tuning.reset_unit"]))
    elif isinstance(value, Rate):
        value = value.per_sample(values["sample_rate"])
    return encode_one(row.codec, value, scales)


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
    for row, item in zip(rows, value if len(rows) > 1 else [value], strict=True):
        try:
            encode_setting(row, item, values, scales)
        except EncodeError as error:
            between = "" if error.low is None else f": {error.low} to {error.high}"
            refuse("set_value", f"{item} does not fit its word: it {error}{between}")
