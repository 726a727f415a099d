"""Values as people read them, and units in the words of the loop."""

from __future__ import annotations

from decimal import Decimal
from math import floor, isfinite, log10
from typing import TYPE_CHECKING, Any

from pidcfg.schemas.base import Duration, Quantity
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.numbers import decimal_text

if TYPE_CHECKING:
    from pidcfg.report.content import Value

SIDES = {"pv": "PV unit", "output": "output unit"}
"""What stands for the unit of a side that has none."""
TINY, THOUSANDTH, THOUSAND, HUNDRED_THOUSAND, MILLION, HUGE = 1e-15, 1e-3, 1e3, 1e5, 1e6, 1e15
RAISED = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def cell(value: Any) -> Value:
    """A value of a model as a cell: numbers, truths and texts stay what they are."""
    if value is None or isinstance(value, bool | int | float | Decimal):
        return value
    if isinstance(value, Quantity):
        return value.value
    if isinstance(value, Duration):
        return value.value
    if isinstance(value, Wire):
        return f":= {value.text}"
    if isinstance(value, tuple) and type(value) is tuple:
        raw = all(isinstance(part, Quantity) and part.counts for part in value)
        return " to ".join(text(part.value if raw else part) for part in value)
    return str(value)


def text(value: Any) -> str:
    """A cell, or a value that becomes one, as text."""
    if isinstance(value, Quantity) and value.counts:
        return str(value)
    value = cell(value)
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Decimal):
        return decimal_text(value)
    return number(value) if isinstance(value, float) else str(value)


def number(value: float) -> str:
    """The shortest decimal that means this number, all digits in sight unless there would be more than fifteen."""
    if value and not TINY <= abs(value) < HUGE:
        return repr(value)
    return decimal_text(Decimal(repr(value)))


def measured(value: float) -> str:
    """A number that was measured, in engineering digits: five of them, or all before the point up to a million.

    Beyond, and below a thousandth, with a power of ten whose exponent is a multiple of three: 4.1471×10⁹.
    """
    if value and isfinite(value) and not THOUSANDTH <= abs(value) < MILLION:
        exponent = 3 * (floor(log10(abs(value))) // 3)
        mantissa = float(f"{Decimal(value).scaleb(-exponent):.5g}")
        if abs(mantissa) >= THOUSAND:
            exponent, mantissa = exponent + 3, mantissa / THOUSAND
        return f"{mantissa:g}×10{str(exponent).translate(RAISED)}"
    return number(float(f"{value:.5g}" if abs(value) < HUNDRED_THOUSAND else f"{value:.0f}"))
