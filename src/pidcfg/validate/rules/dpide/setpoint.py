"""Set point and process value."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dpide import TABLE
from pidcfg.validate.rule import Findings, per_loop, warning
from pidcfg.validate.rules.dpide.operation import D259
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.dpide.context import LoopView


@per_loop
@warning("DP751", TABLE, "SV {sv} is outside the PV's range of {low} to {high}")
def set_point_outside_range(view: LoopView) -> Findings:
    """The target value cannot be measured.

    Why: the PV never reaches it, so the integral drives MV to a limit and stays there.

    Fix: correct SV, or `pv.range`; both must be in the same unit.
    """
    span, target = view.loop.pv.range, view.held("SV")
    if span is not None and target and not span[0] <= target[0] <= span[1]:
        yield view.at("SV", sv=number_text(target[0]), low=number_text(span[0]), high=view.pv(span[1]))


@per_loop
@warning("DP752", D259, "PV is {pv} and has no device: nothing is measured")
def process_value_as_a_number(view: LoopView) -> Findings:
    """The process value is a number in the program.

    Why: it never changes, so the integral drives MV to a limit. A heater runs away.

    Fix: leave PV out, or give it the device where the measured value stands: `devices: {PV: D100}`.
    """
    if view.held("PV") and not view.has_device("PV"):
        yield view.at("PV", pv=view.pv(view.held("PV")[0]))
