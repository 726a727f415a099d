"""A neutral loop with the scales of the DL06 loop that it becomes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping
    from decimal import Decimal

    from pidcfg.encoders.scales import Scale
    from pidcfg.schemas.generic import GenericFile, Loop


@dataclass(frozen=True, slots=True)
class Dl06Target:
    """A neutral loop, its file, and what its DL06 gives."""

    file: GenericFile
    neutral: Loop
    plc: Mapping[str, Any]
    """Settings of the CPU."""
    form: str
    """Data format of PV and output."""
    scales: dict[str, Scale]
    fastest: Decimal
    """The shortest sample time in s."""
    sample: Decimal
    """The sample time in s as its word will hold it."""
