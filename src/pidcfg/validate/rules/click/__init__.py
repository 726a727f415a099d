"""Rules for CLICK configurations; the codes PID3xx, one module a topic."""

from pidcfg.validate.rules import collect, generic

RULES = collect(generic)
