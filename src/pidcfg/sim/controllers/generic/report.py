"""What a neutral loop tells the outside: names of modes, alarms and flags as bits, and notices in words."""

from __future__ import annotations

from pidcfg.sim.controllers.generic import equation
from pidcfg.sim.controllers.generic import state as bits

MODES = {"manual": bits.MANUAL, "auto": bits.AUTO, "cascade": bits.CASCADE}
SIGNALS = {
    "sig_in": "",
    "sig_pv": "PV",
    "sig_sp": "SP",
    "sig_out": "OUT",
    "sig_bias": "BIAS",
    "sig_pulse": "PULSE",
}
"""Signals of a loop by their slots in `Config`; the measurement itself belongs to the plant."""
ALARM_BITS = {
    "high_high": bits.HIGH_HIGH,
    "low_low": bits.LOW_LOW,
    "high": bits.HIGH,
    "low": bits.LOW,
    "deviation_high_high": bits.DEVIATION_2,
    "deviation_high": bits.DEVIATION,
    "rate_of_change": bits.RATE,
}
ALARM_LIMITS = {
    "high_high": "high_high_at",
    "low_low": "low_low_at",
    "high": "high_at",
    "low": "low_at",
    "deviation_high_high": "deviation_2_at",
    "deviation_high": "deviation_at",
    "rate_of_change": "rate_at",
}
"""Where `Config` has the limit of each."""
OUTER_ALARMS = ("high_high", "low_low", "deviation_high_high")
FLAG_BITS = {
    "out_limited": bits.LIMITED,
    "rate_limited": bits.SLOWED,
    "tracking": bits.TRACKING,
    "in_deadband": bits.IN_DEAD_BAND,
}
NO_SOURCE = 32
ABOUT_MODE = (NO_SOURCE,)
"""Reasons that concern a requested mode."""
REASONS = {
    NO_SOURCE: "refused: the loop has no setpoint.source",
    equation.JUMPS: "OUT jumps: without an integral time nothing can carry it on",
}
