"""Rules for Delta AS configurations; codes beginning with DP, one module a topic."""

from pidcfg.validate.rules import collect, common
from pidcfg.validate.rules.dpide import operation, tuning

RULES = collect(common, operation, tuning)
