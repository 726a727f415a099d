"""When CPython runs a vendor's base steps in one piece (`pidcfg.sim.inlining.step`), and when kernel by kernel.

The results are the same to the bit, so that nothing but speed hangs on the choice; it goes by the base steps to run
and a constant a vendor, never by a clock. To write a piece takes as long as to run some thousand base steps, so one is
written for a run that is far longer, or when so much has run without one that others of the kind will follow.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pidcfg.sim.inlining.kernels import Kernel, NotInlinedError, source_of
from pidcfg.sim.inlining.step import Step, step_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from pidcfg.sim.kernel import Log, Loops, Meters, World

MOST_LOOPS = 4
"""More loops gain little: their variables are too many for short instructions."""
FEWEST_STEPS = 32
"""Base steps for which it pays to put fields into variables and back."""
LONG, OFTEN = 200_000, 500_000
"""µs a loop, in CPython: of a run for which pieces are written at once, and of runs before it that had none."""
EACH = 100_000
"""µs a loop of such a run for each piece that is written: events change what is in use."""
MOST_PIECES = 16
SMALL = 40
"""Expressions and statements of a kernel that is put in the place of its call wherever it stands."""


@dataclass(slots=True)
class Pieces:
    """`pidcfg.sim.kernel.advance` of a vendor, and the pieces written for it in this process."""

    plain: Callable[..., int]
    kernel: Kernel
    swap: Mapping[Kernel, Kernel]
    hot: frozenset[Kernel]
    """Kernels that are put in the place of their calls."""
    loop_step: int
    """µs that one loop-step takes in CPython."""
    steps: list[Step] = field(default_factory=list)
    """The one used last first."""
    without: int = 0
    """µs a loop that ran without a piece since one was written last."""
    allowed: int = 0
    """Pieces that are still written for this run."""

    def begin(self, steps: int) -> None:
        """A run of so many base steps begins."""
        work = steps * self.loop_step
        self.allowed = work // EACH if work >= LONG else 0

    def advance(
        self, k: int, last: int, zero: int, world: World, loops: Loops[Any, Any], meters: Meters, log: Log
    ) -> int:
        """The kernel's base steps ``k`` to ``last`` − 1."""
        arguments = k, last, zero, world, loops, meters, log
        step = self.step(last - k, arguments) if 0 < len(loops.cfg) <= MOST_LOOPS else None
        return self.plain(*arguments) if step is None else step.run(*arguments)

    def step(self, turns: int, arguments: tuple[Any, ...]) -> Step | None:
        """The piece for a call of so many base steps; None where the kernels run as they are."""
        if turns < FEWEST_STEPS:
            return None
        for i, step in enumerate(self.steps):
            if step.fits(*arguments):
                self.steps.insert(0, self.steps.pop(i))
                return step
        self.without += turns * self.loop_step
        if not self.allowed and self.without < OFTEN:
            return None
        self.allowed, self.without = max(0, self.allowed - 1), 0
        try:
            self.steps.insert(0, step_of(self.kernel, arguments, self.swap, self.in_place))
        except NotInlinedError:
            return None
        del self.steps[MOST_PIECES:]
        return self.steps[0]

    def in_place(self, kernel: Kernel) -> bool:
        """Whether a kernel is put in the place of its calls."""
        return kernel in self.hot or source_of(kernel).size <= SMALL
