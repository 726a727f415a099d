"""What a CLICK loop knows: `Config` (decoded registers, fixed during a run) and `State` (what the controller writes).

Numbers are what the PLC's single-precision registers hold; the clock is in ticks of a microsecond. Everything is an int
or a float: the same fields become a NumPy record for numba.
"""

from __future__ import annotations

from dataclasses import dataclass

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
class State:
    """One loop's registers and memory that the controller writes."""

    due: int = 0
    """Tick of the next calculation."""
    period: int = 100_000
    """Sample rate in ticks, within what the PLC allows."""
    sample_ms: int = 100
    """DSn+05."""
    busy: int = FIRST
    """What has to be attended to, as a set of bits; 0 in quiet operation."""
    status: int = MANUAL
    """Mode, alarms and errors."""
    aux_status: int = 0
    """Nothing; every vendor's loops have it."""
    notice: int = 0
    """What happened since the runner last looked: see `pidcfg.sim.notices`."""
    error: int = 0
    """Row of the table of PID errors that is active, the lowest, from 1; 0: none."""
    number: float = 0.0
    """Its number, DSn+00."""
    # registers
    sp: float = 0.0
    bias: float = 0.0
    out: float = 0.0
    raw: float = 0.0
    pv: float = 0.0
    gain: float = 1.0
    reset: float = 1.0
    rate: float = 0.0
    # factors made of them
    kp: float = 0.0
    """Kp, negative in reverse action."""
    ki: float = 0.0
    """Kp Ts/Ti, likewise."""
    kd: float = 0.0
    """Td/Ts."""
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
    # modes
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
    """PID errors (as bits) that have refused the goal so far."""
    # pulse width modulation
    pulse_at: int = 0
    """Start of the present period."""
    pulse: float = -1.0
    """On-time of the present period in ticks; below 0: none has begun."""
    last_tick: int = 0
    """Tick of the base step before."""
    # autotune
    tune_phase: int = 0
    tune_done: int = 0
    tune_count: int = 0
    """Samples in this phase."""
    tune_points: int = 0
    """Points in the buffer."""
    tune_stride: int = 1
    """Samples a point."""
    tune_sum: float = 0.0
    tune_noise: float = 0.0
    """Estimated standard deviation of the PV."""
    tune_base: float = 0.0
    """PV at rest."""
    tune_out: float = 0.0
    """Output before anything was done to it."""
    tune_step: float = 0.0
    """Step of the output in shares of its range, with its sign."""
    tune_a: float = 0.0
    tune_b: float = 0.0
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
