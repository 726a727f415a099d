"""Records of a CLICK loop: `Config` (decoded registers, fixed during a run) and `State` (what the controller writes).

Numbers are what the PLC's single-precision registers hold; the clock is in ticks of a microsecond. Everything is an int
or a float: the same fields become a NumPy record for numba.
"""

from __future__ import annotations

from dataclasses import dataclass

from pidcfg.sim.records import LoopConfig, RequestState, register

UNBOUNDED = 1e39
"""A limit that no value reaches: beyond single precision."""
NAN = float("nan")
"""Content of a register whose calculation had no finite result."""

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

# What is pending besides the equation (`State.busy`)
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
class Config(LoopConfig):
    """One loop's registers, decoded."""

    sig_error: int = 5
    sig_pwm: int = 6
    # PV, set point and error
    filtered: int = register("filter_enable", 0)
    filter: float = 1.0
    """Share of the raw PV that is passed each sample: DSn+08 / 100."""
    sp_low_on: int = register("setpoint_lower_enable", 0)
    sp_low: float = register("setpoint_lower", 0.0)
    sp_high_on: int = register("setpoint_upper_enable", 0)
    sp_high: float = register("setpoint_upper", 0.0)
    squared: int = register("error_squared", 0)
    deadband_on: int = 0
    deadband: float = register("deadband", 0.0)
    # equation
    reverse: int = register("action", 0)
    bumpless: int = 1
    freeze: int = register("freeze_bias", 0)
    limited: int = register("derivative_limit_enable", 0)
    limit: float = register("derivative_gain_limit", 100.0)
    out_low: float = register("output_lower", 0.0)
    out_high: float = register("output_upper", 100.0)
    # alarms; a disabled group has limits that no value reaches
    low_low: float = register("pv_low_low", -UNBOUNDED, enabled="pv_alarm_enable")
    low: float = register("pv_low", -UNBOUNDED, enabled="pv_alarm_enable")
    high: float = register("pv_high", UNBOUNDED, enabled="pv_alarm_enable")
    high_high: float = register("pv_high_high", UNBOUNDED, enabled="pv_alarm_enable")
    deviation_high: float = register("deviation_high", UNBOUNDED, enabled="deviation_alarm_enable")
    deviation_high_high: float = register("deviation_high_high", UNBOUNDED, enabled="deviation_alarm_enable")
    rate_of_change: float = register("rate_of_change", UNBOUNDED, enabled="rate_alarm_enable")
    hysteresis: float = register("hysteresis", 0.0)
    # pulse width modulation
    pwm: int = 0
    """The output drives a discrete output."""
    pwm_period: int = 10_000_000
    """In ticks."""
    # autotune
    tune_closed: int = register("autotune_method", 0)
    tune_pi: int = register("autotune_type", 0)
    tune_hysteresis: float = register("autotune_hysteresis", 1.0)
    tune_buffer: int = -1
    """Offset in `aux` of `reaction_curve.POINTS` floats."""
    pv_low: float = register("pv_lower", 0.0)
    """PV lower and upper limit, the process's range for the whole range of the output."""
    pv_high: float = register("pv_upper", 100.0)


@dataclass(slots=True)
class State(RequestState):
    """One loop's registers and memory that the controller writes."""

    # registers
    sample_ms: int = register("sample_rate", 100)
    sp: float = register("setpoint", 0.0)
    raw: float = register("raw_pv", 0.0)
    pv: float = register("pv", 0.0)
    bias: float = register("bias", 0.0)
    out: float = register("output", 0.0)
    gain: float = register("proportional_gain", 1.0)
    reset: float = register("reset_time", 1.0)
    rate: float = register("derivative_gain", 0.0)
    error: int = 0
    """Row of the table of PID errors that is active, the lowest, from 1; 0: none."""
    number: float = 0.0
    """Its number, DSn+00."""
    busy: int = FIRST
    """What is pending, as bits; 0 in undisturbed operation."""
    # factors calculated from them
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
