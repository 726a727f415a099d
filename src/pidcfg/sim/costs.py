"""What running and compiling a vendor's kernels takes; `pidcfg.sim.engine.choice` decides by it, and never by a clock.

Measured with one noisy loop and written by ``python tasks.py bench --write-costs``.
"""

from typing import NamedTuple


class Cost(NamedTuple):
    """Of one vendor's kernels."""

    loop_step: int
    """µs that CPython takes for one."""
    compile_seconds: int
    """s that numba takes, beyond what loading them takes."""


COSTS = {
    "dl06": Cost(6, 13),
    "click": Cost(7, 8),
    "ezlogix": Cost(6, 7),
    "nextopid": Cost(10, 12),
    "dpide": Cost(7, 7),
    "generic": Cost(7, 5),
}
