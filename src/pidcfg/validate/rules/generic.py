"""What the rules of the neutral form look at, and the rules: scales, the three actions, alarms, pulses, cascades."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from decimal import Decimal
from functools import cached_property
from itertools import pairwise

from pidcfg.encoders.generic.image import D299, D302, D303
from pidcfg.encoders.parameters import ProgramEncoding
from pidcfg.schemas.base import Model
from pidcfg.schemas.generic import D280, GenericFile, Loop, Pulse
from pidcfg.text.diagnostics import Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import closest_name, match_ignoring_case
from pidcfg.validate.rule import Findings, error, info, per_loop, warning
from pidcfg.validate.rules import collect_rules
from pidcfg.validate.shared_checks import (
    PV_POINTS,
    Context,
    Pair,
    View,
    find_circles,
    number_text,
    number_with_unit,
    outside_limits_findings,
    report_at_both,
)


@frozen
class LoopView(View[Loop]):
    """A loop and its place in the file."""

    @property
    def limits(self) -> Pair:
        """Lowest and highest output; the ends of the range where they are not given."""
        return self.loop.output.limits or self.loop.output.range

    def pv_text(self, value: Decimal) -> str:
        """A number of the PV with its unit."""
        return number_with_unit(value, self.loop.pv.unit)

    def out_text(self, value: Decimal) -> str:
        """A number of the output with its unit."""
        return number_with_unit(value, self.loop.output.unit)


@frozen
class GenericContext(Context[GenericFile, ProgramEncoding]):
    """A configuration with its encoding, and its loops one by one."""

    @cached_property
    def loops(self) -> tuple[LoopView, ...]:
        """The loops in the order of the file."""
        return tuple(LoopView(i, loop) for i, loop in enumerate(self.config.loops))

    @cached_property
    def loops_by_name(self) -> dict[str, LoopView]:
        """The loops by their names; of two with the same one the first."""
        return {view.name: view for view in reversed(self.loops)}


# --- Values against the scales and limits that they belong to ---------------------------------------------------------


@per_loop
@warning("GN801", D280, "the output limit {value} is outside the output's range, {low} to {high}")
def output_limits_outside_range(view: LoopView) -> Findings:
    """A limit of the output lies outside the output's range.

    Why: the range is what the actuator can do. The output stays at the end of it while the controller believes that it
    still moves: the integral winds up.

    Fix: write limits inside `output.range`, or correct the range.
    """
    for i, end in enumerate(view.loop.output.limits or ()):
        yield from outside_limits_findings(
            view, "output", "limits", i, value=end, limits=view.loop.output.range, quote=view.out_text
        )


@per_loop
@warning("GN802", D280, "the set-point limit {value} is outside the PV's range, {low} to {high}")
def set_point_limits_outside_range(view: LoopView) -> Findings:
    """A limit of the set point lies outside the PV's range.

    Why: the PV is not measured there, so such a set point is never reached.

    Fix: write limits inside `pv.range`, or correct the range.
    """
    for i, end in enumerate(view.loop.setpoint.limits or ()):
        yield from outside_limits_findings(
            view, "setpoint", "limits", i, value=end, limits=view.loop.pv.range, quote=view.pv_text
        )


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
    yield from outside_limits_findings(
        view, "setpoint", "value", value=value, limits=ends, quote=view.pv_text, what=what
    )


@per_loop
@warning("GN804", D280, "the bias {value} is outside the limits of the output, {low} to {high}")
def bias_outside_limits(view: LoopView) -> Findings:
    """The bias lies outside the limits of the output.

    Why: the bias is the output without an error. Beyond the limits the output stays at one of them until the other
    actions have made up for the rest.

    Fix: write a bias between the limits; it is in units of the output.
    """
    bias = view.loop.output.bias or None
    yield from outside_limits_findings(view, "output", "bias", value=bias, limits=view.limits, quote=view.out_text)


@per_loop
@warning("GN805", D280, "the manual output {value} is outside the limits of the output, {low} to {high}")
def manual_outside_limits(view: LoopView) -> Findings:
    """The output for manual lies outside the limits of the output.

    Why: the limit is taken in its place.

    Fix: write a value between the limits; it is in units of the output.
    """
    manual = view.loop.output.manual
    yield from outside_limits_findings(view, "output", "manual", value=manual, limits=view.limits, quote=view.out_text)


@per_loop
@warning("GN806", D299, "the PV is a root, but its range begins at {low} and not at 0")
def square_root_off_zero(view: LoopView) -> Findings:
    """The PV is the root of a differential pressure, and its range does not begin at 0.

    Why: a flow is proportional to the root of the pressure only if both are 0 together. With another beginning PLCs
    differ in what they take the root of.

    Fix: write a range from 0, or `square_root: false` if the transmitter takes the root.
    """
    if view.loop.pv.square_root and view.loop.pv.range[0] != 0:
        yield view.report("pv", "range", low=view.pv_text(view.loop.pv.range[0]))


@per_loop
@error("GN807", D280, "max_rate is 0: the output never moves")
def output_cannot_move(view: LoopView) -> Findings:
    """The fastest change of the output is 0.

    Why: the output stays where it is at the start, whatever the PV does.

    Fix: leave `max_rate` out where the change is not limited, or write a rate above 0.
    """
    if view.loop.output.max_rate == 0:
        yield view.report("output", "max_rate")


# --- The three actions: whether they act, and how their times fit together --------------------------------------------

MAX_SAMPLE_SHARE = Decimal("0.1")
"""A sample time up to this share of a time does it no harm."""


@per_loop
@error(
    "GN821", D280, "sample_time is 0: the loop would be calculated all the time, and none of its times has a meaning"
)
def no_sample_time(view: LoopView) -> Findings:
    """The time between two calculations is 0.

    Why: integral and derivative are calculated from sample to sample.

    Fix: write a time above 0, for example a tenth of the shortest time of the loop.
    """
    if view.loop.sample_time == 0:
        yield view.report("sample_time")


@warning("GN822", D299, "sample_time {sample} s is longer than a tenth of {name}, {time} s")
def sample_time_too_long(context: GenericContext) -> Findings:
    """The loop is calculated less often than its times want.

    Why: integral and derivative are sums and differences of samples; with few of them the loop behaves other than its
    times say, and less stable.

    Fix: write a shorter `sample_time`, at most a tenth of the shortest of both times.
    """
    for view in context.loops:
        for name in ("integral_time", "derivative_time"):
            time, sample = getattr(view.loop.tuning, name), view.loop.sample_time
            if 0 < MAX_SAMPLE_SHARE * time < sample:
                yield view.report("sample_time", sample=number_text(sample), name=name, time=number_text(time))
                break


@per_loop
@warning("GN823", D280, "derivative_time {derivative} s is longer than integral_time {integral} s")
def derivative_longer_than_integral(view: LoopView) -> Findings:
    """The derivative time is longer than the integral time.

    Why: tuning rules make it about a quarter; mostly the two were mixed up, or one is in minutes.

    Fix: check both times and their units.
    """
    tuning = view.loop.tuning
    if 0 < tuning.integral_time < tuning.derivative_time:
        yield view.report(
            "tuning",
            "derivative_time",
            derivative=number_text(tuning.derivative_time),
            integral=number_text(tuning.integral_time),
        )


@per_loop
@error("GN824", D280, "the gain is 0, which switches off all three actions")
def gain_of_zero(view: LoopView) -> Findings:
    """The gain is 0.

    Why: it stands before the integral and the derivative too. The output is the bias, whatever the PV does.

    Fix: write a gain above 0. Without a proportional action write `proportional: false` and keep the gain.
    """
    if view.loop.tuning.gain == 0:
        yield view.report("tuning", "gain")


@per_loop
@error("GN825", D280, "proportional is false, and there is neither an integral nor a derivative: nothing acts")
def no_action_at_all(view: LoopView) -> Findings:
    """All three actions are off.

    Why: the output is the bias, whatever the PV does.

    Fix: write `proportional: true`, or an integral time.
    """
    tuning = view.loop.tuning
    if not (tuning.proportional or tuning.integral_time or tuning.derivative_time):
        yield view.report("tuning", "proportional")


@per_loop
@warning("GN826", D299, "the deadband {value} is as wide as the PV's range, {low} to {high}: there is never an error")
def deadband_covers_range(view: LoopView) -> Findings:
    """The deadband is wider than the PV's range.

    Why: an error inside it counts as zero, and the PV cannot leave it.

    Fix: write a deadband that is small against the range; it is in units of the PV.
    """
    low, high = view.loop.pv.range
    if view.loop.deadband >= high - low:
        yield view.report(
            "deadband", value=view.pv_text(view.loop.deadband), low=number_text(low), high=view.pv_text(high)
        )


@per_loop
@info("GN827", D299, "no integral and a bias of {bias}: an error stays as long as the process needs another output")
def proportional_without_bias(view: LoopView) -> Findings:
    """A loop without an integral has a bias of 0.

    Why: the bias is the output at zero error. A heater that has to give 30 % to hold the temperature does so only with
    the error that makes 30 %. Where errors may be large that is what is wanted.

    Fix: give the output that holds the set point as `output.bias`, or an integral time.
    """
    tuning, bias = view.loop.tuning, view.loop.output.bias
    if not tuning.integral_time and tuning.gain and tuning.proportional and not bias:
        yield view.report("tuning", "integral_time", bias=view.out_text(bias))


# --- Alarm points: their order, and whether they can come -------------------------------------------------------------

DEVIATIONS = ("high", "high_high")


def given_points(points: Model, names: tuple[str, ...]) -> list[tuple[str, Decimal]]:
    """The alarm points that the file gives, in order."""
    return [(name, getattr(points, name)) for name in names if getattr(points, name) is not None]


def severity_of(lower: Decimal, upper: Decimal) -> Severity:
    """Equal points are one alarm twice; crossed ones make no sense."""
    return Severity.WARNING if lower == upper else Severity.ERROR


@per_loop
@error("GN811", D280, "{upper} {above} is not above {lower} {below}")
def alarm_points_out_of_order(view: LoopView) -> Findings:
    """The alarm points of the PV do not ascend from low_low to high_high.

    Why: crossed points are on where nothing is wrong, or the severe alarm comes before the mild one. Equal points make
    two alarms of one.

    Fix: write low_low < low < high < high_high; leave out what is not wanted.
    """
    for (lower, low), (upper, high) in pairwise(given_points(view.loop.alarms.pv, PV_POINTS)):
        if high <= low:
            yield view.report(
                "alarms",
                "pv",
                upper,
                severity=severity_of(high, low),
                upper=upper,
                above=view.pv_text(high),
                lower=lower,
                below=view.pv_text(low),
            )


@per_loop
@error("GN812", D280, "high_high {above} is not above high {below}")
def deviation_points_out_of_order(view: LoopView) -> Findings:
    """The second alarm point of the deviation is not above the first one.

    Why: the severe alarm comes before the mild one, or together with it.

    Fix: write high < high_high, or leave one out.
    """
    for (_, low), (_, high) in pairwise(given_points(view.loop.alarms.deviation, DEVIATIONS)):
        if high <= low:
            severity = severity_of(high, low)
            yield view.report(
                "alarms", "deviation", "high_high", severity=severity, above=view.pv_text(high), below=view.pv_text(low)
            )


@per_loop
@warning("GN813", D280, "the alarm point {name} {value} is outside the PV's range, {low} to {high}")
def alarm_point_outside_range(view: LoopView) -> Findings:
    """An alarm point of the PV lies outside the PV's range.

    Why: the PV is not measured there: the alarm never comes, or is always on.

    Fix: write a point inside `pv.range`, or leave it out.
    """
    for name, value in given_points(view.loop.alarms.pv, PV_POINTS):
        place = ("alarms", "pv", name)
        yield from outside_limits_findings(
            view, *place, value=value, limits=view.loop.pv.range, quote=view.pv_text, name=name
        )


# --- The time-proportioned output: its period and shortest times ------------------------------------------------------


def loops_with_pulse_output(context: GenericContext) -> Iterator[tuple[LoopView, Pulse]]:
    """The loops with a pulse output."""
    for view in context.loops:
        if view.loop.output.pulse is not None:
            yield view, view.loop.output.pulse


@error("GN841", D303, "the period of the pulses is 0")
def no_pulse_period(context: GenericContext) -> Findings:
    """The period of the pulses is 0.

    Why: there is no time that the output could be a share of.

    Fix: write a period above 0, or leave `pulse` out.
    """
    for view, pulse in loops_with_pulse_output(context):
        if pulse.period == 0:
            yield view.report("output", "pulse", "period")


@warning("GN842", D303, "the pulses' period {period} s is shorter than sample_time {sample} s")
def pulse_period_below_sample_time(context: GenericContext) -> Findings:
    """The pulses' period is shorter than the sample time.

    Why: several pulses are alike, since the output is calculated less often: the actuator switches more than it needs
    to.

    Fix: write a longer period, or a shorter `sample_time`.
    """
    for view, pulse in loops_with_pulse_output(context):
        if 0 < pulse.period < view.loop.sample_time:
            yield view.report(
                "output", "pulse", "period", period=number_text(pulse.period), sample=number_text(view.loop.sample_time)
            )


@error("GN843", D303, "min_on {on} s and min_off {off} s together do not fit into the period, {period} s")
def pulse_without_room(context: GenericContext) -> Findings:
    """Shortest pulse and shortest gap are longer together than the period.

    Why: no pulse is then both long enough and followed by a gap that is: the output is on or off for whole periods.

    Fix: write a longer period, or shorter times.
    """
    for view, pulse in loops_with_pulse_output(context):
        if pulse.period > 0 and pulse.min_on + pulse.min_off > pulse.period:
            yield view.report(
                "output",
                "pulse",
                "period",
                on=number_text(pulse.min_on),
                off=number_text(pulse.min_off),
                period=number_text(pulse.period),
            )


# --- Cascades: where a set point comes from ---------------------------------------------------------------------------


def master_of(context: GenericContext, view: LoopView) -> LoopView | None:
    """The loop whose output is this one's set point."""
    return context.loops_by_name.get(view.loop.setpoint.source or "")


