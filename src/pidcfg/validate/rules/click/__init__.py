"""Rules for CLICK configurations; codes beginning with CK, one module a topic."""

from pidcfg.validate.rules import collect, common
from pidcfg.validate.rules.click import alarms, setup, signals, tuning
from pidcfg.validate.rules.click.setup import ClickContext

__all__ = ["RULES", "ClickContext"]

RULES = collect(common, setup, signals, tuning, alarms)
