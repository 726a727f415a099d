"""Delta AS configurations to the operands of DPIDE instructions and back; here what a listing may not say."""

from __future__ import annotations

from pidcfg.encoders import Option, listed

# --- What a listing of operands may not say, and where converted instructions have their registers --------------------

FORMATS = ("text", "csv", "json", "st", "operands", "symbols", "modbus-map")


def _register(text: str) -> str:
    from pidcfg.schemas.dpide import parse_register

    return parse_register(text)


DECODE_OPTIONS = (
    Option("device", "D,D…", "Where the 30 registers of each loop's I_MV begin.", "D500,D530", listed(_register)),
)
CONVERT_OPTIONS = DECODE_OPTIONS
