"""What a block knows: `Config` (fixed during a run) and `State` (what it keeps from one call to the next).

Loops come first, in the order of the file, then the other blocks; all have the same record. Parameters are not here:
they stand among the signals, from ``base`` on (`slots`), where wires, events and other blocks find them. Everything is
an int or a float: the same fields become a NumPy record for numba.
"""

from __future__ import annotations

from dataclasses import dataclass

from pidcfg.sim.records import LoopConfig, RelayState

# `State.status`: the mode reached
MANUAL_MODE, AUTO_MODE, CASCADE_MODE, TRACKING_MODE, TUNING_MODE, OVERRIDDEN = 1, 2, 4, 8, 16, 32
MODES = 63
ERROR_BASE = 64
"""`State.status`: from this bit on the nine ErrBits in the order of the table; `State.aux_status` has the WarnBits."""


@dataclass(slots=True)
class Config(LoopConfig):
    """One block of the program."""

    kind: int = 0
    """Number of its type: `slots.KINDS`."""
    base: int = 0
    """Slot of its first parameter."""
    error: int = -1
    """Slot of its output Error; −1: it has none."""
    turn: int = 0
    """Of the record at this place of the list: which block is executed in this turn."""
    ts: float = 0.1
    """The period in s, single precision: what the block measures as SampleTime."""
    whole: int = 0
    """Parameters are INT: MV is rounded."""
    wires: int = 0
    """First of its wires in the wire table, and one behind the last."""
    wires_end: int = 0
    early: int = 0
    """How many of its wires, the first ones, are renewed before the first block of a cycle is called."""
    moves: int = 0
    """Of the first record: the first row of the program's moves in the wire table, two rows a move."""
    moves_first: int = 0
    """One behind those that are executed before the first call of a cycle, and one behind all."""
    moves_end: int = 0
    buffer: int = 0
    """Where its delay line begins in the shared vector."""


@dataclass(slots=True)
class State(RelayState):
    """What a block keeps. `LoopState`: ``pv`` and ``out`` are PV and MV of the last call."""

    command: int = 0
    """Commands of the operator, as bits, for the next call (`modes`)."""
    tune_end: int = 0
    """State of the last auto-tuning, and its results (`modes`)."""
    result_kp: float = 0.0
    result_ti: float = 0.0
    result_td: float = 0.0
    result_flags: int = 0
    fault: int = 0
    """Why a wire had no value, the first time (`pidcfg.sim.expressions.FAULTS`), for which slot, and when in ticks."""
    fault_target: int = 0
    fault_at: int = -1
    erred: int = 0
    """Whether its output Error was on at some time."""
    started: int = 0
    """Whether it has been called."""
    integral: float = 0.0
    error: float = 0.0
    derivative: float = 0.0
    """Filtered."""
    share_of: float = -1.0
    """The quotient Ts/T that ``share`` was worked out for."""
    share: float = 1.0
    y: float = 0.0
    """State of a lag or filter."""
    samples: int = 0
    """Length of a delay line, or of a period of pulses."""
    head: int = 0
    """Next place of a delay line, or cycle of a period of pulses."""
    delayed: float = 0.0
    """Last output of a delay line."""
    held: int = 0
    """Cycles for which pulses are on."""
    tune_band: float = 0.0
    """Hysteresis of the auto-tuning's relay in PV units."""
    tune_safe: float = 0.0
    """How far the PV may go from its rest before the auto-tuning is aborted."""
    tune_cycles: int = 0
    """Cycles to be measured."""
    tune_mode: int = 0
    """Controller to be tuned: AUTOTUNE_MODE."""
    tune_peak: int = 0
    """Sample of the PV's extreme since the last switch."""
    tune_dead: int = 0
    """Sum of the samples from the switches to the extremes."""
