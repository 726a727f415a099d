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
from pidcfg.sim.plc import TICKS, steps_until

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.schemas.scenario import Event, Scenario
    from pidcfg.sim.influence import Influence
    from pidcfg.sim.meters import Meter
    from pidcfg.sim.network import Network
    from pidcfg.sim.plc import Plc

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
        """How far the PV is from its set point on average, in the two halves of the window at the end."""
        m = self.meters[loop]
        early, late = m.middle - m.window, self.last + 1 - m.middle
        return abs(m.early_error) / max(early, 1), abs(m.final_error) / late

    def span(self, loop: int) -> float:
        """The span of a loop's PV."""
        low, high, _ = self.plc.scales[loop]
        return abs(high - low)

    def least(self, loop: int) -> float:
        """A difference of the PV that is more than rounding."""
        return max(COUNTS * self.span(loop) / self.plc.scales[loop][2], SHARE * self.span(loop))

    def events(self) -> Iterator[tuple[int, Event]]:
        """The events of the run, and ends of sensor faults, with their base steps."""
        for event in self.scenario.events:
            ends = () if event.duration is None else (event.at + event.duration,)
            for time in (event.at, *ends):
                k = steps_until(time, self.step)
                if k <= self.last:
                    yield k, event

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
