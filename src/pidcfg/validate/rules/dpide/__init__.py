"""Rules for Delta AS configurations; codes beginning with DP, one module a topic."""

from pidcfg.validate.rules import collect, common
from pidcfg.validate.rules.dpide import (
    action,
    call,
    cycle,
    deadband,
    derivative,
    devices,
    names,
    operation,
    output,
    setpoint,
    tuning,
)

RULES = collect(common, devices, operation, action, tuning, derivative, cycle, output, setpoint, deadband, names, call)
