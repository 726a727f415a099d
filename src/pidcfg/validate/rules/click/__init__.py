"""Rules for CLICK configurations; codes beginning with CK, one module a topic."""

from pidcfg.validate.rules import collect, common
from pidcfg.validate.rules.click import (
    alarm_signals,
    alarms,
    autotune,
    blocks,
    derivative,
    error,
    names,
    operation,
    output,
    pv,
    setpoint,
    tuning,
)

RULES = collect(
    common,
    blocks,
    names,
    operation,
    setpoint,
    pv,
    tuning,
    derivative,
    error,
    output,
    alarms,
    alarm_signals,
    autotune,
)
