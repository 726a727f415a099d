"""``saturated`` and ``error-stands``: a loop does not end with an error that hardly gets smaller."""

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
OFFSET = 0.02
"""The same where an offset belongs to the loop: it has no integral, or a wide deadband."""
SWITCHED = 0.05
"""The same where the output is on or off."""
PACE = 0.02
"""Of an error, that it has to lose from one half of the window to the other: else it takes twice the run again."""
ARRIVAL = 0.1
"""The same inside the output's limits, where nothing keeps a loop from getting to its set point."""


def saturated(e: Evidence, i: int) -> Judgement:
    """Judges one loop whose output ends at a limit."""
    limit = _limit(e, i)
    if not limit or not lasts(e, i, PACE):
        return Judgement(passed=True, text="does not stay at a limit of its output with an error")
    return _exempt(e, i) or failed(e, i, f"ends at {limit} with an error of")


def error_stands(e: Evidence, i: int) -> Judgement:
    """Judges one loop whose output ends inside its limits."""
    if _limit(e, i) or not lasts(e, i, ARRIVAL):
        return Judgement(passed=True, text="its PV ends at its set point, or comes to it")
    if e.plc.left_out(i, e.sig) or _selected_away(e, i):
        return unjudged("a selector leaves its output out")
    if e.meters[i].broken:
        return unjudged("an event has broken its sensor")
    if e.plc.profile_step(e.meters[i].late_aux):
        return unjudged("a profile runs in the last third")
    return failed(e, i, "ends inside its output limits with an error of")


def lasts(e: Evidence, i: int, pace: float) -> bool:
    """Whether an error lasts to the end that is too much for the loop."""
    early, late = e.errors(i)
    return late > allowed_error(e, i) and early - late < max(e.least(i), pace * early)


def allowed_error(e: Evidence, i: int) -> float:
    """The error with which a loop may end."""
    inner, span = e.plc.inner_deviation(i), e.span(i)
    share = SWITCHED if e.plc.only_switches(i) else DEVIATION if e.plc.integrates(i, e.sig) else OFFSET
    allowed = share * span if inner is None else min(share * span, inner)
    return max(allowed, min(e.plc.dead_band(i, e.sig), OFFSET * span))


def failed(e: Evidence, i: int, what: str) -> Judgement:
    """An error that lasts, unless an event in the window moves the loop, or the run is too short to tell."""
    m = e.meters[i]
    since = e.seconds(m.window)
    early, late = e.errors(i)
    text = f"{what} {late:.4g}, which was {early:.4g} from {since:g} s on"
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


def _exempt(e: Evidence, i: int) -> Judgement | None:
    """Why a loop may stay at a limit; None: nothing says so."""
    if e.plc.left_out(i, e.sig) or _selected_away(e, i):
        return unjudged("a selector leaves its output out")
    if e.plc.windup_input(i, e.sig):
        slaves = [j for j in e.slaves(i) if e.meters[j].control]
        if not slaves or any(_limit(e, j) and lasts(e, j, PACE) for j in slaves):
            return unjudged("its windup input is on")
    for j, name in enumerate(e.plc.loops):
        if j != i and e.meters[j].control and not limits_reached(e, j):
            own, other = answer(e.net, e.plc, i), answer(e.net, e.plc, j, i)
            if own * other < 0 and other * answer(e.net, e.plc, j) > 0:
                return unjudged(f"{name} has the PV, with the opposite effect")
    return None


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
