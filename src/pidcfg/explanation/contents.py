"""A content as a person writes it, to the raw content of a register or parameter."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from pidcfg.encoders.parameters import read
from pidcfg.explanation.question import QuestionError

if TYPE_CHECKING:
    from pidcfg.encoders.parameters import Content, Parameter
    from pidcfg.encoders.spaces import Kind
    from pidcfg.schemas.iec import IecType

HEX = re.compile(r"(?:0[xX]|16#)?([0-9A-Fa-f]{1,8})[hH]?")
MARKED_HEX = re.compile(r"(?:0[xX]|16#)([0-9A-Fa-f]{1,8})")
NUMBER = re.compile(r"[-+]?(?:[0-9]{1,40}\.?[0-9]{0,40}|\.[0-9]{1,40})(?:[eE][-+]?[0-9]{1,3})?")
MOST_DIGITS = 11
STATES = {"on": True, "true": True, "off": False, "false": False}
SWITCH_STATES = {**STATES, "1": True, "0": False}


def whole(text: str, highest: int) -> int | None:
    """A whole number in decimal, or in hexadecimal when it is marked (0x0005, 16#0005)."""
    marked = MARKED_HEX.fullmatch(text)
    decimal = int(text) if text.isdecimal() and len(text) <= MOST_DIGITS else None
    number = int(marked.group(1), 16) if marked else decimal
    return number if number is not None and number <= highest else None


def raw_of(text: str, kind: Kind, name: str, *, hexadecimal: bool) -> int:
    """The raw content that ``text`` writes: in hexadecimal for vendors that show it so, else as a value of its kind.

    ``0x`` marks hexadecimal for every vendor.
    """
    marked = (HEX if hexadecimal else MARKED_HEX).fullmatch(text)
    if marked:
        raw = int(marked.group(1), 16)
        if raw > kind.highest:
            raise QuestionError(f"{name}={text}: {kind.name} content has up to {kind.digits} hexadecimal digits")
        return raw
    if hexadecimal:
        raise QuestionError(
            f"{name}={text}: the value is not up to {kind.digits} hexadecimal digits, like 0402 or 0x0402"
        )
    value: bool | int | float | None = STATES.get(text.lower())
    if value is None and NUMBER.fullmatch(text):
        number = float(text)
        value = int(number) if number == number // 1 and kind.digits != 8 else number
    content = None if value is None else kind.read(value)
    if content is None:
        digits = HEX.fullmatch(text)
        hint = f"; hexadecimal digits are written 0x{digits.group(1)}" if digits and not text.isdecimal() else ""
        raise QuestionError(f"{name}={text}: the value is not {kind.holds}{hint}")
    return content


def content_of(row: Parameter, text: str) -> Content:
    """The content of a parameter that ``text`` writes."""
    value: object = None
    if row.type.kind == "bool":
        value = SWITCH_STATES.get(text.lower())
    elif row.type.kind == "word":
        value = next((w for w in row.type.words if text.upper() in {w.upper(), w.upper().rpartition("_")[2]}), None)
    elif row.type.kind == "whole":
        signed = text.lstrip("+-").isdecimal() and len(text) <= MOST_DIGITS
        value = int(text) if signed else whole(text, row.type.high)
    elif NUMBER.fullmatch(text):
        value = float(text)
    content = read(row.type, value)
    if content is None:
        raise QuestionError(f"{row.name}={text}: the value is not one of {contents_text(row.type)}")
    return content


def contents_text(kind: IecType) -> str:
    """What a parameter of a type holds."""
    if kind.kind == "bool":
        return "TRUE and FALSE"
    if kind.kind == "word":
        return ", ".join(kind.words)
    return f"{kind.name} ({kind.low} to {kind.high})" if kind.kind == "whole" else f"{kind.name}, a finite number"
