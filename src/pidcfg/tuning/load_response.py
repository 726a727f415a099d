"""What a sampled loop does after a step of 1 that is added to its output: the integral of the absolute error."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

if TYPE_CHECKING:
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
    (a1, b1, c1), (a2, b2, c2) = plant.modes
    delay, share, lag = plant.delay, sampling.pv_share, sampling.lag(gains.derivative_time)
    kp, ki = gains.gain, gains.gain * sampling.sample_time / gains.integral_time
    kd = gains.gain * gains.derivative_time / sampling.sample_time
    outputs = [0.0] * (delay + 1)
    one = two = pv = slow = integral = total = signed = highest = first = now = 0.0
    whole, limit = 1 / ki, most / sampling.sample_time
    look, block = LOOK, max(LOOK, 2 * (delay + 1))
    end = block
    for n in range(MOST_SAMPLES):
        y = one + two
        size = y if y >= 0 else -y
        total += size
        signed += y
        now = max(now, size)
        if n >= look:
            look = n + LOOK
            if total + abs(whole - signed) >= limit:
                return inf
            if n >= end:
                if now > highest:
                    highest, first = now, first or now
                    if highest > DIVERGED * first:
                        return inf
                elif now <= AT_REST * highest:
                    return (total + abs(whole - signed)) * sampling.sample_time
                now, end = 0.0, n + block
        pv += (y - pv) * share
        integral += ki * pv
        new = slow + lag * (pv - slow)
        outputs.append(1.0 - kp * pv - integral - kd * (new - slow))
        slow = new
        fresh, old = outputs[n + 1], outputs[n]
        one = a1 * one + b1 * fresh + c1 * old
        two = a2 * two + b2 * fresh + c2 * old
    return inf
