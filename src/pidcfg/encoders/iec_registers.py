"""Elementary types of IEC 61131-3 in registers of 16 bits: how many, by which type of a map, and with which content."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.singles import Single, single_bits
from pidcfg.encoders.words import WORD_MAX, DecodeError
from pidcfg.refs import Decision
from pidcfg.schemas.iec import time_seconds, time_text

if TYPE_CHECKING:
    from pidcfg.encoders.parameters import Content
    from pidcfg.schemas.iec import IecType

D892 = Decision(
    892,
    "an elementary type has the registers of its size",
    "REAL is float32, DINT int32, TIME uint32 in ms, INT int16, UINT and USINT uint16, BOOL one bit; an enumeration is "
    "its number from 0 in an int16 or uint16. LREAL and every other type have none.",
    "IEC 61131-3 gives the sizes, TIME and enumerations as the runtime systems of NextoPID and ISPSoft keep them. What "
    "a client sees of a scaled copy of a value is another value.",
)
LONG_MAX = 0xFFFFFFFF


def types_of(kind: IecType) -> tuple[str, ...]:
    """The types that a parameter may have in a map, the usual one first; empty: none fits it."""
    if kind.kind == "bool":
        return ("bool",)
    if kind.kind == "real":
        return () if kind.double else ("float32",)
    if kind.kind == "time":
        return ("uint32",)
    if kind.kind == "word" or kind.high <= WORD_MAX:
        return ("int16", "uint16") if kind.low < 0 or kind.kind == "word" else ("uint16", "int16")
    return ("int32",)


def raw_of(kind: IecType, content: Content) -> int:
    """A content as its registers hold it."""
    if kind.kind == "bool":
        return int(bool(content))
    if kind.kind == "real":
        return single_bits(float(content)) or 0
    if kind.kind == "time":
        return int((time_seconds(str(content)) or 0) * 1000)
    if kind.kind == "word":
        return kind.words.index(str(content))
    return int(content) & (WORD_MAX if kind.high <= WORD_MAX else LONG_MAX)


def content_of(kind: IecType, raw: int) -> Content:
    """The content that registers hold; raises `DecodeError` where that is no value of the type."""
    if kind.kind == "bool":
        return bool(raw)
    if kind.kind == "real":
        return float(SINGLE.decode(raw))
    if kind.kind == "time":
        return time_text(raw)
    size = WORD_MAX if kind.kind == "word" or kind.high <= WORD_MAX else LONG_MAX
    if kind.kind == "word":
        if raw >= len(kind.words):
            raise DecodeError(f"{raw} is none of the {len(kind.words)} of {kind.name}")
        return kind.words[raw]
    number = raw - size - 1 if kind.low < 0 and raw > size // 2 else raw
    if not kind.low <= number <= kind.high:
        raise DecodeError(f"{number} is outside the range of {kind.name}")
    return number


SINGLE = Single()
