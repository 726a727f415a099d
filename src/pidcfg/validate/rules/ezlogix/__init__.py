"""Rules for EZLogix configurations; codes beginning with EZ, one module a topic."""

from pidcfg.validate.rules import collect_rules
from pidcfg.validate.rules.ezlogix import setup, signals, tuning
from pidcfg.validate.rules.ezlogix.setup import EzlogixContext

__all__ = ["RULES", "EzlogixContext"]

RULES = collect_rules(setup, signals, tuning)
