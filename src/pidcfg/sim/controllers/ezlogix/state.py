"""Records of an EZLogix loop: `Config` (registers and dialog, fixed during a run) and `State` (what the PLC writes).

Registers are held as floats with whole values, in counts; gains and times in their units, the clock in ticks of a
microsecond. Everything is an int or a float: the same fields become a NumPy record for numba.
"""

from __future__ import annotations

from dataclasses import dataclass

from pidcfg.sim.records import CurveState, LoopConfig, register

UNBOUNDED = 1e18
"""Longer than any cycle."""

# `State.status`
MANUAL, AUTO = 1, 2
MODES = MANUAL | AUTO
SATURATED = 4
"""Discrete +3: the CV is 0 or 4095."""
TUNING = 8
"""An autotune collects or calculates."""
TUNE_ERROR = 16
"""The last autotune ended with an error."""

# What is pending besides the equation (`State.busy`)
STOPPED = 1
"""The PLC is stopped and the loop with it."""
PV_STALE = 2
"""The PLC is stopped and nothing writes the PV's register."""
OUTPUT_CUT = 4
"""The PLC is stopped and nothing carries the CV to an output."""
FRESH = 8
"""First calculation in Auto: the integral term follows the CV, and nothing has a past."""
REQUEST = 16
"""Discrete +0 has been written: `State.wanted`."""
TUNE = 32
"""An autotune is started, cancelled, or runs."""
HELD = 64
"""The autotune has taken the CV over."""


@dataclass(slots=True)
class Config(LoopConfig):
    """One loop's registers and dialog."""

    goes_on: int = 0
    """The dialog's "Process PID when PLC is Stopped"."""
    sees_pv: int = 0
    """The PV's tag is an input register."""
    drives: int = 0
    """The CV's tag is an output register, or the control output is enabled."""
    feeds: int = -1
    """The loop whose set point register is this one's CV tag (D177); -1: none."""
    fed_by: int = -1
    """The loop whose CV tag is this one's set point register (D177); -1: none."""
    sig_error: int = 5
    sig_status: int = 6
    sig_pulse: int = 7
    sig_countdown: int = 8
    # ends of the ranges in engineering units
    pv_low: float = 0.0
    pv_width: float = 4095.0
    pv_min: float = 0.0
    pv_max: float = 4095.0
    pv_span: float = 4095.0
    out_low: float = 0.0
    out_width: float = 4095.0
    # set point and error
    direct: int = register("action", 0, equals="direct")
    """The controller's action: direct is E = PV - SP, reverse E = SP - PV."""
    root: int = register("square_root", 0)
    """The square root of the PV is used (D163)."""
    scale: float = 1.0
    """What makes a difference of roots an error in counts."""
    deadband: float = register("deadband", 0.0)
    """On the set point's scale."""
    sp_low: float = register("setpoint_low", 0.0)
    sp_high: float = register("setpoint_high", 4095.0)
    # equation
    velocity: int = register("algorithm", 0, equals="velocity")
    """The derivative acts on the PV."""
    anti_windup: int = register("anti_windup", 0)
    offset: float = register("cv_offset", 0.0)
    m_low: float = 0.0
    """CV limits, within 0 to 4095."""
    m_high: float = 4095.0
    # control output; 0: it is not enabled, or its cycle time is 0
    cycle: int = 0
    """Ticks of a cycle."""
    min_on: int = 0
    min_off: int = 0
    # autotune
    tune_pi: int = register("tuning_type", 0)
    timeout: int = 600_000_000
    """In ticks."""
    tune_buffer: int = 0
    """Where its points begin in the shared vector."""


@dataclass(slots=True)
class State(CurveState):
    """One loop's registers and memory that the PLC writes."""

    wanted: int = MANUAL
    """Discrete +0."""
    error: float = 0.0
    """Base+11, with its sign."""
    # gains: the registers, and the factors calculated from them
    gain: float = 0.0
    """Kp."""
    # past
    integral: float = 0.0
    """The integral term in counts of the CV."""
    x1: float = 0.0
    """What the derivative acts on, at n-1."""
    whole: float = 0.0
    """The CV before its limits, which anti-windup looks at."""
    # control output
    seen: int = 0
    """Tick of the last look."""
    cycle_start: int = 0
    cycle_end: int = 0
    on: float = 0.0
    """On-time of this cycle in ticks."""
    # autotune
    tune_command: int = 0
    """What became of discrete +4 since the last sample: 1 on, 2 off."""
    tune_status: int = 0
    """Base+12."""
    tune_last: int = 0
    """How the last autotune ended, as Base+12 tells it."""
    tune_left: int = 0
    """Base+13: the countdown, in ticks."""
    tune_change: float = 0.0
    """How far the PV has come."""
    tune_gain: float = 0.0
    """Result of the last successful autotune, as in the register; likewise the next two."""
    tune_reset: float = 0.0
    tune_rate: float = 0.0
