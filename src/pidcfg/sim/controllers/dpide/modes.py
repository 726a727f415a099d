"""The four modes of a DPIDE instruction, as PID_RUN, PID_MODE and PID_MAN make them (D275)."""

from __future__ import annotations

from pidcfg.sim.controllers.dpide.autotune import abandon, start_tune
from pidcfg.sim.controllers.dpide.state import (
    AUTO,
    FRESH,
    FROM_MANUAL,
    HALTING,
    IN_DEAD_BAND,
    LIMITED,
    MANUAL,
    MODES,
    OFF,
    REQUEST,
    TUNING,
    Config,
    State,
)


def enter(c: Config, s: State, mode: int) -> None:
    """The mode, and what the next calculation has to know of the one before (kernel)."""
    before = s.status & MODES
    s.status = (s.status & ~MODES) | mode
    if before == OFF:
        s.side = 0.0
        s.crossed = 0
    if mode == TUNING:
        start_tune(c, s)
    elif mode == AUTO:
        s.busy |= FRESH
        if before == MANUAL:
            s.busy |= FROM_MANUAL


def halt(c: Config, s: State) -> None:
    """PID_RUN is FALSE: MV is 0, and nothing else is written (D273, D688; kernel)."""
    if s.status & TUNING:
        abandon(s)
        s.mode = s.mode_before
    s.busy &= ~(REQUEST | HALTING)
    s.status = (s.status & ~(MODES | LIMITED | IN_DEAD_BAND)) | OFF
    s.out = 0.0
    if c.joined:
        s.mout = 0.0


def switch(c: Config, s: State) -> None:
    """The mode that the operands make takes effect (kernel)."""
    s.busy &= ~(REQUEST | FROM_MANUAL)
    if s.status & TUNING:
        abandon(s)
    enter(c, s, s.wanted)
