"""How much the loops lengthen the PLC's scan, by the formula of the manual ("PID Loop Effect on CPU Scan Time")."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import DL06
from pidcfg.sim.report import ScanTime

if TYPE_CHECKING:
    from collections.abc import Iterable

BASIS = DL06.at("PID Loop Effect on CPU Scan Time")
CALCULATION = (150e-6, 250e-6, 350e-6)
"""Seconds of one loop calculation: minimum, typical, maximum; it depends on the options that are selected."""


def scan_time(without_loops: float, sample_rates: Iterable[float]) -> ScanTime:
    """The scan time without loops, plus for each loop (scan time / sample rate) x calculation time."""
    share = sum(without_loops / rate for rate in sample_rates)
    low, typical, high = (without_loops + share * seconds for seconds in CALCULATION)
    return ScanTime(low, typical, high)
