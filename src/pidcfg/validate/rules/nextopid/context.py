"""What the NextoPID rules look at: the program, and how its controllers hang together."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from pidcfg.frozen import frozen
from pidcfg.refs import Decision
from pidcfg.schemas.iec import Timed
from pidcfg.validate.rules.nextopid.links import Network
from pidcfg.validate.rules.nextopid.program import BlockView, Program

if TYPE_CHECKING:
    from pidcfg.paths import Path

D208 = Decision(
    208,
    "rules judge a signal by its first value",
    "A parameter that is wired to nothing but a signal is judged by the signal's first value, which the message names; "
    "one that is wired to a parameter with a value, by that. Expressions and outputs are not judged.",
    "The first value is what the program starts with; what comes later is not in the file.",
)


@frozen
class NextopidContext(Program):
    """A program with its cascades and overrides."""

    @cached_property
    def network(self) -> Network:
        """Its cascades and overrides."""
        return Network(self)

    @cached_property
    def explained(self) -> frozenset[Path]:
        """Places whose limits a rule of NextoPID's own explains better than the rules for every vendor."""
        gains = (
            (*view.placed.place, key)
            for view in self.pids
            for key in ("Ti_Ki", "Td_Kd")
            if self.has_time_as_gain(view, key)
        )
        names = (("loops", i, "name") for i, _ in enumerate(self.config.loops))  # capitals and small letters: NX604
        return frozenset((*gains, *names))

    def has_time_as_gain(self, view: BlockView, key: str) -> bool:
        """Whether a gain of the independent form is written with a unit of time."""
        return view.is_on("Indep") is True and isinstance(getattr(view.item, key), Timed)
