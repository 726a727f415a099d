"""Rules for DL06 configurations; codes beginning with DL, one module a topic."""

from pidcfg.validate.rules import collect_rules
from pidcfg.validate.rules.dl06 import alarms, setpoints, setup, signals, tuning
from pidcfg.validate.rules.dl06.alarms import Dl06Context

__all__ = ["RULES", "Dl06Context"]

RULES = collect_rules(setup, tuning, signals, alarms, setpoints)
