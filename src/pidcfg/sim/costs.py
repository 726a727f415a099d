"""What running and compiling a vendor's kernels takes; `pidcfg.sim.engine.choice` decides by it, and never by a clock.

Measured with the shipped examples and written by ``python tasks.py bench --write-costs``.
"""

from typing import NamedTuple


class Cost(NamedTuple):
    """Of one vendor's kernels."""

    loop_step: int
    """µs that CPython takes for one."""
    compiling: int
    """s that numba takes, beyond what loading them takes."""


COSTS = {
    "dl06": Cost(2, 8),
    "click": Cost(3, 5),
    "ezlogix": Cost(2, 5),
    "nextopid": Cost(9, 8),
    "dpide": Cost(4, 4),
    "generic": Cost(2, 3),
}