@error("GN831", D302, "there is no loop {source}{cure}")
def unknown_cascade_source(context: GenericContext) -> Findings:
    """The source of the set point is no loop of the file.

    Why: the set point would come from nowhere.

    Fix: write the name of a loop of this file.
    """
    for view in context.loops:
        source = view.loop.setpoint.source
        if source is not None and source not in context.loops_by_name:
            near = closest_name(source, context.loops_by_name)
            cure = f"; did you mean {near}?" if near else ""
            yield view.report("setpoint", "source", source=source, cure=cure).correct_to(
                match_ignoring_case(source, context.loops_by_name)
            )


@per_loop
@error("GN832", D302, "the set point of {name} is its own output")
def cascade_to_itself(view: LoopView) -> Findings:
    """A loop is the source of its own set point.

    Why: the output would drive the set point, which drives the output.

    Fix: write the name of the master.
    """
    if view.loop.setpoint.source == view.name:
        yield view.report("setpoint", "source", name=view.name)


@error("GN833", D302, "the cascade goes in a ring: {names}")
def cascade_ring(context: GenericContext) -> Findings:
    """Loops are each other's masters.

    Why: a cascade has an outermost loop with a set point of its own.

    Fix: take `source` from the outermost loop.
    """
    masters = [master_of(context, view) for view in context.loops]
    for ring in find_circles([None if master is None else master.index for master in masters]):
        if len(ring) > 1:
            names = [context.loops[i].name for i in ring]
            way = " - ".join((*names, names[0]))
            for i in ring:
                view = context.loops[i]
                others = (name for name in names if name != view.name)
                yield view.report("setpoint", "source", names=way).with_other_loops(*others)


