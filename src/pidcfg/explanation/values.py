"""What a register's content says, in words."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.regmap import decode_one, scale_of
from pidcfg.encoders.scales import Position, before_root
from pidcfg.encoders.words import Choice, DecodeError
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.numbers import decimal_text
from pidcfg.schemas.units import unit_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from pidcfg.encoders.regmap import Bits, RegisterMap, Word
    from pidcfg.encoders.scales import Scale
    from pidcfg.explanation.page import Origin

PERCENT = Decimal(100)
MOST_CHOICES = 5
"""A row with more choices is not spelled out."""
UNIT_NAMES = {"pv": "PV units", "output": "output units"}
"""What stands for units that are not known."""


class Scaling(NamedTuple):
    """What makes values of a loop's registers: its scales, and the units of PV and output."""

    scales: Mapping[str, Scale]
    units: Mapping[str, str]
    stated: frozenset[str] = frozenset()
    """Readings of the registers that somebody has chosen, where the manual leaves a choice."""


UNKNOWN = Scaling({}, {})


class Placement(NamedTuple):
    """A register in its place: its row, the loop, and what makes values of it."""

    table: RegisterMap
    word: Word
    loop: str | None = None
    scaling: Scaling | None = None
    raw: int | None = None
    """Its content in the configuration."""
    origins: tuple[Origin, ...] = ()
    prefix: str = ""
    """What stands before its name in a listing."""


def is_before_root(word: Word, scales: Mapping[str, Scale]) -> bool:
    """Whether a word is compared with the PV of which the loop takes the root."""
    root = scales.get("sp")
    return scale_of(word.codec) == "pv" and root is not None and root.root


def share_before_root(word: Word, raw: int, scales: Mapping[str, Scale]) -> tuple[Decimal, Decimal | None]:
    """What a word before the root is: percent of the signal, and the PV at which the signal has it.

    There is no such PV for a difference, nor without a range.
    """
    pv, root = scales["pv"], scales["sp"]
    if not isinstance(word.codec, Position):
        return PERCENT * raw / pv.format.span, None
    return before_root(pv, root, pv.format.codec.decode(raw))


def unit_of(word: Word, units: Mapping[str, str]) -> str:
    """A register's unit in the loop's own units: ``degC`` for ``pv``; ``PV units`` where they are not known."""
    return unit_text(word.unit, {**UNIT_NAMES, **units}, "/")


def text_of(word: Word, raw: int, scaling: Scaling) -> str:
    """A content in words, empty where the scale is not known; raises `DecodeError` where it is no value."""
    scale = scale_of(word.codec)
    if scale is not None and scale not in scaling.scales:
        return ""
    value = decode_one(word.codec, raw, scaling.scales)
    if scale is not None:
        return _quantity(word, value, raw, scaling)
    if isinstance(word.codec, Choice):
        return "on" if value is True else "off" if value is False else str(value)
    code = special_code(word.codec, raw)
    text = f"{decimal_text(Decimal(value))} {unit_of(word, scaling.units)}".rstrip()
    return f"{text}: {code}" if code else text


def special_code(codec: Any, raw: int) -> str:
    """What a content does that is a code: it mostly switches the register's function off."""
    if raw not in {codec.encode(number * codec.step) for number in getattr(codec, "off", ())}:
        return ""
    return {"off": "switched off", "not allowed": ""}.get(codec.special, str(codec.special))


def _quantity(word: Word, value: Any, raw: int, scaling: Scaling) -> str:
    scale = scaling.scales[str(scale_of(word.codec))]
    if is_before_root(word, scaling.scales):
        return _before_root(word, raw, scaling)
    bcd = getattr(word.codec, "bcd", None)
    if bcd is not None and (code := special_code(bcd, raw)):
        return f"0 {unit_of(word, scaling.units)}: {code}"
    if not isinstance(value, Quantity) or value.counts or scale.range is None:
        number = value.value if isinstance(value, Quantity) else value
        return f"{decimal_text(number)} counts{_share(word, raw, scale)}"
    return f"{decimal_text(value.value)} {unit_of(word, scaling.units)}"


def _before_root(word: Word, raw: int, scaling: Scaling) -> str:
    """Percent of the signal, and for a position on it the value that the signal means: its root."""
    share, value = share_before_root(word, raw, scaling.scales)
    reached = "" if value is None else f" ({float(value):.4g} {unit_of(word, scaling.units)})"
    return f"{float(share):.4g} % of the signal before the root{reached}"


def _share(word: Word, raw: int, scale: Scale) -> str:
    """How far along its data format a raw position is, in percent."""
    if not isinstance(word.codec, Position) or scale.root:
        return ""
    counts = scale.format.codec.decode(raw)
    share = PERCENT * (counts - scale.format.minimum) / scale.format.span
    return f", {share:.4g} % of {scale.format.minimum} to {scale.format.maximum}"


def choice_text(row: Bits, word: int) -> tuple[str, bool]:
    """What the bits of a row choose, and whether that is something that is on; `DecodeError` for no choice."""
    value = row.decode(word)
    if isinstance(value, bool):
        return ("on" if value else "off"), value
    return ("off" if value is None else str(value)), bool(word & row.mask)


def choices_text(row: Bits) -> str:
    """What the codes of a row choose, where it is not just on or off."""
    values = [value for value in row.in_place if value is not None]
    if len(values) > MOST_CHOICES or all(isinstance(value, bool) for value in values):
        return ""
    single = len(row.bits) == 1
    return ": " + ", ".join(f"{row.in_place[v] >> row.bits[0]} {v}" if single else str(v) for v in values)


def bits_text(rows: Iterable[Bits], raw: int) -> str:
    """A word of bits in one line: what it chooses, then what is on."""
    chosen, on = [], []
    for row in rows:
        try:
            state, active = choice_text(row, raw)
        except DecodeError as error:
            chosen.append(str(error))
            continue
        if state == "on" or (state == "off" and active):
            on.append(f"{row.title} ({label(row)})")
        elif state != "off" and (active or row.access == "setting"):
            chosen.append(f"{row.path or row.title} {state}")
    parts = [", ".join(chosen)] if chosen else []
    parts.append("on: " + ", ".join(on) if on else "no bit is on" if not raw else "")
    return "; ".join(part for part in parts if part)


def label(row: Bits) -> str:
    """The bits of a row as people say them."""
    bits = row.bits
    if len(bits) == 1:
        return f"bit {bits[0]}"
    if bits == tuple(range(bits[0], bits[0] + len(bits))):
        return f"bits {bits[0]}-{bits[-1]}"
    return "bits " + ", ".join(map(str, bits))
