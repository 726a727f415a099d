"""How well a loop did, worked out on the way: memory does not grow with the length of a run.

Integrals run over the time in Auto or Cascade; overshoot, settling time and rise time count from the last event that
changed the set point while the loop was there, and are None when there was none (or when the loop never got there).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.sim.meters import NEVER, Meter, time_in_control, watch_end
from pidcfg.sim.swings import oscillation, watch_swings

if TYPE_CHECKING:
    from collections.abc import Sequence

DEFAULT_BAND = 0.05
"""Share of the set-point step within which a loop counts as settled, unless an expectation says otherwise."""


@dataclass(slots=True)
class Band:
    """When a loop was last further from its new set point than ``share`` of the step."""

    loop: int
    share: float
    outside: int = -1


@dataclass(slots=True)
class Gauge:
    """The smallest and largest value of a signal from one base step up to another."""

    slot: int
    low: float = 1e300
    high: float = -1e300
    first: int = 0
    last: int = NEVER


def measure_loop(k: int, m: Meter, sig: Sequence[float]) -> None:
    """One loop's signals at base step ``k``, which stand for the time up to the next (kernel)."""
    pv, sp, out = sig[m.pv], sig[m.sp], sig[m.out]
    if m.control == 1:
        if sp != pv:
            e = abs(sp - pv)
            m.iae += e
            m.ise += e * e
            m.itae += e * k
        if m.event >= 0:
            if pv > m.peak_high:
                m.peak_high = pv
            elif pv < m.peak_low:
                m.peak_low = pv
            if m.rise_to < 0 or k <= m.locked:
                follow_step(k, m, pv, sp)
    if out != m.last_out:
        m.variation += abs(out - m.last_out)
        m.last_out = out
        if out > m.out_high:
            m.out_high = out
        elif out < m.out_low:
            m.out_low = out
    if pv > m.pv_high:
        m.pv_high = pv
    elif pv < m.pv_low:
        m.pv_low = pv
    if sp != m.last_sp:
        m.last_sp = sp
        if sp > m.sp_high:
            m.sp_high = sp
        elif sp < m.sp_low:
            m.sp_low = sp
    if k >= m.watched:
        watch_end(k, m, pv, sp)
    if k >= m.swung:
        watch_swings(k, m, pv)


def follow_step(k: int, m: Meter, pv: float, sp: float) -> None:
    """The answer to the last set-point event: what it is, and when the PV passed 10 % and 90 % of it (kernel)."""
    if (m.stepped == 0 or k <= m.locked) and sp != m.before:
        m.stepped = 1
        m.after = sp
    if m.stepped == 1 and m.rise_to < 0:
        share = (pv - m.before) / (m.after - m.before)
        if share >= 0.1 and m.rise_from < 0:
            m.rise_from = k
        if share >= 0.9:
            m.rise_to = k


def watch_bands(k: int, bands: Sequence[Band], meters: Sequence[Meter], sig: Sequence[float]) -> None:
    """Notes for every band whether the loop is outside now (kernel)."""
    for i in range(len(bands)):
        b = bands[i]
        m = meters[b.loop]
        if m.event >= 0 and m.control == 1:
            after = m.after
            if m.stepped == 0 or abs(sig[m.pv] - after) > b.share * abs(after - m.before):
                b.outside = k


def read_gauges(k: int, gauges: Sequence[Gauge], sig: Sequence[float]) -> None:
    """Smallest and largest values (kernel)."""
    for i in range(len(gauges)):
        g = gauges[i]
        value = sig[g.slot]
        if (value < g.low or value > g.high) and g.first <= k <= g.last:
            if value < g.low:
                g.low = value
            if value > g.high:
                g.high = value


def begin(meter: Meter, sig: Sequence[float]) -> None:
    """What only makes sense from time 0 on starts with the signals as they stand there."""
    meter.pv_low = meter.pv_high = sig[meter.pv]
    meter.sp_low = meter.sp_high = meter.last_sp = sig[meter.sp]
    meter.out_low = meter.out_high = meter.last_out = sig[meter.out]
    meter.variation = 0.0


def begin_step(meter: Meter, k: int, before: float, period: int, sig: Sequence[float]) -> None:
    """A set-point event at base step ``k``, ``before`` it and a sample ``period`` (in base steps) after it."""
    meter.event, meter.before, meter.stepped, meter.locked = k, before, 0, k + period
    meter.peak_low = meter.peak_high = sig[meter.pv]
    meter.rise_from = meter.rise_to = -1


def overshoot(m: Meter) -> float | None:
    """How far the PV went past the new set point, in % of the step."""
    if not m.stepped:
        return None
    size = m.after - m.before
    past = m.peak_high - m.after if size > 0 else m.after - m.peak_low
    return max(0.0, past / abs(size) * 100)


def rise_time(m: Meter, dt: float) -> float | None:
    """The time from 10 % to 90 % of the step, in s."""
    return None if m.rise_to < 0 else (m.rise_to - m.rise_from) * dt


def settling_time(m: Meter, band: Band, last: int, dt: float) -> float | None:
    """The time from the event until the PV stayed inside the band, in s.

    None when it was outside when the run ended, or when the loop left Auto and Cascade.
    """
    end = last if m.control else m.control_since - 1
    if not m.stepped or band.outside == end:
        return None
    return max(0, band.outside + 1 - m.event) * dt


def loop_metrics(m: Meter, band: Band, last: int, dt: float, sig: Sequence[float]) -> dict[str, float | None]:
    """All metrics of a loop by name, in the units of its PV and output; None: there was nothing to measure."""
    controlled = time_in_control(m, last) > 0
    swings = oscillation(m, last)
    return {
        "overshoot": overshoot(m),
        "settling_time": settling_time(m, band, last, dt),
        "rise_time": rise_time(m, dt),
        "iae": m.iae * dt if controlled else None,
        "ise": m.ise * dt if controlled else None,
        "itae": m.itae * dt * dt if controlled else None,
        "total_variation": m.variation,
        "final_error": sig[m.sp] - sig[m.pv] if m.control else None,
        "oscillation_period": None if swings is None else swings[0] * dt,
        "oscillation_amplitude": None if swings is None else swings[1],
    }


METRICS = (
    "overshoot",
    "settling_time",
    "rise_time",
    "iae",
    "ise",
    "itae",
    "total_variation",
    "final_error",
    "oscillation_period",
    "oscillation_amplitude",
)
"""In the order of the report."""
OF_A_STEP = ("overshoot", "settling_time", "rise_time")
"""Metrics of a step of the set point; the others need none."""
OF_SWINGS = ("oscillation_period", "oscillation_amplitude")
"""None when the PV does not swing."""
