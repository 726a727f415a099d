"""Set point and process value."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dpide import TABLE
from pidcfg.validate.ideas.limits import outside_limits
from pidcfg.validate.rule import Findings, per_loop, warning
from pidcfg.validate.rules.dpide.operation import D259

if TYPE_CHECKING:
    from pidcfg.validate.rules.dpide.context import LoopView


@per_loop
@warning("DP751", TABLE, "SV {sv} is outside the PV's range of {low} to {high}")
def set_point_outside_range(view: LoopView) -> Findings:
    """The target value cannot be measured.

    Why: the PV never reaches it, so the integral drives MV to a limit and stays there.

    Fix: correct SV, or `pv.range`; both must be in the same unit.
    """
    span, target = view.loop.pv.range, view.number("SV")
    yield from outside_limits(view, "SV", value=target, limits=span, shown=view.pv, units=("high",), field="sv")


@per_loop
@warning("DP752", D259, "PV is {pv} and has no device: nothing is measured")
def process_value_as_a_number(view: LoopView) -> Findings:
    """The process value is a number in the program.

    Why: it never changes, so the integral drives MV to a limit. A heater runs away.

    Fix: leave PV out, or give it the device where the measured value stands: `devices: {PV: D100}`.
    """
    if view.held("PV") and not view.has_device("PV"):
        yield view.at("PV", pv=view.pv(view.held("PV")[0]))
