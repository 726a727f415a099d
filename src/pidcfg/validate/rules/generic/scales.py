"""Values against the scales and limits that they belong to."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.generic.decisions import D299
from pidcfg.schemas.generic import D280
from pidcfg.validate.ideas.limits import outside_limits
from pidcfg.validate.rule import Findings, error, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.generic.context import LoopView


@per_loop
@warning("GN801", D280, "the output limit {value} is outside the output's range, {low} to {high}")
def output_limits_outside_range(view: LoopView) -> Findings:
    """A limit of the output lies outside the output's range.

    Why: the range is what the actuator can do. The output stays at the end of it while the controller believes that it
    still moves: the integral winds up.

    Fix: write limits inside `output.range`, or correct the range.
    """
    for i, end in enumerate(view.loop.output.limits or ()):
        yield from outside_limits(view, "output", "limits", i, value=end, limits=view.loop.output.range, shown=view.out)


@per_loop
@warning("GN802", D280, "the set-point limit {value} is outside the PV's range, {low} to {high}")
def set_point_limits_outside_range(view: LoopView) -> Findings:
    """A limit of the set point lies outside the PV's range.

    Why: the PV is not measured there, so such a set point is never reached.

    Fix: write limits inside `pv.range`, or correct the range.
    """
    for i, end in enumerate(view.loop.setpoint.limits or ()):
        yield from outside_limits(view, "setpoint", "limits", i, value=end, limits=view.loop.pv.range, shown=view.pv)


@per_loop
@warning("GN803", D280, "the set point {value} is outside {what}, {low} to {high}")
def set_point_out_of_reach(view: LoopView) -> Findings:
    """The set point lies outside its limits, or outside the PV's range.

    Why: outside its limits it is brought to the nearer one; outside the range the PV never reaches it, and the output
    goes to a limit.

    Fix: correct the set point, its limits or the range.
    """
    value, limits = view.loop.setpoint.value, view.loop.setpoint.limits
    ends, what = (view.loop.pv.range, "the PV's range") if limits is None else (limits, "its limits")
    yield from outside_limits(view, "setpoint", "value", value=value, limits=ends, shown=view.pv, what=what)


@per_loop
@warning("GN804", D280, "the bias {value} is outside the limits of the output, {low} to {high}")
def bias_outside_limits(view: LoopView) -> Findings:
    """The bias lies outside the limits of the output.

    Why: the bias is the output without an error. Beyond the limits the output stays at one of them until the other
    actions have made up for the rest.

    Fix: write a bias between the limits; it is in units of the output.
    """
    bias = view.loop.output.bias or None
    yield from outside_limits(view, "output", "bias", value=bias, limits=view.limits, shown=view.out)


@per_loop
@warning("GN805", D280, "the manual output {value} is outside the limits of the output, {low} to {high}")
def manual_outside_limits(view: LoopView) -> Findings:
    """The output for manual lies outside the limits of the output.

    Why: the limit is taken in its place.

    Fix: write a value between the limits; it is in units of the output.
    """
    manual = view.loop.output.manual
    yield from outside_limits(view, "output", "manual", value=manual, limits=view.limits, shown=view.out)


@per_loop
@warning("GN806", D299, "the PV is a root, but its range begins at {low} and not at 0")
def square_root_off_zero(view: LoopView) -> Findings:
    """The PV is the root of a differential pressure, and its range does not begin at 0.

    Why: a flow is proportional to the root of the pressure only if both are 0 together. With another beginning PLCs
    differ in what they take the root of.

    Fix: write a range from 0, or `square_root: false` if the transmitter takes the root.
    """
    if view.loop.pv.square_root and view.loop.pv.range[0] != 0:
        yield view.at("pv", "range", low=view.pv(view.loop.pv.range[0]))


@per_loop
@error("GN807", D280, "max_rate is 0: the output never moves")
def output_cannot_move(view: LoopView) -> Findings:
    """The fastest change of the output is 0.

    Why: the output stays where it is at the start, whatever the PV does.

    Fix: leave `max_rate` out where the change is not limited, or write a rate above 0.
    """
    if view.loop.output.max_rate == 0:
        yield view.at("output", "max_rate")
