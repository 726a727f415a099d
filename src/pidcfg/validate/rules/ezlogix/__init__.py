"""Rules for EZLogix configurations; the codes PID4xx, one module a topic."""

from pidcfg.validate.rules import collect, generic

RULES = collect(generic)
