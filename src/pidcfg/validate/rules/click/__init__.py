"""Rules for CLICK configurations; codes beginning with CK, one module a topic."""

from pidcfg.validate.rules import collect_rules
from pidcfg.validate.rules.click import alarms, setup, signals, tuning
from pidcfg.validate.rules.click.setup import ClickContext

__all__ = ["RULES", "ClickContext"]

RULES = collect_rules(setup, signals, tuning, alarms)
