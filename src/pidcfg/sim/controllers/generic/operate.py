"""How a neutral loop is reported, and what ``set`` may write."""

from __future__ import annotations

from decimal import Decimal

from pidcfg.encoders.maps.generic import ROWS, TABLES
from pidcfg.schemas.base import limits_at, parse_off_seconds, parse_seconds
from pidcfg.schemas.generic import Loop
from pidcfg.schemas.numbers import refuse
from pidcfg.sim.controllers.generic import equation
from pidcfg.sim.controllers.generic import equation as bits
from pidcfg.sim.controllers.settings import NamedKeys, Parser, parameters_of, parse_plain

# --- What a neutral loop tells the outside: names of modes, alarms and flags as bits, and notices in words ------------

MODE_BITS = {"manual": bits.MANUAL, "auto": bits.AUTO, "cascade": bits.CASCADE}
SIGNALS = {
    "in_slot": "",
    "pv_slot": "PV",
    "sp_slot": "SP",
    "out_slot": "OUT",
    "bias_slot": "BIAS",
    "pulse_slot": "PULSE",
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

# --- What a scenario's ``set`` may write in a running neutral loop: its fields, by their keys in the file -------------
#
# Short forms: ``setpoint`` is setpoint.value, ``output`` the output in manual.

RANGE = "scales do not change in a running loop"
FIXED = {
    "pv.range": RANGE,
    "pv.range.0": RANGE,
    "pv.range.1": RANGE,
    "output.range": RANGE,
    "output.range.0": RANGE,
    "output.range.1": RANGE,
    "setpoint.source": "who the master is does not change in a running loop",
    "output.pulse.period": "it is the plant's wiring",
}
"""Fields that cannot be set, and why."""
OFF = ("tuning.integral_time", "tuning.derivative_time")
"""Times that may be `off`."""


def not_negative(path: str, parse: Parser) -> Parser:
    """A parser that also refuses what the schema's limits refuse; a sample time and a period are above 0."""

    def parsed(value: object) -> Decimal:
        number: Decimal = parse(value)  # type: ignore[assignment]
        if number < 0 or (path == "sample_time" and not number):
            refuse("set_value", f"{path} is {number}; it is {'above' if path == 'sample_time' else 'at least'} 0")
        return number

    return parsed


def parser_of(path: str) -> Parser | None:
    """How a field is written; None: as its type tells."""
    limits = None if path.rpartition(".")[2].isdigit() else limits_at(Loop, path)
    if limits is None:
        return None
    time = parse_off_seconds if path in OFF else parse_seconds
    return not_negative(path, time if limits.unit == "s" else parse_plain)


KEYS = NamedKeys(
    parameters_of(TABLES, (*FIXED, "mode")),
    {"setpoint": "setpoint.value", "output": "output.manual"},
    {"mode": "mode"},
    FIXED,
    {path: parser for path in ROWS if (parser := parser_of(path)) is not None},
)
