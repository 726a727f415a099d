"""Rules for CLICK configurations; codes beginning with CK, one module a topic."""

from pidcfg.validate.rules import collect, common, scales
from pidcfg.validate.rules.click import alarms, setup, signals, tuning

RULES = collect(common, scales, setup, signals, tuning, alarms)
