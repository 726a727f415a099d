"""PID errors of a CLICK loop: which one DSn+00 shows, worked out from the registers whenever one is written (D117)."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.click.errors import WORDS
from pidcfg.encoders.maps.click import ERRORS, PidError
from pidcfg.encoders.words import Implied
from pidcfg.sim.terms import single

if TYPE_CHECKING:
    from collections.abc import Mapping
    from decimal import Decimal


def row_of(number: int) -> int:
    """The row of an error, counted from 1: what `State.error` holds."""
    return next(row for row, error in enumerate(ERRORS, start=1) if error.number == number)


BIAS_NUMBER = 25.0
BIAS_ERROR = row_of(int(BIAS_NUMBER))


class Range(NamedTuple):
    """What a register may hold, as it is stored."""

    low: float
    high: float


def _end(error: PidError, end: Decimal | None, otherwise: float) -> float:
    """A limit as the register holds it: whole digits, or a single-precision number."""
    codec = WORDS[error.register].codec
    if end is None:
        return otherwise
    return float(end / codec.step) if isinstance(codec, Implied) else single(float(end))


RANGES = {
    error.register: Range(_end(error, error.low, float("-inf")), _end(error, error.high, float("inf")))
    for error in ERRORS
    if error.low is not None
}
"""The registers with limits."""


def is_active(error: PidError, n: Mapping[str, float]) -> bool:
    """Whether an error's condition holds; infinities are not numbers either, and limits count only when both are on."""
    value = n[error.register]
    if error.above is not None:
        return bool(n["setpoint_lower_enable"] and n["setpoint_upper_enable"] and value > n[error.above])
    if not isfinite(value):
        return True
    limits = RANGES.get(error.register)
    return limits is not None and not limits.low <= value <= limits.high


def lowest_error(n: Mapping[str, float]) -> int:
    """The row of the lowest error that is active, from 1; 0: none."""
    return next((row for row, error in enumerate(ERRORS, start=1) if is_active(error, n)), 0)


def nearest_allowed(register: str, value: float) -> float:
    """A register's value, or the nearest one without an error."""
    limits = RANGES[register]
    return min(max(value, limits.low), limits.high)
