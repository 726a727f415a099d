"""Gains as a vendor's registers hold them: in its own terms, rounded, with the error that this makes."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from math import isinf
from typing import TYPE_CHECKING

from pidcfg.encoders.tuned import FULL_OUTPUT, LoopTuning
from pidcfg.encoders.words import EncodeError
from pidcfg.schemas.numbers import decimal_text

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
    loop = LoopTuning(vendor.load("tuned"), pv_span=_decimal(pv_span), output_span=_decimal(output_span))
    return fit_loop(gains, vendor.model, loop)


def fit_loop(gains: Gains, model: type[BaseModel], loop: LoopTuning) -> list[Fitted]:
    """The three numbers as a loop of a file holds them; raises `ValueError` where it lacks the PV's span."""
    words, integral = loop.words, _integral(gains, loop)
    derivative = gains.kd if loop.independent else gains.derivative_time
    wanted = (_decimal(gains.gain * gain_factor(loop)), integral, _decimal(derivative))
    rows = zip(words.names, loop.units(), wanted, strict=True)
    return [_fitted(model, words, *row) for row in rows]


def gain_factor(loop: LoopTuning) -> float:
    """From output units per PV unit to the loop's unit of the gain."""
    if loop.words.gain_unit == "engineering":
        return 1.0
    span = FULL_OUTPUT if loop.output_span is None else loop.output_span
    if loop.words.gain_unit == "percent":
        return float(FULL_OUTPUT / span)
    if loop.pv_span is None:
        raise ValueError("the gain is a share of the PV's span, which is not known")
    return float(loop.pv_span / span)


def _integral(gains: Gains, loop: LoopTuning) -> Decimal:
    """What the integral term is written as: a time in s or min, or a gain in 1/s."""
    if isinf(gains.integral_time):
        return loop.words.no_integral
    if loop.independent:
        return _decimal(gains.ki)
    return _decimal(gains.integral_time / (60 if loop.minutes else 1))


def _decimal(value: float) -> Decimal:
    return Decimal(f"{value:.{DIGITS}g}")


def _fitted(model: type[BaseModel], words: Tuned, name: str, unit: str, value: Decimal) -> Fitted:
    key, limits = words.key(name), words.limits(model, name)
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
