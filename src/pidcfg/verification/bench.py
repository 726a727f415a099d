"""The plant that a loop is tested on, scaled so that the loop is well damped on it and its PV stays in range."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING

from pidcfg.refs import Decision

if TYPE_CHECKING:
    from pidcfg.schemas.generic import Loop

D304 = Decision(
    304,
    "both sides are tested on a plant that the loop's own gains fit",
    "First order with a dead time of one sample, and a gain and a time constant with which the loop crosses over at "
    "the lowest of 4/Ti, 0.4/Td and an eighth of the rate that sampling, dead time and filters allow; its gain is at "
    "most 3 spans of the PV for the whole output. At rest the output is in the middle of its limits.",
    "A loop that is tuned at all is stable on it, and it shows gain, times, action and scales of both sides; with a "
    "larger gain one count of the output would move the PV by many.",
)
STRONGEST, WANTED = 3.0, 2.0
"""Gain of the plant, as a share of the PV's span for the whole output: at most, and where the loop's gain allows it."""
PER_INTEGRAL, PER_DERIVATIVE, PER_DELAY = 4.0, 0.4, 0.25
"""Crossover times integral time, derivative time and the sum of what delays the loop."""
SMALL, LARGE = 0.05, 0.5
"""Steps, as shares of the set point's limits."""
MARGIN = 0.02
"""Share of the PV's range at its ends that the tests leave alone, where alarms that are not wanted are parked."""
FORGOTTEN = 12
"""Time constants after which a filter has forgotten."""
IN_CASCADE = 8
"""Samples of the slowest loop of a cascade after which the inner ones are in Cascade."""
MOST = 800
"""Samples of a stage."""


@dataclass(frozen=True, slots=True)
class Bench:
    """A plant, and how far and how long it is moved; PV units and s."""

    low: float
    high: float
    """Of the PV's range."""
    sample: float
    """Sample time of the slower side."""
    gain: float
    """PV units for the whole output, with the sign of the action."""
    time: float
    dead: float
    middle: float
    """The output at rest, as a share of its range."""
    start: float
    """PV and set point at rest."""
    quiet: tuple[float, float]
    """PVs within the limits of the set point and without an alarm."""
    room: float
    """Width of the limits of the set point."""
    length: float
    """How long a change is watched."""
    settling: float
    """How long the loop is left alone in Auto before something happens."""
    rest: float
    """How long a stage begins in Manual: until filters have forgotten what was before."""
    slowest: float
    """The longest sample time in its cascade."""
    limits: tuple[float, float]
    """Of the output, as shares of its range."""

    @property
    def span(self) -> float:
        """Width of the PV's range."""
        return self.high - self.low

    @property
    def sign(self) -> float:
        """1 where the PV rises with the output, else -1."""
        return 1.0 if self.gain > 0 else -1.0

    def load(self, pv: float, output: float) -> float:
        """The load with which the plant rests at a PV with an output (a share)."""
        return pv - self.gain * output


def bench_of(loop: Loop, other: Loop, slowest: float = 0.0) -> Bench:
    """The test bench of a loop; ``other`` is the same loop on the other side, which may sample more slowly.

    ``slowest``: the longest sample time in its cascade.
    """
    low, high = (float(end) for end in loop.pv.range)
    sample = float(max(loop.sample_time, other.sample_time))
    crossover, gain, time = _dynamics(loop, other, sample)
    limits = output_limits(loop)
    bounds = loop.setpoint.limits or loop.pv.range
    room = float(bounds[1] - bounds[0])
    quiet = quiet_range(loop)
    samples = min(ceil(10 / crossover / sample), MOST)
    return Bench(
        low,
        high,
        sample,
        (high - low) * gain * (1.0 if loop.output_raises_pv else -1.0),
        time,
        sample,
        middle_output(loop, limits),
        (quiet[0] + quiet[1]) / 2,
        quiet,
        room,
        samples * sample,
        min(ceil(5 / crossover / sample), MOST // 2) * sample,
        max(ceil(FORGOTTEN * _filters(loop, other) / sample), 6, ceil(IN_CASCADE * slowest / sample)) * sample,
        max(slowest, sample),
        limits,
    )


def _filters(loop: Loop, other: Loop) -> float:
    """The longest time constant of a filter of either side."""
    return max(float(max(one.pv.filter, one.tuning.derivative_filter)) for one in (loop, other))


def _dynamics(loop: Loop, other: Loop, sample: float) -> tuple[float, float, float]:
    """What `dynamics` says, with the slower filter of both sides."""
    filters = max(float(one.pv.filter) for one in (loop, other))
    return dynamics(loop, sample, 2 * sample + filters, WANTED)


def dynamics(loop: Loop, sample: float, delay: float, wanted: float) -> tuple[float, float, float]:
    """Crossover in rad/s, gain of the plant as a share of the span for the whole output, and its time constant.

    ``delay``: what the loop is late by, in s; ``wanted``: the gain of the plant where the loop's gain allows it.
    """
    tuning = loop.tuning
    span, width = (float(pair[1] - pair[0]) for pair in (loop.pv.range, loop.output.range))
    share = abs(float(tuning.gain)) * span / width or 1.0
    integral, derivative = float(tuning.integral_time), float(tuning.derivative_time)
    crossover = PER_DELAY / delay
    if derivative:
        crossover = min(crossover, PER_DERIVATIVE / derivative)
    if not tuning.proportional and integral:
        crossover = min(crossover, 1 / integral)
        return crossover, min(crossover * integral / share, STRONGEST), sample
    if integral:
        crossover = min(crossover, PER_INTEGRAL / integral)
    time = max(integral, 10 * sample, wanted * share / crossover)
    gain = min(crossover * time / share, STRONGEST)
    return gain * share / time, gain, time


def output_limits(loop: Loop) -> tuple[float, float]:
    """Of the output, as shares of its range."""
    low, high = (float(end) for end in loop.output.range)
    ends = loop.output.limits or loop.output.range
    first, second = ((float(end) - low) / (high - low) for end in ends)
    return max(first, 0.0), min(second, 1.0)


def middle_output(loop: Loop, limits: tuple[float, float]) -> float:
    """The output at rest: without an integral it is the bias, which is all that some PLCs can hold it with."""
    if loop.tuning.integral_time:
        return (limits[0] + limits[1]) / 2
    low, high = (float(end) for end in loop.output.range)
    return min(max((float(loop.output.bias) - low) / (high - low), limits[0]), limits[1])


def quiet_range(loop: Loop) -> tuple[float, float]:
    """The PVs within the limits of the set point and between the inner alarms, where there is room between them."""
    low, high = (float(end) for end in loop.pv.range)
    margin = MARGIN * (high - low)
    least, most = low + margin, high - margin
    if loop.setpoint.limits is not None:
        least, most = max(least, float(loop.setpoint.limits[0])), min(most, float(loop.setpoint.limits[1]))
    points = loop.alarms.pv
    inner = [float(p) for p in (points.low_low, points.low) if p is not None]
    outer = [float(p) for p in (points.high, points.high_high) if p is not None]
    between = max([least, *inner]), min([most, *outer])
    return between if between[0] < between[1] else (least, most)
