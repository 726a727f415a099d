"""What a DL06 loop knows: `Config` (decoded words, fixed during a run) and `State` (what the controller writes).

Words are held as floats with whole values, in counts of their data format; times are in seconds, the clock in ticks of
a microsecond. Gains are kept in output counts per fraction of PV span with the sign of the action, so that the step
itself reads like the manual's equation. Everything is an int or a float: the same fields become a NumPy record for
numba.
"""

from __future__ import annotations

from dataclasses import dataclass

from pidcfg.sim.records import Asked

NEVER = 1 << 60
"""A time that does not come."""
UNBOUNDED = 1e18
"""A limit that nothing reaches."""

# Bits of the status word +06
MANUAL, AUTO, CASCADE = 1, 2, 4
MODES = MANUAL | AUTO | CASCADE
LOW_LOW, LOW, HIGH, HIGH_HIGH = 8, 16, 32, 64
PV_ALARMS = LOW_LOW | LOW | HIGH | HIGH_HIGH
YELLOW, RED = 128, 256
DEVIATION_ALARMS = YELLOW | RED
RATE_OF_CHANGE = 512
ALARMS = PV_ALARMS | DEVIATION_ALARMS | RATE_OF_CHANGE
ALARM_ERROR = 1024
OVERFLOW = 2048
TUNING = 4096
TUNE_ERROR = 8192

# Bits of the ramp/soak word +33
RS_START, RS_HOLD, RS_RESUME, RS_JOG = 1, 2, 4, 8
RS_COMPLETE, RS_DEVIATION, RS_HELD = 16, 32, 64
RS_STEP = 256
"""The step number stands in the high byte."""

# What a loop has to attend to besides its equation (`State.busy`)
FIRST = 1
"""First sample after the program-to-run transition: the PV has no past."""
STOPPED = 2
"""The CPU is in Program mode and the loop with it: no calculation, and the output module is off."""
BLIND = 4
"""The CPU is in Program mode and nothing writes the PV word of this independent loop."""
MUTE = 8
"""The CPU is in Program mode and nothing carries the output word to the module."""
PROGRAM = 16
"""The CPU is in Program mode; this loop runs on by itself."""
FRESH = 32
"""First calculation after Manual: the error has no past."""
REQUEST = 64
"""`State.request` holds requested mode bits."""
GOAL = 128
"""`State.goal` has not been reached."""
RESTORE = 256
"""Back to `State.prior` without asking."""
SOAK = 512
"""A ramp/soak command waits or a profile runs."""
TUNE = 1024
"""Auto-tune is wanted or runs."""
RELAY = 2048
"""Auto-tune has taken the output over."""
TRIP = 4096
"""To Manual now: an alarm programming error has been written."""


@dataclass(slots=True)
class Config:
    """One loop's words, decoded. Changed only between two segments of a run."""

    period: int = 50_000
    """Sample rate in ticks."""
    slow: int = 0
    """Sample rate above 2 s and scans have a length: at most one such loop a scan."""
    halt: int = 0
    """The loop does not run: the loop task is off, or its sample rate is 0."""
    independent: int = 0
    """Bit 15 of +00: the loop does not follow the CPU's mode."""
    sees_pv: int = 0
    """+36 fetches the PV from a module, without the ladder program."""
    drives: int = 0
    """+37 carries the output to a module, without the ladder program."""
    # slots of the signal vector, and the ends of the ranges in engineering units
    sig_in: int = 0
    sig_pv: int = 1
    sig_sp: int = 2
    sig_out: int = 3
    sig_bias: int = 4
    pv_low: float = 0.0
    pv_width: float = 4095.0
    pv_min: float = 0.0
    pv_max: float = 4095.0
    pv_span: float = 4095.0
    out_low: float = 0.0
    out_width: float = 4095.0
    out_min: float = 0.0
    out_max: float = 4095.0
    out_span: float = 4095.0
    # PV, set point and error
    filter: float = 1.0
    """Filter constant k; 1 is none."""
    root: int = 0
    """Square-root extract."""
    span: float = 4095.0
    """What an error is divided by: the PV's span, or its root."""
    curved: int = 0
    """Any of root, squared, deadband: the error is not simply SP - PV."""
    squared: int = 0
    deadband: float = 0.0
    """As a fraction of the span."""
    sp_min: float = -UNBOUNDED
    sp_max: float = UNBOUNDED
    major: int = -1
    """Index of the loop whose output is the remote set point; -1: the pointer names no output of this table."""
    # equation
    special: int = 0
    """Not simply the position form of a linear error: `equation.calculate` is needed."""
    velocity: int = 0
    reverse: int = 0
    bumpless: int = 1
    freeze: int = 0
    on_pv: int = 0
    """The derivative acts on the PV."""
    limit: float = 0.0
    """Derivative gain limit, when `limited`."""
    limited: int = 0
    step_bias: int = 0
    m_low: float = 0.0
    """Output limits, within the data range."""
    m_high: float = 4095.0
    interlock: int = 1
    """A PV alarm refuses a request for Auto."""
    # alarms; a group that is off has thresholds that nothing reaches
    low_low: float = -UNBOUNDED
    low: float = -UNBOUNDED
    high: float = UNBOUNDED
    high_high: float = UNBOUNDED
    yellow: float = UNBOUNDED
    red: float = UNBOUNDED
    rate_of_change: float = UNBOUNDED
    hysteresis: float = 0.0
    # ramp/soak
    rs_enabled: int = 0
    rs_table: int = -1
    """Offset of the table in `aux`: target, slope/s, soak seconds, deviation for each of 8 pairs; -1: none."""
    rs_fault: int = 0
    """Bits of +35 that a start reports."""
    # auto-tune
    tune_open: int = 0
    tune_pi: int = 0
    tune_buffer: int = -1
    """Offset in `aux` of `tune_open.POINTS` floats."""
    reset_unit: float = 1.0
    """Seconds of one unit of the reset word: 1 or 60."""
    reset_step: float = 0.1
    """Last digit of the reset word in its unit."""
    least_period: int = 50_000
    """Shortest sample rate for this number of loops."""


@dataclass(slots=True)
class State(Asked):
    """One loop's words and memory that the controller writes."""

    period: int = 50_000
    busy: int = FIRST
    """What has to be attended to, as a set of bits; 0 in quiet operation."""
    turn: int = -1
    """In loop 1: the slow loop that was served last."""
    # words +02 to +05, in counts
    bias: float = 0.0
    """With its fraction, which the word does not show."""
    # gains: the words, and the factors made of them
    gain: float = 0.0
    """Kc."""
    lag: float = 1.0
    """Ts / (Ts + Td / limit)."""
    # past
    m: float = 0.0
    """Output before rounding, the velocity form's position."""
    e1: float = 0.0
    x1: float = 0.0
    """What the derivative acts on, at n-1 and n-2."""
    x2: float = 0.0
    last_sp: float = 0.0
    """Set point of the calculation before, for the step bias."""
    quiet_low: float = UNBOUNDED
    """Between these no alarm can change, as long as the set point stays."""
    quiet_high: float = -UNBOUNDED
    quiet_sp: float = 0.0
    # modes
    prior: int = MANUAL
    """Mode when the CPU left Run."""
    # ramp/soak
    rs_command: int = 0
    rs_step: int = 0
    rs_left: float = 0.0
    """Seconds of the soak that are left."""
    rs_sp: float = 0.0
    """Set point with its fraction."""
    rs_error: int = 0
    """The word +35."""
