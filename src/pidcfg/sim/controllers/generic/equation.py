"""What a neutral loop knows and calculates: its records, the ideal PID, alarms and pulses."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt
from typing import TYPE_CHECKING

from pidcfg.sim.controllers.kernels import LoopConfig, LoopState, clamp, latched, noticed, register, step_to

if TYPE_CHECKING:
    from collections.abc import MutableSequence

# --- The records of a neutral loop: `Config` (what it reads) and `State` (what it writes) -----------------------------
#
# Everything is an int or a float: the same fields become a NumPy record for numba. The clock is in ticks of a
# microsecond.

# `State.status`
MANUAL, AUTO, CASCADE = 1, 2, 4
MODES = MANUAL | AUTO | CASCADE
LIMITED = 8
"""What the equation makes of OUT is beyond a limit."""
SLOWED = 16
"""OUT moves as fast as it may."""
TRACKING = 32
"""OUT is the set point of a slave that is not in cascade (D302)."""
IN_DEAD_BAND = 64
"""The error is inside the dead band."""
LOW_LOW, LOW, HIGH, HIGH_HIGH = 128, 256, 512, 1024
DEVIATION, DEVIATION_2, RATE = 2048, 4096, 8192

# `State.busy`
FRESH = 1
"""There was no sample yet."""
REQUEST = 2
"""`State.wanted` is another mode."""
BUMPLESS = 4
"""The next calculation goes on from OUT (D301)."""
MANUAL_SET = 8
"""`State.manual` has been set since manual was requested."""
SP_SET = 16
"""The set point has been set since the mode was requested."""

UNREACHED = float("inf")
"""An alarm point that no value reaches."""


@dataclass(slots=True)
class Config(LoopConfig):
    """What a loop only reads."""

    sig_pulse: int = 5
    raises: int = register("output_raises_pv", 1)
    proportional: int = register("tuning.proportional", 1)
    of_error: int = register("tuning.derivative_on", 0, equals="error")
    root: int = register("pv.square_root", 0)
    windup: int = register("anti_windup", 0, equals=False)
    """There is no anti-windup."""
    source: int = -1
    """The master's number; -1: none."""
    slave: int = -1
    """Number of the first loop whose master this one is; -1: none."""
    follows: int = 0
    """On the way from manual to auto the set point becomes the PV."""
    pulses: int = 0
    base: float = register("pv.range.0", 0.0)
    span: float = 1.0
    sp_low: float = register("setpoint.limits.0", -UNREACHED)
    sp_high: float = register("setpoint.limits.1", UNREACHED)
    low: float = 0.0
    high: float = 100.0
    band: float = register("deadband", 0.0)
    out_base: float = register("output.range.0", 0.0)
    out_span: float = 100.0
    rate_limit: float = UNREACHED
    """Fastest change of OUT in a sample."""
    low_low_at: float = register("alarms.pv.low_low", -UNREACHED)
    low_at: float = register("alarms.pv.low", -UNREACHED)
    high_at: float = register("alarms.pv.high", UNREACHED)
    high_high_at: float = register("alarms.pv.high_high", UNREACHED)
    deviation_at: float = register("alarms.deviation.high", UNREACHED)
    deviation_2_at: float = register("alarms.deviation.high_high", UNREACHED)
    rate_at: float = UNREACHED
    """Fastest change of the PV in a sample."""
    hysteresis: float = register("alarms.hysteresis", 0.0)
    cycle: float = 0.0
    """Period of the pulses in ticks; likewise the next two."""
    min_on: float = 0.0
    min_off: float = 0.0


