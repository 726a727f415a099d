"""What no first-order process does (the wrong way first, overshoot, swings), and what none does (spikes, a stop)."""

from __future__ import annotations

from itertools import pairwise
from math import sqrt
from statistics import fmean
from typing import TYPE_CHECKING

from pidcfg.tuning.samples import RecordError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.tuning.samples import Record

WINDOWS = 60
"""Means that the answer is looked at by, so that noise makes no shape."""
WRONG_WAY, OVERSHOOT = 0.04, 0.06
"""Parts of the answer from which on they are told."""
ABOVE_NOISE = 5.0
"""How many standard deviations of a mean a shape must have."""
BACK = 0.3
"""Part of the overshoot by which the PV must come back."""

SPIKE = 12.0
"""How many standard deviations of noise a sample must lie beyond both of its neighbours."""
SPIKE_SHARE = 0.05
"""The same as a part of the PV's range."""
STANDS, STOPS = 10, 0.08
"""Samples for which a PV at its end must stand still; how fast it came there, in the fastest way it went."""
WINDOW = 40
"""The part of the answer over which its speed is measured."""


def refuse_spikes(record: Record, noise: float) -> None:
    """Refuses single samples that stand alone, far from both neighbours, which agree: no process is that fast."""
    pv = record.pv
    far = max(SPIKE * noise, SPIKE_SHARE * (max(pv) - min(pv)))
    spikes = [
        i
        for i in range(1, len(pv) - 1)
        if min(abs(pv[i] - pv[i - 1]), abs(pv[i] - pv[i + 1])) > far
        and abs(pv[i + 1] - pv[i - 1]) < far / 2
        and (pv[i] - pv[i - 1]) * (pv[i] - pv[i + 1]) > 0
    ]
    if spikes:
        first, more = spikes[0], f", and {len(spikes) - 1} more" if len(spikes) > 1 else ""
        raise RecordError(
            f"the PV jumps to {pv[first]:.4g} for one sample at {record.time[first]:g} s and back (spike{more})",
            "remove the row" + ("s" if more else ""),
            first,
        )


def refuse_stop(record: Record, k: int, quantum: float) -> None:
    """Refuses an answer that stops at once and stands still: the end of a sensor's range."""
    pv = record.pv[k:]
    stands = next((i for i in range(len(pv) - 1, -1, -1) if pv[i] != pv[-1]), -1) + 1
    width = max(2, len(pv) // WINDOW)
    if len(pv) - stands < STANDS or stands <= width:
        return
    ways = [abs(b - a) for a, b in zip(pv[: stands + 1], pv[width : stands + 1], strict=False)]
    if ways[-1] > max(STOPS * max(ways), 4 * quantum):
        raise RecordError(
            f"the PV stops at once at {pv[-1]:.6g} and stands still, as at the end of a sensor's range",
            "take a smaller step, or widen the range of the measurement",
            k + stands,
        )


def refuse_shape(record: Record, k: int, drift: float, noise: float) -> None:
    """Refuses the answer to one step, from sample ``k`` on, that no first-order process gives."""
    base = fmean(record.pv[:k]) if k else record.pv[0]
    begin = fmean(record.time[:k]) if k else record.time[0]
    moved = [y - base - drift * (t - begin) for t, y in zip(record.time[k:], record.pv[k:], strict=True)]
    width = max(1, len(moved) // WINDOWS)
    means = [fmean(moved[i : i + width]) for i in range(0, len(moved) - width + 1, width)]
    times = [record.time[k + i] for i in range(0, len(moved) - width + 1, width)]
    tail = max(1, len(means) // 5)
    answer = fmean(means[-tail:])
    doubt = ABOVE_NOISE * noise / sqrt(width)
    sign = 1 if answer > 0 else -1
    means = [sign * y for y in means]
    _refuse_wrong_way(means, times, abs(answer), doubt, record.time[k])
    _refuse_overshoot(means, times, abs(answer), doubt)


def _refuse_wrong_way(means: Sequence[float], times: Sequence[float], answer: float, doubt: float, at: float) -> None:
    lowest = min(means)
    if lowest < -max(WRONG_WAY * answer, doubt):
        raise RecordError(
            f"the PV first goes the wrong way, by {-lowest:.4g} of {answer:.4g}, until "
            f"{times[means.index(lowest)] - at:.4g} s after the step (inverse response)",
            "no first-order process does that; give --gain, --time-constant and --dead-time, with the time of the "
            "wrong way as dead time",
        )


def _refuse_overshoot(means: Sequence[float], times: Sequence[float], answer: float, doubt: float) -> None:
    highest = max(means)
    top = means.index(highest)
    later = means[top:]
    over = highest - answer
    if over <= max(OVERSHOOT * answer, doubt) or highest - min(later) < BACK * over:
        return
    crossings = [t for t, (a, b) in zip(times, pairwise(y - answer for y in means), strict=False) if a * b < 0]
    if len(crossings) > 2:
        period = 2 * (crossings[-1] - crossings[0]) / (len(crossings) - 1)
        raise RecordError(
            f"the PV swings about its end with a period of about {period:.3g} s, by {over:.4g} of {answer:.4g} "
            "(oscillation)",
            "put the loop into Manual, so that no controller answers; a process that swings by itself has no "
            "first-order model",
        )
    raise RecordError(
        f"the PV goes beyond its end by {over:.4g} of {answer:.4g} and comes back (overshoot)",
        "put the loop into Manual, keep disturbances away, record longer before the step if the PV drifts, and until "
        "it is at rest",
    )
