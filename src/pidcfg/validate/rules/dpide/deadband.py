"""The dead band with zero crossing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.encoders.maps.dpide import REMARKS, TABLE
from pidcfg.validate.rule import rule
from pidcfg.validate.rules.dpide.context import number_text
from pidcfg.validate.rules.dpide.derivative import derivative_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.validate.rule import Finding
    from pidcfg.validate.rules.dpide.context import DpideContext


@rule(
    code="PID761",
    name="negative-dead-band",
    severity=Severity.INFO,
    basis=TABLE,
    message="ERR_DBW is {value}; its absolute value counts",
)
def negative_dead_band(context: DpideContext) -> Iterator[Finding]:
    """The dead band is below 0.

    Why: the PLC takes the absolute value, so it is not switched off.

    Fix: write 0 to switch it off, else the number without its sign.
    """
    for view in context.loops:
        if view.loop.ERR_DBW < 0:
            yield view.find("ERR_DBW", value=number_text(view.loop.ERR_DBW))


@rule(
    code="PID762",
    name="dead-band-covers-range",
    severity=Severity.WARNING,
    basis=REMARKS,
    message="ERR_DBW {value} around SV covers the PV's whole range {low} to {high}: after the first crossing of SV the "
    "error counts as 0 for ever",
)
def dead_band_covers_range(context: DpideContext) -> Iterator[Finding]:
    """The PV cannot leave the dead band.

    Why: once the PV has crossed SV, the error counts as 0 until the PV is out of the band. If the whole range lies
    inside, the loop never controls again.

    Fix: write a band that is small against the range; mind the unit.
    """
    for view in context.loops:
        span, found = view.loop.pv.range, view.held("ERR_DBW", "SV")
        if span is not None and found and abs(found[0]) >= max(found[1] - span[0], span[1] - found[1]):
            yield view.find("ERR_DBW", value=number_text(abs(found[0])), low=number_text(span[0]),
                            high=view.pv(span[1]))  # fmt: skip


@rule(
    code="PID763",
    name="dead-band-kick",
    severity=Severity.INFO,
    basis=REMARKS,
    message="when PV leaves the dead band of {value}, the error jumps from 0 to that, and {effect}",
)
def dead_band_kick(context: DpideContext) -> Iterator[Finding]:
    """A dead band makes the output jump at its edge.

    Why: inside the band the error counts as 0 after PV has crossed SV. At its edge the full error comes back within one
    cycle, and MV jumps by the band times the gain. The previous error was 0, so a derivative of the error is a pulse.

    Fix: nothing, if the actuator bears it. Otherwise write a smaller band, and `PID_DE: true` for the derivative.
    """
    for view in context.loops:
        if any(view.held("ERR_DBW")):
            kicks = not view.loop.PID_DE and derivative_of(view) > 0
            effect = "the derivative kicks MV" if kicks else "MV jumps with it"
            yield view.find("ERR_DBW", value=view.pv(abs(view.held("ERR_DBW")[0])), effect=effect)
