"""What a register's content says, in words."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.regmap import Word, decode_one, scale_of
from pidcfg.encoders.scales import before_root
from pidcfg.encoders.words import Choice, DecodeError
from pidcfg.schemas.base import Quantity, decimal_text

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from pidcfg.encoders.regmap import Bits, RegisterMap
    from pidcfg.encoders.scales import Scale

PERCENT = Decimal(100)


class Setting(NamedTuple):
    """What is known of the loop around a register: its scales, and the units of PV and output."""

    scales: Mapping[str, Scale]
    units: Mapping[str, str]
    stated: frozenset[str] = frozenset()
    """Readings of the registers that somebody has chosen, where the manual leaves a choice."""


UNKNOWN = Setting({}, {})


def nothing_special(word: Word, raw: int, known: Setting) -> str | None:  # noqa: ARG001 - the signature of a vendor's own
    """For vendors whose registers are all of the common kinds."""
    return None


def no_remark(word: Word, raw: int, known: Setting) -> str:  # noqa: ARG001 - the signature of a vendor's own
    """For vendors whose contents speak for themselves."""
    return ""


def is_before_root(word: Word, known: Setting) -> bool:
    """Whether a word is compared with the PV of which the loop takes the root."""
    root = known.scales.get("sp")
    return scale_of(word.codec) == "pv" and root is not None and root.root


def unit_of(word: Word, units: Mapping[str, str]) -> str:
    """A register's unit in the loop's own units: ``degC`` for ``pv``; ``PV units`` where they are not known."""
    if word.unit in units and "/" not in word.unit:
        return units[word.unit]
    texts = {"pv": units.get("pv") or "PV units", "output": units.get("output") or "output units"}
    return "/".join(texts.get(part, part) for part in word.unit.split("/"))


def text_of(word: Word, raw: int, known: Setting, special: Callable[[Word, int, Setting], str | None]) -> str:
    """A content in words; raises `DecodeError` where it is no value."""
    own = special(word, raw, known)
    if own is not None:
        return own
    name = scale_of(word.codec)
    if name is not None and name not in known.scales:
        return ""
    value = decode_one(word.codec, raw, known.scales)
    if name is not None:
        return _quantity(word, value, raw, known)
    if isinstance(word.codec, Choice):
        return "on" if value is True else "off" if value is False else str(value)
    off = special_code(word.codec, raw)
    text = f"{decimal_text(Decimal(value))} {unit_of(word, known.units)}".rstrip()
    return f"{text}: {off}" if off else text


def special_code(codec: Any, raw: int) -> str:
    """What a content does that is a code: it mostly switches the register's function off."""
    if raw not in {codec.encode(number * codec.step) for number in getattr(codec, "off", ())}:
        return ""
    return {"off": "switched off", "not allowed": ""}.get(codec.special, str(codec.special))


def _quantity(word: Word, value: Any, raw: int, known: Setting) -> str:
    scale = known.scales[str(scale_of(word.codec))]
    if is_before_root(word, known):
        return _before_root(word, raw, known)
    own = getattr(word.codec, "bcd", None)
    if own is not None and (code := special_code(own, raw)):
        return f"0 {unit_of(word, known.units)}: {code}"
    if not isinstance(value, Quantity) or value.counts or scale.range is None:
        number = value.value if isinstance(value, Quantity) else value
        return f"{decimal_text(number)} counts{_share(word, raw, scale)}"
    return f"{decimal_text(value.value)} {unit_of(word, known.units)}"


def _before_root(word: Word, raw: int, known: Setting) -> str:
    """Percent of the signal, and for a position on it the value that the signal means: its root."""
    scale, root = known.scales["pv"], known.scales["sp"]
    codec: Any = word.codec
    if type(codec).__name__ != "Position":
        return f"{float(PERCENT * raw / scale.format.span):.4g} % of the signal before the root"
    share, value = before_root(scale, root, scale.format.codec.decode(raw))
    meant = "" if value is None else f" ({float(value):.4g} {unit_of(word, known.units)})"
    return f"{float(share):.4g} % of the signal before the root{meant}"


def _share(word: Word, raw: int, scale: Scale) -> str:
    """How far along its data format a raw position is, in percent."""
    if type(word.codec).__name__ != "Position" or scale.root:
        return ""
    counts = scale.format.codec.decode(raw)
    share = PERCENT * (counts - scale.format.minimum) / scale.format.span
    return f", {share:.4g} % of {scale.format.minimum} to {scale.format.maximum}"


def choice_text(row: Bits, word: int) -> tuple[str, bool]:
    """What the bits of a row choose, and whether that is something that is on; `DecodeError` for no choice."""
    value = row.decode(word)
    if isinstance(value, bool):
        return ("on" if value else "off"), value
    chosen = bool(word & row.mask)
    return ("off" if value is None else str(value)), chosen


def bits_text(table: RegisterMap, word: Word, raw: int) -> str:
    """A word of bits in one line: what it chooses, then what is on."""
    chosen, on = [], []
    for row in table.bits:
        if row.offset != word.offset:
            continue
        try:
            state, active = choice_text(row, raw)
        except DecodeError as error:
            chosen.append(str(error))
            continue
        if state == "on":
            on.append(f"{row.title} ({label(row)})")
        elif state != "off" and (active or row.access == "setting"):
            chosen.append(f"{row.path or row.title} {state}")
        elif active:
            on.append(f"{row.title} ({label(row)})")
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
