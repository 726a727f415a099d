"""The control output: pulses, and which of them are left out."""

from __future__ import annotations

import math
from decimal import Decimal
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.maps.ezlogix import DUTY_FULL
from pidcfg.refs import EZLOGIX, Decision
from pidcfg.schemas.ezlogix import CV_FULL
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning
from pidcfg.validate.rules.ezlogix.equation import at_defaults
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.validate.rules.ezlogix.context import EzlogixContext, LoopView

CYCLE = EZLOGIX.at("Cycle Time")
MIN_DUTY = EZLOGIX.at("Min Duty Cycle")
MAX_DUTY = EZLOGIX.at("Max Duty Cycle")

D191 = Decision(
    191,
    "pulses below the minimum on time and gaps below the minimum off time are left out",
    "On-time is CV / 4096 of the cycle. Minimum times that leave no pulse, no gap, or neither in between are errors; "
    "those that undo a CV limit are warnings.",
    "The manual names the two times and does not explain them; the dialog's duty cycles divide by 4096.",
)
D192 = Decision(
    192,
    "how long a cycle should be",
    "A cycle longer than the integral time is a warning; one shorter than the sample rate, or than 10 s, is an info.",
    "Within a cycle the actuator is fully on and fully off, and the process of such a loop follows both. The manual "
    "wants cycles of electromechanical relays as long as possible and gives no figure: at 10 s one switches three "
    "million times a year.",
)
SPARING = 10
YEAR = 365 * 86400
"""Seconds."""
MILLION = 1_000_000


class Pulses(NamedTuple):
    """The pulses of a loop at its CV limits, in s."""

    cycle: Decimal
    min_on: Decimal
    min_off: Decimal
    low: int
    high: int

    def on(self, cv: int) -> Decimal:
        """The on-time for a CV, as it is before short pulses and gaps are left out; exact: 4096 is a power of two."""
        return self.cycle * cv / DUTY_FULL

    def pulsed(self, cv: int) -> bool:
        """Whether there is a pulse at all."""
        return cv > 0 and self.on(cv) >= self.min_on

    def full(self, cv: int) -> bool:
        """Whether the gap is left out."""
        return self.pulsed(cv) and self.cycle - self.on(cv) < self.min_off

    @property
    def never_on(self) -> bool:
        """Whether no CV makes a pulse."""
        return not self.pulsed(self.high)

    @property
    def never_off(self) -> bool:
        """Whether no CV makes a gap."""
        return self.full(self.low)

    @property
    def broken(self) -> bool:
        """Whether there is nothing between off and on: the shortest pulse has no gap behind it."""
        shortest = max(self.low, 1, math.ceil(self.min_on * DUTY_FULL / self.cycle))
        return self.never_on or self.never_off or self.full(shortest)


def pulses(context: EzlogixContext) -> Iterator[tuple[LoopView, Pulses]]:
    """The loops with a control output whose times and limits make sense one by one."""
    for view in context.loops:
        if view.pulses is not None and view.cv_limits is not None:
            yield view, Pulses(*view.pulses, *view.cv_limits)


@per_loop
@error("EZ465", CYCLE, "cycle_time is 0: {tag} gives no pulses")
def cycle_time_of_zero(view: LoopView) -> Findings:
    """The control output is enabled with a cycle time of 0.

    Why: pulses are a part of the cycle, so there are none, or what there is is documented nowhere.

    Fix: give the cycle time, 10 s or more for relays, or leave `pulse` out.
    """
    pulse = view.loop.output.pulse
    if pulse is not None and pulse.cycle_time == 0:
        yield view.at("output", "pulse", "cycle_time", tag=pulse.tag)


@error(
    "EZ466",
    D191,
    "a cycle of {cycle} s has no room for a pulse of min_on {min_on} s and a gap of min_off {min_off} s: the "
    "output is either off or on",
)
def minimum_times_exceed_cycle(context: EzlogixContext) -> Findings:
    """Minimum on time and minimum off time do not fit into the cycle together.

    Why: whenever the pulse is long enough, the gap is too short. The output switches between off and on for whole
    cycles, and the loop swings. Where both just fit, there has to be a CV that makes exactly this pulse.

    Fix: lengthen `cycle_time` to several times their sum, or shorten the minimum times.
    """
    for view, p in pulses(context):
        if p.broken and not p.never_on and not p.never_off:
            yield view.at(
                "output",
                "pulse",
                "cycle_time",
                min_on=decimal_text(p.min_on),
                min_off=decimal_text(p.min_off),
                cycle=decimal_text(p.cycle),
            )


@error("EZ467", D191, "the longest pulse is {longest} s, shorter than min_on {min_on} s: {tag} never switches on")
def output_never_on(context: EzlogixContext) -> Findings:
    """No pulse reaches the minimum on time.

    Why: pulses that are shorter are left out. Even at the CV high limit there is none, so the output stays off.

    Fix: shorten `min_on`, lengthen `cycle_time`, or raise the CV high limit.
    """
    for view, p in pulses(context):
        if p.never_on and view.loop.output.pulse is not None:
            yield view.at(
                "output",
                "pulse",
                "min_on",
                longest=seconds(p.on(p.high)),
                min_on=decimal_text(p.min_on),
                tag=view.loop.output.pulse.tag,
            )


