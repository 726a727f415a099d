"""Whether another loop's output is taken in the place of a loop's own: by a selector, by ``min`` or ``max``.

Design. What is taken instead has to follow another loop's output. The smaller or larger of an output and a constant, or
of an output and a signal from outside, is a limit of the output: a loop that stands at it is saturated. So is one whose
output a plant takes as it is, whatever the loop's own inputs say.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.schemas.expressions import ABSOLUTE, CONSTANT, MAXIMUM, MINIMUM, NEGATE, ROOT, SIGNAL
from pidcfg.sim.expressions import evaluate
from pidcfg.sim.influence import read_by
from pidcfg.sim.standing.evidence import SHARE, Evidence

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.sim.kernel import Channel
    from pidcfg.sim.plants import Plant

OPERANDS = {CONSTANT: 0, SIGNAL: 0, NEGATE: 1, ABSOLUTE: 1, ROOT: 1}
"""How many operands an operation takes; all others take two."""


def left_out(e: Evidence, i: int) -> bool:
    """Whether a loop acts on nothing now, since another loop's output is taken in its place."""
    cfg = e.plc.cfg[: len(e.plc.loops)]
    pvs = {c.sig_pv for c in cfg}
    out, others = cfg[i].sig_out, {c.sig_out for c in cfg} - {cfg[i].sig_out}
    own = e.influence.reach([out], without=pvs | others)
    rivals = e.influence.reach(others, without=pvs | {out})
    if any(out in read_by(e.net, plant) and not _leaves_out(e, plant, out, rivals) for plant in e.net.plants):
        return False
    return e.plc.left_out(i, e.sig, own, rivals) or _selected_away(e, i, rivals)


def _selected_away(e: Evidence, i: int, rivals: frozenset[int]) -> bool:
    """Whether every plant or connection that reads a loop's output takes the smaller or larger of it and a rival."""
    out = e.plc.cfg[i].sig_out
    wired: list[Plant | Channel] = [*e.net.plants, *e.net.channels]
    readers = [reader for reader in wired if out in read_by(e.net, reader)]
    return bool(readers) and all(_leaves_out(e, reader, out, rivals) for reader in readers)


def _leaves_out(e: Evidence, reader: Plant | Channel, out: int, rivals: frozenset[int]) -> bool:
    pool = e.net.pool
    if reader.source >= 0:
        return False
    values = set()
    for away in (-SHARE, 0.0, SHARE):
        sig = list(e.sig)
        sig[out] += away * (abs(sig[out]) + 1.0)
        values.add(evaluate(pool.code, pool.constants, reader.first, reader.last, sig, pool.stack()))
    return len(values) == 1 and any(
        out in lost and rivals & taken for taken, lost in _choices(e, reader.first, reader.last)
    )


def _choices(e: Evidence, first: int, last: int) -> Iterator[tuple[set[int], set[int]]]:
    """Of each ``min`` and ``max`` in an expression the signals of what it takes now, and of what it leaves out."""
    pool, parts = e.net.pool, list[int]()
    code = pool.code
    for at in range(first, last, 2):
        if code[at] in {MINIMUM, MAXIMUM}:
            (a, b), end = parts[-2:], at
            left, right = (evaluate(code, pool.constants, *part, e.sig, pool.stack()) for part in ((a, b), (b, end)))
            signals = [{code[k + 1] for k in range(*part, 2) if code[k] == SIGNAL} for part in ((a, b), (b, end))]
            takes_right = right < left if code[at] == MINIMUM else right > left
            yield (signals[1], signals[0]) if takes_right else (signals[0], signals[1])
        operands = OPERANDS.get(code[at], 2)
        if operands == 0:
            parts.append(at)
        elif operands == 2:
            parts.pop()
