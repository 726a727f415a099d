"""DL06 configurations to V-memory words and back; here what a listing may lack, and where converted loops go."""

from __future__ import annotations

from pidcfg.encoders import Option

# --- What a DL06 listing may lack, and where the loops of a converted file go -----------------------------------------

FORMATS = ("text", "csv", "json", "modbus", "ihex")
DATA_FORMATS = ("12-bit unipolar", "12-bit bipolar", "15-bit unipolar", "15-bit bipolar", "16-bit unipolar")
BCD_DIGITS = 4


def _read_address(text: str) -> int | None:
    from pidcfg.encoders.maps.dl06 import SPACE

    return SPACE.parse(text)


def _read_count(text: str) -> int | None:
    return int(text) if text.isdecimal() and len(text) <= BCD_DIGITS else None


LOOP_TABLE = Option(
    "loop_table", "ADDRESS", "Start of the loop table, for a listing without V7640.", "V2000", _read_address
)
RESET_DECIMALS = Option("reset_decimals", "1|2", "Implied decimals of the reset words.", "1", {"1": 1, "2": 2}.get)
DECODE_OPTIONS = (
    LOOP_TABLE,
    Option("number_of_loops", "COUNT", "How many loops, for a listing without V7641.", "4", _read_count),
    RESET_DECIMALS,
)
_NAMES = {name.replace(" ", "-"): name for name in DATA_FORMATS}
CONVERT_OPTIONS = (
    LOOP_TABLE,
    RESET_DECIMALS,
    Option(
        "data_format",
        "FORMAT",
        f"Data format of PV and output: {', '.join(_NAMES)}.",
        "15-bit-unipolar",
        lambda text: _NAMES.get(text.replace(" ", "-")),
    ),
    Option(
        "derivative",
        "error|pv",
        "What the rate term of the CPU acts on: pv on other CPUs of the family.",
        "error",
        {"error": "error", "pv": "pv"}.get,
    ),
)
