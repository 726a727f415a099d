"""Alarms and the pulse output of a neutral loop (both: D303)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.generic.state import (
    DEVIATION,
    DEVIATION_2,
    HIGH,
    HIGH_HIGH,
    LOW,
    LOW_LOW,
    RATE,
    Config,
    State,
)
from pidcfg.sim.terms import latched

if TYPE_CHECKING:
    from collections.abc import MutableSequence

FOREVER = float("inf")


def watch(c: Config, s: State) -> None:
    """Renew the alarms (kernel)."""
    b = latched(s.status, LOW_LOW, c.low_low_at - s.pv, c.hysteresis)
    b = latched(b, LOW, c.low_at - s.pv, c.hysteresis)
    b = latched(b, HIGH, s.pv - c.high_at, c.hysteresis)
    b = latched(b, HIGH_HIGH, s.pv - c.high_high_at, c.hysteresis)
    away = abs(s.sp - s.pv)
    b = latched(b, DEVIATION, away - c.deviation_at, c.hysteresis)
    b = latched(b, DEVIATION_2, away - c.deviation_2_at, c.hysteresis)
    s.status = latched(b, RATE, abs(s.pv - s.pv1) - c.rate_at, 0.0)


def begin_cycle(tick: int, c: Config, s: State) -> None:
    """The next period follows the last one without a gap, unless that one is long over (kernel)."""
    start = s.cycle_end
    if tick - start >= c.cycle:
        start = tick
    s.cycle_start = start
    s.cycle_end = start + int(c.cycle)
    on = (s.out - c.out_base) / c.out_span * c.cycle
    if on <= 0.0 or on < c.min_on:
        on = 0.0
    elif c.cycle - on < c.min_off or on >= c.cycle:
        on = FOREVER
    s.on = on


def pulse(tick: int, c: Config, s: State, sig: MutableSequence[float]) -> None:
    """The output for the base step that begins now: what it is in the middle of that step (kernel)."""
    half = (tick - s.seen) / 2.0
    s.seen = tick
    if tick >= s.cycle_end:
        begin_cycle(tick, c, s)
    passed = tick - s.cycle_start + half
    sig[c.sig_pulse] = 1.0 if s.on > 0.0 and passed <= s.on else 0.0
