"""Looks at the loops of a run while it runs: aims the meters, and judges when a window ends."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

from pidcfg.sim.feedback import effect
from pidcfg.sim.plc import TICKS
from pidcfg.sim.standing.evidence import Swings
from pidcfg.sim.standing.looks import Look, happenings, looks_at, plant_time
from pidcfg.sim.standing.saturation import look_at
from pidcfg.sim.standing.watch import aim
from pidcfg.sim.swings import calm, calm_oscillation

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from pidcfg.sim.standing.evidence import Evidence


@dataclass
class Lookout:
    """The looks of a run; ``evidence`` gathers what they show."""

    evidence: Evidence
    waiting: dict[int, list[Look]] = field(default_factory=dict)
    """The looks at each loop that are still to come."""
    stirred: dict[int, list[int]] = field(default_factory=dict)
    """When events move each loop in the last third of the run."""

    def __post_init__(self) -> None:
        e = self.evidence
        e.looks = {i: [] for i in range(len(e.plc.loops))}
        e.given = {i: e.plc.given_set_point(i, e.sig) for i in e.looks if e.masters[i] < 0}
        e.paces = [plant_time(e.plc, e.influence, i) for i in e.looks]
        e.effects = [effect(e.net, e.plc, i) for i in e.looks]
        for i in e.looks:
            self.waiting[i] = looks_at(e.scenario, e.plc, e.influence, i, e.step, e.last)
            self._aim(i)
            moved = {k for k, event in happenings(e.scenario, e.step, e.last) if e.influence.concerns(event, i)}
            e.meters[i].swung = max((k for k in moved if k <= e.meters[i].late), default=0)
            self.stirred[i] = sorted(k for k in moved if k > e.meters[i].late)

    def _aim(self, i: int) -> None:
        e = self.evidence
        aim(e.meters[i], self.waiting[i][0], e.paces[i].seconds * TICKS / e.step)

    def stops(self) -> Iterator[tuple[int, Callable[[int], None]]]:
        """Base steps before which a window has ended that is not the end of the run, and what is done there."""
        for i, looks in self.waiting.items():
            yield from ((look.end + 1, partial(self._look, i)) for look in looks[:-1])
            yield from ((k, partial(self._stir, i)) for k in self.stirred[i])

    def _stir(self, i: int, k: int) -> None:
        m = self.evidence.meters[i]
        found = calm_oscillation(m, k)
        if found is not None:
            self.evidence.swings.setdefault(i, Swings(*found, m.calm_first_turn))
        calm(m)

    def _look(self, i: int, _k: int) -> None:
        look = self.waiting[i].pop(0)
        self._judge(i, look)
        self._aim(i)

    def _judge(self, i: int, look: Look) -> None:
        found = look_at(replace(self.evidence, last=look.end), i, look)
        if found is not None:
            self.evidence.looks[i].append(found)

    def finish(self) -> None:
        """Looks at how the run ends."""
        for i, looks in self.waiting.items():
            self._judge(i, looks[0])
            self._stir(i, self.evidence.last)