@error("EZ468", D191, "the longest gap is {longest} s, shorter than min_off {min_off} s: {tag} never switches off")
def output_always_on(context: EzlogixContext) -> Findings:
    """No gap reaches the minimum off time.

    Why: gaps that are shorter are left out. Even at the CV low limit there is none, so the output stays on whatever the
    PV is.

    Fix: shorten `min_off`, lengthen `cycle_time`, or lower the CV low limit.
    """
    for view, p in pulses(context):
        if p.never_off and view.loop.output.pulse is not None:
            yield view.at(
                "output",
                "pulse",
                "min_off",
                longest=seconds(p.cycle - p.on(p.low)),
                min_off=decimal_text(p.min_off),
                tag=view.loop.output.pulse.tag,
            )


@warning(
    "EZ469",
    MIN_DUTY,
    "the CV low limit {low} makes pulses of {on} s, shorter than min_on {min_on} s: they are left out",
)
def low_limit_pulse_left_out(context: EzlogixContext) -> Findings:
    """The minimum duty cycle is shorter than the minimum on time.

    Why: the low limit is to keep the output on for a part of each cycle, as the dialog shows. A pulse that is shorter
    than the minimum on time is left out, and the output is off.

    Fix: raise the low limit, shorten `min_on`, or set the low limit to 0 if the output may be off.
    """
    for view, p in pulses(context):
        if p.low > 0 and not p.broken and not p.pulsed(p.low):
            yield view.at(
                "output", "pulse", "min_on", low=view.cv(p.low), on=seconds(p.on(p.low)), min_on=decimal_text(p.min_on)
            )


@warning(
    "EZ470",
    MAX_DUTY,
    "the CV high limit {high} makes gaps of {off} s, shorter than min_off {min_off} s: the output stays on",
)
def high_limit_gap_left_out(context: EzlogixContext) -> Findings:
    """The gap of the maximum duty cycle is shorter than the minimum off time.

    Why: the high limit is to keep the output off for a part of each cycle, as the dialog shows. A gap that is shorter
    than the minimum off time is left out, and the output is on all the time: more than the limit allows.

    Fix: lower the high limit, or shorten `min_off`.
    """
    for view, p in pulses(context):
        if p.high < CV_FULL and not p.broken and p.full(p.high):
            yield view.at(
                "output",
                "pulse",
                "min_off",
                high=view.cv(p.high),
                off=seconds(p.cycle - p.on(p.high)),
                min_off=decimal_text(p.min_off),
            )


@info("EZ471", D192, "the cycle is {cycle} s, and the CV changes every {sample} s: equal pulses in between")
def cycle_below_sample_rate(context: EzlogixContext) -> Findings:
    """The cycle time is shorter than the sample rate.

    Why: the CV is the same until the next calculation, so shorter cycles control no better. A relay switches the more
    often for nothing.

    Fix: make the cycle at least as long as the sample rate.
    """
    for view, p in pulses(context):
        sample = view.held("sample_rate")
        if sample is not None and p.cycle < sample:
            yield view.at("output", "pulse", "cycle_time", cycle=decimal_text(p.cycle), sample=decimal_text(sample))


@warning(
    "EZ472",
    D192,
    "the cycle of {cycle} s is longer than the integral_time of {integral} s: the PV follows single pulses",
)
def cycle_beyond_integral_time(context: EzlogixContext) -> Findings:
    """The cycle time is longer than the integral time.

    Why: within one cycle the actuator is fully on and fully off. A process that is fast enough for this integral time
    swings with the pulses, and the loop answers the swing.

    Fix: shorten the cycle to a small part of the integral time. A relay that is to be spared wants a slower loop.
    """
    for view, p in pulses(context):
        integral, sample = view.held("integral_time"), view.held("sample_rate")
        slow = integral and sample is not None and sample <= integral and not at_defaults(view)
        if slow and integral and p.cycle > integral:
            yield view.at("output", "pulse", "cycle_time", cycle=decimal_text(p.cycle), integral=decimal_text(integral))


@checklist("EZ473", D192, "a cycle of {cycle} s is up to {times} million pulses a year: for solid-state outputs only")
def cycle_wears_relays(context: EzlogixContext) -> Findings:
    """The cycle time is short for an electromechanical relay or contactor.

    Why: each cycle switches once on and once off. The manual suggests cycles as long as possible to extend the life of
    relays; a contactor is worn after some million operations.

    Fix: see that the output is solid-state, or the valve made for it; otherwise write 10 s or more.
    """
    for view, p in pulses(context):
        if p.cycle < SPARING:
            times = YEAR / p.cycle / MILLION
            yield view.at("output", "pulse", "cycle_time", cycle=decimal_text(p.cycle), times=f"{float(times):.3g}")


def seconds(value: Decimal) -> str:
    """A time as people write it: three digits after the point are enough."""
    return number_text(value.quantize(Decimal("0.001")).normalize())