@dataclass(slots=True)
class State(LoopState):
    """What a loop writes; ``kp``, ``ki`` and ``kd`` are the factors of the error, its sum and its difference."""

    gain: float = register("tuning.gain", 0.0)
    reset: float = register("tuning.integral_time", 0.0)
    rate: float = register("tuning.derivative_time", 0.0)
    wanted: int = AUTO
    """The mode that was requested last."""
    manual: float = 0.0
    """OUT in manual."""
    bias: float = register("output.bias", 0.0)
    integral: float = 0.0
    pv_share: float = 1.0
    """What the PV's filter takes of a difference; likewise that of the derivative."""
    d_share: float = 1.0
    error: float = 0.0
    """The error as it counts."""
    e1: float = 0.0
    """That of the sample before, likewise the PV."""
    pv1: float = 0.0
    y: float = 0.0
    """The filtered difference."""
    cycle_start: int = 0
    cycle_end: int = 0
    on: float = 0.0
    """How long the pulse of this cycle is, in ticks."""
    seen: int = 0
    """The base step before."""


# --- The ideal PID in double precision (D299), its anti-windup (D300) and its bumpless changes (D301) -----------------
#
# Plain functions of records and numbers, which numba compiles as they are. D numbers: see
# `pidcfg.encoders.generic.image`.

NOTABLE = 0.01
"""Share of the way between the limits that OUT moves by at most without a word when manual ends."""
JUMPS = 1
"""Notice of `calculate`."""


def measure(c: Config, s: State, raw: float) -> None:
    """The PV: root, then filter."""
    x = raw
    if c.root:
        share = (raw - c.base) / c.span
        x = c.base + c.span * sqrt(share) if share > 0.0 else c.base
    if s.busy & FRESH:
        s.pv = x
        s.pv1 = x
    else:
        s.pv1 = s.pv
        s.pv = s.pv + (x - s.pv) * s.pv_share if s.pv_share < 1.0 else x


def compare(c: Config, s: State) -> None:
    """The error as it counts, and that of the sample before."""
    e = s.sp - s.pv if c.raises else s.pv - s.sp
    if abs(e) < c.band:
        e = 0.0
        s.status |= IN_DEAD_BAND
    else:
        s.status &= ~IN_DEAD_BAND
    s.e1 = e if s.busy & FRESH else s.error
    s.error = e


def derivative(c: Config, s: State) -> float:
    """The third action."""
    if c.of_error:
        x = s.error - s.e1
    elif c.raises:
        x = s.pv1 - s.pv
    else:
        x = s.pv - s.pv1
    if s.d_share < 1.0:
        x = s.y + (x - s.y) * s.d_share
    s.y = x
    return s.kd * x


def put_back(s: State, p: float, d: float) -> None:
    """The integral with which the equation makes the present OUT."""
    total = ((s.out - p) - d) - s.bias
    s.integral = total if s.ki > 0.0 and isfinite(total) else 0.0


def move(c: Config, s: State, target: float) -> None:
    """OUT towards a value, as fast as it may, within the limits."""
    out = step_to(s.out, target, c.rate_limit)
    if out != target:
        s.status |= SLOWED
    else:
        s.status &= ~SLOWED
    s.out = clamp(out, c.low, c.high)


def limited(c: Config, s: State, m: float) -> float:
    """A value within the limits of OUT."""
    if c.low <= m <= c.high:
        s.status &= ~LIMITED
        return m
    s.status |= LIMITED
    return clamp(m, c.low, c.high)


def by_hand(c: Config, s: State, p: float, d: float) -> None:
    """OUT is what the operator wants."""
    move(c, s, limited(c, s, s.manual))
    put_back(s, p, d)


def calculate(c: Config, s: State, p: float, d: float) -> None:
    """OUT of the equation."""
    was = s.out
    step = s.ki * s.error
    if s.busy & BUMPLESS:
        put_back(s, p, d)
        step = 0.0
    total = s.integral + step if s.ki > 0.0 else 0.0
    m = ((p + total) + d) + s.bias
    if not isfinite(m):
        return
    if c.windup or not ((m > c.high and step > 0.0) or (m < c.low and step < 0.0)):
        s.integral = total
    move(c, s, limited(c, s, m))
    if s.busy & BUMPLESS and s.ki <= 0.0 and abs(s.out - was) > NOTABLE * (c.high - c.low):
        s.notice = noticed(s.notice, 0, JUMPS)
    s.busy &= ~BUMPLESS


# --- Alarms and the pulse output of a neutral loop (both: D303) -------------------------------------------------------

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
