"""Rules for EZLogix configurations; codes beginning with EZ, one module a topic."""

from pidcfg.validate.rules import collect, common
from pidcfg.validate.rules.ezlogix import (
    action,
    autotune,
    blocks,
    equation,
    names,
    output,
    pulses,
    pv,
    pv_tags,
    setpoint,
    tags,
)

RULES = collect(common, blocks, tags, pv_tags, names, action, equation, setpoint, pv, output, pulses, autotune)
