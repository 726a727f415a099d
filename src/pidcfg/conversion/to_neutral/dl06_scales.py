"""DL06 quantities, which may be raw counts, as exact engineering values; what a square-root loop makes of alarms."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.conversion.arithmetic import ZERO, product, quotient, rounded
from pidcfg.encoders.scales import is_raw
from pidcfg.refs import Decision
from pidcfg.schemas.numbers import EXACT

if TYPE_CHECKING:
    from pidcfg.encoders.scales import Scale
    from pidcfg.schemas.base import Quantity

D284 = Decision(
    284,
    "alarms of a square-root loop become alarms of the flow",
    "A DL06 compares its absolute alarms with the raw PV; in a conversion a point is the flow whose square it is. Its "
    "deviation and rate-of-change alarms and its hysteresis are differences of squares and are dropped.",
    "The PV of the neutral loop is the root. A difference of squares is another flow at every set point.",
)


DIGITS = 10


def short(value: Decimal) -> Decimal:
    """What was worked out from a neutral number, which may itself be a quotient of `terms.DIGITS` digits."""
    return Decimal(f"{value:.{DIGITS}g}") if value else ZERO


def position(scale: Scale, value: Quantity) -> Decimal:
    """A value on a scale that has a range."""
    if not is_raw(value, scale) or scale.range is None:
        return value.value
    share = quotient(product(value.value - scale.zero, scale.width), scale.full)
    return rounded(EXACT.add(scale.range[0], share))


def distance(scale: Scale, value: Quantity) -> Decimal:
    """A difference on a scale that has a range."""
    if not is_raw(value, scale):
        return value.value
    return rounded(quotient(product(value.value, scale.width), scale.full))


def flow(scale: Scale, value: Quantity) -> Decimal:
    """The root of a raw PV, in units of the flow (D284); a negative PV has none."""
    low = scale.range[0] if scale.range else ZERO
    share = quotient(max(scale.position(value), ZERO), Decimal(scale.format.span))
    return rounded(EXACT.add(low, product(EXACT.sqrt(share), scale.width)))


def squared(scale: Scale, value: Decimal) -> Decimal:
    """The value on the raw scale whose root is a flow (D284)."""
    low, span = scale.range[0] if scale.range else ZERO, Decimal(scale.format.span)
    share = max(quotient(value - low, scale.width), ZERO)
    counts = product(share, share, span) - scale.format.minimum
    return short(EXACT.add(low, quotient(product(counts, scale.width), span)))
