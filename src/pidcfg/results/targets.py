"""Where the gains of a rule go: the terms of a PLC, or a loop of a configuration."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

from pidcfg.results.arguments import ArgumentError
from pidcfg.results.processes import as_float

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.reader import Reader
    from pidcfg.results.findings import Data
    from pidcfg.tuning.fit import Fitted
    from pidcfg.tuning.rules import Gains
    from pidcfg.vendors import Vendor


@dataclass(frozen=True, slots=True)
class VendorGains:
    """The three numbers as the registers of a PLC hold them, and its word for the action."""

    vendor: str
    action: str | None
    """None: the sign of the process's gain is not known."""
    values: tuple[Fitted, ...]

    def to_json(self) -> Data:
        """Key, unit, value, what is stored of it, and the error that this makes."""
        values = [
            {
                "key": v.key,
                "unit": v.unit,
                "value": float(v.wanted),
                "stored": None if v.stored is None else float(v.stored),
                "error_percent": round(v.error_percent, 4),
                "problem": v.problem,
            }
            for v in self.values
        ]
        return {"vendor": self.vendor, "action": self.action, "values": values}


@dataclass(frozen=True, slots=True)
class Into:
    """The file that gains are put into: its bytes, its name, and which of its loops; None: the only one."""

    data: bytes
    name: str
    loop: str | None
    reader: Reader


@dataclass(frozen=True, slots=True)
class Target:
    """The PLC that is to hold the gains, if any, and the engineering values of PV and output at 0 and 100 %."""

    vendor: Vendor | None
    pv_range: tuple[float, float] | None
    output_range: tuple[float, float] | None
    """None: 0 to 100, or what the configuration says."""
    into: Into | None = None
    """The configuration that the gains are put into."""

    def refuse_ranges(self) -> None:
        """Raises `ArgumentError` where the PV's range is needed and nobody says it, or a range does not ascend."""
        vendor = self.vendor if self.into is None and self.pv_range is None else None
        if vendor is not None and vendor.load("tuned").gain_unit == "span":
            raise ArgumentError(f"{vendor.title} has gains in shares of the span: add `pv_range` LOW HIGH", "pv_range")
        for name, span in (("pv_range", self.pv_range), ("output_range", self.output_range)):
            if span is not None and not 0 < as_float(span[1]) - as_float(span[0]) < inf:
                ends = " to ".join(f"{as_float(end):g}" for end in span)
                raise ArgumentError(f"`{name}` {ends} does not ascend; write the lower end first", name)

    def gains(self, gains: Gains, *, heating: bool | None) -> VendorGains | None:
        """The three numbers as the registers hold them."""
        if self.vendor is None:
            return None
        from pidcfg.tuning.fit import fit

        ranges = (self.pv_range or (0.0, 1.0), self.output_range or (0.0, 100.0))
        spans = (float(high) - float(low) for low, high in ranges)
        return held_by(self.vendor, fit(gains, self.vendor, *spans), heating=heating)


def held_by(vendor: Vendor, values: Sequence[Fitted], *, heating: bool | None) -> VendorGains:
    """The three numbers of a PLC with its word for the action."""
    words = vendor.load("tuned")
    action = None if heating is None else words.heating if heating else words.cooling
    return VendorGains(vendor.key, action, tuple(values))
