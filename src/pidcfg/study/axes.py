"""What a loop's signals are called and counted in: names, units and ranges, for pictures and comparisons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite, sqrt
from typing import Any

from pidcfg.sim.controllers.plc import TICKS, Plc
from pidcfg.text.frozen import frozen

PERCENT = (0.0, 100.0)


@frozen
class Root:
    """The PV's scale of a loop that takes the root of it: its signals are recorded as they are before."""

    low: float
    width: float
    zero: float
    """Where the PV's counts begin, as a share of the span."""

    def taken(self, value: float) -> float:
        """The PV for a value before the root."""
        return self.low + self.width * sqrt(max((value - self.low) / self.width + self.zero, 0.0))

    def remark(self, name: str, last: float, unit: str) -> str:
        """A remark on what the axis shows, with the value of ``name`` at the end as the example."""
        stands = f"{self.taken(last):.4g} {unit}".rstrip()
        return f"PV and {name} are before the root: {last:.4g} at the end stands for {stands}"


def root_of(plc: Plc, loop: int) -> Root | None:
    """The scale of a loop, by its number, whose signals are those before its root is taken; None for another one."""
    low, high, _ = plc.scales[loop]
    zero = plc.roots[loop] if plc.roots else None
    return None if zero is None else Root(low, high - low, zero)


@frozen
class Axes:
    """What a loop's signals are called and counted in."""

    pv: str
    setpoint: str
    output: str
    """Names of the signals; empty: the PLC shows no such signal."""
    pv_unit: str = ""
    output_unit: str = ""
    output_range: tuple[float, float] | None = None
    output_counts: tuple[float, float] | None = None
    """Counts of the output at 0 % and 100 %, where no range says what they stand for."""
    pv_range: tuple[float, float] = PERCENT
    sample_time: float = 0.0
    """In s; 0: each base step."""
    root: Root | None = None
    """Given where the loop takes the root of its PV."""
    description: str = ""


def axes_of(plc: Plc, settings: Sequence[Mapping[str, Any]]) -> dict[str, Axes]:
    """The axes of each loop; units, ranges and descriptions come from the ``settings`` of its image."""
    by_name = {str(entry["loop"]): entry for entry in settings if "loop" in entry}
    axes = {}
    for i, loop in enumerate(plc.loops):
        entry, config = by_name.get(loop, {}), plc.configs[i]
        pv, output = (dict(entry.get(key) or {}) for key in ("pv", "output"))
        unit = output.get("unit") or plc.output_unit
        shown = (
            plc.outputs[i] if plc.outputs else output.get("range") or (PERCENT if unit == "%" else limits_of(plc, i))
        )
        low, high, counts = plc.scales[i]
        raw = "range" not in pv and high - low == counts
        axes[loop] = Axes(
            plc.signals[config.pv_slot],
            plc.signals[config.sp_slot],
            plc.signals[config.out_slot],
            pv_unit=str(pv.get("unit") or ("counts" if raw else "")),
            output_unit=str(unit or ("counts" if plc.outputs and "range" not in output else "")),
            output_range=None if shown is None else (float(shown[0]), float(shown[1])),
            output_counts=plc.outputs[i] if plc.outputs and "range" not in output else None,
            pv_range=(low, high),
            sample_time=config.period / TICKS,
            root=root_of(plc, i),
            description=str(entry.get("description") or ""),
        )
    return axes


def limits_of(plc: Plc, loop: int) -> tuple[float, float] | None:
    """The limits of an output without a range, as they are at the start; None where they are no range to show."""
    low, high = plc.output_limits(loop, plc.signal_values)
    return (low, high) if isfinite(high - low) and low < high else None


def signals_of(axes: Mapping[str, Axes]) -> frozenset[str]:
    """The signals that a picture needs."""
    return frozenset(name for one in axes.values() for name in (one.pv, one.setpoint, one.output) if name)
