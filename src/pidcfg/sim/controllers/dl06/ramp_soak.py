"""The ramp/soak generator of a DL06 loop: it writes the set point word, sample by sample.

A segment begins and ends at a sample. A ramp moves the set point by its slope each second until its end value stands, a
soak then lasts its minutes. A slope of 0 and the end of the table complete the profile. The set point with its fraction
is `State.rs_sp`; only its rounded value is a word.
"""

from __future__ import annotations

from pidcfg.sim.controllers.dl06.modes import on_sp_scale
from pidcfg.sim.controllers.dl06.state import (
    CASCADE,
    PROGRAM,
    RS_COMPLETE,
    RS_DEVIATION,
    RS_HELD,
    RS_HOLD,
    RS_JOG,
    RS_RESUME,
    RS_START,
    RS_STEP,
    SOAK,
    Config,
    State,
)
from pidcfg.sim.notices import tell_request
from pidcfg.sim.plc import TICKS
from pidcfg.sim.terms import NEAREST, step_to

STEPS = 16
FIELDS = 4
"""Floats of a pair in `aux`: target, slope a second, seconds to soak, allowed deviation (0: any)."""

REFUSED_RS_OFF = 20
REFUSED_RS_CASCADE = 21
REFUSED_RS_TABLE = 22
REFUSED_RS_PROGRAM = 23
REFUSED_RS_IDLE = 24
HELD_BY_CASCADE = 25

REASONS = {
    REFUSED_RS_OFF: "ramp/soak refused: not enabled (+00 bit 11)",
    REFUSED_RS_CASCADE: "ramp/soak refused: the loop is in Cascade",
    REFUSED_RS_TABLE: "ramp/soak refused: the table is not in user memory (+35)",
    REFUSED_RS_PROGRAM: "ramp/soak refused: the CPU is in Program mode",
    REFUSED_RS_IDLE: "ramp/soak refused: no profile is running",
    HELD_BY_CASCADE: "ramp/soak held: the loop went to Cascade",
}


def finish(s: State, flags: int) -> None:
    """The generator stops; the step byte returns to 0."""
    s.rs_step = 0
    s.aux_status = flags
    s.busy &= ~SOAK


def begin(c: Config, s: State, aux: list[float], step: int) -> None:
    """Enter a step; the profile ends behind step 16 and at a slope of 0 (D55)."""
    if step > STEPS or (step % 2 == 1 and aux[c.rs_table + (step - 1) // 2 * FIELDS + 1] <= 0.0):
        finish(s, RS_COMPLETE)
        return
    s.rs_step = step
    if step % 2 == 0:
        s.rs_left = aux[c.rs_table + (step - 1) // 2 * FIELDS + 2] * TICKS
    s.aux_status = (s.aux_status & RS_HELD) | step * RS_STEP


def start(c: Config, s: State, aux: list[float]) -> None:
    """A rising start bit: the first ramp begins at the present set point, and moves at the next sample (D652)."""
    s.rs_error = c.rs_fault
    s.rs_errors |= c.rs_fault
    if c.rs_fault or c.rs_table < 0:
        tell_request(s, REFUSED_RS_TABLE)
        finish(s, 0)
        return
    s.aux_status = 0
    s.rs_sp = s.sp
    begin(c, s, aux, 1)


def obey(c: Config, s: State, aux: list[float]) -> None:
    """Read and clear the command bits; start works alone, hold comes before resume and jog (D56, D653)."""
    command = s.rs_command
    s.rs_command = 0
    if s.busy & PROGRAM:
        tell_request(s, REFUSED_RS_PROGRAM)
    elif s.status & CASCADE:
        tell_request(s, REFUSED_RS_CASCADE)
    elif command == RS_START:
        start(c, s, aux)
    elif s.rs_step == 0:
        tell_request(s, REFUSED_RS_IDLE)
    elif command & RS_HOLD:
        s.aux_status |= RS_HELD
    elif command & RS_RESUME:
        s.aux_status &= ~RS_HELD
        # the set point goes on with its fraction, unless somebody has written the word meanwhile
        if s.rs_sp + NEAREST - NEAREST != s.sp:
            s.rs_sp = s.sp
    elif command & RS_JOG:
        begin(c, s, aux, s.rs_step + 1)


def run(c: Config, s: State, aux: list[float]) -> None:
    """One sample of the step that is active."""
    pair = c.rs_table + (s.rs_step - 1) // 2 * FIELDS
    if s.rs_step % 2 == 1:
        target = aux[pair]
        s.rs_sp = step_to(s.rs_sp, target, aux[pair + 1] * (s.period / TICKS))
        s.sp = s.rs_sp + NEAREST - NEAREST
        if s.rs_sp == target:
            begin(c, s, aux, s.rs_step + 1)
        return
    s.rs_left -= s.period
    if s.rs_left < 0.5 * s.period:
        begin(c, s, aux, s.rs_step + 1)


def watch(c: Config, s: State, aux: list[float]) -> None:
    """Renew the soak deviation bit; it is on only while a soak sees the PV too far from the set point."""
    s.aux_status &= ~RS_DEVIATION
    if s.rs_step and s.rs_step % 2 == 0:
        allowed = aux[c.rs_table + (s.rs_step - 1) // 2 * FIELDS + 3]
        if allowed > 0.0 and abs(s.sp - on_sp_scale(c, s.pv)) > allowed:
            s.aux_status |= RS_DEVIATION


def ramp_soak(c: Config, s: State, aux: list[float], sig: list[float]) -> None:
    """Commands first, then the active step (D676), then its deviation bit; the step number is a signal."""
    generate(c, s, aux)
    sig[c.sig_step] = s.rs_step * 1.0


def generate(c: Config, s: State, aux: list[float]) -> None:
    """One sample of the generator."""
    if c.rs_enabled == 0:
        if s.rs_command:
            tell_request(s, REFUSED_RS_OFF)
        s.rs_command = 0
        finish(s, s.aux_status & RS_COMPLETE)
        return
    active = s.rs_step
    if s.rs_command:
        started = s.rs_command == RS_START
        obey(c, s, aux)
        if active == 0 or s.rs_step != active or started:
            active = 0
    if active and s.status & CASCADE and s.aux_status & RS_HELD == 0:
        s.aux_status |= RS_HELD
        tell_request(s, HELD_BY_CASCADE)
    if active and s.aux_status & RS_HELD == 0 and s.busy & PROGRAM == 0:
        run(c, s, aux)
    if s.rs_step == 0:
        s.busy &= ~SOAK
    else:
        watch(c, s, aux)
