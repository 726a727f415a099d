"""What a CLICK loop knows: `Config` (decoded registers, fixed during a run) and `State` (what the controller writes).

Numbers are what the PLC's single-precision registers hold; the clock is in ticks of a microsecond. Everything is an int
or a float: the same fields become a NumPy record for numba.
"""

from __future__ import annotations

from dataclasses import dataclass

from pidcfg.sim.records import Asked

NEVER = 1 << 60
"""A time that does not come."""
UNBOUNDED = 1e39
"""A limit that nothing reaches: beyond single precision."""
NAN = float("nan")
"""What a register holds whose calculation had no finite result."""

# Bits of `State.status`: modes, the alarms Cn+31 to Cn+37, errors
MANUAL, AUTO, TUNING = 1, 2, 4
MODES = MANUAL | AUTO | TUNING
LOW_LOW, LOW, HIGH, HIGH_HIGH = 8, 16, 32, 64
PV_ALARMS = LOW_LOW | LOW | HIGH | HIGH_HIGH
DEVIATION_HIGH, DEVIATION_HIGH_HIGH = 128, 256
DEVIATION_ALARMS = DEVIATION_HIGH | DEVIATION_HIGH_HIGH
RATE_OF_CHANGE = 512
ALARMS = PV_ALARMS | DEVIATION_ALARMS | RATE_OF_CHANGE
PID_ERROR = 1024
TUNE_ERROR = 2048

# What a loop has to attend to besides its equation (`State.busy`)
FIRST = 1
"""First sample after the change from STOP to RUN: the PV has no past."""
STOPPED = 2
"""The PLC is in STOP mode."""
FRESH = 4
"""First calculation after Manual or Autotune: the error has no past."""
REQUEST = 8
"""`State.request` holds requested mode bits."""
GOAL = 16
"""`State.goal` has not been reached."""


@dataclass(slots=True)
class Config:
    """One loop's registers, decoded. Changed only between two segments of a run."""

    period: int = 100_000
    """Sample rate in ticks, as at the start."""
    # slots of the signal vector
    sig_in: int = 0
    sig_pv: int = 1
    sig_sp: int = 2
    sig_out: int = 3
    sig_bias: int = 4
    sig_error: int = 5
    sig_pwm: int = 6
    # PV, set point and error
    filtered: int = 0
    """Cn+11."""
    filter: float = 1.0
    """Share of the raw PV that is passed each sample: DSn+08 / 100."""
    sp_low_on: int = 0
    sp_low: float = 0.0
    sp_high_on: int = 0
    sp_high: float = 0.0
    squared: int = 0
    deadband_on: int = 0
    deadband: float = 0.0
    # equation
    reverse: int = 0
    bumpless: int = 1
    freeze: int = 0
    limited: int = 0
    """Cn+04: the derivative gain limit is on."""
    limit: float = 100.0
    out_low: float = 0.0
    out_high: float = 100.0
    # alarms; a group that is off has limits that nothing reaches
    low_low: float = -UNBOUNDED
    low: float = -UNBOUNDED
    high: float = UNBOUNDED
    high_high: float = UNBOUNDED
    deviation_high: float = UNBOUNDED
    deviation_high_high: float = UNBOUNDED
    rate_of_change: float = UNBOUNDED
    hysteresis: float = 0.0
    # pulse width modulation
    pwm: int = 0
    """The output drives a discrete output."""
    pwm_period: int = 10_000_000
    """In ticks."""
    # autotune
    tune_closed: int = 0
    tune_pi: int = 0
    tune_hysteresis: float = 1.0
    """DFn+21 in %."""
    tune_buffer: int = -1
    """Offset in `aux` of `reaction_curve.POINTS` floats."""
    pv_low: float = 0.0
    """PV lower and upper limit, the process's range for the whole range of the output."""
    pv_high: float = 100.0


@dataclass(slots=True)
class State(Asked):
    """One loop's registers and memory that the controller writes."""

    sample_ms: int = 100
    """DSn+05."""
    busy: int = FIRST
    """What has to be attended to, as a set of bits; 0 in quiet operation."""
    error: int = 0
    """Row of the table of PID errors that is active, the lowest, from 1; 0: none."""
    number: float = 0.0
    """Its number, DSn+00."""
    # registers
    bias: float = 0.0
    raw: float = 0.0
    reset: float = 1.0
    # factors made of them
    lag: float = 1.0
    """Of the derivative's filter, Ts / (Ts + Td / limit)."""
    # past
    e1: float = 0.0
    """The error of the calculation before, without the deadband."""
    y1: float = 0.0
    """The filtered difference of errors."""
    quiet_low: float = UNBOUNDED
    """Between these no alarm can change, as long as the set point stays."""
    quiet_high: float = -UNBOUNDED
    quiet_sp: float = 0.0
    # pulse width modulation
    pulse_at: int = 0
    """Start of the present period."""
    pulse: float = -1.0
    """On-time of the present period in ticks; below 0: none has begun."""
    last_tick: int = 0
    """Tick of the base step before."""
