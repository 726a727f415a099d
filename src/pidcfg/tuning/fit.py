"""Gains as a vendor's registers hold them: in its own terms, rounded, with the error that this makes."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from math import isinf
from typing import TYPE_CHECKING

from pidcfg.encoders.words import EncodeError
from pidcfg.schemas.base import decimal_text

if TYPE_CHECKING:
    from pydantic import BaseModel

    from pidcfg.encoders.tuned import Tuned
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
    words: Tuned = vendor.load("tuned")
    factors = {"span": pv_span / output_span, "percent": 100 / output_span, "engineering": 1.0}
    integral = words.no_integral if isinf(gains.integral_time) else _decimal(gains.integral_time)
    wanted = (_decimal(gains.gain * factors[words.gain_unit]), integral, _decimal(gains.derivative_time))
    return [_fitted(vendor.model, words, *row) for row in zip(words.names, wanted, strict=True)]


def _decimal(value: float) -> Decimal:
    return Decimal(f"{value:.{DIGITS}g}")


def _fitted(model: type[BaseModel], words: Tuned, name: str, value: Decimal) -> Fitted:
    key, unit, limits = words.key(name), words.unit(name), words.limits(model, name)
    try:
        stored = words.stored(name, value)
    except EncodeError as error:
        return Fitted(key, unit, value, None, f"{_text(value)} {error}")
    if limits is not None and not limits.holds(value):
        low, high = (end if end is not None else "-" for end in (limits.low, limits.high))
        return Fitted(key, unit, value, None, f"{_text(value)} is outside {low} to {high}")
    return Fitted(key, unit, value, stored)


def _text(value: Decimal) -> str:
    return decimal_text(value.quantize(Decimal("0.000001")) if abs(value) < 1 else value)
