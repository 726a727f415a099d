"""Gains as a vendor's registers hold them: in its own terms, rounded, with the error that this makes."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from math import isinf
from typing import TYPE_CHECKING, cast, get_args

from pidcfg.encoders.words import EncodeError
from pidcfg.schemas.base import decimal_text
from pidcfg.schemas.limits import limits_at

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pydantic import BaseModel

    from pidcfg.encoders.regmap import Codec
    from pidcfg.encoders.tuned import TunedWords
    from pidcfg.tuning.rules import Gains
    from pidcfg.vendors import Vendor

DIGITS = 12
"""Significant digits of a computed number: more are noise of the arithmetic."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """One number for a vendor: its key, what is wanted, what the register holds (None: it cannot), and why not."""

    key: str
    unit: str
    wanted: Decimal
    stored: Decimal | None
    problem: str | None = None

    @property
    def error_percent(self) -> float:
        """What rounding changes."""
        if self.stored is None or not self.wanted:
            return 0.0
        return float((self.stored / self.wanted - 1) * 100)


def fit(gains: Gains, vendor: Vendor, pv_span: float, output_span: float) -> list[Fitted]:
    """Gain, integral and derivative time for a vendor; spans are engineering units from 0 % to 100 %."""
    words: TunedWords = vendor.load("tuned")
    factor = pv_span / output_span if words.gain_unit == "span" else 100 / output_span
    integral = words.no_integral if isinf(gains.integral_time) else _decimal(gains.integral_time)
    wanted = (
        (words.gain, words.table.word(words.gain).unit, _decimal(gains.gain * factor)),
        (words.integral, "s", integral),
        (words.derivative, "s", _decimal(gains.derivative_time)),
    )
    return [_fitted(vendor.model, words, *row) for row in wanted]


def _decimal(value: float) -> Decimal:
    return Decimal(f"{value:.{DIGITS}g}")


def _fitted(model: type[BaseModel], words: TunedWords, name: str, unit: str, value: Decimal) -> Fitted:
    word = words.table.word(name)
    key, codec = str(word.path), cast("Codec", word.codec)
    limits = limits_at(next(_loops(model)), key)
    try:
        stored = codec.decode(codec.encode(value))
    except EncodeError as error:
        return Fitted(key, unit, value, None, f"{_text(value)} {error}")
    if limits is not None and not limits.holds(value):
        low, high = (end if end is not None else "-" for end in (limits.low, limits.high))
        return Fitted(key, unit, value, None, f"{_text(value)} is outside {low} to {high}")
    return Fitted(key, unit, value, stored)


def _text(value: Decimal) -> str:
    return decimal_text(value.quantize(Decimal("0.000001")) if abs(value) < 1 else value)


def _loops(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    """The model of a loop: the items of the list ``loops``."""
    yield from get_args(model.model_fields["loops"].annotation)
