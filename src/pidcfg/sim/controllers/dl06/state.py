"""What a DL06 loop knows: `Config` (decoded words, fixed during a run) and `State` (what the controller writes).

Words are held as floats with whole values, in counts of their data format; times are in seconds, the clock in ticks of
a microsecond. Gains are kept in output counts per fraction of PV span with the sign of the action, so that the step
itself reads like the manual's equation. Everything is an int or a float: the same fields become a NumPy record for
numba.
"""

from __future__ import annotations

from dataclasses import dataclass

from pidcfg.sim.records import LoopConfig, RequestState, register

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
PV_STALE = 4
"""The CPU is in Program mode and nothing writes the PV word of this independent loop."""
OUTPUT_CUT = 8
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
class Config(LoopConfig):
    """One loop's words, decoded."""

    sig_step: int = 5
    """The step of the ramp/soak profile, 1 to 16; 0: none is active."""
    period: int = 50_000
    slow: int = 0
    """Sample rate above 2 s and scans have a length: at most one such loop a scan."""
    independent: int = register("independent_of_cpu_mode", 0)
    sees_pv: int = 0
    """+36 fetches the PV from a module, without the ladder program."""
    drives: int = 0
    """+37 carries the output to a module, without the ladder program."""
    # ends of the ranges in engineering units
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
    root: int = register("pv.square_root", 0)
    span: float = 4095.0
    """What an error is divided by: the PV's span, or its root."""
    curved: int = 0
    """Any of root, squared, deadband: the error is not simply SP - PV."""
    squared: int = register("error.curve", 0, equals="squared")
    deadband: float = 0.0
    """As a fraction of the span."""
    sp_min: float = register("setpoint.limits.0", -UNBOUNDED, enabled="setpoint.limits_enabled")
    sp_max: float = register("setpoint.limits.1", UNBOUNDED, enabled="setpoint.limits_enabled")
    major: int = -1
    """Index of the loop whose output is the remote set point; -1: the pointer names no output of this table."""
    # equation
    special: int = 0
    """Not simply the position form of a linear error: `equation.calculate` is needed."""
    velocity: int = register("algorithm", 0, equals="velocity")
    reverse: int = register("action", 0, equals="reverse")
    bumpless: int = 1
    freeze: int = register("bias_freeze", 0)
    on_pv: int = 0
    """The derivative acts on the PV."""
    limited: int = register("derivative_gain_limit_enabled", 0)
    limit: float = register("derivative_gain_limit", 0.0)
    step_bias: int = 0
    m_low: float = 0.0
    """Output limits, within the data range."""
    m_high: float = 4095.0
    interlock: int = 1
    """A PV alarm refuses a request for Auto."""
    # alarms; a group that is off has thresholds that nothing reaches
    low_low: float = register("alarms.pv.low_low", -UNBOUNDED, enabled="alarms.pv.enabled")
    low: float = register("alarms.pv.low", -UNBOUNDED, enabled="alarms.pv.enabled")
    high: float = register("alarms.pv.high", UNBOUNDED, enabled="alarms.pv.enabled")
    high_high: float = register("alarms.pv.high_high", UNBOUNDED, enabled="alarms.pv.enabled")
    yellow: float = register("alarms.deviation.yellow", UNBOUNDED, enabled="alarms.deviation.enabled")
    red: float = register("alarms.deviation.red", UNBOUNDED, enabled="alarms.deviation.enabled")
    rate_of_change: float = register("alarms.rate_of_change", UNBOUNDED, enabled="alarms.rate_of_change_enabled")
    hysteresis: float = register("alarms.hysteresis", 0.0)
    # ramp/soak
    rs_enabled: int = register("ramp_soak.enabled", 0)
    rs_table: int = -1
    """Offset of the table in `aux`: target, slope/s, soak seconds, deviation for each of 8 pairs; -1: none."""
    rs_fault: int = 0
    """Bits of +35 that a start reports."""
    # auto-tune
    tune_open: int = register("autotune.method", 0, equals="open")
    tune_pi: int = register("autotune.type", 0, equals="PI")
    tune_buffer: int = -1
    """Offset in `aux` of `tune_open.POINTS` floats."""
    reset_unit: float = 1.0
    """Seconds of one unit of the reset word: 1 or 60."""
    reset_step: float = 0.1
    """Last digit of the reset word in its unit."""
    least_period: int = 50_000
    """Shortest sample rate for this number of loops."""


@dataclass(slots=True)
class State(RequestState):
    """One loop's words and memory that the controller writes."""

    period: int = 50_000
    busy: int = FIRST
    """What has to be attended to, as a set of bits; 0 in quiet operation."""
    turn: int = -1
    """In loop 1: the slow loop that was served last."""
    # words +02 to +05, in counts
    bias: float = 0.0
    """With its fraction, which the word does not show."""
    # gains: the words, and the factors calculated from them
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
    """Ticks of the soak that are left."""
    rs_sp: float = 0.0
    """Set point with its fraction."""
    rs_error: int = 0
    """The word +35."""
    rs_errors: int = 0
    """Every bit of it that was on at some time."""
