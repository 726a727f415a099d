"""Rules for the neutral form; codes beginning with GN, one module a topic."""

from pidcfg.validate.rules import collect, common
from pidcfg.validate.rules.generic import loops

RULES = collect(common, loops)
