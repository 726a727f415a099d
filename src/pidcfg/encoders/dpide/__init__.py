"""Delta AS configurations to the operands of DPIDE instructions and back; here what a listing may not say."""

from __future__ import annotations

from pidcfg.encoders import Option, read_per_loop

# --- What a listing of operands may not say, and where converted instructions have their registers --------------------

FORMATS = ("text", "csv", "json", "st", "operands", "symbols", "modbus-map")


def _read_register(text: str) -> str:
    from pidcfg.schemas.dpide import parse_register

    return parse_register(text)


DECODE_OPTIONS = (
    Option(
        "device",
        "D,D…",
        "Where the 30 registers of each loop's I_MV begin.",
        "D500,D530",
        read_per_loop(_read_register),
    ),
)
CONVERT_OPTIONS = DECODE_OPTIONS
