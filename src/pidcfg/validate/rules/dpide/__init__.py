"""Rules for Delta AS configurations; codes beginning with DP, one module a topic."""

from pidcfg.validate.rules import collect_rules
from pidcfg.validate.rules.dpide import operation, tuning
from pidcfg.validate.rules.dpide.tuning import DpideContext

__all__ = ["RULES", "DpideContext"]

RULES = collect_rules(operation, tuning)
