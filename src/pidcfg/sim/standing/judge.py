"""All standing expectations of a run: which loops are judged by which, and what the scenario allows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from pidcfg.sim.problems import Problem
from pidcfg.sim.report import Standing, rounded
from pidcfg.sim.standing.errors import expected_errors, plc_error, set_up_error
from pidcfg.sim.standing.evidence import Evidence, Judgement, unjudged
from pidcfg.sim.standing.modes import not_in_mode
from pidcfg.sim.standing.saturation import error_stands, saturated
from pidcfg.sim.standing.signals import alarm_stands, oscillates, out_of_range, pv_not_driven

Judge = Callable[[Evidence, int], Judgement]

KINDS: dict[str, tuple[Judge, str]] = {
    "not-in-mode": (not_in_mode, "meant"),
    "set-up-error": (set_up_error, ""),
    "pv-not-driven": (pv_not_driven, "controlled"),
    "saturated": (saturated, "in control"),
    "error-stands": (error_stands, "in control"),
    "out-of-range": (out_of_range, "controlled"),
    "oscillates": (oscillates, "controlled"),
    "alarm-stands": (alarm_stands, "controlled"),
}
"""What judges a loop by each kind, and which loops."""


def standing(e: Evidence) -> list[Standing]:
    """The verdicts: of the PLC first, then of its loops, by kind."""
    expected = list(expected_errors(e))
    everywhere = next((why for i, why in expected if i < 0), "")
    found = unjudged(everywhere) if everywhere else plc_error(e)
    verdicts = [_verdict("set-up-error", "", found)]
    for i, name in enumerate(e.plc.loops):
        why = _left_to_others(e, i) or everywhere or next((text for j, text in expected if j == i), "")
        for kind, (judge, who) in KINDS.items():
            said = why or _kept(e, i, who)
            verdicts.append(_verdict(kind, name, unjudged(said) if said else judge(e, i)))
    return [_with_allowance(e, verdict) for verdict in verdicts]


def _left_to_others(e: Evidence, i: int) -> str:
    chosen = e.scenario.loops
    return "" if chosen is None or e.plc.loops[i] in chosen else "the scenario's loops leave it out"


def _kept(e: Evidence, i: int, who: str) -> str:
    """What keeps a loop from being judged, by the loops that a kind is for."""
    m = e.meters[i]
    controlled = bool(m.ever & m.control_bits)
    words = [name for name, word in e.plc.flags.items() if word and name not in e.plc.word_owners]
    if who == "meant" and not controlled and words:
        return f"{' and '.join(words)} keeps the loop task off"
    if who == "meant" and not controlled and not m.wanted and m.missed < 0:
        return "is meant for manual"
    if who in {"controlled", "in control"} and not controlled:
        return f"in {e.mode(i)} from start to end"
    if who == "in control" and not e.found(i):
        return "the PLC has been stopped" if not e.plc.in_run else f"ends in {e.mode(i)}"
    return ""


def _verdict(kind: str, loop: str, found: Judgement) -> Standing:
    at = None if found.at is None else rounded(found.at)
    return Standing(kind, loop, found.passed, found.judged, found.text, at)


def _with_allowance(e: Evidence, verdict: Standing) -> Standing:
    reasons = (a.reason for a in e.scenario.allow if (a.kind, a.loop) == (verdict.kind, verdict.loop))
    return verdict if verdict.passed else replace(verdict, allowed=next(reasons, None))


def unused_allowances(e: Evidence, verdicts: list[Standing]) -> Iterator[Problem]:
    """Warnings of entries of ``allow`` that allow nothing."""
    used = {(v.kind, v.loop) for v in verdicts if v.allowed is not None}
    for i, entry in enumerate(e.scenario.allow):
        if (entry.kind, entry.loop) not in used:
            message = f"{entry.loop} does not fail by {entry.kind}: there is nothing to allow"
            yield Problem(("allow", i), message, "idle_allowance", "warning", "remove the entry", loop=entry.loop)
