"""Rules for NextoPID configurations; codes beginning with NX, one module a topic."""

from pidcfg.validate.rules import collect, common
from pidcfg.validate.rules.nextopid import (
    autotune,
    blocks,
    cascade,
    cascade_ends,
    cascade_wires,
    combinations,
    conditions,
    forms,
    limits,
    override,
    plants,
    switching,
    times,
    wired,
    wires,
)

RULES = collect(
    common,
    wires,
    conditions,
    limits,
    wired,
    plants,
    times,
    forms,
    blocks,
    switching,
    autotune,
    cascade,
    cascade_wires,
    cascade_ends,
    override,
    combinations,
)
