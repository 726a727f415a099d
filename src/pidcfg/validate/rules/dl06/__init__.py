"""Rules for DL06 configurations; the codes PID2xx."""

from pidcfg.validate.rules import collect, generic

RULES = collect(generic)
