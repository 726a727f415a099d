"""The time-proportioned output: its period and shortest times."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.generic.decisions import D303
from pidcfg.validate.rule import Findings, error, warning
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.generic import Pulse
    from pidcfg.validate.rules.generic.context import GenericContext, LoopView


def pulsed(context: GenericContext) -> Iterator[tuple[LoopView, Pulse]]:
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
    for view, pulse in pulsed(context):
        if pulse.period == 0:
            yield view.at("output", "pulse", "period")


@warning("GN842", D303, "the pulses' period {period} s is shorter than sample_time {sample} s")
def pulse_period_below_sample_time(context: GenericContext) -> Findings:
    """The pulses' period is shorter than the sample time.

    Why: several pulses are alike, since the output is calculated less often: the actuator switches more than it needs
    to.

    Fix: write a longer period, or a shorter `sample_time`.
    """
    for view, pulse in pulsed(context):
        if 0 < pulse.period < view.loop.sample_time:
            yield view.at(
                "output", "pulse", "period", period=number_text(pulse.period), sample=number_text(view.loop.sample_time)
            )


@error("GN843", D303, "min_on {on} s and min_off {off} s together do not fit into the period, {period} s")
def pulse_without_room(context: GenericContext) -> Findings:
    """Shortest pulse and shortest gap are longer together than the period.

    Why: no pulse is then both long enough and followed by a gap that is: the output is on or off for whole periods.

    Fix: write a longer period, or shorter times.
    """
    for view, pulse in pulsed(context):
        if pulse.period and pulse.min_on + pulse.min_off > pulse.period:
            yield view.at(
                "output",
                "pulse",
                "period",
                on=number_text(pulse.min_on),
                off=number_text(pulse.min_off),
                period=number_text(pulse.period),
            )
