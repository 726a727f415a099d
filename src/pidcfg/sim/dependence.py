"""Whether an expression's value follows one of its signals at all: ``0 * TIC.OUT`` does not."""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

TRIES = 40
"""Points at which two values of a signal are tried."""
DECADES = (-2.0, 3.0)


def depends(
    value: Callable[[Sequence[float]], float | None], sig: Sequence[float], signals: Collection[int], slot: int
) -> bool:
    """Whether ``value`` of the signals (None: it has none there) is another one at two values of ``slot``.

    All ``signals`` that it reads are drawn anew for each try, from 0, 1 and numbers of either sign.
    """
    random = Random(slot)

    def draw() -> float:
        number = 10 ** random.uniform(*DECADES)
        return random.choice((0.0, 1.0, number, number, number, -number))

    trial = list(sig)
    for _ in range(TRIES):
        for place in signals:
            trial[place] = draw()
        one = value(trial)
        trial[slot] = draw()
        other = value(trial)
        if one is not None and other is not None and one != other:
            return True
    return False
