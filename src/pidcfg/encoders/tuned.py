"""Where a vendor keeps the three numbers of a PID controller, and in which terms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.encoders.regmap import RegisterMap

GainUnit = Literal["span", "percent"]
"""``span``: share of the output's span per share of the PV's span; ``percent``: % of the output per PV unit."""


@dataclass(frozen=True, slots=True)
class TunedWords:
    """Registers of gain, integral and derivative time by name (times in s), and the vendor's words for the action."""

    table: RegisterMap
    gain: str
    integral: str
    derivative: str
    gain_unit: GainUnit
    no_integral: Decimal
    """What the integral time is written as where there is no integral term."""
    heating: str
    """The action of a loop whose PV rises with its output."""
    cooling: str
