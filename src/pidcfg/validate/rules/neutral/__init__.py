"""Rules for the neutral form; the codes PID8xx, one module a topic."""

from pidcfg.validate.rules import collect, generic

RULES = collect(generic)
