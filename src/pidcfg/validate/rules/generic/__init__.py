"""Rules for the neutral form; the codes PID8xx, one module a topic."""

from pidcfg.validate.rules import collect, common
from pidcfg.validate.rules.generic import alarms, cascade, pulses, scales, tuning

RULES = collect(common, scales, alarms, tuning, cascade, pulses)
