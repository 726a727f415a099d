"""Mode requests of a CLICK loop: what is granted, refused or overridden, and the bumpless transfer (D119).

Manual is entered from everywhere, Auto from Manual only, Autotune from Auto only; a PID error forces Manual and refuses
Auto (D118). `REASONS` gives the text of each refusal; kernels leave its number in `State.notice`.
"""

from __future__ import annotations

from pidcfg.sim.controllers.click.state import (
    AUTO,
    FRESH,
    GOAL,
    MANUAL,
    MODES,
    REQUEST,
    TUNE_ERROR,
    TUNING,
    Config,
    State,
)
from pidcfg.sim.controllers.click.tune_results import (
    REFUSED_TUNE_MODE,
    REFUSED_TUNE_RANGE,
    TUNE_ABORTED,
    TUNE_CANCELLED,
    TUNE_IDLE,
    abandon,
    start_tune,
    tunable,
)
from pidcfg.sim.notices import GOAL_ENDS, tell_request

REFUSED_STOP = 1
REFUSED_TUNING = 2
OVERRIDE_STOP = 3
CLEARED = 4
GIVEN_UP = 5
REFUSED_ERROR = 100
OVERRIDE_ERROR = 200
NOTED_ERROR = 300
"""To these the row of the PID error is added."""

REASONS = {
    REFUSED_STOP: "refused: the PLC is in STOP mode",
    REFUSED_TUNING: "refused: Auto is entered from Manual; clearing the autotune request ends an autotune",
    OVERRIDE_STOP: "to Manual: the PLC went to STOP mode",
    CLEARED: "no PID error any more",
    GIVEN_UP: GOAL_ENDS,
}
ABOUT_MODE = {REFUSED_STOP, REFUSED_TUNING, OVERRIDE_STOP}
"""Reasons that concern the mode."""


def stop_tune(s: State) -> None:
    """A mode other than Auto ends an autotune without results."""
    if s.status & TUNING:
        abandon(s)
        s.status |= TUNE_ERROR
        s.requested = 0
        tell_request(s, TUNE_ABORTED)


def to_manual(s: State, reason: int) -> None:
    """Force a loop into Manual, its output as it stands."""
    if s.status & MANUAL == 0:
        stop_tune(s)
        s.status = (s.status & ~MODES) | MANUAL
        s.requested = 0
        tell_request(s, reason)


def to_auto(c: Config, s: State) -> None:
    """Manual to Auto: the bias becomes the output, and in mode 1 the set point the PV."""
    s.bias = s.out
    if c.bumpless == 1:
        s.sp = s.pv
    s.busy |= FRESH
    s.status = (s.status & ~MODES) | AUTO


def no_tune(c: Config, s: State) -> int:
    """Why an autotune cannot start: it needs Auto and PV limits (D123); 0: it can."""
    if s.status & AUTO == 0:
        return REFUSED_TUNE_MODE
    return 0 if tunable(c) else REFUSED_TUNE_RANGE


def request_mode(c: Config, s: State, wanted: int) -> int:
    """Request a mode: it is entered, or the reason of the refusal is returned."""
    s.requested = wanted
    now = s.status & MODES
    if now == wanted:
        return 0
    if wanted == MANUAL:
        stop_tune(s)
        s.status = (s.status & ~MODES) | MANUAL
        return 0
    if wanted == AUTO:
        if now == TUNING:
            return REFUSED_TUNING
        if s.error:
            return REFUSED_ERROR + s.error
        to_auto(c, s)
        return 0
    reason = no_tune(c, s)
    if reason:
        s.status |= TUNE_ERROR
    else:
        start_tune(s)
    return reason


def cancel(s: State) -> None:
    """The autotune request is cleared: back to Auto with the registers as they were."""
    s.request &= ~TUNING
    s.requested = 0
    if s.status & TUNING:
        abandon(s)
        s.status = (s.status & ~MODES) | AUTO
        tell_request(s, TUNE_CANCELLED)
    else:
        tell_request(s, TUNE_IDLE)


def pursue(c: Config, s: State) -> None:
    """Come one step closer to the goal; at the goal write its set point, as an operator would."""
    if s.status & MODES == s.goal:
        if s.goal_writes:
            s.sp = s.goal_sp
        s.busy &= ~GOAL
        s.goal = 0
        return
    reason = request_mode(c, s, s.goal)
    if reason and (s.refused >> s.error) & 1 == 0:
        s.refused |= 1 << s.error
        tell_request(s, reason)


def modes(c: Config, s: State) -> None:
    """Everything that can change the mode at a sample: requests, of which Autotune's comes last, or the goal (D673)."""
    if s.busy & REQUEST:
        s.busy &= ~(REQUEST | GOAL)
        s.goal = 0
        for bit in (s.request & (MANUAL | AUTO), s.request & TUNING):
            reason = request_mode(c, s, bit) if bit else 0
            if reason:
                tell_request(s, reason)
        s.request = 0
    elif s.busy & GOAL:
        pursue(c, s)
