"""The three actions: whether they act, and how their times fit together."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.generic.decisions import D299
from pidcfg.schemas.generic import D280
from pidcfg.validate.rule import Findings, error, per_loop, warning
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.generic.context import GenericContext, LoopView

SHARE = Decimal("0.1")
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
        yield view.at("sample_time")


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
            if 0 < SHARE * time < sample:
                yield view.at("sample_time", sample=number_text(sample), name=name, time=number_text(time))
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
        yield view.at(
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
        yield view.at("tuning", "gain")


@per_loop
@error("GN825", D280, "proportional is false, and there is neither an integral nor a derivative: nothing acts")
def no_action_at_all(view: LoopView) -> Findings:
    """All three actions are off.

    Why: the output is the bias, whatever the PV does.

    Fix: write `proportional: true`, or an integral time.
    """
    tuning = view.loop.tuning
    if not (tuning.proportional or tuning.integral_time or tuning.derivative_time):
        yield view.at("tuning", "proportional")


@per_loop
@warning("GN826", D299, "the deadband {value} is as wide as the PV's range, {low} to {high}: there is never an error")
def deadband_covers_range(view: LoopView) -> Findings:
    """The deadband is wider than the PV's range.

    Why: an error inside it counts as zero, and the PV cannot leave it.

    Fix: write a deadband that is small against the range; it is in units of the PV.
    """
    low, high = view.loop.pv.range
    if view.loop.deadband >= high - low:
        yield view.at("deadband", value=view.pv(view.loop.deadband), low=number_text(low), high=view.pv(high))
