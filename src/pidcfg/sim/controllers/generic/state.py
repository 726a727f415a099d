"""The records of a neutral loop: `Config` (what it reads) and `State` (what it writes).

Everything is an int or a float: the same fields become a NumPy record for numba. The clock is in ticks of a
microsecond.
"""

from __future__ import annotations

from dataclasses import dataclass

from pidcfg.sim.records import LoopConfig, LoopState, register

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
