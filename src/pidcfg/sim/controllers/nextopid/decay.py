"""How far a first-order lag goes in one sample, 1 - e^(-Ts/T), with nothing but the four operations.

Time constants may be wired, so that this is worked out inside a run; the library functions of two engines need not
agree in the last bit, these operations do.
"""

from __future__ import annotations

ALL_THE_WAY = 50.0
"""From so many time constants on nothing is left."""
TERMS = 18


def share(x: float) -> float:
    """1 - e^(-x) for x >= 0 (kernel)."""
    if x >= ALL_THE_WAY:
        return 1.0
    halved = 0
    while x > 0.5:
        x *= 0.5
        halved += 1
    term = x
    total = x
    for n in range(2, TERMS):
        term *= -x / n
        total += term
    for _ in range(halved):
        total *= 2.0 - total
    return total
