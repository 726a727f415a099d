"""The output: its limits, what manual and feed forward make of them, and the 0 of a loop that is stopped."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dpide import TABLE
from pidcfg.refs import DPIDE
from pidcfg.validate.ideas.limits import outside_limits
from pidcfg.validate.rule import Findings, error, info, per_loop, warning
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.dpide.context import LoopView


@per_loop
@warning(
    "DP741", TABLE, "MV_MAX {highest} is below MV_MIN {lowest}: the PLC swaps them, MV goes from {highest} to {lowest}"
)
def limits_swapped(view: LoopView) -> Findings:
    """The highest MV is below the lowest.

    Why: the PLC exchanges the two, so the loop runs; it does not turn the direction round.

    Fix: exchange them in the file. For cooling write `PID_DIR: false`.
    """
    limits = view.held("MV_MIN", "MV_MAX")
    if limits and limits[1] < limits[0]:
        yield view.at("MV_MAX", highest=number_text(limits[1]), lowest=number_text(limits[0]))


@per_loop
@error("DP742", TABLE, "MV_MAX and MV_MIN are both {limit}: MV cannot move")
def limits_equal(view: LoopView) -> Findings:
    """The highest MV is the lowest.

    Why: MV is that number, whatever the PV does.

    Fix: write the limits of the actuator.
    """
    limits = view.held("MV_MIN", "MV_MAX")
    if limits and limits[0] == limits[1]:
        yield view.at("MV_MAX", limit=view.mv(limits[0]))


@per_loop
@warning("DP743", TABLE, "MOUT {mout} is outside {low} to {high}: in manual MV is {used}")
def manual_output_outside_limits(view: LoopView) -> Findings:
    """The output of manual is outside the limits.

    Why: the limits hold in manual too; MV is the nearest of them.

    Fix: write a MOUT inside the limits.
    """
    mout, limits = view.number("MOUT"), view.limits
    stated = view.loop.PID_MAN or (view.gives("MOUT") and not view.loop.MOUT_AUTO)
    if stated and mout is not None and limits is not None:
        place = "MOUT" if view.gives("MOUT") else "PID_MAN"
        used = view.mv(min(max(mout, limits[0]), limits[1]))
        yield from outside_limits(
            view, place, value=mout, limits=limits, shown=view.mv, units=(), field="mout", used=used
        )


@per_loop
@warning(
    "DP744",
    DPIDE.at("The PID algorithm"),
    "BIAS {bias} is outside {low} to {high}: with PV at SV the output stands at its limit",
)
def feed_forward_outside_limits(view: LoopView) -> Findings:
    """The feed forward alone drives the output to a limit.

    Why: BIAS is added to the three terms. Beyond a limit they must first undo the rest of it before MV moves at all.

    Fix: write a BIAS inside the limits.
    """
    bias = view.number("BIAS") if view.gives("BIAS") else None
    yield from outside_limits(view, "BIAS", value=bias, limits=view.limits, shown=view.mv, units=(), field="bias")


@per_loop
@warning("DP745", TABLE, "{operand} {limit} is outside the output's range of {low} to {high}")
def limits_beyond_output(view: LoopView) -> Findings:
    """A limit of MV lies beyond what the output can do.

    Why: the actuator stands at its end while MV goes on. The integral goes on with it, and needs as long to come back.

    Fix: write the ends of the output as MV_MIN and MV_MAX, or correct `output.range`.
    """
    for key in ("MV_MAX", "MV_MIN"):
        limit, span = view.number(key), view.loop.output.range
        yield from outside_limits(
            view, key, value=limit, limits=span, shown=view.mv, units=("high",), field="limit", operand=key
        )


@per_loop
@info("DP746", TABLE, "MV is 0 while PID_RUN is FALSE, which is outside its limits {low} to {high}")
def stop_outside_limits(view: LoopView) -> Findings:
    """A loop that is stopped writes an output that lies outside its limits.

    Why: with PID_RUN FALSE the instruction resets MV to 0 and does not look at the limits. Where 0 is not off, the
    actuator moves.

    Fix: nothing, if 0 is safe. Otherwise switch the instruction's EN off to hold MV, or let the program write the
    output while the loop is stopped.
    """
    if view.limits is not None and not view.limits[0] <= 0 <= view.limits[1]:
        low, high = view.limits
        yield view.at("MV_MIN" if low > 0 else "MV_MAX", low=number_text(low), high=view.mv(high))
