"""Rules for NextoPID configurations; codes beginning with NX, one module a topic."""

from pidcfg.validate.rules import collect_rules
from pidcfg.validate.rules.nextopid import blocks, cascade, limits, wires
from pidcfg.validate.rules.nextopid.context import NextopidContext

__all__ = ["RULES", "NextopidContext"]

RULES = collect_rules(wires, limits, blocks, cascade)
