"""Rules for NextoPID configurations; the codes PID6xx, one module a topic."""

from pidcfg.validate.rules import collect, generic

RULES = collect(generic)
