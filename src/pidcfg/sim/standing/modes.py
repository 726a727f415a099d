"""``not-in-mode``: a loop that is meant for Auto or Cascade reaches it, and ends in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.paths import dotted, leaves
from pidcfg.schemas.scenario_fields import Never
from pidcfg.sim.events import in_words
from pidcfg.sim.standing.evidence import Evidence, Judgement, unjudged

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.scenario import Event

SAMPLES = 10
"""Samples within which a loop answers to what takes its mode away."""


def not_in_mode(e: Evidence, i: int) -> Judgement:
    """Judges one loop; what it is meant for is known to its meter, since events change it."""
    m, name = e.meters[i], e.plc.loops[i]
    if m.missed >= 0:
        until = e.seconds(m.missed)
        return Judgement(passed=False, text=f"does not come into its mode until {until:g} s{_why(e, i)}", at=0.0)
    if not m.wanted:
        return Judgement(passed=True, text="reaches each mode that it is meant for")
    wanted, mode = e.plc.mode(m.wanted), e.mode(i)
    if any(x.loop == name and isinstance(x.mode, Never) and x.mode.mode == wanted for x in e.scenario.expect):
        return unjudged(f"{name} is expected never to be in {wanted}")
    if not m.seen & m.wanted:
        return Judgement(passed=False, text=f"is meant for {wanted} and stays in {mode}{_why(e, i)}", at=0.0)
    if m.status & m.wanted:
        return Judgement(passed=True, text=f"reaches {wanted} and ends in it")
    at = e.seconds(m.left)
    said = _said_by(e, i) or next(
        (f"an expectation names {mode}" for x in e.scenario.expect if x.loop == name and x.mode == mode), ""
    )
    if said:
        return unjudged(f"in {mode} from {at:g} s: {said}")
    return Judgement(passed=False, text=f"is meant for {wanted} and ends in {mode}, from {at:g} s{_why(e, i)}", at=at)


def _why(e: Evidence, i: int) -> str:
    reason = e.reasons.get(i)
    return f": {reason}" if reason else ""


def _said_by(e: Evidence, i: int) -> str:
    """The event after which a loop left its mode: on itself, its cascade, its mode inputs or the CPU."""
    m = e.meters[i]
    slack = -(-SAMPLES * max(e.plc.cfg[j].period for j in e.family(i)) // e.step)
    for k, event in reversed(list(e.events())):
        if m.left - slack <= k <= m.left and _acts_on_mode(e, event, i):
            where = f" on {event.loop}" if event.loop else ""
            return f"the event at {e.seconds(k):g} s{where}, {in_words(event)}"
    return ""


def _acts_on_mode(e: Evidence, event: Event, i: int) -> bool:
    """Whether an event may take a loop's mode away."""
    if event.plc is not None:
        return True
    family = e.family(i)
    if event.loop is None:
        return any(slot in e.plc.mode_inputs(j) for slot in e.influence.signals_set(event) for j in family)
    of_mode = (
        event.mode is not None or event.autotune is not None or any(key in e.plc.mode_keys for key in keys_set(event))
    )
    return of_mode and event.loop in e.plc.loops and e.plc.loops.index(event.loop) in family


def keys_set(event: Event) -> Iterator[str]:
    """The keys that an event sets."""
    return (dotted(keys) for keys, _, _ in leaves(event.set or {}))
