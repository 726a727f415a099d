"""Rules for the neutral form; the codes PID8xx, one module a topic."""

from pidcfg.validate.rules import collect, generic
from pidcfg.validate.rules.neutral import alarms, cascade, pulses, scales, tuning

RULES = collect(generic, scales, alarms, tuning, cascade, pulses)
