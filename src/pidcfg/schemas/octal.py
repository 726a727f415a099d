"""V-memory addresses of the DirectLOGIC family: octal, written ``V2000`` as in the manual, held as plain numbers."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import WithJsonSchema

from pidcfg.schemas.base import Parser
from pidcfg.schemas.numbers import refuse, text_schema

V_ADDRESS = re.compile(r"V([0-7]{1,6})")
BARE = re.compile(r"[0-9]+")
HIGHEST = 0o177777


def v_name(address: int) -> str:
    """The manual's spelling of an address: ``v_name(1024) == "V2000"``."""
    return f"V{address:o}"


def parse_v_address(value: object) -> int:
    """``V2000`` to 1024; every other spelling is refused with the right one."""
    if isinstance(value, int) and not isinstance(value, bool):
        return _in_memory(value, v_name(value))
    if not isinstance(value, str):
        refuse("address_form", "a V-memory address is wanted", help="write it like V2000")
    match = V_ADDRESS.fullmatch(value)
    if match:
        return _in_memory(int(match.group(1), 8), value)
    digits = value.lstrip("vV0") or "0"
    if not BARE.fullmatch(value.lstrip("vV")):
        refuse("address_form", f"{value!r} is not a V-memory address", help="write it like V2000")
    wrong = next((d for d in digits if d in "89"), None)
    if wrong:
        refuse(
            "address_form",
            f"{value} is not octal: {wrong} is not an octal digit",
            help="V-memory addresses have the digits 0 to 7",
        )
    if BARE.fullmatch(value):
        refuse(
            "address_form", f"{value} can be read as octal V{digits} or as decimal {digits}", help=f"write V{digits}"
        )
    only = value.upper() if V_ADDRESS.fullmatch(value.upper()) else None
    _in_memory(int(digits, 8), f"V{digits}")
    return refuse("address_form", f"{value!r} is not spelled as an address", help=f"write V{digits}", only=only)


def _in_memory(address: int, shown: str) -> int:
    if not 0 <= address <= HIGHEST:
        refuse("address_form", f"{shown} is beyond {v_name(HIGHEST)}, the last address that a word can hold")
    return address


VAddress = Annotated[int, Parser(parse_v_address), WithJsonSchema(text_schema("V[01]?[0-7]{1,5}", "V2000"))]
