"""The dead band with zero crossing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dpide import REMARKS, TABLE
from pidcfg.validate.rule import Findings, checklist, info, per_loop, warning
from pidcfg.validate.rules.dpide.derivative import derivative_of
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.dpide.context import LoopView


@per_loop
@info("DP761", TABLE, "ERR_DBW is {value}; its absolute value counts")
def negative_dead_band(view: LoopView) -> Findings:
    """The dead band is below 0.

    Why: the PLC takes the absolute value, so it is not switched off.

    Fix: write 0 to switch it off, else the number without its sign.
    """
    if view.loop.ERR_DBW < 0:
        yield view.at("ERR_DBW", value=number_text(view.loop.ERR_DBW))


@per_loop
@warning(
    "DP762",
    REMARKS,
    "ERR_DBW {value} around SV covers the PV's whole range {low} to {high}: after the first crossing of SV the "
    "error counts as 0 for ever",
)
def dead_band_covers_range(view: LoopView) -> Findings:
    """The PV cannot leave the dead band.

    Why: once the PV has crossed SV, the error counts as 0 until the PV is out of the band. If the whole range lies
    inside, the loop never controls again.

    Fix: write a band that is small against the range; mind the unit.
    """
    span, values = view.loop.pv.range, view.held("ERR_DBW", "SV")
    if span is not None and values and abs(values[0]) >= max(values[1] - span[0], span[1] - values[1]):
        yield view.at("ERR_DBW", value=number_text(abs(values[0])), low=number_text(span[0]), high=view.pv(span[1]))


@per_loop
@checklist("DP763", REMARKS, "when PV leaves the dead band of {value}, the error jumps from 0 to that, and {effect}")
def dead_band_kick(view: LoopView) -> Findings:
    """A dead band makes the output jump at its edge.

    Why: inside the band the error counts as 0 after PV has crossed SV. At its edge the full error comes back within one
    cycle, and MV jumps by the band times the gain. The previous error was 0, so a derivative of the error is a pulse.

    Fix: see that the actuator bears it. Otherwise write a smaller band, and `PID_DE: true` for the derivative.
    """
    if any(view.held("ERR_DBW")):
        kicks = not view.loop.PID_DE and derivative_of(view) > 0
        effect = "the derivative kicks MV" if kicks else "MV jumps with it"
        yield view.at("ERR_DBW", value=view.pv(abs(view.held("ERR_DBW")[0])), effect=effect)
