"""What a sampled loop does after a step of 1 that is added to its output: the integral of the absolute error."""

from __future__ import annotations

from math import ceil, inf
from typing import TYPE_CHECKING

from pidcfg.tuning.sampled import NO_MODE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.tuning.rules import Gains
    from pidcfg.tuning.sampled import Held, Sampling

MOST_SAMPLES = 200_000
"""A loop that is not at rest by then counts as unstable."""
AT_REST = 1e-6
"""Of the highest error: what is left of it when the rest of the integral is known."""
DIVERGED = 1e3
"""Times the highest error of the beginning: the loop is unstable."""
LOOK = 32
"""Samples between two looks at what the integral will be at least."""


def absolute_error(gains: Gains, plant: Held, sampling: Sampling, most: float = inf) -> float:
    """The integral in PV units and s, infinite for an unstable loop, and where it is at least ``most``.

    The integral of the error itself is Ti/Kp whatever the process is, for the integral term ends at -1. So what is
    still to come is known but for its changes of sign, and Ti/Kp is a lower bound from the start.
    """
    whole, limit = gains.integral_time / (gains.gain * sampling.sample_time), most / sampling.sample_time
    block = end = LOOK * ceil(max(LOOK, 2 * (plant.delay + 1)) / LOOK)
    total = signed = highest = first = now = 0.0
    for n, errors in enumerate(_errors(gains, plant, sampling), 1):
        low, high, part = min(errors), max(errors), sum(errors)
        signed += part
        total += part if low >= 0 else -part if high <= 0 else sum(map(abs, errors))
        least = total + abs(whole - signed)
        if not least < limit:
            return inf
        now = max(now, high, -low)
        if n * LOOK < end:
            continue
        if now > highest:
            highest, first = now, first or now
            if highest > DIVERGED * first:
                return inf
        elif now <= AT_REST * highest:
            return least * sampling.sample_time
        now, end = 0.0, end + block
    return inf


def _errors(gains: Gains, plant: Held, sampling: Sampling) -> Iterator[list[float]]:
    """The PV at the samples after the step, `LOOK` of them at a time."""
    alone = plant.modes[1] == NO_MODE and sampling.pv_share == 1 and not gains.derivative_time
    return _of_one_lag(gains, plant, sampling) if alone else _of_all(gains, plant, sampling)


def _of_one_lag(gains: Gains, plant: Held, sampling: Sampling) -> Iterator[list[float]]:
    """The same as `_of_all` with nothing of what is 0, in a third of the time."""
    a, b, c = plant.modes[0]
    kp, ki = gains.gain, gains.gain * sampling.sample_time / gains.integral_time
    outputs = [0.0] * (plant.delay + 1)
    pv = signed = old = 0.0
    for begin in range(1, MOST_SAMPLES + 1, LOOK):
        errors = []
        for n in range(begin, begin + LOOK):
            errors.append(pv)
            signed += pv
            outputs.append(1.0 - kp * pv - ki * signed)
            fresh = outputs[n]
            pv = a * pv + b * fresh + c * old
            old = fresh
        yield errors


def _of_all(gains: Gains, plant: Held, sampling: Sampling) -> Iterator[list[float]]:
    """Two modes, filters of PV and derivative."""
    (a1, b1, c1), (a2, b2, c2) = plant.modes
    share, lag = sampling.pv_share, sampling.lag(gains.derivative_time)
    kp, ki = gains.gain, gains.gain * sampling.sample_time / gains.integral_time
    kd = gains.gain * gains.derivative_time / sampling.sample_time
    outputs = [0.0] * (plant.delay + 1)
    one = two = pv = slow = integral = old = 0.0
    for begin in range(1, MOST_SAMPLES + 1, LOOK):
        errors = []
        for n in range(begin, begin + LOOK):
            y = one + two
            errors.append(y)
            pv += (y - pv) * share
            integral += ki * pv
            new = slow + lag * (pv - slow)
            outputs.append(1.0 - kp * pv - integral - kd * (new - slow))
            slow = new
            fresh = outputs[n]
            one = a1 * one + b1 * fresh + c1 * old
            two = a2 * two + b2 * fresh + c2 * old
            old = fresh
        yield errors
