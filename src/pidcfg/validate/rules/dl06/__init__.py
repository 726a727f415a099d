"""Rules for DL06 configurations; codes beginning with DL, one module a topic."""

from pidcfg.validate.rules import collect, common
from pidcfg.validate.rules.dl06 import (
    alarms,
    autotune,
    cascade,
    cascade_operation,
    equation,
    hysteresis,
    output,
    profile,
    pv_filter,
    ramp_soak,
    setpoint,
    setup,
    square_root,
    transfer,
    tuning,
)

RULES = collect(
    common,
    setup,
    tuning,
    equation,
    output,
    setpoint,
    square_root,
    pv_filter,
    alarms,
    hysteresis,
    cascade,
    cascade_operation,
    ramp_soak,
    profile,
    transfer,
    autotune,
)
