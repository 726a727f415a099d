"""The loops of a configuration in the neutral form, as far as they have one."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.common_scale import flat, on_the_same_scale
from pidcfg.conversion.pipeline import generic_file
from pidcfg.conversion.values import number_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.conversion.ledger import NeutralLoop
    from pidcfg.schemas.generic import Loop
    from pidcfg.vendors import Vendor

EQUAL = Decimal("1e-6")
"""Relative difference of numbers that count as equal."""
FOLLOWS, NO_FOLLOWING = "setpoint.follows_pv", False
"""A PLC that knows nothing of it lets the set point stay."""
ACTION = "output_raises_pv"
"""No line excuses another action."""
FIRST = ("sample_time", "tuning.gain")
"""Fields on which the meaning of others depends."""


def neutral_of(config: Any, vendor: Vendor) -> tuple[tuple[Loop | None, ...], list[NeutralLoop]]:
    """The loops of a file, None for one without a neutral form, and what became of their fields."""
    neutral: list[NeutralLoop] = vendor.load("to_neutral")(config)
    whole = [loop for loop in neutral if not loop.missing]
    models = iter(generic_file(config, whole).loops if whole else ())
    return tuple(None if loop.missing else next(models) for loop in neutral), neutral


def loops_of(config: Any, vendor: Vendor) -> tuple[Loop | None, ...]:
    """The loops of a file, None for one without a neutral form."""
    return neutral_of(config, vendor)[0]


def neutral_values(loop: Loop, other: Loop) -> tuple[dict[str, Any], dict[str, Any]]:
    """The values of two neutral loops by path, the second on the first one's scale of the output."""
    one, two = flat(loop), flat(other)
    for values in (one, two):
        values.setdefault(FOLLOWS, NO_FOLLOWING)
    return one, on_the_same_scale(one, two)


def same(a: Any, b: Any) -> bool:
    """Whether two neutral values are equal."""
    one, two = number_of(a), number_of(b)
    if one is None or two is None:
        return bool(a == b)
    return abs(one - two) <= EQUAL * max(abs(one), abs(two))


def differing(one: Mapping[str, Any], two: Mapping[str, Any]) -> list[str]:
    """The neutral fields that differ, those first on which others depend."""
    keys = [key for key in dict.fromkeys((*one, *two)) if not same(one.get(key), two.get(key))]
    return sorted(keys, key=lambda key: FIRST.index(key) if key in FIRST else len(FIRST))


def neutral_at(loop: Loop, path: str) -> Any:
    """A neutral value by path, as `neutral_values` has it."""
    return flat(loop).get(path, NO_FOLLOWING if path == FOLLOWS else None)
