"""What the loops of every vendor know, as flat records that each vendor's `State` extends.

Ints and floats only: the same fields become a NumPy record for numba.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class LoopState:
    """What the runner reads of a loop, its registers, and the factors made of them."""

    due: int = 0
    """Tick of the next calculation."""
    period: int = 100_000
    """Present sample rate in ticks."""
    busy: int = 0
    """What has to be attended to, as a set of bits; 0 in quiet operation."""
    status: int = 1
    """Mode, alarms and conditions, as bits."""
    aux_status: int = 0
    """Further conditions, as bits."""
    notice: int = 0
    """What happened since the runner last looked: see `pidcfg.sim.notices`."""
    sp: float = 0.0
    pv: float = 0.0
    out: float = 0.0
    gain: float = 1.0
    """As the register has it, likewise the next two."""
    reset: float = 0.0
    """In s."""
    rate: float = 0.0
    """In s."""
    kp: float = 0.0
    ki: float = 0.0
    kd: float = 0.0


@dataclass(slots=True)
class Heard(LoopState):
    """A loop that looks at the noise of its PV and records a reaction curve."""

    tune_phase: int = 0
    tune_count: int = 0
    """Samples in this phase."""
    tune_points: int = 0
    """Points of the reaction curve; under a relay the sample of the last switch."""
    tune_stride: int = 1
    """Samples a point."""
    tune_sum: float = 0.0
    tune_noise: float = 0.0
    """Estimated standard deviation of the PV."""
    tune_base: float = 0.0
    """PV at rest."""
    tune_out: float = 0.0
    """Output before anything was done to it."""
    tune_a: float = 0.0
    tune_b: float = 0.0


@dataclass(slots=True)
class Tuned(Heard):
    """A loop that a relay can make swing."""

    tune_done: int = 0
    tune_step: float = 0.0
    """Step of the output, with its sign, as the vendor counts it."""
    tune_low: float = 0.0
    tune_high: float = 0.0
    tune_side: int = 0
    """Sign of the error."""
    tune_turns: int = 0
    """Times the relay has switched."""
    tune_start: int = 0
    """Sample of the first switch that counts."""
    tune_swing: float = 0.0
    """Sum of the PV's peak-to-peak amplitudes."""


@dataclass(slots=True)
class Asked(Tuned):
    """A loop whose mode is asked for: by requests, and until it is granted by its goal."""

    request: int = 0
    """One-shot requested mode bit."""
    goal: int = 0
    """The mode to be requested every sample until it is granted."""
    goal_sp: float = 0.0
    """Set point that is written when the goal is reached for the first time."""
    goal_writes: int = 0
    """Whether there is a set point to write: configured, or set by an event."""
    requested: int = 0
    """The mode that was requested last, for the log."""
    refused: int = 0
    """Reasons (as bits) that the goal has met so far."""
