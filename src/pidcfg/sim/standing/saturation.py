"""``saturated``: a loop does not end at a limit of its output with an error that does not get smaller."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.schemas.expressions import MAXIMUM, MINIMUM
from pidcfg.sim.expressions import evaluate
from pidcfg.sim.feedback import answer
from pidcfg.sim.influence import read_by
from pidcfg.sim.standing.evidence import SHARE, Evidence, Judgement, limits_reached, unjudged
from pidcfg.sim.standing.watch import SAMPLES

if TYPE_CHECKING:
    from pidcfg.sim.kernel import Channel
    from pidcfg.sim.plants import Plant

DEVIATION = 0.01
"""Of the span: an error that is too much, unless the inner deviation alarm is closer."""
PACE = 0.05
"""Of an error, that it has to lose in the window: slower, it would take twice the run again."""


def saturated(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by the window at the end of the run."""
    m = e.meters[i]
    error, limit = e.error(i), _limit(e, i)
    inner = e.plc.inner_deviation(i)
    allowed = min(DEVIATION * e.span(i), e.span(i) if inner is None else inner)
    if not limit or error <= allowed or m.error_then - error >= max(e.least(i), PACE * m.error_then):
        return Judgement(passed=True, text="does not stay at a limit of its output with an error")
    exempt = _exempt(e, i)
    if exempt:
        return unjudged(exempt)
    since = e.seconds(m.window)
    text = f"ends at {limit} with an error of {error:.4g}, no smaller than at {since:g} s"
    times = e.events_on(i, m.window)
    if times:
        return unjudged(f"{text}: an event at {times[0]:g} s")
    if (e.last - m.window) * e.step < SAMPLES * e.plc.cfg[i].period:
        return unjudged(f"{text}: the run has fewer than {SAMPLES} samples")
    return Judgement(passed=False, text=text, at=since)


def _limit(e: Evidence, i: int) -> str:
    """The limit that a loop's output ends at, its own or that of a slave; empty: none."""
    limit = limits_reached(e, i)
    if limit:
        return f"its {limit} output limit"
    for j in e.slaves(i):
        c = e.plc.cfg[j]
        if e.meters[j].control and limits_reached(e, j):
            return f"the {limits_reached(e, j)} output limit of {e.plc.loops[j]}"
        if e.meters[j].control and abs(e.sig[c.sig_sp] - e.sig[e.plc.cfg[i].sig_out]) > SHARE * e.span(j):
            return f"a set-point limit of {e.plc.loops[j]}"
    return ""


def _exempt(e: Evidence, i: int) -> str:
    """Why a loop may stay at a limit; empty: nothing says so."""
    if e.plc.left_out(i, e.sig) or _selected_away(e, i):
        return "a selector leaves its output out"
    if e.plc.windup_input(i, e.sig):
        slaves = [j for j in e.slaves(i) if e.meters[j].control]
        if not slaves or any(not saturated(e, j).passed for j in slaves):
            return "its windup input is on"
    for j, name in enumerate(e.plc.loops):
        if j != i and e.meters[j].control and not limits_reached(e, j):
            own, other = answer(e.net, e.plc, i), answer(e.net, e.plc, j, i)
            if own * other < 0 and other * answer(e.net, e.plc, j) > 0:
                return f"{name} has the PV, with the opposite effect"
    return ""


def _selected_away(e: Evidence, i: int) -> bool:
    """Whether every plant or connection that reads a loop's output takes the smaller or larger of it and another."""
    out = e.plc.cfg[i].sig_out
    wired: list[Plant | Channel] = [*e.net.plants, *e.net.channels]
    readers = [reader for reader in wired if out in read_by(e.net, reader)]
    return bool(readers) and all(_leaves_out(e, reader, out) for reader in readers)


def _leaves_out(e: Evidence, reader: Plant | Channel, out: int) -> bool:
    pool = e.net.pool
    code, constants, stack = pool.code, pool.constants, pool.stack()
    if reader.source >= 0 or not {MINIMUM, MAXIMUM} & set(code[reader.first : reader.last : 2]):
        return False
    values = set()
    for away in (-SHARE, 0.0, SHARE):
        sig = list(e.sig)
        sig[out] += away * (abs(sig[out]) + 1.0)
        values.add(evaluate(code, constants, reader.first, reader.last, sig, stack))
    return len(values) == 1
