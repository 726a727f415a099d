"""What running and compiling a vendor's kernels takes; `pidcfg.sim.engine.choose` decides by it, and never by a clock.

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
    "dl06": Cost(7, 20),
    "click": Cost(8, 12),
    "ezlogix": Cost(6, 12),
    "nextopid": Cost(24, 20),
    "dpide": Cost(7, 12),
    "generic": Cost(3, 8),
}
