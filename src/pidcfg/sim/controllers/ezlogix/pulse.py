"""The control output of the EZLogix: pulses whose width is proportional to the CV, between samples as well.

The on-time of a cycle is taken from the CV at its beginning. Pulses shorter than the minimum on time are left out, and
so are gaps shorter than the minimum off time (D176). Cycles begin when the PLC starts (D174) and are
as fine as the base step (D175).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.ezlogix import DUTY_FULL
from pidcfg.sim.controllers.ezlogix.state import UNBOUNDED

if TYPE_CHECKING:
    from pidcfg.sim.controllers.ezlogix.state import Config, State

FULL = float(DUTY_FULL)
"""Counts that are a duty cycle of 100 %."""


def begin_cycle(tick: int, c: Config, s: State) -> None:
    """The next cycle follows the last one without a gap, unless that one is long over."""
    start = s.cycle_end
    if tick - start >= c.cycle:
        start = tick
    s.cycle_start = start
    s.cycle_end = start + c.cycle
    on = s.out * c.cycle / FULL
    if on <= 0.0 or on < c.min_on:
        on = 0.0
    elif c.cycle - on < c.min_off:
        on = UNBOUNDED
    s.on = on


def pulse(tick: int, c: Config, s: State, sig: list[float]) -> None:
    """The output for the base step that begins now: what it is in the middle of that step."""
    middle = tick + (tick - s.seen) / 2.0
    s.seen = tick
    if middle >= s.cycle_end:
        begin_cycle(tick, c, s)
    sig[c.sig_pulse] = 1.0 if s.on > 0.0 and middle - s.cycle_start <= s.on else 0.0
