"""What the verdicts of the standing expectations are drawn from.

Design. `Evidence` holds what a run leaves behind: meters, final signals, the PLC as it stands, the wiring, and the
scenario. Each kind is a function of the evidence and a loop in a module of its own; `pidcfg.sim.standing.judge` calls
them, and knows what keeps a loop from being judged. Only the words of a verdict come from the journal.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.sim.loop_facts import IN_CONTROL
from pidcfg.sim.plc import TICKS
from pidcfg.sim.standing.looks import happenings

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.schemas.scenario import Event, Scenario
    from pidcfg.sim.influence import Influence
    from pidcfg.sim.meters import Meter
    from pidcfg.sim.network import Network
    from pidcfg.sim.plc import Plc
    from pidcfg.sim.standing.looks import Look, Pace

SHARE = 0.001
"""Of a span: what is less is no difference."""
COUNTS = 2
"""Counts of a PV: what is less is rounding."""


class Judgement(NamedTuple):
    """What one kind says of one loop; ``at`` in s."""

    passed: bool
    text: str
    at: float | None = None
    judged: bool = True
    tells: bool = True
    """A look at another time may tell more if this is false."""


def too_early(why: str) -> Judgement:
    """Nothing is known of the loop yet, and why."""
    return Judgement(passed=True, text=why, judged=False, tells=False)


class Found(NamedTuple):
    """What a look at a loop in control showed."""

    look: Look
    saturated: Judgement
    stands: Judgement


class Swings(NamedTuple):
    """An oscillation; times in base steps."""

    period: float
    amplitude: float
    """Half peak to peak, in PV units."""
    since: int
    """Its first turning point."""


def unjudged(why: str) -> Judgement:
    """Nothing is known of the loop, and why."""
    return Judgement(passed=True, text=why, judged=False)


@dataclass
class Evidence:
    """A run that is over."""

    scenario: Scenario
    plc: Plc
    net: Network
    influence: Influence
    meters: Sequence[Meter]
    step: int
    """Ticks of a base step."""
    last: int
    """The last base step."""
    reasons: Mapping[int, str] = field(default_factory=dict)
    """Why a loop changed or did not change its mode last, in words, by its number."""
    given: Mapping[int, float] = field(default_factory=dict)
    """The set points that the configuration gives, of loops that have none from another loop, by their number."""
    effects: list[float] = field(default_factory=list)
    """How far each loop's output can move its PV (an integrator: in 1 s), as at the start; 0: that is not known."""
    paces: list[Pace] = field(default_factory=list)
    """How fast the plants of each loop are."""
    looks: dict[int, list[Found]] = field(default_factory=dict)
    """What the looks at each loop have shown, by its number."""
    swings: dict[int, Swings] = field(default_factory=dict)
    """The first oscillation of each loop that no event stirs up and that reaches the last third, by its number."""

    @property
    def sig(self) -> Sequence[float]:
        """The signals as they end."""
        return self.net.sig

    def seconds(self, k: float) -> float:
        """A base step as a time."""
        return k * self.step / TICKS

    @cached_property
    def masters(self) -> Sequence[int]:
        """See `LoopFacts.masters`."""
        return self.plc.masters

    def family(self, loop: int) -> set[int]:
        """A loop and those up and down its cascade."""
        family = {loop}
        while True:
            links = {j for i in family for j in (self.masters[i], *self.slaves(i)) if j >= 0}
            if links <= family:
                return family
            family |= links

    def slaves(self, loop: int) -> Iterator[int]:
        """The loops that have their set point from a loop."""
        return (i for i, master in enumerate(self.masters) if master == loop)

    def errors(self, loop: int) -> tuple[float, float]:
        """SP − PV on average, in the two halves of the window that ends here."""
        m = self.meters[loop]
        early, late = m.middle - m.window, self.last + 1 - m.middle
        return m.early_error / max(early, 1), m.final_error / late

    def set_point_moves(self, loop: int) -> float:
        """By how much the set point is elsewhere in the second half of that window."""
        m = self.meters[loop]
        return abs(m.final_sp / (self.last + 1 - m.middle) - m.early_sp / max(m.middle - m.window, 1))

    def span(self, loop: int) -> float:
        """The span of a loop's PV."""
        low, high, _ = self.plc.scales[loop]
        return abs(high - low)

    def least(self, loop: int) -> float:
        """A difference of the PV that is more than rounding."""
        return max(COUNTS * self.span(loop) / self.plc.scales[loop][2], SHARE * self.span(loop))

    def found(self, loop: int) -> Sequence[Found]:
        """What the looks at a loop showed while it was in control; of the last ones only what can be judged."""
        found = self.looks.get(loop, [])
        final = found[-1] if found else None
        if final is not None and final.look.final and final.look.stage > final.look.start and len(found) > 1:
            return found[:-1]
        return found

    def events(self) -> Iterator[tuple[int, Event]]:
        """The events of the run, and ends of sensor faults, with their base steps."""
        return happenings(self.scenario, self.step, self.last)

    def events_on(self, loop: int, since: int) -> list[float]:
        """The times from base step ``since`` on at which an event moves a loop's PV or set point."""
        return sorted(
            self.seconds(k) for k, event in self.events() if k >= since and self.influence.concerns(event, loop)
        )

    def mode(self, loop: int) -> str:
        """The mode that a loop ends in."""
        return self.plc.mode(self.meters[loop].status)

    @staticmethod
    def is_control(mode: str) -> bool:
        """Whether a mode is one in which a loop controls."""
        return mode in IN_CONTROL


def limits_reached(e: Evidence, loop: int) -> str:
    """The limit that a loop's output ends at: ``lower``, ``upper``; empty: it is inside."""
    low, high = e.plc.output_limits(loop, e.sig)
    out, slack = e.sig[e.plc.cfg[loop].sig_out], SHARE / 2 * abs(high - low)
    return "upper" if out >= high - slack else "lower" if out <= low + slack else ""
