"""What a loop's signals are called and counted in."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.sim.plc import Plc

PERCENT = (0, 100)


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
class Axes:
    """What a loop's signals are called and counted in."""

    pv: str
    setpoint: str
    output: str
    """Names of the signals; empty: the PLC shows no such signal."""
    pv_unit: str = ""
    output_unit: str = ""
    output_range: tuple[float, float] | None = None
    root: Root | None = None
    """Given where the loop takes the root of its PV."""
    description: str = ""


def axes_of(plc: Plc, settings: Sequence[Mapping[str, Any]]) -> dict[str, Axes]:
    """The axes of each loop; units, ranges and descriptions come from the ``settings`` of its image."""
    by_name = {str(entry["loop"]): entry for entry in settings if "loop" in entry}
    axes = {}
    for i, loop in enumerate(plc.loops):
        entry, cfg = by_name.get(loop, {}), plc.cfg[i]
        pv, output = (dict(entry.get(key) or {}) for key in ("pv", "output"))
        unit = output.get("unit") or plc.output_unit
        shown = (
            plc.outputs[i] if plc.outputs else output.get("range") or (PERCENT if unit == "%" else limits_of(plc, i))
        )
        low, high, counts = plc.scales[i]
        raw = "range" not in pv and high - low == counts
        axes[loop] = Axes(
            plc.signals[cfg.sig_pv],
            plc.signals[cfg.sig_sp],
            plc.signals[cfg.sig_out],
            pv_unit=str(pv.get("unit") or ("counts" if raw else "")),
            output_unit=str(unit or ("counts" if plc.outputs and "range" not in output else "")),
            output_range=None if shown is None else (float(shown[0]), float(shown[1])),
            root=root_of(plc, i),
            description=str(entry.get("description") or ""),
        )
    return axes


def limits_of(plc: Plc, loop: int) -> tuple[float, float] | None:
    """The limits of an output without a range, as they are at the start; None where they are no range to show."""
    low, high = plc.output_limits(loop, plc.sig)
    return (low, high) if isfinite(high - low) and low < high else None


def signals_of(axes: Mapping[str, Axes]) -> frozenset[str]:
    """The signals that a picture needs."""
    return frozenset(name for one in axes.values() for name in (one.pv, one.setpoint, one.output) if name)
