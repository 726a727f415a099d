"""Units of tables in the words of a loop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.paths import value_at

if TYPE_CHECKING:
    from collections.abc import Mapping

SIDES = ("pv", "output")
"""The two ends of a loop, which have units of their own."""
RESET_UNIT = "s, or min by reset_unit"
"""The unit of DL06's reset time in tables: a bit of the loop says which of both."""
RESET_UNITS = {"seconds": "s", "minutes": "min"}


def units_of(loop: object) -> dict[str, str]:
    """The units of PV and output that a loop, or what a listing says of one, gives; of the reset time, if it tells."""
    units = {side: str(unit) for side in SIDES if (unit := value_at(loop, (side, "unit")))}
    reset = RESET_UNITS.get(str(value_at(loop, ("tuning", "reset_unit"))))
    return {**units, RESET_UNIT: reset} if reset else units


def unit_text(unit: str, units: Mapping[str, str], nested: str = " per ") -> str:
    """A unit of a table with the loop's own for ``pv`` and ``output``: ``pv/s`` is ``degC/s``, or ``m3/h per s``.

    ``nested`` divides where a part is a quotient itself.
    """
    if " per " in unit:
        return " per ".join(unit_text(part, units, nested) for part in unit.split(" per "))
    parts = [units.get(part, part) for part in unit.split("/")]
    return (nested if len(parts) > 1 and any("/" in part for part in parts) else "/").join(parts)