@per_loop
@error("GN834", D302, "the mode is cascade, but setpoint.source is not given")
def cascade_without_source(view: LoopView) -> Findings:
    """A loop is meant to run in cascade and has no master.

    Why: there is nothing that its set point could follow.

    Fix: write `setpoint: {source: …}` with the master's name, or `mode: auto`.
    """
    if view.loop.mode == "cascade" and view.loop.setpoint.source is None:
        yield view.report("mode")


@warning(
    "GN835", D302, "the output of {master} has the range {low} to {high}, the PV of {slave} {own_low} to {own_high}"
)
def cascade_scales_differ(context: GenericContext) -> Findings:
    """The master's output and the slave's PV have different ranges.

    Why: the master's output is the slave's set point as it is, in units of the slave's PV. A master from 0 to 100 %
    asks a flow from 0 to 40 m3/h for what it never reaches, and its gain acts on another scale.

    Fix: give the master `output.range` the slave's `pv.range`, and its gain in those units; limit it by
    `output.limits`.
    """
    for view in context.loops:
        master = master_of(context, view)
        if master is None or master is view:
            continue
        output, pv = master.loop.output.range, view.loop.pv.range
        if output != pv:
            values = {
                "master": master.name,
                "slave": view.name,
                "low": output[0],
                "high": master.out_text(output[1]),
                "own_low": pv[0],
                "own_high": view.pv_text(pv[1]),
            }
            at_slave, at_master = view.report("setpoint", "source"), master.report("output", "range")
            yield from report_at_both(view, at_slave, master, at_master, **values)


RULES = collect_rules(sys.modules[__name__])
